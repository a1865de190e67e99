"""The process of a foreign FMU: it does with one instance what it is told, and ends with its run.

It loads this file and the few beside it that it needs under a name of their own, not as imufmu: an FMU that brings its
own imufmu along finds no other in memory.
"""

from __future__ import annotations

import ctypes
import json
import os
import signal
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

import numpy as np

from .errors import EndOfRun, SimulationError
from .kinds import slave_of
from .slave import Inlet, Outlet, Slave
from .unpacked import Equations, Unpacked, Variable
from .wire import Answer, Numbers, Shared, Verb, receive_command, send_answer


class Start(NamedTuple):
    """A start value."""

    variable: Variable
    value: Any


def main() -> NoReturn:
    """Serve until there is nothing more to do."""
    commands, answers = _own_pipes()
    threading.Thread(target=_end_with, args=(int(sys.argv[2]),), daemon=True).start()
    _keep_quiet()
    server = _Server()
    with suppress(EOFError):
        while True:
            verb, times, data = receive_command(commands)
            try:
                said = server.perform(verb, times, data)
            except EndOfRun as error:
                send_answer(answers, Answer.ENDED, str(error))
            except SimulationError as error:
                send_answer(answers, Answer.FAILED, str(error))
            else:
                send_answer(answers, Answer.DONE, said)
            if verb == Verb.FREE:
                break
    _leave()


class _Server:
    """One instance, and how each command is done."""

    _slave: Slave

    def perform(self, verb: int, times: Numbers, data: Any) -> str:
        """Do it; returns the text of the answer. Raises SimulationError."""
        if verb == Verb.ADVANCE:
            self._slave.advance(*times)
        elif verb == Verb.CONNECT:
            self._plan = data
            sys.path += [entry for entry in data["path"] if entry not in sys.path]
            ends = [*data["inlets"], *data["outlets"]]
            self._shared = Shared(Path(data["memory"]), [(end["kind"], len(end["variables"])) for end in ends])
        elif verb == Verb.INSTANTIATE:
            self._instantiate(self._plan)
        elif verb == Verb.ENTER:
            starts: list[Any] = [Start(Variable(*variable), value) for variable, value in data]
            self._slave.enter_initialisation(starts, times[0], times[2])
        elif verb == Verb.WRITE:
            self._slave.write(times[0])
        elif verb == Verb.READ_INITIAL:
            self._slave.read_initial(times[0])
        elif verb == Verb.EXIT:
            self._slave.exit_initialisation(times[0])
        elif verb == Verb.READ:
            self._slave.read(times[0])
        elif verb == Verb.NOTES:
            return json.dumps(self._slave.notes)
        elif verb == Verb.FREE:
            self._slave.free()
        return ""

    def _instantiate(self, plan: Any) -> None:
        equations = Equations(*plan["equations"]) if plan["equations"] else None
        paths = Path(plan["library"]), Path(plan["folder"])
        fmu = Unpacked(*paths, plan["guid"], plan["identifier"], plan["version"], equations)
        self._slave = slave_of(plan["name"], fmu, self._shared.now, self._shared.say)
        count = len(plan["inlets"])
        inputs, results = self._shared.buffers[:count], self._shared.buffers[count:]
        nothing = np.zeros(0)
        self._slave.connect(
            [
                Outlet(end["kind"], _variables(end), end["outputs"], values, end["needed"])
                for end, values in zip(plan["outlets"], results, strict=True)
            ],
            [Inlet(end["kind"], _variables(end), nothing, nothing, nothing, nothing) for end in plan["inlets"]],
            inputs,
        )


def _variables(end: Any) -> list[Variable]:
    return [Variable(*variable) for variable in end["variables"]]


def _own_pipes() -> tuple[int, int]:
    """Commands and answers, out of reach of the FMU, whose output goes where errors go."""
    commands, answers = os.dup(0), os.dup(1)
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.dup2(2, 1)
    os.close(nothing)
    return commands, answers


def _keep_quiet() -> None:
    """No memory image of a crash on disk; a Ctrl-C is not for this process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if sys.platform != "win32":
        import resource

        resource.setrlimit(resource.RLIMIT_CORE, (0, resource.getrlimit(resource.RLIMIT_CORE)[1]))


def _end_with(parent: int) -> None:
    """End this process, and what it has started, when its run is gone, whatever the FMU is doing."""
    if sys.platform == "win32":
        import _winapi

        synchronize = 0x00100000
        _winapi.WaitForSingleObject(_winapi.OpenProcess(synchronize, False, parent), _winapi.INFINITE)
        os.kill(os.getpid(), signal.SIGTERM)  # which is TerminateProcess there
    else:
        while os.getppid() == parent:
            time.sleep(1.0)
        os.killpg(os.getpgrp(), signal.SIGKILL)


def _leave() -> NoReturn:
    """Without the ends of libraries and threads, which are the FMU's and may crash; what it has printed is kept."""
    with suppress(Exception):
        sys.stdout.flush()
        sys.stderr.flush()
    if sys.platform != "win32":
        ctypes.CDLL(None).fflush(None)
    os._exit(0)
