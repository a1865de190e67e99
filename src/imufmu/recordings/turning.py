"""Do gyroscope and accelerometer of a recording fit together? Told by the turn of gravity.

Readings of a right accelerometer, brought by a right gyroscope into axes that do not turn, have gravity for their mean:
what is left of it over a few seconds is much more than if one axis were flipped, two were swapped or the unit were
another. So every signed permutation of the gyroscope's axes, with the units in use, is tried on the most turning
windows. The incoherence of one is the part of the squared readings that their mean over a window does not explain.

An accelerometer may also see no turn of gravity where there is one: that of a pendulum's bob reads along the rod
at any angle. So what fits has to do so much better than a gyroscope that reads nothing.

A sign of the accelerometer as a whole cannot be seen here: minus gravity turns as gravity does.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

_WINDOW = 2.5  # s; longer than a movement to and fro, short enough for a gyroscope's bias
_MOST = 30  # windows, those with the most turning
_STEP = 0.02  # s between the rates that are integrated, at least
_FEWEST = 3  # windows
_STEADY = 0.1  # scatter of the readings' length in a window, relative: more of it is motion, and not gravity
# Of 49 recordings of others that fit, none has a candidate with so much less; a flipped axis leaves 4 to 12 times as
# much as the right one where there is turning about it. A slow test looks at all of them.
_CLEARLY_LESS = 0.4
_SEEN = 0.003  # incoherence below which there was too little turning to tell, or nothing is wrong
_EXACTLY = 0.01  # incoherence; of a turn about one axis alone no more is believed: a swing leans readings the other way
_FINALISTS = 24  # candidates that are tried on all windows
_ALIKE = 0.05  # of the way from the best to the readings as they are

DEGREE = np.pi / 180
_PERMUTATIONS = np.array(
    [
        np.diag(signs) @ np.eye(3)[list(order)]
        for order in itertools.permutations(range(3))
        for signs in itertools.product((1, -1), repeat=3)
    ]
)


@dataclass(frozen=True)
class Turning:
    """What fits best. matrix: (3, 3), what the gyroscope's readings have to be multiplied with; the identity times 1
    where nothing speaks against them as they are. scale: its factor. seen: whether there was turning enough to tell.
    """

    matrix: np.ndarray
    scale: float
    seen: bool

    @property
    def fits(self) -> bool:
        return self.scale == 1 and bool((self.matrix == np.eye(3)).all())

    @property
    def is_of_vector(self) -> bool:
        """Whether it can be the vector whose axes are wrong, and not the gyroscope's."""
        return self.scale == 1 and bool(np.linalg.det(self.matrix) > 0)

    @property
    def vector_matrix(self) -> np.ndarray:
        """What the vector's readings have to be multiplied with, but for the sign of all, if it is they that are wrong.

        Right readings v turn as v' = v x w. With S v in their place that is (S v)' = (S v) x (det S) (S w), so that the
        gyroscope seems to need det(S) S: a rotation, the same for S and -S.
        """
        return np.asarray(self.matrix.T)


UNKNOWN = Turning(np.eye(3), 1.0, False)


