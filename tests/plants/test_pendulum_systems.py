"""The systems in models/pendulum, run with the real FMUs: how good the estimates are, and how hard the cases."""

from __future__ import annotations

import numpy as np
import pytest

from imufmu import simulate


def tilt_rms(a: np.ndarray, b: np.ndarray) -> float:
    """Root mean square angle, deg, between vectors (n, 3)."""
    angles = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.sum(a * b, axis=1))
    return float(np.degrees(np.sqrt(np.mean(angles**2))))


# Measured (deg): what the estimates miss, and what the accelerometer alone would. Bounds leave room for another seed.
@pytest.mark.parametrize(
    "name, lee2012, plumb, accelerometer",
    [
        ("pendulum_lee2012", 3.0, 1.5, 20.0),  # 2.3, 0.6, 40
        ("double_pendulum_lee2012", 3.0, 4.0, 20.0),  # 2.2, 2.5, 23
        ("double_pendulum_bennett2014", 2.0, 1.0, 20.0),  # 1.0, 0.5, 41
        ("pendulum_swing_up", 10.0, 5.0, 60.0),  # 5.2, 2.5, 77
    ],
)
def test_the_estimates_follow_the_truth_where_the_accelerometer_does_not(
    name: str, lee2012: float, plumb: float, accelerometer: float
) -> None:
    result = simulate(name)
    truth, reading = result["plant.vertical"][:-1], result["imu.accel"][:-1]
    assert tilt_rms(result["lee2012.vertical"][:-1], truth) < lee2012
    assert tilt_rms(result["plumb.vertical"][:-1], truth) < plumb
    assert tilt_rms(reading, truth) > accelerometer


def test_two_imus_and_the_encoders_are_the_experiment_of_bennett() -> None:
    """Link 2 within 1 deg of the encoders, whose counts are 0.36 deg; the paper has 0.0306 rad, 1.8 deg."""
    result = simulate("double_pendulum_bennett2014")
    by_encoders = result["plant.encoder"].sum(axis=1) - np.pi / 2
    error = result["bennett2014.segment_angle"][:-1] - by_encoders[:-1]
    assert np.degrees(np.sqrt(np.mean(error**2))) < 1.0  # 0.5 measured
    assert np.ptp(by_encoders) > 1.5  # rad: link 2 rises above the horizontal
    assert result["plant.angle"][:, 1].max() <= 0  # the knee


def test_the_swing_up_is_violent() -> None:
    result = simulate("pendulum_swing_up")
    angle = np.unwrap(np.arctan2(result["plant.position"][:, 0], -result["plant.position"][:, 2]))
    assert abs(angle[0]) < 0.03 and np.ptp(angle) > 10 * 2 * np.pi  # from hanging to ten turns and more
    assert np.linalg.norm(result["plant.specific_force"], axis=1).max() > 5 * 9.80665
