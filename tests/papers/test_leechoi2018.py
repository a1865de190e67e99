"""Claims about the experiments on Lee, Choi 2018."""

from __future__ import annotations

from math import isfinite
from pathlib import Path

import numpy as np
import pytest

from imufmu import simulate
from imufmu.estimators.leechoi2018 import BLOCK
from imufmu.papers.leechoi2018 import cost as leechoi2018_cost
from imufmu.papers.leechoi2018 import experiment as leechoi2018
from imufmu.papers.leechoi2018.experiment import EXPERIMENT, TABLE_1, TABLE_2
from imufmu.papers.leechoi2018.runs import (
    DURATION,
    FILTERS,
    FIRST,
    IMU_POSITION,
    ORDERS,
    RATES,
    TESTS,
    THIRD,
    TRUTH,
    Results,
    attitude_error,
    downsampled,
    estimated,
    monte_carlo,
    recorded,
)
from imufmu.papers.motions import Record, parameter_set, white_noise
from imufmu.pictures.figures import png
from support import fmu
from support.cosim_stubs import write_ssd
from support.motions import angle

VERY_FAST = TESTS[2]


@pytest.fixture(scope="module")
def very_fast() -> Record:
    return recorded(VERY_FAST, 3)


@pytest.fixture(scope="module")
def one_run() -> Results:
    return monte_carlo(1, lambda: None)


def wires(a: str, x: str, b: str, y: str) -> list[str]:
    return [f"{a}.{x}[{i}] -> {b}.{y}[{i}]" for i in (1, 2, 3)]


def test_the_chain_in_this_process_is_the_co_simulated_one(very_fast: Record, tmp_path: Path) -> None:
    """Plant and IMU at 240 Hz, the filter at 120 Hz takes every second sample: 4 s as three FMUs."""
    inputs, truth = downsampled(very_fast, 120)
    alone = estimated(inputs, 120, THIRD)

    components = {name: fmu.path(block) for name, block in zip("pif", ("handheld", "imu", "leechoi2018"), strict=True)}
    ideal = ("angular_velocity", "specific_force", "magnetic_field")
    connections = [wire for name in ideal for wire in wires("p", name, "i", name)]
    connections += wires("i", "gyro", "f", "gyro") + wires("i", "accel", "f", "accel")
    settings = {
        "p": parameter_set("handheld/leechoi2018_test_c")
        | {"acceleration_mean": VERY_FAST.acceleration, "max_step": 1 / TRUTH, "imu_position": IMU_POSITION}
        | {"random_attitude": True, "seed": 3},
        "i": white_noise(1 / TRUTH, gyro=0.01, accel=0.01) | {"sample_period": 1 / TRUTH, "seed": 2**30 + 3},
        "f": THIRD.parameters | {"sample_period": 1 / 120},
    }
    parameters = {f"{part}.{name}": value for part, values in settings.items() for name, value in values.items()}
    path = write_ssd(tmp_path / "hand.ssd", components, connections, stop=4.0, step=1 / TRUTH)
    together = simulate(path, parameters=parameters)

    rows = slice(0, 4 * 120)
    # The same Functions on the same numbers; 1e-12 is the project's bound between backends.
    for name in ("vertical", "external_acceleration", "tilt_std", "roll", "pitch"):
        values = together[f"f.{name}"][: 4 * TRUTH : 2]
        np.testing.assert_allclose(values, alone[name][rows], rtol=0, atol=1e-12, err_msg=name)
    assert attitude_error(alone, truth)[rows].max() > 1.0  # it is no trivial run


