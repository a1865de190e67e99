"""The systems in models/, run with the real FMUs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from imufmu.cosim import System, locate, pack, simulate
from imufmu.locations import models_folder
from imufmu.registry import BLOCKS
from imufmu.running import run

SYSTEMS = sorted(path.stem for path in models_folder().rglob("*.ssd"))


def tilt_rms(a: np.ndarray, b: np.ndarray) -> float:
    """Root mean square angle, deg, between vectors (n, 3)."""
    angles = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.sum(a * b, axis=1))
    return float(np.degrees(np.sqrt(np.mean(angles**2))))


@pytest.mark.parametrize("name", SYSTEMS)
def test_a_system_has_names_times_and_a_step_that_its_samples_fit(name: str) -> None:
    system = System.read(locate(name))
    described = system.description
    assert described.name == name
    assert described.description
    assert all(component.description for component in described.components)
    assert None not in (described.start_time, described.stop_time, described.step)
    assert not any("samples every" in note for note in simulate(system, stop_time=0.1).notes)


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


def test_the_co_simulated_estimate_equals_the_same_samples_in_process() -> None:
    result = simulate("pendulum_lee2012", stop_time=3.0)
    samples = {name: result[f"imu.{name}"][:-1] for name in ("gyro", "accel")}
    system = System.read(locate("pendulum_lee2012"))
    parameters = {s.variable.name: s.value for s in system.settings if s.component == "lee2012"}
    alone = run(BLOCKS["lee2012"], samples, parameters)
    for name in ("vertical", "external_acceleration", "tilt_std"):
        # The same compiled step on the same numbers; 1e-12 is the project's bound between backends.
        np.testing.assert_allclose(result[f"lee2012.{name}"][:-1], alone[name], rtol=0, atol=1e-12)


def test_a_noiseless_imu_reads_the_truth_of_its_row() -> None:
    """No artificial delay between plant and sensor: the readings are those of the row's own instant."""
    quiet = {"imu.gyro_noise_density": 0, "imu.gyro_bias_instability": 0, "imu.gyro_misalignment": 0}
    result = simulate("pendulum_lee2012", stop_time=3.0, parameters=quiet)
    readings, truth = result["imu.gyro"][:-1], result["plant.angular_velocity"][:-1]
    assert np.abs(np.diff(truth, axis=0)).max() > 1e-3  # rad/s: a row of delay would be seen
    np.testing.assert_allclose(readings, truth, rtol=0, atol=1e-15)


def test_a_packed_system_gives_the_same_result(tmp_path: Path) -> None:
    packed = pack(locate("pendulum_lee2012"), tmp_path / "a.ssp")
    original, result = simulate("pendulum_lee2012", stop_time=1.0), simulate(packed, stop_time=1.0)
    assert result.names == original.names
    assert all(result[name].tolist() == original[name].tolist() for name in original.names)
