"""Claims about the filter of Lee, Park, Robinovitch 2012."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from imufmu.blocks.running import Trajectory
from imufmu.blocks.vocabulary import Status
from imufmu.compiled.running import run
from imufmu.estimators.lee2012 import BLOCK
from support import golden, motions
from support.missing import without_accel
from support.motions import G, angle


def estimate(motion: motions.Motion, **parameters: Any) -> Trajectory:
    return run(BLOCK, {"gyro": motion.gyro, "accel": motion.accel}, {"sample_period": motion.dt} | parameters)


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


@pytest.fixture(scope="module")
def shaken() -> motions.Motion:
    """20 s of tumbling and shaking with quiet moments, as noisy as the filter assumes."""
    rng = np.random.default_rng(58)  # of those that begin with a quiet moment
    return motions.motion(rng, 2000, rate=1.0, acceleration=0.3).noisy(rng)


# Against the reference vectors


def golden_parameters(case: golden.Case) -> dict[str, Any]:
    same = {name: case.parameters[name] for name in ("mode", "c_a", "sigma_g2", "sigma_a2", "g", "eps_a", "n")}
    return same | {"sample_period": case.parameters["dt"]}


@pytest.mark.parametrize("given_start", [False, True], ids=["own_start", "given_start"])
@pytest.mark.parametrize("name", golden.names("lee2012"))
def test_every_column_equals_the_reference_vectors(name: str, given_start: bool) -> None:
    case = golden.load(name)
    inputs = {"gyro": golden.columns(case.inputs, "gyro", 3), "accel": golden.columns(case.inputs, "acc", 3)}
    start = {"Z": case.parameters["z0"], "a": case.parameters["a0"], "P": np.eye(3)} if given_start else None
    result = run(BLOCK, inputs, golden_parameters(case), initial_state=start)
    golden.assert_equal(result["vertical"], golden.columns(case.outputs, "Z", 3), "Z")
    golden.assert_equal(result["external_acceleration"], golden.columns(case.outputs, "a", 3), "a")
    golden.assert_equal(result["P"].reshape(-1, 9), golden.columns(case.outputs, "P", 9), "P")
    golden.assert_equal(result["roll"], case.outputs["roll"], "roll")
    golden.assert_equal(result["pitch"], case.outputs["pitch"], "pitch")


# Against the paper, written down a second time in NumPy


def reference(
    gyro: np.ndarray,
    accel: np.ndarray,
    dt: float,
    *,
    mode: int = 1,
    c_a: float = 0.1,
    sigma_g2: float = 1e-4,
    sigma_a2: float = 1e-4,
    eps_a: float = 0.2,
    n: int = 4,
    gyro_index: str = "prev",
    window: str = "eq30",
    early: str = "available",
    P0: float = 1.0,
    infinity: float = math.inf,
) -> dict[str, np.ndarray]:
    """(4) to (30) of the paper, with the readings that make them computable. infinity: the variance of (30)."""
    identity = np.eye(3)
    quiet = np.abs(np.linalg.norm(accel, axis=1) - G) <= eps_a
    samples = n + 1 if window == "eq30" else n
    Z = accel[0] / np.linalg.norm(accel[0])
    a, P = accel[0] - G * Z, P0 * identity
    rows, moving = [(Z, a, P)], [False]
    for t in range(1, len(accel)):
        w = {"prev": gyro[t - 1], "curr": gyro[t], "mid": (gyro[t - 1] + gyro[t]) / 2}[gyro_index]
        Phi = identity - dt * np.cross(identity, w)  # cross(identity, w) is the matrix of w x
        Z_cross = np.cross(identity, Z)
        Z, P = Phi @ Z, Phi @ P @ Phi.T + dt**2 * sigma_g2 * Z_cross @ Z_cross.T
        z, variance = accel[t], sigma_a2
        if mode == 1:
            z, variance = accel[t] - c_a * a, c_a**2 * (a @ a) / 3 + sigma_a2
        too_early = t < samples - 1 and early == "dynamic"
        moving.append(mode == 3 and (too_early or not quiet[max(t - samples + 1, 0) : t + 1].all()))
        variance = infinity if moving[-1] else variance
        if math.isfinite(variance):
            K = G * P @ np.linalg.inv(G**2 * P + variance * identity)
            Z, P = Z + K @ (z - G * Z), (identity - G * K) @ P
        Z = Z / np.linalg.norm(Z)
        a = accel[t] - G * Z
        rows.append((Z, a, P))
    Z, a, P = (np.array(column) for column in zip(*rows, strict=True))
    return {"vertical": Z, "external_acceleration": a, "P": P, "rejected": np.array(moving)}


# Reading of the reference, and the parameter of the block that selects it.
OPTIONS: list[tuple[dict[str, Any], dict[str, Any]]] = [
    ({}, {}),
    ({"gyro_index": "curr"}, {"gyro_index": 1}),
    ({"gyro_index": "mid"}, {"gyro_index": 2}),
    ({"window": "n"}, {"window_excludes_start": True}),
    ({"early": "dynamic"}, {"early_is_moving": True}),
    ({"window": "n", "early": "dynamic"}, {"window_excludes_start": True, "early_is_moving": True}),
    ({"n": 0}, {"n": 0}),
    ({"n": 0, "window": "n"}, {"n": 0, "window_excludes_start": True}),
    ({"eps_a": 0.05, "n": 20}, {"eps_a": 0.05, "n": 20}),
    ({"c_a": 1.0, "sigma_g2": 1e-6, "P0": 10.0}, {"c_a": 1.0, "sigma_g2": 1e-6, "P0": 10.0}),
    ({"sigma_a2": 1e-2, "P0": 0.0}, {"sigma_a2": 1e-2, "P0": 0.0}),
]


@pytest.mark.parametrize("mode", [1, 2, 3])
@pytest.mark.parametrize(("reading", "parameters"), OPTIONS, ids=lambda o: " ".join(f"{k}={v}" for k, v in o.items()))
def test_every_reading_equals_the_paper_written_down_again(
    mode: int, reading: dict[str, Any], parameters: dict[str, Any], shaken: motions.Motion
) -> None:
    result = estimate(shaken, mode=mode, **parameters)
    expected = reference(shaken.gyro, shaken.accel, shaken.dt, mode=mode, **reading)
    rejected = (result["status"].astype(int) & Status.ACCEL_REJECTED) > 0
    assert np.array_equal(rejected, expected.pop("rejected"))
    for name, values in expected.items():
        golden.assert_equal(result[name], values, name)


def test_the_readings_differ_on_this_motion(shaken: motions.Motion) -> None:
    """Else the comparison above shows little."""
    default = {mode: estimate(shaken, mode=mode) for mode in (1, 3)}
    assert 0.05 < np.mean(default[3]["status"] > 0) < 0.95
    for mode, parameters in [(1, OPTIONS[1][1]), (1, OPTIONS[2][1]), (3, OPTIONS[3][1]), (3, OPTIONS[4][1])]:
        changed = estimate(shaken, mode=mode, **parameters)
        assert np.abs(changed["vertical"] - default[mode]["vertical"]).max() > 1e-6


# What the paper says of it


def test_no_acceleration_model_is_the_static_mode(shaken: motions.Motion) -> None:
    none, static = estimate(shaken, mode=1, c_a=0.0), estimate(shaken, mode=2)
    assert np.allclose(none["vertical"], static["vertical"], rtol=0, atol=1e-12)
    assert np.allclose(none["external_acceleration"], static["external_acceleration"], rtol=0, atol=1e-11)  # times g


def test_a_rejected_sample_is_the_limit_of_an_infinite_variance(shaken: motions.Motion) -> None:
    result = estimate(shaken, mode=3)
    limit = reference(shaken.gyro, shaken.accel, shaken.dt, mode=3, infinity=1e30)
    for name in ("vertical", "external_acceleration", "P"):
        golden.assert_equal(result[name], limit[name], name)


@pytest.mark.parametrize("mode", [1, 2, 3])
def test_the_error_of_the_acceleration_is_minus_g_times_that_of_the_vertical(mode: int, shaken: motions.Motion) -> None:
    result = estimate(shaken, mode=mode)
    a_error = result["external_acceleration"] - (shaken.accel - G * shaken.vertical)
    assert np.allclose(a_error, -G * (result["vertical"] - shaken.vertical), rtol=0, atol=1e-12)
    assert np.abs(a_error).max() <= 2 * G


def test_the_acceleration_model_outlasts_a_short_acceleration() -> None:
    """3 s of 5 m/s2 rms per axis from a known attitude, four motions: about 2 deg; 30 deg in the static mode."""
    for seed in range(4):
        rng = np.random.default_rng(seed)
        motion = motions.motion(rng, 300, acceleration=5.0).noisy(rng)
        inputs = {"gyro": motion.gyro, "accel": motion.accel}
        known = {"Z": motion.vertical[0], "a": motion.acceleration[0], "P": 1e-6 * np.eye(3)}
        model, static = (run(BLOCK, inputs, {"mode": mode}, initial_state=known)["vertical"] for mode in (1, 2))
        assert rms(angle(model, motion.vertical)) < math.radians(4)
        assert rms(angle(static, motion.vertical)) > math.radians(15)


@pytest.mark.parametrize("mode", [1, 2, 3])
def test_rest_gives_the_right_vertical_from_a_wrong_start(mode: int) -> None:
    """Where the accelerometer is used at all: within 10 s, from any angle but the opposite one."""
    for attitude in Rotation.random(10, random_state=np.random.default_rng(4)):
        motion = motions.rest(attitude, 1000)
        wrong = estimate(motion, mode=mode, use_initial_angles=True, initial_roll=0.4, initial_pitch=-0.3)
        assert angle(wrong["vertical"], motion.vertical)[-1] < 1e-6


def test_given_angles_are_the_start(rng: np.random.Generator) -> None:
    motion = motions.motion(rng, 20)
    result = estimate(motion, use_initial_angles=True, initial_roll=-2.0, initial_pitch=0.5)
    assert (result["roll"][0], result["pitch"][0]) == pytest.approx((-2.0, 0.5), abs=1e-15)
    Z = result["vertical"][0]
    assert np.array_equal(result["external_acceleration"][0], motion.accel[0] - G * Z)


# The gyroscope alone


def test_without_accelerometer_the_gyroscope_carries_the_vertical() -> None:
    """1 rad/s for 5 s: the first-order step of (12) turns by atan(w dt), short by (w dt)^2 / 3 of it: 1.7e-4 rad.

    The external acceleration stays what it was.
    """
    motion = motions.turn(Rotation.identity(), np.array([0.6, -0.8, 0.0]), 501)
    result = run(BLOCK, without_accel(motion, 1))
    assert angle(result["vertical"], motion.vertical)[-1] == pytest.approx(5 * 0.01**2 / 3, rel=1e-3)
    assert np.array_equal(result["external_acceleration"], np.zeros((501, 3)))


def test_without_accelerometer_the_error_is_bias_times_time() -> None:
    """And the filter's own tilt_std grows meanwhile."""
    motion = motions.rest(Rotation.identity(), 1001)
    inputs = without_accel(motion, 1)
    inputs["gyro"] = motion.gyro + np.array([0.01, 0.0, 0.0])
    result = run(BLOCK, inputs)
    assert angle(result["vertical"], motion.vertical)[-1] == pytest.approx(0.01 * 10.0, rel=1e-3)
    assert np.all(np.diff(result["tilt_std"][1:]) > 0)


