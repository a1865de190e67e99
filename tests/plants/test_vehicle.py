"""Claims about the car: closed forms, an independent model, friction, standstill."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import make_interp_spline
from scipy.spatial.transform import Rotation
from vehiclemodels.parameters_vehicle1 import parameters_vehicle1
from vehiclemodels.parameters_vehicle2 import parameters_vehicle2
from vehiclemodels.parameters_vehicle3 import parameters_vehicle3
from vehiclemodels.vehicle_dynamics_st import vehicle_dynamics_st

from imufmu.blocks.block import ParameterError
from imufmu.blocks.vocabulary import GRAVITY
from imufmu.papers.motions import parameter_set
from imufmu.plants.vehicle.driver import BRAKING, CIRCLE, HILL_START, OPEN, STEP_STEER
from imufmu.plants.vehicle.plant import BLOCK
from imufmu.registry import BLOCKS
from support.cars import CARS, drive

EVERY_CAR = pytest.mark.parametrize("car", CARS)
SOURCES = {"ford_escort": parameters_vehicle1, "bmw_320i": parameters_vehicle2, "vw_vanagon": parameters_vehicle3}
START = {s.name: s.start_values() for s in BLOCK.parameters}
NO_RESISTANCE = {"drag_area": 0.0, "rolling_resistance": 0.0}


def of(name: str) -> float:
    """Start value of a parameter, its first element."""
    return START[name][0]


def test_it_is_registered() -> None:
    assert BLOCKS["vehicle"] is BLOCK


def test_a_parameter_out_of_bounds_is_refused_by_name() -> None:
    with pytest.raises(ParameterError, match=r"mass = 0 kg.*manoeuvre = 8"):
        BLOCK.parameter_vector({"mass": 0.0, "manoeuvre": 8})


@EVERY_CAR
def test_a_parameter_set_holds_the_figures_of_its_source(car: str) -> None:
    """Against the package commonroad-vehicle-models, which ships the tables of the source."""
    p, given = SOURCES[car](), parameter_set(f"vehicle/{car}")
    roll = [p.K_sf * p.T_f**2 / 2 - p.K_tsf, p.K_sr * p.T_r**2 / 2 - p.K_tsr]
    expected = {
        "mass": p.m,
        "body_mass": p.m_s,
        "front_distance": p.a,
        "rear_distance": p.b,
        "track": (p.T_f + p.T_r) / 2,
        "length": p.l,
        "width": p.w,
        "body_com_height": p.h_s,
        "roll_axis_height": p.h_raf,
        "yaw_inertia": p.I_z,
        "roll_inertia": p.I_Phi_s,
        "pitch_inertia": p.I_y_s,
        "roll_stiffness": sum(roll),
        "roll_damping": (p.K_sdf * p.T_f**2 + p.K_sdr * p.T_r**2) / 2,
        "pitch_stiffness": 2 * (p.K_sf * p.a**2 + p.K_sr * p.b**2),
        "pitch_damping": 2 * (p.K_sdf * p.a**2 + p.K_sdr * p.b**2),
        "front_roll_share": roll[0] / sum(roll),
        "wheel_radius": p.R_w,
        "wheel_inertia": 2 * p.I_y_w,
        "front_drive_share": p.T_se,
        "front_brake_share": p.T_sb,
        "friction": p.tire.p_dy1,
        "cornering_stiffness[1]": -p.tire.p_ky1 / p.tire.p_dy1,
        "cornering_stiffness[2]": -p.tire.p_ky1 / p.tire.p_dy1,
        "longitudinal_stiffness": p.tire.p_kx1 / p.tire.p_dx1,
        "tyre_shape": p.tire.p_cy1,
    }
    assert given == pytest.approx(expected, rel=1e-6)  # written with seven digits


def test_the_defaults_are_the_rounded_bmw() -> None:
    given = parameter_set("vehicle/bmw_320i")
    defaults = {v.name: v.start for v in BLOCK.variables if v.group == "parameter" and v.name in given}
    assert defaults == pytest.approx(given, rel=2e-3, abs=0)  # three to four digits


# Steady turns


@pytest.mark.parametrize("speed", [10.0, 20.0, 30.0])
@pytest.mark.parametrize("stiffness", [(21.0, 21.0), (16.0, 21.0)], ids=["neutral", "understeering"])
def test_steady_yaw_gain_is_the_closed_form(speed: float, stiffness: tuple[float, float]) -> None:
    """r / delta = v / (L + K v^2), K = (1 / c_f - 1 / c_r) / (mu g), after a small step of the steering wheel."""
    values = {"initial_speed": speed, "final_speed": speed, "cornering_stiffness": stiffness, "load_sensitivity": 0.0}
    run = drive(8.0, manoeuvre=STEP_STEER, step_angle=0.02, **values, **NO_RESISTANCE)
    K = (1 / stiffness[0] - 1 / stiffness[1]) / (of("friction") * GRAVITY)
    L = of("front_distance") + of("rear_distance")
    v = run["speed"][-1]
    # The driver holds the speed; tyres at 0.5 m/s2 are linear to (0.05)^2.
    assert run["yaw_rate"][-1] / run["steering_angle"][-1] == pytest.approx(v / (L + K * v**2), rel=3e-3)


def test_understeer_gradient_on_a_constant_radius_is_the_closed_form() -> None:
    """ISO 4138, constant radius: slope of the steering angle over the lateral acceleration, below 2 m/s2."""
    stiffness = (16.0, 21.0)
    values = {"cornering_stiffness": stiffness, "load_sensitivity": 0.0, **NO_RESISTANCE}
    speeds = {"initial_speed": 5.0, "final_speed": 14.0, "speed_rate": 0.15}
    run = drive(80.0, step=0.1, manoeuvre=CIRCLE, **speeds, **values)
    turning = (run.time > 15) & (run["lateral_acceleration"] < 2.0)
    slope, at_rest = np.polyfit(run["lateral_acceleration"][turning], run["steering_angle"][turning], 1)
    K = (1 / stiffness[0] - 1 / stiffness[1]) / (of("friction") * GRAVITY)
    # Tyres at 2 m/s2 are linear to (0.2)^2; the speed rises meanwhile.
    assert slope == pytest.approx(K, rel=0.05)
    assert at_rest == pytest.approx((of("front_distance") + of("rear_distance")) / of("circle_radius"), rel=0.01)


@EVERY_CAR
def test_roll_gradient_is_that_of_springs_and_gravity(car: str) -> None:
    """phi / a_y = m_s h / (K - m_s g h) in a steady turn."""
    values = parameter_set(f"vehicle/{car}")
    run = drive(8.0, manoeuvre=STEP_STEER, step_angle=0.1, **values)
    swing = values["body_mass"] * (values["body_com_height"] - values["roll_axis_height"])
    expected = swing / (values["roll_stiffness"] - swing * GRAVITY)
    # sin(phi) for phi in gravity's part, 0.03 rad; the driver still corrects the speed a little.
    assert run["body_roll"][-1] / run["lateral_acceleration"][-1] == pytest.approx(expected, rel=1e-3)


def test_lateral_load_transfer_makes_a_neutral_car_understeer_at_high_acceleration() -> None:
    """More roll stiffness at the front, tyres that lose friction with load: the front slides first."""
    slips = []
    for share in (0.9, 0.1):
        values = {"front_roll_share": share, "load_sensitivity": 0.2, "final_speed": 25.0, "initial_speed": 25.0}
        run = drive(20.0, manoeuvre=CIRCLE, **values)
        slips.append(run["steering_angle"][-1])
    assert slips[0] > slips[1] + 0.003  # rad: a hundredth of the friction of an axle, and more


# An independent model


# The car without what the single-track model of CommonRoad leaves out: roll, pitch, resistance, relaxation.
RIGID: dict[str, float] = {
    "g": 9.81,
    "roll_stiffness": 1e7,
    "roll_damping": 1.5e5,
    "pitch_stiffness": 1e8,
    "pitch_damping": 8e5,
    "load_sensitivity": 0.0,
    "relaxation_length": 0.02,
    "manoeuvre": OPEN,
    "initial_speed": 20.0,
    "imu_position": 0.0,
    **NO_RESISTANCE,
}


def test_a_weave_follows_the_single_track_model_of_commonroad() -> None:
    """A sine of the steering wheel at 20 m/s, 0.5 m/s2: the library's linear tyres and ours coincide."""
    h, duration = 0.01, 6.0
    t = np.arange(0, duration + h / 2, h)
    wheel = 0.1 * np.sin(2 * np.pi * 0.4 * t)
    run = drive(duration, {"steering_wheel_angle": wheel}, h, **(parameter_set("vehicle/bmw_320i") | RIGID))
    angle = make_interp_spline(t, run["steering_angle"], k=5).derivative()
    speed = make_interp_spline(t, run["speed"], k=5).derivative()
    p = parameters_vehicle2()

    def slope(time: float, x: np.ndarray) -> np.ndarray:
        return np.array(vehicle_dynamics_st(list(x), [float(angle(time)), float(speed(time))], p))

    start = [0.0, 0.0, 0.0, 20.0, 0.0, 0.0, 0.0]
    theirs = solve_ivp(slope, (0, duration), start, t_eval=t, rtol=1e-9, atol=1e-12, max_step=0.05).y
    assert np.abs(run["lateral_acceleration"]).max() > 0.4
    # Tyres at 0.5 m/s2 are linear to (0.05)^2 / 3 of their force, and delay it by 2 ms at the least relaxation length;
    # the side slip is the small difference of two such angles.
    assert run["yaw_rate"] == pytest.approx(theirs[5], abs=0.003 * np.abs(theirs[5]).max())
    assert run["side_slip"] == pytest.approx(theirs[6], abs=0.03 * np.abs(theirs[6]).max())
    off = np.hypot(run["position"][:, 0] - theirs[0], run["position"][:, 1] - theirs[1])
    assert np.ptp(run["position"][:, 1]) > 0.5
    assert off.max() < 0.002  # m, of 120 m


