"""What ``plumb`` makes of a reading before it believes it: nonsense, timing, clipping.

    symbol  here                      unit         meaning
    y, a    x.gyro_used, .accel_used  rad/s, m/s2  readings of this sample, or what stands in their place
    y-, a-  before.gyro_used, ...     ...          those of the sample before
    kappa   x.kappa                   1            see (18)
    m       x.size                    rad/s        the largest of |y| over the axes
    L       x.clip                    rad/s        gyro_range, or less where the readings show so

A gyroscope beyond WILD times its range and an accelerometer beyond accel_range read nonsense. They count as missing;
the readings used last, or the low-passed accelerometer, stand in their place.

A rate is the mean over a period where the device integrates, and the value of an instant where it does not. So the
turn from one sample to the next has the rate

    y - kappa (y - y-),   kappa = 1, 0, 1/2, 1/4 for gyro_index 0, 1, 2, 3                     (18)

Where nothing is known of the device 1/4 is half as wrong as the wrong one of the other two.

A largest reading that is reached in a jump and then stays is clipped: a swing that ends by itself slows down first. A
step of m by more than JUMP m, then FLAT_STEPS of less than FLAT m, NEARLY at the largest m so far, is a level; so are
SAME_STEPS without any change, which the noise of a gyroscope that reads does not allow. L comes from two levels that
agree, or from one where gyroscopes usually end: at 125 deg/s times a power of 2.

In a hit, which throws the accelerometer further than HIT from its low-pass, the gyroscope reads anything: no sample
rate resolves it.
"""

from __future__ import annotations

from functools import reduce
from math import radians
from types import SimpleNamespace
from typing import Any

import casadi as ca

from ...blocks.block import Expressions
from ...blocks.signals import State, integer, real
from ...blocks.vocabulary import Status
from ..direction_filter import NO_DIRECTION

WILD = 2.0  # of gyro_range
HIT = 100.0  # m/s2, from the low-passed accelerometer
W_HIT = 100.0  # of the change of a rate in a hit, square, in (3)
SATURATED = 0.95  # of the range
JUMP, FLAT, FLAT_STEPS, NEARLY = 0.03, 0.004, 3, 0.97
JUMPED = 2.0  # state ``flat`` after a jump; one less after one more step, one more for every flat step
SLOWEST = 1.5  # rad/s; no gyroscope clips below
SAME_STEPS = 8.0
AGREE = 0.05  # of two levels
USUAL = tuple(radians(125 * 2**n) for n in range(1, 6))  # rad/s
AT_USUAL = 0.03

PARAMETERS = (
    real(
        "gyro_range",
        "rad/s",
        radians(2000),
        (1e-3, 1e3),
        "Full scale of the gyroscope; more than 95 % count as saturated",
    ),
    real("accel_range", "m/s2", 1000.0, (1, 1e6), "Full scale of the accelerometer; what reads more counts as missing"),
    integer(
        "gyro_index",
        3,
        (0, 3),
        "Gyroscope sample of a turn: 0 previous, 1 current (rates are means), 2 mean (instants), 3 between (unknown)",
    ),
)

STATES = (
    State("gyro_used", (3,)),
    State("accel_used", (3,)),
    State("missing"),
    State("size"),
    State("largest"),
    State("flat"),
    State("same"),
    State("level_size"),
)
SLOW_STATES = (State("kappa"), State("corner"), State("clip"))


