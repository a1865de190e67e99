"""Parameters of the vehicle: the car, its sensor, its road and its manoeuvres."""

from __future__ import annotations

from math import pi, radians

from ...blocks.signals import Parameter, integer, real
from ..truth import PARAMETERS as OF_TRUTH
from .driver import HILL_START, LANE_CHANGE, OPEN

# A BMW 320i: M. Althoff, G. Wuersching, CommonRoad: Vehicle Models, TU Munich 2020, table 6, as the package
# commonroad-vehicle-models 3.0.2 has it. Roll and pitch from the springs and dampers of that table: K_phi is the sum
# over the axles of K_s T^2 / 2 - K_ts, K_theta of 2 K_s a^2. Tyres: initial slopes, peak and shape of its PAC2002 set.
# Air, rolling resistance, steering ratio, relaxation length and the times are chosen: usual values.
CAR: tuple[Parameter, ...] = (
    real("mass", "kg", 1093.3, (100, 1e5), "Mass of the whole car"),
    real("body_mass", "kg", 965.7, (50, 1e5), "Mass of the body on its springs, below that of the whole car"),
    real("front_distance", "m", 1.156, (0.3, 10), "Front axle from the centre of mass"),
    real("rear_distance", "m", 1.423, (0.3, 10), "Rear axle from the centre of mass"),
    real("track", "m", 1.375, (0.5, 5), "Left to right wheel"),
    real("length", "m", 4.508, (1, 30), "Length of the body, to draw it"),
    real("width", "m", 1.61, (0.5, 5), "Width of the body; sets the lanes of manoeuvre 3"),
    real("body_com_height", "m", 0.614, (0.1, 3), "Centre of mass of the body above the road"),
    real("roll_axis_height", "m", 0.0, (-1, 2), "Roll axis above the road"),
    real("yaw_inertia", "kg.m2", 1791.6, (10, 1e6), "Moment of inertia of the car about the vertical"),
    real("roll_inertia", "kg.m2", 207.3, (1, 1e6), "Moment of inertia of the body about x through its centre of mass"),
    real(
        "pitch_inertia", "kg.m2", 1565.8, (1, 1e6), "Moment of inertia of the body about y through its centre of mass"
    ),
    real("roll_stiffness", "N.m/rad", 51340.0, (1e3, 1e7), "Springs and anti-roll bars against roll"),
    real("roll_damping", "N.m.s/rad", 3252.0, (0, 1e6), "Dampers against roll"),
    real("pitch_stiffness", "N.m/rad", 144900.0, (1e3, 1e8), "Springs against pitch"),
    real("pitch_damping", "N.m.s/rad", 11450.0, (0, 1e7), "Dampers against pitch"),
    real("front_roll_share", "1", 0.593, (0, 1), "Part of the roll stiffness that is at the front"),
    real("friction", "1", 1.0489, (0.05, 2), "Tyre force over load at the peak, at a quarter of the weight per wheel"),
    real("load_sensitivity", "1", 0.02, (0, 0.5), "Loss of friction when the load of a wheel doubles"),
    real(
        "cornering_stiffness",
        "1",
        20.9,
        (1, 100),
        "Lateral slope, front and rear: force over friction and load, per rad",
        shape=(2,),
    ),
    real("longitudinal_stiffness", "1", 19.0, (1, 100), "Longitudinal slope: force over friction and load, per slip"),
    real("tyre_shape", "1", 1.3507, (1, 1.9), "Shape factor C of the magic formula"),
    real("relaxation_length", "m", 0.3, (0.02, 2), "Way in which a tyre builds up its force"),
    real("wheel_radius", "m", 0.344, (0.1, 1), "Effective rolling radius"),
    real("wheel_inertia", "kg.m2", 3.4, (0.5, 100), "Moment of inertia of the two wheels of an axle"),
    real("steering_ratio", "1", 16.0, (1, 50), "Steering-wheel angle over front wheel angle"),
    real("steering_time", "s", 0.03, (0.01, 1), "Time constant, twice, from steering wheel to front wheels"),
    real("pedal_time", "s", 0.1, (0.01, 2), "Time constant of drive and brake force"),
    real("front_drive_share", "1", 0.0, (0, 1), "Part of the drive force at the front axle: 0 rear, 1 front drive"),
    real("front_brake_share", "1", 0.66, (0, 1), "Part of the brake force at the front axle"),
    real("rolling_resistance", "1", 0.012, (0, 0.1), "Rolling resistance over load"),
    real("drag_area", "m2", 0.7, (0, 20), "Drag coefficient times frontal area"),
    real("air_density", "kg/m3", 1.2, (0, 10), "Density of the air"),
)

