"""Claims about the moving picture, by the artists of its frames and the files that hold them."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from imufmu import Result
from imufmu.pictures import animation, movies
from imufmu.pictures.animation import ELEVATION, MOST_FRAMES, RATE, Scene, frame_times
from imufmu.pictures.bodies import body_of
from imufmu.pictures.horizons import chord, horizon, viewing_axes
from imufmu.pictures.movies import check_movie, write_movie
from imufmu.plants.handheld import BLOCK as HANDHELD
from imufmu.plants.human.plant import BLOCK as HUMAN
from imufmu.plants.pendulum import PENDULUM
from imufmu.reports.present import animate
from imufmu.scoring.systems import comparisons
from support.drawn_runs import result_of
from support.optional import needs

AIRCRAFT = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])  # right, up, ahead: x ahead, z up


def up_vector(roll: float, pitch: float) -> np.ndarray:
    return np.array([-np.sin(pitch), np.cos(pitch) * np.sin(roll), np.cos(pitch) * np.cos(roll)])


def scene_of(result: Result) -> Scene:
    return Scene("title", body_of(result), comparisons(result))


# The instrument


def test_the_drawn_horizon_leans_by_the_roll() -> None:
    for roll in np.linspace(-1.5, 1.5, 7):
        left, right = chord(*horizon(up_vector(roll, 0.0), AIRCRAFT))
        # Right wing down (positive roll about the axis ahead): the horizon rises to the right, by the same angle.
        assert np.arctan2(*(right - left)[::-1]) == pytest.approx(roll, abs=1e-12)
        assert left + right == pytest.approx([0, 0], abs=1e-12)  # through the middle: no pitch


def test_a_lowered_nose_sees_the_horizon_above_the_middle() -> None:
    for pitch in (-0.5, 0.2, 1.2):  # positive lowers x
        ends = chord(*horizon(up_vector(0.0, pitch), AIRCRAFT))
        assert ends[:, 1] == pytest.approx([pitch / (np.pi / 2)] * 2, abs=1e-12)
        assert np.linalg.norm(ends, axis=1) == pytest.approx([1, 1], abs=1e-12)


def test_straight_up_and_down_show_sky_or_ground_alone() -> None:
    for pitch, distance in ((-np.pi / 2, -1), (np.pi / 2, 1)):
        assert horizon(up_vector(0.0, pitch), AIRCRAFT)[1] == pytest.approx(distance, abs=1e-7)  # asin near 1


def test_the_picture_looks_along_the_axis_that_stays_level() -> None:
    t = np.linspace(-1.2, 1.2, 50)
    hanging = np.column_stack([-np.cos(t), np.sin(t), np.zeros(50)])
    r, u, f = viewing_axes(hanging)
    assert f.tolist() == [0, 0, 1] and u.tolist() == [-1, 0, 0]
    assert r == pytest.approx(np.cross(f, u))
    swinging = np.column_stack([0.1 * np.sin(t), np.sin(t), np.cos(t)])
    assert viewing_axes(swinging) == pytest.approx(AIRCRAFT)


def test_the_instruments_of_a_scene_show_estimate_and_truth_of_the_instant() -> None:
    result = result_of(PENDULUM, 3.0, estimators=("lee2012", "plumb"))
    scene = scene_of(result)
    scene.show(2.004)  # 2.00 s is the last sample that is not later
    for name, instrument in zip(("lee2012", "plumb"), scene.instruments, strict=True):
        for line, source in ((instrument.line, name), (instrument.truth, "plant")):
            expected = chord(*horizon(result[f"{source}.vertical"][200], instrument.view))
            assert np.allclose(line.get_xydata(), expected, rtol=0, atol=1e-12)
        error = np.degrees(comparisons(result)[name == "plumb"].errors["tilt"][200])
        assert instrument.text.get_text() == f"tilt error {error:.1f} deg"
        ground = instrument.ground.get_xy()
        middle = ground[:-1].mean(axis=0)  # on the side away from up
        up = instrument.view[:2] @ result[f"{name}.vertical"][200]
        assert middle @ up < 0


# The body


def test_bones_and_axes_are_the_projected_skeleton_and_attitude() -> None:
    result = result_of(PENDULUM, 2.0, heading=0.5)
    body, scene = body_of(result), scene_of(result)
    scene.show(1.5)
    right = np.array([np.cos(0.5), np.sin(0.5), 0.0])
    away = np.array([-np.sin(0.5), np.cos(0.5), 0.0])
    up = np.array([0, 0, np.cos(ELEVATION)]) + np.sin(ELEVATION) * away
    seen = (body.skeleton[150] - scene.window.middle) @ np.array([right, up]).T
    assert np.allclose(scene.bones.get_xydata(), seen, rtol=0, atol=1e-9)  # the plane is found from the points
    for k, line in enumerate(scene.axes):
        start, end = np.asarray(line.get_xydata())
        assert (end - start) / (0.15 * scene.window.half) == pytest.approx(
            np.array([right, up]) @ body.axes[150][:, k], abs=1e-9
        )


def test_an_exact_estimate_lies_on_the_true_horizon_and_a_tilted_one_leans_by_its_error() -> None:
    exact = result_of(PENDULUM, 1.0)
    columns = dict(exact.columns)
    for k in (1, 2, 3):
        columns[f"lee2012.vertical[{k}]"] = columns[f"plant.vertical[{k}]"]
    scene = scene_of(Result("exact", exact.time, columns, exact.units))
    scene.show(0.7)
    assert np.ptp(scene.true_horizon.get_ydata()) == 0
    assert np.ptp(scene.horizons[0].get_ydata()) == pytest.approx(0, abs=1e-12)

    # Up vector turned by 0.2 rad within the plane of the swing, about -y of H: it leans forwards, so its horizon falls.
    axes, error = body_of(exact).axes, 0.2
    leaning = np.einsum("nji,j->ni", axes, [np.sin(error), 0.0, np.cos(error)])
    for k in (1, 2, 3):
        columns[f"lee2012.vertical[{k}]"] = leaning[:, k - 1]
    scene = scene_of(Result("leaning", exact.time, columns, exact.units))
    scene.show(0.7)
    (x0, y0), (x1, y1) = scene.horizons[0].get_xydata()
    # Seen from above by ELEVATION, heights are shorter by its cosine.
    assert np.arctan2(y1 - y0, x1 - x0) == pytest.approx(-np.arctan(np.tan(error) / np.cos(ELEVATION)), abs=1e-9)
    assert scene.instruments[0].text.get_text() == "tilt error 11.5 deg"


def test_the_window_stays_with_a_pendulum_and_holds_all_of_it() -> None:
    result = result_of(PENDULUM, 3.0)
    body, scene = body_of(result), scene_of(result)
    middle = scene.window.middle
    for t in (0.0, 1.0, 3.0):
        scene.show(t)
        assert np.array_equal(scene.window.middle, middle)
    seen = (body.points - middle) @ scene.views.T
    assert np.abs(seen[..., 0]).max() < scene.window.half
    assert not len(scene.ground.get_xydata())


def test_a_tall_body_that_stays_stands_above_scale_and_legend() -> None:
    body, scene = body_of(result := result_of(HUMAN, 3.0, activity=2)), scene_of(result)
    seen = (body.points - scene.window.middle) @ scene.views.T
    legend = max(text.get_position()[1] for text in scene.trail.axes.texts)
    assert seen[..., 1].min() > legend + 0.05 * scene.window.half  # the height of its letters


def test_the_window_follows_a_traveller_over_ground_that_stays() -> None:
    result = result_of(HANDHELD, 5.0, acceleration_mean=10.0)
    body, scene = body_of(result), scene_of(result)
    offsets = []
    for row in (0, 250, 500):
        scene.show(body.time[row])
        assert np.array_equal(scene.window.middle, body.position[row])
        ground = scene.window.ground()
        assert np.all(ground[:, 2] == body.skeleton[..., 2].min())
        offsets.append(ground[0, :2] / (scene.window.half / 4))
    assert np.allclose(offsets, np.round(offsets), rtol=0, atol=1e-9)  # dots at the same places in N


def test_many_estimators_have_an_instrument_each_that_none_hides() -> None:
    result = result_of(PENDULUM, 0.2)
    estimate = {name: values for name, values in result.columns.items() if name.startswith("lee2012.")}
    columns = dict(result.columns)
    for i in range(7):
        columns |= {name.replace("lee2012", f"zihajehzadeh201{i}"): values for name, values in estimate.items()}
    scene = scene_of(Result("many", result.time, columns, result.units))
    scene.show(0.1)
    places = [instrument.line.axes.get_position() for instrument in scene.instruments]
    assert len(places) == len(scene.horizons) == 8
    assert all(place.y0 > 0 and place.y1 < 1 and place.x1 <= 1 for place in places)
    for one, other in itertools.combinations(places, 2):
        across = min(one.x1, other.x1) - max(one.x0, other.x0)
        along = min(one.y1, other.y1) - max(one.y0, other.y0)
        assert min(across, along) < 1e-9  # beside or below each other
    FigureCanvasAgg(scene.figure).draw()
    view = scene.trail.axes.get_window_extent()
    names = [instrument.line.axes.title.get_window_extent() for instrument in scene.instruments]
    assert not any(one.overlaps(other) for one, other in itertools.combinations([view, *names], 2))


# The files


def test_frames_are_in_real_time_and_those_of_a_long_run_are_spread_over_it() -> None:
    times, speed = frame_times(np.arange(0, 10.001, 0.01))
    assert speed == 1 and len(times) == 10 * RATE + 1
    assert times[-1] == pytest.approx(10)
    times, speed = frame_times(np.linspace(5, 305, 1000))
    assert len(times) == MOST_FRAMES and (times[0], times[-1]) == (5, 305)
    assert speed == pytest.approx(300 * RATE / (MOST_FRAMES - 1))


def test_a_gif_has_a_frame_for_each_instant_at_the_stated_rate(tmp_path: Path) -> None:
    result, seen = result_of(PENDULUM, 2.0), []
    assert animate(result, tmp_path / "a.gif", lambda done, total: seen.append((done, total))) == []
    with Image.open(tmp_path / "a.gif") as picture:
        assert picture.n_frames == 2 * RATE + 1
        assert picture.size == (640, 480)
        assert picture.info["duration"] == 1000 / RATE
        first = np.asarray(picture.convert("RGB"), dtype=int)
        picture.seek(RATE)
        assert np.abs(np.asarray(picture.convert("RGB"), dtype=int) - first).max() > 100  # it moves
    assert seen[-1] == (41, 41) and len(seen) == 41
    assert [path.name for path in tmp_path.iterdir()] == ["a.gif"]


def test_the_paper_of_a_gif_is_white_however_many_colours_its_palette_has_to_hold(tmp_path: Path) -> None:
    animate(result_of(HUMAN, 0.1, estimators=("lee2012", "plumb")), tmp_path / "a.gif")
    with Image.open(tmp_path / "a.gif") as picture:
        assert np.all(np.asarray(picture.convert("RGB"))[[0, -1]] == 255)


def test_a_long_run_says_how_much_faster_it_is_shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(animation, "MOST_FRAMES", 6)
    (note,) = animate(result_of(PENDULUM, 2.0), tmp_path / "a.gif")
    assert "8 times as fast" in note
    with Image.open(tmp_path / "a.gif") as picture:
        assert picture.n_frames == 6


@pytest.mark.parametrize("suffix", [".gif", pytest.param(".mp4", marks=needs("ffmpeg"))])
def test_ctrl_c_leaves_the_old_file_and_nothing_else(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    path.write_text("old")

    def interrupted() -> object:
        yield
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_movie(path, Figure(figsize=(1, 1)), interrupted(), RATE)
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


@needs("ffmpeg")
def test_an_mp4_is_written_by_ffmpeg(tmp_path: Path) -> None:
    animate(result_of(PENDULUM, 0.5), tmp_path / "a.mp4")
    assert (tmp_path / "a.mp4").read_bytes()[4:8] == b"ftyp"  # the mark of the format


def test_mp4_without_ffmpeg_says_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(movies.FFMpegWriter, "isAvailable", classmethod(lambda cls: False))
    with pytest.raises(ValueError, match=r"install ffmpeg or choose \.gif"):
        check_movie(Path("a.mp4"))


@needs("false")
def test_an_ffmpeg_that_fails_is_one_clear_message_and_leaves_nothing(tmp_path: Path) -> None:
    with (
        rc_context({"animation.ffmpeg_path": "false"}),
        pytest.raises(ValueError, match=r"ffmpeg failed.*choose \.gif"),
    ):
        write_movie(tmp_path / "a.mp4", Figure(figsize=(1, 1)), range(30), RATE)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["a.avi", "a"])
def test_another_suffix_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match=r"use \.gif or \.mp4"):
        check_movie(Path(name))
