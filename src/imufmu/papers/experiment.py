"""What an experiment of a paper is: a function that runs it, and the tables, figures and checks it comes back with."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from ..reports.page import Section

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Check:
    """One named criterion: a figure that must be at most, or at least, a limit.

    name: a claim, unique within its experiment. unit: of value and limit. reason: where the limit comes from.
    """

    name: str
    value: float
    limit: float
    at_most: bool = True
    unit: str = "1"
    reason: str = ""

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


@dataclass(frozen=True)
class Outcome:
    """What came out: sections of the report (tables beside the paper's values, figures), checks, and remarks in words.

    remarks: conclusions of the paper that do not reproduce, and why, one sentence each.
    """

    sections: Sequence[Section]
    checks: Sequence[Check]
    remarks: Sequence[str] = field(default=())

    @property
    def passed(self) -> bool:
        return all(check.passed for check in self.checks)


@dataclass(frozen=True)
class Experiment:
    """The experiments of one paper.

    run(quick, progress): quick takes fewer seeds; progress(done, total) is called now and then.
    """

    name: str
    title: str
    reference: str
    run: Callable[[bool, Progress], Outcome]
