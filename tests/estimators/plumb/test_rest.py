"""Claims about plumb at rest: what it learns there, and what it takes for rest."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from imufmu.blocks.vocabulary import Status
from imufmu.compiled.running import run
from support import motions
from support.plumb_motions import BLOCK, DEFAULTS, G, carried, consumer, estimate, smooth, tilt_deg, tilt_of

T = np.arange(0, 80, 0.01)


def test_the_bias_of_a_resting_gyroscope_is_learnt_in_half_a_minute() -> None:
    motion = motions.rest(Rotation.from_euler("ZYX", [0.4, 0.3, -0.2]), 3000).noisy(np.random.default_rng(4), 0.003)
    bias = np.array([0.02, -0.01, 0.03])
    result = run(BLOCK, {"gyro": motion.gyro + bias, "accel": motion.accel}, {"g": G})
    # After a time T of rest P0_raw^2 T / (P0_raw^2 T + rr_g^2) of it is learnt: all but a thousandth.
    assert np.allclose(result["gyro_bias"][-1], bias, rtol=0, atol=1e-3)
    assert result["stationary"][100:].all()  # noise of 0.17 deg/s per sample takes a while to be averaged out
    # 2.1 deg/s would tilt a filter without bias by 64 deg.
    assert tilt_deg(motion, result).max() < 1.0
    assert tilt_deg(motion, result)[2000:].max() < 0.1


@pytest.mark.parametrize(("part", "rests"), [(0.9, True), (1.1, False)])
def test_a_steady_turn_about_the_vertical_is_rest_only_below_the_limit(part: float, rests: bool) -> None:
    """Nothing else tells it from a bias."""
    motion = motions.turn(Rotation.identity(), np.array([0, 0, part * DEFAULTS["rr_b"]]), 300)
    assert np.all(estimate(motion)["stationary"][100:] == rests)


@pytest.mark.parametrize("rate_deg", [0.3, 1.0])
def test_a_slow_steady_roll_is_no_rest(rate_deg: float) -> None:
    """Gravity wanders across the sensor: 0.3 deg/s taken for bias would end up as a tilt of 0.8 deg."""
    motion = carried(T, roll=np.radians(rate_deg) * np.maximum(T - 10, 0))
    error, result = tilt_of(motion, consumer(motion))
    assert error.max() < 0.5
    assert result["stationary"][300:1000].all()
    assert result["stationary"][1500:].mean() < 0.05


@pytest.mark.parametrize(("acceleration", "ramp"), [(1.0, 2.0), (2.0, 1.0)])
@pytest.mark.parametrize("lasts", [6.0, 12.0])
def test_a_train_that_sets_off_gently_does_not_tilt_it(acceleration: float, ramp: float, lasts: float) -> None:
    """No turn, no vibration: VQF tilts by 6 and 12 deg. The drift of the accelerometer is what tells."""
    motion = carried(T, acceleration=(acceleration * train(ramp, lasts), 0.0, 0.0))
    error, result = tilt_of(motion, consumer(motion))
    assert error.max() < 0.5
    assert not result["stationary"][round(100 * (21 + ramp)) : round(100 * (19 + ramp + lasts))].any()


@pytest.mark.parametrize(("acceleration", "ramp"), [(0.5, 4.0), (0.3, 8.0)])
def test_where_a_train_is_too_gentle_to_tell_it_doubts(acceleration: float, ramp: float) -> None:
    """The drift is that of a table: the filter leans over by up to atan(a / g), and says so."""
    motion = carried(T, acceleration=(acceleration * train(ramp, 8.0), 0.0, 0.0))
    error, result = tilt_of(motion, consumer(motion))
    assert error.max() < 1.2 * np.degrees(acceleration / G)
    assert np.mean((error / np.rad2deg(result["tilt_std"])) ** 2) < 4
    assert np.mean(error < 3 * np.rad2deg(result["tilt_std"])) > 0.85


def train(ramp: float, lasts: float) -> np.ndarray:
    """Sets off at 20 s, cruises for ten seconds, brakes."""
    edges = 20 + np.cumsum([0, ramp + lasts, ramp + 10, ramp + lasts])
    signs = (1, -1, -1, 1)
    return sum(sign * smooth(T, edge, ramp) for sign, edge in zip(signs, edges, strict=True))


def test_a_lift_and_a_turntable_tilt_nothing() -> None:
    lift = carried(T, acceleration=(0.0, 0.0, 1.2 * train(1.0, 3.0)))
    turntable = carried(T, yaw=np.radians(3) * np.maximum(T - 10, 0), pitch=0.4)
    for motion in (lift, turntable):
        error, _ = tilt_of(motion, consumer(motion))
        assert error[100:].max() < 0.3


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
