"""One FMU instance at work: its calls, its buffers, and what it says when it fails.

Values of all components lie in one array per kind (Real, Integer, Boolean). A slave reads its variables into a part of
each array with one call and sets its inputs, gathered from these arrays, with one call.
"""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from ctypes import POINTER, c_char_p, c_double, c_int, c_uint
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave, fmi2Discard, fmi2Fatal, fmi2OK, fmi2True, fmi2Warning

from .errors import SimulationError
from .messages import Messages

if TYPE_CHECKING:
    from .settings import Setting

DTYPES: dict[str, Any] = {"Real": np.float64, "Integer": np.int32, "Boolean": np.int32}
_POINTERS: dict[str, Any] = {"Real": POINTER(c_double), "Integer": POINTER(c_int), "Boolean": POINTER(c_int)}
KINDS = {float: "Real", bool: "Boolean", int: "Integer"}
GOOD = (fmi2OK, fmi2Warning)  # as in FMI 3.0, whose statuses have the same numbers

# FMI 3.0 has a function per type, for whole arrays.
WIRES = ("Float32", "Float64", *(f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64)), "Boolean")

# Everything that may crash or hang, by number, so that another process can be told what is going on.
INTEGRATION = "integration of its equations"
CALLS = (
    "start",
    "load of its script",
    "load of its binary",
    INTEGRATION,
    *(f"fmi2{verb}{kind}" for verb in ("Set", "Get") for kind in (*DTYPES, "String")),
    *(f"fmi3{verb}{kind}" for verb in ("Set", "Get") for kind in (*WIRES, "String")),
    "fmi2SetupExperiment",
    *(
        f"fmi{version}{call}"
        for version in (2, 3)
        for call in (
            "Instantiate",
            "EnterInitializationMode",
            "ExitInitializationMode",
            "DoStep",
            "Terminate",
            "FreeInstance",
        )
    ),
)
_DO_STEP = CALLS.index("fmi2DoStep")
STEPS = (INTEGRATION, "fmi2DoStep", "fmi3DoStep")

Call = tuple[int, Callable[[], int]]  # number of an FMI function, and a call of it


class Equations(NamedTuple):
    """What it takes to solve an FMU for model exchange. told_of_steps: it wants to know of every step of the solver."""

    states: int
    indicators: int
    tolerance: float
    told_of_steps: bool


@dataclass(frozen=True)
class Unpacked:
    """An FMU on disk: its shared library, the folder it is unpacked in, its GUID and modelIdentifier.

    version: 2 or 3, of FMI. equations: of an FMU for model exchange; None for one for co-simulation.
    """

    library: Path
    folder: Path
    guid: str
    identifier: str
    version: int = 2
    equations: Equations | None = None


class Variable(NamedTuple):
    """What a slave needs to know of a variable. wire: its type in FMI 3.0. place, size: which element of an array."""

    name: str
    valueReference: int
    wire: str = ""
    place: int = 0
    size: int = 1

    @staticmethod
    def of(variable: Any) -> Variable:
        """Of a ModelVariable (fmpy), or one element of it."""
        element = [getattr(variable, name) for name in ("wire", "place", "size") if hasattr(variable, name)]
        return Variable(variable.name, variable.valueReference, *element)


@dataclass(frozen=True)
class Outlet:
    """Variables of one kind that are read together into ``values``; the first ``outputs`` of them are outputs."""

    kind: str
    variables: Sequence[Any]
    outputs: int
    values: np.ndarray


@dataclass(frozen=True)
class Inlet:
    """Inputs of one kind that are set together: factor * pool[sources] + offset, each (n,).

    tables: of those whose whole numbers are exchanged for others, by place.
    """

    kind: str
    variables: Sequence[Any]
    pool: np.ndarray
    sources: np.ndarray
    factor: np.ndarray
    offset: np.ndarray
    tables: Mapping[int, Mapping[int, int]] = field(default_factory=dict)


class Inputs:
    """The inputs of a component, gathered from the values of their sources into one buffer per inlet."""

    def __init__(self, inlets: Sequence[Inlet], buffers: Sequence[np.ndarray]) -> None:
        as_they_are = [bool(np.all(inlet.factor == 1.0) and np.all(inlet.offset == 0.0)) for inlet in inlets]
        self._each = list(zip(inlets, buffers, as_they_are, strict=True))

    def gather(self) -> None:
        """Take the inputs from the present values of their sources."""
        for inlet, buffer, as_it_is in self._each:
            if inlet.pool.dtype == buffer.dtype:
                inlet.pool.take(inlet.sources, out=buffer, mode="clip")
            else:
                buffer[:] = inlet.pool[inlet.sources]
            if not as_it_is:
                buffer *= inlet.factor
                buffer += inlet.offset
            for i, table in inlet.tables.items():
                buffer[i] = table.get(int(buffer[i]), buffer[i])


