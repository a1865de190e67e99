"""Vertical jump, rollerblading and sit-to-stand as smooth functions of time.

    symbol      here                    unit    meaning
    t           t                       s       time since the rest before the motion
    S, J, K     smooth_step, step_integral, step_double_integral
    l_1, l_2                            m       thigh, shank
    kappa       knee                    rad     flexion of the knee

Jump. z is the height of the pelvis over that of a stance with slightly bent knees, up to its highest point at t_a;
after it the motion runs backwards, so the landing is as soft as the push-off. With the rise h in flight, the take-off
speed v = sqrt(2 g h), the push T = 35 v / (16 a) for a peak acceleration a (35/16 is the steepest slope of S), the time
T_r in which the ground is released, and a dip of d in the time T_d before. The way of the push, v T / 2, is at most
that of the deepest dip and the heels: legs too short for a gentle push make it shorter and harder.

    z = -d S(t / T_d) + v T J((t - T_d) / T) - g T_r^2 K((t - T_d - T) / T_r)          (1)
    t_a = T_d + T + T_r / 2 + v / g,   d = v T / 2 - height at take-off                (2)

From the end of the release to its mirror image the pelvis, which stands for the centre of the body, is in free fall. Up
to there the hip is over the ankle, and the length L of the leg from hip to ankle follows z, while it is below 0,

    L = L_0 + (z - sqrt(z^2 + eps^2) + eps) / 2                                        (3)
    cos kappa = (L^2 - l_1^2 - l_2^2) / (2 l_1 l_2)                                    (4)

so the legs bend while z < 0, and heels, then feet, leave the ground while z > 0, all to within eps / 2.

Rollerblading. Strokes to the left and to the right in turn, each for the time T_s. A square wave of three harmonics
(Lanczos' factors), within 3 % of its plateau for 60 % of each stroke, accelerates the pelvis sideways; pelvis and trunk
lean as a body must that is to balance under this acceleration:

    y'' = a_max s(t),  s = sum_k c_k sin(k pi t / T_s),  k = 1, 3, 5                   (5)
    roll = -atan(y'' / g)                                                              (6)

The leg on the outer side pushes: it spreads and stretches; the other one carries with its knee bent. Their angles are
chosen so that both feet stay near the ground, as is the forward lean of the trunk.

Sit-to-stand. The feet stay on the ground. The trunk leans forwards while the thighs rest on the seat, then thighs and
shanks rise while it comes back up; the position follows from the ankle upwards. Angles and the order of the turns are
chosen; the whole takes 1.7 to 2.3 s in healthy men [1].

[1] An analysis of sit-to-stand movements, Archives of Physical Medicine and Rehabilitation 74, 1993,
    doi:10.1016/0003-9993(93)90068-L
"""

from __future__ import annotations

from math import pi, radians, sin
from types import SimpleNamespace
from typing import Any

import casadi as ca

from ..time_functions import smooth_step, step_double_integral, step_integral
from .body import ANKLE_HEIGHT, BALL, PELVIC_TILT, SHANK_LENGTH, THIGH_LENGTH, Leg, Posture

LEAST_GRAVITY = 0.1  # m/s2: with less, jump and lean move as with this; without any, a jump would never end

# Jump; lengths in parts of the height.
DIP_TIME = 0.4  # s
RELEASE_TIME = 0.03  # s
SOFTNESS = 0.017  # eps
STANCE_LENGTH = THIGH_LENGTH + SHANK_LENGTH - 0.6 * SOFTNESS  # L_0: legs not quite straight
HEEL_RISE = 0.05
DEEPEST_DIP = 0.3
TIPTOE = radians(40)  # the foot hangs down so far in flight


def bent_leg(length: Any, rise: Any, pelvis_pitch: Any, height: Any) -> Leg:
    """Leg whose hip is ``length`` (m) over its ankle, which is lifted by ``rise`` (m). (4)"""
    l_1, l_2 = THIGH_LENGTH * height, SHANK_LENGTH * height
    knee = ca.acos((length**2 - l_1**2 - l_2**2) / (2 * l_1 * l_2))
    thigh = ca.asin(l_2 * ca.sin(knee) / length)
    foot = TIPTOE * ca.tanh(rise / (TIPTOE * BALL[0] * height))
    return Leg(thigh + pelvis_pitch, knee, knee - thigh - foot)


def gravity(p: SimpleNamespace) -> Any:
    """g (m/s2) that decides how the body moves."""
    return ca.fmax(p.g, LEAST_GRAVITY)


