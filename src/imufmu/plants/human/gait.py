"""Level walking and running: joint angles and pelvis over the gait cycle as Fourier series.

    symbol      here                unit    meaning
    phi         phase               1       gait cycle, 0 where the right foot meets the ground; the left one is at 1/2
    v, c        p.speed, p.cadence  m/s, 1/min      steps per minute; a stride is two steps
    e           envelope            1       0 standing, 1 walking
    L           stride              m       length of a stride, 120 v / c
    theta       series              deg     hip, knee, ankle: flexion; pelvis: forward tilt

    theta(phi) = a_0 + sum_k a_k cos(2 pi k phi) + b_k sin(2 pi k phi),  k = 1 .. 5     (1)
    hip: the oscillating part times L / L_0, where L_0 is the stride of the published curve     (2)
    posture = standing + e (gait - standing)                                           (3)
    x = v int e dt + e sway(phi)                                                       (4)

Key points. Walking: the angles at the ends of the phases of the gait cycle [1] (hip: the thigh's to the vertical, plus
10 deg of pelvic tilt; the largest bend of the knee, 60 to 70, read as 62 at 73 % of the cycle). Running: hip, knee and
ankle at foot strike, mid stance and toe-off and their largest [2]; when they occur in the cycle, the ankle at foot
strike and in the swing, the knee at toe-off and the hip at 90 % are ours. WALKING.key_points and RUNNING.key_points
hold them, in percent of the cycle and deg. The coefficients are ours too: least squares over the key points together
with a stance foot that stays where it is on the ground, by models/human_segment/fit_gait.py, which prints the tables
and what is left over. Walking is fitted at 1.37 m/s and 113 steps/min, a usual pace, running at 3.3 m/s and 168.

The pelvis. Walking: it rises and falls twice per stride, by 46 mm in all [3], highest in the middle of each single
stance (30 and 80 % of the cycle), and sways once by 40 mm towards the foot that carries. Running: the ground pushes
with a half sine for the part BETA of each step and the rest is free flight; the height is the second integral of

    z'' = g (pi / (2 BETA) sin(pi psi / BETA) - 1) in contact, -g in flight, psi = 2 phi mod 1      (5)

to three harmonics, so its size follows from the cadence. Both: 4 deg of list, 5 deg of rotation to each side and a
small counter-rotation of the trunk, all chosen.

[1] Ottobock, The eight phases of human gait cycle, poster 400W43
[2] Abstract of the chapter doi:10.4324/9780203488300-34 (Taylor and Francis)
[3] Perry 1992, cited by Whittle, Human Movement Science 16, 1997, doi:10.1016/S0167-9457(96)00052-8
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, radians
from types import SimpleNamespace
from typing import Any

import casadi as ca

from ..time_functions import smooth_step, step_integral
from .body import HIP_HEIGHT, Leg, Posture

HARMONICS = 5

Series = tuple[float, ...]  # a_0, a_1, b_1, a_2, b_2, ...; deg


@dataclass(frozen=True)
class Gait:
    """Curves of one gait. Lengths in parts of the height of the person."""

    key_points: dict[str, tuple[tuple[float, float], ...]]  # by joint: percent of the cycle, deg
    flies: bool  # runs: the height of the pelvis is (5)
    stance: float  # part of the cycle that a foot is on the ground
    stride: float  # of the published curve
    hip: Series
    knee: Series
    ankle: Series
    pelvis: Series
    drop: float  # mean height of the hips below that of standing
    sway: tuple[float, float]  # forwards, once per step: cos, sin
    lean: float  # of the trunk, deg


WALKING = Gait(
    key_points={
        "hip": ((0, 30), (12, 30), (31, 10), (50, -10), (62, 0), (75, 25), (87, 35)),
        "knee": ((0, 5), (12, 20), (31, 5), (50, 5), (62, 40), (73, 62), (87, 25), (97, 5)),
        "ankle": ((0, 0), (8, -7), (31, 5), (48, 10), (62, -15), (75, -5), (87, 0)),
    },
    flies=False,
    stance=0.62,
    stride=1.455 / 1.75,
    hip=(16.67, 21.72, -3.33, -3.46, -1.69, 0.25, 2.42, -0.97, -0.34, -0.08, -0.16),
    knee=(20.90, -1.28, -20.03, -13.90, 7.62, 1.40, 6.10, -2.04, -1.34, -0.59, -0.15),
    ankle=(-0.34, -1.79, 5.12, 2.94, -6.74, -2.62, -0.10, 1.55, -1.39, -0.37, -2.20),
    pelvis=(10.0, 0.0, 0.0, 1.0, 0.0),
    drop=0.0116,
    sway=(0.0069, 0.0084),
    lean=2.0,
)
RUNNING = Gait(
    key_points={
        "hip": ((0, 45), (38, -9), (80, 55), (90, 50)),
        "knee": ((0, 25), (16, 40), (38, 20), (68, 90)),
        "ankle": ((0, 5), (19, 30), (40, -20), (70, 0)),
    },
    flies=True,
    stance=0.36,
    stride=2.357 / 1.75,
    hip=(25.38, 21.96, -21.39, -2.16, 3.07, -1.38, 2.07, 1.14, 0.52, -0.85, -1.41),
    knee=(47.19, -8.31, -25.98, -8.92, 14.47, -2.29, 0.99, -1.24, 0.22, -1.49, -0.56),
    ankle=(2.73, 16.11, 3.96, -7.36, 6.05, -6.37, -2.69, 0.42, -2.69, -0.56, 1.67),
    pelvis=(15.0, 0.0, 0.0, 2.0, 0.0),
    drop=0.0227,
    sway=(0.0002, 0.0007),
    lean=8.0,
)

WALKING_RISE, WALKING_SWAY = 0.046 / 1.75, 0.040 / 1.75  # peak to peak, in parts of the height
BETA = 2 * RUNNING.stance
RUNNING_HARMONICS = 3


def series(coefficients: Any, phase: Any, scale: Any = 1) -> Any:
    """The sum (1) in rad; the oscillating part times ``scale``."""
    oscillation = 0
    for k in range(1, (len(coefficients) + 1) // 2):
        a, b = coefficients[2 * k - 1], coefficients[2 * k]
        oscillation += a * ca.cos(2 * pi * k * phase) + b * ca.sin(2 * pi * k * phase)
    return pi / 180 * (coefficients[0] + scale * oscillation)


def leg(gait: Gait, phase: Any, scale: Any) -> Leg:
    """Angles of the leg whose foot meets the ground at phase 0. (1) (2)"""
    return Leg(series(gait.hip, phase, scale), series(gait.knee, phase), series(gait.ankle, phase))


def bounce(phase: Any) -> Any:
    """Height of a runner's pelvis about its mean, in parts of g T^2, T the time of a step. (5)"""
    z = 0
    for k in range(1, RUNNING_HARMONICS + 1):
        # Of the half sine, about the middle of the stance: (1 / BETA) cos(pi k BETA) / (1 - (2 k BETA)^2), doubled.
        force = 2 * ca.cos(pi * k * BETA) / (1 - (2 * k * BETA) ** 2)
        z -= force / (2 * pi * k) ** 2 * ca.cos(2 * pi * k * (2 * phase - BETA / 2))
    return z


