"""Claims about the pendulums: mechanics, driven motion, and what a sensor on them sees."""

from __future__ import annotations

import itertools
from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import cumulative_simpson, solve_ivp

from imufmu.blocks.block import ContinuousBlock
from imufmu.blocks.instance import ContinuousInstance
from imufmu.blocks.vocabulary import GRAVITY, MID_EUROPE
from imufmu.compiled.running import simulate
from imufmu.plants.pendulum import DOUBLE_PENDULUM, PENDULUM, pendulum
from imufmu.plants.pendulum_parts import free_acceleration
from imufmu.registry import BLOCKS
from support.pendulums import BOTH, OFF_AXIS, SHORT_TRIAL, defaults, links_of, numbers
from support.truth_consistency import assert_truth_consistent


def acceleration_function(block: ContinuousBlock, p: SimpleNamespace) -> Any:
    theta, rate, torque = (ca.SX.sym(name, links_of(block)) for name in ("theta", "rate", "torque"))
    return ca.Function("acceleration", [theta, rate, torque], [free_acceleration(theta, rate, torque, p)])


def random_states(links: int) -> np.ndarray:
    """Angles all the way round, rates up to 10 rad/s, torques up to 10 N.m: (50, 3, links)."""
    return np.random.default_rng(7).uniform(-1, 1, (50, 3, links)) * np.array([np.pi, 10, 10])[:, None]


def test_both_pendulums_are_registered() -> None:
    assert BLOCKS["pendulum"] is PENDULUM
    assert BLOCKS["double_pendulum"] is DOUBLE_PENDULUM


# Mechanics


def test_one_link_equals_the_closed_form() -> None:
    p = defaults(PENDULUM)
    m, c, inertia, b = (x[0] for x in numbers(p, "mass", "com_distance", "inertia", "damping"))
    acceleration = acceleration_function(PENDULUM, p)
    for theta, rate, torque in random_states(1):
        expected = (torque - b * rate - m * GRAVITY * c * np.sin(theta)) / (inertia + m * c**2)
        assert float(acceleration(theta, rate, torque)) == pytest.approx(expected[0], rel=1e-12, abs=1e-12)  # rounding


def two_link_acceleration(theta: np.ndarray, rate: np.ndarray, torque: np.ndarray, p: SimpleNamespace) -> np.ndarray:
    """Planar elbow arm with relative angles (Spong, Hutchinson, Vidyasagar, Robot Modeling and Control, Wiley 2006);
    the first angle is counted from the downward vertical here."""
    (l1, _), (m1, m2), (c1, c2) = numbers(p, "length", "mass", "com_distance")
    (i1, i2), b = numbers(p, "inertia", "damping")
    coupling = m2 * l1 * c2 * np.cos(theta[1])
    d22 = m2 * c2**2 + i2
    d12 = d22 + coupling
    d11 = m1 * c1**2 + i1 + m2 * l1**2 + d22 + 2 * coupling
    h = -m2 * l1 * c2 * np.sin(theta[1])
    coriolis = np.array([2 * h * rate[0] * rate[1] + h * rate[1] ** 2, -h * rate[0] ** 2])
    far = m2 * c2 * GRAVITY * np.sin(theta[0] + theta[1])
    gravity = np.array([(m1 * c1 + m2 * l1) * GRAVITY * np.sin(theta[0]) + far, far])
    return np.linalg.solve([[d11, d12], [d12, d22]], torque - b * rate - coriolis - gravity)


def test_two_links_equal_the_textbook_arm() -> None:
    p = defaults(DOUBLE_PENDULUM)
    acceleration = acceleration_function(DOUBLE_PENDULUM, p)
    for theta, rate, torque in random_states(2):
        found = np.array(acceleration(theta, rate, torque)).ravel()
        # Rounding: the mass matrix has a condition number of about 50, accelerations reach 1e3 rad/s2.
        assert found == pytest.approx(two_link_acceleration(theta, rate, torque, p), rel=1e-11, abs=1e-11)


