"""Claims about plumb: its equations, what it learns, what it survives, and that its covariance is honest."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import motions
import numpy as np
import pytest
from motions import Motion, angle
from scipy.linalg import block_diag
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation
from toys import eager

from imufmu.estimators import plumb
from imufmu.evaluate.metrics import inclination_error
from imufmu.instance import SampledInstance
from imufmu.recordings import read
from imufmu.running import Trajectory, run
from imufmu.signals import total_size
from imufmu.vocabulary import Status

BLOCK = plumb.BLOCK
G = motions.G
DEFAULTS = {q.name: q.start for q in BLOCK.own_parameters}
BROAD = Path(__file__).parents[2] / "shared" / "data" / "broad"


def estimate(motion: Motion, **parameters: Any) -> Trajectory:
    settings = {"sample_period": motion.dt, "g": G} | parameters
    return run(BLOCK, {"gyro": motion.gyro, "accel": motion.accel}, settings)


def tilt_deg(motion: Motion, result: Trajectory) -> np.ndarray:
    return np.rad2deg(angle(result["vertical"], motion.vertical))


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def tumbling(rng: np.random.Generator, t: np.ndarray, rate: float) -> Rotation:
    """Attitude that turns about all axes, at about this rate (rad/s rms per axis)."""
    frequency, phase = rng.uniform(0.1, 0.4, (2, 3)), rng.uniform(0, 2 * np.pi, (2, 3))
    angles = rate / (2 * np.pi * frequency) * np.sin(2 * np.pi * frequency * t[:, None, None] + phase)
    return Rotation.from_euler("ZYX", angles.sum(axis=1))


def mean_rates(R_NS: Rotation, dt: float) -> np.ndarray:
    """What a gyroscope reads, (n, 3), that reports the mean over the period that ends with the sample."""
    return np.vstack([np.zeros(3), (R_NS[:-1].inv() * R_NS[1:]).as_rotvec() / dt])


def moving(
    seed: int, seconds: float, *, dt: float = 0.01, speed: float = 0.3, rate: float = 1.0, rest: float = 0.0
) -> Motion:
    """A sensor that rests, then tumbles while its velocity swings at 0.5 to 3 Hz (speed, m/s rms per axis)."""
    rng, t = np.random.default_rng(seed), np.arange(round(seconds / dt)) * dt
    since = np.maximum(t - rest, 0)
    R_NS = tumbling(rng, since**2 / (since + 1), rate)
    frequency, phase = rng.uniform(0.5, 3, (8, 3)), rng.uniform(0, 2 * np.pi, (8, 3))
    waves = np.sin(2 * np.pi * frequency * t[:, None, None] + phase).sum(axis=1)
    velocity = np.minimum(since, 1)[:, None] * speed / 2 * waves
    return motions._readings(dt, mean_rates(R_NS, dt), R_NS, np.diff(velocity, axis=0, prepend=velocity[:1]) / dt)


# Its equations


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
    still: int = 0

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
            self.end_block(self.samples * dt, self.still * dt >= p["rr_t"])
            self.begin_block()

    def end_block(self, H: float, resting: bool) -> None:
        p = self.p
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
        C, innovation = np.zeros((3, 18)), -self.v
        C[:, 3:6] = np.eye(3)
        moving_variance = p["s_v"] ** 2 * math.sqrt(max(self.speed2, p["v2"] ** 2)) / p["k_v"]
        noise = np.eye(3) * (p["rr_v"] ** 2 if resting else moving_variance) / H
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
            [tilt, math.sqrt(f.speed2), f.still * p["sample_period"] >= p["rr_t"]],
            a_S,
        ]
        rows.append(np.concatenate(row))
    names = ["vertical", "gyro_bias", "velocity", "gyro_error"]
    names += ["tilt_std", "velocity_intensity", "stationary", "external_acceleration"]
    sizes = np.cumsum([3, 3, 3, 9, 1, 1, 1])
    return dict(zip(names, np.split(np.array(rows), sizes, axis=1), strict=True))


@pytest.mark.parametrize(
    ("dt", "parameters"),
    [
        (0.0035, {}),
        (0.01, {"h": 0.106, "gyro_range": 2.0, "k_g": 0.01, "s_b": 0.002, "P0_D": 0.02, "t_l": 0.5, "rr_t": 0.3}),
        (0.02, {"h": 1e-3, "s_v": 1.0, "v2": 0.5, "s_a": 0.2, "s_m": 5.0, "s_g": 0.2}),
    ],
)
def test_it_is_the_filter_of_its_docstring(dt: float, parameters: dict[str, float]) -> None:
    """Rest, motion, saturation, missing samples, a yaw that is lost; blocks of 14, 11 and 1 samples."""
    motion = moving(1, 3000 * dt, dt=dt, rest=5.0 if dt > 0.0035 else 2.0).noisy(np.random.default_rng(2), 0.005)
    gyro, accel = motion.gyro + np.array([0.01, -0.02, 0.005]), motion.accel.copy()
    gyro[[400, 401, 2000], 1] = math.nan
    accel[[700, 2000, 2001, *range(2500, 2560)], 2] = math.nan
    p = DEFAULTS | {"sample_period": dt} | parameters
    actual = run(BLOCK, {"gyro": gyro, "accel": accel}, {"sample_period": dt} | parameters)
    expected = reference_run(gyro.copy(), accel.copy(), p)
    assert 0.05 < actual["stationary"].mean() < 0.9
    for name, values in expected.items():
        # Rounding differs, and the filter is linear but for its small corrections: it does not grow.
        assert np.allclose(actual[name].reshape(values.shape), values, rtol=1e-9, atol=1e-9), name


def test_skipping_the_slow_step_changes_nothing() -> None:
    motion = moving(3, 8, rest=3).noisy(np.random.default_rng(3))
    inputs = {"gyro": motion.gyro, "accel": motion.accel}
    lazy, always = run(BLOCK, inputs), run(eager(BLOCK), inputs)
    for signal in BLOCK.reported:
        assert np.array_equal(lazy[signal.name], always[signal.name]), signal.name


# What it learns


def test_the_bias_of_a_resting_gyroscope_is_learnt_in_half_a_minute() -> None:
    motion = motions.rest(Rotation.from_euler("ZYX", [0.4, 0.3, -0.2]), 3000).noisy(np.random.default_rng(4), 0.003)
    bias = np.array([0.02, -0.01, 0.03])
    result = run(BLOCK, {"gyro": motion.gyro + bias, "accel": motion.accel}, {"g": G})
    # After a time T of rest P0_b^2 T / (P0_b^2 T + rr_g^2) of it is learnt: 97 % of 0.03 rad/s.
    assert np.allclose(result["gyro_bias"][-1], bias, rtol=0, atol=1e-3)
    assert result["stationary"][20:].all()
    # 2.1 deg/s would tilt a filter without bias by 64 deg.
    assert tilt_deg(motion, result).max() < 0.5
    assert tilt_deg(motion, result)[2000:].max() < 0.1


def test_a_constant_bias_does_not_tilt_it_in_motion() -> None:
    """No rest anywhere: what a bias of 0.57 deg/s does in the end is a tenth of what the motion does."""
    motion, bias = moving(5, 120), np.array([0.01, -0.01, 0.005])
    clean = estimate(motion)
    biased = run(BLOCK, {"gyro": motion.gyro + bias, "accel": motion.accel}, {"g": G})
    apart = np.rad2deg(angle(clean["vertical"], biased["vertical"]))
    assert rms(apart[6000:]) < 0.1
    assert np.allclose(biased["gyro_bias"][-1] - clean["gyro_bias"][-1], bias, rtol=0, atol=2e-3)


def test_scale_and_cross_axis_errors_are_learnt_in_motion() -> None:
    motion = moving(6, 120, rate=2.0)
    error = np.array([[0.004, 0.002, 0], [-0.001, -0.003, 0.002], [0.001, 0, 0.003]])
    measured = np.linalg.solve(np.eye(3) + error, motion.gyro.T).T
    result = run(BLOCK, {"gyro": measured, "accel": motion.accel}, {"g": G})
    assert rms(result["gyro_error"][-1] - error) < 0.4 * rms(error)
    without = run(BLOCK, {"gyro": measured, "accel": motion.accel}, {"g": G, "P0_D": 0.0})
    assert rms(tilt_deg(motion, result)[6000:]) < rms(tilt_deg(motion, without)[6000:])


def test_motion_without_lasting_velocity_tilts_it_by_less_than_a_degree() -> None:
    """Accelerations of 4 m/s2 (rms) point 20 deg away from the vertical."""
    motion = moving(7, 60, speed=0.3, rest=2.0)
    result = estimate(motion)
    assert rms(np.rad2deg(angle(motion.accel, motion.vertical))[300:]) > 15
    assert rms(tilt_deg(motion, result)[300:]) < 0.5
    assert rms(result["external_acceleration"][300:] - motion.acceleration[300:]) < 0.3


# What it survives


@pytest.mark.parametrize("dt", [0.02, 0.01, 0.005, 0.0035, 0.001])
def test_accuracy_does_not_depend_on_the_sample_rate(dt: float) -> None:
    motion = moving(8, 30, dt=dt, rest=2.0)
    # The same motion at every rate; at 50 Hz readings of 3 Hz motion are means over a noticeable part of a wave.
    assert rms(tilt_deg(motion, estimate(motion))[round(3 / dt) :]) < 0.6


def test_it_recovers_from_a_start_in_motion() -> None:
    motion = moving(9, 30)
    late = {"gyro": motion.gyro[70:], "accel": motion.accel[70:]}
    tilt = np.rad2deg(angle(run(BLOCK, late, {"g": G})["vertical"], motion.vertical[70:]))
    assert tilt[0] > 20
    assert rms(tilt[1500:]) < 1


@pytest.mark.parametrize(("name", "rows"), [("gyro", 20), ("accel", 100)])
def test_it_bridges_a_hole_and_doubts_meanwhile(name: str, rows: int) -> None:
    """A fifth of a second with a gyroscope that is held, or a second without accelerometer."""
    motion = moving(10, 40, rest=2.0)
    holed = {"gyro": motion.gyro.copy(), "accel": motion.accel.copy()}
    whole = run(BLOCK, holed, {"g": G})
    holed[name][2000 : 2000 + rows] = math.nan
    result = run(BLOCK, holed, {"g": G})
    assert result["tilt_std"][1999 + rows] > 1.05 * whole["tilt_std"][1999 + rows]
    assert np.all(np.deg2rad(tilt_deg(motion, result)[2000:2500]) < 4 * result["tilt_std"][2000:2500])
    assert rms(tilt_deg(motion, result)[3000:]) < 0.6


def test_the_first_usable_sample_starts_it() -> None:
    motion = motions.rest(Rotation.from_euler("ZYX", [0.0, 0.5, 1.0]), 60)
    accel = motion.accel.copy()
    accel[:20] = math.nan
    result = run(BLOCK, {"gyro": motion.gyro, "accel": accel}, {"g": G})
    status = result["status"].astype(int)
    assert np.array_equal(status > 0, np.arange(60) < 20)
    assert np.all(status[:20] == Status.NOT_INITIALISED | Status.ACCEL_MISSING)
    assert tilt_deg(motion, result)[20:].max() < 1e-9  # rounding
    assert np.all(result["yaw"] == 0)
    assert np.allclose(result["tilt_std"][:21], math.sqrt(2) * DEFAULTS["P0_psi"], rtol=1e-12)  # nothing was learnt


@pytest.mark.parametrize(("part", "rests"), [(0.9, True), (1.1, False)])
def test_a_steady_turn_is_rest_only_below_the_limit(part: float, rests: bool) -> None:
    """The limit is on each axis: a turn about all three is slower than its norm."""
    motion = motions.turn(Rotation.identity(), np.full(3, part * DEFAULTS["rr_b"]), 100)
    assert np.all(estimate(motion)["stationary"][20:] == rests)


def test_a_saturated_axis_makes_it_doubt() -> None:
    """Gyroscope readings clipped at 2 rad/s: with the range known the filter doubts, and is far better."""
    motion = moving(11, 30, rate=1.5, rest=2.0)
    clipped = {"gyro": np.clip(motion.gyro, -2, 2), "accel": motion.accel}
    knows = run(BLOCK, clipped, {"g": G, "gyro_range": 2.0})
    trusts = run(BLOCK, clipped, {"g": G})
    assert rms(knows["tilt_std"][300:]) > 2 * rms(trusts["tilt_std"][300:])
    assert rms(tilt_deg(motion, knows)[300:]) < 0.5 * rms(tilt_deg(motion, trusts)[300:])


def test_the_covariance_stays_positive_and_bounded_over_hours() -> None:
    """10^5 blocks of 0.1 s, nearly three hours, of a poor gyroscope: motion, rest, and a spin about the vertical."""
    rng = np.random.default_rng(12)
    instance = SampledInstance(BLOCK)
    instance.p[:] = BLOCK.parameter_vector({"sample_period": 0.1, "h": 0.1, "s_g": 0.02, "s_b": 0.1})
    instance.initialise(0.0)
    where = total_size(BLOCK.state[: [s.name for s in BLOCK.state].index("P")])
    largest = np.zeros(18)
    for k in range(100_000):
        phase = k // 5000 % 3
        if phase == 0:
            instance.u[:] = np.concatenate([rng.normal(0, 1, 3), rng.normal((0, 0, G), 3)])
        else:
            instance.u[:] = [0, 0, 3.0 * (phase == 2), 0, 0, G]
        instance.sample()
        if k % 500 == 499:
            P = np.zeros((18, 18))
            P[np.triu_indices(18)] = instance.x[where : where + 171]
            deviation = np.sqrt(np.diag(P))
            assert np.linalg.eigvalsh((P + np.triu(P, 1).T) / np.outer(deviation, deviation)).min() > 0
            largest = np.maximum(largest, deviation)
    # Yaw, and the bias about the vertical while it spins, are observed by nothing: they stop at 1 rad and 1 rad/s.
    assert largest[2] == pytest.approx(1, abs=1e-6)
    assert largest[8] == pytest.approx(1, abs=1e-6)
    assert np.all(largest < 2)


# What it says about itself


def test_latency_turns_the_attitude_ahead() -> None:
    motion = motions.turn(Rotation.identity(), np.array([0.3, 0.2, 0.5]), 400)
    now, ahead = estimate(motion), estimate(motion, latency=0.05)
    for name in ("vertical", "q_NS", "roll", "pitch", "yaw"):
        # Five samples later by the same steady turn; the filter corrects its estimate by less than that in 0.05 s.
        assert np.allclose(ahead[name][100:-5], now[name][105:], rtol=0, atol=1e-5), name
    assert np.array_equal(ahead["external_acceleration"], now["external_acceleration"])


def honest_motion(seed: int, n: int, dt: float) -> tuple[np.ndarray, np.ndarray, Rotation]:
    """Readings and attitude as the filter assumes them: every error and the velocity are noise of its densities.

    White noise smoothed twice by exp(-t / 0.09 s) is the velocity. Its rms, 0.5 m/s, and its density at low frequency
    belong together as in (7).
    """
    p, rng, keep = DEFAULTS, np.random.default_rng(seed), math.exp(-dt / 0.09)
    reach, narrowing = p["s_v"] ** 2 / p["k_v"], (1 - keep) ** 4 * (1 + keep**2) / (1 - keep**2) ** 3
    white = rng.normal(0, reach / dt * math.sqrt(narrowing), (n, 3))
    for _ in range(2):
        white = lfilter([1 - keep], [1, -keep], white, axis=0)
    force = np.diff(white, axis=0, prepend=np.zeros((1, 3))) / dt + [0, 0, p["g"]]
    R_NS = tumbling(rng, np.arange(n) * dt, 1.0)
    turn, noise = mean_rates(R_NS, dt), 1 / math.sqrt(dt)
    bias = rng.normal(0, p["P0_b"], 3) + np.cumsum(rng.normal(0, p["s_b"] * dt * noise, (n, 3)), axis=0)
    gyro = np.linalg.solve(np.eye(3) + rng.normal(0, p["P0_D"], (3, 3)), turn.T).T + bias
    gyro += rng.normal(0, p["s_g"] * noise, (n, 3)) + turn * rng.normal(0, p["k_g"] * noise, (n, 1))
    return gyro, R_NS.inv().apply(force) + rng.normal(0, p["s_a"] * noise, (n, 3)), R_NS


def test_the_covariance_of_the_tilt_is_honest_where_the_model_holds() -> None:
    """Normalised squared tilt error over 40 motions of 30 s, without the first 10 s: that is a start in motion.

    Errors 2 s apart are independent: 40 * 10 tilts of two degrees of freedom, so the mean scatters by
    sqrt(2 / 800) = 5 %. The band is three of that.
    """
    squares = []
    for seed in range(40):
        gyro, accel, R_NS = honest_motion(seed, 3000, 0.01)
        result = run(BLOCK, {"gyro": gyro, "accel": accel})
        R_hat = Rotation.from_quat(np.roll(result["q_NS"], -1, axis=1))
        up = R_hat.apply(R_NS.inv().apply([0, 0, 1]))  # the true vertical where it is estimated: exp(-[psi]) e_z
        psi = np.column_stack([up[:, 1], -up[:, 0]])[1000:]
        squares.append(np.einsum("ni,nij,nj->n", psi, np.linalg.inv(result["tilt_covariance"][1000:]), psi) / 2)
    assert np.mean(squares) == pytest.approx(1.0, abs=0.15)


# Real recordings


@pytest.mark.skipif(not BROAD.is_dir(), reason="the BROAD recordings are not beside the checkout")
@pytest.mark.parametrize(
    ("trial", "limit_deg"), [("01_undisturbed_slow_rotation_A", 0.45), ("15_undisturbed_fast_translation_A", 0.5)]
)
def test_real_motion_is_followed_within_half_a_degree(trial: str, limit_deg: float) -> None:
    """Against the truth as recorded; VQF has 0.60 and 0.47 deg."""
    recording = read(BROAD / f"{trial}.mat")
    result = run(BLOCK, {"gyro": recording.gyro, "accel": recording.accel}, {"sample_period": recording.sample_period})
    error = inclination_error(result["vertical"], recording.truth["vertical"])[recording.scored]
    assert np.rad2deg(rms(error)) < limit_deg
