"""What a limit can be on: the recorded variables of a run, and the errors of its estimators.

An error goes by the name of its estimator: ``plumb.tilt`` (also ``plumb.tilt_error``), ``plumb.roll_error``,
``plumb.heading_error``, ``plumb.external_acceleration_norm_error``; ``plumb.delay`` is from a sample to the row that
first has its estimate. They are those of ``imufmu run``, in the rows that have a truth at their instant.
"""

from __future__ import annotations

from difflib import get_close_matches

import numpy as np

from ..cosim.results import Result
from ..scoring.systems import compare_all
from .expressions import ExpressionError, Quantity


class Table:
    """Variables and errors of one run, by name. time: (n,), s, from the start of the run."""

    def __init__(self, result: Result) -> None:
        self._result = result
        self.time = result.time - result.time[0]
        every = np.ones(len(self.time), bool)
        self._more = {"time": Quantity(self.time, "s", every)}
        compared, self._notes = compare_all(result)
        for comparison in compared:
            rows = np.searchsorted(result.time, comparison.truth.time)
            known = np.zeros(len(self.time), bool)
            known[rows] = True
            for name, error in comparison.errors.items():
                values = np.zeros(len(self.time))
                values[rows] = error
                unit = "m/s2" if name.startswith("external_acceleration") else "rad"
                self._more[f"{comparison.component}.{name}_error"] = Quantity(values, unit, known)
                if name == "tilt":
                    self._more.setdefault(f"{comparison.component}.tilt", Quantity(values, unit, known))
            delay = np.full(len(self.time), comparison.delay)
            self._more[f"{comparison.component}.delay"] = Quantity(delay, "s", every)

    def __call__(self, name: str) -> Quantity:
        """Raises ExpressionError for a name that is not there."""
        if name in self._result:
            unit = self._result.units.get(name) or self._result.units.get(f"{name}[1]")
            values = np.asarray(self._result[name], float)
            return Quantity(values, unit, np.ones(len(self.time), bool))
        if name in self._more:
            return self._more[name]
        known = [*self._more, *self._result.names]
        close = get_close_matches(name, known, 1)
        there = ", ".join([*self._more, *self._result.names[:8]])
        reasons = "".join(f"; {note}" for note in self._notes)
        meant = f"; did you mean {close[0]}?" if close else ""
        raise ExpressionError(f"{name!r} is not there; there is {there}, ... {reasons}{meant}")
