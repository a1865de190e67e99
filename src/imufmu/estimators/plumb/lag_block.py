"""The block ``plumb_lag``: ``plumb`` with the nodes of ``lag`` behind it, and what it tells of one of them.

The equations of plumb stand in ``filter`` and what it names: ``readings``, ``start``, ``rest``, ``travel``,
``block_end``, ``covariance``, ``vehicle`` and ``heading``; those that look back in ``lag`` and ``smoother``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from types import SimpleNamespace
from typing import Any

import casadi as ca

from ...blocks import vocabulary as v
from ...blocks.block import Expressions, SampledBlock
from ...blocks.expressions import function, namespace
from ...blocks.rotations import (
    euler_from_quaternion,
    matrix_from_quaternion,
    multiply,
    quaternion_from_rotation_vector,
    root,
    unit,
)
from ...blocks.signals import Signal, State, real, total_size
from ...blocks.slow_parts import SlowParts
from . import block_end as block
from . import heading, lag
from .covariance import full, tilt_variance
from .filter import BLOCK as PLUMB
from .filter import status
from .smoother import UNTOLD, WIDER

_FAST = [state.name for state in PLUMB.state].index("q0")  # the first that only slow steps change
_TOLD = (
    State("before", (total_size(lag.NODE),)),
    State("after", (total_size(lag.NODE),)),
    State("since"),
    State("waits"),
)


def _stride(p: SimpleNamespace) -> Any:
    """Samples from one attitude that is kept to the next."""
    return ca.fmax(1, ca.ceil(ca.floor(p.h / p.sample_period + 0.5) / lag.SLOTS))


def _initial(u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    first = PLUMB.initial(u, p)
    node = namespace(lag.NODE, lag.start_node())
    after = vars(node) | dict(q=ca.repmat(ca.SX(first["q"]).T, lag.SLOTS + 1, 1))
    record = {state.name: ca.SX.zeros(*state.shape) for state in lag.RECORD}
    told = dict(before=lag.start_node(), after=lag.column(after, lag.NODE), since=0, waits=1)
    return {**first, **record, **told, "slots": ca.SX.zeros(lag.SLOTS, 4)}


def _step(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    after = dict(PLUMB.step(x, u, p))
    slots, place = ca.SX(x.slots), after["samples"] / _stride(p)
    for i in range(lag.SLOTS):
        slots[i, :] = ca.if_else(place == i + 1, after["q"].T, x.slots[i, :])
    return after | dict(slots=slots)


def _output(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    before, after = namespace(lag.NODE, x.before), namespace(lag.NODE, x.after)
    stride = _stride(p)
    slot = ca.floor(ca.if_else(x.waits, 0, ca.fmin(x.samples, after.length)) / stride)
    q = after.q[0, :].T
    for i in range(1, lag.SLOTS + 1):
        q = ca.if_else(slot == i, after.q[i, :].T, q)
    share = slot * stride / ca.fmax(after.length, 1)

    def between(begins: Any, ends: Any) -> Any:
        return begins + share * (ends - begins)

    psi = between(before.s, after.s + after.e)
    q = unit(multiply(quaternion_from_rotation_vector(ca.vertcat(psi, 0)), multiply(before.turn, q)))
    roll, pitch, yaw = euler_from_quaternion(q)
    filters, untold = ca.vertsplit(between(before.told, after.told))
    variance = WIDER * between(before.Pi[0] + before.Pi[2], after.Pi[0] + after.Pi[2]) + UNTOLD * untold  # (32)
    half = after.offset / 2
    return dict(
        roll=roll,
        pitch=pitch,
        yaw=heading.wrapped(yaw + after.offset),
        q_NS=multiply(ca.vertcat(ca.cos(half), 0, 0, ca.sin(half)), q),
        vertical=matrix_from_quaternion(q)[2, :].T,
        tilt_std=root(ca.fmin(filters, variance)),
        stationary=after.resting,
        delay=(x.since + x.samples - slot * stride) * p.sample_period,
        status=status(x, u),
        gyro_bias=x.b,
    )


_INNER = replace(
    PLUMB,
    name="plumb_lag_inner",
    summary="Attitude a moment ago, from a 6- or 9-axis IMU: plumb, smoothed over what came since",
    doc="""The filter plumb with a fixed-lag smoother behind it. It tells the attitude of lag seconds ago, corrected by
