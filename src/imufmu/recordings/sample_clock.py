"""Time stamps of a recording -> nominal sample period and whole-number instants."""

from __future__ import annotations

import numpy as np

from ..blocks.vocabulary import SAMPLE_TIME, sample_period

MOST_MISSING = 10**6  # samples in gaps; more are taken for two recordings in one file, or a broken time
_BOUNDS = sample_period(0.01)


class ClockError(ValueError):
    """The time of row ``row`` (from 0) cannot be used; the message says why and what to do."""

    def __init__(self, row: int, message: str) -> None:
        super().__init__(message)
        self.row = int(row)


def sample_clock(time: np.ndarray) -> tuple[float, np.ndarray]:
    """Nominal sample period (s) and the whole-number instant of every row, (n,), from 0, of ``time`` (n,), s, n >= 2.

    The instants follow a clock that drifts or jitters, by up to a quarter of a period: each row is counted from where
    the rows before it place the last instant. A gap counts as the nearest whole number of periods. The period is the
    mean of the intervals without a gap, so that rounding of the time stamps averages out.

    Raises ClockError unless time is finite and increasing, at a believable rate, without endless gaps, and no two rows
    belong to one instant.
    """
    unknown = np.flatnonzero(~(np.abs(time) <= SAMPLE_TIME.maximum))
    if unknown.size:
        raise ClockError(unknown[0], "missing or not in seconds; every row needs its time")
    intervals = np.diff(time)
    back = np.flatnonzero(intervals <= 0)
    if back.size:
        before, now = time[back[0] : back[0] + 2]
        fault = "is repeated" if now == before else f"follows {before} s"
        raise ClockError(back[0] + 1, f"{now} s {fault}; time must increase from row to row")
    # Intervals not longer than 1.5 medians are mostly free of gaps: near enough to count by.
    median = np.quantile(intervals, 0.5, method="lower")
    period = float(np.mean(intervals[intervals <= 1.5 * median]))
    if not _BOUNDS.minimum <= period <= _BOUNDS.maximum:
        raise ClockError(1, f"samples are {period:g} s apart; give the time in seconds")
    if time[-1] - time[0] > (len(time) + MOST_MISSING) * period:
        longest = int(np.argmax(intervals))
        raise ClockError(longest + 1, f"a gap of {intervals[longest]:g} s; split the recording at its long gaps")
    index = _instants(time, period)
    steps = np.diff(index)
    clash = np.flatnonzero(steps < 1)
    if clash.size:
        raise ClockError(
            clash[0] + 1,
            f"{time[clash[0] + 1]} s is less than half a sample period ({period:g} s) after the row before, or the "
            "rows around it crowd; give one row per sample, at a constant rate",
        )
    shortest = np.min(steps)
    regular = steps == shortest
    period = float(np.mean(intervals[regular]) / shortest)
    pieces = 1 + np.count_nonzero(~regular)  # each begins and ends with a stamp, rounded by half a spacing
    rounding = pieces * np.spacing(np.abs(time).max()) / (np.count_nonzero(regular) * shortest)
    return plainest(period, float(rounding)), index


def plainest(period: float, rounding: float) -> float:
    """The period, or rate, of the fewest digits that the rounding of the stamps allows; of twelve at most.

    0.01, not 0.010000000000000002; nor 0.0099999987 where the stamps count from 1970.
    """
    for digits in range(1, 12):
        for plain in (float(f"{period:.{digits}g}"), 1 / float(f"{1 / period:.{digits}g}")):
            if abs(plain - period) <= rounding:
                return float(f"{plain:.12g}")
    return float(f"{period:.12g}")


def _instants(time: np.ndarray, period: float) -> np.ndarray:
    # The first stamp jitters too: begin where the first rows place its instant, their mean on the circle of one period.
    turns = (time[:20] - time[0]) / period
    instant = float(time[0]) + period * float(np.angle(np.mean(np.exp(2j * np.pi * turns)))) / (2 * np.pi)
    index = [0]
    for t in time[1:].tolist():
        steps = round((t - instant) / period)
        instant += steps * period
        # A tenth averages the jitter of ten rows and lags a clock that is off by 100 ppm by 0.001 samples.
        instant += 0.1 * (t - instant)
        index.append(index[-1] + steps)
    return np.array(index)
