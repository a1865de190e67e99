"""Units: what their names mean, and the conversion from one to another.

A unit is known by its base units with factor and offset where a file defines it (UnitDefinitions of an FMU, Units of
an SSP file: FMI 2.0.5, 2.2.2). Where no file does, its name is read: by pint, after the notations of FMI and Modelica
("m/s2", "N.m") and of data sheets ("deg/s/sqrt(Hz)", "dps") are turned into its own.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

BASES = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
_RAD = BASES.index("rad")
_PINT_BASES = ("kilogram", "meter", "second", "ampere", "kelvin", "mole", "candela", "radian")

# Names that pint does not know, or knows as something else.
_ALIASES = {
    "-": "1",
    "dps": "deg/s",
    "mps": "m/s",
    "Nm": "N*m",
    "g0": "standard_gravity",
    "gn": "standard_gravity",
    "G": "standard_gravity",
    "gauss": "1e-4*tesla",
    "Gauss": "1e-4*tesla",
    "mgauss": "1e-7*tesla",
    "mGauss": "1e-7*tesla",
    "U/min": "rpm",
}
_OFFSETS = {"degC": 273.15, "celsius": 273.15, "degF": 459.67 * 5 / 9}  # K; pint converts those in quantities only
_SIGNS = {"°C": "degC", "°F": "degF", "°": "deg", "µ": "u", "μ": "u", "·": "*", "⋅": "*", "√": "sqrt"}
_SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
# What pint evaluates is arithmetic: no powers of numbers, and none but small ones, in a name that somebody else wrote.
_HARMLESS = re.compile(r"[\w\s*/().%+-]{1,80}")
_POWER_OF_NUMBER = re.compile(r"\d\s*\*\*|\*\*\s*[+-]?[^\d\s+-]|\*\*\s*[+-]?\d{2}|(\*\*.*){9}|(\)\s*\*\*.*){4}")
_QUANTITY = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(\S.*?)?\s*")


class UnitError(ValueError):
    """Values in one unit cannot be given in another."""


@dataclass(frozen=True)
class Base:
    """A value x of the unit is factor x + offset in base units of these exponents."""

    exponents: tuple[float, ...]
    factor: float = 1.0
    offset: float = 0.0


_EMPTY = Base((0.0,) * len(BASES))


@dataclass(frozen=True)
class Unit:
    """A unit by name. base: as its file defines it; None where the file only names it."""

    name: str
    base: Base | None = None

    def __str__(self) -> str:
        return self.name


@dataclass(frozen=True)
class Linear:
    """target = factor * source + offset."""

    factor: float = 1.0
    offset: float = 0.0

    def __call__(self, value: float) -> float:
        return self.factor * value + self.offset

    def then(self, later: Linear) -> Linear:
        """This one, then the other."""
        return Linear(later.factor * self.factor, later.factor * self.offset + later.offset)


SAME = Linear()


def defined(name: str, attributes: Mapping[str, Any], relative: bool = False) -> Unit:
    """Unit of a file from the attributes of its element BaseUnit. relative: differences, where an offset cancels."""
    try:
        exponents = tuple(float(attributes.get(base) or 0) for base in BASES)
        factor, offset = float(attributes.get("factor") or 1), float(attributes.get("offset") or 0)
    except ValueError:
        return Unit(name)
    if not (math.isfinite(factor) and math.isfinite(offset) and factor):
        return Unit(name)
    return Unit(name, Base(exponents, factor, 0.0 if relative else offset))


def conversion(source: Unit | None, target: Unit | None) -> Linear:
    """How values in one unit become values in the other; unchanged where one of them has no unit.

    Raises UnitError for units that differ in kind, and for names of which nobody says what they mean.
    """
    if source is None or target is None or source == target:
        return SAME
    if source.name == target.name and (source.base is None or target.base is None):
        return SAME
    a, b = _base(source), _base(target)
    if source.name == target.name and a and b and a.exponents[:_RAD] == b.exponents[:_RAD]:
        return SAME
    for unit, base in ((source, a), (target, b)):
        if base is None:
            raise UnitError(f"nothing says what the unit {unit.name!r} is; its FMU or SSP file should define it")
    assert a is not None and b is not None
    if a.exponents != b.exponents:
        a, b = _with_gravity(source, a, b), _with_gravity(target, b, a)
    if a.exponents != b.exponents:
        raise UnitError(f"{source} and {target} differ in kind")
    factor = a.factor / b.factor
    return Linear(1.0 if abs(factor - 1.0) < 1e-14 else factor, (a.offset - b.offset) / b.factor)


def quantity(text: str, unit: Unit | None) -> float:
    """Number in ``unit`` of a text such as "500mm" or "0.005 deg/s/sqrt(Hz)".

    Raises ValueError for what is no number with a unit, and UnitError for a unit that does not fit.
    """
    match = _QUANTITY.fullmatch(text)
    if not match:
        raise ValueError(f"{text!r} is no number")
    number, name = float(match[1]), match[2]
    if not name:
        return number
    if unit is None:
        raise UnitError(f"the FMU names no unit, so nobody knows what {name} is there; give the bare number")
    given = Unit(name)
    if _base(given) is None and name != unit.name:
        raise UnitError(f"the unit {name!r} is not known")
    return conversion(given, unit)(number)


def _base(unit: Unit) -> Base | None:
    """What the unit is: by its file, else by its name.

    Some files leave the radian out of rad/s or deg/s. It is put back where the name says so: without it rad/s and Hz,
    which differ by 2 pi, are the same. An empty definition, as of roots, which no file can define, gives way to a name
    that means more.
    """
    base = unit.base
    if base is None:
        return _read(unit.name)
    if base == _EMPTY and re.search(r"rad|deg|°|sqrt|√|/|[A-Za-z]\^?-?\d", unit.name):  # and no "pu" or "dozen"
        return _read(unit.name) or base
    if base.exponents[_RAD] == 0 and re.search(r"rad|deg|rpm|rev|turn|°", unit.name):
        read = _read(unit.name)
        if read and read.exponents[:_RAD] == base.exponents[:_RAD]:
            return Base(read.exponents, base.factor, base.offset)
    return base


def _with_gravity(unit: Unit, base: Base, other: Base) -> Base:
    """A "g" that pint takes for a gram, and that is no mass here, is the acceleration of free fall."""
    if unit.base is None and re.search(r"(?<![A-Za-z])[mukµ]?g(?![A-Za-z])", unit.name):
        falling = _read(re.sub(r"(?<![A-Za-z])([mukµ]?)g(?![A-Za-z])", r"\1g_0", unit.name))
        if falling and falling.exponents == other.exponents:
            return falling
    return base


@cache
def _read(name: str) -> Base | None:
    """What a name means; None if it means nothing."""
    if re.match(r"[\d.]", name) and not re.match(r"1\s*(/|$)", name):
        return None  # a number: "5 2 m" is no quantity
    name = re.sub(r"\s*\[(.*)\]\s*", r"\1", name).strip()  # some write [m]
    text = _ALIASES.get(name, name).translate(_SUPERSCRIPTS)
    for sign, letters in _SIGNS.items():
        text = text.replace(sign, letters)
    text = re.sub(r"sqrt\(([^()]*)\)", r"(\1)**0.5", text)
    text = re.sub(r"sqrt\s*([A-Za-z]+)", r"(\1)**0.5", text)
    text = re.sub(r"(?<=[A-Za-z0-9)])\.(?=[A-Za-z(])", "*", text)  # N.m
    text = re.sub(r"(?<![\w])([A-Za-z]+)\^?([+-]?\d+)(?![\w.])", r"\1**\2", text)  # s2, s-2, s^-2
    if not _HARMLESS.fullmatch(text) or _POWER_OF_NUMBER.search(text):
        return None
    registry: Any = _registry()
    try:
        one = registry.parse_expression(text)
        scale = float(getattr(one, "magnitude", one))  # 1, but for "1e-4*tesla"
        factor, base = registry.get_base_units(getattr(one, "units", ""))
        powers = dict(registry.Quantity(1.0, base).unit_items())
    except Exception:  # pint raises what its tokenizer, parser and registry do
        return None
    if set(powers) - set(_PINT_BASES):
        return None
    exponents = tuple(round(float(powers.get(unit, 0)), 9) for unit in _PINT_BASES)
    return Base(exponents, scale * float(factor), _OFFSETS.get(text, 0.0))


@cache
def _registry() -> Any:
    """pint's registry, made when first needed: half a second. The radian is a base unit in it, as in FMI."""
    import pint

    registry: Any = pint.UnitRegistry(on_redefinition="ignore")
    registry.define("radian = [angle] = rad")
    registry.define("@alias turn = rev")
    return registry
