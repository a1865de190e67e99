"""Claims about plumb in a vehicle: with the speed of the wheels, without it, and with wheels that lie."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from imufmu.blocks.running import Trajectory
from imufmu.compiled.running import run
from imufmu.estimators import lee2012, leechoi2018, rizun2008
from support import driving
from support.driving import DT, IMU_POSITION, MOUNT, Drive
from support.motions import angle
from support.plumb_motions import BLOCK, G, rms

DRIVES = ("roundabout", "lane_changes", "slalom", "braking")
BIAS = np.array([-0.0175, -0.0087, 0.0044])  # rad/s, of a consumer's gyroscope; models/imus/mpu9150.ssv


@pytest.fixture(scope="module")
def drives() -> dict[str, Drive]:
    return {name: getattr(driving, name)() for name in DRIVES}


def readings(drive: Drive, seed: int = 1) -> dict[str, np.ndarray]:
    """With the bias, the resolution and the noise of an MPU-9150, the accelerometer levelled."""
    rng, n = np.random.default_rng(seed), len(drive.gyro)
    gyro = drive.gyro + BIAS + rng.normal(0, 1.3e-3, (n, 3))
    return {"gyro": gyro, "accel": drive.accel + rng.normal(0, 0.055, (n, 3))}


def with_speed(drive: Drive, speed: np.ndarray | None = None, valid: Any = 1.0, **settings: Any) -> Trajectory:
    told = {"forward_speed": drive.forward_speed if speed is None else speed}
    inputs = readings(drive) | told | {"forward_speed_valid": np.broadcast_to(valid, len(drive.gyro)).astype(float)}
    here = {"sample_period": DT, "g": G, "mount": MOUNT, "imu_position": IMU_POSITION}
    return run(BLOCK, inputs, here | settings)


def tilt_deg(drive: Drive, result: Trajectory) -> np.ndarray:
    return np.rad2deg(angle(result["vertical"], drive.vertical))


@pytest.mark.parametrize("name", DRIVES)
def test_with_the_speed_of_the_wheels_no_manoeuvre_tilts_it(name: str, drives: dict[str, Drive]) -> None:
    """A car on springs whose rear wheels slip, accelerations of 4 to 7 m/s2. The issue's limit is 0.3 deg."""
    drive = drives[name]
    result = with_speed(drive)
    assert rms(tilt_deg(drive, result)) < 0.3
    assert np.mean((np.deg2rad(tilt_deg(drive, result)) / result["tilt_std"])[200:] ** 2) < 1  # and it says so


@pytest.mark.parametrize("name", DRIVES)
def test_without_it_no_filter_of_a_paper_is_better(name: str, drives: dict[str, Drive]) -> None:
    drive = drives[name]
    inputs, settings = readings(drive), {"sample_period": DT, "g": G}
    papers = [run(module.BLOCK, inputs, settings) for module in (lee2012, leechoi2018, rizun2008)]
    best = min(rms(tilt_deg(drive, result)) for result in papers)
    assert rms(tilt_deg(drive, run(BLOCK, inputs, settings))) < 0.5 * best


def test_speed_that_is_not_valid_changes_nothing(drives: dict[str, Drive]) -> None:
    drive = drives["slalom"]
    ignored, alone = with_speed(drive, valid=0.0), run(BLOCK, readings(drive), {"sample_period": DT, "g": G})
    for signal in BLOCK.reported:
        assert np.array_equal(ignored[signal.name], alone[signal.name]), signal.name


@pytest.mark.parametrize("name", DRIVES)
def test_speed_may_come_and_go(name: str, drives: dict[str, Drive]) -> None:
    """Three seconds with, two without, NaN instead of a flag now and then: as good as with speed at half the time."""
    drive = drives[name]
    t = np.arange(len(drive.gyro)) * DT
    speed = np.where(np.mod(t, 7.0) > 6.5, np.nan, drive.forward_speed)
    result = with_speed(drive, speed, np.mod(t, 5.0) < 3.0)
    assert rms(tilt_deg(drive, result)) < 0.6


def test_the_velocity_is_that_of_the_sensor(drives: dict[str, Drive]) -> None:
    """Known but for the yaw. The lever arm of 1.3 m adds 0.5 m/s where the car turns at 0.4 rad/s."""
    drive = drives["slalom"]

    def largest_error(**settings: Any) -> float:
        length = np.linalg.norm(with_speed(drive, **settings)["velocity"], axis=1)
        return float(np.abs(length - np.linalg.norm(drive.velocity, axis=1))[2000:].max())

    assert largest_error() < 0.15
    assert largest_error(imu_position=(1.2, 5.0, 0.4)) > 1.0


def test_the_mount_matters(drives: dict[str, Drive]) -> None:
    drive = drives["slalom"]
    right, wrong = with_speed(drive), with_speed(drive, mount=np.zeros(3))
    assert rms(tilt_deg(drive, wrong)) > 5 * rms(tilt_deg(drive, right))


def test_locked_wheels_do_not_mislead_it(drives: dict[str, Drive]) -> None:
    """In every braking the wheels stand still while the car slides from 15 to 1 m/s, for two seconds."""
    drive = drives["braking"]
    slides = (np.gradient(drive.forward_speed, DT) < -3) & (drive.forward_speed < 15) & (drive.forward_speed > 1)
    assert slides.sum() * DT > 3.5
    result = with_speed(drive, np.where(slides, 0.0, drive.forward_speed))
    assert rms(tilt_deg(drive, result)) < 0.5


def test_a_speed_that_keeps_disagreeing_is_believed_in_the_end(drives: dict[str, Drive]) -> None:
    """From one instant on the wheels tell 5 m/s less: after t_f it is the velocity that was wrong."""
    drive = drives["lane_changes"]
    late = np.arange(len(drive.gyro)) * DT > 12
    result = with_speed(drive, drive.forward_speed - 5.0 * late)
    speed = np.linalg.norm(result["velocity"], axis=1)
    assert abs(speed[round(16.5 / DT)] - 20) < 1
    assert abs(speed[-1] - 15) < 1


def test_steady_travel_is_no_rest_of_a_vehicle(drives: dict[str, Drive]) -> None:
    """At a constant 20 m/s nothing but the wheels and a slow drift of the readings tells that it moves."""
    drive = drives["lane_changes"]
    t = np.arange(len(drive.gyro)) * DT
    cruises = (t > 10.2) & (t < 10.9)
    assert not with_speed(drive)["stationary"][cruises].any()
    assert run(BLOCK, readings(drive), {"sample_period": DT, "g": G})["stationary"][cruises].mean() < 0.1
