"""A run as a moving picture: the body, its sensor, the true horizon and the one that each estimator believes in.

The body is seen from the side, a little from above, in parallel projection. Lines through the sensor are horizons: the
true one dashed, an estimated one perpendicular to the estimated up direction, which the true attitude takes to N. So a
right estimate lies on the dashed line, and an angle between the two is an error of tilt.

Beside it one instrument per estimator, as in an aircraft: the horizon as the sensor sees it, sky above, ground below.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import cycle, islice
from math import floor, log10
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..scoring.systems import Comparison
from .bodies import Body
from .figures import COLOURS, TRUTH_COLOUR
from .horizons import instruments
from .motion_figures import AXIS_COLOURS
from .movies import write_movie

RATE = 20  # frames a second; GIF counts in hundredths of a second
MOST_FRAMES = 600  # a longer run is shown faster than it is
ELEVATION = np.deg2rad(15)  # of the camera
TRAIL = 2.0  # s of the sensor's path behind it
_SHAPE = 1.03  # height of the view of the body over its width
_ROOM = 1.15  # of what has to fit into the window
_FOOT = 0.08  # of the height of a body that stays: room under it for scale and legend
_DOTS = 4  # of the ground within half of the window

Progress = Callable[[int, int], None]


def animate(
    path: Path, title: str, body: Body, compared: Sequence[Comparison], progress: Progress | None = None
) -> list[str]:
    """Write the moving picture (.gif or .mp4). Returns what a user should know about it.

    Raises WriteError, and ValueError as ``write_movie`` does.
    """
    instants, speed = frame_times(body.time)
    scene = Scene(title, body, compared)

    def frames() -> Iterator[None]:
        for done, t in enumerate(instants):
            scene.show(t)
            yield
            if progress:
                progress(done + 1, len(instants))

    write_movie(path, scene.figure, frames(), RATE)
    if speed == 1:
        return []
    return [f"{path}: {speed:.2g} times as fast as the run, which would take more than {MOST_FRAMES} frames"]


def frame_times(time: np.ndarray) -> tuple[np.ndarray, float]:
    """Instants (s) of the frames, and how many times faster than the run they are shown."""
    duration = time[-1] - time[0]
    count = floor(duration * RATE + 1e-6) + 1
    if count <= MOST_FRAMES:
        return time[0] + np.arange(count) / RATE, 1.0
    return np.linspace(time[0], time[-1], MOST_FRAMES), duration * RATE / (MOST_FRAMES - 1)


class Scene:
    """The figure, and the artists that ``show`` moves to an instant. The attitude of the body must be known."""

    def __init__(self, title: str, body: Body, compared: Sequence[Comparison]) -> None:
        assert body.axes is not None
        self.body, self.attitude, self.compared = body, body.axes, compared
        self.views = camera(body.side)
        self.window = Window(body, self.views)
        self.figure = Figure(figsize=(6.4, 4.8), dpi=100, facecolor="white")
        self.figure.text(0.02, 0.945, title, fontsize=11, color=TRUTH_COLOUR, weight="bold")
        self.clock = self.figure.text(0.66, 0.945, "", fontsize=10, color=TRUTH_COLOUR, ha="right")
        axis = self.figure.add_axes((0.02, 0.02, 0.64, _SHAPE * 0.64 * 6.4 / 4.8))
        half = self.window.half
        axis.set(xlim=(-half, half), ylim=(-_SHAPE * half, _SHAPE * half), xticks=[], yticks=[])
        self.ground = axis.plot([], [], ".", color="#c3ccd4", markersize=2)[0]
        self.trail = axis.plot([], [], color="#b4bec8", linewidth=1.0)[0]
        self.bones = axis.plot([], [], color=TRUTH_COLOUR, linewidth=2.5, solid_joinstyle="round")[0]
        self.axes = [axis.plot([], [], color=colour, linewidth=2.5)[0] for colour in AXIS_COLOURS.values()]
        self.true_horizon = axis.plot([], [], "--", color=TRUTH_COLOUR, linewidth=1.0)[0]
        colours = [*islice(cycle(COLOURS), len(compared))]
        self.horizons = [axis.plot([], [], color=colour, linewidth=1.8)[0] for colour in colours]
        _explain(axis, half)
        self.instruments = instruments(self.figure, compared, colours)

    def show(self, t: float) -> None:
        """Move everything to the time t (s): to the last row of the run, and the last sample, not after it."""
        row, body = _last(self.body.time, t), self.body
        self.clock.set_text(f"{t:.2f} s")
        self.window.move_to(row)
        sensor, half = body.position[row], self.window.half
        self.ground.set_data(*self._seen(self.window.ground()))
        self.trail.set_data(*self._seen(body.position[_last(body.time, t - TRAIL) : row + 1]))
        if body.skeleton is not None:
            self.bones.set_data(*self._seen(body.skeleton[row]))
        for k, line in enumerate(self.axes):
            line.set_data(*self._seen(np.array([sensor, sensor + 0.15 * half * self.attitude[row][:, k]])))
        middle = self._seen(sensor[None])[:, 0]
        self.true_horizon.set_data(*_across(middle, np.array([0.0, 1.0]), 2 * half))
        for line, instrument, compared in zip(self.horizons, self.instruments, self.compared, strict=True):
            sample = _last(compared.estimate.time, t)
            up = self.views @ self.attitude[row] @ compared.estimate["vertical"][sample]
            line.set_data(*_across(middle, up, 0.5 * half))
            instrument.show(sample)

    def _seen(self, points: np.ndarray) -> np.ndarray:
        """Places (2, k) in the picture of points (k, 3) in N."""
        return self.views @ (points - self.window.middle).T


class Window:
    """What the camera sees: the place of a body that stays, or the surroundings of one that travels.

    middle: (3,), m, in N. half: m, half of its width.
    """

    def __init__(self, body: Body, views: np.ndarray) -> None:
        self.body, self.views = body, views
        if body.travels:
            self.half = _ROOM * 1.5 * body.size
            self.move_to(0)
        else:
            seen = body.points @ views.T
            low, high = seen.min(axis=(0, 1)), seen.max(axis=(0, 1))
            low[1] -= _FOOT * (high - low)[1]
            self.middle = (low + high) / 2 @ views
            self.half = _ROOM * float(((high - low) / 2 / (1.0, _SHAPE)).max())
        spacing = self.half / _DOTS
        steps = np.arange(-4 * _DOTS, 4 * _DOTS + 1) * spacing
        self._spacing, self._dots = spacing, np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
        self._floor = float(body.points[..., 2].min())

    def move_to(self, row: int) -> None:
        """Follow a body that travels."""
        if self.body.travels:
            self.middle = self.body.position[row]

    def ground(self) -> np.ndarray:
        """Dots (k, 3) of the ground under a body that travels, fixed in N; none under one that stays."""
        if not self.body.travels:
            return np.empty((0, 3))
        corner = np.round(self.middle[:2] / self._spacing) * self._spacing
        return np.column_stack([corner + self._dots, np.full(len(self._dots), self._floor)])


def camera(side: np.ndarray) -> np.ndarray:
    """Right and up of the picture, rows (2, 3) in N, for a view across the horizontal direction ``side``."""
    up = np.array([0.0, 0.0, 1.0])
    return np.array([side, np.cos(ELEVATION) * up + np.sin(ELEVATION) * np.cross(up, side)])


def _across(middle: np.ndarray, up: np.ndarray, length: float) -> np.ndarray:
    """Line (2, 2) of this half length through the middle, perpendicular to ``up`` (2,), its columns the ends."""
    along = np.array([up[1], -up[0]]) / max(float(np.hypot(*up)), 1e-12)
    return middle[:, None] + length * np.outer(along, (-1, 1))


def _last(times: np.ndarray, t: float) -> int:
    """The last row not after t, the first where there is none."""
    return max(int(np.searchsorted(times, t + 1e-9, side="right")) - 1, 0)


def _explain(axis: Axes, half: float) -> None:
    """Scale bar and legend."""
    power = 10.0 ** floor(log10(0.5 * half))
    length = max(step * power for step in (1, 2, 5) if step == 1 or step * power <= 0.5 * half)
    left, bottom = -0.94 * half, -0.9 * _SHAPE * half
    axis.plot([left, left + length], [bottom, bottom], color=TRUTH_COLOUR, linewidth=2)
    axis.text(left + length / 2, bottom + 0.03 * half, f"{length:g} m", ha="center", fontsize=8, color=TRUTH_COLOUR)
    axis.text(0.94 * half, bottom, "- - true horizon", ha="right", fontsize=8, color=TRUTH_COLOUR)
    for k, (name, colour) in enumerate(AXIS_COLOURS.items()):
        axis.text((0.02 + 0.08 * k) * half, bottom, name, fontsize=9, color=colour, weight="bold")
    axis.text(-0.03 * half, bottom, "sensor's", ha="right", fontsize=8, color=TRUTH_COLOUR)
