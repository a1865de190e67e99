"""Motions for the tests of plumb, made without any code of the product, and short ways to run it on them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from imufmu.blocks.running import Trajectory
from imufmu.compiled.running import run
from imufmu.estimators import plumb
from support import motions
from support.motions import Motion, angle

BLOCK = plumb.BLOCK
G = motions.G
DEFAULTS = {q.name: q.start for q in BLOCK.own_parameters}


def estimate(motion: Motion, **parameters: Any) -> Trajectory:
    settings = {"sample_period": motion.dt, "g": G} | parameters
    return run(BLOCK, {"gyro": motion.gyro, "accel": motion.accel}, settings)


def tilt_deg(motion: Motion, result: Trajectory) -> np.ndarray:
    return np.rad2deg(angle(result["vertical"], motion.vertical))


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def tumbling(rng: np.random.Generator, t: np.ndarray, rate: float) -> Rotation:
    """Attitude that turns about all axes, at about this rate (rad/s rms per axis)."""
    frequency, phase = rng.uniform(0.1, 0.4, (2, 3)), rng.uniform(0, 2 * np.pi, (2, 3))
    angles = rate / (2 * np.pi * frequency) * np.sin(2 * np.pi * frequency * t[:, None, None] + phase)
    return Rotation.from_euler("ZYX", angles.sum(axis=1))


def mean_rates(R_NS: Rotation, dt: float) -> np.ndarray:
    """What a gyroscope reads, (n, 3), that reports the mean over the period that ends with the sample."""
    return np.vstack([np.zeros(3), (R_NS[:-1].inv() * R_NS[1:]).as_rotvec() / dt])


def moving(
    seed: int, seconds: float, *, dt: float = 0.01, speed: float = 0.3, rate: float = 1.0, rest: float = 0.0
) -> Motion:
    """A sensor that rests, then tumbles while its velocity swings at 0.5 to 3 Hz (speed, m/s rms per axis)."""
    rng, t = np.random.default_rng(seed), np.arange(round(seconds / dt)) * dt
    since = np.maximum(t - rest, 0)
    R_NS = tumbling(rng, since**2 / (since + 1), rate)
    frequency, phase = rng.uniform(0.5, 3, (8, 3)), rng.uniform(0, 2 * np.pi, (8, 3))
    waves = np.sin(2 * np.pi * frequency * t[:, None, None] + phase).sum(axis=1)
    velocity = np.minimum(since, 1)[:, None] * speed / 2 * waves
    return motions._readings(dt, mean_rates(R_NS, dt), R_NS, np.diff(velocity, axis=0, prepend=velocity[:1]) / dt)


def smooth(t: np.ndarray, begin: float, lasts: float) -> np.ndarray:
    """0 until ``begin``, 1 from ``lasts`` s later, without a corner between."""
    x = np.clip((t - begin) / lasts, 0, 1)
    return x * x * (3 - 2 * x)


def carried(
    t: np.ndarray,
    *,
    roll: np.ndarray | float = 0.0,
    pitch: np.ndarray | float = 0.0,
    yaw: np.ndarray | float = 0.0,
    acceleration: tuple[np.ndarray | float, ...] = (0.0, 0.0, 0.0),
) -> Motion:
    """A sensor with these Euler angles (rad) and this acceleration in N (m/s2), each over time or constant."""
    angles = np.column_stack([np.broadcast_to(a, len(t)) for a in (yaw, pitch, roll)])
    a_N = np.column_stack([np.broadcast_to(a, len(t)) for a in acceleration])
    R_NS, dt = Rotation.from_euler("ZYX", angles), t[1] - t[0]
    return motions._readings(dt, mean_rates(R_NS, dt), R_NS, a_N)


def part_of(motion: Motion, rows: Any) -> Motion:
    """The rows of a motion that an index picks, as if nothing were missing between."""
    names = ("gyro", "accel", "mag", "vertical", "acceleration", "R_NS")
    return Motion(motion.dt, *(getattr(motion, name)[rows] for name in names))


def consumer(motion: Motion, seed: int = 30) -> dict[str, np.ndarray]:
    """The readings of a motion with the noise of a consumer device and its bias of 0.4 deg/s."""
    rng, n, wide = np.random.default_rng(seed), len(motion.gyro), math.sqrt(0.02 / motion.dt)
    gyro = motion.gyro + np.array([0.005, -0.003, 0.004]) + rng.normal(0, 0.001 * wide, (n, 3))
    return {"gyro": gyro, "accel": motion.accel + rng.normal(0, 0.005 * wide, (n, 3))}


def tilt_of(motion: Motion, readings: dict[str, np.ndarray], **parameters: Any) -> tuple[np.ndarray, Trajectory]:
    """Tilt error (deg) over time, and all results."""
    result = run(BLOCK, readings, {"sample_period": motion.dt, "g": G, "gyro_index": 1} | parameters)
    return tilt_deg(motion, result), result
