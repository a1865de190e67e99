"""Manoeuvres of the vehicle: paths, speeds and the driver who follows them.

The driver is part of the plant, so that a manoeuvre does not depend on the communication step.

    s, x_ref, y_ref, psi_ref    x.path_distance, x.reference, x.reference_heading    the nearest point of the path
    kappa       curvature           1/m     of the path, positive to the left
    e           lateral error       m       car to the left of the path
    V           speed               m/s     at least CALM
    T_p, T_l    p.preview_time, p.lead_time   s   the driver aims T_p ahead and acts T_l early
    K_us        understeer_gradient rad.s2/m    of the linear tyres
    L           wheelbase           m

The path starts where the car starts, along its heading, and is given by its curvature: of the way s on circles, of the
distance x along the start's heading for courses y(x):

    s' = v_t / (1 - kappa e),   psi_ref' = kappa s',   (x_ref, y_ref)' = s' (cos psi_ref, sin psi_ref)    (1)
    kappa = y'' / (1 + y'^2)^(3/2)                                                                (2)

Steering: the wheel angle of a steady turn of the curvature ahead, corrected as a spring and a damper of the way T_p V:

    kappa_d = kappa(T_l V ahead) - e / (T_p V)^2 - sqrt(2) e' / (T_p V^2)                         (3)
    delta = kappa_d (L + K_us v^2)                                                                (4)

Speed: from initial_speed to final_speed at speed_rate, from start_time on. The force is what this takes, plus a
correction; a negative one goes to the brakes. A car that starts from standstill is held by its brakes until start_time.

Double lane change, ISO 3888-1 [1], to the left, w the width of the car:

    section         1              2      3              4      5              6
    length (m)      15             30     25             25     15             15
    lane width (m)  1.1 w + 0.25   -      1.2 w + 0.25   -      1.3 w + 0.25   1.3 w + 0.25

The right boundaries of lane 3 and lane 1 are 3.5 m apart; those of lanes 5 and 1 are in line.

[1] ISO 3888-1:2018, Passenger cars, Test track for a severe lane-change manoeuvre, Part 1: Double lane-change
"""

from __future__ import annotations

from functools import partial
from math import pi, sqrt
from types import SimpleNamespace
from typing import Any

import casadi as ca

from ..time_functions import along, smooth_step
from .body import air_drag, wheelbase
from .road import coordinate_rates, up_in_road

OPEN, CIRCLE, STEP_STEER, LANE_CHANGE, BRAKING, SLALOM, ROUNDABOUT, HILL_START = range(8)

LANE_LENGTHS = (15.0, 30.0, 25.0, 25.0, 15.0, 15.0)  # m, sections 1 to 6
LANE_OFFSET = 3.5  # m
# How far each change of lane starts before its section, and ends after it (m): the lanes leave that much room.
CHANGE_OUT = 8.0, 8.0
CHANGE_BACK = 9.0, 10.0

CALM = 2.0  # m/s: below, the driver steers as at this speed
SPEED_GAIN = 1.0  # 1/s
HOLDING = 0.6  # brake force at standstill over weight: holds on a slope of 30 deg
RELEASE_TIME = 0.5  # s: from brake to drive
PEDAL_TIME = 0.3  # s: to full braking
LARGEST_ANGLE = 0.6  # rad, front wheels
NEAR_CENTRE = 0.1  # of the radius: a car this near to the centre of the circle has lost its path anyway


def lane_widths(width: Any) -> tuple[Any, Any, Any]:
    """Width (m) of lanes 1, 3 and 5 for a car of this width."""
    return 1.1 * width + 0.25, 1.2 * width + 0.25, 1.3 * width + 0.25


def lane_change(x: Any, p: SimpleNamespace) -> Any:
    """Course y (m) of the double lane change at x (m): the middle of each lane."""
    first, third, fifth = lane_widths(p.width)
    third_middle = LANE_OFFSET + (third - first) / 2
    fifth_middle = (fifth - first) / 2
    since = x - p.path_start
    out_from, out_to = LANE_LENGTHS[0] - CHANGE_OUT[0], sum(LANE_LENGTHS[:2]) + CHANGE_OUT[1]
    back_from, back_to = sum(LANE_LENGTHS[:3]) - CHANGE_BACK[0], sum(LANE_LENGTHS[:4]) + CHANGE_BACK[1]
    out = smooth_step((since - out_from) / (out_to - out_from))
    back = smooth_step((since - back_from) / (back_to - back_from))
    return third_middle * out + (fifth_middle - third_middle) * back


def slalom(x: Any, p: SimpleNamespace) -> Any:
    """Course y (m) of the slalom at x (m): farthest from the line of cones at each of them, on alternate sides."""
    cone = (x - p.path_start) / p.cone_distance  # 1 at the first
    grown = smooth_step(cone) * smooth_step(p.cones + 1 - cone)
    return -p.slalom_amplitude * grown * ca.cos(pi * cone)


def course_curvature(course: Any, x: Any) -> Any:
    """Curvature (1/m) of a course y(x). (2)"""
    _, slope, bend = along(course, x, 1)
    return bend / (1 + slope**2) ** 1.5


