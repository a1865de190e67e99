"""What a process of its own costs an FMU of others: ours, taken for such, beside the same in this process."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from statistics import median
from time import perf_counter
from typing import Any

from ..cosim.apart import Instances
from ..cosim.errors import STEP_TIMEOUT
from ..cosim.exchange import Exchange
from ..cosim.system import System

_STEPS = 4000
_WAYS = {"in this process": True, "in a process each": False}


@dataclass(frozen=True)
class IsolationTiming:
    """Real time in which a component is fed, stepped and read (s): median, and the least of the repeats' medians."""

    fmus: str
    seconds: float
    least: float


def isolation_timings(
    system: System, step: float, parameters: Mapping[str, Any], repeats: int, one_more: Callable[[], None]
) -> list[IsolationTiming]:
    """The components of a system step after each other, both ways, in turn and again.

    Medians, because on a busy machine a few steps have to wait for other programs.
    """
    seconds: dict[str, list[float]] = {way: [] for way in _WAYS}
    for _ in range(repeats):
        for way, in_process in _WAYS.items():
            seconds[way].append(median(_steps(system, step, parameters, in_process)))
        one_more()
    return [IsolationTiming(way, median(some), min(some)) for way, some in seconds.items()]


def _steps(system: System, h: float, parameters: Mapping[str, Any], in_process: bool) -> list[float]:
    """The time that each step of each component takes (s)."""
    settings, exchange, took = system.settings_with(parameters), Exchange(system, None), []
    with ExitStack() as stack:
        instances = Instances(stack, in_process, STEP_TIMEOUT, lambda: None)
        started = [instances.start(part.name, part.fmu, part.model, ours=False) for part in system.parts]
        for instance in started:
            instance.connect(exchange.outlets(instance.name), exchange.inlets(instance.name))
            instance.ready()
            instance.enter_initialisation([s for s in settings if s.component == instance.name], 0.0, _STEPS * h)
            instance.exit_initialisation(0.0)
        for k in range(_STEPS):
            for instance in started:
                began = perf_counter()
                instance.gather()
                instance.advance(k * h, h, (k + 1) * h)
                took.append(perf_counter() - began)
    return took
