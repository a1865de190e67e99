"""Recordings: what is read is what the file says, and what cannot be read is named."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io

from imufmu.blocks.rotations import over_rows, quaternion_from_euler, vertical_from_roll_pitch
from imufmu.files.csv_table import write_csv
from imufmu.recordings.matlab import read_matlab
from imufmu.recordings.reading import Recording, RecordingError, read

HEADER = "time,gyro[1],gyro[2],gyro[3],accel[1],accel[2],accel[3]"
NAMES = HEADER.split(",")


def still(n: int = 20) -> dict[str, np.ndarray]:
    """Columns of a flawless record: a turning, upright sensor at 100 Hz."""
    rng = np.random.default_rng(5)
    columns = {name: 0.1 * rng.standard_normal(n) for name in NAMES}
    columns["time"] = 0.01 * np.arange(n)
    columns["accel[3]"] += 9.81
    return columns


def csv_of(folder: Path, columns: dict[str, np.ndarray]) -> Path:
    write_csv(folder / "walk.csv", columns)
    return folder / "walk.csv"


def text_file(folder: Path, text: str | bytes) -> Path:
    path = folder / "walk.csv"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def lines_of(n: int = 5) -> list[str]:
    """Header and n data lines of a flawless CSV file."""
    return [HEADER, *(f"{0.01 * i:.2f},0,0,0.5,0,0,9.81" for i in range(n))]


# Reading CSV


def test_csv_is_read_back_bit_for_bit(tmp_path: Path) -> None:
    columns = still()
    recording = read(csv_of(tmp_path, columns))
    assert recording.name == "walk"
    assert np.array_equal(recording.time, columns["time"])
    assert np.array_equal(recording.gyro, np.column_stack([columns[f"gyro[{i}]"] for i in (1, 2, 3)]))
    assert np.array_equal(recording.accel, np.column_stack([columns[f"accel[{i}]"] for i in (1, 2, 3)]))
    assert recording.mag is None
    assert recording.truth == {}
    assert recording.scored.all()
    assert recording.notes == ()


def test_order_of_columns_quotes_byte_order_mark_and_line_ends_do_not_matter(tmp_path: Path) -> None:
    columns = still()
    plain = read(csv_of(tmp_path, columns))
    turned = csv_of(tmp_path, dict(reversed(columns.items()))).read_text()
    header, body = turned.split("\n", 1)
    quoted = ",".join(f'"{name}"' for name in header.split(","))
    other = read(text_file(tmp_path, b"\xef\xbb\xbf" + f"{quoted}\n\n{body}\n".replace("\n", "\r\n").encode()))
    assert np.array_equal(other.gyro, plain.gyro)
    assert np.array_equal(other.accel, plain.accel)


def test_unknown_columns_are_ignored_with_a_note(tmp_path: Path) -> None:
    recording = read(csv_of(tmp_path, still() | {"temperature": np.zeros(20)}))
    assert recording.notes == ("ignored columns: 'temperature'",)


def test_empty_cells_and_nan_are_missing_samples(tmp_path: Path) -> None:
    lines = lines_of()
    lines[2] = "0.01,,0,0.5,0,0,9.81"
    lines[3] = "0.02,0,0,0.5,nan, ,9.81"
    recording = read(text_file(tmp_path, "\n".join(lines)))
    assert np.isnan(recording.gyro[1, 0])
    assert np.isnan(recording.accel[2, :2]).all()
    assert np.isnan(np.hstack([recording.gyro, recording.accel])).sum() == 3


def test_recordings_cannot_be_changed(tmp_path: Path) -> None:
    recording = read(csv_of(tmp_path, still()))
    with pytest.raises(ValueError, match="read-only"):
        recording.gyro[0, 0] = 1.0


def test_truth_angles_and_vertical_follow_from_the_quaternion(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    angles = rng.uniform(-1.5, 1.5, (20, 3))
    q_NS = over_rows(quaternion_from_euler, *angles.T)
    recording = read(csv_of(tmp_path, still() | {"q_NS": q_NS}))
    for name, expected in zip(("roll", "pitch", "yaw"), angles.T, strict=True):
        # Pitch stays 0.07 rad from the singularity, which multiplies rounding by 1/0.07.
        np.testing.assert_allclose(recording.truth[name], expected, atol=1e-14)
    vertical = over_rows(vertical_from_roll_pitch, *angles.T[:2])
    np.testing.assert_allclose(recording.truth["vertical"], vertical, atol=1e-14)  # as above


def test_roll_and_pitch_alone_are_a_truth_of_the_vertical(tmp_path: Path) -> None:
    roll, pitch = np.full(20, 0.1), np.full(20, -0.05)
    roll[3] = np.nan
    recording = read(csv_of(tmp_path, still() | {"roll": roll, "pitch": pitch}))
    assert set(recording.truth) == {"roll", "pitch", "vertical"}
    assert np.flatnonzero(~recording.scored).tolist() == [3]
    assert np.isfinite(recording.truth["vertical"][recording.scored]).all()


def test_a_large_file_is_read_whole(tmp_path: Path) -> None:
    recording = read(csv_of(tmp_path, still(20_000)))
    assert len(recording.time) == 20_000
    assert np.array_equal(recording.sample_index, np.arange(20_000))


# What cannot be read


def broken(line: int, text: str) -> str:
    lines = lines_of()
    lines[line - 1] = text
    return "\n".join(lines)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "line 1: no names"),
        ("\n".join(lines_of()[1:]), "line 1: no names"),
        (HEADER, "0 samples"),
        ("\n".join(lines_of(1)), "1 samples"),
        (broken(1, HEADER.replace("gyro[2]", "gyr_y")), r"line 1: missing: gyro\[2\] \(rad/s\).*'gyr_y'"),
        (broken(1, HEADER.replace("gyro[2]", "gyro[1]")), r"column 'gyro\[1\]' appears 2 times"),
        (broken(1, HEADER.replace("gyro[1]", "gyro[1] [furlong]")), r"unit 'furlong' of column 'gyro\[1\]' is unknown"),
        (broken(1, HEADER.replace("gyro[1]", "mag[1]")), r"missing: gyro\[1\].*mag\[2\] \(uT\)"),
        (broken(4, "0.02,0,abc,0,0,0,9.8"), r"line 4, column 'gyro\[2\]': 'abc' is not a number"),
        (broken(4, "0.02,0,0,0,0,9.8"), "line 4: 6 fields, but the header names 7"),
        (broken(4, '0.02,0,"0,0,0,0,9.8'), "line 4: 3 fields, but the header names 7"),
        (broken(4, ",0,0,0,0,0,9.8"), "line 4, column 'time': missing"),
        (broken(4, "inf,0,0,0,0,0,9.8"), "line 4, column 'time': missing"),
        (broken(4, "0.005,0,0,0,0,0,9.8"), "line 4, column 'time': 0.005 s follows 0.01 s"),
        (broken(4, "0.01,0,0,0,0,0,9.8"), "line 4, column 'time': 0.01 s is repeated"),
        (broken(4, "0.0101,0,0,0,0,0,9.8"), "line 4, column 'time': 0.0101 s is less than half a sample period"),
        (broken(6, "1e300,0,0,0,0,0,9.8"), "line 6, column 'time': missing or not in seconds"),
        (broken(6, "1e9,0,0,0,0,0,9.8"), r"line 6, column 'time': a gap of 1e\+09 s"),
        (HEADER + "\n0,0,0,0,0,0,9.8\n1e11,0,0,0,0,0,9.8", r"line 3, column 'time': samples are 1e\+11 s apart"),
        (b"\x89PNG\r\n\x1a\n\x00\xff\xfe", "not a text file"),
        (HEADER + "," + "x" * 200_000, "not a CSV table"),
    ],
)
def test_a_faulty_csv_is_refused_with_its_place(tmp_path: Path, text: str | bytes, message: str) -> None:
    with pytest.raises(RecordingError, match=message):
        read(text_file(tmp_path, text))


def test_lines_are_counted_as_an_editor_counts_them(tmp_path: Path) -> None:
    header, *rows = lines_of()
    text = "\n".join([f"{header},remark", "", "  ", *(f'{row},"two\nlines"' for row in rows), "0.05,0,0,0,0,0,x,"])
    with pytest.raises(RecordingError, match=r"line 14, column 'accel\[3\]'"):
        read(text_file(tmp_path, text))


def test_a_rounded_quaternion_is_brought_to_unit_length(tmp_path: Path) -> None:
    recording = read(csv_of(tmp_path, still() | {"q_NS": np.tile([0.998, 0.056, 0, 0], (20, 1))}))
    # One division and one square root are rounded.
    np.testing.assert_allclose(np.linalg.norm(recording.truth["q_NS"], axis=1), 1.0, atol=4e-16)


def test_a_quaternion_that_is_no_rotation_is_refused(tmp_path: Path) -> None:
    q_NS = np.tile([1.0, 0, 0, 0], (20, 1))
    q_NS[7] = [0.5, 0, 0, 0]
    with pytest.raises(RecordingError, match="line 9: q_NS has length"):
        read(csv_of(tmp_path, still() | {"q_NS": q_NS}))


@pytest.mark.parametrize(
    "name", ["missing.csv", "missing.mat", "missing.zip", "folder.csv", "folder.mat", "record.doc", "record"]
)
def test_what_is_no_recording_is_refused_by_name(tmp_path: Path, name: str) -> None:
    if name.startswith("folder"):
        (tmp_path / name).mkdir()
    with pytest.raises(RecordingError, match=f"{name}: cannot read"):
        read(tmp_path / name)


def test_no_mutilation_of_a_file_gets_past_the_error_class(tmp_path: Path) -> None:
    """Bytes replaced, cut out or doubled at random: a recording or a RecordingError, and never a warning."""
    rng = np.random.default_rng(2)
    whole = csv_of(tmp_path, still() | {"q_NS": np.tile([1.0, 0, 0, 0], (20, 1))}).read_bytes()
    alphabet = np.frombuffer(b'0123456789eE+-.,;"\n\r\0\xff[]nai ', dtype=np.uint8)
    for _ in range(300):
        data = bytearray(whole)
        for _ in range(rng.integers(1, 5)):
            at, length = rng.integers(len(data)), rng.integers(1, 30)
            new = rng.choice(alphabet, rng.integers(0, 4)).tobytes()
            data[at : at + rng.choice([0, 1, length])] = new
        try:
            assert isinstance(read(text_file(tmp_path, bytes(data))), Recording)
        except RecordingError as error:
            assert str(error).startswith(str(tmp_path))


# Doubts


@pytest.mark.parametrize(
    ("change", "note"),
    [
        ({"accel[3]": np.ones(20)}, "are the values in g"),
        ({"accel[3]": np.full(20, 981.0)}, "far from gravity"),
        ({"gyro[2]": np.full(20, 90.0)}, "deg/s"),
        ({"mag": np.full((20, 3), 0.3)}, "uT"),
        ({"time": np.arange(20) * 10.0}, "milliseconds"),
        ({"gyro[2]": np.full(20, np.nan)}, "gyro has no complete sample"),
        ({"roll": np.full(20, np.nan)}, "truth is missing everywhere"),
        ({"q_NS": np.tile([1.0, 0, 0, 0], (20, 1))}, None),
        ({"q_NS": np.tile([0.8, 0.6, 0, 0], (20, 1))}, "off the true vertical"),
        ({"roll": np.full(20, 90.0), "pitch": np.zeros(20)}, "off the true vertical"),
    ],
)
def test_values_that_look_like_another_unit_or_convention_are_noted(
    tmp_path: Path, change: dict[str, np.ndarray], note: str | None
) -> None:
    notes = read(csv_of(tmp_path, still() | change)).notes
    assert len(notes) == (0 if note is None else 1)
    assert note is None or note in notes[0]


# Gaps


def test_readings_at_instants_are_missing_where_rows_are(tmp_path: Path) -> None:
    keep = [0, 1, 2, 3, 6, 7, 9]
    recording = read(csv_of(tmp_path, {name: column[keep] for name, column in still().items()}))
    assert recording.notes == ("3 of 10 samples have no row; the longest gap is after line 5",)
    gyro = recording.at_instants()["gyro"]
    assert np.flatnonzero(np.isnan(gyro).all(axis=1)).tolist() == [4, 5, 8]
    assert np.array_equal(gyro[recording.sample_index], recording.gyro)


# BROAD


def broad_like(path: Path, *, compressed: bool = True, **changes: np.ndarray | None) -> Path:
    """A MATLAB file as BROAD's, with some variables replaced or (None) left out."""
    n = 30
    content: dict[str, np.ndarray | None] = {
        "imu_gyr": np.zeros((n, 3)),
        "imu_acc": np.tile([0, 0, 9.8], (n, 1)),
        "imu_mag": np.full((n, 3), 20.0),
        "opt_quat": np.tile([1.0, 0, 0, 0], (n, 1)),
        "movement": (np.arange(n)[:, None] > 9).astype(np.uint8),
        "sampling_rate": np.array([[250.0]]),
    } | changes
    scipy.io.savemat(path, {key: v for key, v in content.items() if v is not None}, do_compression=compressed)
    return path


