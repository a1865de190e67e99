"""What velocity tells ``plumb`` in motion: noise, travel, or that the attitude is wrong.

    symbol  here       unit   meaning
    V       x.speed2   m2/s2  mean square of v on one axis, low-passed
    v_s     x.lasting  m/s    v, low-passed
    f       x.fresh    1      1 at rest and in steady travel, fades in motion; 0 before the first rest
    X       x.swell    m2/s2  mean square of v_s on one axis beyond its uncertainty; up in X_UP, down in X_DOWN
    Y       x.doubt    m2/s2  excess of (8), where positive; up in Y_UP, down in Y_DOWN

Velocity is noise of the density s_v^2 q ((m/s)^2/Hz). So v = 0, averaged over a block, is a measurement with variance

    (s_v^2 q + 2 t_v e) / H,   q = sqrt(max(V, v2^2)) / k_v                                    (7)

Motion within a reach L takes L / |v|, so its density goes with |v| L: s_v^2 / k_v = 0.18 m is that reach. Noise of that
density, low-passed with t_s, has the variance s_v^2 q / (2 t_s), and v itself is uncertain by P_v. What exceeds twice
the standard deviation of both is no noise; a velocity that lasts for a time t_v has the density 2 t_v e:

    e = max(excess - 4 P_v, v_0^2 f),   excess = |v_s|^2 - 4 s_v^2 q / (2 t_s)                 (8)

with the mean squares of v_s and P_v over x and y for these, and those of z for z: a sensor does not climb as it
travels, and the scale error of an accelerometer makes it fall for ever. Then the gyroscope carries the attitude, and a
car that gathers speed does not tilt the horizon.

Until it was at rest for rr_s the filter is not *levelled*. A velocity that grows then may also mean a wrong attitude.
The density is only raised with the velocity that there was of late, up to MOST times:

    max(s_v^2 q, min(MOST s_v^2 q, 4 t_s X))                                                   (27)

and while the excess is positive bias, scale and cross-axis errors are left as they are: a start in a turn would teach
them nonsense. tilt_std grows by the tilt that makes such a velocity in LASTS:

    tilt_std^2 += 2 Y / (LASTS g)^2                                                            (28)

In steady travel (``rest``) v = 0 has rr_v2^2 / H. A motion that has just begun may become travel. While f lasts the
filter waits and sees: from the rest it knows attitude and bias, and a velocity taken for noise would spoil both before
(8) notices that it lasts. Travel begins then or not at all: after t_v without rest, steady travel, and a velocity
beyond the noise, the filter is not levelled until the next rest.

It is *lost* where it knows the tilt no better than P0_psi although it was levelled, and where v_s is beyond V_MOST, or
beyond V_BRISK after a turn that no vehicle makes (``rest``): a wrong attitude drives it there within seconds.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import casadi as ca

from ...blocks.block import Expressions
from ...blocks.rotations import norm, root
from ...blocks.signals import State, real
from . import rest
from .covariance import V, tilt_variance

X_UP, X_DOWN = 0.3, 6.0  # s
Y_UP, Y_DOWN = 1.0, 10.0  # s
MOST = 10.0
LASTS = 2.0  # s
V_MOST, V_BRISK = 70.0, 7.0  # m/s; a fast train, a runner

PARAMETERS = (
    real(
        "s_v", "m/s/sqrt(Hz)", 0.3, (1e-3, 1e3), "Density of the velocity in motion; larger trusts the gyroscope more"
    ),
    real("k_v", "m/s", 0.5, (1e-3, 1e3), "Velocity, root mean square of one axis, at which the density is s_v"),
    real("v2", "m/s", 0.05, (1e-6, 1e3), "Velocity, root mean square of one axis, of the gentlest motion"),
    real("t_l", "s", 3.0, (0, 1e3), "Time constant at which the density follows the motion"),
    real("t_s", "s", 0.3, (1e-3, 1e3), "Travel: time constant of the low-passed velocity that tells it from noise"),
    real("t_v", "s", 10.0, (0, 1e4), "Travel: how long a velocity lasts; 0 takes every velocity for noise"),
    real("v_0", "m/s", 1.0, (0, 1e3), "Travel: what velocity is expected to last in a motion that has just begun"),
    real("t_0", "s", 1.0, (1e-3, 1e3), "Travel: time in which that expectation fades after rest"),
    real("rr_v2", "m/s/sqrt(Hz)", 0.05, (1e-6, 1e3), "Density of the velocity in steady travel"),
)

STATES = (
    State("lasting", (3,)),
    State("fresh"),
    State("quiet"),
    State("swell"),
    State("doubt"),
    State("levelled"),
    State("steady"),
)

UNKNOWN: Expressions = dict(lasting=ca.SX.zeros(3), fresh=0, quiet=0, swell=0, doubt=0, levelled=0, steady=0)


def lasting(v_N: Any, x: SimpleNamespace, H: Any, p: SimpleNamespace) -> Any:
    """v_s after a block."""
    return x.lasting + H / (p.t_s + H) * (v_N - x.lasting)  # (10)


def is_lost(v_N: Any, P: Any, known: Any, x: SimpleNamespace, H: Any, p: SimpleNamespace) -> Any:
    """1 where the attitude must be wrong."""
    fastest = ca.if_else(rest.is_brisk(x), V_BRISK, V_MOST)
    unsure = ca.logic_and(known, tilt_variance(P) > 2 * p.P0_psi**2)
    return ca.logic_or(unsure, norm(lasting(v_N, x, H, p)[:2]) > fastest)


def velocity(
    v_N: Any, P: Any, travels: Any, steady: Any, x: SimpleNamespace, H: Any, p: SimpleNamespace
) -> tuple[Any, Any, dict[str, Any]]:
    """Variance (3,) of v = 0, 1 where it teaches the errors of the gyroscope, and X, Y, ``quiet`` and f.

    v_N, P: predicted. travels: 1 where a velocity that lasts is believed. steady: 1 in steady travel.
    """
    noise = p.s_v**2 * root(ca.if_else(x.speed2 > p.v2**2, x.speed2, p.v2**2)) / p.k_v  # (7)
    v_s, P_v = lasting(v_N, x, H, p), P[V, V]
    excess = ca.vertcat(ca.sumsqr(v_s[:2]) / 2, v_s[2] ** 2) - 4 * noise / (2 * p.t_s)  # (8)
    known = ca.vertcat((P_v[0, 0] + P_v[1, 1]) / 2, P_v[2, 2])
    e = ca.fmax(excess - 4 * known, x.fresh * p.v_0**2)  # (8)
    swell = follow(x.swell, ca.fmax(0, ca.sumsqr(v_s) - ca.trace(P_v)) / 3, X_UP, X_DOWN, H)
    unknown = ca.fmax(noise, ca.fmin(MOST * noise, 4 * p.t_s * swell))  # (27)
    density = ca.if_else(steady, p.rr_v2**2, ca.if_else(travels, noise + 2 * p.t_v * e, unknown))
    states = dict(
        swell=swell,
        doubt=follow(x.doubt, ca.fmax(0, excess[0]), Y_UP, Y_DOWN, H),
        quiet=ca.if_else(ca.logic_or(steady, excess[0] > 0), 0, x.quiet + H),
        fresh=ca.if_else(steady, 1, x.fresh * p.t_0 / (p.t_0 + H)),  # (10)
    )
    return ca.vertcat(density[0], density[0], density[1]) / H, ca.logic_or(travels, excess[0] <= 0), states


def follow(value: Any, target: Any, up: float, down: float, H: Any) -> Any:
    """A value after H seconds of following its target, faster up than down."""
    return value + H / (ca.if_else(target > value, up, down) + H) * (target - value)
