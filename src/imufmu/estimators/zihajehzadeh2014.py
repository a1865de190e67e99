"""Cascade of two Kalman filters: tilt from gyroscope and accelerometer, then yaw with the magnetometer [1].

    paper             here                    unit   meaning
    x1+, P1           x.x1, x.P1              1      up vector in S, row 3 of R_NS, and its covariance
    a+                x.a                     m/s2   external acceleration in S
    x2+, P2           x.x2, x.P2              1      direction of East in S, row 1 of R_NS, and its covariance
    gamma, beta       roll, pitch             rad    gamma_m and beta_m of (23) to (25) too
    alpha, alpha_m    yaw, alpha_m            rad    filtered, and from one magnetometer sample
    theta_dip, t = 0  dip, x.dip0             rad    angle between up vector and field, and where it started
    h                 p.h                     uT     norm of the local field
    eps_M, eps_dip    p.eps_m, p.eps_dip      uT, rad
    sigma_M^2         p.sigma_m2              1      variance of each element of z2

Both are filters of a direction as in direction_filter, with C1 = g I and C2 = I: (5) to (16) are (12) to (29) there;
(18), (20) and (27) are (24), (12) and (15).

The yaw filter measures x2, h = 1, by z2: the direction of East of a sensor with roll gamma and pitch beta from the tilt
filter, whose field, levelled, points to where m_ref points. It counts while norm and dip of the field are undisturbed:

    t = Ry(beta) Rx(gamma) y_M                                                               (23), (24)
    alpha_m = atan2(t_x m_y - t_y m_x, t_x m_x + t_y m_y),   m = m_ref
    z2_x = cos beta cos alpha_m,   z2_y = sin gamma sin beta cos alpha_m - cos gamma sin alpha_m
    z2_z = cos gamma sin beta cos alpha_m + sin gamma sin alpha_m                            (25)
    abs(|y_M| - h) < eps_M,   abs(theta_dip - theta_dip,0) < eps_dip                         (26)
    alpha = atan2(-cos gamma x2_y + sin gamma x2_z, x2_x / cos beta)                         (28)

Differences from the paper: (25) has the plus that the print lost; z2 is row 1 of (2). (26) compares the norm of y_M
with h and takes the dip from x1+(k); its infinity is no update at all. Q uses x(k-1) as in (15) and (27), unlike (8)
and (21). x2 is normalised like x1. Arctangents have two arguments. (28) divides by cos(beta); within 0.6 deg of a
sensor x axis that points straight up or down x2 counts as perpendicular to x1 instead, which gives the same where it
is. A missing sample is predicted over. The first usable accelerometer sample starts the tilt filter, the
first usable magnetometer sample from there on the yaw filter; yaw is 0 at the start of the tilt filter until then.

The hole in (26): a horizontal disturbance that turns the horizontal part of the field and keeps its length passes,
whatever the angle. One square to the field of d times its norm changes the norm by d^2 / 2 and the dip by
tan(dip) d^2 / 2, but the heading by atan(d / cos(dip)): at 70.5 deg dip the paper's thresholds let d = 0.14 and 23 deg
pass. ``yaw_agrees`` closes the hole where asked to; it is not in the paper.

[1] Zihajehzadeh, Loh, Lee, Hoskinson, Park, A Cascaded Two-Step Kalman Filter for Estimation of Human Body Segment
    Orientation Using MEMS-IMU, EMBC 2014, doi:10.1109/EMBC.2014.6945062
"""

from __future__ import annotations

from math import pi, radians
from types import SimpleNamespace
from typing import Any

import casadi as ca

from ..blocks import vocabulary as v
from ..blocks.block import Expressions, SampledBlock
from ..blocks.rotations import angle_between, angle_of, matrix_from_euler, quaternion_from_euler, roll_pitch, unit
from ..blocks.signals import Signal, State, real, switch
from .direction_filter import (
    ACCEL_VARIANCE,
    GRAVITY,
    GYRO_INDEX,
    GYRO_VARIANCE,
    LARGEST_LENGTH,
    LARGEST_TRACE,
    MODEL_ERROR,
    NO_DIRECTION,
    first_acceleration,
    first_vertical,
    has_vertical,
    normalised,
    predict,
    rate,
    tilt_std,
    update,
    vertical_step,
)

