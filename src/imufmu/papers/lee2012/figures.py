"""Figures of the experiments on Lee 2012: the paper's Figures 4 and 5 from one of our runs, and Table II as a plot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...blocks.running import Trajectory
from ...pictures.figures import COLOURS, TRUTH_COLOUR
from ..motions import Record
from .runs import C_A, DURATION, Seed, acceleration_error

_MODES = {1: "mode 1 (acceleration model)", 2: "mode 2 (static)", 3: "mode 3 (threshold)"}


def attitude_and_acceleration(record: Record, estimates: Mapping[int, Trajectory]) -> Figure:
    """Roll, pitch and external acceleration of each mode beside the truth (Figure 4)."""
    figure = Figure(figsize=(11, 10), layout="constrained")
    panels = figure.subplots(5, len(estimates), sharex=True, sharey="row")
    quantities = ("roll (deg)", "pitch (deg)", *(f"a{axis} (m/s²)" for axis in "xyz"))
    for column, (mode, estimate) in zip(panels.T, estimates.items(), strict=True):
        column[0].set_title(_MODES[mode])
        for axis, true, found in zip(column, _quantities(record.truth), _quantities(estimate), strict=True):
            axis.plot(estimate.time, found, color=COLOURS[mode - 1], linewidth=1.2, label="estimate")
            axis.plot(record.truth.time, true, "--", color=TRUTH_COLOUR, linewidth=1.0, label="truth")
            axis.grid(alpha=0.3)
        column[-1].set_xlabel("time (s)")
    for axis, quantity in zip(panels[:, 0], quantities, strict=True):
        axis.set_ylabel(quantity)
    panels[0, 0].legend()
    return figure


def _quantities(run: Trajectory) -> Sequence[np.ndarray]:
    """Roll and pitch (deg, broken where they wrap) and the components of the external acceleration (m/s2)."""
    angles = [np.rad2deg(run[name]) for name in ("roll", "pitch")]
    for angle in angles:
        angle[1:][np.abs(np.diff(angle)) > 180] = np.nan
    return (*angles, *run["external_acceleration"].T)


def acceleration_errors(record: Record, estimates: Mapping[int, Trajectory]) -> Figure:
    """Norm of the external acceleration, and of its error in each mode (Figure 5)."""
    figure = Figure(figsize=(10, 7), layout="constrained")
    panels = figure.subplots(1 + len(estimates), 1, sharex=True)
    true = np.linalg.norm(record.truth["external_acceleration"], axis=1)
    panels[0].plot(record.truth.time, true, color=TRUTH_COLOUR, label="external acceleration, truth")
    for axis, (mode, estimate) in zip(panels[1:], estimates.items(), strict=True):
        error = np.linalg.norm(acceleration_error(record, estimate), axis=1)
        axis.plot(estimate.time, error, color=COLOURS[mode - 1], label=f"error of {_MODES[mode]}")
    for axis in panels:
        axis.set_ylabel("m/s²")
        axis.set_ylim(bottom=0)
        axis.legend(loc="upper left")
        axis.grid(alpha=0.3)
    panels[-1].set_xlabel("time (s)")
    return figure


def sweep(seeds: Sequence[Seed], printed: Mapping[str, Mapping[float, tuple[float, float]]]) -> Figure:
    """Roll and pitch RMSE (deg) of mode 1 over c_a: median and quartiles of the seeds, and Table II.

    printed: roll and pitch (deg) by test and c_a.
    """
    figure = Figure(figsize=(11, 4), layout="constrained")
    for axis, name in zip(figure.subplots(1, len(DURATION)), DURATION, strict=True):
        for place, angle in enumerate(("roll", "pitch")):
            found = np.array([[getattr(seed.c_a[name][c_a], angle) for c_a in C_A] for seed in seeds])
            low, middle, high = np.quantile(found, (0.25, 0.5, 0.75), axis=0)
            axis.plot(C_A, middle, color=COLOURS[place], label=f"{angle}, median and quartiles")
            axis.fill_between(C_A, low, high, color=COLOURS[place], alpha=0.2, linewidth=0)
            paper = [printed[name][c_a][place] for c_a in C_A]
            axis.plot(C_A, paper, "o", color=COLOURS[place], markerfacecolor="none", label=f"{angle}, printed")
        _finish(axis, f"Test {name}")
    figure.axes[0].set_ylabel("RMSE (deg)")
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


def _finish(axis: Axes, title: str) -> None:
    axis.set(title=title, xscale="log", yscale="log", xlabel="part of the acceleration kept, c_a (1)")
    axis.yaxis.set_major_formatter("{x:g}")
    axis.yaxis.set_minor_formatter("")
    axis.grid(alpha=0.3, which="both")
