"""Units as people write them in the header of a file or on a command line, and their factors to ours.

A table per unit of ours, as one spelling means different things: ``G`` is standard gravity in the column of an
accelerometer and gauss in that of a magnetometer.
"""

from __future__ import annotations

import re
from math import pi

from .vocabulary import GRAVITY

_DEGREE = pi / 180
_NUMBER = r"\d+\.?\d*(?:e[-+]?\d+)?|\.\d+(?:e[-+]?\d+)?"
_FACTORS: dict[str, dict[str, float]] = {
    "s": {"s": 1.0, "seconds": 1.0, "second": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0},
    "rad/s": {
        "rad/s": 1.0, "rads": 1.0, "rads-1": 1.0, "mrad/s": 1e-3, "deg/s": _DEGREE, "degs": _DEGREE, "dps": _DEGREE,
        "degs-1": _DEGREE, "mdps": 1e-3 * _DEGREE, "mdeg/s": 1e-3 * _DEGREE, "deg/h": _DEGREE / 3600, "rpm": pi / 30,
    },
    "m/s2": {
        "m/s2": 1.0, "ms2": 1.0, "ms-2": 1.0, "mps2": 1.0, "m/s/s": 1.0, "cm/s2": 0.01, "mm/s2": 1e-3, "g": GRAVITY,
        "gs": GRAVITY, "g0": GRAVITY, "mg": 1e-3 * GRAVITY, "ug": 1e-6 * GRAVITY,
    },
    "uT": {
        "ut": 1.0, "nt": 1e-3, "mt": 1e3, "t": 1e6, "g": 100.0, "gs": 100.0, "gauss": 100.0, "mg": 0.1, "mgauss": 0.1,
    },
    "m/s": {"m/s": 1.0, "ms-1": 1.0, "mps": 1.0, "km/h": 1 / 3.6, "kph": 1 / 3.6, "kmh": 1 / 3.6, "mph": 0.44704},
    "rad": {"rad": 1.0, "mrad": 1e-3, "deg": _DEGREE},
    "1": {"1": 1.0, "": 1.0, "-": 1.0},
}  # fmt: skip
_SPELLINGS = (
    ("µ", "u"), ("μ", "u"), ("²", "2"), ("°", "deg"), ("−", "-"), ("·", ""), ("*", ""), ("^", ""), ("(", ""),  # noqa: RUF001
    (")", ""), (" ", ""), ("degrees", "deg"), ("degree", "deg"), ("radians", "rad"), ("radian", "rad"), ("sec", "s"),
    ("/second", "/s"),
)  # fmt: skip


def factor(text: str, unit: str) -> float | None:
    """What a number in the unit ``text`` is multiplied with to be one in ``unit``, a unit of ours; None if unknown.

    A unit may be a part or a multiple of another, as the counts of a device are: ``g/16384``, ``0.061 mg``.
    """
    plain = re.sub(r"seconds?", "s", text.strip().lower())
    if not plain:
        return _FACTORS[unit].get("")
    if (known := _factor(plain, unit)) is not None:
        return known
    scaled = re.fullmatch(rf"(?:({_NUMBER})\s*\*?\s*)?(.+?)(?:\s*/\s*({_NUMBER}))?", plain)
    known = _factor(scaled[2], unit) if scaled else None
    if scaled is None or known is None or float(scaled[3] or 1) == 0:
        return None
    return float(scaled[1] or 1) * known / float(scaled[3] or 1)


def _factor(plain: str, unit: str) -> float | None:
    for spelling, ours in _SPELLINGS:
        plain = plain.replace(spelling, ours)
    return _FACTORS[unit].get(plain)


def spellings(unit: str) -> list[str]:
    """What may stand for a unit of ours, the plain ones, for a message."""
    return [name for name in _FACTORS[unit] if name and "-" not in name][:8]
