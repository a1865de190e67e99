"""Motions for the tests of plumb, made without any code of the product, and short ways to run it on them."""

from __future__ import annotations

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