# Forces


@pytest.mark.parametrize("roll_axis_height", [0.0, 0.3])
@pytest.mark.parametrize("manoeuvre", [STEP_STEER, BRAKING])
def test_the_forces_of_the_road_are_the_momentum_of_body_and_axles(manoeuvre: int, roll_axis_height: float) -> None:
    """Newton for the whole car, from the ideal IMU at the body's centre of mass."""
    hard = {"step_angle": 0.5, "deceleration": 6.0, "imu_position": 0.0, "drag_area": 0.0}
    run = drive(3.0, step=0.005, manoeuvre=manoeuvre, roll_axis_height=roll_axis_height, **hard)
    R_NS = Rotation.from_quat(np.roll(run["q_NS"], -1, axis=1))
    a_N = R_NS.apply(run["external_acceleration"])
    a_body = Rotation.from_euler("z", run["yaw"][:, None]).inv().apply(a_N)[:, :2]
    a_axles = np.column_stack([run["longitudinal_acceleration"], run["lateral_acceleration"]])
    momentum = of("body_mass") * a_body + (of("mass") - of("body_mass")) * a_axles
    delta = run["steering_angle"]
    (front_x, rear_x), (front_y, rear_y) = run["longitudinal_force"].T, run["lateral_force"].T
    force = np.column_stack(
        [
            front_x * np.cos(delta) - front_y * np.sin(delta) + rear_x,
            front_y * np.cos(delta) + front_x * np.sin(delta) + rear_y,
        ]
    )
    largest = np.abs(force).max()
    assert largest > 6000
    # Products of body angles (0.1 rad), their rates and the yaw rate (0.4 rad/s) are left out of the equations.
    assert np.abs(momentum - force).max() < 0.01 * largest


