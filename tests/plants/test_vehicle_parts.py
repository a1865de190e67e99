"""Claims about the parts of the car: tyre, load transfer, road, body, outline, courses."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from imufmu.blocks.vocabulary import GRAVITY
from imufmu.plants.vehicle.driver import BRAKING, CIRCLE, HILL_START, OPEN, STEP_STEER, lane_change
from imufmu.plants.vehicle.plant import BLOCK
from imufmu.plants.vehicle.tyre import grip_rate, slip_for
from support.cars import drive

VALUES = {s.name: s.start_values()[0] if s.size == 1 else np.array(s.start_values()) for s in BLOCK.parameters}
P = SimpleNamespace(**{name: ca.DM(value) for name, value in VALUES.items()})


# Tyre


def tyre(velocity: Any, rim: float, grip: Any, stiffness: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Rate of the grip and the grip of the force, each (2,)."""
    found = grip_rate(ca.DM(velocity), ca.DM(rim), ca.DM(grip), ca.DM(stiffness), P)
    rate, damped = (np.array(ca.DM(part)).ravel() for part in found)
    return rate, damped


@pytest.mark.parametrize("slip", [(0.01, 0.0), (0.0, -0.05), (0.1, 0.1), (-0.4, 0.3)])
def test_a_rolling_tyre_settles_on_the_magic_formula_of_the_combined_slip(slip: tuple[float, float]) -> None:
    c, C, speed = np.array([19.0, 21.0]), VALUES["tyre_shape"], 20.0
    # Transport velocity (|v| + rim) / 2 for a rim and a contact velocity with this slip.
    rim, across = speed, -slip[1] * speed
    along = rim - slip[0] * speed
    V = (np.hypot(along, across) + rim) / 2
    rho = c * [rim - along, -across] / V
    size = np.linalg.norm(rho)
    expected = np.sin(C * np.arctan(size / C)) * rho / size
    rate, damped = tyre((along, across), rim, expected, tuple(c))
    assert rate == pytest.approx([0, 0], abs=1e-9)  # 1/s, rounding of 20 m/s over 0.3 m
    assert damped == pytest.approx(expected, abs=1e-12)


def test_a_tyre_builds_up_its_force_over_its_relaxation_length() -> None:
    """From no grip at 20 m/s and a small slip: rate c s V / (sigma + V T_w), T_w = 1 ms."""
    speed, slip = 20.0, 1e-4
    rate, _ = tyre((speed, -slip * speed), speed, (0.0, 0.0), (19.0, 21.0))
    expected = 21.0 * slip * speed / (VALUES["relaxation_length"] + speed * 1e-3)
    assert rate[1] == pytest.approx(expected, rel=1e-5)  # (c s)^2 / 3 and more of saturation


def test_the_grip_of_a_slip_and_the_slip_of_a_grip_are_inverse() -> None:
    for grip in (-0.9, -0.1, 0.3, 0.99):
        slip = float(slip_for(ca.DM(grip), P))
        rim = 20.0 * (1 + slip / 2) / (1 - slip / 2)
        rate, _ = tyre((20.0, 0.0), rim, (grip, 0.0), (VALUES["longitudinal_stiffness"], 20.9))
        assert rate == pytest.approx([0, 0], abs=1e-9)


def test_a_standing_tyre_is_a_spring_and_does_not_forget() -> None:
    rate, damped = tyre((0.0, 0.0), 0.0, (0.3, -0.2), (19.0, 21.0))
    assert np.abs(rate).max() < 1e-90 and damped.tolist() == [0.3, -0.2]  # the guard against 0 / 0


def test_sideways_slip_takes_from_the_grip_along_the_wheel_and_the_other_way_round() -> None:
    """Combined slip: the force points along c times the slip, and both parts together have the size of one alone."""
    c, C = np.array([19.0, 21.0]), VALUES["tyre_shape"]

    def settled(along: float, across: float) -> np.ndarray:
        """Grip of a tyre that has rolled at this slip for long: 8 m along a road, 25 times its relaxation length."""
        rim, grip = 20.0, np.zeros(2)
        for _ in range(200):
            grip = grip + 2e-3 * tyre((rim - along * rim, -across * rim), rim, grip, tuple(c))[0]
        return grip

    alone, both = settled(0.06, 0.0), settled(0.06, 0.08)
    assert both[0] < 0.75 * alone[0]
    assert both[1] / both[0] == pytest.approx(c[1] * 0.08 / (c[0] * 0.06), rel=1e-6)
    V = (np.hypot(20.0 * 0.94, 20.0 * 0.08) + 20.0) / 2  # (3)
    rho = np.linalg.norm(c * [0.06, 0.08]) * 20.0 / V
    assert np.linalg.norm(both) == pytest.approx(np.sin(C * np.arctan(rho / C)), rel=1e-6)


