"""The part of imufmu that travels inside a Python FMU, and how two copies of it are compared.

All Python FMUs in a process share one imported imufmu: the first one loaded. An FMU therefore carries every block, and
refuses to start on a package in memory whose source differs from its own.
"""

from __future__ import annotations

import hashlib
import shutil
import sys
from pathlib import Path

PACKAGE = Path(__file__).parents[1]

_MODULES = ("__init__", "fmi/__init__", "fmi/slave", "fmi/component", "fmi/runtime", "fmi/saved_state", "fmi/wrapper")
_FOLDERS = ("blocks", "estimators", "plants", "sensors")
_AT_HOME = ("blocks/drawing",)  # an FMU draws nothing, and its host need not have what draws


def files(package: Path) -> list[Path]:
    """The runtime's source files below a copy of the package, as relative paths."""
    fixed = [Path(f"{module}.py") for module in _MODULES]
    blocks = [path.relative_to(package) for folder in _FOLDERS for path in (package / folder).rglob("*.py")]
    return sorted({*fixed, *blocks} - {Path(f"{module}.py") for module in _AT_HOME})


def copy_to(folder: Path) -> None:
    """Copy the runtime of the package in memory to folder/imufmu."""
    for path in files(PACKAGE):
        target = folder / "imufmu" / path
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(PACKAGE / path, target)


def fingerprint(package: Path) -> str:
    """Hash of the runtime's source in a copy of the package, the same for any line ends."""
    digest = hashlib.sha256()
    for path in files(package):
        digest.update(f"{path.as_posix()}\n".encode())
        digest.update((package / path).read_text(encoding="utf-8").encode())
    return digest.hexdigest()


# Now, because a package that was loaded from an unpacked FMU is deleted together with it, and goes on serving others.
IN_MEMORY = fingerprint(PACKAGE)


def rejoin_installed() -> None:
    """Where an FMU brought its part of imufmu into the process first, add the rest of an installed one of equal source.

    Otherwise a script that has run one of our FMUs could not import imufmu.cosim any more.
    """
    if (PACKAGE / "cosim").is_dir():
        return
    for entry in sys.path:
        installed = Path(entry) / "imufmu"
        if (installed / "cosim").is_dir() and fingerprint(installed) == IN_MEMORY:
            _find_also_in(installed)
            return


def go_on_with(copy: Path) -> None:
    """Where the package in memory has lost its folder, find what is not loaded yet in this copy of equal source.

    Otherwise an FMU of another block could not start once the host has deleted what it unpacked of the first.
    """
    if not PACKAGE.is_dir():
        _find_also_in(copy)


def _find_also_in(copy: Path) -> None:
    """Add the folders of a copy to those where the packages in memory look for modules; drop what is gone."""
    for name, module in list(sys.modules.items()):
        path = getattr(module, "__path__", None)
        if name.split(".")[0] == "imufmu" and path is not None:
            folder = str(copy.joinpath(*name.split(".")[1:]))
            path[:] = [*(entry for entry in path if entry != folder and Path(entry).is_dir()), folder]


def refusal(resources: Path) -> str:
    """Why the package in memory cannot serve the FMU with these resources; empty if it can."""
    own = resources / "imufmu"
    if not own.is_dir():
        return f"{resources} holds no copy of imufmu: the FMU is incomplete, build it again"
    if fingerprint(own) == IN_MEMORY:
        return ""
    return (
        f"this FMU was built from another version of imufmu than the one already in memory ({PACKAGE}). "
        "Python FMUs in one process share the first imufmu that was loaded: build the FMUs from the same version, "
        "or run them in separate processes"
    )
