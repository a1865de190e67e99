"""Measurement update of a Kalman filter for one scalar measurement after the other, for noise that is not correlated.

With a diagonal measurement covariance that gives the numbers of the update with all measurements at once, and needs no
inverse. One triangle of the covariance is computed and mirrored: rounding errors that differ between the triangles grow
without limit in directions that no measurement sees.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import casadi as ca

ROUNDING = 1e-14  # of the sum of the variances: more than a prediction and an update lose by rounding
SHARPEST = 1e-11  # of the variances of the states measured: a smaller noise variance would drown in their rounding


def symmetric(P: Any) -> Any:
    """The matrix that has the upper triangle of P on both sides."""
    return ca.triu2symm(ca.triu(P))


def predicted(P: Any) -> Any:
    """A predicted covariance, symmetric, and so far from having a negative eigenvalue that no rounding brings it there.

    Once negative, an eigenvalue would grow with every update that follows.
    """
    return symmetric(P + ROUNDING * ca.trace(P) * ca.SX.eye(P.shape[0]))


Row = Mapping[int, Any]  # of a measurement matrix: the coefficients of the states that are measured


def update(x: Any, P: Any, row: Row, y: Any, r: Any, accepted: Any = 1) -> tuple[Any, Any]:
    """State (n,) and covariance (n, n) after y, the sum of coefficient times state over ``row``, of variance r.

    P: symmetric. accepted: 0 leaves both as they are.
    """
    PH, variance = innovation(P, row, r)
    K = ca.if_else(accepted, PH / variance, 0)
    return x + K * (y - sum(h * x[i] for i, h in row.items())), symmetric(P - K @ PH.T)


def innovation(P: Any, row: Row, r: Any) -> tuple[Any, Any]:
    """Covariance (n,) of every state with a measurement of variance r, and the variance of its innovation."""
    PH, variance = _projected(P, row)
    finest = SHARPEST * sum(h**2 * P[i, i] for i, h in row.items())
    return PH, variance + ca.if_else(r > finest, r, finest)


def update_by_state(x: Any, P: Any, i: int, h: Any, y: Any, r: Any, accepted: Any = 1) -> tuple[Any, Any]:
    """As ``update`` by y = h x[i]: nothing cancels in row i, so r may be as small as it likes."""
    inverse = 1 / (h**2 * P[i, i] + r)
    K = ca.if_else(accepted, h * inverse, 0) * P[:, i]
    after, kept = P - h * K @ P[i, :], ca.if_else(accepted, r * inverse, 1) * P[:, i]  # r inverse is 1 - K h
    after[:, i], after[i, :] = kept, kept.T
    return x + K * (y - h * x[i]), symmetric(after)


def surprise(P: Any, row: Row, innovation: Any, r: Any) -> Any:
    """Square of an innovation in units of its variance by P and the variance r of the measurement."""
    return innovation**2 / (_projected(P, row)[1] + r)


def _projected(P: Any, row: Row) -> tuple[Any, Any]:
    """Covariance (n,) of every state with what the row measures, and the variance of that."""
    PH = sum(h * P[:, i] for i, h in row.items())
    variance = sum(h * PH[i] for i, h in row.items())
    return PH, ca.if_else(variance > 0, variance, 0)
