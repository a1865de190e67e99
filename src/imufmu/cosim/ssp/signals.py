"""Signal dictionaries: collections of signals that references in any system below share (SSP 1.0, 5.3.2)."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

from ..units import Unit
from .connectors import Connector, connector_of
from .files import NAMESPACES, DescriptionError, Sources, check_root, read_root, required, units_in

_TYPE = "application/x-ssp-signal-dictionary"


@dataclass
class Dictionaries:
    """Dictionaries that a system sees: full name by name. new: connectors of those that the system itself defines."""

    known: dict[str, str] = field(default_factory=dict)
    new: dict[str, dict[str, Connector]] = field(default_factory=dict)
    _referred: dict[str, str] = field(default_factory=dict)  # full name of the dictionary, by name of the reference

    def within(self, system: Any, name: str, files: Sources) -> Dictionaries:
        """Those seen inside a system: the ones around it, and its own before them."""
        own = {}
        for element in system.iterfind("ssd:SignalDictionaries/ssd:SignalDictionary", NAMESPACES):
            full = f"{name}{'.' if name else ''}{required(element, 'name', files.ssd)}"
            own[element.get("name")] = (f"<{full}>", _entries(element, files))
        return Dictionaries(self.known | {k: full for k, (full, _) in own.items()}, dict(own.values()))

    def refer(self, reference: str, dictionary: str, where: str) -> None:
        """Note what a SignalDictionaryReference refers to. Raises DescriptionError."""
        if dictionary not in self.known:
            known = ", ".join(self.known) or "none"
            raise DescriptionError(f"{where}: there is no signal dictionary {dictionary!r}; there is {known}")
        self._referred[reference] = self.known[dictionary]

    def of(self, reference: str) -> str:
        """Full name of the dictionary behind a reference."""
        return self._referred[reference]


def _entries(element: Any, files: Sources) -> dict[str, Connector]:
    if element.get("type", _TYPE) != _TYPE:
        raise DescriptionError(f"{files.where(element)}: only signal dictionaries (.ssb) are supported")
    where = files
    units: dict[str, Unit] = {}
    if element.get("source") is not None:
        content, path = files.content(element, None)
        root = read_root(content, path, "SignalDictionary", files.faults)
        where = replace(files, ssd=path)
    else:
        root = element.find("{*}SignalDictionary")
        if root is None:
            files.faults.append(f"{files.where(element)}: a signal dictionary without entries")
            return {}
        check_root(root, files.ssd, "SignalDictionary", files.faults)
        units = units_in(element.getroottree().getroot())
    units = units | units_in(root)
    return {
        required(entry, "name", where.ssd): connector_of(entry, "inout", where, units)
        for entry in root.iterfind("ssb:DictionaryEntry", NAMESPACES)
    }
