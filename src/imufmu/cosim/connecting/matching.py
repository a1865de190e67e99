"""Which variables of an FMU are the angular velocity, the specific force, an attitude: by names, units and sizes.

A name that can mean something else, as an acceleration that may or may not contain gravity, is never taken by itself:
the user is asked, or has to say. See ``Choice``.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ..truth import DIRECTIONS, ORDERS
from ..units import Unit, UnitError, conversion
from .vectors import PLACE, Vector, vectors, words_of

# Asked with a question and possible answers; returns one of them, or "" for none.
Ask = Callable[[str, Sequence[str]], str]

ALIASES = {"gyro": "angular_velocity", "accel": "specific_force", "mag": "magnetic_field", "q_NS": "quaternion"}


@dataclass(frozen=True)
class Quantity:
    """Something to be found. sure: names that mean it; perhaps: words that may. Each name as its words."""

    name: str
    size: int
    unit: str
    sure: tuple[str, ...]
    perhaps: tuple[str, ...] = ()
    doubt: str = ""  # what is to be made sure of


_GRAVITY = "does it contain gravity, +9.8 on the axis that points up at rest?"
_RATES = ("angular velocity", "angular rate", "angular rates", "gyro", "gyroscope", "omega", "w", "pqr", "body rates")
_FORCES = ("specific force", "accelerometer", "accel", "sf", "f b", "fb", "proper acceleration")
_FIELDS = ("magnetic field", "mag", "magnetometer", "b field")
READ = {
    "angular_velocity": Quantity(
        "angular_velocity",
        3,
        "rad/s",
        _RATES,
        ("omega", "w", "gyro", "rate", "rates", "velocity", "angvel"),
        "in the sensor's own axes?",
    ),
    "specific_force": Quantity(
        "specific_force", 3, "m/s2", _FORCES, ("acc", "accel", "acceleration", "a", "f", "force"), _GRAVITY
    ),
    "magnetic_field": Quantity("magnetic_field", 3, "uT", _FIELDS, ("mag", "magnetic", "b"), "in the sensor's axes?"),
}
SPEED = Quantity("forward_speed", 1, "m/s", ("forward speed",))  # of wheels; only where the user says so
TOLD = {
    "vertical": Quantity("vertical", 3, "1", ("vertical", "up", "s z")),
    "roll": Quantity("roll", 1, "rad", ("roll", "roll angle")),
    "pitch": Quantity("pitch", 1, "rad", ("pitch", "pitch angle")),
    "yaw": Quantity("yaw", 1, "rad", ("yaw", "yaw angle")),
    "quaternion": Quantity(
        "quaternion", 4, "1", ("q ns",), ("q", "quat", "quaternion", "attitude", "orientation", "att"), "which way?"
    ),
    "matrix": Quantity("matrix", 9, "1", (), ("r", "dcm", "matrix", "rotation", "rot", "orientation"), "which way?"),
    "external_acceleration": Quantity("external_acceleration", 3, "m/s2", ("external acceleration",)),
    "position": Quantity("position", 3, "m", ("position",)),
}


@dataclass(frozen=True)
class Choice:
    """What a quantity is. factors: of each element, to the quantity's unit. unit: that it is in; None if unknown."""

    quantity: str
    variables: tuple[str, ...]
    factors: tuple[float, ...]
    unit: str | None
    form: str = ""

    def __str__(self) -> str:
        signs = ["-" if factor < 0 else "" for factor in self.factors]
        names = ", ".join(sign + name for sign, name in zip(signs, self.variables, strict=True))
        parts = [names, f"[{self.unit}]" if self.unit else "[no unit]", self.form]
        return " ".join(part for part in parts if part)


