"""Optimal Wiener filter of gravity: second-order Butterworth filter in the gyro-estimated Earth frame [1].

    paper     here                      unit            meaning
    ^g        x.g                       m/s2            gravity vector in S, points up
    D ^g      x.h                       m/s3            its rate of change in the gyro-estimated Earth frame, in S
    y_g, ^w   u.gyro                    rad/s
    y_a, y    u.accel                   m/s2
    omega_g   omega_g(p)                rad/s           cut-off of the filter
    delta_n   p.gyro_noise_density      rad/s/sqrt(Hz)  one-sided density, as datasheets print it
    delta_v   p.velocity_noise_density  m/s/sqrt(Hz)    "slosh": density of the sensor's velocity, taken as white

With D the rate of change in the gyro-estimated Earth frame, seen from S (D = d/dt + w x), the filter is

    D D g + sqrt(2) omega_g D g + omega_g^2 g = omega_g^2 y                             (38)
    g' = h - w x g,   h' = -w x h - sqrt(2) omega_g h + omega_g^2 (y - g)               (40)

Discrete form, which the paper leaves open. The state of sample k is that of its instant, before the sample counts.
Sample k then acts on it over one period in the gyro-estimated Earth frame, the frame at rest that S coincides with at
the instant; that gives the outputs. Turning the result by gyro[k] gives the state of sample k + 1 (locals ``g_held``
and ``h_held``). So a stream of samples sees: rotate by gyro[k-1], then a Butterworth step with accel[k].

``gyro_index``: 0, as above, is half a sample behind the rotation where gyro[k] is the rate at the instant k, and a
whole one where it is the mean since the instant before, as many devices report it. 1 rotates by gyro[k] instead, 2 by
the mean of both. ``discretisation``: what the accelerometer reads while a sample is held. With 0 it stands still in the
Earth frame: right for gravity, so a sensor that turns steadily leaves no error. With 1 it turns with the sensor: the
matrix exponential of (40), half a sample of rotation late. Either is exact otherwise, and stable at any rate and
period.

Differences from the paper: (35) has a minus and (37) omega_g^2 y, of which (38) follows. The external acceleration is
y - ^g of (2). The filter starts from the first usable accelerometer sample, or from g0 and h0. Without an accelerometer
sample gravity follows the gyroscope, the filter stands still, and the external acceleration counts as zero.
``tilt_std`` is (50), for any cut-off, plus what (50) leaves out: an initial error that decays with the filter, and the
drift (11) while the accelerometer is missing.

[1] Rizun, Optimal Wiener Filter for a Body Mounted Inertial Attitude Sensor, Journal of Navigation 61, 2008,
    doi:10.1017/S0373463308004736
"""

from __future__ import annotations

from math import pi
from types import SimpleNamespace
from typing import Any

import casadi as ca

from ..blocks import vocabulary as v
from ..blocks.block import Expressions, SampledBlock
from ..blocks.rotations import TINY, quaternion_from_rotation_vector, roll_pitch, root, rotate, rotate_back, unit
from ..blocks.signals import Signal, State, integer, real, switch
from .direction_filter import has_vertical, rate

EXACT = 1  # discretisation: the accelerometer sample turns with the sensor while it is held


def optimal_cutoff(delta_n: Any, delta_v: Any, g: Any) -> Any:
    """Cut-off (rad/s) of the least error for these noise densities. (25)"""
    return (g * delta_n / delta_v) ** 0.5


def mean_square_error(omega_g: Any, delta_n: Any, delta_v: Any, g: Any) -> Any:
    """Mean square error ((m/s2)^2) of one component of gravity, for any cut-off omega_g (rad/s).

    (43) over (41) with H of (34), S_g of (20) and S_a of (16); (46) at the optimal cut-off, (49) off it.
    """
    return (3 * (g * delta_n) ** 2 / omega_g + delta_v**2 * omega_g**3) / (4 * 2**0.5)


def tilt_variance(omega_g: Any, delta_n: Any, delta_v: Any, g: Any) -> Any:
    """Mean square tilt (rad^2): two components of gravity contribute. (50)"""
    return 2 * mean_square_error(omega_g, delta_n, delta_v, g) / g**2


def omega_g(p: SimpleNamespace) -> Any:
    """The cut-off in force (rad/s): given, or optimal for the densities."""
    return ca.if_else(p.cutoff > 0, p.cutoff, optimal_cutoff(p.gyro_noise_density, p.velocity_noise_density, p.g))


