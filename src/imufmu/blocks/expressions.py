"""Flat vectors of CasADi expressions, and the names and shapes of what they hold."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from types import SimpleNamespace
from typing import Any

import casadi as ca

from .signals import Shape, Signal, State


def function(name: str, *parts: Any) -> Any:
    """CasADi Function that computes equal terms once."""
    return ca.Function(name, *parts, {"cse": True})  # type: ignore[call-overload]


def all_of(conditions: Any) -> Any:
    """1 where every element of a column is not 0."""
    return reduce(ca.logic_and, ca.vertsplit(conditions))


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