@pytest.mark.parametrize("speed", [0.0, 0.5, 2.0])
def test_a_damper_quiets_a_slow_tyre_and_fades_with_speed(speed: float) -> None:
    """(4), at first order of the slip: 20 ms of the rate at rest, a fifth of that at 2 m/s."""
    slow = 1e-4 * np.array([1.0, -2.0])
    rate, damped = tyre((speed - slow[0], -slow[1]), speed, (0.1, 0.2), (19.0, 21.0))
    assert damped - [0.1, 0.2] == pytest.approx(rate * 0.02 / (1 + speed**2), rel=1e-3)  # V is speed to 1e-4
    assert np.abs(rate).min() > 1e-3


def test_no_grip_leaves_the_friction_circle_and_the_rate_is_bounded() -> None:
    """At any velocity, from any grip inside; c V / sigma would be some 5000 / s with locked wheels at 70 m/s."""
    rng = np.random.default_rng(2)
    for speed in (1e-3, 0.1, 1.0, 70.0):
        for _ in range(50):
            grip = rng.uniform(-0.7, 0.7, 2)
            rate, damped = tyre(rng.uniform(-speed, speed, 2), rng.uniform(-speed, speed), grip, (19.0, 21.0))
            assert np.linalg.norm(damped) <= 1 + 1e-12
            outward = rate @ grip / np.linalg.norm(grip)
            assert outward < 1e3 * (1 - np.linalg.norm(grip)) + 1e-9  # 1 / T_w: at the circle no way out
            assert np.abs(rate).max() < 2e3


@pytest.mark.parametrize("roll_axis", [0.0, 0.4])
def test_friction_falls_with_the_load_that_a_turn_moves(roll_axis: float) -> None:
    """(5), (6) by hand; the moved load is that of the whole body's roll moment, however high its axis is."""
    k = 0.2
    values = {"load_sensitivity": k, "roll_axis_height": roll_axis, "initial_speed": 25.0, "final_speed": 25.0}
    run = drive(15.0, manoeuvre=CIRCLE, **values)
    load, friction, across = (run[name][-1] for name in ("axle_load", "friction_force", "lateral_force"))
    mu, nominal = VALUES["friction"], VALUES["mass"] * GRAVITY / 4
    share = np.array([VALUES["front_roll_share"], 1 - VALUES["front_roll_share"]])
    springs = share * VALUES["roll_stiffness"] * run["body_roll"][-1]
    moved = (springs + roll_axis * mu * load * across / friction) / VALUES["track"]
    expected = mu * load * (1 - k * ((load / 2 + 2 * moved**2 / load) / nominal - 1))
    assert moved.min() > 500
    assert friction == pytest.approx(expected, rel=1e-4)  # the last of the damper's moment
    # The springs carry the body's moment about the roll axis.
    swing = VALUES["body_mass"] * (VALUES["body_com_height"] - roll_axis)
    lean = swing * GRAVITY * run["body_roll"][-1]
    assert springs.sum() == pytest.approx(swing * run["lateral_acceleration"][-1] + lean, rel=1e-3)  # sin(phi) for phi


# Steering


@pytest.mark.parametrize("front_drive", [0.0, 1.0])
def test_a_slow_car_turns_about_the_point_where_its_axles_meet(front_drive: float) -> None:
    """r = v tan(delta) / L, at the rear axle, which does not slip."""
    n = 800
    wheel = 8.0 * np.clip(np.arange(n + 1) * 0.01, 0, 2) / 2
    values = {"initial_speed": 1.5, "rolling_resistance": 0.0, "front_drive_share": front_drive}
    run = drive(8.0, {"steering_wheel_angle": wheel}, manoeuvre=OPEN, **values)
    delta = run["steering_angle"][-1]
    v_x = run["speed"][-1] * np.cos(run["side_slip"][-1])
    L = VALUES["front_distance"] + VALUES["rear_distance"]
    assert delta == pytest.approx(0.5, abs=1e-6)
    assert run["yaw_rate"][-1] == pytest.approx(v_x * np.tan(delta) / L, rel=5e-3)  # slip of 0.6 m/s2


