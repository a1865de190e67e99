"""All limits over all seeds: one check per limit, and what decided it."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ..scoring.checks import Check, Suite
from .judging import Finding
from .limits import Bound, Limit, LimitsError
from .seeds import Demand
from .trials import Plan, Trial, seed_parameters, trials

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Outcome:
    """checks: one per limit. worst: seed of the run that decided each. runs: made; planned."""

    name: str
    checks: Sequence[Check]
    worst: Sequence[int | None]
    runs: int
    planned: int
    seconds: float
    notes: Sequence[str]

    @property
    def passed(self) -> bool:
        return all(check.passed for check in self.checks)

    def suite(self) -> Suite:
        """As every verdict is written."""
        return Suite(self.name, self.checks, self.seconds, self.notes)


def check_system(
    plan: Plan, limits: Sequence[Limit], seeds: int | None, jobs: int, progress: Progress | None = None
) -> Outcome:
    """Run a system once per seed, 1, 2, ..., and judge it; no further once the verdict on every limit is certain.

    seeds: None for one run as the description has it. Raises LimitsError for demands that so many runs cannot show,
    ExpressionError for limits that do not fit, and what reading a system raises.
    """
    began = clock.monotonic()
    planned = seeds or 1
    demands = [Demand(limit.runs, limit.confidence, planned) for limit in limits]
    for limit, demand in zip(limits, demands, strict=True):
        if not demand.possible:
            sure = f" with {100 * limit.confidence:g} % confidence" if limit.confidence else ""
            raise LimitsError(
                f"{limit.name!r}: {planned} runs cannot show {100 * limit.runs:g} %{sure}: if all hold, it is "
                f"{100 * demand.share(planned):.3g} %; take more seeds"
            )
    system = plan.read()
    notes = list(system.notes)
    if seeds and not seed_parameters(system):
        notes.append("no component has a parameter seed: one run says as much as many")
        planned, seeds = 1, None
        demands = [Demand(limit.runs, None, 1) for limit in limits]
    tallies = [_Tally(limit, demand) for limit, demand in zip(limits, demands, strict=True)]
    made = 0
    order: list[int | None] = list(range(1, planned + 1)) if seeds else [None]
    runs = trials(plan, system, limits, order, jobs)
    try:
        for one in runs:
            made += 1
            for k, tally in enumerate(tallies):
                tally.take(one, k)
            if progress:
                progress(made, planned)
            if all(tally.decided is not None for tally in tallies):
                break
    finally:
        runs.close()  # type: ignore[attr-defined]
    if made < planned:
        notes.append(f"{made} of {planned} runs were enough for a certain verdict")
    name = system.description.name
    seconds = clock.monotonic() - began
    return Outcome(name, [t.check() for t in tallies], [t.worst_seed for t in tallies], made, planned, seconds, notes)


class _Tally:
    """What is known of one limit so far."""

    def __init__(self, limit: Limit, demand: Demand) -> None:
        self._limit, self._demand = limit, demand
        self._passed = self._failed = 0
        self._worst: Finding | None = None
        self._reason = ""
        self.worst_seed: int | None = None
        self.decided: bool | None = None

    def take(self, trial: Trial, k: int) -> None:
        """Count a trial, unless the verdict is certain already."""
        if self.decided is not None:
            return
        finding, first = trial.findings[k], self._passed + self._failed == 0
        if finding is not None and finding.holds:
            self._passed += 1
        else:
            self._failed += 1
        if first or (not self._reason and _worse(finding, self._worst)):
            self._worst, self._reason, self.worst_seed = finding, trial.reasons[k], trial.seed
        self.decided = self._demand.decided(self._passed, self._failed)

    def check(self) -> Check:
        """The line of the verdict."""
        limit, demand, where = self._limit, self._demand, self._where()
        if demand.part < 1 or demand.confidence is not None:
            counted = f"{self._passed} of {self._passed + self._failed} runs hold"
            share = demand.share(self._passed) if self.decided else demand.share(demand.runs - self._failed)
            if demand.confidence is None:
                share = self._passed / (self._passed + self._failed)
            return Check(limit.name, 100 * share, 100 * demand.part, False, "%", limit.reason, f"{counted}; {where}")
        if self._worst is None:
            return Check(
                limit.name, math.nan, 0.0, True, "1", limit.reason, ": ".join(filter(None, (where, self._reason)))
            )
        bound, at_most = self._bound(self._worst)
        return Check(limit.name, self._worst.value, bound, at_most, self._worst.unit, limit.reason, where)

    def _bound(self, worst: Finding) -> tuple[float, bool]:
        """The bound that is nearest, in the unit of the finding, and its sense."""
        limit = self._limit
        if limit.kind != "statistic":
            return 0.0, False
        if limit.statistic == "finite":
            return 0.0, True
        if limit.at_least is None:
            return worst.value + worst.margin, True
        if limit.at_most is None:
            return worst.value - worst.margin, False
        upper = _plain(limit.at_most, worst)
        at_most = upper is None or math.isclose(upper - worst.value, worst.margin, rel_tol=1e-9, abs_tol=1e-300)
        return (worst.value + worst.margin, True) if at_most else (worst.value - worst.margin, False)

    def _where(self) -> str:
        seed = "" if self.worst_seed is None else f"seed {self.worst_seed}"
        at = "" if self._worst is None else f"t = {self._worst.time:.6g} s"
        return ", ".join(part for part in (seed, at) if part)


def _plain(bound: Bound, worst: Finding) -> float | None:
    return bound.value if bound.unit in (None, worst.unit) else None


def _worse(finding: Finding | None, than: Finding | None) -> bool:
    """A run that failed is worse than any, one that is no number worse than any number."""
    if finding is None or than is None:
        return finding is None and than is not None
    return not finding.margin >= than.margin
