"""Trials of Bennett et al. 2014: a two-link arm moved by hand, an IMU on each link, encoders in the joints.

From the paper: rest, motion, rest; hanging at the start; a stick that keeps the knee from bending backwards; one trial
of rather slow motion, one of varying speed; an MPU-9150 at 200 Hz with its ranges; encoders of 1000 counts; a median of
five over the whole record; biases from the first 2 s.

Chosen here, as the paper says nothing: lengths, tuning, and the motion of each seed. Both joints swing, the knee about
a quarter of a period behind, ever faster. The sensors have the noise, bias and resolution of the data sheet and are
calibrated otherwise. After the rest their biases move by 0.25 deg/s within some seconds, as a sensor's do that warms
up: without that a gyroscope alone would be as good as anything.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...blocks.running import Trajectory
from ...compiled.running import run
from ...estimators import bennett2014
from ...estimators.running_median import centred_median
from ...plants.pendulum import DOUBLE_PENDULUM, DRIVEN
from ...scoring.metrics import angle_difference, rms
from ..motions import Record, parameter_set, read, record

PERIOD = 0.005  # s, 200 Hz
A1, A2 = 0.2, 0.35  # m, length of link 1, and joint 2 to sensor 2
MOUNT = (0.0, np.pi / 2, np.pi / 2)  # turns the sensor of the pendulum into the frame of (8)
REST, LEARNING = 3.0, 2.0  # s: at the start, and the part of it that gives the biases
WARMING, DRIFT = 5.0, np.deg2rad(0.25)  # s, rad/s
NOT_CALIBRATED = ("misalignment", "scale_error", "accel_bias")


@dataclass(frozen=True)
class Trial:
    """A record. angle: (n,), rad, of link 2 from the horizontal, by the encoders. readings: inputs of bennett2014."""

    time: np.ndarray
    angle: np.ndarray
    readings: Mapping[str, np.ndarray]

    def error(self, angle: np.ndarray) -> float:
        """Root mean square difference (rad) to an angle of link 2 (n,), rad, whole turns aside."""
        return float(rms(angle_difference(angle, self.angle)))

    def nearest_turn(self, angle: np.ndarray) -> np.ndarray:
        """The angle (n,), rad, by whole turns as near to the encoders as possible."""
        return self.angle + angle_difference(angle, self.angle)

    def mounted_wrongly(self, turn: float) -> Trial:
        """The same with sensor 2 turned about the joint axis by ``turn`` (rad)."""
        c, s = np.cos(turn), np.sin(turn)
        accel2 = self.readings["accel2"] @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
        return replace(self, readings={**self.readings, "accel2": accel2})

    def skewed(self, samples: int) -> Trial:
        """The same with sensor 2 late by this many samples."""
        rows = np.maximum(np.arange(len(self.time)) - samples, 0)
        late = {name: self.readings[name][rows] for name in ("gyro2", "accel2")}
        return replace(self, readings={**self.readings, **late})


def varied(seed: int) -> dict[str, Any]:
    """Drive of the pendulum: swings that become fast, for some 40 s."""
    rng = np.random.default_rng([seed, 1])
    return _drive(rng, start=(0.2, 0.4), end=(1.0, 1.3), duration=(38, 44), thigh=(0.45, 0.7), knee=(0.3, 0.45))


def slow(seed: int) -> dict[str, Any]:
    """Drive of the pendulum: slow swings, for some 20 s."""
    rng = np.random.default_rng([seed, 2])
    return _drive(rng, start=(0.3, 0.4), end=(0.5, 0.6), duration=(16, 20), thigh=(0.4, 0.6), knee=(0.3, 0.4))


def _drive(rng: np.random.Generator, **ranges: tuple[float, float]) -> dict[str, Any]:
    """Parameters by name, each at random in its range: Hz, s, rad."""
    drawn = {name: rng.uniform(*span) for name, span in ranges.items()}
    # Half of the swing, and more than that to one side: the knee never bends backwards.
    knee_swing, knee_offset = 2 * drawn["knee"], -2 * drawn["knee"] * rng.uniform(1.0, 1.1)
    return {
        "drive_offset": (rng.uniform(-0.1, 0.3), knee_offset),
        "drive_amplitude": (drawn["thigh"], knee_swing),
        "drive_phase": (0.0, -rng.uniform(0.8, 2.2)),
        "drive_start_frequency": drawn["start"],
        "drive_end_frequency": drawn["end"],
        "drive_duration": drawn["duration"],
    }


def imu_errors() -> dict[str, float]:
    """Parameters of the IMU: the data sheet, but for what a calibration removes."""
    device = parameter_set("imus/mpu9150")
    return {name: x for name, x in device.items() if not any(error in name for error in NOT_CALIBRATED)}


def records(drive: Mapping[str, Any], seed: int) -> tuple[Record, Record]:
    """What the IMUs on links 1 and 2 read."""
    duration = PERIOD * round((REST + drive["drive_duration"] + REST) / PERIOD)
    arm = {"motion": DRIVEN, "drive_rest": REST, "length": (A1, A2), "imu_distance": A2, "mount": MOUNT, **drive}
    arm["max_step"] = PERIOD  # the angles of a driven motion do not depend on it
    second = record(DOUBLE_PENDULUM, duration, PERIOD, 2 * seed + 2, arm, imu_errors())
    upper = {name: second.truth[f"upper_{name}"] for name in ("angular_velocity", "specific_force", "magnetic_field")}
    return read(Trajectory(second.truth.time, upper), PERIOD, 2 * seed + 1, imu_errors()), second


def trial(drive: Mapping[str, Any], seed: int) -> Trial:
    """The record of one seed, with the drift of the biases and the encoders."""
    first, second = records(drive, seed)
    time = second.truth.time
    angle = second.truth["encoder"].sum(axis=1) - np.pi / 2
    towards = np.random.default_rng([seed, 3]).choice([-1, 1], 2) * DRIFT
    drift = -np.expm1(-np.maximum(time - LEARNING, 0) / WARMING)[:, None]
    readings = {
        "gyro1": first.readings["gyro"] + drift * towards[0],
        "gyro2": second.readings["gyro"] + drift * towards[1],
        "accel2": second.readings["accel"],
    }
    return Trial(time, angle, readings)


def estimated(of: Trial, **parameters: Any) -> Trajectory:
    """What bennett2014 makes of the median of the record. parameters: changes of the tuning, which is the default."""
    filtered = {name: centred_median(values) for name, values in of.readings.items()}
    tuning = {"sample_period": PERIOD, "rest_time": LEARNING, "a1": A1, "a2": A2}
    return run(bennett2014.BLOCK, filtered, tuning | parameters)