def test_drive_at_steered_wheels_pulls_the_car_into_the_turn() -> None:
    """Newton for the planar car with a strong front drive: yaw moment and sideways force of the turned drive force."""
    values = {"initial_speed": 8.0, "front_drive_share": 1.0, "imu_position": 0.0}
    pull = {"steering_wheel_angle": 4.0, "drive_force": 3000.0}
    run = drive(3.0, pull, step=0.002, manoeuvre=OPEN, **values)
    delta = run["steering_angle"]
    front_x = run["longitudinal_force"][:, 0]
    front_y, rear_y = run["lateral_force"].T
    sideways = np.sin(delta) * front_x + np.cos(delta) * front_y
    moment = VALUES["front_distance"] * sideways - VALUES["rear_distance"] * rear_y
    rate = np.gradient(run["yaw_rate"], run.time)
    assert np.abs(np.sin(delta) * front_x).max() > 500
    middle = slice(5, -5)  # one-sided differences at the ends
    # Differences of 2 ms of a motion that changes within 0.1 s.
    assert rate[middle] * VALUES["yaw_inertia"] == pytest.approx(moment[middle], abs=2e-3 * np.abs(moment).max())


# Road and body


def test_a_step_of_the_grade_comes_through_three_lags() -> None:
    tau, to = 0.2, 0.15
    run = drive(2.0, {"grade": to}, manoeuvre=OPEN, initial_speed=0.0, road_time=tau)
    s = run.time / tau
    # RK4 at 1 ms, a two-hundredth of tau.
    assert run["road"][:, 0] == pytest.approx(to * (1 - np.exp(-s) * (1 + s + s**2 / 2)), abs=1e-9)


def test_a_step_of_the_steering_wheel_comes_through_two_lags() -> None:
    tau = VALUES["steering_time"]
    run = drive(0.5, {"steering_wheel_angle": 1.6}, step=1e-3, manoeuvre=OPEN, initial_speed=0.0)
    s = run.time / tau
    # RK4 at 1 ms, a thirtieth of tau: (1 / 30)^4 / 120 and less.
    assert run["steering_angle"] == pytest.approx(0.1 * (1 - np.exp(-s) * (1 + s)), abs=1e-8)


@pytest.mark.parametrize("manoeuvre", [STEP_STEER, BRAKING])
def test_roll_and_pitch_swing_by_their_inertia(manoeuvre: int) -> None:
    """(2) and (3) with the second derivatives of the reported angles, on a level road."""
    h = 1e-3
    run = drive(2.5, step=h, manoeuvre=manoeuvre, step_angle=0.5, g=9.81)
    rows = slice(5, -5)  # one-sided differences at the ends
    across, along = run["lateral_acceleration"][rows], run["longitudinal_acceleration"][rows]
    swing = VALUES["body_mass"] * VALUES["body_com_height"]
    for name, pulled in (("roll", swing * across), ("pitch", -swing * along)):
        angle = run[f"body_{name}"]
        rate = np.gradient(angle, h)
        acceleration = np.gradient(rate, h)[rows]
        inertia = VALUES[f"{name}_inertia"] + swing * VALUES["body_com_height"]
        springs = VALUES[f"{name}_stiffness"] * angle[rows] + VALUES[f"{name}_damping"] * rate[rows]
        moment = pulled + swing * 9.81 * np.sin(angle[rows]) - springs
        # Differences of 1 ms of a swing of 20 rad/s.
        assert inertia * acceleration == pytest.approx(moment, abs=1e-3 * max(np.abs(springs).max(), 100.0))


