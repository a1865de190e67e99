"""Claims about the filter of Lee, Choi 2018."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from imufmu.blocks.running import Trajectory
from imufmu.compiled.running import run
from imufmu.estimators import leechoi2018
from imufmu.estimators.leechoi2018 import BLOCK
from support import golden, motions
from support.missing import without_accel
from support.motions import G, angle

FAST = 0.05  # s, the slowest sampling of the paper: a sample of fast motion turns by half a radian


def estimate(motion: motions.Motion, **parameters: Any) -> Trajectory:
    return run(BLOCK, {"gyro": motion.gyro, "accel": motion.accel}, {"sample_period": motion.dt} | parameters)


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def smallest_eigenvalue(P: np.ndarray) -> np.ndarray:
    """Of each matrix (n, 6, 6), as part of its trace."""
    return np.linalg.eigvalsh(P)[:, 0] / np.trace(P, axis1=1, axis2=2)


@pytest.fixture(scope="module")
def fast() -> motions.Motion:
    """30 s of very fast tumbling at 20 Hz, as noisy as the filter assumes."""
    rng = np.random.default_rng(2018)
    return motions.motion(rng, 600, dt=FAST, rate=4.0, acceleration=0.5).noisy(rng)


# Against the reference vectors


@pytest.mark.parametrize("given_start", [False, True], ids=["own_start", "given_start"])
@pytest.mark.parametrize("name", golden.names("leechoi"))
def test_every_column_equals_the_reference_vectors(name: str, given_start: bool) -> None:
    case = golden.load(name)
    given = case.parameters
    parameters = {q: given[q] for q in ("order", "c_a", "c_b", "sigma_g2", "sigma_a2", "g", "normalise")}
    parameters |= {"process_noise_order": given["q_order"], "sample_period": given["dt"]}
    inputs = {"gyro": golden.columns(case.inputs, "gyro", 3), "accel": golden.columns(case.inputs, "acc", 3)}
    start = {"g": given["x0"][:3], "a": given["x0"][3:], "P": np.eye(6)} if given_start else None
    result = run(BLOCK, inputs, parameters, initial_state=start)
    golden.assert_equal(result["gravity"], golden.columns(case.outputs, "g", 3), "g")
    golden.assert_equal(result["external_acceleration"], golden.columns(case.outputs, "a", 3), "a")
    golden.assert_equal(result["P"].reshape(-1, 36), golden.columns(case.outputs, "P", 36), "P")
    golden.assert_equal(result["roll"], case.outputs["roll"], "roll")
    golden.assert_equal(result["pitch"], case.outputs["pitch"], "pitch")


# Against the paper, written down a second time in NumPy


def cross(v: np.ndarray) -> np.ndarray:
    """Matrix of v x (5)."""
    return np.cross(np.eye(3), v)


def process(y: np.ndarray, g: np.ndarray, dt: float, order: int) -> tuple[np.ndarray, np.ndarray]:
    """Transition matrix (15) and noise gain (14), both (3, 3)."""
    Y = cross(y)
    Phi = np.eye(3) - dt * Y
    K = -dt * cross(g)
    if order >= 2:
        Phi = Phi + dt**2 * Y @ Y / 2
        K = K + dt**2 / 2 * (Y @ cross(g) + cross(Y @ g))
    if order >= 3:
        Phi = Phi - dt**3 * Y @ Y @ Y / 6
        K = K - dt**3 / 6 * (Y @ Y @ cross(g) + cross(Y @ Y @ g) + Y @ cross(Y @ g))
    return Phi, K


def reference(
    motion: motions.Motion,
    *,
    order: int = 3,
    process_noise_order: int = 1,
    c_a: float = 0.1,
    c_b: float = 0.1,
    sigma_g2: float = 1e-4,
    sigma_a2: float = 1e-4,
    P0: float = 1.0,
    gyro_index: int = 0,
    normalise: bool = False,
) -> dict[str, np.ndarray]:
    """(10) to (17) of the paper with the ordinary Kalman filter, one inverse and no structure used."""
    y_G, y_A, O3, H = motion.gyro, motion.accel, np.zeros((3, 3)), np.hstack([np.eye(3), np.eye(3)])
    x, P = np.concatenate([G * y_A[0] / np.linalg.norm(y_A[0]), np.zeros(3)]), P0 * np.eye(6)
    rows = [(x, P, np.zeros(3))]
    for t in range(1, len(y_A)):
        y = (y_G[t - 1], y_G[t], (y_G[t - 1] + y_G[t]) / 2)[gyro_index]
        Phi = np.block([[process(y, x[:3], motion.dt, order)[0], O3], [O3, c_a * np.eye(3)]])
        K_g = process(y, x[:3], motion.dt, process_noise_order or order)[1]
        Q = np.block([[sigma_g2 * K_g @ K_g.T, O3], [O3, c_b**2 * np.eye(3)]])
        x, P = Phi @ x, Phi @ P @ Phi.T + Q
        innovation = y_A[t] - H @ x
        K = P @ H.T @ np.linalg.inv(H @ P @ H.T + sigma_a2 * np.eye(3))
        x, P = x + K @ innovation, (np.eye(6) - K @ H) @ P
        if normalise:
            x[:3] *= G / np.linalg.norm(x[:3])
        rows.append((x.copy(), P, innovation))
    x, P, innovation = (np.array(column) for column in zip(*rows, strict=True))
    return {"gravity": x[:, :3], "external_acceleration": x[:, 3:], "P": P, "innovation": innovation}


OPTIONS: list[dict[str, Any]] = [
    *({"order": order, "process_noise_order": noise} for order in (1, 2, 3) for noise in (0, 1, 2, 3)),
    {"gyro_index": 1},
    {"gyro_index": 2},
    {"normalise": True},
    {"normalise": True, "order": 1},
    {"c_a": 0.0, "c_b": 1.0},
    {"c_a": 1.0, "c_b": 0.01},
    {"sigma_g2": 1e-6, "sigma_a2": 1e-2, "P0": 10.0},
    {"P0": 0.0},
]


def named(options: Mapping[str, Any]) -> str:
    return " ".join(f"{name}={value}" for name, value in options.items())


@pytest.mark.parametrize("options", OPTIONS, ids=named)
def test_every_option_equals_the_paper_written_down_again(options: dict[str, Any], fast: motions.Motion) -> None:
    result = estimate(fast, **options)
    for name, values in reference(fast, **options).items():
        golden.assert_equal(result[name], values, name)


def test_the_options_differ_on_this_motion(fast: motions.Motion) -> None:
    """Else the comparison above shows little. Noise orders 0 and 3 are one where the integration has order 3."""
    verticals = [estimate(fast, **options)["vertical"] for options in OPTIONS]
    same = [(i, j) for i, a in enumerate(verticals) for j, b in enumerate(verticals[:i]) if np.abs(a - b).max() < 1e-6]
    assert same == [(1, 0), (6, 4), (11, 8)]


# What the paper says of it


@pytest.mark.parametrize("order", [1, 2, 3])
def test_the_noise_gain_is_the_slope_of_the_prediction(order: int, rng: np.random.Generator) -> None:
    """(14) against Phi(y_G - n) g, differentiated by CasADi, at some 20 random rates and gravities."""
    y, n, g, dt = ca.SX.sym("y", 3), ca.SX.sym("n", 3), ca.SX.sym("g", 3), 0.05
    predicted = leechoi2018.transition(dt * ca.skew(y - n), order) @ g
    slope = ca.substitute(ca.jacobian(predicted, n), n, ca.SX.zeros(3))
    gain = leechoi2018.noise_gain(dt * ca.skew(y), g, dt, order)
    difference = ca.Function("difference", [y, g], [slope - gain])
    for _ in range(20):
        values = np.array(difference(rng.normal(0, 10, 3), rng.normal(0, 10, 3)))
        assert np.abs(values).max() < 1e-13  # rounding of terms up to 1


@pytest.mark.parametrize("order", [1, 2, 3])
def test_the_integration_is_of_its_order(order: int) -> None:
    """One sample of a steady turn: half the sample period, error over 2^(order + 1)."""

    def error(dt: float) -> float:
        motion = motions.turn(Rotation.identity(), np.array([1.0, -2.0, 0.5]), 2, dt)
        predicted = run(BLOCK, without_accel(motion, 1), {"sample_period": dt, "order": order})["gravity"][1]
        return float(np.linalg.norm(predicted - G * motion.vertical[1]))

    assert math.log2(error(0.02) / error(0.01)) == pytest.approx(order + 1, abs=0.05)  # next order: 0.02


def test_a_higher_order_follows_a_fast_turn_better(fast: motions.Motion) -> None:
    error = {n: rms(angle(estimate(fast, order=n)["vertical"], fast.vertical)) for n in (1, 2, 3)}
    assert error[1] > 1.1 * error[2] > 1.2 * error[3]


def test_the_order_makes_no_difference_to_a_slow_turn(rng: np.random.Generator) -> None:
    slow = motions.motion(rng, 1000, rate=0.3, acceleration=0.5).noisy(rng)
    error = [rms(angle(estimate(slow, order=n)["vertical"], slow.vertical)) for n in (1, 3)]
    assert error[0] == pytest.approx(error[1], rel=0.01)


def test_first_order_integration_lengthens_gravity() -> None:
    """By (w dt)^2 / 2 a sample, across the axis of the turn, where nothing corrects it."""
    motion = motions.turn(Rotation.identity(), np.array([2.0, 0.0, 0.0]), 51)
    length = np.linalg.norm(run(BLOCK, without_accel(motion, 1), {"order": 1})["gravity"], axis=1)
    assert np.allclose(length, G * (1 + 0.02**2) ** (np.arange(51) / 2), rtol=1e-12, atol=0)


def test_normalised_gravity_has_its_length(fast: motions.Motion) -> None:
    length = np.linalg.norm(estimate(fast, order=1, normalise=True)["gravity"], axis=1)
    assert np.allclose(length, G, rtol=1e-14, atol=0)


def test_gravity_and_acceleration_share_out_what_the_accelerometer_reads(fast: motions.Motion) -> None:
    """All but its noise: of an innovation the filter leaves sigma_A^2 / (sigma_A^2 + c_b^2), here 1 %."""
    result = estimate(fast)
    left = fast.accel - result["gravity"] - result["external_acceleration"]
    assert np.all(np.linalg.norm(left[1:], axis=1) <= 0.01 * np.linalg.norm(result["innovation"][1:], axis=1))


def test_rest_gives_the_right_vertical_from_a_wrong_start() -> None:
    """Within 20 s, from any angle but the opposite one."""
    for attitude in Rotation.random(10, random_state=np.random.default_rng(4)):
        motion = motions.rest(attitude, 2000)
        wrong = estimate(motion, use_initial_angles=True, initial_roll=0.4, initial_pitch=-0.3)
        assert angle(wrong["vertical"], motion.vertical)[-1] < 1e-6


def test_given_angles_are_the_start(rng: np.random.Generator) -> None:
    result = estimate(motions.motion(rng, 20), use_initial_angles=True, initial_roll=-2.0, initial_pitch=0.5)
    assert (result["roll"][0], result["pitch"][0]) == pytest.approx((-2.0, 0.5), abs=1e-15)
    assert np.array_equal(result["external_acceleration"][0], np.zeros(3))


# The gyroscope alone


def test_without_accelerometer_the_gyroscope_carries_the_vertical() -> None:
    """1 rad/s for 5 s: a step of third order is short by (w dt)^5 / 30 of turn and longer by nothing that turns."""
    motion = motions.turn(Rotation.identity(), np.array([0.6, -0.8, 0.0]), 501)
    result = run(BLOCK, without_accel(motion, 1))
    assert angle(result["vertical"], motion.vertical)[-1] == pytest.approx(500 * 0.01**5 / 30, rel=0.01)
    assert np.array_equal(result["external_acceleration"], np.zeros((501, 3)))


def test_without_accelerometer_the_error_is_bias_times_time() -> None:
    """And the filter's own tilt_std grows meanwhile."""
    motion = motions.rest(Rotation.identity(), 1001)
    inputs = without_accel(motion, 1)
    inputs["gyro"] = motion.gyro + np.array([0.01, 0.0, 0.0])
    result = run(BLOCK, inputs)
    assert angle(result["vertical"], motion.vertical)[-1] == pytest.approx(0.01 * 10.0, rel=1e-3)
    assert np.all(np.diff(result["tilt_std"][1:]) > 0)


