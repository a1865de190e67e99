"""Timing of a device's gyroscope, from recordings of it: the ``gyro_index`` that makes them likeliest.

A rate is the mean over a sample period, of the one before or after its stamp, or the value of an instant (equation
(18) of plumb). The wrong one turns every attitude by a part of what the rate changes within a sample; the velocity
that follows is larger than the filter expects. With e, P- and P of v at the end of a block of plumb, what its
measurement corrected and the covariance before and after it, the innovation has the likelihood L:

    -2 log L = 2 log det P- - log det M + e' M^-1 e,   M = P- - P

summed over all blocks in motion of all recordings. Innovations are correlated, so this is no probability, and every
motion has preferences of its own: from a single recording it finds the wrong timing as often as not. The timing is the
same in all recordings of a device, their motions are not. A recording of less than GENTLE says nothing: timing moves
the vertical by next to nothing there, and a vehicle in a bend, whose velocity is no noise, looks the same. No other
parameter of plumb can be found so: the likelihood takes the correlation for a small density of the velocity.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike

import numpy as np

from ..compiled.smoothing import blocks
from ..estimators.plumb.covariance import N_ERRORS, V
from ..papers.experiment import Progress
from ..recordings.reading import Recording, RecordingError, read
from ..scoring.metrics import inclination_error, vertical_of
from ..scoring.table import Table
from .sources import Place, sources

TIMINGS: Mapping[int, str] = {
    1: "means over the period before the stamp",
    2: "values of the instant",
    0: "means over the period after the stamp",
}
LEAST = 2  # recordings
GENTLE = 0.15  # rad/s, root mean square of one axis
AGREE = 0.5  # of the recordings, at least, prefer what is found to each other timing


@dataclass(frozen=True)
class Timing:
    """One gyro_index over all recordings. cost: -2 log L less that of the best.

    agree: recordings that prefer the best to it. change_deg: what it turns the vertical by from where the best has it,
    root mean square.
    """

    gyro_index: int
    cost: float
    agree: int
    change_deg: float


@dataclass(frozen=True)
class DeviceTiming:
    """The timing found, None where the recordings do not tell; that in a sentence; the likeliest timing first.

    recordings: names of those that count.
    """

    gyro_index: int | None
    verdict: str
    timings: Sequence[Timing]
    recordings: Sequence[str]
    notes: Sequence[str] = ()

    @property
    def table(self) -> Table:
        """A row per timing."""
        columns = ["gyro_index", "the rates are", "-2 log L", "less likely in", "turns the vertical by (deg)"]
        rows = [
            [
                str(t.gyro_index),
                TIMINGS[t.gyro_index],
                f"{t.cost:.1f}",
                str(t.agree) if k else "",
                f"{t.change_deg:.2f}",
            ]
            for k, t in enumerate(self.timings)
        ]
        return Table(columns, rows, words=True)


def device_timing(
    recordings: Place | Recording | Iterable[Place | Recording], progress: Progress | None = None
) -> DeviceTiming:
    """The timing of the one device that all these recordings are of.

    recordings: read already, or folders, files and patterns. The truth is not needed. Raises ValueError for a place
    that is none.
    """
    known, notes = _read(recordings)
    turning = [recording for recording in known if _rate(recording) > GENTLE]
    gentle = [recording.name for recording in known if not _rate(recording) > GENTLE]
    if gentle:
        notes.append(f"turns too gently to tell anything about timing: {', '.join(gentle)}")
    found = []
    for done, recording in enumerate(turning):
        found.append(_of_one(recording))
        if progress:
            progress(done + 1, len(turning))
    rows = [(cost, change, r.name) for (count, cost, change), r in zip(found, turning, strict=True) if count]
    if not rows:
        return DeviceTiming(None, "No recording turns enough to tell the timing: leave gyro_index = 3.", [], [], notes)
    costs, changes, names = zip(*rows, strict=True)
    return _judged(np.array(costs), np.array(changes), names, notes)


def _read(given: Place | Recording | Iterable[Place | Recording]) -> tuple[list[Recording], list[str]]:
    known: list[Recording] = []
    notes: list[str] = []
    for one in [given] if isinstance(given, str | PathLike | Recording) else given:
        if isinstance(one, Recording):
            known.append(one)
            continue
        for source in sources(one).files:
            try:
                known.append(read(source.path))
            except RecordingError as fault:
                notes.append(f"left out: {fault}")
    return known, notes


def _rate(recording: Recording) -> float:
    """Root mean square (rad/s) of one axis."""
    gyro = recording.gyro[np.isfinite(recording.gyro).all(axis=1)]
    return float(np.sqrt(np.mean(gyro**2))) if len(gyro) else 0.0


def _of_one(recording: Recording) -> tuple[int, np.ndarray, np.ndarray]:
    """Number of blocks that count; of every timing -2 log L (3,) and the distances (3, 3), rad2, of its vertical."""
    readings = {name: recording.at_instants()[name] for name in ("gyro", "accel")}
    verticals, costs = [], []
    for gyro_index in TIMINGS:
        pieces = list(blocks(readings, {"sample_period": recording.sample_period, "gyro_index": gyro_index}))
        costs.append(np.concatenate([block_costs(piece) for piece in pieces]))
        verticals.append(vertical_of(np.concatenate([piece["q"] for piece in pieces])))
    fewest = min(map(len, costs))  # rest and start do not end in the same block with every timing
    if not fewest:
        return 0, np.zeros(0), np.zeros(0)
    distances = [[np.mean(inclination_error(a, b) ** 2) for b in verticals] for a in verticals]
    return fewest, fewest * np.array([c.mean() for c in costs]), np.array(distances)


def block_costs(rows: Mapping[str, np.ndarray]) -> np.ndarray:
    """-2 log L (m,) of every block in motion, up to a constant."""
    moves = (rows["resting"] == 0) & (rows["anew"] == 0) & (rows["coarse"][rows["ends"]] == 0)
    before, after = (_of_velocity(rows[name][moves]) for name in ("P_before", "P"))
    error, M = rows["error"][moves][:, V], before - after
    measured = np.linalg.det(M) > 0
    before, error, M = before[measured], error[measured], M[measured]
    surprise = np.einsum("ij,ij->i", error, np.linalg.solve(M, error[:, :, None])[:, :, 0])
    return 2 * np.linalg.slogdet(before)[1] - np.linalg.slogdet(M)[1] + surprise


def _of_velocity(triangles: np.ndarray) -> np.ndarray:
    """The part (m, 3, 3) of v of covariances, from their upper triangles."""
    place, (i, j) = np.zeros((N_ERRORS, N_ERRORS), int), np.triu_indices(N_ERRORS)
    place[i, j] = place[j, i] = np.arange(len(i))
    return triangles[:, place[V, V]]


def _judged(costs: np.ndarray, changes: np.ndarray, names: Sequence[str], notes: Sequence[str]) -> DeviceTiming:
    """costs: (n, 3). changes: (n, 3, 3), rad2."""
    pooled, indices = costs.sum(axis=0), list(TIMINGS)
    order = np.argsort(pooled)
    best, n = order[0], len(names)
    agree = (costs > costs[:, [best]]).sum(axis=0)
    change = np.rad2deg(np.sqrt(changes.mean(axis=0)[best]))
    timings = [Timing(indices[k], float(pooled[k] - pooled[best]), int(agree[k]), float(change[k])) for k in order]
    likeliest = f"gyro_index = {timings[0].gyro_index} is likeliest ({TIMINGS[timings[0].gyro_index]})"
    fewest = min(t.agree for t in timings[1:])
    if n < LEAST:
        verdict = (
            f"{likeliest}, but one recording tells nothing: its own motion decides. Give some more of this device."
        )
    elif fewest < AGREE * n:
        verdict = f"{likeliest}, but only {fewest} of {n} recordings say so: leave gyro_index = 3, or record more."
    else:
        verdict = f"Set {likeliest.replace(' is likeliest', '')}, by {fewest} of {n} recordings and all together."
    found = timings[0].gyro_index if n >= LEAST and fewest >= AGREE * n else None
    return DeviceTiming(found, verdict, timings, list(names), notes)