@pytest.mark.parametrize("mode", [1, 3])
def test_an_endless_gap_in_fast_rotation_stays_finite_and_ends_well(mode: int) -> None:
    """(25) grows by 1 + (w dt)^2 a sample: without a limit the covariance overflows within 6000 samples at 35 rad/s."""
    spin = motions.turn(Rotation.identity(), np.array([35.0, 0.0, 0.0]), 8000)
    after = motions.rest(spin.R_NS[-1], 500)
    during = spin.accel + np.array([20.0, 0, 0])
    if mode == 1:
        during[1:] = math.nan
    accel = np.vstack([during, after.accel])
    result = run(BLOCK, {"gyro": np.vstack([spin.gyro, after.gyro]), "accel": accel}, {"mode": mode})
    for name, values in result.values.items():
        assert np.isfinite(values).all(), name
    assert angle(result["vertical"][-1:], after.vertical[-1:])[0] < 1e-6
    assert result["tilt_std"][-1] < 0.01


# The filter about itself


@pytest.mark.parametrize("mode", [1, 2])
def test_tilt_std_is_honest_on_static_noise(mode: int, rng: np.random.Generator) -> None:
    """Noise as assumed: the root mean square tilt error of 200 s is what the filter says, within 10 %.

    The errors are correlated over some ten samples, so 20 000 of them fix their mean square to about 3 %.
    """
    motion = motions.rest(Rotation.from_euler("ZYX", [0.2, 0.5, -0.7]), 20_000).noisy(rng, std=0.01)
    result = estimate(motion, mode=mode)
    error = rms(angle(result["vertical"], motion.vertical)[100:])
    assert np.mean(result["tilt_std"][100:]) == pytest.approx(error, rel=0.1)


