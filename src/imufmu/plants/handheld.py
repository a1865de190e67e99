"""A rigid body that a hand shakes and turns at random, with a sensor on it.

    symbol      here                unit    meaning
    r, v        x.position, x.velocity      centre of rotation, in N (m, m/s)
    q_NB        x.attitude          1       body to N
    w, a        rate, acceleration          random vectors: rad/s in the body; m/s2 in N
    e           activity            1       1 while the body is moved, 0 at rest
    omega_0     pull                rad/s   softness of the hand
    l           p.imu_position      m       sensor from the centre of rotation, in the body
    delta_v, omega_c                        p.velocity_noise_density, p.velocity_cutoff

The hand (motion 0). Band-limited random vectors of a stated mean and largest length (module random_vectors) turn and
shake the body; the hand draws it back softly to where it started, so that it wanders but does not leave:

    w_B  = e(t) w(t)                                                                   (1)
    r''  = e(t) (a(t) - 2 omega_0 r' - omega_0^2 r)                                    (2)

omega_0 is half of the lowest frequency of a: little of a is lost. In a rest between bursts the body keeps the velocity
that it has, which no IMU feels.

White velocity (motion 1), the human motion of Rizun 2008 [1]: each component of the velocity has the one-sided density

    2 S_v = delta_v^2 / (1 + (omega / omega_c)^2)                                      [1, (14)]

made of lines at random places of equal parts of log(omega), from omega_c / 1000 to 10 omega_c. Mean squares behind a
filter that passes an octave or more come out right on average over seeds; a record is not normal in distribution, and
one of hours is no substitute for many seeds.

The sensor. With R = R_NB and w' from the time derivative of (1),

    r_S = r + R l,   v_S = v + R (w x l),   a_S = r'' + R (w' x l + w x (w x l))       (3)

What the sensor reads from this: module truth.

To be drawn, the body is a box of the size of a telephone around the sensor.

[1] Rizun, Optimal Wiener Filter for a Body Mounted Inertial Attitude Sensor, Journal of Navigation 61, 2008,
    doi:10.1017/S0373463308004736
"""

from __future__ import annotations

from functools import partial
from math import log, pi
from types import SimpleNamespace
from typing import Any

import casadi as ca

from ..blocks import vocabulary as v
from ..blocks.block import ContinuousBlock, Expressions
from ..blocks.rotations import multiply, quaternion_from_euler, rotate, unit
from ..blocks.signals import Parameter, Signal, State, integer, real, switch
from .random_vectors import DRAWS, LINES, lines, random_vector, sum_of_lines
from .time_functions import along, windows
from .truth import OUTPUTS, PARAMETERS, magnetic_field, times, truth

HAND, WHITE_VELOCITY = 0, 1
BURSTS = 4
ATTITUDE_DRAWS = 4

BOX = (0.15, 0.07, 0.02)  # m, edges of the drawn body along x, y, z of S
# Corners in the order of one line that passes every edge; bits 1, 2, 4 of a corner are its side in x, y, z.
ROUND_THE_BOX = (0, 1, 3, 2, 0, 4, 5, 1, 5, 7, 3, 7, 6, 2, 6, 4)

WHITE_FROM, WHITE_TO = 1e-3, 10.0  # lines of the white velocity, relative to its cut-off


def initial(p: SimpleNamespace) -> Expressions:
    """Attitude, frequencies and phases from the draws."""
    attitude_draws, rate_draws, acceleration_draws = ca.vertsplit(
        p.normal, [0, ATTITUDE_DRAWS, ATTITUDE_DRAWS + DRAWS, ATTITUDE_DRAWS + 2 * DRAWS]
    )
    rate_place, rate_phase = lines(rate_draws)
    place, phase = lines(acceleration_draws)
    in_hand = in_band(place, p.acceleration_low_frequency, p.acceleration_high_frequency)
    in_white = p.velocity_cutoff / (2 * pi) * WHITE_FROM * (WHITE_TO / WHITE_FROM) ** place
    white = p.motion == WHITE_VELOCITY
    frequency = ca.if_else(white, in_white, in_hand)
    start_velocity = sum_of_lines(0, white_amplitude(frequency, p), frequency, phase)
    given = quaternion_from_euler(*ca.vertsplit(p.initial_attitude))
    return dict(
        attitude=ca.if_else(p.random_attitude, unit(attitude_draws), given),
        velocity=ca.if_else(white, start_velocity, 0),
        position=ca.SX.zeros(3),
        rate_frequency=in_band(rate_place, p.rate_low_frequency, p.rate_high_frequency),
        rate_phase=rate_phase,
        frequency=frequency,
        phase=phase,
    )


