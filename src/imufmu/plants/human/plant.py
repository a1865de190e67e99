"""A sensor on a segment of a moving person: walking, running, a vertical jump, rollerblading, sit-to-stand.

    symbol      here                    unit    meaning
    r, q        mounting point          m, 1    of the rigid segment, in N, with its attitude B to N
    u           burst                   m       displacement by the impact of a foot on the ground, upwards
    d, d'       x.offset, x.offset_rate m, m/s  of the sensor on soft tissue from r, in N
    omega, zeta p.wobble_frequency, p.wobble_damping

Prescribed motion. The activity gives the posture at time t (modules gait, activities), the chain of
segments the place and attitude of the sensor (module body); R_NP turns the path frame by ``heading``. Time derivatives
of r and q are symbolic, so the ideal IMU (module truth) is exact at any step:

    r = R_NP (joint + q_PB (middle H + imu_position)) + (0, 0, u),   q_NS = q_NP q_PB q_BS      (1)
    w_S = 2 vec(conj(q_NS) q_NS')                                                      (2)

Impact of a foot at phase 0 of its cycle, for the time T_b = impact_duration: a smooth pulse of displacement, whose
acceleration has its peak A, upwards, in the middle; A is impact_acceleration times the share of the segment:

    u = -A T_b^2 / 32 (4 s (1 - s))^4,  s = time since the contact / T_b               (3)

Soft tissue (wobble 1): the sensor's case hangs on the segment by a spring and a damper, the same in all directions; the
sag under gravity is part of the rest position, and the case does not turn against the segment.

    d'' = -r'' - 2 zeta omega d' - omega^2 d                                           (4)
    acceleration of the sensor = r'' + d'' = -2 zeta omega d' - omega^2 d              (5)
"""

from __future__ import annotations

from functools import partial
from math import pi
from types import SimpleNamespace
from typing import Any

import casadi as ca

from ...blocks.block import ContinuousBlock, Expressions
from ...blocks.rotations import conjugate, multiply, quaternion_from_euler, rotate
from ...blocks.signals import Signal, State, integer, real, switch
from ...blocks.vocabulary import skeleton as skeleton_signal
from ..time_functions import along
from ..truth import OUTPUTS, PARAMETERS, magnetic_field, truth
from .activities import jump, sit_to_stand, skating
from .body import (
    FOOT,
    MIDDLE,
    PELVIS,
    SEGMENTS,
    SHANK,
    SKELETON_POINTS,
    THIGH,
    TRUNK,
    Posture,
    posture_from,
    segments,
    skeleton,
    standing,
)
from .gait import RUNNING as RUNNING_GAIT
from .gait import WALKING as WALKING_GAIT
from .gait import envelope, gait_posture, stride_phase

WALKING, RUNNING, JUMP, ROLLERBLADING, SIT_TO_STAND = range(5)

# Share of the impact at the foot that reaches the middle of a segment (chosen: it fades on its way up).
IMPACT_SHARE = {PELVIS: 0.25, THIGH: 0.4, SHANK: 0.7, FOOT: 1.0, TRUNK: 0.15}


def choose(index: Any, options: list[Any]) -> Any:
    """The option of this number."""
    chosen = options[0]
    for number, option in enumerate(options[1:], start=1):
        chosen = ca.if_else(index == number, option, chosen)
    return chosen


def posture(t: Any, p: SimpleNamespace) -> Posture:
    """Posture of the chosen activity at time t."""
    e, gone = envelope(t, p)
    stand = standing(p).column()
    way = ca.vertcat(p.speed * gone, ca.SX.zeros(stand.numel() - 1))

    def moving(column: Any) -> Any:
        return stand + e * (column - stand) + way

    phase, since = stride_phase(t, p), t - p.rest
    options = [
        moving(gait_posture(WALKING_GAIT, phase, p).column()),
        moving(gait_posture(RUNNING_GAIT, phase, p).column()),
        jump(since, p).column(),
        moving(skating(since, p).column()),
        sit_to_stand(since, p).column(),
    ]
    return posture_from(choose(p.activity, options))


