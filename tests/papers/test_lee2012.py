"""The experiments on Lee 2012: the chain in this process is the co-simulated one, and errors are what they say."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

import numpy as np
import pytest

from imufmu import simulate
from imufmu.papers.lee2012 import experiment as lee2012
from imufmu.papers.lee2012 import runs as lee2012_runs
from imufmu.papers.lee2012.experiment import EXPERIMENT, TABLE_1, TABLE_2, TABLE_3
from imufmu.papers.lee2012.runs import C_A, DURATION, PERIOD, SOLVER, THRESHOLDS, Seed
from imufmu.papers.motions import parameter_set, record
from imufmu.pictures.figures import png
from imufmu.plants import handheld
from support.motions import angle


@pytest.fixture(scope="module")
def seeds() -> Sequence[Seed]:
    return [lee2012_runs.run_seed(0)]


def test_the_chain_in_this_process_is_the_co_simulated_one() -> None:
    """Plant, IMU and filter as three FMUs on the same seeds: Test B with an Xsens MTx."""
    motion, device = parameter_set("handheld/lee2012_test_b") | SOLVER, parameter_set("imus/mtx")
    alone = record(handheld.BLOCK, 4.0, PERIOD, 5, motion, device)
    estimated = lee2012_runs.estimate(alone, mode=3)
    given = {"plant.seed": 5, "plant.max_step": SOLVER["max_step"], "imu.seed": 2**30 + 5, "lee2012.mode": 3}
    together = simulate("handheld_lee2012", stop_time=4.0, parameters=given)
    # The same Functions on the same numbers; 1e-12 is the project's bound between backends.
    for component, trajectory in (
        ("plant", alone.truth.values),
        ("imu", alone.readings),
        ("lee2012", estimated.values),
    ):
        for name, values in trajectory.items():
            if f"{component}.{name}" in together or f"{component}.{name}[1]" in together.names:
                np.testing.assert_allclose(
                    together[f"{component}.{name}"][:-1], values[:-1], rtol=0, atol=1e-12, err_msg=name
                )
    assert np.abs(estimated["vertical"] - alone.truth["vertical"]).max() > 1e-4  # it is no trivial run


def test_errors_are_root_mean_squares_against_the_truth() -> None:
    recorded = lee2012_runs.test("B", 7)
    estimated = lee2012_runs.estimate(recorded, mode=2)
    found = lee2012_runs.errors(recorded, estimated)

    def rms(x: np.ndarray) -> float:
        return float(np.sqrt(np.mean(x**2)))

    turn = np.angle(np.exp(1j * (estimated["roll"] - recorded.truth["roll"])))
    tilt = angle(estimated["vertical"], recorded.truth["vertical"])
    a_hat, a = estimated["external_acceleration"], recorded.truth["external_acceleration"]
    expected = {
        "roll": np.degrees(rms(turn)),
        "pitch": np.degrees(rms(estimated["pitch"] - recorded.truth["pitch"])),
        "tilt": np.degrees(rms(tilt)),
        "a_x": rms(a_hat[:, 0] - a[:, 0]),
        "a_y": rms(a_hat[:, 1] - a[:, 1]),
        "a_z": rms(a_hat[:, 2] - a[:, 2]),
        "a_norm": rms(np.linalg.norm(a_hat, axis=1) - np.linalg.norm(a, axis=1)),
    }
    assert vars(found) == pytest.approx(expected, rel=1e-12)  # rounding
    inside = (estimated.time >= 2.0) & (estimated.time <= 3.0)
    assert lee2012_runs.tilt_rms(recorded, estimated, (2.0, 3.0)) == pytest.approx(
        np.degrees(rms(tilt[inside])), rel=1e-12
    )


@pytest.mark.parametrize("name", DURATION)
def test_the_records_have_the_rests_and_noise_of_the_paper(name: str) -> None:
    recorded = lee2012_runs.test(name, 3)
    assert recorded.truth.time[-1] == pytest.approx(DURATION[name])
    still = recorded.truth["activity"] == 0
    assert {"A": 1.0, "B": 5.1, "C": 10.8}[name] == pytest.approx(still.sum() * PERIOD, abs=0.1)  # s of rest
    noise = recorded.readings["gyro"] - recorded.truth["angular_velocity"]
    assert noise.std() == pytest.approx(0.01, rel=0.05)  # 3000 draws and more: standard error 1.3 %


def test_settings_shared_by_two_tables_gave_the_same(seeds: Sequence[Seed]) -> None:
    """As in the paper: Table II at 0.1 is mode 1 of Table I, Table III at (0.2, 4) is mode 3."""
    for name in DURATION:
        assert TABLE_2[name][C_A.index(0.1)] == TABLE_1[name][1][:2]
        assert TABLE_3[name][THRESHOLDS.index((0.2, 4))] == TABLE_1[name][3][:2]
        for seed in seeds:
            assert seed.c_a[name][0.1] == seed.modes[name][1]
            assert seed.thresholds[name][0.2, 4] == seed.modes[name][3]


def test_bias_is_what_makes_test_a_drift(seeds: Sequence[Seed]) -> None:
    for seed in seeds:
        assert seed.biased[1.0] > 2 * seed.c_a["A"][1.0].tilt


def test_an_outcome_has_every_table_figure_and_check(seeds: Sequence[Seed], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lee2012, "SEEDS", {True: 1})
    monkeypatch.setattr(lee2012_runs, "run_seed", lambda seed: seeds[seed])
    reported: list[tuple[int, int]] = []
    outcome = EXPERIMENT.run(True, lambda done, total: reported.append((done, total)))
    assert reported == [(1, 1)]
    assert [len(s.table.rows) for s in outcome.sections if s.table] == [9, len(C_A), len(THRESHOLDS)]
    assert all(len(row) == len(s.table.columns) for s in outcome.sections if s.table for row in s.table.rows)
    drawn = [s.figure for s in outcome.sections if s.figure]
    assert len(drawn) == 3 and all(png(figure).startswith(b"\x89PNG") for figure in drawn)
    names = [check.name for check in outcome.checks]
    assert len(set(names)) == len(names) >= 20
    assert all(isfinite(check.value) and check.reason for check in outcome.checks)
    assert outcome.remarks
    # What holds in every seed holds in this one.
    every = [c for c in outcome.checks if "every seed" in c.name or c.reason.startswith(("an identity", "bounded"))]
    assert len(every) == 6 and all(check.passed for check in every)


@pytest.mark.slow
@pytest.mark.parametrize("quick", [True, False])
def test_every_criterion_is_met(quick: bool) -> None:
    failed = [check for check in EXPERIMENT.run(quick, lambda done, total: None).checks if not check.passed]
    assert not failed
