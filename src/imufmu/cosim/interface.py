"""What an FMU offers to a system: its variables, their units and bounds, and names to suggest."""

from __future__ import annotations

import math
import sys
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from difflib import SequenceMatcher
from functools import cached_property
from pathlib import Path
from typing import Any

from attrs import asdict

from .units import Unit, defined

_SUGGESTIONS = 4


class WiringError(ValueError):
    """A description or an argument does not fit the FMUs. ``problems`` holds one line each."""

    def __init__(self, subject: Path, problems: Iterable[str], fault: str = "does not fit its FMUs") -> None:
        self.problems = tuple(problems)
        super().__init__("\n  ".join((f"{subject} {fault}:", *self.problems)))


@dataclass(frozen=True)
class Interface:
    """Variables (fmpy ModelVariable) of one component by name, in the order of its FMU, and the units it defines."""

    component: str
    variables: dict[str, Any]
    units: Mapping[str, Unit] = field(default_factory=dict)
    unclear: frozenset[str] = frozenset()  # names that several variables have

    @staticmethod
    def of_model(component: str, model: Any) -> Interface:
        """Interface of an FMU with this ModelDescription (fmpy)."""
        units = {
            unit.name: defined(unit.name, asdict(unit.baseUnit)) if unit.baseUnit else Unit(unit.name)
            for unit in model.unitDefinitions
        }
        counted = Counter(variable.name for variable in model.modelVariables)
        unclear = frozenset(name for name, count in counted.items() if count > 1)
        return Interface(component, {variable.name: variable for variable in model.modelVariables}, units, unclear)

    def unit(self, variable: Any) -> Unit | None:
        """Unit of a variable with what the FMU says of it; None where the FMU does not say."""
        name = unit_of(variable)
        if not name:
            return None
        unit = self.units.get(name, Unit(name))
        relative = any(getattr(of, "relativeQuantity", False) for of in (variable, variable.declaredType))
        if relative and unit.base and unit.base.offset:
            return Unit(name, replace(unit.base, offset=0.0))
        return unit

    def elements(self, name: str) -> list[str]:
        """Names of the elements of a vector or matrix, in the order of their indices; empty for any other name."""
        return self._elements.get(name, [])

    @cached_property
    def _elements(self) -> dict[str, list[str]]:
        found: dict[str, list[str]] = {}
        for variable in self.variables:
            name, bracket, _ = variable.rpartition("[")
            if bracket and variable.endswith("]"):
                found.setdefault(name, []).append(variable)
        return {name: sorted(elements, key=_index) for name, elements in found.items()}

    def counts_from(self, name: str) -> int | None:
        """0 or 1 for an element such as x[2] of a vector with three or more of that number on; None for any other."""
        vector = name.rpartition("[")[0]
        elements = self.elements(vector)
        return next((i for i in (0, 1) if elements[:3] == [f"{vector}[{i + k}]" for k in range(3)]), None)

    def of(self, *causalities: str) -> list[Any]:
        """Variables of these causalities, in the order of the FMU."""
        return [variable for variable in self.variables.values() if variable.causality in causalities]

    def why_unclear(self, name: str) -> str:
        """Why a name cannot be used, for messages; empty if it can."""
        return "several variables of the FMU have this name: which one is meant?" if name in self.unclear else ""

    def suggest(self, name: str, causality: str, unit: str | None) -> str:
        """End of a message: variables of this causality and unit (None: any), those most like ``name`` first."""
        fitting = [v.name for v in self.of(causality) if unit is None or unit_of(v) == unit]
        return f"{causality.capitalize()}s of {self.component}{f' in {unit}' if unit else ''}: {near(name, fitting)}"


def _index(element: str) -> tuple[int, ...]:
    """Indices of an element, such as (2, 1) of x[2,1]; those that are no numbers come last."""
    inside = element.rpartition("[")[2].rstrip("]").split(",")
    return tuple(int(text) if text.strip().isdecimal() else sys.maxsize for text in inside)


def representation(variable: Any) -> str:
    """The type that carries the variable's value: Real, Integer, Boolean or String; Binary and Clock carry none."""
    return "Integer" if variable.type == "Enumeration" else variable.type


def unit_of(variable: Any) -> str | None:
    """Unit of a variable, its own or its declared type's; None where the FMU does not say."""
    return variable.unit or (variable.declaredType.unit if variable.declaredType else None)


def number_of(text: Any) -> float | None:
    """A number or truth value that fmpy leaves as text; None where there is none, or an FMU with faults has another."""
    plain = str(text).strip()
    try:
        value = float(plain == "true") if plain in ("true", "false") else float(plain)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def items_of(variable: Any) -> dict[str, int]:
    """Items of an Enumeration by name; empty for any other variable."""
    declared = variable.declaredType
    return {item.name: int(item.value) for item in declared.items} if declared is not None else {}


def bounds_of(variable: Any) -> tuple[float, float]:
    """Least and greatest value, the variable's own or its declared type's; infinite where the FMU does not say."""
    low, high = variable.min, variable.max
    if variable.declaredType:
        low = variable.declaredType.min if low is None else low
        high = variable.declaredType.max if high is None else high
    return (-math.inf if low is None else float(low)), (math.inf if high is None else float(high))


def label(component: str, variable: Any) -> str:
    """The variable with its unit, for messages."""
    unit = unit_of(variable)
    return f"{component}.{variable.name}" + (f" [{unit}]" if unit else "")


def near(name: str, known: Iterable[str]) -> str:
    """The known names most like ``name``, for messages."""
    ranked = sorted(known, key=lambda other: (-SequenceMatcher(None, name, other).ratio(), other))
    return ", ".join(ranked[:_SUGGESTIONS]) or "none"
