"""The filter of plumb once more, with whole matrices and all measurements of a block at once, for its tests."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.linalg import block_diag
from scipy.spatial.transform import Rotation


@dataclass
class Reference:
    """The filter of the module docstring once more: whole matrices, all measurements of a block at once."""

    p: Mapping[str, Any]
    R: np.ndarray
    gyro_lp: np.ndarray
    accel_lp: np.ndarray
    v: np.ndarray = field(default_factory=lambda: np.zeros(3))
    b: np.ndarray = field(default_factory=lambda: np.zeros(3))
    D: np.ndarray = field(default_factory=lambda: np.zeros((3, 3)))
    speed2: float = 0.0
    lasting: np.ndarray = field(default_factory=lambda: np.zeros(3))
    fresh: float = 0.0
    still: int = 0
    level: bool = True
    levelled: bool = False
    resting: bool = False
    travels: bool = False
    quiet: float = 0.0

    def __post_init__(self) -> None:
        p = self.p
        self.P = np.diag(np.repeat([p["P0_psi"], p["P0_v"], p["P0_b"], p["P0_D"]], [3, 3, 3, 9]) ** 2)
        self.begin_block()

    def begin_block(self) -> None:
        self.samples, self.T = 0, 0.0
        self.dV, self.S, self.theta, self.W = np.zeros(3), np.zeros((3, 3)), np.zeros(3), np.zeros((3, 3))

    def sample(self, gyro: np.ndarray, accel: np.ndarray, gyro_missing: bool, accel_missing: bool) -> None:
        p, dt = self.p, self.p["sample_period"]
        w = (np.eye(3) + self.D) @ (gyro - self.b)
        before, self.R = self.R, self.R @ Rotation.from_rotvec(w * dt).as_matrix()
        mean = (before + self.R) / 2
        self.S += mean * dt
        self.theta += w * dt
        for i in range(3):
            if gyro_missing or abs(gyro[i]) > 0.95 * p["gyro_range"]:
                self.W[i, i] += p["s_s"] ** 2 * dt
        if not accel_missing:
            self.dV += self.R @ accel * dt
            self.T += dt
        alpha = dt / (p["rr_l"] + dt)
        self.gyro_lp = (1 - alpha) * self.gyro_lp + alpha * gyro
        self.accel_lp = (1 - alpha) * self.accel_lp + alpha * accel
        is_still = (
            np.linalg.norm(gyro - self.gyro_lp) < p["rr_dg"]
            and np.linalg.norm(accel - self.accel_lp) < p["rr_da"]
            and all(abs(self.gyro_lp) < p["rr_b"])
            and not (gyro_missing or accel_missing)
        )
        self.still = self.still + 1 if is_still else 0
        self.samples += 1
        if self.samples == max(1, round(p["h"] / dt)):
            self.end_block(self.samples * dt)
            self.begin_block()

    def at_rest(self) -> bool:
        return self.still * self.p["sample_period"] >= self.p["rr_t"] and self.level

    def density(self, P: np.ndarray, H: float) -> float:
        """Of the velocity in motion; ``travels`` says whether it lasts."""
        p = self.p
        noise = p["s_v"] ** 2 * math.sqrt(max(self.speed2, p["v2"] ** 2)) / p["k_v"]
        lasting = self.lasting + H / (p["t_s"] + H) * (self.v - self.lasting)
        excess = lasting @ lasting / 3 - 4 * noise / (2 * p["t_s"])
        self.travels = bool(excess > 0)
        expected = max(excess - 4 * np.trace(P[3:6, 3:6]) / 3, self.fresh * p["v_0"] ** 2)
        return float(noise + 2 * p["t_v"] * expected * self.levelled)

    def end_block(self, H: float) -> None:
        p, resting = self.p, self.at_rest()
        self.v = self.v + self.dV - np.array([0, 0, p["g"]]) * self.T
        x, y, z = self.dV
        F = np.eye(18)
        F[0:3, 6:9] = -self.S
        for i in range(3):
            for j in range(3):
                F[0:3, 9 + 3 * i + j] = self.S[:, i] * self.theta[j] / H
        F[3:6, 0:3] = -np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        W = self.W + p["k_g"] ** 2 / H * np.outer(self.theta, self.theta)
        psi = p["s_g"] ** 2 * H * np.eye(3) + self.R @ W @ self.R.T
        dv = (p["s_a"] ** 2 * H + p["s_m"] ** 2 * (H - self.T)) * np.eye(3)
        P = F @ self.P @ F.T + block_diag(psi, dv, p["s_b"] ** 2 * H * np.eye(3), np.zeros((9, 9)))
        scale = np.ones(18)
        scale[[0, 1, 2, 6, 7, 8]] = np.minimum(1, 1 / np.sqrt(np.diag(P)[[0, 1, 2, 6, 7, 8]]))
        P = P * np.outer(scale, scale)
        if not resting and self.levelled and P[0, 0] + P[1, 1] > 2 * p["P0_psi"] ** 2:
            self.v, P[3:6], P[:, 3:6], self.levelled = np.zeros(3), 0, 0, False
            P[3:6, 3:6] = np.eye(3) * p["P0_v"] ** 2
        if resting and not self.resting and np.sum(self.v**2 / (np.diag(P)[3:6] + p["rr_v"] ** 2 / H)) > 9:
            self.v, P[3:6], P[:, 3:6] = np.zeros(3), 0, 0
            P[3:6, 3:6] = np.eye(3) * p["rr_v"] ** 2 / H
        C, innovation = np.zeros((3, 18)), -self.v
        C[:, 3:6] = np.eye(3)
        noise = np.eye(3) * (p["rr_v"] ** 2 if resting else self.density(P, H)) / H
        if resting:
            of_bias = np.zeros((3, 18))
            of_bias[:, 6:9] = np.eye(3)
            C, innovation = np.vstack([C, of_bias]), np.concatenate([innovation, self.gyro_lp - self.b])
            noise = block_diag(noise, np.eye(3) * p["rr_g"] ** 2 / H)
        K = P @ C.T @ np.linalg.inv(C @ P @ C.T + noise)
        self.P = (np.eye(18) - K @ C) @ P @ (np.eye(18) - K @ C).T + K @ noise @ K.T
        error = K @ innovation
        self.R = Rotation.from_rotvec(error[:3]).as_matrix() @ self.R
        self.v, self.b, self.D = self.v + error[3:6], self.b + error[6:9], self.D + error[9:].reshape(3, 3)
        self.speed2 += H / (p["t_l"] + H) * (self.v @ self.v / 3 - self.speed2)
        self.lasting = self.lasting + H / (p["t_s"] + H) * (self.v - self.lasting)
        off_level = np.sum((self.accel_lp - p["g"] * self.R[2]) ** 2)
        limit = p["rr_a"] ** 2 + 9 * p["g"] ** 2 * (self.P[0, 0] + self.P[1, 1])
        self.level = bool(off_level < limit or not self.levelled)
        self.resting = resting
        self.fresh = 1.0 if resting else self.fresh * p["t_0"] / (p["t_0"] + H)
        self.quiet = 0.0 if resting or self.travels else self.quiet + H
        self.levelled = self.levelled and self.quiet < p["t_v"]
        self.levelled = self.levelled or (resting and self.still * p["sample_period"] >= p["rr_s"])


def reference_run(gyro: np.ndarray, accel: np.ndarray, p: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """The outputs of Reference; NaN marks missing samples, the first one is complete."""
    x, y, z = accel[0]
    start = Rotation.from_euler("ZYX", [0, math.atan2(-x, math.hypot(y, z)), math.atan2(y, z)]).as_matrix()
    filter_ = Reference(p, start, gyro[0].copy(), accel[0].copy())
    rows = []
    for k in range(len(gyro)):
        missing = [bool(np.isnan(values[k]).any()) for values in (gyro, accel)]
        gyro[k] = gyro[k - 1] if missing[0] else gyro[k]
        accel[k] = accel[k - 1] if missing[1] else accel[k]
        if k:
            filter_.sample(gyro[k], accel[k], *missing)
        f = filter_
        a_S = np.zeros(3) if missing[1] else accel[k] - p["g"] * f.R[2]
        tilt = math.sqrt(f.P[0, 0] + f.P[1, 1])
        row = [
            f.R[2],
            f.b,
            f.v,
            f.D.ravel(),
            [tilt, math.sqrt(f.speed2), f.at_rest()],
            a_S,
        ]
        rows.append(np.concatenate(row))
    names = ["vertical", "gyro_bias", "velocity", "gyro_error"]
    names += ["tilt_std", "velocity_intensity", "stationary", "external_acceleration"]
    sizes = np.cumsum([3, 3, 3, 9, 1, 1, 1])
    return dict(zip(names, np.split(np.array(rows), sizes, axis=1), strict=True))
