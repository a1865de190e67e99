"""Claims about a record that is known as a whole."""

from __future__ import annotations

import numpy as np
import pytest

import imufmu
from imufmu.compiled.offline import run_offline
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


def test_the_rates_belong_to_the_same_turns_in_both_directions() -> None:
    """One sample off would be 0.6 deg at 1 rad/s."""
    motion = moving(61, 20, speed=0.0, rest=3.0)
    readings = {"gyro": motion.gyro, "accel": motion.accel}
    settings = {"sample_period": motion.dt, "g": G, "gyro_index": 1}
    whole = run_offline(BLOCK, readings, settings)
    assert np.rad2deg(angle(whole["vertical"], motion.vertical)).max() < 0.05
    assert np.allclose(np.sin(whole["pitch"]), -whole["vertical"][:, 0], rtol=0, atol=1e-12)


def test_a_block_that_tells_no_uncertainty_is_refused() -> None:
    with pytest.raises(
        ValueError, match=r"imu has no gyro_index, tilt_std, vertical: it cannot run in both directions"
    ):
        imufmu.run_offline(BLOCKS["imu"], {"angular_velocity": np.zeros((5, 3))})
