"""The Functions that one sample of a block with slow steps is made of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca


@dataclass(frozen=True)
class SlowParts:
    """CasADi Functions of one sample, for a caller that changes the state in place.

    step: (state and held inputs, u, p, w) -> (the states that it changes, finite inputs, number of the slow step due)
    slow: (number, state, held inputs before the sample, u, p, w) -> (state); not to be called for number 0
    report: (state and finite inputs, held inputs before the sample, u, p, w) -> (y)
    """

    step: Any
    slow: Any
    report: Any

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


def one_of(name: str, slow_steps: Sequence[Any]) -> Any:
    """Function ``slow`` of SlowParts: number 1 evaluates the first slow step, and so on; 0 keeps the state."""
    arguments = slow_steps[0].mx_in()
    keep = ca.Function(f"{name}_keep", arguments, arguments[:1])
    return ca.Function.conditional(name, [keep, *slow_steps], keep)