class Slave:
    """An instance of an FMU 2.0 for co-simulation, until ``close``. Every failure is a SimulationError.

    now: gets the number, in CALLS, of each call before it is made. say: called with what the FMU logs.
    """

    _fmi = "fmi2"  # what the names of its functions begin with
    _library: Any = FMU2Slave

    def __init__(self, name: str, fmu: Unpacked, now: Any = None, say: Callable[[str], None] | None = None) -> None:
        self.name = name
        self.messages = Messages(say)
        self._now = c_int() if now is None else now
        self._may_terminate = self._lost = self._closed = False
        self._now.value = CALLS.index("load of its script")
        try:
            _import_script(name, fmu.folder)
            self._now.value = CALLS.index("load of its binary")
            self._fmu = _loaded(self._library, name, fmu)
        except SimulationError:
            self.messages.close()
            raise
        self._now.value = CALLS.index(f"{self._fmi}Instantiate")
        try:
            self._instantiate()
        except Exception as error:  # fmpy raises plain exceptions
            said = self.messages.latest
            self.messages.close()
            self._fmu.freeLibrary()
            raise SimulationError(f"{name}: cannot be instantiated{quoted(said)}") from error
        self._instance: Any = self._fmu.component
        self._inputs = Inputs([], [])
        self._buffers: Sequence[np.ndarray] = ()
        self._gets: list[Call] = []
        self._initial_gets: list[Call] = []
        self._sets: list[Call] = []
        self._reals: list[tuple[Outlet, np.ndarray]] = []
        self._warned = False
        self._prepare_step(fmu)

    def _instantiate(self) -> None:
        """Raises what fmpy raises."""
        self._fmu.instantiate(callbacks=self.messages.callbacks, loggingOn=True)

    def _prepare_step(self, fmu: Unpacked) -> None:
        self._do_step = self._function("fmi2DoStep")

    def connect(
        self, outlets: Sequence[Outlet], inlets: Sequence[Inlet], buffers: Sequence[np.ndarray] | None = None
    ) -> None:
        """Prepare the calls of ``read``, ``gather`` and ``write``. buffers: where the inputs are gathered, by inlet."""
        for outlet in outlets:
            self._gets += self._calls("Get", outlet.kind, outlet.variables, outlet.values)
            if outlet.outputs:
                outputs = outlet.variables[: outlet.outputs]
                self._initial_gets += self._calls("Get", outlet.kind, outputs, outlet.values)
            if outlet.kind == "Real":
                self._reals.append((outlet, np.zeros(len(outlet.variables))))
        if buffers is None:
            buffers = [np.zeros(len(inlet.variables), DTYPES[inlet.kind]) for inlet in inlets]
        self._inputs, self._buffers = Inputs(inlets, buffers), buffers
        for inlet, buffer in zip(inlets, buffers, strict=True):
            self._sets += self._calls("Set", inlet.kind, inlet.variables, buffer)

    def _calls(self, verb: str, kind: str, variables: Sequence[Any], values: np.ndarray) -> list[Call]:
        """FMI functions with all their arguments that get or set values of a kind."""
        name = f"fmi2{verb}{kind}"
        pointer = values.ctypes.data_as(_POINTERS[kind])
        call = partial(
            self._function(name),
            self._instance,
            references(v.valueReference for v in variables),
            len(variables),
            pointer,
        )
        return [(CALLS.index(name), call)]

    def _function(self, name: str) -> Callable[..., int]:
        """The C function, which gives its status back: FMPy's method takes longer than most FMUs do, and passes -5."""
        function: Callable[..., int] = getattr(self._fmu.dll, name)
        return function

    def ready(self) -> None:
        """Wait until the instance is there: at once in this process."""

    def enter_initialisation(self, settings: Sequence[Setting], start_time: float) -> None:
        """Apply the start values and enter initialization mode."""
        for setting in settings:
            variable, value = setting.variable, setting.value
            if isinstance(value, str):
                calls = [self._set_text(variable, value)]
            else:
                kind = KINDS[type(value)]
                calls = self._calls("Set", kind, [variable], self._array([setting], DTYPES[kind]))
            self._make(calls, f"{variable.name} = {value}")
        self._enter(start_time)

    def _array(self, settings: Sequence[Setting], dtype: Any) -> np.ndarray:
        """Their values. Raises SimulationError for a whole number that is too large."""
        try:
            return np.array([setting.value for setting in settings], dtype)
        except OverflowError:
            told = ", ".join(f"{setting.variable.name} = {setting.value}" for setting in settings)
            limits = np.iinfo(dtype)
            raise SimulationError(f"{self.name}: {told}: beyond {limits.min} to {limits.max}") from None

    def _set_text(self, variable: Any, text: str) -> Call:
        name, value = "fmi2SetString", (c_char_p * 1)(text.encode())
        return CALLS.index(name), partial(
            self._function(name), self._instance, references([variable.valueReference]), 1, value
        )

    def _enter(self, start_time: float) -> None:
        """Enter initialization mode."""
        at = when(start_time)
        self._plain("fmi2SetupExperiment", at, 0, 0.0, start_time, 0, 0.0)
        self._plain("fmi2EnterInitializationMode", at)

    def exit_initialisation(self, time: float) -> None:
        """Leave initialization mode: the instance can step from here on."""
        self._plain(f"{self._fmi}ExitInitializationMode", when(time))
        self._may_terminate = True

    def gather(self) -> None:
        """Take the inputs from the present values of their sources."""
        self._inputs.gather()

    def write(self, time: float) -> None:
        """Hand the gathered inputs to the FMU."""
        self._make(self._sets, time)

    def advance(self, time: float, h: float, reached: float) -> None:
        """Hand over the gathered inputs, step from time to time + h, get the variables: those of time ``reached``."""
        self._make(self._sets, time)
        self._step(time, h)
        self.read(reached)

    def _step(self, time: float, h: float) -> None:
        self._now.value = _DO_STEP
        self._judge(self._do_step(self._instance, time, h, fmi2True), time, h)

    def _judge(self, status: int, time: float, h: float) -> None:
        """What a step has returned: an error is raised, the first warning kept."""
        if status not in GOOD:
            raise self._failure(f"{self._fmi}DoStep", status, when(time, h))
        if status == fmi2Warning and not self._warned:
            self._warned = True
            self.messages.add(status, f"{self._fmi}DoStep at {when(time)} returned a warning")

    def read(self, time: float) -> None:
        """Get the variables; none may be other than finite."""
        self._make(self._gets, time)
        for outlet, zeros in self._reals:
            if outlet.values.dot(zeros) != 0.0:  # nan or infinity times zero is not
                i = int(np.argmin(np.isfinite(outlet.values)))
                raise SimulationError(
                    f"{self.name}.{outlet.variables[i].name} = {outlet.values[i]} at {when(time)}"
                    + quoted(self.messages.latest)
                )

    def read_initial(self, time: float) -> None:
        """Get the outputs during initialisation, where FMI allows no other variable."""
        self._make(self._initial_gets, time)

    def _make(self, calls: Sequence[Call], at: float | str) -> None:
        """Make calls; at: the time, or where else a failure happened."""
        for number, call in calls:
            self._now.value = number
            status = call()
            if status not in GOOD:
                raise self._failure(CALLS[number], status, at if isinstance(at, str) else when(at))

    def _plain(self, name: str, at: str, *arguments: Any) -> None:
        """Make one call that has nothing prepared."""
        self._make([(CALLS.index(name), partial(self._function(name), self._instance, *arguments))], at)

    @property
    def notes(self) -> list[str]:
        """What the FMU warned of."""
        own = f"{self.name}: "  # some FMUs begin their messages with their name
        return [own + text.removeprefix(own) for text in self.messages.warnings]

    def close(self) -> None:
        """Terminate and free the instance, as far as FMI allows after what happened, and unload its library."""
        if self._closed:
            return
        self.free()
        if not self._lost:
            self._fmu.freeLibrary()

    abandon = close

    def free(self) -> None:
        """As ``close``, with the library left loaded: threads that the FMU has left behind may still run in it."""
        self._closed = True
        if not self._lost:
            if self._may_terminate:
                self._now.value = CALLS.index(f"{self._fmi}Terminate")
                self._function(f"{self._fmi}Terminate")(self._instance)
            self._now.value = CALLS.index(f"{self._fmi}FreeInstance")
            self._function(f"{self._fmi}FreeInstance")(self._instance)
        self.messages.close()

    def _failure(self, name: str, status: int, at: str) -> SimulationError:
        """The error to raise; also remembers which calls are still allowed."""
        error = FMICallException(name, status)
        self._lost = self._lost or status == fmi2Fatal
        self._may_terminate = self._may_terminate and status == fmi2Discard
        return SimulationError(f"{self.name}: {error.args[0].rstrip('.')} at {at}{quoted(self.messages.latest)}")


def _loaded(library: Any, name: str, fmu: Unpacked) -> Any:
    """The functions of an FMU, by a class of fmpy."""
    folder_before = os.getcwd()
    try:
        return library(
            guid=fmu.guid,
            modelIdentifier=fmu.identifier,
            unzipDirectory=str(fmu.folder),
            instanceName=name,
            libraryPath=str(fmu.library),
        )
    except Exception as error:  # fmpy raises plain exceptions, and AttributeError for a missing function
        os.chdir(folder_before)  # fmpy loads libraries in their folder, and stays there when that fails
        raise SimulationError(f"{name}: its binary cannot be loaded: {error}") from error


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


def when(time: float, h: float | None = None) -> str:
    """A time (s), or a step that begins there, for messages; exact to 0.01 ms in calendar time too."""
    return f"t = {time:.15g} s" if h is None else f"t = {time:.15g} s, step {h:.15g} s"


def quoted(said: str) -> str:
    """What an FMU said, for the end of a message."""
    return f": {said}" if said else "; the FMU gave no reason"


def references(numbers: Iterable[int]) -> Any:
    """Value references as a C array."""
    numbers = list(numbers)
    return (c_uint * len(numbers))(*numbers)
