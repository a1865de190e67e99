"""Arrays that a description connects as a whole, as FMI 3.0 and SSP 2.0 have them: taken apart as those of FMUs are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from .description import Description
from .interface import Interface
from .ssp.flat import Component, Connection, End

_Sizes = dict[tuple[str, str], int]  # of the arrays, by element and connector


def one_by_one(description: Description, interfaces: Mapping[str, Interface], problems: list[str]) -> Description:
    """The description with a connector and a connection for each element of an array. Problems: sizes that differ.

    Elements go together in their order, whatever number they begin with. A connector of a system is as large as what it
    is connected to; its elements are then named x[1], x[2], ...
    """
    sizes = _sizes(description, interfaces)
    if not sizes:
        return description
    components = tuple(_component(component, interfaces) for component in description.components)
    systems = {
        system: {
            part: connector
            for name, connector in connectors.items()
            for part in _parts(system, name, interfaces, sizes)
        }
        for system, connectors in description.systems.items()
    }
    connections: list[Connection] = []
    for connection in description.connections:
        starts, ends = (
            _parts(end.element, end.connector, interfaces, sizes) for end in (connection.start, connection.end)
        )
        if len(starts) != len(ends):
            problems.append(f"{connection}: an array of {len(starts)} elements and one of {len(ends)}")
            continue
        connections += [
            replace(connection, start=replace(connection.start, connector=a), end=replace(connection.end, connector=b))
            for a, b in zip(starts, ends, strict=True)
        ]
    return replace(description, components=components, systems=systems, connections=tuple(connections))


def _sizes(description: Description, interfaces: Mapping[str, Interface]) -> _Sizes:
    """Arrays at the ends of connections: of components by their FMUs, of systems by what they are connected to."""
    sizes: _Sizes = {}

    def size(end: End) -> int:
        if end.element in interfaces:
            is_variable = end.connector in interfaces[end.element].variables
            return 0 if is_variable else len(interfaces[end.element].elements(end.connector))
        return sizes.get((end.element, end.connector), 0)

    before = -1
    while before < len(sizes):
        before = len(sizes)
        for connection in description.connections:
            largest = max(size(connection.start), size(connection.end))
            for end in (connection.start, connection.end):
                found = size(end) or (0 if end.element in interfaces else largest)
                if found:
                    sizes.setdefault((end.element, end.connector), found)
    return sizes


def _parts(element: str, connector: str, interfaces: Mapping[str, Interface], sizes: _Sizes) -> list[str]:
    """Names of the elements of an array, or the connector alone."""
    if (element, connector) not in sizes:
        return [connector]
    if element in interfaces:
        return interfaces[element].elements(connector)
    return [f"{connector}[{i + 1}]" for i in range(sizes[element, connector])]


def _component(component: Component, interfaces: Mapping[str, Interface]) -> Component:
    interface = interfaces[component.name]
    connectors = {
        part: connector
        for name, connector in component.connectors.items()
        for part in ([] if name in interface.variables else interface.elements(name)) or [name]
    }
    return replace(component, connectors=connectors)
