"""Claims about plumb and wheels that do not tell the truth, or not at once."""

from __future__ import annotations

import numpy as np

from imufmu.blocks.running import Trajectory
from imufmu.compiled.running import run
from support.motions import Motion
from support.plumb_motions import BLOCK, DEFAULTS, G, carried, consumer, smooth, tilt_deg

DT = 0.01
T = np.arange(3000) * DT


def driven(motion: Motion, speed: np.ndarray, **parameters: float) -> Trajectory:
    readings = consumer(motion) | {"forward_speed": speed, "forward_speed_valid": np.ones(len(speed))}
    return run(BLOCK, readings, {"sample_period": DT, "g": G, "gyro_index": 1} | parameters)


def test_wheels_that_disagree_are_left_out_for_a_while_and_then_believed() -> None:
    """A car coasts at 10 m/s; from 10 s on its wheels tell another speed that no acceleration led to."""
    motion = carried(T)
    speed = np.where((T > 10) & (T < 12), 3.0, 10.0)
    result = driven(motion, speed)
    along = np.linalg.norm(result["velocity"], axis=1)
    assert along[1190] > 9
    spins = driven(motion, np.where(T > 10, 3.0, 10.0))
    along = np.linalg.norm(spins["velocity"], axis=1)
    assert along[1450] > 9  # t_f = 5 s
    assert along[1700] < 4


def test_a_vehicle_is_at_rest_only_where_its_wheels_stand() -> None:
    """An even ride at 1 m/s, as quiet as a table: no rest, until the wheels stop with it."""
    speed = np.where(T < 20, 1.0, 0.0)
    motion = carried(T, acceleration=(np.gradient(speed, DT), 0.0, 0.0))
    result = driven(motion, speed)
    assert not result["stationary"][T < 20].any()
    assert result["stationary"][T > 24].mean() > 0.9


def test_a_wheel_that_slips_sideways_in_a_bend_is_believed_less_there() -> None:
    """At 4 m/s2 to the side a car slips by a tenth of its speed: with k_l that tilts it by less than without."""
    speed, turn = np.full(len(T), 10.0), 0.4 * (smooth(T, 10, 2) - smooth(T, 22, 2))
    yaw = np.cumsum(turn) * DT
    course = yaw - 0.25 * turn  # the car points into the bend, and slides outwards
    velocity = 10 * np.column_stack([np.cos(course), np.sin(course), 0 * T])
    motion = carried(T, yaw=yaw, acceleration=tuple(np.gradient(velocity, DT, axis=0).T))
    careful, rash = (np.max(tilt_deg(motion, driven(motion, speed, k_l=k_l))) for k_l in (DEFAULTS["k_l"], 0.0))
    assert careful < 0.8 * rash


def test_the_bias_of_an_accelerometer_does_not_pass_for_a_bend() -> None:
    """0.3 m/s2 forward, in a car that drives round and round: with s_c the tilt that it leads to is told."""
    speed, turn = np.full(len(T), 10.0), 0.2 * smooth(T, 5, 2)
    yaw = np.cumsum(turn) * DT
    velocity = 10 * np.column_stack([np.cos(yaw), np.sin(yaw), 0 * T])
    motion = carried(T, yaw=yaw, acceleration=tuple(np.gradient(velocity, DT, axis=0).T))
    motion.accel[:, 0] += 0.3
    honest, proud = (driven(motion, speed, **p) for p in ({}, {"s_c": 0.0, "k_c": 0.0}))
    nees = [np.mean((np.radians(tilt_deg(motion, r)) / r["tilt_std"])[1500:] ** 2) for r in (honest, proud)]
    assert nees[0] < 0.5 * nees[1]
