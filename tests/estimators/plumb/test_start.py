"""Claims about how plumb starts: in motion, with a wrong first sample, and where there is no rest."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from imufmu.blocks.rotations import over_rows
from imufmu.estimators.plumb.start import to_the_top
from support.plumb_motions import carried, consumer, moving, part_of, smooth, tilt_of

T = np.arange(0, 60, 0.01)


def hand(seed: int, moves: np.ndarray) -> np.ndarray:
    """Three angles (rad) that swing by some 0.5 rad at up to 0.4 Hz, where ``moves`` is 1."""
    rng = np.random.default_rng(seed)
    frequency, phase = rng.uniform(0.1, 0.4, (2, 3)), rng.uniform(0, 2 * np.pi, (2, 3))
    return 0.3 * np.sin(2 * np.pi * frequency * T[:, None, None] + phase).sum(axis=1).T * moves


@pytest.mark.parametrize("first", [(0.0, 0.0, -9.8), (9.8, 0.0, 0.0), (0.0, 0.0, 0.0), (1e8, 0.0, -1e8)])
@pytest.mark.parametrize("begins", [10.0, 0.0])
def test_a_wrong_first_sample_is_forgotten_in_two_seconds(first: tuple[float, ...], begins: float) -> None:
    """Upside down, sideways, none, nonsense; then rest, or a motion that goes on already."""
    roll, pitch, yaw = hand(31, smooth(T, begins, 2) if begins else np.ones_like(T))
    motion = carried(T, roll=roll, pitch=pitch, yaw=yaw)
    readings = consumer(motion)
    readings["accel"][0] = first
    error, _ = tilt_of(motion, readings)
    assert error[200:].max() < 3
    assert error[1000:].max() < 1


@pytest.mark.parametrize("seed", range(6))
def test_a_start_in_motion_is_as_good_as_one_at_rest_after_ten_seconds(seed: int) -> None:
    motion = moving(40 + seed, 30, speed=0.5)
    late = {name: values[100:] for name, values in consumer(motion).items()}
    error, result = tilt_of(part_of(motion, slice(100, None)), late)
    assert error[1000:].max() < 2.5
    assert np.mean(error < 3 * np.rad2deg(result["tilt_std"])) > 0.95  # and it knows


def test_the_start_on_a_moored_ship_does_not_carry_it_away() -> None:
    """Sway of 0.4 m/s2 is 2.3 deg; a filter that takes a crest for rest goes astray by tens of degrees."""
    w = 2 * np.pi / 12
    sway, heave = 0.4 * np.sin(w * T + 1), 0.5 * np.sin(w * T + 2)
    motion = carried(T, roll=0.02 * np.sin(w * T), acceleration=(0.0, sway, heave))
    error, result = tilt_of(motion, consumer(motion))
    assert error.max() < 3.2
    assert error[3000:].max() < 1.5
    assert not result["stationary"].any()


def test_a_start_in_a_bend_is_overcome_on_the_straight() -> None:
    """2 m/s2 to one side for 30 s are 11.5 deg of tilt to whoever has never been at rest."""
    rate = 0.2 * (1 - smooth(T, 30, 2))
    yaw = np.cumsum(rate) * 0.01
    motion = carried(T, yaw=yaw, acceleration=(-10 * rate * np.sin(yaw), 10 * rate * np.cos(yaw), 0.0))
    error, result = tilt_of(motion, consumer(motion))
    assert error.max() < 13
    assert error[4500:].max() < 2
    assert np.mean(error < 3 * np.rad2deg(result["tilt_std"])) > 0.9


def test_a_start_on_a_slider_is_no_rest() -> None:
    motion = carried(T, acceleration=(1.5 * np.sin(2 * np.pi * 0.4 * T), 0.0, 0.0))
    error, result = tilt_of(motion, consumer(motion))
    assert error[500:].max() < 2
    assert not result["stationary"].any()


def test_the_shortest_turn_to_the_top() -> None:
    vectors = np.random.default_rng(50).normal(0, 1, (100, 3))
    vectors = np.vstack([vectors, [[0, 0, 2], [0, 0, -2], [1e-9, 0, -1]]])
    turns = over_rows(to_the_top, vectors)
    tops = Rotation.from_rotvec(turns).apply(vectors)
    assert np.allclose(tops[:, :2], 0, atol=1e-8) and np.all(tops[:, 2] > 0)  # 1e-9 rad off straight down is rounding
    assert np.all(turns[:, 2] == 0)
    assert np.linalg.norm(turns, axis=1).max() <= math.pi + 1e-12
