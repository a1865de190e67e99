"""A car on a level road with exact truth, made without any code of the product.

Its body leans on its springs, its rear wheels slip sideways, its sensor is mounted askew and away from the rear axle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from support.motions import G

DT = 0.005  # s
MOUNT = np.array([0.1, -0.2, 0.7])  # rad, roll, pitch, yaw of the sensor in the car
IMU_POSITION = np.array([1.2, 0.3, 0.4])  # m, from the middle of the rear axle

_FINE = 5  # steps per sample
_ROLL, _PITCH = np.deg2rad(5) / G, np.deg2rad(2) / G  # lean per acceleration to the side and ahead
_SLIP = np.deg2rad(2) / G  # slip angle of the rear wheels per acceleration to the side


@dataclass(frozen=True)
class Drive:
    """What an ideal IMU reads, (n, 3), the speed of the rear wheels, (n,), and the truth; row k belongs to k DT.

    velocity: m/s, (n, 3), of the sensor, in N.
    """

    gyro: np.ndarray
    accel: np.ndarray
    forward_speed: np.ndarray
    vertical: np.ndarray
    velocity: np.ndarray


def drive(speed: np.ndarray, yaw_rate: np.ndarray) -> Drive:
    """speed: m/s, yaw_rate: rad/s, one value per sample, both smooth."""
    n, dt = len(speed), DT / _FINE
    rows, fine = np.arange(n) * DT, np.arange((n - 1) * _FINE + 1) * dt
    s, r = (_smooth(np.interp(fine, rows, values)) for values in (speed, yaw_rate))
    ahead, aside = np.gradient(s, dt), s * r
    heading = np.cumsum(r) * dt
    R_NB = Rotation.from_euler("ZYX", np.column_stack([heading, -_PITCH * ahead, _ROLL * aside]))
    course = heading - _SLIP * aside
    velocity = (s / np.cos(_SLIP * aside))[:, None] * np.column_stack([np.cos(course), np.sin(course), 0 * course])
    position = np.cumsum(velocity, axis=0) * dt + R_NB.apply(IMU_POSITION)
    of_sensor = np.gradient(position, dt, axis=0)
    acceleration = np.gradient(of_sensor, dt, axis=0)
    R_NS = (R_NB * Rotation.from_euler("ZYX", MOUNT[::-1]))[::_FINE]
    turns = np.vstack([np.zeros(3), (R_NS[:-1].inv() * R_NS[1:]).as_rotvec() / DT])
    accel = R_NS.inv().apply(acceleration[::_FINE] + np.array([0, 0, G]))
    return Drive(turns, accel, s[::_FINE], R_NS.inv().apply([0, 0, 1]), of_sensor[::_FINE])


def _smooth(values: np.ndarray) -> np.ndarray:
    """Twice the mean over 0.3 s: a car has mass."""
    width = round(0.3 / DT) * _FINE
    for _ in range(2):
        padded = np.concatenate([np.full(width // 2, values[0]), values, np.full(width - width // 2 - 1, values[-1])])
        values = np.convolve(padded, np.full(width, 1 / width), mode="valid")
    return values


def roundabout(seconds: float = 60.0) -> Drive:
    """From rest to 12 m/s, then circles at 4 m/s2."""
    t = np.arange(round(seconds / DT)) * DT
    return drive(np.clip((t - 3) * 2.0, 0, 12.0), np.where(t > 10, 4 / 12.0, 0.0))


def lane_changes(seconds: float = 30.0) -> Drive:
    """From rest to 20 m/s, then a double lane change at 5 m/s2 every eight seconds."""
    t = np.arange(round(seconds / DT)) * DT
    phase = np.mod(t - 11, 8.0)
    swing = np.where((t > 11) & (phase < 4), np.sin(np.pi * phase) * np.where(phase < 2, 1, -1), 0.0)
    return drive(np.clip((t - 3) * 3.0, 0, 20.0), 5 / 20.0 * swing)


def slalom(seconds: float = 40.0) -> Drive:
    """From rest to 12 m/s, then a slalom at 5 m/s2 and 0.3 Hz."""
    t = np.arange(round(seconds / DT)) * DT
    return drive(np.clip((t - 3) * 2.0, 0, 12.0), np.where(t > 10, 5 / 12.0 * np.sin(0.6 * np.pi * (t - 10)), 0.0))


def braking(seconds: float = 40.0) -> Drive:
    """From rest to 20 m/s at 2 m/s2, and back to rest at 7 m/s2, again and again."""
    t = np.arange(round(seconds / DT)) * DT
    phase = np.mod(t - 3, 17.0)
    speed = np.where(t < 3, 0.0, np.interp(phase, [0, 10, 12, 12 + 20 / 7, 17], [0, 20, 20, 0, 0]))
    return drive(speed, np.zeros_like(t))
