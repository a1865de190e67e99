"""Gravity turns as the gyroscope says, or the axes, signs and units do not fit: which, and what to do."""

from __future__ import annotations

import numpy as np
import pytest

from imufmu.files.csv_table import write_csv
from imufmu.recordings.checks import axes_doubts
from imufmu.recordings.reading import RecordingError, read
from imufmu.recordings.turning import DEGREE, best_scale, told, turning
from support.optional import RECORDINGS
from support.rocking import GRAVITY, rocking

MOTION = rocking(30.0)
GYRO, ACCEL = MOTION["gyro"], MOTION["accel"]
INDEX = np.arange(len(GYRO))


def said(gyro: np.ndarray, accel: np.ndarray) -> str:
    return told(turning(gyro, accel, INDEX, 0.01))


def test_right_axes_fit_and_nothing_is_said():
    fit = turning(GYRO, ACCEL, INDEX, 0.01)
    assert fit.fits and fit.seen
    assert told(fit) == ""


@pytest.mark.parametrize(
    ("gyro", "accel", "words", "remedy"),
    [
        (
            np.rad2deg(GYRO),
            ACCEL,
            "57 times as far as gravity: its values are in deg/s",
            "gyro[1],gyro[2],gyro[3]:deg/s",
        ),
        (np.deg2rad(GYRO), ACCEL, "57 times less far than gravity", ""),
        (2 * GYRO, ACCEL, "2 times as far as gravity", ""),
        (GYRO * [1, 1, -1], ACCEL, "axis z of gyro is flipped", "gyro[1],gyro[2],-gyro[3]"),
        (GYRO * [-1, 1, 1], ACCEL, "axis x of gyro is flipped", "-gyro[1],gyro[2],gyro[3]"),
        (GYRO, ACCEL * [1, -1, 1], "axis y of accel is flipped", "-gyro[1],gyro[2],-gyro[3]"),
        (-GYRO, ACCEL, "or gyro is negated", "-gyro[1],-gyro[2],-gyro[3]"),
        (GYRO * [1, 1, -1], ACCEL * [1, 1, -1], "left-handed set", "-gyro[1],-gyro[2],-gyro[3]"),
        (GYRO[:, [1, 0, 2]], ACCEL[:, [1, 0, 2]], "left-handed set", "-gyro[1],-gyro[2],-gyro[3]"),
        (GYRO[:, [1, 0, 2]], ACCEL, "two or more are swapped", "gyro[2],gyro[1],gyro[3]"),
        (np.rad2deg(GYRO * [1, 1, -1]), ACCEL, "deg/s; axis z of gyro is flipped", "-gyro[3]:deg/s"),
    ],
)
def test_a_fault_is_named_with_its_remedy(gyro, accel, words, remedy):
    sentence = said(gyro, accel)
    assert words in sentence
    assert remedy in sentence


def test_the_remedy_mends_it():
    """What is told to be done is done: then nothing is said any more."""
    fit = turning(np.rad2deg(GYRO[:, [1, 0, 2]]), ACCEL, INDEX, 0.01)
    assert said(fit.scale * np.rad2deg(GYRO[:, [1, 0, 2]]) @ fit.matrix.T, ACCEL) == ""


def test_the_unit_and_a_constant_offset_of_the_accelerometer_do_not_matter():
    assert said(GYRO, ACCEL / 9.81) == ""
    assert said(GYRO, ACCEL + np.array([0.5, 0.5, 0.8])) == ""
    assert said(GYRO + np.array([0.02, -0.01, 0.01]), ACCEL) == ""  # nor a bias of 1 deg/s
    assert said(GYRO, -ACCEL) == ""  # which cannot be seen


def test_a_body_that_is_shaken_is_told_from_a_flipped_axis():
    """A metre per second squared to and fro, three times a second, beside the turning."""
    shaken = ACCEL + 1 * np.sin(2 * np.pi * 3 * MOTION["time"])[:, None] * [1, 0.7, 0.4]
    assert said(GYRO, shaken) == ""
    assert "left-handed" in said(-GYRO, shaken)
    assert "axis x of gyro is flipped" in said(GYRO * [-1, 1, 1], shaken)


