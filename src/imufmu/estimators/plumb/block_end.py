"""The end of a block of ``plumb``: its slow steps.

Prediction over the block, with the sums of (2) and (3):

    v += dV - g e_z T                                                                          (4)
    psi' = psi - S db + S dD theta / H,   dv' = dv - [dV] psi                                  (5)
    Q = diag((s_g^2 H + k_j^2 J) I + R W R',  (s_a^2 H + s_m^2 (H - T) + k_a^2 K) I,  s_b^2 H I,  0),
        W = k_g^2 theta theta' / H + s_s^2 diag(blind)                                         (6)

then measurements, one element after the other, and their results:

    in motion   v = 0 with the variance (7) of ``travel``; with wheels (12) to (14) of ``vehicle``
    at rest     v = 0 with variance rr_v^2 / H,    b = gl with rr_g^2 / H                      (9)
    R <- exp([psi]) R,   v += dv,   b += db,   D += dD,
    t_l dV/dt = |v|^2 / 3 - V,   t_s dv_s/dt = v - v_s,   t_0 df/dt = -f in motion             (10)

(5) is R' = R [w] and v' = R a - g e_z, true minus estimated, to first order; dD and the noise of (6) see the mean rate
of the block, for its change within 0.05 s makes no difference to what is learnt. k_g leaves room for errors that grow
with the rate and that D cannot hold, k_j and k_a for those that grow with the change within a sample: timing, a hit, a
sample that was lost.

To an IMU rest and steady travel are the same. So if v is more than GATE standard deviations off 0 in the first block of
either, it was travel: v is 0 again, its errors are independent of the others, with the variance of that measurement.

At the first rest of rr_s P_b rises to P0_raw^2. A start in motion, where there is little to learn a bias from, is best
served by the bias of a calibrated gyroscope; the first rest may show that it is none.

Where the filter is lost (``travel``) it starts anew (``start``). Where it is overruled (``rest``) the low-passed
accelerometer is the vertical, known to OVERRULED, and the filter is not levelled. Both set the flag LOST of status.

Corrections by rest and steady travel that go on in one direction are an attitude that follows an acceleration, or a
bias. There is no telling: their sum c, forgotten in T_LEANED, adds to the uncertainty that is told, and so does an
accelerometer that does not read g at rest, beyond SCALE:

    tilt_std^2 += |c|^2 + 2 (2 max(0, |g_r / g - 1| - SCALE))^2                                (29)

Variances of psi and b stop at 1 (rad, rad/s): yaw is never observed.
"""

from __future__ import annotations

from collections.abc import Callable
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
    rotate,
    rotate_back,
    unit,
)
from ...blocks.signals import State
from . import heading, readings, rest, start, travel, vehicle
from .covariance import (
    N_ERRORS,
    PSI,
    B,
    D,
    Log,
    V,
    forgotten,
    full,
    kept,
    measure,
    noise_of_turn,
    predicted,
    tilt_variance,
    upper_triangle,
)

LARGEST_BIAS = 1.0  # rad/s
LARGEST_GYRO_ERROR = 0.2  # 1, each element of D
GATE = 3.0  # standard deviations of a velocity at rest
OVERRULED = 0.05  # rad, each axis
LOST_SHOWN = 1.0  # s
T_LEANED = 20.0  # s
SCALE = 0.04  # of g; what an accelerometer may be off by and still be good

UP = ca.DM([0, 0, 1])

STATES = (
    *travel.STATES,
    State("resting"),
    State("rested"),
    State("lost"),
    State("leaned", (2,)),
    State("tilt_std"),
    State("intensity"),
)

MEASUREMENTS = 6  # of a block, at most

