"""Attitude from the assumption that velocity is noise: an error-state Kalman filter.

Over a moment, a tilt and an acceleration look alike to an accelerometer. In the long run they do not: gravity lasts,
while the velocity of a hand, a limb or a tool stays near zero. Rizun [1] takes velocity for white noise and derives a
fixed filter. The same model stands here in a Kalman filter that also learns bias, scale and cross-axis errors of the
gyroscope, follows the liveliness of the motion, uses rest where there is any, notices a velocity that is no noise, and
looks for the vertical anew where it finds itself wrong.

Its parts, each with its equations:

    readings    what a sample is worth: nonsense, timing, clipping
    rest        what is rest, what is steady travel, and stillness that contradicts the attitude
    start       the vertical while nothing is known
    travel      the velocity in motion: noise, travel, or a wrong attitude
    block_end   the end of a block: prediction, and the measurements of all these
    covariance  prediction of the covariance
    vehicle     the speed of a vehicle's wheels
    heading     the magnetometer

    symbol           here                   unit         meaning
    R                x.q                    1            attitude, S to N; its yaw is 0 at the start
    v                x.v                    m/s          velocity in N
    b, D             x.b, x.D               rad/s, 1     gyroscope bias; scale (diagonal) and cross-axis errors
    psi, dv, db, dD  PSI, V, B, D           ...          errors: R_true = exp([psi]) R, v_true = v + dv, ...
    P                x.P                    ...          their covariance, 18 x 18, upper triangle
    y, a             gyro_used, accel_used  rad/s, m/s2  readings of this sample, y-, a- of the one before (readings)

Every sample, of period dt, with e_z the up vector in N, dD row by row, and y of (18):

    w = (I + D) (y - b),   R+ = R exp([w] dt),   Rbar = (R + R+) / 2                           (1)
    dV += R+ a dt,   T += dt,   S += Rbar dt,   theta += w dt                                  (2)
    blind += dt on every axis whose gyroscope is saturated,
    J += |y - y-|^2 dt^2, W_HIT times that in a hit,   K += |a - a-|^2 dt^2                    (3)

and after m = round(h / dt) samples, a block of H = m dt, the slow step. x.S sums R+ alone; the end of the block makes
it S by the attitudes at both ends. A gyroscope sample that is missing is held and counts as saturated on every axis. An
accelerometer sample that is missing leaves dV and T as they are.

[1] Rizun, Optimal Wiener Filter for a Body Mounted Inertial Attitude Sensor, Journal of Navigation 61, 2008,
    doi:10.1017/S0373463308004736
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import casadi as ca

from ...blocks import vocabulary as v
from ...blocks.block import Expressions, SampledBlock
from ...blocks.rotations import (
    euler_from_quaternion,
    matrix_from_quaternion,
    multiply,
    quaternion_from_rotation_vector,
    rotate_back,
    unit,
)
from ...blocks.signals import Signal, State, real
from . import block_end as block
from . import heading, readings, rest, start, travel, vehicle
from .covariance import N_ERRORS, full, upper_triangle


def initial(u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """The first sample."""
    std = ca.vertcat(*[p.P0_psi] * 3, *[p.P0_v] * 3, *[p.P0_b] * 3, *[p.P0_D] * 9)
    read = readings.first(u, p)
    x = SimpleNamespace(**read)
    state = dict(
        **read,
        started=readings.has_vertical(x, p),
        v=ca.SX.zeros(3),
        b=ca.SX.zeros(3),
        D=ca.SX.zeros(3, 3),
        P=upper_triangle(ca.diag(std**2)),
        **block.first_attitude(x, u, p),
        **rest.first(x.gyro_used, x.accel_used, p),
        **heading.first_sample(u),
        **block.EMPTY,
        **block.UNKNOWN,
        **vehicle.NO_SPEED,
    )
    return state | block.told(SimpleNamespace(**state), p)


def step(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """Every further sample: attitude, sums of the block, test for rest."""
    read, no_gyro, no_accel = readings.plausible(x, u, p)
    now = SimpleNamespace(**read)
    clipping, saturated = readings.clipping(x, now)
    w, dt = block.rate(x, readings.timed(x, now)), p.sample_period * x.started
    q = multiply(x.q, quaternion_from_rotation_vector(w * dt))  # (1)
    R = matrix_from_quaternion(q)
    T = ca.if_else(no_accel, 0, dt)
    return dict(
        **read,
        **clipping,
        **rest.sample(x, now, u, p),
        **heading.sample(x, u, p),
        q=q,
        started=x.started,
        samples=x.samples + x.started,
        dV=x.dV + R @ now.accel_used * T,  # (2)
        S=x.S + R * dt,  # (2)
        theta=x.theta + w * dt,  # (2)
        T=x.T + T,  # (2)
        blind=x.blind + ca.logic_or(saturated, no_gyro) * dt,  # (3)
        jerk=x.jerk + readings.change_of_rate(x, now) * dt**2,  # (3)
        jolt=x.jolt + ca.sumsqr(now.accel_used - x.accel_used) * dt**2,  # (3)
    )


def output(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """Outputs of one sample."""
    # To second order in the turn. Angles do not mind that it is no unit quaternion; they are what takes longest.
    ahead = multiply(x.q, ca.vertcat(1, block.rate(x, x.gyro_used) * p.latency / 2))
    roll, pitch, yaw = euler_from_quaternion(ahead)
    q = unit(ahead)
    tilt_covariance = full(x.P)[:2, :2]
    without_gravity = x.accel_used - p.g * rotate_back(x.q, block.UP)
    return dict(
        roll=roll,
        pitch=pitch,
        yaw=heading.wrapped(yaw + x.offset),
        q_NS=heading.turned(x, q),
        vertical=matrix_from_quaternion(q)[2, :].T,
        external_acceleration=ca.if_else(x.missing < v.Status.ACCEL_MISSING, without_gravity, 0),
        tilt_std=x.tilt_std,
        gyro_bias=x.b,
        stationary=rest.at_rest(x),
        velocity_intensity=x.intensity,
        status=status(x, u),
        velocity=x.v,
        gyro_error=x.D,
        tilt_covariance=tilt_covariance,
        yaw_offset=x.offset,
        yaw_offset_std=heading.offset_std(x),
    )


def status(x: SimpleNamespace, u: SimpleNamespace) -> Any:
    """Flags of this sample."""
    flags = x.missing + v.Status.NOT_INITIALISED * (1 - x.started) + v.Status.LOST * (x.lost > 0)
    return flags + heading.status(x, u)


BLOCK = SampledBlock(
    name="plumb",
    summary="Attitude from a 6- or 9-axis IMU for any acceleration: a Kalman filter that takes velocity for noise",
    doc="""Estimates roll and pitch, yaw, the external acceleration, and the gyroscope's bias, scale and cross-axis
