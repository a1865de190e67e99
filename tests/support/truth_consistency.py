"""The laws that the truth of every plant keeps, checked without any code of the product.

An ideal strapdown navigation - integrate the angular velocity, turn the specific force, subtract gravity, integrate
twice - must arrive at the plant's own attitude, velocity and position. Only a plant whose signals belong to one motion
passes: a wrong sign, frame or term in any of them makes the integrals part.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import make_interp_spline
from scipy.spatial.transform import Rotation

from imufmu.blocks.running import Trajectory


def assert_truth_consistent(run: Trajectory, g: float, earth_field: np.ndarray, tolerance: float) -> None:
    """All truth signals of the run belong to one motion.

    run: smooth over its whole length (no switched inputs), sampled finely enough for a quintic spline. g: m/s2.
    earth_field: (3,), uT, in N. tolerance: for the integrated attitude (rad), velocity (m/s) and position (m).
    """
    assert_signals_agree(run, g, earth_field)
    for name, error in strapdown_errors(run, g).items():
        assert error <= tolerance, f"integrated {name} is {error:.2g} off"


def assert_signals_agree(run: Trajectory, g: float, earth_field: np.ndarray) -> None:
    """Attitude in all its forms, gravity and field agree at every sample, to rounding."""
    rounding = 1e-12  # a few hundred operations on numbers up to 100
    assert np.abs(np.linalg.norm(run["q_NS"], axis=1) - 1).max() <= rounding
    R_NS = _attitude(run["q_NS"])
    yaw_pitch_roll = np.column_stack([run["yaw"], run["pitch"], run["roll"]])
    assert np.abs(Rotation.from_euler("ZYX", yaw_pitch_roll).as_matrix() - R_NS.as_matrix()).max() <= rounding
    assert np.abs(R_NS.inv().apply([0.0, 0.0, 1.0]) - run["vertical"]).max() <= rounding
    assert np.abs(R_NS.inv().apply(earth_field) - run["magnetic_field"]).max() <= 100 * rounding  # of 50 uT
    gravity = run["specific_force"] - run["external_acceleration"]
    assert np.abs(gravity - g * run["vertical"]).max() <= 100 * rounding  # difference of numbers up to 100


def strapdown_errors(run: Trajectory, g: float) -> dict[str, float]:
    """Largest distance of the integrated ideal IMU from the truth: attitude (rad), velocity (m/s), position (m)."""
    reading = make_interp_spline(run.time, np.hstack([run["angular_velocity"], run["specific_force"]]), k=5)

    def slope(t: float, y: np.ndarray) -> np.ndarray:
        q, v_N = y[:4], y[4:7]
        both = reading(t)
        w_S, f_S = both[:3], both[3:]
        q_slope = 0.5 * np.concatenate([[-q[1:] @ w_S], q[0] * w_S + _cross(q[1:], w_S)])
        twist = 2 * _cross(q[1:], f_S)
        a_N = f_S + q[0] * twist + _cross(q[1:], twist) - (0, 0, g)
        return np.concatenate([q_slope, a_N, v_N])

    start = np.concatenate([run["q_NS"][0], run["velocity"][0], run["position"][0]])
    # The longest step keeps the solver from jumping over a short motion between two rests.
    solution = solve_ivp(slope, run.time[[0, -1]], start, "DOP853", run.time, rtol=1e-11, atol=1e-12, max_step=0.1)
    q, v_N, r_N = solution.y[:4].T, solution.y[4:7].T, solution.y[7:].T
    return {
        "attitude": (_attitude(q).inv() * _attitude(run["q_NS"])).magnitude().max(),
        "velocity": np.abs(v_N - run["velocity"]).max(),
        "position": np.abs(r_N - run["position"]).max(),
    }


def _attitude(q_NS: np.ndarray) -> Rotation:
    return Rotation.from_quat(np.roll(q_NS, -1, axis=1))  # scipy puts the scalar last


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross product of two (3,): np.cross takes ten times as long on so few numbers."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
