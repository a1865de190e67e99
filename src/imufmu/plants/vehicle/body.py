"""Motion of the vehicle on its road: planar, with the body's roll and pitch on springs.

    symbol        here                          unit          meaning
    vx, vy, r     x.velocity, x.yaw_rate        m/s, rad/s    along the road's axes, about its normal
    phi, theta    x.body_angle                  rad           roll, pitch of the body
    m, m_s        p.mass, p.body_mass           kg            of the whole car, of the body on its springs
    h_s           p.body_com_height             m             body's centre of mass above the road
    h = h_s - h_a p.roll_axis_height (h_a)      m             body's centre of mass above the roll axis
    a, b          p.front_distance, p.rear_distance   m       axles from the centre of mass
    f = a - g     f                             m/s2          acceleration minus gravity, along the road's axes
    up            up_in_road                    1             unit vector that points up, along the road's axes
    X, Y          forces                        N             of both axles and the air, along the road's axes

Planar motion, and a body that leans; terms of second order in phi and theta are left out, and the turn of the road
itself (grade and bank change slowly) does not push the car:

    m fx + m_s h_s theta'' = X,   m fy - m_s h phi'' = Y,   I_z r' = a Y_f - b Y_r               (1)
    (I_x + m_s h^2) phi'' - m_s h fy = m_s g h up_z sin(phi) - K_phi phi - D_phi phi'             (2)
    (I_y + m_s h_s^2) theta'' + m_s h_s fx = m_s g h_s up_z sin(theta) - K_theta theta - D_theta theta'    (3)
    vx' = fx - g up_x + r vy,   vy' = fy - g up_y - r vx                                          (4)

Grade and bank act through the gravity along the road in (4). The springs carry the moved load: the pitch moment along
the car, the roll moment across it, shared between the axles by their part of the roll stiffness; what acts at the
height of the roll axis crosses without the springs.

    F_zf = (b m g up_z + K_theta theta + D_theta theta') / L,   F_zr = m g up_z - F_zf            (5)
    dF_i = (part_i (K_phi phi + D_phi phi') + h_a Y_i) / track                                    (6)

The mass of the axles counts at the height of the road.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import casadi as ca

from .road import PITCH, ROLL, up_in_road
from .tyre import axle_friction, grip_rate, spin_rate, wrap_rate

FRONT, REAR = 0, 1


def wheelbase(p: SimpleNamespace) -> Any:
    """Distance between the axles (m)."""
    return p.front_distance + p.rear_distance


def swings(p: SimpleNamespace) -> tuple[Any, Any]:
    """Mass of the body times its height above the axes of pitch and roll (kg.m)."""
    return p.body_mass * p.body_com_height, p.body_mass * (p.body_com_height - p.roll_axis_height)


def steering_angle(x: SimpleNamespace, p: SimpleNamespace) -> Any:
    """Angle of the front wheels (rad), positive to the left."""
    return x.steering[0] / p.steering_ratio


def spring_moments(x: SimpleNamespace, p: SimpleNamespace) -> tuple[Any, Any]:
    """Moments (N.m) of springs and dampers against roll and pitch of the body."""
    roll = p.roll_stiffness * x.body_angle[ROLL] + p.roll_damping * x.body_rate[ROLL]
    pitch = p.pitch_stiffness * x.body_angle[PITCH] + p.pitch_damping * x.body_rate[PITCH]
    return roll, pitch


def axle_loads(x: SimpleNamespace, p: SimpleNamespace) -> tuple[Any, Any]:
    """Load (N) of the front and of the rear axle; an axle that leaves the road carries nothing. (5)"""
    weight = p.mass * p.g * up_in_road(x)[2]
    _, pitch_moment = spring_moments(x, p)
    front = ca.fmin(ca.fmax((p.rear_distance * weight + pitch_moment) / wheelbase(p), 0), weight)
    return front, weight - front


def contact_velocities(x: SimpleNamespace, p: SimpleNamespace) -> tuple[Any, Any]:
    """Velocity (2,), m/s, of the front and of the rear contact point, along and across the wheel."""
    delta = steering_angle(x, p)
    v_x, v_y = x.velocity[0], x.velocity[1]
    front_y, rear_y = v_y + p.front_distance * x.yaw_rate, v_y - p.rear_distance * x.yaw_rate
    along, across = ca.cos(delta) * v_x + ca.sin(delta) * front_y, ca.cos(delta) * front_y - ca.sin(delta) * v_x
    return ca.vertcat(along, across), ca.vertcat(v_x, rear_y)


def axles(x: SimpleNamespace, p: SimpleNamespace) -> SimpleNamespace:
    """Pairs (front, rear): load (N), friction (1), force (N) along and across the wheel, rate of the grip (1/s)."""
    found = SimpleNamespace(load=axle_loads(x, p), friction=[], along=[], across=[], grip_rate=[])
    roll_moment, _ = spring_moments(x, p)
    parts = p.front_roll_share, 1 - p.front_roll_share
    for i, velocity in enumerate(contact_velocities(x, p)):
        stiffness = ca.vertcat(p.longitudinal_stiffness, p.cornering_stiffness[i])
        rate, grip = grip_rate(velocity, p.wheel_radius * x.spin[i], x.grip[i, :].T, stiffness, p)
        load = found.load[i]
        moved = (parts[i] * roll_moment + p.roll_axis_height * p.friction * load * grip[1]) / p.track  # (6)
        friction = axle_friction(load, moved, p)
        found.friction.append(friction)
        found.along.append(friction * load * grip[0])
        found.across.append(friction * load * grip[1])
        found.grip_rate.append(rate.T)
    return found


def air_drag(x: SimpleNamespace, p: SimpleNamespace) -> Any:
    """Drag (N) of the air along the car, against its motion."""
    return p.air_density / 2 * p.drag_area * ca.fabs(x.velocity[0]) * x.velocity[0]


def wheel_shares(x: SimpleNamespace, p: SimpleNamespace, load: tuple[Any, Any]) -> tuple[tuple[Any, Any], ...]:
    """Drive force and largest dry friction (N) of the front and of the rear axle."""
    drive = p.front_drive_share, 1 - p.front_drive_share
    brake = p.front_brake_share, 1 - p.front_brake_share
    return tuple(
        (drive[i] * x.drive_force, brake[i] * x.brake_force + p.rolling_resistance * load[i]) for i in (FRONT, REAR)
    )


def motion(x: SimpleNamespace, p: SimpleNamespace) -> dict[str, Any]:
    """Time derivative of the states velocity, yaw_rate, body_rate, spin, grip, brake_wrap."""
    wheel = axles(x, p)
    delta, up = steering_angle(x, p), up_in_road(x)
    front_x = ca.cos(delta) * wheel.along[FRONT] - ca.sin(delta) * wheel.across[FRONT]
    front_y = ca.sin(delta) * wheel.along[FRONT] + ca.cos(delta) * wheel.across[FRONT]
    X, Y = front_x + wheel.along[REAR] - air_drag(x, p), front_y + wheel.across[REAR]

    roll_moment, pitch_moment = spring_moments(x, p)
    swing_x, swing_y = swings(p)
    topple = p.g * up[2] * ca.sin(x.body_angle)
    # (1) solved for f, and put into (2) and (3).
    roll_inertia = p.roll_inertia + swing_y**2 * (1 / p.body_mass - 1 / p.mass)
    pitch_inertia = p.pitch_inertia + swing_x**2 * (1 / p.body_mass - 1 / p.mass)
    roll_rate = (swing_y * (topple[ROLL] + Y / p.mass) - roll_moment) / roll_inertia  # (2)
    pitch_rate = (swing_x * (topple[PITCH] - X / p.mass) - pitch_moment) / pitch_inertia  # (3)
    f_x = (X - swing_x * pitch_rate) / p.mass  # (1)
    f_y = (Y + swing_y * roll_rate) / p.mass  # (1)

    r = x.yaw_rate
    shares = wheel_shares(x, p, wheel.load)
    return dict(
        velocity=ca.vertcat(f_x - p.g * up[0] + r * x.velocity[1], f_y - p.g * up[1] - r * x.velocity[0]),  # (4)
        yaw_rate=(p.front_distance * front_y - p.rear_distance * wheel.across[REAR]) / p.yaw_inertia,  # (1)
        body_rate=ca.vertcat(roll_rate, pitch_rate),
        spin=ca.vertcat(
            *(
                spin_rate(drive, x.brake_wrap[i] * friction, wheel.along[i], p)
                for i, (drive, friction) in enumerate(shares)
            )
        ),
        grip=ca.vertcat(*wheel.grip_rate),
        brake_wrap=ca.vertcat(*(wrap_rate(p.wheel_radius * x.spin[i], x.brake_wrap[i]) for i in (FRONT, REAR))),
    )
