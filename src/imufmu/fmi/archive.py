"""Open .fmu files: what is checked before anything in one is used."""

from __future__ import annotations

from pathlib import Path, PurePosixPath
from typing import Any

import fmpy
from fmpy.model_description import ValidationError

from ..files.archives import ArchiveError, listed, parse_xml, read_members, reason, unpack


def fmu_members(path: Path) -> tuple[set[str], Any]:
    """Names of the members of an FMU of any version and kind, and the root element (lxml) of its model description.

    Raises ArchiveError.
    """
    name = "modelDescription.xml"
    names, content = read_members(path, lambda member: member == name)
    if name not in names:
        raise ArchiveError(f"{path}: {name} is missing: this is no FMU")
    root = parse_xml(content[name], f"{path}: {name}")
    if root.tag != "fmiModelDescription" or root.get("fmiVersion") is None:
        raise ArchiveError(f"{path}: {name}: no FMI model description: the root element is {root.tag}")
    return names, root


def read_fmu(path: Path) -> Any:
    """Checked ModelDescription (fmpy) of an FMU that this machine can run.

    Raises ArchiveError unless it is FMI 2.0 for co-simulation with a binary for this platform.
    """
    where = f"{path}: modelDescription.xml"
    names, root = fmu_members(path)
    version = root.get("fmiVersion")
    if version != "2.0":
        raise ArchiveError(f"{path}: FMI {version}; expected FMI 2.0 for co-simulation. Export it as that")
    if root.find("CoSimulation") is None:
        raise ArchiveError(f"{path}: for model exchange only; expected FMI 2.0 for co-simulation. Export it as that")
    try:
        description = fmpy.read_model_description(str(path))
    except ValidationError as error:
        raise ArchiveError(f"{where}: {listed(error.problems)}") from error
    except Exception as error:  # fmpy raises plain exceptions, and its parsing any ValueError or KeyError
        raise ArchiveError(f"{where}: {reason(error)}") from error
    identifier = description.coSimulation.modelIdentifier
    if not any(candidate in names for candidate in _library_names(identifier)):
        raise ArchiveError(f"{path}: {_why_no_library(identifier, names)}")
    return description


def open_fmu(path: Path, folder: Path) -> tuple[Path, Any]:
    """Check an FMU as read_fmu does and unpack it into an existing folder.

    Returns its shared library for this platform and its ModelDescription (fmpy).
    """
    description = read_fmu(path)
    unpack(path, folder)
    candidates = (folder / name for name in _library_names(description.coSimulation.modelIdentifier))
    return next(library for library in candidates if library.is_file()), description


def _library_names(identifier: str) -> list[str]:
    """Members that can hold the binary for this platform; the newer folder name tells the processor and goes first."""
    folders = (fmpy.platform_tuple, fmpy.platform)
    return [f"binaries/{folder}/{identifier}{fmpy.sharedLibraryExtension}" for folder in folders]


def _why_no_library(identifier: str, names: set[str]) -> str:
    binaries = [PurePosixPath(name) for name in names if name.startswith("binaries/") and not name.endswith("/")]
    here = sorted(b.name for b in binaries if b.parts[1] in (fmpy.platform, fmpy.platform_tuple))
    if here:
        return (
            f"no binary belongs to modelIdentifier {identifier!r}: expected "
            f"{identifier}{fmpy.sharedLibraryExtension}, there is {', '.join(here)}"
        )
    inside = sorted({b.parts[1] for b in binaries if len(b.parts) > 2})
    return (
        f"no binary for this platform ({fmpy.platform}); it holds {', '.join(inside) or 'none'}. "
        "Build the FMU for this platform"
    )
