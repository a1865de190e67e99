"""``plumb`` as it is, but it tells what happens at the end of every block: what a smoother wants to know."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import casadi as ca

from ...blocks.block import Expressions
from ...blocks.signals import Signal
from . import block_end as block
from .filter import BLOCK

RECORD = (*block.BOTH, *block.GOING_BACK)
_STATES = {state.name: state for state in (*BLOCK.state, *RECORD)}
EVERY_SAMPLE = ("q", "samples", "started", "coarse")
AT_ENDS = ("P", "resting", *(state.name for state in RECORD))
_TOLD = (*EVERY_SAMPLE, *AT_ENDS)


def _initial(u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    return {**BLOCK.initial(u, p), **{state.name: ca.SX.zeros(*state.shape) for state in RECORD}}


def _output(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    reported = BLOCK.output(x, u, p)
    return {name: reported[name] for name in ("tilt_std", "status")} | {name: getattr(x, name) for name in _TOLD}


RECORDING = replace(
    BLOCK,
    name="plumb_record",
    outputs=tuple(signal for signal in BLOCK.outputs if signal.name in ("tilt_std", "status")),
    locals=tuple(Signal(name, "1", f"State {name} of plumb", -1e30, 1e30, _STATES[name].shape) for name in _TOLD),
    state=(*BLOCK.state, *RECORD),
    slow_steps=block.steps(RECORD),
    initial=_initial,
    output=_output,
)
