"""Attitude from the assumption that velocity is white noise: an error-state Kalman filter.

Over a moment, a tilt and an acceleration look alike to an accelerometer. In the long run they do not: gravity lasts,
while the velocity of a hand, a limb or a tool stays near zero. Rizun [1] takes velocity for white noise and derives a
fixed filter. The same model stands here in a Kalman filter that also learns bias, scale and cross-axis errors of the
gyroscope, follows the liveliness of the motion, and uses rest where there is any.

    symbol           here             unit      meaning
    R                x.q              1         attitude, S to N; its yaw is 0 at the start
    v                x.v              m/s       velocity in N
    b, D             x.b, x.D         rad/s, 1  gyroscope bias; scale (diagonal) and cross-axis errors
    psi, dv, db, dD  PSI, V, B, D     ...       errors: R_true = exp([psi]) R, v_true = v + dv, ...
    P                x.P              ...       their covariance, 18 x 18, upper triangle
    V                x.speed2         m2/s2     mean square of v on one axis, low-passed
    y_g, y_a         u.gyro, u.accel  rad/s, m/s2

Every sample, of period dt, with e_z the up vector in N and dD row by row:

    w = (I + D) (y_g - b),   R+ = R exp([w] dt),   Rbar = (R + R+) / 2                         (1)
    dV += R+ y_a dt,   T += dt,   S += Rbar dt,   theta += w dt                                (2)
    blind += dt on every axis whose gyroscope is saturated                                     (3)

After m = round(h / dt) samples, a block of H = m dt, the slow step. Prediction:

    v += dV - g e_z T                                                                          (4)
    psi' = psi - S db + S dD theta / H,   dv' = dv - [dV] psi                                  (5)
    Q = diag(s_g^2 H I + R W R',  s_a^2 H I + s_m^2 (H - T) I,  s_b^2 H I,  0),
        W = k_g^2 theta theta' / H + s_s^2 diag(blind)                                         (6)

then measurements, one element after the other, and their results:

    in motion   v = 0 with variance s_v^2 q / H,   q = sqrt(max(V, v2^2)) / k_v                (7)
    at rest     v = 0 with variance rr_v^2 / H,    b = low-passed y_g with rr_g^2 / H          (8)
    R <- exp([psi]) R,   v += dv,   b += db,   D += dD,   t_l dV/dt = |v|^2 / 3 - V            (9)

(5) is R' = R [w] and v' = R y_a - g e_z, true minus estimated, to first order; dD and the noise of (6) see the mean
rate of the block, for its change within 0.05 s makes no difference to what is learnt. (7) is white velocity of density
s_v^2 q ((m/s)^2/Hz), averaged over H. Motion within a reach L takes L / |v|, so its density goes with |v| L:
s_v^2 / k_v = 0.18 m is that reach. k_g leaves room for errors that grow with the rate and that D cannot hold, such as
those of timing. It is rest after rr_t of |y_g - low-pass| < rr_dg, |y_a - low-pass| < rr_da and, on each axis, a
low-passed gyroscope below rr_b; the low-pass has the time constant rr_l.

A gyroscope sample that is not finite is held and counts as saturated on every axis. An accelerometer sample that is not
finite leaves dV and T as they are. Variances of psi and b stop at 1 (rad, rad/s): yaw is never observed.
At the start P0 lets the filter begin in the middle of a motion; from rest it is at home at once.

[1] Rizun, Optimal Wiener Filter for a Body Mounted Inertial Attitude Sensor, Journal of Navigation 61, 2008,
    doi:10.1017/S0373463308004736
"""

from __future__ import annotations

from functools import reduce
from math import radians
from types import SimpleNamespace
from typing import Any

import casadi as ca

