"""FMUs for model exchange, which bring equations and no solver: fmpy's CVode carries them from time to time.

Inputs are held over a step, so each change of them is an event, behind which the solver begins anew.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Model
from fmpy.fmi3 import FMU3Model

from .errors import EndOfRun, SimulationError
from .slave import CALLS, INTEGRATION, Slave, quoted, when
from .slave3 import Slave3
from .unpacked import Equations, Unpacked

_MOST_EVENTS = 10_000  # in one step; more do not come to an end
_SAME_TIME = 1e-9  # of a step


class _Solved(Slave):
    """A slave whose steps are those of a solver."""

    _solver: _Solver

    def _prepare_step(self, fmu: Unpacked) -> None:
        assert fmu.equations is not None
        self._equations = fmu.equations
        self._before: list[np.ndarray] = []

    def exit_initialisation(self, time: float) -> None:
        """Leave initialization mode, handle the event at the start, and begin to solve."""
        super().exit_initialisation(time)
        self._guarded(lambda: self._begin(time), when(time))
        self._before = [buffer.copy() for buffer in self._buffers]

    def _begin(self, time: float) -> None:
        self._solver = _Solver(self._fmu, self._equations, time)

    def advance(self, time: float, h: float, reached: float) -> None:
        """Hand over the inputs where they changed, solve from time to time + h, get the variables."""
        if any(not np.array_equal(was, now) for was, now in zip(self._before, self._buffers, strict=True)):
            self._guarded(lambda: self._solver.event(lambda: self._make(self._sets, time)), when(time))
            for was, now in zip(self._before, self._buffers, strict=True):
                was[:] = now
        self._now.value = CALLS.index(INTEGRATION)
        self._guarded(lambda: self._solver.advance(h), when(time, h))
        self.read(reached)

    def _guarded(self, work: Callable[[], None], at: str) -> None:
        """Do it; what goes wrong in fmpy or its solver becomes a SimulationError."""
        try:
            work()
        except FMICallException as error:
            raise self._failure(error.function, error.status, at) from error
        except EndOfRun:
            raise EndOfRun(f"{self.name} ended the run at {at}{self._last_words()}") from None
        except SimulationError:
            raise
        except Exception as error:  # fmpy raises plain exceptions
            raise SimulationError(f"{self.name}: {error} at {at}{quoted(self.messages.latest)}") from error


class Solved2(_Solved):
    """An instance of an FMU 2.0 for model exchange, used as a Slave is."""

    _library: Any = FMU2Model


class Solved3(_Solved, Slave3):
    """An instance of an FMU 3.0 for model exchange, used as a Slave is."""

    _library: Any = FMU3Model


class _Solver:
    """The equations of an instance in continuous-time mode. Raises what fmpy raises, and RuntimeError.

    Its time counts from the start, in whole steps, so that equations are solved as well at 1.7e9 s as at 0.
    """

    def __init__(self, fmu: Any, equations: Equations, start: float) -> None:
        try:
            from fmpy.sundials import CVodeSolver
        except OSError as error:
            raise RuntimeError("FMPy brings no solver for this platform, which model exchange needs") from error

        self._fmu, self._equations, self._start = fmu, equations, start
        self._time = self._origin = 0.0
        self._h, self._steps = 0.0, 0  # of equal length since the origin
        self._update = getattr(fmu, "updateDiscreteStates", None) or fmu.newDiscreteStates
        self._fault: Exception | None = None
        self._next: float | None = None
        self._iterate()
        fmu.enterContinuousTimeMode()
        derivatives = getattr(fmu, "getContinuousStateDerivatives", None) or fmu.getDerivatives
        self._cvode = CVodeSolver(
            equations.states,
            equations.indicators,
            *map(self._kept, (fmu.getContinuousStates, fmu.setContinuousStates, derivatives, fmu.getEventIndicators)),
            self._kept(fmu.getNominalsOfContinuousStates),
            self._kept(self._set_time),
            self,
            0.0,
            relativeTolerance=equations.tolerance,
            maxNumSteps=100_000,
        )
        self._check()

    def _set_time(self, since_start: float) -> None:
        self._fmu.setTime(self._start + since_start)

    def apply(self, time: float) -> None:
        """As an input of fmpy: nothing to be done, inputs are held."""

    def event(self, change: Callable[[], None] = lambda: None) -> None:
        """An event at the present time: a change from outside, or one of the FMU's own."""
        self._fmu.enterEventMode()
        change()
        self._iterate()
        self._fmu.enterContinuousTimeMode()
        self._cvode.reset(self._time)
        self._check()

    def advance(self, h: float) -> None:
        """Solve over h (s), stopping at events."""
        if h != self._h:
            self._origin, self._steps, self._h = self._time, 0, h
        self._steps += 1
        end, near = self._origin + self._steps * h, _SAME_TIME * h
        for _ in range(_MOST_EVENTS):
            if self._next is not None and self._next <= self._time + near:
                self.event()
                continue
            goal = end if self._next is None or self._next > end - near else self._next
            crossed, _, self._time = self._cvode.step(self._time, goal)
            self._check()
            self._set_time(self._time)
            asked = False
            if self._equations.told_of_steps:
                asked, ended = self._fmu.completedIntegratorStep()
                self._refuse_end(ended)
            if crossed or asked:
                self.event()
            if self._time >= end - near:
                if self._next is not None and self._next <= self._time + near:
                    self.event()
                return
        raise RuntimeError(f"more than {_MOST_EVENTS} events")

    def _iterate(self) -> None:
        """Let discrete states settle."""
        for _ in range(_MOST_EVENTS):
            again, ended, _, _, defined, following = self._update()
            self._refuse_end(ended)
            if not again:
                self._next = following - self._start if defined else None
                return
        raise RuntimeError(f"its discrete states do not settle in {_MOST_EVENTS} iterations")

    def _refuse_end(self, ended: bool) -> None:
        if ended:
            raise EndOfRun

    def _kept(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """The function, which the solver calls by way of C: an exception would be lost on that way."""

        def call(*arguments: Any) -> Any:
            try:
                return function(*arguments)
            except Exception as error:
                self._fault = self._fault or error
                return None

        return call

    def _check(self) -> None:
        if self._fault:
            fault, self._fault = self._fault, None
            raise fault
