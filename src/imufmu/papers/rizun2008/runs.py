"""The runs behind the experiments on Rizun 2008: motion -> IMU -> filter, in this process."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np

from ...blocks import vocabulary as v
from ...blocks.block import Expressions, SampledBlock
from ...blocks.rotations import over_rows, rotate, rotate_back, unit
from ...blocks.running import Trajectory
from ...blocks.signals import State, real
from ...blocks.vocabulary import GRAVITY
from ...compiled.running import run, simulate
from ...estimators import lee2012, rizun2008
from ...plants.pendulum import DOUBLE_PENDULUM, DRIVEN
from ...scoring import prediction
from ...scoring.metrics import inclination_error, rms
from .motions import UP, Motion, circle, inclined_plane, readings, turning, white_velocity

DELTA_N, DELTA_V = np.deg2rad(0.2), 1.0  # the third row of Table 1
OMEGA_C = 10.0  # rad/s, the limit of human motion in section 4.2
OMEGA_G = prediction.optimal_cutoff(DELTA_N, DELTA_V, GRAVITY)
FILTER = {"gyro_noise_density": DELTA_N, "velocity_noise_density": DELTA_V}

PERIOD = 0.02  # s; OMEGA_C is far below the Nyquist frequency
SETTLE = 50.0  # s, nine time constants, left out at the start of every record
RECORD = 2000.0 + SETTLE  # s
REST = np.zeros(3)  # rad/s
TURN = np.array([2.0, 2.0, 2.0]) / np.sqrt(3)  # rad/s


def degrees_rms(tilt: np.ndarray) -> float:
    """Root mean square (deg) of angles in rad."""
    return float(np.rad2deg(rms(tilt)))


# The filter that section 4.2 compares with: optimal if acceleration were white


def _step(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    g = rotate_back(rizun2008.turn(u.gyro_previous, p), x.g)
    return dict(g=g + (1 - ca.exp(-p.cutoff * p.sample_period)) * (u.accel - g))


FIRST_ORDER = SampledBlock(
    name="first_order",
    summary="First-order low-pass filter in the gyro-estimated Earth frame",
    doc="The optimal filter if acceleration were white (section 4.2).",
    reference="Rizun 2008",
    inputs=(v.GYRO, v.ACCEL),
    outputs=(v.VERTICAL, v.EXTERNAL_ACCELERATION),
    locals=(),
    own_parameters=(real("cutoff", "rad/s", OMEGA_G, (1e-6, 1e3), "Cut-off of the filter"),),
    state=(State("g", (3,)),),
    initial=lambda u, p: dict(g=u.accel),
    step=_step,
    output=lambda x, u, p: dict(vertical=unit(x.g), external_acceleration=u.accel - x.g),
)


# Estimates and their errors


def estimated(
    block: SampledBlock, read: Mapping[str, np.ndarray], motion: Motion, *, known_start: bool = False, **parameters: Any
) -> Trajectory:
    """The estimate of a block from readings; rizun2008 has the parameters FILTER unless told otherwise."""
    own = FILTER if block is rizun2008.BLOCK else {}
    start = {"g": GRAVITY * motion.vertical[0]} if known_start else None
    return run(block, read, {"sample_period": motion.period} | own | parameters, initial_state=start)


def tilt_of(motion: Motion, estimate: Trajectory) -> np.ndarray:
    """Tilt error (n,), rad."""
    return inclination_error(estimate["vertical"], motion.vertical)


def gravity_error(motion: Motion, read: Mapping[str, np.ndarray], estimate: Trajectory) -> np.ndarray:
    """Error of the gravity estimate (n, 3), m/s2, in N."""
    g_S = read["accel"] - estimate["external_acceleration"]  # (2)
    return over_rows(rotate, motion.q_NS, g_S) - GRAVITY * UP


# White velocity


@dataclass(frozen=True)
class Case:
    """One condition: slosh ``a`` DELTA_V, constant rate w (3,), rad/s, in S. printed: entry of Table 1, deg."""

    label: str
    a: float
    w: np.ndarray
    printed: float

    @property
    def predicted(self) -> float:
        """(50), deg."""
        return float(np.rad2deg(prediction.tilt_rms(DELTA_N, DELTA_V, self.a)))

    @property
    def predicted_band_limited(self) -> float:
        """The same where the velocity ends at OMEGA_C, deg."""
        error = prediction.second_order_error(OMEGA_G, DELTA_N, self.a * DELTA_V, OMEGA_C)
        return float(np.rad2deg(np.sqrt(2 * error) / GRAVITY))


HALF, ASSUMED, TWICE, TURNING = CASES = (
    Case("half the slosh", 0.5, REST, 0.50),
    Case("slosh as assumed", 1.0, REST, 0.55),
    Case("twice the slosh", 2.0, REST, 0.73),
    Case("slosh as assumed, 2 rad/s", 1.0, TURN, 0.55),
)


@dataclass
class Errors:
    """Errors of gravity (m/s2, in N) and tilts (rad) of the records of one case."""

    gravity: list[np.ndarray] = field(default_factory=list)
    tilt: list[np.ndarray] = field(default_factory=list)

    @property
    def seconds(self) -> float:
        return sum(map(len, self.tilt)) * PERIOD

    @property
    def tilt_rms(self) -> float:
        """deg."""
        return degrees_rms(np.concatenate(self.tilt))

    @property
    def horizontal_mean_square(self) -> float:
        """Of one component, (m/s2)^2."""
        return float(rms(np.concatenate(self.gravity)[:, :2].ravel()) ** 2)

    @property
    def mean(self) -> np.ndarray:
        """Mean error (3,), m/s2."""
        return np.concatenate(self.gravity).mean(axis=0)

    @property
    def standard_error(self) -> float:
        """Of the mean, m/s2: its variance is the error spectrum at frequency 0, g delta_n delta_v, per second."""
        return float(np.sqrt(GRAVITY * DELTA_N * DELTA_V / self.seconds))


@dataclass
class Campaign:
    """All records of white velocity. cases, first_order: by label. shown: one record for a figure."""

    cases: dict[str, Errors]
    first_order: dict[str, Errors]
    shown: tuple[Motion, dict[str, np.ndarray], Trajectory]


OWN_CUTOFF = prediction.first_order_cutoff(DELTA_N, DELTA_V, OMEGA_C)
FIRST_ORDER_CUTOFFS = {"cut-off of the second-order filter": OMEGA_G, "cut-off of its own optimum": OWN_CUTOFF}


def campaign(records: int, advance: Callable[[], None]) -> Campaign:
    """So many records of every case; ``advance`` is called after each."""
    cases = {case.label: Errors() for case in CASES}
    first_order = {label: Errors() for label in FIRST_ORDER_CUTOFFS}
    shown = None
    for number, case in enumerate(CASES):
        for record in range(records):
            rng = np.random.default_rng([2008, number, record])
            acceleration = white_velocity(rng, RECORD, PERIOD, case.a * DELTA_V, OMEGA_C)
            motion = turning(case.w, acceleration, PERIOD)
            read = readings(motion, {"gyro_noise_density": DELTA_N, "seed": 1000 * number + record})
            estimate = estimated(rizun2008.BLOCK, read, motion, known_start=True)
            _add(cases[case.label], motion, read, estimate, SETTLE)
            if case is ASSUMED:
                shown = shown or (motion, read, estimate)
                for label, cutoff in FIRST_ORDER_CUTOFFS.items():
                    other = estimated(FIRST_ORDER, read, motion, known_start=True, cutoff=cutoff)
                    _add(first_order[label], motion, read, other, SETTLE * OMEGA_G / cutoff)
            advance()
    assert shown is not None
    return Campaign(cases, first_order, shown)


def _add(errors: Errors, motion: Motion, read: dict[str, np.ndarray], estimate: Trajectory, settle: float) -> None:
    settled = slice(round(settle / motion.period), None)
    errors.gravity.append(gravity_error(motion, read, estimate)[settled])
    errors.tilt.append(tilt_of(motion, estimate)[settled])


# One run each


def drift(windows: int) -> dict[float, float]:
    """Root mean square tilt (deg) of the gyroscope alone, by time (s): increments within one long record at rest."""
    period, longest = 0.05, 30.0
    motion = turning(REST, np.zeros((round(windows * longest / period) + 1, 3)), period)
    read = readings(motion, {"gyro_noise_density": DELTA_N, "seed": 11})
    read["accel"][1:] = np.nan
    vertical = estimated(rizun2008.BLOCK, read, motion)["vertical"]
    every = {t: vertical[:: round(t / period)] for t in (10.0, 20.0, longest)}
    return {t: degrees_rms(inclination_error(rows[1:], rows[:-1])) for t, rows in every.items()}


def circling() -> dict[str, float]:
    """Mean tilt (deg) by filter, on a circle of 0.8 m at 2 rad/s with perfect readings, after 150 s."""
    motion = circle(200.0, 0.01, rate=2.0, radius=0.8)
    read = readings(motion)
    mean = np.tile(read["accel"].mean(axis=0), (len(motion.time), 1))
    late = slice(15_000, None)
    estimates = {
        "rizun2008": tilt_of(motion, estimated(rizun2008.BLOCK, read, motion, known_start=True)),
        "lee2012, mode 1": tilt_of(motion, estimated(lee2012.BLOCK, read, motion, mode=1)),
        "lee2012, mode 2": tilt_of(motion, estimated(lee2012.BLOCK, read, motion, mode=2)),
        "mean of the accelerometer": inclination_error(mean, motion.vertical),
    }
    return {label: float(np.rad2deg(tilt[late].mean())) for label, tilt in estimates.items()}


def walking_leg() -> tuple[np.ndarray, np.ndarray]:
    """Both sides of (19) for a shank in a walking-like swing: mean acceleration, mean of w x v; (3,), m/s2, in S."""
    seconds = 300.0
    leg = simulate(DOUBLE_PENDULUM, seconds + 4.0, 0.01, parameters={"motion": DRIVEN, "drive_duration": seconds})
    v_S = over_rows(rotate_back, leg["q_NS"], leg["velocity"])
    return leg["external_acceleration"].mean(axis=0), np.cross(leg["angular_velocity"], v_S).mean(axis=0)


def on_inclined_plane() -> dict[str, float]:
    """Tilt (deg) along the plane of section 2.5, by what is averaged; the filter's is its largest after 150 s."""
    motion = inclined_plane(200.0, 0.01, frequency=1.0)
    read = readings(motion)
    apparent = np.arctan2(read["accel"][:, 0], read["accel"][:, 2])
    mean = read["accel"].mean(axis=0)
    filtered = tilt_of(motion, estimated(rizun2008.BLOCK, read, motion, known_start=True))
    return {
        "mean of the apparent angle": float(np.rad2deg(apparent.mean())),
        "angle of the mean accelerometer": float(np.rad2deg(np.arctan2(mean[0], mean[2]))),
        "rizun2008, largest tilt": float(np.rad2deg(filtered[15_000:].max())),
    }


