"""Figures of the experiments on Rizun 2008: the paper's Figures 2, 5 and 6 from our runs, and one run over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...pictures.figures import COLOURS, TRUTH_COLOUR
from ...scoring import prediction
from .runs import CASES, DELTA_N, DELTA_V, OMEGA_C, OMEGA_G, OWN_CUTOFF, PERIOD, TURNING

_SEGMENT = 10_000  # samples of one periodogram: 200 s


def spectra(gravity_errors: Sequence[np.ndarray]) -> Figure:
    """Left: assumed spectra and responses (Figure 2). Right: error spectrum of records (n, 3), m/s2 (Figure 5)."""
    figure = Figure(figsize=(10, 4), layout="constrained")
    assumed, error = figure.subplots(1, 2)
    omega = np.geomspace(0.01, 100, 300)
    second, first = (prediction.wiener_response(omega, OMEGA_G), prediction.first_order_response(omega, OWN_CUTOFF))
    curves = {
        "gravity that the gyroscope lost, (20)": prediction.signal_spectrum(omega, DELTA_N),
        "acceleration, (15)": prediction.acceleration_spectrum(omega, DELTA_V, OMEGA_C),
        "|H|², second order, (34)": np.abs(second) ** 2,
        "|H|², first order at its optimum": np.abs(first) ** 2,
    }
    for (label, curve), colour in zip(curves.items(), COLOURS, strict=False):
        assumed.loglog(omega, curve, color=colour, label=label)
    assumed.set(ylim=(1e-6, 1e3), ylabel="PSD ((m/s²)²/Hz, two-sided) or |H|²")
    measured_at, measured = periodogram(gravity_errors)
    near = np.linspace(0.005, 1.0, 300)
    error.plot(measured_at, measured, ".", color=COLOURS[1], label="simulated, horizontal")
    error.plot(near, prediction.optimal_error_spectrum(near, DELTA_N, DELTA_V), color=TRUTH_COLOUR, label="(42)")
    error.set(xlim=(0, 1), ylim=(0, None), ylabel="PSD of the error ((m/s²)²/Hz, two-sided)")
    for axis in (assumed, error):
        _finish(axis, "angular frequency (rad/s)")
    return figure


def periodogram(gravity_errors: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies (rad/s) and two-sided density per Hz of the horizontal components, averaged over half-overlapping
    Hann windows of all records (n, 3)."""
    window = np.hanning(_SEGMENT)
    found = []
    for record in gravity_errors:
        for first in range(0, len(record) - _SEGMENT + 1, _SEGMENT // 2):
            transform = np.fft.rfft(window[:, None] * record[first : first + _SEGMENT, :2], axis=0)
            found.append((np.abs(transform) ** 2).mean(axis=1))
    density = np.mean(found, axis=0) * PERIOD / np.sum(window**2)
    omega = 2 * np.pi * np.fft.rfftfreq(_SEGMENT, PERIOD)
    return omega[2:], density[2:]  # the window mixes the mean into the first two


def slosh(simulated: Mapping[str, float]) -> Figure:
    """RMS tilt (deg, by label of the case) over slosh, for a fixed and for an ever optimal filter (Figure 6)."""
    figure = Figure(figsize=(7, 4), layout="constrained")
    axis = figure.subplots()
    a = np.linspace(0.02, 2.5, 200)
    fixed, optimal = prediction.tilt_rms(DELTA_N, DELTA_V, a), prediction.tilt_rms(DELTA_N, a * DELTA_V)
    axis.plot(a, np.rad2deg(fixed), color=COLOURS[1], label="filter for 1 m/s/√Hz, (50)")
    axis.plot(a, np.rad2deg(optimal), "--", color=COLOURS[2], label="filter for the slosh there is")
    for case in CASES:
        turns = case is TURNING
        marker, label = ("x", "simulated, turning at 2 rad/s") if turns else ("o", "simulated, at rest")
        axis.plot(case.a, simulated[case.label], marker, color=TRUTH_COLOUR, fillstyle="none", label=label)
    axis.set(ylabel="tilt error, RMS (deg)", ylim=(0, None))
    _finish(axis, "slosh (m/s/√Hz)")
    return figure


def history(time: np.ndarray, tilts: Mapping[str, np.ndarray], tilt_std: np.ndarray) -> Figure:
    """Tilt errors (n,), rad, by label over time (s), and the filter's own one-sigma (rad)."""
    figure = Figure(figsize=(10, 3.5), layout="constrained")
    axis = figure.subplots()
    for (label, tilt), colour in zip(tilts.items(), COLOURS, strict=False):
        axis.plot(time, np.rad2deg(tilt), color=colour, linewidth=0.8, label=label)
    axis.plot(time, np.rad2deg(tilt_std), "--", color=TRUTH_COLOUR, label="tilt_std of rizun2008")
    axis.set(ylabel="tilt error (deg)", ylim=(0, 1.1 * np.rad2deg(max(tilt.max() for tilt in tilts.values()))))
    _finish(axis, "time (s)")
    return figure


def _finish(axis: Axes, x_label: str) -> None:
    axis.set_xlabel(x_label)
    axis.grid(alpha=0.3)
    lines = {str(line.get_label()): line for line in axis.get_lines()}
    axis.legend(lines.values(), lines.keys(), fontsize="small")
