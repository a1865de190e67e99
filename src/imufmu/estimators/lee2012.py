"""Gravity-direction Kalman filter with an external acceleration model [1].

    paper     here              unit      meaning
    Z+        x.Z               1         up vector in S, a posteriori, of unit length
    a+        x.a               m/s2      external acceleration in S, a posteriori
    P+        x.P               1         covariance of Z+
    y_G, y_A  u.gyro, u.accel   rad/s, m/s2
    sigma_G^2 p.sigma_g2        rad2/s2   gyroscope variance per sample (noise density^2 times half the sample rate)
    sigma_A^2 p.sigma_a2        m2/s4     accelerometer variance per sample
    eps_A     p.eps_a           m/s2

Differences from the paper: roll uses the two-argument arctangent and pitch atan2(-Z1, hypot(Z2, Z3)), which equals (4)
where (4) can be computed. A threshold that is not met means no update at all (the limit of an infinite variance). A
sample that is not finite is predicted over; the first usable accelerometer sample starts the filter.

[1] Lee, Park, Robinovitch, Estimation of Attitude and External Acceleration Using Inertial Sensor Measurement During
    Various Dynamic Conditions, IEEE TIM 61(8), 2012, doi:10.1109/TIM.2012.2187245
"""

from __future__ import annotations

from math import pi
from types import SimpleNamespace
from typing import Any

import casadi as ca

from .. import vocabulary as v
from ..block import Expressions, SampledBlock
from ..rotations import roll_pitch, root, skew, unit, vertical_from_roll_pitch
from ..signals import Signal, State, integer, real, switch

ENDLESS = 1e9  # more quiet samples than any window asks for
NO_DIRECTION = 1e-6  # of g: a first accelerometer sample shorter than this points nowhere
LARGEST_TRACE = 1e6  # of P: a longer prediction without update would overflow; nothing is known by then


