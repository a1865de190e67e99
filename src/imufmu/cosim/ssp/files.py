"""Files of SSP: where they are, whether they follow their schema, and what of SSP 2.0 is in them.

The schemas come from fmpy. A file that breaks them is read all the same where its meaning is clear; what is wrong with
it is added to ``faults``.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, unquote, urlsplit

from lxml import etree

from ...files.archives import LARGEST_READ, ArchiveError, check_xml, listed, parse_xml, read_members
from ..units import Unit, defined
from .version2 import lower

SSP = "http://ssp-standard.org/SSP1/"
NAMESPACES = {
    "ssd": f"{SSP}SystemStructureDescription",
    "ssc": f"{SSP}SystemStructureCommon",
    "ssv": f"{SSP}SystemStructureParameterValues",
    "ssm": f"{SSP}SystemStructureParameterMapping",
    "ssb": f"{SSP}SystemStructureSignalDictionary",
    "imufmu": "urn:imufmu:ssp",
}
_ROOTS = {
    "SystemStructureDescription": "ssd",
    "ParameterSet": "ssv",
    "ParameterMapping": "ssm",
    "SignalDictionary": "ssb",
}
_SCHEMAS = {
    "SystemStructureDescription": "SystemStructureDescription",
    "ParameterSet": "SystemStructureParameterValues",
    "ParameterMapping": "SystemStructureParameterMapping",
    "SignalDictionary": "SystemStructureSignalDictionary",
}


class DescriptionError(ValueError):
    """A system description cannot be used; the message names the file, the line and the reason."""


@dataclass(frozen=True)
class Sources:
    """Files that a description refers to, relative to itself.

    ssd: the description. inside: the folder that they must not leave. faults: collects what is formally wrong.
    """

    ssd: Path
    inside: Path | None
    faults: list[str] = field(default_factory=list)

    def where(self, element: Any) -> str:
        """File and line, for messages."""
        return f"{self.ssd}, line {element.sourceline}"

    def path(self, element: Any) -> Path:
        """Path that the ``source`` attribute of an element means. Raises DescriptionError."""
        path, fragment = self.path_and_fragment(element)
        if fragment:
            raise DescriptionError(f"{self.where(element)}: source {element.get('source')!r}: leave out #{fragment}")
        return path

    def path_and_fragment(self, element: Any) -> tuple[Path, str]:
        """The same, with what stands behind a #."""
        source = required(element, "source", self.ssd)
        where = f"{self.where(element)}: source {source!r}"
        plain = source
        if "\\" in source:
            plain = source.replace("\\", "/")
            self.faults.append(f"{where}: backslashes are no URI; write {plain!r}")
        try:
            address = urlsplit(plain)
        except ValueError as error:
            raise DescriptionError(f"{where}: no URI: {error}") from error
        path = unquote(address.path)
        if address.scheme == "proxyfmu" and address.hostname == "localhost":  # of libcosim: an FMU in its own process
            path = parse_qs(address.query).get("file", [""])[0]
        elif address.scheme == "file" and address.hostname in (None, "localhost"):
            path = re.sub(r"^/(?=[A-Za-z]:)", "", path)  # file:///C:/...
        elif address.scheme or address.netloc:
            raise DescriptionError(f"{where}: expected a path relative to the description, or a file: URI")
        if not path:
            raise DescriptionError(f"{where}: expected a path relative to the description")
        found = (self.ssd.parent / path).resolve()
        if self.inside and not found.is_relative_to(self.inside):
            raise DescriptionError(f"{where}: leaves the archive")
        return found, address.fragment

    def content(self, element: Any, component: Path | None) -> tuple[bytes, Path]:
        """Content of the source of an element, and the path that names it in messages.

        component: where a ``sourceBase`` of component lies, inside which sources may be, as in an FMU.
        """
        if element.get("sourceBase", "SSD") != "component":
            path = self.path(element)
            return read_bytes(path), path
        source = required(element, "source", self.ssd)
        if component is None or not component.is_file():
            raise DescriptionError(f"{self.where(element)}: source {source!r}: there is no component to find it in")
        _, contents = read_members(component, lambda name: name == source)
        if source not in contents:
            raise DescriptionError(f"{self.where(element)}: source {source!r}: there is no such file in {component}")
        return contents[source], component / source


def read_bytes(path: Path) -> bytes:
    """Content of a file. Raises DescriptionError."""
    try:
        with path.open("rb") as file:
            return file.read(LARGEST_READ + 1)
    except OSError as error:
        raise DescriptionError(f"{path}: cannot be read: {error.strerror or error}") from error


def read_root(content: bytes, path: Path, name: str, faults: list[str]) -> Any:
    """Root element, of this name, of a file of SSP 1.0 or 2.0. Raises DescriptionError and ArchiveError."""
    root = _parsed(content, path, faults)
    if etree.QName(root).localname != name:
        raise DescriptionError(f"{path}: no {name}: the root element is {etree.QName(root).localname}")
    check_root(root, path, name, faults)
    return root


