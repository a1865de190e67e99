"""Claims about what an experiment adds to the pendulums: end stops, encoders, a second sensor, a swing-up."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import brentq

from imufmu.blocks.block import ContinuousBlock
from imufmu.blocks.running import Trajectory
from imufmu.blocks.vocabulary import GRAVITY, MID_EUROPE
from imufmu.compiled.running import simulate
from imufmu.papers.motions import parameter_set
from imufmu.plants.pendulum import DOUBLE_PENDULUM, PENDULUM
from imufmu.plants.pendulum_parts import stop_torque
from support.pendulums import BOTH, OFF_AXIS, SHORT_TRIAL, defaults, links_of, numbers
from support.truth_consistency import assert_truth_consistent

# The knee bends from 0 to 2.4 rad backwards, the hip not at all beyond 1 rad.
STOPS = {"stop_low": (-1.0, -2.4), "stop_high": (1.0, 0.0), "stop_stiffness": 1e4}
LIVELY = {"initial_angle": (0.9, -0.3), "initial_rate": (2.0, 4.0)}

# End stops


def against_a_stop(rate: float, stiffness: float, damping: float) -> tuple[Trajectory, float]:
    """A link without weight and friction that runs into a stop 0.1 rad away; and its moment of inertia (kg.m2)."""
    m, c, inertia = (x[0] for x in numbers(defaults(PENDULUM), "mass", "com_distance", "inertia"))
    stop = {"stop_high": 0.1, "stop_stiffness": stiffness, "stop_damping": damping}
    start = {"g": 0.0, "damping": 0.0, "initial_angle": 0.0, "initial_rate": rate}
    return simulate(PENDULUM, 0.5, 0.001, parameters=stop | start), inertia + m * c**2


def test_a_stop_without_damping_gives_back_all_energy_and_yields_as_far_as_its_spring_says() -> None:
    run, J = against_a_stop(3.0, 2e4, 0.0)
    assert run["angle_rate"][-1, 0] == pytest.approx(-3.0, rel=1e-6)  # RK4 through a contact of some 80 ms
    deepest = (1.5 * J * 3.0**2 / 2e4) ** (1 / 3)  # J w^2 / 2 = k d^3 / 3
    # Between two rows of 1 ms at the turning point, where the acceleration is k d^2 / J.
    assert run["angle"].max() - 0.1 == pytest.approx(deepest, abs=2e4 * deepest**2 / J * 0.0005**2)
    assert np.ptp(run["energy"]) < 1e-6 * run["energy"][0]


@pytest.mark.parametrize("damping", [0.05, 0.3])
def test_a_damped_stop_gives_back_what_hunt_and_crossley_say(damping: float) -> None:
    """J v dv = -k d^2 (1 + a v) dd, so v / a - log(1 + a v) / a^2 is the same on the way in and on the way out."""
    run, _ = against_a_stop(3.0, 2e4, damping)

    def kept(v: float) -> float:
        return v / damping - np.log1p(damping * v) / damping**2

    out = brentq(lambda v: kept(v) - kept(3.0), -1 / damping * (1 - 1e-9), -1e-6)
    assert run["angle_rate"][-1, 0] == pytest.approx(out, rel=1e-6)
    assert np.diff(run["energy"]).max() < 1e-9


def test_a_stop_never_pulls_and_does_nothing_between_its_ends() -> None:
    p = defaults(PENDULUM, stop_low=-0.5, stop_high=0.5, stop_stiffness=1e4, stop_damping=0.7)
    theta, rate = ca.SX.sym("theta"), ca.SX.sym("rate")
    torque = ca.Function("torque", [theta, rate], [stop_torque(theta, rate, p)])
    for at, v in np.random.default_rng(3).uniform((-1, -20), (1, 20), (200, 2)):
        found = float(torque(at, v))
        assert found <= 0 if at > 0.5 else found >= 0 if at < -0.5 else found == 0


def test_the_energy_of_a_leg_with_end_stops_only_falls() -> None:
    run = simulate(DOUBLE_PENDULUM, 10.0, 0.002, parameters=STOPS | LIVELY | {"damping": 0.0})
    # RK4 in a contact of w = (2 k d / J)^1/2 = 80 rad/s: (w h)^5 / 120 = 3e-8 of some 20 J a step, two steps a row.
    assert np.diff(run["energy"]).max() < 1.2e-6
    assert run["energy"][-1] < run["energy"][0] - 1.0  # J
    knee = run["angle"][:, 1]
    assert knee.min() < -0.5 and 0 < knee.max() < 0.25  # it bends, and yields a little


def test_the_default_solver_step_follows_stiff_stops_within_a_tenth_of_an_encoders_count() -> None:
    stiff = STOPS | LIVELY | {"stop_stiffness": 1e5}
    usual, fine = (simulate(DOUBLE_PENDULUM, 2.0, 0.01, parameters=stiff | {"max_step": h}) for h in (1e-3, 1e-4))
    assert usual["angle"][:, 1].max() > 0.01  # in contact
    assert np.abs(usual["angle"] - fine["angle"]).max() < 0.1 * 2 * np.pi / 1000


def test_the_truth_of_a_leg_in_its_stops_is_one_motion() -> None:
    run = simulate(DOUBLE_PENDULUM, 3.0, 0.001, parameters=STOPS | LIVELY | OFF_AXIS)
    assert run["angle"][:, 1].max() > 0.01
    # A quintic spline through the kinks of the jerk, rows 1 ms apart.
    assert_truth_consistent(run, GRAVITY, np.array(MID_EUROPE), tolerance=1e-5)


@BOTH
def test_stops_without_stiffness_are_none(block: ContinuousBlock) -> None:
    plain, tight = (simulate(block, 2.0, 0.01, parameters=stops) for stops in ({}, {"stop_low": 0.1, "stop_high": 0.2}))
    assert all(np.array_equal(plain[name], tight[name]) for name in plain.values)


# Encoders and the second sensor


@BOTH
@pytest.mark.parametrize("counts", [1000, 64])
def test_encoders_read_the_nearest_whole_count(block: ContinuousBlock, counts: int) -> None:
    run = simulate(block, 3.0, 0.003, parameters={"encoder_counts": counts, "initial_rate": 5.0})
    count = 2 * np.pi / counts
    steps = run["encoder"] / count
    assert np.abs(steps - np.round(steps)).max() < 1e-10  # rounding of up to 1e3 counts
    assert np.abs(run["encoder"] - run["angle"]).max() <= count / 2 * (1 + 1e-9)
    assert len(np.unique(run["encoder"][:, 0])) > 5


@pytest.mark.parametrize("motion", [0, 1], ids=["free", "driven"])
def test_the_upper_sensor_reads_what_a_sensor_moved_there_would(motion: int) -> None:
    values = SHORT_TRIAL | OFF_AXIS | {"motion": motion, "upper_imu_distance": 0.31}
    both = simulate(DOUBLE_PENDULUM, 4.0, 0.01, parameters=values)
    moved = simulate(DOUBLE_PENDULUM, 4.0, 0.01, parameters=values | {"imu_link": 1, "imu_distance": 0.31})
    for name in ("angular_velocity", "specific_force", "magnetic_field"):
        assert both[f"upper_{name}"] == pytest.approx(moved[name], abs=1e-13), name  # the same, in another order
        assert np.abs(both[f"upper_{name}"] - both[name]).max() > 0.1, name


@pytest.mark.parametrize("name", ["by_hand", "slow"])
def test_the_arm_of_bennett_moves_by_hand_between_two_rests_and_never_hyperextends(name: str) -> None:
    values = parameter_set(f"pendulum/bennett2014_{name}")
    run = simulate(DOUBLE_PENDULUM, 6.0 + values["drive_duration"], 0.01, parameters=values)
    still = (run.time <= 3.0) | (run.time >= 3.0 + values["drive_duration"])
    assert not run["angular_velocity"][still].any()
    # Hanging, x of the sensors points down and z against the joint axis.
    assert run["vertical"][0] == pytest.approx([-1, 0, 0], abs=1e-15)
    assert run["specific_force"][0] == pytest.approx([-GRAVITY, 0, 0], abs=1e-14)
    knee = run["angle"][:, 1]
    assert knee.max() <= 0 and knee.min() < np.radians(-70)
    for prefix, rate in (("upper_", run["angle_rate"][:, 0]), ("", run["angle_rate"].sum(axis=1))):
        assert run[f"{prefix}angular_velocity"][:, 2] == pytest.approx(-rate, abs=1e-12)


# Swing-up


def swung_up(block: ContinuousBlock, duration: float = 15.0, **changes: Any) -> Trajectory:
    start = {"motion": 2, "initial_angle": [0.02, 0.0][: links_of(block)]}
    return simulate(block, duration, 0.005, parameters=start | changes)


def energy_of(block: ContinuousBlock, share: float) -> float:
    """Energy (J) at rest, from hanging (0) to standing (1)."""
    mass, com, length = numbers(defaults(block), "mass", "com_distance", "length")
    upright = GRAVITY * sum(m * (c + length[:i].sum()) for i, (m, c) in enumerate(zip(mass, com, strict=True)))
    return (2 * share - 1) * upright


def test_the_swing_up_goes_over_the_top_again_and_again_at_the_energy_aimed_at() -> None:
    run = swung_up(PENDULUM, damping=0.0)
    assert np.ptp(run["angle"]) > 4 * 2 * np.pi
    assert run["energy"][-1] == pytest.approx(energy_of(PENDULUM, 1.2), rel=1e-6)  # reached long before
    assert np.diff(run["energy"]).min() > -1e-9  # J; it only rises on the way


def test_the_swing_up_to_the_energy_of_standing_stands_up_without_turning_over() -> None:
    run = swung_up(PENDULUM, swing_up_energy=1.0, damping=0.0)
    assert np.abs(run["angle"]).max() == pytest.approx(np.pi, abs=0.05)  # the last of it takes for ever
    assert np.abs(run["angle"]).max() < np.pi + 0.05
    assert run["energy"][-1] == pytest.approx(energy_of(PENDULUM, 1.0), rel=1e-6)


@BOTH
def test_the_drive_never_passes_its_torque_and_sits_in_the_first_joint(block: ContinuousBlock) -> None:
    run = swung_up(block, swing_up_torque=2.5)
    assert np.abs(run["joint_torque"][:, 0]).max() == pytest.approx(2.5, rel=1e-3)  # it is used in full
    assert np.abs(run["joint_torque"][:, 0]).max() < 2.5 + 1e-9
    assert np.abs(run["joint_torque"][:, 1:]).max(initial=0) < 1e-9  # rounding of some 100 N.m


def test_the_double_pendulum_swings_up_too() -> None:
    run = swung_up(DOUBLE_PENDULUM, 12.0)
    assert np.ptp(run["angle"][:, 0]) > 2 * np.pi
    assert run["energy"].max() == pytest.approx(energy_of(DOUBLE_PENDULUM, 1.2), rel=0.02)  # damping takes some


def test_errors_of_the_solver_grow_in_the_chaos_of_two_links_and_fall_with_the_fourth_power_of_its_step() -> None:
    """The figures of models/pendulum/README.md: 6e-5 rad after 2 s, 0.1 rad after 5 s, at 1 ms."""
    usual, half, fine = (
        simulate(DOUBLE_PENDULUM, 5.0, 0.1, parameters={"motion": 2, "max_step": h})["angle"]
        for h in (1e-3, 5e-4, 1e-4)
    )
    off, off_at_half = np.abs(usual - fine).max(axis=1), np.abs(half - fine).max(axis=1)
    assert off[:21].max() == pytest.approx(6e-5, rel=0.1)
    assert off.max() == pytest.approx(0.1, rel=0.1)
    assert off[:21].max() / off_at_half[:21].max() == pytest.approx(2**4, rel=0.1)  # less the next order


@BOTH
def test_the_truth_of_a_swing_up_is_one_motion(block: ContinuousBlock) -> None:
    values = OFF_AXIS | {"motion": 2, "initial_angle": 1.0}
    run = simulate(block, 3.0, 0.001, parameters=values | {"max_step": 2e-4})
    # RK4 at w = 40 rad/s, the fastest of the double pendulum: (w h)^5 / 120 = 3e-13 a step, 15000 steps, on 10 m.
    assert_truth_consistent(run, GRAVITY, np.array(MID_EUROPE), tolerance=1e-7)


@BOTH
def test_a_pendulum_that_hangs_still_is_not_swung_up(block: ContinuousBlock) -> None:
    run = simulate(block, 1.0, 0.1, parameters={"motion": 2, "initial_angle": 0.0})
    assert np.abs(run["angle"]).max() == 0