def pelvis_offset(gait: Gait, phase: Any, p: SimpleNamespace) -> Any:
    """Pelvis (3,), m, about the point that moves on at constant speed at the height of the ground."""
    x = gait.sway[0] * ca.cos(4 * pi * phase) + gait.sway[1] * ca.sin(4 * pi * phase)
    if gait.flies:
        y, z = 0, bounce(phase) * p.g * (60 / p.cadence) ** 2
    else:
        y = -WALKING_SWAY / 2 * ca.cos(2 * pi * (phase - 0.3)) * p.height
        z = WALKING_RISE / 2 * ca.cos(4 * pi * (phase - 0.3)) * p.height
    return ca.vertcat(x * p.height, y, (HIP_HEIGHT - gait.drop) * p.height + z)


def gait_posture(gait: Gait, phase: Any, p: SimpleNamespace) -> Posture:
    """Posture at this phase; the position without the way gone."""
    stride = 120 * p.speed / p.cadence / p.height
    scale = stride / gait.stride
    turn = ca.cos(2 * pi * phase)
    return Posture(
        position=pelvis_offset(gait, phase, p),
        pelvis=(-radians(4) * ca.sin(2 * pi * phase), series(gait.pelvis, phase), radians(5) * turn),
        trunk=(radians(1) * ca.sin(2 * pi * phase), radians(gait.lean), -radians(3) * turn),
        right=leg(gait, phase, scale),
        left=leg(gait, phase + 0.5, scale),
    )


def envelope(t: Any, p: SimpleNamespace) -> tuple[Any, Any]:
    """e(t), and its integral (s): rest, ramp, motion, ramp, rest; a ramp is at most half of the motion."""
    ramp = ca.fmin(p.ramp, p.duration / 2)
    up = (t - p.rest) / ramp
    down = (t - p.rest - p.duration + ramp) / ramp
    return smooth_step(up) - smooth_step(down), ramp * (step_integral(up) - step_integral(down))


def stride_phase(t: Any, p: SimpleNamespace) -> Any:
    """phi, counted on from stride to stride; 0 at the end of the rest."""
    return (t - p.rest) * p.cadence / 120
