"""Vectors among the variables of an FMU, however their elements are named.

w[1] w[2] w[3], w[0] ..., w[1,1] ..., omega_x omega_y omega_z, omegaX ..., w1 w2 w3, p q r, q_w q_x q_y q_z.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import product

_INDEXED = re.compile(r"(.+)\[(\d+(?:,\d+)?)\]")
# A letter that stands for an axis: a word of its own, or at the end of a word that goes on differently.
_AXIS = re.compile(
    r"(?<![A-Za-z0-9])[wxyzWXYZ](?![A-Za-z0-9])|(?<=[a-z0-9])[WXYZ](?![a-z])|(?<=[A-Za-z0-9])[wxyz](?![A-Za-z0-9])"
)
_NUMBER = re.compile(r"(?<=[A-Za-z_])\d(?!\d|\])")
_RATE = re.compile(r"(?<![A-Za-z])[pqrPQR](?![A-Za-z0-9])")
_ORDERS = {3: ("xyz", "XYZ", "123", "012", "pqr", "PQR"), 4: ("wxyz", "WXYZ", "1234", "0123")}
PLACE = "*"  # stands in the name of a vector where its elements have a letter or number


@dataclass(frozen=True)
class Vector:
    """Elements in order; of a matrix row by row. order: "wxyz" or "pqr" where their letters are these, else empty."""

    name: str
    elements: tuple[str, ...]
    order: str = ""

    @property
    def words(self) -> list[str]:
        """The words of its name in lower case, without the place of its elements."""
        return words_of(self.name.replace(PLACE, " "))


def words_of(name: str) -> list[str]:
    """bodyAngular_velocity.w: body, angular, velocity, w."""
    parted = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", " ", name)
    return re.findall(r"[a-z]+|\d+", parted.lower())


def vectors(names: Iterable[str]) -> list[Vector]:
    """Every vector of three or four elements, every 3 x 3 matrix, and every scalar as a vector of one."""
    known = list(names)
    found: dict[tuple[str, ...], Vector] = {}
    indexed: dict[str, dict[str, str]] = {}
    placed: dict[tuple[str, str], dict[str, str]] = {}
    for name in known:
        match = _INDEXED.fullmatch(name)
        if match:
            indexed.setdefault(match[1], {})[match[2]] = name
            continue
        for kind, pattern in (("axis", _AXIS), ("number", _NUMBER), ("rate", _RATE)):
            for hit in pattern.finditer(name):
                key = name[: hit.start()] + PLACE + name[hit.end() :]
                placed.setdefault((kind, key), {})[hit[0]] = name
    for base, elements in indexed.items():
        for first, size in product((0, 1), (3, 4)):
            some = [str(i) for i in range(first, first + size)]
            square = [f"{i},{j}" for i, j in product(range(first, first + 3), repeat=2)]
            for wanted in (some, square):
                if set(wanted) == set(elements):
                    found.setdefault(
                        tuple(elements[i] for i in wanted), Vector(base, tuple(elements[i] for i in wanted))
                    )
    for (_, key), elements in placed.items():
        for size in (4, 3):
            for order in _ORDERS[size]:
                if set(order) == set(elements):
                    some_elements = tuple(elements[letter] for letter in order)
                    told = order.lower() if order.lower() in ("wxyz", "pqr") else ""
                    found.setdefault(some_elements, Vector(key, some_elements, told))
    return [*found.values(), *(Vector(name, (name,)) for name in known)]
