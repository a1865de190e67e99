"""Open archives, and the XML in them, without trusting them.

Everything is checked before anything is written or expanded. What is wrong is said in one ArchiveError that names the
file and the member.
"""

from __future__ import annotations

import re
import stat
import struct
import xml.parsers.expat
import zipfile
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from lxml import etree

try:
    from lzma import LZMAError
except ImportError:  # Python was built without it, and says so for such an archive by a RuntimeError

    class LZMAError(Exception):  # type: ignore[no-redef]
        """Raised by nobody."""


MOST_MEMBERS = 20_000
LARGEST_UNPACKED = 2 * 2**30  # bytes
LARGEST_RATIO = 100  # unpacked : packed, of archives that unpack to more than UNSUSPICIOUS
UNSUSPICIOUS = 64 * 2**20  # bytes
LARGEST_READ = 16 * 2**20  # bytes of a file that is read as a whole: 50 000 variables, and seconds of work

# What zipfile lets through from damaged archives.
_UNREADABLE = (
    zipfile.BadZipFile,
    zlib.error,
    LZMAError,
    struct.error,
    EOFError,
    RuntimeError,
    OSError,
    ValueError,
    MemoryError,
)
_MOST_PROBLEMS = 5  # of one file, told at once


class ArchiveError(ValueError):
    """An archive or an XML file cannot be used; the message names file, member and reason."""


def unpack(path: Path, folder: Path) -> None:
    """Unpack an archive into an existing folder, which is the caller's to delete. Raises ArchiveError."""
    with _opened(path) as archive:
        for member in archive.infolist():
            try:
                archive.extract(member, folder)
            except _UNREADABLE as error:
                raise ArchiveError(f"{path}: {member.filename} cannot be unpacked: {reason(error)}") from error


def check_xml(content: bytes, where: str) -> None:
    """Refuse XML that is malformed, large, or has a document type (the door to entity bombs and external entities)."""
    _check_size(len(content), where)

    def refuse(*_declaration: Any) -> None:
        raise ArchiveError(f"{where}, line {parser.CurrentLineNumber}: a DOCTYPE is not allowed; remove it")

    parser = xml.parsers.expat.ParserCreate()
    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(content, True)
    except xml.parsers.expat.ExpatError as error:
        fault = xml.parsers.expat.ErrorString(error.code)
        raise ArchiveError(f"{where}, line {error.lineno}: not well-formed XML: {fault}") from error
    except ArchiveError:
        raise
    except (LookupError, ValueError) as error:
        raise ArchiveError(f"{where}: its encoding cannot be read ({reason(error)}); save it as UTF-8") from error


def parse_xml(content: bytes, where: str) -> Any:
    """Root element (lxml) of checked XML. Raises ArchiveError."""
    check_xml(content, where)
    try:
        return etree.fromstring(content, etree.XMLParser(resolve_entities=False, no_network=True))
    except etree.XMLSyntaxError as error:
        raise ArchiveError(f"{where}, line {error.lineno}: {reason(error)}") from error


def listed(problems: Sequence[str]) -> str:
    """The first problems of a file in one line, and how many more there are."""
    shown = "; ".join(" ".join(problem.split()) for problem in problems[:_MOST_PROBLEMS])
    more = len(problems) - _MOST_PROBLEMS
    return f"{shown}; and {more} more" if more > 0 else shown


def read_members(
    path: Path, wanted: Callable[[str], bool], faults: list[str] | None = None
) -> tuple[set[str], dict[str, bytes]]:
    """Names of all members of an archive, and the content of the wanted ones. Raises ArchiveError.

    Names begin with no "./". faults: gets what is harmless in the names, and odd.
    """
    with _opened(path) as archive:
        names = {_plain(name): name for name in archive.namelist()}
        if faults is not None:
            faults += _oddities(archive.namelist())
        return set(names), {name: _read(archive, names[name], path) for name in sorted(names) if wanted(name)}


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
        raise ArchiveError(f"{path}: not a zip archive, or cut off: {reason(error)}") from error
    with archive:
        members = archive.infolist()
        if len(members) > MOST_MEMBERS:
            raise ArchiveError(f"{path}: {len(members)} members; at most {MOST_MEMBERS} are accepted")
        seen: set[str] = set()
        for member in members:
            harm = _why_harmful(member)
            if _plain(member.filename) in seen and not member.is_dir():
                harm = "the name occurs twice"
            if harm:
                raise ArchiveError(f"{path}: member {member.orig_filename!r} refused: {harm}")
            seen.add(_plain(member.filename))
        unpacked = sum(member.file_size for member in members)
        limit = min(LARGEST_UNPACKED, max(UNSUSPICIOUS, LARGEST_RATIO * path.stat().st_size))
        if unpacked > limit:
            raise ArchiveError(f"{path}: unpacks to {unpacked:,} bytes; at most {limit:,} are accepted for its size")
        yield archive


def _plain(name: str) -> str:
    return re.sub(r"^(\./)+", "", name)


def _oddities(names: Sequence[str]) -> list[str]:
    """What other programs may refuse in the names of members."""
    folders = [name for name in names if name.endswith("/")]
    oddities = {
        "begins with ./": [name for name in names if name.startswith("./")],
        "has a colon in its name, which Windows has not": [name for name in names if ":" in name],
        "occurs twice": [name for name in dict.fromkeys(folders) if folders.count(name) > 1],
    }
    return [f"member {found[0]!r} {fault}" for fault, found in oddities.items() if found]


def _why_harmful(member: zipfile.ZipInfo) -> str:
    """Why a member must not be unpacked; empty if it may."""
    name = member.orig_filename  # as stored; filename is cut at a zero byte
    if "\\" in name:
        return "a backslash in the name"
    if name.startswith("/") or re.match(r"(\./)*[A-Za-z]:", name):
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
    _check_size(archive.getinfo(name).file_size, f"{path}: {name}")
    try:
        return archive.read(name)
    except _UNREADABLE as error:
        raise ArchiveError(f"{path}: {name} cannot be unpacked: {reason(error)}") from error


def _check_size(size: int, where: str) -> None:
    if size > LARGEST_READ:
        raise ArchiveError(f"{where}: more than {LARGEST_READ // 2**20} MB; no larger file of this kind is read")


def reason(error: BaseException) -> str:
    """What an exception says, in one line; its kind where it says nothing, as MemoryError does."""
    return " ".join(str(error).split()) or type(error).__name__
