"""Time stamps as devices and hosts write them -> seconds of a sample clock, and in words what was assumed.

``sample_clock`` counts the rows of a clock that increases. Here stands what comes before it: the unit where the file
does not tell, counters that wrap, clocks that are set while they are recorded, and stamps of the arrival at a host
(equal, in bursts, crowded), which say how many samples there were but not when each was taken.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..blocks.units import factor
from ..blocks.vocabulary import sample_period
from .sample_clock import ClockError, plainest, sample_clock

_WRAPS = (2.0**16, 2.0**32, 604800.0, 86400.0, 604800e3, 86400e3)  # counters; seconds and ms of a week and a day
_SLOWEST = 1.0  # s between samples; more is another unit
_SET = 86400.0  # s; a jump ahead by more is taken for a clock that was set, not for samples that are missing
_REGULAR = 20  # rows before and after such a jump
_BOUNDS = sample_period(0.01)


@dataclass(frozen=True)
class Clock:
    """time: (n,), s, as in the file but for what the notes say. period: s. index: (n,), whole-number instants."""

    time: np.ndarray
    period: float
    index: np.ndarray
    notes: tuple[str, ...] = ()


def evenly(rows: int, rate: float) -> Clock:
    """The clock of rows that are evenly spaced at a rate (Hz) that was given."""
    note = f"rows are taken for evenly spaced at {rate:g} Hz; times of the file are not used"
    return Clock(np.arange(rows) / rate, 1 / rate, np.arange(rows), (note,))


def read_clock(stamps: np.ndarray, unit: str | None, tick: float | None = None) -> Clock:
    """Clock of the stamps (n,), n >= 2, of a column. unit: as the file or the user tells it, None where neither does.

    tick: s, of a counter in place of a unit. Raises ClockError.
    """
    notes: list[str] = []
    unknown = np.flatnonzero(~np.isfinite(stamps))
    if unknown.size:
        raise ClockError(unknown[0], "missing or not in seconds; every row needs its time")
    counted = _unwrapped(stamps, notes)
    if tick is None:
        tick = _unit(counted, unit, notes)
    time = _continued(counted * tick, notes)
    try:
        period, index = sample_clock(time)
    except ClockError as fault:
        clock = _arrivals(time)
        if clock is None:
            raise fault from None
    else:
        clock = Clock(time, period, index)
        if index[-1] + 1 > 2 * len(index):  # more holes than rows: rather bursts
            clock = _arrivals(time) or clock
    return Clock(clock.time, clock.period, clock.index, (*notes, *clock.notes))


def _unit(stamps: np.ndarray, unit: str | None, notes: list[str]) -> float:
    """Seconds per unit of the stamps. Where it is not told, the one that makes a believable rate, and a note."""
    known = factor(unit, "s") if unit else None
    if known is not None:
        return known
    usual = _mean_step(np.diff(stamps))
    if usual < _SLOWEST:
        return 1.0
    for name, seconds, most in (("milliseconds", 1e-3, 1e3), ("microseconds", 1e-6, 1e6), ("nanoseconds", 1e-9, 1e9)):
        if usual < most:
            notes.append(f"times are taken for {name}, as rows are {usual:g} apart; another unit: --time NAME:s")
            return seconds
    return 1.0


def _mean_step(steps: np.ndarray) -> float:
    """Mean of the intervals without the few longest, and whatever comes together."""
    return float(np.mean(np.clip(steps, 0, 2 * np.quantile(steps, 0.99, method="lower")))) if len(steps) else 0.0


def _unwrapped(stamps: np.ndarray, notes: list[str]) -> np.ndarray:
    """Stamps of a counter that begins anew at a power of two, or at the end of a day or week, without its falls."""
    steps = np.diff(stamps)
    falls = np.flatnonzero(steps < 0)
    usual = np.median(steps[steps > 0]) if (steps > 0).any() else 0.0
    if not falls.size or not usual:
        return stamps
    for wrap in _WRAPS:
        over = steps[falls] + wrap
        if stamps.min() >= 0 and stamps.max() < wrap and (over > 0).all() and (over < 50 * usual).all():
            whole = np.concatenate([[0.0], np.cumsum(steps < 0)]) * wrap
            notes.append(f"times begin anew at {wrap:.10g}, as a counter does, {falls.size} times; counted on")
            return stamps + whole
    return stamps


def _continued(time: np.ndarray, notes: list[str]) -> np.ndarray:
    """Time without the jumps of a clock that was set. Raises ClockError where two recordings are in one file."""
    steps = np.diff(time)
    typical = _mean_step(steps)
    jumps = np.flatnonzero((steps < -20 * typical) | (steps > _SET))  # packets that overtake each other are no jump
    if not jumps.size or jumps.size > 10 or len(time) / (jumps.size + 1) < _REGULAR:
        return time
    ends = [-1, *jumps.tolist(), len(time) - 1]
    if min(np.diff(ends)) < _REGULAR:
        return time
    moved = time.copy()
    kept = float(np.median(np.delete(steps, jumps)))
    for at in jumps.tolist():
        jump = steps[at]
        if jump < 0 and abs(time[at + 1] - time[0]) <= 2 * typical:
            raise ClockError(at + 1, f"{time[at + 1]:g} s: time begins anew: two recordings in one file? split them")
        moved[at + 1 :] -= jump - kept
        notes.append(
            f"the clock jumps by {jump:g} s after sample {at + 1}: taken for a clock that was set, with no sample lost"
        )
    return moved


def _arrivals(time: np.ndarray) -> Clock | None:
    """Clock of stamps that a host gave to samples on their arrival, None where they tell no rate.

    The rate is that of the rows over long stretches. Rows are evenly spaced but where the lateness of all rows rises
    for good: there samples are missing.
    """
    n = len(time)
    if n < _REGULAR or (np.diff(time) < -0.5 * (time[-1] - time[0])).any():
        return None
    stretch = max(10, min(n // 4, 400))
    period = float(np.median(time[stretch:] - time[:-stretch])) / stretch
    if not _BOUNDS.minimum <= period <= _SLOWEST:
        return None
    period = plainest(_mean_period(time, period), 1e-3 * period)
    late = time / period - np.arange(n)
    late -= late[0]
    window = _bunch(time, period)
    # The last sample of a burst is the least late; after a host's pause it takes a while until none is late.
    before = _least_ahead(late, max(window, min(200, round(2.0 / period), n // 4)))
    lost = np.zeros(n)
    level = before[0]
    for k in range(1, n):
        rise = before[k] - level
        if rise > max(2.0, 0.75 * window):
            lost[k:] += round(rise)
            level = before[k]
        else:
            level += 0.05 * rise
    index = (np.arange(n) + lost).astype(int)
    if index[-1] + 1 > 3 * n:
        return None
    missing = int(index[-1]) + 1 - n
    last = np.flatnonzero(np.append(np.diff(time) > 0.6 * period, True))
    period = plainest(float(np.polyfit(index[last], time[last] - time[0], 1)[0]), 5e-4 * period)
    note = (
        f"times do not tell the samples apart (equal, crowded or in bunches of {window}): rows are taken for evenly "
        f"spaced at their mean rate, {1 / period:.6g} Hz" + (f", {missing} missing" if missing else "")
        + "; another rate: --rate"
    )  # fmt: skip
    return Clock(time[0] + index * period, period, index, (note,))


def _mean_period(time: np.ndarray, period: float) -> float:
    """The period (s) between rows that came last of those that came together, over long stretches without a gap."""
    last = np.flatnonzero(np.diff(time) > 0.6 * period)
    if len(last) < 6:
        return period
    apart = max(1, min(len(last) // 5, 100))
    return float(np.median((time[last[apart:]] - time[last[:-apart]]) / (last[apart:] - last[:-apart])))


def _bunch(time: np.ndarray, period: float) -> int:
    """Rows that arrive together, in the usual case: those between two intervals of more than half their share."""
    long = np.flatnonzero(np.diff(time) > 1.3 * period)
    sizes = np.diff(long) if long.size > 1 else np.array([2])
    return int(np.clip(np.quantile(sizes, 0.9), 2, 200))


def _least_ahead(values: np.ndarray, window: int) -> np.ndarray:
    """Least of each value and the window - 1 after it."""
    padded = np.concatenate([values, np.full(window - 1, values[-1])])
    return np.asarray(np.lib.stride_tricks.sliding_window_view(padded, window).min(axis=1))
