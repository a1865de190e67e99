"""Claims about fmi2GetDirectionalDerivative of native FMUs."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from imufmu.blocks.block import SampledBlock
from imufmu.fmi.native import block_called
from imufmu.registry import BLOCKS
from support.fmu import refusal
from support.native_fmus import derivative, enter, leave, native

WITH_INPUTS = [*(name for name, block in BLOCKS.items() if block.inputs), "imu+lee2012"]
# Of plumb, the sixth sample takes a slow step and the seventh starts from what that has changed.
SLOW_STEPS = [("plumb", 6), ("plumb", 7)]


@pytest.mark.parametrize(("name", "steps"), [*product(WITH_INPUTS, (0, 1, 5)), *SLOW_STEPS])
def test_directional_derivatives_are_those_of_repeating_the_last_step_with_other_inputs(name: str, steps: int) -> None:
    """Of every output along a random direction of inputs, against the central difference."""
    rng, block = np.random.default_rng(9), block_called(name)
    instance = native(name)
    by_causality = {c: [v for v in instance.model.modelVariables if v.causality == c] for c in ("input", "output")}
    inputs, outputs = ([v.valueReference for v in by_causality[c]] for c in ("input", "output"))
    start = block.start_vector(block.inputs) + rng.uniform(0.1, 0.5, len(inputs))
    direction = rng.uniform(-1.0, 1.0, len(inputs))

    # A sampled block answers for its last sample, a plant for the inputs at its time: set after the last step.
    changes_before = max(steps - 1, 0) if isinstance(block, SampledBlock) else steps

    def after(change: float) -> np.ndarray:
        """Outputs after all steps, the last inputs changed; without a step, those of the initialisation mode."""
        instance.slave.reset()
        enter(instance)
        instance.slave.setReal(inputs, list(start))
        if steps:
            leave(instance)
        for k in range(steps + 1):
            if k == changes_before:
                instance.slave.setReal(inputs, list(start + change * direction))
            if k < steps:
                instance.step(0.01 * k, 0.01)
        return np.array(instance.slave.getReal(outputs))

    eps = 1e-5
    difference = (after(eps) - after(-eps)) / (2 * eps)
    after(0.0)
    actual = np.array(instance.slave.getDirectionalDerivative(outputs, inputs, list(direction)))
    # Rounding of 1e-16 / eps, and a truncation of eps^2: both 1e-10, times what outputs of the size 100 amplify.
    np.testing.assert_allclose(actual, difference, rtol=1e-6, atol=1e-6)
    # A first sample may depend on parameters alone; a car feels its controls by their lags only.
    # What is told late hangs on nothing of now.
    is_late = isinstance(block, SampledBlock) and block.delayed_by
    assert steps < 2 or name == "vehicle" or is_late or np.any(actual != 0)
    instance.slave.freeInstance()


def test_the_derivative_of_a_sampled_block_is_at_the_inputs_of_its_last_sample() -> None:
    instance = native().initialise()
    for k in range(3):
        instance.set({"gyro[1]": 0.3, "accel[2]": 2.0})
        instance.step(0.01 * k, 0.01)
    before = derivative(instance, "roll", "accel[3]")
    instance.set({"gyro[1]": -5.0, "accel[2]": -8.0})  # for the next sample
    assert derivative(instance, "roll", "accel[3]") == before != 0
    instance.close()


def test_the_inputs_of_the_last_sample_are_no_older_ones() -> None:
    """An instance that had them from its initialisation on answers alike."""
    readings, answers = {"gyro[1]": 0.3, "accel[2]": 2.0}, []
    for from_the_start in (True, False):
        instance = native()
        enter(instance)
        instance.set(readings if from_the_start else {})
        leave(instance)
        instance.set(readings)
        for k in range(3):
            instance.step(0.01 * k, 0.01)
        answers.append(derivative(instance, "roll", "accel[3]"))
        instance.close()
    assert answers[0] == answers[1] != 0


def test_an_input_that_is_named_twice_changes_by_the_sum() -> None:
    instance = native().initialise()
    instance.step(0.0, 0.01)
    roll, accel = ([instance.variables[name].valueReference] for name in ("roll", "accel[2]"))
    twice = instance.slave.getDirectionalDerivative(roll, accel * 2, [0.25, 0.5])
    assert twice == instance.slave.getDirectionalDerivative(roll, accel, [0.75]) != [0.0]
    instance.close()


def test_derivatives_are_of_outputs_with_respect_to_inputs_only() -> None:
    instance = native().initialise()
    assert "innovation[1] is not an output" in refusal(
        instance, lambda: derivative(instance, "innovation[1]", "gyro[1]")
    )
    assert "g is not an input" in refusal(instance, lambda: derivative(instance, "roll", "g"))
    assert derivative(instance, "sample_time", "gyro[1]") == 0.0
    instance.close()
