"""Attitude indicator of an estimator, as in an aircraft: the horizon as the sensor sees it, sky above, ground below.

The picture looks along that axis of the sensor which stays most level, f; up in it is the axis nearest to the vertical
at first, u, and right is r = f x u. With the up vector v in S the horizon is the line

    d . n = e,    n = (r . v, u . v) / |(r . v, u . v)|,    e = -asin(f . v) / (pi / 2)

of the unit disc: straight ahead is its middle, straight up or down its rim.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from ..scoring.systems import Comparison
from .figures import TRUTH_COLOUR

SKY, GROUND, MARK = "#a9cdea", "#c8ab86", "#ffffff"
_ARC = 48  # corners of the ground's edge


def viewing_axes(vertical: np.ndarray) -> np.ndarray:
    """Rows r, u, f (3, 3) in S for a run with these up vectors (n, 3)."""
    level = np.abs(vertical).mean(axis=0)
    f, u = np.zeros(3), np.zeros(3)
    f[level.argmin()] = 1.0
    upright = np.delete(np.arange(3), level.argmin())
    up = upright[level[upright].argmax()]
    u[up] = np.copysign(1.0, vertical[0, up])
    return np.array([np.cross(f, u), u, f])


def horizon(vertical: np.ndarray, view: np.ndarray) -> tuple[float, float]:
    """Angle (rad) of n from r towards u, and distance e of the horizon from the middle, -1 to 1, of an up vector."""
    r, u, f = view @ vertical / np.linalg.norm(vertical)
    return float(np.arctan2(u, r)), float(-np.arcsin(np.clip(f, -1, 1)) / (np.pi / 2))


def chord(angle: float, distance: float) -> np.ndarray:
    """Ends (2, 2) of the horizon on the rim of the disc."""
    half = np.arccos(distance)
    return _on_rim(np.array([angle + half, angle - half]))


class Instrument:
    """One attitude indicator; ``show`` moves it to a sample."""

    def __init__(self, axis: Axes, compared: Comparison, colour: str, font_size: float) -> None:
        self.compared = compared
        self.view = viewing_axes(compared.truth["vertical"])
        axis.set(xlim=(-1.1, 1.1), ylim=(-1.1, 1.1), aspect="equal")
        axis.axis("off")
        axis.add_patch(Circle((0, 0), 1, facecolor=SKY, edgecolor="none"))
        self.ground = Polygon(np.zeros((3, 2)), closed=True, facecolor=GROUND, edgecolor="none")
        axis.add_patch(self.ground)
        self.line = axis.plot([], [], color=colour, linewidth=2.0)[0]
        self.truth = axis.plot([], [], "--", color=TRUTH_COLOUR, linewidth=1.0)[0]
        axis.plot([-0.45, -0.15, 0, 0.15, 0.45], [0, 0, -0.12, 0, 0], color=MARK, linewidth=2.5)
        axis.add_patch(Circle((0, 0), 1, facecolor="none", edgecolor=colour, linewidth=2.5))
        axis.set_title(compared.component, fontsize=font_size, color=colour, pad=1)
        self.text = axis.text(0, -1.1, "", fontsize=font_size, color=TRUTH_COLOUR, ha="center", va="top")

    def show(self, row: int) -> None:
        """Horizons and error of this sample."""
        angle, distance = horizon(self.compared.estimate["vertical"][row], self.view)
        half = np.arccos(distance)
        self.ground.set_xy(_on_rim(np.linspace(angle + half, angle - half + 2 * np.pi, _ARC)))
        self.line.set_data(*chord(angle, distance).T)
        self.truth.set_data(*chord(*horizon(self.compared.truth["vertical"][row], self.view)).T)
        self.text.set_text(f"tilt error {np.rad2deg(self.compared.errors['tilt'][row]):.1f} deg")


def instruments(figure: Figure, compared: Sequence[Comparison], colours: Sequence[str]) -> list[Instrument]:
    """One instrument per estimator, in a column at the right of the figure; in two where they are many."""
    columns = 1 if len(compared) <= 3 else 2
    rows = -(-len(compared) // columns)
    width, height = 0.33 / columns, min(0.46, 0.97 / rows)
    made = []
    for i, (of, colour) in enumerate(zip(compared, colours, strict=True)):
        left, bottom = 0.67 + i % columns * width, 0.98 - (i // columns + 1) * height
        axis = figure.add_axes((left, bottom + 0.06, width, height - 0.11))  # room for the name and the error
        made.append(Instrument(axis, of, colour, 9 if columns == 1 else 7))
    return made


def _on_rim(angles: np.ndarray) -> np.ndarray:
    return np.column_stack([np.cos(angles), np.sin(angles)])
