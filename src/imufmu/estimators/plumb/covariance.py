"""Covariance of the errors of ``plumb``: its prediction over a block, and the measurements at the end of one.

The equation numbers are those of ``block_end``. P is 18 x 18 and symmetric. Its prediction is written out for the
rows that change, psi and dv: a product with the whole transition matrix would mostly multiply by 0 and 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import casadi as ca

from ...blocks.rotations import matrix_from_quaternion, skew
from ..kalman import Row, innovation, update

PSI, V, B, D = (slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 18))
N_ERRORS = 18
LARGEST_VARIANCE = 1.0  # rad2 of psi, rad2/s2 of b

I3 = ca.SX.eye(3)

# Of each measurement: its row h (18,), P h / s, innovation / s and 1 / s, with s the variance of the innovation.
Log = list[tuple[Any, Any, Any, Any]]


def predicted(P: Any, S: Any, x: SimpleNamespace, H: Any, p: SimpleNamespace) -> tuple[Any, Any]:
    """Covariance at the end of a block, from that at its beginning, and by what (18,) its bounds shrink the errors."""
    minus_dV, theta = -skew(x.dV), x.theta / H
    psi = P[PSI, :] + S @ of_rate(P, theta)  # (5): covariance of psi' with every error at the beginning
    dv = P[V, :] + minus_dV @ P[PSI, :]  # (5): the same of dv'
    P = ca.SX(P)
    P[V, V] = dv[:, V] + dv[:, PSI] @ minus_dV.T
    P[PSI, V] = psi[:, V] + psi[:, PSI] @ minus_dV.T
    P[PSI, PSI] = psi[:, PSI] + of_rate(psi.T, theta).T @ S.T
    P[PSI, 6:], P[V, 6:] = psi[:, 6:], dv[:, 6:]
    P[PSI, PSI] += noise_of_turn(x, H, p)
    P[V, V] += (p.s_a**2 * H + p.s_m**2 * (H - x.T) + p.k_a**2 * x.jolt) * I3  # (6)
    P[B, B] += p.s_b**2 * H * I3  # (6)
    P = ca.triu2symm(ca.triu(P))
    scale = within_bounds(P)
    return P * (scale @ scale.T), scale


def transition(S: Any, dV: Any, rate: Any) -> Any:
    """F (18, 18) of (5); rate: theta / H. ``predicted`` is F P F' + Q, without the products by 0 and 1."""
    F = ca.SX.eye(N_ERRORS)
    F[PSI, B], F[V, PSI] = -S, -skew(dV)
    F[PSI, D] = S @ ca.kron(I3, rate.T)
    return F


def noise_of_turn(x: SimpleNamespace, H: Any, p: SimpleNamespace) -> Any:
    """Q of psi (3, 3) for a block."""
    R, theta = matrix_from_quaternion(x.q), x.theta / H
    W = H * p.k_g**2 * theta @ theta.T + p.s_s**2 * ca.diag(x.blind)  # (6)
    return (p.s_g**2 * H + p.k_j**2 * x.jerk) * I3 + R @ W @ R.T  # (6)


def of_rate(P: Any, theta: Any) -> Any:
    """Covariance of the error of the mean rate, dD theta / H - db, with what the columns of P stand for."""
    return ca.vertcat(*(theta.T @ P[row : row + 3, :] for row in (9, 12, 15))) - P[B, :]


def within_bounds(P: Any) -> Any:
    """Factors (18,) of the errors that leave psi and b no more than LARGEST_VARIANCE: the correlations stay."""
    scale = ca.SX.ones(N_ERRORS)
    for i in (*range(N_ERRORS)[PSI], *range(N_ERRORS)[B]):
        scale[i] = ca.if_else(P[i, i] > LARGEST_VARIANCE, ca.sqrt(LARGEST_VARIANCE / P[i, i]), 1)
    return scale


def measure(
    error: Any, P: Any, part: slice, values: Sequence[Any], variance: Any, learns: Any = 1, log: Log | None = None
) -> tuple[Any, Any]:
    """Errors and covariance after measurements of the three errors ``part``, one after the other.

    variance: one for all, or (3,). learns: 0 leaves the errors of the gyroscope and their covariance as they are.
    """
    accepted = ca.SX.ones(N_ERRORS)
    accepted[B], accepted[D] = learns, learns
    variances = ca.vertsplit(variance * ca.SX.ones(3))
    for i, value, r in zip(range(N_ERRORS)[part], values, variances, strict=True):
        error, P = one_update(error, P, {i: 1}, value, r, accepted, log=log)
    return error, P


def one_update(
    error: Any, P: Any, row: Row, value: Any, r: Any, accepted: Any = 1, used: Any = 1, log: Log | None = None
) -> tuple[Any, Any]:
    """``update`` of ``kalman``, and an entry in the log. used: 0 where it is not accepted at all."""
    if log is not None:
        PH, variance = innovation(P, row, r)
        h = ca.SX(N_ERRORS, 1)
        for i, h_i in row.items():
            h[i] = h_i
        off = value - sum(h_i * error[i] for i, h_i in row.items())
        log.append((ca.densify(h), used * PH / variance, used * off / variance, used / variance))
    return update(error, P, row, value, r, accepted)


def tilt_variance(P: Any) -> Any:
    """Variance of the tilt (rad2)."""
    return P[0, 0] + P[1, 1]


def forgotten(P: Any, condition: Any, variance: Any = 0) -> Any:
    """P; where the condition holds, with errors of v of this variance that are independent of all others."""
    keep = kept(condition)
    P = P * (keep @ keep.T)
    P[V, V] += condition * variance * I3
    return P


def kept(forgotten: Any) -> Any:
    """Factors (18,) of the errors where those of v are forgotten, and others take their place."""
    keep = ca.SX.ones(N_ERRORS)
    keep[V] = 1 - forgotten
    return keep


def upper_triangle(P: Any) -> Any:
    """Upper triangle of a matrix, flat, row by row."""
    return ca.vertcat(*(P[i, j] for i in range(N_ERRORS) for j in range(i, N_ERRORS)))


def full(triangle: Any) -> Any:
    """Symmetric matrix of an upper triangle."""
    P, elements = ca.SX(N_ERRORS, N_ERRORS), iter(ca.vertsplit(triangle))
    for i in range(N_ERRORS):
        for j in range(i, N_ERRORS):
            P[i, j] = P[j, i] = next(elements)
    return P
