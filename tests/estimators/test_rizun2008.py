"""Claims about the filter of Rizun 2008."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from imufmu.blocks.running import Trajectory
from imufmu.blocks.vocabulary import Status
from imufmu.compiled.running import run
from imufmu.estimators.rizun2008 import BLOCK
from imufmu.recordings import reading as recordings
from imufmu.scoring import prediction
from imufmu.scoring.metrics import inclination_error
from support import golden, motions
from support.motions import angle

G = 9.80665  # m/s2, start value of the block
SPLIT, EXACT = 0, 1
ROOT2 = math.sqrt(2)


def estimate(motion: motions.Motion, **parameters: Any) -> Trajectory:
    return run(BLOCK, {"gyro": motion.gyro, "accel": motion.accel}, {"sample_period": motion.dt} | parameters)


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


@pytest.fixture(scope="module")
def shaken() -> motions.Motion:
    """20 s of tumbling and shaking, with noise."""
    rng = np.random.default_rng(8)
    return motions.motion(rng, 2000, rate=1.5, acceleration=3.0).noisy(rng)


# Against the reference vectors


@pytest.mark.parametrize("by_parameters", [False, True], ids=["initial_state", "g0_and_h0"])
@pytest.mark.parametrize(("name", "discretisation"), [("rizun_split_fr", SPLIT), ("rizun_exact", EXACT)])
def test_every_column_equals_the_reference_vectors(name: str, discretisation: int, by_parameters: bool) -> None:
    """Row k of the reference is the state after sample k was held for a period: the locals g_held and h_held."""
    case = golden.load(name)
    inputs = {"gyro": golden.columns(case.inputs, "gyro", 3), "accel": golden.columns(case.inputs, "acc", 3)}
    parameters = {
        "sample_period": case.parameters["dt"],
        "cutoff": case.parameters["wg"],
        "discretisation": discretisation,
    }
    start = {"g": case.parameters["g0"], "h": case.parameters["h0"]}
    if by_parameters:
        given = {"use_initial_gravity": True, "g0": start["g"], "h0": start["h"]}
        result = run(BLOCK, inputs, parameters | given)
    else:
        result = run(BLOCK, inputs, parameters, initial_state=start)
    golden.assert_equal(result["g_held"], golden.columns(case.outputs, "g", 3), "g")
    golden.assert_equal(result["h_held"], golden.columns(case.outputs, "h", 3), "h")


# Against the paper, written down a second time


def skew(w: np.ndarray) -> np.ndarray:
    return np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])


def of_40(w: np.ndarray, wg: float) -> np.ndarray:
    """Matrix (9, 9) of (40) for (g, h, y), y constant in S."""
    W, eye = skew(w), np.eye(3)
    zero = np.zeros((3, 3))
    return np.block([[-W, eye, zero], [-(wg**2) * eye, -W - ROOT2 * wg * eye, wg**2 * eye], [zero, zero, zero]])


def butterworth(wg: float) -> np.ndarray:
    """Matrix (9, 9) of (37) for (g, D g, y), y constant in the gyro-estimated Earth frame."""
    return of_40(np.zeros(3), wg)


def streamed(motion: motions.Motion, wg: float, gyro_index: int = 0) -> np.ndarray:
    """Gravity (n, 3) of the form for streams: rotate by a gyroscope sample, then a Butterworth step with accel[k]."""
    Phi = expm(butterworth(wg) * motion.dt)
    g, h = motion.accel[0], np.zeros(3)
    rows = []
    for k, y in enumerate(motion.accel):
        if k > 0:
            before, now = motion.gyro[k - 1], motion.gyro[k]
            turn = Rotation.from_rotvec([before, now, (before + now) / 2][gyro_index] * motion.dt).inv()
            g, h = turn.apply(g), turn.apply(h)
        g, h, _ = np.split(Phi @ np.concatenate([g, h, y]), 3)
        rows.append(g)
    return np.array(rows)


@pytest.mark.parametrize("gyro_index", [0, 1, 2])
@pytest.mark.parametrize("wg", [0.05, 0.7, 20.0])
def test_a_stream_sees_rotation_then_butterworth_step(wg: float, gyro_index: int, shaken: motions.Motion) -> None:
    result = estimate(shaken, cutoff=wg, gyro_index=gyro_index)
    g = streamed(shaken, wg, gyro_index)
    golden.assert_equal(result["vertical"], g / np.linalg.norm(g, axis=1)[:, None], "vertical")
    golden.assert_equal(result["external_acceleration"], shaken.accel - g, "external acceleration")


@pytest.mark.parametrize("wg", [0.05, 0.7, 20.0])
def test_the_exact_form_is_the_matrix_exponential(wg: float, shaken: motions.Motion) -> None:
    g, h = shaken.accel[0], np.zeros(3)
    rows = []
    for w, y in zip(shaken.gyro[:300], shaken.accel, strict=False):
        g, h, _ = np.split(expm(of_40(w, wg) * shaken.dt) @ np.concatenate([g, h, y]), 3)
        rows.append(np.concatenate([g, h]))
    result = estimate(shaken, cutoff=wg, discretisation=EXACT)
    golden.assert_equal(np.hstack([result["g_held"], result["h_held"]])[:300], np.array(rows), "g and h")


def test_both_forms_tend_to_one_solution_for_short_periods() -> None:
    """Their distance is half a sample of rotation: it halves with the period."""
    distance = []
    for dt in (0.02, 0.01, 0.005):
        motion = motions.turn(Rotation.identity(), np.array([0.5, 1.0, 0.0]), round(60 / dt), dt)
        split, exact = (estimate(motion, discretisation=d)["g_held"][-1] for d in (SPLIT, EXACT))
        distance.append(float(np.linalg.norm(split - exact)))
    assert np.array(distance[:-1]) / distance[1:] == pytest.approx([2, 2], rel=0.01)


# Cut-off


def test_the_cutoff_follows_from_the_densities_unless_it_is_given(shaken: motions.Motion) -> None:
    densities = {"gyro_noise_density": math.radians(0.2), "velocity_noise_density": 2.0}
    optimal = math.sqrt(G * math.radians(0.2) / 2.0)  # (25)
    follows, given = estimate(shaken, **densities), estimate(shaken, cutoff=optimal)
    assert follows["omega_g"][0] == given["omega_g"][0] == pytest.approx(optimal, rel=1e-15)
    assert np.array_equal(follows["vertical"], given["vertical"])
    assert estimate(shaken, **densities, cutoff=0.7)["omega_g"][0] == 0.7


@pytest.mark.parametrize("frequency", [0.1, 0.7, 3.0])
def test_the_response_to_vibration_is_that_of_a_butterworth_filter(frequency: float) -> None:
    """Of second order, -3 dB at the cut-off. frequency: rad/s, at a cut-off of 0.7 rad/s."""
    t = np.arange(0, 200, 0.01)
    accel = np.column_stack([np.exp(1j * frequency * t).real, np.exp(1j * frequency * t).imag, np.full(t.size, G)])
    result = run(BLOCK, {"gyro": np.zeros((t.size, 3)), "accel": accel}, {"cutoff": 0.7})
    gain = np.hypot(*result["g_held"][-1, :2])
    # Holding a sample delays it by half a period, and changes its amplitude by (frequency dt)^2 / 24.
    assert gain == pytest.approx(abs(prediction.wiener_response(frequency, 0.7)), rel=1e-4)


# What the paper says of it


def test_a_steady_turn_leaves_no_error_and_half_a_sample_with_the_exact_form() -> None:
    motion = motions.turn(Rotation.identity(), np.array([0.0, 2.0, 0.0]), 20_000)
    split = angle(estimate(motion)["vertical"], motion.vertical)
    assert split.max() < 1e-9
    after = Rotation.from_rotvec(-motion.gyro * motion.dt).apply(motion.vertical)  # at the end of each period
    exact = angle(estimate(motion, discretisation=EXACT)["g_held"], after)
    assert exact[-1] == pytest.approx(0.5 * 2.0 * 0.01, rel=1e-3)  # to second order in the angle


@pytest.mark.parametrize("discretisation", [SPLIT, EXACT])
@pytest.mark.parametrize("rate", [20.0, 300.0, 1000.0])
def test_nothing_grows_at_any_angular_rate(rate: float, discretisation: int) -> None:
    """An Euler step of (40) does, above 4.3 rad/s."""
    n = 20_000
    gyro = np.tile(rate * np.array([0.6, 0.0, 0.8]), (n, 1))
    accel = np.random.default_rng(3).normal(0, 10, (n, 3))
    result = run(BLOCK, {"gyro": gyro, "accel": accel}, {"discretisation": discretisation})
    assert np.linalg.norm(result["g_held"], axis=1).max() < 1.1 * np.linalg.norm(accel, axis=1).max()
    assert np.linalg.norm(result["g_held"][n // 2 :], axis=1).max() < 5.0  # the mean of the input is 0


def test_moving_in_a_circle_leaves_no_bias() -> None:
    """Section 2.4: 2 rad/s at 0.8 m reads as a tilt of 18 deg; the filter keeps H(2 rad/s) of it, and that turns."""
    motion = motions.turn(Rotation.identity(), np.array([0.0, 0.0, 2.0]), 40_000)
    accel = motion.accel + np.array([-3.2, 0.0, G - motions.G])
    tilt = angle(run(BLOCK, {"gyro": motion.gyro, "accel": accel})["vertical"], motion.vertical)
    cutoff = prediction.optimal_cutoff(1.745e-3, 1.0, G)
    assert tilt[-1] == pytest.approx(abs(prediction.wiener_response(2.0, cutoff)) * 3.2 / G, rel=1e-3)


def test_an_initial_error_settles_as_predicted() -> None:
    motion = motions.rest(Rotation.identity(), 6000)
    accel = motion.accel.copy()
    accel[0] += [3.0, 0.0, 0.0]
    result = run(BLOCK, {"gyro": motion.gyro, "accel": accel}, {"cutoff": 0.5})
    part = np.abs(result["g_held"][:, 0]) / 3.0
    row = round(prediction.settling_time(0.5) / 0.01)
    assert part[row - 5] > prediction.SETTLED > part[row + 5]  # 0.05 s either way
    assert part[row + 5 :].max() < prediction.SETTLED


def test_a_gyroscope_bias_tilts_as_predicted() -> None:
    motion = motions.rest(Rotation.identity(), 6000)
    biased = motion.gyro + np.array([0.002, 0.0, 0.0])
    tilt = angle(run(BLOCK, {"gyro": biased, "accel": motion.accel}, {"cutoff": 0.5})["vertical"], motion.vertical)
    assert tilt[-1] == pytest.approx(prediction.bias_tilt(0.5, 0.002), rel=0.01)  # small angles, 15 time constants


# The filter about itself


def test_tilt_std_is_honest_in_the_motion_it_was_made_for() -> None:
    """2000 s of white velocity: the mean square of the error has 10 % of scatter, its root 5 %."""
    rng, dt, n = np.random.default_rng(17), 0.05, 40_000
    delta_n, delta_v = math.radians(0.5), 0.5
    velocity = rng.normal(0, delta_v * math.sqrt(0.5 / dt), (n + 1, 3))
    gyro = rng.normal(0, delta_n * math.sqrt(0.5 / dt), (n, 3))
    accel = np.array([0.0, 0.0, G]) + np.diff(velocity, axis=0) / dt
    densities = {"gyro_noise_density": delta_n, "velocity_noise_density": delta_v}
    result = run(BLOCK, {"gyro": gyro, "accel": accel}, {"sample_period": dt} | densities)
    error = angle(result["vertical"], np.tile([0.0, 0.0, 1.0], (n, 1)))[n // 20 :]
    assert result["tilt_std"][-1] == pytest.approx(prediction.tilt_rms(delta_n, delta_v), rel=1e-12)
    assert rms(error) == pytest.approx(result["tilt_std"][-1], rel=0.1)


def test_tilt_std_begins_with_the_start_decays_and_grows_while_blind() -> None:
    motion = motions.rest(Rotation.identity(), 9000)
    accel = motion.accel.copy()
    accel[6000:] = math.nan
    result = run(BLOCK, {"gyro": motion.gyro, "accel": accel}, {"cutoff": 0.5, "initial_tilt_std": 0.3})
    steady = math.sqrt(prediction.tilt_variance(0.5, 1.745e-3, 1.0, G))
    assert result["tilt_std"][0] == pytest.approx(math.hypot(steady, 0.3))
    amplitude = math.exp(-0.5 * 2.0 / ROOT2)  # of the filter's own response after 2 s
    assert result["tilt_std"][200] == pytest.approx(math.hypot(steady, 0.3 * amplitude))
    assert result["tilt_std"][5999] == pytest.approx(steady, rel=1e-9)
    blind = prediction.gyro_drift_rms(1.745e-3, 2999 * 0.01)  # row 6000 is the state before the first blind period
    assert result["tilt_std"][8999] == pytest.approx(math.hypot(steady, blind), rel=1e-9)
    assert run(BLOCK, {"accel": accel}, {"initial_tilt_std": math.pi})["tilt_std"][0] == math.pi


# Missing samples


def flags(result: Trajectory) -> list[int]:
    return result["status"].astype(int).tolist()


def test_without_accelerometer_gravity_follows_the_gyroscope_and_the_filter_stands_still() -> None:
    motion = motions.turn(Rotation.identity(), np.array([0.6, -0.8, 0.5]), 3000)
    accel = motion.accel.copy()
    accel[1000:2000] = math.nan
    result = run(BLOCK, {"gyro": motion.gyro, "accel": accel})
    assert angle(result["vertical"], motion.vertical).max() < 1e-9
    assert np.array_equal(result["external_acceleration"][1000:2000], np.zeros((1000, 3)))
    assert flags(result) == [0] * 1000 + [Status.ACCEL_MISSING] * 1000 + [0] * 1000


def test_a_gap_at_rest_only_stops_the_clock(rng: np.random.Generator) -> None:
    """The samples after it are taken as if they followed those before it."""
    accel = np.array([0.0, 0.0, G]) + rng.normal(0, 1.0, (400, 3))
    gap = np.full((150, 3), math.nan)
    zero = np.zeros((550, 3))
    whole = run(BLOCK, {"gyro": zero[:400], "accel": accel})
    interrupted = run(BLOCK, {"gyro": zero, "accel": np.vstack([accel[:200], gap, accel[200:]])})
    assert np.array_equal(interrupted["vertical"][350:], whole["vertical"][200:])


def test_a_missing_gyroscope_sample_is_the_last_one_held(shaken: motions.Motion) -> None:
    missing, held = shaken.gyro.copy(), shaken.gyro.copy()
    missing[10:15], held[10:15] = math.nan, held[9]
    one, other = (run(BLOCK, {"gyro": gyro, "accel": shaken.accel}) for gyro in (missing, held))
    assert np.array_equal(one["vertical"], other["vertical"])
    assert flags(one)[9:16] == [0, *[Status.GYRO_MISSING] * 5, 0]


@pytest.mark.parametrize("unusable", [math.nan, 0.0, 5e-324, 1e-150], ids=str)
def test_the_first_usable_accelerometer_sample_starts_the_filter(unusable: float, shaken: motions.Motion) -> None:
    """A missing one, and one without a direction (an input that nobody has set yet), are waited out."""
    accel = shaken.accel.copy()
    accel[:7] = unusable
    late = run(BLOCK, {"gyro": shaken.gyro, "accel": accel})
    own = run(BLOCK, {"gyro": shaken.gyro[7:], "accel": accel[7:]})
    for name in ("vertical", "external_acceleration", "tilt_std"):
        assert np.array_equal(late[name][7:], own[name]), name
    waiting = Status.NOT_INITIALISED | (Status.ACCEL_MISSING if math.isnan(unusable) else 0)
    assert flags(late) == [waiting] * 7 + [0] * (len(accel) - 7)
    assert np.array_equal(late["vertical"][:7], np.tile([0, 0, 1], (7, 1)))
    assert np.array_equal(late["external_acceleration"][:7], np.zeros((7, 3)))
    assert np.array_equal(late["tilt_std"][:8], np.full(8, late["tilt_std"][0]))


def test_the_first_sample_is_taken_for_gravity(shaken: motions.Motion) -> None:
    first = estimate(shaken)["vertical"][0]
    assert np.allclose(first, shaken.accel[0] / np.linalg.norm(shaken.accel[0]), rtol=0, atol=1e-15)


def test_given_gravity_starts_the_filter_without_accelerometer() -> None:
    motion = motions.turn(Rotation.from_euler("X", 0.7), np.array([1.0, 0, 0]), 11)
    nothing = np.full_like(motion.accel, math.nan)
    given = {"use_initial_gravity": True, "g0": 5.0 * motion.vertical[0]}
    result = run(BLOCK, {"gyro": motion.gyro, "accel": nothing}, given)
    assert flags(result) == [Status.ACCEL_MISSING] * 11
    assert angle(result["vertical"], motion.vertical).max() < 1e-14


# Real recordings


@pytest.mark.slow
def test_real_recordings_come_out_within_a_degree_or_so(broad: Path) -> None:
    """Mean over the trials, cut-off 0.7 rad/s for gyroscopes with bias: measured 1.31, 0.97 and 1.11 deg.

    These gyroscopes report the mean rate since the sample before.
    """
    means = []
    for gyro_index in (0, 1, 2):
        errors = []
        for path in sorted(broad.glob("*.mat")):
            trial = recordings.read(path)
            inputs = {"gyro": trial.gyro, "accel": trial.accel}
            parameters = {"sample_period": trial.sample_period, "cutoff": 0.7, "gyro_index": gyro_index}
            result = run(BLOCK, inputs, parameters)
            tilt = inclination_error(result["vertical"][trial.scored], trial.truth["vertical"][trial.scored])
            errors.append(math.degrees(rms(tilt)))
        means.append(np.mean(errors))
    assert means[0] < 1.4 and means[1] < 1.0 and means[2] < 1.2
