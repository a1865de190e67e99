"""Run blocks over whole records in this process, compiled where that pays: as ``blocks.running``, sooner."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..blocks import running
from ..blocks.block import ContinuousBlock, SampledBlock
from ..blocks.running import Trajectory
from .offline import run_offline
from .rows import following, solved


def run(
    block: SampledBlock,
    inputs: Mapping[str, Any],
    parameters: Mapping[str, Any] | None = None,
    *,
    initial_state: Mapping[str, Any] | None = None,
    start_time: float = 0.0,
    offline: bool = False,
) -> Trajectory:
    """As ``blocks.running.run``, to the last bit; offline: as ``run_offline``, every row by the whole record."""
    if offline:
        if initial_state:
            raise ValueError("an initial_state does not go with offline: it would hold for one end of the record only")
        return run_offline(block, inputs, parameters, start_time=start_time)
    return running.run(
        block, inputs, parameters, initial_state=initial_state, start_time=start_time, following=following
    )


def simulate(
    block: ContinuousBlock,
    duration: float,
    step: float,
    inputs: Mapping[str, Any] | None = None,
    parameters: Mapping[str, Any] | None = None,
    *,
    start_time: float = 0.0,
) -> Trajectory:
    """As ``blocks.running.simulate``, to the last bit."""
    return running.simulate(block, duration, step, inputs, parameters, start_time=start_time, solved=solved)
