"""The connections of a description, checked against the FMUs: what feeds what, and in which direction."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from .description import Description
from .interface import Interface, label, near, representation, unit_of
from .links import Node, Wiring
from .ssp.flat import Component, Connection, End
from .units import UnitError

# Causalities of variables that can feed, and that can be fed. A local variable is no output, but can be read as one.
_FROM = ("output", "calculatedParameter", "local")
_TO = ("input", "parameter", "structuralParameter")
_SPOKEN_AS = {"structuralParameter": "parameter", "local": "output"}  # kinds of SSP 2.0, in the words of 1.0
_TOLD = 3  # connections told by name in one note


def find_wiring(
    description: Description,
    interfaces: Mapping[str, Interface],
    problems: list[str],
    notes: list[str],
    faults: list[str],
) -> Wiring:
    """Links between existing variables.

    What is wrong goes to problems, what is unusual but no error to notes, what is formally wrong but clear to faults.
    """
    for component in description.components:
        faults += _connector_faults(component, interfaces[component.name])
    wiring = Wiring(description, interfaces)
    checks = _Checks(wiring, problems, notes, faults)
    for connection in description.connections:
        checks.add(connection)
    links, linked = [], []
    for way in wiring.ways:
        if way[0][0] not in interfaces:  # a connector of the whole system, or an entry that nothing feeds
            continue
        try:
            links.append(wiring.link(way))
        except ValueError as error:
            problems.append(checks.misfit(way, error))
            continue
        linked.append(way)
        checks.note_shifted_index(way)
    checks.note_missing_units(linked)
    wiring.links = tuple(links)
    return wiring


def _connector_faults(component: Component, interface: Interface) -> list[str]:
    """Where the declared connectors contradict the FMU, which is right then."""
    faults = []
    for name, connector in component.connectors.items():
        where = f"{connector.where}: connector {component.name}.{name}"
        variable = interface.variables.get(name)
        if variable is None:
            faults.append(f"{where}: the FMU has no such variable. Near: {near(name, interface.variables)}")
            continue
        if connector.kind not in (variable.causality, _SPOKEN_AS.get(variable.causality)):
            faults.append(f"{where}: declared as {connector.kind}; the FMU says {variable.causality}")
        if connector.type is not None and connector.type != variable.type:
            faults.append(f"{where}: declared as {connector.type}; the FMU says {variable.type}")
    return faults


@dataclass
class _Checks:
    """Adds connections to a wiring, each in the direction of its values."""

    wiring: Wiring
    problems: list[str]
    notes: list[str]
    faults: list[str]

    def __post_init__(self) -> None:
        self._declared = {c.name: c.connectors for c in self.wiring.description.components}

    def add(self, connection: Connection) -> None:
        """One more; nothing is added for a connection with a problem."""
        roles = [self._role(end) for end in (connection.start, connection.end)]
        if roles.count("source") == 2 or roles.count("sink") == 2:
            needed = "an input" if roles[0] == "source" else "an output"
            end = connection.end if needed == "an input" else connection.start
            self.problems.append(f"{connection}: {self._wrong(end, connection, needed)}")
            return
        backward = roles[0] == "sink" or roles[1] == "source"
        source, sink = (connection.end, connection.start) if backward else (connection.start, connection.end)
        if not all([self._exists(source, "output", sink, connection), self._exists(sink, "input", source, connection)]):
            return
        node, feeding = (sink.element, sink.connector), (source.element, source.connector)
        if node in self.wiring.feeders:
            first = self._label(*self.wiring.feeders[node][0])
            ends = f"{self._label(*feeding)} -> {self._label(*node)}"
            self.problems.append(f"{connection.where}: {ends}: it is fed by {first} already; keep one of the two")
            return
        self.wiring.feeders[node] = (feeding, connection)

    def _label(self, element: str, connector: str) -> str:
        """An end with its unit, for messages."""
        variable = self._variable(End(element, connector, ""))
        return label(element, variable) if variable is not None else str(End(element, connector, ""))

    def _role(self, end: End) -> str:
        if end.role != "component":
            return end.role
        variable = self._variable(end)
        if variable is None:
            return "either"
        return "source" if variable.causality in _FROM else "sink" if variable.causality in _TO else "neither"

    def _variable(self, end: End) -> Any:
        interface = self.wiring.interfaces.get(end.element)
        return interface.variables.get(end.connector) if interface else None

    def _exists(self, end: End, causality: str, other: End, connection: Connection) -> bool:
        """Whether an end is there and can be what it has to be; problems and faults are added."""
        if end.role != "component":
            if end.connector not in self.wiring.description.systems.get(end.element, {}):
                self.faults.append(f"{connection}: {end} is not among the connectors of its system; add it there")
            return True
        if end.element not in self.wiring.interfaces:
            known = ", ".join(self.wiring.interfaces)
            self.problems.append(f"{connection}: there is no component {end.element!r}; there is {known}")
            return False
        variable = self._variable(end)
        unclear = self.wiring.interfaces[end.element].why_unclear(end.connector)
        if unclear:
            self.problems.append(f"{connection}: {end}: {unclear}")
            return False
        # A value from the whole system may go to a parameter; one from another FMU would come too late for it.
        wanted = _FROM if causality == "output" else _TO if other.role != "component" else ("input",)
        if variable is None or variable.causality not in wanted:
            self.problems.append(f"{connection}: {self._wrong(end, connection, causality)}")
            return False
        if end.connector not in self._declared[end.element]:
            self.faults.append(f"{connection}: {end} is not among the component's connectors; add it there")
        return True

    def _wrong(self, end: End, connection: Connection, needed: str) -> str:
        """Why an end is not what is needed, and what would be."""
        causality = needed.split()[-1]
        variable, other = self._variable(end), connection.start if end is connection.end else connection.end
        there = self._variable(other)
        if end.element not in self.wiring.interfaces:
            return f"{end} cannot be {needed} here; see the kinds of the connectors"
        interface = self.wiring.interfaces[end.element]
        reason = f"{end.element} has no variable {end.connector}"
        if variable is not None:
            reason = f"{end} is {variable.causality}; {causality} is needed"
        return f"{reason}. {interface.suggest(end.connector, causality, unit_of(there) if there is not None else None)}"

    def misfit(self, way: Sequence[Node], error: ValueError) -> str:
        """Message for a way whose ends do not go together."""
        (a, x), (b, y) = way[0], way[-1]
        ends = (a, self.wiring.interfaces[a].variables[x]), (b, self.wiring.interfaces[b].variables[y])
        start = f"{self.wiring.feeders[way[-1]][1].where}: {label(*ends[0])} -> {label(*ends[1])}"
        if not isinstance(error, UnitError):
            return f"{start}: {error}"
        suggestion = self.wiring.interfaces[a].suggest(x, "output", unit_of(ends[1][1]))
        return f'{start}: {error}. {suggestion}. To pass the numbers as they are: suppressUnitConversion="true"'

    def note_missing_units(self, ways: Sequence[Sequence[Node]]) -> None:
        """Say so where one end names its unit and the other does not, once for each pair of components."""
        pairs: dict[tuple[str, str], list[str]] = {}
        for way in ways:
            units = self.wiring.unit(way[0]), self.wiring.unit(way[-1])
            ends = [(c, self.wiring.interfaces[c].variables[v]) for c, v in (way[0], way[-1])]
            same_units = all(self.wiring.feeders[node][1].same_units for node in way[1:])
            are_real = all(representation(variable) == "Real" for _, variable in ends)
            if are_real and same_units and (units[0] is None) != (units[1] is None):
                names = " -> ".join(label(*end) for end in ends)
                pairs.setdefault((way[0][0], way[-1][0]), []).append(names)
        for wires in pairs.values():
            more = f" and {len(wires) - _TOLD} more" if len(wires) > _TOLD else ""
            told = ", ".join(wires[:_TOLD])
            self.notes.append(f"{told}{more}: one end does not name its unit; taken for the same")

    def note_shifted_index(self, way: Sequence[Node]) -> None:
        """Say so where equal indices are not the same axis: one end counts from 0, the other from 1."""
        first, last = way[0], way[-1]
        counts = [self.wiring.interfaces[c].counts_from(v) for c, v in (first, last)]
        if None not in counts and counts[0] != counts[1] and first[1].partition("[")[2] == last[1].partition("[")[2]:
            ends = [
                f"{c}.{v.rpartition('[')[0]} counts from {i}" for (c, v), i in zip((first, last), counts, strict=True)
            ]
            names = " -> ".join(".".join(node) for node in (first, last))
            self.notes.append(f"{names}: {' and '.join(ends)}: the axes are shifted by one; is that meant?")
