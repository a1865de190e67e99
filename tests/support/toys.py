"""Small blocks that make the framework visible: one reports all it sees, one the same with slow steps, one has a
closed-form solution."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np

from imufmu.blocks.block import ContinuousBlock, SampledBlock
from imufmu.blocks.signals import Signal, State, integer, real, switch


def signal(name: str, shape: tuple[int, ...] = (), start: float | tuple[float, ...] = 0.0) -> Signal:
    return Signal(name, "1", f"The {name} of a toy", -1e300, 1e300, shape, start)


MATRIX = (2, 3)
GAIN = ((1.0, 2.0, 3.0), (4.0, 5.0, 6.0))

MIRROR = SampledBlock(
    name="mirror",
    summary="Reports everything a sampled block sees",
    doc="A toy.",
    reference="None",
    inputs=(signal("vector", (3,), (0.1, 0.2, 0.3)), signal("scalar"), signal("matrix", MATRIX)),
    outputs=(
        signal("vector_seen", (3,)),
        signal("vector_before", (3,)),
        signal("vector_missing"),
        signal("scalar_missing"),
        signal("matrix_seen", MATRIX),
        signal("matrix_before", MATRIX),
        signal("draws", (2,)),
        signal("samples"),
        signal("sum"),
    ),
    locals=(signal("product", MATRIX), signal("gain_seen", MATRIX)),
    own_parameters=(
        real("gain", "1", tuple(np.ravel(GAIN)), (-10, 10), "A matrix", shape=MATRIX),
        real("mount", "rad", 0.0, (-3, 3), "A vector", shape=(3,), tunable=True),
        integer("mode", 1, (1, 3), "A whole number"),
        switch("flag", "A switch"),
    ),
    state=(State("samples"), State("sum"), State("product", MATRIX)),
    initial=lambda u, p: dict(samples=1, sum=u.scalar, product=p.gain),
    step=lambda x, u, p: dict(samples=x.samples + 1, sum=x.sum + u.scalar, product=x.product + 0.1 * u.matrix),
    output=lambda x, u, p: dict(
        vector_seen=u.vector,
        vector_before=u.vector_previous,
        vector_missing=u.vector_missing,
        scalar_missing=u.scalar_missing,
        matrix_seen=u.matrix,
        matrix_before=u.matrix_previous,
        draws=u.normal,
        samples=x.samples,
        sum=x.sum,
        product=x.product,
        gain_seen=p.gain,
    ),
    period=0.01,
    normals=2,
)

# Every third sample it empties the sum and adds the last input and draw to the product; it mirrors it every fifth.
LAZY = replace(
    MIRROR,
    name="lazy",
    step=lambda x, u, p: dict(samples=x.samples + 1, sum=x.sum + u.scalar),
    slow_due=lambda x, u, p: ca.if_else(ca.fmod(x.samples, 3) == 0, 1, ca.if_else(ca.fmod(x.samples, 5) == 0, 2, 0)),
    slow_steps=(
        lambda x, u, p: dict(product=x.product + 0.1 * x.sum * u.matrix_previous + u.normal[1], sum=0),
        lambda x, u, p: dict(product=-x.product),
    ),
)


def eager(block: SampledBlock) -> SampledBlock:
    """The same block with its slow steps evaluated at every sample, and the result of the one that is due selected."""
    slow_due = block.slow_due
    assert slow_due is not None

    def step(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> dict[str, Any]:
        now = SimpleNamespace(**(vars(x) | block.step(x, u, p)))
        due, result = slow_due(now, u, p), vars(now)
        for number, slow_step in enumerate(block.slow_steps, 1):
            slowed = slow_step(now, u, p)
            result = {name: ca.if_else(due == number, slowed.get(name, value), value) for name, value in result.items()}
        return result

    return replace(block, step=step, slow_due=None, slow_steps=())


# q'' = -w^2 q + force + cos(t), q(0) = 1, q'(0) = 0
OSCILLATOR = ContinuousBlock(
    name="oscillator",
    summary="Undamped oscillator, driven by an input and by time",
    doc="A toy.",
    reference="None",
    inputs=(signal("force"),),
    outputs=(signal("position"), signal("velocity"), signal("force_seen")),
    locals=(signal("clock"),),
    own_parameters=(real("w", "rad/s", 2.0, (1e-3, 100), "Angular frequency"),),
    state=(State("q"), State("v")),
    initial=lambda p: dict(q=1, v=0),
    dynamics=lambda x, u, p, t: dict(q=x.v, v=-(p.w**2) * x.q + u.force + ca.cos(t)),
    output=lambda x, u, p, t: dict(position=x.q, velocity=x.v, force_seen=u.force, clock=t),
    longest_step=1e-3,
)


def oscillator_position(t: np.ndarray, w: float, force: float) -> np.ndarray:
    """Closed form for a constant force, w != 1."""
    forced = 1 / (w**2 - 1)
    return (1 - forced - force / w**2) * np.cos(w * t) + forced * np.cos(t) + force / w**2
