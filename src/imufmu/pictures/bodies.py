"""The moving body in a result: its points, its sensor, and where to look at it from."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..blocks.rotations import matrix_from_quaternion, over_rows
from ..cosim.interface import representation
from ..cosim.results import Result
from ..cosim.slave import DTYPES
from ..cosim.system import System
from ..scoring.systems import knowing

TRAVELS = 3.0  # a body that goes further than this many of its own sizes is on a journey
SENSOR_SIZE = 0.1  # drawn size of the body, m, where only a sensor that does not move is known


@dataclass(frozen=True)
class Body:
    """Motion of the body in a run.

    time: (n,), s. position: (n, 3), m, of the sensor, in N. axes: (n, 3, 3), R_NS, whose columns are the sensor's axes
    in N; None where the attitude is not known. skeleton: (n, m, 3), m, points of the body in N, joined by one line;
    None where the plant has none.
    """

    time: np.ndarray
    position: np.ndarray
    axes: np.ndarray | None
    skeleton: np.ndarray | None

    @property
    def points(self) -> np.ndarray:
        """Every point that is drawn, (n, k, 3), m: of the body and its sensor."""
        sensor = self.position[:, None, :]
        return sensor if self.skeleton is None else np.concatenate([self.skeleton, sensor], axis=1)

    @cached_property
    def size(self) -> float:
        """Largest extent of the body along an axis of N (m); of the sensor alone a tenth of its path."""
        extent = float(np.ptp(self.points, axis=1).max())
        return extent or 0.1 * float(np.ptp(self.position, axis=0).max()) or SENSOR_SIZE

    @cached_property
    def travels(self) -> bool:
        """Whether the body leaves its place, so that its path says more than its postures."""
        middle = self.points.mean(axis=1)
        return bool(self.skeleton is None or np.ptp(middle, axis=0).max() > TRAVELS * self.size)

    @cached_property
    def side(self) -> np.ndarray:
        """Horizontal direction (3,) along which the body moves most, at rest extends most: to be seen from the side."""
        horizontal = self.points[..., :2]
        moved = horizontal - horizontal.mean(axis=0)
        spread = moved if moved.any() else horizontal - horizontal.mean(axis=(0, 1))
        _, directions = np.linalg.eigh(np.einsum("nki,nkj->ij", spread, spread))
        x, y = directions[:, -1]
        return np.array([x, y, 0.0]) * (1 if x + 1e-9 * y >= 0 else -1)

    def between(self, rows: np.ndarray) -> Body:
        """The same at some rows."""
        axes, skeleton = (None if a is None else a[rows] for a in (self.axes, self.skeleton))
        return Body(self.time[rows], self.position[rows], axes, skeleton)


def body_of(result: Result) -> Body | None:
    """The body that the system's plant moves; None where no plant says where it is."""
    plants, _ = knowing(result.names)
    for plant in plants:
        if f"{plant}.position" in result:
            known = {name: result[f"{plant}.{name}"] for name in ("q_NS", "skeleton") if f"{plant}.{name}" in result}
            axes = over_rows(matrix_from_quaternion, known["q_NS"]).reshape(-1, 3, 3) if "q_NS" in known else None
            return Body(result.time, result[f"{plant}.position"], axes, known.get("skeleton"))
    return None


def recorded(system: System) -> list[str]:
    """Names of what a run has to record to be drawn: every output, and the points of the bodies."""
    return [
        f"{name}.{variable.name}"
        for name, interface in system.interfaces.items()
        for variable in interface.variables.values()
        if representation(variable) in DTYPES
        and (variable.causality == "output" or variable.name.startswith("skeleton["))
    ]
