"""Tyres, wheels and brakes of the vehicle: what one axle does on the road.

    symbol      here                unit    meaning, for one axle
    Vx, Vy      V_x, V_y            m/s     velocity of the contact point, along and across the wheel
    omega       spin                rad/s   of the wheels
    kappa, tau  slip, lateral_slip  1       state of the tyre: what is left of the sliding after the contact length
    sigma       p.relaxation_length m       way in which a tyre builds up its force
    rho         rho                 1       slip times stiffness, along and across
    c_x, c_y    p.longitudinal_stiffness, p.cornering_stiffness (1, 1/rad)    initial slope of force over mu Fz
    C           p.tyre_shape        1       of the magic formula
    mu, Fz      friction, load      1, N    of the axle
    z           brake_wrap          1       how far the brake's lining has taken its force: -1 to 1

Slip as a state [1, chapter 7]. Nothing is divided by a speed, so standing still is a motion like any other:

    sigma kappa' = R omega - Vx - V kappa                                                        (1)
    sigma tau'   = -Vy - V tau,         V = (|(Vx, Vy)| + |R omega|) / 2                          (2)

At speed kappa and tau settle to the slip of the books. At standstill they are the deflection of a spring, which the
damper T(V) quiets:

    s = (kappa, tau) + T(V) (kappa', tau'),   T(V) = T_0 / (1 + (V / V_0)^2)                      (3)

Magic formula [1, section 4.3] of the combined slip; its length is at most 1, the friction circle holds by its form:

    F = mu Fz sin(C atan(|rho| / C)) rho / |rho|,   rho = (c_x s_x, c_y s_y)                      (4)

The friction of the two wheels of an axle falls with their load: mu_w = mu_0 (1 - k (Fw / F0 - 1)), F0 = m g / 4. With
the load dF moved from one wheel to the other, and mu Fz the sum over both,

    mu = mu_0 (1 - k ((Fz / 2 + 2 dF^2 / Fz) / F0 - 1))                                           (5)

Brakes and rolling resistance are dry friction [2] that builds up within the way d, and no faster than in the time T_b:
it never drives a wheel further than about d, and it holds one without creep.

    z' = (R omega - |R omega| z) / (d + T_b |R omega|)                                            (6)
    I omega' = R (Fx_drive - z (F_brake + f_r Fz) - Fx)                                           (7)

[1] H. B. Pacejka, Tire and Vehicle Dynamics, 3rd edition, Butterworth-Heinemann 2012
[2] P. R. Dahl, A Solid Friction Model, The Aerospace Corporation, TOR-0158(3107-18)-1, 1968
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import casadi as ca

from ..rotations import TINY, norm

DAMPING_TIME = 0.02  # s: T_0
DAMPED_BELOW = 1.0  # m/s: V_0
WRAP_LENGTH = 0.01  # m: d
WRAP_TIME = 0.01  # s: T_b
LEAST_FRICTION = 0.1  # of mu_0, however large the load


def slip_rates(V_x: Any, V_y: Any, spin: Any, slip: Any, lateral_slip: Any, p: SimpleNamespace) -> tuple[Any, Any, Any]:
    """Rates of slip and lateral slip (1/s), and the damper's time T (s); of one axle. (1), (2), (3)"""
    rim = p.wheel_radius * spin
    V = (norm(ca.vertcat(V_x, V_y)) + ca.fabs(rim)) / 2
    slip_rate = (rim - V_x - V * slip) / p.relaxation_length  # (1)
    lateral_rate = (-V_y - V * lateral_slip) / p.relaxation_length  # (2)
    return slip_rate, lateral_rate, DAMPING_TIME / (1 + (V / DAMPED_BELOW) ** 2)


def force_over_friction(rho_x: Any, rho_y: Any, shape: Any) -> tuple[Any, Any]:
    """Force over mu Fz (1), along and across the wheel. (4)"""
    rho = ca.sqrt(rho_x**2 + rho_y**2 + TINY**2)
    gain = ca.sin(shape * ca.atan(rho / shape)) / rho
    return gain * rho_x, gain * rho_y


def slip_for(force: Any, shape: Any) -> Any:
    """rho of a pure slip that gives this force over mu Fz, within (-1, 1): (4) backwards."""
    return shape * ca.tan(ca.asin(force) / shape)


def axle_friction(load: Any, moved: Any, p: SimpleNamespace) -> Any:
    """mu of an axle whose outer wheel carries ``moved`` (N) more than half of its load. (5)"""
    least = ca.fmax(load, TINY)
    moved = ca.fmin(ca.fabs(moved), least / 2)  # the inner wheel does not pull
    nominal = p.mass * p.g / 4
    loss = p.load_sensitivity * ((least / 2 + 2 * moved**2 / least) / nominal - 1)
    return p.friction * ca.fmax(1 - loss, LEAST_FRICTION)


def wrap_rate(spin: Any, brake_wrap: Any, p: SimpleNamespace) -> Any:
    """z' (1/s). (6)"""
    rim = p.wheel_radius * spin
    return (rim - ca.fabs(rim) * brake_wrap) / (WRAP_LENGTH + WRAP_TIME * ca.fabs(rim))


def spin_rate(drive: Any, friction: Any, force: Any, p: SimpleNamespace) -> Any:
    """omega' (rad/s2) of an axle from its forces (N): drive, brake and rolling resistance, road. (7)"""
    return p.wheel_radius * (drive - friction - force) / p.wheel_inertia