def test_broad_scores_movement_with_known_truth(tmp_path: Path) -> None:
    q_NS = np.tile([1.0, 0, 0, 0], (30, 1))
    q_NS[12] = np.nan
    recording = read(broad_like(tmp_path / "a.mat", opt_quat=q_NS))
    assert np.flatnonzero(recording.scored).tolist() == [10, 11, *range(13, 30)]
    assert recording.sample_period == 1 / 250
    assert np.array_equal(recording.time, np.arange(30) / 250)
    assert recording.notes == ()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"imu_gyr": None}, "no variable 'imu_gyr'.*'imu_acc'"),
        ({"imu_acc": np.zeros((29, 3))}, r"'imu_acc' is of shape \(29, 3\), expected \(30, 3\)"),
        ({"imu_gyr": np.array(["a", "b"])}, "'imu_gyr' is no matrix of real numbers"),
        ({"imu_gyr": np.ones((30, 3), complex)}, "'imu_gyr' is no matrix of real numbers"),
        ({"imu_gyr": np.zeros((1, 3))}, "1 samples"),
        ({"sampling_rate": np.array([[0.0]])}, "'sampling_rate' is 0"),
        ({"sampling_rate": np.array([[np.nan]])}, "'sampling_rate' is nan"),
        ({"opt_quat": np.zeros((30, 4))}, "row 1: q_NS has length 0"),
    ],
)
def test_another_mat_file_is_refused(tmp_path: Path, changes: dict[str, np.ndarray | None], message: str) -> None:
    with pytest.raises(RecordingError, match=message):
        read(broad_like(tmp_path / "a.mat", **changes))


