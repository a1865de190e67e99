"""Claims about the experiments on Rizun 2008."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import imufmu
from imufmu.compiled.running import simulate
from imufmu.estimators import rizun2008
from imufmu.files.locations import models_folder
from imufmu.papers.rizun2008 import experiment, runs
from imufmu.papers.rizun2008.figures import periodogram
from imufmu.papers.rizun2008.motions import Motion, circle, readings, turning, white_velocity
from imufmu.plants.pendulum import DRIVEN, PENDULUM
from imufmu.scoring import prediction


@pytest.mark.slow
def test_every_criterion_is_met_and_progress_is_told() -> None:
    told: list[tuple[int, int]] = []
    outcome = experiment.EXPERIMENT.run(True, lambda done, total: told.append((done, total)))
    assert [check.name for check in outcome.checks if not check.passed] == []
    assert len({check.name for check in outcome.checks}) == len(outcome.checks)
    assert told == [(i + 1, told[-1][1]) for i in range(told[-1][1])]
    assert sum(section.figure is not None for section in outcome.sections) == 3


@pytest.mark.parametrize("part", [experiment.table_1, experiment.formulas])
def test_what_needs_no_run_meets_its_criteria(part) -> None:
    sections, checks = part()
    assert all(check.passed for check in checks)
    assert all(len(row) == len(section.table.columns) for section in sections for row in section.table.rows)


def test_the_chain_equals_the_co_simulated_fmus(tmp_path: Path) -> None:
    """Pendulum, IMU and filter: in this process as the experiments run them, and as FMUs."""
    folder = models_folder()
    text = (folder / "pendulum" / "pendulum_lee2012.ssd").read_text(encoding="utf-8").replace("lee2012", "rizun2008")
    (tmp_path / "imus").mkdir()
    (tmp_path / "system").mkdir()
    (tmp_path / "imus" / "mtx.ssv").write_bytes((folder / "imus" / "mtx.ssv").read_bytes())
    description = tmp_path / "system" / "pendulum_rizun2008.ssd"
    description.write_text(text, encoding="utf-8")
    together = imufmu.simulate(description, stop_time=4.0)
    settings = imufmu.System.read(description).settings
    imu_errors = {s.variable.name: s.value for s in settings if s.component == "imu"}

    plant = simulate(PENDULUM, 4.0, 0.01, parameters={"motion": DRIVEN})
    truth = ("q_NS", "angular_velocity", "specific_force", "vertical")
    motion = Motion(0.01, *(plant[name] for name in truth))
    read = readings(motion, imu_errors)
    parameters = {"gyro_noise_density": 1.745e-3}
    estimate = runs.estimated(rizun2008.BLOCK, read, motion, **parameters)
    for name in ("gyro", "accel"):
        np.testing.assert_allclose(read[name][:-1], together[f"imu.{name}"][:-1], rtol=0, atol=1e-12)
    for name in ("vertical", "external_acceleration", "tilt_std"):
        # The same compiled functions; 1e-12 is the project's bound between backends.
        np.testing.assert_allclose(estimate[name][:-1], together[f"rizun2008.{name}"][:-1], rtol=0, atol=1e-12)


def test_white_velocity_has_the_spectrum_of_the_paper() -> None:
    """4000 s: variance delta_v^2 omega_c / 4 to 5 %, and the density of (14) at 0.3 and 1 omega_c to 20 %."""
    delta_v, omega_c, dt = 2.0, 10.0, runs.PERIOD
    a = white_velocity(np.random.default_rng(1), 4000.0, dt, delta_v, omega_c)
    v = np.cumsum(a, axis=0) * dt
    v -= v.mean(axis=0)
    assert v.var(axis=0) == pytest.approx([delta_v**2 * omega_c / 4] * 3, rel=0.05)
    omega, density = periodogram([v])
    for at in (0.3 * omega_c, omega_c):
        near = np.abs(omega / at - 1) < 0.1
        assert density[near].mean() == pytest.approx(delta_v**2 / 2 / (1 + (at / omega_c) ** 2), rel=0.2)


def test_motions_are_what_they_say() -> None:
    still = turning(np.zeros(3), np.zeros((5, 3)), 0.1)
    assert np.array_equal(still.specific_force, np.tile([0, 0, prediction.GRAVITY], (5, 1)))
    assert still.time[-1] == pytest.approx(0.4)
    round_ = circle(10.0, 0.01, rate=2.0, radius=0.8)
    expected = [-3.2, 0.0, prediction.GRAVITY]
    assert np.allclose(round_.specific_force, expected, rtol=0, atol=1e-12)
    assert np.allclose(round_.vertical, [0, 0, 1], rtol=0, atol=1e-15)


def test_the_error_of_gravity_is_that_in_the_ground_frame() -> None:
    """A known start at rest in a turning sensor, perfect readings: none."""
    motion = turning(runs.TURN, np.zeros((500, 3)), 0.02)
    read = readings(motion)
    for block in (rizun2008.BLOCK, runs.FIRST_ORDER):
        estimate = runs.estimated(block, read, motion, known_start=True)
        assert np.abs(runs.gravity_error(motion, read, estimate)).max() < 1e-12
        assert runs.tilt_of(motion, estimate).max() < 1e-12
