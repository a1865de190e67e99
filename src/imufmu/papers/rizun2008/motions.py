"""Motions of the experiments on Rizun 2008, and the readings that an IMU makes of them.

The white velocity of the paper's (14) is drawn exactly at the sample instants, so a record may be as long as a mean
needs: each component is an Ornstein-Uhlenbeck process,

    v_k+1 = rho v_k + sigma sqrt(1 - rho^2) n_k,   rho = exp(-omega_c dt),   sigma^2 = delta_v^2 omega_c / 4

and the acceleration of sample k is its mean (v_k+1 - v_k) / dt over the period that follows the instant.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ...blocks.rotations import over_rows, quaternion_from_rotation_vector, rotate_back
from ...blocks.vocabulary import GRAVITY
from ...compiled.running import run
from ...sensors import imu

UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Motion:
    """What an ideal IMU reads, and the truth. Rows are samples, ``period`` (s) apart.

    q_NS: (n, 4). angular_velocity: (n, 3), rad/s; specific_force: (n, 3), m/s2; vertical: (n, 3); all in S.
    """

    period: float
    q_NS: np.ndarray
    angular_velocity: np.ndarray
    specific_force: np.ndarray
    vertical: np.ndarray

    @property
    def time(self) -> np.ndarray:
        return np.arange(len(self.q_NS)) * self.period


def turning(w: np.ndarray, acceleration: np.ndarray, period: float) -> Motion:
    """A sensor that turns at the constant rate w (3,), rad/s in S, under an acceleration (n, 3), m/s2 in N."""
    n = len(acceleration)
    q_NS = over_rows(lambda t: quaternion_from_rotation_vector(ca.DM(w) * t), np.arange(n) * period)
    specific_force = over_rows(rotate_back, q_NS, acceleration + GRAVITY * UP)
    vertical = over_rows(rotate_back, q_NS, np.tile(UP, (n, 1)))
    return Motion(period, q_NS, np.tile(w, (n, 1)), specific_force, vertical)


def white_velocity(
    rng: np.random.Generator, seconds: float, period: float, delta_v: float, omega_c: float
) -> np.ndarray:
    """Acceleration (n, 3), m/s2, of a point with the velocity spectrum (14). Units as in ``prediction``."""
    n = round(seconds / period)
    rho = np.exp(-omega_c * period)
    draws = rng.normal(0.0, delta_v * np.sqrt(omega_c) / 2, (n + 1, 3))
    draws[1:] *= np.sqrt(1 - rho**2)
    v = draws
    for k in range(n):
        v[k + 1] += rho * v[k]
    return np.diff(v, axis=0) / period


def circle(seconds: float, period: float, rate: float, radius: float) -> Motion:
    """A sensor that is carried round a horizontal circle (rad/s, m) and turns with it."""
    t = np.arange(round(seconds / period)) * period
    towards_centre = -np.column_stack([np.cos(rate * t), np.sin(rate * t), 0 * t])
    return turning(rate * UP, rate**2 * radius * towards_centre, period)


def inclined_plane(seconds: float, period: float, frequency: float) -> Motion:
    """The block of section 2.5: up and down a plane of 45 deg with sqrt(2) g at this frequency (Hz), never turned."""
    t = np.arange(round(seconds / period)) * period
    along = np.array([1.0, 0.0, 1.0]) / np.sqrt(2)
    return turning(np.zeros(3), np.sqrt(2) * GRAVITY * np.sin(2 * np.pi * frequency * t)[:, None] * along, period)


def readings(motion: Motion, errors: Mapping[str, float] | None = None) -> dict[str, np.ndarray]:
    """``gyro`` and ``accel`` (n, 3) of an IMU with these parameters; without any, an ideal one."""
    ideal = {"angular_velocity": motion.angular_velocity, "specific_force": motion.specific_force}
    read = run(imu.BLOCK, ideal, {"sample_period": motion.period} | dict(errors or {}))
    return {name: read[name] for name in ("gyro", "accel")}
