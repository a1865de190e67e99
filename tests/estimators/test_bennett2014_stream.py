"""Claims about bennett2014 at work: median, rest at the start, missing samples, the covariance over a long time."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy.signal import medfilt

from imufmu.blocks.vocabulary import Status
from imufmu.compiled.running import run
from imufmu.estimators.bennett2014 import BLOCK
from imufmu.estimators.running_median import centred_median
from support import golden
from support.arm import DT, GYRO_ONLY, RAW, Arm, estimate, flags, inputs_of, moved, states, swing


@pytest.fixture(scope="module")
def arm() -> Arm:
    return swing().noisy(np.random.default_rng(14))


# The median


def test_the_centred_median_of_a_record_shrinks_at_its_ends(rng: np.random.Generator) -> None:
    values = rng.normal(size=(40, 3))
    expected = [np.median(values[max(k - 2, 0) : k + 3], axis=0) for k in range(40)]
    assert np.array_equal(centred_median(values), expected)
    assert np.array_equal(centred_median(values[:, 0]), np.array(expected)[:, 0])
    assert np.array_equal(centred_median(values[:1]), values[:1])


def test_the_median_with_zeros_at_the_ends_is_that_of_medfilt(rng: np.random.Generator) -> None:
    values = rng.normal(size=40)
    assert np.array_equal(centred_median(values, edge="zero"), medfilt(values, 5))
    with pytest.raises(ValueError, match=r"edge = 'wrap'; expected one of shrink, zero"):
        centred_median(values, edge="wrap")  # type: ignore[arg-type]


def test_the_median_removes_lost_packets_of_two_samples(arm: Arm) -> None:
    """What the paper uses it for. Zeros in their place would throw the raw filter off by a radian."""
    A = arm.A.copy()
    A[1000:1002] = 0.0
    A[2000:2002] = 500.0
    whole, lossy = (estimate(Arm(arm.theta, arm.s, x), median=True)["segment_angle"] for x in (arm.A, A))
    assert np.abs(lossy - whole).max() < 1e-3


# Rest at the start


@pytest.mark.parametrize("median", [False, True])
def test_the_biases_are_the_mean_of_the_rest_and_the_angles_wait(median: bool, arm: Arm) -> None:
    """Up to rounding, and from then on the filter runs as one that was given these biases."""
    rest, late = 400, 2 * median
    learning = estimate(arm, rest_time=rest * DT, median=median, initial_angle=(-1.5, 0.1))
    s = centred_median(arm.s) if median else arm.s
    held = learning["status"].astype(int) & Status.NOT_INITIALISED > 0
    assert np.array_equal(held, np.arange(len(held)) < rest + late)
    assert np.array_equal(learning["angle"][held], np.tile([-1.5, 0.1], (rest + late, 1)))
    assert np.allclose(learning["gyro_bias"][rest + late - 1], s[:rest].mean(axis=0), rtol=0, atol=1e-15)
    given = {"initial_bias": s[:rest].mean(axis=0), "initial_angle": (-1.5, 0.1), "median": median}
    after = estimate(Arm(arm.theta, arm.s[rest - 1 :], arm.A[rest - 1 :]), **given)
    if not median:  # with one the first window would be another
        golden.assert_equal(learning["segment_angle"][rest - 1 :], after["segment_angle"], "segment_angle")


def test_samples_missing_during_the_rest_do_not_count(arm: Arm) -> None:
    s = arm.s.copy()
    s[0] = s[50:60] = math.nan
    learnt = estimate(Arm(arm.theta, s, arm.A), rest_time=400 * DT)["gyro_bias"][399]
    assert np.allclose(learnt, np.nanmean(s[:400], axis=0), rtol=0, atol=1e-15)


# Missing samples


def test_status_names_each_missing_sample_and_clears(arm: Arm) -> None:
    inputs = {name: values[:8].copy() for name, values in inputs_of(arm.s, arm.A).items()}
    inputs["gyro1"][1, 0] = inputs["gyro2"][2, 2] = inputs["accel2"][[2, 4], 1] = math.nan
    inputs["accel2"][6] = 0.0
    result = run(BLOCK, inputs, {"sample_period": DT, "variant": RAW})
    gyro, accel = Status.GYRO_MISSING, Status.ACCEL_MISSING
    assert flags(result) == [0, gyro, gyro | accel, 0, accel, 0, Status.ACCEL_REJECTED, 0]


def test_a_missing_gyroscope_sample_is_the_last_one_held(arm: Arm) -> None:
    missing, held = arm.s.copy(), arm.s.copy()
    missing[1000:1005, 1], held[1000:1005, 1] = math.nan, held[999, 1]
    one, other = (estimate(Arm(arm.theta, s, arm.A))["segment_angle"] for s in (missing, held))
    assert np.array_equal(one, other)


@pytest.mark.parametrize("unusable", [math.nan, 0.0, 1e-200], ids=str)
def test_without_a_usable_accelerometer_the_gyroscopes_go_on(unusable: float, arm: Arm) -> None:
    """Exactly as in the variant without one; and the filter's own tilt_std says so."""
    nothing = estimate(Arm(arm.theta, arm.s, np.full_like(arm.A, unusable)), variant=RAW)
    gyro_only = estimate(arm, variant=GYRO_ONLY)
    assert np.array_equal(states(nothing), states(gyro_only))
    assert np.array_equal(nothing["P"], gyro_only["P"])
    assert np.all(np.diff(nothing["tilt_std"][10:]) > 0)
    assert nothing["tilt_std"][-1] > 2 * estimate(arm)["tilt_std"][-1]


