"""Gravity and acceleration Kalman filter with strapdown integration of first, second or third order [1].

    paper     here              unit      meaning
    g+        x.g               m/s2      gravity in S (upwards: what an accelerometer reads at rest), a posteriori
    a+        x.a               m/s2      external acceleration in S, a posteriori
    P+        x.P               m2/s4     covariance of [g, a]
    A         A                 1         dt [y_G x]
    y_G, y_A  u.gyro, u.accel   rad/s, m/s2
    sigma_G^2 p.sigma_g2        rad2/s2   gyroscope variance per sample (noise density^2 times half the sample rate)
    sigma_A^2 p.sigma_a2        m2/s4     accelerometer variance per sample

From one sample to the next, dt later, with g+, a+ and y_G of the one before; the terms up to the order count:

    Phi = I - A + A^2 / 2 - A^3 / 6                                                           (15)
    K_g = -dt [g x] + dt / 2 (A [g x] + [A g x]) - dt / 6 (A A [g x] + [A A g x] + A [A g x])    (14)
    g- = Phi g+,   a- = c_a a+                                                                (10), (12)
    Q = diag(sigma_G^2 K_g K_g', c_b^2 I)                                                     (16)

and the Kalman filter corrects both by the accelerometer:

    y_A = g + a   with variance sigma_A^2 on each axis                                        (11), (17)

The paper's Case 1 takes the process noise (14) of the same order as the integration (15), its Case 2 that of order 1.

Differences from the paper: M = sigma_A^2 I is diagonal, so the three axes of y_A correct one after the other, with the
same numbers and without an inverse. What would overflow in a long prediction without update is bounded: the covariance
and the length of g. A missing sample is predicted over; the first usable accelerometer sample starts the filter.

[1] Lee, Choi, Effect of Strapdown Integration Order and Sampling Rate on IMU-Based Attitude Estimation Accuracy,
    Sensors 18(9), 2018, 2775, doi:10.3390/s18092775. Equations without number are those of a Kalman filter.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import casadi as ca

from ..blocks import vocabulary as v
from ..blocks.block import Expressions, SampledBlock
from ..blocks.rotations import norm, roll_pitch, skew, unit, vertical_from_roll_pitch
from ..blocks.signals import Signal, State, integer, real, switch
from . import kalman, lee2012
from .direction_filter import (
    ACCEL_VARIANCE,
    GYRO_INDEX,
    GYRO_VARIANCE,
    LARGEST_TRACE,
    MODEL_ERROR,
    first_vertical,
    has_vertical,
    rate,
    tilt_std,
)

I3 = ca.SX.eye(3)
SHORTEST, LONGEST = 0.1, 1e3  # of p.g; the noise (14) shrinks with g, so a shorter one would be slow to return
LARGEST_A = v.EXTERNAL_ACCELERATION.maximum


def initial(u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """Gravity along the first accelerometer sample, or from the given angles; no external acceleration."""
    given = vertical_from_roll_pitch(p.initial_roll, p.initial_pitch)
    return dict(
        g=p.g * ca.if_else(p.use_initial_angles, given, first_vertical(u, p)),
        a=ca.SX.zeros(3),
        P=p.P0 * ca.SX.eye(6),
        innovation=ca.SX.zeros(3),
        started=ca.logic_or(has_vertical(u, p), p.use_initial_angles),
    )


def of_order(order: Any, first: Any, second: Any, third: Any) -> Any:
    """The expression that belongs to the order."""
    return ca.if_else(order == 1, first, ca.if_else(order == 2, second, third))


def transition(A: Any, order: Any) -> Any:
    """Transition matrix of g (3, 3)."""
    Phi_1 = I3 - A  # (15a)
    Phi_2 = Phi_1 + A @ A / 2  # (15b)
    Phi_3 = Phi_2 - A @ A @ A / 6  # (15c)
    return of_order(order, Phi_1, Phi_2, Phi_3)


def noise_gain(A: Any, g: Any, dt: Any, order: Any) -> Any:
    """Error of the predicted g per gyroscope noise (3, 3)."""
    g_x, Ag_x, AAg_x = skew(g), skew(A @ g), skew(A @ A @ g)
    K_1 = -dt * g_x  # (14a)
    K_2 = K_1 + dt / 2 * (A @ g_x + Ag_x)  # (14b)
    K_3 = K_2 - dt / 6 * (A @ A @ g_x + AAg_x + A @ Ag_x)  # (14c)
    return of_order(order, K_1, K_2, K_3)


def predict(x: SimpleNamespace, gyro: Any, p: SimpleNamespace) -> tuple[Any, Any]:
    """A priori state [g, a] and covariance."""
    A = p.sample_period * skew(gyro)
    noise_order = ca.if_else(p.process_noise_order == 0, p.order, p.process_noise_order)
    K_g = noise_gain(A, x.g, p.sample_period, noise_order)
    Phi = ca.diagcat(transition(A, p.order), p.c_a * I3)  # (12)
    Q = ca.diagcat(p.sigma_g2 * K_g @ K_g.T, p.c_b**2 * I3)  # (16)
    P = kalman.symmetric(Phi @ x.P @ Phi.T + Q)
    unknown = ca.diagcat(LARGEST_TRACE / 3 * I3, P[3:, 3:])  # scaled down instead, P would lose its small eigenvalues
    P = ca.if_else(ca.trace(P[:3, :3]) > LARGEST_TRACE, unknown, P)
    return Phi @ ca.vertcat(x.g, x.a), P  # (10)


def update(x: Any, P: Any, y_A: Any, M: Any, accepted: Any) -> tuple[Any, Any]:
    """A posteriori state and covariance; as before if not accepted. M: scalar, the variance of each axis of y_A."""
    for axis in range(3):
        x, P = kalman.update(x, P, {axis: 1, 3 + axis: 1}, y_A[axis], M, accepted)  # (11), (17)
    return x, P


def of_sane_length(g: Any, p: SimpleNamespace) -> Any:
    """The gravity vector, between SHORTEST and LONGEST, or of length p.g if normalised."""
    length = norm(g)
    within = ca.fmin(ca.fmax(length, SHORTEST * p.g), LONGEST * p.g)
    wanted = ca.if_else(p.normalise, p.g, within)
    return ca.if_else(wanted == length, g, g / length * wanted)


def step(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """One sample."""
    predicted, P = predict(x, rate(u, p), p)
    updated, P = update(predicted, P, u.accel, p.sigma_a2, 1 - u.accel_missing)
    filtered = dict(
        g=of_sane_length(updated[:3], p),
        a=ca.fmax(-LARGEST_A, ca.fmin(updated[3:], LARGEST_A)),
        P=P,
        innovation=ca.if_else(u.accel_missing, 0, u.accel - predicted[:3] - predicted[3:]),
        started=1,
    )
    fresh = initial(u, p)
    return {name: ca.if_else(x.started, value, fresh[name]) for name, value in filtered.items()}


def output(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """Outputs of one sample."""
    Z = unit(x.g)
    roll, pitch = roll_pitch(Z)
    return dict(
        roll=roll,
        pitch=pitch,
        vertical=Z,
        external_acceleration=x.a,
        tilt_std=tilt_std(Z, x.P[:3, :3], p, norm(x.g)),
        status=v.Status.GYRO_MISSING * u.gyro_missing
        + v.Status.ACCEL_MISSING * u.accel_missing
        + v.Status.NOT_INITIALISED * (1 - x.started),
        gravity=x.g,
        P=x.P,
        innovation=x.innovation,
    )


BLOCK = SampledBlock(
    name="leechoi2018",
    summary="Attitude and external acceleration from a 6-axis IMU: strapdown order 1, 2 or 3 (Lee, Choi 2018)",
    doc="""Estimates gravity and external acceleration in the sensor frame, both as states of one Kalman filter, hence
