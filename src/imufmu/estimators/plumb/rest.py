"""What ``plumb`` takes for rest, what for steady travel, and when it believes its own attitude no more.

    symbol  here                     unit         meaning
    gl, al  x.gyro_lp, x.accel_lp    rad/s, m/s2  readings, low-passed with rr_l
    g2, a2  x.gyro_lp2, x.accel_lp2  ...          the same, low-passed once more
    a3      x.accel_lp3              m/s2         al, low-passed with rr_w since the readings are even
    z, z_r  z, x.z_rest              1            up, in S; at the last rest
    g_r     x.felt_g                 m/s2         |al| where it was still for RR_LONG

    calm    |y - gl| < rr_dg, |a - al| < rr_da, |gl| < rr_b on each axis, wheels stand         (19)
    even    calm for a block, |gl - g2| < rr_lg, |al - a2| < rr_la                             (20)
    still   even, |al - a3| < rr_lw                                                            (21)
    level   |al - g_r z|^2 < (rr_a + rr_k g |z - z_r|)^2 + (3 g tilt_std)^2                    (22)

A car drives more quietly than a hand rests: no threshold on noise (19) tells them apart. The slow drift does (20):
what is moved does not keep its mean rate and its mean force within a tenth of a degree per second and 0.4 % of g, what
lies on a table does. (21) is the same over ten seconds, for a train that sets off gently or a sensor that rolls slowly.
The low-passes begin as means of what there is. Their drift is small then, so in the first 4 rr_l the limits of (20)
grow with the root of the time. What is further than FAR from al does not enter it.

It is rest where stillness has lasted for rr_t - for rr_s where the filter is not levelled - and is level (22): a sensor
that gathers speed steadily is still, too. rr_k leaves room for an accelerometer whose offsets depend on how it lies; a
car does not turn over, and gets none of it. Calm and level but not still is steady travel, once the filter knows its
attitude: the velocity changes little, but there is nothing to learn a bias from.

Stillness that is not level is either a steady acceleration or a wrong attitude. No acceleration lasts for rr_o, and
what has turned faster than W_BRISK a moment ago is no vehicle: there RR_LONG is enough. Then the attitude is
*overruled*.
"""

from __future__ import annotations

from functools import reduce
from math import radians
from types import SimpleNamespace
from typing import Any

import casadi as ca

from ...blocks.block import Expressions
from ...blocks.rotations import norm
from ...blocks.signals import State, real
from . import readings, vehicle

RR_SAMPLES = 3  # at least, at a low sample rate
RR_LONG = 2.0  # s
W_BRISK = 1.0  # rad/s, mean of a block
FAR = 30.0  # m/s2
REST, OVERRULED = 1, 2  # verdicts
T_BRISK = 10.0  # s, in which a turn is forgotten

PARAMETERS = (
    real("rr_l", "s", 0.5, (0, 1e3), "Rest: time constant of the low-pass"),
    real("rr_dg", "rad/s", radians(2.8), (0, 1e3), "Rest: largest distance of the gyroscope from its low-pass"),
    real("rr_da", "m/s2", 0.8, (0, 1e3), "Rest: largest distance of the accelerometer from its low-pass"),
    real("rr_b", "rad/s", radians(4), (0, 1e3), "Rest: largest low-passed gyroscope on each axis"),
    real("rr_lg", "rad/s", radians(0.1), (0, 1e3), "Rest: largest drift of the low-passed gyroscope in rr_l"),
    real("rr_la", "m/s2", 0.04, (0, 1e3), "Rest: largest drift of the low-passed accelerometer in rr_l"),
    real("rr_w", "s", 10.0, (0, 1e3), "Rest: time constant of the slow low-pass"),
    real("rr_lw", "m/s2", 0.1, (0, 1e3), "Rest: largest drift of the low-passed accelerometer in rr_w"),
    real("rr_t", "s", 0.1, (0, 1e3), "Rest: how long it must last to count"),
    real("rr_s", "s", 0.33, (0, 1e3), "Rest: how long it must last before the filter believes in travel"),
    real("rr_a", "m/s2", 0.1, (0, 1e3), "Rest: largest distance of the low-passed accelerometer from gravity"),
    real("rr_k", "1", 0.08, (0, 1), "Rest: growth of that, in g, with the change of attitude since the last rest"),
    real("rr_o", "s", 20.0, (0, 1e6), "Rest: how long stillness that is not level lasts before the attitude is wrong"),
)

FAST_STATES = (State("seen"), State("gyro_lp", (3,)), State("accel_lp", (3,)), State("calm_samples"))

STATES = (
    State("gyro_lp2", (3,)),
    State("accel_lp2", (3,)),
    State("accel_lp3", (3,)),
    State("age"),
    State("still_time"),
    State("brisk"),
    State("level"),
    State("verdict"),
    State("felt_g"),
    State("z_rest", (3,)),
)


def first(gyro: Any, accel: Any, p: SimpleNamespace) -> Expressions:
    """FAST_STATES and STATES after the first sample."""
    return dict(
        seen=1,
        gyro_lp=gyro,
        accel_lp=accel,
        calm_samples=0,
        gyro_lp2=gyro,
        accel_lp2=accel,
        accel_lp3=accel,
        age=0,
        still_time=0,
        brisk=0,
        level=1,
        verdict=0,
        felt_g=p.g,
        z_rest=ca.DM([0, 0, 1]),
    )