def circle_curvature(s: Any, radius: Any, p: SimpleNamespace) -> Any:
    """Curvature (1/m) of a circle that is entered smoothly."""
    return smooth_step((s - p.path_start) / p.circle_entry) / radius


def curvature(s: Any, x: Any, p: SimpleNamespace) -> Any:
    """Curvature (1/m) of the chosen path where it is s long and x (m) along the start's heading."""
    left = p.path_start + p.laps * 2 * pi * p.roundabout_radius
    roundabout = circle_curvature(s, p.roundabout_radius, p)
    paths = {
        CIRCLE: circle_curvature(s, p.circle_radius, p),
        LANE_CHANGE: course_curvature(partial(lane_change, p=p), x),
        SLALOM: course_curvature(partial(slalom, p=p), x),
        ROUNDABOUT: roundabout * (1 - smooth_step((s - left) / p.circle_entry)),
    }
    return sum(ca.if_else(p.manoeuvre == which, value, 0) for which, value in paths.items())


def understeer_gradient(p: SimpleNamespace) -> Any:
    """K_us (rad.s2/m) of the linear tyres: front minus rear slip angle per lateral acceleration."""
    stiffness = p.friction * p.cornering_stiffness
    return (1 / stiffness[0] - 1 / stiffness[1]) / p.g


def path_following(x: SimpleNamespace, p: SimpleNamespace) -> tuple[dict[str, Any], Any, Any]:
    """Rates of the path's states, the steering-wheel angle that follows it (rad), the error e (m). (1), (3), (4)"""
    ahead = ca.vertcat(ca.cos(x.reference_heading), ca.sin(x.reference_heading))
    left = ca.vertcat(-ahead[1], ahead[0])
    velocity = coordinate_rates(x)["position"][:2]
    e = ca.dot(left, x.position[:2] - x.reference)
    e_rate = ca.dot(left, velocity)
    start = ca.vertcat(ca.cos(p.heading), ca.sin(p.heading))
    x_ref = ca.dot(start, x.reference)

    kappa = curvature(x.path_distance, x_ref, p)
    s_rate = ca.dot(ahead, velocity) / ca.fmax(1 - kappa * e, NEAR_CENTRE)
    rates = dict(path_distance=s_rate, reference=s_rate * ahead, reference_heading=kappa * s_rate)  # (1)

    v = x.velocity[0]
    V = ca.sqrt(v**2 + CALM**2)
    lead = p.lead_time * v
    preview = p.preview_time * V
    wanted = curvature(x.path_distance + lead, x_ref + lead, p) - e / preview**2 - sqrt(2) * e_rate / (preview * V)
    delta = wanted * (wheelbase(p) + understeer_gradient(p) * v**2)
    delta = ca.fmin(ca.fmax(delta, -LARGEST_ANGLE), LARGEST_ANGLE)
    return rates, p.steering_ratio * delta, e


def steering_wheel(t: Any, follow: Any, p: SimpleNamespace) -> Any:
    """Steering-wheel angle (rad) of the driver; ``follow`` is the one that follows the path."""
    step = p.step_angle * smooth_step((t - p.step_time) / p.step_rise)
    follows = ca.logic_and(p.manoeuvre != OPEN, p.manoeuvre != STEP_STEER)
    return ca.if_else(follows, follow, ca.if_else(p.manoeuvre == STEP_STEER, step, 0))


def speed_profile(t: Any, p: SimpleNamespace) -> tuple[Any, Any]:
    """Wanted speed (m/s) and its rate (m/s2) at time t."""
    change = p.final_speed - p.initial_speed
    gained = p.speed_rate * ca.fmax(t - p.start_time, 0)
    going = ca.logic_and(t >= p.start_time, gained < ca.fabs(change))
    return (
        p.initial_speed + ca.sign(change) * ca.fmin(gained, ca.fabs(change)),
        ca.if_else(going, ca.sign(change) * p.speed_rate, 0),
    )


def resistance(x: SimpleNamespace, p: SimpleNamespace) -> Any:
    """Force (N) that a steady speed takes: air, rolling and slope."""
    up = up_in_road(x)
    return air_drag(x, p) + p.mass * p.g * (p.rolling_resistance * up[2] + up[0])


def pedals(t: Any, x: SimpleNamespace, p: SimpleNamespace) -> tuple[Any, Any]:
    """Drive and brake force (N) of the driver; none in manoeuvre 0."""
    wanted, rate = speed_profile(t, p)
    from_rest = p.initial_speed == 0
    released = ca.if_else(from_rest, smooth_step((t - p.start_time) / RELEASE_TIME), 1)
    stopping = ca.if_else(p.manoeuvre == BRAKING, smooth_step((t - p.brake_time) / PEDAL_TIME), 0)
    force = resistance(x, p) + p.mass * (rate + SPEED_GAIN * (wanted - x.velocity[0]))
    force *= released * (1 - stopping)
    holding = HOLDING * p.g * (1 - released)
    brake = ca.fmax(-force, 0) + p.mass * (holding + p.deceleration * stopping)
    driven = p.manoeuvre != OPEN
    return ca.if_else(driven, ca.fmax(force, 0), 0), ca.if_else(driven, brake, 0)
