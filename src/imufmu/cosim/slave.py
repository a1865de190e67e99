"""One FMU instance at work: its calls, its buffers, and what it says when it fails.

Values of all components lie in one array per kind (Real, Integer, Boolean). A slave reads its variables into a part of
each array with one call and sets its inputs, gathered from these arrays, with one call.
"""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from ctypes import POINTER, c_double, c_int, c_uint
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave, fmi2Discard, fmi2Fatal, fmi2True, fmi2Warning

from .errors import SimulationError
from .messages import Messages
from .settings import Setting

DTYPES: dict[str, Any] = {"Real": np.float64, "Integer": np.int32, "Boolean": np.int32}
_POINTERS: dict[str, Any] = {"Real": POINTER(c_double), "Integer": POINTER(c_int), "Boolean": POINTER(c_int)}

_Call = tuple[str, Callable[[], int]]  # name of an FMI function, and a call of it


@dataclass(frozen=True)
class Outlet:
    """Variables of one kind that are read together into ``values``; the first ``outputs`` of them are outputs."""

    kind: str
    variables: Sequence[Any]
    outputs: int
    values: np.ndarray


@dataclass(frozen=True)
class Inlet:
    """Inputs of one kind that are set together: factor * pool[sources] + offset, each (n,)."""

    kind: str
    variables: Sequence[Any]
    pool: np.ndarray
    sources: np.ndarray
    factor: np.ndarray
    offset: np.ndarray


