"""The Python FMU of a block as a backend of the laws."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from fmpy.fmi1 import FMICallException

from imufmu.blocks.block import Block, SampledBlock
from imufmu.blocks.running import Trajectory
from imufmu.blocks.signals import Signal
from support import fmu


class Refused(Exception):
    """The block reported an error instead of a result."""


class PythonFmu:
    """Blocks as FMUs, stepped sample by sample, plants by ``plant_step`` (s)."""

    name = "python_fmu"
    kind = "python"

    def __init__(self, plant_step: float) -> None:
        self._plant_step = plant_step

    def open(self, block: Block, parameters: Mapping[str, Any]) -> FmuSession:
        return FmuSession(block, parameters, self.kind)

    def run(
        self, block: Block, inputs: Mapping[str, np.ndarray], parameters: Mapping[str, Any], rows: int
    ) -> Trajectory:
        session = self.open(block, parameters)
        sampled = isinstance(block, SampledBlock)
        h = session.sample_period if sampled else self._plant_step
        constant = {s.name: np.reshape(s.start_values(), s.shape) for s in block.inputs}
        results = []
        for k in range(rows):
            now = constant | {name: np.asarray(values)[k] for name, values in inputs.items()}
            if sampled:
                results.append(session.step(k * h, h, now))
                continue
            # A plant's row k holds its outputs at k h with the inputs of row k, which then drive it on.
            session.set(now)
            results.append(session.outputs())
            session.step(k * h, h, now)
        session.close()
        values = {s.name: np.array([result[s.name] for result in results]) for s in block.reported}
        return Trajectory(np.arange(rows) * h, values)


class FmuSession:
    """One instance of the FMU."""

    def __init__(self, block: Block, parameters: Mapping[str, Any], kind: str) -> None:
        self._block = block
        p = block.parameter_vector(parameters)
        names = [v.name for v in block.variables if v.group == "parameter"]
        self.sample_period = dict(zip(names, p, strict=True)).get("sample_period", 0.0)
        self._fmu = fmu.Fmu(block.name, kind=kind).initialise(dict(zip(names, p.tolist(), strict=True)))

    def set(self, inputs: Mapping[str, np.ndarray]) -> None:
        for signal in self._block.inputs:
            self._fmu.set(dict(zip(signal.element_names(), np.ravel(inputs[signal.name]).tolist(), strict=True)))

    def outputs(self) -> dict[str, np.ndarray]:
        return {signal.name: self._read(signal) for signal in self._block.reported}

    def step(self, t: float, h: float, inputs: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        self.set(inputs)
        try:
            self._fmu.step(t, h)
        except FMICallException as error:
            raise Refused(next(text for status, text in reversed(self._fmu.log) if status == fmu.ERROR)) from error
        return self.outputs()

    def save(self) -> bytes:
        return fmu.serialised(self._fmu)

    def restore(self, saved: bytes) -> None:
        fmu.restore(self._fmu, saved)

    def close(self) -> None:
        self._fmu.close()

    def _read(self, signal: Signal) -> np.ndarray:
        return np.array(self._fmu.get(*signal.element_names())).reshape(signal.shape)