def burst(t: Any, p: SimpleNamespace) -> Any:
    """u(t), m: of the right foot on the right leg, of both feet on pelvis and trunk. (3)"""
    e, _ = envelope(t, p)
    phase = stride_phase(t, p)

    def pulse(contacts: Any, period: Any) -> Any:
        s = ca.fmin((contacts - ca.floor(contacts)) * period / p.impact_duration, 1)
        return (4 * s * (1 - s)) ** 4

    stride = 120 / p.cadence
    both = ca.logic_or(p.segment == PELVIS, p.segment == TRUNK)
    pulses = ca.if_else(both, pulse(2 * phase, stride / 2), pulse(phase, stride))
    peak = p.impact_acceleration * choose(p.segment, [IMPACT_SHARE[i] for i in range(len(SEGMENTS))])
    return -ca.if_else(p.activity <= RUNNING, e * peak, 0) * p.impact_duration**2 / 32 * pulses


def heading(p: SimpleNamespace) -> Any:
    """q_NP (4,)."""
    return quaternion_from_euler(0, 0, p.heading)


def mounting(t: Any, p: SimpleNamespace) -> Any:
    """r (3,) and q_NS (4,) in one column. (1)"""
    placed = segments(posture(t, p), p.height)
    joint = choose(p.segment, [segment.joint for segment in placed])
    q_PB = choose(p.segment, [segment.q for segment in placed])
    middle = choose(p.segment, [ca.SX(ca.DM(place)) for place in MIDDLE])
    r_P = joint + rotate(q_PB, middle * p.height + p.imu_position)
    q_BS = quaternion_from_euler(*ca.vertsplit(p.mount))
    r_N = rotate(heading(p), r_P) + ca.vertcat(0, 0, burst(t, p))
    return ca.vertcat(r_N, multiply(multiply(heading(p), q_PB), q_BS))


def motion(t: Any, p: SimpleNamespace) -> tuple[Any, Any, Any]:
    """r and q_NS with their first two time derivatives, each (7,); terms that occur twice are computed once."""
    stacked = ca.cse(ca.vertcat(*along(partial(mounting, p=p), t, 1)))
    return stacked[:7], stacked[7:14], stacked[14:]


def initial(p: SimpleNamespace) -> Expressions:
    """The case at its rest position."""
    return dict(offset=ca.SX.zeros(3), offset_rate=ca.SX.zeros(3))


def wobble(x: SimpleNamespace, p: SimpleNamespace) -> Any:
    """Acceleration of the case by spring and damper (3,), m/s2. (5)"""
    omega = 2 * pi * p.wobble_frequency
    return -2 * p.wobble_damping * omega * x.offset_rate - omega**2 * x.offset


def dynamics(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace, t: Any) -> Expressions:
    """State derivative; nothing moves on a rigid mount. (4)"""
    acceleration = motion(t, p)[2][:3]
    return dict(offset=x.offset_rate, offset_rate=ca.if_else(p.wobble, wobble(x, p) - acceleration, 0))


def output(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace, t: Any) -> Expressions:
    """Truth at the sensor, skeleton and joint angles."""
    value, rate, acceleration = motion(t, p)
    q_NS = value[3:]
    w_S = 2 * multiply(conjugate(q_NS), rate[3:])[1:]  # (2)
    body = posture(t, p)
    points = [rotate(heading(p), point.T).T for point in ca.vertsplit(skeleton(body, p.height))]
    return {
        **truth(
            q_NS,
            w_S,
            value[:3] + x.offset,
            rate[:3] + x.offset_rate,
            ca.if_else(p.wobble, wobble(x, p), acceleration[:3]),
            p.g,
            magnetic_field(t, p),
        ),
        "joint_angle": ca.vertcat(body.right.hip, body.right.knee, body.right.ankle),
        "skeleton": ca.vertcat(*points),
    }


