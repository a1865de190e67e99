"""The filter of plumb once more, with whole matrices and all measurements of a block at once, for its tests."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.linalg import block_diag
from scipy.spatial.transform import Rotation

UP = np.array([0.0, 0.0, 1.0])
USUAL = np.radians(125.0 * 2.0 ** np.arange(1, 6))


def cross_matrix(a: np.ndarray) -> np.ndarray:
    return np.cross(a, np.eye(3)).T


@dataclass
class Reference:
    """One filter after its first sample, which must be complete."""

    p: Mapping[str, Any]
    gyro: np.ndarray
    accel: np.ndarray
    v: np.ndarray = field(default_factory=lambda: np.zeros(3))
    b: np.ndarray = field(default_factory=lambda: np.zeros(3))
    D: np.ndarray = field(default_factory=lambda: np.zeros((3, 3)))
    lasting: np.ndarray = field(default_factory=lambda: np.zeros(3))
    leaned: np.ndarray = field(default_factory=lambda: np.zeros(2))
    fresh: float = 0.0
    quiet: float = 0.0
    swell: float = 0.0
    doubt: float = 0.0
    lost: float = 0.0
    levelled: bool = False
    steady: bool = False
    resting: bool = False
    rested: bool = False
    level: bool = True
    samples: int = 0
    seen: int = 1
    calm: int = 0
    age: float = 0.0
    still: float = 0.0
    brisk: float = 0.0
    largest: float = 0.0
    history: list[tuple[bool, bool]] = field(default_factory=list)
    same: int = 0
    corner: float = 0.0
    top: float = 0.0
    missing: tuple[bool, bool] = (False, False)

    def __post_init__(self) -> None:
        p = self.p
        x, y, z = self.accel
        self.R = Rotation.from_euler("ZYX", [0, math.atan2(-x, math.hypot(y, z)), math.atan2(y, z)]).as_matrix()
        self.P = np.diag(np.repeat([p["P0_psi"], p["P0_v"], p["P0_b"], p["P0_D"]], [3, 3, 3, 9]) ** 2)
        self.gl, self.al, self.g2, self.a2, self.a3 = self.gyro, self.accel, self.gyro, self.accel, self.accel
        self.size, self.clip = np.abs(self.gyro).max(), p["gyro_range"]
        self.felt_g, self.z_rest = p["g"], UP
        self.seek(np.linalg.norm(self.accel))
        self.begin_block()

    def seek(self, gravity: float) -> None:
        self.coarse, self.gravity, self.V = True, gravity, 0.7**2
        self.start_P = np.diag([25.0, self.p["P0_v"] ** 2])

    def begin_block(self) -> None:
        self.samples, self.T, self.jerk, self.jolt = 0, 0.0, 0.0, 0.0
        self.dV, self.S, self.theta, self.W = np.zeros(3), np.zeros((3, 3)), np.zeros(3), np.zeros((3, 3))
        self.top = 0.0

    def sample(self, gyro: np.ndarray, accel: np.ndarray, gyro_missing: bool, accel_missing: bool) -> None:
        p, dt = self.p, self.p["sample_period"]
        gyro_missing = gyro_missing or bool(np.abs(gyro).max() > 2 * p["gyro_range"])
        accel_missing = accel_missing or bool(np.linalg.norm(accel) > p["accel_range"])
        gyro, accel = self.gyro if gyro_missing else gyro, self.al if accel_missing else accel
        kappa = {0: 1, 1: 0, 2: 0.5, 3: 0.25}[p["gyro_index"]]
        w = (np.eye(3) + self.D) @ (gyro - kappa * (gyro - self.gyro) - self.b)
        before, self.R = self.R, self.R @ Rotation.from_rotvec(w * dt).as_matrix()
        self.S += (before + self.R) / 2 * dt
        self.theta += w * dt
        for i in range(3):
            if gyro_missing or abs(gyro[i]) > 0.95 * self.clip:
                self.W[i, i] += p["s_s"] ** 2 * dt
        hit = np.linalg.norm(accel - self.al) > 100
        self.jerk += np.sum((gyro - self.gyro) ** 2) * dt**2 * (100 if hit else 1)
        self.jolt += np.sum((accel - self.accel) ** 2) * dt**2
        if not accel_missing:
            self.dV += self.R @ accel * dt
            self.T += dt
        self.look_for_clipping(np.abs(gyro).max())
        self.look_for_calm(gyro, accel, gyro_missing or accel_missing)
        self.gyro, self.accel, self.missing = gyro, accel, (gyro_missing, accel_missing)
        self.samples += 1
        if self.samples == max(1, round(p["h"] / dt)):
            self.end_block(self.samples * dt)
            self.begin_block()

    def look_for_clipping(self, size: float) -> None:
        change, self.size = abs(size - self.size), size
        self.largest = max(self.largest, size)
        stays = change < 0.004 * size and size >= 0.97 * self.largest and size > 1.5
        self.history = [*self.history, (change > 0.03 * size, stays)][-5:]
        self.same = self.same + 1 if change == 0 and size >= 0.97 * self.largest and size > 1.5 else 0
        # A jump, three flat steps, and at most one more step between them.
        flat = [stays for _, stays in self.history]
        jumped = [jumps for jumps, _ in self.history]
        if all(flat[-3:]) and len(flat) > 3 and (jumped[-4] or (len(flat) > 4 and jumped[-5])) and not flat[-4]:
            self.top = size
        if self.same == 8:
            self.top = size

    def look_for_calm(self, gyro: np.ndarray, accel: np.ndarray, missing: bool) -> None:
        p, dt = self.p, self.p["sample_period"]
        self.seen += 1
        alpha = max(dt / (p["rr_l"] + dt), 1 / self.seen)
        if np.linalg.norm(accel - self.al) <= 30:
            self.gl, self.al = (1 - alpha) * self.gl + alpha * gyro, (1 - alpha) * self.al + alpha * accel
        is_calm = (
            np.linalg.norm(gyro - self.gl) < p["rr_dg"]
            and np.linalg.norm(accel - self.al) < p["rr_da"]
            and all(abs(self.gl) < p["rr_b"])
            and not missing
        )
        self.calm = self.calm + 1 if is_calm else 0

    def all_calm(self) -> bool:
        return self.calm >= max(self.samples, 1)

    def at_rest(self) -> bool:
        least = max(self.p["rr_t"] if self.levelled else self.p["rr_s"], 3 * self.p["sample_period"])
        return bool(self.level and self.all_calm() and self.still > least - self.p["sample_period"] / 2)

    def look_for_rest(self, H: float) -> None:
        p = self.p
        alpha = max(H / (p["rr_l"] + H), H / (self.age + H))
        self.g2, self.a2 = (1 - alpha) * self.g2 + alpha * self.gl, (1 - alpha) * self.a2 + alpha * self.al
        self.age = min(self.age + H, 4 * p["rr_l"])
        share = math.sqrt(self.age / (4 * p["rr_l"]))
        drift = np.linalg.norm(self.gl - self.g2) / p["rr_lg"], np.linalg.norm(self.al - self.a2) / p["rr_la"]
        even = self.all_calm() and max(drift) < share
        self.a3 = (p["rr_w"] * self.a3 + H * self.al) / (p["rr_w"] + H) if even else self.al
        still = even and np.linalg.norm(self.al - self.a3) < p["rr_lw"]
        self.still = self.still + H if still else 0.0
        self.brisk = max(self.brisk * 10 / (10 + H), np.linalg.norm(self.theta) / H)

    def end_block(self, H: float) -> None:
        resting = self.at_rest()
        overruled = not resting and not self.level and self.all_calm()
        overruled = overruled and self.still > (2.0 if self.brisk > 1 else self.p["rr_o"])
        self.learn_range()
        if self.coarse:
            self.end_coarse(resting, H)
        elif resting:
            long_enough = self.still >= self.p["rr_s"]
            self.end_fine(H, *self.rest(H))
            self.levelled, self.rested = self.levelled or long_enough, self.rested or long_enough
        elif overruled:
            self.overrule(H)
        else:
            self.end_in_motion(H)

    def learn_range(self) -> None:
        m = self.top
        if m and (abs(m - self.corner) < 0.05 * self.corner or np.any(np.abs(m - USUAL) < 0.03 * USUAL)):
            self.clip = min(self.clip, m / 0.97)
        self.corner = m or self.corner

    def end_coarse(self, resting: bool, H: float) -> None:
        """A filter of g and v, the same on each axis: state (g, v)."""
        p = self.p
        state = np.array([self.gravity * UP, self.v])
        F = np.array([[1, 0], [-self.T, 1]])
        state = F @ state + np.array([np.zeros(3), self.dV])
        noise = [(0.005 * p["g"]) ** 2 * H, p["s_a"] ** 2 * H + p["s_m"] ** 2 * (H - self.T)]
        P = F @ self.start_P @ F.T + np.diag(noise)
        density = p["s_v"] ** 2 * max(math.sqrt(self.V), p["v2"]) / p["k_v"]
        looks = [] if resting or not self.T else [([1.0, 0.0], self.dV / (self.T or 1), 2.2**2 / H)]
        looks.append(([0.0, 1.0], np.zeros(3), (p["rr_v"] ** 2 if resting else density) / H))
        for h, y, r in looks:
            row = np.array(h)
            K = P @ row / (row @ P @ row + r)
            state = state + np.outer(K, y - row @ state)
            P = P - np.outer(K, row @ P)
        g, v = state
        axis, angle = np.cross(g, UP), math.atan2(math.hypot(g[0], g[1]), g[2])
        turn = Rotation.from_rotvec(axis / np.linalg.norm(axis) * angle).as_matrix()
        self.R, self.v, self.gravity, self.start_P = turn @ self.R, turn @ v, float(np.linalg.norm(g)), P
        self.V += H / (p["t_l"] + H) * (v @ v / 3 - self.V)
        length = max(self.gravity, math.sqrt(P[0, 0]))
        self.P[:6], self.P[:, :6] = 0, 0
        self.P[[0, 1, 2], [0, 1, 2]] = [P[0, 0] / length**2, P[0, 0] / length**2, p["P0_psi"] ** 2]
        self.P[3:6, 3:6] = np.eye(3) * P[1, 1]
        self.P[0, 4] = self.P[4, 0] = P[0, 1] / length
        self.P[1, 3] = self.P[3, 1] = -P[0, 1] / length
        rested = resting and self.still >= p["rr_s"]
        self.coarse = not (rested or 2 * P[0, 0] < (0.15 * max(self.gravity, p["g"] / 2)) ** 2)
        self.levelled = self.resting = rested
        self.fresh = float(rested)
        self.lost = self.lost if self.coarse and self.lost > 0 else max(self.lost - H, 0)
        self.look_for_rest(H)

    def predict(self, H: float) -> None:
        p = self.p
        self.v = self.v + self.dV - p["g"] * UP * self.T
        F = np.eye(18)
        F[0:3, 6:9] = -self.S
        for i in range(3):
            for j in range(3):
                F[0:3, 9 + 3 * i + j] = self.S[:, i] * self.theta[j] / H
        F[3:6, 0:3] = -cross_matrix(self.dV)
        W = self.W + p["k_g"] ** 2 / H * np.outer(self.theta, self.theta)
        psi = (p["s_g"] ** 2 * H + p["k_j"] ** 2 * self.jerk) * np.eye(3) + self.R @ W @ self.R.T
        dv = (p["s_a"] ** 2 * H + p["s_m"] ** 2 * (H - self.T) + p["k_a"] ** 2 * self.jolt) * np.eye(3)
        P = F @ self.P @ F.T + block_diag(psi, dv, p["s_b"] ** 2 * H * np.eye(3), np.zeros((9, 9)))
        scale = np.ones(18)
        scale[[0, 1, 2, 6, 7, 8]] = np.minimum(1, 1 / np.sqrt(np.diag(P)[[0, 1, 2, 6, 7, 8]]))
        self.P = P * np.outer(scale, scale)

    def forget_velocity(self, variance: float) -> None:
        self.v, self.P[3:6], self.P[:, 3:6] = np.zeros(3), 0, 0
        self.P[3:6, 3:6] = np.eye(3) * variance

    def surprised(self, variance: float) -> bool:
        squares = np.sum(self.v**2 / (np.diag(self.P)[3:6] + variance))
        return bool(not (self.resting or self.steady) and squares > 9)

    def tilt_variance(self) -> float:
        return float(self.P[0, 0] + self.P[1, 1])

    def low_passed_velocity(self, H: float) -> np.ndarray:
        return self.lasting + H / (self.p["t_s"] + H) * (self.v - self.lasting)

    def rest(self, H: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, bool, bool]:
        """Measurement matrix, innovation and noise; whether all is learnt, whether it is steady travel."""
        p, variance = self.p, self.p["rr_v"] ** 2 / H
        self.predict(H)
        if self.surprised(variance):
            self.forget_velocity(variance)
        if self.still >= p["rr_s"] and not self.rested:
            for i in (6, 7, 8):
                self.P[i, i] = max(self.P[i, i], p["P0_raw"] ** 2)
        C = np.zeros((6, 18))
        C[:3, 3:6], C[3:, 6:9] = np.eye(3), np.eye(3)
        noise = block_diag(np.eye(3) * variance, np.eye(3) * p["rr_g"] ** 2 / H)
        self.fresh, self.quiet, self.swell, self.doubt = 1.0, 0.0, 0.0, 0.0
        return C, np.concatenate([-self.v, self.gl - self.b]), noise, True, False

    def overrule(self, H: float) -> None:
        p = self.p
        up = self.R @ self.al
        turn, _ = Rotation.align_vectors([UP], [up / np.linalg.norm(up)])
        self.R, self.v = turn.as_matrix() @ self.R, np.zeros(3)
        std = np.repeat([0.05, p["P0_psi"], p["rr_v"] / math.sqrt(H), p["P0_raw"], p["P0_D"]], [2, 1, 3, 3, 9])
        self.P = np.diag(std**2)
        self.fresh, self.quiet, self.swell, self.doubt, self.levelled = 1.0, 0.0, 0.0, 0.0, False
        self.after(np.zeros(18), H, resting=True, steady=False)
        self.levelled, self.level, self.lost = False, True, 1.0

    def end_in_motion(self, H: float) -> None:
        p, was_levelled = self.p, self.levelled
        self.predict(H)
        fast = np.linalg.norm(self.low_passed_velocity(H)[:2]) > (7 if self.brisk > 1 else 70)
        lost = bool(fast or (self.levelled and self.tilt_variance() > 2 * p["P0_psi"] ** 2))
        calm = self.calm * p["sample_period"] >= p["rr_t"] and self.calm >= 3
        steady = bool(calm and self.level and self.levelled and not lost)
        if lost:
            self.forget_velocity(p["P0_v"] ** 2)
        elif steady and self.surprised(p["rr_v2"] ** 2 / H):
            self.forget_velocity(p["rr_v2"] ** 2 / H)
        density, learns = self.density(H, steady, self.levelled and not lost)
        C = np.zeros((3, 18))
        C[:, 3:6] = np.eye(3)
        self.end_fine(H, C, -self.v, np.diag(density) / H, learns, steady)
        self.levelled = was_levelled and not lost and self.quiet < p["t_v"]
        if lost:
            self.fresh = self.quiet = self.swell = self.doubt = 0.0
            self.lasting, self.leaned, self.steady, self.rested, self.lost = np.zeros(3), np.zeros(2), False, False, 1.0
            self.seek(p["g"])

    def density(self, H: float, steady: bool, travels: bool) -> tuple[np.ndarray, bool]:
        """Of the velocity in motion, per axis, and whether it teaches the errors of the gyroscope."""
        p = self.p
        noise = p["s_v"] ** 2 * math.sqrt(max(self.V, p["v2"] ** 2)) / p["k_v"]
        v_s, P_v = self.low_passed_velocity(H), np.diag(self.P)[3:6]
        level = np.array([v_s[:2] @ v_s[:2] / 2, v_s[2] ** 2]) - 4 * noise / (2 * p["t_s"])
        sure = 4 * np.array([P_v[:2].mean(), P_v[2]])
        e = np.maximum(level - sure, self.fresh * p["v_0"] ** 2)
        target = max(0.0, v_s @ v_s - P_v.sum()) / 3
        self.swell += H / ((0.3 if target > self.swell else 6.0) + H) * (target - self.swell)
        excess = max(0.0, level[0])
        self.doubt += H / ((1.0 if excess > self.doubt else 10.0) + H) * (excess - self.doubt)
        self.quiet = 0.0 if steady or level[0] > 0 else self.quiet + H
        self.fresh = 1.0 if steady else self.fresh * p["t_0"] / (p["t_0"] + H)
        if steady:
            densities = np.full(2, p["rr_v2"] ** 2)
        elif travels:
            densities = noise + 2 * p["t_v"] * e
        else:
            densities = np.full(2, max(noise, min(10 * noise, 4 * p["t_s"] * self.swell)))
        return densities[[0, 0, 1]], bool(travels or level[0] <= 0)

    def end_fine(
        self, H: float, C: np.ndarray, innovation: np.ndarray, noise: np.ndarray, learns: bool, steady: bool
    ) -> None:
        """Joseph's form holds for any gain: also for one that leaves the errors of the gyroscope alone."""
        P, resting = self.P, len(innovation) == 6
        if learns:
            K = P @ C.T @ np.linalg.inv(C @ P @ C.T + noise)
            self.P = (np.eye(18) - K @ C) @ P @ (np.eye(18) - K @ C).T + K @ noise @ K.T
            error = K @ innovation
        else:
            error = np.zeros(18)
            for row, y, r in zip(C, innovation, np.diag(noise), strict=True):
                K = self.P @ row / (row @ self.P @ row + r)
                K[6:] = 0
                error += K * (y - row @ error)
                I_KC = np.eye(18) - np.outer(K, row)
                self.P = I_KC @ self.P @ I_KC.T + r * np.outer(K, K)
        self.after(error, H, resting, steady)

    def after(self, error: np.ndarray, H: float, resting: bool, steady: bool) -> None:
        p = self.p
        self.R = Rotation.from_rotvec(error[:3]).as_matrix() @ self.R
        self.v, self.b, self.D = self.v + error[3:6], self.b + error[6:9], self.D + error[9:].reshape(3, 3)
        self.V += H / (p["t_l"] + H) * (self.v @ self.v / 3 - self.V)
        self.lasting = self.low_passed_velocity(H)
        self.leaned = (self.leaned + (error[:2] if resting or steady else 0)) * 20 / (20 + H)
        self.lost = max(self.lost - H, 0)
        if self.still >= 2 and self.all_calm():
            self.felt_g += H / (1 + H) * (np.linalg.norm(self.al) - self.felt_g)
        z = self.R[2].copy()
        room = p["rr_a"] + p["rr_k"] * p["g"] * np.linalg.norm(z - self.z_rest)
        off = np.sum((self.al - self.felt_g * z) ** 2)
        self.level = bool(not self.levelled or off < room**2 + 9 * p["g"] ** 2 * self.tilt_variance())
        self.z_rest = z if resting else self.z_rest
        self.resting, self.steady = resting, steady
        self.look_for_rest(H)

    def tilt_std(self) -> float:
        p = self.p
        scale = max(0.0, abs(self.felt_g / p["g"] - 1) - 0.04)
        grows = 0.0 if self.levelled else 2 * self.doubt / (2 * p["g"]) ** 2
        return math.sqrt(self.tilt_variance() + grows + self.leaned @ self.leaned + 8 * scale**2)


