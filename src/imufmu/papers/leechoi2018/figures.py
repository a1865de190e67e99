"""Figures of the experiments on Lee, Choi 2018."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from ...blocks.running import Trajectory
from ...pictures.figures import COLOURS, TRUTH_COLOUR
from ...scoring.metrics import angle_difference
from .runs import ORDERS, RATES, TESTS, Results, attitude_error

_ENLARGED = (12.0, 22.0)  # s, in the middle of the movement


def bars(results: Results, printed: Mapping[tuple[str, int], tuple[float, ...]]) -> Figure:
    """Averaged attitude RMSE over rate and order, one panel per test; printed: by test and rate, one per order."""
    figure = Figure(figsize=(10, 3.8), layout="constrained")
    width = 0.26
    places = np.arange(len(RATES))
    for axis, test in zip(figure.subplots(1, len(TESTS)), TESTS, strict=True):
        for i, (tried, colour) in enumerate(zip(ORDERS, COLOURS, strict=False)):
            at = places + (i - 1) * width
            ours = [results.mean(test.name, rate, tried.name) for rate in RATES]
            axis.bar(at, ours, width, color=colour, label=f"{tried.name} order")
            theirs = [printed[test.name, rate][i] for rate in RATES]
            axis.plot(at, theirs, "_", color=TRUTH_COLOUR, markersize=9, label="printed")
        axis.set(title=f"Test {test.name} ({test.speed})", xticks=places, xlabel="sample rate (Hz)")
        axis.set_xticklabels([str(rate) for rate in RATES])
        axis.grid(axis="y", alpha=0.3)
    figure.axes[0].set_ylabel("attitude RMSE (deg)")
    return _with_legend(figure)


def history(truth: Trajectory, estimates: Mapping[str, Trajectory]) -> Figure:
    """Pitch and attitude errors of one run over time, and 10 s of them enlarged."""
    figure = Figure(figsize=(10, 5), layout="constrained")
    axes = figure.subplots(2, 2, sharex="col", sharey="row")
    for (name, estimate), colour in zip(estimates.items(), COLOURS, strict=False):
        pitch = np.rad2deg(angle_difference(estimate["pitch"], truth["pitch"]))
        for row, error in zip(axes, (pitch, attitude_error(estimate, truth)), strict=True):
            for axis in row:
                axis.plot(truth.time, error, color=colour, linewidth=1.0, label=f"{name} order")
                axis.grid(alpha=0.3)
    for row, label in zip(axes, ("pitch error (deg)", "attitude error (deg)"), strict=True):
        row[0].set_ylabel(label)
    axes[1, 1].set_xlim(*_ENLARGED)
    for axis in axes[1]:
        axis.set_xlabel("time (s)")
    return _with_legend(figure)


def _with_legend(figure: Figure) -> Figure:
    """One legend for all panels, each label once."""
    handles, labels = figure.axes[0].get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))
    figure.legend(once.values(), once.keys(), loc="outside lower center", ncols=len(once))
    return figure