BLOCK = ContinuousBlock(
    name="human_segment",
    summary="Sensor on pelvis, thigh, shank, foot or trunk of a person who walks, runs, jumps, skates or stands up",
    doc="""The motion is prescribed and smooth, from rest through a ramp into the activity and, for walking, running and
rollerblading, back to rest. Joint angles of walking and running follow published curves; speed and cadence set the
length of a stride and with it the swing of the hip. The segments are those of the right leg. The sensor sits
imu_position from the middle of its segment (the centre of the pelvis, the instep of the foot), turned by the Z-Y-X
angles mount from the frame of the segment, which is x forwards, y left, z up where the person stands upright. With
impact_acceleration a short burst of acceleration follows each contact of a foot; it is 0 at first, because bursts are
too short for a record at 100 Hz. With wobble the sensor hangs on soft tissue, a spring and a damper. The pelvis is
driven, not the foot: the foot that carries slides and lifts by up to 2 cm at the pace of the curves, more at others;
in the ramps a foot dips up to 5 cm into the ground. A jump that the legs are too short for at jump_acceleration is
pushed off harder.
Times count from 0 whatever the start time is. Arms, toes, and the deformation of the segments are left out.""",
    reference="D. A. Winter, Biomechanics and Motor Control of Human Movement, Wiley 2009 (proportions); Ottobock, The "
    "eight phases of human gait cycle, poster 400W43 (walking); chapter doi:10.4324/9780203488300-34 (running)",
    inputs=(),
    outputs=OUTPUTS,
    locals=(
        Signal("joint_angle", "rad", "Flexion of the right hip, knee and ankle", -pi, pi, (3,)),
        skeleton_signal(SKELETON_POINTS),
    ),
    own_parameters=(
        *PARAMETERS,
        integer(
            "activity",
            WALKING,
            (WALKING, SIT_TO_STAND),
            "0 walking, 1 running, 2 jump, 3 rollerblading, 4 sit-to-stand",
        ),
        integer("segment", THIGH, (PELVIS, TRUNK), "0 pelvis, 1 thigh, 2 shank, 3 foot, 4 trunk"),
        real("imu_position", "m", 0.0, (-1, 1), "Sensor from the middle of its segment, in its frame", shape=(3,)),
        real("mount", "rad", 0.0, (-pi, pi), "Roll, pitch, yaw of the sensor in its segment", shape=(3,)),
        real("heading", "rad", 0.0, (-pi, pi), "Direction of the way, from East towards North"),
        real("height", "m", 1.75, (1.3, 2.2), "Height of the person"),
        real("rest", "s", 1.0, (0, 1e6), "Rest before the motion"),
        real("duration", "s", 20.0, (0.1, 1e6), "Activities 0, 1, 3: motion from rest to rest, with its ramps"),
        real("ramp", "s", 2.0, (0.1, 1e6), "Activities 0, 1, 3: time to grow, and to fade; at most half of duration"),
        real("speed", "m/s", 1.37, (0, 10), "Activities 0, 1, 3: speed over the ground"),
        real("cadence", "1/min", 113.0, (40, 240), "Activities 0, 1: steps per minute of both feet"),
        real("impact_acceleration", "m/s2", 0.0, (0, 1e3), "Activities 0, 1: peak of the burst at the foot; 0 none"),
        real("impact_duration", "s", 0.08, (0.005, 0.25), "Activities 0, 1: length of the burst"),
        real("jump_acceleration", "m/s2", 40.0, (10, 200), "Activity 2: largest upward acceleration of the pelvis"),
        real("jump_height", "m", 0.35, (0.02, 1), "Activity 2: rise of the pelvis in flight"),
        real("stroke_time", "s", 1.2, (0.3, 10), "Activity 3: time of one stroke"),
        real("lateral_acceleration", "m/s2", 1.5, (0, 5), "Activity 3: sideways acceleration in a stroke"),
        real("rise_time", "s", 2.0, (0.5, 20), "Activity 4: from the first lean to upright"),
        switch("wobble", "1 holds the sensor by soft tissue, 0 rigidly"),
        real("wobble_frequency", "Hz", 23.0, (2, 60), "Natural frequency of the sensor on its soft tissue"),
        real("wobble_damping", "1", 0.3, (0.01, 2), "Damping ratio of the soft tissue"),
    ),
    state=(State("offset", (3,)), State("offset_rate", (3,))),
    initial=initial,
    dynamics=dynamics,
    output=output,
    longest_step=1e-3,
)
