"""What the wheels of a vehicle tell ``plumb``: its velocity, so that cornering and braking need not be guessed.

    symbol        here                unit        meaning
    s             u.forward_speed     m/s         speed of the reference point along the vehicle's x axis
    l             p.imu_position      m           the sensor seen from the reference point, vehicle axes
    R_BS          mount(p)            1           attitude of the sensor in its vehicle B: x forward, y left, z up
    e_f, e_l      forward, left       1           level directions ahead and to the left of the vehicle, in N
    v_r           v_r                 m/s         velocity of the reference point, in N

At the end of a block with a valid s the velocity v is no noise but what it is, up to the unknown yaw of N. It follows
from the strapdown (4) and three measurements, with w the rate and R the attitude at that instant:

    v_r = v - R (w x R_SB l)                                                                  (11)
    e_f . v_r = s   with variance s_f^2 / H                                                   (12)
    e_l . v_r = 0   with variance (s_l + k_l |a_l|)^2 / H,   a_l = s e_z . R w                (13)
    e_z . v_r = 0   with variance s_z^2 / H                                                   (14)

in place of (7). To first order e_f turns with psi_z by e_l, so (12) sees psi_z times e_l . v, and (13) minus psi_z
times e_f . v; all three see db through the rate of (11). The directions are level, not the body's: a body on springs
leans by some degrees against its road, which costs the cosine of that. (13) is a wheel that does not slip sideways; it
does the more, the larger the acceleration a_l to the side. (14) leaves room for hills. Q of dv grows by (s_c + k_c |dV
across e_z| / H)^2 H: bias and scale error of an accelerometer are accelerations that follow the vehicle round.

A wheel that locks or spins tells a wrong s. (12) is left out where it is off by more than GATE standard deviations of
prediction and measurement together. After t_f s without agreement s is believed again, as at the first valid s: v is
set to s e_f, its errors are independent of the others, with P0_v. Without a valid s the velocity goes on by (4), as
one that lasts (8). A vehicle is at rest only where s says so.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import casadi as ca

from ...blocks import vocabulary as v
from ...blocks.block import Expressions
from ...blocks.rotations import matrix_from_euler, matrix_from_quaternion, norm, unit
from ...blocks.signals import Signal, State, real
from ..kalman import surprise
from .covariance import I3, N_ERRORS, PSI, B, Log, V, forgotten, kept, one_update

GATE = 4.0  # standard deviations
STANDING = 0.01  # m/s; a vehicle this slow may be at rest

INPUTS = (
    v.FORWARD_SPEED,
    Signal("forward_speed_valid", "1", "1 where forward_speed is to be used, 0 where there is none", 0, 1),
)

PARAMETERS = (
    real("mount", "rad", 0.0, (-7, 7), "Roll, pitch, yaw of the sensor in its vehicle", shape=(3,)),
    real("imu_position", "m", 0.0, (-100, 100), "Sensor seen from where forward_speed holds, vehicle axes", shape=(3,)),
    real("s_f", "m/s/sqrt(Hz)", 0.05, (1e-6, 1e3), "Density of the error of forward_speed"),
    real("s_l", "m/s/sqrt(Hz)", 0.05, (1e-6, 1e3), "Density of the sideways velocity, straight ahead"),
    real("k_l", "s/sqrt(Hz)", 0.15, (0, 1e3), "Growth of that density with the acceleration to the side"),
    real("s_z", "m/s/sqrt(Hz)", 0.5, (1e-6, 1e3), "Density of the vertical velocity of a vehicle"),
    real("s_c", "m/s2/sqrt(Hz)", 0.18, (0, 100), "Density that stands for the bias of the accelerometer"),
    real("k_c", "1/sqrt(Hz)", 0.04, (0, 10), "Growth of that density with the acceleration along the road"),
    real("t_f", "s", 5.0, (0, 1e3), "How long a forward_speed that disagrees is left out"),
)

STATES = (State("rolling"), State("disagreed"))

NO_SPEED: Expressions = dict(rolling=0, disagreed=0)


def is_valid(u: SimpleNamespace) -> Any:
    """1 where the wheels tell a speed."""
    missing = ca.logic_or(u.forward_speed_missing, u.forward_speed_valid_missing)
    return ca.logic_and(u.forward_speed_valid > 0.5, ca.logic_not(missing))


def wheels_turn(u: SimpleNamespace) -> Any:
    """1 where the wheels say that the vehicle moves."""
    return ca.logic_and(is_valid(u), ca.fabs(u.forward_speed) > STANDING)


def measured_velocity(
    v_N: Any, P: Any, w: Any, H: Any, x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace, log: Log
) -> tuple[Any, Any, Any, dict[str, Any]]:
    """Velocity, errors and covariance after (12) to (14), and the states of this module with what came before those.

    v_N, P: predicted velocity and covariance. w: rate, in S.
    """
    R, R_SB, speed = matrix_from_quaternion(x.q), matrix_from_euler(*ca.vertsplit(p.mount)).T, u.forward_speed
    ahead = R @ R_SB[:, 0]
    forward = unit(ca.vertcat(ahead[:2], 0))
    left, up = ca.vertcat(-forward[1], forward[0], 0), ca.SX([0, 0, 1])
    lever, w_N = R @ R_SB @ p.imu_position, R @ w

    anew = ca.logic_or(ca.logic_not(x.rolling), x.disagreed > p.t_f)
    v_N = ca.if_else(anew, speed * forward + ca.cross(w_N, lever), v_N)
    P = forgotten(P, anew, p.P0_v**2)
    P[V, V] += (p.s_c + p.k_c * norm(x.dV[:2]) / H) ** 2 * H * I3
    before = dict(P_before=P, kept=kept(anew))

    v_r = v_N - ca.cross(w_N, lever)  # (11)

    def row(direction: Any, psi_z: Any) -> dict[int, Any]:
        of_bias = R.T @ ca.cross(lever, direction)
        parts = [(PSI, ca.vertcat(0, 0, psi_z)), (V, direction), (B, of_bias)]
        return {i: h_i for part, h in parts for i, h_i in zip(range(N_ERRORS)[part], ca.vertsplit(h), strict=True)}

    error = ca.SX.zeros(N_ERRORS)
    sideways = p.s_l + p.k_l * ca.fabs(speed * w_N[2])
    along, off, variance = row(forward, ca.dot(left, v_N)), speed - ca.dot(forward, v_r), p.s_f**2 / H
    agrees = surprise(P, along, off, variance) < GATE**2
    across = row(left, -ca.dot(forward, v_N))
    error, P = one_update(error, P, along, off, variance, agrees, agrees, log)  # (12)
    error, P = one_update(error, P, across, -ca.dot(left, v_r), sideways**2 / H, log=log)  # (13)
    error, P = one_update(error, P, row(up, 0), -v_r[2], p.s_z**2 / H, log=log)  # (14)
    states = dict(rolling=1, disagreed=ca.if_else(agrees, 0, x.disagreed * (1 - anew) + H))
    return v_N, error, P, states | before