def test_without_accelerometer_the_acceleration_fades_as_modelled(fast: motions.Motion) -> None:
    result = run(BLOCK, without_accel(fast, 100), {"sample_period": fast.dt, "c_a": 0.5})
    a = result["external_acceleration"]
    assert np.allclose(a[100:110], a[99] * 0.5 ** np.arange(1, 11)[:, None], rtol=1e-14, atol=0)


@pytest.mark.parametrize("dt", [0.01, FAST])
@pytest.mark.parametrize("order", [1, 2, 3])
def test_an_endless_gap_in_fast_rotation_stays_finite_and_ends_well(order: int, dt: float) -> None:
    """Gravity grows (orders 1 and 2) or shrinks (order 3) with every sample, and the covariance with it."""
    spin = motions.turn(Rotation.identity(), np.array([25.0, 10.0, 0.0]), 8000, dt)
    after = motions.rest(spin.R_NS[-1], 1000, dt)
    accel = np.vstack([without_accel(spin, 1)["accel"], after.accel])
    inputs = {"gyro": np.vstack([spin.gyro, after.gyro]), "accel": accel}
    result = run(BLOCK, inputs, {"sample_period": dt, "order": order})
    for signal in BLOCK.reported:
        values = result[signal.name]
        assert np.all((values >= signal.minimum) & (values <= signal.maximum)), signal.name
    assert np.array_equal(result["P"], result["P"].transpose(0, 2, 1))
    assert np.all(smallest_eigenvalue(result["P"]) >= -1e-12)
    assert angle(result["vertical"][-1:], after.vertical[-1:])[0] < 1e-6
    assert result["tilt_std"][-1] < 0.01


