"""What lee2012 and zihajehzadeh2014 share: prediction, update and uncertainty of a direction."""

from __future__ import annotations

import math
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest

from imufmu.estimators.direction_filter import LARGEST_TRACE, predict, tilt_std, update

Z = np.array([2.0, -1.0, 2.0]) / 3
ACROSS = np.linalg.svd(Z[None, :])[2][1:]  # two unit vectors square to Z and to each other
P_OF = SimpleNamespace(sample_period=ca.DM(0.01), sigma_g2=ca.DM(1e-4), model_error=ca.DM(0), g=ca.DM(9.8))


def numbers(expression: object) -> np.ndarray:
    return np.array(ca.DM(expression)).squeeze()


def random_covariance(rng: np.random.Generator, sizes: tuple[float, float, float]) -> np.ndarray:
    """Symmetric, with these eigenvalues along random axes."""
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return axes @ np.diag(sizes) @ axes.T


def test_an_error_along_the_vertical_is_no_tilt_and_one_across_it_is() -> None:
    along, (one, other) = np.outer(Z, Z), (np.outer(a, a) for a in ACROSS)
    assert float(tilt_std(ca.DM(Z), ca.DM(1e-2 * along), P_OF)) < 1e-8  # root of the rounding of 0.01
    assert float(tilt_std(ca.DM(Z), ca.DM(9e-4 * one), P_OF)) == pytest.approx(0.03)
    assert float(tilt_std(ca.DM(Z), ca.DM(9e-4 * one + 16e-4 * other + along), P_OF)) == pytest.approx(0.05)


def test_an_update_is_that_of_the_textbook(rng: np.random.Generator) -> None:
    """All three elements at once with a matrix inverse, (26) to (28), for covariances it can still tell."""
    for sizes, M, scale in (
        ((1.0, 0.1, 1e-3), 1e-4, 9.8),
        ((1e-4, 1e-6, 1e-5), 0.3, 9.8),
        ((2.0, 1.0, 0.5), 1e-2, 1.0),
    ):
        P, d, z = random_covariance(rng, sizes), rng.normal(size=3), rng.normal(size=3)
        S = scale**2 * P + M * np.eye(3)
        K = scale * P @ np.linalg.inv(S)
        after = update(ca.DM(d), ca.DM(P), ca.DM(z), ca.DM(M), scale, ca.DM(1))
        assert numbers(after[0]) == pytest.approx(d + K @ (z - scale * d), rel=1e-9, abs=1e-12)
        assert numbers(after[1]) == pytest.approx(P - K @ S @ K.T, rel=1e-9, abs=1e-14)
        assert numbers(after[2]) == pytest.approx(z - scale * d)
        unchanged = update(ca.DM(d), ca.DM(P), ca.DM(z), ca.DM(M), scale, ca.DM(0))
        assert numbers(unchanged[0]).tolist() == d.tolist()
        assert numbers(unchanged[1]) == pytest.approx(P, abs=1e-15)


def test_a_prediction_turns_the_covariance_and_adds_the_gyroscope(rng: np.random.Generator) -> None:
    P, gyro = random_covariance(rng, (1e-2, 1e-3, 1e-4)), np.array([1.0, -2.0, 3.0])
    cross = np.array([[0, -gyro[2], gyro[1]], [gyro[2], 0, -gyro[0]], [-gyro[1], gyro[0], 0]])
    Phi = np.eye(3) - 0.01 * cross
    noise = 1e-8 * (np.eye(3) - np.outer(Z, Z))  # across Z only
    direction, after = predict(ca.DM(Z), ca.DM(P), ca.DM(gyro), P_OF)
    assert numbers(direction) == pytest.approx(Phi @ Z)
    assert numbers(after) == pytest.approx(Phi @ P @ Phi.T + noise, rel=1e-9, abs=1e-15)


def test_where_nothing_is_known_any_more_the_covariance_is_that_of_any_direction(rng: np.random.Generator) -> None:
    """Not one that has shrunk to a plane."""
    P = random_covariance(rng, (2 * LARGEST_TRACE, 1.0, 1e-9))
    _, after = predict(ca.DM(Z), ca.DM(P), ca.DM([0.0, 0.0, 0.0]), P_OF)
    assert numbers(after).tolist() == (LARGEST_TRACE / 3 * np.eye(3)).tolist()


def test_a_prediction_heals_what_rounding_broke(rng: np.random.Generator) -> None:
    """An eigenvalue below 0 by the last digits of the largest, and no noise of a gyroscope that would lift it."""
    perfect = SimpleNamespace(sample_period=ca.DM(0.01), sigma_g2=ca.DM(0.0))
    for _ in range(20):
        P = random_covariance(rng, (1e5, 1e-6, -1e-10))
        _, after = predict(ca.DM(Z), ca.DM(P), ca.DM([0.0, 0.0, 0.0]), perfect)
        assert np.linalg.eigvalsh(numbers(after))[0] > 0


def test_an_update_after_a_long_gap_leaves_every_eigenvalue_positive(rng: np.random.Generator) -> None:
    """A variance of 3e5 across one axis, nearly none along others, a sharp accelerometer: the inverse lost its sign."""
    for _ in range(200):
        P = random_covariance(rng, (3e5, 1e-6, 1e-9))
        _, predicted = predict(ca.DM(Z), ca.DM(P), ca.DM(rng.normal(0, 30, 3)), P_OF)
        _, after, _ = update(ca.DM(Z), predicted, ca.DM(9.8 * Z), ca.DM(1e-4), 9.8, ca.DM(1))
        assert np.linalg.eigvalsh(numbers(after))[0] > 0
        assert math.isfinite(float(tilt_std(ca.DM(Z), after, P_OF)))
