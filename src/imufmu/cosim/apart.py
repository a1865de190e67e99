"""Where each instance of a run lives: FMUs that imufmu has built in this process, any other in a process of its own."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from ..files.scratch import scratch_folder
from ..fmi.archive import interface_of, open_fmu
from .guest import Guest
from .kinds import slave_of
from .slave import Equations, Slave, Unpacked, forget_paths

Instance = Slave | Guest

_TOLERANCE = 1e-6  # relative, of solved equations, where an FMU does not want less: errors are measured against them


class Instances:
    """Starts instances; the stack ends them, whatever state they are in, and deletes what was unpacked.

    in_process: no processes. limit: s, the longest that a call in another process may take. check: may raise
    KeyboardInterrupt while such a call is awaited.
    """

    def __init__(self, stack: ExitStack, in_process: bool, limit: float, check: Callable[[], None]) -> None:
        if not limit > 0:
            raise ValueError(f"step_timeout = {limit:g} s; it must be positive")
        self._stack, self._in_process, self._limit, self._check = stack, in_process, limit, check
        self._scratch = stack.enter_context(scratch_folder("run"))
        self._unpacked: dict[tuple[Path, bool], Unpacked] = {}  # each for model exchange or not
        self._guests = 0
        stack.callback(forget_paths, self._scratch)

    def start(self, name: str, fmu: Path, model: Any, ours: bool) -> Instance:
        """An instance of an FMU with this ModelDescription (fmpy). Raises SimulationError and ArchiveError."""
        unpacked = self._unpack(fmu, model)
        instance: Instance
        if ours or self._in_process:
            instance = slave_of(name, unpacked)
        else:
            folder = self._scratch / f"process{self._guests}"
            folder.mkdir()
            self._guests += 1
            instance = Guest(name, unpacked, folder, self._limit, self._check)
        self._stack.callback(instance.abandon)
        return instance

    def _unpack(self, fmu: Path, model: Any) -> Unpacked:
        key = fmu, model.coSimulation is None
        if key not in self._unpacked:
            folder = self._scratch / str(len(self._unpacked))
            folder.mkdir()
            library, _ = open_fmu(fmu, folder, model)
            identifier, version = interface_of(model).modelIdentifier, model.fmiMajorVersion
            equations = None if model.coSimulation else _equations(model)
            self._unpacked[key] = Unpacked(library, folder, model.guid, identifier, version, equations)
        return self._unpacked[key]


def _equations(model: Any) -> Equations:
    experiment = model.defaultExperiment
    declared = float(experiment.tolerance) if experiment and experiment.tolerance else _TOLERANCE
    return Equations(
        model.numberOfContinuousStates,
        model.numberOfEventIndicators,
        min(declared, _TOLERANCE) if declared > 0 else _TOLERANCE,
        model.modelExchange.needsCompletedIntegratorStep,
    )
