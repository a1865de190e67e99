"""What a magnetometer tells ``plumb``: where North is. It turns the attitude about the vertical, nothing else.

    symbol   here                     unit        meaning
    delta    x.offset                 rad         true yaw less that of the 6-axis attitude R
    r        x.drift                  rad/s       its rate
    P_d      x.P_heading              ...         covariance of both: (1,1), (1,2), (2,2)
    y_m      x.mag_used               any         the last reading, x.mag_age samples old
    T        x.unread + H             s           time since the last block that had one, LONGEST at most
    f        f                        any         field in N: horizontal and upward part
    f_l      x.field_lp               any         the same, low-passed with t_h
    f_ref    x.field_ref, x.ref_time  any, s      the undisturbed field, and how long it has been learnt
    f_new    x.field_new, x.new_time  any, s      a field that may succeed it, and how long it has lasted

Magnetometers read less often than gyroscopes. Between two readings rows are empty, zero, or repeat the last one: none
of these is a reading. At the end of a block of H seconds, with y_m turned by the rate since it was read:

    delta += r H,   P_d <- F P_d F' + diag(s_d^2, s_r^2) H,   F = [1 H; 0 1]                   (15)
    undisturbed while |f - f_ref| < eps_m |f_ref|                                             (16)
    delta = atan2(east, north) of the field in the frame of R, less the declination,
        with variance (s_h^2 + (k_h |f_l - f_ref| / f_ref horizontal)^2) / T                  (17)

(16) tests norm and dip at once. A disturbance of the size |f - f_ref| turns the heading by up to that over the
horizontal part, hence (17), where the noise of single samples, a twentieth of the horizontal part, is no disturbance:
it would only make the heading slow. f_ref is the mean of the undisturbed fields, over t_m at most. While (16) fails
delta coasts on r, and P_d grows by (15). A field that stays within eps_m of f_new for t_new becomes f_ref, and delta
may be wrong by NEW_PLACE: the sensor was carried elsewhere. What (16) cannot see well is a horizontal disturbance
square to the field: at 66 deg of dip one that turns the heading by 37 deg lengthens the field's horizontal part by no
more than eps_m of the field; (17) then gives it little weight. delta is no state of the 18, so that nothing a
magnetometer reads reaches them.
"""

from __future__ import annotations

from functools import reduce
from math import pi
from types import SimpleNamespace
from typing import Any

import casadi as ca

from ...blocks import vocabulary as v
from ...blocks.block import Expressions
from ...blocks.rotations import angle_of, multiply, norm, quaternion_from_rotation_vector, root, rotate
from ...blocks.signals import Signal, State, real

NEW_PLACE = 0.5  # rad; what delta may be off by where another field is taken for undisturbed
HELD = 0.3  # s; a field that is the same for longer was read again
LONGEST = 1.0  # s that one reading may stand for
NO_FIELD = 1e-9  # in the unit of mag; a field smaller than this is none

PARAMETERS = (
    real("declination", "rad", 0.0, (-pi, pi), "Magnetic North seen from true North, towards East"),
    real("s_h", "rad/sqrt(Hz)", 0.15, (1e-6, 1e3), "Density of the error of a heading by the magnetometer"),
    real("k_h", "1/sqrt(Hz)", 10.0, (0, 1e3), "Growth of that density with the deviation of the field"),
    real("t_h", "s", 0.05, (0, 1e3), "Time constant of the low-passed field that this deviation is of"),
    real("eps_m", "1", 0.07, (0, 10), "Deviation of the field, of its norm, that means disturbed"),
    real("t_m", "s", 20.0, (0, 1e4), "How much of the undisturbed field its mean covers"),
    real("t_new", "s", 20.0, (0, 1e6), "How long another field must last to be taken for undisturbed"),
    real("s_d", "rad/sqrt(s)", 0.04, (0, 10), "Random walk of the yaw by the gyroscope"),
    real("s_r", "rad/s2/sqrt(Hz)", 3e-5, (0, 1), "Random walk of the drift of that yaw"),
    real("P0_r", "rad/s", 0.001, (0, 1), "Standard deviation of that drift at the start"),
)

FAST_STATES = (State("mag_used", (3,)), State("mag_age"))

