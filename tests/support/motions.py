"""Seeded motions of a sensor with exact truth, made without any code of the product."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

G = 9.8  # m/s2
FIELD_N = np.array([0.0, 20.0, -45.0])  # uT, East-North-Up: magnetic North is geographic North
_FINE = 8  # rotation steps per sample: truth is piecewise of constant rate at eight times the sample rate


@dataclass(frozen=True)
class Motion:
    """What an ideal IMU reads, and the truth; row k belongs to k dt.

    gyro, accel, mag, vertical, acceleration: (n, 3), in S, rad/s, m/s2, uT, 1, m/s2. R_NS: (n,).
    """

    dt: float
    gyro: np.ndarray
    accel: np.ndarray
    mag: np.ndarray
    vertical: np.ndarray
    acceleration: np.ndarray
    R_NS: Rotation

    def noisy(self, rng: np.random.Generator, std: float = 0.01) -> Motion:
        """The same with white noise of this standard deviation per sample on gyro (rad/s) and accel (m/s2)."""
        shape = self.gyro.shape
        gyro, accel = self.gyro + rng.normal(0, std, shape), self.accel + rng.normal(0, std, shape)
        return Motion(self.dt, gyro, accel, self.mag, self.vertical, self.acceleration, self.R_NS)


def wander(rng: np.random.Generator, t: np.ndarray, rms: float, fastest: float = 1.0) -> np.ndarray:
    """Three sums of random sinusoids up to ``fastest`` (Hz), (len(t), 3), of this root mean square per axis."""
    frequency, phase = rng.uniform(0.05, fastest, (8, 3)), rng.uniform(0, 2 * np.pi, (8, 3))
    waves = np.sin(2 * np.pi * frequency * t[:, None, None] + phase)
    return rms / 2 * waves.sum(axis=1)  # eight sines: root mean square 2


def motion(
    rng: np.random.Generator, n: int, *, dt: float = 0.01, rate: float = 1.0, acceleration: float = 1.0
) -> Motion:
    """A sensor that tumbles (rate, rad/s rms per axis) and is shaken (acceleration, m/s2 rms per axis)."""
    fine = np.arange(n * _FINE) * dt / _FINE
    w = wander(rng, fine, rate)
    start = Rotation.random(random_state=rng)
    R_NS = _integrate(start, w, dt / _FINE)[::_FINE]
    a_N = wander(rng, fine, acceleration)[::_FINE]
    return _readings(dt, w[::_FINE], R_NS, a_N)


def turn(start: Rotation, w: np.ndarray, n: int, dt: float = 0.01) -> Motion:
    """A sensor that turns at a constant rate w (3,), rad/s in S, and is not accelerated."""
    R_NS = start * Rotation.from_rotvec(np.arange(n)[:, None] * dt * w)
    return _readings(dt, np.tile(w, (n, 1)), R_NS, np.zeros((n, 3)))


def rest(attitude: Rotation, n: int, dt: float = 0.01) -> Motion:
    """A sensor at rest."""
    return turn(attitude, np.zeros(3), n, dt)


def angle(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Angle (n,), rad, between the vectors in the rows of a and b (n, 3), accurate when small."""
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.sum(a * b, axis=1))


def _integrate(start: Rotation, w: np.ndarray, dt: float) -> Rotation:
    steps = Rotation.from_rotvec(w * dt)
    reached = [start]
    for step in steps[:-1]:
        reached.append(reached[-1] * step)
    return Rotation.concatenate(reached)


def _readings(dt: float, w: np.ndarray, R_NS: Rotation, a_N: np.ndarray) -> Motion:
    into_sensor = R_NS.inv()
    vertical, a_S = into_sensor.apply([0.0, 0.0, 1.0]), into_sensor.apply(a_N)
    return Motion(dt, w, G * vertical + a_S, into_sensor.apply(FIELD_N), vertical, a_S, R_NS)
