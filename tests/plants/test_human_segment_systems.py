"""Claims about the systems in models/human_segment, run with the real FMUs."""

from __future__ import annotations

import numpy as np
import pytest

from imufmu import simulate
from imufmu.files.locations import models_folder

SYSTEMS = sorted(path.stem for path in (models_folder() / "human_segment").glob("*.ssd"))

# Largest tilt error RMS, deg, of lee2012 and plumb, half again of what came out (models/human_segment/README.md), and
# the smallest of the direction that the accelerometer reads.
LIMITS = {
    "human_walking_thigh": (3.0, 2.1, 10.0),
    "human_running_foot": (7.0, 5.8, 40.0),
    "human_jump": (0.2, 0.2, 20.0),
    "human_rollerblading": (6.7, 6.6, 5.0),
}


def tilt_rms(a: np.ndarray, b: np.ndarray) -> float:
    """Root mean square angle, deg, between vectors (n, 3)."""
    angles = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.sum(a * b, axis=1))
    return float(np.degrees(np.sqrt(np.mean(angles**2))))


def test_there_are_the_four_systems() -> None:
    assert set(SYSTEMS) == set(LIMITS)


@pytest.mark.parametrize("name", SYSTEMS)
def test_both_estimators_follow_a_person_within_the_range_of_the_sensor(name: str) -> None:
    result = simulate(name)
    truth, reading = result["plant.vertical"][:-1], result["imu.accel"][:-1]
    lee2012, plumb, accelerometer = LIMITS[name]
    assert tilt_rms(result["lee2012.vertical"][:-1], truth) < lee2012
    assert tilt_rms(result["plumb.vertical"][:-1], truth) < plumb
    assert tilt_rms(reading, truth) > accelerometer
    assert np.abs(reading).max() < 160.0  # m/s2, range of the MTw: nothing clips
    assert np.abs(result["imu.gyro"]).max() < 34.9  # rad/s
