"""Write files whole or not at all."""

from __future__ import annotations

import errno
import os
import secrets
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path


class WriteError(OSError):
    """A file cannot be written; the message names it and the reason."""


@contextmanager
def atomic_write(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Give an empty file beside ``path`` to write to; it takes the place of ``path`` when the block ends well.

    After an exception or Ctrl-C ``path`` is as it was and the temporary file is gone. The temporary name keeps the
    suffix, which some writers go by. Raises WriteError if the folder is missing or closed to us, if ``path`` is
    something other than a file, and in place of an OSError of the block that names no other file, as of a full disk.
    """
    try:
        target = Path(path).resolve()  # a symbolic link stays one: its target is replaced
        if target.exists() and not target.is_file():
            raise OSError(errno.EINVAL, "not a regular file")
        if not target.parent.is_dir():
            raise OSError(errno.ENOENT, f"no folder {target.parent}")
        temporary = target.with_name(f".{target.stem}.{secrets.token_hex(4)}{target.suffix}")
        temporary.touch(exist_ok=False)
    except OSError as error:
        raise WriteError(f"{path}: cannot write: {error.strerror}") from None
    try:
        yield temporary
        os.replace(temporary, target)
    except OSError as error:
        if isinstance(error, WriteError) or error.filename not in (None, temporary, str(temporary)):
            raise
        raise WriteError(f"{path}: cannot write: {error.strerror or error}") from error
    finally:
        temporary.unlink(missing_ok=True)


def check_not_read(path: str | os.PathLike[str], inputs: Iterable[str | os.PathLike[str]]) -> None:
    """Raises WriteError if ``path`` is one of these files, by whatever name: an output never overwrites an input."""
    for source in inputs:
        if os.path.exists(path) and os.path.exists(source) and os.path.samefile(path, source):
            raise WriteError(f"{path}: cannot write: it is read here; choose another name")
