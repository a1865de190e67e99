"""Functions of time that plants are made of: derivatives, smooth steps, windows."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca


def along(f: Callable[[Any], Any], at: Any, rate: Any, acceleration: Any = 0) -> tuple[Any, Any, Any]:
    """Value and first two time derivatives of f(q(t)), f a column, where q is ``at`` and has these derivatives."""
    s = ca.SX.sym("s")
    value = f(at + rate * s + acceleration * s**2 / 2)
    slope = ca.jacobian(value, s)
    now = ca.substitute([value, slope, ca.jacobian(slope, s)], [s], [ca.SX(0)])
    return now[0], now[1], now[2]


def smooth_step(s: Any) -> Any:
    """Polynomial from 0 (s <= 0) to 1 (s >= 1) whose first three derivatives are 0 at both ends."""
    s = ca.fmin(ca.fmax(s, 0), 1)
    return s**4 * (35 - 84 * s + 70 * s**2 - 20 * s**3)


def step_integral(s: Any) -> Any:
    """Integral of ``smooth_step`` from 0 to s; s - 1/2 for s >= 1."""
    inside = ca.fmin(ca.fmax(s, 0), 1)
    return inside**5 * (7 - 14 * inside + 10 * inside**2 - 2.5 * inside**3) + ca.fmax(s - 1, 0)


def step_double_integral(s: Any) -> Any:
    """Integral of ``step_integral`` from 0 to s."""
    inside, beyond = ca.fmin(ca.fmax(s, 0), 1), ca.fmax(s - 1, 0)
    return inside**6 * (7 / 6 - 2 * inside + 5 / 4 * inside**2 - 5 / 18 * inside**3) + (beyond + beyond**2) / 2


def windows(t: Any, count: Any, start: Any, stop: Any, ramp: Any) -> Any:
    """1 in the first ``count`` of the intervals, 0 outside, with three continuous derivatives.

    start, stop: (n,), s. The window rises and falls within ``ramp`` (s) inside its interval.
    """
    outside = 1
    for i in range(start.numel()):
        inside = smooth_step((t - start[i]) / ramp) * smooth_step((stop[i] - t) / ramp)
        outside *= 1 - ca.if_else(i < count, inside, 0)
    return 1 - outside
