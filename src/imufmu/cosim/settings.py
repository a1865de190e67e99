"""Start values of a system's parameters and inputs, every one checked against its FMU."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .description import Description, ParameterValue
from .interface import Interface, bounds_of, near, representation, unit_of

Value = float | int | bool | str

_GIVEN = "parameters"  # where values stand that come with a call


@dataclass(frozen=True)
class Setting:
    """The start value of one variable (fmpy ModelVariable), of the variable's type."""

    component: str
    variable: Any
    value: Value


def bound_settings(
    description: Description, interfaces: Mapping[str, Interface], problems: list[str]
) -> tuple[Setting, ...]:
    """Values that the description binds, those of the system over those of a component. Problems are added."""
    bound = [(component.name, value) for component in description.components for value in component.values]
    for value in description.values:
        component, _, name = value.name.partition(".")
        bound.append((component, replace(value, name=name)))
    return _checked(bound, interfaces, problems)


def given_settings(
    parameters: Mapping[str, Any], interfaces: Mapping[str, Interface], problems: list[str]
) -> tuple[Setting, ...]:
    """Values by ``component.variable``; a vector may be given by its name, with one value or one per element."""
    given = []
    for full_name, value in parameters.items():
        component, _, name = full_name.partition(".")
        names = [name]
        if component in interfaces and name not in interfaces[component].variables:
            names = [other for other in interfaces[component].variables if other.startswith(f"{name}[")] or [name]
        values = np.asarray(value).reshape(-1).tolist()
        if len(values) == 1:
            values *= len(names)
        if len(values) != len(names):
            problems.append(f"parameters: {full_name}: {len(values)} values for {len(names)} elements")
            continue
        given += [(component, _as_written(n, v)) for n, v in zip(names, values, strict=True)]
    return _checked(given, interfaces, problems)


def merged(*settings: Iterable[Setting]) -> tuple[Setting, ...]:
    """One setting per variable: the last one."""
    return tuple({(s.component, s.variable.name): s for part in settings for s in part}.values())


def _as_written(name: str, value: Any) -> ParameterValue:
    kind = {bool: "Boolean", int: "Integer", str: "String"}.get(type(value), "Real")
    text = str(value).lower() if kind == "Boolean" else str(value)
    return ParameterValue(name, kind, text, None, _GIVEN)


def _checked(
    bound: Iterable[tuple[str, ParameterValue]], interfaces: Mapping[str, Interface], problems: list[str]
) -> tuple[Setting, ...]:
    settings = []
    for component, given in bound:
        start = f"{given.where}: {component}.{given.name} = {given.value}"
        if component not in interfaces:
            problems.append(f"{start}: there is no component {component!r}; there is {', '.join(interfaces)}")
            continue
        settable = {v.name: v for v in interfaces[component].variables.values() if _is_settable(v)}
        if given.name not in settable:
            problems.append(f"{start}: no parameter of its FMU. Near: {near(given.name, settable)}")
            continue
        variable = settable[given.name]
        reason = _misfit(given, variable)
        if reason:
            problems.append(f"{start}{f' {given.unit}' if given.unit else ''}: {reason}")
        else:
            settings.append(Setting(component, variable, _parsed(given, variable)))
    return merged(settings)


def _is_settable(variable: Any) -> bool:
    """Whether FMI lets it be set before initialisation: parameters, inputs, and what has a start value of its own."""
    own_start = variable.initial in ("exact", "approx") and variable.variability != "constant"
    return variable.causality in ("parameter", "input") or (own_start and variable.causality in ("output", "local"))


def _misfit(given: ParameterValue, variable: Any) -> str:
    """Why the value cannot be that of the variable; empty if it can."""
    unit = unit_of(variable)
    if given.unit and unit and given.unit != unit:
        return f"the FMU wants {unit}"
    try:
        value = _parsed(given, variable)
    except ValueError:
        return f"expected a value of type {variable.type}"
    low, high = bounds_of(variable)
    if not isinstance(value, str) and not low <= value <= high:
        return f"outside [{low:g}, {high:g}]{f' {unit}' if unit not in (None, '1') else ''}"
    return ""


def _parsed(given: ParameterValue, variable: Any) -> Value:
    """The value in the variable's type; whole numbers pass between Integer and Real. Raises ValueError."""
    kind = representation(variable)
    if kind == "String" and (given.type == "String" or given.where == _GIVEN):  # what is typed may look like a number
        return given.value
    if kind == "Boolean" and given.value in ("true", "1", "false", "0"):
        return given.value in ("true", "1")
    if kind not in ("Real", "Integer") or given.type not in ("Real", "Integer", "Enumeration"):
        raise ValueError(kind)
    number = float(given.value)
    if not math.isfinite(number) or (kind == "Integer" and number != int(number)):
        raise ValueError(kind)
    return int(number) if kind == "Integer" else number
