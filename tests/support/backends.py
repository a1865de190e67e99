"""The ways to run a block. Laws that must hold whatever runs a block take a ``Backend``.

A new backend joins the laws by its entry in BACKENDS.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np

from imufmu.blocks.block import Block, ContinuousBlock, SampledBlock
from imufmu.blocks.instance import StepError, instantiate
from imufmu.blocks.running import Trajectory
from imufmu.compiled.running import run, simulate
from support.backend_native_fmu import NativeFmu
from support.backend_python_fmu import PythonFmu, Refused

PLANT_STEP = 0.01  # s between the rows of a continuous block

Inputs = Mapping[str, np.ndarray]


class Session(Protocol):
    """One instance of a block, initialised at time 0 with its inputs at their start values."""

    def step(self, t: float, h: float, inputs: Inputs) -> dict[str, np.ndarray]:
        """Set the inputs, step from t to t + h, and return every reported signal by name."""

    def save(self) -> bytes:
        """The whole state, serialised."""

    def restore(self, saved: bytes) -> None:
        """Return to a saved state."""


class Backend(Protocol):
    """One way to run blocks."""

    name: str

    def run(self, block: Block, inputs: Inputs, parameters: Mapping[str, Any], rows: int) -> Trajectory:
        """Every reported signal of ``rows`` rows: one per sample, or one per PLANT_STEP of a continuous block.

        inputs: (rows,) or (rows, k) by name; missing ones stay at their start value. Raises Refused.
        """

    def open(self, block: Block, parameters: Mapping[str, Any]) -> Session:
        """An instance to step."""


class InProcess:
    """The block in this Python process."""

    name = "in_process"

    def run(self, block: Block, inputs: Inputs, parameters: Mapping[str, Any], rows: int) -> Trajectory:
        if isinstance(block, ContinuousBlock):
            try:
                return simulate(block, (rows - 1) * PLANT_STEP, PLANT_STEP, inputs, parameters)
            except StepError as error:
                raise Refused(str(error)) from error
        assert isinstance(block, SampledBlock)
        starts = {s.name: np.tile(s.start_values(), (rows, 1)) for s in block.inputs}
        return run(block, starts | dict(inputs), parameters)

    def open(self, block: Block, parameters: Mapping[str, Any]) -> Session:
        return InProcessSession(block, parameters)


class InProcessSession:
    """An instance of ``imufmu.instance``; its state as JSON text."""

    def __init__(self, block: Block, parameters: Mapping[str, Any]) -> None:
        self._instance = instantiate(block)
        self._instance.p[:] = block.parameter_vector(parameters)
        self._instance.initialise(0.0)

    def step(self, t: float, h: float, inputs: Inputs) -> dict[str, np.ndarray]:
        values = [np.ravel(inputs[s.name]) for s in self._instance.block.inputs]
        self._instance.u[:] = np.concatenate(values) if values else []
        self._instance.do_step(t, h)
        result, first = {}, 0
        for s in self._instance.block.reported:
            result[s.name] = self._instance.y[first : first + s.size].reshape(s.shape).copy()
            first += s.size
        return result

    def save(self) -> bytes:
        return json.dumps(self._instance.get_state()).encode()

    def restore(self, saved: bytes) -> None:
        self._instance.set_state(json.loads(saved))


BACKENDS: tuple[Backend, ...] = (InProcess(), PythonFmu(PLANT_STEP), NativeFmu(PLANT_STEP))
