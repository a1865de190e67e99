"""Times as devices and hosts write them: the rate is found, what was assumed is said, and nonsense is refused."""

from __future__ import annotations

import numpy as np
import pytest

from imufmu.recordings.sample_clock import ClockError
from imufmu.recordings.stamps import evenly, read_clock

K = np.arange(2000)


def spread(seed: int, rows: int, scale: float) -> np.ndarray:
    return np.random.default_rng(seed).exponential(scale, rows)


def test_a_clean_clock_is_left_alone_without_a_word():
    clock = read_clock(0.01 * K, None)
    assert clock.period == 0.01 and clock.notes == ()
    assert np.array_equal(clock.time, 0.01 * K) and np.array_equal(clock.index, K)


@pytest.mark.parametrize(
    ("stamps", "unit", "said"),
    [
        (10.0 * K, None, "milliseconds"),
        (1.7e12 + 10 * K, None, "milliseconds"),
        (10_000.0 * K, None, "microseconds"),
        (1e7 * K, None, "nanoseconds"),
        ((K // 7) * 70 + (K % 7) * 0.1, None, "milliseconds"),
        (10.0 * K, "ms", ""),
        (10_000.0 * K, "us", ""),
    ],
)
def test_the_unit_is_the_one_that_makes_a_believable_rate(stamps, unit, said):
    clock = read_clock(stamps, unit)
    assert clock.period == 0.01
    assert said in clock.notes[0] if said else clock.notes == ()


@pytest.mark.parametrize(
    "stamps",
    [
        (K // 2) * 0.02,  # both at once
        (K // 2) * 0.02 + (K % 2) * 0.001,  # 1 ms apart every 20 ms: 100 Hz, and not 1 kHz with holes
        (K // 7) * 0.07 + (K % 7) * 1e-4,  # as packets of a radio
        (K // 10) * 0.1 + spread(1, 2000, 0.02)[K // 10] + (K % 10) * 1e-5,  # the same, late by chance
        np.maximum.accumulate(0.01 * K + spread(2, 2000, 0.008)),  # each late by chance, in order
        np.floor(0.01 * K),  # whole seconds only
    ],
    ids=["pairs", "pairs 1 ms apart", "packets", "late packets", "late rows", "whole seconds"],
)
def test_stamps_of_arrival_give_the_rate_and_no_holes(stamps):
    clock = read_clock(stamps, "s")
    # Where rows are late by chance, by 20 ms in the mean of 200 packets over 20 s, the rate scatters by 0.01 %.
    assert clock.period == pytest.approx(0.01, rel=1e-3)
    assert np.array_equal(clock.index, K)
    assert "rows are taken for evenly spaced at their mean rate" in clock.notes[-1]


def test_rows_closed_up_over_a_gap_are_found_where_stamps_of_arrival_tell_it():
    counted = K + 40 * (K >= 700)
    clock = read_clock(np.maximum.accumulate(0.01 * counted + spread(3, 2000, 0.006)), "s")
    jump = np.flatnonzero(np.diff(clock.index) != 1)
    assert jump.tolist() == [699]
    assert np.diff(clock.index)[699] == pytest.approx(41, abs=2)  # stamps are late by a sample or so
    assert "missing" in clock.notes[-1]


def test_a_pause_of_the_host_after_which_everything_arrives_is_no_gap():
    stamps = 0.01 * K
    stamps[500:550] = 5.5 + 1e-6 * np.arange(50)
    clock = read_clock(stamps, "s")
    assert np.array_equal(clock.index, K)


@pytest.mark.parametrize("jump", [-3.0, -1e6, 1.9e8])
def test_a_clock_that_is_set_loses_no_sample(jump):
    clock = read_clock(0.01 * K + 100 + jump * (K > 1000), None)
    assert clock.period == pytest.approx(0.01, rel=1e-9)  # a time of 6 years is rounded
    assert np.array_equal(clock.index, K)
    assert "taken for a clock that was set" in clock.notes[0]


def test_a_time_that_begins_anew_is_two_recordings():
    with pytest.raises(ClockError, match="two recordings in one file") as caught:
        read_clock(np.concatenate([0.01 * K, 0.01 * K]), None)
    assert caught.value.row == 2000


@pytest.mark.parametrize(
    ("stamps", "unit", "tick"),
    [((65_000 + K) % 65_536, None, 0.01), ((2**32 - 5_000_000 + 10_000 * K) % 2**32, "us", None)],
)
def test_a_counter_that_wraps_is_counted_on(stamps, unit, tick):
    clock = read_clock(stamps.astype(float), unit, tick)
    assert clock.period == 0.01
    assert np.array_equal(clock.index, K)
    assert "begin anew" in clock.notes[0]


def test_a_gap_of_seconds_is_missing_samples():
    clock = read_clock(0.01 * K + 10 * (K > 1000), None)
    assert clock.notes == ()
    assert clock.index[-1] == 2999


@pytest.mark.parametrize("stamps", [0.0 * K, np.random.default_rng(1).uniform(0, 10, 2000), np.full(2000, np.nan)])
def test_what_tells_no_rate_is_refused(stamps):
    with pytest.raises(ClockError):
        read_clock(stamps, None)


def test_a_rate_that_is_given_needs_no_times():
    clock = evenly(5, 50.0)
    assert clock.time.tolist() == [0, 0.02, 0.04, 0.06, 0.08]
    assert "times of the file are not used" in clock.notes[0]
