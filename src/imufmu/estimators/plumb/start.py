"""How ``plumb`` finds the vertical: a linear filter that has no attitude to be wrong about.

One accelerometer sample says little in the middle of a motion, and nothing where it is wrong; and an error-state filter
that starts 90 deg off never finds back. But in a frame that turns with the gyroscope alone gravity is a constant vector
g and velocity v its integral: both are linear in the readings, however wrong the first guess.

    symbol            here            unit       meaning
    g, v              x.gravity, x.v  m/s2, m/s  gravity, upward, and velocity; N is turned so that g = |g| e_z
    p_gg, p_gv, p_vv  x.start_P       m2/s4 ...  their covariance, the same on each axis
    V                 x.speed2        m2/s2      mean square of v on one axis, low-passed with t_l

At the end of a block, with the sums of (2):

    v += dV - g T,   p_vv += T^2 p_gg - 2 T p_gv + s_a^2 H + s_m^2 (H - T),   p_gv -= T p_gg,
    p_gg += (DRIFT g)^2 H                                                                      (23)
    in motion  g = dV / T  with variance LOOK^2 / H,   v = 0  with s_v^2 sqrt(max(V, v2^2)) / (k_v H)
    at rest    v = 0  with rr_v^2 / H                                                          (24)
    R <- exp([phi]) R,   v <- exp([phi]) v,   phi the shortest turn from g to e_z              (25)
    P_psi = p_gg / |g|^2 for x and y,   P_psi_x,vy = -P_psi_y,vx = p_gv / |g|,   P_v = p_vv    (26)

The look at dV / T helps in the first second only. From then on the velocity tells gravity from acceleration, as it
stays where it is: a wrong g drives it away. The filter proper takes over with (26) once tilt_std is below HAND_OVER, or
after rest of rr_s. It comes back here when it finds itself lost.
"""

from __future__ import annotations

from math import pi
from types import SimpleNamespace
from typing import Any

import casadi as ca

from ...blocks.block import Expressions
from ...blocks.rotations import TINY, angle_of, multiply, norm, quaternion_from_rotation_vector, root, rotate, unit
from ...blocks.signals import State
from . import rest
from .covariance import full, upper_triangle

FIRST = 5.0  # m/s2, standard deviation of one accelerometer sample as a measurement of gravity
FIRST_SPEED = 0.7  # m/s, root mean square on one axis
LOOK = 2.2  # m/s2/sqrt(Hz), density of the acceleration for which dV / T is a measurement of gravity
DRIFT = 0.005  # 1/sqrt(s); how far the gyroscope turns N away
HAND_OVER = 0.15  # rad

STATES = (State("coarse"), State("gravity"), State("start_P", (3,)), State("speed2"))

UP = ca.DM([0, 0, 1])


def begin(gravity: Any, p: SimpleNamespace) -> Expressions:
    """STATES where nothing is known but that gravity may point up in N."""
    start_P = ca.vertcat(FIRST**2, 0, p.P0_v**2)
    return dict(coarse=1, gravity=gravity, start_P=start_P, speed2=ca.SX(FIRST_SPEED**2))


def end_of_block(x: SimpleNamespace, H: Any, p: SimpleNamespace) -> dict[str, Any]:
    """q, v, P and STATES after a block, and phi."""
    resting = rest.at_rest(x)
    g, v_N, p_gg, p_gv, p_vv = measured(x, resting, H, p)
    phi = to_the_top(g)
    turn = quaternion_from_rotation_vector(phi)  # (25)
    gravity = norm(g)
    seen = 2 * p_gg < (HAND_OVER * ca.fmax(gravity, p.g / 2)) ** 2
    known = ca.logic_or(seen, ca.logic_and(resting, x.still_time >= p.rr_s))
    return dict(
        q=unit(multiply(turn, x.q)),
        phi=phi,
        v=rotate(turn, v_N),
        P=upper_triangle(handed_over(full(x.P), gravity, p_gg, p_gv, p_vv, p)),
        coarse=ca.logic_not(known),
        gravity=gravity,
        start_P=ca.vertcat(p_gg, p_gv, p_vv),
        speed2=x.speed2 + H / (p.t_l + H) * (ca.sumsqr(v_N) / 3 - x.speed2),
    )


def measured(x: SimpleNamespace, resting: Any, H: Any, p: SimpleNamespace) -> tuple[Any, Any, Any, Any, Any]:
    """g, v, p_gg, p_gv, p_vv after a block."""
    T, g, (p_gg, p_gv, p_vv) = x.T, x.gravity * UP, ca.vertsplit(x.start_P)
    v_N = x.v + x.dV - g * T  # (23)
    p_vv += T**2 * p_gg - 2 * T * p_gv + p.s_a**2 * H + p.s_m**2 * (H - T)
    p_gv -= T * p_gg
    p_gg += (DRIFT * p.g) ** 2 * H

    looks = ca.logic_and(ca.logic_not(resting), T > 0)
    gain = ca.if_else(looks, 1 / (p_gg + LOOK**2 / H), 0)  # (24)
    innovation = x.dV / ca.fmax(T, TINY) - g
    g, v_N = g + gain * p_gg * innovation, v_N + gain * p_gv * innovation
    p_gg, p_gv, p_vv = p_gg - gain * p_gg**2, p_gv - gain * p_gg * p_gv, p_vv - gain * p_gv**2

    density = ca.if_else(resting, p.rr_v**2, p.s_v**2 * root(ca.fmax(x.speed2, p.v2**2)) / p.k_v)
    gain = 1 / (p_vv + density / H)  # (24)
    g, v_N = g - gain * p_gv * v_N, v_N - gain * p_vv * v_N
    return g, v_N, p_gg - gain * p_gv**2, p_gv - gain * p_gv * p_vv, p_vv - gain * p_vv**2


def to_the_top(g: Any) -> Any:
    """phi (rad) of (25); half a turn about x where g points straight down."""
    across = norm(g[:2])
    straight_down = ca.logic_and(across < 2 * TINY, g[2] < 0)
    return ca.if_else(straight_down, ca.DM([pi, 0, 0]), ca.vertcat(g[1], -g[0], 0) / across * angle_of(across, g[2]))


def handed_over(P: Any, gravity: Any, p_gg: Any, p_gv: Any, p_vv: Any, p: SimpleNamespace) -> Any:
    """P with the errors of (26), independent of all others; no tilt is known worse than 1 rad."""
    P = ca.SX(P)
    P[:6, :], P[:, :6] = 0, 0
    length = ca.fmax(gravity, root(p_gg))
    P[0, 0] = P[1, 1] = p_gg / length**2
    P[2, 2] = p.P0_psi**2
    P[3, 3] = P[4, 4] = P[5, 5] = p_vv
    P[0, 4] = P[4, 0] = p_gv / length
    P[1, 3] = P[3, 1] = -p_gv / length
    return P
