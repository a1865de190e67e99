"""The motion itself: a body that swings in its place from the side, one that travels from above."""

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
SWEEP = 1.0  # of its own size: how far the fastest point of a body in its place goes while it is drawn
LEAST_DRAWN = 0.06  # of the path: a smaller travelling body is drawn enlarged
AXIS_COLOURS = {"x": "#e07a1f", "y": "#2a9d8f", "z": "#7b5ea7"}  # of the sensor
_TIME_COLOURS = colormaps["viridis"]
_PATH = "#b4bec8"


def motion_figure(body: Body) -> Figure:
    """Stick figure at several instants, or path with the body at intervals; metres, equal scales, time in colours."""
    if body.travels:
        rows = _evenly(np.arange(len(body.time)))
        views = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
        names = "East (m)", "North (m)"
    else:
        rows = _evenly(lively(body))
        views = np.array([body.side, [0.0, 0.0, 1.0]])
        degrees = np.degrees(np.arctan2(body.side[1], body.side[0])) + 0.0
        names = f"horizontal, {degrees:.0f} deg from East towards North (m)", "up (m)"
    width, height = np.ptp(body.points @ views.T, axis=(0, 1)) + 1e-9
    figure = Figure(figsize=(10, np.clip(2 + 7 * height / width, 3.5, 6.5)), layout="constrained")
    axis = figure.add_subplot()
    axis.set(xlabel=names[0], ylabel=names[1])
    shown = body.time if body.travels else body.time[rows]
    colours = ScalarMappable(Normalize(shown[0], shown[-1]), _TIME_COLOURS)
    _path(axis, body, views, colours)
    length = body.size if body.skeleton is None else 0.14 * body.size * enlargement(body)
    _postures(axis, body.between(rows), views, colours, enlargement(body), length)
    axis.set_aspect("equal", adjustable="datalim")
    axis.grid(alpha=0.3)
    axis.margins(0.08)
    figure.colorbar(colours, ax=axis, label="time (s)", shrink=0.8)
    figure.legend(loc="outside lower center", ncols=6)
    return figure


def caption(body: Body) -> str:
    """What ``motion_figure`` shows of this body."""
    if body.skeleton is None:
        return "Path of the sensor from above, with its axes at equal times."
    if body.travels:
        times = enlargement(body)
        enlarged = f", drawn {times} times as large," if times > 1 else ""
        return f"Path of the sensor from above, with the body{enlarged} and the sensor's axes at equal times."
    return "The body from the side at equal times of its fastest movement; path of the sensor in the whole run."


def enlargement(body: Body) -> int:
    """How many times as large a body on a long journey is drawn, to be seen at all."""
    journey = float(np.ptp(body.position, axis=0).max())
    return max(1, round(LEAST_DRAWN * journey / body.size)) if body.travels and body.skeleton is not None else 1


def lively(body: Body) -> np.ndarray:
    """Rows (k,) of the fastest movement: around its instant until the fastest point has gone SWEEP sizes."""
    steps = np.linalg.norm(np.diff(body.points, axis=0), axis=2).max(axis=1)
    if not steps.any():
        return np.arange(1)
    first = last = int(steps.argmax())
    while steps[first : last + 1].sum() < SWEEP * body.size and (first > 0 or last < len(steps) - 1):
        first, last = max(first - 1, 0), min(last + 1, len(steps) - 1)
    return np.arange(first, last + 2)


def _evenly(rows: np.ndarray) -> np.ndarray:
    """Some of the rows, at equal distances, the first and the last among them."""
    return np.unique(rows[np.linspace(0, len(rows) - 1, POSTURES).round().astype(int)])


def _path(axis: Axes, body: Body, views: np.ndarray, colours: ScalarMappable) -> None:
    """Path of the sensor; of a travelling body in the colours of time."""
    path = body.position @ views.T
    if body.travels:
        lines = LineCollection([*np.stack([path[:-1], path[1:]], axis=1)], colors=colours.to_rgba(body.time[1:]))
        axis.add_collection(lines)
        axis.plot(*path[:1].T, "o", color=TRUTH_COLOUR, markersize=6, label="start")
    else:
        axis.plot(*path.T, color=_PATH, linewidth=0.8, label="path of the sensor", zorder=1)


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
