"""Claims about the body that is drawn: the skeletons of the plants, and what a result says of them."""

from __future__ import annotations

import numpy as np
import pytest

from imufmu import System, locate
from imufmu.compiled.running import simulate
from imufmu.pictures.bodies import Body, body_of, recorded
from imufmu.plants.handheld import BLOCK as HANDHELD
from imufmu.plants.handheld import BOX
from imufmu.plants.pendulum import DOUBLE_PENDULUM, PENDULUM
from support.drawn_runs import result_of, without

ROUNDING = 1e-14  # m; a few operations on numbers of about 1


def test_the_skeleton_of_a_pendulum_runs_from_the_pivot_through_the_joints_to_the_end() -> None:
    run = simulate(DOUBLE_PENDULUM, 2.0, 0.1, parameters={"heading": 0.6})
    bones = np.diff(run["skeleton"], axis=1)
    assert not run["skeleton"][:, 0].any()
    assert np.linalg.norm(bones, axis=2) == pytest.approx(np.full((21, 2), 0.43), abs=ROUNDING)
    phi = np.cumsum(run["angle"], axis=1)
    for i in range(2):
        expected = 0.43 * np.column_stack(
            [np.cos(0.6) * np.sin(phi[:, i]), np.sin(0.6) * np.sin(phi[:, i]), -np.cos(phi[:, i])]
        )
        assert bones[:, i] == pytest.approx(expected, abs=ROUNDING)


def test_the_sensor_lies_on_the_line_of_its_link() -> None:
    run = simulate(PENDULUM, 2.0, 0.1, parameters={"imu_distance": 0.25})
    assert run["position"] == pytest.approx(0.25 * run["skeleton"][:, 1], abs=ROUNDING)


def test_the_skeleton_of_the_handheld_body_is_a_box_around_the_sensor_that_turns_with_it() -> None:
    result = result_of(HANDHELD, 2.0, imu_position=(0.1, 0.2, -0.1))
    body = body_of(result)
    corners = np.einsum("nji,nkj->nki", body.axes, body.skeleton - body.position[:, None, :])
    assert np.abs(corners) == pytest.approx(np.broadcast_to(np.array(BOX) / 2, corners.shape), abs=ROUNDING)
    steps = {
        tuple(sorted((tuple(a), tuple(b)))) for a, b in zip(np.sign(corners[0]), np.sign(corners[0][1:]), strict=False)
    }
    assert len(steps) == 12  # the line passes every edge, and nothing but edges:
    assert all(sum(x != y for x, y in zip(a, b, strict=True)) == 1 for a, b in steps)


def test_the_columns_of_its_axes_are_the_sensors_axes_in_N() -> None:
    result = result_of(PENDULUM, 1.0, heading=0.4)
    body = body_of(result)
    assert body.axes[:, 2, :] == pytest.approx(result["plant.vertical"], abs=ROUNDING)  # height of each axis


def test_a_pendulum_stays_and_is_seen_across_its_plane() -> None:
    body = body_of(result_of(PENDULUM, 2.0, heading=0.7))
    assert not body.travels
    assert body.size == pytest.approx(1.0, abs=0.02)  # 1 m long; upright its height is all of it
    assert abs(body.side @ [np.cos(0.7), np.sin(0.7), 0.0]) == pytest.approx(1, abs=1e-9)


def test_a_body_is_seen_across_the_direction_in_which_it_moves_and_at_rest_across_its_width() -> None:
    time = np.arange(20.0)
    forward = 0.2 * np.sin(time)[:, None] * [1.0, 0.0, 0.0]
    wide = np.array([[0.0, -0.5, 0.0], [0.0, 0.5, 0.0]])
    nodding = Body(time, forward, None, wide + forward[:, None, :])
    still = Body(time, 0 * forward, None, np.tile(wide, (20, 1, 1)))
    assert nodding.side == pytest.approx([1, 0, 0])
    assert still.side == pytest.approx([0, 1, 0])


def test_a_body_in_a_hand_travels() -> None:
    assert body_of(result_of(HANDHELD, 10.0)).travels


def test_a_plant_without_skeleton_has_a_body_of_its_sensor_alone() -> None:
    body = body_of(without(result_of(PENDULUM, 2.0), "skeleton"))
    assert body.skeleton is None and body.travels
    assert np.array_equal(body.points[:, 0], body.position)
    assert body.size > 0


def test_a_plant_without_position_has_no_body() -> None:
    assert body_of(without(result_of(PENDULUM, 0.5), "position")) is None


def test_what_is_recorded_to_be_drawn_is_every_output_and_the_skeleton() -> None:
    system = System.read(locate("pendulum_lee2012"))
    names = recorded(system)
    outputs = {f"{c}.{v.name}" for c, interface in system.interfaces.items() for v in interface.of("output")}
    points = {f"plant.skeleton[{i},{k}]" for i in (1, 2) for k in (1, 2, 3)}
    assert set(names) == outputs | points
    assert len(names) == len(set(names))
