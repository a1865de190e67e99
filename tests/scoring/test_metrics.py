"""Errors are what their definitions say, also where these are delicate."""

from __future__ import annotations

import numpy as np
import pytest

from imufmu.blocks.rotations import (
    conjugate,
    euler_from_quaternion,
    multiply,
    over_rows,
    quaternion_from_euler,
    quaternion_from_rotation_vector,
)
from imufmu.blocks.running import Trajectory
from imufmu.scoring import metrics

N = 500


def random_attitudes(seed: int) -> np.ndarray:
    """Uniformly distributed unit quaternions (N, 4)."""
    q = np.random.default_rng(seed).standard_normal((N, 4))
    return q / np.linalg.norm(q, axis=1, keepdims=True)


def errors_in_N(q_NS_hat: np.ndarray, q_NS: np.ndarray) -> np.ndarray:
    return over_rows(lambda p, q: multiply(p, conjugate(q)), q_NS_hat, q_NS)


def test_inclination_error_is_that_of_broad() -> None:
    """2 arccos(sqrt(w^2 + z^2)) of the error quaternion in the Earth frame."""
    q_NS_hat, q_NS = random_attitudes(1), random_attitudes(2)
    w, _, _, z = errors_in_N(q_NS_hat, q_NS).T
    broad = 2 * np.arccos(np.minimum(np.hypot(w, z), 1.0))
    ours = metrics.inclination_error(metrics.vertical_of(q_NS_hat), metrics.vertical_of(q_NS))
    # The arccosine multiplies rounding by 1 / sin of its value, here at least 0.02.
    np.testing.assert_allclose(ours, broad, atol=1e-13)


def test_heading_error_is_that_of_broad() -> None:
    """2 arctan(abs(z / w)) of the error quaternion in the Earth frame."""
    q_NS_hat, q_NS = random_attitudes(3), random_attitudes(4)
    w, _, _, z = errors_in_N(q_NS_hat, q_NS).T
    # The quotient and two arctangents round once each.
    np.testing.assert_allclose(np.abs(metrics.heading_error(q_NS_hat, q_NS)), 2 * np.arctan(np.abs(z / w)), atol=4e-15)


def test_heading_error_has_the_sign_of_the_turn_and_ignores_the_sign_of_the_quaternion() -> None:
    q_NS = random_attitudes(5)
    turn = np.random.default_rng(6).uniform(-np.pi, np.pi, N)
    about_up = over_rows(quaternion_from_rotation_vector, np.column_stack([0 * turn, 0 * turn, turn]))
    q_NS_hat = over_rows(multiply, about_up, q_NS)
    for q in (q_NS_hat, -q_NS_hat):
        np.testing.assert_allclose(metrics.heading_error(q, q_NS), turn, atol=2e-15)  # two products, rounded


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-6, 1.0, np.pi - 1e-9, np.pi])
def test_inclination_error_is_accurate_at_every_size(angle: float) -> None:
    error = metrics.inclination_error(np.array([[0.0, 0.0, 1.0]]), np.array([[np.sin(angle), 0.0, np.cos(angle)]]))
    # One rounding of a vertical of length 1, and relative accuracy of the small sine.
    assert error[0] == pytest.approx(angle, rel=1e-15, abs=1e-16 + 2e-16 * (angle > 3))


def test_inclination_error_does_not_depend_on_heading() -> None:
    rng = np.random.default_rng(7)
    roll, pitch, yaw, other_yaw = rng.uniform(-1.5, 1.5, (4, N))
    one = over_rows(quaternion_from_euler, roll, pitch, yaw)
    other = over_rows(quaternion_from_euler, roll, pitch, other_yaw)
    error = metrics.inclination_error(metrics.vertical_of(one), metrics.vertical_of(other))
    np.testing.assert_allclose(error, 0.0, atol=1e-15)  # a few roundings of numbers up to 1


def test_angle_differences_lie_in_the_half_open_turn() -> None:
    cases = [(0.1, 0.3, -0.2), (np.pi, 0.0, np.pi), (-np.pi, 0.0, np.pi), (3.0, -3.0, 6.0 - 2 * np.pi), (7.0, 0.7, 6.3)]
    for a, b, difference in cases:
        wrapped = metrics.angle_difference(a, b)
        assert -np.pi < wrapped <= np.pi
        assert wrapped == pytest.approx(difference - 2 * np.pi * (difference > np.pi), abs=1e-15)  # one rounding
    assert metrics.angle_difference(1e-300, 0.0) == 1e-300


def test_rms_of_vectors_is_by_component() -> None:
    assert metrics.rms(np.array([3.0, -4.0])) == pytest.approx(np.sqrt(12.5), rel=1e-15)
    assert metrics.rms(np.array([[1.0, 2.0], [-1.0, 2.0]])).tolist() == [1.0, 2.0]


def test_nothing_is_computed_from_missing_samples() -> None:
    with pytest.raises(ValueError, match="1 of 3 samples are not finite, the first in row 1"):
        metrics.rms(np.array([1.0, np.nan, 2.0]))
    with pytest.raises(ValueError, match="no samples"):
        metrics.rms(np.array([]))
    with pytest.raises(ValueError, match="tilt: 1 of 2"):
        metrics.summary({"tilt": np.array([0.0, np.nan])})