def test_a_gap_leaves_the_covariance_symmetric(fast: motions.Motion) -> None:
    P = run(BLOCK, without_accel(fast, 20), {"sample_period": FAST})["P"]
    assert np.array_equal(P, P.transpose(0, 2, 1))


# Missing samples


def test_a_missing_accelerometer_sample_is_the_limit_of_an_infinite_variance(fast: motions.Motion) -> None:
    """Nothing of the sample enters, up to 1e-12 of the variance of the state over that of the sample."""
    gap = run(BLOCK, without_accel(fast, 50), {"sample_period": fast.dt})
    state = {"g": gap["gravity"][49], "a": gap["external_acceleration"][49], "P": gap["P"][49]}
    rest = {"gyro": fast.gyro[49:55], "accel": fast.accel[49:55]}
    vague = run(BLOCK, rest, {"sample_period": fast.dt, "sigma_a2": 1e6}, initial_state=state)
    assert np.allclose(vague["gravity"], gap["gravity"][49:55], rtol=0, atol=1e-6)
    assert np.allclose(vague["P"], gap["P"][49:55], rtol=0, atol=1e-9)


# The filter about itself


def test_tilt_std_is_honest_where_the_acceleration_is_as_modelled() -> None:
    """At rest but for acceleration and noise of the filter's own model, 600 s.

    The errors are correlated over some hundred samples, so 60 000 of them fix their mean square to about 6 %.
    """
    rng, n = np.random.default_rng(7), 60_000
    motion = motions.rest(Rotation.from_euler("ZYX", [0.2, 0.5, -0.7]), n).noisy(rng, std=0.01)
    a = np.zeros((n, 3))
    for t in range(1, n):
        a[t] = 0.1 * a[t - 1] + 0.1 * rng.normal(size=3)  # (3)
    result = run(BLOCK, {"gyro": motion.gyro, "accel": motion.accel + a})
    error = rms(angle(result["vertical"], motion.vertical)[1000:])
    assert np.mean(result["tilt_std"][1000:]) == pytest.approx(error, rel=0.1)
    a_std = np.sqrt(np.mean(result["P"][1000:, 3, 3]))
    assert rms((result["external_acceleration"] - a)[1000:]) == pytest.approx(a_std, rel=0.1)


