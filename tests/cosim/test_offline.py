"""A recording through an estimator that sees all of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from imufmu.compiled.offline import run_offline
from imufmu.cosim.offline import replay_offline
from imufmu.files.csv_table import write_csv
from imufmu.recordings.reading import Recording, read
from support.plumb_motions import BLOCK, consumer, moving


@pytest.fixture
def recording(tmp_path: Path) -> Recording:
    """Twenty seconds that begin in motion, with 5 rows that are not there."""
    motion = moving(62, 21)
    readings, kept = consumer(motion), np.delete(np.arange(100, 2100), slice(700, 705))
    v = motion.vertical[kept]
    roll, pitch = np.arctan2(v[:, 1], v[:, 2]), np.arcsin(-v[:, 0])
    columns = {"time": kept * motion.dt, "roll": roll, "pitch": pitch}
    write_csv(tmp_path / "hand.csv", columns | {name: values[kept] for name, values in readings.items()})
    return read(tmp_path / "hand.csv")


def test_a_replay_offline_is_the_run_over_all_instants(recording: Recording) -> None:
    replay = replay_offline(recording, "plumb", {"gyro_index": 1})
    settings = {"gyro_index": 1, "sample_period": recording.sample_period}
    found = run_offline(BLOCK, recording.at_instants(), settings)
    for name in ("vertical", "roll", "pitch", "tilt_std"):
        assert np.array_equal(replay.signals()[name], found[name][recording.sample_index]), name
    assert replay.units["tilt_std"] == "rad"


def test_the_command_prints_errors_and_writes_the_table(imufmu, recording: Recording, tmp_path: Path) -> None:
    target = tmp_path / "tilt.csv"
    code, text, errors = imufmu("replay", recording.path, "-e", "plumb", "--offline", "--output", target)
    assert code == 0, errors
    assert "plumb" in text and "tilt RMSE" in text
    assert len(target.read_text().splitlines()) == len(recording.time) + 1


def test_what_cannot_run_backward_is_refused(imufmu, recording: Recording) -> None:
    code, _, errors = imufmu("replay", recording.path, "-e", "mine.fmu", "--offline")
    assert code == 2
    assert "an FMU runs forward only" in errors
