"""The order of stepping: sources first, loops broken at a place that does not depend on chance."""

from __future__ import annotations

from itertools import permutations

import pytest

from imufmu.cosim.order import signal_flow


def test_sources_come_first_whatever_the_order_of_names() -> None:
    edges = {("a", "b"), ("b", "c"), ("a", "d"), ("d", "c")}
    for names in permutations("abcd"):
        order, broken = signal_flow(names, edges)
        assert not broken
        assert all(order.index(source) < order.index(target) for source, target in edges)


def test_independent_components_keep_their_order() -> None:
    assert signal_flow("cab", set()) == (["c", "a", "b"], [])


def test_edges_to_components_outside_do_not_count() -> None:
    assert signal_flow("ab", {("x", "a"), ("b", "x")}) == (["a", "b"], [])


@pytest.mark.parametrize("names", list(permutations("abc")))
def test_a_ring_is_broken_once_before_its_first_named(names: tuple[str, ...]) -> None:
    ring = {("a", "b"), ("b", "c"), ("c", "a")}
    order, broken = signal_flow(names, ring)
    before = next(source for source, target in ring if target == names[0])
    assert broken == [(before, names[0])]
    assert order[0] == names[0]


def test_what_only_hangs_on_a_loop_breaks_nothing() -> None:
    order, broken = signal_flow("dabs", {("s", "a"), ("a", "b"), ("b", "a"), ("b", "d")})
    assert order == ["s", "a", "b", "d"]
    assert broken == [("b", "a")]


def test_a_component_that_feeds_itself_is_told() -> None:
    assert signal_flow("ab", {("a", "a"), ("a", "b")}) == (["a", "b"], [("a", "a")])
