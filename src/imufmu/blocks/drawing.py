"""Lines over time, one panel per unit. Loaded when something is to be drawn."""

from __future__ import annotations

import io
from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

_IN_DEGREES = {"rad": "deg", "rad/s": "deg/s"}


class Drawing(Figure):
    """A figure that a notebook shows as it is; it needs neither pyplot nor a screen."""

    def _repr_png_(self) -> bytes:
        buffer = io.BytesIO()
        self.savefig(buffer, format="png")
        return buffer.getvalue()


def draw(time: np.ndarray, lines: Sequence[tuple[str, str, np.ndarray]]) -> Drawing:
    """Lines over time (s), each with label, unit and values (n,); angles in degrees."""
    panels: dict[str, list[tuple[str, np.ndarray]]] = {}
    for label, unit, values in lines:
        shown = _IN_DEGREES.get(unit, unit)
        panels.setdefault(shown, []).append((label, np.rad2deg(values) if shown != unit else values))
    figure = Drawing(figsize=(8, 1 + 2.2 * len(panels)), layout="constrained")
    axes = figure.subplots(len(panels), sharex=True, squeeze=False)[:, 0]
    for axis, (unit, drawn) in zip(axes, panels.items(), strict=True):
        for label, values in drawn:
            style = "default" if np.issubdtype(values.dtype, np.floating) else "steps-post"
            axis.plot(time, values, label=label, linewidth=1.2, drawstyle=style)
        what = [drawn[0][0]] if len(drawn) == 1 else []
        axis.set_ylabel(" ".join([*what, f"({unit})"] if unit else what))
        axis.grid(alpha=0.3)
        axis.legend(loc="best", fontsize="small")
    axes[-1].set_xlabel("time (s)")
    return figure
