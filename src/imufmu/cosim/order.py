"""The order in which components step: along the signal flow, loops broken at a place that is told."""

from __future__ import annotations

from collections.abc import Collection, Sequence

Edge = tuple[str, str]  # from component, to component


def signal_flow(names: Sequence[str], edges: Collection[Edge]) -> tuple[list[str], list[Edge]]:
    """Order the named components so that sources come before what they feed.

    Where a loop prevents that, the loop's component that was named first goes first, and the edges that lead back to it
    are broken. Edges from or to other components do not count. Returns the order and the broken edges.
    """
    order: list[str] = []
    broken: list[Edge] = [(name, name) for name in names if (name, name) in edges]
    remaining = list(names)
    while remaining:
        inner = [(a, b) for a, b in edges if a in remaining and b in remaining and a != b]
        # Nothing that is left feeds the next one, unless it is fed by it in turn.
        following = next(name for name in remaining if _reached(name, inner, back=True) <= _reached(name, inner))
        broken += [(name, following) for name in remaining if (name, following) in inner]
        order.append(following)
        remaining.remove(following)
    return order, broken


def _reached(name: str, edges: Collection[Edge], back: bool = False) -> set[str]:
    """Components that can be reached from ``name`` along the edges (or against them)."""
    reached: set[str] = set()
    ahead = [name]
    while ahead:
        at = ahead.pop()
        found = {(a if back else b) for a, b in edges if (b if back else a) == at} - reached
        reached |= found
        ahead += found
    return reached