def initial(u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """Attitude from the first accelerometer sample, or from the given angles."""
    started = ca.logic_or(is_usable(u, p), p.use_initial_angles)
    Z = start_vertical(u, p)
    return dict(
        Z=Z,
        a=ca.if_else(ca.logic_and(started, 1 - u.accel_missing), u.accel - p.g * Z, 0),
        P=p.P0 * ca.SX.eye(3),
        innovation=ca.SX.zeros(3),
        quiet_samples=ca.if_else(is_quiet(u, p), ENDLESS * (1 - p.early_is_moving) + 1, 0),
        rejected=0,
        started=started,
    )


def start_vertical(u: SimpleNamespace, p: SimpleNamespace) -> Any:
    """Up vector in S before any update; (0, 0, 1) as long as nothing is known."""
    given = vertical_from_roll_pitch(p.initial_roll, p.initial_pitch)
    measured = ca.if_else(is_usable(u, p), unit(u.accel), ca.DM([0, 0, 1]))
    return ca.if_else(p.use_initial_angles, given, measured)


def is_usable(u: SimpleNamespace, p: SimpleNamespace) -> Any:
    """1 where the accelerometer sample has a direction to start from."""
    return ca.logic_and(ca.norm_2(u.accel) > NO_DIRECTION * p.g, 1 - u.accel_missing)


def is_quiet(u: SimpleNamespace, p: SimpleNamespace) -> Any:
    """1 where the accelerometer norm is that of gravity, (30) for one tau."""
    return ca.logic_and(ca.fabs(ca.norm_2(u.accel) - p.g) <= p.eps_a, 1 - u.accel_missing)


def rate(u: SimpleNamespace, p: SimpleNamespace) -> Any:
    """Gyroscope sample of the prediction from t-1 to t: y_G,t-1 as printed, y_G,t, or their mean."""
    mean = (u.gyro_previous + u.gyro) / 2
    return ca.if_else(p.gyro_index == 0, u.gyro_previous, ca.if_else(p.gyro_index == 1, u.gyro, mean))


def predict(x: SimpleNamespace, gyro: Any, p: SimpleNamespace) -> tuple[Any, Any]:
    """A priori up vector and covariance."""
    dt = p.sample_period
    Phi = ca.SX.eye(3) - dt * skew(gyro)  # (12)
    Q = -(dt**2) * p.sigma_g2 * skew(x.Z) @ skew(x.Z)  # (15)
    P = Phi @ x.P @ Phi.T + Q  # (25)
    return Phi @ x.Z, P / ca.fmax(1, ca.trace(P) / LARGEST_TRACE)  # (24)


def update(Z: Any, P: Any, z: Any, M: Any, g: Any, accepted: Any) -> tuple[Any, Any, Any]:
    """A posteriori up vector of unit length, covariance, innovation; unchanged but for the length if not accepted.

    M: scalar, the measurement variance of each axis.
    """
    innovation = z - g * Z
    inverse = ca.inv_minor(g**2 * P + M * ca.SX.eye(3))
    K = ca.if_else(accepted, g * P @ inverse, 0)  # (26), H = g I
    I_KH = ca.if_else(accepted, M * inverse, ca.SX.eye(3))  # I - g K, without its cancellation where g^2 P >> M
    return unit(Z + K @ innovation), I_KH @ P, innovation  # (27), (28)


def step(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """One sample: (24) to (30)."""
    quiet_samples = ca.if_else(is_quiet(u, p), x.quiet_samples + 1, 0)
    still = quiet_samples >= p.n + ca.if_else(p.window_excludes_start, 0, 1)  # (30)
    rejected = ca.logic_and(p.mode == 3, ca.logic_not(still))
    accepted = ca.logic_and(1 - u.accel_missing, ca.logic_not(rejected))

    c_a = ca.if_else(p.mode == 1, p.c_a, 0)
    M = c_a**2 * ca.sumsqr(x.a) / 3 + p.sigma_a2  # (22), (23)
    Z, P = predict(x, rate(u, p), p)
    Z, P, innovation = update(Z, P, u.accel - c_a * x.a, M, p.g, accepted)  # z: (18)
    filtered = dict(
        Z=Z,
        a=ca.if_else(u.accel_missing, x.a, u.accel - p.g * Z),  # (29)
        P=P,
        innovation=ca.if_else(u.accel_missing, 0, innovation),
        quiet_samples=quiet_samples,
        rejected=rejected,
        started=1,
    )
    fresh = initial(u, p)
    return {name: ca.if_else(x.started, value, fresh[name]) for name, value in filtered.items()}


def tilt_std(Z: Any, P: Any) -> Any:
    """One-sigma tilt (rad) from the covariance of the up vector: its part perpendicular to the vector."""
    return root(ca.trace(P) - Z.T @ P @ Z)


def output(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """Outputs of one sample."""
    roll, pitch = roll_pitch(x.Z)  # (4)
    return dict(
        roll=roll,
        pitch=pitch,
        vertical=x.Z,
        external_acceleration=x.a,
        tilt_std=tilt_std(x.Z, x.P),
        status=v.Status.GYRO_MISSING * u.gyro_missing
        + v.Status.ACCEL_MISSING * u.accel_missing
        + v.Status.ACCEL_REJECTED * x.rejected
        + v.Status.NOT_INITIALISED * (1 - x.started),
        P=x.P,
        innovation=x.innovation,
    )


BLOCK = SampledBlock(
    name="lee2012",
    summary="Attitude and external acceleration from a 6-axis IMU: gravity-direction Kalman filter (Lee et al. 2012)",
    doc="""Estimates the up vector in the sensor frame, hence roll and pitch, and the external acceleration. Mode 1
models the external acceleration as low-pass filtered noise: good for short accelerations. Mode 2 takes every
accelerometer sample for gravity: for quasi-static use only. Mode 3 uses the accelerometer only after its norm stayed
near g for n samples. The filter has no gyroscope bias state: remove a constant bias first. Sustained acceleration
(cornering, braking) tilts the estimate in every mode. Heading is not estimated.""",
    reference="J. K. Lee, E. J. Park, S. N. Robinovitch, IEEE Transactions on Instrumentation and Measurement 61(8), "
    "2012, doi:10.1109/TIM.2012.2187245",
    inputs=(v.GYRO, v.ACCEL),
    outputs=(v.ROLL, v.PITCH, v.VERTICAL, v.EXTERNAL_ACCELERATION, v.TILT_STD, v.STATUS),
    locals=(
        Signal("P", "1", "Covariance of the vertical", -1e6, 1e6, (3, 3), nominal=1e-4),
        Signal("innovation", "m/s2", "Measured minus predicted gravity, in S", -1e5, 1e5, (3,)),
    ),
    own_parameters=(
        integer("mode", 1, (1, 3), "1 acceleration model, 2 static, 3 threshold switching", tunable=True),
        real("c_a", "1", 0.1, (0, 1), "Mode 1: part of the acceleration kept to the next sample", tunable=True),
        real(
            "sigma_g2", "rad2/s2", 1e-4, (0, 1e3), "Gyroscope variance per sample; larger trusts it less", tunable=True
        ),
        real(
            "sigma_a2",
            "m2/s4",
            1e-4,
            (1e-9, 1e6),
            "Accelerometer variance per sample; larger trusts it less",
            tunable=True,
        ),
        real("g", "m/s2", 9.8, (1, 100), "Magnitude of gravity; 9.8 is the paper's value"),
        real(
            "eps_a",
            "m/s2",
            0.2,
            (0, 1e3),
            "Mode 3: deviation of the accelerometer norm from g allowed at rest",
            tunable=True,
        ),
        integer("n", 4, (0, 10**6), "Mode 3: length of the window in sample periods", tunable=True),
        switch("window_excludes_start", "Mode 3: 0 window of n + 1 samples as in (30), 1 of n samples"),
        switch("early_is_moving", "Mode 3: while the window is not full, 0 judge by the samples there are, 1 moving"),
        integer(
            "gyro_index", 0, (0, 2), "Gyroscope sample of the prediction: 0 previous (as printed), 1 current, 2 mean"
        ),
        real("P0", "1", 1.0, (0, 1e5), "Variance of the vertical at the start, each axis"),
        switch(
            "use_initial_angles", "0 start from the first accelerometer sample, 1 from initial_roll and initial_pitch"
        ),
        real("initial_roll", "rad", 0.0, (-pi, pi), "Roll at the start"),
        real("initial_pitch", "rad", 0.0, (-pi / 2, pi / 2), "Pitch at the start"),
    ),
    state=(
        State("Z", (3,)),
        State("a", (3,)),
        State("P", (3, 3)),
        State("innovation", (3,)),
        State("quiet_samples"),
        State("rejected"),
        State("started"),
    ),
    initial=initial,
    step=step,
    output=output,
)
