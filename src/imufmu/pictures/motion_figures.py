"""The motion itself: the body from the side, and from above the path of one that travels. Metres, equal scales."""

from __future__ import annotations

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from .bodies import Body
from .figures import TRUTH_COLOUR

POSTURES = 9  # instants at which the body is drawn
SWEEP = 1.0  # of its own size: how far the fastest point of a body in its place goes while it is drawn from the side
SWEEP_ON_A_JOURNEY = 2.0  # the same of one that travels
LEAST_DRAWN = 0.06  # of the path: a smaller travelling body is drawn enlarged
AXIS_COLOURS = {"x": "#e07a1f", "y": "#2a9d8f", "z": "#7b5ea7"}  # of the sensor
_TIME_COLOURS = colormaps["viridis"]
_PATH = "#b4bec8"


def stick_figure(body: Body) -> Figure:
    """The body from the side at equal times of its fastest movement, in the plane in which it moves most."""
    rows = lively(body)
    window = body.between(rows)
    views = np.array([window.side, [0.0, 0.0, 1.0]])
    degrees = round(np.degrees(np.arctan2(window.side[1], window.side[0])))  # a whole number has no -0
    figure, axis = _to_scale(
        (window if body.travels else body).points @ views.T,
        f"horizontal, {degrees} deg from East towards North (m)",
        "up (m)",
    )
    path = (window if body.travels else body).position @ views.T
    axis.plot(*path.T, color=_PATH, linewidth=0.8, label="path of the sensor", zorder=1)
    colours = _colours_of(window.time)
    _postures(axis, body.between(_evenly(rows)), views, colours, 1, 0.14 * body.size)
    return _finished(figure, axis, colours)


def path_figure(body: Body) -> Figure:
    """Path of the sensor from above in the colours of time, with the body and the sensor's axes at equal times."""
    views = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    figure, axis = _to_scale(body.points @ views.T, "East (m)", "North (m)")
    path, colours = body.position @ views.T, _colours_of(body.time)
    steps = [*np.stack([path[:-1], path[1:]], axis=1)]
    axis.add_collection(LineCollection(steps, colors=colours.to_rgba(body.time[1:])))
    axis.plot(*path[:1].T, "o", color=TRUTH_COLOUR, markersize=6, label="start")
    length = body.size if body.skeleton is None else 0.14 * body.size * enlargement(body)
    at = body.between(_evenly(np.arange(len(body.time))))
    _postures(axis, at, views, colours, enlargement(body), length)
    return _finished(figure, axis, colours)


def enlargement(body: Body) -> int:
    """How many times as large a body on a long journey is drawn on its path, to be seen at all."""
    journey = float(np.ptp(body.position, axis=0).max())
    return max(1, round(LEAST_DRAWN * journey / body.size))


def lively(body: Body) -> np.ndarray:
    """Rows (k,) of the fastest movement: around its instant until the fastest point has gone as far as is drawn."""
    steps = np.linalg.norm(np.diff(body.points, axis=0), axis=2).max(axis=1)
    if not steps.any():
        return np.arange(1)
    far = (SWEEP_ON_A_JOURNEY if body.travels else SWEEP) * body.size
    first = last = int(steps.argmax())
    while steps[first : last + 1].sum() < far and (first > 0 or last < len(steps) - 1):
        first, last = max(first - 1, 0), min(last + 1, len(steps) - 1)
    return np.arange(first, last + 2)


def _to_scale(points: np.ndarray, x: str, y: str) -> tuple[Figure, Axes]:
    """A figure with equal scales, of a height that fits points (..., 2)."""
    width, height = np.ptp(points.reshape(-1, 2), axis=0) + 1e-9
    figure = Figure(figsize=(10, np.clip(2 + 7 * height / width, 3.5, 6.5)), layout="constrained")
    axis = figure.add_subplot()
    axis.set(xlabel=x, ylabel=y)
    axis.set_aspect("equal", adjustable="datalim")
    axis.grid(alpha=0.3)
    axis.margins(0.08)
    return figure, axis


def _colours_of(time: np.ndarray) -> ScalarMappable:
    return ScalarMappable(Normalize(time[0], time[-1]), _TIME_COLOURS)


def _finished(figure: Figure, axis: Axes, colours: ScalarMappable) -> Figure:
    figure.colorbar(colours, ax=axis, label="time (s)", shrink=0.8)
    figure.legend(loc="outside lower center", ncols=6)
    return figure


def _evenly(rows: np.ndarray) -> np.ndarray:
    """Some of the rows, at equal distances, the first and the last among them."""
    return np.unique(rows[np.linspace(0, len(rows) - 1, POSTURES).round().astype(int)])


def _postures(
    axis: Axes, body: Body, views: np.ndarray, colours: ScalarMappable, times: int, axis_length: float
) -> None:
    """The body, this many times as large, its sensor and the sensor's axes of this length (m)."""
    sensor, last = body.position @ views.T, len(body.time) - 1
    if body.skeleton is not None:
        place = body.position[:, None, :]
        for i, bones in enumerate((place + times * (body.skeleton - place)) @ views.T):
            shade, label = colours.to_rgba(body.time[i]), "body" if i == last else None
            axis.plot(*bones.T, color=shade, linewidth=1.8, label=label, solid_joinstyle="round")
    axis.plot(*sensor.T, "s", color=TRUTH_COLOUR, markersize=3.5, label="sensor", zorder=4)
    if body.axes is None:
        return
    for k, (name, colour) in enumerate(AXIS_COLOURS.items()):
        ends = (body.position + axis_length * body.axes[:, :, k]) @ views.T
        for i in range(last + 1):
            label = f"sensor's {name} axis" if i == last else None
            axis.plot(*np.stack([sensor[i], ends[i]]).T, color=colour, linewidth=1.8, label=label, zorder=3)
