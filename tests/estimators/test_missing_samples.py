"""What the Kalman filters of gravity's direction do with samples that are missing."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from imufmu import Trajectory, lee2012, leechoi2018, run
from imufmu.blocks.block import SampledBlock
from imufmu.blocks.vocabulary import Status
from support import motions
from support.missing import without_accel

FILTERS = pytest.mark.parametrize("block", [lee2012, leechoi2018], ids=lambda block: block.name)


def estimate(block: SampledBlock, motion: motions.Motion) -> Trajectory:
    return run(block, {"gyro": motion.gyro, "accel": motion.accel}, {"sample_period": motion.dt})


def flags(result: Trajectory) -> list[int]:
    return result["status"].astype(int).tolist()


@FILTERS
def test_status_names_each_missing_sample_and_clears(block: SampledBlock, rng: np.random.Generator) -> None:
    motion = motions.motion(rng, 6)
    motion.gyro[1:3, 0] = math.nan
    motion.accel[2:4, 2] = math.inf
    both = Status.GYRO_MISSING | Status.ACCEL_MISSING
    result = estimate(block, motion)
    assert flags(result) == [0, Status.GYRO_MISSING, both, Status.ACCEL_MISSING, 0, 0]
    for name, values in result.values.items():
        assert np.isfinite(values).all(), name


@FILTERS
def test_a_missing_gyroscope_sample_is_the_last_one_held(block: SampledBlock) -> None:
    missing, held = (motions.motion(np.random.default_rng(3), 50) for _ in range(2))
    missing.gyro[10:15] = math.nan
    held.gyro[10:15] = held.gyro[9]
    assert np.array_equal(estimate(block, missing)["vertical"], estimate(block, held)["vertical"])


@FILTERS
@pytest.mark.parametrize("unusable", [math.nan, 0.0, 5e-324, 1e-150], ids=str)
def test_the_first_usable_accelerometer_sample_starts_the_filter(
    block: SampledBlock, unusable: float, rng: np.random.Generator
) -> None:
    """A missing one, and one without a direction (an input that nobody has set yet), are waited out."""
    motion = motions.motion(rng, 500).noisy(rng)
    accel = motion.accel.copy()
    accel[:7] = unusable
    late = run(block, {"gyro": motion.gyro, "accel": accel})
    own = run(block, {"gyro": motion.gyro[7:], "accel": accel[7:]})
    assert np.array_equal(late["vertical"][7:], own["vertical"])
    assert np.array_equal(late["P"][7:], own["P"])
    waiting = Status.NOT_INITIALISED | (Status.ACCEL_MISSING if math.isnan(unusable) else 0)
    assert flags(late) == [waiting] * 7 + [0] * (len(accel) - 7)
    assert np.array_equal(late["vertical"][:7], np.tile([0, 0, 1], (7, 1)))
    if block is lee2012:  # the acceleration is a state of the other one
        assert np.array_equal(late["external_acceleration"][:7], np.zeros((7, 3)))


# What the first-order step of lee2012, and the third-order step of leechoi2018, leave of 0.1 rad in ten steps.
@pytest.mark.parametrize(("block", "tolerance"), [(lee2012, 1e-5), (leechoi2018, 1e-9)], ids=["lee2012", "leechoi2018"])
def test_given_angles_start_the_filter_without_accelerometer(block: SampledBlock, tolerance: float) -> None:
    inputs = without_accel(motions.turn(Rotation.identity(), np.array([1.0, 0, 0]), 11), 0)
    result = run(block, inputs, {"use_initial_angles": True, "initial_roll": 0.3})
    assert flags(result) == [Status.ACCEL_MISSING] * 11
    assert result["roll"][-1] == pytest.approx(0.4, abs=tolerance)
