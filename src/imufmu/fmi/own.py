"""Which FMUs are ours: those that this imufmu has built here, to the last byte. What a file says proves nothing."""

from __future__ import annotations

import filecmp
from contextlib import suppress
from pathlib import Path

from ..compiled.compilers import BuildError
from ..registry import BLOCKS
from .build import cache_folder
from .native import native_cache_folder


def is_ours(fmu: Path) -> bool:
    """Whether the file equals the FMU of its name in the user's cache that was built from the source as it is."""
    if not any(fmu.stem.startswith(name) for name in BLOCKS):  # blocks in series are named after the first
        return False
    folders = [cache_folder(fmu.stem)]
    with suppress(BuildError):
        folders.append(native_cache_folder())
    with suppress(OSError):
        return any(kept.is_file() and filecmp.cmp(kept, fmu, shallow=False) for kept in (f / fmu.name for f in folders))
    return False
