"""Claims about a record that is known as a whole."""

from __future__ import annotations

import numpy as np
import pytest

import imufmu
from imufmu.compiled.offline import _backward, run_offline
from imufmu.compiled.running import run
from imufmu.registry import BLOCKS
from support.motions import angle
from support.plumb_motions import BLOCK, G, consumer, moving, part_of, rms


@pytest.mark.parametrize("gyro_index", [1, 3])
def test_what_comes_later_tells_where_up_was_at_a_start_in_motion(gyro_index: int) -> None:
    motion = moving(60, 40, speed=0.5)
    late, readings = part_of(motion, slice(100, None)), {n: v[100:] for n, v in consumer(motion).items()}
    settings = {"sample_period": motion.dt, "g": G, "gyro_index": gyro_index}
    causal, whole = run(BLOCK, readings, settings), run_offline(BLOCK, readings, settings)
    errors = [np.rad2deg(angle(result["vertical"], late.vertical)) for result in (causal, whole)]
    assert rms(errors[0][:1000]) > 2
    assert rms(errors[1][:1000]) < 0.7
    assert rms(errors[1][1000:]) < 1.1 * rms(errors[0][1000:])
    assert np.all(whole["tilt_std"] < causal["tilt_std"])


# What a sensor writes into row k, from the rates of the turns that end there.
READS = {
    0: lambda rates: np.vstack([rates[1:], rates[-1:]]),  # the turn that begins there
    1: lambda rates: rates,
    2: lambda rates: (rates + np.vstack([rates[1:], rates[-1:]])) / 2,  # the rate of that instant
}


@pytest.mark.parametrize("gyro_index", READS)
def test_the_rates_belong_to_the_same_turns_in_both_directions(gyro_index: int) -> None:
    """One sample off would be 0.6 deg at 1 rad/s."""
    motion = moving(61, 20, speed=0.0, rest=3.0)
    readings = {"gyro": READS[gyro_index](motion.gyro), "accel": motion.accel}
    settings = {"sample_period": motion.dt, "g": G, "gyro_index": gyro_index}
    whole = run_offline(BLOCK, readings, settings)
    assert np.rad2deg(angle(whole["vertical"], motion.vertical)).max() < 0.05
    assert np.allclose(np.sin(whole["pitch"]), -whole["vertical"][:, 0], rtol=0, atol=1e-12)


def test_both_directions_count_alike_and_their_information_adds_up() -> None:
    motion = moving(62, 20, speed=0.5)
    readings, settings = consumer(motion), {"sample_period": motion.dt, "g": G, "gyro_index": 2}
    turned = {name: _backward(name, rows, (3,), 0) for name, rows in readings.items()}
    whole, back = (run_offline(BLOCK, record, settings) for record in (readings, turned))
    for name in ("vertical", "tilt_std"):
        np.testing.assert_allclose(back[name][::-1], whole[name], rtol=0, atol=1e-13)  # sums in another order
    stds = run(BLOCK, readings, settings)["tilt_std"], run(BLOCK, turned, settings)["tilt_std"][::-1]
    np.testing.assert_allclose(whole["tilt_std"] ** -2.0, sum(s**-2.0 for s in stds), rtol=1e-14)  # a power, rounded


def test_backward_rates_and_speeds_are_opposite_and_accelerations_alike() -> None:
    rows, axes = np.arange(6.0).reshape(2, 3), np.array([1.0, 2.0, 3.0])
    assert _backward("accel", rows, (3,), 0).tolist() == rows[::-1].tolist()
    assert _backward("accel", axes, (3,), 0).tolist() == axes.tolist()
    assert _backward("gyro", axes, (3,), 1).tolist() == (-axes).tolist()
    assert _backward("forward_speed", axes, (), 1).tolist() == [-3.0, -2.0, -1.0]
    assert _backward("forward_speed", 4.0, (), 1) == -4.0


def test_a_block_that_tells_no_uncertainty_is_refused() -> None:
    with pytest.raises(
        ValueError, match=r"imu has no gyro_index, tilt_std, vertical: it cannot run in both directions"
    ):
        imufmu.run_offline(BLOCKS["imu"], {"angular_velocity": np.zeros((5, 3))})
