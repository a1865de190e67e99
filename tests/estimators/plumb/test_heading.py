"""Claims about plumb with a magnetometer: it finds North, survives disturbances, and touches nothing but yaw."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from imufmu.blocks.running import Trajectory
from imufmu.blocks.vocabulary import Status
from imufmu.compiled.running import run
from imufmu.scoring.metrics import heading_error
from support import motions
from support.motions import FIELD_N, Motion
from support.plumb_motions import BLOCK, DEFAULTS, G, consumer, moving, rms

YAW = 2.0  # rad, of the sensor at the start
BIAS = np.array([0.0, 0.0, 0.01])  # rad/s: yaw drifts by half a degree per second where the bias is not known


def with_mag(motion: Motion, mag: np.ndarray | None, **parameters: float) -> Trajectory:
    inputs = {"gyro": motion.gyro + BIAS, "accel": motion.accel} | ({} if mag is None else {"mag": mag})
    return run(BLOCK, inputs, {"sample_period": motion.dt, "g": G} | parameters)


def yaw_error_deg(motion: Motion, result: Trajectory) -> np.ndarray:
    return np.rad2deg(heading_error(result["q_NS"], np.roll(motion.R_NS.as_quat(), 1, axis=1)))


@pytest.fixture(scope="module")
def hand() -> Motion:
    """Two minutes in a hand, at rest at first."""
    return moving(20, 120, rest=3.0)


def field(motion: Motion, extra_N: np.ndarray | float = 0.0, seed: int = 21) -> np.ndarray:
    """What a magnetometer with 0.5 uT of noise reads; extra_N: disturbance in N, uT, of one row or many."""
    noise = np.random.default_rng(seed).normal(0, 0.5, motion.mag.shape)
    return motion.R_NS.inv().apply(FIELD_N + np.zeros(motion.mag.shape) + extra_N) + noise


def test_the_first_sample_gives_the_heading() -> None:
    attitude = Rotation.from_euler("ZYX", [YAW, 0.4, -0.3])
    motion = motions.rest(attitude, 50)
    result = run(BLOCK, {"gyro": motion.gyro, "accel": motion.accel, "mag": motion.mag}, {"g": G})
    assert np.abs(yaw_error_deg(motion, result)).max() < 1e-9  # rounding
    assert np.allclose(result["yaw"], YAW, rtol=0, atol=1e-12)
    east = run(BLOCK, {"gyro": motion.gyro, "accel": motion.accel, "mag": motion.mag}, {"g": G, "declination": 0.1})
    assert np.allclose(east["yaw"], YAW - 0.1, rtol=0, atol=1e-12)  # magnetic North lies to the East: less to turn


def test_yaw_does_not_drift(hand: Motion) -> None:
    """The bias that nothing else observes about the vertical is learnt as a drift."""
    result, alone = with_mag(hand, field(hand)), with_mag(hand, None)
    assert rms(yaw_error_deg(hand, result)[1000:]) < 1
    assert np.all(result["status"] == 0)
    assert abs(yaw_error_deg(hand, alone)[-1]) > 3 * abs(yaw_error_deg(hand, result)[-1])


def test_a_magnetometer_changes_nothing_but_yaw(hand: Motion) -> None:
    """Bit for bit, with noise of 30 uT, and where every sample is missing, too."""
    alone = with_mag(hand, None)
    untouched = {s.name for s in BLOCK.reported} - {"yaw", "q_NS", "status", "yaw_offset", "yaw_offset_std"}
    for mag in (30 * np.random.default_rng(22).standard_normal(hand.mag.shape), np.full_like(hand.mag, math.nan)):
        result = with_mag(hand, mag)
        for name in untouched:
            assert np.array_equal(result[name], alone[name]), name


def test_readings_of_nothing_but_zeros_are_none(hand: Motion) -> None:
    zeros, alone = with_mag(hand, np.zeros_like(hand.mag)), with_mag(hand, None)
    for signal in BLOCK.reported:
        assert np.array_equal(zeros[signal.name], alone[signal.name]), signal.name
    assert np.all(alone["status"] == 0)
    assert np.all(alone["yaw_offset_std"] == math.pi)


def test_the_unit_of_the_field_does_not_matter(hand: Motion) -> None:
    one, other = with_mag(hand, field(hand)), with_mag(hand, field(hand) / 64)
    assert np.allclose(one["q_NS"], other["q_NS"], rtol=0, atol=1e-9)  # rounding


@pytest.mark.parametrize("extra", [[20.0, 0.0, 0.0], [0.0, 0.0, 12.0], [-8.0, -8.0, 8.0]])
def test_a_disturbance_of_the_field_is_left_out(extra: list[float], hand: Motion) -> None:
    """Ten seconds of a field that is off by a quarter or more; 20 uT to the East would turn the heading by 45 deg."""
    rows = np.zeros((len(hand.mag), 1))
    rows[5000:6000] = 1
    result = with_mag(hand, field(hand, rows * extra))
    rejected = (result["status"].astype(int) & Status.MAG_REJECTED) > 0
    assert rejected[5010:5999].all() and not rejected[:4990].any() and not rejected[6010:].any()
    assert np.abs(yaw_error_deg(hand, result)[5000:7000]).max() < 2


def test_a_lasting_change_of_the_field_is_accepted_in_the_end(hand: Motion) -> None:
    """North lies 45 deg elsewhere from 30 s on: t_new later yaw goes there."""
    rows = np.arange(len(hand.mag))[:, None] >= 3000
    result = with_mag(hand, field(hand, rows * np.array([20.0, 0.0, 0.0])))
    rejected = (result["status"].astype(int) & Status.MAG_REJECTED) > 0
    assert rejected[3010:4990].all() and not rejected[5020:].any()
    error = yaw_error_deg(hand, result)
    assert abs(error[4990]) < 2
    assert abs(error[-1] - 45) < 2


def test_a_magnetometer_may_come_late(hand: Motion) -> None:
    mag = field(hand)
    mag[:2000] = 0
    result = with_mag(hand, mag)
    assert np.all(result["yaw_offset"][:1990] == 0)
    assert rms(yaw_error_deg(hand, result)[4000:]) < 1


def test_a_missing_sample_counts_for_nothing(hand: Motion) -> None:
    mag = field(hand)
    mag[np.random.default_rng(23).random(len(mag)) < 0.5, 1] = math.nan
    result = with_mag(hand, mag)
    assert np.array_equal((result["status"].astype(int) & Status.MAG_MISSING) > 0, np.isnan(mag[:, 1]))
    assert rms(yaw_error_deg(hand, result)[1000:]) < 1


@pytest.mark.parametrize("every", [7, 10])
def test_a_magnetometer_may_read_less_often(every: int, hand: Motion) -> None:
    """Rows without a reading between, whether blocks end with one or not: as good as with all of them.

    Such rows may be empty, zero, or repeat the last reading, which is then turned on by the gyroscope.
    """
    mag, rows = field(hand), np.arange(len(hand.mag))
    read = rows % every == 3
    often = rms(yaw_error_deg(hand, with_mag(hand, mag))[1000:])
    empty = with_mag(hand, np.where(read[:, None], mag, math.nan))
    assert rms(yaw_error_deg(hand, empty)[1000:]) < 1.3 * often + 0.1
    zero = with_mag(hand, np.where(read[:, None], mag, 0))
    assert np.array_equal(zero["q_NS"], empty["q_NS"])
    first = np.maximum(3, rows - (rows - 3) % every)
    held = with_mag(hand, mag[first])
    # Before row 3 it has a reading already.
    assert np.abs(heading_error(held["q_NS"], empty["q_NS"])[100:]).max() < math.radians(0.5)


def test_a_field_that_really_stays_the_same_is_read_again() -> None:
    """Held for longer than a magnetometer may take it tells as much as one with noise: within a tenth."""
    motion = motions.rest(Rotation.from_euler("ZYX", [YAW, 0.4, -0.3]), 6000)
    noise = np.random.default_rng(24).normal(0, 1e-6, motion.mag.shape)
    readings = {"gyro": motion.gyro, "accel": motion.accel}
    same, other = (run(BLOCK, readings | {"mag": mag}, {"g": G}) for mag in (motion.mag, motion.mag + noise))
    assert same["yaw_offset_std"][-1] < 1.1 * other["yaw_offset_std"][-1]


def test_zeros_in_between_count_for_nothing(hand: Motion) -> None:
    mag = field(hand)
    mag[4000:6000] = 0
    result = with_mag(hand, mag)
    assert np.abs(yaw_error_deg(hand, result)[4000:6500]).max() < 3
    assert not (result["status"].astype(int) & Status.MAG_REJECTED).any()


@pytest.mark.parametrize("seed", [70, 71])
def test_a_start_that_turns_out_upside_down_does_not_spoil_the_heading(seed: int) -> None:
    """The first accelerometer sample is turned by half a turn about x: what it said of North goes with it."""
    motion = moving(seed, 12, rate=1.0)
    readings = consumer(motion) | {"mag": motion.mag}
    readings["accel"][0] *= [1, -1, -1]
    result = run(BLOCK, readings, {"sample_period": motion.dt, "g": G})
    assert np.abs(yaw_error_deg(motion, result))[200:].max() < 5


def test_one_reading_after_a_long_silence_is_not_believed_blindly(hand: Motion) -> None:
    """It stands for a second, though it is the only one in twenty."""
    mag = field(hand)
    mag[3000:5003], mag[5004:] = math.nan, math.nan
    std = with_mag(hand, mag)["yaw_offset_std"]
    grown = DEFAULTS["s_d"] ** 2 * 20
    expected = 1 / math.sqrt(1 / grown + 1 / DEFAULTS["s_h"] ** 2)
    assert std[5006] > 0.9 * expected  # the deviation of the field makes it larger


def test_a_field_that_is_a_little_off_turns_the_heading_slowly(hand: Motion) -> None:
    """By 3 uT for five seconds, too little to be left out: North seems to lie 6 deg elsewhere."""
    rows = ((np.arange(len(hand.mag)) >= 5000) & (np.arange(len(hand.mag)) < 5500))[:, None]
    mag = field(hand, rows * np.array([2.2, 2.0, 0.0]))
    careful, rash = (np.abs(yaw_error_deg(hand, with_mag(hand, mag, **p))) for p in ({}, {"k_h": 0.0}))
    assert rash[5499] > 2
    assert careful[5499] < 0.6 * rash[5499]


def test_the_noise_of_single_readings_is_no_deviation_of_the_field(hand: Motion) -> None:
    """With the field that tells it low-passed the heading is known better; a mean of two halves the noise's square."""
    low_passed, single = (with_mag(hand, field(hand), t_h=t_h)["yaw_offset_std"][-1] for t_h in (0.05, 0.0))
    assert low_passed < 0.9 * single


def test_where_the_field_is_another_for_good_the_heading_goes_there_at_once(hand: Motion) -> None:
    rows = np.arange(len(hand.mag))[:, None] >= 3000
    result = with_mag(hand, field(hand, rows * np.array([20.0, 0.0, 0.0])))
    accepted = np.flatnonzero((result["status"][3000:].astype(int) & Status.MAG_REJECTED) == 0)[10] + 3000
    assert abs(yaw_error_deg(hand, result)[accepted + 100] - 45) < 5