def test_axle_loads_carry_the_weight_and_move_with_acceleration() -> None:
    """Braking at a steady deceleration: dF L = height times the force of the body, the springs' equilibrium."""
    run = drive(3.0, manoeuvre=BRAKING, deceleration=5.0)
    assert run["axle_load"].sum(axis=1) == pytest.approx(np.full(len(run.time), of("mass") * GRAVITY), rel=1e-12)
    steady = (run.time > 2.4) & (run.time < 2.6)
    L = of("front_distance") + of("rear_distance")
    static = of("mass") * GRAVITY * of("rear_distance") / L
    moved = (run["axle_load"][steady, 0] - static).mean()
    swing = of("body_mass") * of("body_com_height")
    topple = swing * GRAVITY * run["body_pitch"][steady].mean()
    # The body still pitches a little.
    assert moved * L == pytest.approx(-swing * run["longitudinal_acceleration"][steady].mean() + topple, rel=5e-3)


def test_no_axle_ever_leaves_the_friction_circle() -> None:
    """Steering, drive and brakes at random up to their limits, on a road that tilts."""
    rng, n = np.random.default_rng(3), 200
    inputs = {
        "steering_wheel_angle": rng.uniform(-8, 8, n + 1),
        "drive_force": rng.uniform(-1e4, 2e4, n + 1),
        "brake_force": rng.choice([0.0, 3e4], n + 1),
        "grade": rng.uniform(-0.3, 0.3, n + 1),
        "bank": rng.uniform(-0.3, 0.3, n + 1),
    }
    held = {name: np.repeat(u, 5)[: 5 * n + 1] for name, u in inputs.items()}
    run = drive(n * 0.05, held, manoeuvre=OPEN, initial_speed=25.0)
    assert run["friction_used"].max() > 0.99
    assert run["friction_used"].max() <= 1 + 1e-12  # rounding
    assert np.hypot(run["longitudinal_force"], run["lateral_force"]) == pytest.approx(
        run["friction_used"] * run["friction_force"], abs=1e-6
    )


