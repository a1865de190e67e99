"""Attitude from the assumption that velocity is white noise: an error-state Kalman filter.

Over a moment, a tilt and an acceleration look alike to an accelerometer. In the long run they do not: gravity lasts,
while the velocity of a hand, a limb or a tool stays near zero. Rizun [1] takes velocity for white noise and derives a
fixed filter. The same model stands here in a Kalman filter that also learns bias, scale and cross-axis errors of the
gyroscope, follows the liveliness of the motion, uses rest where there is any, and notices a velocity that is no noise.

Its parts, each with its equations:

    block_end   the end of a block: velocity as noise, lasting velocity, rest
    covariance  prediction of the covariance
    vehicle     the speed of a vehicle's wheels
    heading     the magnetometer

    symbol           here             unit      meaning
    R                x.q              1         attitude, S to N; its yaw is 0 at the start
    v                x.v              m/s       velocity in N
    b, D             x.b, x.D         rad/s, 1  gyroscope bias; scale (diagonal) and cross-axis errors
    psi, dv, db, dD  PSI, V, B, D     ...       errors: R_true = exp([psi]) R, v_true = v + dv, ...
    P                x.P              ...       their covariance, 18 x 18, upper triangle
    y_g, y_a         u.gyro, u.accel  rad/s, m/s2

Every sample, of period dt, with e_z the up vector in N and dD row by row:

    w = (I + D) (y_g - b),   R+ = R exp([w] dt),   Rbar = (R + R+) / 2                         (1)
    dV += R+ y_a dt,   T += dt,   S += Rbar dt,   theta += w dt                                (2)
    blind += dt on every axis whose gyroscope is saturated                                     (3)

and after m = round(h / dt) samples, a block of H = m dt, the slow step. x.S sums R+ alone; the end of the block makes
it S by the attitudes at both ends.

It is still while |y_g - low-pass| < rr_dg, |y_a - low-pass| < rr_da and, on each axis, the low-passed gyroscope is
below rr_b; the low-pass has the time constant rr_l. A gyroscope sample that is not finite is held and counts as
saturated on every axis. An accelerometer sample that is not finite leaves dV and T as they are. At the start P0 lets
the filter begin in the middle of a motion; from rest it is at home at once.

[1] Rizun, Optimal Wiener Filter for a Body Mounted Inertial Attitude Sensor, Journal of Navigation 61, 2008,
    doi:10.1017/S0373463308004736
"""

from __future__ import annotations

from functools import reduce
from math import radians
from types import SimpleNamespace

import casadi as ca

from ...blocks import vocabulary as v
from ...blocks.block import Expressions, SampledBlock
from ...blocks.rotations import (
    euler_from_quaternion,
    matrix_from_quaternion,
    multiply,
    quaternion_from_rotation_vector,
    root,
    rotate_back,
    unit,
)
from ...blocks.signals import Signal, State, real
from ..direction_filter import has_vertical
from . import block_end as block
from . import heading, vehicle
from .covariance import N_ERRORS, full, upper_triangle

SATURATED = 0.95  # of the gyroscope's range