def sample(before: SimpleNamespace, x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """FAST_STATES after a sample."""
    time_constant = readings.smaller(p.rr_l, before.seen * p.sample_period)
    keep = time_constant / (time_constant + p.sample_period)
    keep = ca.if_else(ca.sumsqr(x.accel_used - before.accel_lp) > FAR**2, 1, keep)
    gyro_lp = x.gyro_used + keep * (before.gyro_lp - x.gyro_used)
    accel_lp = x.accel_used + keep * (before.accel_lp - x.accel_used)
    calm = _all(
        ca.sumsqr(x.gyro_used - gyro_lp) < p.rr_dg**2,  # (19)
        ca.sumsqr(x.accel_used - accel_lp) < p.rr_da**2,
        *ca.vertsplit(ca.fabs(gyro_lp) < p.rr_b),
        x.missing == 0,
        ca.logic_not(vehicle.wheels_turn(u)),
    )
    return dict(
        seen=before.seen + 1,
        gyro_lp=gyro_lp,
        accel_lp=accel_lp,
        calm_samples=ca.if_else(calm, before.calm_samples + 1, 0),
    )


def block(x: SimpleNamespace, H: Any, p: SimpleNamespace) -> dict[str, Any]:
    """What of STATES follows from the readings, after a block of H seconds."""
    keep = ca.fmin(p.rr_l / (p.rr_l + H), x.age / (x.age + H))
    gyro_lp2 = x.gyro_lp + keep * (x.gyro_lp2 - x.gyro_lp)
    accel_lp2 = x.accel_lp + keep * (x.accel_lp2 - x.accel_lp)
    age = ca.fmin(x.age + H, 4 * p.rr_l)
    share = ca.sqrt(age / (4 * p.rr_l))  # of the limits of (20)
    even = _all(
        is_calm(x),
        ca.sumsqr(x.gyro_lp - gyro_lp2) < (share * p.rr_lg) ** 2,  # (20)
        ca.sumsqr(x.accel_lp - accel_lp2) < (share * p.rr_la) ** 2,
    )
    keep = p.rr_w / (p.rr_w + H)
    accel_lp3 = ca.if_else(even, x.accel_lp + keep * (x.accel_lp3 - x.accel_lp), x.accel_lp)
    still = ca.logic_and(even, ca.sumsqr(x.accel_lp - accel_lp3) < p.rr_lw**2)  # (21)
    return dict(
        gyro_lp2=gyro_lp2,
        accel_lp2=accel_lp2,
        accel_lp3=accel_lp3,
        age=age,
        still_time=ca.if_else(still, x.still_time + H, 0),
        brisk=ca.fmax(x.brisk * T_BRISK / (T_BRISK + H), norm(x.theta) / H),
    )


def levels(x: SimpleNamespace, z: Any, tilt_variance: Any, resting: Any, H: Any, p: SimpleNamespace) -> dict[str, Any]:
    """The rest of STATES after a block, with z and the variance of the tilt after it."""
    felt = norm(x.accel_lp)
    felt_g = ca.if_else(
        ca.logic_and(x.still_time >= RR_LONG, is_calm(x)), x.felt_g + H / (1 + H) * (felt - x.felt_g), x.felt_g
    )
    room = p.rr_a + p.rr_k * p.g * norm(z - x.z_rest)
    level = ca.sumsqr(x.accel_lp - felt_g * z) < room**2 + (3 * p.g) ** 2 * tilt_variance  # (22)
    level = ca.logic_or(level, ca.logic_not(x.levelled))  # before that there is no attitude to agree with
    return dict(level=level, felt_g=felt_g, z_rest=ca.if_else(resting, z, x.z_rest))


def is_calm(x: SimpleNamespace) -> Any:
    """1 where every sample of the block was calm."""
    return ca.logic_and(x.calm_samples >= x.samples, x.calm_samples > 0)


def verdict(x: SimpleNamespace, p: SimpleNamespace) -> Any:
    """What calm samples mean from here on: REST, OVERRULED or nothing. They ask for it one by one."""
    least = ca.fmax(ca.if_else(x.levelled, p.rr_t, p.rr_s), RR_SAMPLES * p.sample_period) - p.sample_period / 2
    longest = ca.if_else(is_brisk(x), RR_LONG, p.rr_o)
    overruled = ca.logic_and(x.still_time > longest, ca.logic_not(x.level))
    return ca.if_else(ca.logic_and(x.still_time > least, x.level), REST, ca.if_else(overruled, OVERRULED, 0))


def at_rest(x: SimpleNamespace) -> Any:
    """1 at rest."""
    return ca.logic_and(is_calm(x), x.verdict == REST)


def is_brisk(x: SimpleNamespace) -> Any:
    """1 where the sensor has turned a moment ago as no vehicle does."""
    return x.brisk > W_BRISK


def travels_steadily(x: SimpleNamespace, p: SimpleNamespace) -> Any:
    """1 in steady travel, for what is not at rest."""
    calm = ca.logic_and(x.calm_samples * p.sample_period >= p.rr_t, x.calm_samples >= RR_SAMPLES)
    return _all(calm, x.level, x.levelled)


def _all(*conditions: Any) -> Any:
    return reduce(ca.logic_and, conditions)
