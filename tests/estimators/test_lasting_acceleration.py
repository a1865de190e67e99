"""A train on straight rails: its acceleration lasts, the papers' Kalman filters lean, and may be told to know it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from imufmu import lee2012, leechoi2018, run, zihajehzadeh2014
from imufmu.blocks.block import SampledBlock
from imufmu.scoring.metrics import inclination_error

RATE = 50.0
G = 9.8
FILTERS = pytest.mark.parametrize("block", [lee2012, leechoi2018, zihajehzadeh2014], ids=lambda block: block.name)


@pytest.fixture
def train(rng: np.random.Generator) -> dict[str, np.ndarray]:
    """20 s of rest, 1 m/s2 for 20 s within ramps of 2 s, 20 s of even speed, the same backwards, rest; level track."""
    time = np.arange(0, 110, 1 / RATE)
    forward = np.interp(time, [20, 22, 38, 40, 60, 62, 78, 80], [0, 1, 1, 0, 0, -1, -1, 0])
    gyro, accel = rng.normal(0, 0.005, (len(time), 3)), rng.normal(0, 0.03, (len(time), 3))
    accel[:, 0] += forward
    accel[:, 2] += G
    return {"gyro": gyro, "accel": accel}


def normalised_error(block: SampledBlock, train: dict[str, np.ndarray], model_error: float) -> float:
    """Mean of squared tilt error over tilt_std squared, after the first second: 1 where tilt_std tells the truth."""
    ran = run(block, train, {"sample_period": 1 / RATE, "model_error": model_error})
    error = inclination_error(ran["vertical"], np.broadcast_to([0.0, 0.0, 1.0], ran["vertical"].shape))
    return float(np.mean((error / ran["tilt_std"])[int(RATE) :] ** 2))


@FILTERS
def test_the_filter_knows_how_far_it_leans_where_it_is_told_of_lasting_acceleration(
    block: SampledBlock, train: dict[str, np.ndarray]
) -> None:
    told = float(np.std(train["accel"][:, 0])) / math.sqrt(2)  # the track has one axis of two
    assert normalised_error(block, train, 0.0) > 100
    assert 0.3 < normalised_error(block, train, told) < 3


@FILTERS
def test_to_be_told_of_lasting_acceleration_changes_nothing_but_the_uncertainty(
    block: SampledBlock, train: dict[str, np.ndarray]
) -> None:
    plain, told = (run(block, train, {"sample_period": 1 / RATE, "model_error": e}) for e in (0.0, 0.5))
    for name in plain.values:
        if name != "tilt_std":
            np.testing.assert_array_equal(plain[name], told[name])
    expected = np.sqrt(plain["tilt_std"] ** 2 + 2 * (0.5 / G) ** 2)
    np.testing.assert_allclose(told["tilt_std"], expected, rtol=1e-12)