def test_with_the_median_a_sample_is_missing_where_most_of_its_window_is(arm: Arm) -> None:
    """Two of five are the business of the median, with the last sample held in their place; of six some are left out.

    The covariance of angles, rates and biases depends on that alone (and on slow), not on the readings.
    """
    whole = estimate(arm, median=True)["P"][:, 2:, 2:]
    for length, updates in ((2, True), (6, False)):
        A = arm.A.copy()
        A[1000 : 1000 + length] = math.nan
        P = estimate(Arm(arm.theta, arm.s, A), median=True)["P"][:, 2:, 2:]
        assert np.array_equal(P, whole) == updates


# The covariance


@pytest.mark.parametrize(
    "samples", [100_000, pytest.param(10_000_000, marks=pytest.mark.slow)], ids=["1e5_samples", "1e7_samples"]
)
def test_the_covariance_stays_symmetric_and_positive(samples: int) -> None:
    """The printed (23) diverges when its rounding errors differ between the two triangles of P.

    The variance of theta_1 grows all the time, up to 1e4 rad2, while that of theta_1 + theta_2 stays below 1e-5.
    """
    rows = 2000
    t = np.arange(rows)[:, None] * DT
    size, speed = np.array([0.6, 0.4]), 2 * np.pi * np.array([0.4, 0.8])  # whole swings in 10 s: the record repeats
    theta = size * np.sin(speed * t) + (-np.pi / 2, 0)
    arm = moved(theta, size * speed * np.cos(speed * t), -size * speed**2 * np.sin(speed * t))
    u = np.hstack([*inputs_of(arm.s, arm.A).values()]).T
    p = np.tile(BLOCK.parameter_vector({"sample_period": DT})[:, None], rows)
    x, no_draws = BLOCK.first_function(u[:, 0], p[:, 0], [])[0], np.zeros((0, rows))
    many = BLOCK.next_function.fold(rows)
    for _ in range(samples // rows):
        x = many(x, u, p, no_draws)[0]
    P = np.array(x).ravel()[10:110].reshape(10, 10)
    assert np.array_equal(P, P.T)
    deviation = np.sqrt(np.diag(P))
    assert np.linalg.eigvalsh(P / np.outer(deviation, deviation))[0] > 0  # correlations: a positive P of any scale
    assert P[2, 2] > 0.1
    assert 1e-6 < P[2, 2] + P[5, 5] + 2 * P[2, 5] < 1e-5


def test_the_outputs_stay_finite_at_every_corner_of_the_tuning() -> None:
    """All noise variances and start variances at their bounds: ratios up to 1e18, far beyond double precision."""
    rng = np.random.default_rng(3)
    inputs = inputs_of(rng.normal(0, 2, (400, 2)), rng.normal(0, 10, (400, 2)))
    bounds = {q.name: (q.minimum, q.maximum) for q in BLOCK.parameters}
    names = (("r1", "r2"), ("r3_slow", "r3_fast"), ("q_d",), ("q_1", "q_2"), ("q_b",), ("P0",))
    for corner in itertools.product((0, 1), repeat=len(names)):
        parameters = {n: bounds[n][i] for group, i in zip(names, corner, strict=True) for n in group}
        result = run(BLOCK, inputs, {"sample_period": DT} | parameters)
        assert all(np.isfinite(values).all() for values in result.values.values()), parameters


def test_tilt_std_is_honest_on_the_filters_own_model(rng: np.random.Generator) -> None:
    """White jerk, white noise, biases that wander: the error of the segment is what the filter says, within 10 %.

    30 runs of 5 s from the start variances: the errors are correlated over some 20 samples, so the mean of their
    squares is sure to some 3 %.
    """
    n, q, r, r3 = 1000, 1e3, 2.25e-6, 0.01
    B = q * np.array(
        [[DT**5 / 20, DT**4 / 8, DT**3 / 6], [DT**4 / 8, DT**3 / 3, DT**2 / 2], [DT**3 / 6, DT**2 / 2, DT]]
    )
    Phi = np.array([[1, DT, 0], [0, 1, DT], [0, 0, 1]])
    ratios = []
    for _ in range(30):
        jerks = rng.multivariate_normal(np.zeros(3), B, (n, 2), method="cholesky")
        joints = [rng.normal(0, np.sqrt([1e-4, 1e-4, 1e-2]), (2, 3)) + np.array([[-np.pi / 2, 0, 0], [0, 0, 0]])]
        for jerk in jerks[1:]:
            joints.append(joints[-1] @ Phi.T + jerk)
        joint = np.array(joints)  # (n, joint, derivative)
        bias = rng.normal(0, 1e-3, 2) + np.cumsum(rng.normal(0, 1e-6, (n, 2)), axis=0)
        s = np.cumsum(joint[:, :, 1], axis=1) + bias + rng.normal(0, math.sqrt(r), (n, 2))
        s3 = joint[:, :, 0].sum(axis=1) + rng.normal(0, math.sqrt(r3), n)
        result = estimate(Arm(joint[:, :, 0], s, np.column_stack([np.sin(s3), -np.cos(s3)])), variant=RAW, r3_fast=r3)
        error = result["segment_angle"] - joint[:, :, 0].sum(axis=1)
        ratios.append(np.mean((error / result["tilt_std"]) ** 2))
    assert math.sqrt(np.mean(ratios)) == pytest.approx(1, abs=0.1)
