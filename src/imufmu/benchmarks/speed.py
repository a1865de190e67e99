"""What a sample costs, each way of running a block beside the others in one run; what a system costs, and a start.

Samples and starts are measured in processor time, systems in real time. The ways are measured in turn, and again, so
that what else the machine does meets all of them. Each figure is the median of its measurements, a ratio that of the
ratios within a turn.
"""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from statistics import median
from time import perf_counter

import numpy as np

from .. import __version__
from ..blocks.block import SampledBlock
from ..compiled.compilers import identity
from ..cosim.master import simulate
from ..cosim.system import System, locate
from ..files.atomic import atomic_write
from ..files.names import no_such
from ..files.scratch import scratch_folder
from ..papers.experiment import Progress
from ..papers.motions import parameter_set, record
from ..plants import handheld
from ..registry import BLOCKS
from ..scoring.table import Table
from .speed_isolation import IsolationTiming, isolation_timings
from .speed_start import StartTiming, start_timings
from .speed_ways import NATIVE_IN_C, Trip, ways

BLOCKS_BY_DEFAULT = ("lee2012", "plumb")
BROAD_RATE = 285.0  # Hz, about that of the recordings in the benchmark BROAD

_REPEATS = 9
_RECORD = 30.0  # s of motion, over and over
_SEED = 1
_SYSTEM, _SYSTEM_STEP, _SYSTEM_REPEATS = "pendulum_lee2012", 1e-3, 3
_SYSTEM_TIMES = {True: 60.0, False: 6.0}  # s to simulate, native or not


@dataclass(frozen=True)
class Timing:
    """Processor time of a sample (s): median and least; median ratio to the native FMU in the C host."""

    block: str
    rate: float  # Hz
    way: str
    seconds: float
    least: float
    ratio: float


@dataclass(frozen=True)
class SystemTiming:
    """A system through our master: simulated time (s), median of the time it took (s)."""

    system: str
    step: float
    fmus: str
    simulated: float
    seconds: float

    @property
    def times_real_time(self) -> float:
        """How many times faster than real time."""
        return self.simulated / self.seconds


@dataclass(frozen=True)
class Speed:
    """Everything that was measured, and on what."""

    machine: Mapping[str, str]
    timings: Sequence[Timing]
    systems: Sequence[SystemTiming]
    isolation: Sequence[IsolationTiming]
    starts: Sequence[StartTiming]


def speed(
    names: Sequence[str] = BLOCKS_BY_DEFAULT,
    rates: Sequence[float] = (BROAD_RATE,),
    *,
    repeats: int = _REPEATS,
    with_system: bool = True,
    with_starts: bool = True,
    progress: Progress | None = None,
) -> Speed:
    """Measure sampled blocks at their own sample period and at these rates (Hz), and a system of FMUs at 1 kHz.

    repeats: measurements of each way. Raises ValueError for a block that cannot be fed with a hand-held motion, and
    BuildError without a C compiler.
    """
    trips = [trip for name in names for trip in _trips(name, rates)]
    systems = _SYSTEM_REPEATS if with_system else 0
    starts = repeats if with_starts else 0
    total = len(trips) * repeats + 2 * systems + starts
    done = 0

    def one_more() -> None:
        nonlocal done
        done += 1
        if progress:
            progress(done, total)

    timings = [timing for trip in trips for timing in _measured(trip, repeats, one_more)]
    measured, isolation = _system_timings(systems, one_more)
    return Speed(_machine(), timings, measured, isolation, start_timings(starts, one_more))


def _trips(name: str, rates: Sequence[float]) -> list[Trip]:
    """The block in a moving hand at its own rate, then at the given ones."""
    block = BLOCKS.get(name)
    if not isinstance(block, SampledBlock):
        sampled = [n for n, b in BLOCKS.items() if isinstance(b, SampledBlock)]
        raise ValueError(no_such("sampled block", name, sampled))
    if not all(0 < rate < np.inf for rate in rates):
        raise ValueError(f"sample rates must be positive and finite, not {', '.join(f'{rate:g}' for rate in rates)}")
    periods = dict.fromkeys((block.period, *(1 / rate for rate in rates)))
    return [Trip(block, period, _inputs(block, period)) for period in periods]


