"""Claims about running blocks on arrays: the same numbers on every path, convergence, clear input errors."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from imufmu.blocks.block import Block, ParameterError, SampledBlock
from imufmu.blocks.instance import ContinuousInstance, SampledInstance, StepError
from imufmu.blocks.running import Stream, Trajectory, run, simulate
from imufmu.estimators import lee2012
from support import motions
from support.toys import GAIN, LAZY, MIRROR, OSCILLATOR, eager, oscillator_position

AROUND_A_CHUNK = [1, 2, 1023, 1024, 1025, 1026, 2049]  # records are evaluated 1024 rows at a time


def record(block: SampledBlock, n: int) -> dict[str, np.ndarray]:
    """Seeded inputs, some of them missing."""
    rng = np.random.default_rng(n)
    inputs = {s.name: rng.normal(s.start_values(), 1, (n, s.size)) for s in block.inputs}
    for values in inputs.values():
        values[rng.uniform(size=n) < 0.05, 0] = math.nan
    return {s.name: inputs[s.name].reshape(n, *s.shape) for s in block.inputs}


def flat(block: Block, result: Trajectory) -> np.ndarray:
    """All reported signals, (n, elements)."""
    return np.hstack([result[s.name].reshape(len(result.time), -1) for s in block.reported])


# Sampled blocks


@pytest.mark.parametrize("n", AROUND_A_CHUNK)
@pytest.mark.parametrize("block", [MIRROR, LAZY, lee2012.BLOCK], ids=lambda b: b.name)
def test_a_record_a_stream_and_an_instance_agree_bit_for_bit(block: SampledBlock, n: int) -> None:
    inputs, parameters = record(block, n), {"sample_period": 0.02} | ({"seed": 5} if block.normals else {})
    whole = run(block, inputs, parameters, start_time=3.0)

    stream, streamed = Stream(block, parameters, start_time=3.0), []
    instance, stepped = SampledInstance(block), []
    instance.p[:] = block.parameter_vector(parameters)
    instance.initialise(3.0)
    for k in range(n):
        out = stream.update(**{name: values[k] for name, values in inputs.items()})
        streamed.append(np.hstack([np.ravel(out[s.name]) for s in block.reported]))
        assert out["sample_time"] == whole.time[k]
        instance.u[:] = np.hstack([np.ravel(values[k]) for values in inputs.values()])
        instance.do_step(3.0 + k * 0.02, 0.02)
        stepped.append(instance.y.copy())
    assert np.array_equal(flat(block, whole), streamed)
    assert np.array_equal(flat(block, whole), stepped)


def test_a_slow_step_that_is_skipped_equals_one_that_is_never_due() -> None:
    inputs = record(LAZY, 100)
    lazy = run(LAZY, inputs)
    assert np.array_equal(flat(LAZY, lazy), flat(LAZY, run(eager(LAZY), inputs)))
    # The first sample counts but is not stepped to: slow step 1 is due at rows 2, 5, 8, ..., 2 at 4, ...
    due = [row for row in range(2, 100) if row % 3 == 2 or row % 5 == 4]
    assert np.array_equal(np.flatnonzero(np.diff(lazy["product"][:, 0, 0])) + 1, due)
    assert np.array_equal(lazy["sum"] == 0, np.arange(100) % 3 == 2)


def test_results_have_the_declared_shapes_and_instants() -> None:
    result = run(MIRROR, {"scalar": np.zeros(3)}, {"sample_period": 0.5}, start_time=-1.0)
    assert np.array_equal(result.time, [-1.0, -0.5, 0.0])
    assert (result["sum"].shape, result["vector_seen"].shape, result["product"].shape) == ((3,), (3, 3), (3, 2, 3))
    out = Stream(MIRROR).update(scalar=1.0)
    assert (np.shape(out["sum"]), out["vector_seen"].shape, out["product"].shape) == ((), (3,), (2, 3))


def test_inputs_left_out_stay_at_their_start_and_single_values_are_held() -> None:
    seen = run(MIRROR, {"scalar": np.ones(4), "matrix": 2 * np.ones((2, 3))})
    assert np.array_equal(seen["vector_seen"], np.tile([0.1, 0.2, 0.3], (4, 1)))
    assert np.array_equal(seen["matrix_seen"], np.full((4, 2, 3), 2.0))


@pytest.mark.parametrize("n", [1, 2, 3])
def test_a_single_vector_never_counts_as_a_record(n: int) -> None:
    seen = run(MIRROR, {"vector": [7, 8, 9], "matrix": np.zeros((n, 2, 3))})
    assert np.array_equal(seen["vector_seen"], np.tile([7, 8, 9], (n, 1)))


def test_a_given_state_replaces_that_of_the_first_sample() -> None:
    inputs = {"scalar": np.array([1.0, 2.0, 3.0]), "vector": np.array([[math.nan, 0, 0]] * 3)}
    given = run(MIRROR, inputs, initial_state={"sum": 100.0, "product": np.ones((2, 3))})
    assert np.array_equal(given["sum"], [100, 102, 105])
    assert np.array_equal(given["samples"], [1, 2, 3])
    assert np.array_equal(given["product"], np.ones((3, 2, 3)))
    default = run(MIRROR, inputs, initial_state={"product": GAIN})
    assert np.array_equal(flat(MIRROR, default), flat(MIRROR, run(MIRROR, inputs)))


@pytest.mark.parametrize(
    ("inputs", "complaint"),
    [
        ({}, "mirror: no samples given"),
        ({"vector": [1, 2, 3]}, "mirror: no samples given"),
        ({"vector": np.zeros((0, 3))}, "mirror: no samples given"),
        ({"speed": [1, 2]}, "mirror has no input speed; it has vector, scalar, matrix"),
        ({"vector": np.zeros((4, 2))}, r"vector: shape \(4, 2\), expected \(4, 3\)"),
        ({"vector": np.zeros((3, 4))}, r"vector: shape \(3, 4\), expected \(3, 3\)"),
        ({"vector": np.zeros((4, 3)), "scalar": np.zeros(5)}, r"vector: shape \(4, 3\), expected \(5, 3\)"),
        ({"vector": np.zeros((1, 3)), "scalar": np.zeros(5)}, r"vector: shape \(1, 3\), expected \(5, 3\)"),
        ({"vector": 4.0, "scalar": np.zeros(5)}, r"vector: shape \(\), expected \(5, 3\)"),
        ({"scalar": ["a", "b"]}, "scalar: not an array of numbers"),
        ({"vector": [[1, 2, 3], [1, 2]]}, "vector: not an array of numbers, or its rows differ in length"),
    ],
)
def test_a_record_that_does_not_fit_is_refused_by_name(inputs: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        run(MIRROR, inputs)


@pytest.mark.parametrize(
    ("state", "complaint"),
    [
        ({"speed": 1}, "no state speed; there is samples, sum, product"),
        ({"product": [1, 2]}, "state product: 2 values, expected 6"),
        ({"sum": "a"}, "sum: not an array of numbers"),
    ],
)
def test_an_initial_state_that_does_not_fit_is_refused_by_name(state: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        run(MIRROR, {"scalar": [1.0]}, initial_state=state)


@pytest.mark.parametrize(
    ("inputs", "complaint"),
    [
        ({"speed": 1}, "mirror has no input 'speed'; it has vector, scalar, matrix"),
        ({"vector": [1, 2]}, "vector: 2 values, expected 3"),
        ({"vector": None}, "vector: 1 values, expected 3"),
        ({"scalar": "a"}, "scalar: not an array of numbers"),
    ],
)
def test_a_stream_refuses_wrong_inputs_without_taking_a_sample(inputs: dict[str, Any], complaint: str) -> None:
    stream = Stream(MIRROR)
    with pytest.raises(ValueError, match=complaint):
        stream.update(**inputs)
    assert stream.update(scalar=1.0)["samples"] == 1


def test_a_stream_keeps_inputs_that_are_not_given() -> None:
    stream = Stream(MIRROR)
    stream.update(vector=(7, 8, 9), scalar=2.0)
    assert np.array_equal(stream.update()["vector_seen"], [7, 8, 9])
    assert stream.update()["sum"] == 6.0


def test_a_result_does_not_change_when_its_stream_goes_on() -> None:
    stream = Stream(MIRROR)
    first = stream.update(vector=(1, 2, 3))
    stream.update(vector=(4, 5, 6))
    assert np.array_equal(first["vector_seen"], [1, 2, 3])


@pytest.mark.parametrize("start", [lambda p: run(MIRROR, {"scalar": [1.0]}, p), lambda p: Stream(MIRROR, p)])
def test_wrong_parameters_are_refused_before_anything_runs(start: Any) -> None:
    with pytest.raises(ParameterError, match=r"mirror: mode = 9 is outside \[1, 3\]"):
        start({"mode": 9})


def test_the_caller_keeps_its_arrays() -> None:
    motion = motions.motion(np.random.default_rng(0), 50)
    gyro, accel = motion.gyro.copy(), motion.accel.copy()
    run(lee2012.BLOCK, {"gyro": motion.gyro, "accel": motion.accel})
    assert np.array_equal(gyro, motion.gyro)
    assert np.array_equal(accel, motion.accel)


# Continuous blocks


@pytest.mark.parametrize(
    ("n", "substeps"), [(1, 10), (102, 10), (103, 10), (205, 10), (1023, 1), (1024, 1), (1025, 1), (2, 1500)]
)
def test_a_simulation_and_an_instance_agree_bit_for_bit(n: int, substeps: int) -> None:
    step, force = 0.01, np.random.default_rng(n).normal(size=n + 1)
    force[::7] = math.nan
    parameters = {"w": 3.0, "max_step": step / substeps}
    whole = simulate(OSCILLATOR, n * step, step, {"force": force}, parameters, start_time=2.0)

    instance = ContinuousInstance(OSCILLATOR)
    instance.p[:] = OSCILLATOR.parameter_vector(parameters)
    instance.u[:] = force[0]
    instance.initialise(2.0)
    stepped = [instance.y.copy()]
    for i in range(n):
        instance.do_step(2.0 + i * step, step)
        instance.u[:] = force[i + 1]
        instance.refresh()
        stepped.append(instance.y.copy())
    rows = flat(OSCILLATOR, whole)
    assert np.array_equal(rows[:, :3], np.array(stepped)[:, :3])
    # t + h on one side, (i + 1) h on the other.
    assert np.allclose(rows[:, 3], np.array(stepped)[:, 3], rtol=1e-15, atol=0)


def test_a_simulation_follows_the_closed_form() -> None:
    result = simulate(OSCILLATOR, 5.0, 0.1, {"force": 3.0}, {"w": 3.0})
    assert result.time == pytest.approx(np.linspace(0, 5, 51))
    # RK4 at 1 ms: (w h)^4 / 120 per unit of w t.
    assert np.allclose(result["position"], oscillator_position(result.time, 3.0, 3.0), rtol=0, atol=1e-11)


def test_the_solver_converges_with_order_4() -> None:
    errors = []
    for max_step in (0.1, 0.05, 0.025):
        result = simulate(OSCILLATOR, 4.0, 0.2, {"force": 1.0}, {"max_step": max_step})
        errors.append(np.abs(result["position"] - oscillator_position(result.time, 2.0, 1.0)).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    # The next term of the error shifts the measured order by a few hundredths at w h = 0.2.
    assert orders == pytest.approx([4, 4], abs=0.1)


def test_time_dependence_starts_at_the_start_time() -> None:
    late = simulate(OSCILLATOR, 1.0, 0.5, start_time=math.pi)
    assert np.array_equal(late.time, math.pi + np.array([0, 0.5, 1.0]))
    # cos(t + pi) = -cos(t): the drive is reversed, so both runs add up to twice the free oscillation.
    together = late["position"] + simulate(OSCILLATOR, 1.0, 0.5)["position"]
    assert np.allclose(together, 2 * np.cos(2.0 * np.array([0, 0.5, 1.0])), rtol=0, atol=1e-11)


@pytest.mark.parametrize(
    ("duration", "step"),
    [(1.0, 0.0), (1.0, -0.1), (-1.0, -0.1), (0.0, 0.1), (0.04, 0.1), (math.nan, 0.1), (math.inf, 0.1), (1.0, math.inf)],
)
def test_an_impossible_duration_or_step_is_refused(duration: float, step: float) -> None:
    with pytest.raises(ValueError, match="must be finite and at least one step"):
        simulate(OSCILLATOR, duration, step)


def test_a_row_of_more_solver_steps_than_one_can_wait_for_is_refused() -> None:
    with pytest.raises(ValueError, match=r"oscillator: a step of 2000\.0 s is more than 1e\+06 internal"):
        simulate(OSCILLATOR, 4000.0, 2000.0)


def test_a_simulation_that_diverges_is_refused() -> None:
    """No row after the last finite one: 100 rad/s at 1 s a step is far outside the stability of RK4."""
    with pytest.raises(StepError, match=r"oscillator: not finite at t = .* s; the solver needs a max_step below 1 s"):
        simulate(OSCILLATOR, 100.0, 1.0, parameters={"w": 100.0, "max_step": 1.0})


def test_a_simulation_refuses_inputs_that_do_not_fit() -> None:
    with pytest.raises(ValueError, match=r"force: shape \(10,\), expected \(11,\)"):
        simulate(OSCILLATOR, 1.0, 0.1, {"force": np.zeros(10)})
    with pytest.raises(ValueError, match="oscillator has no input torque; it has force"):
        simulate(OSCILLATOR, 1.0, 0.1, {"torque": 0.0})
    with pytest.raises(ParameterError, match=r"oscillator: w = 0 rad/s is outside"):
        simulate(OSCILLATOR, 1.0, 0.1, parameters={"w": 0})


def test_a_trajectory_is_shown_in_one_short_line() -> None:
    assert repr(Trajectory(np.arange(3.0), {"roll": np.zeros(3), "P": np.zeros((3, 3, 3))})) == (
        "<Trajectory of 3 rows: roll, P>"
    )
