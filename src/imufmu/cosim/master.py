"""The co-simulation master: a fixed communication step, counted in integer ticks, along the signal flow.

Two kinds of FMU, told apart as schedule.py says. A **sampled** one (IMU, estimator) answers to the inputs of time t:
doStep(t, h) processes the samples in [t, t + h). A **continuous** one (a plant) advances: its outputs after
doStep(t, h) are those of t + h. So a tick from t to t + h is

    1  sampled FMUs, along the signal flow: set inputs, doStep(t, h), get outputs
    2  record the row of time t: truth and samples belong together, no delay is added
    3  continuous FMUs, along the signal flow: set inputs, doStep(t, h), get outputs, now of t + h

Jacobi takes all inputs before the tick instead, so every connection from a sampled FMU adds a delay of one step.
"""

from __future__ import annotations

import math
import time as clock
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .apart import Instance, Instances
from .errors import STEP_TIMEOUT, EndOfRun, SimulationError
from .exchange import Exchange
from .interface import number_of
from .interrupt import Terminated, interrupt_between_calls
from .results import Result
from .schedule import Schedule
from .settings import Setting
from .system import Part, System, locate
from .truth import derive

MOST_TICKS = 10**8  # more is taken for a wrong unit
_BETWEEN_PROGRESS = 0.1  # s

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Ticks:
    """Communication points start + k h, k = 0 ... count (s)."""

    start: float
    h: float
    count: int

    def time(self, k: int) -> float:
        """Communication point k."""
        return self.start + k * self.h

    @property
    def end(self) -> float:
        """The end of the last step, which no step passes by a rounding."""
        return max(self.time(self.count), self.time(self.count - 1) + self.h)


def simulate(
    system: System | str | Path,
    *,
    start_time: float | None = None,
    stop_time: float | None = None,
    step: float | None = None,
    parameters: Mapping[str, Any] | None = None,
    record: Sequence[str] | None = None,
    jacobi: bool = False,
    treat: Mapping[str, str] | None = None,
    native: bool = False,
    in_process: bool = False,
    step_timeout: float = STEP_TIMEOUT,
    progress: Progress | None = None,
) -> Result:
    """Run a system: a System, a file (.ssd, .ssp), or the name of a system of imufmu.

    Times in s; what is not given comes from the description, a step also from the FMUs (the smallest they prefer).
    parameters: start values by ``component.variable``, a vector by its name. record: names of variables or vectors
    (default: all outputs). treat: "sampled" or "continuous" by component, where an FMU does not tell what it is.
    native: as in System.read. progress(done, total), in ticks, is called now and then.

    FMUs that imufmu has not built run in a process each, and may crash or hang there. in_process: let them share ours,
    which is faster and can be debugged, and which they may take along. step_timeout: s, how long such an FMU may take
    for a call.

    An FMU may end the run; the result then ends there, with a note. Raises WiringError and what System.read raises for
    a system that does not fit, ValueError for impossible times, SimulationError for a run that fails. That, and
    KeyboardInterrupt, has the rows up to there as ``result``, where there are any. Whatever happens, no instance, no
    process and no temporary file stays behind.
    """
    if not isinstance(system, System):
        system = System.read(locate(system), native=native)
    settings = system.settings_with(parameters or {})
    ticks = _ticks(system, start_time, stop_time, step)
    told = system.description.truth
    exchange = Exchange(system, record, [variable for one in told for variable in one.variables])
    schedule = Schedule(system, jacobi, treat or {})
    notes = [*system.notes, *_period_notes(system, settings, ticks.h), *schedule.notes]

    def result(partial: str = "") -> Result:
        time = ticks.start + np.arange(exchange.rows) * ticks.h
        columns, units = exchange.columns(), exchange.units()
        derived, their_units, said = derive(told, columns)
        every = columns | derived, units | their_units, (*notes, *said)
        return Result(system.description.name, time, *every, partial)

    try:
        with ExitStack() as stack:
            check = stack.enter_context(interrupt_between_calls())
            slaves = _start(system.parts, Instances(stack, in_process, step_timeout, check))
            for name, slave in slaves.items():
                slave.connect(exchange.outlets(name), exchange.inlets(name))
            for slave in slaves.values():
                slave.ready()
            notes += _initialise(slaves, schedule, exchange, settings, ticks)
            exchange.new_tables(ticks.count + 1)
            notes += _run(slaves, schedule, exchange, ticks, check, progress)
            for slave in slaves.values():
                notes += slave.notes
            for slave in slaves.values():
                slave.close()
    except (SimulationError, KeyboardInterrupt, Terminated) as error:
        if exchange.rows:
            reason = str(error) if isinstance(error, SimulationError) else "interrupted"
            error.result = result(f"{exchange.rows} of {ticks.count + 1} rows: {reason}")  # type: ignore[union-attr]
        raise
    return result()


