"""Rotations as CasADi expressions: exact away from singularities, finite with finite derivatives at them.

N inertial frame (Z up), S sensor frame. q_AB and R_AB take components in B to components in A. Quaternions are
Hamilton, scalar first. Euler angles are Z-Y-X: R_NS = Rz(yaw) Ry(pitch) Rx(roll).

The guards add TINY^2 under a square root, or replace an argument smaller than TINY: no double above 1e-92 notices.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

TINY = 1e-100


def norm(v: Any) -> Any:
    """Euclidean length of v; TINY for v = 0."""
    return ca.sqrt(ca.sumsqr(v) + TINY**2)


def unit(v: Any) -> Any:
    """Direction of v (1); zero for v = 0."""
    return v / norm(v)


def root(x: Any) -> Any:
    """Square root of x, of 0 where rounding made x negative."""
    return ca.sqrt(ca.if_else(x > 0, x, 0) + TINY**2)


def angle_of(y: Any, x: Any) -> Any:
    """atan2(y, x) in rad; 0 at the origin."""
    at_origin = ca.logic_and(ca.fabs(y) < TINY, ca.fabs(x) < TINY)
    return ca.atan2(y, ca.if_else(at_origin, TINY, x))


def skew(v: Any) -> Any:
    """Cross-product matrix (3, 3): skew(a) b = a x b."""
    return ca.skew(v)


def roll_pitch(vertical: Any) -> tuple[Any, Any]:
    """Roll and pitch (rad) of the sensor whose up vector in S is ``vertical`` (3,).

    Roll is in (-pi, pi], pitch in [-pi/2, pi/2]; roll is 0 where pitch is +-pi/2 (Lee 2012, (4), made computable).
    """
    z1, z2, z3 = ca.vertsplit(vertical)
    return angle_of(z2, z3), ca.atan2(-z1, ca.sqrt(z2**2 + z3**2 + TINY**2))


def vertical_from_roll_pitch(roll: Any, pitch: Any) -> Any:
    """Up vector in S (3,): the last row of R_NS."""
    return ca.vertcat(-ca.sin(pitch), ca.cos(pitch) * ca.sin(roll), ca.cos(pitch) * ca.cos(roll))


def matrix_from_euler(roll: Any, pitch: Any, yaw: Any) -> Any:
    """R_NS (3, 3) from Z-Y-X angles (rad)."""
    return matrix_from_quaternion(quaternion_from_euler(roll, pitch, yaw))


def quaternion_from_euler(roll: Any, pitch: Any, yaw: Any) -> Any:
    """q_NS (4,) from Z-Y-X angles (rad)."""

    def about(axis: int, angle: Any) -> Any:
        q = [ca.cos(angle / 2), 0, 0, 0]
        q[axis] = ca.sin(angle / 2)
        return ca.vertcat(*q)

    return multiply(multiply(about(3, yaw), about(2, pitch)), about(1, roll))


def euler_from_quaternion(q: Any) -> tuple[Any, Any, Any]:
    """Roll, pitch, yaw (rad) of q_NS (4,); roll is 0 where pitch is +-pi/2."""
    R = matrix_from_quaternion(q)
    roll, pitch = roll_pitch(R[2, :].T)
    # R_NS turned back by the roll: valid at pitch = +-pi/2 too, where R11 = R21 = 0. Roll is atan2(sin_roll, cos_roll).
    sin_roll, cos_roll = R[2, 1], R[2, 2]
    cos_roll = ca.if_else(ca.logic_and(ca.fabs(sin_roll) < TINY, ca.fabs(cos_roll) < TINY), 1, cos_roll)
    cos_yaw = cos_roll * R[1, 1] - sin_roll * R[1, 2]
    sin_yaw = sin_roll * R[0, 2] - cos_roll * R[0, 1]
    return roll, pitch, angle_of(sin_yaw, cos_yaw)


def quaternion_from_rotation_vector(v: Any) -> Any:
    """exp(v / 2): quaternion (4,) of a turn by |v| rad about v (3,)."""
    angle = norm(v)
    return ca.vertcat(ca.cos(angle / 2), ca.sin(angle / 2) / angle * v)


def multiply(p: Any, q: Any) -> Any:
    """Hamilton product p q (4,): q_AC = q_AB q_BC."""
    p0, p1, p2, p3 = ca.vertsplit(p)
    q0, q1, q2, q3 = ca.vertsplit(q)
    return ca.vertcat(
        p0 * q0 - p1 * q1 - p2 * q2 - p3 * q3,
        p0 * q1 + p1 * q0 + p2 * q3 - p3 * q2,
        p0 * q2 - p1 * q3 + p2 * q0 + p3 * q1,
        p0 * q3 + p1 * q2 - p2 * q1 + p3 * q0,
    )


def conjugate(q: Any) -> Any:
    """q_BA of q_AB (4,)."""
    return ca.vertcat(q[0], -q[1:4])


def matrix_from_quaternion(q: Any) -> Any:
    """R_AB (3, 3) of the unit quaternion q_AB (4,)."""
    w, v = q[0], q[1:4]
    return (w**2 - ca.sumsqr(v)) * ca.SX.eye(3) + 2 * w * skew(v) + 2 * v @ v.T


def rotate(q: Any, v: Any) -> Any:
    """Components in A of the vector with components v (3,) in B, for q_AB."""
    t = 2 * ca.cross(q[1:4], v)
    return v + q[0] * t + ca.cross(q[1:4], t)


def rotate_back(q: Any, v: Any) -> Any:
    """Components in B of the vector with components v (3,) in A, for q_AB."""
    return rotate(conjugate(q), v)


def angle_between(a: Any, b: Any) -> Any:
    """Angle (rad, in [0, pi]) between two vectors (3,), accurate near 0 and pi."""
    return angle_of(norm(ca.cross(a, b)), ca.dot(a, b))


def over_rows(expression: Callable[..., Any], *arrays: np.ndarray) -> np.ndarray:
    """Evaluate a symbolic function of vectors on every row of numeric arrays.

    arrays: (n, k_i), or (n,) for a scalar argument, n >= 1. Returns (n, m); a tuple of results is stacked into columns.
    Raises ValueError if the arrays differ in length.
    """
    if len({len(a) for a in arrays}) != 1:
        raise ValueError(f"arrays of {', '.join(str(len(a)) for a in arrays)} rows; expected the same number")
    rows = [np.asarray(a, dtype=float).reshape(len(a), -1) for a in arrays]
    symbols = [ca.SX.sym(f"a{i}", a.shape[1]) for i, a in enumerate(rows)]
    result = expression(*symbols)
    flat = ca.vertcat(*result) if isinstance(result, tuple) else ca.vec(result.T)
    function = ca.Function("over_rows", symbols, [flat]).map(len(rows[0]))
    return np.array(function(*(a.T for a in rows))).T