@np.errstate(over="ignore", invalid="ignore")  # of absurd values nothing is told
def turning(gyro: np.ndarray, accel: np.ndarray, index: np.ndarray, period: float) -> Turning:
    """Readings (n, 3), rad/s and any unit, their whole-number instants (n,) and the sample period (s)."""
    windows = _windows(gyro, accel, index, period)
    if windows is None:
        return UNKNOWN
    as_is = float(_incoherences([np.eye(3)], *windows)[0])
    opposite, still = _incoherences([-np.eye(3), np.zeros((3, 3))], *windows)
    as_they_are = Turning(np.eye(3), 1.0, bool(as_is < _CLEARLY_LESS * opposite and opposite > _SEEN))
    if as_is < _SEEN:
        return as_they_are
    tried = [(1.0, m) for m in _PERMUTATIONS] + [(s, np.eye(3)) for s in (0.5, 2.0)]
    tried += [(s, m) for s in (DEGREE, 1 / DEGREE) for m in _PERMUTATIONS]
    rates, forces, step = windows
    roughly = _incoherences([scale * m for scale, m in tried], rates[::4], forces[::4], step)
    tried = [tried[i] for i in np.argsort(roughly)[:_FINALISTS]]
    found = _incoherences([scale * m for scale, m in tried], *windows)
    best = float(found.min())
    if best > _CLEARLY_LESS * min(as_is, float(still)) or (best > _EXACTLY and _is_planar(*windows[:2])):
        return as_they_are
    alike = [candidate for candidate, left in zip(tried, found, strict=True) if left <= best + _ALIKE * (as_is - best)]
    scale, matrix = min(alike, key=_oddness)
    return Turning(matrix, scale, True)


@np.errstate(over="ignore", invalid="ignore")
def best_scale(gyro: np.ndarray, accel: np.ndarray, index: np.ndarray, period: float, scales: Sequence[float]) -> int:
    """Place of the factor of the gyroscope that fits much better than the others, -1 where none does."""
    windows = _windows(gyro, accel, index, period)
    if windows is None:
        return -1
    found = _incoherences([scale * np.eye(3) for scale in (*scales, 0.0)], *windows)
    best, second = np.sort(found)[:2]
    told = best < _CLEARLY_LESS * second and second > 1e-4 and np.argmin(found) < len(scales)
    return int(np.argmin(found)) if told else -1


def columns_told(matrix: np.ndarray, names: Sequence[str]) -> str:
    """Columns x, y, z after a signed permutation, as a user tells them."""
    signs, order = matrix.sum(axis=1), np.abs(matrix).argmax(axis=1)
    return ",".join(("-" if signs[i] < 0 else "") + names[order[i]] for i in range(3))


def told(fit: Turning, names: Sequence[str] = ("gyro[1]", "gyro[2]", "gyro[3]"), what: str = "gravity") -> str:
    """What does not fit, and what to do, in one sentence; empty where everything does.

    names: columns of the gyro. what: gravity, seen by the accelerometer, or the magnetic field.
    """
    if fit.fits:
        return ""
    said = []
    if abs(fit.scale - DEGREE) < 1e-9:
        said.append(f"gyro turns 57 times as far as {what}: its values are in deg/s")
    elif abs(fit.scale - 1 / DEGREE) < 1e-6:
        said.append(f"gyro turns 57 times less far than {what}: its values are not in deg/s")
    elif fit.scale != 1:
        said.append(f"gyro turns {1 / fit.scale:g} times as far as {what}: its range is set otherwise than assumed")
    matrix = fit.matrix
    signs, order = matrix.sum(axis=1), np.abs(matrix).argmax(axis=1)
    flipped = ["xyz"[i] for i in range(3) if signs[i] < 0]
    if (order == range(3)).all() and len(flipped) == 3:
        said.append(
            f"gyro turns the other way than {what} about every axis: the axes are a left-handed set (one axis is "
            "flipped, or two are swapped, in both sensors), or gyro is negated"
        )
    elif (order == range(3)).all() and len(flipped) == 2:
        kept = "xyz"[next(i for i in range(3) if signs[i] > 0)]
        vector = "accel" if what == "gravity" else "mag"
        said.append(f"axis {kept} of {vector} is flipped, or {' and '.join(flipped)} of gyro are")
    elif flipped and (order == range(3)).all():
        said.append(f"axis {flipped[0]} of gyro is flipped")
    elif not (order == range(3)).all():
        vector = "accel" if what == "gravity" else "mag"
        said.append(f"axes of gyro and {vector} are not the same: two or more are swapped")
    unit = ":deg/s" if abs(fit.scale - DEGREE) < 1e-9 else ""
    fixes = (order != range(3)).any() or flipped or unit
    return "; ".join(said) + (f"; gyro fits as --columns gyro={columns_told(matrix, names)}{unit}" if fixes else "")


