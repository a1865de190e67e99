"""Readings that are not there."""

from __future__ import annotations

import math

import numpy as np

from support.motions import Motion


def without_accel(motion: Motion, first: int) -> dict[str, np.ndarray]:
    """Inputs whose accelerometer is missing from row ``first`` on."""
    accel = motion.accel.copy()
    accel[first:] = math.nan
    return {"gyro": motion.gyro, "accel": accel}