def test_the_bob_of_a_pendulum_sees_no_turn_of_gravity_and_raises_no_alarm():
    """It reads along the rod at any angle, while it turns: as if the gyroscope read much too much."""
    time = MOTION["time"]
    angle = np.sin(3 * time)
    gyro = np.column_stack([3 * np.cos(3 * time), 0 * time, 0 * time])
    along = GRAVITY * np.cos(angle) + 9 * np.cos(3 * time) ** 2
    noise = np.random.default_rng(1).normal(0, 0.02, (len(time), 3))
    accel = np.column_stack([0 * time, 0 * time, along]) + noise
    assert said(gyro, accel) == ""
    assert best_scale(gyro, accel, INDEX, 0.01, (1.0, DEGREE)) == -1


def test_a_swing_about_one_axis_that_leans_readings_the_other_way_raises_no_alarm():
    """A sensor beyond the centre of a pendulum: its acceleration along the arc is more than that of gravity."""
    time = MOTION["time"]
    angle = 0.5 * np.sin(4 * time)
    gyro = np.column_stack([2 * np.cos(4 * time), 0 * time, 0 * time])
    lean = -angle + 0.2 * np.sin(9 * time)
    noise = np.random.default_rng(1).normal(0, 0.02, (len(time), 3))
    accel = GRAVITY * np.column_stack([0 * time, np.sin(lean), np.cos(lean)]) + noise
    assert said(gyro, accel) == ""
    lean = -angle  # but where nothing else is in it, a sign is wrong
    accel = GRAVITY * np.column_stack([0 * time, np.sin(lean), np.cos(lean)]) + noise
    assert "the other way than gravity" in said(gyro, accel)


def test_at_rest_nothing_can_be_told():
    rng = np.random.default_rng(1)
    still = rng.normal((0, 0, 9.81), 0.02, (2000, 3))
    fit = turning(rng.normal(0, 2e-3, (2000, 3)), still, np.arange(2000), 0.01)
    assert fit.fits and not fit.seen


def test_missing_samples_and_short_records_are_no_obstacle():
    gyro, accel = GYRO.copy(), ACCEL.copy()
    gyro[500:520], accel[700:705] = np.nan, np.nan
    keep = np.delete(INDEX, np.arange(900, 1000))
    assert told(turning(gyro[keep], accel[keep], keep, 0.01)) == ""
    assert not turning(GYRO[:100], ACCEL[:100], INDEX[:100], 0.01).seen
    assert not turning(np.full((2000, 3), np.nan), ACCEL[:2000], INDEX[:2000], 0.01).seen


def test_the_unit_of_a_gyroscope_is_told_by_gravity():
    scales = (1.0, DEGREE)
    assert best_scale(GYRO, ACCEL, INDEX, 0.01, scales) == 0
    assert best_scale(np.rad2deg(GYRO), ACCEL, INDEX, 0.01, scales) == 1
    assert best_scale(0 * GYRO, ACCEL[:1].repeat(len(GYRO), axis=0), INDEX, 0.01, scales) == -1


def recorded(folder, **changed: np.ndarray):
    columns = {name: MOTION[name] for name in ("time", "gyro", "accel", "mag")} | changed
    write_csv(folder / "walk.csv", columns)
    return read(folder / "walk.csv")


