"""Starts inside a motion: which instants they are, and that every filter really begins there."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from imufmu.benchmarks.contenders import Contender
from imufmu.benchmarks.recordings import benchmark
from imufmu.benchmarks.sources import Source
from imufmu.benchmarks.starts import start_scores, start_tables, starts
from imufmu.benchmarks.summary import tables
from imufmu.files.csv_table import write_csv
from imufmu.recordings.reading import Recording, read

PERIOD, G = 0.01, 9.81


@pytest.fixture
def recording(tmp_path: Path) -> Recording:
    """At rest for 10 s, then rocking by 0.5 rad about x for a minute, at up to 1.5 rad/s; the truth ends at 65 s."""
    time = np.arange(7000) * PERIOD
    since = np.maximum(time - 10, 0)
    roll, rate = 0.5 * (1 - np.cos(3 * since)), 1.5 * np.sin(3 * since)
    columns = {"time": time, "gyro[1]": rate, "gyro[2]": 0 * time, "gyro[3]": 0 * time}
    columns |= {"accel[1]": 0 * time, "accel[2]": G * np.sin(roll), "accel[3]": G * np.cos(roll)}
    columns |= {"roll": np.where(time < 65, roll, np.nan), "pitch": 0 * time}
    write_csv(tmp_path / "rocking.csv", columns)
    return read(tmp_path / "rocking.csv")


def test_starts_lie_in_the_motion_and_twenty_known_seconds_before_the_end(recording: Recording) -> None:
    rows = starts(recording, recording.truth["vertical"], 7)
    time = recording.time[rows]
    assert len(rows) == 7 and np.all(np.diff(time) > 0)
    assert time[0] > 9.5 and time[-1] > 40
    assert time[-1] <= 65 - 0.9 * 20
    rates = [np.sqrt(np.mean(recording.gyro[row : row + 50, 0] ** 2)) for row in rows]
    assert min(rates) > 0.5
    assert starts(recording, recording.truth["vertical"], 0) == []


def test_a_recording_without_motion_has_no_start(recording: Recording) -> None:
    vertical = recording.truth["vertical"].copy()
    vertical[recording.time > 10] = np.nan
    assert starts(recording, vertical, 5) == []


def test_a_filter_sees_nothing_from_before_its_start(recording: Recording) -> None:
    """One that believes for ever what it read first is off by the turn since."""
    seen: list[np.ndarray] = []

    def estimate(readings: Any, sample_period: float) -> dict[str, np.ndarray]:
        seen.append(readings["accel"][0])
        return {"vertical": np.tile(readings["accel"][0] / G, (len(readings["accel"]), 1))}

    vertical = recording.truth["vertical"]
    source = Source(recording.path, "rocking", [])
    scores = list(start_scores(source, recording, vertical, 3, [Contender("stubborn", estimate, {})]))
    for score, first in zip(scores, seen, strict=True):
        row = round(score.instant / PERIOD)
        assert np.allclose(first, recording.accel[row], atol=0)
        angles = np.degrees(np.arccos(np.clip(vertical[row : row + 2000] @ vertical[row], -1, 1)))
        known = np.isfinite(angles)
        early, late = angles[:1000][known[:1000]], angles[1000:][known[1000:]]
        # arccos loses half the digits near 0, and rounding of the time puts the row at 10 s to either part.
        assert score.first_rmse_deg == pytest.approx(np.sqrt(np.mean(early**2)), abs=0.05)
        assert score.later_rmse_deg == pytest.approx(np.sqrt(np.mean(late**2)), abs=0.05)
        assert score.later_max_deg == pytest.approx(late.max(), abs=1e-3)
        assert score.later_near == pytest.approx(np.mean(late < 2), abs=0.002)
    (section,) = start_tables(scores)
    assert section.table and section.table.columns[1:] == ["stubborn"] and len(section.table.rows) == 6


def test_the_benchmark_begins_there_when_asked(recording: Recording) -> None:
    folder = recording.path.parent
    headings = [section.heading for section in tables(benchmark(folder, ["plumb"], starts=2))]
    assert any("start inside a motion, mean of 2" in heading for heading in headings)
    assert not benchmark(folder, ["plumb"]).starts
