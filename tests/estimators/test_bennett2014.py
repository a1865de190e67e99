"""Claims about the equations of bennett2014: reference vectors, the paper written down again, what the paper says."""

from __future__ import annotations

import itertools
import math
from typing import Any

import casadi as ca
import numpy as np
import pytest

from imufmu.blocks.running import Trajectory
from imufmu.blocks.vocabulary import Status
from imufmu.compiled.running import run, simulate
from imufmu.estimators import bennett2014
from imufmu.estimators.bennett2014 import BLOCK
from imufmu.plants.pendulum import DOUBLE_PENDULUM
from support import golden
from support.arm import (
    A1,
    A2,
    CORRECTED,
    DT,
    GYRO_ONLY,
    RAW,
    VARIANTS,
    Arm,
    estimate,
    flags,
    golden_inputs,
    golden_parameters,
    moved,
    resting,
    rms,
    states,
    swing,
)


@pytest.fixture(scope="module")
def arm() -> Arm:
    return swing().noisy(np.random.default_rng(14))


# Against the reference vectors


def assert_golden(result: Trajectory, case: golden.Case, late: int = 0) -> None:
    rows = len(result.time)
    expected = {name: values[: rows - late] for name, values in case.outputs.items()}
    expected["theta_corr"][0] = expected["theta_raw"][0]  # the reference has none; the block reports the raw one
    golden.assert_equal(states(result)[late:], golden.columns(expected, "x", 10), "x")
    golden.assert_equal(result["raw_angle"][late:], expected["theta_raw"], "theta_raw")
    golden.assert_equal(result["corrected_angle"][late:], expected["theta_corr"], "theta_corr")
    assert np.array_equal(result["slow"][late:], expected["slow"])


@pytest.mark.parametrize("given_start", [False, True], ids=["own_start", "given_start"])
@pytest.mark.parametrize("name", golden.names("bennett"))
def test_every_column_equals_the_reference_vectors(name: str, given_start: bool) -> None:
    case = golden.load(name)
    start = {"x": case.parameters["x0"], "P": case.parameters["P0"]} if given_start else None
    assert_golden(run(BLOCK, golden_inputs(case), golden_parameters(name, case), initial_state=start), case)


@pytest.mark.parametrize("name", golden.names("bennett"))
def test_the_median_of_a_stream_gives_the_reference_vectors_two_samples_late(name: str) -> None:
    """From raw samples, sample by sample, without knowledge of later ones, and from the first sample on."""
    case = golden.load(name)
    result = run(BLOCK, golden_inputs(case, "_raw"), golden_parameters(name, case) | {"median": True})
    assert_golden(result, case, late=2)
    assert np.array_equal(result["delay"], np.full(len(result.time), 2 * case.parameters["dt"]))
    assert flags(result)[:3] == [Status.NOT_INITIALISED, Status.NOT_INITIALISED, 0]


# Against the paper, written down a second time in NumPy


def reference(arm: Arm, variant: int, *, corr_state: int = 0, slow_rule: int = 0, **changes: Any) -> dict[str, Any]:
    """(10) to (23) with matrices, a general inverse, and (4), (7), (8) in the complex plane."""
    start = {"P0": (1e-6, 1e-6, 1e-4, 1e-4, 1e-2, 1e-4, 1e-4, 1e-2, 1e-6, 1e-6), "bias": (0, 0)}
    tuning = {"q_d": 1e-8, "q_1": 1e3, "q_2": 1e3, "q_b": 1e-12, "r1": 2.25e-6, "r2": 2.25e-6}
    c = start | tuning | {"r3_slow": 0.01, "r3_fast": 1.0, "delta": 2.0, "a1": A1, "a2": A2} | changes
    H = np.zeros((3, 10))
    H[0, [3, 8]] = H[1, [3, 6, 9]] = H[2, [2, 5]] = 1
    powers = np.array(
        [[DT**5 / 20, DT**4 / 8, DT**3 / 6], [DT**4 / 8, DT**3 / 3, DT**2 / 2], [DT**3 / 6, DT**2 / 2, DT]]
    )
    Q = np.diag([c["q_d"]] * 2 + [0] * 6 + [c["q_b"]] * 2)
    Q[2:5, 2:5], Q[5:8, 5:8] = c["q_1"] * powers, c["q_2"] * powers
    x = np.array([0, -c["a1"] - c["a2"], -np.pi / 2, 0, 0, 0, 0, 0, *c["bias"]])
    P = np.diag(c["P0"])
    rows, slow = [(x, P)], []
    for k, ((s1, s2), A) in enumerate(zip(arm.s, arm.A, strict=True)):
        slow.append((abs(s1) + abs(s2) if slow_rule else max(abs(s1), abs(s2))) < c["delta"])
        if k == 0:
            continue
        elbow, wrist = c["a1"] * np.exp(1j * x[2]), c["a2"] * np.exp(1j * (x[2] + x[5]))
        F = np.zeros((10, 10))
        F[0, [3, 6]], F[1, [3, 6]] = (
            np.real([1j * (elbow + wrist), 1j * wrist]),
            np.imag([1j * (elbow + wrist), 1j * wrist]),
        )
        F[[2, 3, 5, 6], [3, 4, 6, 7]] = 1
        Phi = np.eye(10) + F * DT
        before, x, P = x, Phi @ x, Phi @ P @ Phi.T + Q
        b = before if corr_state else x
        e1, e12, w12, al12 = np.exp(1j * b[2]), np.exp(1j * (b[2] + b[5])), b[3] + b[6], b[4] + b[7]
        moving = c["a1"] * e1 * (1j * b[4] - b[3] ** 2) + c["a2"] * e12 * (1j * al12 - w12**2)
        g = A[0] - 1j * A[1] - (moving / e12 if variant == CORRECTED else 0)
        R = np.diag([c["r1"], c["r2"], c["r3_slow"] if slow[k] else c["r3_fast"]])
        innovation = np.array([s1, s2, np.angle(1j * np.conj(g))]) - H @ x
        innovation[2] = np.angle(np.exp(1j * innovation[2]))
        m = 2 if variant == GYRO_ONLY else 3
        K = P @ H[:m].T @ np.linalg.inv(H[:m] @ P @ H[:m].T + R[:m, :m])
        x = x + K @ innovation[:m]
        P = (np.eye(10) - K @ H[:m]) @ P
        P = (P + P.T) / 2
        rows.append((x, P))
    return {"x": np.array([x for x, _ in rows]), "P": np.array([P for _, P in rows]), "slow": np.array(slow)}