def test_summary_names_units_and_holds_the_known_errors() -> None:
    """An estimate that is 3 deg off in roll, at once, in half of the samples."""
    off = np.deg2rad(np.repeat([0.0, 3.0], N // 2))
    level = np.zeros(N)
    truth = {"roll": level, "vertical": metrics.vertical_of(over_rows(quaternion_from_euler, level, level, level))}
    estimate = {"roll": off, "vertical": metrics.vertical_of(over_rows(quaternion_from_euler, off, level, level))}
    figures = metrics.summary(metrics.errors(estimate, truth))
    for name in ("roll", "tilt"):
        # Rounding of a cosine near 1 does not enter: the angle comes from the sine.
        assert figures[f"{name}_rmse_deg"] == pytest.approx(3 / np.sqrt(2), rel=1e-13)
        assert figures[f"{name}_max_deg"] == pytest.approx(3, rel=1e-13)
        assert figures[f"{name}_p95_deg"] == pytest.approx(3, rel=1e-13)
    assert len(figures) == 6


def test_acceleration_error_is_the_difference_of_norms_and_by_component() -> None:
    a = np.tile([3.0, 0.0, 4.0], (N, 1))
    a_hat = np.tile([0.0, 3.0, 4.0], (N, 1))
    figures = metrics.summary(metrics.errors({"external_acceleration": a_hat}, {"external_acceleration": a}))
    assert figures["external_acceleration_norm_rmse_m_s2"] == 0.0
    assert figures["external_acceleration_x_max_m_s2"] == 3.0
    assert figures["external_acceleration_y_rmse_m_s2"] == 3.0
    assert figures["external_acceleration_z_rmse_m_s2"] == 0.0


def test_yaw_errors_do_not_jump_at_the_branch_cut() -> None:
    errors = metrics.errors({"yaw": np.array([-3.1])}, {"yaw": np.array([3.1])})
    assert errors["yaw"][0] == pytest.approx(2 * np.pi - 6.2, abs=1e-15)  # one rounding


def test_all_angle_errors_agree_for_a_pure_heading_error() -> None:
    q_NS = random_attitudes(8)
    quarter = over_rows(quaternion_from_rotation_vector, np.tile([0, 0, 0.25], (N, 1)))
    q_NS_hat = over_rows(multiply, quarter, q_NS)

    def signals(q: np.ndarray) -> dict[str, np.ndarray]:
        angles = over_rows(euler_from_quaternion, q)
        return {"q_NS": q, "vertical": metrics.vertical_of(q)} | dict(
            zip(("roll", "pitch", "yaw"), angles.T, strict=True)
        )

    figures = metrics.summary(metrics.errors(signals(q_NS_hat), signals(q_NS)))
    # Euler angles lose digits near pitch = 90 deg; the nearest of 500 is 3 deg away.
    assert figures["heading_max_deg"] == pytest.approx(np.rad2deg(0.25), abs=1e-12)
    assert figures["yaw_max_deg"] == pytest.approx(np.rad2deg(0.25), abs=1e-12)
    assert figures["tilt_max_deg"] < 1e-12
    assert figures["roll_max_deg"] < 1e-12


def test_signals_that_cannot_be_compared_are_named() -> None:
    with pytest.raises(ValueError, match=r"estimate \(roll\) and truth \(yaw\) share no signal"):
        metrics.errors({"roll": np.zeros(3)}, {"yaw": np.zeros(3)})
    with pytest.raises(ValueError, match=r"roll: estimate \(3,\), truth \(2,\)"):
        metrics.errors({"roll": np.zeros(3)}, {"roll": np.zeros(2)})


def test_errors_are_taken_at_the_instant_a_sample_belongs_to() -> None:
    """A perfect estimator at 100 Hz, seen at 1 kHz through held outputs, has no error."""
    time = np.arange(1001) * 1e-3
    sample_time = np.floor(np.arange(1001) / 10) * 0.01
    truth = Trajectory(time, {"roll": np.sin(time)})
    estimate = Trajectory(time, {"roll": np.sin(sample_time), "sample_time": sample_time})
    # k * 0.01 and 10 k * 0.001 differ by rounding.
    assert metrics.compare(estimate, truth, 0.01)["roll_max_deg"] < 1e-13
    held = Trajectory(time, {"roll": np.sin(sample_time)})
    assert metrics.compare(held, truth, 0.01)["roll_max_deg"] > 0.4


@pytest.mark.parametrize(("start", "apart"), [(0.0, 0.9e-8), (1.7e9, 2.4e-7)])
def test_instants_match_within_a_millionth_of_a_sample(start: float, apart: float) -> None:
    """Also in seconds since 1970, where a double resolves 2e-7 s."""
    time = start + np.arange(100) * 0.01
    rows_hat, rows = metrics.equal_instants(time[10::10] + apart, time, 0.01)
    assert rows_hat.tolist() == list(range(9))
    assert rows.tolist() == list(range(10, 100, 10))


@pytest.mark.parametrize("sample_time", [0.0201, -0.01, 1.0, np.nan])
def test_an_estimate_without_truth_at_its_instant_is_refused(sample_time: float) -> None:
    with pytest.raises(ValueError, match="1 of 2 estimates have no truth at their instant"):
        metrics.equal_instants(np.array([0.01, sample_time]), np.arange(100) * 0.01, 0.01)