from .. import vocabulary as v
from ..block import Expressions, SampledBlock
from ..rotations import (
    euler_from_quaternion,
    matrix_from_quaternion,
    multiply,
    quaternion_from_euler,
    quaternion_from_rotation_vector,
    roll_pitch,
    root,
    rotate_back,
    unit,
)
from ..signals import Signal, State, real
from .direction_filter import first_vertical, has_vertical
from .plumb_covariance import N_ERRORS, PSI, B, D, V, full, measure, predicted, upper_triangle

SATURATED = 0.95  # of the gyroscope's range
LARGEST_BIAS = 1.0  # rad/s
LARGEST_GYRO_ERROR = 0.2  # 1, each element of D

UP = ca.DM([0, 0, 1])


def initial(u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """The first sample."""
    std = ca.vertcat(*[p.P0_psi] * 3, *[p.P0_v] * 3, *[p.P0_b] * 3, *[p.P0_D] * 9)
    q = first_attitude(u, p)
    return dict(
        q=q,
        q0=q,
        started=has_vertical(u, p),
        gyro_lp=u.gyro,
        accel_lp=u.accel,
        still_samples=0,
        **empty_block(),
        v=ca.SX.zeros(3),
        b=ca.SX.zeros(3),
        D=ca.SX.zeros(3, 3),
        P=upper_triangle(ca.diag(std**2)),
        speed2=0,
    )


def first_attitude(u: SimpleNamespace, p: SimpleNamespace) -> Any:
    """q_NS of yaw 0 from one accelerometer sample."""
    return quaternion_from_euler(*roll_pitch(first_vertical(u, p)), 0)


def empty_block() -> Expressions:
    """The sums over a block, at its beginning."""
    zero = ca.SX.zeros(3)
    return dict(samples=0, dV=zero, T=0, S=ca.SX.zeros(3, 3), theta=zero, blind=zero)


def step(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """Every further sample: attitude, sums of the block, test for rest."""
    w, dt = rate(x, u), p.sample_period * x.started
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


def rate(x: SimpleNamespace, u: SimpleNamespace) -> Any:
    """w: angular velocity (rad/s) as far as the errors of the gyroscope are known."""
    without_bias = u.gyro - x.b
    return without_bias + x.D @ without_bias  # (1)


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
    )
    still = reduce(ca.logic_and, conditions)
    return dict(gyro_lp=gyro_lp, accel_lp=accel_lp, still_samples=ca.if_else(still, x.still_samples + 1, 0))


def at_rest(x: SimpleNamespace, p: SimpleNamespace) -> Any:
    """1 where the sensor has been still long enough."""
    return x.still_samples * p.sample_period >= p.rr_t


def slow_due(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Any:
    """Which of SLOW_STEPS is due: at the end of a block of m samples, and at the first usable sample."""
    full_block = (x.samples + 0.5) * p.sample_period > p.h
    at_end = ca.if_else(at_rest(x, p), RESTING, MOVING)
    return ca.if_else(x.started, ca.if_else(full_block, at_end, 0), ca.if_else(has_vertical(u, p), BEGINNING, 0))


def begin(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """The first usable sample."""
    q = first_attitude(u, p)
    return dict(q=q, q0=q, started=1)


def end_in_motion(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """The end of a block in motion."""
    v_N, P, H = predicted_block(x, p)
    variance = p.s_v**2 * root(ca.if_else(x.speed2 > p.v2**2, x.speed2, p.v2**2)) / p.k_v / H
    error, P = measure(ca.SX.zeros(N_ERRORS), P, V, ca.vertsplit(-v_N), variance)  # (7)
    return corrected(x, v_N, error, P, H, p)


def end_at_rest(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """The end of a block at rest."""
    v_N, P, H = predicted_block(x, p)
    error, P = measure(ca.SX.zeros(N_ERRORS), P, V, ca.vertsplit(-v_N), p.rr_v**2 / H)  # (8)
    error, P = measure(error, P, B, ca.vertsplit(x.gyro_lp - x.b), p.rr_g**2 / H)  # (8)
    return corrected(x, v_N, error, P, H, p)


def predicted_block(x: SimpleNamespace, p: SimpleNamespace) -> tuple[Any, Any, Any]:
    """Velocity and covariance at the end of a block before its measurements, and its length (s)."""
    H = x.samples * p.sample_period
    S = x.S + (matrix_from_quaternion(x.q0) - matrix_from_quaternion(x.q)) * p.sample_period / 2  # (2)
    return x.v + x.dV - p.g * UP * x.T, predicted(full(x.P), S, x, H, p), H  # (4)


def corrected(x: SimpleNamespace, v_N: Any, error: Any, P: Any, H: Any, p: SimpleNamespace) -> Expressions:
    """State after the measurements of a block."""
    v_N = v_N + error[V]
    q = unit(multiply(quaternion_from_rotation_vector(error[PSI]), x.q))  # (9)
    return dict(
        q=q,
        q0=q,
        v=v_N,
        b=within(x.b + error[B], LARGEST_BIAS),  # (9)
        D=within(x.D + ca.reshape(error[D], 3, 3).T, LARGEST_GYRO_ERROR),  # (9)
        P=upper_triangle(P),
        speed2=x.speed2 + H / (p.t_l + H) * (ca.sumsqr(v_N) / 3 - x.speed2),  # (9)
        **empty_block(),
    )


SLOW_STEPS = (end_in_motion, end_at_rest, begin)
MOVING, RESTING, BEGINNING = 1, 2, 3


def within(values: Any, largest: float) -> Any:
    """Each value within +-largest."""
    return ca.if_else(values > largest, largest, ca.if_else(values < -largest, -largest, values))


def output(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """Outputs of one sample."""
    ahead = unit(ca.vertcat(1, rate(x, u) * p.latency / 2))  # to second order in the turn
    q = multiply(x.q, ahead)
    roll, pitch, yaw = euler_from_quaternion(q)
    tilt_covariance = full(x.P)[:2, :2]
    return dict(
        roll=roll,
        pitch=pitch,
        yaw=yaw,
        q_NS=q,
        vertical=matrix_from_quaternion(q)[2, :].T,
        external_acceleration=ca.if_else(u.accel_missing, 0, u.accel - p.g * rotate_back(x.q, UP)),
        tilt_std=root(ca.trace(tilt_covariance)),
        gyro_bias=x.b,
        stationary=at_rest(x, p),
        velocity_intensity=root(x.speed2),
        status=v.Status.GYRO_MISSING * u.gyro_missing
        + v.Status.ACCEL_MISSING * u.accel_missing
        + v.Status.NOT_INITIALISED * (1 - x.started),
        velocity=x.v,
        gyro_error=x.D,
        tilt_covariance=tilt_covariance,
    )


BLOCK = SampledBlock(
    name="plumb",
    summary="Attitude from a 6-axis IMU for any acceleration: error-state Kalman filter that takes velocity for noise",
    doc="""Estimates roll and pitch, yaw relative to the start, the external acceleration, and the gyroscope's bias,
scale and cross-axis errors. One set of parameters serves hand-held, body-worn and tool-mounted sensors, from slow to
violent motion, with or without rest; only gyro_range and g follow the sensor and the place. tilt_std follows the
motion. Start it at rest if you can: it then knows the attitude at once and the bias within ten seconds. In the middle
of a motion it needs some ten seconds, in a violent motion longer. Do not use it where velocity changes slowly and for
long - a car in a roundabout, an aircraft in a turn, a centrifuge: there velocity is not noise, and the horizon tilts. A
turn slower than rr_b that lasts longer than rr_t is taken for rest, and its rate for bias.
Nothing observes yaw: it drifts.""",
    reference="Model of velocity: T. Rizun, Journal of Navigation 61, 2008, doi:10.1017/S0373463308004736",
    inputs=(v.GYRO, v.ACCEL),
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
    ),
    initial=initial,
    step=step,
    slow_due=slow_due,
    slow_steps=SLOW_STEPS,
    output=output,
    period=0.01,
)
