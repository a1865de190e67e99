"""The Functions that one sample of a block with slow steps is made of, and their derivative."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca

from .expressions import function


@dataclass(frozen=True)
class SlowParts:
    """CasADi Functions of one sample, for a caller that changes the state in place.

    step: (state and held inputs, u, p, w) -> (the states that it changes, finite inputs, number of the slow step due)
    slow: (number, state, held inputs before the sample, u, p, w) -> (state); not to be called for number 0
    report: (state and finite inputs, held inputs before the sample, u, p, w) -> (y)
    slow_steps: each slow step as ``slow``, without the number
    """

    step: Any
    slow: Any
    report: Any
    slow_steps: tuple[Any, ...]

    def in_a_row(self, name: str) -> Any:
        """CasADi Function (x, u, p, w) -> (x, y) of all three, x with the held inputs."""
        arguments = self.step.mx_in()
        x_all, u, p, w = arguments
        n = self.slow.numel_out(0)
        fast, finite, due = self.step(*arguments)
        held = x_all[n:]
        x = self.slow(due, ca.vertcat(fast, x_all[fast.numel() : n]), held, u, p, w)
        x_next = ca.vertcat(x, finite)
        result = [x_next, self.report(x_next, held, u, p, w)]
        return ca.Function(name, arguments, result, ["x", "u", "p", "w"], ["x_next", "y"])

    def derivative(self, name: str, n_outputs: int) -> Any:
        """CasADi Function (x, u, p, w, du) -> (dy) of ``in_a_row``: change of the first outputs with that of u.

        Only what ``step`` changes depends on u before a slow step, and only what is reported counts behind it. So each
        slow step is differentiated in one list of instructions with ``report``: most of its covariance drops out.
        """
        x_all, u, p, w = self.step.mx_in()
        du, n = ca.MX.sym("du", u.shape), self.slow.numel_out(0)
        fast, finite, due = self.step(x_all, u, p, w)
        changes = [ca.jtimes(part, u, du) for part in (fast, finite)]
        x = ca.vertcat(fast, x_all[fast.numel() : n])
        choice = [self._changed(f"{name}_{i}", step, n_outputs) for i, step in enumerate((None, *self.slow_steps))]
        change = ca.Function.conditional(f"{name}_one_of", choice[1:], choice[0])
        # Number 0 is none: it is what stands beyond the list of the others, as -1 does.
        dy = change(due - 1, x, finite, x_all[n:], u, p, w, *changes, du)
        return ca.Function(name, [x_all, u, p, w, du], [dy], ["x", "u", "p", "w", "du"], ["dy"])

    def _changed(self, name: str, slow_step: Any, n_outputs: int) -> Any:
        """Function (x after ``step``, finite, held, u, p, w, their changes: of fast, finite, u) -> (dy)."""
        x, held, u, p, w = self.slow_steps[0].sx_in()
        finite, fast = ca.SX.sym("finite", held.shape), x[: self.step.numel_out(0)]
        after = slow_step(x, held, u, p, w) if slow_step else x
        y = self.report(ca.vertcat(after, finite), held, u, p, w)[:n_outputs]
        of = ca.vertcat(fast, finite, u)
        d_fast, d_finite, du = (ca.SX.sym(f"d_{i}", part.shape) for i, part in enumerate((fast, finite, u)))
        dy = ca.densify(ca.jtimes(y, of, ca.vertcat(d_fast, d_finite, du)))
        return function(name, [x, finite, held, u, p, w, d_fast, d_finite, du], [dy])


def one_of(name: str, slow_steps: Sequence[Any]) -> Any:
    """Function ``slow`` of SlowParts: number 1 evaluates the first slow step, and so on; 0 keeps the state."""
    arguments = slow_steps[0].mx_in()
    keep = ca.Function(f"{name}_keep", arguments, arguments[:1])
    return ca.Function.conditional(name, [keep, *slow_steps], keep)
