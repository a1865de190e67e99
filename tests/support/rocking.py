"""A sensor that is rocked about all axes: readings that tell their units and axes by themselves."""

from __future__ import annotations

import casadi as ca
import numpy as np

from imufmu.blocks.rotations import over_rows, quaternion_from_euler, rotate_back

GRAVITY = 9.80665


def rocking(seconds: float = 20.0, rate: float = 100.0, seed: int = 4) -> dict[str, np.ndarray]:
    """time (n,), gyro (n, 3), accel (n, 3), mag (n, 3), q_NS (n, 4) with a little noise, SI. At rest for a second."""
    time = np.arange(round(seconds * rate)) / rate
    moving = np.clip(time - 1, 0, 1)
    roll = moving * (0.6 * np.sin(1.7 * time))
    pitch = moving * (0.5 * np.sin(1.1 * time + 0.4) - 0.5 * np.sin(0.4))
    yaw = moving * (0.8 * np.sin(0.7 * time))
    q_NS = over_rows(quaternion_from_euler, roll, pitch, yaw)
    rng = np.random.default_rng(seed)
    turns = over_rows(lambda p, q: ca.vertcat(*_relative(p, q)), q_NS[:-1], q_NS[1:])
    gyro = np.vstack([np.zeros(3), 2 * turns * rate]) + rng.normal(0, 2e-3, (len(time), 3))
    accel = over_rows(lambda q: rotate_back(q, [0, 0, GRAVITY]), q_NS) + rng.normal(0, 0.02, (len(time), 3))
    mag = over_rows(lambda q: rotate_back(q, [1.4, 20.1, -44.9]), q_NS) + rng.normal(0, 0.3, (len(time), 3))
    return {"time": time, "gyro": gyro, "accel": accel, "mag": mag, "q_NS": q_NS}


def _relative(p: ca.MX, q: ca.MX) -> list[ca.MX]:
    """Vector part of conj(p) q: half the small turn from p to q, in the sensor."""
    w, v = p[0], p[1:]
    return [w * q[i + 1] - q[0] * v[i] - ca.cross(v, q[1:])[i] for i in range(3)]


def lines_of(header: str, *columns: np.ndarray, separator: str = ",", digits: int = 7) -> str:
    """A text table of these columns, (n,) or (n, k), below a header that may be of many lines."""
    table = np.column_stack(columns)
    rows = [separator.join(f"{value:.{digits}f}" for value in row) for row in table]
    return "\n".join([header, *rows]) + "\n"