OPTIONS: list[dict[str, Any]] = [
    {},
    {"slow_rule": 1},
    {"corr_state": 1},
    {"delta": 0.5, "r3_slow": 0.003, "r3_fast": 30.0, "r1": 1e-5, "r2": 1e-6},
    {"q_d": 1e-4, "q_1": 2e4, "q_2": 50.0, "q_b": 1e-9, "a1": 0.43, "a2": 0.1},
    {"P0": np.linspace(1e-5, 1e-2, 10)},
]


@pytest.mark.parametrize("variant", VARIANTS.values(), ids=VARIANTS)
@pytest.mark.parametrize("options", OPTIONS, ids=lambda options: " ".join(options) or "defaults")
def test_every_reading_equals_the_paper_written_down_again(variant: int, options: dict[str, Any], arm: Arm) -> None:
    result, expected = estimate(arm, variant=variant, **options), reference(arm, variant, **options)
    golden.assert_equal(states(result), expected["x"], "x")
    golden.assert_equal(result["P"], expected["P"], "P")
    assert np.array_equal(result["slow"], expected["slow"])


def test_the_readings_differ_on_this_motion(arm: Arm) -> None:
    """Else the comparison above shows little."""
    default = estimate(arm)
    assert 0.2 < default["slow"].mean() < 0.8
    for other in ({"variant": RAW}, {"variant": GYRO_ONLY}, {"slow_rule": 1}, {"corr_state": 1}):
        assert np.abs(estimate(arm, **other)["segment_angle"] - default["segment_angle"]).max() > 1e-5


# The kinematics


def test_velocity_and_acceleration_are_derivatives_of_the_position(rng: np.random.Generator) -> None:
    """(3) and (6) in F, and (4) and (7) turned by (8), against derivatives of (2) and (5) that nobody typed."""
    joints, t = ca.SX.sym("joints", 6), ca.SX.sym("t")
    theta = [joints[i] + joints[i + 1] * t + joints[i + 2] * t**2 / 2 for i in (0, 3)]
    p = type("Lengths", (), {"a1": A1, "a2": A2, "sample_period": DT})
    x = ca.vertcat(0, 0, joints, 0, 0)
    place = ca.vertcat(*bennett2014.position(ca.vertcat(0, 0, theta[0], 0, 0, theta[1]), p))
    velocity = ca.jacobian(place, t)
    by_filter = ((bennett2014.transition(x, p) @ x - x) / DT)[:2]
    c, s = ca.cos(joints[0] + joints[3]), ca.sin(joints[0] + joints[3])
    acceleration = ca.blockcat([[c, s], [s, -c]]) @ ca.jacobian(velocity, t)  # (8)
    pairs = ca.vertcat(velocity - by_filter, acceleration - bennett2014.motion_acceleration(x, p))
    difference = ca.Function("difference", [joints, t], [pairs])
    for values in rng.uniform(-3, 3, (20, 6)):
        assert np.abs(np.array(difference(values, 0))).max() < 1e-12  # rounding of terms up to 30 m/s2


