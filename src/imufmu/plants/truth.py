"""What every plant says about a sensor on it, from the motion of the mounting point.

    r_N, v_N, a_N   position (m), velocity (m/s), acceleration (m/s2) of the mounting point, in N
    q_NS, R_NS      attitude, sensor to navigation (Z up)
    w_S             angular velocity of S relative to N, in S (rad/s)
    B_N             magnetic flux density, in N (uT)

    f_S = R_SN (a_N + g e_z)    specific force: +g on the axis that points up at rest
    B_S = R_SN B_N              the Earth's field, the same everywhere, and a disturbance while one lasts

A disturbed magnetic field: a constant vector in N that is added in up to three intervals of time.

N counts as inertial: the Earth's rotation and the change of gravity with height are left out.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from ..blocks import vocabulary as v
from ..blocks.block import Expressions
from ..blocks.rotations import euler_from_quaternion, matrix_from_quaternion
from ..blocks.signals import Parameter, Signal, integer, real
from .time_functions import windows

OUTPUTS: tuple[Signal, ...] = (*v.TRUTH, *v.IDEAL_IMU)

DISTURBANCES = 3


def times(name: str, count: int, text: str) -> Parameter:
    """Parameter for ``count`` instants (s)."""
    return real(name, "s", 0.0, (-1e6, 1e6), text, shape=(count,))


PARAMETERS: tuple[Parameter, ...] = (
    real("g", "m/s2", v.GRAVITY, (0, 100), "Magnitude of gravity"),
    real(
        "earth_field",
        "uT",
        v.MID_EUROPE,
        (-1e3, 1e3),
        "Magnetic flux density East, North, Up; start: mid-Europe, IGRF-14, 2025",
        shape=(3,),
    ),
    real("disturbance_field", "uT", 0.0, (-1e3, 1e3), "Magnetic disturbance East, North, Up", shape=(3,)),
    integer("disturbances", 0, (0, DISTURBANCES), "Number of intervals of the magnetic disturbance"),
    times("disturbance_start", DISTURBANCES, "Start of each magnetic disturbance"),
    times("disturbance_stop", DISTURBANCES, "End of each magnetic disturbance"),
    real(
        "disturbance_ramp", "s", 0.5, (0.01, 1e6), "Time in which a disturbance grows, and fades, inside its interval"
    ),
)


def magnetic_field(t: Any, p: SimpleNamespace) -> Any:
    """Magnetic flux density in N (3,), uT, at time t: the Earth's and the disturbance."""
    disturbed = windows(t, p.disturbances, p.disturbance_start, p.disturbance_stop, p.disturbance_ramp)
    return p.earth_field + disturbed * p.disturbance_field


def truth(q_NS: Any, w_S: Any, r_N: Any, v_N: Any, a_N: Any, g: Any, B_N: Any) -> Expressions:
    """Expressions by name for OUTPUTS.

    q_NS: (4,), of unit length. w_S, r_N, v_N, a_N, B_N: (3,). g: scalar, m/s2. Units and frames as in the module.
    """
    roll, pitch, yaw = euler_from_quaternion(q_NS)
    R_SN = matrix_from_quaternion(q_NS).T
    up_S = R_SN[:, 2]
    a_S = R_SN @ a_N
    return dict(
        roll=roll,
        pitch=pitch,
        yaw=yaw,
        q_NS=q_NS,
        vertical=up_S,
        external_acceleration=a_S,
        position=r_N,
        velocity=v_N,
        angular_velocity=w_S,
        specific_force=a_S + g * up_S,
        magnetic_field=R_SN @ B_N,
    )