def _inputs(block: SampledBlock, period: float) -> dict[str, np.ndarray]:
    """What a hand-held IMU has; an estimator's other inputs, which it can do without, stay at their start values."""
    moved = record(handheld.BLOCK, _RECORD, period, _SEED, parameter_set("handheld/lee2012_test_b"))
    there = {**moved.truth.values, **moved.readings}
    missing = [signal.name for signal in block.inputs if signal.name not in there]
    if missing and not {"gyro", "accel"} <= {signal.name for signal in block.inputs}:
        raise ValueError(f"{block.name} cannot be fed: a hand-held IMU has no {', '.join(missing)}")
    rows = len(there["gyro"])
    idle = {signal.name: np.tile(signal.start_values(), (rows, 1)) for signal in block.inputs}
    return {name: there.get(name, values) for name, values in idle.items()}


def _measured(trip: Trip, repeats: int, one_more: Callable[[], None]) -> list[Timing]:
    with ExitStack() as stack:
        folder = stack.enter_context(scratch_folder("speed"))
        measure = ways(trip, folder, stack)
        seconds: dict[str, list[float]] = {way: [] for way in measure}
        for _ in range(repeats):
            for way, once in measure.items():
                seconds[way].append(once())
            one_more()
    native = np.array(seconds[NATIVE_IN_C])
    return [
        Timing(trip.block.name, 1 / trip.period, way, median(some), min(some), float(np.median(some / native)))
        for way, some in seconds.items()
    ]


def _system_timings(repeats: int, one_more: Callable[[], None]) -> tuple[list[SystemTiming], list[IsolationTiming]]:
    if not repeats:
        return [], []
    systems = {native: System.read(locate(_SYSTEM), native=native) for native in _SYSTEM_TIMES}
    sampled = [n for s in systems.values() for n, i in s.interfaces.items() if "sample_period" in i.variables]
    periods = {f"{component}.sample_period": _SYSTEM_STEP for component in sampled}
    seconds: dict[bool, list[float]] = {native: [] for native in systems}
    for _ in range(repeats):
        for native, system in systems.items():
            began = perf_counter()
            simulate(system, stop_time=_SYSTEM_TIMES[native], step=_SYSTEM_STEP, parameters=periods)
            seconds[native].append(perf_counter() - began)
        one_more()
    kinds = {True: "native FMUs", False: "Python FMUs"}
    measured = [
        SystemTiming(_SYSTEM, _SYSTEM_STEP, kinds[native], _SYSTEM_TIMES[native], median(some))
        for native, some in seconds.items()
    ]
    return measured, isolation_timings(systems[True], _SYSTEM_STEP, periods, repeats, one_more)


def _machine() -> dict[str, str]:
    return {
        "processor": _processor(),
        "cores": str(os.cpu_count()),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "imufmu": __version__,
        "casadi": version("casadi"),
        "compiler": identity().splitlines()[0],
    }


def _processor() -> str:
    """Its name as the system tells it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or "unknown"


def tables(result: Speed) -> list[Table]:
    """What a sample costs, what a system costs, a process for each FMU, and a start."""
    rows = [
        [t.block, f"{t.rate:.4g}", t.way, f"{1e9 * t.seconds:.0f}", f"{1e9 * t.least:.0f}", f"{t.ratio:.3g}"]
        for t in result.timings
    ]
    columns = ["block", "rate (Hz)", "way", "median (ns)", "least (ns)", f"/ {NATIVE_IN_C}"]
    systems = [
        [s.system, s.fmus, f"{1 / s.step:g}", f"{s.simulated:g}", f"{s.seconds:.3f}", f"{s.times_real_time:.3g}"]
        for s in result.systems
    ]
    system_columns = ["system", "of", "rate (Hz)", "simulated (s)", "took (s)", "times real time"]
    starts = [[s.command, f"{1e3 * s.seconds:.0f}", f"{1e3 * s.least:.0f}"] for s in result.starts]
    isolation = [[i.fmus, f"{1e6 * i.seconds:.1f}", f"{1e6 * i.least:.1f}"] for i in result.isolation]
    made = (
        Table(columns, rows),
        Table(system_columns, systems),
        Table(["native FMUs", "of a component and step (us)", "least (us)"], isolation),
        Table(["start", "processor time (ms)", "least (ms)"], starts),
    )
    return [table for table in made if table.rows]


def write_json(path: Path, result: Speed) -> None:
    """Write everything. Raises WriteError."""
    with atomic_write(path) as temporary:
        temporary.write_text(json.dumps(asdict(result), indent=2) + "\n", encoding="utf-8")