def _ticks(system: System, start: float | None, stop: float | None, h: float | None) -> Ticks:
    """Communication points that reach the stop time."""
    described = system.description
    start = start if start is not None else described.start_time or 0.0
    stop = stop if stop is not None else described.stop_time
    h = h if h is not None else described.step
    if h is None:
        experiments = [part.model.defaultExperiment for part in system.parts]
        preferred = [number_of(e.stepSize) for e in experiments if e is not None]
        h = min((size for size in preferred if size), default=None)
    missing = [name for name, value in (("stop_time", stop), ("step", h)) if value is None]
    if stop is None or h is None:
        raise ValueError(f"{system.path} does not say {' and '.join(missing)}: give {' and '.join(missing)}")
    if not (math.isfinite(start) and math.isfinite(stop) and h > 0 and math.isfinite(h) and stop > start):
        raise ValueError(f"cannot run from {start} s to {stop} s in steps of {h} s")
    count = (stop - start) / h
    if count > MOST_TICKS:
        raise ValueError(f"{count:.3g} steps of {h:g} s are too many; are the times in seconds?")
    rounding = 1e-6 + math.ulp(max(abs(start), abs(stop))) / h  # of stop / h and, far from time zero, of the times
    return Ticks(start, h, max(1, math.ceil(count - rounding)))


def _period_notes(system: System, settings: Sequence[Setting], h: float) -> list[str]:
    """Sampled blocks whose samples do not fall on communication points."""
    notes = []
    for name, interface in system.interfaces.items():
        variable = interface.variables.get("sample_period")
        if variable is None or number_of(variable.start) is None:
            continue
        given = [s.value for s in settings if s.component == name and s.variable.name == "sample_period"]
        period = float(given[0] if given else variable.start)
        if period <= 0 or round(period / h) < 1 or abs(period / h - round(period / h)) > 1e-6:
            notes.append(
                f"{name}: samples every {period:g} s, inputs every {h:g} s: some samples see older inputs; "
                "let the sample period be a whole multiple of the step"
            )
    return notes


def _start(parts: Sequence[Part], instances: Instances) -> dict[str, Instance]:
    """Instances of all components, by name."""
    return {part.name: instances.start(part.name, part.fmu, part.model, part.ours) for part in parts}


def _initialise(
    slaves: Mapping[str, Instance], schedule: Schedule, exchange: Exchange, settings: Sequence[Setting], ticks: Ticks
) -> list[str]:
    """Start values, then outputs exchanged until they settle."""
    time, end = ticks.start, ticks.end
    for name, slave in slaves.items():
        slave.enter_initialisation([setting for setting in settings if setting.component == name], time, end)
    settled = False
    for _ in range(len(slaves) + 1):
        before = {kind: values.copy() for kind, values in exchange.values.items()}
        for name in schedule.initial:
            slaves[name].gather()
            slaves[name].write(time)
            slaves[name].read_initial(time)
        settled = all(np.array_equal(before[kind], now, equal_nan=True) for kind, now in exchange.values.items())
        if settled:
            break
    for name in schedule.initial:
        slaves[name].exit_initialisation(time)
        slaves[name].read(time)
    return [] if settled else [f"outputs did not settle in {len(slaves) + 1} exchanges during initialisation"]


def _run(
    slaves: Mapping[str, Instance],
    schedule: Schedule,
    exchange: Exchange,
    ticks: Ticks,
    check: Callable[[], None],
    progress: Progress | None,
) -> list[str]:
    """All ticks, or those before an FMU ends the run, which is returned as a note; every row recorded."""
    sampled = [slaves[name] for name in schedule.sampled]
    continuous = [slaves[name] for name in schedule.continuous]
    h, reported = ticks.h, clock.monotonic()
    for k in range(ticks.count):
        t = ticks.time(k)
        if schedule.jacobi:
            for slave in slaves.values():
                slave.gather()
        try:
            for slave in sampled:
                _advance(slave, t, h, t, not schedule.jacobi)
            exchange.record(k)
            for slave in continuous:
                _advance(slave, t, h, ticks.time(k + 1), not schedule.jacobi)
        except EndOfRun as end:
            if exchange.rows == k:  # the last row of a run holds the samples before it
                exchange.record(k)
            return [f"{end}; {exchange.rows} of {ticks.count + 1} rows"]
        check()
        if progress and (k + 1 == ticks.count or clock.monotonic() - reported > _BETWEEN_PROGRESS):
            progress(k + 1, ticks.count)
            reported = clock.monotonic()
    exchange.record(ticks.count)
    return []


def _advance(slave: Instance, t: float, h: float, reached: float, gather: bool) -> None:
    if gather:
        slave.gather()
    slave.advance(t, h, reached)