@pytest.mark.parametrize("bound", ["minimum", "maximum"])
def test_the_covariance_stays_positive_at_the_bounds_of_every_parameter(bound: str, shaken: motions.Motion) -> None:
    parameters = {q.name: getattr(q, bound) for q in BLOCK.parameters if q.name not in ("mode", "sample_period")}
    for mode in (1, 2, 3):
        P = estimate(shaken, **parameters, mode=mode)["P"]
        smallest = np.linalg.eigvalsh((P + P.transpose(0, 2, 1)) / 2)[:, 0]
        assert np.all(smallest >= -1e-14 * np.trace(P, axis1=1, axis2=2))  # rounding of the largest element


def test_a_sharp_accelerometer_and_a_vague_start_keep_the_covariance() -> None:
    """(I - K H) P written out loses every digit where g^2 P / sigma_A^2 exceeds 1e16."""
    motion = motions.rest(Rotation.identity(), 3)
    P = estimate(motion, mode=2, P0=1e5, sigma_g2=0.0, sigma_a2=1e-9)["P"]
    assert np.allclose(P[1], 1e-9 / G**2 * np.eye(3), rtol=1e-9, atol=0)
    assert np.allclose(P[2], 1e-9 / G**2 / 2 * np.eye(3), rtol=1e-9, atol=0)
