"""What a reader of one kind of file hands on: signals in SI units on one clock, before axes, truth and doubts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .faults import RecordingError
from .sample_clock import ClockError
from .stamps import Clock, evenly, read_clock

Where = Callable[[int], str]  # row -> what a user calls it


@dataclass(frozen=True)
class Raw:
    """signals: by name of ours, (n,) or (n, k), SI, not finite where missing. where: what a user calls a row.

    facts: what a person may want to know of the file, in words, by topic. names: columns of the file by signal.
    """

    signals: Mapping[str, np.ndarray]
    clock: Clock
    where: Where
    notes: Sequence[str] = ()
    scored: np.ndarray | None = None
    facts: Mapping[str, str] | None = None
    names: Mapping[str, Sequence[str]] | None = None


@dataclass(frozen=True)
class Stream:
    """One signal of a file that gives each its own times. time: (n,), s. values: (n, k), SI."""

    time: np.ndarray
    values: np.ndarray


def merged(path: Path, streams: Mapping[str, Stream], rate: float | None, notes: Sequence[str],
           facts: Mapping[str, str] | None = None) -> Raw:  # fmt: skip
    """Signals on the clock of the gyroscope: those as fast by interpolation, slower ones at the instant next to theirs.

    Raises RecordingError.
    """
    missing = [name for name in ("gyro", "accel") if name not in streams or len(streams[name].time) < 2]
    if missing:
        raise RecordingError(f"{path}: no {' and no '.join(missing)} in it; it has {', '.join(streams) or 'nothing'}")
    gyro = streams["gyro"]
    begin, end = _common(streams)
    rows = np.flatnonzero((gyro.time >= begin - 1e-9) & (gyro.time <= end + 1e-9))
    if len(rows) < 2:
        raise RecordingError(f"{path}: gyro and accel have no time in common")
    said = list(notes)

    def where(row: int) -> str:
        return f"{path}, gyro sample {int(rows[row]) + 1}"

    time = gyro.time[rows]
    try:
        clock = evenly(len(rows), rate) if rate else read_clock(time, "s")
    except ClockError as error:
        raise RecordingError(f"{where(error.row)}: {error}") from None
    signals = {"gyro": gyro.values[rows]}
    for name, stream in streams.items():
        if name == "gyro" or len(stream.time) < 2:
            continue
        same = len(stream.time) == len(gyro.time) and np.array_equal(stream.time, gyro.time)
        if same:
            signals[name] = stream.values[rows]
        elif len(stream.time) > 0.6 * len(gyro.time):
            signals[name] = _interpolated(stream, time, clock.period)
            said.append(f"{name} has other times than gyro: interpolated")
        else:
            signals[name] = _at_nearest(stream, time)
            if name == "accel":
                said.append(
                    f"accel is slower than gyro: {np.isfinite(signals[name]).all(axis=1).mean():.0%} of the rows"
                )
    return Raw(signals, clock, where, said, facts=facts)


def _common(streams: Mapping[str, Stream]) -> tuple[float, float]:
    """Time that gyroscope and accelerometer have in common."""
    times = [streams[name].time for name in ("gyro", "accel")]
    return max(t.min() for t in times), min(t.max() for t in times)


def _interpolated(stream: Stream, time: np.ndarray, period: float) -> np.ndarray:
    """Values at other times, linear between neighbours; NaN where the nearest is further than two periods."""
    order = np.argsort(stream.time, kind="stable")
    known, values = stream.time[order], stream.values[order]
    flat = values.reshape(len(values), -1)
    found = np.column_stack([np.interp(time, known, column) for column in flat.T])
    after = np.clip(np.searchsorted(known, time), 1, len(known) - 1)
    apart = np.minimum(np.abs(known[after] - time), np.abs(time - known[after - 1]))
    found[apart > 2 * max(period, float(np.median(np.diff(known))))] = np.nan
    return found.reshape(len(time), *values.shape[1:])


def _at_nearest(stream: Stream, time: np.ndarray) -> np.ndarray:
    """Each value at the one instant next to its time, NaN between."""
    found = np.full((len(time), *stream.values.shape[1:]), np.nan)
    after = np.clip(np.searchsorted(time, stream.time), 1, len(time) - 1)
    nearest = np.where(stream.time - time[after - 1] < time[after] - stream.time, after - 1, after)
    inside = (stream.time >= time[0]) & (stream.time <= time[-1])
    found[nearest[inside]] = stream.values[inside]
    return found