NEAR_VERTICAL = 0.01  # cos(beta) below which (28) magnifies the part of x2 along x1 more than 100 times


def initial(u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """Both filters from the first samples."""
    started, x1 = has_vertical(u, p), first_vertical(u, p)
    return dict(
        x1=x1,
        a=first_acceleration(x1, started, u, p),
        P1=p.P10 * ca.SX.eye(3),
        started=started,
        **first_heading(x1, started, u, p),
    )


def first_heading(x1: Any, started: Any, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """State of the yaw filter from this magnetometer sample; yaw 0 where it has no direction or nothing is upright."""
    found = ca.logic_and(started, has_field(u, p))
    roll, pitch = roll_pitch(x1)
    return dict(
        x2=matrix_from_euler(roll, pitch, ca.if_else(found, measured_yaw(roll, pitch, u, p), 0))[0, :].T,
        P2=p.P20 * ca.SX.eye(3),
        dip0=ca.if_else(p.dip_of_m_ref, angle_between(ca.DM([0, 0, 1]), p.m_ref), angle_between(x1, u.mag)),
        mag_ok=found,
        yaw_innovation=0,
        slack=0,
        heading_started=found,
    )


def has_field(u: SimpleNamespace, p: SimpleNamespace) -> Any:
    """1 where the magnetometer sample has a direction."""
    return ca.logic_and(ca.norm_2(u.mag) > NO_DIRECTION * p.h, 1 - u.mag_missing)


def measured_yaw(roll: Any, pitch: Any, u: SimpleNamespace, p: SimpleNamespace) -> Any:
    """alpha_m: angle from the horizontal part of the tilt-compensated field to that of the Earth's field."""
    tilt_y_M = matrix_from_euler(roll, pitch, 0) @ u.mag  # (23), (24)
    (t_x, t_y, _), (m_x, m_y, _) = ca.vertsplit(tilt_y_M), ca.vertsplit(p.m_ref)
    return angle_of(t_x * m_y - t_y * m_x, t_x * m_x + t_y * m_y)


def yaw_of(x2: Any, roll: Any, pitch: Any) -> Any:
    """Yaw of the sensor whose roll, pitch and direction of East are these."""
    x, y, z = ca.vertsplit(x2)
    upright = ca.cos(pitch) * x + ca.sin(pitch) * (ca.sin(roll) * y + ca.cos(roll) * z)
    cos_yaw = ca.if_else(ca.cos(pitch) > NEAR_VERTICAL, x / ca.cos(pitch), upright)
    return angle_of(-ca.cos(roll) * y + ca.sin(roll) * z, cos_yaw)  # (28)


def field_agrees(x1: Any, dip0: Any, u: SimpleNamespace, p: SimpleNamespace) -> Any:
    """1 where norm and dip of the measured field are those of the undisturbed one."""
    norm = ca.fabs(ca.norm_2(u.mag) - p.h) < p.eps_m
    dip = ca.fabs(angle_between(x1, u.mag) - dip0) < p.eps_dip
    return ca.logic_and(norm, dip)  # (26)


def yaw_agrees(yaw_innovation: Any, slack: Any, p: SimpleNamespace) -> Any:
    """1 where the measured yaw is the predicted one as far as the gyroscope can tell.

    slack: rad, grows by yaw_drift while no sample counts and shrinks as fast while they do. So the test lets go of a
    wrong heading, and the filter has the time to leave it.
    """
    return ca.fabs(yaw_innovation) <= p.eps_yaw + slack


def heading_step(x: SimpleNamespace, x1: Any, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """State of the yaw filter one sample on, x1 the up vector of this sample."""
    roll, pitch = roll_pitch(x1)
    alpha_m = measured_yaw(roll, pitch, u, p)
    x2, P2 = predict(x.x2, x.P2, rate(u, p), p)  # (18), (20), (27)

    difference = alpha_m - yaw_of(x2, roll, pitch)
    yaw_innovation = angle_of(ca.sin(difference), ca.cos(difference))
    agrees = ca.logic_and(field_agrees(x1, x.dip0, u, p), yaw_agrees(yaw_innovation, x.slack, p))
    mag_ok = ca.logic_and(has_field(u, p), agrees)
    slack = x.slack + ca.if_else(mag_ok, -1, 1) * p.yaw_drift * p.sample_period

    z2 = matrix_from_euler(roll, pitch, alpha_m)[0, :].T  # (25)
    x2, P2, _ = update(x2, P2, z2, p.sigma_m2, 1, mag_ok)  # (19), (22)
    return dict(
        x2=normalised(x2, p.normalise2),
        P2=P2,
        dip0=x.dip0,
        mag_ok=mag_ok,
        yaw_innovation=ca.if_else(u.mag_missing, 0, yaw_innovation),
        slack=ca.fmin(ca.fmax(slack, 0), pi),
        heading_started=x.heading_started,
    )


def step(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """One sample: tilt first, then yaw, which never acts back on it."""
    accepted = 1 - u.accel_missing
    x1, a, P1, _ = vertical_step(x.x1, x.a, x.P1, u, p, c_a=p.c_a, accepted=accepted, normalise=p.normalise1)
    tilt = dict(x1=x1, a=a, P1=P1, started=1)
    fresh = initial(u, p)
    tilt = {name: ca.if_else(x.started, value, fresh[name]) for name, value in tilt.items()}

    heading = heading_step(x, tilt["x1"], u, p)
    fresh = first_heading(tilt["x1"], tilt["started"], u, p)
    begins = ca.logic_and(fresh["heading_started"], ca.logic_not(x.heading_started))
    goes_on = ca.logic_and(x.started, ca.logic_not(begins))
    return tilt | {name: ca.if_else(goes_on, value, fresh[name]) for name, value in heading.items()}


def output(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """Outputs of one sample."""
    roll, pitch = roll_pitch(x.x1)  # (17)
    yaw = yaw_of(x.x2, roll, pitch)
    heading = pi / 2 - yaw
    vertical = unit(x.x1)
    return dict(
        roll=roll,
        pitch=pitch,
        yaw=yaw,
        heading=ca.if_else(heading < 0, heading + 2 * pi, heading),
        q_NS=quaternion_from_euler(roll, pitch, yaw),
        vertical=vertical,
        external_acceleration=x.a,
        tilt_std=tilt_std(vertical, x.P1, p),
        status=v.Status.GYRO_MISSING * u.gyro_missing
        + v.Status.ACCEL_MISSING * u.accel_missing
        + v.Status.MAG_MISSING * u.mag_missing
        + v.Status.MAG_REJECTED * x.started * ca.logic_and(1 - u.mag_missing, ca.logic_not(x.mag_ok))
        + v.Status.NOT_INITIALISED * (1 - x.started),
        x2=x.x2,
        alpha_m=measured_yaw(roll, pitch, u, p),
        dip=angle_between(x.x1, u.mag),
        mag_ok=x.mag_ok,
        yaw_innovation=x.yaw_innovation,
        P1=x.P1,
        P2=x.P2,
    )


BLOCK = SampledBlock(
    name="zihajehzadeh2014",
    summary="Attitude with heading from a 9-axis IMU: tilt filter, then yaw filter (Zihajehzadeh et al. 2014)",
    doc="""Estimates roll, pitch and external acceleration as mode 1 of lee2012 does, and yaw from gyroscope and
magnetometer. Whatever the magnetometer reads, tilt and acceleration stay the same to the last bit. Yaw counts from East
towards North; heading is the compass course of the sensor's x axis, clockwise from North, so heading = 90 deg - yaw.
North is where m_ref says: with the local declination in it, geographic North. The field comes in uT or normalised:
mag, m_ref, h and eps_m share the unit, the defaults are for mid-Europe in uT.
A sample whose field differs from h by eps_m or more in norm, or by eps_dip or more in dip from the first sample, does
not count (status 16); yaw then coasts on the gyroscope and drifts by its bias. The first sample is taken on trust, so
start at rest; if the sensor moves then, set dip_of_m_ref, or a wrong dip locks the magnetometer out for good.
This test has a hole: a horizontal disturbance that turns the field and keeps its norm and dip passes. Square to the
field it passes up to 0.14 of the field at 70 deg dip, which turns the heading by 23 deg. To close it set eps_yaw, the
largest yaw_innovation of undisturbed motion: 0.1 rad for calm, 0.2 rad for vigorous motion. A sample that differs more
from the gyroscope's heading does not count either. While no sample counts the limit widens by yaw_drift, which should
exceed the gyroscope's bias; so a disturbance that stays, or one that turns the field as slowly, still passes.
Without magnetometer (not connected: status 16) yaw counts from the start and drifts. An error of tilt becomes one of
yaw, times tan(dip).""",
    reference="S. Zihajehzadeh, D. Loh, M. Lee, R. Hoskinson, E. J. Park, EMBC 2014, doi:10.1109/EMBC.2014.6945062",
    when="""Use it for the orientation of a body segment or a tool with a magnetometer, in a place whose field is
known and disturbed now and then, and where a disturbance must never reach the tilt.
Instead: plumb, which needs no field of the place, finds the bias of the gyroscope and keeps the same promise about
the tilt; lee2012 in mode 1 for the tilt alone, which is the same.""",
    inputs=(v.GYRO, v.ACCEL, v.MAG),
    outputs=(
        v.ROLL,
        v.PITCH,
        v.YAW,
        Signal("heading", "rad", "Direction of the sensor's x axis, clockwise from North: pi/2 - yaw", 0, 2 * pi),
        v.Q_NS,
        v.VERTICAL,
        v.EXTERNAL_ACCELERATION,
        v.TILT_STD,
        v.STATUS,
    ),
    locals=(
        Signal("x2", "1", "Direction of East in S: row 1 of R_NS", -LARGEST_LENGTH, LARGEST_LENGTH, (3,)),
        Signal("alpha_m", "rad", "Yaw by this magnetometer sample alone", -pi, pi),
        Signal("dip", "rad", "Angle between vertical and measured field; 90 deg more than the dip angle", 0, pi),
        Signal("mag_ok", "1", "1 this magnetometer sample counts, 0 it is missing or taken for disturbed", 0, 1),
        Signal("yaw_innovation", "rad", "alpha_m minus yaw predicted by the gyroscope", -pi, pi, nominal=0.1),
        Signal("P1", "1", "Covariance of the vertical", -LARGEST_TRACE, LARGEST_TRACE, (3, 3), nominal=1e-4),
        Signal("P2", "1", "Covariance of the direction of East", -LARGEST_TRACE, LARGEST_TRACE, (3, 3), nominal=1e-4),
    ),
    own_parameters=(
        real("c_a", "1", 0.3, (0, 1), "Part of the external acceleration kept to the next sample", tunable=True),
        GYRO_VARIANCE,
        ACCEL_VARIANCE,
        MODEL_ERROR,
        real(
            "sigma_m2",
            "1",
            1e-4,
            (1e-9, 1e3),
            "Variance of a measured direction of East; larger trusts the magnetometer less",
            tunable=True,
        ),
        GRAVITY,
        real(
            "m_ref",
            "uT",
            v.MID_EUROPE,
            (-v.MAG.maximum, v.MAG.maximum),
            "Local field East, North, Up, of any length",
            shape=(3,),
        ),
        real("h", "uT", 49.2, (1e-3, v.MAG.maximum), "Norm of the local field", tunable=True),
        real("eps_m", "uT", 0.5, (0, 1e6), "Deviation of the norm that means disturbed", tunable=True),
        real("eps_dip", "rad", radians(2), (0, pi), "Change of the dip that means disturbed", tunable=True),
        real("eps_yaw", "rad", pi, (0, pi), "Largest undisturbed yaw_innovation; pi any, the paper", tunable=True),
        real(
            "yaw_drift",
            "rad/s",
            0.005,
            (0, 10),
            "Growth of eps_yaw while no sample counts; exceeds the gyroscope's bias",
            tunable=True,
        ),
        switch(
            "dip_of_m_ref", "Dip of the undisturbed field: 0 that of the first sample, as in the paper, 1 that of m_ref"
        ),
        switch("normalise1", "1 normalise the vertical after each sample", start=True),
        switch("normalise2", "1 normalise the direction of East after each sample", start=True),
        GYRO_INDEX,
        real("P10", "1", 1.0, (0, 1e5), "Variance of the vertical at the start, each axis"),
        real("P20", "1", 1.0, (0, 1e5), "Variance of the direction of East at the start, each axis"),
    ),
    state=(
        State("x1", (3,)),
        State("a", (3,)),
        State("P1", (3, 3)),
        State("started"),
        State("x2", (3,)),
        State("P2", (3, 3)),
        State("dip0"),
        State("mag_ok"),
        State("yaw_innovation"),
        State("slack"),
        State("heading_started"),
    ),
    initial=initial,
    step=step,
    output=output,
)
