"""Three records of a backpack with an IMU in it, after Zihajehzadeh et al. 2014: left alone, jumping, rollerblading.

Z-Y-X angles, acceleration and magnetic field are functions of time; what an IMU reads follows from them exactly. Chosen
freely, as the paper tells the lengths of the disturbances (5, 10, 15 s), the largest specific force of the jump
(40 m/s2) and "low to medium" acceleration only:

At rest. Level, for 120 s; a constant disturbance of the field comes and goes within a second, three times.

Jump. Stand, crouch, push off, fly for half a second, land hard, stand: raised cosines, and free fall in flight. No
velocity is left in the end. The trunk leans forward before the flight and after it.

Rollerblading. Stand for 2 s, then random acceleration of mean length 2.5 m/s2 and largest length 7.5 m/s2 at 0.5 to
2 Hz, the pace of strides and pushes. The trunk leans by 15 deg and sways at 0.3 to 1.2 Hz; two rounds of a rink.

The field is one of 54 uT that dips by 70.5 deg, as where the paper was written.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import cos, pi, radians, sin, sqrt
from typing import Any

import casadi as ca
import numpy as np

from ...blocks.rotations import conjugate, multiply, over_rows, quaternion_from_euler
from ...blocks.running import Trajectory
from ...blocks.vocabulary import GRAVITY, POSITION, VELOCITY
from ...plants.random_vectors import LINES, random_vector, sum_of_lines
from ...plants.time_functions import along, smooth_step, windows
from ...plants.truth import OUTPUTS, truth

NORM, DIP = 54.0, radians(70.5)  # uT, rad
FIELD = (0.0, NORM * cos(DIP), -NORM * sin(DIP))  # East, North, Up
SPANS = ((20.0, 5.0), (45.0, 10.0), (80.0, 15.0))  # s: start and length of each disturbance in full: sec. IV.A
RAMP = 1.0  # s, in which a disturbance comes, before, and goes, after
REST_DURATION = 120.0  # s
PEAK = 40.0  # m/s2, largest specific force of the jump: sec. IV.B of the paper
JUMP_DURATION, SKATING_DURATION = 8.0, 120.0  # s
ROUNDS = 2

_SIGNALS = tuple(signal for signal in OUTPUTS if signal not in (POSITION, VELOCITY))

Of = Callable[[Any], Any]
Terms = Sequence[tuple[float, float, float]]


def undisturbed(t: Any) -> Any:
    """The field everywhere and always."""
    return ca.DM(FIELD)


def moved(euler: Of, acceleration: Of, duration: float, period: float, field: Of = undisturbed) -> Trajectory:
    """Truth and ideal readings every ``period`` (s), by the names of a plant's outputs; not position and velocity.

    euler, acceleration, field: CasADi columns (3,) as functions of time: roll, pitch, yaw (rad); in N (m/s2, uT).
    """

    def at(t: Any) -> tuple[Any, ...]:
        q_NS, q_rate, _ = along(lambda s: quaternion_from_euler(*ca.vertsplit(euler(s))), t, 1)
        w_S = 2 * multiply(conjugate(q_NS), q_rate)[1:]
        nowhere = ca.SX.zeros(3)
        values = truth(q_NS, w_S, nowhere, nowhere, acceleration(t), GRAVITY, field(t))
        return tuple(values[signal.name] for signal in _SIGNALS)

    time = np.arange(round(duration / period) + 1) * period
    columns = np.split(over_rows(at, time), np.cumsum([signal.size for signal in _SIGNALS])[:-1], axis=1)
    named = zip(_SIGNALS, columns, strict=True)
    return Trajectory(time, {s.name: c.reshape(len(time), *s.shape) for s, c in named})


def at_rest(disturbance: Sequence[float], period: float) -> Trajectory:
    """No motion; the disturbance (East, North, Up, uT) is added in SPANS."""
    starts, stops = ([start - RAMP for start, _ in SPANS], [start + length + RAMP for start, length in SPANS])

    def field(t: Any) -> Any:
        return FIELD + windows(t, len(SPANS), ca.DM(starts), ca.DM(stops), RAMP) * ca.DM(list(disturbance))

    return moved(lambda t: ca.SX.zeros(3), lambda t: ca.SX.zeros(3), REST_DURATION, period, field)


def pulse(since: Any, width: float) -> Any:
    """Raised cosine of height 1 and area width / 2 about 0."""
    return ca.if_else(ca.fabs(since) < width / 2, (1 + ca.cos(2 * pi * since / width)) / 2, 0)


def pulses(t: Any, terms: Terms) -> Any:
    """Sum of pulses, (centre in s, width in s, height) each."""
    return sum(height * pulse(t - centre, width) for centre, width, height in terms)


def jump(seed: int, period: float) -> Trajectory:
    """A vertical jump, between 2 and 4.5 s. period: s, of which 0.05 is a multiple, so that a sample sees the peak."""
    rng = np.random.default_rng(seed)

    def about(mean: float, spread: float) -> float:
        return mean + spread * rng.uniform(-1, 1)

    dip, push, flight, land = 2.25, 2.75, 3.25, 3.55  # s: centres
    stretch, edge, thump = 0.4, 0.2, 0.14  # s: free fall, its raised-cosine edges (as a pulse), width of the landing
    crouch, across = about(-4.0, 1.0), [about(1.2, 0.6), about(0.0, 0.6)]  # m/s2
    brake = 0.5 / thump  # of ``across``: takes the velocity that the push has given
    crash = sqrt(PEAK**2 - (brake * across[0]) ** 2 - (brake * across[1]) ** 2) - GRAVITY
    fallen = GRAVITY * (stretch + edge / 2)  # m/s
    kick = (fallen - crash * thump / 2 - crouch * 0.5 / 2) / (0.5 / 2)

    def acceleration(t: Any) -> Any:
        falling = pulse(ca.fmax(ca.fabs(t - flight) - stretch / 2, 0), edge)
        up = pulses(t, [(dip, 0.5, crouch), (push, 0.5, kick), (land, thump, crash)]) - GRAVITY * falling
        level = pulses(t, [(push, 0.5, 1.0), (land, thump, -brake)])
        return ca.vertcat(across[0] * level, across[1] * level, up)

    stand = about(0, 0.05), about(0.1, 0.1), about(0, pi)  # rad, as all angles below
    roll = [(2.6, 1.0, about(0, 0.08)), (3.6, 0.8, about(0, 0.1))]
    pitch = [(2.5, 1.2, about(0.45, 0.15)), (3.25, 0.7, about(-0.15, 0.1)), (3.9, 1.2, about(0.4, 0.15))]
    yaw = [(2.7, 1.0, about(0, 0.1)), (3.6, 1.2, about(0, 0.15))]

    def euler(t: Any) -> Any:
        return ca.vertcat(*(at + pulses(t, terms) for at, terms in zip(stand, (roll, pitch, yaw), strict=True)))

    return moved(euler, acceleration, JUMP_DURATION, period)


def skating(seed: int, period: float, *, stand: float = 2.0, speed: float = 0.0) -> Trajectory:
    """Rollerblading on a rink, after ``stand`` (s) and a second of starting. Negative: from the first sample on.

    speed: m/s, for the centripetal acceleration of the rounds; 0 leaves it out.
    """
    rng = np.random.default_rng(seed)

    def lines(low: float, high: float) -> tuple[Any, Any]:
        """Frequencies (Hz) in the band, one in each of LINES equal parts, and phases, (3, LINES) each."""
        place = (np.arange(LINES) + rng.uniform(size=(3, LINES))) / LINES
        return ca.DM(low + place * (high - low)), ca.DM(rng.uniform(0, 2 * pi, (3, LINES)))

    pushes, sway = lines(0.5, 2.0), lines(0.3, 1.2)
    sway_rms = ca.DM([radians(5), radians(5), radians(8)])  # roll, pitch, yaw
    start, turn = rng.uniform(-pi, pi), 2 * pi * ROUNDS / SKATING_DURATION  # rad, rad/s

    def acceleration(t: Any) -> Any:
        to_the_left = ca.vertcat(-ca.sin(start + turn * t), ca.cos(start + turn * t), 0)
        return smooth_step(t - stand) * (random_vector(t, *pushes, 2.5, 3.0) + speed * turn * to_the_left)

    def euler(t: Any) -> Any:
        going = smooth_step(t - stand)
        course = ca.vertcat(0, radians(15), start + going * turn * t)
        return course + going * sway_rms * sum_of_lines(t, sqrt(2 / LINES), *sway)

    return moved(euler, acceleration, SKATING_DURATION, period)
