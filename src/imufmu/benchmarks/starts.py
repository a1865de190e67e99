"""Starts inside a motion: every filter begins anew at instants in the middle of a recording.

Most recordings begin at rest, and so flatter a filter that needs rest. A start counts where the sensor turns with more
than MOVES, root mean square over the first BEGINS, and the truth is known for nearly all of the LASTS that follow. The
instants are spread evenly over all that count, so a run repeats. Readings as recorded: no filter is told a bias.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..recordings.reading import Recording
from ..reports.page import Section
from ..scoring import metrics
from ..scoring.table import Table
from .contenders import Contender

MOVES = 0.5  # rad/s
BEGINS = 0.5  # s
FIRST, LASTS = 10.0, 20.0  # s: the two parts of a start that are scored
KNOWN = 0.9  # of the truth, at least
NEAR_DEG = 2.0


@dataclass(frozen=True)
class StartScore:
    """One filter from one instant (s after the first row): RMSE before and after FIRST, what is the largest error after
    it, and how much of that stays below NEAR_DEG."""

    contender: str
    recording: str
    instant: float
    first_rmse_deg: float
    later_rmse_deg: float
    later_max_deg: float
    later_near: float


def start_scores(
    recording: Recording, vertical: np.ndarray, count: int, contenders: Sequence[Contender]
) -> Iterator[StartScore]:
    """Every filter from ``count`` instants, or as many as there are.

    vertical: (n, 3), true up vector in S per row; NaN where it does not count.
    """
    readings, time = recording.at_instants(), recording.time
    for row in starts(recording, vertical, count):
        rows = np.arange(row, np.searchsorted(time, time[row] + LASTS))
        instants = recording.sample_index[rows]
        part = {name: values[instants[0] : instants[-1] + 1] for name, values in readings.items()}
        known = np.isfinite(vertical[rows]).all(axis=1)
        since = time[rows][known] - time[row]
        for contender in contenders:
            found = contender.estimate(part, recording.sample_period)["vertical"][instants - instants[0]]
            error = np.rad2deg(metrics.inclination_error(found[known], vertical[rows][known]))
            first, later = error[since < FIRST], error[since >= FIRST]
            yield StartScore(
                contender.name,
                recording.name,
                float(time[row] - time[0]),
                float(metrics.rms(first)),
                float(metrics.rms(later)),
                float(later.max()),
                float(np.mean(later < NEAR_DEG)),
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
    counts = whole & (mean_over(squares, BEGINS) > MOVES**2) & (mean_over(known, LASTS) > KNOWN)
    counts &= np.isfinite(recording.accel).all(axis=1) & np.isfinite(recording.gyro).all(axis=1)
    rows = np.flatnonzero(counts)
    return list(rows[np.linspace(0, len(rows) - 1, min(count, len(rows))).round().astype(int)]) if len(rows) else []


def start_tables(scores: Sequence[StartScore]) -> list[Section]:
    """One table: a row per measure, a column per filter."""
    if not scores:
        return []
    by_filter: Mapping[str, list[StartScore]] = {
        name: [s for s in scores if s.contender == name] for name in dict.fromkeys(s.contender for s in scores)
    }

    def row(label: str, values: Sequence[float], digits: int = 2) -> list[str]:
        return [label, *(f"{value:.{digits}f}" for value in values)]

    each = list(by_filter.values())
    rows = [
        row(f"RMSE, 0 to {FIRST:g} s", [float(np.mean([s.first_rmse_deg for s in found])) for found in each]),
        row(f"RMSE, {FIRST:g} to {LASTS:g} s", [float(np.mean([s.later_rmse_deg for s in found])) for found in each]),
        row(f"largest, {FIRST:g} to {LASTS:g} s", [max(s.later_max_deg for s in found) for found in each]),
        row(
            f"% below {NEAR_DEG:g} deg there",
            [100 * float(np.mean([s.later_near for s in found])) for found in each],
            1,
        ),
    ]
    heading = f"Inclination (deg) after a start inside a motion, mean of {len(each[0])}, parameters for real recordings"
    return [Section(heading, table=Table(["seconds after the start", *by_filter], rows))]
