"""Recordings of a file per sensor, in a folder or a .zip: brought to one clock, with the signs of the device."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from imufmu.recordings.reading import RecordingError, read
from support.rocking import GRAVITY, lines_of, rocking

MOTION = rocking(12.0)
TIME, GYRO, ACCEL, MAG = (MOTION[name] for name in ("time", "gyro", "accel", "mag"))


def at(times: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.column_stack([np.interp(times, TIME, column) for column in values.T])


def write(folder: Path, name: str, text: str) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / name).write_text(text, encoding="utf-8")
    return folder


def sensor_logger(folder: Path, name: str, times: np.ndarray, values: np.ndarray) -> None:
    """As that program writes: z before y before x, in nanoseconds since 1970 and seconds since the start."""
    write(folder, name, lines_of("time,seconds_elapsed,z,y,x", 1.7e18 + 1e9 * times, times, values[:, ::-1], digits=9))


def close(recording, begin: float = 0.0) -> bool:
    rows = np.searchsorted(TIME, recording.time - 1e-6)
    # Noise between two samples is less than at them: up to its size (2e-3 rad/s, 0.02 m/s2) times four.
    return np.allclose(recording.gyro, GYRO[rows], atol=1e-6) and np.allclose(
        recording.accel, ACCEL[rows], atol=0.08, equal_nan=True
    )


def test_android_with_its_own_clock_per_sensor(tmp_path):
    folder = tmp_path / "2026-01-01"
    sensor_logger(folder, "Gyroscope.csv", TIME, GYRO)
    later = TIME[3:-3] + 0.004
    sensor_logger(folder, "TotalAcceleration.csv", later, at(later, ACCEL))
    sensor_logger(folder, "Accelerometer.csv", later, 0.01 * ACCEL[3:-3])  # without gravity: not to be taken
    slow = TIME[::10]
    sensor_logger(folder, "Magnetometer.csv", slow, at(slow, MAG))
    recording = read(folder)
    assert recording.sample_period == 0.01
    assert close(recording)
    assert recording.time[0] == pytest.approx(0.04)  # what both sensors have
    given = np.isfinite(recording.mag).all(axis=1)
    assert given.mean() == pytest.approx(0.1, abs=0.01)
    assert "read as files of Sensor Logger" in recording.notes
    assert "accel has other times than gyro: interpolated" in recording.notes


def test_a_gap_of_one_sensor_is_not_bridged(tmp_path):
    folder = tmp_path / "phone"
    sensor_logger(folder, "Gyroscope.csv", TIME, GYRO)
    kept = np.flatnonzero((TIME < 5) | (TIME > 6))
    sensor_logger(folder, "TotalAcceleration.csv", TIME[kept] + 0.003, ACCEL[kept])
    missing = np.isnan(read(folder).accel).all(axis=1)
    assert missing.sum() == pytest.approx(100, abs=6)  # two periods at either end are


@pytest.mark.parametrize(("standard", "sign"), [("false", -1), ("true", 1)])
def test_an_iphone_gives_motion_and_gravity_apart_with_its_sign(tmp_path, standard, sign):
    folder = tmp_path / "phone"
    gravity = np.tile([0, 0, GRAVITY], (len(TIME), 1))
    sensor_logger(folder, "Gyroscope.csv", TIME, GYRO)
    sensor_logger(folder, "Gravity.csv", TIME, sign * gravity)
    sensor_logger(folder, "Accelerometer.csv", TIME, sign * (ACCEL - gravity))
    write(folder, "Metadata.csv", f"version,platform,standardisation\n3,ios,{standard}\n")
    assert close(read(folder))


def test_phyphox_in_a_folder_and_in_a_zip(tmp_path):
    folder = tmp_path / "Motion 2026"
    names = '"Time (s)","X (rad/s)","Y (rad/s)","Z (rad/s)"'
    write(folder, "Gyroscope.csv", lines_of(names, TIME, GYRO))
    names = '"Time (s)","Acceleration x (m/s^2)","Acceleration y (m/s^2)","Acceleration z (m/s^2)"'
    write(folder, "Accelerometer.csv", lines_of(names, TIME, ACCEL))
    (folder / "meta").mkdir()
    assert close(read(folder))
    assert "read as files of phyphox" in read(folder).notes
    zipped = Path(shutil.make_archive(str(tmp_path / "motion"), "zip", tmp_path, folder.name))
    assert np.array_equal(read(zipped).gyro, read(folder).gyro)


def test_x_imu3_writes_microseconds_degrees_and_g(tmp_path):
    folder = tmp_path / "x-IMU3"
    header = "Timestamp (us),Gyroscope X (deg/s),Gyroscope Y (deg/s),Gyroscope Z (deg/s),"
    header += "Accelerometer X (g),Accelerometer Y (g),Accelerometer Z (g)"
    write(folder, "Inertial.csv", lines_of(header, 1e6 * TIME, np.rad2deg(GYRO), ACCEL / GRAVITY))
    header = "Timestamp (us),X Axis (a.u.),Y Axis (a.u.),Z Axis (a.u.)"
    write(folder, "Magnetometer.csv", lines_of(header, 1e6 * TIME[::5], MAG[::5] / 50))
    recording = read(folder)
    assert close(recording)
    assert np.allclose(recording.mag[::5], MAG[::5], atol=1e-4)


def test_a_rate_stands_for_the_times_of_the_gyroscope(tmp_path):
    folder = tmp_path / "phone"
    sensor_logger(folder, "Gyroscope.csv", TIME, GYRO)
    sensor_logger(folder, "TotalAcceleration.csv", TIME, ACCEL)
    assert read(folder, rate=50.0).sample_period == 0.02


def test_one_file_of_several_points_to_its_folder(tmp_path):
    folder = tmp_path / "phone"
    sensor_logger(folder, "Gyroscope.csv", TIME, GYRO)
    sensor_logger(folder, "TotalAcceleration.csv", TIME, ACCEL)
    with pytest.raises(RecordingError, match=r"or give the folder .*phone, where TotalAcceleration.csv is"):
        read(folder / "Gyroscope.csv")


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ({}, "no Gyroscope.csv and no Inertial.csv"),
        ({"Gyroscope.csv": "time,seconds_elapsed,z,y,x\n1,0.0,1,2,3\n2,0.1,1,2,3\n"}, "no accel in it"),
        ({"Gyroscope.csv": "time,seconds_elapsed,z,y\n1,0.0,1,2\n2,0.1,1,2\n"}, "Gyroscope.csv: no axes x, y, z"),
        ({"Gyroscope.csv": "a (furlong),x,y,z\n1,1,2,3\n2,1,2,3\n"}, "Gyroscope.csv: no column of times"),
        ({"Gyroscope.csv": "time,x (furlong),y,z\n1,1,2,3\n2,1,2,3\n"}, "unit 'furlong' of column 'x' is unknown"),
        ({"Gyroscope.csv": "time,x,y,z\n1,1,2,3\n"}, "1 samples"),
        ({"Gyroscope.csv": "time,x,y,z\n1,1,2,3\n2,a,2,3\n"}, "Gyroscope.csv, line 3, column 'x': 'a' is not a number"),
    ],
)
def test_a_folder_that_is_no_recording_is_refused(tmp_path, files, message):
    (tmp_path / "phone").mkdir()
    for name, text in files.items():
        write(tmp_path / "phone", name, text)
    with pytest.raises(RecordingError, match=message):
        read(tmp_path / "phone")


def test_a_damaged_zip_and_columns_for_a_folder_are_refused(tmp_path):
    (tmp_path / "a.zip").write_bytes(b"PK\x03\x04 not really")
    with pytest.raises(RecordingError, match=r"a.zip: not a .zip"):
        read(tmp_path / "a.zip")
    with pytest.raises(RecordingError, match="give its file, not the folder"):
        read(tmp_path, columns=["time=t"])
