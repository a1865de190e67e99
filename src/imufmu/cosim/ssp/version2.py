"""What SSP 2.0 adds to 1.0, put into the words of 1.0 where they say the same; what they cannot say is named."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from lxml import etree

_SSP = "{http://ssp-standard.org/SSP1/"
_TYPES = {
    "Float64": "Real",
    "Float32": "Real",
    **{f"{sign}Int{bits}": "Integer" for sign in ("", "U") for bits in (8, 16, 32, 64)},
}
_KINDS = {
    "structuralParameter": "parameter",
    "constant": "calculatedParameter",
    "local": "output",
    "unspecified": "inout",
}
_ONLY_TOLD = ("MetaData", "Signature", "Dimension")  # who made and signed it; how large arrays are, as FMUs tell, too
_INDICES = ("startIndices", "endIndices")


def lower(root: Any, path: Path, faults: list[str]) -> None:
    """Rewrite what only SSP 2.0 knows. In a file that calls itself 1.x that is a fault; what is lost always is one."""
    version = root.get("version", "1.0")
    second = version.startswith("2.")
    if not version.startswith(("1.", "2.")):
        faults.append(f"{path}, line {root.sourceline}: version {version!r} of SSP is not known; read as 1.0")
    if not version.startswith("1."):
        root.set("version", "1.0")

    def is_new(element: Any, what: str) -> None:
        if not second:
            faults.append(f"{path}, line {element.sourceline}: {what} came with SSP 2.0; the file says {version}")

    def is_lost(element: Any, what: str) -> None:
        faults.append(f"{path}, line {element.sourceline}: of SSP 2.0, not supported and left out: {what}")

    for element in [e for e in root.iter(etree.Element) if e.tag.startswith(_SSP)]:
        name, parent = etree.QName(element).localname, element.getparent()
        if name in _TYPES:
            is_new(element, name)
            element.tag = element.tag.replace(f"}}{name}", f"}}{_TYPES[name]}")
        elif name == "Connector" and element.get("kind") in _KINDS:
            is_new(element, f"kind {element.get('kind')!r}")
            element.set("kind", _KINDS[element.get("kind")])
        elif name == "Connection" and any(element.attrib.pop(attribute, None) for attribute in _INDICES):
            is_lost(element, "elements of an array; connect x[1] and its like one by one")
        elif name in _ONLY_TOLD:
            parent.remove(element)
        elif name == "Clock":
            is_lost(element, f"Clock of {parent.get('name')!r}: a clock; only values are exchanged")
            parent.remove(element)
