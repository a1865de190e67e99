"""Frames of the vehicle: N, road, body, sensor; the motion of the sensor by differentiation.

    P       x.position      point of the road under the centre of mass, in N (m)
    psi     x.heading       from East towards North (rad)
    gamma   x.grade[0]      slope of the road along the car, positive uphill (rad)
    beta    x.bank[0]       slope of the road across the car, positive where the right side is lower (rad)
    phi, theta  x.body_angle    roll and pitch of the body on its springs (rad)
    vx, vy, r   x.velocity, x.yaw_rate      of P along the road's axes; turn about the road's normal

All axes are those of ISO 8855: x forward, y left, z up; angles are right-handed, so uphill and nose up are negative
pitch. The road plane is tangent to the road under the car and moves with it:

    R_NR = Rz(psi) Ry(-gamma) Rx(beta)                                                            (1)
    P' = R_NR (vx, vy, 0)                                                                         (2)
    psi' = (r - gamma' sin(beta)) / (cos(beta) cos(gamma))                                        (3)

(3) solves the z component of the road's angular velocity for psi'. The pitch axis lies in the road under the centre of
mass, the roll axis h_a above it. With h_s the height of the body's centre of mass and l the sensor from there,

    r_S = P + R_NR Ry(theta) ((0, 0, h_a) + Rx(phi) ((0, 0, h_s - h_a) + l))                      (4)
"""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import casadi as ca

from ...blocks.rotations import multiply, quaternion_from_euler, rotate, rotate_back

ROLL, PITCH = 0, 1

# What (4) depends on, and what its derivatives add.
COORDINATES = ("position", "heading", "body_angle", "grade", "bank")
MOTION = (*COORDINATES, "velocity", "yaw_rate", "body_rate")


def road_attitude(x: SimpleNamespace) -> Any:
    """q_NR (4,). (1)"""
    return quaternion_from_euler(x.bank[0], -x.grade[0], x.heading)


def body_attitude(x: SimpleNamespace) -> Any:
    """q_RB (4,): body on the road."""
    return quaternion_from_euler(x.body_angle[ROLL], x.body_angle[PITCH], 0)


def up_in_road(x: SimpleNamespace) -> Any:
    """Unit vector that points up, along the road's axes (3,)."""
    slope, bank = x.grade[0], x.bank[0]
    return ca.vertcat(ca.sin(slope), ca.cos(slope) * ca.sin(bank), ca.cos(slope) * ca.cos(bank))


def coordinate_rates(x: SimpleNamespace) -> dict[str, Any]:
    """Time derivative of every one of COORDINATES. (2), (3)"""
    heading_rate = (x.yaw_rate - x.grade[1] * ca.sin(x.bank[0])) / (ca.cos(x.bank[0]) * ca.cos(x.grade[0]))
    return dict(
        position=rotate(road_attitude(x), ca.vertcat(x.velocity, 0)),
        heading=heading_rate,
        body_angle=x.body_rate,
        grade=ca.vertcat(x.grade[1:], 0),  # the second derivative is a state: its own rate does not enter
        bank=ca.vertcat(x.bank[1:], 0),
    )


def turn_rate(roll: Any, pitch: Any, roll_rate: Any, pitch_rate: Any, yaw_rate: Any) -> Any:
    """Angular velocity (3,), turned axes, of a frame whose Z-Y-X angles have these rates (rad/s)."""
    along_z = ca.vertcat(-ca.sin(pitch), ca.cos(pitch) * ca.sin(roll), ca.cos(pitch) * ca.cos(roll))
    return ca.vertcat(roll_rate, 0, 0) + pitch_rate * ca.vertcat(0, ca.cos(roll), -ca.sin(roll)) + yaw_rate * along_z


def body_turn_rate(x: SimpleNamespace) -> Any:
    """Angular velocity of the body relative to N, in the body (3,)."""
    heading_rate = coordinate_rates(x)["heading"]
    road = turn_rate(x.bank[0], -x.grade[0], x.bank[1], -x.grade[1], heading_rate)
    own = turn_rate(x.body_angle[ROLL], x.body_angle[PITCH], x.body_rate[ROLL], x.body_rate[PITCH], 0)
    return rotate_back(body_attitude(x), road) + own


def in_N(x: SimpleNamespace, l_B: Any, p: SimpleNamespace) -> Any:
    """Point of the body (3,), given from its centre of mass, in N. (4)"""
    axis = ca.vertcat(0, 0, p.roll_axis_height)
    arm = ca.vertcat(0, 0, p.body_com_height - p.roll_axis_height) + l_B
    about_x = quaternion_from_euler(x.body_angle[ROLL], 0, 0)
    about_y = quaternion_from_euler(0, x.body_angle[PITCH], 0)
    return x.position + rotate(road_attitude(x), rotate(about_y, axis + rotate(about_x, arm)))


def sensor_motion(x: SimpleNamespace, rates: Mapping[str, Any], p: SimpleNamespace) -> tuple[Any, Any, Any, Any, Any]:
    """q_NS (4,), angular velocity in S (3,), position, velocity, acceleration in N (3,) of the sensor.

    rates: time derivative of every state.
    """
    s = SimpleNamespace(**{name: ca.SX.sym(name, getattr(x, name).numel()) for name in MOTION})
    first = coordinate_rates(s)
    r = in_N(s, p.imu_position, p)
    q = ca.vertcat(*(getattr(s, name) for name in COORDINATES))
    v = ca.jtimes(r, q, ca.vertcat(*(first[name] for name in COORDINATES)))
    a = ca.jtimes(v, ca.vertcat(*vars(s).values()), ca.vertcat(*(rates[name] for name in MOTION)))
    q_BS = quaternion_from_euler(*ca.vertsplit(p.mount))
    q_NS = multiply(multiply(road_attitude(s), body_attitude(s)), q_BS)
    w_S = rotate_back(q_BS, body_turn_rate(s))
    now = [ca.vertcat(getattr(x, name)) for name in MOTION]
    found: tuple[Any, Any, Any, Any, Any] = tuple(ca.substitute([q_NS, w_S, r, v, a], list(vars(s).values()), now))
    return found
