"""The end of a block of ``plumb``: its slow steps.

    symbol  here       unit     meaning
    V       x.speed2   m2/s2    mean square of v on one axis, low-passed
    v_s     x.lasting  m/s      v, low-passed
    f       x.fresh    1        1 at rest, fades in motion; 0 before the first rest

Prediction over the block, with the sums of (2) and (3):

    v += dV - g e_z T                                                                          (4)
    psi' = psi - S db + S dD theta / H,   dv' = dv - [dV] psi                                  (5)
    Q = diag(s_g^2 H I + R W R',  s_a^2 H I + s_m^2 (H - T) I,  s_b^2 H I,  0),
        W = k_g^2 theta theta' / H + s_s^2 diag(blind)                                         (6)

then measurements, one element after the other, and their results:

    in motion   v = 0 with variance (s_v^2 q + 2 t_v e) / H,   q = sqrt(max(V, v2^2)) / k_v    (7)
                e = max(|v_s|^2 / 3 - 4 (s_v^2 q / (2 t_s) + tr P_v / 3), v_0^2 f)             (8)
    at rest     v = 0 with variance rr_v^2 / H,    b = low-passed y_g with rr_g^2 / H          (9)
    R <- exp([psi]) R,   v += dv,   b += db,   D += dD,
    t_l dV/dt = |v|^2 / 3 - V,   t_s dv_s/dt = v - v_s,   t_0 df/dt = -f in motion            (10)

(5) is R' = R [w] and v' = R y_a - g e_z, true minus estimated, to first order; dD and the noise of (6) see the mean
rate of the block, for its change within 0.05 s makes no difference to what is learnt. (7) is white velocity of density
s_v^2 q ((m/s)^2/Hz), averaged over H. Motion within a reach L takes L / |v|, so its density goes with |v| L:
s_v^2 / k_v = 0.18 m is that reach. k_g leaves room for errors that grow with the rate and that D cannot hold, such as
those of timing.

(8) notices a sensor that travels. Noise of that density, low-passed with t_s, has the variance s_v^2 q / (2 t_s), and
v itself is uncertain by P_v. What exceeds twice the standard deviation of both is no noise; a velocity that lasts for
a time t_v has the density 2 t_v e. Then the gyroscope carries the attitude, and a car that gathers speed does not
tilt the horizon. Until the filter was at rest for rr_s it is not *levelled*, and e is 0: a velocity that grows then
rather means a wrong attitude. The same holds once it is lost, that is, knows the tilt no better than at the start
(P0_psi): v is 0 again, its errors are independent of the others, with P0_v, and it is not levelled. A velocity known
from wheels lasts, too, when they fall silent.

A motion that has just begun may become travel. While f lasts the filter waits and sees: from the rest it knows attitude
and bias, and a velocity taken for noise would spoil both before (8) notices that it lasts. Travel begins then or not at
all: after t_v without rest and without a velocity beyond the noise, the filter is not levelled until the next rest.

It is rest after rr_t of stillness, if the low-passed accelerometer agrees with the attitude within rr_a and three
tilt_std: a sensor that gathers speed steadily is still, too. Before it is levelled, any stillness is rest. To an IMU
rest and steady travel are the same. So if v is more than GATE standard deviations off 0 in the first block of a rest,
it was travel: v is 0 again, its errors are independent of the others, with the variance of (9).

Variances of psi and b stop at 1 (rad, rad/s): yaw is never observed.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import casadi as ca

from ...blocks.block import Expressions
from ...blocks.rotations import (
    matrix_from_quaternion,
    multiply,
    quaternion_from_euler,
    quaternion_from_rotation_vector,
    roll_pitch,
    root,
    rotate_back,
    unit,
)
from ...blocks.signals import State, real
from ..direction_filter import first_vertical, has_vertical
from . import heading, vehicle
from .covariance import N_ERRORS, PSI, B, D, V, forgotten, full, measure, predicted, upper_triangle

LARGEST_BIAS = 1.0  # rad/s
LARGEST_GYRO_ERROR = 0.2  # 1, each element of D
GATE = 3.0  # standard deviations of a velocity at rest

UP = ca.DM([0, 0, 1])

PARAMETERS = (
    real("t_s", "s", 0.3, (1e-3, 1e3), "Travel: time constant of the low-passed velocity that tells it from noise"),
    real("t_v", "s", 10.0, (0, 1e4), "Travel: how long a velocity lasts; 0 takes every velocity for noise"),
    real("v_0", "m/s", 1.0, (0, 1e3), "Travel: what velocity is expected to last in a motion that has just begun"),
    real("t_0", "s", 1.0, (1e-3, 1e3), "Travel: time in which that expectation fades after rest"),
    real("rr_a", "m/s2", 0.3, (0, 1e3), "Rest: largest distance of the low-passed accelerometer from gravity"),
    real("rr_s", "s", 0.5, (0, 1e3), "Rest: how long it must last before the filter believes in travel"),
)

STATES = (State("lasting", (3,)), State("fresh"), State("quiet"), State("level"), State("levelled"), State("resting"))

NEVER_AT_REST: Expressions = dict(lasting=ca.SX.zeros(3), fresh=0, quiet=0, level=1, levelled=0, resting=0)

EMPTY: Expressions = dict(
    samples=0,
    dV=ca.SX.zeros(3),
    T=0,
    S=ca.SX.zeros(3, 3),
    theta=ca.SX.zeros(3),
    blind=ca.SX.zeros(3),
)
MOVING, ROLLING, RESTING, BEGINNING = 1, 2, 3, 4


def slow_due(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Any:
    """Which of SLOW_STEPS is due: at the end of a block of m samples, and at the first usable sample."""
    full_block = (x.samples + 0.5) * p.sample_period > p.h
    at_end = ca.if_else(at_rest(x, p), RESTING, ca.if_else(vehicle.is_valid(u), ROLLING, MOVING))
    return ca.if_else(x.started, ca.if_else(full_block, at_end, 0), ca.if_else(has_vertical(u, p), BEGINNING, 0))


def at_rest(x: SimpleNamespace, p: SimpleNamespace) -> Any:
    """1 where the sensor has been still long enough."""
    return ca.logic_and(x.still_samples * p.sample_period >= p.rr_t, x.level)


def begin(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """The first usable sample."""
    q = first_attitude(u, p)
    return dict(q=q, q0=q, started=1, **heading.first_heading(q, 1, u, p))


def first_attitude(u: SimpleNamespace, p: SimpleNamespace) -> Any:
    """q_NS of yaw 0 from one accelerometer sample."""
    return quaternion_from_euler(*roll_pitch(first_vertical(u, p)), 0)


def rate(x: SimpleNamespace, u: SimpleNamespace) -> Any:
    """w: angular velocity (rad/s) as far as the errors of the gyroscope are known."""
    without_bias = u.gyro - x.b
    return without_bias + x.D @ without_bias  # (1)


def end_in_motion(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """The end of a block in motion."""
    v_N, P, H = predicted_block(x, p)
    known = ca.logic_or(x.levelled, x.rolling)
    lost = ca.logic_and(known, tilt_variance(P) > 2 * p.P0_psi**2)
    v_N, P = ca.if_else(lost, 0, v_N), forgotten(P, lost, p.P0_v**2)
    noise, e, travels = velocity_in_motion(v_N, P, x, H, p)
    density = noise + ca.if_else(ca.logic_and(known, ca.logic_not(lost)), 2 * p.t_v * e, 0)  # (7)
    error, P = measure(ca.SX.zeros(N_ERRORS), P, V, ca.vertsplit(-v_N), density / H)  # (7)
    quiet = ca.if_else(travels, 0, x.quiet + H)
    goes_on = ca.logic_and(ca.logic_not(lost), quiet < p.t_v)
    states = dict(levelled=ca.logic_and(x.levelled, goes_on), rolling=ca.logic_and(x.rolling, goes_on))
    states |= dict(resting=0, quiet=quiet, fresh=x.fresh * p.t_0 / (p.t_0 + H))  # (10)
    return corrected(x, u, v_N, error, P, H, p) | states


def velocity_in_motion(v_N: Any, P: Any, x: SimpleNamespace, H: Any, p: SimpleNamespace) -> tuple[Any, Any, Any]:
    """Density ((m/s)^2/Hz) of velocity that is noise, e of one that lasts, and 1 where v is beyond the noise."""
    noise = p.s_v**2 * root(ca.if_else(x.speed2 > p.v2**2, x.speed2, p.v2**2)) / p.k_v  # (7)
    excess = ca.sumsqr(lasting(v_N, x, H, p)) / 3 - 4 * noise / (2 * p.t_s)
    return noise, ca.fmax(excess - 4 * ca.trace(P[V, V]) / 3, x.fresh * p.v_0**2), excess > 0  # (8)


def lasting(v_N: Any, x: SimpleNamespace, H: Any, p: SimpleNamespace) -> Any:
    """v_s after a block."""
    return x.lasting + H / (p.t_s + H) * (v_N - x.lasting)  # (10)


def end_in_vehicle(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """The end of a block in a vehicle whose wheels tell its speed."""
    v_N, P, H = predicted_block(x, p)
    v_N, error, P, states = vehicle.measured_velocity(v_N, P, rate(x, u), H, x, u, p)
    after = corrected(x, u, v_N, error, P, H, p)
    return after | dict(speed2=x.speed2, lasting=after["v"], resting=0) | states


def end_at_rest(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """The end of a block at rest."""
    v_N, P, H = predicted_block(x, p)
    variance = p.rr_v**2 / H
    surprise = sum(v_N[i] ** 2 / (P[V, V][i, i] + variance) for i in range(3))
    travels = ca.logic_and(ca.logic_not(x.resting), surprise > GATE**2)
    v_N, P = ca.if_else(travels, 0, v_N), forgotten(P, travels, variance)
    error, P = measure(ca.SX.zeros(N_ERRORS), P, V, ca.vertsplit(-v_N), variance)  # (9)
    error, P = measure(error, P, B, ca.vertsplit(x.gyro_lp - x.b), p.rr_g**2 / H)  # (9)
    levelled = ca.logic_or(x.levelled, x.still_samples * p.sample_period >= p.rr_s)
    stands = dict(rolling=vehicle.is_valid(u), disagreed=0, levelled=levelled, resting=1, quiet=0, fresh=1)
    return corrected(x, u, v_N, error, P, H, p) | stands


def predicted_block(x: SimpleNamespace, p: SimpleNamespace) -> tuple[Any, Any, Any]:
    """Velocity and covariance at the end of a block before its measurements, and its length (s)."""
    H = x.samples * p.sample_period
    S = x.S + (matrix_from_quaternion(x.q0) - matrix_from_quaternion(x.q)) * p.sample_period / 2  # (2)
    return x.v + x.dV - p.g * UP * x.T, predicted(full(x.P), S, x, H, p), H  # (4)


def corrected(
    x: SimpleNamespace, u: SimpleNamespace, v_N: Any, error: Any, P: Any, H: Any, p: SimpleNamespace
) -> dict[str, Any]:
    """State after the measurements of a block."""
    v_N = v_N + error[V]
    q = unit(multiply(quaternion_from_rotation_vector(error[PSI]), x.q))  # (10)
    off_level = ca.sumsqr(x.accel_lp - p.g * rotate_back(q, UP))
    return dict(
        q=q,
        q0=q,
        v=v_N,
        b=within(x.b + error[B], LARGEST_BIAS),  # (10)
        D=within(x.D + ca.reshape(error[D], 3, 3).T, LARGEST_GYRO_ERROR),  # (10)
        P=upper_triangle(P),
        speed2=x.speed2 + H / (p.t_l + H) * (ca.sumsqr(v_N) / 3 - x.speed2),  # (10)
        lasting=lasting(v_N, x, H, p),
        level=ca.logic_or(1 - x.levelled, off_level < p.rr_a**2 + (3 * p.g) ** 2 * tilt_variance(P)),
        **EMPTY,
        **heading.end_block(x, u, H, p),
    )


def tilt_variance(P: Any) -> Any:
    """Square of tilt_std (rad2)."""
    return P[0, 0] + P[1, 1]


def within(values: Any, largest: float) -> Any:
    """Each value within +-largest."""
    return ca.if_else(values > largest, largest, ca.if_else(values < -largest, -largest, values))


SLOW_STEPS = (end_in_motion, end_in_vehicle, end_at_rest, begin)  # numbers MOVING to BEGINNING
