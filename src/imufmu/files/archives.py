"""Open .fmu and .ssp archives, and the XML in them, without trusting them.

Everything is checked before anything is written or expanded. What is wrong is said in one ArchiveError that names the
file and the member.
"""

from __future__ import annotations

import stat
import struct
import xml.parsers.expat
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import Any

import fmpy
from fmpy.model_description import ValidationError
from lxml import etree

MOST_MEMBERS = 20_000
LARGEST_UNPACKED = 2 * 2**30  # bytes
LARGEST_RATIO = 100  # unpacked : packed, of archives that unpack to more than UNSUSPICIOUS
UNSUSPICIOUS = 64 * 2**20  # bytes

# What zipfile lets through from damaged archives.
_UNREADABLE = (zipfile.BadZipFile, zlib.error, struct.error, EOFError, RuntimeError, OSError, ValueError)


class ArchiveError(ValueError):
    """An archive or an XML file cannot be used; the message names file, member and reason."""


def unpack(path: Path, folder: Path) -> None:
    """Unpack an archive into an existing folder, which is the caller's to delete. Raises ArchiveError."""
    with _opened(path) as archive:
        for member in archive.infolist():
            try:
                archive.extract(member, folder)
            except _UNREADABLE as error:
                raise ArchiveError(f"{path}: {member.filename} cannot be unpacked: {error}") from error


def check_xml(content: bytes, where: str) -> None:
    """Refuse XML that is malformed or has a document type (the door to entity bombs and external entities)."""

    def refuse(*_declaration: Any) -> None:
        raise ArchiveError(f"{where}, line {parser.CurrentLineNumber}: a DOCTYPE is not allowed; remove it")

    parser = xml.parsers.expat.ParserCreate()
    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(content, True)
    except xml.parsers.expat.ExpatError as error:
        reason = xml.parsers.expat.ErrorString(error.code)
        raise ArchiveError(f"{where}, line {error.lineno}: not well-formed XML: {reason}") from error


def parse_xml(content: bytes, where: str) -> Any:
    """Root element (lxml) of checked XML. Raises ArchiveError."""
    check_xml(content, where)
    try:
        return etree.fromstring(content, etree.XMLParser(resolve_entities=False, no_network=True))
    except etree.XMLSyntaxError as error:
        raise ArchiveError(f"{where}, line {error.lineno}: {error.msg}") from error


def read_members(path: Path, wanted: Callable[[str], bool]) -> tuple[set[str], dict[str, bytes]]:
    """Names of all members of an archive, and the content of the wanted ones. Raises ArchiveError."""
    with _opened(path) as archive:
        names = set(archive.namelist())
        return names, {name: _read(archive, name, path) for name in sorted(names) if wanted(name)}


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
        raise ArchiveError(f"{where}: " + "; ".join(error.problems)) from error
    except Exception as error:  # fmpy raises plain exceptions, and its parsing any ValueError or KeyError
        raise ArchiveError(f"{where}: {error}") from error
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


@contextmanager
def _opened(path: Path) -> Iterator[zipfile.ZipFile]:
    """The archive, once every member's name, kind and size is found harmless."""
    try:
        archive = zipfile.ZipFile(path)
    except FileNotFoundError as error:
        raise ArchiveError(f"{path}: there is no such file") from error
    except OSError as error:
        raise ArchiveError(f"{path}: cannot be read: {error.strerror or error}") from error
    except _UNREADABLE as error:
        raise ArchiveError(f"{path}: not a zip archive, or cut off: {error}") from error
    with archive:
        members = archive.infolist()
        if len(members) > MOST_MEMBERS:
            raise ArchiveError(f"{path}: {len(members)} members; at most {MOST_MEMBERS} are accepted")
        seen: set[str] = set()
        for member in members:
            reason = _why_harmful(member)
            if member.filename in seen:
                reason = "the name occurs twice"
            if reason:
                raise ArchiveError(f"{path}: member {member.orig_filename!r} refused: {reason}")
            seen.add(member.filename)
        unpacked = sum(member.file_size for member in members)
        limit = min(LARGEST_UNPACKED, max(UNSUSPICIOUS, LARGEST_RATIO * path.stat().st_size))
        if unpacked > limit:
            raise ArchiveError(f"{path}: unpacks to {unpacked:,} bytes; at most {limit:,} are accepted for its size")
        yield archive


def _why_harmful(member: zipfile.ZipInfo) -> str:
    """Why a member must not be unpacked; empty if it may."""
    name = member.orig_filename  # as stored; filename is cut at a zero byte
    if "\\" in name:
        return "a backslash in the name"
    if name.startswith("/") or ":" in name:
        return "an absolute path"
    if ".." in name.split("/"):
        return "the path leaves the archive"
    if not name.isprintable() or not name:
        return "a name that cannot be printed"
    kind = stat.S_IFMT(member.external_attr >> 16)
    if kind not in (0, stat.S_IFREG, stat.S_IFDIR):
        return "a link or special file"
    if member.flag_bits & 1:
        return "encrypted"
    return ""


def _read(archive: zipfile.ZipFile, name: str, path: Path) -> bytes:
    try:
        return archive.read(name)
    except _UNREADABLE as error:
        raise ArchiveError(f"{path}: {name} cannot be unpacked: {error}") from error
