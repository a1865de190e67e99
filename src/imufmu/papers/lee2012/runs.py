"""The runs behind the experiments on Lee 2012: Tests A, B, C by a random hand, and what the filter makes of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...blocks.running import Trajectory
from ...compiled.running import run
from ...estimators import lee2012
from ...plants import handheld
from ...scoring import metrics
from ..motions import Record, parameter_set, read, record, white_noise

PERIOD = 0.01  # s
DURATION = {"A": 60.0, "B": 10.0, "C": 27.0}  # s; A and C are chosen, the paper names that of B only
SOLVER = {"max_step": 0.005}  # 1e-6 rad over a record of Test C, far below the noise
NOISE = white_noise(PERIOD, 0.01, 0.01)  # the variances that the filter assumes, 1e-4 each
BIAS = {"gyro_bias": np.radians(0.3)}  # on each axis
G = 9.8  # m/s2, of plant and filter

MODES = (1, 2, 3)
C_A = (0.001, 0.01, 0.05, 0.1, 0.3, 0.5, 0.7, 1.0)  # Table II
THRESHOLDS = ((0.05, 1), (0.1, 2), (0.2, 4), (0.5, 7), (1.0, 10))  # Table III: eps_A, n

# Test C: what happens within its first burst and in the rest after it (s).
EARLY, LATE, VERY_LATE, RESTED = (7.5, 9.5), (9.5, 15.3), (12.5, 15.3), (16.5, 16.9)


@dataclass(frozen=True)
class Errors:
    """Root mean squares of one run. roll, pitch, tilt: deg. a_x, a_y, a_z, a_norm: m/s2, a_norm of the norms."""

    roll: float
    pitch: float
    tilt: float
    a_x: float
    a_y: float
    a_z: float
    a_norm: float


@dataclass(frozen=True)
class Seed:
    """What one seed gave, by test: ``modes``, ``c_a`` (mode 1), ``thresholds`` (mode 3) by setting.

    biased: tilt (deg) of Test A with gyroscope bias, by c_a. windows: tilt (deg) of Test C in mode 1, by span (s).
    identity: largest |a_err + g Z_err|, component (m/s2). largest: largest component of a_err (m/s2). static: largest
    difference between c_a = 0 and mode 2 in any output.
    """

    modes: Mapping[str, Mapping[int, Errors]]
    c_a: Mapping[str, Mapping[float, Errors]]
    thresholds: Mapping[str, Mapping[tuple[float, int], Errors]]
    biased: Mapping[float, float]
    windows: Mapping[tuple[float, float], float]
    identity: float
    largest: float
    static: float


def test(name: str, seed: int) -> Record:
    """Record of Test A, B or C."""
    motion = parameter_set(f"handheld/lee2012_test_{name.lower()}")
    return record(handheld.BLOCK, DURATION[name], PERIOD, seed, motion | SOLVER, NOISE)


def estimate(recorded: Record, **parameters: Any) -> Trajectory:
    """What the filter makes of it."""
    return run(lee2012.BLOCK, recorded.of("gyro", "accel"), {"g": G, "sample_period": PERIOD, **parameters})


def errors(recorded: Record, estimated: Trajectory) -> Errors:
    """Root mean square errors against the truth."""
    error = {name: metrics.rms(e) for name, e in metrics.errors(estimated.values, recorded.truth.values).items()}
    angles = (float(np.degrees(error[name])) for name in ("roll", "pitch", "tilt"))
    return Errors(*angles, *(float(error[f"external_acceleration_{part}"]) for part in ("x", "y", "z", "norm")))


def tilt_rms(recorded: Record, estimated: Trajectory, span: tuple[float, float] = (-np.inf, np.inf)) -> float:
    """Root mean square tilt error (deg) within the span (s)."""
    tilt = metrics.inclination_error(estimated["vertical"], recorded.truth["vertical"])
    inside = (estimated.time >= span[0]) & (estimated.time <= span[1])
    return float(np.degrees(metrics.rms(tilt[inside])))


def acceleration_error(recorded: Record, estimated: Trajectory) -> np.ndarray:
    """a - a_ref (n, 3), m/s2, with the paper's reference a_ref = y_A - g Z_ref."""
    return estimated["external_acceleration"] - (recorded.readings["accel"] - G * recorded.truth["vertical"])


def run_seed(seed: int) -> Seed:
    """Every run of one seed."""
    records = {name: test(name, seed) for name in DURATION}
    of_modes = {name: {mode: estimate(r, mode=mode) for mode in MODES} for name, r in records.items()}
    biased = read(records["A"].truth, PERIOD, seed, NOISE | BIAS)
    off, largest = [], []
    for name, recorded in records.items():
        for estimated in of_modes[name].values():
            a_error = acceleration_error(recorded, estimated)
            Z_error = estimated["vertical"] - recorded.truth["vertical"]
            off.append(np.abs(a_error + G * Z_error).max())
            largest.append(np.abs(a_error).max())
    static, without_model = of_modes["B"][2], estimate(records["B"], mode=1, c_a=0.0)
    return Seed(
        modes={name: {m: errors(records[name], e) for m, e in found.items()} for name, found in of_modes.items()},
        c_a={name: {c: errors(r, estimate(r, mode=1, c_a=c)) for c in C_A} for name, r in records.items()},
        thresholds={
            name: {(eps, n): errors(r, estimate(r, mode=3, eps_a=eps, n=n)) for eps, n in THRESHOLDS}
            for name, r in records.items()
        },
        biased={c: tilt_rms(biased, estimate(biased, mode=1, c_a=c)) for c in (0.1, 0.7, 1.0)},
        windows={span: tilt_rms(records["C"], of_modes["C"][1], span) for span in (EARLY, LATE, VERY_LATE, RESTED)},
        identity=float(max(off)),
        largest=float(max(largest)),
        static=max(float(np.abs(static[name] - without_model[name]).max()) for name in static.values),
    )


def tilts(seeds: Sequence[Seed], kind: str, name: str, setting: Any) -> np.ndarray:
    """Tilt RMSE (deg) of every seed. kind: ``modes``, ``c_a`` or ``thresholds``; name: of the test."""
    return np.array([getattr(seed, kind)[name][setting].tilt for seed in seeds])


def median(seeds: Sequence[Seed], kind: str, name: str, setting: Any) -> Errors:
    """Median over the seeds of every root mean square."""
    found = [vars(getattr(seed, kind)[name][setting]) for seed in seeds]
    return Errors(**{figure: float(np.median([f[figure] for f in found])) for figure in found[0]})