class Matcher:
    """The Real variables of an FMU, and what they can be.

    units: as the FMU defines them, by variable. found: names of those that need not be named by the user.
    """

    def __init__(
        self, where: str, variables: Iterable[Any], units: Mapping[str, Unit | None], found: Collection[str]
    ) -> None:
        self.where = where
        self._names = [v.name for v in variables if v.type == "Real"]
        self._units = units
        self._all_vectors = vectors(self._names)
        self._vectors = [vector for vector in self._all_vectors if set(vector.elements) <= set(found)]

    def find(self, quantity: Quantity, ask: Ask | None, by_unit: bool = False) -> tuple[Choice | None, str]:
        """What the quantity is, or None and why: what it may be and how to say so; empty if nothing looks like it.

        by_unit: the unit alone makes something worth asking about.
        """
        fitting = [vector for vector in self._vectors if self._fits(quantity, vector)]
        sure = [vector for vector in fitting if _is_sure(quantity, vector)]
        sure = [vector for vector in sure if " ".join(vector.words) == quantity.sure[0]] or sure  # upper_... is another
        perhaps = sure or [vector for vector in fitting if set(vector.words) & set(quantity.perhaps)]
        if not perhaps and by_unit:
            perhaps = [vector for vector in fitting if self._units.get(vector.elements[0])]
        if len(sure) == 1:
            return self._choice(quantity, sure[0]), ""
        if not perhaps:
            return None, ""
        shown = [str(self._choice(quantity, vector)) for vector in perhaps]
        if ask is None:
            name = perhaps[0].name if PLACE not in perhaps[0].name else ",".join(perhaps[0].elements)
            said = f"--map {short(quantity.name)}={name}"
            return None, f"{quantity.name} may be {' or '.join(shown)}; {quantity.doubt or 'which?'} Say it: {said}"
        answer = ask(f"Is this the {quantity.name}? {quantity.doubt}".strip(), [*shown, "none of these"])
        chosen = dict(zip(shown, perhaps, strict=True)).get(answer)
        return (self._choice(quantity, chosen) if chosen else None), ""

    def candidates(self, quantity: Quantity) -> list[Choice]:
        """Everything that may be the quantity by its name."""
        fitting = [vector for vector in self._vectors if self._fits(quantity, vector)]
        return [self._choice(quantity, vector) for vector in fitting if set(vector.words) & set(quantity.perhaps)]

    def given(self, quantity: Quantity, text: str) -> Choice:
        """What the user says it is: a vector or its elements, with signs, and a unit or a form behind colons.

        Raises ValueError.
        """
        names, *words = text.split(":")
        said = [word for word in words if word in (*ORDERS, *DIRECTIONS)]
        units = [word for word in words if word not in said]
        parts = [part.strip() for part in re.split(r",(?![^\[]*\])", names)]  # not at the comma of R[1,2]
        signs = [-1.0 if part.startswith("-") else 1.0 for part in parts]
        elements = tuple(part.lstrip("+-") for part in parts)
        order = ""
        if len(parts) == 1 and quantity.size > 1:
            vector = self._called(quantity, elements[0], text)
            signs, elements, order = signs * quantity.size, vector.elements, vector.order
        unknown = [name for name in elements if name not in self._names]
        if unknown or len(elements) != quantity.size:
            fault = f"no variable {', '.join(unknown)}" if unknown else f"{len(elements)} names, not {quantity.size}"
            raise ValueError(
                f"{short(quantity.name)}={text}: {fault}; {self.where} has {', '.join(self._names) or 'none'}"
            )
        said += [order] if order in ORDERS else []
        own = [Unit(units[-1]) if units else self._units.get(element) for element in elements]
        try:
            factors = [conversion(unit, Unit(quantity.unit)).factor for unit in own]
        except UnitError as error:
            raise ValueError(f"{short(quantity.name)}={text}: {error}") from None
        form = _checked_form(quantity, text, said)
        signed = tuple(sign * factor for sign, factor in zip(signs, factors, strict=True))
        named = ", ".join(dict.fromkeys(unit.name for unit in own if unit)) or None
        return Choice(quantity.name, elements, signed, named, form)

    def there_is(self, size: int) -> str:
        """Vectors of a size, for messages."""
        return "; ".join(", ".join(v.elements) for v in self._vectors if len(v.elements) == size) or (
            f"no vector of {size}, but {', '.join(self._names) or 'nothing'}"
        )

    def _called(self, quantity: Quantity, base: str, text: str) -> Vector:
        """omega for omega_*: the place of its elements and what joins it on may be left out. Raises ValueError."""
        sized = [v for v in self._all_vectors if len(v.elements) == quantity.size]
        for same in (
            [v for v in sized if base in (v.name, v.name.replace(PLACE, "").strip("_."))],
            [v for v in sized if words_of(base) == v.words != []],
        ):
            if len(same) == 1:
                return same[0]
        raise ValueError(
            f"{short(quantity.name)}={text}: {self.where} has no single vector of {quantity.size} of that name; "
            f"there is {self.there_is(quantity.size)}. Or give {quantity.size} names with commas"
        )

    def _fits(self, quantity: Quantity, vector: Vector) -> bool:
        own = {self._units.get(element) for element in vector.elements}
        try:
            return len(vector.elements) == quantity.size and all(conversion(u, Unit(quantity.unit)) for u in own)
        except UnitError:
            return False

    def _choice(self, quantity: Quantity, vector: Vector) -> Choice:
        unit = self._units.get(vector.elements[0])
        factor = conversion(unit, Unit(quantity.unit)).factor
        form = vector.order if vector.order in ORDERS else ""
        if quantity.name == "quaternion" and _is_sure(quantity, vector):
            form = f"{ORDERS[0]} {DIRECTIONS[0]}"
        return Choice(quantity.name, vector.elements, (factor,) * quantity.size, unit.name if unit else None, form)