def initial(u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """The first sample."""
    std = ca.vertcat(*[p.P0_psi] * 3, *[p.P0_v] * 3, *[p.P0_b] * 3, *[p.P0_D] * 9)
    q = block.first_attitude(u, p)
    return dict(
        q=q,
        q0=q,
        started=has_vertical(u, p),
        gyro_lp=u.gyro,
        accel_lp=u.accel,
        still_samples=0,
        **block.EMPTY,
        v=ca.SX.zeros(3),
        b=ca.SX.zeros(3),
        D=ca.SX.zeros(3, 3),
        P=upper_triangle(ca.diag(std**2)),
        speed2=0,
        **block.NEVER_AT_REST,
        **vehicle.NO_SPEED,
        **heading.first_heading(q, has_vertical(u, p), u, p),
    )


def step(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """Every further sample: attitude, sums of the block, test for rest."""
    w, dt = block.rate(x, u), p.sample_period * x.started
    q = multiply(x.q, quaternion_from_rotation_vector(w * dt))  # (1)
    R = matrix_from_quaternion(q)
    blind = ca.logic_or(ca.fabs(u.gyro) > SATURATED * p.gyro_range, u.gyro_missing)
    T = ca.if_else(u.accel_missing, 0, dt)
    return dict(
        q=q,
        started=x.started,
        **rest_test(x, u, p),
        samples=x.samples + x.started,
        dV=x.dV + R @ u.accel * T,  # (2)
        S=x.S + R * dt,  # (2)
        theta=x.theta + w * dt,  # (2)
        T=x.T + T,  # (2)
        blind=x.blind + blind * dt,  # (3)
    )


def rest_test(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """Low-passed readings and the number of samples for which the sensor has been still."""
    keep = p.rr_l / (p.rr_l + p.sample_period)
    gyro_lp = u.gyro + keep * (x.gyro_lp - u.gyro)
    accel_lp = u.accel + keep * (x.accel_lp - u.accel)
    conditions = (
        ca.sumsqr(u.gyro - gyro_lp) < p.rr_dg**2,
        ca.sumsqr(u.accel - accel_lp) < p.rr_da**2,
        *ca.vertsplit(ca.fabs(gyro_lp) < p.rr_b),
        ca.logic_not(u.gyro_missing),
        ca.logic_not(u.accel_missing),
        ca.logic_not(vehicle.wheels_turn(u)),
    )
    still = reduce(ca.logic_and, conditions)
    return dict(gyro_lp=gyro_lp, accel_lp=accel_lp, still_samples=ca.if_else(still, x.still_samples + 1, 0))


def output(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """Outputs of one sample."""
    # To second order in the turn. Angles do not mind that it is no unit quaternion; they are what takes longest.
    ahead = multiply(x.q, ca.vertcat(1, block.rate(x, u) * p.latency / 2))
    roll, pitch, yaw = euler_from_quaternion(ahead)
    q = unit(ahead)
    tilt_covariance = full(x.P)[:2, :2]
    return dict(
        roll=roll,
        pitch=pitch,
        yaw=heading.wrapped(yaw + x.offset),
        q_NS=heading.turned(x, q),
        vertical=matrix_from_quaternion(q)[2, :].T,
        external_acceleration=ca.if_else(u.accel_missing, 0, u.accel - p.g * rotate_back(x.q, block.UP)),
        tilt_std=root(ca.trace(tilt_covariance)),
        gyro_bias=x.b,
        stationary=block.at_rest(x, p),
        velocity_intensity=root(x.speed2),
        status=v.Status.GYRO_MISSING * u.gyro_missing
        + v.Status.ACCEL_MISSING * u.accel_missing
        + v.Status.NOT_INITIALISED * (1 - x.started)
        + heading.status(x, u),
        velocity=x.v,
        gyro_error=x.D,
        tilt_covariance=tilt_covariance,
        yaw_offset=x.offset,
        yaw_offset_std=heading.offset_std(x),
    )


BLOCK = SampledBlock(
    name="plumb",
    summary="Attitude from a 6- or 9-axis IMU for any acceleration: a Kalman filter that takes velocity for noise",
    doc="""Estimates roll and pitch, yaw, the external acceleration, and the gyroscope's bias, scale and cross-axis
errors. One set of parameters serves hand-held, body-worn and tool-mounted sensors, from slow to violent motion, with
or without rest; only gyro_range and g follow the sensor and the place. tilt_std follows the motion.
Start it at rest if you can: it then knows the attitude at once and the bias within ten seconds. In the middle of a
motion it needs some ten seconds, in a violent motion longer.
Vehicles: after half a second of rest it tells travel from noise, and cornering and braking tilt the horizon by a few
degrees only, as long as the gyroscope carries it. With forward_speed, forward_speed_valid = 1, mount and imu_position
they do not tilt it: then what is left is the accelerometer's own bias. imu_position is best seen from the middle of
the rear axle, whose wheels do not steer. A gyroscope with 1 % of scale error, as consumer devices have, wants P0_D =
0.01 there.
Magnetometer: mag turns yaw to North and changes nothing else, not by a bit; its unit does not matter. A disturbed
field is left out (status 16). Without mag (all zero, or not connected) yaw counts from the start and drifts.
Do not use it without forward_speed where velocity changes for minutes on end - an aircraft in a turn, a centrifuge -
nor where it starts in the middle of such a motion: there velocity is no noise, and the horizon tilts. Do not use it
on a turntable: a turn slower than rr_b that lasts longer than rr_t is taken for rest, and its rate for bias. So is an
acceleration that sets in gently and free of any turn, as in a lift or a train: it becomes tilt. A saturated
accelerometer is not noticed.""",
    reference="Model of velocity: T. Rizun, Journal of Navigation 61, 2008, doi:10.1017/S0373463308004736",
    when="""Use it first: it needs no tuning, finds the bias of the gyroscope, and tells by tilt_std how far to trust
it. In a vehicle connect the speed of its wheels.
Instead: rizun2008 where a linear filter with a known frequency response is asked for; lee2012 or leechoi2018 as
references, or where the step must be as small as can be; bennett2014 for two links in a plane.""",
    inputs=(v.GYRO, v.ACCEL, v.MAG, *vehicle.INPUTS),
    outputs=(
        v.ROLL,
        v.PITCH,
        v.YAW,
        v.Q_NS,
        v.VERTICAL,
        v.EXTERNAL_ACCELERATION,
        v.TILT_STD,
        Signal("gyro_bias", "rad/s", "Bias of the gyroscope, sensor frame", -1, 1, (3,), nominal=0.01),
        Signal("stationary", "1", "1 at rest, else 0", 0, 1),
        Signal("velocity_intensity", "m/s", "Root mean square of the velocity on one axis, low-passed", 0, 1e9),
        v.STATUS,
    ),
    locals=(
        Signal("velocity", "m/s", "Velocity in N, as far as it is not taken for noise", -1e9, 1e9, (3,)),
        Signal("gyro_error", "1", "Scale and cross-axis errors of the gyroscope", -1, 1, (3, 3), nominal=1e-3),
        Signal("tilt_covariance", "rad2", "Covariance of the tilt about x and y of N", -2, 2, (2, 2), nominal=1e-4),
        *heading.LOCALS,
    ),
    own_parameters=(
        real("g", "m/s2", 9.81, (1, 100), "Magnitude of gravity at the place of use"),
        real(
            "gyro_range",
            "rad/s",
            radians(2000),
            (1e-3, 1e3),
            "Full scale of the gyroscope; more than 95 % count as saturated",
        ),
        real(
            "latency", "s", 0.0, (0, 0.2), "Attitude outputs are predicted this far ahead of the sample", tunable=True
        ),
        real("h", "s", 0.05, (1e-6, 10), "Length of a block: time between corrections"),
        real("s_g", "rad/s/sqrt(Hz)", 0.0015, (0, 10), "Noise density of the gyroscope, with vibration"),
        real("k_g", "1/sqrt(Hz)", 3e-4, (0, 1), "Noise density of the gyroscope in proportion to the rate"),
        real("s_s", "rad/s/sqrt(Hz)", 0.2, (0, 100), "Noise density of a gyroscope axis that is saturated or missing"),
        real(
            "s_b", "rad/s2/sqrt(Hz)", 2e-4, (0, 1), "Random walk of the gyroscope bias; larger follows warm-up faster"
        ),
        real(
            "s_a",
            "m/s2/sqrt(Hz)",
            0.03,
            (1e-3, 100),
            "Noise density of the accelerometer; below 0.01 the filter trusts itself too much",
        ),
        real("s_m", "m/s2/sqrt(Hz)", 1.0, (0, 1e3), "Density of the acceleration while the accelerometer is missing"),
        real(
            "s_v",
            "m/s/sqrt(Hz)",
            0.3,
            (1e-3, 1e3),
            "Density of the velocity in motion; larger trusts the gyroscope more",
        ),
        real("k_v", "m/s", 0.5, (1e-3, 1e3), "Velocity, root mean square of one axis, at which the density is s_v"),
        real("v2", "m/s", 0.05, (1e-6, 1e3), "Velocity, root mean square of one axis, of the gentlest motion"),
        real("t_l", "s", 3.0, (0, 1e3), "Time constant at which the density follows the motion"),
        real("rr_v", "m/s/sqrt(Hz)", 0.003, (1e-6, 1e3), "Density of the velocity at rest"),
        real(
            "rr_g",
            "rad/s/sqrt(Hz)",
            0.01,
            (1e-6, 1e3),
            "Density of the low-passed gyroscope at rest, as a measurement of its bias",
        ),
        real("rr_l", "s", 0.5, (0, 1e3), "Rest: time constant of the low-pass"),
        real("rr_dg", "rad/s", radians(2.8), (0, 1e3), "Rest: largest distance of the gyroscope from its low-pass"),
        real("rr_da", "m/s2", 0.8, (0, 1e3), "Rest: largest distance of the accelerometer from its low-pass"),
        real("rr_b", "rad/s", radians(2), (0, 1e3), "Rest: largest low-passed gyroscope on each axis"),
        real("rr_t", "s", 0.1, (0, 1e3), "Rest: how long it must last to count"),
        real("P0_psi", "rad", 0.2, (0, 1), "Standard deviation of the attitude at the start, each axis"),
        real("P0_v", "m/s", 0.5, (0, 1e3), "Standard deviation of the velocity at the start, each axis"),
        real("P0_b", "rad/s", 0.01, (0, 1), "Standard deviation of the gyroscope bias at the start, each axis"),
        real("P0_D", "1", 0.0025, (0, 0.1), "Standard deviation of the scale and cross-axis errors"),
        *block.PARAMETERS,
        *vehicle.PARAMETERS,
        *heading.PARAMETERS,
    ),
    state=(
        State("q", (4,)),
        State("started"),
        State("gyro_lp", (3,)),
        State("accel_lp", (3,)),
        State("still_samples"),
        State("samples"),
        State("dV", (3,)),
        State("T"),
        State("S", (3, 3)),
        State("theta", (3,)),
        State("blind", (3,)),
        # Only the slow steps change these.
        State("q0", (4,)),
        State("v", (3,)),
        State("b", (3,)),
        State("D", (3, 3)),
        State("P", (N_ERRORS * (N_ERRORS + 1) // 2,)),
        State("speed2"),
        *block.STATES,
        *vehicle.STATES,
        *heading.STATES,
    ),
    initial=initial,
    step=step,
    slow_due=block.slow_due,
    slow_steps=block.SLOW_STEPS,
    output=output,
    period=0.01,
)
