"""Claims about the experiments on Zihajehzadeh et al. 2014."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import imufmu
from imufmu.blocks.running import Trajectory
from imufmu.blocks.vocabulary import GRAVITY
from imufmu.papers.motions import record
from imufmu.papers.zihajehzadeh2014 import experiment, magnetic, motions
from imufmu.papers.zihajehzadeh2014.runs import NOISE, PAPER, PERIOD, filtered, read
from imufmu.plants import handheld
from support.cosim_stubs import write_ssd
from support.truth_consistency import assert_signals_agree


@pytest.mark.slow
def test_every_criterion_is_met_and_progress_is_told() -> None:
    told: list[tuple[int, int]] = []
    outcome = experiment.EXPERIMENT.run(True, lambda done, total: told.append((done, total)))
    assert [check.name for check in outcome.checks if not check.passed] == []
    assert len({check.name for check in outcome.checks}) == len(outcome.checks)
    assert told == [(i + 1, len(told)) for i in range(len(told))]
    assert sum(section.figure is not None for section in outcome.sections) == 4


def test_one_record_of_each_kind_meets_the_criteria() -> None:
    side = magnetic.directions(experiment.DIRECTIONS)[1]
    moved = [experiment.Moved.of(truth, 1) for truth in (motions.jump(1, PERIOD), motions.skating(1, PERIOD))]
    checks = [
        *magnetic.disturbance_checks([magnetic.disturb(side, 1)]),
        *magnetic.hole_checks(magnetic.hole(np.array([0.14]), 1)),
        *experiment.jump_checks(moved[:1]),
        *experiment.skating_checks(moved[1:]),
    ]
    assert [check.name for check in checks if not check.passed] == []


def test_a_filter_with_a_fault_does_not_meet_them(monkeypatch: pytest.MonkeyPatch) -> None:
    """Wrong sign of the declination, no test at all, no acceleration model: each breaks a criterion of its own."""
    side = magnetic.directions(experiment.DIRECTIONS)[1]

    def failed(**fault: object) -> set[str]:
        for name, value in fault.items():
            monkeypatch.setitem(PAPER, name, value)
        still = magnetic.disturbance_checks([magnetic.disturb(side, 1)])
        jumped = experiment.jump_checks([experiment.Moved.of(motions.jump(1, PERIOD), 1)])
        monkeypatch.undo()
        return {check.name for check in (*still, *jumped) if not check.passed}

    assert "Jump: all angles are tracked" in failed(m_ref=(5.0, 17.3, -50.9))
    assert "The test rejects every sample of the flat part of a disturbance" in failed(eps_m=1e6, eps_dip=3.0)
    assert "Jump: without acceleration model the tilt is worse" in failed(c_a=0.0)


def test_the_chain_equals_the_co_simulated_fmus(tmp_path: Path) -> None:
    """Hand, IMU and filter, the field disturbed: in this process as the experiments run them, and as FMUs."""
    plant = {
        "rate_mean": 0.3,
        "acceleration_mean": 0.5,
        "earth_field": motions.FIELD,
        "disturbance_field": (20.0, 10.0, 5.0),
        "disturbances": 1,
        "disturbance_start": (1.0, 0.0, 0.0),
        "disturbance_stop": (2.0, 0.0, 0.0),
    }
    seed = 5
    recorded = record(handheld.BLOCK, 3.0, PERIOD, seed, plant, NOISE)
    estimate = filtered(Trajectory(recorded.truth.time, recorded.readings))

    wires = [
        f"{one}.{out}[{i}] -> {other}.{to}[{i}]"
        for one, other, pairs in (
            ("plant", "imu", (("angular_velocity",) * 2, ("specific_force",) * 2, ("magnetic_field",) * 2)),
            ("imu", "filter", (("gyro",) * 2, ("accel",) * 2, ("mag",) * 2)),
        )
        for out, to in pairs
        for i in (1, 2, 3)
    ]
    sources = {"plant": "handheld.fmu", "imu": "imu.fmu", "filter": "zihajehzadeh2014.fmu"}
    values = {"plant": plant | {"seed": seed}, "imu": NOISE | {"seed": 2**30 + seed}, "filter": PAPER}
    together = imufmu.simulate(
        write_ssd(tmp_path / "chain.ssd", sources, wires, stop=3.0, step=PERIOD),
        parameters={f"{part}.{name}": value for part, given in values.items() for name, value in given.items()},
    )
    assert 0 < np.mean(estimate["mag_ok"]) < 1
    for name in ("gyro", "accel", "mag"):
        # The same compiled functions; 1e-12 is the project's bound between backends.
        np.testing.assert_allclose(recorded.readings[name][:-1], together[f"imu.{name}"][:-1], rtol=0, atol=1e-12)
    for name in ("q_NS", "heading", "external_acceleration", "status"):
        np.testing.assert_allclose(estimate[name][:-1], together[f"filter.{name}"][:-1], rtol=0, atol=1e-12)


@pytest.mark.parametrize("motion", [motions.jump, motions.skating])
def test_the_truth_of_a_motion_belongs_together(motion) -> None:
    """Attitude, gravity and field agree; the gyroscope integrated is the attitude, to the second order of 5 ms."""
    truth = motion(2, 0.005)
    assert_signals_agree(truth, GRAVITY, np.array(motions.FIELD))
    R_NS = Rotation.from_quat(np.roll(truth["q_NS"], -1, axis=1))
    w = (truth["angular_velocity"][1:] + truth["angular_velocity"][:-1]) / 2
    left = (R_NS[:-1] * Rotation.from_rotvec(0.005 * w)).inv() * R_NS[1:]
    assert left.magnitude().max() < 0.005**3 / 12 * 200  # trapezoidal rule; w is bent by less than 200 rad/s3


def test_the_jump_peaks_at_40_and_ends_where_the_velocity_does() -> None:
    for seed in range(5):
        truth = motions.jump(seed, PERIOD)
        force = np.linalg.norm(truth["specific_force"], axis=1)
        assert force.max() == pytest.approx(motions.PEAK, abs=1e-9)
        assert np.sum(force < 1e-9) >= 40  # free fall for 0.4 s
        R_NS = Rotation.from_quat(np.roll(truth["q_NS"], -1, axis=1))
        velocity = R_NS.apply(truth["external_acceleration"]).sum(axis=0) * PERIOD
        assert np.abs(velocity).max() < 1e-9  # raised cosines sum to their area on this grid


def test_rollerblading_has_the_stated_acceleration_and_rounds() -> None:
    """Mean 2.5 m/s2 while skating and no more than three times that; two rounds; the sensor stands before."""
    truth = motions.skating(3, PERIOD)
    a = np.linalg.norm(truth["external_acceleration"], axis=1)
    assert not a[:200].any() and not truth["angular_velocity"][:200].any()
    assert a[300:].mean() == pytest.approx(2.5, rel=0.1)  # of a random record of 2 min
    assert 7.0 < a.max() <= 7.5
    turned = np.unwrap(truth["yaw"])[-1] - truth["yaw"][0]
    assert turned == pytest.approx(2 * 2 * np.pi, abs=0.5)  # and a sway of 8 deg rms


def test_rounds_add_their_centripetal_acceleration() -> None:
    one, other = (motions.skating(3, PERIOD, speed=speed) for speed in (0.0, 4.0))
    rate = 2 * np.pi * motions.ROUNDS / motions.SKATING_DURATION
    added = np.linalg.norm(other["external_acceleration"] - one["external_acceleration"], axis=1)
    assert added[300:] == pytest.approx(4.0 * rate, abs=1e-12)


def test_the_disturbance_is_whole_in_its_spans_and_absent_outside() -> None:
    truth = motions.at_rest((10.0, -5.0, 3.0), PERIOD)
    added = truth["magnetic_field"] - np.array(motions.FIELD)
    for part in magnetic.flat_parts(truth.time):
        assert added[part] == pytest.approx(np.tile([10.0, -5.0, 3.0], (part.sum(), 1)), abs=1e-9)
    assert np.abs(added[magnetic.undisturbed(truth.time)]).max() < 1e-9
    assert np.allclose(np.linalg.norm(magnetic.directions(10), axis=1), 0.6 * motions.NORM)


def test_readings_have_the_stated_noise() -> None:
    """0.01 rad/s, 0.01 m/s2 and 0.15 % of the field per sample, each within 3 % (36 000 draws fix it to 0.4 %)."""
    truth = motions.at_rest((0.0, 0.0, 0.0), PERIOD)
    readings = read(truth, 1)
    pairs = (("gyro", "angular_velocity", 0.01), ("accel", "specific_force", 0.01), ("mag", "magnetic_field", 0.081))
    for name, ideal, std in pairs:
        assert np.std(readings[name] - truth[ideal]) == pytest.approx(std, rel=0.03)
