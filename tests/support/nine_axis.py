"""Runs of the filter of Zihajehzadeh et al. 2014 on seeded motions, in a field that may be disturbed."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from imufmu.blocks.running import Trajectory
from imufmu.compiled.running import run
from imufmu.estimators.zihajehzadeh2014 import BLOCK
from support import motions
from support.motions import FIELD_N

NORM = float(np.linalg.norm(FIELD_N))
DIP = math.atan2(-FIELD_N[2], FIELD_N[1])  # rad
FIELD = {"m_ref": FIELD_N, "h": NORM}
MAG_STD = 0.07  # uT per sample, 0.15 % of the field: well inside the threshold of 0.5 uT


def inputs_of(motion: motions.Motion, **other: np.ndarray) -> dict[str, np.ndarray]:
    return {"gyro": motion.gyro, "accel": motion.accel, "mag": motion.mag} | other


def estimate(motion: motions.Motion, mag: np.ndarray | None = None, **parameters: Any) -> Trajectory:
    inputs = inputs_of(motion) if mag is None else inputs_of(motion, mag=mag)
    return run(BLOCK, inputs, FIELD | {"sample_period": motion.dt} | parameters)


def disturbed(motion: motions.Motion, rows: slice, field: Any) -> np.ndarray:
    """Magnetometer readings (n, 3), uT, with a constant field in N added in some rows."""
    added = np.zeros_like(motion.mag)
    added[rows] = motion.R_NS[rows].inv().apply(field)
    return motion.mag + added


def noisy_mag(mag: np.ndarray, seed: int = 1) -> np.ndarray:
    return mag + np.random.default_rng(seed).normal(0, MAG_STD, mag.shape)


def yaw_error(result: Trajectory, motion: motions.Motion) -> np.ndarray:
    """Turn about the vertical (n,), rad, of the estimated attitude against the true one."""
    error_N = Rotation.from_quat(np.roll(result["q_NS"], -1, axis=1)) * motion.R_NS.inv()
    q = error_N.as_quat(canonical=True)
    return 2 * np.arctan2(q[:, 2], q[:, 3])


def level_rest(seconds: float) -> motions.Motion:
    return motions.rest(Rotation.identity(), round(seconds / 0.01))