def free_response(omega_g: Any, dt: Any) -> Any:
    """Phi (2, 2): what becomes of (g, D g) within dt where (38) has no input."""
    a = omega_g / 2**0.5  # the poles of (34) lie at -a (1 +- i)
    c, s = ca.cos(a * dt), ca.sin(a * dt)
    return ca.exp(-a * dt) * ca.vertcat(ca.horzcat(c + s, s / a), ca.horzcat(-2 * a * s, c - s))


def forced_gravity(y: Any, w: Any, omega_g: Any) -> Any:
    """The solution g (3,) of (38) that is steady in S where y (3,) and w (3,) are: D = w x.

    Along w it is y, across it y after (34) at the frequency |w|.
    """
    denominator = omega_g**4 + ca.sumsqr(w) ** 2 + TINY**2
    w_y = ca.cross(w, y)
    return y + ((omega_g**2 + ca.sumsqr(w)) * ca.cross(w, w_y) - 2**0.5 * omega_g**3 * w_y) / denominator


def turn(w: Any, p: SimpleNamespace) -> Any:
    """Quaternion (4,) from the next sample's S to this one's, for the rate w (3,)."""
    return quaternion_from_rotation_vector(w * p.sample_period)


def filtered(x: SimpleNamespace, accel: Any, gyro: Any, p: SimpleNamespace) -> tuple[Any, Any]:
    """Gravity and its rate after one sample period of (38), in the Earth frame that is S at the sample's instant."""
    exact = p.discretisation == EXACT
    g_forced = ca.if_else(exact, forced_gravity(accel, gyro, omega_g(p)), accel)
    forced = ca.horzcat(g_forced, ca.if_else(exact, ca.cross(gyro, g_forced), 0))
    q = turn(gyro, p)
    forced_after = ca.horzcat(rotate(q, forced[:, 0]), rotate(q, forced[:, 1]))
    after = ca.if_else(exact, forced_after, forced)
    free = (ca.horzcat(x.g, x.h) - forced) @ free_response(omega_g(p), p.sample_period).T
    gh = ca.if_else(x.accel_counts, free + after, ca.horzcat(x.g, x.h))
    return gh[:, 0], gh[:, 1]


def held(x: SimpleNamespace, accel: Any, gyro: Any, p: SimpleNamespace) -> tuple[Any, Any]:
    """Gravity and its rate at the next instant, in S there: (40) over one sample period."""
    q = turn(gyro, p)
    g, h = filtered(x, accel, gyro, p)
    return rotate_back(q, g), rotate_back(q, h)