class Slave:
    """An FMU instance, from instantiation to ``close``. Every failure is a SimulationError.

    library, folder: its shared library, and where the FMU is unpacked. model: its ModelDescription (fmpy).
    """

    def __init__(self, name: str, library: Path, folder: Path, model: Any) -> None:
        self.name = name
        self._messages = Messages()
        self._may_terminate = self._lost = False
        self._instance: Any = None
        _import_script(name, folder)
        folder_before = os.getcwd()
        try:
            self._fmu = FMU2Slave(
                guid=model.guid,
                modelIdentifier=model.coSimulation.modelIdentifier,
                unzipDirectory=str(folder),
                instanceName=name,
                libraryPath=str(library),
            )
        except Exception as error:  # fmpy raises plain exceptions, and AttributeError for a missing function
            os.chdir(folder_before)  # fmpy loads libraries in their folder, and stays there when that fails
            self._messages.close()
            raise SimulationError(f"{name}: its binary cannot be loaded: {error}") from error
        try:
            self._fmu.instantiate(callbacks=self._messages.callbacks, loggingOn=True)
        except Exception as error:  # as above
            said = self._messages.latest
            self._messages.close()
            self._fmu.freeLibrary()
            raise SimulationError(f"{name}: cannot be instantiated{_quoted(said)}") from error
        self._instance = self._fmu.component
        self._do_step = self._function("fmi2DoStep")
        self._gets: list[_Call] = []
        self._initial_gets: list[_Call] = []
        self._sets: list[_Call] = []
        self._gathers: list[tuple[Inlet, np.ndarray, bool]] = []
        self._reals: list[tuple[Outlet, np.ndarray]] = []
        self._warned = False

    def connect(self, outlets: Sequence[Outlet], inlets: Sequence[Inlet]) -> None:
        """Prepare the calls of ``read``, ``gather`` and ``write``."""
        for outlet in outlets:
            self._gets.append(self._call("Get", outlet.kind, outlet.variables, outlet.values))
            if outlet.outputs:
                outputs = outlet.variables[: outlet.outputs]
                self._initial_gets.append(self._call("Get", outlet.kind, outputs, outlet.values))
            if outlet.kind == "Real":
                self._reals.append((outlet, np.zeros(len(outlet.variables))))
        for inlet in inlets:
            buffer = np.zeros(len(inlet.variables), DTYPES[inlet.kind])
            as_it_is = np.all(inlet.factor == 1.0) and np.all(inlet.offset == 0.0)
            self._gathers.append((inlet, buffer, bool(as_it_is)))
            self._sets.append(self._call("Set", inlet.kind, inlet.variables, buffer))

    def _call(self, verb: str, kind: str, variables: Sequence[Any], values: np.ndarray) -> _Call:
        """An FMI function with all its arguments."""
        name = f"fmi2{verb}{kind}"
        references, pointer = _references(variables), values.ctypes.data_as(_POINTERS[kind])
        return name, partial(self._function(name), self._instance, references, len(variables), pointer)

    def _function(self, name: str) -> Callable[..., int]:
        """The C function, which gives its status back: FMPy's method of this name takes longer than most FMUs do."""
        function: Callable[..., int] = getattr(self._fmu.dll, name)
        return function

    def enter_initialisation(self, settings: Sequence[Setting], start_time: float) -> None:
        """Apply the start values and enter initialization mode."""
        setters = {float: self._fmu.setReal, bool: self._fmu.setBoolean, int: self._fmu.setInteger}
        for setting in settings:
            try:
                setters.get(type(setting.value), self._fmu.setString)(
                    [setting.variable.valueReference], [setting.value]
                )
            except FMICallException as error:
                raise self._failure(error, f"{setting.variable.name} = {setting.value}") from None
        try:
            self._fmu.setupExperiment(startTime=start_time)
            self._fmu.enterInitializationMode()
        except FMICallException as error:
            raise self._failure(error, f"t = {start_time:g} s") from None

    def exit_initialisation(self, time: float) -> None:
        """Leave initialization mode: the instance can step from here on."""
        try:
            self._fmu.exitInitializationMode()
        except FMICallException as error:
            raise self._failure(error, f"t = {time:g} s") from None
        self._may_terminate = True

    def gather(self) -> None:
        """Take the inputs from the present values of their sources."""
        for inlet, buffer, as_it_is in self._gathers:
            inlet.pool.take(inlet.sources, out=buffer, mode="clip")
            if not as_it_is:
                buffer *= inlet.factor
                buffer += inlet.offset

    def write(self, time: float) -> None:
        """Hand the gathered inputs to the FMU."""
        self._make(self._sets, time)

    def step(self, time: float, h: float) -> None:
        """From time to time + h."""
        status = self._do_step(self._instance, time, h, fmi2True)
        if status > fmi2Warning:
            raise self._failure(FMICallException("fmi2DoStep", status), f"t = {time:g} s, step {h:g} s")
        if status == fmi2Warning and not self._warned:
            self._warned = True
            self._messages.add(status, f"fmi2DoStep at t = {time:g} s returned a warning")

    def read(self, time: float) -> None:
        """Get the variables; none may be other than finite."""
        self._make(self._gets, time)
        for outlet, zeros in self._reals:
            if outlet.values.dot(zeros) != 0.0:  # nan or infinity times zero is not
                i = int(np.argmin(np.isfinite(outlet.values)))
                raise SimulationError(
                    f"{self.name}.{outlet.variables[i].name} = {outlet.values[i]} at t = {time:g} s"
                    + _quoted(self._messages.latest)
                )

    def read_initial(self, time: float) -> None:
        """Get the outputs during initialisation, where FMI allows no other variable."""
        self._make(self._initial_gets, time)

    def _make(self, calls: Sequence[_Call], time: float) -> None:
        for name, call in calls:
            status = call()
            if status > fmi2Warning:
                raise self._failure(FMICallException(name, status), f"t = {time:g} s")

    @property
    def notes(self) -> list[str]:
        """What the FMU warned of."""
        own = f"{self.name}: "  # some FMUs begin their messages with their name
        return [own + text.removeprefix(own) for text in self._messages.warnings]

    def close(self) -> None:
        """Terminate and free the instance, as far as FMI allows after what happened."""
        if not self._lost:
            with suppress(FMICallException):
                if self._may_terminate:
                    self._fmu.terminate()
            self._fmu.freeInstance()
        self._messages.close()

    def _failure(self, error: FMICallException, at: str) -> SimulationError:
        """The error to raise; also remembers which calls are still allowed."""
        self._lost = self._lost or error.status == fmi2Fatal
        self._may_terminate = self._may_terminate and error.status == fmi2Discard
        return SimulationError(f"{self.name}: {error.args[0].rstrip('.')} at {at}{_quoted(self._messages.latest)}")


def _import_script(name: str, folder: Path) -> None:
    """Import the script of a PythonFMU archive first: if that fails in its wrapper, the wrapper ends this process."""
    pointer = folder / "resources" / "slavemodule.txt"
    if not pointer.is_file():
        return
    sys.path.insert(0, str(pointer.parent))
    try:
        importlib.import_module(pointer.read_text(encoding="utf-8").strip())
    except Exception as error:  # whatever the script does
        forget_paths(folder)
        raise SimulationError(f"{name}: its Python script fails to load: {type(error).__name__}: {error}") from error


def forget_paths(folder: Path) -> None:
    """Python FMUs put their folders on the import path and leave them there: take those below ``folder`` off again."""
    sys.path[:] = [entry for entry in sys.path if not Path(entry).is_relative_to(folder)]


def _references(variables: Sequence[Any]) -> Any:
    return (c_uint * len(variables))(*(variable.valueReference for variable in variables))


def _quoted(said: str) -> str:
    return f": {said}" if said else "; the FMU gave no reason"
