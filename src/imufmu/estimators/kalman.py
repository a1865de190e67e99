"""Measurement update of a Kalman filter for one scalar measurement after the other, for noise that is not correlated.

With a diagonal measurement covariance that gives the numbers of the update with all measurements at once, and needs no
inverse. One triangle of the covariance is computed and mirrored: rounding errors that differ between the triangles grow
without limit in directions that no measurement sees.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca

SHARPEST = 1e-11  # of the variances of the states measured: a smaller noise variance would drown in their rounding


def symmetric(P: Any) -> Any:
    """The matrix that has the upper triangle of P on both sides."""
    return ca.triu2symm(ca.triu(P))


def update(x: Any, P: Any, measured: Sequence[int], y: Any, r: Any, accepted: Any = 1) -> tuple[Any, Any]:
    """State (n,) and covariance (n, n) after y, the sum of the ``measured`` states, of variance r.

    P: symmetric. accepted: 0 leaves both as they are.
    """
    states = list(measured)
    PH = ca.sum2(P[:, states])
    variance, finest = ca.sum1(PH[states]), SHARPEST * sum(P[i, i] for i in states)
    variance, noise = ca.if_else(variance > 0, variance, 0), ca.if_else(r > finest, r, finest)
    K = ca.if_else(accepted, PH * (1 / (variance + noise)), 0)
    return x + K * (y - ca.sum1(x[states])), symmetric(P - K @ PH.T)
