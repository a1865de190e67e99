"""The signals that plants, IMUs and estimators exchange: one definition of every name, unit and frame.

S sensor frame, N inertial frame with Z up (East-North-Up). The accelerometer reads specific force: +g on the axis that
points up at rest.
"""

from __future__ import annotations

from enum import IntFlag
from math import pi

from .signals import Parameter, Signal, Values, integer, real

GRAVITY = 9.80665  # m/s2, standard gravity, the plants' default

# Near the middle of Europe, 50 deg N 10 deg E at sea level, at the start of 2025: International Geomagnetic Reference
# Field, 14th generation (IAGA), to 0.1 uT. Declination 4 deg East, dip 66 deg.
MID_EUROPE = (1.4, 20.1, -44.9)

_XYZ = (3,)
_AT_REST = (0.0, 0.0, GRAVITY)
# Of what a plant may do to an ideal IMU.
_RATE_LIMIT = 1e3  # rad/s
_FORCE_LIMIT = 1e5  # m/s2
_FIELD_LIMIT = 1e6  # uT

# Of what real sensors read, with room; a reading beyond counts as missing. Gyroscopes end at 350 rad/s, accelerometers
# that fit into an IMU at 400 g, magnetometers at 50 mT.
_GYRO_LIMIT = 1e3  # rad/s
_ACCEL_LIMIT = 5e3  # m/s2
_MAG_LIMIT = 1e5  # uT


def _xyz(name: str, unit: str, limit: float, nominal: float, description: str, start: Values = 0.0) -> Signal:
    return Signal(name, unit, description, -limit, limit, _XYZ, start, nominal)


# What an ideal IMU at the mounting point reads (plant out, IMU in).
ANGULAR_VELOCITY = _xyz("angular_velocity", "rad/s", _RATE_LIMIT, 1.0, "Angular velocity of S relative to N, in S")
SPECIFIC_FORCE = _xyz(
    "specific_force", "m/s2", _FORCE_LIMIT, 10.0, "Acceleration minus gravity at the mounting point, in S", _AT_REST
)
MAGNETIC_FIELD = _xyz("magnetic_field", "uT", _FIELD_LIMIT, 50.0, "Magnetic flux density at the mounting point, in S")

# Readings (IMU out, estimator in).
GYRO = _xyz("gyro", "rad/s", _GYRO_LIMIT, 1.0, "Gyroscope reading, sensor frame")
ACCEL = _xyz("accel", "m/s2", _ACCEL_LIMIT, 10.0, "Accelerometer reading (specific force), sensor frame", _AT_REST)
MAG = _xyz("mag", "uT", _MAG_LIMIT, 50.0, "Magnetometer reading, sensor frame")

# Attitude (plant out as truth, estimator out as estimate).
ROLL = Signal("roll", "rad", "Z-Y-X Euler angle about the sensor's x axis", -pi, pi)
PITCH = Signal("pitch", "rad", "Z-Y-X Euler angle about y; positive lowers the sensor's x axis", -pi / 2, pi / 2)
YAW = Signal("yaw", "rad", "Z-Y-X Euler angle about the vertical, from East towards North", -pi, pi)
Q_NS = Signal("q_NS", "1", "Attitude quaternion, Hamilton, scalar first, S to N", -1.0, 1.0, (4,), (1.0, 0.0, 0.0, 0.0))
VERTICAL = Signal("vertical", "1", "Unit vector that points up, in S", -1.0, 1.0, _XYZ, (0.0, 0.0, 1.0))
EXTERNAL_ACCELERATION = _xyz(
    "external_acceleration", "m/s2", _FORCE_LIMIT, 1.0, "Acceleration of the sensor without gravity, in S"
)

# Truth that only a plant knows.
POSITION = _xyz("position", "m", 1e7, 1.0, "Position of the mounting point, in N")
VELOCITY = _xyz("velocity", "m/s", 1e5, 1.0, "Velocity of the mounting point, in N")

# What the wheels of a vehicle say: plant out, estimator in.
FORWARD_SPEED = Signal(
    "forward_speed", "m/s", "Speed along the vehicle's x axis as its wheels tell it", -200.0, 200.0, nominal=10.0
)


def skeleton(points: int) -> Signal:
    """Local variable of a plant whose body can be drawn: this many points, in N, joined by one line."""
    description = "Points of the body, in N, joined by one line to draw it"
    return Signal("skeleton", "m", description, -1e7, 1e7, (points, 3))


# What an estimator says about itself.
TILT_STD = Signal("tilt_std", "rad", "One-sigma angle between estimated and true vertical", 0.0, 1e3, nominal=0.01)
STATUS = Signal(
    "status",
    "1",
    "0 ok, else the sum of: 1 gyroscope, 2 accelerometer, 4 magnetometer missing; 8 accelerometer, 16 magnetometer "
    "rejected; 32 not initialised; 64 begun anew; 128 found wrong, sought anew",
    0.0,
    1023.0,
)

# Every sampled block has these two; the framework adds them.
SAMPLE_TIME = Signal("sample_time", "s", "Instant of the sample that the outputs belong to", -1e12, 1e12)


def sample_period(start: float) -> Parameter:
    """The parameter ``sample_period`` of a sampled block."""
    return real("sample_period", "s", start, (1e-6, 1e3), "Time between samples")


def max_step(start: float) -> Parameter:
    """The parameter ``max_step`` of a continuous block."""
    return real("max_step", "s", start, (1e-7, 1), "Longest step of the fixed-step solver (RK4)")


SEED = integer("seed", 1, (0, 2**31 - 1), "Seed of the noise; blocks with different seeds are independent")

TRUTH = (ROLL, PITCH, YAW, Q_NS, VERTICAL, EXTERNAL_ACCELERATION, POSITION, VELOCITY)
IDEAL_IMU = (ANGULAR_VELOCITY, SPECIFIC_FORCE, MAGNETIC_FIELD)


class Status(IntFlag):
    """Flags in the output ``status`` of an estimator; 0 means every input was used.

    Missing is a reading that is not finite, or outside its declared bounds.
    """

    GYRO_MISSING = 1  # the last sample that was not missing was held
    ACCEL_MISSING = 2  # predicted without it
    MAG_MISSING = 4  # predicted without it
    ACCEL_REJECTED = 8  # the filter's own test took it for motion
    MAG_REJECTED = 16  # the filter's own test took it for a disturbance
    NOT_INITIALISED = 32  # no usable accelerometer sample yet: attitude is the start value
    RESTARTED = 64  # its numbers were not finite any more: it began anew with this sample
    LOST = 128  # the filter found its attitude wrong and seeks the vertical anew
