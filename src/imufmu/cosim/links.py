"""Connections of a description as links between variables of its FMUs, every one checked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from .description import Component, Connection, Description
from .interface import Interface, label, near, representation, unit_of

End = tuple[str, Any]  # component, fmpy ModelVariable


@dataclass(frozen=True)
class Link:
    """An input fed by an output: target = factor * source + offset."""

    source: End
    target: End
    factor: float
    offset: float

    def __str__(self) -> str:
        return f"{label(*self.source)} -> {label(*self.target)}"


def find_links(
    description: Description, interfaces: Mapping[str, Interface], problems: list[str], notes: list[str]
) -> tuple[Link, ...]:
    """Links between existing variables. What is wrong goes to problems, what is unusual but no error to notes."""
    declared = set()
    for component in description.components:
        problems += _connector_problems(component, interfaces[component.name])
        declared |= {(component.name, name) for name in component.connectors}
    feeders: dict[tuple[str, str], Link] = {}
    for connection in description.connections:
        if "" in (connection.start[0], connection.end[0]):
            notes.append(f"{_text(connection)}: ends at the boundary of the system; nothing is exchanged there")
            continue
        problems += [
            f"{_text(connection)}: {component}.{name} is not among the component's connectors; add it there"
            for component, name in (connection.start, connection.end)
            if component in interfaces and name in interfaces[component].variables and (component, name) not in declared
        ]
        link = _link(connection, interfaces, problems)
        if link is None:
            continue
        problems += [f"line {connection.line}: {link}: {reason}" for reason in _misfits(link, connection, interfaces)]
        target = (link.target[0], link.target[1].name)
        if target in feeders:
            problems.append(
                f"line {connection.line}: {link}: the input is fed by {label(*feeders[target].source)} already; "
                "keep one of the two"
            )
        feeders[target] = link
        if (unit_of(link.source[1]) is None) != (unit_of(link.target[1]) is None) and connection.same_units:
            notes.append(f"{link}: one end does not name its unit; taken for the same")
    return tuple(feeders.values())


def _connector_problems(component: Component, interface: Interface) -> list[str]:
    """Where the declared connectors contradict the FMU."""
    problems = []
    for name, connector in component.connectors.items():
        where = f"line {connector.line}: connector {component.name}.{name}"
        variable = interface.variables.get(name)
        if variable is None:
            problems.append(f"{where}: the FMU has no such variable. Near: {near(name, interface.variables)}")
            continue
        unit = unit_of(variable)
        if connector.kind != variable.causality:
            problems.append(f"{where}: declared as {connector.kind}; the FMU says {variable.causality}")
        if connector.type is not None and connector.type != variable.type:
            problems.append(f"{where}: declared as {connector.type}; the FMU says {variable.type}")
        if connector.unit and unit and connector.unit != unit:
            problems.append(f"{where}: declared in {connector.unit}; the FMU says {unit}")
    return problems


def _text(connection: Connection) -> str:
    start, end = (".".join(filter(None, part)) for part in (connection.start, connection.end))
    return f"line {connection.line}: {start} -> {end}"


def _link(connection: Connection, interfaces: Mapping[str, Interface], problems: list[str]) -> Link | None:
    """The variables at both ends, output first; None, and problems, unless they are an output and an input."""
    found = [_variable(end, interfaces) for end in (connection.start, connection.end)]
    causalities = ["output", "input"]
    if (found[0] and found[0].causality == "input") or (found[1] and found[1].causality == "output"):
        both_wrong = found[0] and found[1] and found[0].causality == found[1].causality
        causalities = causalities if both_wrong else ["input", "output"]
    ends: list[End] = []
    for (component, name), variable, other, causality in zip(
        (connection.start, connection.end), found, reversed(found), causalities, strict=True
    ):
        if component not in interfaces:
            known = ", ".join(interfaces)
            problems.append(f"{_text(connection)}: there is no component {component!r}; there is {known}")
        elif variable is None or variable.causality != causality:
            reason = f"{component} has no variable {name}"
            if variable is not None:
                reason = f"{component}.{name} is {variable.causality}; {causality} is needed"
            suggestion = interfaces[component].suggest(name, causality, unit_of(other) if other else None)
            problems.append(f"{_text(connection)}: {reason}. {suggestion}")
        else:
            ends.append((component, variable))
    if len(ends) < 2:
        return None
    source, target = ends if causalities[0] == "output" else reversed(ends)
    return Link(source, target, connection.factor, connection.offset)


def _variable(end: tuple[str, str], interfaces: Mapping[str, Interface]) -> Any:
    component, name = end
    return interfaces[component].variables.get(name) if component in interfaces else None


def _misfits(link: Link, connection: Connection, interfaces: Mapping[str, Interface]) -> list[str]:
    """Why the two variables do not go together."""
    source, target = link.source[1], link.target[1]
    kind = representation(source)
    if kind != representation(target):
        return [f"types differ: {source.type} and {target.type}"]
    if kind not in ("Real", "Integer", "Boolean"):
        return [f"{kind} variables cannot be connected"]
    if kind != "Real":
        scaled = (link.factor, link.offset) != (1.0, 0.0)
        return [f"a LinearTransformation needs Real variables, not {kind}"] if scaled else []
    units = unit_of(source), unit_of(target)
    if connection.same_units and None not in units and units[0] != units[1]:
        suggestion = interfaces[link.source[0]].suggest(source.name, "output", units[1])
        return [f'units differ. {suggestion}. To convert: LinearTransformation with suppressUnitConversion="true"']
    return []
