"""Claims about magnetic disturbances and the filter of Zihajehzadeh et al. 2014."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from imufmu.blocks.vocabulary import Status
from imufmu.compiled.running import run
from imufmu.estimators.zihajehzadeh2014 import BLOCK
from support import motions
from support.motions import FIELD_N
from support.nine_axis import FIELD, NORM, disturbed, estimate, inputs_of, level_rest, noisy_mag, yaw_error


def test_a_strong_disturbance_is_rejected_and_without_the_test_it_turns_the_heading() -> None:
    motion = level_rest(30)
    mag = noisy_mag(disturbed(motion, slice(1000, 2000), [20.0, -10.0, 10.0]))
    result = estimate(motion, mag)
    rejected = (result["status"].astype(int) & Status.MAG_REJECTED) > 0
    assert np.array_equal(np.flatnonzero(rejected), np.arange(1000, 2000))
    assert np.abs(yaw_error(result, motion)).max() < math.radians(1.5)  # noise of the first sample
    trusting = estimate(motion, mag, eps_m=1e6, eps_dip=math.pi)
    assert np.abs(yaw_error(trusting, motion)).max() > math.radians(45)


def test_a_deviation_of_exactly_the_threshold_is_a_disturbance() -> None:
    """(26) has "<". 75 - 50 = 25 uT without rounding, dip unchanged."""
    motion = level_rest(0.1)
    mag = np.tile([0.0, 30.0, -40.0], (10, 1))
    mag[5] *= 1.5
    for eps_m, used in ((25.0, 0), (25.1, 1)):
        assert estimate(motion, mag, h=50.0, eps_m=eps_m)["mag_ok"].tolist() == [1] * 5 + [used] + [1] * 4


def test_the_turn_from_pi_to_minus_pi_is_no_innovation() -> None:
    motion = motions.rest(Rotation.from_euler("Z", math.pi), 1000)
    result = estimate(motion, noisy_mag(motion.mag), eps_yaw=0.1)
    assert result["mag_ok"].all()
    assert np.ptp(result["yaw"]) > 6  # it does change sign
    assert np.abs(result["yaw_innovation"]).max() < 0.03  # of noise: eight times 0.07 uT in 20 uT


def test_in_a_rejected_span_the_heading_drifts_by_bias_times_time() -> None:
    motion, bias = level_rest(30), 0.005
    mag = disturbed(motion, slice(1000, 2000), [20.0, -10.0, 10.0])
    result = run(BLOCK, inputs_of(motion, gyro=motion.gyro + np.array([0, 0, bias]), mag=mag), FIELD)
    error = yaw_error(result, motion)
    assert error[1999] - error[999] == pytest.approx(bias * 10.0, rel=1e-3)  # first order in the turn of a sample
    assert abs(error[-1] - error[999]) < 1e-4  # ten time constants later


def twisting(twist: float) -> np.ndarray:
    """Disturbance, uT in N, that turns the horizontal part of the field by this angle (rad) and keeps its length."""
    return Rotation.from_euler("Z", twist).apply(FIELD_N) - FIELD_N


@pytest.mark.parametrize("field", [[0.09 * NORM, 0, 0], twisting(math.radians(60)), twisting(math.radians(-20))])
def test_the_hole_in_the_test_of_the_paper_and_its_cover(field: np.ndarray) -> None:
    """Norm and dip stay, the heading turns by 12.5 deg (square to the field), 60 deg and -20 deg."""
    motion = level_rest(40)
    mag = noisy_mag(disturbed(motion, slice(1000, 2500), field))
    open_hole, covered = estimate(motion, mag), estimate(motion, mag, eps_yaw=0.1)
    assert open_hole["mag_ok"].all()
    assert np.abs(yaw_error(open_hole, motion)).max() > math.radians(12)
    assert not covered["mag_ok"][1000:2500].any()
    assert covered["mag_ok"][:1000].all() and covered["mag_ok"][2500:].all()
    assert np.abs(yaw_error(covered, motion)).max() < math.radians(1)


def test_a_disturbance_that_comes_within_a_second_is_caught_on_its_way() -> None:
    """The yaw follows it by no more than the test allows: eps_yaw, and yaw_drift for as long as it lasts."""
    motion = level_rest(40)
    t = np.arange(4000) * motion.dt
    twist = np.radians(30) * np.clip(np.minimum(t - 10, 26 - t), 0, 1)
    mag = noisy_mag(Rotation.from_rotvec(twist[:, None] * [0, 0, 1]).apply(motion.mag))
    assert np.abs(yaw_error(estimate(motion, mag), motion)).max() > math.radians(25)
    strict = estimate(motion, mag, eps_yaw=0.1, yaw_drift=0.005)
    assert np.abs(yaw_error(strict, motion)).max() < 0.1 + 0.005 * 16


def test_the_stricter_test_leaves_undisturbed_motion_alone() -> None:
    """Waved at 1 rad/s and shaken with 0.2 m/s2, both per axis: 0.2 rad changes no bit of four motions."""
    for seed in range(4):
        rng = np.random.default_rng(seed)
        motion = motions.motion(rng, 2000, acceleration=0.2).noisy(rng)
        mag = noisy_mag(motion.mag, seed)
        paper, strict = (estimate(motion, mag, dip_of_m_ref=True, eps_yaw=eps_yaw) for eps_yaw in (math.pi, 0.2))
        assert np.mean(paper["mag_ok"]) > 0.9
        assert all(np.array_equal(strict[name], paper[name]) for name in paper.values)


def test_the_dip_of_the_first_sample_is_taken_on_trust_that_of_m_ref_is_known() -> None:
    """A start in a shake of 2 m/s2 (12 deg of tilt) spoils the dip for good; that of m_ref fits again after 10 s."""
    motion = level_rest(20)
    motion.accel[:50] += [0, 2, 0]
    trusting, knowing = (estimate(motion, dip_of_m_ref=known) for known in (False, True))
    assert not trusting["mag_ok"][1000:].any()
    assert knowing["mag_ok"][1000:].all()
    assert abs(yaw_error(knowing, motion)[-1]) < 1e-4


def test_the_stricter_test_lets_go_of_a_wrong_heading() -> None:
    """A start in a disturbed field: once it has gone, the gate opens by yaw_drift until the true field fits again."""
    motion = level_rest(60)
    twist = math.radians(25)
    result = estimate(motion, disturbed(motion, slice(0, 500), twisting(twist)), eps_yaw=0.1, yaw_drift=0.02)
    waiting = math.ceil((twist - 0.1) / 0.02 / motion.dt)  # samples
    assert np.array_equal(np.flatnonzero(result["mag_ok"] == 0), np.arange(500, 500 + waiting))
    assert abs(yaw_error(result, motion)[-1]) < 1e-6
