"""Claims about a block at work: sample clock, solver, rollback, isolation, refusals."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest

from imufmu.blocks.block import ParameterError, SampledBlock
from imufmu.blocks.instance import (
    LONGEST_STEP,
    ContinuousInstance,
    Instance,
    SampledInstance,
    StepError,
    instantiate,
    solver_steps,
)
from imufmu.blocks.noise import standard_normal, uniforms
from imufmu.blocks.rotations import over_rows
from support.toys import MIRROR, OSCILLATOR, oscillator_position

PLACES = {v.name: v for v in MIRROR.variables}


def mirror(start_time: float = 0.0, **parameters: Any) -> SampledInstance:
    instance = SampledInstance(MIRROR)
    instance.p[:] = MIRROR.parameter_vector(parameters)
    instance.initialise(start_time)
    return instance


def oscillator(**parameters: Any) -> ContinuousInstance:
    instance = ContinuousInstance(OSCILLATOR)
    instance.p[:] = OSCILLATOR.parameter_vector(parameters)
    instance.initialise(0.0)
    return instance


def reported(instance: SampledInstance, name: str) -> float:
    return float(instance.y[PLACES[name].index])


def feed(instance: SampledInstance, name: str, value: float) -> None:
    instance.u[PLACES[name].index] = value


# Sample clock


def assert_every_instant_once(steps: list[float], period: float, start: float) -> None:
    """Each step takes the instants it contains, all with the inputs of that step, and none is left out or doubled."""
    instance = mirror(start, sample_period=period)
    slack = 1.1e-6 * period  # the clock's own tolerance of 1e-6, and rounding
    t, before, total = start, 0, 0.0
    for i, h in enumerate(steps):
        feed(instance, "scalar", i + 1.0)
        instance.do_step(t, h)
        t = math.fsum([start, *steps[: i + 1]])
        taken, total_before = instance.next_sample, total
        total = reported(instance, "sum") if taken else 0.0
        assert taken >= before
        if taken > before:
            assert reported(instance, "samples") == taken
            assert total - total_before == (taken - before) * (i + 1)
            assert start + (taken - 1) * period < t + slack
            assert instance.sample_time == start + (taken - 1) * period
        assert start + taken * period > t - slack
        before = taken
    assert before > 0


@pytest.mark.parametrize("start", [0.0, 123.456, -7.7])
@pytest.mark.parametrize("ratio", [1.0, 10.0, 0.1, 3.0, 1 / 3, 0.7, math.pi])
def test_equal_steps_of_any_length_take_every_instant_once(ratio: float, start: float) -> None:
    assert_every_instant_once([0.01 * ratio] * 300, 0.01, start)


@pytest.mark.parametrize("period", [0.01, 0.0123456789, 1 / 3, 1e-6, 1e3])
def test_jittering_steps_take_every_instant_once(period: float, rng: np.random.Generator) -> None:
    assert_every_instant_once(list(period * rng.uniform(0.05, 3, 300)), period, start=17.0)


@pytest.mark.parametrize("ratio", [1e-7, 1e-6, 1e-4])
def test_a_trembling_master_takes_every_instant_once(ratio: float, rng: np.random.Generator) -> None:
    """Communication points that miss the instants by less, as much, and more than the clock tolerates."""
    points = 0.01 * (np.arange(1, 400) + ratio * rng.uniform(-1, 1, 399))
    assert_every_instant_once(list(np.diff([0.0, *points])), 0.01, start=0.0)


def test_adding_up_the_time_takes_one_sample_per_step() -> None:
    """100 000 steps of t += h: the accumulated rounding, 1e-9 s, must not cost or double a sample."""
    instance, t = mirror(), 0.0
    taken = []
    for _ in range(100_000):
        instance.do_step(t, 0.01)
        taken.append(instance.next_sample)
        t += 0.01
    assert t != 1000.0  # else this shows nothing
    assert taken == list(range(1, 100_001))


def test_a_step_ends_before_the_instant_at_its_end() -> None:
    instance = mirror()
    instance.do_step(0.0, 0.01)
    assert (instance.next_sample, instance.sample_time) == (1, 0.0)
    instance.do_step(0.01, 0.01)
    assert (instance.next_sample, instance.sample_time) == (2, 0.01)


def test_outputs_hold_between_samples() -> None:
    instance = mirror()
    instance.do_step(0.0, 0.002)
    held = instance.y.copy()
    feed(instance, "scalar", 5.0)
    for i in range(1, 5):
        instance.do_step(0.002 * i, 0.002)
        assert np.array_equal(instance.y, held)
    instance.do_step(0.01, 0.002)
    assert reported(instance, "sum") == 5.0


def test_a_step_repeated_takes_no_sample_twice() -> None:
    instance = mirror()
    for _ in range(2):
        instance.do_step(0.0, 0.05)
        assert instance.next_sample == 5


def test_outputs_before_the_first_sample_show_it_without_taking_it() -> None:
    """The initialisation phase of a co-simulation: inputs change, outputs follow, no sample is used up."""
    instance = mirror()
    for value in (3.0, 4.0):
        feed(instance, "scalar", value)
        instance.refresh()
        assert (reported(instance, "sum"), instance.next_sample) == (value, 0)
    instance.do_step(0.0, 0.01)
    assert (reported(instance, "sum"), reported(instance, "samples")) == (4.0, 1.0)
    held = instance.y.copy()
    feed(instance, "scalar", 9.0)
    instance.refresh()
    assert np.array_equal(instance.y, held)


def test_initialising_again_starts_anew() -> None:
    instance = mirror(seed=3)
    first = instance.y.copy()
    instance.do_step(0.0, 5.0)
    instance.initialise(0.0)
    assert np.array_equal(instance.y, first)
    instance.do_step(0.0, 0.01)
    assert np.array_equal(instance.y, first)


def test_draws_belong_to_their_sample() -> None:
    """Also across the chunks they are made in, and after a return to an earlier state."""
    instance, seen = mirror(seed=9), []
    saved = None
    for k in range(600):
        if k == 250:
            saved = instance.get_state()
        instance.do_step(0.01 * k, 0.01)
        seen.append([reported(instance, f"draws[{j}]") for j in (1, 2)])
    expected = over_rows(standard_normal, uniforms(9, 0, 600, 2))
    # CasADi runs the same expression alone and as part of the block's step.
    assert np.array_equal(seen, expected)
    assert saved is not None
    instance.set_state(saved)
    instance.do_step(2.5, 0.01)
    assert [reported(instance, f"draws[{j}]") for j in (1, 2)] == list(expected[250])


def test_a_tunable_parameter_acts_from_the_next_sample_on() -> None:
    instance = mirror()
    instance.do_step(0.0, 0.01)
    instance.p[PLACES["gain[1,1]"].index] = -3.0
    assert reported(instance, "gain_seen[1,1]") == 1.0
    instance.do_step(0.01, 0.01)
    assert reported(instance, "gain_seen[1,1]") == -3.0


# Refusals

IMPOSSIBLE = [
    (0.0, math.nan),
    (math.nan, 0.01),
    (0.0, math.inf),
    (math.inf, 0.01),
    (-math.inf, 0.01),
    (0.0, 0.0),
    (0.0, -0.01),
    (0.0, 1e300),
    (0.0, 1.01 * LONGEST_STEP * 0.01),
]


@pytest.mark.parametrize(("t", "h"), [*IMPOSSIBLE, (1e308, 0.01), (-1e308, 0.01), (1e300, 0.01)])
def test_an_impossible_step_of_a_sampled_block_is_refused_and_changes_nothing(t: float, h: float) -> None:
    instance = mirror()
    instance.do_step(0.0, 0.05)
    before = instance.get_state()
    with pytest.raises(StepError, match=r"^mirror: "):
        instance.do_step(t, h)
    assert instance.get_state() == before


@pytest.mark.parametrize(("t", "h"), IMPOSSIBLE)
def test_an_impossible_step_of_a_plant_is_refused_and_changes_nothing(t: float, h: float) -> None:
    instance = oscillator(max_step=0.01)
    instance.do_step(0.0, 0.05)
    before = instance.get_state()
    with pytest.raises(StepError, match=r"^oscillator: "):
        instance.do_step(t, h)
    assert instance.get_state() == before


def test_parameters_out_of_bounds_are_refused_with_name_value_and_range() -> None:
    instance = SampledInstance(MIRROR)
    instance.p[PLACES["mount[2]"].index] = 7.5
    instance.p[PLACES["mode"].index] = 1.5
    with pytest.raises(
        ParameterError, match=r"mirror: mount\[2\] = 7.5 rad is outside \[-3, 3\] rad; mode = 1.5 is not"
    ):
        instance.initialise(0.0)


@pytest.mark.parametrize("start", [math.nan, math.inf, -math.inf])
def test_a_start_time_that_is_no_time_is_refused(start: float) -> None:
    with pytest.raises(ParameterError, match=f"mirror: start time {start} is not a time"):
        SampledInstance(MIRROR).initialise(start)


def test_a_solution_that_diverges_is_refused_and_changes_nothing() -> None:
    """100 rad/s at 1 s a step is far outside the stability of RK4."""
    instance = oscillator(w=100.0, max_step=1.0)
    instance.do_step(0.0, 1.0)
    before = instance.get_state()
    with pytest.raises(StepError, match=r"oscillator: not finite at t = 101 s; the solver needs a max_step"):
        instance.do_step(1.0, 100.0)
    assert instance.get_state() == before


# State and isolation


def mirror_steps(instance: SampledInstance, first: int, last: int) -> list[np.ndarray]:
    """Jittering steps with inputs that are sometimes missing."""
    rows = []
    for i in range(first, last):
        rng = np.random.default_rng(i)
        instance.u[:] = rng.normal(size=instance.u.shape)
        if i % 3 == 0:
            instance.u[i % instance.u.size] = math.nan
        instance.do_step(0.013 * i, 0.013)
        rows.append(instance.y.copy())
    return rows


def test_a_sampled_block_rolled_back_equals_an_uninterrupted_run_bit_for_bit() -> None:
    instance = mirror(seed=4)
    mirror_steps(instance, 0, 40)
    saved = json.dumps(instance.get_state())
    uninterrupted = mirror_steps(instance, 40, 80)
    instance.set_state(json.loads(saved))
    again = mirror_steps(instance, 40, 80)
    other = mirror(start_time=99.0, seed=77, mode=2)
    other.do_step(99.0, 3.0)
    other.set_state(json.loads(saved))
    assert np.array_equal(again, uninterrupted)
    assert np.array_equal(mirror_steps(other, 40, 80), uninterrupted)
    assert other.get_state() == instance.get_state()


def test_a_plant_rolled_back_equals_an_uninterrupted_run_bit_for_bit() -> None:
    def steps(instance: ContinuousInstance, first: int, last: int) -> list[np.ndarray]:
        rows = []
        for i in range(first, last):
            instance.u[:] = math.nan if i % 5 == 0 else math.sin(i)
            instance.do_step(0.013 * i, 0.013)
            rows.append(instance.y.copy())
        return rows

    instance = oscillator()
    steps(instance, 0, 12)
    saved = json.dumps(instance.get_state())
    uninterrupted = steps(instance, 12, 30)
    other = oscillator(w=3.0)
    for again in (instance, other):
        again.set_state(json.loads(saved))
        assert again.time == 0.013 * 11 + 0.013
        assert np.array_equal(steps(again, 12, 30), uninterrupted)


def test_a_saved_state_does_not_follow_the_instance() -> None:
    instance = mirror()
    saved = instance.get_state()
    text = json.dumps(saved)
    instance.do_step(0.0, 1.0)
    assert json.dumps(saved) == text


def test_two_instances_share_nothing() -> None:
    a, b = mirror(seed=1), mirror(seed=2)
    alone = mirror(seed=1)
    for i in range(20):
        a.do_step(0.01 * i, 0.01)
        feed(b, "scalar", 100.0 + i)
        b.do_step(0.01 * i, 0.01)
        b.p[PLACES["gain[1,1]"].index] = -i / 10
        alone.do_step(0.01 * i, 0.01)
        assert np.array_equal(a.y, alone.y)
    assert a.get_state() == alone.get_state()
    assert not np.array_equal(a.y, b.y)


# Solver


@pytest.mark.parametrize(
    ("h", "max_step", "steps"),
    [(0.01, 0.001, 10), (0.1 * 3, 0.1, 3), (0.3, 0.1, 3), (0.01, 1.0, 1), (0.0101, 0.001, 11), (1e-9, 1e-3, 1)],
)
def test_solver_steps_are_the_fewest_that_respect_max_step(h: float, max_step: float, steps: int) -> None:
    assert solver_steps(h, max_step) == steps


def test_a_long_step_is_as_accurate_as_short_ones() -> None:
    long, short = oscillator(), oscillator()
    long.do_step(0.0, 2.0)
    for i in range(200):
        short.do_step(0.01 * i, 0.01)
    # RK4 at 1 ms and 2 rad/s: (w h)^4 / 120 a step; 1e-13 over 2 s.
    assert long.y[0] == pytest.approx(oscillator_position(np.array(2.0), 2.0, 0.0), abs=1e-11)
    assert short.y[0] == pytest.approx(long.y[0], abs=1e-12)


def test_outputs_of_a_plant_follow_inputs_between_steps() -> None:
    instance = oscillator()
    instance.do_step(0.0, 0.1)
    instance.u[:] = 4.0
    instance.refresh()
    position, _, force, clock = instance.y
    assert (force, clock) == (4.0, 0.1)
    assert position == pytest.approx(oscillator_position(np.array(0.1), 2.0, 0.0), abs=1e-11)


def test_every_kind_of_block_gets_its_instance() -> None:
    for block in (MIRROR, OSCILLATOR):
        instance: Instance = instantiate(block)
        assert isinstance(instance, SampledInstance if isinstance(block, SampledBlock) else ContinuousInstance)
        assert np.array_equal(instance.u, block.start_vector(block.inputs))
