"""What a signal and a parameter are: name, shape, unit, bounds, description.

A vector or matrix signal becomes one scalar variable per element, named in the structured way of FMI 2.0:
``gyro[1]``, ``gyro[2]``, ``gyro[3]``; ``P[1,1]``, ``P[1,2]`` ... row by row.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

Shape = tuple[int, ...]
Values = float | tuple[float, ...]


@dataclass(frozen=True)
class Unit:
    """A unit in SI base units: value in base units = factor * value.

    ``base`` holds whole exponents; it is None where FMI 2.0 cannot express them (1/sqrt(Hz) is a half power).
    """

    name: str
    base: dict[str, int] | None
    factor: float = 1.0
    display: tuple[str, float] | None = None  # display unit and its value in one of this unit: deg = factor * rad


DEGREES = 180.0 / math.pi

UNITS = {
    unit.name: unit
    for unit in (
        Unit("1", {}),
        Unit("s", {"s": 1}),
        Unit("Hz", {"s": -1}),
        Unit("1/min", {"s": -1}, factor=1 / 60),
        Unit("m", {"m": 1}),
        Unit("m/s", {"m": 1, "s": -1}),
        Unit("m/s2", {"m": 1, "s": -2}),
        Unit("m/s3", {"m": 1, "s": -3}),
        Unit("m2", {"m": 2}),
        Unit("m2/s4", {"m": 2, "s": -4}),
        Unit("rad", {"rad": 1}, display=("deg", DEGREES)),
        Unit("rad/s", {"rad": 1, "s": -1}, display=("deg/s", DEGREES)),
        Unit("rad/s2", {"rad": 1, "s": -2}),
        Unit("rad2", {"rad": 2}),
        Unit("rad2/s2", {"rad": 2, "s": -2}),
        Unit("rad2/s5", {"rad": 2, "s": -5}),
        Unit("kg", {"kg": 1}),
        Unit("kg.m2", {"kg": 1, "m": 2}),
        Unit("kg/m3", {"kg": 1, "m": -3}),
        Unit("N", {"kg": 1, "m": 1, "s": -2}),
        Unit("N.m", {"kg": 1, "m": 2, "s": -2}),
        Unit("N.m/rad2", {"kg": 1, "m": 2, "s": -2, "rad": -2}),
        Unit("s/rad", {"s": 1, "rad": -1}),
        Unit("N.m/rad", {"kg": 1, "m": 2, "s": -2, "rad": -1}),
        Unit("N.m.s/rad", {"kg": 1, "m": 2, "s": -1, "rad": -1}),
        Unit("J", {"kg": 1, "m": 2, "s": -2}),
        Unit("uT", {"kg": 1, "s": -2, "A": -1}, factor=1e-6),
        Unit("rad/s/sqrt(Hz)", None),
        Unit("rad/s2/sqrt(Hz)", None),
        Unit("m/s/sqrt(Hz)", None),
        Unit("m/s2/sqrt(Hz)", None),
        Unit("uT/sqrt(Hz)", None),
        Unit("1/sqrt(Hz)", None),
        Unit("s/sqrt(Hz)", None),
        Unit("rad/sqrt(Hz)", None),
        Unit("rad/sqrt(s)", None),
    )
}


class DeclarationError(ValueError):
    """A signal, parameter or block is declared wrongly; the message names it."""


@dataclass(frozen=True)
class Signal:
    """One input, output or local variable of a block.

    start: one number for all elements, or one number per element, row by row. minimum and maximum bound every
    element. nominal: the usual magnitude.
    """

    name: str
    unit: str
    description: str
    minimum: float
    maximum: float
    shape: Shape = ()
    start: Values = 0.0
    nominal: float = 1.0

    def __post_init__(self) -> None:
        if self.unit not in UNITS:
            raise DeclarationError(f"{self.name}: unit {self.unit!r} is not in imufmu.signals.UNITS")
        if not self.name.replace("_", "a").replace(".", "a").isalnum() or self.name[0].isdigit():
            raise DeclarationError(f"{self.name!r} is not a variable name")
        if not self.description:
            raise DeclarationError(f"{self.name}: description missing")
        if len(self.shape) > 2 or min(self.shape, default=1) < 1:
            raise DeclarationError(f"{self.name}: shape {self.shape} is not that of a scalar, vector or matrix")
        for value in self.start_values():
            if not self.minimum <= value <= self.maximum:
                raise DeclarationError(f"{self.name}: start {value} outside [{self.minimum}, {self.maximum}]")

    @property
    def size(self) -> int:
        return math.prod(self.shape)

    def start_values(self) -> tuple[float, ...]:
        """Start value of every element, row by row."""
        values = self.start if isinstance(self.start, tuple) else (self.start,) * self.size
        if len(values) != self.size:
            raise DeclarationError(f"{self.name}: {len(values)} start values for {self.size} elements")
        return tuple(float(value) for value in values)

    def element_names(self) -> list[str]:
        """Names of the scalar elements, row by row."""
        if not self.shape:
            return [self.name]
        indices = itertools.product(*(range(1, n + 1) for n in self.shape))
        return [f"{self.name}[{','.join(map(str, index))}]" for index in indices]


@dataclass(frozen=True)
class Parameter(Signal):
    """A parameter of a block. ``tunable`` parameters may change during a run, the others are fixed at its start."""

    kind: Literal["real", "integer", "boolean"] = "real"
    tunable: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.kind != "real" and self.unit != "1":
            raise DeclarationError(f"{self.name}: only real parameters carry a unit")


def real(
    name: str,
    unit: str,
    start: Values,
    bounds: tuple[float, float],
    description: str,
    *,
    shape: Shape = (),
    tunable: bool = False,
) -> Parameter:
    """A real parameter; its nominal value is the largest start value, or 1."""
    nominal = max(map(abs, start)) if isinstance(start, tuple) else abs(start)
    return Parameter(name, unit, description, *bounds, shape, start, nominal or 1.0, tunable=tunable)


def integer(name: str, start: int, bounds: tuple[int, int], description: str, *, tunable: bool = False) -> Parameter:
    """A whole-number parameter."""
    return Parameter(name, "1", description, *bounds, start=start, kind="integer", tunable=tunable)


def switch(name: str, description: str, *, start: bool = False) -> Parameter:
    """A parameter that is 0 or 1, fixed during a run."""
    return Parameter(name, "1", description, 0, 1, start=start, kind="boolean")


@dataclass(frozen=True)
class State:
    """Memory of a block between steps; start values matter only where the block computes no initial state."""

    name: str
    shape: Shape = ()
    start: float = 0.0

    @property
    def size(self) -> int:
        return math.prod(self.shape)


def total_size(items: Iterable[Signal | State]) -> int:
    """Number of scalar elements in all items."""
    return sum(item.size for item in items)
