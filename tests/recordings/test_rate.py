"""A rate that the user gives stands for times of a file that are of no use."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from imufmu.files.csv_table import write_csv
from imufmu.recordings.reading import RecordingError, read


def still(n: int = 20) -> dict[str, np.ndarray]:
    """Columns of a record at rest, with noise."""
    rng = np.random.default_rng(5)
    names = [f"{sensor}[{axis}]" for sensor in ("gyro", "accel") for axis in (1, 2, 3)]
    columns = {"time": 0.01 * np.arange(n)} | {name: 0.1 * rng.standard_normal(n) for name in names}
    columns["accel[3]"] += 9.81
    return columns


def csv_of(path: Path, columns: dict[str, np.ndarray]) -> Path:
    write_csv(path, columns)
    return path


@pytest.mark.parametrize("stamps", ["0.0 0.0 0.02 0.02 0.04 0.04", "9 8 7 6 5 4", ", , , , , "])
def test_times_that_are_useless_give_way_to_a_rate(tmp_path: Path, stamps: str) -> None:
    """As stamps of a host that gets two samples at once."""
    path = csv_of(tmp_path / "walk.csv", still(6))
    header, *rows = path.read_text().splitlines()
    times = [stamp.strip(",") for stamp in stamps.split(" ")][:6]
    stamped = [",".join([time, *row.split(",")[1:]]) for time, row in zip(times, rows, strict=True)]
    path.write_text("\n".join([header, *stamped]))
    with pytest.raises(RecordingError, match=r"or give the rate \(--rate\)"):
        read(path)
    recording = read(path, rate=100.0)
    assert recording.sample_period == 0.01
    assert np.array_equal(recording.time, np.arange(6) / 100)
    assert np.array_equal(recording.gyro, np.column_stack([still(6)[f"gyro[{i}]"] for i in (1, 2, 3)]))
    assert recording.notes == ("rows are taken for evenly spaced at 100 Hz; times of the file are not used",)
    for rate in (0.0, -1.0, math.nan, 1e9):
        with pytest.raises(RecordingError, match="Hz cannot be"):
            read(path, rate=rate)


def test_with_a_rate_no_times_are_needed(tmp_path: Path) -> None:
    columns = still()
    del columns["time"]
    assert len(read(csv_of(tmp_path / "walk.csv", columns), rate=50.0).time) == 20
    with pytest.raises(RecordingError, match=r"missing: time \(s\)"):
        read(tmp_path / "walk.csv")