# What smoothers want to know of a block, beside its results: one that goes back, one that goes along, both.
BOTH = (
    State("error", (N_ERRORS,)),
    State("kept", (N_ERRORS,)),
    State("S_block", (3, 3)),
    State("dV_block", (3,)),
    State("rate_block", (3,)),
    State("anew"),
    State("phi", (3,)),
)
GOING_BACK = (State("P_before", (N_ERRORS * (N_ERRORS + 1) // 2,)), State("Q_turn", (3, 3)))
GOING_ALONG = (
    State("log_h", (MEASUREMENTS, N_ERRORS)),
    State("log_gain", (MEASUREMENTS, N_ERRORS)),
    State("log_pull", (MEASUREMENTS,)),
    State("log_weight", (MEASUREMENTS,)),
)

SlowStep = Callable[[SimpleNamespace, SimpleNamespace, SimpleNamespace], Expressions]

UNKNOWN: Expressions = dict(**travel.UNKNOWN, resting=0, rested=0, lost=0, leaned=ca.SX.zeros(2))

EMPTY: Expressions = dict(
    samples=0,
    dV=ca.SX.zeros(3),
    T=0,
    S=ca.SX.zeros(3, 3),
    theta=ca.SX.zeros(3),
    blind=ca.SX.zeros(3),
    jerk=0,
    jolt=0,
)
RESTING, OVERRULING, MOVING, ROLLING, BEGINNING, STARTING = rest.REST, rest.OVERRULED, 3, 4, 5, 6


def slow_due(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Any:
    """Which of ``steps`` is due: at the end of a block of m samples, and at the first usable sample."""
    full_block, wheels = (x.samples + 0.5) * p.sample_period > p.h, vehicle.is_valid(u)
    stands = ca.logic_and(rest.is_calm(x), x.verdict > 0)
    at_end = ca.if_else(stands, x.verdict, ca.if_else(wheels, ROLLING, MOVING))
    at_end = ca.if_else(ca.logic_and(x.coarse, ca.logic_not(wheels)), STARTING, at_end)
    return ca.if_else(
        x.started, ca.if_else(full_block, at_end, 0), ca.if_else(readings.has_vertical(x, p), BEGINNING, 0)
    )


def begin(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """The first usable sample."""
    return first_attitude(x, u, p) | dict(started=1)


def first_attitude(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> dict[str, Any]:
    """Attitude of yaw 0 and what starts with it, from one accelerometer sample; upright where it has no direction."""
    found = readings.has_vertical(x, p)
    vertical = ca.if_else(found, unit(x.accel_used), UP)
    q = quaternion_from_euler(*roll_pitch(vertical), 0)
    gravity = ca.if_else(found, ca.norm_2(x.accel_used), p.g)
    return dict(q=q, q0=q, **start.begin(gravity, p), **heading.first_heading(q, found, u, p))


def end_at_start(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """The end of a block while the vertical is hardly known."""
    H = block_length(x, p)
    after = start.end_of_block(x, H, p)
    rests = ca.logic_not(after["coarse"]) * rest.at_rest(x) * (x.still_time >= p.rr_s)
    field, present = heading.first_heading(after["q"], 1, u, p), heading.is_there(u)
    # A turn as large as those at the start would make nonsense of what was learnt about the heading.
    anew = {name: ca.if_else(present, value, getattr(x, name)) for name, value in field.items()}
    lost = ca.if_else(ca.logic_and(after["coarse"], x.lost > 0), x.lost, ca.fmax(x.lost - H, 0))
    record = kept_for_later(x, H, p, [], P_before=full(after["P"]), anew=1, turn=after.pop("phi"))
    record |= dict(error=ca.SX.zeros(N_ERRORS))
    return (
        after
        | anew
        | dict(q0=after["q"], levelled=rests, resting=rests, fresh=rests, lost=lost, **EMPTY)
        | (rest.block(x, H, p) | readings.range_seen(x) | record)
    )


def end_in_motion(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """The end of a block in motion."""
    v_N, P, scale, H = predicted_block(x, p)
    known = ca.logic_or(x.levelled, x.rolling)
    lost = travel.is_lost(v_N, P, known, x, H, p)
    steady = rest.travels_steadily(x, p) * ca.logic_not(lost) * ca.logic_not(x.rolling)
    forget = ca.logic_or(lost, ca.logic_and(steady, surprising(v_N, P, x, p.rr_v2**2 / H)))
    v_N = ca.if_else(forget, 0, v_N)
    P = forgotten(P, forget, ca.if_else(lost, p.P0_v**2, p.rr_v2**2 / H))
    travels = ca.logic_and(known, ca.logic_not(lost))
    variance, learns, states = travel.velocity(v_N, P, travels, steady, x, H, p)
    log: Log = []
    error, P_after = measure(ca.SX.zeros(N_ERRORS), P, V, ca.vertsplit(-v_N), variance, learns, log)  # (7)
    after = corrected(x, u, v_N, error, P_after, H, p, resting=0, steady=steady) | states
    after |= kept_for_later(x, H, p, log, P_before=P, kept=scale * kept(forget))
    goes_on = ca.logic_not(lost) * (states["quiet"] < p.t_v)
    after |= dict(levelled=ca.logic_and(x.levelled, goes_on), rolling=ca.logic_and(x.rolling, goes_on))
    anew = dict(UNKNOWN, **start.begin(p.g, p), lost=LOST_SHOWN)
    return after | {name: ca.if_else(lost, value, (vars(x) | after)[name]) for name, value in anew.items()}


def end_in_vehicle(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """The end of a block in a vehicle whose wheels tell its speed."""
    turn = start.to_the_top(ca.if_else(x.coarse, x.dV, UP))  # one block says more than one sample
    x = upright(x, turn)
    v_N, P, scale, H = predicted_block(x, p)
    log: Log = []
    v_N, error, P, states = vehicle.measured_velocity(v_N, P, rate(x, x.gyro_used), H, x, u, p, log)
    P_before, scale = states.pop("P_before"), scale * states.pop("kept")
    record = kept_for_later(x, H, p, log, P_before=P_before, kept=scale, anew=x.coarse, turn=turn)
    after = corrected(x, u, v_N, error, P, H, p, resting=0, steady=0)
    return after | dict(speed2=x.speed2, lasting=after["v"], coarse=0) | states | record


def end_at_rest(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """The end of a block at rest."""
    v_N, P, scale, H = predicted_block(x, p)
    variance, lasts = p.rr_v**2 / H, x.still_time >= p.rr_s
    travelled = surprising(v_N, P, x, variance)
    v_N, P = ca.if_else(travelled, 0, v_N), forgotten(P, travelled, variance)
    first = ca.logic_and(lasts, ca.logic_not(x.rested))
    for i in range(N_ERRORS)[B]:
        P[i, i] = ca.if_else(ca.logic_and(first, P[i, i] < p.P0_raw**2), p.P0_raw**2, P[i, i])
    log: Log = []
    P_before = P
    error, P = measure(ca.SX.zeros(N_ERRORS), P, V, ca.vertsplit(-v_N), variance, log=log)  # (9)
    error, P = measure(error, P, B, ca.vertsplit(x.gyro_lp - x.b), p.rr_g**2 / H, log=log)  # (9)
    record = kept_for_later(x, H, p, log, P_before=P_before, kept=scale * kept(travelled))
    after = corrected(x, u, v_N, error, P, H, p, resting=1, steady=0) | stands(x, u) | record
    return after | dict(levelled=ca.logic_or(x.levelled, lasts), rested=ca.logic_or(x.rested, lasts))


def end_overruled(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """The end of a block in which stillness shows that the attitude is wrong."""
    turn, H = start.to_the_top(rotate(x.q, x.accel_lp)), block_length(x, p)
    x = upright(x, turn)
    std = ca.vertcat(OVERRULED, OVERRULED, p.P0_psi, *[p.rr_v / ca.sqrt(H)] * 3, *[p.P0_raw] * 3, *[p.P0_D] * 9)
    nothing, P = ca.SX.zeros(N_ERRORS), ca.diag(std**2)
    after = corrected(x, u, ca.SX.zeros(3), nothing, P, H, p, resting=1, steady=0) | stands(x, u)
    record = kept_for_later(x, H, p, [], P_before=P, anew=1, turn=turn)
    return after | dict(levelled=0, level=1, lost=LOST_SHOWN) | record


def upright(x: SimpleNamespace, turn: Any) -> SimpleNamespace:
    """x with N turned by this rotation vector."""
    turn = quaternion_from_rotation_vector(turn)
    R = matrix_from_quaternion(turn)
    turned = dict(q=unit(multiply(turn, x.q)), q0=unit(multiply(turn, x.q0)), dV=R @ x.dV, S=R @ x.S)
    return SimpleNamespace(**vars(x) | turned)


def stands(x: SimpleNamespace, u: SimpleNamespace) -> dict[str, Any]:
    """What rest says of travel."""
    return dict(rolling=vehicle.is_valid(u), disagreed=0, quiet=0, fresh=1, swell=0, doubt=0)


def surprising(v_N: Any, P: Any, x: SimpleNamespace, variance: Any) -> Any:
    """1 where the velocity in the first block of rest or steady travel is far from 0."""
    surprise = sum(v_N[i] ** 2 / (P[V, V][i, i] + variance) for i in range(3))
    return ca.logic_and(ca.logic_not(ca.logic_or(x.resting, x.steady)), surprise > GATE**2)


def block_length(x: SimpleNamespace, p: SimpleNamespace) -> Any:
    """H (s)."""
    return x.samples * p.sample_period


def predicted_block(x: SimpleNamespace, p: SimpleNamespace) -> tuple[Any, Any, Any, Any]:
    """Velocity and covariance at the end of a block before its measurements, factors of the errors, its length (s)."""
    H = block_length(x, p)
    return x.v + x.dV - p.g * UP * x.T, *predicted(full(x.P), mean_attitude(x, p), x, H, p), H  # (4)


def mean_attitude(x: SimpleNamespace, p: SimpleNamespace) -> Any:
    """S (s) of the block."""
    return x.S + (matrix_from_quaternion(x.q0) - matrix_from_quaternion(x.q)) * p.sample_period / 2  # (2)


def rate(x: SimpleNamespace, y: Any) -> Any:
    """w: angular velocity (rad/s) of a reading y as far as the errors of the gyroscope are known."""
    without_bias = y - x.b
    return without_bias + x.D @ without_bias  # (1)


def corrected(
    x: SimpleNamespace,
    u: SimpleNamespace,
    v_N: Any,
    error: Any,
    P: Any,
    H: Any,
    p: SimpleNamespace,
    *,
    resting: Any,
    steady: Any,
) -> dict[str, Any]:
    """State after the measurements of a block."""
    v_N = v_N + error[V]
    q = unit(multiply(quaternion_from_rotation_vector(error[PSI]), x.q))  # (10)
    leans = ca.logic_or(resting, steady) * error[:2]
    return dict(
        q=q,
        q0=q,
        error=error,
        v=v_N,
        b=within(x.b + error[B], LARGEST_BIAS),  # (10)
        D=within(x.D + ca.reshape(error[D], 3, 3).T, LARGEST_GYRO_ERROR),  # (10)
        P=upper_triangle(P),
        coarse=0,
        speed2=x.speed2 + H / (p.t_l + H) * (ca.sumsqr(v_N) / 3 - x.speed2),  # (10)
        lasting=travel.lasting(v_N, x, H, p),
        resting=resting,
        steady=steady,
        lost=ca.fmax(x.lost - H, 0),
        leaned=(x.leaned + leans) * T_LEANED / (T_LEANED + H),  # (29)
        **EMPTY,
        **readings.range_seen(x),
        **rest.block(x, H, p),
        **rest.levels(x, rotate_back(q, UP), tilt_variance(P), resting, H, p),
        **heading.end_block(x, u, rate(x, x.gyro_used), H, p),
    )


def untold(x: SimpleNamespace, p: SimpleNamespace) -> Any:
    """What P does not hold of the variance of the tilt (rad2)."""
    scale = ca.fmax(0, ca.fabs(x.felt_g / p.g - 1) - SCALE)
    grows = ca.if_else(x.levelled, 0, 2 * x.doubt / (travel.LASTS * p.g) ** 2)  # (28)
    return grows + ca.sumsqr(x.leaned) + 8 * scale**2  # (29)


def within(values: Any, largest: float) -> Any:
    """Each value within +-largest."""
    return ca.if_else(values > largest, largest, ca.if_else(values < -largest, -largest, values))


def told(x: SimpleNamespace, p: SimpleNamespace) -> dict[str, Any]:
    """What is told for every sample, but changes with a block only."""
    tilt_std = root(tilt_variance(full(x.P)) + untold(x, p))
    return dict(verdict=rest.verdict(x, p), tilt_std=tilt_std, intensity=root(x.speed2))


def kept_for_later(
    x: SimpleNamespace,
    H: Any,
    p: SimpleNamespace,
    log: Log,
    *,
    P_before: Any,
    kept: Any = 1,
    anew: Any = 0,
    turn: Any = 0,
) -> dict[str, Any]:
    """BOTH, GOING_BACK and GOING_ALONG after a block, but ``error``.

    P_before: before the measurements. kept: factors (18,) of the errors of (5). turn: of N, where it began ``anew``.
    """
    nothing = (ca.SX.zeros(N_ERRORS), ca.SX.zeros(N_ERRORS), 0, 0)
    h, gain, pull, weight = zip(*log, *[nothing] * (MEASUREMENTS - len(log)), strict=True)
    return dict(
        log_h=ca.horzcat(*h).T,
        log_gain=ca.horzcat(*gain).T,
        log_pull=ca.vertcat(*pull),
        log_weight=ca.vertcat(*weight),
        P_before=upper_triangle(P_before),
        kept=kept * ca.SX.ones(N_ERRORS),
        S_block=mean_attitude(x, p),
        dV_block=x.dV,
        rate_block=x.theta / H,
        Q_turn=noise_of_turn(x, H, p),
        anew=anew,
        phi=turn * ca.SX.ones(3),
    )


def steps(record: tuple[State, ...] = ()) -> tuple[SlowStep, ...]:
    """Slow steps RESTING to STARTING, each with what follows from the state after it and with these of the records."""
    left_out = {state.name for state in (*BOTH, *GOING_BACK, *GOING_ALONG)} - {state.name for state in record}

    def without(slow_step: SlowStep) -> SlowStep:
        def step(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
            after = dict(slow_step(x, u, p))
            after |= told(SimpleNamespace(**vars(x) | after), p)
            return {name: value for name, value in after.items() if name not in left_out}

        return step

    return tuple(map(without, (end_at_rest, end_overruled, end_in_motion, end_in_vehicle, begin, end_at_start)))
