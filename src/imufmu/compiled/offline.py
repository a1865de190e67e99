"""A whole record at once: an estimator forward and backward in time, and what both say together.

Turned round in time, a motion turns with the opposite rate and moves with the opposite speed, but is pushed alike. So
the readings backward are those of a motion, too, and an estimator that begins at their end knows what is to come. With
the vertical u and its standard deviation s of both runs,

    u = (u_f / s_f^2 + u_b / s_b^2) / | ... |,   s = 1 / sqrt(1 / s_f^2 + 1 / s_b^2)

which is what two independent estimates are worth together. They share their readings, so s is somewhat too small.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..blocks.block import SampledBlock
from ..blocks.rotations import over_rows, roll_pitch
from ..blocks.running import Trajectory
from .running import run

_OPPOSITE = ("gyro", "forward_speed")
# By gyro_index: how many rows after the one where a turn begins the rate stands that is read first for it backward.
_LATER = {0: -1, 1: 1, 2: 0, 3: 1}


def run_offline(
    block: SampledBlock, inputs: Mapping[str, Any], parameters: Mapping[str, Any] | None = None
) -> Trajectory:
    """Run an estimator over a record in both directions: ``vertical``, ``roll``, ``pitch`` and ``tilt_std`` of both.

    inputs, parameters: as for ``run``. Raises ValueError for a block without these outputs and ``gyro_index``, and as
    ``run``.
    """
    known = {signal.name for signal in (*block.outputs, *block.own_parameters)}
    lacking = {"vertical", "tilt_std", "gyro_index"} - known
    if lacking:
        raise ValueError(f"{block.name} has no {', '.join(sorted(lacking))}: it cannot run in both directions")
    forward = run(block, inputs, parameters)
    index = next(p.start for p in block.own_parameters if p.name == "gyro_index")
    shift = _LATER[int((parameters or {}).get("gyro_index", index))]
    shapes = {signal.name: signal.shape for signal in block.inputs}
    turned = {name: _backward(name, value, shapes.get(name), shift) for name, value in inputs.items()}
    backward = run(block, turned, parameters)
    back = {name: backward[name][::-1] for name in ("vertical", "tilt_std")}
    weights = forward["tilt_std"] ** -2.0, back["tilt_std"] ** -2.0
    both = weights[0][:, None] * forward["vertical"] + weights[1][:, None] * back["vertical"]
    vertical = both / np.linalg.norm(both, axis=1, keepdims=True)
    roll, pitch = over_rows(roll_pitch, vertical).T
    values = {"vertical": vertical, "roll": roll, "pitch": pitch, "tilt_std": sum(weights) ** -0.5}
    return Trajectory(forward.time, values, {name: forward.units[name] for name in values})


def _backward(name: str, value: Any, shape: tuple[int, ...] | None, shift: int) -> np.ndarray:
    """An input turned round in time; one of a signal's own shape is constant."""
    rows = np.asarray(value, dtype=float)
    if rows.shape == shape:
        return -rows if name in _OPPOSITE else rows
    if name == "gyro":
        rows = rows[np.clip(np.arange(len(rows)) + shift, 0, len(rows) - 1)]
    return -rows[::-1] if name in _OPPOSITE else rows[::-1]
