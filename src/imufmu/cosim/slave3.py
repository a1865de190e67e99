"""An FMU instance of FMI 3.0: as one of FMI 2.0, with arrays that go over whole and a type for every size of number."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from ctypes import POINTER, byref, c_bool, c_char_p, c_double
from functools import partial
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np
from fmpy.fmi3 import FMU3Slave

from .errors import EndOfRun, SimulationError
from .slave import CALLS, DTYPES, GOOD, KINDS, WIRES, Call, Inlet, Outlet, Slave, references, when
from .unpacked import Unpacked

if TYPE_CHECKING:
    from .settings import Setting

_DO_STEP = CALLS.index("fmi3DoStep")
_WIRE_TYPES: dict[str, Any] = {wire: np.dtype(wire.lower().replace("boolean", "bool")) for wire in WIRES}


class Slave3(Slave):
    """An instance of an FMU 3.0 for co-simulation, used as a Slave is."""

    _fmi = "fmi3"
    _library: Any = FMU3Slave

    def _instantiate(self) -> None:
        def log(_environment: Any, status: int, _category: bytes, message: bytes) -> None:
            self.messages.add(status, (message or b"").decode(errors="replace").strip())

        self._feeding: set[str] = set()  # names of variables that feed something
        self._fmu.instantiate(loggingOn=True, logMessage=log)

    def connect(
        self, outlets: Sequence[Outlet], inlets: Sequence[Inlet], buffers: Sequence[np.ndarray] | None = None
    ) -> None:
        """As ``Slave.connect``."""
        for outlet in outlets:
            needed = range(len(outlet.variables)) if outlet.needed is None else outlet.needed
            self._feeding |= {outlet.variables[i].name for i in needed}
        super().connect(outlets, inlets, buffers)

    def _prepare_step(self, fmu: Unpacked) -> None:
        step = self._function("fmi3DoStep")
        self._event, self._ended, self._early = c_bool(), c_bool(), c_bool()
        self._reached = c_double()
        told = [byref(place) for place in (self._event, self._ended, self._early, self._reached)]
        self._do_step = lambda instance, time, h, no_way_back: step(instance, time, h, no_way_back, *told)

    def _step(self, time: float, h: float) -> None:
        self._now.value = _DO_STEP
        self._judge(self._do_step(self._instance, time, h, True), time, h)
        if self._early.value:
            raise SimulationError(
                f"{self.name}: fmi3DoStep came back early at {when(time, h)}, at {when(self._reached.value)}, as it "
                "must not"
            )
        if self._ended.value:
            raise EndOfRun(f"{self.name} ended the run at {when(time, h)}{self._last_words()}")

    def _ends(self) -> bool:
        return bool(self._ended.value)

    def enter_initialisation(self, settings: Sequence[Setting], start_time: float, stop_time: float) -> None:
        """As ``Slave.enter_initialisation``; the elements of an array are set together."""
        for _, group in groupby(settings, lambda s: (s.variable.valueReference, s.variable.size > 1)):
            some = list(group)
            at = ", ".join(f"{s.variable.name} = {s.value}" for s in some)
            if isinstance(some[0].value, str):
                calls = [self._set_text(s.variable, s.value) for s in some if isinstance(s.value, str)]
            else:
                kind = KINDS[type(some[0].value)]
                values = self._array(some, np.int64 if kind == "Integer" else DTYPES[kind])
                calls = self._calls("Set", kind, [s.variable for s in some], values)
            self._make(calls, at)
        self._enter(start_time, stop_time)

    def _set_text(self, variable: Any, text: str) -> Call:
        if variable.size > 1:
            raise SimulationError(f"{self.name}.{variable.name}: an array of String cannot be set")
        name, value = "fmi3SetString", (c_char_p * 1)(text.encode())
        reference = references([variable.valueReference])
        return CALLS.index(name), partial(self._function(name), self._instance, reference, 1, value, 1)

    def _enter(self, start_time: float, stop_time: float) -> None:
        self._plain("fmi3EnterInitializationMode", when(start_time), False, 0.0, start_time, True, stop_time)

    def _calls(self, verb: str, kind: str, variables: Sequence[Any], values: np.ndarray) -> list[Call]:
        """One call per type of FMI 3.0."""
        calls = []
        for wire in dict.fromkeys(variable.wire for variable in variables):
            at = [i for i, variable in enumerate(variables) if variable.wire == wire]
            arrays = _Arrays([variables[i] for i in at], wire)
            get = partial(self._function(f"fmi3Get{wire}"), self._instance, *arrays.arguments)
            if verb == "Get":
                call: Callable[[], int] = partial(self._get, get, arrays, values, np.array(at))
            else:
                put = partial(self._function(f"fmi3Set{wire}"), self._instance, *arrays.arguments)
                call = partial(self._set, put, get, arrays, values, np.array(at))
            calls.append((CALLS.index(f"fmi3{verb}{wire}"), call))
        return calls

    def _get(self, get: Callable[[], int], arrays: _Arrays, values: np.ndarray, at: np.ndarray) -> int:
        status = get()
        if status in GOOD:
            values[at] = self._fitting(arrays, arrays.buffer[arrays.places], values.dtype, self._feeding)
        return status

    def _set(
        self, put: Callable[[], int], get: Callable[[], int], arrays: _Arrays, values: np.ndarray, at: np.ndarray
    ) -> int:
        if not arrays.known:  # the elements that are not set keep what they are
            status = get()
            if status not in GOOD:
                return status
            arrays.known = True
        arrays.buffer[arrays.places] = self._fitting(arrays, values[at], arrays.buffer.dtype)
        return put()

    def _fitting(
        self, arrays: _Arrays, values: np.ndarray, wanted: Any, feeding: Collection[str] | None = None
    ) -> np.ndarray:
        """The values, every one of which the wanted type of integer can hold.

        feeding: names of those that must fit; the nearest that fits stands for any other, with a remark. None: all.
        Raises SimulationError.
        """
        if not (wanted.kind in "iu" and values.dtype.kind in "iu") or np.can_cast(values.dtype, wanted):
            return values
        limits = np.iinfo(wanted)
        for i in np.flatnonzero((values < limits.min) | (values > limits.max)).tolist():
            name = arrays.variables[i].name
            told = f"{name} = {values[i]}: beyond what {wanted.name} holds, {limits.min} to {limits.max}"
            if feeding is None or name in feeding:
                raise SimulationError(f"{self.name}.{told}")
            self._odd.setdefault(name, f"{told}; recorded as the nearest of these")
        return np.clip(values, limits.min, limits.max)


class _Arrays:
    """Variables of one type, elements of the same array together. places: of the variables in the buffer."""

    def __init__(self, variables: Sequence[Any], wire: str) -> None:
        self.variables = variables
        sizes = {variable.valueReference: variable.size for variable in variables}
        first = dict(zip(sizes, np.cumsum([0, *sizes.values()]), strict=False))
        self.places = np.array([first[variable.valueReference] + variable.place for variable in variables])
        self.buffer = np.zeros(sum(sizes.values()), _WIRE_TYPES[wire])
        self.known = len(set(self.places)) == len(self.buffer)  # every element is among the variables
        kind = c_bool if wire == "Boolean" else np.ctypeslib.as_ctypes_type(self.buffer.dtype)
        self.arguments = references(sizes), len(sizes), self.buffer.ctypes.data_as(POINTER(kind)), len(self.buffer)
