"""An FMU under test, driven through FMPy's thin wrapper of the FMI functions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import fmpy
import pytest
from fmpy import fmi2
from fmpy.fmi1 import FMICallException

from imufmu.fmi.build import cached_fmu
from imufmu.fmi.native import cached_native_fmu
from support.places import built_once

KINDS = ("python", "native")
OK, WARNING, ERROR, FATAL = 0, 1, 3, 4
REFUSED = {"python": FATAL, "native": ERROR}  # PythonFMU has no other word for it


def path(name: str, kind: str = "python") -> Path:
    """The FMU of a registered block, of one of KINDS, for this platform."""
    return cached_native_fmu(name) if kind == "native" else cached_fmu(name)


@lru_cache
def description(name: str, kind: str = "python") -> Any:
    """ModelDescription (fmpy) of the FMU of a registered block."""
    return fmpy.read_model_description(str(path(name, kind)))


@lru_cache
def unpacked(name: str, kind: str = "python") -> str:
    """Folder of the unpacked FMU, for the whole test run."""
    return str(built_once(f"{name}_{kind}", lambda folder: fmpy.extract(str(path(name, kind)), str(folder))))


class Fmu:
    """One instance; ``log`` collects (status, message)."""

    def __init__(
        self,
        name: str,
        instance_name: str = "instance",
        folder: str = "",
        *,
        kind: str = "python",
        guid: str = "",
        logging: bool = True,
    ) -> None:
        self.kind = kind
        self.model = fmpy.read_model_description(folder) if folder else description(name, kind)
        self.variables = {v.name: v for v in self.model.modelVariables}
        self.log: list[tuple[int, str]] = []
        self.slave = fmi2.FMU2Slave(
            guid=guid or self.model.guid,
            unzipDirectory=folder or unpacked(name, kind),
            modelIdentifier=self.model.coSimulation.modelIdentifier,
            instanceName=instance_name,
        )
        callbacks = fmi2.fmi2CallbackFunctions()
        callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(self._logged)
        callbacks.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(fmi2.calloc)
        callbacks.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(fmi2.free)
        self.callbacks = callbacks
        self.slave.instantiate(callbacks=callbacks, loggingOn=logging)

    def _logged(self, _environment: Any, _name: bytes, status: int, _category: bytes, message: bytes) -> None:
        self.log.append((status, message.decode()))

    def initialise(self, parameters: Mapping[str, float] | None = None, start_time: float = 0.0) -> Fmu:
        """From instantiated to ready to step."""
        self.slave.setupExperiment(startTime=start_time)
        self.slave.enterInitializationMode()
        self.set(parameters or {})
        self.slave.exitInitializationMode()
        return self

    def set(self, values: Mapping[str, float]) -> None:
        for name, value in values.items():
            variable = self.variables[name]
            setter = {"Real": self.slave.setReal, "Integer": self.slave.setInteger, "Boolean": self.slave.setBoolean}
            convert = {"Real": float, "Integer": int, "Boolean": bool}[variable.type]
            setter[variable.type]([variable.valueReference], [convert(value)])

    def get(self, *names: str) -> list[float]:
        return self.slave.getReal([self.variables[name].valueReference for name in names])

    def reals(self) -> list[float]:
        """Every output and local variable."""
        return self.get(*(v.name for v in self.model.modelVariables if v.causality in ("output", "local")))

    def step(self, t: float, h: float) -> None:
        self.slave.doStep(t, h)

    def close(self) -> None:
        self.slave.terminate()
        self.slave.freeInstance()


def elements(name: str, values: Sequence[float]) -> dict[str, float]:
    """Vector as scalar variables: name[1], name[2], ..."""
    return {f"{name}[{i}]": float(value) for i, value in enumerate(values, 1)}


def serialised(fmu: Fmu) -> bytes:
    """The whole state as bytes; the FMU's own copy is freed."""
    state = fmu.slave.getFMUstate()
    saved = fmu.slave.serializeFMUstate(state)
    fmu.slave.freeFMUstate(state)
    return saved


def restore(fmu: Fmu, saved: bytes) -> None:
    """Return to a serialised state."""
    state = fmu.slave.deSerializeFMUstate(saved)
    fmu.slave.setFMUstate(state)
    fmu.slave.freeFMUstate(state)


def refusal(instance: Fmu, call: Callable[[], Any]) -> str:
    """The one message of a call that is to be refused. A Python FMU is brought back to where it was before."""
    before, saved = len(instance.log), serialised(instance)
    with pytest.raises(FMICallException) as raised:
        call()
    assert raised.value.status == REFUSED[instance.kind]
    (message,) = (text for status, text in instance.log[before:] if status == ERROR)
    if instance.kind == "python":
        status, text = instance.log.pop()  # PythonFMU's wrapper says so too, in other words
        assert status == FATAL and text.startswith("Fatal py exception encountered")
        restore(instance, saved)
    assert [status for status, _ in instance.log[before:]] == [ERROR]
    return message
