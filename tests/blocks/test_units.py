"""Units as people write them: the factor is that of the unit, and what is no unit is told apart."""

from __future__ import annotations

from math import pi

import pytest

from imufmu.blocks.units import factor, spellings

G = 9.80665


@pytest.mark.parametrize(
    ("text", "unit", "expected"),
    [
        *((text, "rad/s", 1.0) for text in ("rad/s", "rad/sec", "Rad/S", "radians/second", "rad s-1", "rad·s^-1")),
        *((text, "rad/s", pi / 180) for text in ("deg/s", "dps", "°/s", "degrees/sec", "deg/second", " deg / s ")),
        *((text, "m/s2", 1.0) for text in ("m/s2", "m/s^2", "m/s²", "m/(s^2)", "m/s/s", "m s-2", "m/s**2", "mps2")),
        *((text, "m/s2", G) for text in ("g", "G")),
        ("mg", "m/s2", 1e-3 * G),
        *((text, "uT", 1.0) for text in ("uT", "µT", "μT")),
        *((text, "uT", 100.0) for text in ("G", "gauss", "Gauss")),
        ("mG", "uT", 0.1),
        ("nT", "uT", 1e-3),
        *((text, "s", 1e-6) for text in ("us", "µs")),
        ("ms", "s", 1e-3),
        ("km/h", "m/s", 1 / 3.6),
        ("°", "rad", pi / 180),
        ("g/16384", "m/s2", G / 16384),
        ("deg/s/131", "rad/s", pi / 180 / 131),
        ("0.061 mg", "m/s2", 0.061e-3 * G),
        ("0.1 ms", "s", 1e-4),
        ("1e-6 s", "s", 1e-6),
    ],
)
def test_a_unit_has_its_factor(text, unit, expected):
    assert factor(text, unit) == pytest.approx(expected, rel=1e-15)


@pytest.mark.parametrize("text", ["furlong", "", "16384", "g/0", "g/", "/131", "deg", "rad/s2", "-g", "g g"])
def test_what_is_no_unit_of_an_acceleration_is_none(text):
    assert factor(text, "m/s2") is None


def test_what_is_shown_is_what_is_understood():
    for unit in ("s", "rad/s", "m/s2", "uT", "m/s", "rad"):
        assert all(factor(text, unit) for text in spellings(unit))