roll and pitch. The order of the strapdown integration decides how well fast turns are followed: an order too low costs
accuracy where angular rate times sample period passes some 0.1 rad. The default is the paper's recommendation, third
order with the process noise of the first. The remaining error of fast turns is the half sample by which the gyroscope
sample before is late: gyro_index 2 removes most of it. The filter has no gyroscope bias state: remove a constant bias
first. Sustained acceleration (cornering, braking) tilts the estimate. Heading is not estimated.""",
    reference="J. K. Lee, M. J. Choi, Sensors 18(9), 2018, 2775, doi:10.3390/s18092775",
    when="""Use it where angular rate times sample period passes some 0.1 rad: fast turns, or a low sample rate.
Gravity and acceleration are both states, so that a gentle acceleration is followed rather than rejected.
Instead: lee2012 where turns are slow; rizun2008 where vigorous motion does not end; plumb where the gyroscope has a
bias or the acceleration lasts, as in a vehicle; plumb or zihajehzadeh2014 for heading.""",
    inputs=(v.GYRO, v.ACCEL),
    outputs=(v.ROLL, v.PITCH, v.VERTICAL, v.EXTERNAL_ACCELERATION, v.TILT_STD, v.STATUS),
    locals=(
        Signal("gravity", "m/s2", "Gravity in S, upwards, of the length the filter gives it", -1e5, 1e5, (3,)),
        Signal("P", "m2/s4", "Covariance of gravity and external acceleration", -1e8, 1e8, (6, 6), nominal=1e-3),
        Signal("innovation", "m/s2", "Measured minus predicted specific force, in S", -1e5, 1e5, (3,)),
    ),
    own_parameters=(
        integer("order", 3, (1, 3), "Order of the strapdown integration", tunable=True),
        integer("process_noise_order", 1, (0, 3), "Order of the process noise; 0 as the integration", tunable=True),
        real("c_a", "1", 0.1, (0, 1), "Part of the acceleration kept to the next sample", tunable=True),
        real("c_b", "m/s2", 0.1, (0, 100), "New acceleration per sample, standard deviation", tunable=True),
        GYRO_VARIANCE,
        ACCEL_VARIANCE,
        MODEL_ERROR,
        real("g", "m/s2", 9.8, (1, 100), "Magnitude of gravity; 9.8 is the value of Lee et al. 2012"),
        switch("normalise", "0 gravity as the filter leaves it (as printed), 1 scaled to length g after every sample"),
        real("P0", "m2/s4", 1.0, (0, 1e5), "Variance of gravity and acceleration at the start, each axis"),
        GYRO_INDEX,
        *(q for q in lee2012.BLOCK.own_parameters if "initial" in q.name),
    ),
    state=(
        State("g", (3,)),
        State("a", (3,)),
        State("P", (6, 6)),
        State("innovation", (3,)),
        State("started"),
    ),
    initial=initial,
    step=step,
    output=output,
)
