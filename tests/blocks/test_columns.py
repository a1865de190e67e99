"""Values over time as tables, datasets, figures and pages: nothing lost, every unit told."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from imufmu import Replay, Result, lee2012, read_recording, run
from imufmu.blocks.running import Trajectory
from imufmu.files.csv_table import write_csv
from support.optional import needs


@pytest.fixture
def trajectory() -> Trajectory:
    """A scalar, a vector and a matrix with known values over four rows."""
    values = {"roll": np.arange(4) / 10, "gyro": np.arange(12.0).reshape(4, 3), "P": np.arange(24.0).reshape(4, 3, 2)}
    return Trajectory(0.5 + np.arange(4) * 0.01, values, {"roll": "rad", "gyro": "rad/s", "P": None})


@pytest.fixture
def result() -> Result:
    """A vector, half a vector, an integer; one column without a unit."""
    columns = {f"imu.gyro[{i}]": np.arange(3.0) + i for i in (1, 2, 3)}
    columns |= {"imu.part[2]": np.ones(3), "imu.n": np.arange(3, dtype=np.int32)}
    units = {name: "rad/s" if "gyro" in name else None for name in columns}
    return Result("bench", np.arange(3) * 0.1, columns, units, ("a note",), "3 of 9 rows: it ended")


@needs("pandas")
def test_a_frame_has_every_column_over_time_with_its_unit(trajectory: Trajectory, result: Result) -> None:
    frame = trajectory.to_pandas()
    assert frame.index.name == "time"
    assert frame.index.tolist() == trajectory.time.tolist()
    assert frame["gyro[2]"].tolist() == trajectory["gyro"][:, 1].tolist()
    assert frame["P[3,2]"].tolist() == trajectory["P"][:, 2, 1].tolist()
    assert frame.attrs["units"] == {"roll": "rad", **{f"gyro[{i}]": "rad/s" for i in (1, 2, 3)}}
    frame = result.to_pandas()
    assert list(frame.columns) == result.names
    assert frame["imu.n"].dtype == np.int32
    assert frame.attrs["title"] == "bench"
    assert frame.attrs["notes"] == ["a note"]
    assert frame.attrs["partial"].startswith("3 of 9")


@needs("xarray")
def test_a_dataset_has_vectors_and_matrices_as_arrays_with_units(trajectory: Trajectory, result: Result) -> None:
    dataset = trajectory.to_xarray()
    assert dataset["gyro"].dims == ("time", "element_3")
    assert dataset["P"].dims == ("time", "row_3", "column_2")
    assert dataset["gyro"].attrs == {"units": "rad/s"}
    assert dataset["time"].attrs == {"units": "s"}
    assert dataset["P"].attrs == {}
    np.testing.assert_array_equal(dataset["P"], trajectory["P"])
    assert dataset["roll"].sel(time=0.51, method="nearest") == 0.1
    dataset = result.to_xarray()
    assert set(dataset) == {"imu.gyro", "imu.part[2]", "imu.n"}
    assert dataset.attrs["notes"] == ["a note"]


def test_a_figure_has_a_panel_per_unit_and_a_line_per_element(trajectory: Trajectory) -> None:
    figure = trajectory.plot("roll", "gyro", "P[1,2]")
    labels = [[line.get_label() for line in axis.lines] for axis in figure.axes]
    assert labels == [["roll"], ["gyro[1]", "gyro[2]", "gyro[3]"], ["P[1,2]"]]
    assert [axis.get_ylabel() for axis in figure.axes] == ["roll (deg)", "(deg/s)", "P[1,2]"]
    assert figure.axes[-1].get_xlabel() == "time (s)"
    np.testing.assert_array_equal(figure.axes[0].lines[0].get_ydata(), np.rad2deg(trajectory["roll"]))
    assert all(axis.get_legend() for axis in figure.axes)
    assert figure._repr_png_().startswith(b"\x89PNG")


def test_what_is_not_there_cannot_be_drawn_and_near_names_are_told(trajectory: Trajectory, result: Result) -> None:
    with pytest.raises(KeyError, match=r"'gyr' is not there\. Near: gyro"):
        trajectory.plot("gyr")
    with pytest.raises(KeyError, match=r"name what to draw, such as 'imu\.gyro', 'imu\.part\[2\]'"):
        result.plot()


def test_a_notebook_shows_a_short_table_in_which_nothing_is_markup(result: Result) -> None:
    page = result._repr_html_()
    assert "&lt;Result of &#x27;bench&#x27;" in page
    assert "<td>imu.gyro</td><td>rad/s</td><td>3</td><td>1</td><td>5</td>" in page
    assert "3 of 9 rows: it ended" in page
    many = Result("<b>", np.arange(2.0), {f"a.x{i}": np.full(2, np.nan) for i in range(40)}, {})
    page = many._repr_html_()
    assert page.count("<tr>") < 20
    assert "28 more" in page
    assert "<b>" not in page


def test_what_is_empty_is_shown_too() -> None:
    assert "<table>" in Trajectory(np.empty(0), {"gyro": np.empty((0, 3))})._repr_html_()


@pytest.mark.parametrize("package", ["pandas", "xarray"])
def test_a_missing_package_is_told_in_one_sentence(
    package: str, trajectory: Trajectory, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, package, None)  # as if it were not installed
    with pytest.raises(ImportError, match=rf'to_{package} needs {package}, .*: pip install "imufmu\[notebook\]"'):
        getattr(trajectory, f"to_{package}")()


@needs("pandas")
def test_a_replay_is_a_table_too(tmp_path: Path) -> None:
    """Over the rows of its recording, which need not begin at 0."""
    time = 7.0 + np.arange(50) * 0.01
    write_csv(tmp_path / "walk.csv", {"time": time, "gyro": np.zeros((50, 3)), "accel": np.tile([0, 0, 9.8], (50, 1))})
    recording = read_recording(tmp_path / "walk.csv")
    columns = {"roll": np.arange(50.0), **{f"vertical[{i}]": np.full(50, i) for i in (1, 2, 3)}}
    replayed = Replay(recording, "lee2012", columns, {name: "rad" if name == "roll" else "1" for name in columns}, ())
    frame = replayed.to_pandas()
    assert frame.index.tolist() == recording.time.tolist()
    assert frame.attrs["units"]["roll"] == "rad"
    assert [line.get_label() for line in replayed.plot("vertical").axes[0].lines] == [
        f"vertical[{i}]" for i in (1, 2, 3)
    ]
    assert "<table>" in replayed._repr_html_()


def test_a_run_of_a_block_knows_its_units() -> None:
    still = {"gyro": np.zeros((5, 3)), "accel": np.tile([0, 0, 9.81], (5, 1))}
    ran = run(lee2012, still)
    assert ran.units["roll"] == "rad"
    assert ran.units["external_acceleration"] == "m/s2"
    assert set(ran.units) == set(ran.values)
