"""Gravity-direction Kalman filter with an external acceleration model [1].

    paper     here              unit      meaning
    Z+        x.Z               1         up vector in S, a posteriori, of unit length
    a+        x.a               m/s2      external acceleration in S, a posteriori
    P+        x.P               1         covariance of Z+
    y_G, y_A  u.gyro, u.accel   rad/s, m/s2
    sigma_G^2 p.sigma_g2        rad2/s2   gyroscope variance per sample (noise density^2 times half the sample rate)
    sigma_A^2 p.sigma_a2        m2/s4     accelerometer variance per sample
    eps_A     p.eps_a           m/s2

Mode 1 takes c_a as it is, modes 2 and 3 take 0 for it; mode 3 measures only where the accelerometer's norm was that of
gravity in each of the last n + 1 samples:

    roll = atan2(Z_2, Z_3),   pitch = atan2(-Z_1, sqrt(Z_2^2 + Z_3^2))                        (4)
    abs(|y_A| - g) <= eps_A                                                                   (30)

Differences from the paper: roll uses the two-argument arctangent and pitch atan2(-Z1, hypot(Z2, Z3)), which equals (4)
where (4) can be computed. A threshold that is not met means no update at all (the limit of an infinite variance). A
missing sample is predicted over; the first usable accelerometer sample starts the filter. (12) to (29) stand in
direction_filter.

[1] Lee, Park, Robinovitch, Estimation of Attitude and External Acceleration Using Inertial Sensor Measurement During
    Various Dynamic Conditions, IEEE TIM 61(8), 2012, doi:10.1109/TIM.2012.2187245
"""

from __future__ import annotations

from math import pi
from types import SimpleNamespace
from typing import Any

import casadi as ca

from ..blocks import vocabulary as v
from ..blocks.block import Expressions, SampledBlock
from ..blocks.rotations import roll_pitch, vertical_from_roll_pitch
from ..blocks.signals import Signal, State, integer, real, switch
from .direction_filter import (
    ACCEL_VARIANCE,
    GRAVITY,
    GYRO_INDEX,
    GYRO_VARIANCE,
    MODEL_ERROR,
    first_acceleration,
    first_vertical,
    has_vertical,
    tilt_std,
    vertical_step,
)

ENDLESS = 1e9  # more quiet samples than any window asks for


def initial(u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """Attitude from the first accelerometer sample, or from the given angles."""
    started = ca.logic_or(has_vertical(u, p), p.use_initial_angles)
    given = vertical_from_roll_pitch(p.initial_roll, p.initial_pitch)
    Z = ca.if_else(p.use_initial_angles, given, first_vertical(u, p))
    return dict(
        Z=Z,
        a=first_acceleration(Z, started, u, p),
        P=p.P0 * ca.SX.eye(3),
        innovation=ca.SX.zeros(3),
        quiet_samples=ca.if_else(is_quiet(u, p), ENDLESS * (1 - p.early_is_moving) + 1, 0),
        rejected=0,
        started=started,
    )


def is_quiet(u: SimpleNamespace, p: SimpleNamespace) -> Any:
    """1 where the accelerometer norm is that of gravity, (30) for one tau."""
    return ca.logic_and(ca.fabs(ca.norm_2(u.accel) - p.g) <= p.eps_a, 1 - u.accel_missing)


def step(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """One sample: (24) to (30)."""
    quiet_samples = ca.if_else(is_quiet(u, p), x.quiet_samples + 1, 0)
    still = quiet_samples >= p.n + ca.if_else(p.window_excludes_start, 0, 1)  # (30)
    rejected = ca.logic_and(p.mode == 3, ca.logic_not(still))
    accepted = ca.logic_and(1 - u.accel_missing, ca.logic_not(rejected))
    c_a = ca.if_else(p.mode == 1, p.c_a, 0)
    Z, a, P, innovation = vertical_step(x.Z, x.a, x.P, u, p, c_a=c_a, accepted=accepted)  # (18) to (29)
    filtered = dict(Z=Z, a=a, P=P, innovation=innovation, quiet_samples=quiet_samples, rejected=rejected, started=1)
    fresh = initial(u, p)
    return {name: ca.if_else(x.started, value, fresh[name]) for name, value in filtered.items()}


def output(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """Outputs of one sample."""
    roll, pitch = roll_pitch(x.Z)  # (4)
    return dict(
        roll=roll,
        pitch=pitch,
        vertical=x.Z,
        external_acceleration=x.a,
        tilt_std=tilt_std(x.Z, x.P, p),
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
(cornering, braking) tilts the estimate in every mode, and tilt_std tells of it only where model_error says how large it
may be. Heading is not estimated.""",
    reference="J. K. Lee, E. J. Park, S. N. Robinovitch, IEEE Transactions on Instrumentation and Measurement 61(8), "
    "2012, doi:10.1109/TIM.2012.2187245",
    when="""Use it on a hand, a limb or a tool that accelerates in short bursts with rest or gentle motion between
them (mode 1), or as a small and well-known reference. On recordings of sustained hand motion mode 2 with a time
constant of some 3 s does better: sigma_a2 = 0.087 for sigma_g2 = 1e-4. Mode 3 is for motion that stops again and
again.
Instead: leechoi2018 where the sensor turns fast for its sample rate; rizun2008 where vigorous motion does not end;
plumb where the gyroscope has a bias or the acceleration lasts, as in a vehicle; plumb or zihajehzadeh2014 for
heading.""",
    inputs=(v.GYRO, v.ACCEL),
    outputs=(v.ROLL, v.PITCH, v.VERTICAL, v.EXTERNAL_ACCELERATION, v.TILT_STD, v.STATUS),
    locals=(
        Signal("P", "1", "Covariance of the vertical", -1e6, 1e6, (3, 3), nominal=1e-4),
        Signal("innovation", "m/s2", "Measured minus predicted gravity, in S", -1e5, 1e5, (3,)),
    ),
    own_parameters=(
        integer("mode", 1, (1, 3), "1 acceleration model, 2 static, 3 threshold switching", tunable=True),
        real("c_a", "1", 0.1, (0, 1), "Mode 1: part of the acceleration kept to the next sample", tunable=True),
        GYRO_VARIANCE,
        ACCEL_VARIANCE,
        MODEL_ERROR,
        GRAVITY,
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
        GYRO_INDEX,
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
