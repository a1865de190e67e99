"""Parameter sets and the mapping of their names, as a binding of a system or component applies them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from lxml import etree

from ..units import Unit
from .files import (
    NAMESPACES,
    DescriptionError,
    Sources,
    check_root,
    enumerations_in,
    first_child,
    read_bytes,
    read_root,
    required,
    units_in,
)
from .transformations import UNCHANGED, Transformation, transformation_of

_SET = "application/x-ssp-parameter-set"
_MAPPING = "application/x-ssp-parameter-mapping"


@dataclass(frozen=True)
class ParameterValue:
    """One value of a parameter set: text as written, its SSP type, and where it stands.

    same_units: False where the author takes care of units. items: of its enumeration, where the file defines it.
    """

    name: str
    type: str
    value: str
    unit: Unit | None
    where: str
    transformation: Transformation = UNCHANGED
    same_units: bool = True
    items: tuple[tuple[str, int], ...] = ()


def bound_values(element: Any, files: Sources, component: Path | None) -> tuple[ParameterValue, ...]:
    """Values bound to a component or system by the names that they have there, later ones taking precedence.

    component: the component's file.
    """
    values: list[ParameterValue] = []
    for binding in element.iterfind("ssd:ParameterBindings/ssd:ParameterBinding", NAMESPACES):
        if binding.get("type", _SET) != _SET:
            raise DescriptionError(f"{files.where(binding)}: only parameter sets (.ssv) are supported")
        prefix = binding.get("prefix", "")
        found = [replace(value, name=prefix + value.name) for value in _sets(binding, files, component)]
        mapping = binding.find("ssd:ParameterMapping", NAMESPACES)
        values += found if mapping is None else _mapped(found, _mapping(mapping, files, component))
    return tuple(values)


def _sets(binding: Any, files: Sources, component: Path | None) -> Iterator[ParameterValue]:
    if binding.get("source") is not None:
        content, path = files.content(binding, component)
        yield from _values(read_root(content, path, "ParameterSet", files.faults), path, {}, files.faults)
    for inline in binding.iterfind("ssd:ParameterValues/{*}ParameterSet", NAMESPACES):
        check_root(inline, files.ssd, "ParameterSet", files.faults)
        around = {} if inline.find("ssv:Units", NAMESPACES) is not None else units_in(inline.getroottree().getroot())
        yield from _values(inline, files.ssd, around, files.faults)


def _values(root: Any, path: Path, units: dict[str, Unit], faults: list[str]) -> Iterator[ParameterValue]:
    units = units | units_in(root)
    enumerations = enumerations_in(root)
    for parameter in root.iterfind("ssv:Parameters/ssv:Parameter", NAMESPACES):
        where = f"{path}, line {parameter.sourceline}"
        value = first_child(parameter, "ssv")
        name = required(parameter, "name", path)
        if value is None:
            faults.append(f"{where}: {name} has no value")
            continue
        text = value.get("value")
        if text is None:  # SSP 2.0 has child elements for the texts of an array
            text = " ".join(inner.get("value", "") for inner in value.iterfind("ssv:Value", NAMESPACES))
        items = enumerations.get(value.get("name", ""), {})
        unit = value.get("unit")
        known = None if not unit else units.get(unit, Unit(unit))
        yield ParameterValue(name, etree.QName(value).localname, text, known, where, items=tuple(items.items()))


def read_parameter_set(path: Path) -> list[ParameterValue]:
    """Values of an .ssv file. Raises DescriptionError and ArchiveError."""
    return list(_values(read_root(read_bytes(path), path, "ParameterSet", []), path, {}, []))


@dataclass(frozen=True)
class _Entry:
    source: str
    target: str
    transformation: Transformation
    same_units: bool


def _mapping(element: Any, files: Sources, component: Path | None) -> list[_Entry]:
    """Entries of a parameter mapping, inline or in a file of its own."""
    if element.get("type", _MAPPING) != _MAPPING:
        raise DescriptionError(f"{files.where(element)}: only parameter mappings (.ssm) are supported")
    where = files
    if element.get("source") is not None:
        content, path = files.content(element, component)
        root = read_root(content, path, "ParameterMapping", files.faults)
        where = replace(files, ssd=path)
    else:
        root = element.find("{*}ParameterMapping")
        if root is None:
            files.faults.append(f"{files.where(element)}: a ParameterMapping without entries; no value is applied")
            return []
        check_root(root, files.ssd, "ParameterMapping", files.faults)
    return [
        _Entry(
            required(entry, "source", where.ssd),
            required(entry, "target", where.ssd),
            transformation_of(entry, where),
            entry.get("suppressUnitConversion") not in ("true", "1"),
        )
        for entry in root.iterfind("ssm:MappingEntry", NAMESPACES)
    ]


def _mapped(values: list[ParameterValue], entries: list[_Entry]) -> list[ParameterValue]:
    """Values under the names of their targets; those that no entry mentions are not applied."""
    by_name: dict[str, list[ParameterValue]] = {}
    for value in values:
        by_name.setdefault(value.name, []).append(value)
    return [
        replace(value, name=entry.target, transformation=entry.transformation, same_units=entry.same_units)
        for entry in entries
        for value in by_name.get(entry.source, [])
    ]