def test_the_frames_are_those_of_the_double_pendulum() -> None:
    """Two plants in the same driven motion with perfect IMUs: every output against the truth of the plant."""
    leg = {
        "motion": 1,
        "mount": (0, math.pi / 2, math.pi / 2),
        "length": (0.2, 0.4),
        "heading": 0.8,
        "imu_distance": 0.35,
    }
    first, second = (simulate(DOUBLE_PENDULUM, 15.0, DT, parameters=leg | {"imu_link": i}) for i in (1, 2))
    readings = {
        "gyro1": first["angular_velocity"],
        "gyro2": second["angular_velocity"],
        "accel2": second["specific_force"],
    }
    result = run(BLOCK, readings, {"sample_period": DT})
    # (12) is of first order: an angle is behind by up to half a sample of its rate, and the rest adds a little.
    behind = 1.1 * DT / 2 * np.abs(second["angle_rate"]).sum(axis=1).max()
    assert np.abs(result["angle"] - second["angle"] + (math.pi / 2, 0)).max() < behind
    assert np.abs(result["vertical"] - second["vertical"]).max() < behind
    # The acceleration is behind by a sample or two, the rate hardly.
    assert np.abs(result["angle_rate"] - second["angle_rate"]).max() < 1e-3
    assert np.abs(result["external_acceleration"] - second["external_acceleration"]).max() < 0.2
    assert np.abs(second["external_acceleration"]).max() > 5.0


@pytest.mark.parametrize("theta", list(itertools.product((-3.1, -1.0, 0.0, 2.0), (-2.5, 0.0, math.pi))), ids=str)
def test_at_rest_the_raw_and_the_corrected_angle_are_that_of_the_link(theta: tuple[float, float]) -> None:
    """In every quadrant, also where the angle has gone more than half a turn."""
    result = estimate(resting(theta, 50), initial_angle=theta)
    for name in ("raw_angle", "corrected_angle"):
        assert np.abs(np.exp(1j * result[name]) - np.exp(1j * sum(theta))).max() < 1e-12  # rounding
    assert result["segment_angle"] == pytest.approx(np.full(50, sum(theta)), abs=1e-12)


# What the paper says of it


def test_the_correction_beats_the_raw_accelerometer_and_the_gyroscopes_alone() -> None:
    """A rest, 30 s of swings, and a bias that drifted by 0.25 deg/s since the rest. Measured: 0.1 and 0.3 times."""
    arm = swing(30.0, fastest=1.5).noisy(np.random.default_rng(1), bias=(0.0044, 0.0044))
    error = {v: rms(estimate(arm, variant=v)["segment_angle"] - arm.segment) for v in VARIANTS.values()}
    assert error[CORRECTED] < 0.6 * error[GYRO_ONLY]
    assert error[CORRECTED] < 0.6 * error[RAW]


def test_the_accelerometer_corrects_the_sum_of_the_angles_and_nothing_else() -> None:
    """A wrong bias of link 1 turns both joints at that rate, apart; the segment stays."""
    bias, n = 0.01, 4000
    result = estimate(
        Arm(*(getattr(resting((-1.0, 0.5), n), k) for k in ("theta", "s", "A"))),
        initial_bias=(bias, 0),
        initial_angle=(-1.0, 0.5),
    )
    assert result["segment_angle"][-1] == pytest.approx(-0.5, abs=1e-3)
    drift = result["angle"][-1] - (-1.0, 0.5)
    assert drift == pytest.approx(
        (-bias * n * DT, bias * n * DT), rel=0.03
    )  # less at first: it started as an error of the start


def test_the_bias_of_the_second_gyroscope_is_found() -> None:
    arm = resting((-math.pi / 2, 0.0), 40_000)
    result = estimate(Arm(arm.theta, arm.s + np.array([0.0, 0.02]), arm.A))
    assert result["gyro_bias"][-1] == pytest.approx((0.0, 0.02), abs=1e-3)


def test_the_segment_turns_over_and_over_without_a_jump() -> None:
    """Three turns at 4 rad/s about joint 1: s_3 jumps by a turn three times, the estimate does not."""
    t = np.arange(0, 3 * 2 * np.pi / 4, DT)
    rate = np.column_stack([np.full(len(t), 4.0), np.zeros(len(t))])
    arm = moved(rate * t[:, None] + (-np.pi / 2, 0), rate, np.zeros_like(rate))
    result = estimate(arm, initial_state={"x": [0, -0.55, -np.pi / 2, 4.0, 0, 0, 0, 0, 0, 0]})
    assert np.ptp(result["raw_angle"]) > 6
    assert np.abs(result["segment_angle"] - arm.segment).max() < 1e-3