def _oddness(candidate: tuple[float, np.ndarray]) -> tuple[int, int, int]:
    """The simplest of explanations that fit alike: a unit, then signs of all axes, of one, of two, then swaps."""
    scale, matrix = candidate
    swapped = int((np.abs(matrix).argmax(axis=1) != range(3)).sum())
    negative = int((matrix < 0).sum())
    return swapped, {0: 0, 3: 1, 1: 2, 2: 3}[negative], int(scale != 1)


def _windows(
    gyro: np.ndarray, accel: np.ndarray, index: np.ndarray, period: float
) -> tuple[np.ndarray, np.ndarray, float] | None:
    """Rates and readings (windows, steps, 3) of those windows that turn gravity most, and the step (s)."""
    block = max(1, round(_STEP / period))
    step = block * period
    length = max(10, round(_WINDOW / step))
    count = (int(index[-1]) + 1) // (block * length)
    kept = index < count * block * length
    if count < _FEWEST or not kept.any():
        return None
    readings = np.full((2, count * block * length, 3), np.nan)
    readings[0, index[kept]], readings[1, index[kept]] = gyro[kept], accel[kept]
    known = np.isfinite(readings).all(axis=(0, 2))
    readings[:, ~known] = 0
    weights = known.reshape(count, length, block).sum(axis=2)
    means = readings.reshape(2, count, length, block, 3).sum(axis=3) / np.maximum(weights, 1)[..., None]
    lengths = np.linalg.norm(means[1], axis=2)
    steady = lengths.std(axis=1) < _STEADY * lengths.mean(axis=1)
    rates, forces = means[:, steady & ((weights > 0).mean(axis=1) > 0.9)]
    turned = (np.cross(forces, rates) ** 2).sum(axis=(1, 2))
    chosen = np.argsort(-turned)[:_MOST]
    if len(chosen) < _FEWEST or not np.isfinite(turned[chosen]).all() or not (forces**2).sum() > 0:
        return None
    return rates[chosen], forces[chosen], step


def _is_planar(rates: np.ndarray, forces: np.ndarray) -> bool:
    """Whether gravity is turned about hardly more than one axis."""
    up = forces / np.maximum(np.linalg.norm(forces, axis=2, keepdims=True), 1e-12)
    across = (rates - (rates * up).sum(axis=2, keepdims=True) * up).reshape(-1, 3)
    sizes = np.linalg.eigvalsh(across.T @ across)
    return bool(sizes[1] < 0.05 * sizes[2])


def _incoherences(matrices: Sequence[np.ndarray], rates: np.ndarray, forces: np.ndarray, step: float) -> np.ndarray:
    """Part of the squared readings that is not their mean in axes that do not turn, for gyro times each matrix."""
    turns = np.einsum("cij,wlj->lcwi", np.array(matrices), rates) * step
    shape = turns.shape[1:]
    attitude = np.broadcast_to(np.eye(3), (*shape, 3)).copy()
    total = np.zeros(shape)
    for k in range(len(turns)):
        total += np.einsum("cwij,wj->cwi", attitude, forces[:, k])
        attitude = attitude @ _rotations((turns[k] + turns[min(k + 1, len(turns) - 1)]) / 2)
    explained = (total**2).sum(axis=(1, 2)) / len(turns)
    return np.asarray(1 - explained / (forces**2).sum())


def _rotations(turns: np.ndarray) -> np.ndarray:
    """Rotation matrices (..., 3, 3) of rotation vectors (..., 3), after Rodrigues."""
    angle = np.linalg.norm(turns, axis=-1, keepdims=True)[..., None]
    x, y, z = np.moveaxis(turns / np.maximum(angle[..., 0], 1e-12), -1, 0)
    zero = np.zeros_like(x)
    cross = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(*x.shape, 3, 3)
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * (cross @ cross))