# Coasting and braking


def test_a_coasting_car_slows_down_by_air_and_rolling_resistance() -> None:
    """(m + 2 I / R^2) v' = -(rho / 2) A v^2 - f m g has the solution v = k tan(atan(v0 / k) - c t)."""
    run = drive(20.0, manoeuvre=OPEN, initial_speed=30.0)
    mass = of("mass") + 2 * of("wheel_inertia") / of("wheel_radius") ** 2
    air, rolling = of("air_density") / 2 * of("drag_area"), of("rolling_resistance") * of("mass") * GRAVITY
    k, c = math.sqrt(rolling / air), math.sqrt(rolling * air) / mass
    expected = k * np.tan(math.atan(30.0 / k) - c * run.time)
    # The start, the slip of the wheels (a thousandth of the speed), rocking of the body.
    assert run["speed"] == pytest.approx(expected, abs=0.02)


def test_nothing_slows_a_car_without_resistance() -> None:
    run = drive(10.0, manoeuvre=OPEN, initial_speed=30.0, **NO_RESISTANCE)
    assert run["speed"] == pytest.approx(np.full(len(run.time), 30.0), abs=1e-9)
    assert run["forward_speed"] == pytest.approx(run["speed"], abs=1e-9)


def test_a_weaving_car_without_drive_only_loses_energy() -> None:
    """Tyres turn kinetic energy into heat and store little; what springs and tyres hold is returned, no more."""
    n = 1000
    weave = 1.5 * np.sin(2 * np.pi * 0.5 * np.arange(n + 1) * 0.01)
    run = drive(10.0, {"steering_wheel_angle": weave}, manoeuvre=OPEN, initial_speed=20.0, **NO_RESISTANCE)
    spin = run["wheel_speed"] / of("wheel_radius")
    energy = (of("mass") * run["speed"] ** 2 + of("yaw_inertia") * run["yaw_rate"] ** 2) / 2
    energy += of("wheel_inertia") * (spin**2).sum(axis=1) / 2
    energy += of("roll_stiffness") * run["body_roll"] ** 2 / 2
    # Left out: the body's own turning and the tyres' deflection, some 100 J each, of 30 kJ that are lost.
    assert energy[0] - energy[-1] > 3e4
    assert np.max(energy - np.minimum.accumulate(energy)) < 500.0


def test_a_car_that_is_driven_backwards_says_so() -> None:
    run = drive(3.0, {"drive_force": -1000.0}, manoeuvre=OPEN, initial_speed=0.0)
    # The undriven wheels slip by rolling resistance, f / (mu c) = 0.06 %, and inertia.
    assert run["forward_speed"][-1] == pytest.approx(-run["speed"][-1], rel=2e-3)
    assert run["speed"][-1] > 1.5


