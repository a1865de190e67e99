"""Claims about finding truth and estimates in a run: what does not fit is a note, never the end of the run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from imufmu import Result
from imufmu.reports.present import present_run
from imufmu.scoring.systems import compare_all, comparisons

N, H = 20, 0.01


def result(**extra: np.ndarray) -> Result:
    """A plant that stands upright and an estimator that is 0.1 rad off; extra: columns, component__variable."""
    time = np.arange(N) * H
    columns = {"plant.roll": np.zeros(N), "est.roll": np.full(N, 0.1), "est.sample_time": time}
    columns |= {f"{c}.vertical[{i}]": np.full(N, float(i == 3)) for c in ("plant", "est") for i in (1, 2, 3)}
    columns |= {name.replace("__", ".").replace("_1", "[1]"): values for name, values in extra.items()}
    return Result("system", time, columns, dict.fromkeys(columns))


def test_what_fits_is_compared() -> None:
    (found,), notes = compare_all(result())
    assert found.summary["roll_rmse_deg"] == pytest.approx(np.rad2deg(0.1)) and notes == []


def test_a_second_truth_is_a_note_and_nothing_is_compared(tmp_path: Path) -> None:
    second = result(other__vertical_1=np.zeros(N))
    found, notes = compare_all(second)
    assert found == [] and comparisons(second) == []
    assert len(notes) == 1 and "plant and other" in notes[0] and "sample_time" in notes[0]
    table, notes, written = present_run(second, tmp_path / "figure.png", tmp_path / "report.html")
    assert table.columns[0] == "variable" and written == [] and list(tmp_path.iterdir()) == []
    assert "no figure and no report" in notes[-1]


def test_vectors_of_unequal_size_are_left_out_with_a_note() -> None:
    run = result(est__q_NS_1=np.ones(N))
    columns = dict(run.columns) | {f"plant.q_NS[{i}]": np.ones(N) for i in (1, 2, 3, 4)}
    (found,), notes = compare_all(Result("system", run.time, columns, dict.fromkeys(columns)))
    assert "roll" in found.errors and "heading" not in found.errors
    assert notes == ["est: q_NS is not compared: it has 1 elements, that of plant 4"]


def test_an_estimator_that_samples_between_the_rows_is_left_out_with_a_note() -> None:
    coarse = result(late__vertical_1=np.zeros(N), late__sample_time=np.arange(N) * H + 0.4 * H)
    found, notes = compare_all(coarse)
    assert [c.component for c in found] == ["est"]
    assert notes[-1].startswith("late is not compared with plant: 20 of 20 estimates have no truth")


def test_an_estimator_without_a_common_signal_is_left_out_with_a_note() -> None:
    run = result()
    columns = {name: values for name, values in run.columns.items() if name not in ("plant.roll", "est.vertical[2]")}
    found, notes = compare_all(Result("system", run.time, columns, dict.fromkeys(columns)))
    assert found == [] and "share no signal" in notes[0]
