"""Claims about the experiments on Bennett et al. 2014."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import imufmu
from imufmu.compiled.running import run
from imufmu.estimators import bennett2014 as estimator
from imufmu.papers import motions
from imufmu.papers.bennett2014 import experiment
from imufmu.papers.bennett2014.trials import (
    A1,
    A2,
    DRIFT,
    LEARNING,
    MOUNT,
    PERIOD,
    REST,
    Trial,
    imu_errors,
    records,
    slow,
    trial,
    varied,
)
from support import fmu
from support.cosim_stubs import write_ssd


@pytest.fixture(scope="module")
def pair() -> tuple[Trial, Trial]:
    """A varied and a slow trial; of a seed that meets even the criteria for means."""
    return trial(varied(2), 2), trial(slow(2), 2)


@pytest.mark.slow
@pytest.mark.parametrize("quick", [True, False], ids=["quick", "full"])
def test_every_criterion_is_met_and_progress_is_told(quick: bool) -> None:
    told: list[tuple[int, int]] = []
    outcome = experiment.EXPERIMENT.run(quick, lambda done, total: told.append((done, total)))
    assert [check.name for check in outcome.checks if not check.passed] == []
    assert len({check.name for check in outcome.checks}) == len(outcome.checks)
    assert told == [(i + 1, len(told)) for i in range(len(told))]
    assert sum(section.figure is not None for section in outcome.sections) == 2


def failed(pair: tuple[Trial, Trial], **parameters: float) -> list[str]:
    """Criteria that one trial of each kind does not meet."""
    fast, calm = (experiment.gathered([experiment.errors_of(one, **parameters)]) for one in pair)
    return [check.name for check in experiment.checks_of(fast, calm, change=0.0) if not check.passed]


def test_one_trial_of_each_kind_meets_the_criteria(pair: tuple[Trial, Trial]) -> None:
    assert failed(pair) == []


def test_without_the_correction_the_criteria_are_not_met(pair: tuple[Trial, Trial]) -> None:
    """Links without length move nothing."""
    names = failed(pair, a1=0.0, a2=0.0)
    assert "corrected against raw EKF" in names
    assert "corrected against raw accelerometer, slow trials" in names


def test_a_change_of_the_variances_is_felt(pair: tuple[Trial, Trial]) -> None:
    error = experiment.errors_of(pair[1])[experiment.CORRECTED_EKF]
    assert 1e-4 < experiment.sensitivity(pair[1], error) < 0.05


def test_a_trial_rests_at_both_ends_and_encoders_count(pair: tuple[Trial, Trial]) -> None:
    for one in pair:
        still = (one.time < REST) | (one.time > one.time[-1] - REST + PERIOD)
        assert np.abs(one.angle[still] + np.pi / 2).max() < 1e-12
        counts = (one.angle + np.pi / 2) / (2 * np.pi / 1000)
        assert np.abs(counts - np.round(counts)).max() < 1e-9
        assert np.ptp(counts) > 100


def test_the_gyroscopes_drift_by_what_is_said_after_the_rest() -> None:
    """Means over 2 s of noise: 1e-3 rad/s / sqrt(400) is 4e-5 rad/s."""
    drive = slow(5)
    drifting, steady = trial(drive, 5), records(drive, 5)
    for name, link in zip(("gyro1", "gyro2"), steady, strict=True):
        drift = drifting.readings[name] - link.readings["gyro"]
        assert np.array_equal(drift[drifting.time <= LEARNING], np.zeros_like(drift[drifting.time <= LEARNING]))
        assert np.abs(np.abs(drift[-1]) - DRIFT).max() < 0.05 * DRIFT


def test_other_conditions_are_what_they_say(pair: tuple[Trial, Trial]) -> None:
    one = pair[1]
    assert np.array_equal(one.skewed(4).readings["accel2"][4:], one.readings["accel2"][:-4])
    assert one.skewed(4).readings["gyro1"] is one.readings["gyro1"]
    found = experiment.errors_of(one.mounted_wrongly(0.2))[experiment.ANGLE]
    plain = experiment.errors_of(one)[experiment.ANGLE]
    assert found**2 - plain**2 == pytest.approx(0.2**2, rel=0.5)  # and twice their correlation


def test_a_turned_sensor_reads_an_angle_turned_by_as_much() -> None:
    """At rest: x = g sin, y = -g cos of the angle of the sensor."""
    still = Trial(np.zeros(1), np.zeros(1), {"accel2": np.array([[-9.8, 0.0, 0.0]])})
    x, y, _ = still.mounted_wrongly(0.1).readings["accel2"][0]
    assert np.arctan2(x, -y) == pytest.approx(-np.pi / 2 + 0.1, abs=1e-12)


def elements(name: str, count: int = 3) -> list[str]:
    return [f"{name}[{i + 1}]" for i in range(count)]


def wires(a: str, x: str, b: str, y: str) -> list[str]:
    return [f"{a}.{start} -> {b}.{end}" for start, end in zip(elements(x), elements(y), strict=True)]


def test_the_chain_equals_the_co_simulated_fmus(tmp_path: Path) -> None:
    """Two pendulums, two IMUs and the filter: in this process as the experiments run them, and as FMUs."""
    drive, seed = {"drive_duration": 3.0, "drive_ramp": 1.0}, 3
    first, second = records(drive, seed)
    inputs = {"gyro1": first.readings["gyro"], "gyro2": second.readings["gyro"], "accel2": second.readings["accel"]}
    settings = {"sample_period": PERIOD, "rest_time": LEARNING, "median": True}
    alone = run(estimator.BLOCK, inputs, settings)

    components, connections, parameters = {"filter": fmu.path("bennett2014")}, [], {}
    arm = {"motion": 1, "drive_rest": REST, "length": (A1, A2), "imu_distance": A2, "mount": MOUNT, "max_step": PERIOD}
    for link in (1, 2):
        plant, imu = f"plant{link}", f"imu{link}"
        components |= {plant: fmu.path("double_pendulum"), imu: fmu.path("imu")}
        for name in ("angular_velocity", "specific_force", "magnetic_field"):
            connections += wires(plant, name, imu, name)
        connections += wires(imu, "gyro", "filter", f"gyro{link}")
        parameters |= {f"{plant}.{name}": value for name, value in (arm | drive | {"imu_link": link}).items()}
        errors = imu_errors() | {"sample_period": PERIOD, "seed": motions._IMU_SEEDS + 2 * seed + link}
        parameters |= {f"{imu}.{name}": value for name, value in errors.items()}
    connections += wires("imu2", "accel", "filter", "accel2")
    parameters |= {f"filter.{name}": value for name, value in settings.items()}
    description = write_ssd(tmp_path / "arm.ssd", components, connections, stop=first.truth.time[-1], step=PERIOD)
    together = imufmu.simulate(
        description, parameters=parameters, record=["filter.vertical", "filter.angle", "filter.tilt_std"]
    )
    for name in ("vertical", "angle", "tilt_std"):
        # The same compiled functions; 1e-12 is the project's bound between backends.
        np.testing.assert_allclose(alone[name][:-1], together[f"filter.{name}"][:-1], rtol=0, atol=1e-12)
    assert np.ptp(alone["angle"][:, 1]) > 0.5
