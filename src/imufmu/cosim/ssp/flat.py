"""Nested systems laid out flat: every component, connector, connection and value under its full name.

A component or system inside systems has the names of all of them, "chassis.wheel.brake", as the hierarchical names of
SSP have it (5.2.3).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from lxml import etree

from ..units import Unit
from .connectors import Connector, connectors_of
from .files import NAMESPACES, DescriptionError, Sources, read_bytes, read_root, required, units_in
from .packages import Packages
from .parameters import ParameterValue, bound_values
from .signals import Dictionaries
from .transformations import Transformation, transformation_of

ROOT = "SystemStructureDescription"
FMU_TYPE = "application/x-fmu-sharedlibrary"
KINDS_OF_STEP = ("sampled", "continuous")
_DEEPEST = 50  # systems in systems: more is a circle of references
# Kinds of connectors through which values go into an element, and out of one.
_INTO = ("input", "parameter")
_OUT_OF = ("output", "calculatedParameter")


@dataclass(frozen=True)
class Component:
    """One FMU of the system. name: with those of the systems around it.

    implementation: ModelExchange or CoSimulation where the description wants one of these; else any. treat: how it
    steps, one of KINDS_OF_STEP, where an annotation says so.
    """

    name: str
    description: str
    source: Path
    connectors: dict[str, Connector]
    where: str
    implementation: str = "any"
    treat: str | None = None


@dataclass(frozen=True)
class End:
    """One end of a connection. element: a component, a system ("" is the whole) or a signal dictionary.

    role: whether values come out of this end ("source") or go into it ("sink"), as seen from the connection; "either"
    where the other end tells; "component" where its FMU tells.
    """

    element: str
    connector: str
    role: str

    def __str__(self) -> str:
        return f"{self.element}.{self.connector}" if self.element else self.connector


@dataclass(frozen=True)
class Connection:
    """A connection as written: its two ends, which do not say in which direction values go.

    same_units: False where the author takes care of units (suppressUnitConversion).
    """

    start: End
    end: End
    transformation: Transformation
    same_units: bool
    where: str

    def __str__(self) -> str:
        return f"{self.where}: {self.start} -> {self.end}"


def system_of(root: Any, path: Path) -> Any:
    """The System of a description. Raises DescriptionError."""
    system = root.find("ssd:System", NAMESPACES)
    if system is None:
        raise DescriptionError(f"{path}: there is no System in it")
    return system


@dataclass
class Flat:
    """Collects what is in nested systems, each thing under its full name."""

    packages: Packages | None
    faults: list[str]
    components: list[Component] = field(default_factory=list)
    systems: dict[str, dict[str, Connector]] = field(default_factory=dict)
    connections: list[Connection] = field(default_factory=list)
    values: list[tuple[int, ParameterValue]] = field(default_factory=list)  # each with the depth of its binding

    def add(
        self, system: Any, name: str, files: Sources, units: dict[str, Unit], dictionaries: Dictionaries, depth: int = 0
    ) -> None:
        """A system and all that is in it; name: "" for the whole."""
        if depth > _DEEPEST:
            raise DescriptionError(f"{files.where(system)}: systems inside systems without an end")
        self.systems[name] = dict(connectors_of(system, files, units))
        self._bind(system, name, files, None, depth)
        dictionaries = dictionaries.within(system, name, files)
        self.systems |= dictionaries.new
        inner: dict[str, tuple[str, dict[str, Connector]]] = {}  # kind of element and its connectors, by its own name
        for element in system.iterfind("ssd:Elements/*", NAMESPACES):
            own = required(element, "name", files.ssd)
            full = _joined(name, own)
            kind = etree.QName(element).localname
            if own in inner:
                raise DescriptionError(f"{files.where(element)}: {own!r}: the name occurs twice; rename one of them")
            if kind == "System":
                self.add(element, full, files, units, dictionaries, depth + 1)
            elif kind == "Component":
                kind = self._component(element, full, files, units, dictionaries, depth + 1)
            elif kind != "SignalDictionaryReference":
                self.faults.append(f"{files.where(element)}: {kind} is no element of a system; left out")
                continue
            declared = dict(connectors_of(element, files, units))
            inner[own] = kind, self.systems[full] | declared if kind == "System" else declared
            if kind == "SignalDictionaryReference":
                dictionaries.refer(own, required(element, "dictionary", files.ssd), files.where(element))
        for element in system.iterfind("ssd:Connections/ssd:Connection", NAMESPACES):
            start, end = (
                _end(element.get(f"{side}Element", ""), required(element, f"{side}Connector", files.ssd), name,
                     self.systems[name], inner, dictionaries)
                for side in ("start", "end")
            )  # fmt: skip
            same_units = element.get("suppressUnitConversion") not in ("true", "1")
            self.connections.append(
                Connection(start, end, transformation_of(element, files), same_units, files.where(element))
            )

    def _bind(self, element: Any, name: str, files: Sources, component: Path | None, depth: int) -> None:
        self.values += [(depth, value) for value in bound_values(element, name, files, component)]

    def _component(
        self, element: Any, name: str, files: Sources, units: dict[str, Unit], dictionaries: Dictionaries, depth: int
    ) -> str:
        """Add a component; says whether it is one, or another description and so a System."""
        where, kind = f"{files.where(element)}: component {name!r}", element.get("type", FMU_TYPE)
        if element.get("source") is None:
            raise DescriptionError(f"{where} has no source: there is nothing to run; give its FMU")
        if element.get("source").startswith("#"):
            systems = element.getroottree().iterfind(".//ssd:System", NAMESPACES)
            meant = next((s for s in systems if s.get("id") == element.get("source")[1:]), None)
            if meant is None:
                raise DescriptionError(f"{where}: no system here has the id {element.get('source')[1:]!r}")
            self.add(meant, name, files, units, dictionaries, depth)
            self._bind(element, name, files, None, depth)
            return "System"
        if _is_system(element):
            path, fragment = files.path_and_fragment(element)
            inside = files.inside
            if self.packages and path.suffix.lower() == ".ssp":
                path, inside = self.packages.structure(path, fragment)
            root = read_root(read_bytes(path), path, ROOT, self.faults)
            inner = Sources(path, inside, self.faults)
            self.add(system_of(root, path), name, inner, units_in(root), Dictionaries(), depth)
            self._bind(element, name, files, path, depth)
            return "System"
        if kind != FMU_TYPE:
            raise DescriptionError(f"{where} is no FMU and no system, but {kind}: there is no way to run it")
        source = files.path(element)
        connectors = dict(connectors_of(element, files, units))
        self.components.append(
            Component(
                name,
                element.get("description", ""),
                source,
                connectors,
                files.where(element),
                element.get("implementation", "any"),
                _treatment(element, files),
            )
        )
        self._bind(element, name, files, source, depth)
        return "Component"


def _is_system(element: Any) -> bool:
    """Whether a component is a description of a system, by its type or the end of its name."""
    kind, name = element.get("type", ""), element.get("source").partition("#")[0].lower()
    return kind in ("application/x-ssp-definition", "application/x-ssp-package") or name.endswith((".ssd", ".ssp"))


def _treatment(element: Any, files: Sources) -> str | None:
    """What an annotation says of how a component steps; see schedule.py."""
    for mark in element.iterfind("ssd:Annotations/ssc:Annotation[@type='org.imufmu']/imufmu:Treat", NAMESPACES):
        kind = required(mark, "as", files.ssd)
        if kind not in KINDS_OF_STEP:
            raise DescriptionError(f"{files.where(mark)}: as={kind!r}: expected {' or '.join(KINDS_OF_STEP)}")
        return kind
    return None


def _joined(system: str, name: str) -> str:
    return f"{system}.{name}" if system else name


def _end(
    element: str,
    connector: str,
    system: str,
    connectors: dict[str, Connector],
    inner: dict[str, tuple[str, dict[str, Connector]]],
    dictionaries: Dictionaries,
) -> End:
    """An end by its full name. element: its own name, "" for the system around the connection."""
    if not element:  # seen from inside: what goes into the system comes out of its connector
        kind = connectors[connector].kind if connector in connectors else None
        role = "source" if kind in _INTO else "sink" if kind in _OUT_OF else "either"
        return End(system, connector, role)
    what, its = inner.get(element, ("Component", {}))
    if what == "Component":
        return End(_joined(system, element), connector, "component")
    kind = its[connector].kind if connector in its else None
    role = "sink" if kind in _INTO else "source" if kind in _OUT_OF else "either"
    if what == "SignalDictionaryReference":
        return End(dictionaries.of(element), connector, role)
    return End(_joined(system, element), connector, role)
