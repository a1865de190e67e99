"""A limit on a run: value, margin, and the row that decides."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from imufmu import Result
from imufmu.gate.expressions import ExpressionError
from imufmu.gate.judging import Finding, NothingToJudge, judge
from imufmu.gate.limits import _limit
from imufmu.gate.table import Table

N = 101
TIME = 5.0 + 0.1 * np.arange(N)  # a run that begins at 5 s: windows count from there


@pytest.fixture
def table() -> Table:
    """A truth at rest, and an estimate that leans by 1 deg per s to one side and has a sample of its own time."""
    lean = np.radians(TIME - 5.0)
    columns = {"plant.speed": np.linspace(0.0, 10.0, N), "plumb.status": np.where(TIME > 14, 64.0, 0.0)}
    columns |= {"plumb.sample_time": TIME, "plumb.tilt_std": np.full(N, np.radians(5.0))}
    columns |= {"plumb.roll": -lean, "plant.roll": np.zeros(N)}
    for i, (true, found) in enumerate(zip((0.0, 0.0, 1.0), (0 * lean, np.sin(-lean), np.cos(lean)), strict=True), 1):
        columns |= {f"plant.vertical[{i}]": np.full(N, true), f"plumb.vertical[{i}]": found}
    units = dict.fromkeys(columns, "1")
    units |= dict.fromkeys(("plumb.roll", "plant.roll", "plumb.tilt_std"), "rad")
    units |= {"plant.speed": "m/s", "plumb.sample_time": "s"}
    return Table(Result("made", TIME, columns, units))


def found(table: Table, **entry: Any) -> Finding:
    return judge(_limit(entry), table)


def test_the_value_is_in_the_unit_of_its_bound_and_the_margin_too(table: Table) -> None:
    finding = found(table, quantity="plumb.tilt", statistic="max", at_most="12 deg")
    assert (finding.value, finding.unit, finding.margin) == (pytest.approx(10.0), "deg", pytest.approx(2.0))
    assert finding.time == pytest.approx(10.0)
    assert finding.holds
    broken = found(table, quantity="plumb.tilt", statistic="max", at_most="0.1 rad")
    assert broken.margin == pytest.approx(0.1 - np.radians(10.0))
    assert not broken.holds


def test_of_two_bounds_the_nearest_decides(table: Table) -> None:
    between = {"quantity": "plumb.roll_error", "statistic": "final", "at_least": "-11 deg", "at_most": "5 deg"}
    assert found(table, **between).margin == pytest.approx(1.0)
    assert found(table, **{**between, "at_least": "-9 deg"}).margin == pytest.approx(-1.0)


@pytest.mark.parametrize(
    ("window", "largest"),
    [
        ({"to": "5 s"}, 5.0),
        ({"from": "2 s", "to": "3 s"}, 3.0),
        ({"where": "plant.speed < 2.5 m/s"}, 2.4),
        ({"after": "plant.speed >= 4 m/s", "to": "1 s"}, 5.0),
        ({"after": "plant.speed >= 4 m/s", "from": "1 s", "to": "1.5 s"}, 5.5),
    ],
)
def test_only_rows_in_the_window_are_looked_at(table: Table, window: dict[str, str], largest: float) -> None:
    finding = found(table, quantity="plumb.tilt", statistic="max", at_most="20 deg", **window)
    assert finding.value == pytest.approx(largest)


def test_a_difference_of_two_variables_can_be_limited(table: Table) -> None:
    finding = found(table, quantity="abs(plumb.roll - plant.roll)", statistic="mean", at_most="6 deg")
    assert finding.value == pytest.approx(5.0)


def test_share_nees_settling_and_finite_say_what_their_names_do(table: Table) -> None:
    assert found(table, quantity="flag(plumb.status, 64)", statistic="share", at_most="20 %").value == pytest.approx(
        100 * 10 / N
    )
    nees = found(table, quantity="plumb.tilt", statistic="nees", sigma="plumb.tilt_std", at_least=0.3, at_most=3)
    assert nees.value == pytest.approx(np.mean(((TIME - 5) / 5) ** 2))
    settling = found(table, quantity="plant.speed - 10 m/s", statistic="settling_time", band="2 m/s", at_most="9 s")
    assert (settling.value, settling.unit) == (pytest.approx(8.0), "s")
    assert found(table, quantity="plumb.tilt", statistic="finite").holds


def test_rows_that_repeat_a_sample_have_no_error_of_their_own() -> None:
    """An estimator of every second row: its outputs are held, and the error is that of its samples."""
    lean = np.radians(np.repeat(np.arange(0, N + 1, 2), 2)[:N] / 10)
    columns = {"plumb.sample_time": np.repeat(TIME[::2], 2)[:N]}
    for i, (true, held) in enumerate(zip((0.0, 0.0, 1.0), (0 * lean, np.sin(lean), np.cos(lean)), strict=True), 1):
        columns |= {f"plant.vertical[{i}]": np.full(N, true), f"plumb.vertical[{i}]": held}
    table = Table(Result("made", TIME, columns, dict.fromkeys(columns, "1")))
    finding = found(table, quantity="plumb.tilt", statistic="mean", at_most="20 deg")
    assert finding.value == pytest.approx(np.mean(np.arange(0, N, 2) / 10))


def test_always_eventually_and_when(table: Table) -> None:
    assert found(table, always="plumb.tilt < 10.5 deg").holds
    always = found(table, always="plumb.tilt < 9 deg")
    assert (always.holds, always.time) == (False, pytest.approx(10.0))
    assert found(table, always="plumb.tilt < 9 deg", when="plant.speed < 8 m/s").holds
    assert found(table, eventually="plant.speed > 5 m/s", within="6 s").holds
    assert not found(table, eventually="plant.speed > 5 m/s", within="4 s").holds
    assert found(table, eventually="plant.speed > 5 m/s", within="4 s", when="plant.speed > 2 m/s").holds
    never = found(table, always="plumb.tilt < 1 deg", when="plant.speed > 99 m/s")
    assert (never.holds, never.margin) == (True, np.inf)


def test_a_variable_that_is_not_finite_holds_no_limit() -> None:
    values = np.array([0.0, np.nan, 1.0])
    table = Table(Result("made", np.arange(3.0), {"a.b": values}, {"a.b": "m"}))
    for statistic in ("max", "rmse", "final", "mean"):
        if statistic != "final":
            assert not found(table, quantity="a.b", statistic=statistic, at_most="5 m").holds
    assert found(table, quantity="a.b", statistic="finite") == Finding(1.0, "rows not finite", -1.0, 1.0)
    assert not found(table, always="a.b < 5 m").holds


@pytest.mark.parametrize(
    ("entry", "said"),
    [
        ({"quantity": "plumb.tlt", "statistic": "max", "at_most": "1 deg"}, "did you mean plumb.tilt?"),
        ({"quantity": "plumb.tilt", "statistic": "max", "at_most": 3}, "3 needs a unit, as the value is in rad"),
        ({"quantity": "plumb.tilt", "statistic": "max", "at_most": "3 m"}, "differ in kind"),
        ({"quantity": "plumb.vertical", "statistic": "max", "at_most": 1}, "is a vector"),
        ({"quantity": "plumb.tilt < 1 deg", "statistic": "max", "at_most": 1}, "its statistic is share"),
        ({"always": "plumb.tilt"}, "is a number; write a condition"),
        (
            {"quantity": "plumb.tilt", "statistic": "max", "at_most": "1 deg", "where": "plant.speed"},
            "a condition is wan",
        ),
    ],
)
def test_a_limit_that_fits_no_run_is_told_in_one_line(table: Table, entry: dict[str, Any], said: str) -> None:
    with pytest.raises(ExpressionError) as raised:
        found(table, **entry)
    assert said in str(raised.value)


def test_a_window_without_rows_is_no_limit_that_holds(table: Table) -> None:
    limit = {"quantity": "plumb.tilt", "statistic": "max", "at_most": "90 deg"}
    with pytest.raises(NothingToJudge, match="no row is looked at"):
        found(table, **limit, **{"from": "20 s"})
    with pytest.raises(NothingToJudge, match=r"'plant\.speed > 99 m/s' never comes true"):
        found(table, **limit, after="plant.speed > 99 m/s")
