"""Connectors of components, systems and signal dictionaries."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from lxml import etree

from ..units import Unit
from .files import NAMESPACES, Sources, first_child, required


@dataclass(frozen=True)
class Connector:
    """A declared connector of a component or system; kind, type and unit are None where the description is silent."""

    kind: str | None
    type: str | None
    unit: Unit | None
    where: str


def connectors_of(element: Any, files: Sources, units: Mapping[str, Unit]) -> Iterator[tuple[str, Connector]]:
    """Names and connectors of a component, a system or a reference to a signal dictionary."""
    for connector in element.iterfind("ssd:Connectors/ssd:Connector", NAMESPACES):
        yield required(connector, "name", files.ssd), connector_of(connector, connector.get("kind"), files, units)


def connector_of(element: Any, kind: str | None, files: Sources, units: Mapping[str, Unit]) -> Connector:
    """A connector of this kind, or an entry of a signal dictionary."""
    declared = first_child(element, "ssc")
    unit = None if declared is None else declared.get("unit")
    return Connector(
        kind,
        element.get("type") if declared is None else etree.QName(declared).localname,  # some write an attribute
        None if not unit else units.get(unit, Unit(unit)),
        files.where(element),
    )
