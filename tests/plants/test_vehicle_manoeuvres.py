"""Each manoeuvre of the car does what its standard says, and its truth is one motion."""

from __future__ import annotations

import numpy as np
import pytest

from imufmu.blocks.running import Trajectory
from imufmu.blocks.vocabulary import GRAVITY, MID_EUROPE
from imufmu.papers.motions import parameter_set
from imufmu.plants.vehicle.driver import BRAKING, CIRCLE, HILL_START, LANE_CHANGE, OPEN, ROUNDABOUT, SLALOM, STEP_STEER
from support.cars import CARS, drive
from support.truth_consistency import assert_truth_consistent

LEVER = {"imu_position": (0.8, -0.4, 0.6), "mount": (0.2, -0.3, 2.0)}
FROM_REST = {"initial_speed": 0.0, "start_time": 0.5}
WIDTH, WHEELBASE = 1.61, 2.579  # m, of the default car


def corners(run: Trajectory) -> np.ndarray:
    """The four corners (n, 4, 2) of the car's floor, seen from above: the first points of its outline."""
    return run["skeleton"][:, [0, 3, 6, 9], :2]


# Truth

EVERY_MANOEUVRE = {
    "inputs": {"manoeuvre": OPEN, "initial_speed": 10.0},
    "circle": {"manoeuvre": CIRCLE, "path_start": 5.0},
    "step steer": {"manoeuvre": STEP_STEER},
    "lane change": {"manoeuvre": LANE_CHANGE, "path_start": 0.0},
    "braking": {"manoeuvre": BRAKING, "brake_time": 0.5, "deceleration": 4.0},
    "slalom": {"manoeuvre": SLALOM, "path_start": 0.0, "initial_speed": 15.0, "final_speed": 15.0},
    "roundabout": {"manoeuvre": ROUNDABOUT, "path_start": 5.0, "initial_speed": 8.0, "final_speed": 8.0},
    "hill start": {"manoeuvre": HILL_START, "road_grade": 0.2, **FROM_REST},
}


@pytest.mark.parametrize("name", EVERY_MANOEUVRE)
def test_truth_is_one_motion_in_every_manoeuvre(name: str) -> None:
    """Sensor off the centre of mass and turned, on a road that begins to climb and to bank."""
    slope = {"grade": 0.1, "bank": -0.08, "steering_wheel_angle": 0.1, "drive_force": 200.0}
    run = drive(3.0, slope, step=0.002, **LEVER, **EVERY_MANOEUVRE[name])
    assert np.linalg.norm(run["velocity"], axis=1).max() > 1.0
    # The spline meets jumps of the road's third and the pedals' first derivatives at the start.
    assert_truth_consistent(run, GRAVITY, np.array(MID_EUROPE), tolerance=2e-6)


@pytest.mark.parametrize("name", EVERY_MANOEUVRE)
def test_a_manoeuvre_does_not_depend_on_the_communication_step(name: str) -> None:
    fine, coarse = (drive(3.0, step=step, **EVERY_MANOEUVRE[name]) for step in (0.01, 0.1))
    for signal in ("q_NS", "position", "velocity", "angular_velocity", "specific_force", "forward_speed"):
        # Solver steps of 1 ms at the same instants, to rounding of their times.
        assert fine[signal][::10] == pytest.approx(coarse[signal], abs=1e-9), signal


def test_the_road_carries_the_car_up_and_tilts_it() -> None:
    grade, bank = 0.12, 0.07
    run = drive(6.0, {"grade": grade, "bank": bank}, manoeuvre=HILL_START, initial_speed=20.0, final_speed=20.0)
    assert run["road"][-1] == pytest.approx([grade, bank], abs=1e-9)
    v_N = run["velocity"][-1]
    assert np.arcsin(v_N[2] / np.linalg.norm(v_N)) == pytest.approx(grade, abs=2e-3)  # the car crabs on the bank
    # ISO 8855: nose up is negative pitch, a lower right side is positive roll; the body's springs add their part.
    # To the product of the slopes and the body's pitch of 1e-3 rad.
    assert run["pitch"][-1] - run["body_pitch"][-1] == pytest.approx(-grade, abs=1e-4)
    assert run["roll"][-1] - run["body_roll"][-1] == pytest.approx(bank, abs=1e-4)
    assert run["body_roll"][-1] > 0.005  # gravity pulls the body to the lower side


