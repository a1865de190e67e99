"""Both pendulums, their parameters as numbers, and motions of theirs."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
import pytest

from imufmu.blocks.block import ContinuousBlock
from imufmu.plants.pendulum import DOUBLE_PENDULUM, PENDULUM

BOTH = pytest.mark.parametrize("block", [PENDULUM, DOUBLE_PENDULUM], ids=lambda block: block.name)
OFF_AXIS = {"heading": 0.7, "mount": (0.3, -0.5, 2.0)}
SHORT_TRIAL = {"motion": 1, "drive_rest": 0.5, "drive_duration": 5.0, "drive_ramp": 1.5}


def links_of(block: ContinuousBlock) -> int:
    return block.inputs[0].size


def defaults(block: ContinuousBlock, **changes: Any) -> SimpleNamespace:
    """Parameter values as arrays, for closed forms; SX so that the plant's own functions take them too."""
    values = {q.name: np.array(q.start_values()) for q in block.own_parameters}
    return SimpleNamespace(**{name: ca.SX(ca.DM(changes.get(name, value))) for name, value in values.items()})


def numbers(p: SimpleNamespace, *names: str) -> list[np.ndarray]:
    return [np.array(ca.DM(getattr(p, name))).ravel() for name in names]