@BOTH
def test_mass_matrix_is_invertible_at_the_bounds_of_all_parameters(block: ContinuousBlock) -> None:
    links = links_of(block)
    names = ("length", "mass", "com_distance", "inertia")
    bounds = {q.name: (q.minimum, q.maximum) for q in block.own_parameters if q.name in names}
    corners = itertools.product(*(bounds[name] for name in names for _ in range(links)))
    p = defaults(block)
    values = ca.SX.sym("values", 4 * links)
    for name, value in zip(names, ca.vertsplit(values, links), strict=True):
        setattr(p, name, value)
    theta, torque = ca.SX.sym("theta", links), ca.SX.sym("torque", links)
    acceleration = free_acceleration(theta, ca.SX.zeros(links), torque, p)
    # M^-1 is the change of the accelerations with the torques: positive definite, so its trace is positive.
    trace = ca.Function("trace", [values, theta], [ca.trace(ca.jacobian(acceleration, torque))])
    stretched, folded = np.zeros(links), np.full(links, np.pi)  # where two links couple most
    for corner in corners:
        assert 0 < float(trace(corner, stretched)) < np.inf
        assert 0 < float(trace(corner, folded)) < np.inf


@BOTH
def test_energy_is_constant_without_damping(block: ContinuousBlock) -> None:
    h, steps = 0.001, 10_000
    run = simulate(block, h * steps, 0.01, parameters={"max_step": h, "damping": 0.0, "initial_rate": 3.0})
    # One RK4 step of h is wrong by about (w h)^5 / 5!, w the fastest rate of the motion; at worst all steps add up.
    w = np.abs(run["angle_rate"]).max()
    assert np.ptp(run["energy"]) < steps * (w * h) ** 5 / 120 * np.abs(run["energy"]).max()
    assert np.ptp(run["angle"]) > 1.0  # rad; it did swing


@BOTH
def test_energy_changes_by_the_work_of_torque_and_damping(block: ContinuousBlock) -> None:
    links = links_of(block)
    torque = np.full(links, 2.0)
    run = simulate(block, 5.0, 0.002, {"torque": torque}, {"damping": [0.5, 0.3][:links]})
    power = ((torque - np.array([0.5, 0.3][:links]) * run["angle_rate"]) * run["angle_rate"]).sum(axis=1)
    work = cumulative_simpson(power, x=run.time, initial=0.0)
    assert np.abs(run["energy"] - run["energy"][0] - work).max() < 1e-6  # J; Simpson's rule, of about 10 J


@BOTH
def test_damping_only_takes_energy(block: ContinuousBlock) -> None:
    run = simulate(block, 20.0, 0.01, parameters={"damping": 1.0})
    assert np.diff(run["energy"]).max() < 1e-9  # J; rounding of about 50 J, and RK4, once it hangs still
    mass, com, length = numbers(defaults(block), "mass", "com_distance", "length")
    hanging = -GRAVITY * sum(m * (c + length[:i].sum()) for i, (m, c) in enumerate(zip(mass, com, strict=True)))
    assert run["energy"][-1] == pytest.approx(hanging, rel=1e-3)  # most of the swing is gone after 20 s


@BOTH
def test_solver_is_of_order_four(block: ContinuousBlock) -> None:
    p = defaults(block)
    links = links_of(block)
    acceleration = acceleration_function(block, p)

    def slope(_: float, y: np.ndarray) -> np.ndarray:
        return np.concatenate([y[links:], np.array(acceleration(y[:links], y[links:], np.zeros(links))).ravel()])

    start = np.concatenate([*numbers(p, "initial_angle", "initial_rate")])
    exact = solve_ivp(slope, (0, 2), start, "DOP853", rtol=1e-13, atol=1e-13).y[:links, -1]
    errors = [
        np.abs(simulate(block, 2.0, 1.0, parameters={"max_step": h})["angle"][-1] - exact).max() for h in (0.02, 0.01)
    ]
    # Halving the step divides the error by 2^4; the next order of the error, about h w, moves that by some 15 %.
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4, abs=0.3)


def test_small_swing_has_the_period_of_the_physical_pendulum() -> None:
    p = defaults(PENDULUM)
    m, c, inertia = (x[0] for x in numbers(p, "mass", "com_distance", "inertia"))
    w = np.sqrt(m * GRAVITY * c / (inertia + m * c**2))
    small = 1e-4
    run = simulate(PENDULUM, 10.0, 0.01, parameters={"damping": 0.0, "initial_angle": small})
    # The period grows by the part small^2 / 16, that is 2e-8 rad of phase in 10 s.
    assert run["angle"][:, 0] == pytest.approx(small * np.cos(w * run.time), abs=1e-7 * small)


