"""What an FMU offers to a system: its variables, their units and bounds, and names to suggest."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from difflib import SequenceMatcher
from pathlib import Path
from typing import Any

_SUGGESTIONS = 4


class WiringError(ValueError):
    """A description or an argument does not fit the FMUs. ``problems`` holds one line each."""

    def __init__(self, subject: Path, problems: Iterable[str], fault: str = "does not fit its FMUs") -> None:
        self.problems = tuple(problems)
        super().__init__("\n  ".join((f"{subject} {fault}:", *self.problems)))


@dataclass(frozen=True)
class Interface:
    """Variables (fmpy ModelVariable) of one component by name, in the order of its FMU."""

    component: str
    variables: dict[str, Any]

    def of(self, *causalities: str) -> list[Any]:
        """Variables of these causalities, in the order of the FMU."""
        return [variable for variable in self.variables.values() if variable.causality in causalities]

    def suggest(self, name: str, causality: str, unit: str | None) -> str:
        """End of a message: variables of this causality and unit (None: any), those most like ``name`` first."""
        fitting = [v.name for v in self.of(causality) if unit is None or unit_of(v) == unit]
        return f"{causality.capitalize()}s of {self.component}{f' in {unit}' if unit else ''}: {near(name, fitting)}"


def representation(variable: Any) -> str:
    """The type that carries the variable's value: Real, Integer, Boolean or String; Binary and Clock carry none."""
    return "Integer" if variable.type == "Enumeration" else variable.type


def unit_of(variable: Any) -> str | None:
    """Unit of a variable, its own or its declared type's; None where the FMU does not say."""
    return variable.unit or (variable.declaredType.unit if variable.declaredType else None)


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
