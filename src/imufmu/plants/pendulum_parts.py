"""Chain of links in a vertical plane: places, energies, end stops, torques. Symbols and numbers: module pendulum."""

from __future__ import annotations

from functools import partial
from types import SimpleNamespace
from typing import Any

import casadi as ca

from .time_functions import along


def arms_to(link: Any, distance: Any, p: SimpleNamespace) -> Any:
    """Arms (n,) of the chain that ends on this link (1 to n), at this distance from its joint."""
    number = ca.SX(range(1, p.length.numel() + 1))
    return ca.if_else(number == link, distance, (number < link) * p.length)


def chain_end(theta: Any, arms: Any) -> Any:
    """Point (x, z) in the plane of H, relative to the pivot, at the end of arms (n,) along the n links. (3)"""
    phi = ca.cumsum(theta)
    return ca.vertcat(ca.dot(arms, ca.sin(phi)), -ca.dot(arms, ca.cos(phi)))


def joints(theta: Any, p: SimpleNamespace) -> Any:
    """Points (x, z) of H, (2, n + 1): the pivot, every joint, the free end."""
    places = [chain_end(theta, arms_to(i + 1, p.length[i], p)) for i in range(theta.numel())]
    return ca.horzcat(ca.SX.zeros(2), *places)


def energies(theta: Any, rate: Any, p: SimpleNamespace) -> tuple[Any, Any]:
    """Kinetic and potential energy (J) of the links. (2)"""
    phi_rate = ca.cumsum(rate)
    T, V = 0, 0
    for i in range(theta.numel()):
        r, r_rate, _ = along(partial(chain_end, arms=arms_to(i + 1, p.com_distance[i], p)), theta, rate)
        T += (p.mass[i] * ca.sumsqr(r_rate) + p.inertia[i] * phi_rate[i] ** 2) / 2
        V += p.mass[i] * p.g * r[1]
    return T, V


def beyond_stops(theta: Any, p: SimpleNamespace) -> tuple[Any, Any]:
    """How far (n,), rad, each joint is beyond its lower and its upper stop; 0 between them."""
    return ca.fmax(p.stop_low - theta, 0), ca.fmax(theta - p.stop_high, 0)


def stop_energy(theta: Any, p: SimpleNamespace) -> Any:
    """Energy (J) in the springs of the stops: their torque without damping, summed up. (5)"""
    low, high = beyond_stops(theta, p)
    return ca.dot(p.stop_stiffness, low**3 + high**3) / 3


def stop_torque(theta: Any, rate: Any, p: SimpleNamespace) -> Any:
    """Torque (n,) of the stops on the joints. (5)"""
    low, high = beyond_stops(theta, p)
    pushed_up = low**2 * ca.fmax(1 - p.stop_damping * rate, 0)
    pushed_down = high**2 * ca.fmax(1 + p.stop_damping * rate, 0)
    return p.stop_stiffness * (pushed_up - pushed_down)


def required_torque(theta: Any, rate: Any, acceleration: Any, p: SimpleNamespace) -> Any:
    """Torque (n,) of the drive that this motion takes. (1)"""
    q, dq = ca.SX.sym("q", theta.numel()), ca.SX.sym("dq", theta.numel())
    T, V = energies(q, dq, p)
    momentum = ca.gradient(T, dq)
    momentum_rate = ca.jtimes(momentum, q, dq) + ca.jtimes(momentum, dq, acceleration)
    torque = momentum_rate - ca.gradient(T - V, q) + p.damping * dq - stop_torque(q, dq, p)
    return ca.substitute(torque, ca.vertcat(q, dq), ca.vertcat(theta, rate))


def swing_up_torque(theta: Any, rate: Any, p: SimpleNamespace) -> Any:
    """Torque (n,) of the drive in the first joint that brings the energy to the one aimed at. (6)"""
    still = ca.SX.zeros(theta.shape)
    _, hanging = energies(still, still, p)
    E = sum(energies(theta, rate, p))
    E_aim = hanging * (1 - 2 * p.swing_up_energy)  # standing upright has the energy of hanging with the other sign
    limit = p.swing_up_torque
    tau_1 = limit * ca.tanh(p.swing_up_gain * (E_aim - E) * rate[0] / limit)
    return ca.SX.eye(theta.numel())[:, 0] * tau_1


def free_acceleration(theta: Any, rate: Any, torque: Any, p: SimpleNamespace) -> Any:
    """Joint accelerations (n,) under this torque of the drive: (1) is linear in them."""
    ddq = ca.SX.sym("ddq", theta.numel())
    required = required_torque(theta, rate, ddq, p)
    M = ca.jacobian(required, ddq)
    return ca.solve(M, torque - ca.substitute(required, ddq, ca.SX.zeros(ddq.shape)))