errors. One set of parameters serves hand-held, body-worn and tool-mounted sensors and vehicles, from slow to violent
motion, with or without rest, started anywhere. Only gyro_index, the ranges and g follow the sensor and the place.
gyro_index: 1 for a device that integrates its rates between samples, 2 where they are the values of instants; 3, the
default, where that is unknown. The wrong one of 1 and 2 costs most at low sample rates.
tilt_std follows the motion and grows where physics gives no answer. status 128 says that the filter found its attitude
wrong - samples were lost, a gyroscope clipped, a hit - and looks for the vertical anew. Clipping is noticed from the
readings; a gyro_range that is known is better.
Start it at rest if you can: it then knows the attitude in a third of a second and the bias within seconds. In the
middle of a motion it needs some ten seconds for two degrees.
Vehicles: after a moment of rest it tells travel from noise, and cornering and braking tilt the horizon by a degree or
so. Started on the road it tilts by some degrees in long bends until the first rest. With forward_speed,
forward_speed_valid = 1, mount and imu_position nothing of this tilts it: then what is left is the accelerometer's own
bias. imu_position is best seen from the middle of the rear axle, whose wheels do not steer. A gyroscope with 1 % of
scale error, as consumer devices have, wants P0_D = 0.01 there.
Magnetometer: mag turns yaw to North and changes nothing else, not by a bit; its unit does not matter. A disturbed
field is left out (status 16). Without mag (all zero, or not connected) yaw counts from the start and drifts.
Where it is weak: a vehicle that gathers speed in its first seconds, with no rest before (10 deg for ten seconds). An
acceleration that sets in more gently than 0.1 m/s2 in a second and free of any turn is taken for rest in part, and
becomes tilt. A turn about the vertical slower than rr_b is taken for bias. Aircraft, centrifuges and ships in a long
turn, without forward_speed: velocity changes for minutes on end there. A saturated accelerometer is not noticed.""",
    reference="Model of velocity: P. Rizun, Journal of Navigation 61, 2008, doi:10.1017/S0373463308004736",
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
        *readings.PARAMETERS,
        real(
            "latency", "s", 0.0, (0, 0.2), "Attitude outputs are predicted this far ahead of the sample", tunable=True
        ),
        real("h", "s", 0.05, (1e-6, 10), "Length of a block: time between corrections"),
        real("s_g", "rad/s/sqrt(Hz)", 0.0015, (0, 10), "Noise density of the gyroscope, with vibration"),
        real("k_g", "1/sqrt(Hz)", 3e-4, (0, 1), "Noise density of the gyroscope in proportion to the rate"),
        real("k_j", "1", 0.03, (0, 10), "Error of a turn as a part of the change of the rate within a sample"),
        real("k_a", "1", 0.2, (0, 10), "Error of a velocity as a part of the change of the force within a sample"),
        real("s_s", "rad/s/sqrt(Hz)", 0.2, (0, 100), "Noise density of a gyroscope axis that is saturated or missing"),
        real(
            "s_b", "rad/s2/sqrt(Hz)", 1.4e-4, (0, 1), "Random walk of the gyroscope bias; larger follows warm-up faster"
        ),
        real(
            "s_a",
            "m/s2/sqrt(Hz)",
            0.05,
            (1e-3, 100),
            "Noise density of the accelerometer; below 0.01 the filter trusts itself too much",
        ),
        real("s_m", "m/s2/sqrt(Hz)", 1.0, (0, 1e3), "Density of the acceleration while the accelerometer is missing"),
        real("rr_v", "m/s/sqrt(Hz)", 0.003, (1e-6, 1e3), "Density of the velocity at rest"),
        real(
            "rr_g",
            "rad/s/sqrt(Hz)",
            0.0007,
            (1e-6, 1e3),
            "Density of the low-passed gyroscope at rest, as a measurement of its bias",
        ),
        *rest.PARAMETERS,
        real("P0_psi", "rad", 0.2, (0, 1), "Standard deviation of the attitude that means lost; of yaw at the start"),
        real("P0_v", "m/s", 0.5, (0, 1e3), "Standard deviation of the velocity at the start, each axis"),
        real("P0_b", "rad/s", 0.003, (0, 1), "Standard deviation of the gyroscope bias at the start, each axis"),
        real(
            "P0_raw", "rad/s", 0.01, (0, 1), "The same at the first rest: what a device may have that is not calibrated"
        ),
        real("P0_D", "1", 0.0025, (0, 0.1), "Standard deviation of the scale and cross-axis errors"),
        *travel.PARAMETERS,
        *vehicle.PARAMETERS,
        *heading.PARAMETERS,
    ),
    state=(
        *readings.STATES,
        *rest.FAST_STATES,
        *heading.FAST_STATES,
        State("q", (4,)),
        State("started"),
        State("samples"),
        State("dV", (3,)),
        State("S", (3, 3)),
        State("theta", (3,)),
        State("T"),
        State("blind", (3,)),
        State("jerk"),
        State("jolt"),
        # Only the slow steps change these.
        State("q0", (4,)),
        *readings.SLOW_STATES,
        State("v", (3,)),
        State("b", (3,)),
        State("D", (3, 3)),
        State("P", (N_ERRORS * (N_ERRORS + 1) // 2,)),
        *start.STATES,
        *rest.STATES,
        *block.STATES,
        *vehicle.STATES,
        *heading.STATES,
    ),
    initial=initial,
    step=step,
    slow_due=block.slow_due,
    slow_steps=block.steps(),
    output=output,
    period=0.01,
)