all that was read since: sample_time says of which instant, delay how long that is ago. Half a second is worth a tenth
of the error of a hand-held sensor, one or two seconds make a start in the middle of a motion bearable. For a record
that is there as a whole there is better: plumb offline.
What is told lies a whole number of blocks of h back, so the delay is longer than lag by up to h. Until so much was
read it stays with the first sample. Of a block of more than 16 samples every second, third ... attitude is
told. Where its attitude was found wrong it lets the last two seconds follow the new one, or as much as there is.
Settings, inputs and weaknesses are those of plumb; stationary is of the instant of the attitude, status of now.""",
    when="""Use it where what happened half a second or two seconds ago is soon enough: logging, labelling, motion
capture with a delay. Instead: plumb, for control; plumb offline, for recordings.""",
    outputs=(
        v.ROLL,
        v.PITCH,
        v.YAW,
        v.Q_NS,
        v.VERTICAL,
        v.TILT_STD,
        Signal("stationary", "1", "1 at rest at that instant, else 0", 0, 1),
        Signal("delay", "s", "How long ago the instant of the attitude is", 0, 1e4),
        v.STATUS,
    ),
    locals=(Signal("gyro_bias", "rad/s", "Bias of the gyroscope, sensor frame, of now", -1, 1, (3,), nominal=0.01),),
    own_parameters=(
        *(p for p in PLUMB.own_parameters if p.name != "latency"),
        real("lag", "s", 0.5, (0.1, 2), "How long ago the attitude is that is told, at least"),
    ),
    state=(*PLUMB.state[:_FAST], State("slots", (lag.SLOTS, 4)), *PLUMB.state[_FAST:], *lag.RECORD, *_TOLD),
    initial=_initial,
    step=_step,
    slow_steps=block.steps(lag.RECORD),
    output=_output,
)


class _Delayed(SlowParts):
    """Parts of a block that tells nothing of the sample of now."""

    def derivative(self, name: str, n_outputs: int) -> Any:
        """As of any SlowParts: 0."""
        arguments = self.step.mx_in()
        du = ca.MX.sym("du", arguments[1].shape)
        return ca.Function(
            name, [*arguments, du], [ca.MX.zeros(n_outputs)], ["x", "u", "p", "w", "du"], ["dy"], {"is_diff_in": []}
        )


@dataclass(frozen=True)
class Lagged(SampledBlock):
    """``inner`` with its nodes, as the last of the state."""

    inner: SampledBlock | None = None

    @cached_property
    def first_function(self) -> Any:
        """CasADi Function (u, p, w) -> (x, y), as of any sampled block."""
        u, p, w = (ca.MX.sym(name, s.shape) for name, s in zip("upw", _INNER.first_function.sx_in(), strict=True))
        x, y = _INNER.first_function(u, p, w)
        nodes = ca.repmat(ca.DM(lag.start_node()), lag.NODES, 1)
        result = ca.vertcat(x[:_N], nodes, x[_N:])
        return ca.Function(f"{self.name}_first", [u, p, w], [result, y], ["u", "p", "w"], ["x", "y"])

    @cached_property
    def slow_parts(self) -> SlowParts:
        """Those of ``inner``; before each slow step the nodes move on."""
        inner = _INNER.slow_parts
        assert inner
        # Lists of instructions, which read what they need where it stands: a graph would copy the nodes every sample.
        _, held, u, p, w = inner.report.sx_in()
        x_all = ca.SX.sym("x", _N + _RING + held.numel())
        own = ca.vertcat(x_all[:_N], x_all[_N + _RING :])
        step = function(f"{self.name}_step", [x_all, u, p, w], list(inner.step(own, u, p, w)))
        report = function(f"{self.name}_report", [x_all, held, u, p, w], [inner.report(own, held, u, p, w)])
        due, held, u, p, w = (ca.MX.sym("a", inner.slow.size_in(i)) for i in (0, 2, 3, 4, 5))
        x = ca.MX.sym("x", _N + _RING)
        moved, nodes = _moved_on(x[:_N], x[_N:], p)
        after = ca.vertcat(inner.slow(due, moved, held, u, p, w), nodes)
        arguments = [due, x, held, u, p, w]
        moving, keep = (ca.Function(name, arguments, [result]) for name, result in (("moving", after), ("keep", x)))
        choice = ca.Function.if_else(f"{self.name}_moving_or_not", moving, keep)
        slow = ca.Function(f"{self.name}_slow", arguments, [choice(due, *arguments)])
        return _Delayed(step, slow, report, inner.slow_steps)


_N, _RING = total_size(_INNER.state), total_size(lag.NODE) * lag.NODES


def _moved_on(x: Any, nodes: Any, p: Any) -> tuple[Any, Any]:
    """State and nodes at the end of a block, before the slow step."""
    changing, rows = total_size(lag.CHANGING), total_size(lag.NODE)
    table = ca.reshape(nodes, rows, lag.NODES)
    record, P, begun, entering, samples = _of_block(x, p)
    one = _one_block_on().map("nodes", "serial", lag.NODES, [1, 2], [])
    going = ca.vertcat(one(table[:changing, :], record, P), table[changing:, :])
    newest = ca.if_else(table[_LENGTH, 0] > 0, ca.vertcat(begun, table[begun.numel() :, 0]), going[:, 0])
    going = ca.horzcat(entering, newest, going[:, 1:-1])
    picked, since, waits = _window()(going[_LENGTH, :].T, p)
    told = ca.vertcat(going @ ca.vertcat(0, picked[:-1]), going @ picked, since, waits)
    moved = ca.vertcat(x[: _N - told.numel()], told)
    ends = samples > 0  # else it has only begun
    return ca.if_else(ends, moved, x), ca.if_else(ends, ca.vec(going), nodes)


_LENGTH = total_size(lag.NODE) - lag.NODE[-1].size - 1  # row of a node


def _arguments() -> tuple[Any, SimpleNamespace, Any, SimpleNamespace]:
    x, p = ca.SX.sym("x", _N), ca.SX.sym("p", total_size(_INNER.parameters))
    return x, namespace(_INNER.state, x), p, namespace(_INNER.parameters, p)


def _of_block(x: Any, p: Any) -> Any:
    """The record of the block before, P of its errors with psi, what its node begins with, the node that enters."""
    flat, state, flat_p, _ = _arguments()
    P = full(state.P)
    told = ca.vertcat(state.tilt_std**2, ca.if_else(state.coarse, 0, state.tilt_std**2 - tilt_variance(P)))
    node = lag.begun(state, P[:, :2]) | dict(told=told, resting=state.resting, offset=state.offset)
    empty = vars(namespace(lag.NODE, lag.start_node()))
    entering = empty | dict(length=state.samples, q=ca.vertcat(state.q0.T, state.slots))
    results = [
        ca.vertcat(*(lag.column({s.name: getattr(state, s.name)}, (s,)) for s in lag.RECORD)),
        lag.column({"P": P[:, :2]}, (State("P", (18, 2)),)),
        lag.column(node, lag.NODE[: len(lag.CHANGING) + 3]),
        lag.column(entering, lag.NODE),
        state.samples,
    ]
    return function("plumb_lag_of_block", [flat, flat_p], results)(x, p)


def _one_block_on() -> Any:
    """Function (CHANGING, record, P) -> (CHANGING)."""
    flat, record = ca.SX.sym("node", total_size(lag.CHANGING)), ca.SX.sym("record", total_size(lag.RECORD))
    P = ca.SX.sym("P", 36)
    node, x = namespace(lag.CHANGING, flat), namespace(lag.RECORD, record)
    after = lag.one_block_on(node, x, ca.reshape(P, 2, 18).T)
    return function("plumb_lag_node", [flat, record, P], [lag.column(after, lag.CHANGING)])


def _window() -> Any:
    """Function (lengths, p) -> (places, since, waits)."""
    lengths, (_, _, flat_p, p) = ca.SX.sym("lengths", lag.NODES), _arguments()
    return function("plumb_lag_window", [lengths, flat_p], list(lag.window(lengths, p.sample_period, p.lag)))


BLOCK = Lagged(
    **{
        name: getattr(_INNER, name)
        for name in _INNER.__dataclass_fields__
        if name not in ("name", "state", "delayed_by")
    },
    name="plumb_lag",
    delayed_by="delay",
    state=(*_INNER.state, State("nodes", (_RING,))),
    inner=_INNER,
)