def test_a_jump_of_the_road_does_not_jump_the_truth() -> None:
    """Grade and bank that a host lets jump: the ideal IMU stays continuous from millisecond to millisecond."""
    n = 2000
    jump = np.where(np.arange(n + 1) * 1e-3 < 1.0, 0.0, 0.2)
    run = drive(2.0, {"grade": jump, "bank": jump}, step=1e-3, **LEVER, manoeuvre=HILL_START)
    assert np.abs(np.diff(run["angular_velocity"], axis=0)).max() < 0.02  # rad/s: 0.2 rad / (0.1 s)^2 times 1 ms
    assert np.abs(np.diff(run["specific_force"], axis=0)).max() < 0.5  # m/s2, of 20 m/s on a road that turns


def test_heading_turns_the_whole_manoeuvre() -> None:
    straight, turned = (drive(4.0, manoeuvre=LANE_CHANGE, heading=heading) for heading in (0.0, 2.0))
    c, s = np.cos(2.0), np.sin(2.0)
    expected = straight["position"] @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    assert turned["position"] == pytest.approx(expected, abs=1e-9)
    assert turned["specific_force"] == pytest.approx(straight["specific_force"], abs=1e-8)


# What the standards say


def test_the_circle_keeps_its_radius_while_the_speed_rises() -> None:
    """ISO 4138, constant radius: 100 m, lateral acceleration from 1 to 6 m/s2."""
    speeds = {"initial_speed": 10.0, "final_speed": 25.0, "speed_rate": 0.3, "circle_radius": 100.0}
    run = drive(60.0, step=0.05, manoeuvre=CIRCLE, **speeds)
    turning = run.time > 6
    assert np.abs(run["path_error"][turning]).max() < 0.3  # m: the driver corrects, and has no integral
    assert run["lateral_acceleration"][turning].min() < 1.5
    assert run["lateral_acceleration"][-1] > 6.0


def test_the_step_of_the_steering_wheel_is_as_fast_as_the_standard_asks() -> None:
    """ISO 7401: at 80 km/h to 4 m/s2, the wheel from 10 to 90 % within 0.15 s; the car follows and turns steadily."""
    run = drive(5.0, step=0.002, manoeuvre=STEP_STEER, step_time=1.0)
    angle, rate = run["steering_angle"] / run["steering_angle"][-1], run["yaw_rate"] / run["yaw_rate"][-1]

    def first(over: np.ndarray, level: float) -> float:
        return float(run.time[np.argmax(over >= level)])

    assert first(angle, 0.9) - first(angle, 0.1) < 0.15
    # From half of the step to 90 % of the yaw rate: the linear car's mode at 80 km/h is some 7 rad/s.
    assert 0.05 < first(rate, 0.9) - first(angle, 0.5) < 0.3
    assert run["lateral_acceleration"][-1] == pytest.approx(4.0, abs=0.2)  # step_angle is a round 20 deg
    assert run["yaw_rate"][(run.time > 4)] == pytest.approx(run["yaw_rate"][-1], rel=1e-3)  # the speed settles


@pytest.mark.parametrize("car", CARS)
def test_the_lane_change_stays_within_the_lanes_at_80_km_h(car: str) -> None:
    """ISO 3888-1: every corner of the car, in every lane; lanes from the standard's table."""
    values = parameter_set(f"vehicle/{car}")
    run = drive(8.0, **values, manoeuvre=LANE_CHANGE, path_start=20.0)
    w = values["width"]
    widths = 1.1 * w + 0.25, 1.2 * w + 0.25, 1.3 * w + 0.25
    right = -widths[0] / 2
    lanes = ((0, 15, right, widths[0]), (45, 70, right + 3.5, widths[1]), (95, 125, right, widths[2]))
    for begin, end, edge, width in lanes:
        x, y = np.moveaxis(corners(run), 2, 0)
        inside = (x >= 20 + begin) & (x <= 20 + end)
        assert y[inside].min() > edge and y[inside].max() < edge + width, (begin, end)
    assert np.abs(run["lateral_acceleration"]).max() > 4.5  # the severe manoeuvre that it is


