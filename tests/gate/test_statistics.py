"""One number from a quantity over time."""

from __future__ import annotations

import numpy as np
import pytest

from imufmu.gate import statistics


def test_statistics_are_those_of_their_names() -> None:
    x = np.array([0.0, -3.0, 2.0, 1.0])
    found = {name: statistics.reduced(name, x) for name in ("rmse", "max", "mean", "highest", "lowest", "final", "std")}
    assert found["rmse"].value == pytest.approx(np.sqrt(14 / 4))
    assert found["max"] == (3.0, 1)  # of the magnitude
    assert found["mean"].value == 0.0
    assert found["highest"] == (2.0, 2)
    assert found["lowest"] == (-3.0, 1)
    assert found["final"] == (1.0, 3)
    assert found["std"].value == pytest.approx(np.std(x))
    assert statistics.reduced("p95", np.arange(101.0) - 100).value == pytest.approx(95.0)
    assert statistics.share(x > 0).value == 0.5


def test_nees_is_one_where_sigma_is_the_error_and_infinite_where_there_is_no_sigma() -> None:
    assert statistics.nees(np.array([1.0, -2.0]), np.array([1.0, 2.0])).value == 1.0
    assert statistics.nees(np.array([0.0, 1.0]), np.array([0.0, 0.0])).value == np.inf


@pytest.mark.parametrize(
    ("values", "seconds"), [([5, 3, 1, 1], 0.2), ([5, 0, 3, 1], 0.3), ([0, 0, 0, 0], 0.0), ([0, 0, 0, 5], np.inf)]
)
def test_settling_ends_with_the_last_row_outside_the_band(values: list[float], seconds: float) -> None:
    found = statistics.settling_time(np.arange(4) * 0.1, np.array(values, float), 2.0)
    assert found.value == pytest.approx(seconds)


def test_the_greatest_within_some_seconds_is_that_of_the_slow_obvious_search(rng: np.random.Generator) -> None:
    robustness, time = rng.normal(size=60), 3.0 + np.arange(60) * 0.1
    for seconds in (0.0, 0.1, 0.25, 0.3, 1.0, 5.85, 5.9, 100.0):
        slow = [robustness[(time >= t - 1e-9) & (time <= t + seconds + 1e-9)].max() for t in time]
        assert statistics.within(time, robustness, seconds).tolist() == slow
