"""What the papers' experiments record: a plant moves, an IMU reads, both in this process."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import sqrt
from typing import Any

import numpy as np
from fmpy.ssp.ssd import read_ssv

from ..blocks.block import ContinuousBlock
from ..blocks.running import Trajectory
from ..compiled.running import run, simulate
from ..files.locations import models_folder
from ..sensors import imu

# Plant and IMU draw from streams of their own, also where both are given the same seed.
_IMU_SEEDS = 2**30


@dataclass(frozen=True)
class Record:
    """truth: of the plant, at the instants of the samples. readings: gyro, accel, mag by name, (n, 3), SI units, uT."""

    truth: Trajectory
    readings: Mapping[str, np.ndarray]

    def of(self, *names: str) -> dict[str, np.ndarray]:
        """Some of the readings: the inputs of an estimator."""
        return {name: self.readings[name] for name in names}


def record(
    plant: ContinuousBlock,
    duration: float,
    period: float,
    seed: int,
    plant_parameters: Mapping[str, Any] | None = None,
    imu_parameters: Mapping[str, Any] | None = None,
) -> Record:
    """Samples every ``period`` (s) from 0 to ``duration`` (s). seed: of motion and noise, from 0 to 2^30 - 1.

    A plant without a seed moves as its parameters say. Without ``imu_parameters`` the IMU is ideal.
    """
    seeded = {"seed": seed} if plant.normals else {}
    truth = simulate(plant, duration, period, parameters={**(plant_parameters or {}), **seeded})
    return read(truth, period, seed, imu_parameters)


def read(truth: Trajectory, period: float, seed: int, imu_parameters: Mapping[str, Any] | None = None) -> Record:
    """What an IMU with these errors reads of a motion, with samples every ``period`` (s); seed: as in ``record``."""
    ideal = {signal.name: truth[signal.name] for signal in imu.BLOCK.inputs}
    errors = {**(imu_parameters or {}), "sample_period": period, "seed": _IMU_SEEDS + seed}
    readings = run(imu.BLOCK, ideal, errors)
    return Record(truth, {signal.name: readings[signal.name] for signal in imu.BLOCK.outputs})


def parameter_set(name: str) -> dict[str, float]:
    """Values by variable name of a parameter set in models/, such as ``handheld/lee2012_test_b``."""
    words = {"true": 1.0, "false": 0.0}
    parameters = read_ssv(str(models_folder() / f"{name}.ssv")).parameters
    return {p.name: words[p.value] if p.value in words else float(p.value) for p in parameters}


def white_noise(period: float, gyro: float = 0.0, accel: float = 0.0, mag: float = 0.0) -> dict[str, float]:
    """IMU parameters for white noise of these standard deviations per sample (rad/s, m/s2, uT)."""
    deviations = {"gyro": gyro, "accel": accel, "mag": mag}
    return {f"{sensor}_noise_density": deviation * sqrt(2 * period) for sensor, deviation in deviations.items()}