def test_the_slalom_passes_the_cones_on_alternate_sides() -> None:
    cones, distance, first = 6, 30.0, 50.0
    values = {"cones": cones, "cone_distance": distance, "path_start": first - distance}
    run = drive(18.0, manoeuvre=SLALOM, initial_speed=15.0, final_speed=15.0, **values)
    x, y = np.moveaxis(corners(run), 2, 0)
    assert x[-1].min() > first + cones * distance
    for cone in range(cones):
        at = first + cone * distance
        beside = (x.min(axis=1) <= at) & (x.max(axis=1) >= at)  # rows in which the car is beside the cone
        side = y[beside] if cone % 2 == 0 else -y[beside]
        assert side.min() > 0.2, cone  # m: clear of a cone's foot
    assert abs(y[-1].mean()) < 0.1  # back on the line


def test_the_roundabout_keeps_radius_and_speed_and_leaves() -> None:
    values = {"manoeuvre": ROUNDABOUT, "path_start": 25.0, "final_speed": 8.0, "speed_rate": 2.0, "laps": 2.0}
    run = drive(45.0, step=0.05, **FROM_REST, **values)
    laps = (run.time > 12) & (run.time < 30)
    x, y = run["position"][laps, 0], run["position"][laps, 1]
    # Circle through the points, by least squares: x^2 + y^2 = 2 a x + 2 b y + c.
    a, b, _ = np.linalg.lstsq(np.column_stack([2 * x, 2 * y, np.ones_like(x)]), x**2 + y**2, rcond=None)[0]
    radii = np.hypot(x - a, y - b)
    assert radii.mean() == pytest.approx(15.0, abs=0.1)  # the sensor is ahead of the centre of mass and leans outwards
    assert np.ptp(radii) < 0.2
    assert np.abs(run["path_error"]).max() < 0.4  # at the entry
    assert run["speed"][laps] == pytest.approx(8.0, rel=0.01)  # the drag of the turned wheels over 1/s
    assert run["yaw_rate"][laps].sum() * 0.05 > 2 * np.pi * 1.5
    assert run["yaw"][-1] == pytest.approx(0.0, abs=1e-4)  # whole laps: out in the direction of the entry


def test_the_driver_waits_and_then_drives_the_speed_profile() -> None:
    run = drive(12.0, manoeuvre=HILL_START, initial_speed=0.0, final_speed=10.0, speed_rate=2.0, start_time=3.0)
    assert run["speed"][run.time <= 3.0].max() < 1e-6
    ramp = (run.time > 5.0) & (run.time < 7.9)
    # The driver's correction of 1/s starts late by the time that brake and drive take to change over.
    assert run["speed"][ramp] == pytest.approx(2.0 * (run.time[ramp] - 3.0), abs=0.5)
    assert run["speed"][-1] == pytest.approx(10.0, abs=0.01)  # of 0.3 m/s, 4 s later: exp(-4)


@pytest.mark.parametrize("car", CARS)
@pytest.mark.parametrize("grade", [0.0, 0.15, 0.3])
def test_a_hill_start_does_not_roll_back(car: str, grade: float) -> None:
    values = {"manoeuvre": HILL_START, "road_grade": grade, "final_speed": 5.0, **FROM_REST}
    run = drive(4.0, **parameter_set(f"vehicle/{car}"), **values)
    way = run["position"] @ [np.cos(grade), 0.0, np.sin(grade)]
    assert way[-1] - way[0] > 2.0
    assert (way - way[0]).min() > -1e-3  # m: the springs of tyres and brakes


def test_the_undriven_wheels_tell_the_speed_and_locked_ones_do_not() -> None:
    free, hard, locked = (drive(3.5, manoeuvre=BRAKING, deceleration=d) for d in (0.0, 8.0, 15.0))
    assert free["forward_speed"] == pytest.approx(free["speed"], rel=1e-3)  # the slip of rolling resistance
    steady = (hard.time > 2.0) & (hard["speed"] > 5)
    slip = 1 - hard["forward_speed"][steady] / hard["speed"][steady]
    assert slip == pytest.approx(np.full(steady.sum(), 0.045), abs=0.005)  # as measured
    sliding = (locked.time > 2.0) & (locked["speed"] > 5)
    assert np.abs(locked["forward_speed"][sliding]).max() < 0.5 and sliding.any()


def test_the_wheels_of_a_steered_axle_tell_the_speed_of_the_car() -> None:
    run = drive(12.0, manoeuvre=ROUNDABOUT, initial_speed=5.0, final_speed=5.0)
    v_x = run["speed"] * np.cos(run["side_slip"])
    assert run["steering_angle"][-1] > 0.1
    assert run["forward_speed"] == pytest.approx(v_x, rel=0.01)  # slip angle times steering angle