def jump_times(p: SimpleNamespace) -> tuple[Any, Any, Any, Any]:
    """Take-off speed v (m/s), push T (s), highest point t_a (s), dip d (m). (2)"""
    v = ca.sqrt(2 * gravity(p) * p.jump_height)
    push = ca.fmin(35 / 16 * v / p.jump_acceleration, 2 * (DEEPEST_DIP + HEEL_RISE) * p.height / v)
    dip = v * push / 2 - ca.fmin(HEEL_RISE * p.height, v * push / 4)
    return v, push, DIP_TIME + push + RELEASE_TIME / 2 + v / gravity(p), dip


def jump(t: Any, p: SimpleNamespace) -> Posture:
    """Dip, push-off, flight, landing. (1) to (4)"""
    v, push, highest, dip = jump_times(p)
    since = highest - ca.fabs(t - highest)
    z = -dip * smooth_step(since / DIP_TIME) + v * push * step_integral((since - DIP_TIME) / push)
    z -= gravity(p) * RELEASE_TIME**2 * step_double_integral((since - DIP_TIME - push) / RELEASE_TIME)
    eps = SOFTNESS * p.height
    bend = (z - ca.sqrt(z**2 + eps**2) + eps) / 2
    lean = -2 * bend / p.height  # rad: 20 deg for a dip of 30 cm
    leg = bent_leg(STANCE_LENGTH * p.height + bend, z - bend, PELVIC_TILT + lean, p.height)
    position = ca.vertcat(0, 0, (STANCE_LENGTH + ANKLE_HEIGHT) * p.height + z)
    return Posture(position, (0, PELVIC_TILT + lean, 0), (0, 2 * lean, 0), leg, leg)


# Rollerblading.
LANCZOS = 7
SQUARE_WAVE = {k: 4 / (pi * k) * sin(pi * k / LANCZOS) / (pi * k / LANCZOS) for k in (1, 3, 5)}  # c_k
CARRYING_KNEE, PUSHING_KNEE, SPREAD = radians(55), radians(15), radians(20)
SKATING_PITCH, SKATING_LEAN = radians(25), radians(35)  # of pelvis and trunk
SKATING_HEIGHT, SKATING_DIP = 0.491, 0.022  # of the pelvis, and how much lower it is in mid-stroke; parts of the height


def push_leg(s: Any) -> Leg:
    """The right leg, which pushes where s is 1."""
    push = ((1 + s) / 2) ** 2
    knee = CARRYING_KNEE + (PUSHING_KNEE - CARRYING_KNEE) * push
    return Leg(knee / 2 + SKATING_PITCH, knee, knee / 2, SPREAD * push)


def skating(t: Any, p: SimpleNamespace) -> Posture:
    """Strokes, first to the left; the position without the way forwards. (5) (6)"""
    omega = pi / p.stroke_time
    s, double_integral = 0, 0
    for k, c in SQUARE_WAVE.items():
        s += c * ca.sin(k * omega * t)
        double_integral -= c * ca.sin(k * omega * t) / (k * omega) ** 2
    roll = -ca.atan(p.lateral_acceleration * s / gravity(p))
    z = (SKATING_HEIGHT - SKATING_DIP * ca.sin(omega * t) ** 2) * p.height
    return Posture(
        position=ca.vertcat(0, p.lateral_acceleration * double_integral, z),
        pelvis=(roll, SKATING_PITCH, 0),
        trunk=(roll, SKATING_LEAN, 0),
        right=push_leg(s),
        left=push_leg(-s),
    )


# Sit-to-stand.
SEATED_THIGH, SEATED_SHANK, FORWARD_SHANK = radians(85), radians(10), radians(20)
TRUNK_LEAN = radians(40)


def sit_to_stand(t: Any, p: SimpleNamespace) -> Posture:
    """From the seat to upright within ``rise_time``."""
    s = t / p.rise_time

    def between(start: float, stop: float) -> Any:
        return smooth_step((s - start) / (stop - start))

    rising = between(0.3, 1.0)
    trunk = TRUNK_LEAN * (between(0.0, 0.45) - between(0.4, 1.0))
    thigh = SEATED_THIGH * (1 - rising)
    shank = SEATED_SHANK + (FORWARD_SHANK - SEATED_SHANK) * between(0.25, 0.5) - FORWARD_SHANK * between(0.45, 1.0)
    hip_x = SHANK_LENGTH * ca.sin(shank) - THIGH_LENGTH * ca.sin(thigh)
    hip_z = ANKLE_HEIGHT + SHANK_LENGTH * ca.cos(shank) + THIGH_LENGTH * ca.cos(thigh)
    pitch = PELVIC_TILT * between(0.0, 0.3) + trunk / 2
    leg = Leg(thigh + pitch, thigh + shank, shank)
    return Posture(p.height * ca.vertcat(hip_x, 0, hip_z), (0, pitch, 0), (0, trunk, 0), leg, leg)
