"""The body that carries the sensor: proportions, posture, and where every joint and segment is.

    symbol      here                unit    meaning
    H           p.height            m       height of the person
    r_P         position            m       centre of the pelvis, midway between the hips, in the path frame
    q_PB        q                   1       attitude of a segment, B to the path frame
    alpha       abduction           rad     thigh away from the middle of the body
    theta       hip, knee, ankle    rad     flexion: thigh forwards, shank backwards, toes up

Path frame P: x forwards, y left, z up, origin on the ground; N is P turned back by ``heading``. The frame of every
segment is P where the person stands upright: x forwards, y left, z up. With signs for the right leg (the left one
mirrors alpha),

    pelvis   q = Rz(yaw) Ry(pitch) Rx(roll)                                            (1)
    thigh    q_thigh = q_pelvis Rx(-alpha) Ry(-hip),    hip at r_P + q_pelvis (0, -b, 0)      (2)
    shank    q_shank = q_thigh Ry(knee),                knee at hip + q_thigh (0, 0, -l_1)    (3)
    foot     q_foot = q_shank Ry(-ankle),               ankle at knee + q_shank (0, 0, -l_2)  (4)
    trunk    q_trunk = Rz(yaw) Ry(pitch) Rx(roll) of its own angles, from r_P          (5)

Proportions in parts of H are those of Drillis and Contini as printed in [1], figure 4.1; where the hips lie in the
pelvis, and heel and ball under the ankle, is chosen. Toes, which bend as the heel rises, are left out.

[1] Winter, Biomechanics and Motor Control of Human Movement, Wiley, 4th edition 2009
"""

from __future__ import annotations

from dataclasses import astuple, dataclass
from math import radians
from types import SimpleNamespace
from typing import Any

import casadi as ca

from ...blocks.rotations import multiply, quaternion_from_euler, rotate

PELVIS, THIGH, SHANK, FOOT, TRUNK = range(5)
SEGMENTS = ("pelvis", "thigh", "shank", "foot", "trunk")

# In parts of the height [1].
THIGH_LENGTH = 0.245
SHANK_LENGTH = 0.246
ANKLE_HEIGHT = 0.039
TRUNK_LENGTH = 0.288  # hips to shoulders
HEAD_LENGTH = 0.182
HIP_HEIGHT = THIGH_LENGTH + SHANK_LENGTH + ANKLE_HEIGHT
# Chosen.
HALF_PELVIS = 0.05
HEEL = (-0.038, 0.0, -ANKLE_HEIGHT)  # from the ankle
BALL = (0.08, 0.0, -ANKLE_HEIGHT)

# Middle of each segment, from its upper joint (the trunk and the pelvis: from the centre of the pelvis).
MIDDLE = (
    (0.0, 0.0, 0.0),
    (0.0, 0.0, -THIGH_LENGTH / 2),
    (0.0, 0.0, -SHANK_LENGTH / 2),
    (0.04, 0.0, -ANKLE_HEIGHT / 4),  # the instep
    (0.0, 0.0, TRUNK_LENGTH / 2),
)

PELVIC_TILT = radians(10)  # forwards, in standing; so much a hip is flexed by where the thigh is upright

SKELETON_POINTS = 16


@dataclass(frozen=True)
class Leg:
    """Angles of one leg (rad)."""

    hip: Any
    knee: Any
    ankle: Any
    abduction: Any = 0


@dataclass(frozen=True)
class Posture:
    """Where the pelvis is (m, path frame) and how the body is bent (rad); trunk and pelvis: roll, pitch, yaw."""

    position: Any
    pelvis: tuple[Any, Any, Any]
    trunk: tuple[Any, Any, Any]
    right: Leg
    left: Leg

    def column(self) -> Any:
        """All of it, to choose between postures."""
        return ca.vertcat(self.position, *self.pelvis, *self.trunk, *astuple(self.right), *astuple(self.left))


def posture_from(column: Any) -> Posture:
    """The posture of a column."""
    x = ca.vertsplit(column)
    return Posture(ca.vertcat(*x[:3]), (x[3], x[4], x[5]), (x[6], x[7], x[8]), Leg(*x[9:13]), Leg(*x[13:17]))


def standing(p: SimpleNamespace) -> Posture:
    """Upright, legs straight."""
    leg = Leg(PELVIC_TILT, 0, 0)
    return Posture(ca.vertcat(0, 0, HIP_HEIGHT * p.height), (0, PELVIC_TILT, 0), (0, 0, 0), leg, leg)


@dataclass(frozen=True)
class Placed:
    """A segment in the path frame: its upper joint (3,), m, and its attitude (4,)."""

    joint: Any
    q: Any

    def point(self, place: Any) -> Any:
        """A point of the segment, (3,) from its joint."""
        return self.joint + rotate(self.q, place)


def about_y(angle: Any) -> Any:
    """Quaternion (4,) of a turn about y; positive leans forwards."""
    return quaternion_from_euler(0, angle, 0)


def leg_segments(pelvis: Placed, leg: Leg, side: int, height: Any) -> tuple[Placed, Placed, Placed]:
    """Thigh, shank and foot; side: 1 left, -1 right. (2) to (4)"""
    q_thigh = multiply(multiply(pelvis.q, quaternion_from_euler(side * leg.abduction, 0, 0)), about_y(-leg.hip))
    thigh = Placed(pelvis.point(ca.vertcat(0, side * HALF_PELVIS * height, 0)), q_thigh)
    shank = Placed(thigh.point(ca.vertcat(0, 0, -THIGH_LENGTH * height)), multiply(q_thigh, about_y(leg.knee)))
    ankle = shank.point(ca.vertcat(0, 0, -SHANK_LENGTH * height))
    return thigh, shank, Placed(ankle, multiply(shank.q, about_y(-leg.ankle)))


def segments(posture: Posture, height: Any) -> tuple[Placed, ...]:
    """The five segments of SEGMENTS, of the right leg. (1) to (5)"""
    pelvis = Placed(posture.position, quaternion_from_euler(*posture.pelvis))
    trunk = Placed(posture.position, quaternion_from_euler(*posture.trunk))
    return pelvis, *leg_segments(pelvis, posture.right, -1, height), trunk


def skeleton(posture: Posture, height: Any) -> Any:
    """Points (16, 3) in the path frame: head, down the right leg, back to the hip, across, down the left leg.

    A leg: hip, knee, ankle, heel, ball, ankle again.
    """
    pelvis, *right, trunk = segments(posture, height)
    left = leg_segments(pelvis, posture.left, 1, height)

    def down(thigh: Placed, shank: Placed, foot: Placed) -> list[Any]:
        heel, ball = (foot.point(height * ca.vertcat(*place)) for place in (HEEL, BALL))
        return [thigh.joint, shank.joint, foot.joint, heel, ball, foot.joint]

    head = trunk.point(ca.vertcat(0, 0, (TRUNK_LENGTH + HEAD_LENGTH) * height))
    first, second = down(*right), down(*left)
    back = [first[1], first[0]]
    return ca.horzcat(head, pelvis.joint, *first, *back, *second).T
