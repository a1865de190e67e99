"""Links between variables of FMUs, and what happens to a value on its way.

A link leads from an output of one FMU to an input of another, maybe through connectors of systems and entries of signal
dictionaries. Each hop converts units and applies a transformation; a link holds what they do together.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from .description import Description
from .interface import Interface, items_of, label, representation
from .ssp.flat import Connection
from .ssp.transformations import UNCHANGED, Transformation
from .units import SAME, Linear, Unit, conversion

VariableEnd = tuple[str, Any]  # component, fmpy ModelVariable
Node = tuple[str, str]  # element and connector


@dataclass(frozen=True)
class Link:
    """An input fed by an output: target = factor * source + offset, or what the table has for a whole number.

    table: {} where values pass as they are; what is not in it does.
    """

    source: VariableEnd
    target: VariableEnd
    factor: float = 1.0
    offset: float = 0.0
    table: Mapping[int, int] = field(default_factory=dict)

    def __str__(self) -> str:
        return f"{label(*self.source)} -> {label(*self.target)}"


@dataclass(frozen=True)
class Hop:
    """One step of a value on its way: to a connector in this unit (None: it has none), then transformed.

    same_units: False where the author takes care of units.
    """

    unit: Unit | None
    same_units: bool = True
    transformation: Transformation = UNCHANGED


@dataclass
class Wiring:
    """What the connections say. feeders: by the node that is fed, the node that feeds it and the connection between.

    links: those that begin at an output of an FMU.
    """

    description: Description
    interfaces: Mapping[str, Interface]
    feeders: dict[Node, tuple[Node, Connection]] = field(default_factory=dict)
    links: tuple[Link, ...] = ()

    def __post_init__(self) -> None:
        self._connectors = {c.name: c.connectors for c in self.description.components} | self.description.systems

    @staticmethod
    def of_one(interface: Interface) -> Wiring:
        """That of a single FMU."""
        alone = Description(Path(), interface.component, "", (), {}, (), (), None, None, None)
        return Wiring(alone, {interface.component: interface})

    @cached_property
    def ways(self) -> list[list[Node]]:
        """Ways to every variable of an FMU that is fed; to be asked for when all feeders are known."""
        return [self.way_to(target) for target in self.feeders if target[0] in self.interfaces]

    def way_to(self, target: Node) -> list[Node]:
        """Nodes from the one that nothing feeds to the target. It ends early where it would go in a circle."""
        way = [target]
        while way[0] in self.feeders:
            before = self.feeders[way[0]][0]
            if before in way:
                break
            way.insert(0, before)
        return way

    def fed_by(self, node: Node) -> list[list[Node]]:
        """Ways from a connector of a system to every variable of an FMU that gets its value."""
        return [way[way.index(node) :] for way in self.ways if node in way]

    def hops(self, way: Sequence[Node]) -> list[Hop]:
        """What happens on a way, after its first node."""
        hops = []
        for node in way[1:]:
            connection = self.feeders[node][1]
            hops.append(Hop(self.unit(node), connection.same_units, connection.transformation))
            hops += self._into_fmu(node)
        return hops

    def unit(self, node: Node) -> Unit | None:
        """Unit of a connector: as declared there, else that of the FMU's variable."""
        declared = self._connectors.get(node[0], {}).get(node[1])
        if declared is None or declared.unit is None:
            return self._unit_of_variable(node)
        if declared.unit.base is None and node[0] in self.interfaces:  # the FMU may say what it is
            return self.interfaces[node[0]].units.get(declared.unit.name, declared.unit)
        return declared.unit

    def _unit_of_variable(self, node: Node) -> Unit | None:
        interface = self.interfaces.get(node[0])
        variable = interface.variables.get(node[1]) if interface else None
        return interface.unit(variable) if interface and variable is not None else None

    def _into_fmu(self, node: Node) -> list[Hop]:
        """From a declared connector to the variable behind it, which may have another unit."""
        behind = self._unit_of_variable(node)
        return [Hop(behind)] if behind and behind != self.unit(node) else []

    def link(self, way: Sequence[Node]) -> Link:
        """The link along a way between variables of FMUs. Raises UnitError and ValueError for what does not fit."""
        (a, x), (b, y) = way[0], way[-1]
        source, target = self.interfaces[a].variables[x], self.interfaces[b].variables[y]
        kinds = representation(source), representation(target)
        if kinds[0] != kinds[1] and kinds != ("Integer", "Real"):
            raise ValueError(f"types differ: {source.type} and {target.type}")
        if kinds[0] not in ("Real", "Integer", "Boolean"):
            raise ValueError(f"{kinds[0]} variables cannot be connected")
        first = self.unit(way[0])
        behind = self._unit_of_variable(way[0])
        hops = ([Hop(first)] if behind and behind != first else []) + self.hops(way)
        linear = carried(behind or first, hops)
        table = mapped([hop.transformation for hop in hops], source, target)
        if kinds[1] != "Real" and linear != SAME:
            raise ValueError(f"a LinearTransformation needs Real variables, not {kinds[1]}")
        return Link((a, source), (b, target), linear.factor, linear.offset, table)


def carried(unit: Unit | None, hops: Iterable[Hop]) -> Linear:
    """What the hops do to a value that begins in a unit. Raises UnitError."""
    whole = SAME
    for hop in hops:
        if hop.same_units:
            whole = whole.then(conversion(unit, hop.unit))
            unit = hop.unit or unit
        else:
            unit = hop.unit
        whole = whole.then(hop.transformation.linear)
    return whole


def mapped(transformations: Sequence[Transformation], source: Any, target: Any) -> dict[int, int]:
    """What the tables among transformations do together to whole numbers, and to the numbers of truth values."""
    tables = [
        {
            _whole(before, source if i == 0 else target): _whole(after, target)
            for before, after in (transformation.table or {}).items()
        }
        for i, transformation in enumerate(t for t in transformations if t.table)
    ]
    together = {}
    for number in {before for table in tables for before in table}:
        value = number
        for table in tables:
            value = table.get(value, value)
        together[number] = value
    return together


def _whole(text: str, variable: Any) -> int:
    """Number of an entry of a table: a whole one, a truth value, or the name of an item. Raises ValueError."""
    if text in ("true", "false"):
        return int(text == "true")
    items = items_of(variable)
    if text in items:
        return items[text]
    try:
        return int(text)
    except ValueError:
        known = ", ".join(items) or "none"
        raise ValueError(f"{text!r} is no item of {variable.name}; there is {known}") from None
