"""A car on a road: planar dynamics with saturating tyres, roll and pitch of the body, and a driver.

The parts, each with its equations and symbols:

    tyre        slip, magic formula, friction circle, load sensitivity, wheels and dry friction of the brakes
    body        planar motion, roll and pitch, load transfer
    road        frames from N to the sensor, grade and bank
    driver      manoeuvres: paths, speeds, the driver
    parameters  the car, its road, its manoeuvres

Here: the states together, what the inputs do, where the motion starts, what is reported; what the sensor reads is in
the module truth.

Inputs reach the car through its controls, so that the truth stays smooth when a host lets them jump:

    steering    tau^2 delta'' + 2 tau delta' + delta = u                                          (1)
    pedals      tau F' + F = u                                                                    (2)
    road        (tau d/dt + 1)^3 gamma = u: its second derivative is continuous                   (3)

The start is the steady state of driving straight on a level or climbing road, or of standing on a slope in any
direction. The tyres carry the resistance:

    F = share F_drive - z (F_brake + f_r Fz),   w = F / mu Fz,   slip(w) for the spin             (4)
"""

from __future__ import annotations

from math import pi
from types import SimpleNamespace
from typing import Any

import casadi as ca

from ...blocks.block import ContinuousBlock, Expressions
from ...blocks.rotations import TINY, angle_of, norm
from ...blocks.signals import Signal, State
from ...blocks.vocabulary import FORWARD_SPEED, skeleton
from ..truth import OUTPUTS, magnetic_field, truth
from .body import FRONT, REAR, air_drag, axle_loads, axles, motion, steering_angle, swings, wheel_shares
from .driver import OPEN, path_following, pedals, resistance, steering_wheel
from .outline import POINTS, outline
from .parameters import PARAMETERS
from .road import PITCH, ROLL, coordinate_rates, sensor_motion, up_in_road
from .tyre import slip_for

STANDING = 0.1  # m/s: below, a car has no side slip angle
NEARLY_ALL = 0.99  # of the friction: the most that the start asks of a tyre

STATE = (
    State("position", (3,)),
    State("heading"),
    State("velocity", (2,)),
    State("yaw_rate"),
    State("body_angle", (2,)),
    State("body_rate", (2,)),
    State("spin", (2,)),
    State("grip", (2, 2)),
    State("brake_wrap", (2,)),
    State("steering", (2,)),
    State("drive_force"),
    State("brake_force"),
    State("grade", (3,)),
    State("bank", (3,)),
    State("path_distance"),
    State("reference", (2,)),
    State("reference_heading"),
)


def initial(p: SimpleNamespace) -> Expressions:
    """Driving straight at initial_speed, or standing on the slope."""
    x = SimpleNamespace(**{state.name: ca.SX.zeros(*state.shape) for state in STATE})
    x.heading = x.reference_heading = p.heading
    x.velocity[0] = p.initial_speed
    x.grade[0], x.bank[0] = p.road_grade, p.road_bank
    up = up_in_road(x)
    moving = p.initial_speed > 0
    _, held = pedals(0, x, p)
    x.brake_force = ca.if_else(moving, 0, held)
    x.drive_force = ca.if_else(ca.logic_and(p.manoeuvre != OPEN, moving), ca.fmax(resistance(x, p), 0), 0)

    friction = x.brake_force + p.rolling_resistance * p.mass * p.g * up[2]
    pulled = -p.mass * p.g * up[0] / ca.fmax(friction, TINY)  # downhill, over what the dry friction can hold
    z = ca.if_else(moving, 1, within(pulled, 1))
    x.brake_wrap = ca.vertcat(z, z)
    f_x = (x.drive_force - z * friction - air_drag(x, p)) / p.mass
    swing_x, swing_y = swings(p)
    x.body_angle[PITCH] = -swing_x * f_x / (p.pitch_stiffness - swing_x * p.g * up[2])
    x.body_angle[ROLL] = swing_y * p.g * up[1] / (p.roll_stiffness - swing_y * p.g * up[2])
    load = axle_loads(x, p)
    for i, (drive, largest) in enumerate(wheel_shares(x, p, load)):
        along = within((drive - z * largest) / (p.friction * load[i]), NEARLY_ALL)
        slip = slip_for(along, p)
        across = within(up[1] / (p.friction * up[2]), NEARLY_ALL)
        x.grip[i, 0], x.grip[i, 1] = along, ca.if_else(moving, 0, across)
        x.spin[i] = p.initial_speed * (1 + slip / 2) / (1 - slip / 2) / p.wheel_radius  # (4)
    return vars(x)