def in_band(place: Any, low: Any, high: Any) -> Any:
    """Frequency (Hz) at a place (0 to 1) in the band."""
    return low + place * (high - low)


def white_amplitude(frequency: Any, p: SimpleNamespace) -> Any:
    """Amplitude (m/s) of each line of the white velocity: half its square is the density times the line's part."""
    part = frequency * log(WHITE_TO / WHITE_FROM) / LINES  # Hz
    density = p.velocity_noise_density**2 / (1 + (2 * pi * frequency / p.velocity_cutoff) ** 2)
    return ca.sqrt(2 * density * part)


def activity(t: Any, p: SimpleNamespace) -> Any:
    """e(t): 1 while the body is moved."""
    return ca.if_else(p.bursts == 0, 1, windows(t, p.bursts, p.burst_start, p.burst_stop, p.burst_ramp))


def rate(t: Any, x: SimpleNamespace, p: SimpleNamespace) -> Any:
    """Angular velocity in the body (3,). (1)"""
    moved = ca.if_else(p.turns_at_rest, 1, activity(t, p))
    return moved * random_vector(t, x.rate_frequency, x.rate_phase, p.rate_mean, p.rate_peak_to_mean)


def acceleration(t: Any, x: SimpleNamespace, p: SimpleNamespace) -> Any:
    """Acceleration of the centre of rotation in N (3,). (2)"""
    a = random_vector(t, x.frequency, x.phase, p.acceleration_mean, p.acceleration_peak_to_mean)
    pull = pi * p.acceleration_low_frequency
    hand = a - 2 * pull * x.velocity - pull**2 * x.position
    slope = 2 * pi * x.frequency * white_amplitude(x.frequency, p)
    white = sum_of_lines(t, slope, x.frequency, x.phase + pi / 2)
    return activity(t, p) * ca.if_else(p.motion == WHITE_VELOCITY, white, hand)


def dynamics(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace, t: Any) -> Expressions:
    """State derivative; what was drawn stays."""
    return dict(
        attitude=multiply(x.attitude, ca.vertcat(0, rate(t, x, p))) / 2,
        velocity=acceleration(t, x, p),
        position=x.velocity,
        rate_frequency=ca.SX.zeros(3, LINES),
        rate_phase=ca.SX.zeros(3, LINES),
        frequency=ca.SX.zeros(3, LINES),
        phase=ca.SX.zeros(3, LINES),
    )


def output(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace, t: Any) -> Expressions:
    """Truth at the sensor. (3)"""
    w, w_rate, _ = along(partial(rate, x=x, p=p), t, 1)
    q_NB, l_B = unit(x.attitude), p.imu_position
    r_S = x.position + rotate(q_NB, l_B)
    v_l = ca.cross(w, l_B)
    a_l = ca.cross(w_rate, l_B) + ca.cross(w, v_l)
    return {
        **truth(
            q_NB,
            w,
            r_S,
            x.velocity + rotate(q_NB, v_l),
            acceleration(t, x, p) + rotate(q_NB, a_l),
            p.g,
            magnetic_field(t, p),
        ),
        "activity": activity(t, p),
        "skeleton": box(r_S, q_NB),
    }


def box(centre: Any, q_NB: Any) -> Any:
    """Corners (16, 3), in N, of the drawn body at this place (3,) and attitude."""
    corners = [ca.vertcat(*(edge * ((c >> i & 1) - 0.5) for i, edge in enumerate(BOX))) for c in ROUND_THE_BOX]
    return ca.horzcat(*(centre + rotate(q_NB, corner) for corner in corners)).T


