"""Real clocks jitter, drift, round and drop samples; every row still finds its instant."""

from __future__ import annotations

import numpy as np
import pytest

from imufmu.recordings.sample_clock import MOST_MISSING, ClockError, sample_clock


def ticks(n: int = 3000) -> np.ndarray:
    return np.arange(n)


@pytest.mark.parametrize("rate", [100.0, 285.71428571428572, 400.0])
def test_time_stamps_rounded_to_milliseconds_keep_their_samples(rate: float) -> None:
    for rounded in (np.round(ticks() / rate, 3), np.floor(1e3 / rate * ticks() + 1e-9) / 1e3):
        period, index = sample_clock(rounded)
        assert np.array_equal(index, ticks())
        # Only the first and last stamp of 3000 carry rounding, 1 ms between them at most.
        assert period == pytest.approx(1 / rate, abs=1e-3 / 2999)


def test_a_clean_clock_gives_the_clean_period() -> None:
    period, index = sample_clock(1e4 + 0.01 * ticks())
    assert period == 0.01
    assert np.array_equal(index, ticks())


@pytest.mark.parametrize("spread", [1e-5, 1e-3, 2.8e-3])
def test_jitter_of_the_time_stamps_does_not_accumulate(spread: float) -> None:
    """Up to 0.28 samples either way: neighbours are 0.44 to 1.56 periods apart."""
    rng = np.random.default_rng(3)
    for _ in range(100):
        period, index = sample_clock(0.01 * ticks(1000) + rng.uniform(-spread, spread, 1000))
        assert np.array_equal(index, ticks(1000))
        assert period == pytest.approx(0.01, abs=2 * spread / 999)  # two end points


def test_a_late_first_row_does_not_mislead() -> None:
    """The first interval is less than half a period, yet every row is within 0.26 samples of its instant."""
    time = 0.01 * ticks()
    time[:2] += [0.0026, -0.0026]
    assert np.array_equal(sample_clock(time)[1], ticks())


def test_a_clock_that_drifts_keeps_its_samples() -> None:
    """From 100 ppm fast to 100 ppm slow over 100000 samples: 2.5 samples off a constant rate in the middle."""
    n = 100_000
    intervals = 0.01 * (1 + np.linspace(-1e-4, 1e-4, n - 1))
    _, index = sample_clock(np.concatenate([[0.0], np.cumsum(intervals)]))
    assert np.array_equal(index, np.arange(n))


def test_missing_rows_leave_their_instants_out() -> None:
    kept = np.delete(ticks(), [5, 100, 101, 102, 2000])
    period, index = sample_clock(np.round(kept / 285.71428571428572, 3))
    assert np.array_equal(index, kept)
    assert period == pytest.approx(0.0035, rel=1e-3)  # rounding next to the gaps no longer cancels


def test_a_gap_counts_as_the_nearest_whole_number_of_periods() -> None:
    time = 0.01 * ticks()
    time[1000:] += 0.024  # the interval is 3.4 periods
    _, index = sample_clock(time)
    assert np.array_equal(np.flatnonzero(np.diff(index) != 1), [999])
    assert index[1000] - index[999] == 3


def test_two_rows_make_a_clock_and_a_third_may_be_far() -> None:
    for time, instants in ([5.0, 5.01], [0, 1]), ([5.0, 5.01, 5.11], [0, 1, 11]):
        period, index = sample_clock(np.array(time))
        assert period == 0.01
        assert index.tolist() == instants


def test_two_recordings_in_one_file_are_refused() -> None:
    time = 0.01 * ticks()
    time[1000:] += 0.01 * 2 * MOST_MISSING
    with pytest.raises(ClockError, match="split the recording") as caught:
        sample_clock(time)
    assert caught.value.row == 1000


@pytest.mark.parametrize(
    ("stamps", "fault"),
    [
        ([0.0, 0.01, 0.01, 0.02, 0.03], r"^0.01 s is repeated; time must increase"),
        ([0.0, 0.01, 0.005, 0.02, 0.03], r"^0.005 s follows 0.01 s; time must increase"),
    ],
)
def test_a_stamp_that_does_not_increase_is_refused_with_its_row(stamps: list[float], fault: str) -> None:
    with pytest.raises(ClockError, match=fault) as caught:
        sample_clock(np.array(stamps))
    assert caught.value.row == 2


def test_every_stamp_twice_is_no_clock() -> None:
    with pytest.raises(ClockError, match="is repeated") as caught:
        sample_clock(np.repeat(0.01 * ticks(), 2))
    assert caught.value.row == 1


@pytest.mark.parametrize("rate", [100.0, 120.0, 60.0, 400.0, 285.7])
@pytest.mark.parametrize("n", [30, 3000])
def test_stamps_that_count_from_1970_give_the_clock_of_stamps_that_count_from_zero(n: int, rate: float) -> None:
    """There a double moves on in steps of 0.24 us; the plainest number that this allows is the one that was meant."""
    expected, actual = sample_clock(ticks(n) / rate), sample_clock(1.7e9 + ticks(n) / rate)
    assert actual[0] == expected[0]
    assert np.array_equal(actual[1], expected[1])


def test_a_period_without_a_plain_number_keeps_its_digits() -> None:
    """Only what the rounding of the stamps leaves open is chosen plain."""
    period = 0.0034940600978
    assert sample_clock(period * ticks())[0] == pytest.approx(period, rel=1e-12)
    assert sample_clock(1.7e9 + period * ticks())[0] == pytest.approx(period, abs=2.4e-7 / 2999)