@pytest.mark.parametrize("angles", [(0.8,), (0.8, -0.5)], ids=["one link", "two links"])
def test_torque_that_carries_the_weight_keeps_it_still(angles: tuple[float, ...]) -> None:
    block = pendulum(len(angles))
    mass, com, length = numbers(defaults(block), "mass", "com_distance", "length")
    phi = np.cumsum(angles)
    moments = np.zeros(len(angles))
    for joint in range(len(angles)):
        for i in range(joint, len(angles)):
            lever = sum(length[k] * np.sin(phi[k]) for k in range(joint, i)) + com[i] * np.sin(phi[i])
            moments[joint] += mass[i] * GRAVITY * lever
    run = simulate(block, 1.0, 0.1, {"torque": moments}, {"initial_angle": angles})
    # Rounding of the balance, 1e-15 of 10 rad/s2, grows by e^(w t) at the most, w t < 10.
    assert run["angle"] == pytest.approx(np.tile(angles, (len(run.time), 1)), abs=1e-10)
    assert np.abs(run["external_acceleration"]).max() < 1e-9


# What the sensor sees


def test_hanging_still_reads_gravity_upwards_along_the_link() -> None:
    run = simulate(PENDULUM, 0.1, 0.1, parameters={"initial_angle": 0.0, "mount": 0.0})
    assert run["specific_force"][0] == pytest.approx([0, 0, GRAVITY], abs=1e-14)  # rounding
    assert run["position"][0] == pytest.approx([0, 0, -0.9], abs=1e-15)


@pytest.mark.parametrize("heading, direction", [(0.0, [1, 0]), (np.pi / 2, [0, 1])], ids=["East", "North"])
def test_positive_angle_moves_the_sensor_along_the_heading(heading: float, direction: list[float]) -> None:
    values = {"initial_angle": 0.5, "heading": heading, "mount": 0.0, "imu_distance": 2.0}
    run = simulate(PENDULUM, 0.1, 0.1, parameters=values)
    expected = [*(2 * np.sin(0.5) * np.array(direction)), -2 * np.cos(0.5)]
    assert run["position"][0] == pytest.approx(expected, abs=1e-15)  # rounding
    # The link's x axis follows the free end up: positive pitch lowers x.
    assert run["pitch"][0] == pytest.approx(-0.5, abs=1e-15)
    assert run["yaw"][0] == pytest.approx(heading, abs=1e-15)


def test_accelerometer_at_a_point_mass_is_blind_to_tilt() -> None:
    """The string pulls along itself only: no tangential specific force at any angle and rate."""
    point = {"length": 1.0, "com_distance": 1.0, "inertia": 0.0, "damping": 0.0, "imu_distance": 1.0, "mount": 0.0}
    run = simulate(PENDULUM, 5.0, 0.01, parameters=point | {"initial_rate": 4.0})
    assert np.abs(run["pitch"]).max() > 1.2  # rad
    assert np.abs(run["specific_force"][:, :2]).max() < 1e-14 * 4 * GRAVITY  # difference of equal numbers, some 4 g


@pytest.mark.parametrize("motion", [0, 1], ids=["free", "driven"])
@pytest.mark.parametrize(
    "block, imu_link", [(PENDULUM, 1), (DOUBLE_PENDULUM, 1), (DOUBLE_PENDULUM, 2)], ids=["pendulum", "thigh", "shank"]
)
def test_truth_is_one_motion(block: ContinuousBlock, motion: int, imu_link: int) -> None:
    values = SHORT_TRIAL | OFF_AXIS | {"motion": motion, "imu_link": imu_link, "initial_rate": 2.0}
    run = simulate(block, 6.0, 0.002, {"torque": [1.0, 0.5][: links_of(block)]}, values)
    # Free: the solver's 1 ms steps; driven: the spline at the corners of the jerk. Both below 3e-8 in 6 s.
    assert_truth_consistent(run, GRAVITY, np.array(MID_EUROPE), tolerance=1e-7)


