"""Figures: angles in degrees, time in seconds, every axis with its unit, every line in a legend."""

from __future__ import annotations

import io
from collections.abc import Mapping
from itertools import cycle
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..blocks.running import Trajectory
from ..files.atomic import atomic_write
from ..scoring import metrics
from ..scoring.metrics import Signals

_DPI = 100
STEEPEST = np.deg2rad(80)  # pitch up to which roll and yaw are good to look at
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
    figure, axes = _panels(len(panels))
    figure.suptitle(title)
    for axis, panel in zip(axes, panels, strict=True):
        if panel == "tilt":
            for (label, (time, error)), colour in zip(errors.items(), cycle(COLOURS), strict=False):
                axis.plot(time, np.rad2deg(error["tilt"]), color=colour, linewidth=1.2, label=label)
            axis.set_ylabel("tilt error (deg)")
            axis.set_ylim(bottom=0)
        else:
            _signal_panel(axis, panel, truth, estimates)
    return _finished(figure, axes)


def direction_figure(truth: Trajectory, estimates: Mapping[str, Trajectory]) -> Figure:
    """Roll, pitch and yaw of truth and estimates over time, or the up vector where those say less.

    That is where an estimate has no angles, and where the true pitch comes near +-90 deg: there roll and yaw jump.
    """
    every = [truth, *estimates.values()]
    if all({"roll", "pitch"} <= e.values.keys() for e in every) and np.abs(truth["pitch"]).max() < STEEPEST:
        angles = [name for name in ("roll", "pitch", "yaw") if any(name in e.values for e in estimates.values())]
        figure, axes = _panels(len(angles))
        for axis, name in zip(axes, angles, strict=True):
            _signal_panel(axis, name, truth, estimates)
        return _finished(figure, axes)
    return _component_figure("vertical", "up vector, {} (1)", truth, estimates)


def acceleration_figure(truth: Trajectory, estimates: Mapping[str, Trajectory]) -> Figure | None:
    """External acceleration, truth and estimates, along each axis of the sensor; None where no estimate has one."""
    with_one = {label: e for label, e in estimates.items() if "external_acceleration" in e.values}
    if not with_one or "external_acceleration" not in truth.values:
        return None
    return _component_figure("external_acceleration", "{} (m/s²)", truth, with_one)


def _component_figure(name: str, label: str, truth: Trajectory, estimates: Mapping[str, Trajectory]) -> Figure:
    """One panel per component of a vector. label: of an axis, with a place for the component."""
    figure, axes = _panels(3)
    for k, axis in enumerate(axes):
        axis.plot(truth.time, truth[name][:, k], color=TRUTH_COLOUR, linewidth=2.0, label="truth")
        for (estimator, estimate), colour in zip(estimates.items(), cycle(COLOURS), strict=False):
            axis.plot(estimate.time, estimate[name][:, k], color=colour, linewidth=1.0, label=estimator)
        axis.set_ylabel(label.format("xyz"[k]))
    return _finished(figure, axes)


def error_figure(estimates: Mapping[str, Trajectory], errors: Mapping[str, Signals]) -> Figure:
    """Tilt error of every estimator over time, its own one-sigma tilt_std as a band; then how far its heading drifts.

    The heading counts from the first sample: without a magnetometer only that can be known.
    """
    headings = [label for label, error in errors.items() if "heading" in error]
    figure, axes = _panels(len(errors) + bool(headings))
    colours = dict(zip(errors, cycle(COLOURS), strict=False))
    for axis, (label, error) in zip(axes, errors.items(), strict=False):
        estimate, tilt = estimates[label], np.rad2deg(error["tilt"])
        axis.plot(estimate.time, tilt, color=colours[label], linewidth=1.2, label=label)
        if "tilt_std" in estimate.values:
            sigma = np.rad2deg(estimate["tilt_std"])
            axis.fill_between(estimate.time, sigma, color=colours[label], alpha=0.2, linewidth=0, label="its tilt_std")
        axis.set_ylabel("tilt error (deg)")
        axis.set_ylim(0, 1.05 * max(tilt.max(), 1e-6))
    for label in headings:
        drift = metrics.angle_difference(errors[label]["heading"], errors[label]["heading"][0])
        axes[-1].plot(estimates[label].time, _shown("heading", drift), color=colours[label], linewidth=1.2, label=label)
        axes[-1].set_ylabel("heading error\nsince the start (deg)")
    for axis in axes:
        axis.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=2 + len(headings), fontsize="small", frameon=False)
    return _time_axis(figure, axes)


def _panels(count: int) -> tuple[Figure, list[Axes]]:
    """A figure with panels of one time axis."""
    figure = Figure(figsize=(10, 0.8 + 2.3 * count), layout="constrained")
    return figure, list(figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0])


def _finished(figure: Figure, axes: list[Axes]) -> Figure:
    """The figure with grid, time axis and one legend."""
    lines = {str(line.get_label()): line for axis in axes for line in axis.get_lines()}
    figure.legend(lines.values(), lines.keys(), loc="outside lower center", ncols=len(lines))
    return _time_axis(figure, axes)


def _time_axis(figure: Figure, axes: list[Axes]) -> Figure:
    for axis in axes:
        axis.grid(alpha=0.3)
    axes[-1].set_xlabel("time (s)")
    return figure


def _signal_panel(axis: Axes, name: str, truth: Trajectory | None, estimates: Mapping[str, Trajectory]) -> None:
    if truth is not None and name in truth.values:
        axis.plot(truth.time, _shown(name, truth[name]), color=TRUTH_COLOUR, linewidth=2.0, label="truth")
    for (label, estimate), colour in zip(estimates.items(), cycle(COLOURS), strict=False):
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
