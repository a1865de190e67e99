"""Quantities and conditions in a limits file: ``abs(plumb.roll - plant.roll) < 2 deg and plant.speed > 5 m/s``.

Written as in Python, with units behind numbers: names of variables or vectors, + - * /, abs, norm (of a vector),
flag(status, 64), comparisons, and, or, not. Numbers are compared with what has a unit only in a unit themselves.

A condition has a robustness over time: how far it is from turning false (negative: from turning true), in the unit of
its comparison; of several comparisons the least with ``and``, the greatest with ``or`` [1].

[1] Fainekos, Pappas, Robustness of temporal logic specifications for continuous-time signals, Theoretical Computer
    Science 410(42), 2009, doi:10.1016/j.tcs.2009.06.021
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import NoReturn

import numpy as np

from ..cosim.units import Unit, UnitError, conversion

_WORDS = r"(?!(?:and|or|not)\b)"
_UNIT = r"[A-Za-z°µμ√%][\w°µμ√²³]*(?:[/*·](?:sqrt\(\w+\)|[\w°µμ√]+[²³]?))*"
_NUMBER_WITH_UNIT = re.compile(rf"(?<![\w.\[])(\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+)\s*{_WORDS}({_UNIT})")
_MARK = "_in_unit"
_FUNCTIONS = ("abs", "norm", "flag")
_LEAST = float(np.finfo(float).tiny)  # robustness of what is on a limit and should be off it
_SAMENESS = 1e-9  # relative, of equal numbers


class ExpressionError(ValueError):
    """A text is no quantity or condition, or its units do not fit."""


@dataclass(frozen=True)
class Quantity:
    """values: (n,) or (n, k), bool for a condition without a distance. unit: None without one.

    robustness: (n,), of a condition. known: (n,) bool, rows that have a value.
    """

    values: np.ndarray
    unit: str | None
    known: np.ndarray
    robustness: np.ndarray | None = None

    @property
    def is_condition(self) -> bool:
        return self.robustness is not None


Lookup = Callable[[str], Quantity]  # raises KeyError


@dataclass(frozen=True)
class Expression:
    """A parsed text. names: of the variables in it."""

    text: str
    tree: ast.expr
    names: tuple[str, ...]

    def evaluate(self, lookup: Lookup) -> Quantity:
        """Its values over time. Raises ExpressionError."""
        return _Evaluation(self.text, lookup).of(self.tree)


def parse(text: str) -> Expression:
    """Raises ExpressionError."""
    marked = _NUMBER_WITH_UNIT.sub(lambda match: f'{_MARK}({match[1]}, "{match[2]}")', text.strip())
    try:
        tree = ast.parse(marked, mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise ExpressionError(f"{text!r} cannot be read; write as plumb.tilt or abs(plumb.roll) < 2 deg") from None
    names: list[str] = []
    _collect(text, tree, names)
    return Expression(text.strip(), tree, tuple(dict.fromkeys(names)))


def _collect(text: str, node: ast.expr, names: list[str]) -> None:
    """Names of variables; refuses what has no place in a limit."""
    name = _name(node)
    if name is not None:
        names.append(name)
        return
    match node:
        case ast.BinOp(op=ast.Add() | ast.Sub() | ast.Mult() | ast.Div()):
            parts = [node.left, node.right]
        case ast.UnaryOp(op=ast.USub() | ast.UAdd() | ast.Not()):
            parts = [node.operand]
        case ast.BoolOp():
            parts = node.values
        case ast.Compare():
            parts = [node.left, *node.comparators]
        case ast.Call(func=ast.Name(id=function)) if not node.keywords and function in (*_FUNCTIONS, _MARK):
            parts = [] if function == _MARK else node.args
        case ast.Constant(value=bool()) | ast.Constant(value=str()):
            _refuse(text, node)
        case ast.Constant(value=int() | float()):
            parts = []
        case _:
            _refuse(text, node)
    for part in parts:
        _collect(text, part, names)


def _name(node: ast.expr) -> str | None:
    """component.variable, component.variable[1] or a bare name."""
    match node:
        case ast.Name(id=name) if name not in (*_FUNCTIONS, _MARK):
            return name
        case ast.Attribute(value=value, attr=attr):
            before = _name(value)
            return None if before is None else f"{before}.{attr}"
        case ast.Subscript(value=value, slice=ast.Constant(value=int(index))):
            before = _name(value)
            return None if before is None else f"{before}[{index}]"
        case ast.Subscript(value=value, slice=ast.Tuple(elts=elements)):
            before = _name(value)
            inside = [element.value for element in elements if isinstance(element, ast.Constant)]
            return None if before is None else f"{before}[{','.join(map(str, inside))}]"
    return None


def _refuse(text: str, node: ast.expr) -> NoReturn:
    part = ast.unparse(node)
    raise ExpressionError(
        f"{text!r}: {part!r} has no place here; there is + - * / < <= > >= == != and or not, {', '.join(_FUNCTIONS)}"
    )


class _Evaluation:
    """Values of the nodes of one expression."""

    def __init__(self, text: str, lookup: Lookup) -> None:
        self._text, self._lookup = text, lookup

    def of(self, node: ast.expr) -> Quantity:
        name = _name(node)
        if name is not None:
            return self._lookup(name)
        match node:
            case ast.Constant(value=int() | float() as number):
                return Quantity(np.array(float(number)), None, np.array(True))
            case ast.Call(func=ast.Name(id=function), args=arguments):
                return self._call(function, arguments)
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                condition = self._condition(operand)
                return self._of_robustness(_negated(_robustness(condition)), condition.unit, condition.known)
            case ast.UnaryOp():
                negated = self._number(node.operand)
                sign = 1.0 if isinstance(node.op, ast.UAdd) else -1.0
                return Quantity(sign * negated.values, negated.unit, negated.known)
            case ast.BinOp(left=left, op=op, right=right):
                return self._arithmetic(self._number(left), op, self._number(right))
            case ast.BoolOp():
                conditions = [self._condition(part) for part in node.values]
                extreme = np.minimum if isinstance(node.op, ast.And) else np.maximum
                together = extreme.reduce(np.broadcast_arrays(*map(_robustness, conditions)))
                return self._of_robustness(together, conditions[0].unit, _all_known(*conditions))
            case ast.Compare(left=left, ops=[op], comparators=[right]):
                return self._comparison(self._number(left), op, self._number(right))
        raise ExpressionError(f"{self._text!r}: compare two at a time, with 'and' between")

    def _call(self, function: str, arguments: list[ast.expr]) -> Quantity:
        if function == _MARK:
            number, unit = (argument.value for argument in arguments if isinstance(argument, ast.Constant))
            return Quantity(np.array(float(number)), str(unit), np.array(True))  # type: ignore[arg-type]
        wanted = 2 if function == "flag" else 1
        if len(arguments) != wanted:
            raise ExpressionError(f"{self._text!r}: {function} takes {wanted} argument{'s' * (wanted > 1)}")
        value = self._number(arguments[0])
        if function == "abs":
            return Quantity(np.abs(value.values), value.unit, value.known)
        if function == "norm":
            return Quantity(np.linalg.norm(np.atleast_2d(value.values), axis=-1), value.unit, value.known)
        flag = self._number(arguments[1]).values
        raised = (value.values.astype(np.int64) & int(flag)) != 0
        return self._of_robustness(np.where(raised, 1.0, -1.0), None, value.known)

    def _arithmetic(self, a: Quantity, op: ast.operator, b: Quantity) -> Quantity:
        known = _all_known(a, b)
        if isinstance(op, ast.Add | ast.Sub):
            right = self._in_unit_of(a, b)
            values = a.values + right if isinstance(op, ast.Add) else a.values - right
            return Quantity(values, a.unit or b.unit, known)
        if _has_unit(b) and (_has_unit(a) or isinstance(op, ast.Div)):
            raise ExpressionError(f"{self._text!r}: only numbers without a unit multiply and divide")
        with np.errstate(divide="ignore", invalid="ignore"):
            values = a.values * b.values if isinstance(op, ast.Mult) else a.values / b.values
        return Quantity(values, a.unit or b.unit, known)

    def _comparison(self, a: Quantity, op: ast.cmpop, b: Quantity) -> Quantity:
        right, known = self._in_unit_of(a, b), _all_known(a, b)
        with np.errstate(invalid="ignore"):
            above = a.values - right
            same = np.abs(above) <= _SAMENESS * np.maximum(np.abs(a.values), np.abs(right))
        match op:
            case ast.Lt() | ast.LtE():
                robustness = -above
            case ast.Gt() | ast.GtE():
                robustness = above
            case ast.Eq():
                robustness = np.where(same, 1.0, -np.abs(above))
            case ast.NotEq():
                robustness = np.where(same, -1.0, np.abs(above))
            case _:
                raise ExpressionError(f"{self._text!r}: only < <= > >= == != compare")
        if isinstance(op, ast.Lt | ast.Gt):  # on the limit is not below it
            robustness = np.where(robustness == 0, -_LEAST, robustness)
        return self._of_robustness(np.where(np.isnan(robustness), -np.inf, robustness), a.unit or b.unit, known)

    def _of_robustness(self, robustness: np.ndarray, unit: str | None, known: np.ndarray) -> Quantity:
        if robustness.ndim > 1:
            raise ExpressionError(f"{self._text!r}: compares a vector; take norm(...) or one element, as gyro[1]")
        return Quantity(robustness >= 0, unit, known, robustness)

    def _in_unit_of(self, a: Quantity, b: Quantity) -> np.ndarray:
        """Values of b in the unit of a."""
        if _has_unit(a) != _has_unit(b):
            bare, other = (b, a) if _has_unit(a) else (a, b)
            if bare.values.ndim == 0 and bare.values == 0:
                return b.values
            what = f"{bare.values:g}" if bare.values.ndim == 0 else "the other side"
            raise ExpressionError(f"{self._text!r}: one side is in {other.unit}; give {what} a unit, too")
        try:
            change = conversion(Unit(b.unit) if _has_unit(b) else None, Unit(a.unit) if _has_unit(a) else None)  # type: ignore[arg-type]
        except UnitError as error:
            raise ExpressionError(f"{self._text!r}: {error}") from None
        return np.asarray(change.factor * b.values + change.offset)

    def _number(self, node: ast.expr) -> Quantity:
        value = self.of(node)
        if value.is_condition:
            raise ExpressionError(f"{self._text!r}: {ast.unparse(node)!r} is a condition, where a number is wanted")
        return value

    def _condition(self, node: ast.expr) -> Quantity:
        value = self.of(node)
        if not value.is_condition:
            raise ExpressionError(f"{self._text!r}: {ast.unparse(node)!r} is a number, where a condition is wanted")
        return value


def _robustness(condition: Quantity) -> np.ndarray:
    assert condition.robustness is not None
    return condition.robustness


def _negated(robustness: np.ndarray) -> np.ndarray:
    """On the limit either a condition or its opposite holds, not both."""
    on_it = np.where(robustness == 0, -_LEAST, 0.0)
    return np.where(np.abs(robustness) <= _LEAST, on_it, -robustness)


def _has_unit(quantity: Quantity) -> bool:
    return quantity.unit not in (None, "", "1")


def _all_known(*parts: Quantity) -> np.ndarray:
    known = parts[0].known
    for part in parts[1:]:
        known = known & part.known
    return known
