"""The sample clock far from time zero: at 1.7e9 s, a date in seconds since 1970, doubles are 0.24 us apart."""

from __future__ import annotations

import numpy as np
import pytest

from imufmu.blocks.instance import SampledInstance, StepError
from support.toys import MIRROR

EPOCHS = [1.7e9, -1.7e9, 1e12, 86400.0]
PERIODS = [0.01, 0.005, 1 / 285.7, 1 / 120, 1e-3]


def mirror(start: float, period: float) -> SampledInstance:
    instance = SampledInstance(MIRROR)
    instance.p[:] = MIRROR.parameter_vector({"sample_period": period})
    instance.initialise(start)
    return instance


@pytest.mark.parametrize("period", PERIODS)
@pytest.mark.parametrize("start", EPOCHS)
def test_a_master_that_counts_its_steps_takes_one_sample_in_each(start: float, period: float) -> None:
    instance = mirror(start, period)
    for k in range(3000):
        instance.do_step(start + k * period, period)
        assert (instance.next_sample, instance.sample_time) == (k + 1, start + k * period)


@pytest.mark.parametrize("period", PERIODS)
@pytest.mark.parametrize("start", EPOCHS)
def test_a_master_that_adds_up_its_time_takes_one_sample_in_each_step(start: float, period: float) -> None:
    """Its time drifts away from the sum of its steps by up to half a spacing of doubles at every step."""
    instance, t = mirror(start, period), start
    for k in range(3000):
        instance.do_step(t, period)
        t += period
        assert instance.next_sample == k + 1


@pytest.mark.parametrize("start", EPOCHS)
@pytest.mark.parametrize("ratio", [0.1, 1 / 3, 3.0, 7.0, 10.0])
def test_steps_of_any_length_take_the_samples_of_a_start_at_zero(start: float, ratio: float) -> None:
    early, late = mirror(0.0, 0.01), mirror(start, 0.01)
    for k in range(1000):
        early.do_step(k * ratio * 0.01, ratio * 0.01)
        late.do_step(start + k * ratio * 0.01, ratio * 0.01)
        assert late.next_sample == early.next_sample


def test_steps_of_random_length_take_the_samples_of_a_start_at_zero(rng: np.random.Generator) -> None:
    early, late, start = mirror(0.0, 0.01), mirror(1.7e9, 0.01), 1.7e9
    ends = np.cumsum(rng.uniform(0.001, 0.03, 3000))
    for t, end in zip(np.append(0.0, ends[:-1]), ends, strict=True):
        early.do_step(t, end - t)
        late.do_step(start + t, end - t)
        assert late.next_sample == early.next_sample


def test_a_step_repeated_or_left_out_finds_its_instant_again() -> None:
    start = 1.7e9
    instance = mirror(start, 0.01)
    instance.do_step(start, 0.05)
    for t in (start, start + 0.02, start + 0.04):  # nothing new in these
        instance.do_step(t, 0.01)
        assert instance.next_sample == 5
    instance.do_step(start + 0.05, 0.01)
    assert instance.next_sample == 6
    instance.do_step(start + 1.23, 0.01)  # takes the instants up to there, too: 0 to 123
    assert instance.next_sample == 124
    for k in range(124, 300):
        instance.do_step(start + 0.01 * k, 0.01)
        assert instance.next_sample == k + 1


def test_a_first_step_behind_the_start_takes_every_instant_up_to_it() -> None:
    for start in (-1.0, 1.7e9):
        instance = mirror(start, 0.01)
        instance.do_step(start + 1.0, 0.01)
        assert instance.next_sample == 101


def test_a_refused_step_does_not_move_the_clock() -> None:
    start = 1.7e9
    instance = mirror(start, 0.01)
    instance.do_step(start, 0.01)
    before = instance.get_state()
    with pytest.raises(StepError, match="samples away"):
        instance.do_step(0.0, 0.01)
    assert instance.get_state() == before
    instance.do_step(start + 0.01, 0.01)
    assert instance.next_sample == 2