SENSOR: tuple[Parameter, ...] = (
    real(
        "imu_position",
        "m",
        (0.3, 0.0, -0.2),
        (-20, 20),
        "Sensor from the body's centre of mass, in the body",
        shape=(3,),
    ),
    real("mount", "rad", 0.0, (-pi, pi), "Roll, pitch, yaw of the sensor in the body", shape=(3,)),
)

ROAD: tuple[Parameter, ...] = (
    real("heading", "rad", 0.0, (-pi, pi), "Heading at the start, from East towards North"),
    real("road_grade", "rad", 0.0, (-0.5, 0.5), "Constant slope along the car, positive uphill; the input adds to it"),
    real("road_bank", "rad", 0.0, (-0.5, 0.5), "Constant slope across it, right side lower; the input adds to it"),
    real("road_time", "s", 0.1, (0.02, 10), "Time constant, three times, in which the road turns to grade and bank"),
)

MANOEUVRE: tuple[Parameter, ...] = (
    integer(
        "manoeuvre",
        LANE_CHANGE,
        (OPEN, HILL_START),
        "0 inputs only, 1 circle, 2 step steer, 3 double lane change, 4 braking, 5 slalom, 6 roundabout, 7 hill start",
    ),
    real("initial_speed", "m/s", 80 / 3.6, (0, 80), "Speed at the start; 0 starts from standstill"),
    real("final_speed", "m/s", 80 / 3.6, (0, 80), "Speed that the driver goes to"),
    real("speed_rate", "m/s2", 1.0, (1e-3, 10), "Rate at which the driver changes the speed"),
    real("start_time", "s", 1.0, (0, 1e6), "When the driver begins to change the speed, or starts from standstill"),
    real("path_start", "m", 20.0, (0, 1e5), "Straight way before the circle, the first lane or the slalom"),
    real("preview_time", "s", 0.8, (0.2, 5), "How far ahead the driver aims: smaller follows the path more stiffly"),
    real("lead_time", "s", 0.2, (0, 2), "How early the driver turns the wheel"),
    real("circle_radius", "m", 100.0, (5, 1e4), "Manoeuvre 1: radius, to the left"),
    real("circle_entry", "m", 20.0, (1, 1e3), "Manoeuvres 1, 6: way in which the curvature grows"),
    real("step_angle", "rad", radians(20), (-20, 20), "Manoeuvre 2: steering-wheel angle after the step"),
    real("step_time", "s", 1.0, (0, 1e6), "Manoeuvre 2: start of the step"),
    real("step_rise", "s", 0.15, (0.01, 100), "Manoeuvre 2: duration of the step"),
    real("brake_time", "s", 1.0, (0, 1e6), "Manoeuvre 4: start of the braking"),
    real("deceleration", "m/s2", 6.0, (0, 20), "Manoeuvre 4: brake force over mass"),
    integer("cones", 8, (1, 1000), "Manoeuvre 5: number of cones"),
    real("cone_distance", "m", 30.0, (5, 1e3), "Manoeuvre 5: cone to cone, and to the first"),
    real("slalom_amplitude", "m", 1.6, (0, 20), "Manoeuvre 5: centre of mass from the line of cones, at each of them"),
    real("roundabout_radius", "m", 15.0, (5, 1e4), "Manoeuvre 6: radius of the way round, to the left"),
    real("laps", "1", 5.0, (0, 1e4), "Manoeuvre 6: ways round before the exit"),
)

PARAMETERS = (*OF_TRUTH, *CAR, *SENSOR, *ROAD, *MANOEUVRE)
