"""A toy estimator that loses its numbers on command, and the same with slow steps."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca

from imufmu.blocks.block import SampledBlock
from imufmu.blocks.signals import Signal, State
from imufmu.blocks.vocabulary import STATUS, Status

BREAKS = -1.0  # a value whose root no sum survives

FRAGILE = SampledBlock(
    name="fragile",
    summary="Sums up the roots of its input",
    doc="A toy.",
    reference="None",
    inputs=(Signal("value", "1", "The value of a toy", -10.0, 20.0),),
    outputs=(
        Signal("total", "1", "The total of a toy", 0.0, 1e6),
        Signal("samples", "1", "Samples so far", 0, 1e9),
        STATUS,
    ),
    locals=(),
    own_parameters=(),
    state=(State("total"), State("samples")),
    initial=lambda u, p: dict(total=ca.fabs(u.value), samples=1),
    step=lambda x, u, p: dict(total=x.total + ca.sqrt(u.value), samples=x.samples + 1),
    output=lambda x, u, p: dict(total=x.total, samples=x.samples, status=Status.GYRO_MISSING * u.value_missing),
)

# Every second sample is due for the sum.
FRAGILE_SLOWLY = replace(
    FRAGILE,
    name="fragile_slowly",
    state=(State("samples"), State("total")),
    step=lambda x, u, p: dict(samples=x.samples + 1),
    slow_due=lambda x, u, p: ca.fmod(x.samples, 2) == 0,
    slow_steps=(lambda x, u, p: dict(total=x.total + ca.sqrt(u.value)),),
)
