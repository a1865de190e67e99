"""Logs of robots and measuring systems give the readings that were put into them, in SI units, at their instants."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from imufmu.recordings.reading import RecordingError, read
from support import robot_logs
from support.optional import needs

N, RATE = 60, 100.0
START = 1.7e9  # a date: stamps of robots count from 1970
SINGLE = 1e-6  # relative: PX4 and ArduPilot log 32 bit floats


@pytest.fixture
def readings(rng: np.random.Generator) -> dict[str, np.ndarray]:
    """time (s) from 0, gyro (rad/s), accel (m/s2), mag (uT)."""
    accel = rng.normal(size=(N, 3)) + np.array([0.0, 0.0, 9.8])
    mag = rng.normal(size=(N, 3)) + np.array([20.0, 0.0, -40.0])
    return {"time": np.arange(N) / RATE, "gyro": rng.normal(size=(N, 3)), "accel": accel, "mag": mag}


def assert_holds(path: Path, readings: dict[str, np.ndarray], tolerance: float, start: float = 0.0) -> None:
    """The recording has these readings, mag in every fifth row."""
    recording = read(path)
    assert recording.sample_period == pytest.approx(1 / RATE, rel=1e-6)
    assert recording.sample_index.tolist() == list(range(N))
    np.testing.assert_allclose(recording.time, start + readings["time"], atol=1e-6)
    np.testing.assert_allclose(recording.gyro, readings["gyro"], rtol=tolerance, atol=tolerance)
    np.testing.assert_allclose(recording.accel, readings["accel"], rtol=tolerance, atol=tolerance)
    assert recording.mag is not None
    np.testing.assert_allclose(recording.mag[::5], readings["mag"][::5], rtol=tolerance, atol=1e-4)
    assert np.isnan(np.delete(recording.mag, slice(0, N, 5), axis=0)).all()


@pytest.mark.parametrize("kind", ["bag", "sqlite3", "db3", "mcap", "mcap alone"])
@needs("rosbags")
def test_a_ros_bag_is_read_by_the_stamps_of_its_messages(
    kind: str, readings: dict[str, np.ndarray], tmp_path: Path
) -> None:
    release = "ROS1_NOETIC" if kind == "bag" else "ROS2_HUMBLE"
    time = START + readings["time"]
    messages = robot_logs.ros_messages(release, time, readings["gyro"], readings["accel"], 1e-6 * readings["mag"])
    if kind == "bag":
        path = robot_logs.write_ros1(tmp_path / "drive.bag", messages)
    else:
        storage = "mcap" if "mcap" in kind else "sqlite3"
        path = robot_logs.write_ros2(tmp_path / "drive", messages, storage)
        if kind in ("db3", "mcap alone"):
            (path,) = path.glob("*.db3" if kind == "db3" else "*.mcap")
    assert_holds(path, readings, 1e-12, START)


@needs("rosbags")
def test_messages_without_a_stamp_take_the_time_of_recording_and_a_note_says_so(
    readings: dict[str, np.ndarray], tmp_path: Path
) -> None:
    messages = robot_logs.ros_messages(
        "ROS1_NOETIC", START + readings["time"], readings["gyro"], readings["accel"], stamped=False
    )
    recording = read(robot_logs.write_ros1(tmp_path / "drive.bag", messages))
    np.testing.assert_allclose(recording.time, START + readings["time"] + 0.005, atol=1e-6)
    assert any("/imu/data" in note and "no stamp" in note for note in recording.notes)


def px4_topics(readings: dict[str, np.ndarray]) -> list[tuple[str, int, list[str], np.ndarray]]:
    """Topics of a flight, the magnetometer in every fifth row."""
    microseconds = 1e6 * readings["time"][:, None] + 2e6
    inertial = [f"gyro_rad[{i}]" for i in range(3)] + [f"accelerometer_m_s2[{i}]" for i in range(3)]
    combined = np.hstack([microseconds, readings["gyro"], readings["accel"]])
    field = np.hstack([microseconds, readings["mag"] / 100])[::5]
    return [
        ("vehicle_magnetometer", 0, [f"magnetometer_ga[{i}]" for i in range(3)], field),
        ("sensor_combined", 0, inertial, combined),
        ("sensor_gyro", 0, ["x", "y", "z"], 0 * combined[:, :4] + microseconds),
    ]


@needs("pyulog")
def test_a_log_of_px4_gives_the_combined_sensor_and_the_magnetometer(
    readings: dict[str, np.ndarray], tmp_path: Path
) -> None:
    path = robot_logs.write_ulog(tmp_path / "flight.ulg", px4_topics(readings))
    assert_holds(path, readings, SINGLE, 2.0)
    assert any("z down" in note for note in read(path).notes)


@needs("pyulog")
def test_gyroscope_and_accelerometer_of_px4_go_together_by_their_number(
    readings: dict[str, np.ndarray], tmp_path: Path
) -> None:
    microseconds = 1e6 * readings["time"][:, None]
    topics = []
    for instance in (0, 1):
        scale = 1.0 + instance
        for name in ("gyro", "accel"):
            rows = np.hstack([microseconds, scale * readings[name]])
            topics.append((f"sensor_{name}", instance, ["x", "y", "z"], rows))
    path = robot_logs.write_ulog(tmp_path / "flight.ulg", topics)
    recording = read(path)
    np.testing.assert_allclose(recording.accel, readings["accel"], rtol=SINGLE)
    assert any("sensor_gyro[1]" in note and "--stream" in note for note in recording.notes)
    recording = read(path, stream="sensor_gyro[1]")
    np.testing.assert_allclose(recording.gyro, 2 * readings["gyro"], rtol=SINGLE, atol=SINGLE)
    np.testing.assert_allclose(recording.accel, 2 * readings["accel"], rtol=SINGLE)
    with pytest.raises(RecordingError, match=r"no gyroscope is called 'sensor_gyro\[2\]'.*sensor_gyro\[0\]"):
        read(path, stream="sensor_gyro[2]")


@needs("pymavlink")
def test_a_log_of_ardupilot_gives_its_first_imu_and_compass(readings: dict[str, np.ndarray], tmp_path: Path) -> None:
    microseconds = 1e6 * readings["time"][:, None] + 3e6
    first, second = (np.hstack([microseconds, np.full((N, 1), i)]) for i in (0, 1))
    inertial = np.hstack([readings["gyro"], readings["accel"]])
    both = np.stack([np.hstack([first, inertial]), np.hstack([second, 2 * inertial])], axis=1).reshape(2 * N, -1)
    compass = np.hstack([first, 10 * readings["mag"]])[::5]
    path = robot_logs.write_ardupilot(
        tmp_path / "00000012.BIN",
        [
            ("IMU", ("GyrX", "GyrY", "GyrZ", "AccX", "AccY", "AccZ"), both),
            ("MAG", ("MagX", "MagY", "MagZ"), compass),
        ],
    )
    assert_holds(path, readings, SINGLE, 3.0)
    second_imu = read(path, stream="IMU[1]")
    np.testing.assert_allclose(second_imu.gyro, 2 * readings["gyro"], rtol=SINGLE, atol=SINGLE)


def mdf_channels(readings: dict[str, np.ndarray], names: dict[str, tuple[str, str, float]]) -> list[tuple]:
    """Channels by the pattern of their names; of a signal: pattern, unit, factor."""
    return [
        (pattern.format(axis), unit, readings["time"], scale * readings[signal][:, i])
        for signal, (pattern, unit, scale) in names.items()
        for i, axis in enumerate("XYZ")
    ]


@needs("asammdf")
def test_channels_of_a_measurement_file_are_known_by_name_and_converted_by_unit(
    readings: dict[str, np.ndarray], tmp_path: Path
) -> None:
    names = {"gyro": ("IMU_Gyro_{}", "deg/s", np.degrees(1.0)), "accel": ("IMU_Acc_{}", "g", 1 / 9.80665)}
    recording = read(robot_logs.write_mdf(tmp_path / "drive.mf4", mdf_channels(readings, names)))
    np.testing.assert_allclose(recording.gyro, readings["gyro"], rtol=1e-12)
    np.testing.assert_allclose(recording.accel, readings["accel"], rtol=1e-12)
    np.testing.assert_allclose(recording.time, readings["time"], atol=1e-9)


@needs("asammdf")
def test_channels_of_other_names_are_named_by_the_user(readings: dict[str, np.ndarray], tmp_path: Path) -> None:
    names = {"gyro": ("Vehicle.Rot{}", "", np.degrees(1.0)), "accel": ("Vehicle.Lin{}", "m/s2", 1.0)}
    path = robot_logs.write_mdf(tmp_path / "drive.mf4", mdf_channels(readings, names))
    with pytest.raises(RecordingError, match=r"which channels are gyro and accel\?.*--columns gyro=X,Y,Z"):
        read(path)
    chosen = {
        "gyro": "Vehicle.RotX,Vehicle.RotY,Vehicle.RotZ:deg/s",
        "accel": "Vehicle.LinX,Vehicle.LinY,Vehicle.LinZ",
    }
    recording = read(path, columns=chosen)
    np.testing.assert_allclose(recording.gyro, readings["gyro"], rtol=1e-12)
    with pytest.raises(RecordingError, match=r"no channel 'Vehicle\.RotW'; the channels are 'Vehicle\.RotX'"):
        read(path, columns=chosen | {"gyro": "Vehicle.RotX,Vehicle.RotY,Vehicle.RotW"})


SUFFIXES = {
    "bag": "rosbags",
    "db3": "rosbags",
    "mcap": "rosbags",
    "ulg": "pyulog",
    "bin": "pymavlink",
    "mf4": "asammdf",
}
EACH = pytest.mark.parametrize(
    "suffix", [pytest.param(suffix, marks=needs(package)) for suffix, package in SUFFIXES.items()]
)


@EACH
@pytest.mark.parametrize("content", [b"", b"not a log at all\n" * 40, bytes(5000)], ids=["empty", "text", "zeros"])
def test_a_damaged_log_is_one_line_that_names_the_file(suffix: str, content: bytes, tmp_path: Path) -> None:
    path = tmp_path / f"broken.{suffix}"
    path.write_bytes(content)
    with pytest.raises(RecordingError) as raised:
        read(path)
    assert str(raised.value).startswith(str(path))
    assert "\n" not in str(raised.value)


@EACH
def test_a_log_cut_short_is_read_up_to_there_or_refused(
    suffix: str, readings: dict[str, np.ndarray], tmp_path: Path, logs: dict[str, Callable[[], Path]]
) -> None:
    content = logs[suffix]().read_bytes()
    for share in (0.02, 0.3, 0.6, 0.95):
        path = tmp_path / f"cut.{suffix}"
        path.write_bytes(content[: int(share * len(content))])
        try:
            recording = read(path)
        except RecordingError as error:
            assert str(error).startswith(str(path)) and "\n" not in str(error)
        else:
            rows = len(recording.gyro)
            assert 2 <= rows <= N
            np.testing.assert_allclose(recording.gyro, readings["gyro"][:rows], rtol=SINGLE, atol=SINGLE)


@pytest.fixture
def logs(readings: dict[str, np.ndarray], tmp_path: Path) -> dict[str, Callable[[], Path]]:
    """A whole log by suffix."""
    inertial = np.hstack([1e6 * readings["time"][:, None], np.zeros((N, 1)), readings["gyro"], readings["accel"]])
    names = {"gyro": ("Gyro{}", "rad/s", 1.0), "accel": ("Acc{}", "m/s2", 1.0)}

    def bag(release: str) -> list:
        return robot_logs.ros_messages(release, START + readings["time"], readings["gyro"], readings["accel"])

    def ros2(storage: str, suffix: str) -> Path:
        return next(
            robot_logs.write_ros2(tmp_path / f"whole_{suffix}", bag("ROS2_HUMBLE"), storage).glob(f"*.{suffix}")
        )

    return {
        "bag": lambda: robot_logs.write_ros1(tmp_path / "whole.bag", bag("ROS1_NOETIC")),
        "db3": lambda: ros2("sqlite3", "db3"),
        "mcap": lambda: ros2("mcap", "mcap"),
        "ulg": lambda: robot_logs.write_ulog(tmp_path / "whole.ulg", px4_topics(readings)),
        "bin": lambda: robot_logs.write_ardupilot(
            tmp_path / "whole.bin", [("IMU", ("GyrX", "GyrY", "GyrZ", "AccX", "AccY", "AccZ"), inertial)]
        ),
        "mf4": lambda: robot_logs.write_mdf(tmp_path / "whole.mf4", mdf_channels(readings, names)),
    }


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_missing_library_is_told_with_what_installs_it(
    suffix: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = SUFFIXES[suffix]
    for module in (package, "rosbags.highlevel", "rosbags.typesys", "pyulog.core", "pymavlink.DFReader"):
        monkeypatch.setitem(sys.modules, module, None)  # as if it were not installed
    path = tmp_path / f"log.{suffix}"
    path.write_bytes(b"anything")
    with pytest.raises(RecordingError, match=rf'to read it {package} is needed: pip install "imufmu\['):
        read(path)
