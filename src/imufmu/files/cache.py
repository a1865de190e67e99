"""Files that are built once and kept: the first process builds, others that want the same wait for it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from filelock import FileLock

from .atomic import WriteError


def cached(path: Path, build: Callable[[], object]) -> Path:
    """``path``, made by ``build()`` where it is not there yet. Raises WriteError if its folder cannot be written."""
    if path.is_file():
        return path
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        lock = FileLock(path.with_name(f"{path.name}.lock")).acquire()
    except OSError as error:
        raise WriteError(f"{path}: cannot write: {error.strerror or error}") from error
    with lock:
        if not path.is_file():
            build()
    return path
