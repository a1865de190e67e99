"""Quantities and conditions of limits files: what they are worth, in which unit, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from imufmu.gate.expressions import ExpressionError, Quantity, parse

TRUE = np.ones(4, bool)
VARIABLES = {
    "plumb.tilt": Quantity(np.array([0.0, 0.01, -0.02, 0.04]), "rad", TRUE),
    "plant.speed": Quantity(np.array([0.0, 5.0, 10.0, 20.0]), "m/s", TRUE),
    "plumb.status": Quantity(np.array([0.0, 64.0, 65.0, 1.0]), "1", TRUE),
    "imu.gyro": Quantity(np.array([[3.0, 4.0, 0.0]] * 4), "rad/s", TRUE),
    "imu.gyro[2]": Quantity(np.full(4, 4.0), "rad/s", TRUE),
    "A[1,2]": Quantity(np.full(4, 2.0), None, TRUE),
}


def value_of(text: str) -> Quantity:
    return parse(text).evaluate(VARIABLES.__getitem__)


@pytest.mark.parametrize(
    ("text", "expected", "unit"),
    [
        ("plumb.tilt", [0.0, 0.01, -0.02, 0.04], "rad"),
        ("abs(-plumb.tilt)", [0.0, 0.01, 0.02, 0.04], "rad"),
        ("2 * plumb.tilt / 4", [0.0, 0.005, -0.01, 0.02], "rad"),
        ("plumb.tilt + 1 deg", np.array([0.0, 0.01, -0.02, 0.04]) + np.pi / 180, "rad"),
        ("plant.speed - 36 km/h", [-10.0, -5.0, 0.0, 10.0], "m/s"),
        ("norm(imu.gyro)", [5.0] * 4, "rad/s"),
        ("imu.gyro[2]", [4.0] * 4, "rad/s"),
        ("A[1,2]", [2.0] * 4, None),
    ],
)
def test_a_quantity_has_values_and_a_unit(text: str, expected: list[float], unit: str) -> None:
    found = value_of(text)
    assert not found.is_condition
    assert found.unit == unit
    np.testing.assert_allclose(found.values, expected, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("plumb.tilt < 1.5 deg", [True, True, True, False]),
        ("abs(plumb.tilt) <= 1 deg and plant.speed > 3 m/s", [False, True, False, False]),
        ("plant.speed > 36 km/h or plant.speed == 0", [True, False, False, True]),
        ("not plant.speed >= 36 km/h", [True, True, False, False]),
        ("flag(plumb.status, 64)", [False, True, True, False]),
        ("flag(plumb.status, 64) and not flag(plumb.status, 1)", [False, True, False, False]),
        ("plant.speed < 5m/s", [True, False, False, False]),
        ("plant.speed != 5 m/s", [True, False, True, True]),
    ],
)
def test_a_condition_holds_or_not(text: str, expected: list[bool]) -> None:
    assert value_of(text).values.tolist() == expected


def test_robustness_is_the_distance_from_turning_in_the_unit_of_the_left_side() -> None:
    robustness = value_of("plant.speed < 36 km/h").robustness
    assert robustness is not None
    np.testing.assert_allclose(robustness, [10.0, 5.0, 0.0, -10.0], atol=1e-9)
    both = value_of("plant.speed < 36 km/h and plant.speed > 1 m/s").robustness
    np.testing.assert_allclose(both, [-1.0, 4.0, 0.0, -10.0], atol=1e-9)
    assert value_of("plant.speed > 5 m/s").robustness[1] < 0  # type: ignore[index]  # on the limit is not above it


def test_a_row_that_is_no_number_keeps_no_condition() -> None:
    table = {"x": Quantity(np.array([1.0, np.nan]), None, np.ones(2, bool))}
    for text in ("x < 2", "x > 0", "x == 1"):
        assert parse(text).evaluate(table.__getitem__).values.tolist() == [True, False]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("plumb.tilt < 2", "one side is in rad; give 2 a unit"),
        ("plumb.tilt < 2 m", "differ in kind"),
        ("plumb.tilt < 2 dgr", "dgr"),
        ("plumb.tilt * plant.speed", "only numbers without a unit multiply"),
        ("1 / plant.speed", "only numbers without a unit multiply"),
        ("imu.gyro < 1 rad/s", "compares a vector"),
        ("0 m/s < plant.speed < 5 m/s", "compare two at a time"),
        ("not plumb.tilt", "'plumb.tilt' is a number, where a condition is wanted"),
        ("abs(plumb.tilt < 1 deg)", "is a condition, where a number is wanted"),
        ("flag(plumb.status)", "flag takes 2 arguments"),
        ("plumb.tilt <", "cannot be read"),
        ("", "cannot be read"),
        ("__import__('os').system('true')", "has no place here"),
        ("[x for x in ()]", "has no place here"),
        ("plumb.tilt ** 2", "has no place here"),
        ("'text'", "has no place here"),
        ("(lambda: 1)()", "has no place here"),
        ("plumb.tilt if plant.speed else 2", "has no place here"),
        ("(" * 5000 + "1" + ")" * 5000, "cannot be read"),
    ],
)
def test_what_cannot_be_a_limit_is_refused_in_one_line(text: str, said: str) -> None:
    with pytest.raises(ExpressionError) as raised:
        value_of(text)
    assert said in str(raised.value)
    assert "\n" not in str(raised.value)


def test_the_names_of_variables_are_known_before_any_run() -> None:
    assert parse("abs(plumb.roll - plant.roll) < 2 deg and imu.gyro[2] > 0 rad/s").names == (
        "plumb.roll",
        "plant.roll",
        "imu.gyro[2]",
    )
