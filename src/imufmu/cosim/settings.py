"""Start values of a system's parameters and inputs, every one checked against its FMU."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .interface import bounds_of, items_of, near, representation
from .links import Hop, Wiring, carried, mapped
from .ssp.parameters import ParameterValue
from .units import SAME, Linear, Unit, UnitError, conversion, quantity

Value = float | int | bool | str

_GIVEN = "parameters"  # where values stand that come with a call
_TOLD = 5  # names of unknown values told at once


@dataclass(frozen=True)
class Setting:
    """The start value of one variable (fmpy ModelVariable), of the variable's type."""

    component: str
    variable: Any
    value: Value


def bound_settings(wiring: Wiring, problems: list[str], faults: list[str]) -> tuple[Setting, ...]:
    """Values that the description binds, the later ones in force. Problems are added.

    A value of a name that is nowhere is left out, as SSP wants it (5.2.3), and goes to the faults.
    """
    resolver = Resolver(wiring)
    settings, unknown = [], []
    for value in wiring.description.values:
        try:
            found = resolver.settings(value)
        except ValueError as error:
            problems.append(f"{value.where}: {value.name} = {_shown(value)}: {error}")
            continue
        settings += found or []
        if found is None:
            unknown.append(value)
    if unknown:
        first = unknown[0]
        told = ", ".join(value.name for value in unknown[:_TOLD])
        more = f" and {len(unknown) - _TOLD} more" if len(unknown) > _TOLD else ""
        faults.append(f"{first.where}: not used, as nothing has the name: {told}{more}. {resolver.near(first.name)}")
    return merged(settings)


def given_settings(parameters: Mapping[str, Any], wiring: Wiring, problems: list[str]) -> tuple[Setting, ...]:
    """Values by ``component.variable``; a vector may be given by its name, with one value or one per element.

    A value may be a text with its unit, such as "500 mm" or "0, 0, 1 deg". Values of a system go by the name of its
    connector.
    """
    resolver = Resolver(wiring)
    settings: list[Setting] = []
    for name, value in parameters.items():
        texts = [_as_written(each) for each in np.asarray(value, dtype=object).reshape(-1)]
        kind = texts[0][0] if len({kind for kind, _ in texts}) == 1 else "Real"
        given = ParameterValue(name, kind, " ".join(text for _, text in texts), None, _GIVEN)
        shown = f"{_GIVEN}: {name} = {', '.join(text for _, text in texts)}"
        try:
            found = resolver.settings(given, [text for _, text in texts])
        except ValueError as error:
            problems.append(f"{shown}: {error}")
            continue
        if found is None:
            problems.append(f"{shown}: {resolver.near(name)}")
        settings += found or []
    return merged(settings)


def merged(*settings: Iterable[Setting]) -> tuple[Setting, ...]:
    """One setting per variable: the last one."""
    return tuple({(s.component, s.variable.name): s for part in settings for s in part}.values())


class Resolver:
    """Finds what a name means in a system, and gives values the type and unit of their variables."""

    def __init__(self, wiring: Wiring) -> None:
        self._wiring = wiring
        self._interfaces = wiring.interfaces
        self._settable: dict[str, dict[str, Any]] = {}

    def settings(self, given: ParameterValue, texts: Sequence[str] | None = None) -> list[Setting] | None:
        """Settings that a value makes, by the name of a variable, a vector or a connector; None if there is none.

        texts: its single values, where it is several. Raises ValueError for a value that does not fit.
        """
        for component, name in self._splits(given.name, self._interfaces):
            interface = self._interfaces[component]
            names = [name] if name in interface.variables else interface.elements(name)
            if names:
                return self._of_elements(component, names, given, texts)
        for system, name in self._splits(given.name, self._wiring.description.systems):
            if name in self._wiring.description.systems[system]:
                return self._of_connector((system, name), given)
        return None

    @staticmethod
    def _splits(name: str, known: Collection[str]) -> Iterator[tuple[str, str]]:
        """Ways to take a name for one of a known element and the name in it, the longest element first."""
        at = len(name)
        while (at := name.rfind(".", 0, at)) >= 0:
            if name[:at] in known:
                yield name[:at], name[at + 1 :]
        if "" in known:
            yield "", name

    def _of_elements(
        self, component: str, names: Sequence[str], given: ParameterValue, texts: Sequence[str] | None
    ) -> list[Setting]:
        """One setting per element; one value stands for all, and the unit of the last one for all."""
        variables = self._interfaces[component].variables
        single = len(names) == 1
        if texts is None or len(texts) == 1:
            texts = [given.value] if single or (given.type == "String" and "," not in given.value) else _parts(given)
        if len(texts) == 1:
            texts = list(texts) * len(names)
        if len(texts) != len(names):
            raise ValueError(f"{len(texts)} values for {len(names)} elements")
        return [
            self._setting(component, variables[name], replace(given, value=text))
            for name, text in zip(names, texts, strict=True)
        ]

    def _of_connector(self, node: tuple[str, str], given: ParameterValue) -> list[Setting]:
        """Settings of all variables that get the value of a connector of a system."""
        settings = []
        first = Hop(self._wiring.unit(node), given.same_units, given.transformation)
        for way in self._wiring.fed_by(node):
            component, name = way[-1]
            settings.append(
                self._setting(
                    component, self._interfaces[component].variables[name], given, [first, *self._wiring.hops(way)]
                )
            )
        return settings

    def _setting(
        self, component: str, variable: Any, given: ParameterValue, hops: Sequence[Hop] | None = None
    ) -> Setting:
        """The setting of one variable. hops: on the way there, where it is not given to the variable itself."""
        if self._interfaces[component].why_unclear(variable.name):
            raise ValueError(self._interfaces[component].why_unclear(variable.name))
        if component not in self._settable:
            every = self._interfaces[component].variables.values()
            self._settable[component] = {v.name: v for v in every if _is_settable(v)}
        settable = self._settable[component]
        if variable.name not in settable:
            raise ValueError(f"no parameter of its FMU. Near: {near(variable.name, settable)}")
        unit = self._interfaces[component].unit(variable)
        value = _parsed(given, variable, unit, self._units_of(component, given), hops)
        low, high = bounds_of(variable)
        if not isinstance(value, str) and not low <= value <= high:
            name = f" {unit}" if unit and unit.name != "1" else ""
            converted = f"{value:g}{name} is " if value != _number_or_none(given.value) else ""
            raise ValueError(f"{converted}outside [{low:g}, {high:g}]{name}")
        return Setting(component, variable, value)

    def _units_of(self, component: str, given: ParameterValue) -> Unit | None:
        """Unit of a value; what it means may stand in the FMU alone."""
        if given.unit is None or given.unit.base is not None:
            return given.unit
        return self._interfaces[component].units.get(given.unit.name, given.unit)

    def near(self, name: str) -> str:
        """What there is instead of a name that means nothing, for messages."""
        for component, inner in self._splits(name, self._interfaces):
            settable = [v.name for v in self._interfaces[component].variables.values() if _is_settable(v)]
            return f"no parameter of its FMU. Near: {near(inner, settable)}"
        connectors = self._wiring.description.systems.get("", {})
        there = ", ".join([*self._interfaces, *connectors])
        return f"there is no component {name.partition('.')[0]!r}; there is {there}"


