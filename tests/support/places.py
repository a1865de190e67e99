"""Where the repository lies, and what a test run builds once for all its workers."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from filelock import FileLock

ROOT = Path(__file__).parents[2]
SHARED = "IMUFMU_TESTS_SHARED"  # environment variable with the folder of this run; conftest.py sets it


def built_once(name: str, build: Callable[[Path], object]) -> Path:
    """A file or folder of this run, built by ``build(path)`` in the first process that asks for it."""
    path = Path(os.environ[SHARED]) / name
    done = path.with_name(f"{path.name}.done")
    with FileLock(f"{path}.lock"):
        if not done.exists():
            build(path)
            done.touch()
    return path
