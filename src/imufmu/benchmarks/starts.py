"""Starts inside a motion: every filter begins anew at instants in the middle of a recording.

Most recordings begin at rest, and so flatter a filter that needs rest. A start counts where the sensor turns with more
than MOVES, root mean square over the first BEGINS, or its wheels turn with more than RIDES, and the truth is known for
nearly all of the LASTS that follow. The instants are spread evenly over all that count, so a run repeats. Readings as
recorded: no filter is told a bias.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..recordings.reading import Recording
from ..reports.page import Section
from ..scoring import metrics
from ..scoring.table import Table
from .contenders import Contender
from .sources import Source

MOVES = 0.5  # rad/s
RIDES = 2.0  # m/s
BEGINS = 0.5  # s
FIRST, LASTS = 10.0, 20.0  # s: the two parts of a start that are scored
KNOWN = 0.9  # of the truth, at least
NEAR_DEG = 2.0
WITH = "parameters for real recordings, readings as recorded"
FAR = 3.0  # tilt_std


@dataclass(frozen=True)
class StartScore:
    """One filter from one instant (s after the first row): RMSE before and after FIRST, the error at FIRST, the largest
    after it, and how much of that stays below NEAR_DEG; how much of all is below FAR tilt_std, NaN without one."""

    contender: str
    recording: str
    groups: Sequence[str]
    instant: float
    first_rmse_deg: float
    later_rmse_deg: float
    reached_deg: float
    later_max_deg: float
    later_near: float
    near: float


def start_scores(
    source: Source, recording: Recording, vertical: np.ndarray, count: int, contenders: Sequence[Contender]
) -> Iterator[StartScore]:
    """Every filter from ``count`` instants, or as many as there are.

    vertical: (n, 3), true up vector in S per row; NaN where it does not count.
    """
    readings, time = {name: recording.at_instants()[name] for name in ("gyro", "accel")}, recording.time
    for row in starts(recording, vertical, count):
        rows = np.arange(row, np.searchsorted(time, time[row] + LASTS))
        instants = recording.sample_index[rows]
        part = {name: values[instants[0] : instants[-1] + 1] for name, values in readings.items()}
        known = np.isfinite(vertical[rows]).all(axis=1)
        since = time[rows][known] - time[row]
        for contender in contenders:
            signals = contender.estimate(part, recording.sample_period)
            found = signals["vertical"][instants - instants[0]]
            error = metrics.inclination_error(found[known], vertical[rows][known])
            near = math.nan
            if "tilt_std" in signals:
                near = float(np.mean(error < FAR * signals["tilt_std"][instants - instants[0]][known]))
            degrees = np.rad2deg(error)
            first, later = degrees[since < FIRST], degrees[since >= FIRST]
            yield StartScore(
                contender.name,
                source.name,
                source.groups,
                float(time[row] - time[0]),
                float(metrics.rms(first)),
                float(metrics.rms(later)),
                float(later[0]),
                float(later.max()),
                float(np.mean(later < NEAR_DEG)),
                near,
            )


def starts(recording: Recording, vertical: np.ndarray, count: int) -> list[int]:
    """Rows to start from, evenly spread over those that count."""
    time, known = recording.time, np.isfinite(vertical).all(axis=1)
    if count == 0 or time[-1] - time[0] < LASTS:
        return []
    squares = np.where(np.isfinite(recording.gyro).all(axis=1), np.sum(recording.gyro**2, axis=1), 0.0)

    def mean_over(values: np.ndarray, seconds: float) -> np.ndarray:
        """Mean from each row on over so many seconds."""
        sums = np.concatenate([[0.0], np.cumsum(values)])
        end = np.searchsorted(time, time + seconds)
        return (sums[end] - sums[:-1]) / (end - np.arange(len(time)))

    whole = time <= time[-1] - LASTS
    moves = mean_over(squares, BEGINS) > MOVES**2
    if recording.forward_speed is not None:
        moves |= np.abs(recording.forward_speed) > RIDES
    counts = whole & moves & (mean_over(known, LASTS) > KNOWN)
    counts &= np.isfinite(recording.accel).all(axis=1) & np.isfinite(recording.gyro).all(axis=1)
    rows = np.flatnonzero(counts)
    return list(rows[np.linspace(0, len(rows) - 1, min(count, len(rows))).round().astype(int)]) if len(rows) else []


def start_tables(scores: Sequence[StartScore], kinds: Sequence[str] = ()) -> list[Section]:
    """One table per kind of recording, or one for all: a row per measure, a column per filter."""
    chosen = {kind: [s for s in scores if kind in s.groups] for kind in kinds} if len(kinds) > 1 else {"": scores}
    return [_table(some, kind) for kind, some in chosen.items() if some]


def _table(scores: Sequence[StartScore], kind: str) -> Section:
    by_filter = {
        name: [s for s in scores if s.contender == name] for name in dict.fromkeys(s.contender for s in scores)
    }
    each = list(by_filter.values())

    def row(label: str, values: Sequence[float], digits: int = 2) -> list[str]:
        return [label, *(f"{value:.{digits}f}" if math.isfinite(value) else "-" for value in values)]

    def mean(measure: Callable[[StartScore], float], scale: float = 1.0) -> list[float]:
        return [scale * float(np.mean([measure(s) for s in found])) for found in each]

    later = f"{FIRST:g} to {LASTS:g} s"
    rows = [
        row(f"RMSE, 0 to {FIRST:g} s", mean(lambda s: s.first_rmse_deg)),
        row(f"RMSE, {later}", mean(lambda s: s.later_rmse_deg)),
        row(f"largest, {later}", [max(s.later_max_deg for s in found) for found in each]),
        row(f"% of the starts below {NEAR_DEG:g} deg at {FIRST:g} s", mean(lambda s: s.reached_deg < NEAR_DEG, 100), 1),
        row(f"% of the time below {NEAR_DEG:g} deg, {later}", mean(lambda s: s.later_near, 100), 1),
        row(f"% of the time below {FAR:g} tilt_std, 0 to {LASTS:g} s", mean(lambda s: s.near, 100), 1),
    ]
    of = f"{kind}, " if kind else ""
    heading = f"Inclination (deg) after a start inside a motion, {of}mean of {len(each[0])}, {WITH}"
    return Section(heading, table=Table(["", *by_filter], rows))