def _as_written(value: Any) -> tuple[str, str]:
    """Type and text of a value of a call."""
    if isinstance(value, bool | np.bool_):
        return "Boolean", str(bool(value)).lower()
    if isinstance(value, str):
        return "String", value
    if isinstance(value, int | np.integer):
        return "Integer", str(value)
    return "Real", str(value if not isinstance(value, np.floating) else float(value))


def _parts(given: ParameterValue) -> list[str]:
    """Values of a vector in one text: apart by commas, or by blanks as in SSP 2.0; a last unit counts for all."""
    if given.type != "String":
        return given.value.split() or [given.value]
    parts = [part.strip() for part in given.value.split(",")]
    number, _, unit = parts[-1].partition(" ")
    if unit and all(_number_or_none(part) is not None for part in (*parts[:-1], number)):
        return [f"{part} {unit}" for part in (*parts[:-1], number)]
    return parts


def _shown(given: ParameterValue) -> str:
    return f"{given.value}{f' {given.unit}' if given.unit else ''}"


def _is_settable(variable: Any) -> bool:
    """Whether FMI lets it be set before initialisation: parameters, inputs, and what has a start value of its own."""
    own_start = variable.initial in ("exact", "approx") and variable.variability != "constant"
    return variable.causality in ("parameter", "input") or (own_start and variable.causality in ("output", "local"))


def _parsed(
    given: ParameterValue, variable: Any, unit: Unit | None, given_unit: Unit | None, hops: Sequence[Hop] | None
) -> Value:
    """The value in the variable's type and unit. Raises ValueError; UnitError where that says why."""
    kind = representation(variable)
    wrong = ValueError(f"expected a value of type {variable.type}")
    typed = given.where == _GIVEN  # what is typed may look like anything
    if kind == "String":
        if given.type == "String" or typed:
            return given.value
        raise wrong
    text = (
        given.value.strip()
        if hops
        else (given.transformation.table or {}).get(given.value.strip(), given.value.strip())
    )
    table = mapped([hop.transformation for hop in hops or []], variable, variable)
    if kind == "Boolean":
        if text not in ("true", "1", "false", "0"):
            raise wrong
        whole = int(text in ("true", "1"))
        return bool(table.get(whole, whole))
    if text in items_of(variable):
        text = str(items_of(variable)[text])
    elif given.type == "Enumeration" and items_of(variable) and _number_or_none(text) is None:
        raise ValueError(f"{variable.name} has no item {text!r}; its items are {', '.join(items_of(variable))}")
    elif given.type == "Enumeration":
        text = str(dict(given.items).get(text, text))
    elif given.type == "Boolean" or (given.type == "String" and not typed):
        raise wrong
    number = _number_or_none(text)
    if number is not None:
        number = _way(given, given_unit, unit, hops)(number)
    elif typed and kind == "Real" and text[:1] in tuple("+-.0123456789"):
        own = (hops[0].unit if hops else None) or unit
        number = carried(None, hops or [])(quantity(text, own))
    if number is None or not math.isfinite(number) or (kind == "Integer" and number != int(number)):
        raise wrong
    return table.get(int(number), int(number)) if kind == "Integer" else number


def _way(given: ParameterValue, given_unit: Unit | None, unit: Unit | None, hops: Sequence[Hop] | None) -> Linear:
    """What becomes of a number in its own unit on its way into a variable."""
    if hops:
        return carried(given_unit, hops)
    try:
        linear = conversion(given_unit, unit) if given.same_units else SAME
    except UnitError as error:
        raise UnitError(f"the FMU wants {unit}: {error}") from error
    return linear.then(given.transformation.linear)


def _number_or_none(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None