@pytest.mark.parametrize("compressed", [False, True])
def test_a_truncated_or_damaged_mat_file_is_refused(tmp_path: Path, compressed: bool) -> None:
    whole = broad_like(tmp_path / "a.mat", compressed=compressed).read_bytes()
    damaged = tmp_path / "damaged.mat"
    for cut in (0, 1, 100, 130, len(whole) // 2, len(whole) - 5):
        damaged.write_bytes(whole[:cut])
        with pytest.raises(RecordingError, match=r"damaged\.mat: "):
            read(damaged)
    rng = np.random.default_rng(4)
    for _ in range(200):
        data = np.frombuffer(whole, dtype=np.uint8).copy()
        # Type codes and sizes are words on multiples of four bytes: change them often.
        data[rng.integers(124 // 4, len(data) // 4, 3) * 4] = rng.choice([0, 1, 5, 9, 14, 15, 255], 3)
        damaged.write_bytes(data.tobytes())
        try:
            read(damaged)
        except RecordingError as error:
            assert str(error).startswith(f"{damaged}: ")


@pytest.mark.parametrize("compressed", [False, True])
def test_matrices_are_those_that_scipy_reads(tmp_path: Path, compressed: bool) -> None:
    rng = np.random.default_rng(9)
    kinds = ["f8", "f4", "i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "?"]
    written: dict[str, Any] = {f"a_{kind.strip('?')}": (100 * rng.random((3, 5))).astype(kind) for kind in kinds}
    written |= {"whole_numbers_are_packed": np.arange(6.0)[:, None], "empty": np.zeros((0, 3)), "b": np.ones((2, 3, 4))}
    others: dict[str, Any] = {"text": "abc", "cell": np.array([1, "a"], object), "complex": np.ones(2) * 1j}
    path = tmp_path / "a.mat"
    scipy.io.savemat(path, written | others, do_compression=compressed)
    ours, scipys = read_matlab(path), scipy.io.loadmat(path)
    assert set(ours) == {*written, *others}
    for name in written:
        np.testing.assert_array_equal(ours[name], scipys[name])
    assert all(ours[name] is None for name in others)


def test_a_variable_that_unpacks_without_end_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("imufmu.recordings.matlab._LARGEST", 500)
    with pytest.raises(RecordingError, match="larger than 500 bytes"):
        read(broad_like(tmp_path / "a.mat"))


def test_files_of_other_versions_say_what_to_do(tmp_path: Path) -> None:
    scipy.io.savemat(tmp_path / "a.mat", {"imu_gyr": np.zeros((5, 3))}, format="4")
    with pytest.raises(RecordingError, match="save with the option -v7"):
        read(tmp_path / "a.mat")


def test_every_broad_trial_is_read_without_doubts(broad: Path) -> None:
    for path in sorted(broad.glob("*.mat")):
        recording = read(path)
        assert recording.notes == (), path.name
        assert recording.sample_period == pytest.approx(0.0035, rel=1e-12)  # stored in double precision
        assert recording.scored.any()
        assert np.isfinite(recording.truth["vertical"][recording.scored]).all()
        content = scipy.io.loadmat(path)
        assert set(read_matlab(path)) == {name for name in content if not name.startswith("__")}
        assert np.array_equal(recording.gyro, content["imu_gyr"])
        known = np.isfinite(content["opt_quat"]).all(axis=1)
        assert np.array_equal(recording.scored, known & (content["movement"].ravel() == 1))


def test_broad_as_csv_is_the_same_recording(tmp_path: Path, broad: Path) -> None:
    trial = read(min(broad.glob("*.mat")))
    write_csv(tmp_path / "trial.csv", {"time": trial.time, **trial.readings, "q_NS": trial.truth["q_NS"]})
    copy = read(tmp_path / "trial.csv")
    assert copy.sample_period == trial.sample_period
    assert np.array_equal(copy.sample_index, trial.sample_index)
    for name, readings in trial.readings.items():
        assert np.array_equal(copy.readings[name], readings)
    # Normalised at each reading: a second time it can move the last digit.
    np.testing.assert_allclose(copy.truth["q_NS"], trial.truth["q_NS"], atol=2.3e-16)


# Writing


def test_columns_of_different_length_are_refused_before_anything_is_written(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="one length"):
        write_csv(tmp_path / "a.csv", {"time": np.zeros(3), "gyro": np.zeros((2, 3))})
    with pytest.raises(ValueError, match=r"P: shape \(2, 3, 3\)"):
        write_csv(tmp_path / "a.csv", {"P": np.zeros((2, 3, 3))})
    assert list(tmp_path.iterdir()) == []
