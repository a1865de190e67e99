"""A criterion with its value: what every verdict consists of, of a paper's experiment as of a user's limit."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Check:
    """One named criterion: a figure that must be at most, or at least, a limit.

    name: a claim, unique among its like. unit: of value and limit. reason: where the limit comes from. where: what
    decided, as a seed and a time.
    """

    name: str
    value: float
    limit: float
    at_most: bool = True
    unit: str = "1"
    reason: str = ""
    where: str = ""

    @property
    def passed(self) -> bool:
        """False for NaN, too."""
        return self.value <= self.limit if self.at_most else self.value >= self.limit

    @property
    def margin(self) -> float:
        """Distance from the limit, relative to it (to the value where it is 0); negative where the check fails."""
        room = self.limit - self.value if self.at_most else self.value - self.limit
        scale = abs(self.limit) or abs(self.value) or 1.0
        return room / scale if math.isfinite(room) else math.nan


def at_most(name: str, value: float, limit: float, reason: str, unit: str = "1") -> Check:
    """The value must not exceed the limit."""
    return Check(name, float(value), limit, unit=unit, reason=reason)


def at_least(name: str, value: float, limit: float, reason: str, unit: str = "1") -> Check:
    """The value must reach the limit."""
    return Check(name, float(value), limit, at_most=False, unit=unit, reason=reason)


def value_text(check: Check) -> str:
    """The value with its unit."""
    return _quantity(check.value, check.unit)


def limit_text(check: Check) -> str:
    """The limit with its sense and unit."""
    return f"{'≤' if check.at_most else '≥'} {_quantity(check.limit, check.unit)}"


def margin_text(check: Check) -> str:
    """The margin in percent, of a value or limit that is not finite a dash."""
    return f"{100 * check.margin:.1f} %" if math.isfinite(check.margin) else "-"


def _quantity(value: float, unit: str) -> str:
    return f"{value:.4g}" + (f" {unit}" if unit != "1" else "")


@dataclass(frozen=True)
class Suite:
    """Checks that come from the same runs. seconds: those took. error: why they broke off, empty if they did not."""

    name: str
    checks: Sequence[Check]
    seconds: float = 0.0
    remarks: Sequence[str] = field(default=())
    error: str = ""

    @property
    def failed(self) -> Sequence[Check]:
        return [check for check in self.checks if not check.passed]
