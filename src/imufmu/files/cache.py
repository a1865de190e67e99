"""Files that are built once and kept: the first process builds, others that want the same wait for it.

Beside each lies its digest. A file that does not have it, as after a crash, a full disk or the hand of another program,
is built again.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path

from filelock import FileLock

from .atomic import WriteError, atomic_write


def cached(path: Path, build: Callable[[], object]) -> Path:
    """``path``, made by ``build()`` where it is not there yet or is not what was built.

    Raises WriteError if its folder cannot be written.
    """
    if is_whole(path):
        return path
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        lock = FileLock(path.with_name(f"{path.name}.lock")).acquire()
    except OSError as error:
        raise WriteError(f"{path}: cannot write: {error.strerror or error}") from error
    with lock:
        if not is_whole(path):
            build()
            with atomic_write(_digest_file(path)) as temporary:
                temporary.write_text(_digest(path))
    return path


def is_whole(path: Path) -> bool:
    """Whether the file is there and is what was built."""
    try:
        return _digest_file(path).read_text(errors="replace") == _digest(path)
    except OSError:
        return False


def _digest_file(path: Path) -> Path:
    return path.with_name(f"{path.name}.sha256")


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
