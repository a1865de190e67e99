"""Flat vectors of CasADi expressions, and the names and shapes of what they hold."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from types import SimpleNamespace
from typing import Any

import casadi as ca

from .signals import Shape, Signal, State

LARGEST_SQUARE = 1e300


def function(name: str, *parts: Any) -> Any:
    """CasADi Function that computes equal terms once."""
    return ca.Function(name, *parts, {"cse": True})  # type: ignore[call-overload]


def all_of(conditions: Any) -> Any:
    """1 where every element of a column is not 0."""
    return reduce(ca.logic_and, ca.vertsplit(conditions))


def is_within(column: Any, least: float, largest: float) -> Any:
    """1 for every element within these bounds: no comparison holds for NaN."""
    if least == -largest:
        return ca.fabs(column) <= largest
    return ca.logic_and(column >= least, column <= largest)


def is_finite(column: Any) -> Any:
    """1 where every element of a column is finite, and the sum of their squares not beyond LARGEST_SQUARE."""
    squares = [element**2 for element in ca.vertsplit(column)]
    while len(squares) > 1:  # in pairs: sums that do not wait for each other
        squares = [a + b for a, b in zip(squares[::2], squares[1::2], strict=False)] + squares[len(squares) & ~1 :]
    return squares[0] <= LARGEST_SQUARE if squares else 1


def shaped(flat: Any, shape: Shape) -> Any:
    """Flat row-by-row column as an expression of the declared shape."""
    return ca.reshape(flat, shape[1], shape[0]).T if len(shape) == 2 else flat


def namespace(items: Sequence[Signal | State], flat: Any) -> SimpleNamespace:
    """The parts of a flat vector by the names of the items, in their order."""
    result, first = SimpleNamespace(), 0
    for item in items:
        setattr(result, item.name, shaped(flat[first : first + item.size], item.shape))
        first += item.size
    return result
