"""Figures: angles in degrees, time in seconds, every axis with its unit, every line in a legend."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..files import atomic_write
from ..running import Trajectory
from .metrics import Signals

_DPI = 100
TRUTH_COLOUR = "#26323f"
COLOURS = ("#d1495b", "#2e86ab", "#6a994e", "#edae49", "#7b5ea7", "#8d6b4f")


def attitude_figure(
    title: str,
    truth: Trajectory | None,
    estimates: Mapping[str, Trajectory],
    errors: Mapping[str, tuple[np.ndarray, Signals]],
) -> Figure:
    """Roll, pitch, tilt error and norm of the external acceleration over time.

    estimates: by label. errors: time (n,) and errors over time by label. A panel without data is left out.
    """
    panels = [name for name in ("roll", "pitch") if any(name in e.values for e in estimates.values())]
    panels += ["tilt"] if any("tilt" in error for _, error in errors.values()) else []
    panels += ["external_acceleration"] if any("external_acceleration" in e.values for e in estimates.values()) else []
    figure = Figure(figsize=(10, 0.8 + 2.3 * len(panels)), layout="constrained")
    figure.suptitle(title)
    axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    for axis, panel in zip(axes, panels, strict=True):
        if panel == "tilt":
            for (label, (time, error)), colour in zip(errors.items(), COLOURS, strict=False):
                axis.plot(time, np.rad2deg(error["tilt"]), color=colour, linewidth=1.2, label=label)
            axis.set_ylabel("tilt error (deg)")
            axis.set_ylim(bottom=0)
        else:
            _signal_panel(axis, panel, truth, estimates)
        axis.grid(alpha=0.3)
    axes[-1].set_xlabel("time (s)")
    lines = {str(line.get_label()): line for axis in axes for line in axis.get_lines()}
    figure.legend(lines.values(), lines.keys(), loc="outside lower center", ncols=len(lines))
    return figure


def _signal_panel(axis: Axes, name: str, truth: Trajectory | None, estimates: Mapping[str, Trajectory]) -> None:
    if truth is not None and name in truth.values:
        axis.plot(truth.time, _shown(name, truth[name]), color=TRUTH_COLOUR, linewidth=2.0, label="truth")
    for (label, estimate), colour in zip(estimates.items(), COLOURS, strict=False):
        if name in estimate.values:
            axis.plot(estimate.time, _shown(name, estimate[name]), color=colour, linewidth=1.0, label=label)
    axis.set_ylabel("external acceleration,\nnorm (m/s²)" if name == "external_acceleration" else f"{name} (deg)")


def _shown(name: str, values: np.ndarray) -> np.ndarray:
    """Norm of a vector; an angle in degrees, broken where it jumps from one end of its range to the other."""
    if values.ndim == 2:
        return np.linalg.norm(values, axis=1)
    degrees = np.rad2deg(values)
    degrees[1:][np.abs(np.diff(degrees)) > 180] = np.nan
    return degrees


def png(figure: Figure) -> bytes:
    """The figure as a PNG image."""
    image = io.BytesIO()
    figure.savefig(image, format="png", dpi=_DPI)
    return image.getvalue()


def save(figure: Figure, path: Path) -> None:
    """Write the figure in the format of the file's suffix (.png, .svg, .pdf), whole or not at all.

    Raises WriteError, and ValueError for a suffix that is no image format.
    """
    formats = figure.canvas.get_supported_filetypes()
    suffix = path.suffix.lstrip(".").lower()
    if suffix not in formats:
        raise ValueError(f"{path}: cannot draw a {path.suffix or 'file without suffix'}; use .png, .svg or .pdf")
    with atomic_write(path) as temporary:
        figure.savefig(temporary, format=suffix, dpi=_DPI)
