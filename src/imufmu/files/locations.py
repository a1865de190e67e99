"""Where the files that are no Python modules lie: system descriptions and FMU scripts.

An installed imufmu carries them inside the package; an editable installation uses those of the repository.
"""

from __future__ import annotations

from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[1]


def models_folder() -> Path:
    """Folder of the system descriptions and parameter sets. Raises FileNotFoundError if there is none."""
    return _folder("models")


def fmu_src_folder() -> Path:
    """Folder of the FMU scripts and of the C wrapper. Raises FileNotFoundError if there is none."""
    return _folder("fmu_src")


def _folder(name: str) -> Path:
    candidates = (PACKAGE / name, PACKAGE.parents[1] / name)
    for candidate in candidates:
        if candidate.is_dir():
            return candidate
    looked = " or ".join(map(str, candidates))
    raise FileNotFoundError(f"the folder {name!r} of imufmu is missing: looked for {looked}; install imufmu again")