def check_root(root: Any, path: Path, name: str, faults: list[str]) -> None:
    """Bring an element, which may stand in another file, to the names of SSP 1.0, and note what is wrong with it."""
    _rename(root, path, NAMESPACES[_ROOTS[name]], faults)
    lower(root, path, faults)
    rules = _schema(_SCHEMAS[name])
    if not rules.validate(root):
        problems = [f"line {entry.line}: {_plain(entry.message)}" for entry in rules.error_log]
        faults.append(f"{path}, {listed(problems)}")


def _plain(message: str) -> str:
    """A message of the schema without namespaces."""
    return re.sub(r"\{[^}]*\}", "", message)


def read_xml(path: Path, name: str) -> Any:
    """Root element, of this name, of a file that follows its schema. Raises DescriptionError and ArchiveError."""
    root = parse_xml(read_bytes(path), str(path))
    rules = _schema(_SCHEMAS[name])
    if not rules.validate(root):
        problems = [f"line {entry.line}: {_plain(entry.message)}" for entry in rules.error_log]
        raise DescriptionError(f"{path}: not a valid {name}: {listed(problems)}")
    return root


def _parsed(content: bytes, path: Path, faults: list[str]) -> Any:
    """Root element of checked XML; prefixes that nobody declares are taken for those that the standard uses."""
    try:
        return parse_xml(content, str(path))
    except ArchiveError:
        check_xml(content, str(path))  # all but what concerns namespaces is refused here again
        parser = etree.XMLParser(resolve_entities=False, no_network=True, recover=True)
        root = etree.fromstring(content, parser)
        missing = [re.fullmatch(r"Namespace prefix (\w+) .*not defined", entry.message) for entry in parser.error_log]
        if root is None or not all(missing):
            raise
        prefixes = sorted({match[1] for match in missing if match})
        faults.append(f"{path}: the prefix {', '.join(prefixes)} is not declared (xmlns)")
        for element in root.iter(etree.Element):
            prefix, colon, name = element.tag.partition(":")
            if colon and prefix in prefixes:
                element.tag = f"{{{NAMESPACES.get(prefix, prefix)}}}{name}"
        return root


def _rename(root: Any, path: Path, own: str, faults: list[str]) -> None:
    """Put the elements of drafts of SSP, and those around a root without its namespace, into those of the standard."""
    new = {etree.QName(root).namespace: own}
    for element in root.iter(etree.Element):
        name = etree.QName(element)
        draft = re.search(
            r"SystemStructure(Description|Common|Parameter(Values|Mapping)|SignalDictionary)", name.namespace or ""
        )
        wanted = new.get(name.namespace) or (f"{SSP}{draft[0]}" if draft else name.namespace)
        if name.namespace != wanted:
            if name.namespace not in new or element is root:
                faults.append(f"{path}, line {element.sourceline}: the namespace of {name.localname} is not {wanted}")
            new[name.namespace] = wanted
            element.tag = f"{{{wanted}}}{name.localname}"


@lru_cache
def _schema(name: str) -> Any:
    found = find_spec("fmpy")  # to import it takes longer than to read a description
    assert found and found.origin
    return etree.XMLSchema(file=str(Path(found.origin).parent / "ssp" / "schema" / f"{name}.xsd"))


def units_in(root: Any) -> dict[str, Unit]:
    """Units that a file of SSP defines, by name."""
    units = {}
    for unit in root.iterfind("*/ssc:Unit", NAMESPACES):
        base = unit.find("ssc:BaseUnit", NAMESPACES)
        name = unit.get("name", "")
        try:
            units[name] = Unit(name) if base is None else defined(name, base.attrib)
        except ValueError:
            units[name] = Unit(name)
    return units


def enumerations_in(root: Any) -> dict[str, dict[str, int]]:
    """Enumerations that a file of SSP defines: value by name of the item, by name of the enumeration."""
    found: dict[str, dict[str, int]] = {}
    for enumeration in root.iterfind("*/ssc:Enumeration", NAMESPACES):
        items = enumeration.iterfind("ssc:Item", NAMESPACES)
        found[enumeration.get("name", "")] = {
            item.get("name", ""): int(item.get("value"))
            for item in items
            if re.fullmatch(r"\s*[+-]?\d+\s*", item.get("value", ""))
        }
    return found


def required(element: Any, attribute: str, path: Path) -> str:
    """An attribute that must be there. Raises DescriptionError."""
    value = element.get(attribute)
    if value is None:
        tag = etree.QName(element).localname
        raise DescriptionError(f"{path}, line {element.sourceline}: {tag} has no attribute {attribute}")
    return str(value)


def number(element: Any, attribute: str, path: Path) -> float | None:
    """An attribute as a number; None where it is missing. Raises DescriptionError."""
    text = element.get(attribute)
    if text is None:
        return None
    try:
        return float(text)
    except ValueError:
        where = f"{path}, line {element.sourceline}"
        raise DescriptionError(f"{where}: {attribute}={text!r} is not a number") from None


def first_child(element: Any, namespace: str) -> Any:
    """First child in this namespace; None without one."""
    return next(element.iterchildren(f"{{{NAMESPACES[namespace]}}}*"), None)