def test_of_three_sensors_the_one_is_wrong_that_fits_neither_of_the_others(tmp_path):
    """As the magnetometer of the MPU-9250, whose x and y are swapped and whose z is turned over."""
    swapped = MOTION["mag"][:, [1, 0, 2]] * [1, 1, -1]
    recording = recorded(tmp_path, mag=swapped)
    (doubt,) = axes_doubts(recording)
    assert "mag does not turn" in doubt and "--columns mag=mag[2],mag[1],-mag[3] (South" in doubt
    remedy = doubt.split("--columns ")[1].split(" ")[0]
    mended = read(recording.path, columns=[remedy])
    assert axes_doubts(mended) == [] and np.allclose(mended.mag, MOTION["mag"])
    (doubt,) = axes_doubts(recorded(tmp_path, accel=ACCEL * [1, 1, -1]))
    assert (
        "accel does not turn" in doubt and "--columns accel=-accel[1],-accel[2],accel[3], or with every sign" in doubt
    )
    assert axes_doubts(recorded(tmp_path, gyro=-GYRO, mag=MOTION["mag"][::-1])) != []
    (doubt,) = axes_doubts(recorded(tmp_path, gyro=GYRO * [1, -1, 1]))
    assert "axis y of gyro is flipped" in doubt
    assert axes_doubts(recorded(tmp_path)) == []


def test_the_axis_that_points_down_in_a_left_handed_set_is_named(tmp_path):
    flipped = np.array([1, 1, -1])
    write_csv(tmp_path / "walk.csv", {"time": MOTION["time"], "gyro": GYRO * flipped, "accel": ACCEL * flipped})
    (doubt,) = axes_doubts(read(tmp_path / "walk.csv"))
    both = doubt.split("flipped in both: ")[1].split("--columns ")[1:]
    mended = read(tmp_path / "walk.csv", columns=[column.strip() for column in both])
    assert np.allclose(mended.gyro, GYRO) and np.allclose(mended.accel, ACCEL)
    assert axes_doubts(mended) == []


def test_a_magnetometer_that_stands_still_says_nothing_of_the_gyroscope(tmp_path):
    assert axes_doubts(recorded(tmp_path, mag=np.tile([0.0, 20, -45], (len(GYRO), 1)))) == []
    assert axes_doubts(recorded(tmp_path, mag=0 * GYRO)) == []


def test_where_gravity_is_drowned_in_motion_the_field_tells(tmp_path):
    wild = ACCEL + 25 * np.sin(2 * np.pi * 1.3 * MOTION["time"])[:, None] * [1, 0.7, 0.4]
    assert not turning(GYRO, wild, INDEX, 0.01).seen
    (doubt,) = axes_doubts(recorded(tmp_path, gyro=-GYRO, accel=wild))
    assert "gyro turns the other way than the magnetic field" in doubt


@pytest.mark.slow
def test_no_recording_of_others_raises_a_false_alarm_and_their_mirror_images_do(broad):
    """14 trials of BROAD and what else there is: a car, a phone, a robot, a chain of segments, a camera in the hand."""
    paths = [*sorted(broad.glob("*.mat")), *sorted((RECORDINGS / "field").rglob("*.csv"))]
    found = 0
    for path in paths:
        recording = read(path)
        assert axes_doubts(recording) == [], path.name
        fit = turning(-recording.gyro, recording.accel, recording.sample_index, recording.sample_period)
        assert fit.fits or (fit.scale == 1 and np.array_equal(fit.matrix, -np.eye(3))), path.name
        found += not fit.fits
    assert not (RECORDINGS / "field").is_dir() or found >= 10  # of 49: cars turn gravity too little to tell


def test_a_log_of_degrees_read_as_radians_says_so_with_its_columns(tmp_path):
    header = "time,gyro[1],gyro[2],gyro[3],accel[1],accel[2],accel[3]"
    table = np.column_stack([MOTION["time"], np.rad2deg(GYRO), ACCEL])
    path = tmp_path / "walk.csv"
    np.savetxt(path, table, delimiter=",", header=header, comments="", fmt="%.6f")
    (doubt,) = axes_doubts(read(path))
    remedy = doubt.split("--columns ")[1]
    assert axes_doubts(read(path, columns=[remedy])) == []
    with pytest.raises(RecordingError):
        read(path, columns=["gyro=a,b,c"])
