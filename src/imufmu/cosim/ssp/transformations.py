"""Transformations of SSP: of values on a connection, and of values of parameters (SSP 1.0, 4.4.1)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from lxml import etree

from ..units import SAME, Linear
from .files import NAMESPACES, Sources, first_child, number, required

_BOOLEANS = {"true": "true", "1": "true", "false": "false", "0": "false"}


@dataclass(frozen=True)
class Transformation:
    """Of a value on its way: a linear one, or a table of its texts ("true", "3", name of an enumeration's item).

    What a table does not list stays as it is. kind: the type of values that the table is for.
    """

    linear: Linear = SAME
    table: Mapping[str, str] | None = None
    kind: str = "Real"


UNCHANGED = Transformation()


def transformation_of(element: Any, files: Sources) -> Transformation:
    """Transformation inside a Connection or a MappingEntry. Unknown ones go to the faults, and change nothing."""
    inner = first_child(element, "ssc")
    name = "" if inner is None else etree.QName(inner).localname
    if name == "LinearTransformation":
        factor, offset = (number(inner, attribute, files.ssd) for attribute in ("factor", "offset"))
        return Transformation(Linear(1.0 if factor is None else factor, offset or 0.0))
    if name.endswith("MappingTransformation"):
        kind = name.removesuffix("MappingTransformation")
        table: dict[str, str] = {}
        for entry in inner.iterfind("ssc:MapEntry", NAMESPACES):
            source, target = (_text(required(entry, end, files.ssd), kind) for end in ("source", "target"))
            if table.setdefault(source, target) != target:
                files.faults.append(f"{files.where(entry)}: {source} is mapped twice; the first entry counts")
        return Transformation(SAME, table, kind)
    if name not in ("", "Annotations"):
        files.faults.append(f"{files.where(inner)}: {name} is no transformation of SSP; values stay as they are")
    return UNCHANGED


def _text(value: str, kind: str) -> str:
    return _BOOLEANS.get(value.strip(), value) if kind == "Boolean" else value
