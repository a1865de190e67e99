"""Open .fmu files: what is checked before anything in one is used."""

from __future__ import annotations

import io
import zipfile
from contextlib import suppress
from pathlib import Path, PurePosixPath
from typing import Any

import fmpy
from fmpy.model_description import ValidationError

from ..files.archives import ArchiveError, listed, parse_xml, read_members, reason, unpack
from .scalars import as_scalars


def fmu_members(path: Path, faults: list[str] | None = None) -> tuple[set[str], Any]:
    """Names of the members of an FMU of any version and kind, and the root element (lxml) of its model description.

    faults: gets what is odd in the archive. Raises ArchiveError.
    """
    name = "modelDescription.xml"
    names, content = read_members(path, lambda member: member == name, faults)
    if name not in names:
        raise ArchiveError(f"{path}: {name} is missing: this is no FMU")
    root = parse_xml(content[name], f"{path}: {name}")
    if root.tag != "fmiModelDescription" or root.get("fmiVersion") is None:
        raise ArchiveError(f"{path}: {name}: no FMI model description: the root element is {root.tag}")
    return names, root


def read_fmu(path: Path, faults: list[str] | None = None) -> Any:
    """Checked ModelDescription (fmpy) of an FMU that this machine can run, its variables scalars as in FMI 2.0.

    faults: gets what breaks the standard without hindering a run; None: that is an error, too. Raises ArchiveError
    unless it is FMI 2.0 or 3.0, for co-simulation or model exchange, with a binary for this platform.
    """
    names, model = read_model(path, faults)
    if interface_of(model) is None:
        kind = "scheduled execution only" if model.scheduledExecution else "no kind of simulation"
        raise ArchiveError(f"{path}: for {kind}; expected co-simulation or model exchange. Export it for one of these")
    if not names & set(_library_names(model)):
        raise ArchiveError(f"{path}: {_why_no_library(model, names)}")
    if model.fmiMajorVersion == 3:
        model.modelVariables = as_scalars(model.modelVariables)
    return model


def read_model(path: Path, faults: list[str] | None = None) -> tuple[set[str], Any]:
    """Names of the members of an FMU 2.0 or 3.0 of any kind and platform, and its checked ModelDescription (fmpy).

    faults: as for read_fmu. Raises ArchiveError.
    """
    where = f"{path}: modelDescription.xml"
    odd: list[str] = []
    names, root = fmu_members(path, odd)
    if faults is not None:
        faults += [f"{path}: {fault}" for fault in odd]
    version = root.get("fmiVersion")
    if version != "2.0" and not version.startswith("3.0"):
        raise ArchiveError(f"{path}: FMI {version}; expected FMI 2.0 or 3.0. Export it as one of these")
    return names, _described(path, where, faults)


def interface_of(model: Any) -> Any:
    """What is used of what a ModelDescription (fmpy) offers: co-simulation, or model exchange, or None of both."""
    return model.coSimulation or model.modelExchange


def _described(path: Path, where: str, faults: list[str] | None) -> Any:
    """ModelDescription (fmpy), also of an XML with faults, if those are asked for and it can be read."""
    problems: list[str]
    try:
        return fmpy.read_model_description(_for_fmpy(path))
    except ValidationError as error:
        problems = error.problems
    except Exception as error:  # fmpy raises plain exceptions, and its parsing any ValueError or KeyError
        problems = [reason(error)]
    if faults is not None:
        with suppress(Exception):
            description = fmpy.read_model_description(_for_fmpy(path), validate=False)
            faults.append(f"{where}: {listed(problems)}")
            return description
    raise ArchiveError(f"{where}: {listed(problems)}")


def _for_fmpy(path: Path) -> Any:
    """The FMU, or where its members have names that FMPy does not look for, an archive of what it reads."""
    name = "modelDescription.xml"
    with zipfile.ZipFile(path) as archive:
        if name in archive.namelist():
            return str(path)
    _, members = read_members(path, lambda member: member in (name, "sources/buildDescription.xml"))
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as archive:
        for member, text in members.items():
            archive.writestr(member, text)
    return content


def open_fmu(path: Path, folder: Path, model: Any = None) -> tuple[Path, Any]:
    """Check an FMU as read_fmu does, mildly, and unpack it into an existing folder.

    model: what read_fmu gave, where it was asked already. Returns its shared library for this platform and its
    ModelDescription (fmpy).
    """
    description = read_fmu(path, []) if model is None else model
    unpack(path, folder)
    return next(library for name in _library_names(description) if (library := folder / name).is_file()), description


def kinds_of(model: Any) -> str:
    """The kinds of simulation that a ModelDescription (fmpy) offers, for people."""
    kinds = {
        "co-simulation": model.coSimulation,
        "model exchange": model.modelExchange,
        "scheduled execution": model.scheduledExecution,
    }
    return " and ".join(name for name, part in kinds.items() if part) or "no kind of simulation"


def _library_names(model: Any) -> list[str]:
    """Members that can hold the binary for this platform; the newer folder name tells the processor and goes first."""
    folders = (fmpy.platform_tuple, fmpy.platform) if model.fmiMajorVersion == 2 else (fmpy.platform_tuple,)
    return [
        f"binaries/{folder}/{interface_of(model).modelIdentifier}{fmpy.sharedLibraryExtension}" for folder in folders
    ]


def _why_no_library(model: Any, names: set[str]) -> str:
    identifier, folder = interface_of(model).modelIdentifier, fmpy.platform
    if model.fmiMajorVersion == 3:
        folder = fmpy.platform_tuple
    binaries = [PurePosixPath(name) for name in names if name.startswith("binaries/") and not name.endswith("/")]
    here = sorted(b.name for b in binaries if b.parts[1] in (folder, fmpy.platform_tuple))
    if here:
        return (
            f"no binary belongs to modelIdentifier {identifier!r}: expected "
            f"{identifier}{fmpy.sharedLibraryExtension}, there is {', '.join(here)}"
        )
    inside = sorted({b.parts[1] for b in binaries if len(b.parts) > 2})
    return (
        f"no binary for this platform ({folder}); it holds {', '.join(inside) or 'none'}. "
        "Build the FMU for this platform"
    )