def steady_turn_errors() -> dict[str, float]:
    """Tilt (deg) after 400 s of 2 rad/s about a horizontal axis at 100 Hz, perfect readings, by discretisation."""
    motion = turning(np.array([0.0, 2.0, 0.0]), np.zeros((40_001, 3)), 0.01)
    read = readings(motion)
    found = {}
    for label, discretisation in (("filter, then rotate", 0), ("matrix exponential", 1)):
        estimate = estimated(rizun2008.BLOCK, read, motion, discretisation=discretisation)
        held = inclination_error(estimate["g_held"][:-1], motion.vertical[1:])  # at the end of each period
        found[label] = float(np.rad2deg(held[-1]))
    return found


def fast_turn_growth() -> tuple[float, float]:
    """Largest gravity estimate relative to g, and RMS tilt (deg), in 1000 s of 20 rad/s and slosh at 100 Hz."""
    acceleration = white_velocity(np.random.default_rng(20), 1000.0, 0.01, DELTA_V, OMEGA_C)
    motion = turning(10 * TURN, acceleration, 0.01)
    read = readings(motion, {"gyro_noise_density": DELTA_N, "seed": 20})
    estimate = estimated(rizun2008.BLOCK, read, motion, known_start=True)
    largest = np.linalg.norm(estimate["g_held"], axis=1).max() / GRAVITY
    return float(largest), degrees_rms(tilt_of(motion, estimate)[round(SETTLE / 0.01) :])
