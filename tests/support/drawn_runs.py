"""Results of runs to draw, made in this process: a plant, an ideal IMU, estimators."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from imufmu import Result
from imufmu.blocks.block import Block, ContinuousBlock
from imufmu.blocks.running import Trajectory
from imufmu.compiled.running import run, simulate
from imufmu.registry import BLOCKS


def columns_of(component: str, block: Block, values: Trajectory) -> dict[str, np.ndarray]:
    """Columns of a result from the signals that a block reported."""
    return {
        f"{component}.{name}": column
        for signal in block.reported
        for name, column in zip(
            signal.element_names(), values[signal.name].reshape(len(values.time), -1).T, strict=True
        )
    }


def result_of(
    plant: ContinuousBlock,
    duration: float,
    step: float = 0.01,
    estimators: Sequence[str] = ("lee2012",),
    **parameters: Any,
) -> Result:
    """What a run of plant, ideal IMU and estimators records, the body of the plant included."""
    truth = simulate(plant, duration, step, parameters=parameters)
    columns = columns_of("plant", plant, truth)
    readings = {"gyro": truth["angular_velocity"], "accel": truth["specific_force"]}
    for name in estimators:
        estimate = run(BLOCKS[name], readings, {"sample_period": step})
        columns |= columns_of(name, BLOCKS[name], estimate) | {f"{name}.sample_time": truth.time}
    return Result("a_system", truth.time, columns, dict.fromkeys(columns))


def without(result: Result, *names: str) -> Result:
    """The same without the plant's signals of these names."""
    left = {k: v for k, v in result.columns.items() if k.removeprefix("plant.").split("[")[0] not in names}
    return Result(result.system, result.time, left, result.units)
