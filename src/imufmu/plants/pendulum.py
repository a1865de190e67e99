"""Planar pendulum with one link or two, free or driven, with a sensor on one of them.

    symbol    here               unit       meaning, for link i
    theta_i   x.angle            rad        angle of joint i, relative to the link before; 0 hangs straight down
    phi_i     phi                rad        theta_1 + ... + theta_i: angle of link i to the vertical
    l_i       p.length           m          joint i to joint i + 1
    c_i       p.com_distance     m          joint i to the centre of mass
    m_i, I_i  p.mass, p.inertia  kg, kg.m2  mass, moment of inertia about the centre of mass
    b_i       p.damping          N.m.s/rad  viscous damping of joint i
    tau_i     u.torque           N.m        torque of the drive, from link i - 1 (or the support) on link i

Lagrangian mechanics, T kinetic and V potential energy (zero with every mass at the height of the pivot):

    d/dt (dT/dtheta') - d(T - V)/dtheta + b theta' = tau                              (1)
    T = sum (m_i |r_i'|^2 + I_i phi_i'^2) / 2,    V = sum m_i g r_i,z                  (2)
    r_i = sum_{j<i} l_j d(phi_j) + c_i d(phi_i),  d(phi) = (sin phi, -cos phi)         (3)

For one link (I + m c^2) theta'' = tau - m g c sin(theta) - b theta'.

Frames: H is N turned by ``heading`` about the vertical, from East towards North; the links swing in its x-z plane and a
positive angle moves the free end towards +x of H. L, the frame of a link, is H turned by -phi about y: its z axis
points along the link towards the joint. S is the sensor: R_NS = Rz(heading) Ry(-phi) R_LS.

Driven motion. Both joints of a leg in walking, after the experiments in [1]: hang at rest, swing with a frequency that
changes during the trial, hang at rest again.

    theta_i(t) = e(t) (offset_i + amplitude_i sin(psi(t) + phase_i)),  psi' = 2 pi f(t),  f linear in t      (4)

The envelope e rises from 0 to 1 and falls back with three continuous derivatives, so the jerk is continuous. While
amplitude <= |offset| a joint bends to one side only: a knee that never hyperextends.

[1] Bennett, Jafari, Gans, Motion Based Acceleration Correction for Improved Sensor Orientation Estimates, BSN 2014
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from math import pi, radians
from types import SimpleNamespace
from typing import Any

import casadi as ca

from ..block import ContinuousBlock, Expressions
from ..rotations import multiply, quaternion_from_euler, rotate_back
from ..signals import Parameter, Signal, State, integer, real
from .time_functions import along, smooth_step
from .truth import OUTPUTS, PARAMETERS, magnetic_field, truth

FREE, DRIVEN = 0, 1


def arms_to(link: Any, distance: Any, p: SimpleNamespace) -> Any:
    """Arms (n,) of the chain that ends on this link (1 to n), at this distance from its joint."""
    number = ca.SX(range(1, p.length.numel() + 1))
    return ca.if_else(number == link, distance, (number < link) * p.length)


def chain_end(theta: Any, arms: Any) -> Any:
    """Point (x, z) in the plane of H, relative to the pivot, at the end of arms (n,) along the n links. (3)"""
    phi = ca.cumsum(theta)
    return ca.vertcat(ca.dot(arms, ca.sin(phi)), -ca.dot(arms, ca.cos(phi)))


def energies(theta: Any, rate: Any, p: SimpleNamespace) -> tuple[Any, Any]:
    """Kinetic and potential energy (J). (2)"""
    phi_rate = ca.cumsum(rate)
    T, V = 0, 0
    for i in range(theta.numel()):
        r, r_rate, _ = along(partial(chain_end, arms=arms_to(i + 1, p.com_distance[i], p)), theta, rate)
        T += (p.mass[i] * ca.sumsqr(r_rate) + p.inertia[i] * phi_rate[i] ** 2) / 2
        V += p.mass[i] * p.g * r[1]
    return T, V


def required_torque(theta: Any, rate: Any, acceleration: Any, p: SimpleNamespace) -> Any:
    """Torque (n,) of the drive that this motion takes. (1)"""
    q, dq = ca.SX.sym("q", theta.numel()), ca.SX.sym("dq", theta.numel())
    T, V = energies(q, dq, p)
    momentum = ca.gradient(T, dq)
    momentum_rate = ca.jtimes(momentum, q, dq) + ca.jtimes(momentum, dq, acceleration)
    torque = momentum_rate - ca.gradient(T - V, q) + p.damping * dq
    return ca.substitute(torque, ca.vertcat(q, dq), ca.vertcat(theta, rate))


def free_acceleration(theta: Any, rate: Any, torque: Any, p: SimpleNamespace) -> Any:
    """Joint accelerations (n,) under this torque of the drive: (1) is linear in them."""
    ddq = ca.SX.sym("ddq", theta.numel())
    required = required_torque(theta, rate, ddq, p)
    M = ca.jacobian(required, ddq)
    return ca.solve(M, torque - ca.substitute(required, ddq, ca.SX.zeros(ddq.shape)))


def driven_angles(t: Any, p: SimpleNamespace) -> Any:
    """Joint angles (n,) at time t. (4)"""
    since = t - p.drive_rest
    e = smooth_step(since / p.drive_ramp) * smooth_step((p.drive_duration - since) / p.drive_ramp)
    f_slope = (p.drive_end_frequency - p.drive_start_frequency) / p.drive_duration
    psi = 2 * pi * (p.drive_start_frequency + f_slope * since / 2) * since
    return e * (p.drive_offset + p.drive_amplitude * ca.sin(psi + p.drive_phase))


def joint_motion(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace, t: Any) -> tuple[Any, Any, Any]:
    """Joint angles, rates and accelerations (n,) of the chosen motion."""
    free = (x.angle, x.angle_rate, free_acceleration(x.angle, x.angle_rate, u.torque, p))
    driven = along(partial(driven_angles, p=p), t, 1)
    theta, rate, acceleration = (ca.if_else(p.motion == DRIVEN, d, f) for d, f in zip(driven, free, strict=True))
    return theta, rate, acceleration


def initial(p: SimpleNamespace) -> Expressions:
    """Start of the free motion; a driven one starts hanging at rest."""
    free = p.motion == FREE
    return dict(angle=ca.if_else(free, p.initial_angle, 0), angle_rate=ca.if_else(free, p.initial_rate, 0))


def dynamics(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace, t: Any) -> Expressions:
    """State derivative. The state follows a driven motion too, though only the free one reads it."""
    _, rate, acceleration = joint_motion(x, u, p, t)
    return dict(angle=rate, angle_rate=acceleration)


def output(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace, t: Any) -> Expressions:
    """Truth at the sensor, joint motion, energy and torque."""
    theta, rate, acceleration = joint_motion(x, u, p, t)
    arms = arms_to(p.imu_link, p.imu_distance, p)
    r_H, v_H, a_H = along(partial(chain_end, arms=arms), theta, rate, acceleration)

    up_to_sensor = ca.SX(range(1, theta.numel() + 1)) <= p.imu_link
    phi, phi_rate = ca.dot(up_to_sensor, theta), ca.dot(up_to_sensor, rate)
    q_LS = quaternion_from_euler(*ca.vertsplit(p.mount))
    q_NL = quaternion_from_euler(0, -phi, p.heading)  # of half angles: continuous however often the link goes round
    w_S = rotate_back(q_LS, ca.vertcat(0, -phi_rate, 0))

    def in_N(plane: Any) -> Any:
        return ca.vertcat(ca.cos(p.heading) * plane[0], ca.sin(p.heading) * plane[0], plane[1])

    T, V = energies(theta, rate, p)
    return {
        **truth(multiply(q_NL, q_LS), w_S, in_N(r_H), in_N(v_H), in_N(a_H), p.g, magnetic_field(t, p)),
        "angle": theta,
        "angle_rate": rate,
        "energy": T + V,
        "joint_torque": required_torque(theta, rate, acceleration, p),
    }


@dataclass(frozen=True)
class Start:
    """Start values of the parameters that differ between the blocks; one entry per link, units as in the block."""

    name: str
    summary: str
    length: tuple[float, ...]
    mass: tuple[float, ...]
    com_distance: tuple[float, ...]
    inertia: tuple[float, ...]
    damping: tuple[float, ...]
    angle: tuple[float, ...]
    imu_distance: float
    offset: tuple[float, ...]
    amplitude: tuple[float, ...]
    phase: tuple[float, ...]


# A bob of 1 kg at the end of a rod of 1 m and 0.2 kg, the sensor on the rod just above the bob.
LABORATORY = Start(
    name="pendulum",
    summary="Planar pendulum with a sensor on it, free, torque-driven or in a prescribed swing",
    length=(1.0,),
    mass=(1.2,),
    com_distance=(0.917,),
    inertia=(0.058,),
    damping=(0.02,),
    angle=(radians(60),),
    imu_distance=0.9,
    offset=(0.0,),
    amplitude=(radians(30),),
    phase=(0.0,),
)

# The leg of a person of 1.75 m and 75 kg: thigh, shank with foot; proportions from Winter, Biomechanics and Motor
# Control of Human Movement, Wiley, 4th edition 2009, table 4.1. The sensor sits on the middle of the shank.
# Driven: thigh from 10 deg backwards to 30 deg forwards, knee bent by 0 to 60 deg, as in normal walking; the knee is
# bent most a quarter of a stride before the thigh is foremost, which lifts the foot in the swing.
LEG = Start(
    name="double_pendulum",
    summary="Planar double pendulum (leg) with a sensor on it, free, torque-driven or in a walking-like swing",
    length=(0.43, 0.43),
    mass=(7.5, 4.6),
    com_distance=(0.186, 0.26),
    inertia=(0.145, 0.147),
    damping=(0.2, 0.1),
    angle=(radians(40), radians(-20)),
    imu_distance=0.2,
    offset=(radians(10), radians(-30)),
    amplitude=(radians(20), radians(30)),
    phase=(0.0, -pi / 2),
)

DOC = """The links swing in a vertical plane that is turned by heading from East towards North. Angles are relative to
the link before, the first one to the vertical; 0 hangs straight down, positive moves the free end forwards. The sensor
sits on link imu_link, imu_distance from the joint of that link, turned by the Z-Y-X angles mount from the link's frame
(z along the link towards its joint, y across the plane of the swing). Motion 0 is free: it starts from initial_angle
and initial_rate and follows gravity, damping and the input torque, which is held over a communication step. Motion 1 is
driven: rest for drive_rest, a swing of drive_duration whose frequency goes from drive_start_frequency to
drive_end_frequency, rest again. Its times count from 0 whatever the start time is, the torque input has no effect, and
its angles are exact at any step. A free pendulum is a hard case for an accelerometer: near its centre of oscillation
the specific force stays along the link at any tilt. For a sensor on each link use two plants with the same motion."""


def pendulum(links: int) -> ContinuousBlock:
    """The block with 1 or 2 links."""
    start = {1: LABORATORY, 2: LEG}[links]
    per_link = (links,)
    return ContinuousBlock(
        name=start.name,
        summary=start.summary,
        doc=DOC,
        reference="T. R. Bennett, R. Jafari, N. Gans, Motion Based Acceleration Correction for Improved Sensor "
        "Orientation Estimates, BSN 2014 (the driven motion)",
        inputs=(Signal("torque", "N.m", "Torque of the drive at each joint (motion 0)", -1e6, 1e6, per_link),),
        outputs=(
            *OUTPUTS,
            Signal("angle", "rad", "Joint angles, each relative to the link before", -1e6, 1e6, per_link),
            Signal("angle_rate", "rad/s", "Joint rates", -1e3, 1e3, per_link),
        ),
        locals=(
            Signal("energy", "J", "Kinetic plus potential energy, the latter 0 at the height of the pivot", -1e9, 1e9),
            Signal("joint_torque", "N.m", "Torque of the drive that the motion takes", -1e9, 1e9, per_link),
        ),
        own_parameters=(*PARAMETERS, *_parameters(start)),
        state=(State("angle", per_link), State("angle_rate", per_link)),
        initial=initial,
        dynamics=dynamics,
        output=output,
        longest_step=1e-3,
    )


def _parameters(start: Start) -> tuple[Parameter, ...]:
    """Parameters of the pendulum. Mass away from each joint keeps the mass matrix invertible, to rounding too."""
    links = len(start.length)

    def each(
        name: str, unit: str, values: float | tuple[float, ...], bounds: tuple[float, float], doc: str
    ) -> Parameter:
        return real(name, unit, values, bounds, doc, shape=(links,))

    return (
        integer("motion", FREE, (FREE, DRIVEN), "0 free or torque-driven, 1 prescribed swing"),
        real("heading", "rad", 0.0, (-pi, pi), "Direction of the swing, from East towards North"),
        each("length", "m", start.length, (0.01, 100), "Joint to next joint, or to the end of the last link"),
        each("mass", "kg", start.mass, (0.01, 1000), "Mass of each link"),
        each("com_distance", "m", start.com_distance, (0.01, 100), "Joint to the centre of mass of its link"),
        each("inertia", "kg.m2", start.inertia, (0, 1e6), "Moment of inertia about the centre of mass; 0 point mass"),
        each("damping", "N.m.s/rad", start.damping, (0, 1e4), "Viscous damping of each joint"),
        each("initial_angle", "rad", start.angle, (-2 * pi, 2 * pi), "Motion 0: joint angles at the start"),
        each("initial_rate", "rad/s", 0.0, (-100, 100), "Motion 0: joint rates at the start"),
        integer("imu_link", links, (1, links), "Link that carries the sensor"),
        real("imu_distance", "m", start.imu_distance, (0, 100), "Sensor from the joint of its link, along the link"),
        real("mount", "rad", (0, 0, pi / 4), (-pi, pi), "Roll, pitch, yaw of the sensor in its link", shape=(3,)),
        each("drive_offset", "rad", start.offset, (-pi, pi), "Motion 1: middle of the swing"),
        each("drive_amplitude", "rad", start.amplitude, (0, pi), "Motion 1: half of the swing"),
        each("drive_phase", "rad", start.phase, (-pi, pi), "Motion 1: phase of the swing at its start"),
        real("drive_start_frequency", "Hz", 0.4, (0, 10), "Motion 1: frequency at the start; a stroll"),
        real("drive_end_frequency", "Hz", 1.2, (0, 10), "Motion 1: frequency at the end; strides of a brisk walk"),
        real("drive_rest", "s", 2.0, (0, 1e6), "Motion 1: rest before the swing"),
        real("drive_duration", "s", 20.0, (0.1, 1e6), "Motion 1: swing from rest to rest"),
        real("drive_ramp", "s", 2.0, (0.1, 1e6), "Motion 1: time in which the swing grows and fades"),
    )


PENDULUM = pendulum(1)
DOUBLE_PENDULUM = pendulum(2)
