"""A whole record at once: what comes later tells where up was.

``plumb`` is smoothed: see ``smoothing``. Any other estimator runs forward and backward in time. Turned round in time, a
motion turns with the opposite rate and moves with the opposite speed, but is pushed alike. So the readings backward are
those of a motion, too, and an estimator that begins at their end knows what is to come. With the vertical u and its
standard deviation s of both runs,

    u = (u_f / s_f^2 + u_b / s_b^2) / | ... |,   s = 1 / sqrt(1 / s_f^2 + 1 / s_b^2)

which is what two independent estimates are worth together. They share their readings, so s is somewhat too small.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..blocks.block import SampledBlock
from ..blocks.rotations import over_rows, roll_pitch
from ..blocks.running import Trajectory, run
from ..estimators import plumb
from .rows import following
from .smoothing import run_smoothed

_OPPOSITE = ("gyro", "forward_speed")
# By gyro_index: how many rows after the one where a turn begins the rate stands that is read first for it backward.
_LATER = {0: -1, 1: 1, 2: 0, 3: 1}


def run_offline(
    block: SampledBlock,
    inputs: Mapping[str, Any],
    parameters: Mapping[str, Any] | None = None,
    *,
    start_time: float = 0.0,
) -> Trajectory:
    """Run an estimator over a record and its future: ``vertical``, ``roll``, ``pitch`` and ``tilt_std``.

    inputs, parameters, start_time: as for ``run``. Raises ValueError for a block without these outputs and
    ``gyro_index``, and as ``run``.
    """
    if block is plumb.BLOCK:
        time, vertical, tilt_std = run_smoothed(inputs, parameters)
    else:
        time, vertical, tilt_std = _both_directions(block, inputs, parameters)
    roll, pitch = over_rows(roll_pitch, vertical).T
    values = {"vertical": vertical, "roll": roll, "pitch": pitch, "tilt_std": tilt_std}
    units = {signal.name: signal.unit for signal in block.outputs}
    return Trajectory(start_time + time, values, {name: units[name] for name in values})


def _both_directions(
    block: SampledBlock, inputs: Mapping[str, Any], parameters: Mapping[str, Any] | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time (s), vertical (n, 3) and tilt_std (rad)."""
    known = {signal.name for signal in (*block.outputs, *block.own_parameters)}
    lacking = {"vertical", "tilt_std", "gyro_index"} - known
    if lacking:
        raise ValueError(f"{block.name} has no {', '.join(sorted(lacking))}: it cannot run in both directions")
    forward = run(block, inputs, parameters, following=following)
    index = next(p.start for p in block.own_parameters if p.name == "gyro_index")
    shift = _LATER[int((parameters or {}).get("gyro_index", index))]
    shapes = {signal.name: signal.shape for signal in block.inputs}
    turned = {name: _backward(name, value, shapes.get(name), shift) for name, value in inputs.items()}
    backward = run(block, turned, parameters, following=following)
    back = {name: backward[name][::-1] for name in ("vertical", "tilt_std")}
    weights = forward["tilt_std"] ** -2.0, back["tilt_std"] ** -2.0
    both = weights[0][:, None] * forward["vertical"] + weights[1][:, None] * back["vertical"]
    vertical = both / np.linalg.norm(both, axis=1, keepdims=True)
    return forward.time, vertical, sum(weights) ** -0.5


def _backward(name: str, value: Any, shape: tuple[int, ...] | None, shift: int) -> np.ndarray:
    """An input turned round in time; one of a signal's own shape is constant."""
    rows = np.asarray(value, dtype=float)
    if rows.shape == shape:
        return -rows if name in _OPPOSITE else rows
    if name == "gyro":
        rows = rows[np.clip(np.arange(len(rows)) + shift, 0, len(rows) - 1)]
    return -rows[::-1] if name in _OPPOSITE else rows[::-1]