def within(value: Any, limit: Any) -> Any:
    """The value, or the nearer of +-limit."""
    return ca.fmax(ca.fmin(value, limit), -limit)


def dynamics(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace, t: Any) -> Expressions:
    """State derivative."""
    path, follow, _ = path_following(x, p)
    drive, brake = pedals(t, x, p)
    wanted_angle = u.steering_wheel_angle + steering_wheel(t, follow, p)
    coordinates = coordinate_rates(x)
    return {
        **{name: coordinates[name] for name in ("position", "heading", "body_angle")},
        **motion(x, p),
        **path,
        "steering": ca.vertcat(
            x.steering[1], (wanted_angle - x.steering[0]) / p.steering_time**2 - 2 * x.steering[1] / p.steering_time
        ),  # (1)
        "drive_force": (u.drive_force + drive - x.drive_force) / p.pedal_time,  # (2)
        "brake_force": (u.brake_force + brake - x.brake_force) / p.pedal_time,
        "grade": road_rates(x.grade, u.grade + p.road_grade, p.road_time),
        "bank": road_rates(x.bank, u.bank + p.road_bank, p.road_time),
    }


def road_rates(angle: Any, wanted: Any, tau: Any) -> Any:
    """Rates of an angle (rad) of the road and its two derivatives. (3)"""
    third = (wanted - angle[0]) / tau**3 - 3 * angle[1] / tau**2 - 3 * angle[2] / tau
    return ca.vertcat(angle[1:], third)


def output(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace, t: Any) -> Expressions:
    """Truth at the sensor, and what people ask a car about."""
    rates = dynamics(x, u, p, t)
    q_NS, w_S, r, v, a = sensor_motion(x, rates, p)
    wheel = axles(x, p)
    delta = steering_angle(x, p)
    rim = p.wheel_radius * ca.vertcat(x.spin[FRONT] * ca.cos(delta), x.spin[REAR])
    _, _, path_error = path_following(x, p)
    used = [ca.sqrt(wheel.along[i] ** 2 + wheel.across[i] ** 2) for i in (FRONT, REAR)]
    largest = [wheel.friction[i] * wheel.load[i] for i in (FRONT, REAR)]
    v_x, v_y = x.velocity[0], x.velocity[1]
    speed = norm(x.velocity)
    return {
        **truth(q_NS, w_S, r, v, a, p.g, magnetic_field(t, p)),
        "forward_speed": (1 - p.front_drive_share) * rim[FRONT] + p.front_drive_share * rim[REAR],
        "speed": speed,
        "yaw_rate": x.yaw_rate,
        "side_slip": ca.if_else(speed > STANDING, angle_of(v_y, v_x), 0),
        "longitudinal_acceleration": rates["velocity"][0] - x.yaw_rate * v_y,
        "lateral_acceleration": rates["velocity"][1] + x.yaw_rate * v_x,
        "steering_angle": delta,
        "body_roll": x.body_angle[ROLL],
        "body_pitch": x.body_angle[PITCH],
        "road": ca.vertcat(x.grade[0], x.bank[0]),
        "path_error": path_error,
        "wheel_speed": p.wheel_radius * x.spin,
        "axle_load": ca.vertcat(*wheel.load),
        "longitudinal_force": ca.vertcat(*wheel.along),
        "lateral_force": ca.vertcat(*wheel.across),
        "friction_force": ca.vertcat(*largest),
        "friction_used": ca.vertcat(*(f / ca.fmax(m, 1e-6) for f, m in zip(used, largest, strict=True))),
        "skeleton": outline(x, p),
    }


def _pair(name: str, unit: str, limit: float, nominal: float, description: str, least: float | None = None) -> Signal:
    """A local variable of the front and the rear axle."""
    return Signal(name, unit, description, -limit if least is None else least, limit, (2,), nominal=nominal)


