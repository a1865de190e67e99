"""The systems in models/, run with the real FMUs."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from imufmu import System, locate, pack, simulate
from imufmu.compiled.running import run
from imufmu.files.locations import models_folder
from imufmu.registry import BLOCKS

SYSTEMS = sorted(path.stem for path in models_folder().rglob("*.ssd"))


@pytest.mark.parametrize("name", SYSTEMS)
def test_a_system_has_names_times_and_a_step_that_its_samples_fit(name: str) -> None:
    system = System.read(locate(name))
    described = system.description
    assert described.name == name
    assert described.description
    assert all(component.description for component in described.components)
    assert None not in (described.start_time, described.stop_time, described.step)
    assert not any("samples every" in note for note in simulate(system, stop_time=0.1).notes)


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


def test_steps_and_sample_periods_of_whole_rates_are_written_to_the_last_digit() -> None:
    """So that every host counts the same steps, whether it rounds, adds up or divides."""
    written = []
    for path in [*models_folder().rglob("*.ssd"), *models_folder().rglob("*.ssv")]:
        text = path.read_text(encoding="utf-8")
        found = re.findall(r'stepSize="([^"]+)"|name="sample_period"[^/]*?value="([^"]+)"', text)
        written += [(path.name, float(step or period)) for step, period in found]
    assert {value for _, value in written} >= {0.01, 0.005, 1 / 120}
    assert [(name, value) for name, value in written if value != 1 / round(1 / value)] == []
