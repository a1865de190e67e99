"""Values of parameters as one flat vector, and what is wrong with them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .signals import Parameter


class ParameterError(ValueError):
    """Parameter values out of bounds, or unknown; the message names each."""


def flat_parameters(
    parameters: Sequence[Parameter], values: Mapping[str, Any], owner: str
) -> tuple[np.ndarray, list[str]]:
    """Start values with ``values`` of parameters or elements in their place, and a line per value that does not fit."""
    starts: list[float] = []
    places: dict[str, slice] = {}
    for parameter in parameters:
        first = len(starts)
        starts += parameter.start_values()
        places |= {name: slice(first + i, first + i + 1) for i, name in enumerate(parameter.element_names())}
        places[parameter.name] = slice(first, first + parameter.size)
    p, problems = np.array(starts), []
    for name, value in values.items():
        if name not in places:
            problems.append(f"{name}: unknown; {owner} has {', '.join(q.name for q in parameters)}")
            continue
        try:
            flat = np.asarray(value, dtype=float).reshape(-1)
        except (TypeError, ValueError):
            problems.append(f"{name}: {value!r} is not a number")
            continue
        if flat.size not in (1, places[name].stop - places[name].start):
            problems.append(f"{name}: {flat.size} values for {places[name].stop - places[name].start} elements")
            continue
        p[places[name]] = flat
    return p, problems


def parameter_problems(parameters: Sequence[Parameter], p: np.ndarray) -> list[str]:
    """One line per element of the flat vector that is out of bounds or of the wrong kind."""
    problems = []
    named = [(name, declared) for declared in parameters for name in declared.element_names()]
    for (name, declared), value in zip(named, p, strict=True):
        if not declared.minimum <= value <= declared.maximum:
            unit = "" if declared.unit == "1" else f" {declared.unit}"
            problems.append(f"{name} = {value:g}{unit} is outside [{declared.minimum:g}, {declared.maximum:g}]{unit}")
        elif declared.kind != "real" and value != round(value):
            problems.append(f"{name} = {value:g} is not a whole number")
    return problems