@pytest.mark.parametrize("bound", ["minimum", "maximum"])
@pytest.mark.parametrize("order", [1, 2, 3])
def test_the_covariance_stays_positive_at_the_bounds_of_every_parameter(
    bound: str, order: int, fast: motions.Motion
) -> None:
    """One at a time and all together; without any variance at the start there is nothing to stay positive."""
    fixed = ("sample_period", "order", "P0")
    bounds = {q.name: getattr(q, bound) for q in BLOCK.parameters if q.name not in fixed}
    for parameters in (*({name: value} for name, value in bounds.items()), bounds, bounds | {"P0": 1e5}):
        P = estimate(fast, order=order, **parameters)["P"]
        assert np.array_equal(P, P.transpose(0, 2, 1))
        assert np.all(smallest_eigenvalue(P) >= -1e-14)  # rounding of the largest element


@pytest.mark.parametrize("samples", [20_000, pytest.param(1_000_000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("order", [1, 3])
def test_the_covariance_stays_symmetric_and_positive(order: int, samples: int) -> None:
    """Nearly three hours at 100 Hz, fast rotation all the time."""
    rng, chunk = np.random.default_rng(10), 1000
    motion = motions.motion(rng, chunk, rate=5.0, acceleration=2.0).noisy(rng)
    u = np.hstack([motion.gyro, motion.accel]).T
    p = BLOCK.parameter_vector({"order": order})
    x = np.array(BLOCK.first_function(u[:, 0], p, np.zeros(0))[0])
    many = BLOCK.next_function.mapaccum(chunk)
    for _ in range(samples // chunk):
        x = np.array(many(x, u, np.tile(p[:, None], chunk), np.zeros((0, chunk)))[0][:, -1])
        P = x[6:42].reshape(1, 6, 6)  # state: g, a, P, ...
        assert np.array_equal(P[0], P[0].T)
        assert np.trace(P[0]) < 1
        assert smallest_eigenvalue(P)[0] > 0


def test_huge_inputs_leave_finite_outputs_and_are_forgotten() -> None:
    """A second of what no sensor reads, then rest."""
    motion = motions.rest(Rotation.from_euler("ZYX", [0.3, 0.2, 0.1]), 3000)
    motion.gyro[100:200] = np.random.default_rng(1).normal(0, 1e20, (100, 3))
    motion.accel[100:200] = np.random.default_rng(2).normal(0, 1e20, (100, 3))
    for order in (1, 2, 3):
        result = estimate(motion, order=order)
        for name, values in result.values.items():
            assert np.isfinite(values).all(), name
        assert angle(result["vertical"], motion.vertical)[-1] < 1e-6