def initial(u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """Gravity as the first accelerometer sample says, or as given."""
    usable = has_vertical(u, p)
    first = ca.if_else(usable, u.accel, ca.vertcat(0, 0, p.g))
    started = ca.logic_or(usable, p.use_initial_gravity)
    return dict(
        g=ca.if_else(p.use_initial_gravity, p.g0, first),
        h=ca.if_else(p.use_initial_gravity, p.h0, 0),
        excess=p.initial_tilt_std**2,
        accel_counts=ca.logic_and(started, 1 - u.accel_missing),
        started=started,
    )


def step(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """From the instant of the sample before to that of this one."""
    g, h = held(x, u.accel_previous, rate(u, p), p)
    decayed = x.excess * ca.exp(-(2**0.5) * omega_g(p) * p.sample_period)
    drifted = x.excess + p.gyro_noise_density**2 * p.sample_period  # (11)
    ongoing = dict(
        g=g,
        h=h,
        excess=ca.if_else(x.accel_counts, decayed, drifted),
        accel_counts=1 - u.accel_missing,
        started=1,
    )
    fresh = initial(u, p)
    return {name: ca.if_else(x.started, value, fresh[name]) for name, value in ongoing.items()}


def output(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """Outputs of one sample."""
    g, _ = filtered(x, u.accel, u.gyro, p)
    g_held, h_held = held(x, u.accel, u.gyro, p)
    vertical = unit(g)
    roll, pitch = roll_pitch(vertical)
    steady = tilt_variance(omega_g(p), p.gyro_noise_density, p.velocity_noise_density, p.g)
    return dict(
        roll=roll,
        pitch=pitch,
        vertical=vertical,
        external_acceleration=ca.if_else(x.accel_counts, u.accel - g, 0),  # (2)
        tilt_std=ca.fmin(root(steady + x.excess), pi),
        status=v.Status.GYRO_MISSING * u.gyro_missing
        + v.Status.ACCEL_MISSING * u.accel_missing
        + v.Status.NOT_INITIALISED * (1 - x.started),
        g_held=g_held,
        h_held=h_held,
        omega_g=omega_g(p),
    )


BLOCK = SampledBlock(
    name="rizun2008",
    summary="Attitude and external acceleration from a 6-axis IMU: optimal Wiener filter (Rizun 2008)",
    doc="""Low-pass filters the accelerometer in the Earth frame that the gyroscope tracks: a second-order Butterworth
filter, optimal for white gyroscope noise and white velocity of the sensor. Its cut-off follows from the two noise
densities, or is set directly. Two numbers say all there is to tune: the gyroscope's datasheet gives the one, the vigour
of the motion the other (1 m/s/sqrt(Hz) is a shoe in running). Bursts of acceleration and centripetal acceleration
leave no bias, because acceleration averages out in the Earth frame. The filter has no gyroscope bias state: a constant
bias b tilts the estimate by sqrt(2) b / cut-off, so remove it first, or raise the cut-off. Acceleration that lasts as
long as 1 / cut-off is taken for gravity. Heading is not estimated.""",
    reference="P. Rizun, Optimal Wiener Filter for a Body Mounted Inertial Attitude Sensor, Journal of Navigation 61, "
    "2008, doi:10.1017/S0373463308004736",
    when="""Use it where the motion goes on and on - a shoe, a ball, a tool, a body in the water - and where two
numbers shall be all there is to tune, or a linear filter with a known frequency response is wanted. It is the best of
the papers' filters on hand-held recordings and in long turns.
Instead: plumb where the gyroscope has a bias, where rest should be used, or where acceleration lasts as long as 1 /
cut-off; lee2012 where rest and short bursts alternate; plumb or zihajehzadeh2014 for heading.""",
    inputs=(v.GYRO, v.ACCEL),
    outputs=(v.ROLL, v.PITCH, v.VERTICAL, v.EXTERNAL_ACCELERATION, v.TILT_STD, v.STATUS),
    locals=(
        Signal("g_held", "m/s2", "Gravity estimate at the end of the sample period, in S there", -1e6, 1e6, (3,)),
        Signal("h_held", "m/s3", "Rate of the gravity estimate in the Earth frame, as g_held", -1e9, 1e9, (3,)),
        Signal("omega_g", "rad/s", "Cut-off in force", 0.0, 1e5),
    ),
    own_parameters=(
        real(
            "gyro_noise_density",
            "rad/s/sqrt(Hz)",
            1.745e-3,
            (1e-8, 10),
            "White gyroscope noise, one-sided density; larger trusts it less. Start: 0.1 deg/s/sqrt(Hz)",
            tunable=True,
        ),
        real(
            "velocity_noise_density",
            "m/s/sqrt(Hz)",
            1.0,
            (1e-6, 1e3),
            "Slosh: one-sided density of the sensor's velocity; larger trusts the accelerometer less",
            tunable=True,
        ),
        real("cutoff", "rad/s", 0.0, (0, 1e3), "Cut-off of the filter; 0 optimal for the densities", tunable=True),
        real("g", "m/s2", v.GRAVITY, (1, 100), "Magnitude of gravity"),
        integer("gyro_index", 0, (0, 2), "Gyroscope sample that turns to this instant: 0 previous, 1 current, 2 mean"),
        integer("discretisation", 0, (0, 1), "While a sample is held it 0 stands in the Earth frame, 1 turns with S"),
        real("initial_tilt_std", "rad", 0.2, (0, pi), "One-sigma tilt error of the start"),
        switch("use_initial_gravity", "0 start from the first accelerometer sample, 1 from g0 and h0"),
        real("g0", "m/s2", (0.0, 0.0, v.GRAVITY), (-1e3, 1e3), "Gravity estimate at the start, in S", shape=(3,)),
        real("h0", "m/s3", 0.0, (-1e3, 1e3), "Rate of the gravity estimate at the start, in S", shape=(3,)),
    ),
    state=(
        State("g", (3,)),
        State("h", (3,)),
        State("excess"),  # rad^2, tilt variance beyond the steady one
        State("accel_counts"),  # 1 where this sample's accelerometer reading acts on the filter
        State("started"),
    ),
    initial=initial,
    step=step,
    output=output,
)
