"""A planar arm of two links in motion, made without any code of the product, and bennett2014 fed by its sensors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from imufmu.blocks.running import Trajectory
from imufmu.compiled.running import run
from imufmu.estimators.bennett2014 import BLOCK
from support import golden

DT, A1, A2, G = 0.005, 0.2, 0.35, 9.81
GYRO_ONLY, RAW, CORRECTED = 0, 1, 2
VARIANTS = {"gyro": GYRO_ONLY, "raw": RAW, "corrected": CORRECTED}


@dataclass(frozen=True)
class Arm:
    """Two links in motion and what their sensors read. theta: (n, 2), joint angles. s: (n, 2), A: (n, 2), as in (9)."""

    theta: np.ndarray
    s: np.ndarray
    A: np.ndarray

    def noisy(self, rng: np.random.Generator, bias: tuple[float, float] = (0.0, 0.0)) -> Arm:
        """The same with noise of a cheap sensor: 0.0015 rad/s and 0.05 m/s2 per sample."""
        s = self.s + bias + rng.normal(0, 0.0015, self.s.shape)
        return Arm(self.theta, s, self.A + rng.normal(0, 0.05, self.A.shape))

    @property
    def segment(self) -> np.ndarray:
        return self.theta.sum(axis=1)


def moved(theta: np.ndarray, rate: np.ndarray, acceleration: np.ndarray) -> Arm:
    """The arm with these joint angles and derivatives (n, 2), in the complex plane of x_0 and i y_0."""
    e1, e12 = (np.exp(1j * angle) for angle in (theta[:, 0], theta.sum(axis=1)))
    w1, w12, al1, al12 = rate[:, 0], rate.sum(axis=1), acceleration[:, 0], acceleration.sum(axis=1)
    lift = A1 * e1 * (1j * al1 - w1**2) + A2 * e12 * (1j * al12 - w12**2) + 1j * G
    along_link = lift / e12
    return Arm(theta, np.column_stack([w1, w12]), np.column_stack([along_link.real, -along_link.imag]))


def swing(duration: float = 15.0, rest: float = 2.5, fastest: float = 1.3) -> Arm:
    """Hanging at rest, then swings of both joints that become faster, up to ``fastest`` (Hz)."""
    t = np.maximum(np.arange(0, duration, DT) - rest, 0.0)[:, None]
    size, phase = np.array([0.5, 0.6]), np.array([0.0, 1.0])
    chirp = 2 * np.pi * fastest / (2 * (duration - rest))
    psi, psi_d, psi_dd = chirp * t**2 + phase, 2 * chirp * t, 2 * chirp
    theta = size * (np.sin(psi) - np.sin(phase)) + np.array([-np.pi / 2, 0.0])
    rate = size * np.cos(psi) * psi_d
    acceleration = np.where(t > 0, size * (np.cos(psi) * psi_dd - np.sin(psi) * psi_d**2), 0.0)
    return moved(theta, rate, acceleration)


def resting(theta: tuple[float, float], n: int) -> Arm:
    """The arm at rest."""
    return moved(np.tile(theta, (n, 1)), np.zeros((n, 2)), np.zeros((n, 2)))


def inputs_of(s: np.ndarray, A: np.ndarray) -> dict[str, np.ndarray]:
    """Readings of both sensors; the axes that the filter does not use read something, too."""
    unused = np.full(len(s), 0.3)
    return {
        "gyro1": np.column_stack([unused, unused, -s[:, 0]]),
        "gyro2": np.column_stack([unused, unused, -s[:, 1]]),
        "accel2": np.column_stack([A, unused]),
    }


def estimate(arm: Arm, initial_state: dict[str, Any] | None = None, **parameters: Any) -> Trajectory:
    return run(BLOCK, inputs_of(arm.s, arm.A), {"sample_period": DT} | parameters, initial_state=initial_state)


def states(result: Trajectory) -> np.ndarray:
    """The ten states of (10), (n, 10)."""
    joints = np.stack([result[name] for name in ("angle", "angle_rate", "angle_acceleration")], axis=-1)
    return np.column_stack([result["position"], joints[:, 0], joints[:, 1], result["gyro_bias"]])


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def flags(result: Trajectory) -> list[int]:
    return result["status"].astype(int).tolist()


def golden_inputs(case: golden.Case, suffix: str = "") -> dict[str, np.ndarray]:
    """The filtered columns, or those with suffix ``_raw``."""
    s = np.column_stack([case.inputs[f"s1{suffix}"], case.inputs[f"s2{suffix}"]])
    return inputs_of(s, golden.columns(case.inputs, f"acc{suffix}", 2))


def golden_parameters(name: str, case: golden.Case) -> dict[str, Any]:
    c = case.parameters
    same = {key: c[key] for key in ("a1", "a2", "r1", "r2", "r3_slow", "r3_fast", "delta")}
    Q = np.array(c["Q"])
    noise = {"q_d": Q[0, 0], "q_1": Q[4, 4] / c["dt"], "q_2": Q[7, 7] / c["dt"], "q_b": Q[8, 8]}  # B[3, 3] is T
    start = {"initial_angle": (c["x0"][2], c["x0"][5]), "initial_bias": c["x0"][8:], "P0": np.diag(c["P0"])}
    return same | noise | start | {"variant": VARIANTS[name.split("_")[1]], "sample_period": c["dt"]}
