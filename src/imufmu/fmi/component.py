"""What an FMU in Python answers to each FMI function: the same as the C of fmu_src/c, in the same words.

A call that is refused raises Refusal and changes nothing. From then on the component is failed: it can be read, but it
goes on only from a state that was saved, or after a reset.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from ..blocks.block import Block, ParameterError, Variable
from ..blocks.instance import SampledInstance, StateError, StepError, instantiate
from ..blocks.signals import Parameter


class Refusal(Exception):
    """Why a call is refused; to be handed to the host."""


INSTANTIATED, INITIALISING, STEPPING, TERMINATED = 1, 2, 4, 8  # phases of a component's life; sums are sets of them

_PHASE_NAMES = {
    INSTANTIATED: "before initialisation",
    INITIALISING: "during initialisation",
    STEPPING: "once the simulation runs",
    TERMINATED: "after fmi2Terminate",
}
_READABLE = INITIALISING | STEPPING | TERMINATED
_WRITABLE = INSTANTIATED | INITIALISING | STEPPING


class Component:
    """One instance of a block behind the FMI functions. warn: takes messages of status fmi2Warning.

    Value references count the block's variables from 0; the one after the last is ``sample_time`` of a sampled block.
    """

    def __init__(self, block: Block, warn: Callable[[str], None]) -> None:
        self.block = block
        self._warn = warn
        self._instance = instantiate(block)
        self._values = self._instance.values
        self._inputs = len(self._instance.u)
        self._results = self._inputs + len(self._instance.p)  # value reference of the first
        self._types = [_type_of(variable) for variable in block.variables]
        self._start_time = 0.0
        self._phase = INSTANTIATED
        self._failed = False
        self._stale = True  # the outputs do not yet reflect the inputs and parameters in force
        self._missing = False  # in an episode of inputs that count as missing

    def failed(self) -> None:
        """Do not go on: a call was refused."""
        self._failed = True

    # Phases

    def setup_experiment(self, start_time: float) -> None:
        self._require("fmi2SetupExperiment", INSTANTIATED)
        if not math.isfinite(start_time):
            raise self._refusal(f"start time {start_time:g} is not a time")
        self._start_time = start_time

    def enter_initialization_mode(self) -> None:
        self._require("fmi2EnterInitializationMode", INSTANTIATED)
        self._phase = INITIALISING

    def exit_initialization_mode(self) -> None:
        self._require("fmi2ExitInitializationMode", INITIALISING)
        try:
            self._instance.initialise(self._start_time)
        except ParameterError as error:
            raise Refusal(str(error)) from error
        self._phase = STEPPING
        self._stale = False

    def do_step(self, t: float, h: float) -> None:
        self._require("fmi2DoStep", STEPPING)
        try:
            self._instance.do_step(t, h)
        except StepError as error:
            raise Refusal(str(error)) from error
        self._stale = False
        self._report_missing_inputs()

    def terminate(self) -> None:
        if self._phase != STEPPING:
            raise self._refusal(f"fmi2Terminate cannot be called {_PHASE_NAMES[self._phase]}")
        self._phase = TERMINATED

    def _require(self, function: str, phases: int) -> None:
        """Refuse what may not be called in the present phase, or after a refusal."""
        if not self._phase & phases:
            raise self._refusal(f"{function} cannot be called {_PHASE_NAMES[self._phase]}")
        if self._failed:
            raise self._refusal(f"{function} cannot be called after an error; reset the FMU or restore a saved state")

    def _refusal(self, reason: str) -> Refusal:
        return Refusal(f"{self.block.name}: {reason}")

    def _report_missing_inputs(self) -> None:
        """Warn once per episode which inputs count as missing."""
        names = self._instance.missing_inputs()
        if names and not self._missing:
            self._warn(f"{self.block.name}: not finite or out of bounds, treated as missing: {', '.join(names)}")
        self._missing = bool(names)

    def _refresh(self) -> None:
        """Bring the outputs up to date with what was set."""
        self._stale = False
        if self._phase == STEPPING:
            self._instance.refresh()
        elif self._phase == INITIALISING and not self.block.parameter_problems(self._instance.p):
            self._instance.initialise(self._start_time)

    # Variables

    def get(self, kind: str, references: Sequence[int]) -> list[float]:
        """Values of variables of one kind: Real, Integer or Boolean."""
        if not self._phase & _READABLE:
            raise self._refusal(f"fmi2Get{kind} cannot be called {_PHASE_NAMES[self._phase]}")
        if kind != "Real" or min(references, default=0) < self._results:
            for reference in references:
                self._find(reference, kind)
        if self._stale:
            self._refresh()
        known, item = len(self._values), self._values.item
        return [item(r) if r < known else self._sample_time(r) for r in references]

    def _sample_time(self, reference: int) -> float:
        """The clock of a sampled block, whose value reference follows the last variable's."""
        if isinstance(self._instance, SampledInstance) and reference == len(self._values):
            return self._instance.sample_time
        raise self._unknown(reference)

    def set(self, kind: str, references: Sequence[int], values: Sequence[float]) -> None:
        """Set all of these variables of one kind, or none."""
        self._require(f"fmi2Set{kind}", _WRITABLE)
        if kind != "Real" or min(references, default=0) < 0 or max(references, default=0) >= self._inputs:
            for reference, value in zip(references, values, strict=True):
                self._check_settable(reference, kind, value)
        self._values[references] = values
        self._stale = True

    def _check_settable(self, reference: int, kind: str, value: float) -> None:
        variable = self._find(reference, kind)
        if variable is None or variable.group in ("output", "local"):
            name = variable.name if variable else "sample_time"
            raise self._refusal(f"{name} is calculated and cannot be set")
        declared = variable.signal
        if self._phase != STEPPING or not isinstance(declared, Parameter):
            return
        kept = f"it keeps {self._values[reference]:g}"
        if not declared.tunable:
            raise self._refusal(f"{variable.name} is fixed once the simulation runs; {kept}")
        if not declared.minimum <= value <= declared.maximum:
            unit = "" if declared.unit == "1" else f" {declared.unit}"
            bounds = f"[{declared.minimum:g}, {declared.maximum:g}]{unit}"
            raise self._refusal(f"{variable.name} = {value:g}{unit} is outside {bounds}; {kept}")

    def _find(self, reference: int, kind: str) -> Variable | None:
        """The variable with this value reference and type, None for sample_time."""
        variables: Sequence[Variable] = self.block.variables
        if reference == len(variables) and isinstance(self._instance, SampledInstance):
            own, name = "Real", "sample_time"
        elif 0 <= reference < len(variables):
            own, name = self._types[reference], variables[reference].name
        else:
            raise self._unknown(reference)
        if own != kind:
            raise self._refusal(f"{name} is {own}, not {kind}")
        return variables[reference] if reference < len(variables) else None

    def _unknown(self, reference: int) -> Refusal:
        return self._refusal(f"no variable has value reference {reference % 2**32}")  # negative behind the wrapper

    def strings(self, function: str, references: Sequence[int]) -> list[str]:
        """Answer for the functions of strings, of which there are none."""
        if references:
            raise self._refusal("there are no string variables")
        return []

    # Whole state

    def get_state(self) -> dict[str, Any]:
        """Everything that determines the future, as JSON-able values."""
        own = {"phase": self._phase, "stale": self._stale, "missing": self._missing, "setup": self._start_time}
        return {"block": self.block.name, "instance": self._instance.get_state(), **own}

    def set_state(self, state: Any) -> None:
        """Return to a state from ``get_state``."""
        if not isinstance(state, dict) or state.get("block") != self.block.name:
            raise self._refusal("the state is that of another FMU and was not set")
        try:
            self._instance.set_state(state["instance"])
        except StateError as error:
            raise Refusal(str(error)) from error
        self._phase, self._stale = state["phase"], state["stale"]
        self._missing, self._start_time = state["missing"], state["setup"]
        self._failed = False


def _type_of(variable: Variable) -> str:
    """Real, Integer or Boolean."""
    signal = variable.signal
    return signal.kind.capitalize() if isinstance(signal, Parameter) else "Real"
