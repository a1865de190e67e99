"""Folders for the time of a run: in plain letters, and swept by the next run where a run was killed.

A folder belongs to whoever holds the lock on the file beside it, which has its name and ``.lock``. The system takes the
lock off a process that dies, however it dies; what lies beside an open lock is left over.
"""

from __future__ import annotations

import os
import re
import secrets
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from filelock import FileLock, Timeout

_PLAIN = re.compile(r"[A-Za-z0-9_.\-~ /\\:]*")  # FMUs get a folder as a URI, and some decode no more than spaces
_OTHERS = {"nt": ("C:/Windows/Temp",)}.get(os.name, ("/tmp", "/var/tmp"))
_PREFIX = "imufmu_"


class ScratchError(OSError):
    """There is no folder for temporary files that FMUs understand."""


@contextmanager
def scratch_folder(purpose: str) -> Iterator[Path]:
    """A new, empty folder imufmu_<purpose>_..., deleted at the end of the block. Raises ScratchError."""
    folder, delete = new_scratch(purpose)
    try:
        yield folder
    finally:
        delete()


def new_scratch(purpose: str) -> tuple[Path, Callable[[], None]]:
    """A new, empty folder, and the function that deletes it. Raises ScratchError."""
    base = _plain_base()
    _sweep(base)
    folder = base / f"{_PREFIX}{purpose}_{secrets.token_hex(6)}"
    lock = FileLock(f"{folder}.lock", thread_local=False)  # whoever deletes the folder may be another thread
    try:
        with suppress(NotImplementedError):  # a file system without locks: such a folder is never swept
            lock.acquire()
        folder.mkdir(mode=0o700)
    except OSError as error:
        raise ScratchError(f"{folder}: cannot be made: {error.strerror or error}") from error

    def delete() -> None:
        shutil.rmtree(folder, ignore_errors=True)
        _drop(lock)

    return folder, delete


def _plain_base() -> Path:
    """The user's folder for temporary files, or where its name is not plain, the system's."""
    given = Path(tempfile.gettempdir()).resolve()
    for base in (given, *map(Path, _OTHERS)):
        if _PLAIN.fullmatch(str(base)) and os.access(base, os.W_OK | os.X_OK):
            return base
    raise ScratchError(
        f"no folder for unpacked FMUs: they do not understand the path {given}, and {' and '.join(_OTHERS)} "
        "cannot be written; let TMPDIR name a folder in plain letters"
    )


def _sweep(base: Path) -> None:
    """Delete the folders of processes that were killed; those of living ones are locked."""
    for path in base.glob(f"{_PREFIX}*.lock"):
        with suppress(OSError, Timeout, NotImplementedError):
            if hasattr(os, "getuid") and path.lstat().st_uid != os.getuid():
                continue
            lock = FileLock(path, blocking=False)
            lock.acquire()
            shutil.rmtree(path.with_suffix(""), ignore_errors=True)
            _drop(lock)


def _drop(lock: FileLock) -> None:
    lock.release()
    with suppress(OSError):
        Path(lock.lock_file).unlink(missing_ok=True)