STATES = (
    State("turn", (2,)),  # cosine and sine of delta / 2
    State("offset"),
    State("drift"),
    State("P_heading", (3,)),
    State("heading_started"),
    State("field_lp", (2,)),
    State("field_ref", (2,)),
    State("ref_time"),
    State("field_new", (2,)),
    State("new_time"),
    State("mag_rejected"),
    State("unread"),
)

LOCALS = (
    Signal("yaw_offset", "rad", "Yaw by the magnetometer less yaw by the gyroscope, filtered", -pi, pi),
    Signal("yaw_offset_std", "rad", "One-sigma error of yaw_offset; pi without magnetometer", 0, 1e9, nominal=0.1),
)


def first_heading(q: Any, started: Any, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """STATES from one sample, delta = 0 where it has no field."""
    field, found = rotate(q, u.mag), ca.logic_and(started, is_there(u))
    return with_turn(begin(ca.if_else(found, field, 0), found, p.sample_period, p))


def is_there(u: SimpleNamespace) -> Any:
    """1 where this sample has a field: all zeros are none."""
    return ca.logic_and(ca.sumsqr(u.mag) > NO_FIELD**2, ca.logic_not(u.mag_missing))


def first_sample(u: SimpleNamespace) -> dict[str, Any]:
    """FAST_STATES after the first sample."""
    return dict(mag_used=u.mag, mag_age=0)


def sample(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> dict[str, Any]:
    """FAST_STATES after a sample."""
    repeated = reduce(ca.logic_and, ca.vertsplit(u.mag == x.mag_used))
    held = ca.logic_and(repeated, x.mag_age * p.sample_period < HELD)
    read = ca.logic_and(is_there(u), ca.logic_not(held))
    return dict(mag_used=ca.if_else(read, u.mag, x.mag_used), mag_age=ca.if_else(read, 0, x.mag_age + 1))


def last_field(x: SimpleNamespace, w: Any, p: SimpleNamespace) -> tuple[Any, Any]:
    """The last field of this block, in the frame of R at its end, and 1 where there was one. w: rate (rad/s), in S."""
    since = quaternion_from_rotation_vector(-w * x.mag_age * p.sample_period)
    there = ca.logic_and(ca.sumsqr(x.mag_used) > NO_FIELD**2, x.mag_age < x.samples)
    return rotate(x.q, rotate(since, x.mag_used)), there


def begin(field: Any, found: Any, T: Any, p: SimpleNamespace) -> Expressions:
    """STATES but ``turn`` by a first field in the frame of R, of T seconds."""
    f = parts(field)
    offset = ca.if_else(found, by_field(field, p), 0)
    return dict(
        offset=offset,
        drift=0,
        P_heading=ca.if_else(found, ca.vertcat(p.s_h**2 / T, 0, p.P0_r**2), ca.SX.zeros(3)),
        heading_started=found,
        field_lp=f,
        field_ref=f,
        ref_time=0,
        field_new=f,
        new_time=0,
        mag_rejected=0,
        unread=0,
    )


def by_field(field: Any, p: SimpleNamespace) -> Any:
    """delta by a field in the frame of R."""
    return wrapped(angle_of(field[0], field[1]) - p.declination)


def parts(field: Any) -> Any:
    """Horizontal and upward part (2,) of a field."""
    return ca.vertcat(norm(field[:2]), field[2])


def with_turn(states: Expressions) -> dict[str, Any]:
    """STATES from all others."""
    half = states["offset"] / 2
    return dict(states, turn=ca.vertcat(ca.cos(half), ca.sin(half)))


def wrapped(angle: Any) -> Any:
    """An angle within (-3 pi, 3 pi] brought into (-pi, pi]."""
    return ca.if_else(angle > pi, angle - 2 * pi, ca.if_else(angle <= -pi, angle + 2 * pi, angle))


def end_block(x: SimpleNamespace, u: SimpleNamespace, w: Any, H: Any, p: SimpleNamespace) -> dict[str, Any]:
    """STATES at the end of a block; w: rate (rad/s), in S."""
    field, present = last_field(x, w, p)
    first, following = begin(field, present, H, p), filtered(field, present, x, H, p)
    return with_turn({name: ca.if_else(x.heading_started, following[name], first[name]) for name in first})


def filtered(field: Any, present: Any, x: SimpleNamespace, H: Any, p: SimpleNamespace) -> Expressions:
    """STATES but ``turn`` one block on."""
    T = ca.fmin(x.unread + H, LONGEST)
    fields, succeeds = fields_after(parts(field), present, x, T, p)
    offset, (P11, P12, P22) = x.offset + H * x.drift, ca.vertsplit(x.P_heading)
    P11 = ca.fmin(P11 + H * (2 * P12 + H * P22) + p.s_d**2 * H, pi**2)  # (15)
    P12, P22 = (P12 + H * P22) * (1 - succeeds), P22 + p.s_r**2 * H  # (15)
    P11 += succeeds * NEW_PLACE**2

    lag = ca.if_else(present, p.t_h / (p.t_h + T), 1)
    field_lp = parts(field) + lag * (x.field_lp - parts(field))
    deviation = norm(field_lp - fields["field_ref"]) / ca.fmax(fields["field_ref"][0], NO_FIELD)
    variance = (p.s_h**2 + (p.k_h * deviation) ** 2) / T  # (17)
    gain = ca.if_else(ca.logic_and(present, ca.logic_not(fields["mag_rejected"])), 1 / (P11 + variance), 0)
    innovation = wrapped(wrapped(by_field(field, p) - offset))
    offset, drift = wrapped(offset + P11 * gain * innovation), x.drift + P12 * gain * innovation
    P = ca.vertcat(P11 - P11**2 * gain, P12 - P11 * P12 * gain, P22 - P12**2 * gain)
    return dict(
        offset=offset,
        drift=drift,
        P_heading=P,
        heading_started=1,
        field_lp=field_lp,
        unread=ca.if_else(present, 0, T),
        **fields,
    )


def fields_after(f: Any, present: Any, x: SimpleNamespace, T: Any, p: SimpleNamespace) -> tuple[dict[str, Any], Any]:
    """What is known of the undisturbed field and its successor after a field of T seconds, and 1 where it succeeds."""

    def near(reference: Any) -> Any:
        return ca.sumsqr(f - reference) < p.eps_m**2 * ca.sumsqr(reference)  # (16)

    def mean(reference: Any, time: Any) -> Any:
        return reference + T / (ca.fmin(time, p.t_m) + T) * (f - reference)

    lasts, undisturbed = near(x.field_new), near(x.field_ref)
    field_new = ca.if_else(lasts, mean(x.field_new, x.new_time), f)
    new_time = ca.if_else(lasts, x.new_time + T, 0)
    succeeds = ca.logic_and(ca.logic_not(undisturbed), new_time >= p.t_new)
    field_ref = ca.if_else(undisturbed, mean(x.field_ref, x.ref_time), ca.if_else(succeeds, field_new, x.field_ref))
    ref_time = ca.if_else(undisturbed, ca.fmin(x.ref_time + T, p.t_m), ca.if_else(succeeds, p.t_m, x.ref_time))
    after = dict(
        field_ref=field_ref,
        ref_time=ref_time,
        field_new=field_new,
        new_time=ca.fmin(new_time, p.t_new + p.t_m),
        mag_rejected=ca.logic_not(ca.logic_or(undisturbed, succeeds)),
    )
    before = {name: getattr(x, name) for name in after} | dict(mag_rejected=0)
    fields = {name: ca.if_else(present, after[name], before[name]) for name in after}
    return fields, ca.logic_and(present, succeeds)


def turned(x: SimpleNamespace, q: Any) -> Any:
    """q_NS with North, of q_NS in the frame of R."""
    return multiply(ca.vertcat(x.turn[0], 0, 0, x.turn[1]), q)


def status(x: SimpleNamespace, u: SimpleNamespace) -> Any:
    """Flags of this sample."""
    return v.Status.MAG_MISSING * u.mag_missing + v.Status.MAG_REJECTED * x.mag_rejected * ca.logic_not(u.mag_missing)


def offset_std(x: SimpleNamespace) -> Any:
    """Standard deviation of delta; pi before there is a heading."""
    return ca.if_else(x.heading_started, root(x.P_heading[0]), pi)
