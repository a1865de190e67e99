"""An FMU that is not ours, in a process of its own: a crash, an exit or an endless call ends that process, not ours."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from ..fmi.child import Child
from .errors import EndOfRun, SimulationError
from .settings import Setting
from .slave import CALLS, STEPS, Inlet, Inputs, Outlet, quoted, when
from .unpacked import Unpacked, Variable
from .wire import Answer, Numbers, Shared, Verb, receive_answer, send_command

_START_TIMEOUT = 60.0  # s, of Python itself, however short the user's patience with the FMU
_LAST_TIMEOUT = 5.0  # s, to be freed after another component has failed

# Run by the new process, whose arguments are the folder of this file and the number of this process; see worker.py.
_BOOT = """
import sys, types
package = types.ModuleType("imufmu_worker")
package.__path__ = [sys.argv[1]]
sys.modules["imufmu_worker"] = package
from imufmu_worker.worker import main
main()
"""


class Guest:
    """An FMU instance, used as a Slave is. Every failure is a SimulationError.

    scratch: an existing folder for what the two processes share. limit: s, the longest that a call may take. check:
    called while an answer is awaited; it may raise KeyboardInterrupt.
    """

    def __init__(self, name: str, fmu: Unpacked, scratch: Path, limit: float, check: Callable[[], None]) -> None:
        self.name = name
        self._fmu, self._limit, self._check = fmu, limit, check
        self._scratch = scratch
        self._times: Numbers = (0.0, 0.0, 0.0)  # of the last command
        self._busy = self._gone = False
        self._inputs = Inputs([], [])
        self._outlets: list[tuple[Outlet, np.ndarray]] = []
        if not sys.executable:
            raise SimulationError(f"{name}: this program has no Python to start for it; run it in_process")
        boot = ("-u", "-P", "-c", _BOOT, str(Path(__file__).parent), str(os.getpid()))
        try:
            self._child = Child(boot, scratch, _hand_on)
        except OSError as error:
            raise SimulationError(f"{name}: no process can be started for it: {error.strerror or error}") from error

    def connect(self, outlets: Sequence[Outlet], inlets: Sequence[Inlet]) -> None:
        """Share the values of ``gather``, ``write`` and ``read``. The process works on, until ``ready`` is called."""
        ends: list[Inlet | Outlet] = [*inlets, *outlets]
        sizes = [(end.kind, len(end.variables)) for end in ends]
        memory = self._scratch / "memory"
        try:
            self._shared = Shared(memory, sizes)
        except OSError as error:
            raise SimulationError(f"{self.name}: {memory} cannot be written: {error.strerror or error}") from error
        self._inputs = Inputs(inlets, self._shared.buffers[: len(inlets)])
        self._outlets = list(zip(outlets, self._shared.buffers[len(inlets) :], strict=True))
        plan = {
            "name": self.name,
            "library": str(self._fmu.library),
            "folder": str(self._fmu.folder),
            "guid": self._fmu.guid,
            "identifier": self._fmu.identifier,
            "version": self._fmu.version,
            "equations": self._fmu.equations,
            "path": [entry for entry in sys.path if entry],
            "memory": str(memory),
            "inlets": [_end(inlet) for inlet in inlets],
            "outlets": [_end(outlet) | {"outputs": outlet.outputs, "needed": outlet.needed} for outlet in outlets],
        }
        self._send(Verb.CONNECT, (0.0, 0.0, 0.0), plan)

    def ready(self) -> None:
        """Wait until the process is there, and instantiate."""
        self._receive(max(self._limit, _START_TIMEOUT))
        self._request(Verb.INSTANTIATE, 0.0)

    def enter_initialisation(self, settings: Sequence[Setting], start_time: float, stop_time: float) -> None:
        """Apply the start values and enter initialization mode, for a run between these times (s)."""
        starts = [(Variable.of(s.variable), s.value) for s in settings]
        self._request(Verb.ENTER, start_time, stop_time - start_time, stop_time, data=starts)

    def exit_initialisation(self, time: float) -> None:
        """Leave initialization mode: the instance can step from here on."""
        self._request(Verb.EXIT, time)

    def gather(self) -> None:
        """Take the inputs from the present values of their sources."""
        self._inputs.gather()

    def write(self, time: float) -> None:
        """Hand the gathered inputs to the FMU."""
        self._request(Verb.WRITE, time)

    def advance(self, time: float, h: float, reached: float) -> None:
        """As ``Slave.advance``."""
        self._request(Verb.ADVANCE, time, h, reached)
        for outlet, values in self._outlets:
            outlet.values[:] = values

    def read(self, time: float) -> None:
        """Get the variables; none may be other than finite."""
        self._request(Verb.READ, time)
        for outlet, values in self._outlets:
            outlet.values[:] = values

    def read_initial(self, time: float) -> None:
        """Get the outputs during initialisation, where FMI allows no other variable."""
        self._request(Verb.READ_INITIAL, time)
        for outlet, values in self._outlets:
            outlet.values[: outlet.outputs] = values[: outlet.outputs]

    @property
    def notes(self) -> list[str]:
        """What the FMU warned of."""
        return list(json.loads(self._request(Verb.NOTES, self._times[2])))

    def close(self) -> None:
        """Terminate and free the instance, and end its process."""
        if not self._gone:
            self._request(Verb.FREE, self._times[2])
            self._gone = True
            self._child.end()

    def abandon(self) -> None:
        """As ``close`` after a failure, of this component or another: without delay, and without a word."""
        if self._gone:
            return
        try:
            if not self._busy:
                self._limit = min(self._limit, _LAST_TIMEOUT)
                with suppress(SimulationError):
                    self._request(Verb.FREE, self._times[2])
        finally:
            self._gone = True
            self._child.kill()

    def _request(self, verb: int, *times: float, data: Any = None) -> str:
        """Have the process do something, and wait for its answer. times: of a step all three, else one."""
        self._send(verb, (times[0], times[1], times[2]) if len(times) > 1 else (times[0], 0.0, times[0]), data)
        return self._receive(self._limit)

    def _send(self, verb: int, times: Numbers, data: Any = None) -> None:
        self._times, self._busy = times, True
        with suppress(BrokenPipeError):  # that it is gone is found where the answer is awaited
            send_command(self._child.requests, verb, times, data)

    def _receive(self, limit: float) -> str:
        def wait() -> bool:
            return self._child.wait(limit, self._check)

        if not wait():
            raise self._lost(f"gave no answer within {limit:g} s")
        try:
            kind, text = receive_answer(self._child.answers, wait)
        except EOFError:
            raise self._lost(self._child.fate()) from None
        self._busy = False
        if kind == Answer.ENDED:
            raise EndOfRun(text)
        if kind == Answer.FAILED:
            raise SimulationError(text)
        return text

    def _lost(self, fate: str) -> SimulationError:
        """The error for a process that answers no more."""
        time, h, reached = self._times
        number = self._shared.now.value
        call = CALLS[number] if 0 <= number < len(CALLS) else "a call"
        at = (
            when(time, h)
            if call in STEPS
            else when(reached if call[:4] in ("fmi2", "fmi3") and call[4:7] == "Get" else time)
        )
        self._gone = True
        self._child.kill()
        said = self._shared.said or self._child.last_lines.replace("\n", " | ")
        return SimulationError(f"{self.name}: {call} {fate} at {at}{quoted(said)}")


def _end(end: Inlet | Outlet) -> dict[str, Any]:
    return {"kind": end.kind, "variables": [Variable.of(v) for v in end.variables]}


def _hand_on(output: bytes) -> None:
    """Print what an FMU prints: beside the results, not among them."""
    with suppress(OSError, ValueError):
        sys.stderr.write(output.decode(errors="replace"))
        sys.stderr.flush()
