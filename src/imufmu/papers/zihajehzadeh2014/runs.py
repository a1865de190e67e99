"""The chain of the experiments of Zihajehzadeh et al. 2014: truth, IMU, filter with the paper's parameters.

Chosen freely: white noise of 0.01 rad/s and 0.01 m/s2 per sample (the filter's variances), 0.15 % of the field for the
magnetometer, and sigma_M^2 = 1e-4.
"""

from __future__ import annotations

from math import pi, radians
from typing import Any

import numpy as np

from ...blocks.running import Trajectory
from ...blocks.vocabulary import GRAVITY
from ...compiled.running import run
from ...estimators.zihajehzadeh2014 import BLOCK
from ...scoring.metrics import angle_difference
from ...sensors import imu
from ..motions import white_noise
from .motions import FIELD, NORM

PERIOD = 0.01  # s, sec. III
NOISE = white_noise(PERIOD, 0.01, 0.01, 0.0015 * NORM)
PAPER = {  # sec. III; g and the field are those of the motions
    "sample_period": PERIOD,
    "c_a": 0.3,
    "sigma_g2": 1e-4,
    "sigma_a2": 1e-4,
    "sigma_m2": 1e-4,
    "eps_m": 1e-2 * NORM,
    "eps_dip": radians(2),
    "g": GRAVITY,
    "m_ref": FIELD,
    "h": NORM,
}
NO_TEST = {"eps_m": 1e6, "eps_dip": pi}
STRICT = {"eps_yaw": 0.1, "yaw_drift": 0.005}  # rad, rad/s: not in the paper
ANGLES = ("roll", "pitch", "yaw")


def read(truth: Trajectory, seed: int, bias: float = 0.0) -> Trajectory:
    """Readings of an IMU that moves like this. bias: of its third gyroscope, rad/s."""
    ideal = {signal.name: truth[signal.name] for signal in imu.BLOCK.inputs}
    return run(imu.BLOCK, ideal, NOISE | {"sample_period": PERIOD, "seed": seed, "gyro_bias[3]": bias})


def filtered(readings: Trajectory, **changes: Any) -> Trajectory:
    """The filter with the paper's parameters, some of them changed."""
    return run(BLOCK, {signal.name: readings[signal.name] for signal in BLOCK.inputs}, PAPER | changes)


def errors(estimate: Trajectory, truth: Trajectory) -> np.ndarray:
    """Errors of roll, pitch and yaw over time, (n, 3), deg."""
    return np.degrees(np.column_stack([angle_difference(estimate[name], truth[name]) for name in ANGLES]))


def yaw_error(estimate: Trajectory, truth: Trajectory) -> np.ndarray:
    """Size of the error of yaw over time, (n,), deg."""
    return np.abs(errors(estimate, truth)[:, 2])
