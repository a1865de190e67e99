"""Open archives, and the XML in them, without trusting them.

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
from pathlib import Path
from typing import Any

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
