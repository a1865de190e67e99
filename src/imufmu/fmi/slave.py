"""PythonFMU adapter: a block as an FMI 2.0 co-simulation slave.

PythonFMU turns every exception that leaves a slave into fmi2Fatal, so none does, with two exceptions that FMI has no
other way to say: an FMU that cannot start at all (the constructor) and parameters out of bounds (the end of
initialisation). Everything else is logged, answered with a defined value, and leaves the state as it was.
"""

from __future__ import annotations

import ctypes
import math
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, ClassVar
from xml.etree.ElementTree import Element

from pythonfmu import Fmi2Slave
from pythonfmu.enums import Fmi2Status

from ..blocks.block import Block, ParameterError, Variable
from ..blocks.instance import SampledInstance, StepError, instantiate
from ..blocks.signals import Parameter
from .runtime import refusal, rejoin_installed

_STARTING, _INITIALISING, _STEPPING = range(3)


def _hold(thing: Any) -> None:
    """Add a reference that is never given back.

    PythonFMU 0.7.0 releases some objects once more than it acquired them: the namespace of the FMU's script when it
    looks up the class in it, after an exception the slave, its class and its log. Without a reference to spare they are
    freed, and the next call crashes the host.
    """
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(thing))


class BlockSlave(Fmi2Slave):
    """Base of every slave: a subclass names its ``block``. Value references count the block's variables from 0;
    the one after the last is ``sample_time`` of a sampled block."""

    block: ClassVar[Block]

    def __init_subclass__(cls) -> None:
        _hold(vars(sys.modules[cls.__module__]))

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        rejoin_installed()
        reason = refusal(Path(kwargs["resources"]))
        if reason:
            raise RuntimeError(f"{self.block.name}: {reason}")
        self.modelName = self.block.name
        self._instance = instantiate(self.block)
        self._sampled = isinstance(self._instance, SampledInstance)
        self._values = self._instance.values
        self._inputs = len(self._instance.u)
        self._start_time = 0.0
        self._phase = _STARTING
        self._stale = True  # the outputs do not yet reflect the inputs and parameters in force
        self._missing = False  # in an episode of inputs that are not finite

    def to_xml(self, model_options: Any = None) -> Element:
        from .model_description import model_description  # needed where FMUs are built, not where they run

        return model_description(self.block)

    def log(self, msg: str, status: Fmi2Status = Fmi2Status.ok, category: Any = None, debug: Any = None) -> None:
        """Log a message. PythonFMU hands it on as a C format, where a percent sign would be read as a directive."""
        super().log(msg.replace("%", "%%"), status, category)

    # Phases

    def setup_experiment(self, start_time: float, stop_time: Any = None, tolerance: Any = None) -> None:
        self._start_time = start_time

    def enter_initialization_mode(self) -> None:
        self._phase = _INITIALISING
        self._stale = True

    def exit_initialization_mode(self) -> None:
        try:
            self._instance.initialise(self._start_time)
        except ParameterError as error:
            self.log(str(error), Fmi2Status.error)
            for thing in (self, type(self), self.log_queue):
                _hold(thing)
            raise
        self._phase = _STEPPING
        self._stale = False

    def do_step(self, current_time: float, step_size: float) -> bool:
        if self._phase != _STEPPING:
            self.log(f"{self.block.name}: doStep before a successful initialisation", Fmi2Status.error)
            return False
        self._report_missing_inputs()
        try:
            self._instance.do_step(current_time, step_size)
        except StepError as error:
            self.log(str(error), Fmi2Status.error)
            return False
        self._stale = False
        return True

    def _report_missing_inputs(self) -> None:
        """Log once per episode which inputs are not finite."""
        names = []
        if not math.isfinite(sum(self._instance.u.tolist())):  # one sum is cheaper than many questions
            names = [v.name for v in self.block.variables[: self._inputs] if not math.isfinite(self._values[v.index])]
        if names and not self._missing:
            self.log(f"{self.block.name}: not finite, treated as missing: {', '.join(names)}", Fmi2Status.warning)
        self._missing = bool(names)

    def _refresh(self) -> None:
        """Bring the outputs up to date with what was set."""
        self._stale = False
        if self._phase == _STEPPING:
            self._instance.refresh()
        elif not self.block.parameter_problems(self._instance.p):
            self._instance.initialise(self._start_time)

    # Variables

    def _get(self, references: Sequence[int], convert: Callable[[float], Any]) -> list[Any]:
        if self._stale:
            self._refresh()
        known = len(self._values)
        if max(references, default=0) < known:
            values = self._values[references].tolist()
        else:
            values = [self._values[r].item() if r < known else self._sample_time(r) for r in references]
        return values if convert is float else [convert(value) for value in values]

    def _sample_time(self, reference: int) -> float:
        if isinstance(self._instance, SampledInstance) and reference == len(self._values):
            return self._instance.sample_time
        self.log(f"{self.block.name}: no variable has value reference {reference}", Fmi2Status.error)
        return 0.0

    def _set(self, references: Sequence[int], values: Sequence[float]) -> None:
        self._stale = True
        if max(references, default=0) < self._inputs:
            self._values[references] = values
            return
        for reference, value in zip(references, values, strict=True):
            refused = self._why_not_settable(reference, value)
            if refused:
                self.log(f"{self.block.name}: {refused}", Fmi2Status.error)
            else:
                self._values[reference] = value

    def _why_not_settable(self, reference: int, value: float) -> str:
        variables: Sequence[Variable] = self.block.variables
        if reference >= len(variables):
            return f"the variable with value reference {reference} cannot be set"
        variable = variables[reference]
        if variable.group in ("output", "local"):
            return f"{variable.name} is an {variable.group} variable and cannot be set"
        declared = variable.signal
        if self._phase == _STEPPING and isinstance(declared, Parameter):
            if not declared.tunable:
                return f"{variable.name} is fixed once the simulation runs; it keeps {self._values[reference]:g}"
            if not declared.minimum <= value <= declared.maximum:
                return (
                    f"{variable.name} = {value:g} is outside [{declared.minimum:g}, {declared.maximum:g}]; "
                    f"it keeps {self._values[reference]:g}"
                )
        return ""

    def get_real(self, vrs: Sequence[int]) -> list[float]:
        return self._get(vrs, float)

    def get_integer(self, vrs: Sequence[int]) -> list[int]:
        return self._get(vrs, int)

    def get_boolean(self, vrs: Sequence[int]) -> list[bool]:
        return self._get(vrs, bool)

    def set_real(self, vrs: Sequence[int], values: Sequence[float]) -> None:
        self._set(vrs, values)

    def set_integer(self, vrs: Sequence[int], values: Sequence[int]) -> None:
        self._set(vrs, values)

    def set_boolean(self, vrs: Sequence[int], values: Sequence[bool]) -> None:
        self._set(vrs, values)

    # Whole state

    def _get_fmu_state(self) -> dict[str, Any]:
        own = {"phase": self._phase, "stale": self._stale, "missing": self._missing, "setup": self._start_time}
        return {"block": self.block.name, "instance": self._instance.get_state(), **own}

    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        if state.get("block") != self.block.name:
            self.log(f"{self.block.name}: the state is that of another FMU and was not set", Fmi2Status.error)
            return
        self._instance.set_state(state["instance"])
        self._phase, self._stale = state["phase"], state["stale"]
        self._missing, self._start_time = state["missing"], state["setup"]