def test_yaw_rate_is_the_turn_about_the_normal_of_the_road() -> None:
    """While grade and bank change in a turn: projected from the ideal gyroscope."""
    n = 300
    t = np.arange(n + 1) * 0.01
    road = {"grade": 0.3 * np.sin(2 * t), "bank": 0.3 * np.cos(2 * t), "steering_wheel_angle": 0.3}
    run = drive(3.0, road, manoeuvre=OPEN, initial_speed=10.0, road_time=0.05)
    R_NS = Rotation.from_quat(np.roll(run["q_NS"], -1, axis=1))
    on_body = np.column_stack([np.zeros_like(t), run["body_pitch"], run["body_roll"]])
    R_NR = R_NS * Rotation.from_euler("ZYX", on_body).inv()
    normal = R_NR.apply([0.0, 0.0, 1.0])
    turn = np.sum(R_NS.apply(run["angular_velocity"]) * normal, axis=1)
    assert np.abs(np.diff(run["road"], axis=0)).max() > 2e-3
    # Roll about an axis that pitch leans from the road: the product of two small numbers.
    assert turn == pytest.approx(run["yaw_rate"], abs=2e-3)


def test_a_sensor_moves_with_the_body() -> None:
    """Two sensors are always their lever arm apart, turned by the attitude, while the body rolls and pitches."""
    one, other = np.array([1.0, 0.5, 0.3]), np.array([-0.5, 0.2, 1.2])
    dive = {"brake_force": 4000.0, "steering_wheel_angle": 1.0}
    runs = [drive(2.0, dive, manoeuvre=OPEN, initial_speed=20.0, imu_position=at) for at in (one, other)]
    R_NS = Rotation.from_quat(np.roll(runs[0]["q_NS"], -1, axis=1))
    assert np.abs(runs[0]["body_roll"]).max() > 0.02 and np.abs(runs[0]["body_pitch"]).max() > 0.01
    assert runs[0]["position"] - runs[1]["position"] == pytest.approx(R_NS.apply(one - other), abs=1e-12)


def test_a_body_on_a_bank_leans_by_springs_and_gravity() -> None:
    bank = 0.3
    run = drive(10.0, manoeuvre=HILL_START, initial_speed=0.0, start_time=1e3, road_bank=bank)
    swing = VALUES["body_mass"] * VALUES["body_com_height"] * GRAVITY
    expected = swing * np.sin(bank) / (VALUES["roll_stiffness"] - swing * np.cos(bank))
    assert run["body_roll"][-1] == pytest.approx(expected, rel=5e-4)  # sin(phi) for phi of 0.04 rad


def test_the_outline_has_the_size_of_the_car() -> None:
    run = drive(1.0, manoeuvre=OPEN, initial_speed=0.0)
    points = run["skeleton"][-1]
    wheels, floor = points[[1, 4, 7, 10]], points[[0, 3, 6, 9]]
    assert wheels[:, 2] == pytest.approx([0, 0, 0, 0], abs=1e-12)
    L = VALUES["front_distance"] + VALUES["rear_distance"]
    for corners, length, width in ((wheels, L, VALUES["track"]), (floor, VALUES["length"], VALUES["width"])):
        sides = np.linalg.norm(np.diff(corners, axis=0), axis=1)
        assert sides == pytest.approx([length, width, length], abs=1e-9)
    assert points[:, 2].max() == pytest.approx(1.4, abs=1e-9)


# Driver


def test_the_course_of_the_lane_change_is_the_middle_of_every_lane() -> None:
    w = VALUES["width"]
    widths = 1.1 * w + 0.25, 1.2 * w + 0.25, 1.3 * w + 0.25
    right = -widths[0] / 2
    middles = {0.0: 0.0, 7.0: 0.0, 57.5: right + 3.5 + widths[1] / 2, 105.1: right + widths[2] / 2, 125.0: None}
    for x, expected in middles.items():
        y = float(lane_change(ca.DM(VALUES["path_start"] + x), P))
        assert y == pytest.approx(right + widths[2] / 2 if expected is None else expected, abs=1e-9), x


def test_the_driver_knows_how_his_car_understeers() -> None:
    run = drive(20.0, manoeuvre=CIRCLE, cornering_stiffness=(12.0, 21.0), load_sensitivity=0.0)
    # Curvature error of the tyres' saturation at half of the friction, a twentieth of K v^2, times the preview squared.
    assert np.abs(run["path_error"][-1]) < 0.3