def short(quantity: str) -> str:
    """The name that people type: gyro for angular_velocity."""
    return next((alias for alias, name in ALIASES.items() if name == quantity and alias != "q_NS"), quantity)


def with_form(choice: Choice, ask: Ask | None) -> tuple[Choice | None, str]:
    """A quaternion or matrix whose order and direction are known, by asking; or None, and how to say so."""
    known = choice.form.split()
    for some, question in (
        (ORDERS if choice.quantity == "quaternion" else (), "In which order are its elements?"),
        (DIRECTIONS, "Does it turn the components of a vector to those in the world, or in the body?"),
    ):
        if not some or set(some) & set(known):
            continue
        if ask is None:
            forms = "".join(f":{'|'.join(part)}" for part in ((ORDERS,) if choice.quantity == "quaternion" else ()))
            return None, (
                f"{choice} may be the attitude; its order and direction are not known. Say it: "
                f"--map {choice.quantity}={choice.variables[0].split('[')[0]}{forms}:{'|'.join(DIRECTIONS)}"
            )
        answer = ask(f"{choice}: {question}", [*some, "neither"])
        if answer not in some:
            return None, ""
        known.append(answer)
    form = " ".join(word for word in (*ORDERS, *DIRECTIONS) if word in known)
    return replace(choice, form=form), ""


def _is_sure(quantity: Quantity, vector: Vector) -> bool:
    words = " ".join(vector.words)
    named = any(f" {words}".endswith(f" {name}") for name in quantity.sure)
    return named or (quantity.name == "angular_velocity" and vector.order == "pqr")


def _checked_form(quantity: Quantity, text: str, said: Sequence[str]) -> str:
    """Raises ValueError where the order or the direction of an attitude is not said, or is said of something else."""
    orders, ways = ([word for word in dict.fromkeys(said) if word in some] for some in (ORDERS, DIRECTIONS))
    is_attitude = quantity.name in ("quaternion", "matrix")
    lacking = [f":{'|'.join(ORDERS)} (its order)"] if quantity.name == "quaternion" and len(orders) != 1 else []
    lacking += [f":{'|'.join(DIRECTIONS)} (what it turns vectors to)"] if is_attitude and len(ways) != 1 else []
    if lacking:
        raise ValueError(f"{short(quantity.name)}={text}: add {' and '.join(lacking)}")
    if said and not is_attitude:
        raise ValueError(f"{short(quantity.name)}={text}: {' '.join(said)} is for a quaternion or a matrix")
    return " ".join([*(orders if quantity.name == "quaternion" else []), *ways])
