"""Claims about the figures and the report of a run, by what they hold."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure

from imufmu import Result
from imufmu.pictures.bodies import body_of
from imufmu.pictures.figures import acceleration_figure, direction_figure, error_figure
from imufmu.pictures.motion_figures import POSTURES, enlargement, lively, path_figure, stick_figure
from imufmu.plants.handheld import BLOCK as HANDHELD
from imufmu.plants.pendulum import DOUBLE_PENDULUM, PENDULUM
from imufmu.reports.present import present_run
from imufmu.reports.tables import run_table
from imufmu.scoring.systems import comparisons
from support.drawn_runs import result_of, without

BOTH = ("lee2012", "plumb")


@pytest.fixture(scope="module")
def swing() -> Result:
    return result_of(DOUBLE_PENDULUM, 6.0, estimators=BOTH, motion=1, drive_rest=0.5, drive_duration=5.0, heading=0.3)


def labels(figure: Figure) -> list[str]:
    return [text.get_text() for legend in figure.legends for text in legend.get_texts()]


def lines(figure: Figure, label: str) -> list[np.ndarray]:
    return [np.asarray(line.get_xydata()) for axis in figure.axes for line in axis.lines if line.get_label() == label]


# The motion


def test_the_stick_figure_is_the_skeleton_from_the_side_at_equal_times(swing: Result) -> None:
    body = body_of(swing)
    axis = stick_figure(body).axes[0]
    drawn = [np.asarray(line.get_xydata()) for line in axis.lines if len(line.get_xydata()) == 3]
    rows = lively(body)[np.linspace(0, len(lively(body)) - 1, POSTURES).round().astype(int)]
    expected = np.stack([body.skeleton[rows] @ body.side, body.skeleton[rows][:, :, 2]], axis=-1)
    assert np.allclose(drawn, expected, rtol=0, atol=1e-12)  # the same products
    assert axis.get_aspect() == 1.0
    assert axis.get_xlabel() == "horizontal, 17 deg from East towards North (m)" and axis.get_ylabel() == "up (m)"


def test_a_plane_just_south_of_east_is_0_deg_from_it() -> None:
    body = body_of(result_of(PENDULUM, 1.0, heading=-0.002))
    assert stick_figure(body).axes[0].get_xlabel().startswith("horizontal, 0 deg from East")  # no -0


def test_what_is_drawn_of_a_swing_holds_its_fastest_instant(swing: Result) -> None:
    body = body_of(swing)
    speed = np.linalg.norm(np.diff(body.points, axis=0), axis=2).max(axis=1)
    rows = lively(body)
    assert rows[0] <= speed.argmax() <= rows[-1]
    gone = speed[rows[0] : rows[-1]].sum()
    assert body.size <= gone < 1.1 * body.size  # a row or two more than one size


def test_a_body_at_rest_is_drawn_once() -> None:
    body = body_of(result_of(PENDULUM, 0.5, motion=1))
    assert len(lively(body)) == 1
    assert {len(bones) for bones in lines(stick_figure(body), "body")} == {2}


def test_the_path_of_a_traveller_is_seen_from_above_in_the_colours_of_time() -> None:
    drifting = {"bursts": 1, "burst_stop": (1.5, 0.0, 0.0, 0.0), "acceleration_mean": 10.0}
    body = body_of(result_of(HANDHELD, 10.0, **drifting))
    axis = path_figure(body).axes[0]
    (path,) = (c for c in axis.collections if isinstance(c, LineCollection))
    ends = np.array(path.get_segments())[:, 1]
    assert np.allclose(ends, body.position[1:, :2], rtol=0, atol=1e-12)
    assert (axis.get_xlabel(), axis.get_ylabel()) == ("East (m)", "North (m)")
    (drawn,) = (line[0] - body.position[-1, :2] for line in map(np.asarray, lines(path_figure(body), "body")))
    assert enlargement(body) > 1
    offset = (body.skeleton[-1, 0] - body.position[-1])[:2]
    assert drawn == pytest.approx(enlargement(body) * offset, abs=1e-12)


def test_a_plant_without_skeleton_is_a_path_with_the_sensors_axes(swing: Result) -> None:
    figure = path_figure(body_of(without(swing, "skeleton")))
    assert {"sensor's x axis", "sensor's y axis", "sensor's z axis"} <= set(labels(figure))
    assert "body" not in labels(figure)


# Truth, estimates, errors


def test_panels_show_the_truth_and_every_estimator(swing: Result) -> None:
    compared = comparisons(swing)
    estimates = {c.component: c.estimate for c in compared}
    figure = direction_figure(compared[0].truth, estimates)
    assert [axis.get_ylabel() for axis in figure.axes] == ["roll (deg)", "pitch (deg)", "yaw (deg)"]
    assert labels(figure) == ["truth", *BOTH]
    assert np.array_equal(lines(figure, "plumb")[0][:, 1], np.rad2deg(estimates["plumb"]["roll"]))
    figure = acceleration_figure(compared[0].truth, estimates)
    for k, curve in enumerate(lines(figure, "lee2012")):
        assert np.array_equal(curve[:, 1], swing["lee2012.external_acceleration"][:, k])
    assert [axis.get_ylabel() for axis in figure.axes] == ["x (m/s²)", "y (m/s²)", "z (m/s²)"]


def test_a_sensor_that_hangs_at_the_singularity_is_shown_by_its_up_vector() -> None:
    result = result_of(PENDULUM, 1.0, mount=(0, np.pi / 2, np.pi / 2), initial_angle=0.3)
    compared = comparisons(result)
    figure = direction_figure(compared[0].truth, {"lee2012": compared[0].estimate})
    assert [axis.get_ylabel() for axis in figure.axes] == [f"up vector, {k} (1)" for k in "xyz"]
    assert np.array_equal(lines(figure, "truth")[1][:, 1], result["plant.vertical"][:, 1])


def test_errors_have_the_estimators_own_sigma_as_a_band(swing: Result) -> None:
    compared = comparisons(swing)
    figure = error_figure({c.component: c.estimate for c in compared}, {c.component: c.errors for c in compared})
    assert [axis.get_ylabel().splitlines()[0] for axis in figure.axes] == ["tilt error (deg)"] * 2 + ["heading error"]
    for axis, c in zip(figure.axes, compared, strict=False):
        (band,) = (collection for collection in axis.collections if isinstance(collection, PolyCollection))
        sigma = np.rad2deg(c.estimate["tilt_std"])
        assert band.get_paths()[0].vertices[:, 1].max() == pytest.approx(sigma.max())
        assert np.array_equal(axis.lines[0].get_ydata(), np.rad2deg(c.errors["tilt"]))


def test_delay_is_the_time_from_a_sample_to_its_row(swing: Result) -> None:
    late = dict(swing.columns)
    for name, values in swing.columns.items():
        if name.startswith("plumb."):
            late[name] = np.concatenate([values[:1], values[:1], values[:-2]])  # two rows of 10 ms late
    delays = {c.component: c.delay for c in comparisons(Result("late", swing.time, late, swing.units))}
    assert delays["lee2012"] == 0
    # All but the first sample, which is there at once.
    assert delays["plumb"] == pytest.approx(0.02, rel=0.01)
    table = run_table(comparisons(swing))
    assert table.columns[-2:] == ["tilt 95th percentile (deg)", "delay (ms)"]
    assert [row[0] for row in table.rows] == list(BOTH)
    assert [row[-1] for row in table.rows] == ["0.000", "0.000"]


# The page


def headings(page: Path) -> list[str]:
    return re.findall(r"<h2>(.*?)</h2>", page.read_text())


def test_the_report_goes_from_the_motion_to_the_errors(swing: Result, tmp_path: Path) -> None:
    present_run(swing, report=tmp_path / "r.html")
    assert headings(tmp_path / "r.html") == [
        "Errors and delay",
        "Motion",
        "Truth and estimates",
        "Errors over time",
        "External acceleration",
    ]
    page = (tmp_path / "r.html").read_text()
    assert page.count("data:image/png;base64,") == 4
    assert "<script" not in page and 'src="http' not in page


def test_the_report_of_a_traveller_has_its_path_and_its_fastest_movement(tmp_path: Path) -> None:
    present_run(result_of(HANDHELD, 10.0), report=tmp_path / "r.html")
    page = (tmp_path / "r.html").read_text()
    assert page.index("<h2>Motion") < page.index("<h3>Fastest movement") < page.index("<h2>Truth and estimates")
    assert page.count("data:image/png;base64,") == 5


def test_the_report_of_a_plant_without_position_leaves_the_motion_out(swing: Result, tmp_path: Path) -> None:
    present_run(without(swing, "position"), report=tmp_path / "r.html")
    assert "Motion" not in headings(tmp_path / "r.html")
    assert "External acceleration" in headings(tmp_path / "r.html")