@pytest.mark.parametrize("deceleration", [3.0, 6.0, 8.0])
def test_braking_distance_is_that_of_the_brake_force(deceleration: float) -> None:
    """Integrated by hand: force built up by foot and filter, wheels without slip, then standstill."""
    run = drive(12.0, manoeuvre=BRAKING, deceleration=deceleration, brake_time=1.0)
    v0, tau = 80 / 3.6, of("pedal_time")
    mass = of("mass") + 2 * of("wheel_inertia") / of("wheel_radius") ** 2

    def slope(t: float, y: np.ndarray) -> list[float]:
        s = min(max((t - 1.0) / 0.3, 0), 1)
        wanted = s**4 * (35 - 84 * s + 70 * s**2 - 20 * s**3)
        drag = of("air_density") / 2 * of("drag_area") * y[1] ** 2 + of("rolling_resistance") * of("mass") * GRAVITY
        drive_force = y[3]
        feedback = of("mass") * (v0 - y[1])
        a = (drive_force - drag - of("mass") * y[2]) / mass
        wanted_drive = max(drag + feedback, 0) * (1 - wanted)
        return [y[1], a, (deceleration * wanted - y[2]) / tau, (wanted_drive - drive_force) / tau]

    def stands(t: float, y: np.ndarray) -> float:
        return y[1]

    stands.terminal = True  # type: ignore[attr-defined]
    drag0 = of("air_density") / 2 * of("drag_area") * v0**2 + of("rolling_resistance") * of("mass") * GRAVITY
    end = solve_ivp(slope, (0, 20), [0.0, v0, 0.0, drag0], events=stands, rtol=1e-9, max_step=0.01).y[0, -1]
    start = v0 * 1.0
    # The wheels lag behind the car by the slip, up to 5 %: their inertia, 5 % of the mass, gives that much less back.
    assert run["position"][-1, 0] - run["position"][0, 0] - start == pytest.approx(end - start, rel=5e-3)


@pytest.mark.parametrize("deceleration", [2.0, 8.0, 20.0], ids=["gentle", "hard", "locked"])
def test_brakes_stop_the_car_and_do_not_push_it_back(deceleration: float) -> None:
    on_the_road = (0.0, 0.0, -of("body_com_height"))
    run = drive(20.0, manoeuvre=BRAKING, deceleration=deceleration, imu_position=on_the_road)
    x = run["position"][:, 0]
    # Tyres and brakes rock back by the way that they gave, sigma / c + d, and not further.
    assert x.max() - x[-1] < of("relaxation_length") / of("longitudinal_stiffness") + 0.01
    assert run["speed"][-1] < 1e-5


# Standstill


@pytest.mark.parametrize("grade, bank", [(0.0, 0.0), (0.3, 0.0), (-0.3, 0.1), (0.1, -0.3)])
def test_a_braked_car_stands_still_on_any_slope(grade: float, bank: float) -> None:
    values = {"manoeuvre": HILL_START, "initial_speed": 0.0, "start_time": 1e3, "road_grade": grade, "road_bank": bank}
    run = drive(30.0, step=0.1, **values)
    late = run.time > 15
    creep = np.linalg.norm(run["position"][late] - run["position"][-1], axis=1).max()
    assert creep < 1e-9  # m in 15 s: the springs are at rest, nothing slides
    # The tyres take the slope at their nominal friction; load changes it a little.
    assert np.linalg.norm(run["position"] - run["position"][-1], axis=1).max() < 1e-3
    assert run["specific_force"][-1] == pytest.approx(GRAVITY * run["vertical"][-1], abs=1e-4)
    assert run["forward_speed"][-1] == pytest.approx(0, abs=1e-6)


def test_a_car_at_rest_without_driver_stays_where_it_is() -> None:
    run = drive(5.0, manoeuvre=OPEN, initial_speed=0.0)
    assert np.ptp(run["position"], axis=0).max() == 0.0
    assert run["specific_force"] == pytest.approx(np.tile([0, 0, GRAVITY], (len(run.time), 1)), abs=1e-12)


def test_a_car_without_brakes_rolls_down_the_hill() -> None:
    """(m + 2 I / R^2) v' = m g sin(grade) - f m g cos(grade), little air at such speeds."""
    run = drive(4.0, manoeuvre=OPEN, initial_speed=0.0, road_grade=0.1, drag_area=0.0)
    mass = of("mass") + 2 * of("wheel_inertia") / of("wheel_radius") ** 2
    expected = of("mass") * GRAVITY * (math.sin(0.1) - of("rolling_resistance") * math.cos(0.1)) / mass
    later = run.time > 2
    slope = np.polyfit(run.time[later], run["forward_speed"][later], 1)[0]
    assert slope == pytest.approx(-expected, rel=2e-3)  # slip that still grows
