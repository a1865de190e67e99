"""Tyres, wheels and brakes of the vehicle: what one axle does on the road.

    symbol      here                unit    meaning, for one axle
    v_s         sliding             m/s     rim minus contact point along the wheel; minus contact point across it
    omega       spin                rad/s   of the wheels
    V           transport           m/s     at which the contact patch is renewed
    w           grip                1       state: force over mu Fz, along and across the wheel
    c           stiffness           1       (longitudinal, cornering): initial slope of w over slip; per rad across
    sigma       p.relaxation_length m       way in which a tyre builds up its force
    C           p.tyre_shape        1       of the magic formula
    mu, Fz      friction, load      1, N    of the axle
    z           brake_wrap          1       part of the brake's friction that acts, -1 to 1

The force is a state [1, chapter 7] and nothing is divided by a speed that is zero at rest, so that standing, starting
and stopping are motions like any other. With c v_s element by element,

    w' = (c v_s - D w) / (sigma + D T_w)                                                          (1)
    D = V / G(|rho|),   rho = c v_s / V,   G(rho) = sin(C atan(rho / C)) / rho                     (2)
    V = (|(Vx, Vy)| + |R omega|) / 2                                                              (3)

Rolling steadily, w = G(|rho|) rho: the magic formula [1, section 4.3] of the combined slip rho / c, built up over the
way sigma. Standing, w' = c v_s / sigma: a spring. Sliding with locked wheels, D = c |v_s| / sin(...): dry friction,
which forgets its deflection within sigma / c, the way that the rubber gives. T_w bounds the rate and adds V T_w to
sigma: 2 cm at 20 m/s. |w| <= 1 is the friction circle; a damper that fades with V quiets the spring of a car at rest,
inside the same circle:

    F = mu Fz w_d / max(1, |w_d|),   w_d = w + w' T_0 / (1 + (V / V_0)^2)                         (4)

The friction of the two wheels of an axle falls with their load: mu_w = mu_0 (1 - k (Fw / F0 - 1)), F0 = m g / 4. With
the load dF moved from one wheel to the other, and mu Fz the sum over both,

    mu = mu_0 (1 - k ((Fz / 2 + 2 dF^2 / Fz) / F0 - 1))                                           (5)

Brakes and rolling resistance are dry friction [2] that builds up within the way d, and no faster than in the time T_b:
it never drives a wheel further than about d, and it holds one without creep.

    z' = (R omega - |R omega| z) / (d + T_b |R omega|)                                            (6)
    I omega' = R (F_drive - z (F_brake + f_r Fz) - F)                                             (7)

[1] H. B. Pacejka, Tire and Vehicle Dynamics, 3rd edition, Butterworth-Heinemann 2012
[2] P. R. Dahl, A Solid Friction Model, The Aerospace Corporation, TOR-0158(3107-18)-1, 1968
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import casadi as ca

from ...blocks.rotations import TINY, norm

GRIP_TIME = 1e-3  # s: T_w
DAMPING_TIME = 0.02  # s: T_0
DAMPED_BELOW = 1.0  # m/s: V_0
WRAP_LENGTH = 0.01  # m: d
WRAP_TIME = 0.01  # s: T_b
LEAST_FRICTION = 0.1  # of mu_0, however large the load


def grip_rate(velocity: Any, rim: Any, grip: Any, stiffness: Any, p: SimpleNamespace) -> tuple[Any, Any]:
    """Rate w' (2,) of an axle, 1/s, and the grip w_d (2,) that its force has; both along and across the wheel.

    velocity: (2,), of the contact point along and across the wheel, m/s. rim: R omega, m/s. (1) to (4)
    """
    V = (norm(velocity) + ca.fabs(rim)) / 2  # (3)
    sliding = ca.vertcat(rim, 0) - velocity
    pull = stiffness * sliding
    rho = norm(pull) / (V + TINY)
    D = (V + TINY) * rho / ca.sin(p.tyre_shape * ca.atan(rho / p.tyre_shape))  # (2)
    rate = (pull - D * grip) / (p.relaxation_length + D * GRIP_TIME)  # (1)
    damped = grip + rate * DAMPING_TIME / (1 + (V / DAMPED_BELOW) ** 2)
    return rate, damped / ca.fmax(1, norm(damped))  # (4)


def slip_for(grip: Any, p: SimpleNamespace) -> Any:
    """Longitudinal slip (1) of a tyre that rolls steadily with this grip, within (-1, 1): (2) backwards."""
    return p.tyre_shape * ca.tan(ca.asin(grip) / p.tyre_shape) / p.longitudinal_stiffness


def axle_friction(load: Any, moved: Any, p: SimpleNamespace) -> Any:
    """mu of an axle whose outer wheel carries ``moved`` (N) more than half of its load. (5)"""
    least = ca.fmax(load, TINY)
    moved = ca.fmin(ca.fabs(moved), least / 2)  # the inner wheel does not pull
    nominal = p.mass * p.g / 4
    loss = p.load_sensitivity * ((least / 2 + 2 * moved**2 / least) / nominal - 1)
    return p.friction * ca.fmax(1 - loss, LEAST_FRICTION)


def wrap_rate(rim: Any, brake_wrap: Any) -> Any:
    """z' (1/s) of an axle whose rim moves at R omega (m/s). (6)"""
    return (rim - ca.fabs(rim) * brake_wrap) / (WRAP_LENGTH + WRAP_TIME * ca.fabs(rim))


def spin_rate(drive: Any, friction: Any, force: Any, p: SimpleNamespace) -> Any:
    """omega' (rad/s2) of an axle from its forces (N): drive, brake and rolling resistance, road. (7)"""
    return p.wheel_radius * (drive - friction - force) / p.wheel_inertia
