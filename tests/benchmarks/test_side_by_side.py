"""A user's own files in a benchmark, and filters of others on one recording."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from imufmu.benchmarks.recordings import benchmark
from imufmu.benchmarks.side_by_side import parameters_of, peer_replays
from imufmu.blocks.rotations import euler_from_quaternion, over_rows
from imufmu.files.csv_table import write_csv
from imufmu.recordings.columns import parsed_columns
from imufmu.recordings.reading import read
from imufmu.recordings.told import Told, remember
from imufmu.scoring.metrics import inclination_error
from support.optional import needs
from support.rocking import lines_of, rocking

MOTION = rocking(8.0)


def test_a_log_of_another_make_is_scored_as_it_is_remembered(tmp_path: Path) -> None:
    """Told once beside the file, a table with other names, units and axes counts like any other."""
    flip = np.array([1, -1, -1])
    roll, pitch, _ = over_rows(euler_from_quaternion, MOTION["q_NS"]).T
    table = (1e3 * MOTION["time"], np.rad2deg(MOTION["gyro"]) * flip, MOTION["accel"] * flip, roll, -pitch)
    (tmp_path / "a.txt").write_text(lines_of("t;wx;wy;wz;bx;by;bz;roll;pitch", *table, separator=";"))
    columns = parsed_columns(["gyro=wx,wy,wz:deg/s", "accel=bx,by,bz", "time=t:ms"])
    remember(tmp_path / "a.txt", Told(columns, axes="NED"))
    result = benchmark(tmp_path, ["rizun2008"])
    ours = [score for score in result.scores if score.contender == "rizun2008"]
    # The rocking accelerates nothing: what is left is a filter's lag, some tenths of a degree.
    assert ours and all(score.inclination_rmse_deg < 1 for score in ours)


@needs("vqf", "imufusion")
def test_filters_of_others_give_the_vertical_and_its_angles(tmp_path: Path) -> None:
    write_csv(tmp_path / "walk.csv", MOTION)
    recording = read(tmp_path / "walk.csv")
    for replay in peer_replays(recording):
        signals = replay.signals()
        tilted = inclination_error(signals["vertical"], recording.truth["vertical"])
        assert np.rad2deg(tilted[200:].max()) < 5, replay.estimator  # 1.6 at most where they have settled
        np.testing.assert_allclose(
            -np.sin(signals["pitch"]), signals["vertical"][:, 0], atol=1e-6
        )  # of single precision


def test_parameters_go_to_the_estimators_that_they_name() -> None:
    every = ["lee2012", "my/filter.fmu"]
    given = {"g": 9.81, "lee2012.c_a": 0.2, "filter.gain": 3, "filter.part.gain": 4}
    assert parameters_of("lee2012", given, every) == {"g": 9.81, "c_a": 0.2}
    assert parameters_of("my/filter.fmu", given, every) == {"g": 9.81, "gain": 3, "part.gain": 4}


def test_peers_that_are_not_installed_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("imufmu.benchmarks.side_by_side.peers", list)
    write_csv(tmp_path / "walk.csv", MOTION)
    with pytest.raises(ValueError, match=r'pip install "imufmu\[peers\]"'):
        peer_replays(read(tmp_path / "walk.csv"))
