"""Pack a system into one .ssp file that any SSP 1.0 tool can load."""

from __future__ import annotations

import zipfile
from pathlib import Path

from lxml import etree

from ..files import atomic_write
from .description import NAMESPACES, Sources, read_xml
from .system import STRUCTURE, System

_FIXED_TIME = (1980, 1, 1, 0, 0, 0)  # the earliest a zip can say: equal contents make equal bytes


def pack(ssd: str | Path, target: str | Path, *, native: bool = False) -> Path:
    """Write the system described by ``ssd``, with its FMUs and parameter sets under ``resources/``, to ``target``.

    native: as in System.read. Returns the path written. Raises what System.read raises, and WriteError.
    """
    system = System.read(ssd, native=native)
    root = read_xml(system.description.path, "SystemStructureDescription")
    files = Sources(system.description.path, None)
    members: dict[str, Path] = {}
    for component in root.iterfind("ssd:System/ssd:Elements/ssd:Component", NAMESPACES):
        fmu = next(part.fmu for part in system.parts if part.name == component.get("name"))
        component.set("source", _member(fmu, members))
    for binding in root.iterfind(".//ssd:ParameterBinding[@source]", NAMESPACES):
        binding.set("source", _member(files(binding), members))
    contents = {name: path.read_bytes() for name, path in members.items()}
    contents[STRUCTURE] = etree.tostring(root, xml_declaration=True, encoding="UTF-8")
    with atomic_write(target) as temporary, zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in sorted(contents.items()):
            entry = zipfile.ZipInfo(name, _FIXED_TIME)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, content)
    return Path(target)


def _member(path: Path, members: dict[str, Path]) -> str:
    """Name in the archive for a file; files of the same name in different folders get numbers."""
    name, number = f"resources/{path.name}", 1
    while members.setdefault(name, path) != path:
        number += 1
        name = f"resources/{path.stem}_{number}{path.suffix}"
    return name