def _random(
    name: str, unit: str, mean: float, peak: float, band: tuple[float, float], what: str
) -> tuple[Parameter, ...]:
    """Parameters of one random vector."""
    low, high = band
    return (
        real(f"{name}_mean", unit, mean, (0, 1e3), f"Mean length of the {what} while moved"),
        real(f"{name}_peak_to_mean", "1", peak, (1.5, 20), f"Largest length of the {what} divided by its mean"),
        real(f"{name}_low_frequency", "Hz", low, (0, 100), f"Low end of the band of the {what}"),
        real(f"{name}_high_frequency", "Hz", high, (0, 100), f"High end of the band of the {what}"),
    )


BLOCK = ContinuousBlock(
    name="handheld",
    summary="Rigid body in a random hand: shaken and turned at stated accelerations and rates, in bursts or always",
    doc="""A body turned by random rates about its own axes and shaken by random accelerations of its centre of
rotation. Mean and peak_to_mean state the length of each vector while the body is moved: the length never exceeds
mean times peak_to_mean (but for the soft pull of the hand), nears it in most records, and its mean is met on average
over seeds, in a single record to a tenth or so. Bursts of motion lie between burst_start and burst_stop and include
their ramps; with bursts = 0 the body moves from the start on. With motion 1 the velocity is that of Rizun 2008, white
up to velocity_cutoff. The seed decides everything random, at the start; the run itself is deterministic. A magnetic
disturbance is a constant vector added to the Earth's field in its intervals. Rotation is not limited: the body
tumbles, as no hand does for long. The position is that of the integrated acceleration and may drift between bursts.""",
    reference="J. K. Lee, E. J. Park, S. N. Robinovitch, IEEE TIM 61(8), 2012, doi:10.1109/TIM.2012.2187245; "
    "J. K. Lee, M. J. Choi, Sensors 18(9), 2018, doi:10.3390/s18092775; P. Rizun, Journal of Navigation 61, 2008, "
    "doi:10.1017/S0373463308004736 (the motions)",
    inputs=(),
    outputs=OUTPUTS,
    locals=(
        Signal("activity", "1", "1 while the body is moved, 0 at rest, between in a ramp", 0, 1),
        v.skeleton(len(ROUND_THE_BOX)),
    ),
    own_parameters=(
        *PARAMETERS,
        integer("motion", HAND, (HAND, WHITE_VELOCITY), "Translation: 0 hand, 1 white velocity (Rizun 2008)"),
        *_random("acceleration", "m/s2", 2.0, 3.0, (0.3, 1.5), "acceleration of motion 0"),
        *_random("rate", "rad/s", 1.0, 3.0, (0.1, 0.8), "angular velocity"),
        real("velocity_noise_density", "m/s/sqrt(Hz)", 1.0, (0, 1e3), "Motion 1: delta_v, one-sided density"),
        real("velocity_cutoff", "rad/s", 10.0, (1e-3, 1e3), "Motion 1: omega_c, where the density has fallen by half"),
        integer("bursts", 0, (0, BURSTS), "Number of bursts of motion; 0 moves all the time"),
        times("burst_start", BURSTS, "Start of each burst"),
        times("burst_stop", BURSTS, "End of each burst"),
        real("burst_ramp", "s", 0.3, (0.01, 1e6), "Time in which a burst grows, and fades, inside its times"),
        switch("turns_at_rest", "0 turns in the bursts only, 1 turns all the time"),
        real("initial_attitude", "rad", 0.0, (-pi, pi), "Roll, pitch, yaw at the start", shape=(3,)),
        switch("random_attitude", "1 starts at an attitude drawn from all there are, 0 at initial_attitude"),
        real("imu_position", "m", 0.0, (-10, 10), "Sensor from the centre of rotation, in S", shape=(3,)),
    ),
    state=(
        State("attitude", (4,)),
        State("velocity", (3,)),
        State("position", (3,)),
        State("rate_frequency", (3, LINES)),
        State("rate_phase", (3, LINES)),
        State("frequency", (3, LINES)),
        State("phase", (3, LINES)),
    ),
    initial=initial,
    dynamics=dynamics,
    output=output,
    longest_step=2e-3,
    normals=ATTITUDE_DRAWS + 2 * DRAWS,
)
