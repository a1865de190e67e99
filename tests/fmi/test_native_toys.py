"""Native FMUs of small blocks that show all that the generated C and its wrapper hand to a block, and take from it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
import pytest

from imufmu.blocks.block import Block, ContinuousBlock
from imufmu.blocks.instance import instantiate
from imufmu.registry import BLOCKS
from support import fmu
from support.fmu import refusal
from support.native_fmus import native, unpacked_toy
from support.optional import needs
from support.toys import LAZY, MIRROR, OSCILLATOR

pytestmark = needs("a C compiler")

TOYS = pytest.mark.parametrize("block", [MIRROR, LAZY, OSCILLATOR], ids=lambda block: block.name)
STEPS = 40
H = (0.01, 0.01, 0.034, 0.004, 0.012, 0.01)  # s, in turn: no sample, one, and several in a step


@pytest.fixture
def started(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[Block], fmu.Fmu]:
    """A new instance of a toy's native FMU, which is compiled once for the test."""

    def start(block: Block) -> fmu.Fmu:
        monkeypatch.setitem(BLOCKS, block.name, block)
        return native(block.name, folder=unpacked_toy(block, tmp_path)).initialise(settings(block), start_time=3.0)

    return start


def settings(block: Block) -> dict[str, float]:
    return {"seed": 5} if block.normals else {}


def inputs(block: Block) -> np.ndarray:
    """Seeded, a row per step, some of them missing."""
    rng, width = np.random.default_rng(3), len(block.start_vector(block.inputs))
    rows = rng.normal(0, 1, (STEPS, width))
    if block is not OSCILLATOR:
        rows[rng.uniform(size=rows.shape) < 0.05] = np.nan
    return rows


@TOYS
def test_a_toy_gives_the_numbers_of_the_run_in_process_also_from_a_saved_state(
    block: Block, started: Callable[[Block], fmu.Fmu]
) -> None:
    """Bit for bit. Each step is taken by a new instance, which has nothing but the state."""
    expected = instantiate(block)
    expected.p[:] = block.parameter_vector(settings(block))
    expected.initialise(3.0)
    references = [v.name for v in block.variables if v.group == "input"]
    seen = [v.name for v in block.variables if v.group in ("output", "local")]
    first = started(block)
    assert np.array_equal(first.get(*seen), expected.y)  # of the inputs' start values
    saved, t = fmu.serialised(first), 3.0
    for k, row in enumerate(inputs(block)):
        h = H[k % len(H)]
        expected.u[:] = row
        expected.do_step(t, h)
        actual = started(block)
        fmu.restore(actual, saved)
        actual.set(dict(zip(references, row, strict=True)))
        actual.step(t, h)
        assert np.array_equal(actual.get(*seen), expected.y, equal_nan=True), k
        saved, t = fmu.serialised(actual), t + h
        actual.close()
    first.close()


@TOYS
def test_the_derivatives_of_a_toy_are_those_of_its_last_sample(
    block: Block, started: Callable[[Block], fmu.Fmu]
) -> None:
    """Outputs are linear in the inputs here, so the difference of two steps from one state is the derivative."""
    instance = started(block)
    variables = {group: [v.name for v in block.variables if v.group == group] for group in ("input", "output")}
    known, unknown = ([instance.variables[name].valueReference for name in variables[g]] for g in ("input", "output"))
    rows = np.nan_to_num(inputs(block))
    direction = np.random.default_rng(4).normal(0, 1, len(known)).tolist()
    for k in range(12):
        before, outcomes = fmu.serialised(instance), []
        for change in (1.0, 0.0):
            fmu.restore(instance, before)
            instance.slave.setReal(known, (rows[k] + change * np.array(direction)).tolist())
            instance.step(3.0 + 0.01 * k, 0.01)
            if block is OSCILLATOR:  # which answers for the inputs at its time, not for those of the step
                instance.slave.setReal(known, (rows[k] + change * np.array(direction)).tolist())
            outcomes.append(np.array(instance.get(*variables["output"])))
        actual = instance.slave.getDirectionalDerivative(unknown, known, direction)
        if block is OSCILLATOR:
            assert actual == [0.0, 0.0, *direction]
        else:
            # Sums of numbers of the size 1 to 40: 1e-13 after the subtraction.
            np.testing.assert_allclose(actual, outcomes[0] - outcomes[1], rtol=0, atol=1e-12)
    instance.close()


def broken(place: str) -> ContinuousBlock:
    """The oscillator, where a force above 1 leaves one number that is not finite: a state, the first or last output."""

    def number(where: str, u: SimpleNamespace) -> Any:
        return ca.sqrt(1 - u.force) if where == place else u.force

    return replace(
        OSCILLATOR,
        name=f"broken_{place}",
        dynamics=lambda x, u, p, t: dict(q=x.v, v=number("state", u)),
        output=lambda x, u, p, t: dict(position=number("first", u), velocity=t, force_seen=t, clock=number("last", u)),
    )


@pytest.mark.parametrize("place", ["state", "first", "last"])
def test_a_single_number_that_is_not_finite_is_enough_to_refuse_a_step(
    place: str, started: Callable[[Block], fmu.Fmu]
) -> None:
    block = broken(place)
    instance = started(block)
    instance.step(3.0, 0.01)
    before = fmu.serialised(instance)
    instance.set({"force": 2.0})
    assert "not finite at t = 3.02 s" in refusal(instance, lambda: instance.step(3.01, 0.01))
    instance.set({"force": 0.0})
    instance.get("clock")
    assert fmu.serialised(instance) == before
    instance.close()


def test_a_switch_next_to_the_results_is_no_real_number(started: Callable[[Block], fmu.Fmu]) -> None:
    instance = started(MIRROR)
    last = max((v for v in instance.model.modelVariables if v.causality == "parameter"), key=lambda v: v.valueReference)
    assert last.type != "Real"
    message = refusal(instance, lambda: instance.slave.getReal([last.valueReference]))
    assert message == f"mirror: {last.name} is {last.type}, not Real"
    instance.close()
