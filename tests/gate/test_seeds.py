"""How often a limit must hold, and when the verdict is certain."""

from __future__ import annotations

import pytest

from imufmu.gate.seeds import Demand, surely_at_least


@pytest.mark.parametrize(("passed", "met"), [(949, False), (950, True), (1000, True)])
def test_950_of_1000_are_95_percent_and_949_are_not(passed: int, met: bool) -> None:
    assert Demand(0.95, None, 1000).met(passed) is met


def test_the_lower_limit_is_that_of_clopper_and_pearson() -> None:
    """All of n hold: the limit is (1 - confidence)^(1 / n). Others from tables of the binomial distribution."""
    assert surely_at_least(20, 20, 0.95) == pytest.approx(0.05 ** (1 / 20))
    assert surely_at_least(0, 20, 0.95) == 0.0
    assert surely_at_least(9, 10, 0.975) == pytest.approx(0.55498, abs=1e-5)  # the usual two-sided 95 % interval
    assert surely_at_least(299, 300, 0.99) < 0.98 < surely_at_least(300, 300, 0.99)


@pytest.mark.parametrize("confidence", [None, 0.9])
@pytest.mark.parametrize("part", [0.5, 0.9, 1.0])
def test_a_verdict_is_certain_as_soon_as_no_further_run_can_change_it(part: float, confidence: float | None) -> None:
    runs = 12
    demand = Demand(part, confidence, runs)
    for passed in range(runs + 1):
        for failed in range(runs + 1 - passed):
            left = runs - passed - failed
            ends = {demand.met(passed + more) for more in range(left + 1)}
            assert demand.decided(passed, failed) == (ends.pop() if len(ends) == 1 else None)


def test_demands_that_so_few_runs_cannot_show_are_known_beforehand() -> None:
    assert not Demand(0.95, 0.99, 50).possible
    assert Demand(0.95, 0.99, 90).possible