@BOTH
def test_gravity_and_field_are_parameters(block: ContinuousBlock) -> None:
    run = simulate(block, 1.0, 0.002, parameters=OFF_AXIS | {"g": 1.62, "earth_field": (-5.0, 7.0, 11.0)})
    assert_truth_consistent(run, 1.62, np.array([-5.0, 7.0, 11.0]), tolerance=1e-9)  # slow motion, 1 s


@BOTH
@pytest.mark.parametrize("motion", [0, 1], ids=["free", "driven"])
def test_any_communication_step_gives_the_same_truth(block: ContinuousBlock, motion: int) -> None:
    values = {"motion": motion, "drive_rest": 0.0}
    runs = [simulate(block, 0.6, step, parameters=values) for step in (1e-4, 7.5e-4, 0.01, 0.1)]
    for name in ("q_NS", "position", "velocity", "angular_velocity", "specific_force", "angle"):
        ends = np.array([run[name][-1] for run in runs])
        # Solver steps differ (0.1 to 1 ms): 600 RK4 steps of 1 ms at up to 10 rad/s are wrong by 600 (0.01)^5 / 5!,
        # that is 5e-10, relative to some 10 m/s2.
        assert np.ptp(ends, axis=0).max() < 5e-9, name


@BOTH
def test_heading_shifts_yaw_and_leaves_roll_and_pitch(block: ContinuousBlock) -> None:
    mount = {"mount": (0.1, 0.2, 0.3)}
    east = simulate(block, 3.0, 0.02, parameters=mount)
    turned = simulate(block, 3.0, 0.02, parameters=mount | {"heading": 2.5})
    rounding = 1e-13
    assert turned["roll"] == pytest.approx(east["roll"], abs=rounding)
    assert turned["pitch"] == pytest.approx(east["pitch"], abs=rounding)
    shift = np.exp(1j * (turned["yaw"] - east["yaw"]))  # on the circle: yaw jumps by a turn at +-180 deg
    assert shift == pytest.approx(np.full(len(shift), np.exp(2.5j)), abs=rounding)
    assert turned["specific_force"] == pytest.approx(east["specific_force"], abs=100 * rounding)


def test_attitude_is_continuous_over_the_top() -> None:
    run = simulate(PENDULUM, 5.0, 0.005, parameters=OFF_AXIS | {"initial_rate": 12.0, "damping": 0.0})
    assert np.ptp(run["angle"]) > 4 * np.pi  # two turns and more
    fastest = np.linalg.norm(run["angular_velocity"], axis=1).max()
    # A unit quaternion moves by half the angle; a flipped sign would be a jump of 2.
    assert np.linalg.norm(np.diff(run["q_NS"], axis=0), axis=1).max() <= 0.5 * fastest * 0.005
    assert np.linalg.norm(run["q_NS"], axis=1) == pytest.approx(np.ones(len(run.time)), abs=1e-14)


# Driven motion


def trial(block: ContinuousBlock, step: float = 0.01, **changes: Any) -> Any:
    return simulate(block, 26.0, step, parameters={"motion": 1, "mount": 0.0} | changes)


@BOTH
def test_driven_motion_rests_swings_and_rests(block: ContinuousBlock) -> None:
    run = trial(block)
    still = (run.time <= 2.0) | (run.time >= 22.0)
    for name in ("angle", "angle_rate", "angular_velocity", "external_acceleration", "velocity"):
        assert np.abs(run[name][still]).max() == 0, name
    assert np.ptp(run["angle"][~still], axis=0).min() > np.radians(35)


def test_driven_swing_gets_faster_as_asked() -> None:
    run = trial(PENDULUM, 0.001, drive_start_frequency=0.5, drive_end_frequency=1.5)
    crossings = run.time[1:][np.diff(np.sign(run["angle"][:, 0])) != 0]
    crossings = crossings[(crossings > 5) & (crossings < 19)]
    middles, frequency = (crossings[1:] + crossings[:-1]) / 2, 0.5 / np.diff(crossings)
    # 1 ms of 0.4 s between crossings, and the change of frequency within half a swing.
    assert frequency == pytest.approx(0.5 + (middles - 2) / 20, rel=0.01)


