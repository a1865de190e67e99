"""What experiments record: one seed decides motion and noise, and the IMU reads what it is told to."""

from __future__ import annotations

import numpy as np
import pytest

from imufmu.compiled.running import run
from imufmu.papers.motions import parameter_set, read, record, white_noise
from imufmu.plants import pendulum
from imufmu.plants.handheld import BLOCK
from imufmu.sensors import imu

IDEAL = {"gyro": "angular_velocity", "accel": "specific_force", "mag": "magnetic_field"}


def test_an_ideal_imu_reads_the_truth_of_its_instants() -> None:
    recorded = record(BLOCK, 1.0, 0.02, seed=4)
    assert recorded.truth.time == pytest.approx(np.arange(51) * 0.02, abs=1e-15)
    for reading, truth in IDEAL.items():
        assert np.array_equal(recorded.readings[reading], recorded.truth[truth])
    assert list(recorded.of("gyro", "accel")) == ["gyro", "accel"]


def test_the_seed_decides_motion_and_noise() -> None:
    noise = white_noise(0.01, gyro=0.1)
    one, same, other = (record(BLOCK, 1.0, 0.01, seed, imu_parameters=noise) for seed in (1, 1, 2))
    assert np.array_equal(one.readings["gyro"], same.readings["gyro"])
    assert np.all(one.truth["angular_velocity"] != other.truth["angular_velocity"])
    added = [r.readings["gyro"] - r.truth["angular_velocity"] for r in (one, other)]
    assert np.all(added[0] != added[1])


def test_the_noise_is_not_made_of_the_draws_that_made_the_motion() -> None:
    """The first draws of a block are those of its seed: with the same one the noise would follow from the motion."""
    noise = white_noise(0.01, accel=1.0)
    recorded = record(BLOCK, 1.0, 0.01, 1, imu_parameters=noise)
    ideal = {name: recorded.truth[name] for name in IDEAL.values()}
    same_draws = run(imu.BLOCK, ideal, noise | {"sample_period": 0.01, "seed": 1})["accel"]
    assert np.all(recorded.readings["accel"] != same_draws)


def test_another_reading_of_one_motion_keeps_its_noise() -> None:
    truth = record(BLOCK, 1.0, 0.01, seed=3).truth
    noise = white_noise(0.01, 0.01, 0.01)
    plain, biased = read(truth, 0.01, 3, noise), read(truth, 0.01, 3, noise | {"gyro_bias": 0.5})
    assert biased.readings["gyro"] - plain.readings["gyro"] == pytest.approx(np.full((101, 3), 0.5), abs=1e-14)
    assert np.array_equal(biased.readings["accel"], plain.readings["accel"])


def test_white_noise_has_the_asked_deviation_per_sample() -> None:
    still = {"rate_mean": 0.0, "acceleration_mean": 0.0}
    deviations = {"gyro": 0.02, "accel": 0.3, "mag": 4.0}
    recorded = record(BLOCK, 40.0, 0.01, 5, still | {"max_step": 0.01}, white_noise(0.01, **deviations))
    for reading, truth in IDEAL.items():
        noise = recorded.readings[reading] - recorded.truth[truth]
        # 12000 draws: standard error of a deviation 0.65 %; five of them.
        assert noise.std() == pytest.approx(deviations[reading], rel=0.033)


def test_a_plant_without_seed_is_recorded_too() -> None:
    first, second = (record(pendulum.PENDULUM, 0.5, 0.01, seed) for seed in (1, 2))
    assert np.array_equal(first.truth["q_NS"], second.truth["q_NS"])


def test_parameter_sets_are_values_by_name() -> None:
    values = parameter_set("handheld/lee2012_test_b")
    assert values["random_attitude"] == 1.0
    assert values["bursts"] == 2.0
    assert [values[f"burst_start[{i}]"] for i in (1, 2)] == [1.3, 5.3]
    assert parameter_set("imus/mtx")["gyro_range"] > 0
