"""Planar pendulum with one link or two, free or driven, with a sensor on one of them, or on each.

    symbol    here               unit       meaning, for link i
    theta_i   x.angle            rad        angle of joint i, relative to the link before; 0 hangs straight down
    phi_i     phi                rad        theta_1 + ... + theta_i: angle of link i to the vertical
    l_i       p.length           m          joint i to joint i + 1
    c_i       p.com_distance     m          joint i to the centre of mass
    m_i, I_i  p.mass, p.inertia  kg, kg.m2  mass, moment of inertia about the centre of mass
    b_i       p.damping          N.m.s/rad  viscous damping of joint i
    tau_i     u.torque           N.m        torque of the drive, from link i - 1 (or the support) on link i
    s_i       stop_torque        N.m        torque of the end stops of joint i
    k_i, a_i  p.stop_stiffness, p.stop_damping          N.m/rad2, s/rad

Lagrangian mechanics, T kinetic and V potential energy (zero with every mass at the height of the pivot):

    d/dt (dT/dtheta') - d(T - V)/dtheta + b theta' = tau + s                          (1)
    T = sum (m_i |r_i'|^2 + I_i phi_i'^2) / 2,    V = sum m_i g r_i,z                  (2)
    r_i = sum_{j<i} l_j d(phi_j) + c_i d(phi_i),  d(phi) = (sin phi, -cos phi)         (3)

For one link (I + m c^2) theta'' = tau - m g c sin(theta) - b theta'.

Frames: H is N turned by ``heading`` about the vertical, from East towards North; the links swing in its x-z plane and a
positive angle moves the free end towards +x of H. L, the frame of a link, is H turned by -phi about y: its z axis
points along the link towards the joint. S is the sensor: R_NS = Rz(heading) Ry(-phi) R_LS. What it reads: module truth.

Driven motion. Both joints of a leg in walking, after the experiments in [1]: hang at rest, swing with a frequency that
changes during the trial, hang at rest again.

    theta_i(t) = e(t) (offset_i + amplitude_i sin(psi(t) + phase_i)),  psi' = 2 pi f(t),  f linear in t      (4)

The envelope e rises from 0 to 1 and falls back with three continuous derivatives, so the jerk is continuous. While
amplitude <= |offset| a joint bends to one side only: a knee that never hyperextends.

End stops, as the stick that keeps the knee from hyperextending in [1]. A joint that is d beyond its upper stop is
pushed back by the contact law of [2], with an exponent of 2,

    s = -k d^2 max(0, 1 + a d')                                                       (5)

and at the lower stop alike. The square makes the jerk continuous, a > 0 takes energy from every contact, and a stop
never pulls. The springs of the stops count as energy.

Swing-up. A drive in the first joint moves the energy E = T + V to one aimed at [3], without ever passing tau_max:

    tau_1 = tau_max tanh(gain (E_aim - E) theta_1' / tau_max),  E_aim = V_hanging + r (V_upright - V_hanging)    (6)

so that its power tau_1 theta_1' has the sign of E_aim - E. Above r = 1 the pendulum goes over the top again and again.

[1] Bennett, Jafari, Gans, Motion Based Acceleration Correction for Improved Sensor Orientation Estimates, BSN 2014
[2] Hunt, Crossley, Coefficient of Restitution Interpreted as Damping in Vibroimpact, Journal of Applied Mechanics
    42(2), 1975, doi:10.1115/1.3423596
[3] Astrom, Furuta, Swinging up a Pendulum by Energy Control, Automatica 36(2), 2000,
    doi:10.1016/S0005-1098(99)00140-5; here with a torque in place of the motion of the pivot
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from math import pi, radians
from types import SimpleNamespace
from typing import Any

import casadi as ca

from ..blocks import vocabulary as v
from ..blocks.block import ContinuousBlock, Expressions
from ..blocks.rotations import multiply, quaternion_from_euler, rotate_back
from ..blocks.signals import Parameter, Signal, State, integer, real
from .pendulum_parts import (
    arms_to,
    chain_end,
    energies,
    free_acceleration,
    joints,
    required_torque,
    stop_energy,
    swing_up_torque,
)
from .time_functions import along, smooth_step
from .truth import OUTPUTS, PARAMETERS, magnetic_field, truth

FREE, DRIVEN, SWING_UP = 0, 1, 2


def driven_angles(t: Any, p: SimpleNamespace) -> Any:
    """Joint angles (n,) at time t. (4)"""
    since = t - p.drive_rest
    e = smooth_step(since / p.drive_ramp) * smooth_step((p.drive_duration - since) / p.drive_ramp)
    f_slope = (p.drive_end_frequency - p.drive_start_frequency) / p.drive_duration
    psi = 2 * pi * (p.drive_start_frequency + f_slope * since / 2) * since
    return e * (p.drive_offset + p.drive_amplitude * ca.sin(psi + p.drive_phase))


def joint_motion(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace, t: Any) -> tuple[Any, Any, Any]:
    """Joint angles, rates and accelerations (n,) of the chosen motion."""
    torque = u.torque + ca.if_else(p.motion == SWING_UP, swing_up_torque(x.angle, x.angle_rate, p), 0)
    free = (x.angle, x.angle_rate, free_acceleration(x.angle, x.angle_rate, torque, p))
    driven = along(partial(driven_angles, p=p), t, 1)
    theta, rate, acceleration = (ca.if_else(p.motion == DRIVEN, d, f) for d, f in zip(driven, free, strict=True))
    return theta, rate, acceleration


def initial(p: SimpleNamespace) -> Expressions:
    """Start of the free motion; a driven one starts hanging at rest."""
    free = p.motion != DRIVEN
    return dict(angle=ca.if_else(free, p.initial_angle, 0), angle_rate=ca.if_else(free, p.initial_rate, 0))


def dynamics(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace, t: Any) -> Expressions:
    """State derivative. The state follows a driven motion too, though only the free one reads it."""
    _, rate, acceleration = joint_motion(x, u, p, t)
    return dict(angle=rate, angle_rate=acceleration)


def output(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace, t: Any) -> Expressions:
    """Truth at the sensor, what a second sensor on the upper link reads, joint motion, energy and torque."""
    motion = joint_motion(x, u, p, t)
    theta, rate, acceleration = motion
    T, V = energies(theta, rate, p)
    count = 2 * pi / p.encoder_counts
    found = {
        **truth_on_link(p.imu_link, p.imu_distance, motion, p, t),
        "angle": theta,
        "angle_rate": rate,
        "encoder": count * ca.floor(theta / count + 0.5),
        "energy": T + V + stop_energy(theta, p),
        "joint_torque": required_torque(theta, rate, acceleration, p),
        "skeleton": ca.horzcat(*(in_N(place, p) for place in ca.horzsplit(joints(theta, p)))).T,
    }
    if theta.numel() > 1:
        upper = truth_on_link(1, p.upper_imu_distance, motion, p, t)
        found |= {f"upper_{signal.name}": upper[signal.name] for signal in v.IDEAL_IMU}
    return found


def truth_on_link(link: Any, distance: Any, motion: tuple[Any, Any, Any], p: SimpleNamespace, t: Any) -> Expressions:
    """Truth of a sensor on this link (1 to n), at this distance (m) from its joint."""
    theta, rate, _ = motion
    place = along(partial(chain_end, arms=arms_to(link, distance, p)), *motion)
    r_N, v_N, a_N = (in_N(derivative, p) for derivative in place)
    up_to_sensor = ca.SX(range(1, theta.numel() + 1)) <= link
    phi, phi_rate = ca.dot(up_to_sensor, theta), ca.dot(up_to_sensor, rate)
    q_LS = quaternion_from_euler(*ca.vertsplit(p.mount))
    q_NL = quaternion_from_euler(0, -phi, p.heading)  # of half angles: continuous however often the link goes round
    w_S = rotate_back(q_LS, ca.vertcat(0, -phi_rate, 0))
    return truth(multiply(q_NL, q_LS), w_S, r_N, v_N, a_N, p.g, magnetic_field(t, p))


def in_N(plane: Any, p: SimpleNamespace) -> Any:
    """Components in N (3,) of a vector (x, z) in the plane of H."""
    return ca.vertcat(ca.cos(p.heading) * plane[0], ca.sin(p.heading) * plane[0], plane[1])


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
    swing_up_torque: float
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
    swing_up_torque=3.0,
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
    swing_up_torque=15.0,
    offset=(radians(10), radians(-30)),
    amplitude=(radians(20), radians(30)),
    phase=(0.0, -pi / 2),
)

UPPER_DISTANCE = "Second sensor from the first joint, along the first link"
UPPER_IMU = tuple(
    replace(signal, name=f"upper_{signal.name}", description=f"Sensor on the first link: {signal.description}")
    for signal in v.IDEAL_IMU
)

DOC = """The links swing in a vertical plane that is turned by heading from East towards North. Angles are relative to
the link before, the first one to the vertical; 0 hangs straight down, positive moves the free end forwards. The sensor
sits on link imu_link, imu_distance from the joint of that link, turned by the Z-Y-X angles mount from the link's frame
(z along the link towards its joint, y across the plane of the swing). Motion 0 is free: it starts from initial_angle
and initial_rate and follows gravity, damping and the input torque, which is held over a communication step. Motion 1 is
driven: rest for drive_rest, a swing of drive_duration whose frequency goes from drive_start_frequency to
drive_end_frequency, rest again. Its times count from 0 whatever the start time is, the torque input has no effect, and
its angles are exact at any step. Motion 2 is like motion 0 with a drive in the first joint that swings the pendulum up:
with at most swing_up_torque it brings the energy to swing_up_energy, 0 hanging at rest, 1 standing at rest, more for
turning over. End stops, where stop_stiffness is not 0, push back a joint beyond stop_low or stop_high. The encoders
read each joint angle in counts of a turn. A free pendulum is a hard case for an accelerometer: near its centre of
oscillation the specific force stays along the link at any tilt. With two links, a second ideal IMU, mounted alike, sits
upper_imu_distance from the first joint on the first link; the truth is that of the sensor on imu_link."""


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
            *(UPPER_IMU if links > 1 else ()),
            Signal("angle", "rad", "Joint angles, each relative to the link before", -1e6, 1e6, per_link),
            Signal("angle_rate", "rad/s", "Joint rates", -1e3, 1e3, per_link),
            Signal("encoder", "rad", "Joint angles as the encoders read them, in whole counts", -1e6, 1e6, per_link),
        ),
        locals=(
            Signal("energy", "J", "Kinetic plus potential energy, the latter 0 at the height of the pivot", -1e9, 1e9),
            Signal("joint_torque", "N.m", "Torque of the drive that the motion takes", -1e9, 1e9, per_link),
            v.skeleton(links + 1),
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
        integer("motion", FREE, (FREE, SWING_UP), "0 free or torque-driven, 1 prescribed swing, 2 swing-up"),
        real("heading", "rad", 0.0, (-pi, pi), "Direction of the swing, from East towards North"),
        each("length", "m", start.length, (0.01, 100), "Joint to next joint, or to the end of the last link"),
        each("mass", "kg", start.mass, (0.01, 1000), "Mass of each link"),
        each("com_distance", "m", start.com_distance, (0.01, 100), "Joint to the centre of mass of its link"),
        each("inertia", "kg.m2", start.inertia, (0, 1e6), "Moment of inertia about the centre of mass; 0 point mass"),
        each("damping", "N.m.s/rad", start.damping, (0, 1e4), "Viscous damping of each joint"),
        each("initial_angle", "rad", start.angle, (-2 * pi, 2 * pi), "Motions 0 and 2: joint angles at the start"),
        each("initial_rate", "rad/s", 0.0, (-100, 100), "Motions 0 and 2: joint rates at the start"),
        each("stop_low", "rad", -pi, (-1e3, 1e3), "Lower end stop of each joint"),
        each("stop_high", "rad", pi, (-1e3, 1e3), "Upper end stop of each joint"),
        each(
            "stop_stiffness", "N.m/rad2", 0.0, (0, 1e6), "Torque of an end stop over the square of its yielding; 0 none"
        ),
        each("stop_damping", "s/rad", 0.1, (0, 1e3), "Growth of the torque of an end stop with the rate of yielding"),
        integer("encoder_counts", 1000, (1, 10**6), "Counts of each encoder in a turn"),
        integer("imu_link", links, (1, links), "Link that carries the sensor"),
        real("imu_distance", "m", start.imu_distance, (0, 100), "Sensor from the joint of its link, along the link"),
        *([real("upper_imu_distance", "m", start.imu_distance, (0, 100), UPPER_DISTANCE)] if links > 1 else []),
        real("mount", "rad", (0, 0, pi / 4), (-pi, pi), "Roll, pitch, yaw of the sensor in its link", shape=(3,)),
        each("drive_offset", "rad", start.offset, (-pi, pi), "Motion 1: middle of the swing"),
        each("drive_amplitude", "rad", start.amplitude, (0, pi), "Motion 1: half of the swing"),
        each("drive_phase", "rad", start.phase, (-pi, pi), "Motion 1: phase of the swing at its start"),
        real("swing_up_energy", "1", 1.2, (0, 100), "Motion 2: energy aimed at; 0 hanging, 1 standing, both at rest"),
        real("swing_up_torque", "N.m", start.swing_up_torque, (1e-6, 1e6), "Motion 2: largest torque of the drive"),
        real("swing_up_gain", "s/rad", 1.0, (0, 1e6), "Motion 2: torque over missing energy and rate"),
        real("drive_start_frequency", "Hz", 0.4, (0, 10), "Motion 1: frequency at the start; a stroll"),
        real("drive_end_frequency", "Hz", 1.2, (0, 10), "Motion 1: frequency at the end; strides of a brisk walk"),
        real("drive_rest", "s", 2.0, (0, 1e6), "Motion 1: rest before the swing"),
        real("drive_duration", "s", 20.0, (0.1, 1e6), "Motion 1: swing from rest to rest"),
        real("drive_ramp", "s", 2.0, (0.1, 1e6), "Motion 1: time in which the swing grows and fades"),
    )


PENDULUM = pendulum(1)
DOUBLE_PENDULUM = pendulum(2)