def first(u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """STATES and SLOW_STATES after the first sample."""
    before = SimpleNamespace(gyro_used=ca.SX.zeros(3), size=0, accel_lp=ca.DM([0, 0, 1]) * p.g)
    read, _, _ = plausible(before, u, p)
    index = p.gyro_index
    kappa = 1 - (index > 0) * (1 - (index > 1) * (0.5 - 0.25 * (index > 2)))
    return read | dict(largest=0, flat=0, same=0, level_size=0, kappa=kappa, corner=0, clip=p.gyro_range)


def plausible(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> tuple[dict[str, Any], Any, Any]:
    """The first four of STATES, and 1 where the gyroscope is missing, and the accelerometer."""
    size = largest_of(u.gyro)
    no_gyro = ca.logic_or(u.gyro_missing, size > WILD * p.gyro_range)
    no_accel = ca.logic_or(u.accel_missing, ca.sumsqr(u.accel) > p.accel_range**2)
    read = dict(
        gyro_used=ca.if_else(no_gyro, x.gyro_used, u.gyro),
        accel_used=ca.if_else(no_accel, x.accel_lp, u.accel),
        missing=Status.GYRO_MISSING * no_gyro + Status.ACCEL_MISSING * no_accel,
        size=ca.if_else(no_gyro, x.size, size),
    )
    return read, no_gyro, no_accel


def largest_of(vector: Any) -> Any:
    """The largest magnitude of three components. A comparison; fmax would be a call into the C library."""
    a, b, c = ca.vertsplit(ca.fabs(vector))
    return larger(larger(a, b), c)


def change_of_rate(before: SimpleNamespace, x: SimpleNamespace) -> Any:
    """|y - y-|^2 as it counts in (3)."""
    hit = ca.sumsqr(x.accel_used - before.accel_lp) > HIT**2
    return ca.sumsqr(x.gyro_used - before.gyro_used) * (1 + (W_HIT - 1) * hit)


def larger(a: Any, b: Any) -> Any:
    """The larger of two."""
    return ca.if_else(a > b, a, b)


def smaller(a: Any, b: Any) -> Any:
    """The smaller of two."""
    return ca.if_else(a < b, a, b)


def has_vertical(x: SimpleNamespace, p: SimpleNamespace) -> Any:
    """1 where the accelerometer has a direction to start from."""
    return ca.logic_and(ca.sumsqr(x.accel_used) > (NO_DIRECTION * p.g) ** 2, x.missing < Status.ACCEL_MISSING)


def timed(before: SimpleNamespace, x: SimpleNamespace) -> Any:
    """Rate (rad/s) of the turn from the sample before to this one."""
    return x.gyro_used - before.kappa * (x.gyro_used - before.gyro_used)  # (18)


def clipping(before: SimpleNamespace, x: SimpleNamespace) -> tuple[dict[str, Any], Any]:
    """The last four of STATES, and per axis 1 where the gyroscope is saturated."""
    change, largest = ca.fabs(x.size - before.size), larger(before.largest, x.size)
    at_top = ca.logic_and(x.size >= NEARLY * largest, x.size > SLOWEST)
    stays = ca.logic_and(ca.logic_and(change < FLAT * x.size, at_top), before.flat > 0)
    between = ca.if_else(before.flat == JUMPED, JUMPED - 1, 0)  # the step into a level may be a part of one
    flat = ca.if_else(stays, larger(before.flat, JUMPED) + 1, between)
    flat = ca.if_else(change > JUMP * x.size, JUMPED, flat)
    same = ca.if_else(ca.logic_and(change == 0, at_top), before.same + 1, 0)
    level = ca.logic_or(flat == JUMPED + FLAT_STEPS, same == SAME_STEPS)
    states = dict(largest=largest, flat=flat, same=same, level_size=ca.if_else(level, x.size, before.level_size))
    return states, ca.fabs(x.gyro_used) > SATURATED * before.clip


def range_seen(x: SimpleNamespace) -> dict[str, Any]:
    """The last two of SLOW_STATES after a block, and no level."""
    m = x.level_size
    again = ca.fabs(m - x.corner) < AGREE * x.corner
    usual = reduce(ca.logic_or, (ca.fabs(m - known) < AT_USUAL * known for known in USUAL))
    clip = ca.if_else(ca.logic_or(again, usual), ca.fmin(x.clip, m / NEARLY), x.clip)
    return dict(clip=clip, corner=ca.if_else(m > 0, m, x.corner), level_size=0)