def reference_run(gyro: np.ndarray, accel: np.ndarray, p: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """The outputs of Reference; NaN marks missing samples, the first one is complete."""
    filter_ = Reference(p, gyro[0].copy(), accel[0].copy())
    rows = []
    for k in range(len(gyro)):
        missing = [bool(np.isnan(values[k]).any()) for values in (gyro, accel)]
        gyro[k] = gyro[k - 1] if missing[0] else gyro[k]
        accel[k] = accel[k - 1] if missing[1] else accel[k]
        if k:
            filter_.sample(gyro[k], accel[k], *missing)
        f = filter_
        a_S = np.zeros(3) if f.missing[1] else f.accel - p["g"] * f.R[2]
        status = [1, 2] @ np.array(f.missing) + 128 * (f.lost > 0)
        row = [f.R[2], f.b, f.v, f.D.ravel(), [f.tilt_std(), math.sqrt(f.V), f.at_rest(), status], a_S]
        rows.append(np.concatenate(row))
    names = ["vertical", "gyro_bias", "velocity", "gyro_error"]
    names += ["tilt_std", "velocity_intensity", "stationary", "status", "external_acceleration"]
    sizes = np.cumsum([3, 3, 3, 9, 1, 1, 1, 1])
    return dict(zip(names, np.split(np.array(rows), sizes, axis=1), strict=True))