def test_lower_rates_are_interpolated_linearly_and_the_truth_is_exact(very_fast: Record) -> None:
    read, true = very_fast.readings["gyro"][::2], very_fast.truth["vertical"]
    for rate in RATES:
        inputs, truth = downsampled(very_fast, rate)
        assert len(truth.time) == DURATION * rate + 1
        assert np.allclose(truth.time, np.arange(len(truth.time)) / rate, rtol=0, atol=1e-12)
        assert np.array_equal(truth["vertical"], true[:: 240 // rate])
        if rate != 80:
            assert np.array_equal(inputs["gyro"], read[:: 120 // rate])
        else:  # every other sample lies in the middle of two
            assert np.allclose(inputs["gyro"][::2], read[::3], rtol=0, atol=1e-12)
            assert np.allclose(inputs["gyro"][1::2], (read[1:-1:3] + read[2::3]) / 2, rtol=0, atol=1e-12)


def test_an_error_is_the_root_mean_square_angle_of_one_run(one_run: Results) -> None:
    inputs, truth = downsampled(recorded(VERY_FAST, 0), 20)
    for tried in FILTERS:
        tilt = angle(estimated(inputs, 20, tried)["vertical"], truth["vertical"])
        expected = np.degrees(np.sqrt(np.mean(tilt**2)))
        assert one_run.of("C", 20, tried.name) == pytest.approx([expected], rel=1e-9)  # rounding


def test_a_compiled_step_is_that_of_the_block(very_fast: Record) -> None:
    """One step from a state in fast motion, to rounding."""
    u = np.concatenate([very_fast.readings[name][2000] for name in ("gyro", "accel")])
    for tried in FILTERS:
        p = BLOCK.parameter_vector({"sample_period": 0.05, **tried.parameters})
        start = np.random.default_rng(1).normal(size=BLOCK.next_function.numel_in(0))
        start[6:42] = np.eye(6).ravel()  # state: g, a, P, ...
        expected, _ = BLOCK.next_function(start, u, p, [])
        actual, _ = leechoi2018_cost.compiled(tried)(start, u, p, [])
        assert np.allclose(np.array(actual), np.array(expected), rtol=1e-13, atol=1e-13)


def test_the_cost_depends_on_the_order_only_where_it_is_compiled_in() -> None:
    costs = [leechoi2018_cost.operations(tried) for tried in FILTERS]
    assert len(set(costs)) == len(costs)
    relative = leechoi2018_cost.times([FIRST, FIRST])
    assert relative[0] == 1.0 and relative[1] > 0


def printed() -> Results:
    """Results as the paper prints them, as if every run had given the mean."""
    results = Results()
    for (test, rate), values in TABLE_1.items():
        both = zip(FILTERS, (*values, *TABLE_2[test, rate]), strict=True)
        results.errors |= {(test, rate, tried.name): [value] for tried, value in both}
    results.rates = {test.name: [(test.mean_rate, test.largest_rate)] for test in TESTS}
    return results


def failed(results: Results) -> set[str]:
    groups = (leechoi2018.motion_checks, leechoi2018.order_checks, leechoi2018.effect_checks, leechoi2018.case_checks)
    return {check.name for group in groups for check in group(results) if not check.passed}


def test_the_printed_numbers_meet_the_criteria_but_one() -> None:
    """At 20 Hz in Test C the paper's Cases differ by 3.6 %, more than any run here."""
    assert failed(printed()) == {"Case 2 against Case 1, third order"}


def test_exchanged_orders_do_not_meet_the_criteria() -> None:
    results = printed()
    for test, rate in TABLE_1:
        first, third = ((test, rate, tried.name) for tried in (FIRST, THIRD))
        results.errors[first], results.errors[third] = results.errors[third], results.errors[first]
    assert len(failed(results)) >= 6
    results = printed()
    results.rates["B"] = [(4.5, 13.7)]
    assert "angular rates, deviation from the printed ones" in failed(results)


def test_what_came_out_differently_is_said() -> None:
    assert not any("other sign" in remark for remark in leechoi2018.remarks(printed()))
    results = printed()
    results.errors["C", 20, "third''"] = [10.0]
    assert any("9.44° and 10.00°, printed 9.44° and 9.10°" in remark for remark in leechoi2018.remarks(results))


def test_an_outcome_has_every_table_figure_and_check(one_run: Results, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(leechoi2018, "monte_carlo", lambda runs, advance: [advance() for _ in range(2)] and one_run)
    told: list[tuple[int, int]] = []
    outcome = EXPERIMENT.run(True, lambda done, total: told.append((done, total)))
    assert told == [(1, 12), (2, 12)]
    tables = [section.table for section in outcome.sections if section.table]
    assert [len(table.rows) for table in tables] == [3, 12, 5, 5]
    assert all(len(row) == len(table.columns) for table in tables for row in table.rows)
    drawn = [section.figure for section in outcome.sections if section.figure]
    assert len(drawn) == 2 and all(png(figure).startswith(b"\x89PNG") for figure in drawn)
    names = [check.name for check in outcome.checks]
    assert len(set(names)) == len(names) == 14
    assert all(isfinite(check.value) and check.reason for check in outcome.checks)
    assert outcome.remarks


def test_a_third_order_filter_with_both_gyroscope_samples_halves_the_error(one_run: Results) -> None:
    at_20_hz = {name: one_run.mean("C", 20, name) for name in (THIRD.name, *leechoi2018.VARIANTS)}
    assert at_20_hz["third, mean of both gyroscope samples"] < 0.5 * at_20_hz["third"]
    assert at_20_hz["third, gravity normalised"] == pytest.approx(at_20_hz["third"], rel=0.05)
    assert at_20_hz["first, gravity normalised"] > one_run.mean("C", 20, FIRST.name)
    assert [tried.name for tried in ORDERS] == ["first", "second", "third"]


@pytest.mark.slow
@pytest.mark.parametrize("quick", [True, False], ids=["quick", "full"])
def test_every_criterion_is_met(quick: bool) -> None:
    assert [check.name for check in EXPERIMENT.run(quick, lambda done, total: None).checks if not check.passed] == []
