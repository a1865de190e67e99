"""Claims about plumb where its attitude went wrong: it notices, says so, and finds back."""

from __future__ import annotations

import math

import numpy as np
import pytest

from imufmu.blocks.vocabulary import Status
from support.plumb_motions import carried, consumer, part_of, smooth, tilt_of

DT = 0.01
T = np.arange(0, 60, DT)
AFTER = 2550  # 5 s after everything that goes wrong here


def swinging(begin: float) -> dict[str, np.ndarray]:
    """Angles of a gentle motion, some 0.4 rad, from this time on."""
    moves = smooth(T, begin, 2)
    return {name: 0.4 * np.sin(2 * np.pi * f * (T - begin)) * moves for name, f in (("roll", 0.23), ("pitch", 0.31))}


@pytest.mark.parametrize("moves", [False, True])
def test_samples_lost_in_a_turn_cost_five_seconds_of_rest_or_ten_of_gentle_motion(moves: bool) -> None:
    """A tenth of a second of a turn at 100 deg/s, rows closed up; VQF needs 4 s of rest."""
    turn = np.radians(90) * smooth(T, 20, 1.2)
    swings = swinging(21) if moves else {"roll": np.zeros_like(T), "pitch": np.zeros_like(T)}
    motion = carried(T, roll=turn + swings["roll"], pitch=swings["pitch"])
    kept = np.delete(np.arange(len(T)), slice(2055, 2065))
    readings = {name: values[kept] for name, values in consumer(motion).items()}
    error, result = tilt_of(part_of(motion, kept), readings)
    assert error[2100] > 10
    assert error[3110 if moves else AFTER :].max() < 3
    status = result["status"].astype(int)
    assert (status[2100:3200] == Status.LOST).any() and not status[:2055].any() and not status[3500:].any()


@pytest.mark.parametrize("moves", [False, True])
def test_a_hit_is_forgotten(moves: bool) -> None:
    """Two samples of 15 g and 6 rad/s that no sample rate resolves."""
    motion = carried(T, **(swinging(5) if moves else {}))
    readings = consumer(motion)
    readings["accel"][2050:2052] += [150, -90, 60]
    readings["gyro"][2050:2052] += [3, -6, 2]
    error, _ = tilt_of(motion, readings)
    assert error[2051] > 5
    assert error[AFTER if not moves else 3100 :].max() < 3


@pytest.mark.parametrize("full_scale", [250, 500, 1000])
def test_clipping_is_noticed_from_the_readings(full_scale: float) -> None:
    """Half a turn faster than the gyroscope can read, with gyro_range left at 2000 deg/s: the filter doubts."""
    limit = np.radians(full_scale)
    motion = carried(T, roll=np.pi * smooth(T, 20, 1.1 * np.pi / limit))
    readings = consumer(motion)
    readings["gyro"] = np.clip(readings["gyro"], -limit, limit)
    error, result = tilt_of(motion, readings)
    ends = round((20 + 1.1 * np.pi / limit) / DT)
    _, unclipped = tilt_of(motion, consumer(motion))
    assert error[ends] > 10
    assert result["tilt_std"][ends] > 2 * unclipped["tilt_std"][ends]
    assert error[AFTER:].max() < 3


def test_readings_beyond_all_ranges_count_as_missing() -> None:
    motion = carried(T, **swinging(5))
    readings = consumer(motion)
    readings["accel"][2000], readings["accel"][2001:2003], readings["gyro"][2500] = 1e8, 1e29, 1e8
    holes = {name: values.copy() for name, values in readings.items()}
    holes["accel"][2000:2003], holes["gyro"][2500] = math.nan, math.nan
    error, result = tilt_of(motion, readings)
    _, missing = tilt_of(motion, holes)
    assert error.max() < 1
    for name in ("vertical", "tilt_std", "gyro_bias", "status"):
        assert np.array_equal(result[name], missing[name]), name
    assert result["status"][2000] == Status.ACCEL_MISSING and result["status"][2500] == Status.GYRO_MISSING


def test_an_accelerometer_with_offsets_of_80_mg_still_shows_rest() -> None:
    """Uncalibrated, and 4 % of scale: the error is the offset's."""
    turns = smooth(T, 10, 1) - smooth(T, 25, 1), smooth(T, 35, 1) - smooth(T, 50, 1)
    motion = carried(T, roll=np.pi / 2 * turns[0], pitch=np.pi / 2 * turns[1])
    readings = consumer(motion)
    readings["accel"] = 1.04 * readings["accel"] + [0.5, 0.5, 0.8]
    error, result = tilt_of(motion, readings)
    assert error.max() < 8
    at_rest = np.abs(motion.gyro).max(axis=1) < 1e-9
    assert result["stationary"][at_rest].mean() > 0.4
    assert np.rad2deg(result["tilt_std"][900]) > 3
