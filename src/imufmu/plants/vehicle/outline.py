"""Outline of the vehicle, to draw it: the box of its body and the points where the wheels touch the road."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import casadi as ca

from ...blocks.rotations import rotate
from .road import in_N, road_attitude

TOP, BOTTOM = 1.4, 0.2  # m above the road
FRONT_LEFT, REAR_LEFT, REAR_RIGHT, FRONT_RIGHT = range(4)

# Every edge of the box and every leg, in one line: ``floor``, ``roof`` and ``wheel`` of each corner.
LINE = (
    *(step for corner in range(4) for step in (("floor", corner), ("wheel", corner), ("floor", corner))),
    ("floor", FRONT_LEFT),
    ("roof", FRONT_LEFT),
    *(step for corner in range(1, 4) for step in (("roof", corner), ("floor", corner), ("roof", corner))),
    ("roof", FRONT_LEFT),
)
POINTS = len(LINE)


def outline(x: SimpleNamespace, p: SimpleNamespace) -> Any:
    """Points (POINTS, 3) of the body, in N (m)."""
    q_NR = road_attitude(x)
    middle = (p.front_distance - p.rear_distance) / 2
    places = {}
    for corner, (forward, left) in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1))):
        axle = p.front_distance if forward > 0 else -p.rear_distance
        places["wheel", corner] = x.position + rotate(q_NR, ca.vertcat(axle, left * p.track / 2, 0))
        for name, height in (("floor", BOTTOM), ("roof", TOP)):
            at = ca.vertcat(middle + forward * p.length / 2, left * p.width / 2, height - p.body_com_height)
            places[name, corner] = in_N(x, at, p)
    return ca.horzcat(*(places[step] for step in LINE)).T
