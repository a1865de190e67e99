"""Claims about plumb at rest: what it learns there, and what it takes for rest."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from imufmu.blocks.vocabulary import Status
from imufmu.compiled.running import run
from support import motions
from support.plumb_motions import BLOCK, DEFAULTS, G, estimate, tilt_deg


def test_the_bias_of_a_resting_gyroscope_is_learnt_in_half_a_minute() -> None:
    motion = motions.rest(Rotation.from_euler("ZYX", [0.4, 0.3, -0.2]), 3000).noisy(np.random.default_rng(4), 0.003)
    bias = np.array([0.02, -0.01, 0.03])
    result = run(BLOCK, {"gyro": motion.gyro + bias, "accel": motion.accel}, {"g": G})
    # After a time T of rest P0_b^2 T / (P0_b^2 T + rr_g^2) of it is learnt: 97 % of 0.03 rad/s.
    assert np.allclose(result["gyro_bias"][-1], bias, rtol=0, atol=1e-3)
    assert result["stationary"][20:].all()
    # 2.1 deg/s would tilt a filter without bias by 64 deg.
    assert tilt_deg(motion, result).max() < 0.5
    assert tilt_deg(motion, result)[2000:].max() < 0.1


@pytest.mark.parametrize(("part", "rests"), [(0.9, True), (1.1, False)])
def test_a_steady_turn_is_rest_only_below_the_limit(part: float, rests: bool) -> None:
    """The limit is on each axis: a turn about all three is slower than its norm."""
    motion = motions.turn(Rotation.identity(), np.full(3, part * DEFAULTS["rr_b"]), 100)
    assert np.all(estimate(motion)["stationary"][20:] == rests)


def test_the_first_usable_sample_starts_it() -> None:
    motion = motions.rest(Rotation.from_euler("ZYX", [0.0, 0.5, 1.0]), 60)
    accel = motion.accel.copy()
    accel[:20] = math.nan
    result = run(BLOCK, {"gyro": motion.gyro, "accel": accel}, {"g": G})
    status = result["status"].astype(int)
    assert np.array_equal(status > 0, np.arange(60) < 20)
    assert np.all(status[:20] == Status.NOT_INITIALISED | Status.ACCEL_MISSING)
    assert tilt_deg(motion, result)[20:].max() < 1e-9  # rounding
    assert np.all(result["yaw"] == 0)
    assert np.allclose(result["tilt_std"][:21], math.sqrt(2) * DEFAULTS["P0_psi"], rtol=1e-12)  # nothing was learnt
