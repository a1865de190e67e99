"""Runs of a system, one per seed, each judged where it was made: only findings come back.

Results come in the order of the seeds, whatever the number of workers, so that a verdict does not depend on it.
"""

from __future__ import annotations

import os
import signal
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass, field
from multiprocessing import get_context
from typing import Any

from ..cosim.errors import STEP_TIMEOUT, SimulationError
from ..cosim.master import simulate
from ..cosim.results import Result
from ..cosim.system import System, locate
from ..files.workers import no_ctrl_c_for_what_starts_here, workers_end_with_us
from .judging import Finding, NothingToJudge, judge
from .limits import Limit
from .table import Table

SEED = "seed"  # the name of the parameter, in every component that draws numbers


@dataclass(frozen=True)
class Plan:
    """What is run, again and again. system: name or path. parameters: as --set; those called seed stay as given."""

    system: str
    native: bool = False
    stop_time: float | None = None
    step: float | None = None
    parameters: Mapping[str, Any] = field(default_factory=dict)
    in_process: bool = False
    step_timeout: float = STEP_TIMEOUT

    def read(self) -> System:
        """Raises what System.read raises."""
        return System.read(locate(self.system), native=self.native)

    def run(self, system: System, seed: int | None) -> Result:
        """One run; seed: of every component with such a parameter, None to leave them. Raises as ``simulate``."""
        seeds = {} if seed is None else {name: seed for name in seed_parameters(system)}
        return simulate(
            system,
            stop_time=self.stop_time,
            step=self.step,
            parameters={**seeds, **self.parameters},
            in_process=self.in_process,
            step_timeout=self.step_timeout,
        )


@dataclass(frozen=True)
class Trial:
    """One run. seed: None where there is one only. findings: one per limit, None where there is a reason instead."""

    seed: int | None
    findings: Sequence[Finding | None]
    reasons: Sequence[str]


def seed_parameters(system: System) -> list[str]:
    """``component.seed`` of every component that has one."""
    return [f"{name}.{SEED}" for name, interface in system.interfaces.items() if SEED in interface.variables]


def trial(plan: Plan, system: System, limits: Sequence[Limit], seed: int | None) -> Trial:
    """Run and judge. A run that fails breaks every limit. Raises ExpressionError for limits that fit no run."""
    try:
        table = Table(plan.run(system, seed))
    except SimulationError as error:
        return Trial(seed, [None] * len(limits), [str(error)] * len(limits))
    findings: list[Finding | None] = []
    reasons = []
    for limit in limits:
        try:
            findings.append(judge(limit, table))
            reasons.append("")
        except NothingToJudge as error:
            findings.append(None)
            reasons.append(str(error))
    return Trial(seed, findings, reasons)


def trials(
    plan: Plan,
    system: System,
    limits: Sequence[Limit],
    seeds: Sequence[int | None],
    jobs: int,
) -> Iterator[Trial]:
    """One trial per seed, in their order. jobs: processes at once; closing the iterator ends them.

    Raises ExpressionError.
    """
    if jobs == 1 or len(seeds) == 1:
        for seed in seeds:
            yield trial(plan, system, limits, seed)
        return
    context = get_context("spawn")  # as on Windows and macOS
    with ExitStack() as stack:
        pool = ProcessPoolExecutor(min(jobs, len(seeds)), context, _prepare, (plan, limits))
        stack.callback(pool.shutdown, cancel_futures=True)
        stack.enter_context(workers_end_with_us())
        waiting: deque[Future[Trial]] = deque()
        left = iter(seeds)
        while True:
            with no_ctrl_c_for_what_starts_here():
                while len(waiting) < 2 * jobs and (seed := next(left, _NONE)) is not _NONE:
                    waiting.append(pool.submit(_trial, seed))
            if not waiting:
                return
            yield waiting.popleft().result()


_NONE: Any = object()
_of_worker: Any = None


def _prepare(plan: Plan, limits: Sequence[Limit]) -> None:
    global _of_worker
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _of_worker = (plan, plan.read(), limits)


def _trial(seed: int | None) -> Trial:
    plan, system, limits = _of_worker
    return trial(plan, system, limits, seed)


def cores() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
