"""One limit on one run: the value, how far it is from its bound, and when it was worst."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..cosim.units import Unit, UnitError, conversion
from . import statistics
from .expressions import Expression, ExpressionError, Quantity
from .limits import Bound, Limit
from .table import Table


class NothingToJudge(ValueError):
    """A run has no row that a limit looks at: its event never came, or the run is too short."""


@dataclass(frozen=True)
class Finding:
    """value: in ``unit``, of a condition its least robustness. margin: to the nearest bound, in the same unit, negative
    where it breaks. time: s from the start, of the row that decides.
    """

    value: float
    unit: str
    margin: float
    time: float

    @property
    def holds(self) -> bool:
        """False for NaN, too."""
        return self.margin >= 0


def judge(limit: Limit, table: Table) -> Finding:
    """Raises ExpressionError for a limit that fits no run of this system, NothingToJudge where this run lacks it."""
    rows = _rows(limit, table)
    if limit.kind != "statistic":
        return _condition(limit, table, rows)
    value = limit.quantity.evaluate(table)
    if limit.statistic == "finite":
        finite = np.isfinite(value.values).reshape(len(table.time), -1).all(axis=1)[rows] if value.values.ndim else True
        bad = np.flatnonzero(~np.atleast_1d(finite))
        at = table.time[rows][bad[0]] if bad.size else table.time[rows][-1]
        return Finding(float(bad.size), "rows not finite", -float(bad.size), float(at))
    unit = _shown_unit(limit, value)
    times, found = table.time[rows], _reduced(limit, table, value, rows, unit)
    margins = []
    for bound, sign in ((limit.at_most, 1.0), (limit.at_least, -1.0)):
        if bound is not None:
            margins.append(sign * (bound_in(bound, unit, limit) - found.value))
    return Finding(
        found.value, unit, min(margins) if not math.isnan(found.value) else math.nan, float(times[found.row])
    )


def _rows(limit: Limit, table: Table) -> np.ndarray:
    """Numbers of the rows that the limit looks at. Raises NothingToJudge where there is none."""
    window, start = limit.window, 0.0
    if window.after is not None:
        event = _flags(window.after, table)
        if not event.any():
            raise NothingToJudge(f"{window.after.text!r} never comes true, so there is nothing after it")
        start = float(table.time[np.argmax(event)])
    slack = 1e-9 * max(1.0, float(table.time[-1]))
    looked_at = table.time >= start + window.begin - slack
    if window.end is not None:
        looked_at &= table.time <= start + window.end + slack
    if window.where is not None:
        looked_at &= _flags(window.where, table)
    looked_at &= limit.quantity.evaluate(table).known
    rows = np.flatnonzero(looked_at)
    if not rows.size:
        raise NothingToJudge(f"no row is looked at; the run takes {table.time[-1]:g} s")
    return rows


def _flags(condition: Expression, table: Table) -> np.ndarray:
    value = condition.evaluate(table)
    if not value.is_condition:
        raise ExpressionError(f"{condition.text!r} is a number, where a condition is wanted")
    return np.broadcast_to(value.values & value.known, table.time.shape)


def _condition(limit: Limit, table: Table, rows: np.ndarray) -> Finding:
    value = limit.quantity.evaluate(table)
    if value.robustness is None:
        raise ExpressionError(f"{limit.quantity.text!r} is a number; write a condition, as plumb.tilt < 2 deg")
    robustness = np.broadcast_to(np.where(value.known, value.robustness, -np.inf), table.time.shape)
    begins = rows
    if limit.when is not None:
        begins = rows[_flags(limit.when, table)[rows]]
    if limit.kind == "eventually":
        if limit.when is None:
            begins = rows[:1]
        until = limit.within if limit.within is not None else math.inf
        robustness = statistics.within(table.time[: rows[-1] + 1], robustness[: rows[-1] + 1], until)
    unit, factor = shown(value.unit)
    if not begins.size:
        return Finding(math.inf, unit, math.inf, float(table.time[rows[0]]))
    worst = begins[np.argmin(robustness[begins])]
    least = factor * float(robustness[worst])
    return Finding(least, unit, least, float(table.time[worst]))


def shown(unit: str | None) -> tuple[str, float]:
    """The unit that a person is shown, and the factor to it: degrees for radians."""
    if unit in ("rad", "rad/s"):
        return unit.replace("rad", "deg"), float(np.rad2deg(1.0))
    return unit or "1", 1.0


def _reduced(limit: Limit, table: Table, value: Quantity, rows: np.ndarray, unit: str) -> statistics.Reduced:
    if limit.statistic == "share":
        found = statistics.share(_flags(limit.quantity, table)[rows])
        return statistics.Reduced(100 * found.value, found.row)
    if value.is_condition:
        raise ExpressionError(f"{limit.quantity.text!r} is a condition; its statistic is share, not {limit.statistic}")
    if value.values.ndim > 1:
        raise ExpressionError(f"{limit.quantity.text!r} is a vector; take norm(...) or one element, as gyro[1]")
    values = np.broadcast_to(value.values, table.time.shape)[rows]
    if limit.sigma is not None:
        sigma = limit.sigma.evaluate(table)
        return statistics.nees(values, _converted(sigma.values[rows], sigma.unit, value.unit, limit))
    if limit.band is not None:
        return statistics.settling_time(table.time[rows], values, bound_in(limit.band, value.unit or "1", limit))
    found = statistics.reduced(limit.statistic, values)
    return statistics.Reduced(float(_converted(found.value, value.unit, unit, limit)), found.row)


def _shown_unit(limit: Limit, value: Quantity) -> str:
    """The unit of the bound, as far as the value has one."""
    if limit.statistic == "share":
        return "%"
    if limit.statistic == "settling_time":
        return "s"
    if limit.statistic == "nees":
        return "1"
    bound = limit.at_most or limit.at_least
    return (bound.unit if bound else None) or value.unit or "1"


def bound_in(bound: Bound, unit: str, limit: Limit) -> float:
    """The bound in a unit. Raises ExpressionError."""
    if bound.unit is None and unit not in ("1", "%") and bound.value != 0:
        raise ExpressionError(f"{limit.name!r}: {bound.value:g} needs a unit, as the value is in {unit}")
    return bound.value if bound.unit in (None, unit) else float(_converted(bound.value, bound.unit, unit, limit))


def _converted(values: np.ndarray | float, source: str | None, target: str | None, limit: Limit) -> np.ndarray:
    """Values of one unit in another."""
    try:
        change = conversion(_unit(source), _unit(target))
        if (_unit(source) is None) != (_unit(target) is None):
            raise UnitError(f"{source or 1} and {target or 1} differ in kind")
    except UnitError as error:
        raise ExpressionError(f"{limit.name!r}: {error}") from None
    return np.asarray(change.factor * np.asarray(values) + change.offset)


def _unit(name: str | None) -> Unit | None:
    return Unit(name) if name and name != "1" else None
