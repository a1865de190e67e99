"""Claims about a record that is known as a whole."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
import pytest

import imufmu
from imufmu.blocks.running import input_rows
from imufmu.blocks.vocabulary import Status
from imufmu.compiled import smoothing
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
    assert rms(errors[1][:1000]) < 0.5
    assert rms(errors[1][1000:]) < 0.8 * rms(errors[0][1000:])
    assert np.all(whole["tilt_std"] <= causal["tilt_std"])
    assert np.all(errors[1] < 3 * np.rad2deg(whole["tilt_std"]))
    assert rms(errors[1][-10:]) == pytest.approx(rms(errors[0][-10:]), rel=0.2)  # the end has no future


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


def test_an_estimator_without_a_smoother_runs_in_both_directions() -> None:
    motion = moving(63, 20, rest=2.0).noisy(np.random.default_rng(0), 0.05)
    readings = {"gyro": motion.gyro, "accel": motion.accel}
    block, settings = BLOCKS["lee2012"], {"sample_period": motion.dt, "gyro_index": 1}
    causal, whole = run(block, readings, settings), run(block, readings, settings, offline=True)
    assert rms(angle(whole["vertical"], motion.vertical)) < rms(angle(causal["vertical"], motion.vertical))


def test_nothing_is_handed_back_beyond_a_restart(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two records in a row, the second of which begins with the flag: as each alone."""
    settings, parts = {"sample_period": 0.01, "g": G}, []
    for seed in (64, 65):
        motion = moving(seed, 9)
        parts.append({"gyro": motion.gyro, "accel": motion.accel})
    alone = [run_offline(BLOCK, part, settings) for part in parts]
    portions, p = smoothing._portions, smoothing.RECORDING.parameter_vector(settings)

    def in_a_row(*_: object) -> Iterator[Mapping[str, np.ndarray]]:
        for restarted, part in enumerate(parts):
            for k, rows in enumerate(portions(input_rows(smoothing.RECORDING, part), p)):
                yield {**rows, "status": rows["status"] + Status.RESTARTED * (restarted and k == 0)}

    monkeypatch.setattr(smoothing, "_portions", in_a_row)
    both = run_offline(BLOCK, {name: np.vstack([part[name] for part in parts]) for name in parts[0]}, settings)
    for name in ("vertical", "tilt_std"):
        assert np.array_equal(both[name], np.concatenate([each[name] for each in alone])), name


def test_an_initial_state_does_not_go_with_offline() -> None:
    with pytest.raises(ValueError, match="initial_state does not go with offline"):
        run(BLOCK, {"gyro": np.zeros((5, 3))}, initial_state={"P": 0}, offline=True)


def test_both_directions_count_alike_and_their_information_adds_up() -> None:
    block, motion = BLOCKS["lee2012"], moving(62, 20, speed=0.5)
    readings, settings = consumer(motion), {"sample_period": motion.dt, "g": G, "gyro_index": 2}
    turned = {name: _backward(name, rows, (3,), 0) for name, rows in readings.items()}
    whole, back = (run_offline(block, record, settings) for record in (readings, turned))
    for name in ("vertical", "tilt_std"):
        np.testing.assert_allclose(back[name][::-1], whole[name], rtol=0, atol=1e-13)  # sums in another order
    stds = run(block, readings, settings)["tilt_std"], run(block, turned, settings)["tilt_std"][::-1]
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