BLOCK = ContinuousBlock(
    name="vehicle",
    summary="Car on a road: planar dynamics with saturating tyres, roll and pitch, and a driver with seven manoeuvres",
    doc="""A single-track car with load transfer, roll and pitch of the body on springs and dampers, tyres of the
magic formula with combined slip inside the friction circle, wheels that turn, slip and lock, dry friction in the
brakes, and grade and bank of the road. Axes are those of ISO 8855: x forward, y left, z up; pitch is negative uphill.
The sensor sits at imu_position from the centre of mass of the body, turned by the Z-Y-X angles mount. Manoeuvre 0 does
what the inputs say. In the others a driver inside the plant steers and uses the pedals, whatever the communication
step is, and the inputs add to what the driver does: 1 constant radius with rising speed (ISO 4138), 2 step steer
(ISO 7401), 3 double lane change (ISO 3888-1), 4 straight braking, 5 slalom, 6 roundabout, 7 straight start (set
road_grade for a hill). Times count from 0 whatever the start time is. With initial_speed = 0 the car of a driver
stands on its brakes until start_time. Grade and bank are the slopes of the road along and across the car, wherever it
heads. forward_speed is the rim speed of the undriven axle (of both, weighted, where all wheels are driven), turned by
the steering angle: wheels that lock or spin mislead it. The driver brakes without an anti-lock system. A body that
leans far is outside of the model: roll and pitch on the springs are taken as small.""",
    reference="H. B. Pacejka, Tire and Vehicle Dynamics, 3rd edition, Butterworth-Heinemann 2012; M. Althoff, "
    "G. Wuersching, CommonRoad: Vehicle Models, TU Munich 2020 (the cars); ISO 8855, ISO 4138, ISO 7401, ISO 3888-1",
    inputs=(
        Signal("steering_wheel_angle", "rad", "Steering-wheel angle, positive to the left", -20, 20),
        Signal(
            "drive_force", "N", "Drive force at the wheels; negative: engine brake or reverse", -2e4, 2e4, nominal=1e3
        ),
        Signal("brake_force", "N", "Brake force at the wheels, front and rear together", 0, 5e4, nominal=1e3),
        Signal("grade", "rad", "Slope of the road along the car, positive uphill", -0.5, 0.5, nominal=0.1),
        Signal(
            "bank",
            "rad",
            "Slope of the road across the car, positive where its right side is lower",
            -0.5,
            0.5,
            nominal=0.1,
        ),
    ),
    outputs=(
        *OUTPUTS,
        FORWARD_SPEED,
        Signal("speed", "m/s", "Speed of the point of the road under the centre of mass", 0, 200, nominal=10),
        Signal("yaw_rate", "rad/s", "Turn of the car about the normal of the road", -100, 100),
        Signal("side_slip", "rad", "Direction of travel relative to the x axis; 0 below 0.1 m/s", -pi, pi, nominal=0.1),
        Signal(
            "longitudinal_acceleration", "m/s2", "Along the road's x axis, centre of mass of an upright car", -1e4, 1e4
        ),
        Signal("lateral_acceleration", "m/s2", "Along the road's y axis, centre of mass of an upright car", -1e4, 1e4),
        Signal("steering_angle", "rad", "Angle of the front wheels, positive to the left", -20, 20, nominal=0.1),
    ),
    locals=(
        Signal("body_roll", "rad", "Roll of the body relative to the road", -10, 10, nominal=0.1),
        Signal("body_pitch", "rad", "Pitch of the body relative to the road, positive nose down", -10, 10, nominal=0.1),
        Signal("road", "rad", "Grade and bank under the car", -10, 10, (2,), nominal=0.1),
        Signal("path_error", "m", "Distance of the centre of mass to the left of its path", -1e7, 1e7),
        _pair("wheel_speed", "m/s", 1e4, 10, "Rim speed of the front and the rear wheels"),
        _pair("axle_load", "N", 1e7, 1e4, "Load of the front and the rear axle", 0),
        _pair("longitudinal_force", "N", 1e7, 1e3, "Force of the road along the front and the rear wheels"),
        _pair("lateral_force", "N", 1e7, 1e3, "Force of the road across the front and the rear wheels"),
        _pair("friction_force", "N", 1e7, 1e4, "Largest force of the front and the rear axle: friction times load", 0),
        _pair("friction_used", "1", 1.001, 1, "Force over its largest, front and rear: 1 at the friction circle", 0),
        skeleton(POINTS),
    ),
    own_parameters=PARAMETERS,
    state=STATE,
    initial=initial,
    dynamics=dynamics,
    output=output,
    longest_step=1e-3,
)