def test_driven_knee_never_hyperextends_and_bends() -> None:
    knee = trial(DOUBLE_PENDULUM)["angle"][:, 1]
    assert knee.max() <= 0  # 0 is straight, negative takes the shank backwards
    assert np.degrees(knee.min()) == pytest.approx(-60, abs=0.5)  # the deepest sample between two instants


def test_driven_knee_is_bent_before_the_thigh_is_foremost() -> None:
    run = trial(DOUBLE_PENDULUM, drive_start_frequency=0.8, drive_end_frequency=0.8)
    one = (run.time >= 10.0) & (run.time < 11.25)  # one stride
    deepest = run.time[one][run["angle"][one, 1].argmin()]
    foremost = run.time[one][run["angle"][one, 0].argmax()]
    assert (foremost - deepest) % 1.25 == pytest.approx(1.25 / 4, abs=0.02)  # two samples


@BOTH
def test_driven_acceleration_and_jerk_are_continuous(block: ContinuousBlock) -> None:
    """Differences over a step shrink with the step: a jump would stay."""
    steps = (0.002, 0.001)
    runs = [simulate(block, 6.0, step, parameters=SHORT_TRIAL)["external_acceleration"] for step in steps]
    for order in (1, 2):
        differences = [np.diff(a, order, axis=0) / h ** (order - 1) for a, h in zip(runs, steps, strict=True)]
        largest = [np.abs(d).max() for d in differences]
        assert largest[0] / largest[1] == pytest.approx(2, abs=0.1)  # first order in the step


@BOTH
def test_driven_motion_takes_no_notice_of_torque_and_start(block: ContinuousBlock) -> None:
    links = links_of(block)
    plain = simulate(block, 5.0, 0.01, parameters=SHORT_TRIAL)
    other = simulate(
        block, 5.0, 0.01, {"torque": [50.0] * links}, SHORT_TRIAL | {"initial_angle": 1.0, "initial_rate": 9.0}
    )
    for name, values in plain.values.items():
        assert np.array_equal(values, other[name]), name


@BOTH
def test_torque_of_a_driven_motion_makes_a_free_pendulum_move_alike(block: ContinuousBlock) -> None:
    driven = simulate(block, 5.0, 0.05, parameters=SHORT_TRIAL)
    state_and_held = np.hstack([driven["angle"], driven["angle_rate"], np.zeros_like(driven["angle"])])
    p = block.parameter_vector(SHORT_TRIAL | {"motion": 0})
    names = [name for signal in block.reported for name in signal.element_names()]
    first = names.index("specific_force[1]")
    for x, torque, t, expected in zip(
        state_and_held, driven["joint_torque"], driven.time, driven["specific_force"], strict=True
    ):
        y = np.array(block.output_function(x, torque, p, t)).ravel()
        assert y[first : first + 3] == pytest.approx(expected, abs=1e-11)  # rounding of 20 m/s2 through a solve


@BOTH
def test_state_follows_a_driven_motion(block: ContinuousBlock) -> None:
    plant = ContinuousInstance(block)
    plant.p[:] = block.parameter_vector(SHORT_TRIAL)
    plant.initialise(0.0)
    for k in range(30):
        plant.do_step(0.1 * k, 0.1)
    names = [name for signal in block.reported for name in signal.element_names()]
    first = names.index("angle[1]")
    links = links_of(block)
    # 3000 RK4 steps of 1 ms integrate angles that change within 0.1 s: far below rounding to 1e-10.
    assert plant.x[: 2 * links] == pytest.approx(plant.y[first : first + 2 * links], abs=1e-10)


def test_sensor_on_the_first_link_feels_only_that_link() -> None:
    thigh = {"drive_offset": 0.2, "drive_amplitude": 0.4, "drive_phase": 0.3}
    shank = {f"{name}[2]": 0.1 for name in thigh}
    first_of_two = {f"{name}[1]": value for name, value in thigh.items()} | shank
    one = simulate(PENDULUM, 5.0, 0.01, parameters=SHORT_TRIAL | thigh | {"imu_distance": 0.3})
    two = simulate(
        DOUBLE_PENDULUM, 5.0, 0.01, parameters=SHORT_TRIAL | first_of_two | {"imu_link": 1, "imu_distance": 0.3}
    )
    for name in ("q_NS", "position", "specific_force"):
        assert two[name] == pytest.approx(one[name], abs=1e-13), name  # rounding
