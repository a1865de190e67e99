"""Figures of merit as rows of text, the same on the terminal and in reports."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..cosim.results import Result
from ..scoring.systems import Comparison, compare_all
from ..scoring.table import Table

_SHOWN = {
    "roll_rmse_deg": "roll RMSE (deg)",
    "pitch_rmse_deg": "pitch RMSE (deg)",
    "heading_rmse_deg": "heading RMSE (deg)",
    "tilt_rmse_deg": "tilt RMSE (deg)",
    "tilt_max_deg": "tilt max (deg)",
    "external_acceleration_norm_rmse_m_s2": "|ext. acc.| RMSE (m/s²)",
}


def summary_table(first_column: str, summaries: Mapping[str, Mapping[str, float]]) -> Table:
    """One row per label of ``summaries``; columns for the figures that any of them has."""
    figures = [name for name in _SHOWN if any(name in summary for summary in summaries.values())]
    rows: list[Sequence[str]] = [
        [label, *(f"{summary[name]:.3f}" if name in summary else "" for name in figures)]
        for label, summary in summaries.items()
    ]
    return Table([first_column, *(_SHOWN[name] for name in figures)], rows)


def run_table(compared: Sequence[Comparison]) -> Table:
    """Errors and delay of every estimator of a run."""
    errors = summary_table("estimator", {c.component: c.summary for c in compared})
    columns = [*errors.columns, "tilt 95th percentile (deg)", "delay (ms)"]
    further = [[f"{c.summary['tilt_p95_deg']:.3f}", f"{1e3 * c.delay:.3f}"] for c in compared]
    return Table(columns, [[*row, *more] for row, more in zip(errors.rows, further, strict=True)])


def run_facts(result: Result, notes: Sequence[str]) -> dict[str, Any]:
    """What ``run_table`` shows and more, for programs: figures of every estimator with the unit in the name."""
    found, _ = compare_all(result)
    estimators = {c.component: {name: float(v) for name, v in c.summary.items()} | {"delay_s": c.delay} for c in found}
    span = {"start_time_s": float(result.time[0]), "stop_time_s": float(result.time[-1]), "rows": len(result.time)}
    return {"system": result.system, **span, "variables": result.names, "estimators": estimators, "notes": list(notes)}


def range_table(columns: Mapping[str, np.ndarray], units: Mapping[str, str]) -> Table:
    """Smallest, mean and largest value of every column (n,)."""
    rows = [
        [f"{name} ({units[name] or '1'})", *(f"{f(values):.6g}" for f in (np.min, np.mean, np.max))]
        for name, values in columns.items()
    ]
    return Table(["variable", "min", "mean", "max"], rows)
