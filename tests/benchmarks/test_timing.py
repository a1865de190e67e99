"""Timing of a device from its recordings: what is found in motions whose rates are means, or instants."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from imufmu.benchmarks import timing
from imufmu.benchmarks.sources import sources
from imufmu.benchmarks.timing import Timing, device_timing
from imufmu.cli.timing import tell_timing, timing_facts
from imufmu.files.csv_table import write_csv
from support.optional import RECORDINGS
from support.plumb_motions import moving

PERIOD = 0.02
STAMP = {1: 0, 2: 1, 0: 2}  # by gyro_index: halves of a period from the end of what a rate is the mean of to its stamp


def write(folder: Path, seed: int, gyro_index: int, seconds: float = 40.0, rate: float = 1.5) -> None:
    """A tumbling sensor; half as many rows as the motion has, each rate the mean of the period around its timing."""
    fine = moving(seed, seconds, dt=PERIOD / 2, rate=rate, rest=3.0)
    rows = np.arange(2, len(fine.gyro) - 2, 2)
    ends = rows + STAMP[gyro_index]
    # The mean of two short periods; the turn between them is less than 0.02 rad, and so commutes to 1e-4.
    gyro = (fine.gyro[ends] + fine.gyro[ends - 1]) / 2
    noise = np.random.default_rng(seed).normal(0, 0.02, (len(rows), 3))
    columns = {"time": np.arange(len(rows)) * PERIOD, "gyro": gyro, "accel": fine.accel[rows] + noise}
    write_csv(folder / f"r{seed}.csv", columns)


def device(folder: Path, gyro_index: int, count: int = 3) -> Path:
    folder.mkdir()
    for seed in range(count):
        write(folder, 40 + seed, gyro_index)
    return folder


@pytest.mark.parametrize("gyro_index", [pytest.param(1, marks=pytest.mark.slow), 2])
def test_several_recordings_tell_whether_rates_are_means_or_instants(gyro_index: int, tmp_path: Path) -> None:
    result = device_timing(device(tmp_path / "d", gyro_index))
    assert result.gyro_index == gyro_index
    assert result.verdict.startswith(f"Set gyro_index = {gyro_index} (")
    assert [t.cost > 0 for t in result.timings] == [False, True, True]
    assert result.timings[0].change_deg < 1e-9 < result.timings[1].change_deg
    assert result.table.rows[0][0] == str(gyro_index)


def test_one_recording_decides_nothing(tmp_path: Path) -> None:
    result = device_timing(device(tmp_path / "d", 2, count=1))
    assert result.gyro_index is None and "one recording tells nothing" in result.verdict


def test_what_hardly_turns_is_left_out_and_named(tmp_path: Path) -> None:
    write(tmp_path, 50, 1, rate=0.02)
    result = device_timing(tmp_path)
    assert result.gyro_index is None and not result.timings and "leave gyro_index = 3" in result.verdict
    assert list(result.notes) == ["turns too gently to tell anything about timing: r50"]


def test_recordings_that_contradict_each_other_decide_nothing() -> None:
    """One that shouts against three that whisper."""
    costs = np.array([[0.0, 900.0, 900.0], [5.0, 0.0, 9.0], [5.0, 0.0, 9.0], [5.0, 0.0, 9.0]])
    result = timing._judged(costs, np.zeros((4, 3, 3)), ["a", "b", "c", "d"], [])
    assert result.gyro_index is None
    assert result.timings[0] == Timing(1, 0.0, 0, 0.0)
    assert "only 1 of 4 recordings say so" in result.verdict


def test_the_likelihood_is_that_of_a_scalar_innovation() -> None:
    """Three independent velocities with variances P and R: -2 log L is the sum of log(P + R) + nu^2 / (P + R)."""
    P, R, nu = np.array([0.5, 1.0, 2.0]), np.array([1.0, 0.5, 4.0]), np.array([0.3, -1.0, 2.0])
    full = np.zeros((18, 18))
    full[[3, 4, 5], [3, 4, 5]] = P
    after = full.copy()
    after[[3, 4, 5], [3, 4, 5]] = P * R / (P + R)
    upper, error = np.triu_indices(18), np.zeros((1, 18))
    error[0, 3:6] = P / (P + R) * nu
    rows = {"resting": np.zeros(1), "anew": np.zeros(1), "coarse": np.zeros(1), "ends": np.ones(1, bool)}
    rows |= {"P_before": full[upper][None], "P": after[upper][None], "error": error}
    expected = np.sum(np.log(P + R) + nu**2 / (P + R))
    assert timing.block_costs(rows) == pytest.approx([expected], rel=1e-12)
    assert not len(timing.block_costs(rows | {"resting": np.ones(1)}))


def test_a_folder_is_told_about_in_words_and_for_programs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = device(tmp_path / "d", 2, count=2)
    (folder / "broken.csv").write_text("time\n")
    tell_timing(folder)
    printed = capsys.readouterr()
    assert re.search(r"^Timing of the gyroscope, by 2 recordings of one device$", printed.out, re.MULTILINE)
    assert re.search(r"^2 +values of the instant", printed.out, re.MULTILINE)
    assert "note: left out: " in printed.err and "broken.csv" in printed.err
    facts = timing_facts(folder)
    assert facts["gyro_index"] == 2 and facts["timings"][0]["gyro_index"] == 2


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "expected"),
    [("broad", 1), ("field/chain", 2), ("field/phone", 1), ("field/robot", 1), ("field/handheld", None)],
)
def test_recordings_of_others_give_the_timing_of_their_device(kind: str, expected: int | None) -> None:
    """BROAD and DIODEM against the truth; the truth of the others was aligned by rates, and cannot tell."""
    if not (RECORDINGS / kind).is_dir():
        pytest.skip(f"no recordings in {RECORDINGS / kind}: docs/recordings.md tells how to get some")
    assert sources(RECORDINGS / kind).files
    assert device_timing(RECORDINGS / kind).gyro_index == expected
