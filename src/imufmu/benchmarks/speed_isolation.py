"""What a process of its own costs an FMU of others: ours, taken for such, beside the same in this process."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from statistics import median
from time import perf_counter
from typing import Any

from ..cosim.master import simulate
from ..cosim.system import System

_STEPS = 5000
_WAYS = {"in this process": True, "in a process each": False}


@dataclass(frozen=True)
class IsolationTiming:
    """Real time per component and step (s): median and least. Starts and ends of processes are left out."""

    fmus: str
    seconds: float
    least: float


def isolation_timings(
    system: System, step: float, parameters: Mapping[str, Any], repeats: int, one_more: Callable[[], None]
) -> list[IsolationTiming]:
    """The system both ways, in turn and again."""
    foreign = replace(system, parts=tuple(replace(part, ours=False) for part in system.parts))
    seconds: dict[str, list[float]] = {way: [] for way in _WAYS}
    for _ in range(repeats):
        for way, in_process in _WAYS.items():
            took = []
            for steps in (1, 1 + _STEPS):
                began = perf_counter()
                simulate(foreign, stop_time=steps * step, step=step, parameters=parameters, in_process=in_process)
                took.append(perf_counter() - began)
            seconds[way].append((took[1] - took[0]) / (_STEPS * len(system.parts)))
        one_more()
    return [IsolationTiming(way, median(some), min(some)) for way, some in seconds.items() if some]
