"""A moving person for the tests: parameter sets of the activities, runs, and where the skeleton has what."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from imufmu.blocks.running import Trajectory
from imufmu.compiled.running import simulate
from imufmu.plants.human.plant import BLOCK

HEIGHT = 1.75
WALK = {"activity": 0}
RUN = {"activity": 1, "speed": 3.3, "cadence": 168.0}
JUMP = {"activity": 2}
SKATE = {"activity": 3, "speed": 5.0}
RISE = {"activity": 4}
ACTIVITIES = [WALK, RUN, JUMP, SKATE, RISE]
NAMES = ["walking", "running", "jump", "rollerblading", "sit-to-stand"]
ACTIVITY = pytest.mark.parametrize("activity", ACTIVITIES, ids=NAMES)

# Points of the skeleton.
HEAD, PELVIS, HIP, KNEE, ANKLE, HEEL, BALL = range(7)
LEFT = 10 - HIP  # from a point of the right leg to that of the left one


def length(v: np.ndarray) -> np.ndarray:
    return np.linalg.norm(v, axis=-1)


def moved(run_time: float, step: float, *parameters: dict[str, Any], **more: Any) -> Trajectory:
    """A run with rows every ``step``. On a rigid mount there is no state to integrate: the output alone."""
    values = {name: value for given in (*parameters, more) for name, value in given.items()}
    if values.get("wobble"):
        return simulate(BLOCK, run_time, step, parameters=values)
    time = np.arange(round(run_time / step) + 1) * step
    return Trajectory(time, outputs_at(time, values))


def outputs_at(time: np.ndarray, parameters: dict[str, Any]) -> dict[str, np.ndarray]:
    """Every reported signal at these instants, with the sensor at its rest position."""
    n, p = len(time), BLOCK.parameter_vector(parameters)
    y = np.array(
        BLOCK.output_function.map(n)(np.zeros((6, n)), np.zeros((0, n)), np.tile(p[:, None], n), time[None, :])
    )
    values, first = {}, 0
    for signal in BLOCK.reported:
        values[signal.name] = y[first : first + signal.size].T.reshape(n, *signal.shape)
        first += signal.size
    return values


def steady(run: Trajectory) -> np.ndarray:
    """Rows in which walking, running and skating are under way at full speed."""
    return np.asarray(run.time > 3.0)
