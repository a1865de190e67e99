"""What was told of a recording is remembered beside it, holds until told otherwise, and is said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from imufmu.files.atomic import WriteError
from imufmu.recordings.columns import parsed_columns
from imufmu.recordings.reading import RecordingError, read
from imufmu.recordings.told import Told, memory_of, recall, remember
from support.rocking import lines_of, rocking

MOTION = rocking(6.0)


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "log.txt"
    text = lines_of(
        "t;wx;wy;wz;ax;ay;az", 1e3 * MOTION["time"], np.rad2deg(MOTION["gyro"]), MOTION["accel"], separator=";"
    )
    path.write_text(text)
    return path


TOLD = Told(
    parsed_columns(["gyro=wx,-wy,wz:deg/s", 'accel="ax",ay,az', "time=t:ms"]),
    axes="NED",
    mount="0,0,90",
    stream="imu 1",
)


def test_what_is_remembered_is_recalled(log):
    remember(log, TOLD)
    assert memory_of(log).name == "log.txt.toml"
    assert recall(log) == TOLD
    rated = Told(rate=99.5)
    remember(log, rated)
    assert recall(log) == rated


def test_a_recording_is_read_as_remembered_and_a_note_says_so(log):
    remember(log, Told(parsed_columns(["gyro=wx,wy,wz:deg/s", "time=t:ms"])))
    recording = read(log)
    assert np.allclose(recording.gyro, MOTION["gyro"], atol=1e-6)
    assert recording.notes[0] == "as remembered in log.txt.toml: --columns gyro=wx,wy,wz:deg/s --columns time=t:ms"
    again = read(log, columns=["gyro=wx,wy,wz:rad/s"])
    assert np.allclose(again.gyro, np.rad2deg(MOTION["gyro"]), atol=1e-6)


def test_a_rate_is_remembered_until_another_is_given(log):
    remember(log, Told(parsed_columns(["gyro=wx,wy,wz:deg/s"]), rate=50.0))
    assert read(log).sample_period == 0.02
    assert read(log, rate=100.0).sample_period == 0.01


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("rate = ", "log.txt.toml: not TOML"),
        ('speed = "fast"', "log.txt.toml: no setting is called 'speed'"),
        ('rate = "fast"', "rate is a number"),
        ("rate = true", "rate is a number"),
        ("axes = 3", "are texts in quotes"),
        ('[columns]\ngyro = ["a", "b"]', r"\[columns\] has lines as"),
        ('[columns]\ngyro = "a,b"', "log.txt.toml: columns: gyro=a,b: give 3 columns"),
        ("\0", "not TOML"),
    ],
)
def test_a_damaged_memory_is_refused_by_name(log, text, message):
    memory_of(log).write_text(text)
    with pytest.raises(RecordingError, match=message):
        read(log)


def test_a_folder_that_is_closed_is_one_line(tmp_path):
    with pytest.raises(WriteError, match="no folder"):
        remember(tmp_path / "none" / "log.txt", TOLD)
