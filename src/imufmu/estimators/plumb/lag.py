"""The fixed-lag smoother of ``plumb``: what it would have said ``lag`` seconds ago, had it known what came since.

The attitude after each of the last blocks is a *node*: its error psi is carried along, next to the errors of now, as
one more error that never changes. What is learnt of the errors of now is learnt of it, too, by their covariance

    C = cov(errors of now, psi of the node), 18 x 2,   Pi = cov(psi of the node),   s = psi of the node, estimated

of which at the end of a block, with F of (5) and for each measurement with row h, gain P h / c, innovation n and its
variance c:

    C <- F C,   s += (h C)' n / c,   Pi -= (h C)' (h C) / c,   C -= P h / c (h C)              (33)

Where the attitude was put right at once by phi (``start``, or overruled) all nodes turn with it and begin anew:

    turn <- exp([phi]) turn,   C = P of the errors with psi,   Pi = P of psi,   s = 0           (34)

That is the smoother of ``smoother``, but for its (31): gyroscope errors count for nothing within a lag. Only the two
errors of tilt are carried. Within a block psi goes in a straight line from s of the node before to e + s of its own.

What is told lies a whole number of blocks back, by ``lag`` at least; ``delay`` says how far, and sample_time of which
instant. Until there are so many it stays with the first sample. A block enters when the next one ends, so that nothing
that is told hangs on the sample of now.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import casadi as ca

from ...blocks.rotations import multiply, quaternion_from_rotation_vector, skew
from ...blocks.signals import State
from . import block_end as block
from .covariance import PSI, V, of_rate

NODES = 62  # two seconds of blocks of 0.033 s, and what is needed at both ends
SLOTS = 16  # attitudes that are kept of a block; more samples are told one for several

# Of a node: what (33) and (34) change, what stays, and the attitudes of the block that ends with it, the first of which
# is that at its beginning.
CHANGING = (State("C", (18, 2)), State("Pi", (3,)), State("s", (2,)), State("turn", (4,)), State("e", (2,)))
STAYING = (State("told", (2,)), State("resting"), State("offset"), State("length"), State("q", (SLOTS + 1, 4)))
NODE = (*CHANGING, *STAYING)

RECORD = (*block.BOTH, *block.GOING_ALONG)


def start_node() -> Any:
    """The node that stands for all that was before the first block (column)."""
    unknown = dict(turn=ca.DM([1, 0, 0, 0]), Pi=ca.DM([1, 0, 1]), told=ca.DM([2, 0]))
    return column(dict.fromkeys((state.name for state in NODE), 0.0) | unknown, NODE)


def column(values: dict[str, Any], states: tuple[State, ...]) -> Any:
    """Flat, row by row."""
    parts = []
    for state in states:
        value = ca.SX(values[state.name])
        value = ca.repmat(value, state.size, 1) if value.numel() < state.size else value
        parts.append(ca.vec(value.T) if len(state.shape) == 2 else value)
    return ca.densify(ca.vertcat(*parts))


def one_block_on(node: SimpleNamespace, x: SimpleNamespace, P: Any) -> dict[str, Any]:
    """CHANGING after the record x of a block. P: (18, 2), of the errors after it with psi."""
    psi = node.C[PSI, :] + x.S_block @ of_rate(node.C, x.rate_block)
    C = ca.SX(node.C)
    C[V, :] = node.C[V, :] - skew(x.dV_block) @ node.C[PSI, :]  # (33)
    C[PSI, :] = psi
    C = ca.diag(x.kept) @ C
    s, Pi = node.s, node.Pi
    for i in range(block.MEASUREMENTS):
        hC = x.log_h[i, :] @ C
        s += hC.T * x.log_pull[i]  # (33)
        Pi -= ca.vertcat(hC[0] ** 2, hC[0] * hC[1], hC[1] ** 2) * x.log_weight[i]
        C -= x.log_gain[i, :].T @ hC
    turned = dict(begun(x, P), turn=multiply(quaternion_from_rotation_vector(x.phi), node.turn))  # (34)
    changed = dict(C=C, s=s, Pi=Pi, turn=node.turn, e=node.e)
    return {name: ca.if_else(x.anew, turned[name], changed[name]) for name in changed}


def begun(x: SimpleNamespace, P: Any) -> dict[str, Any]:
    """CHANGING of a node whose psi is that of now."""
    e = ca.if_else(x.anew, 0, x.error[:2])
    return dict(C=P, s=ca.SX.zeros(2), Pi=ca.vertcat(P[0, 0], P[0, 1], P[1, 1]), turn=ca.DM([1, 0, 0, 0]), e=e)


def window(lengths: Any, T: Any, lag: Any) -> tuple[Any, Any, Any]:
    """Which block is told: 1 in its place (NODES,), samples since its beginning, 1 before there are so many.

    lengths: (NODES,), samples of the last blocks, the newest first; 0 where there was none.
    """
    places, reached, since, first = [], ca.SX(0), ca.SX(0), ca.SX(0)
    last = 0
    for i in range(NODES - 1):
        since += lengths[i]
        enough = ca.logic_and((since + 0.5) * T > lag, lengths[i] > 0)
        enough = ca.logic_or(enough, lengths[i] > 0) if i == NODES - 2 else enough
        picked = ca.logic_and(enough, ca.logic_not(reached)) if i else ca.SX(0)
        places.append(picked)
        first += picked * since
        reached = ca.logic_or(reached, picked)
    oldest = [ca.logic_and(lengths[i] > 0, lengths[i + 1] == 0) for i in range(NODES - 1)]
    places = [ca.if_else(reached, a, b) for a, b in zip(places, oldest, strict=True)]
    return ca.vertcat(*places, last), ca.if_else(reached, first, since), ca.logic_not(reached)
