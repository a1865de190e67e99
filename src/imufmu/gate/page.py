"""The verdict for people: a table for the terminal, and a page with the run that decided each limit."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from .. import __version__
from ..blocks.drawing import Drawing
from ..cosim.errors import SimulationError
from ..files.atomic import atomic_write
from ..reports.page import Section, write_report
from ..scoring.checks import limit_text, margin_text, value_text
from ..scoring.table import Table as TextTable
from .judging import bound_in
from .judging import shown as in_shown_unit
from .limits import Limit
from .table import Table
from .trials import Plan
from .verdict import Outcome

_BROKEN = "#d55e00"  # of Okabe and Ito: told apart by the colour-blind, too


def verdict_table(outcome: Outcome) -> TextTable:
    """A row per limit."""
    rows = []
    for check in outcome.checks:
        margin = margin_text(check) if check.limit else ""  # no part of nothing
        found = ("holds" if check.passed else "BROKEN", value_text(check), limit_text(check), margin)
        rows.append([check.name, *found, check.where])
    return TextTable(["limit", "verdict", "value", "limit", "margin", "where it was worst"], rows, words=True)


def summary(outcome: Outcome) -> str:
    """The verdict in one sentence."""
    broken = [check.name for check in outcome.checks if not check.passed]
    runs = f"{outcome.runs} run{'s' * (outcome.runs != 1)}"
    if not broken:
        return f"{outcome.name}: every limit holds ({len(outcome.checks)} of {len(outcome.checks)}, {runs})"
    return f"{outcome.name}: {len(broken)} of {len(outcome.checks)} limits broken ({runs}): {'; '.join(broken)}"


def write_json(path: Path, outcome: Outcome) -> None:
    """Everything but the figures; a number that is not finite becomes null. Raises WriteError."""
    checks = [asdict(check) | {"margin": check.margin, "passed": check.passed} for check in outcome.checks]
    content = {
        "imufmu": __version__,
        "system": outcome.name,
        "passed": outcome.passed,
        "runs": outcome.runs,
        "planned": outcome.planned,
        "seconds": outcome.seconds,
        "limits": [
            {k: None if isinstance(v, float) and not np.isfinite(v) else v for k, v in check.items()}
            for check in checks
        ],
        "notes": list(outcome.notes),
    }
    with atomic_write(path) as temporary:
        text = json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False)
        temporary.write_text(text + "\n", encoding="utf-8")


def _finite(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value


def write_page(path: Path, plan: Plan, limits: Sequence[Limit], outcome: Outcome) -> None:
    """The verdict and, per limit, the run that decided it, which is made once more. Raises WriteError."""
    sections = [Section("Verdict", "", verdict_table(outcome), points=outcome.notes)]
    system = plan.read()
    tables: dict[int | None, Table] = {}
    for limit, check, seed in zip(limits, outcome.checks, outcome.worst, strict=True):
        text = f"{value_text(check)}, limit {limit_text(check)}. {check.reason}".strip()
        try:
            if seed not in tables:
                tables[seed] = Table(plan.run(system, seed))
            figure = _figure(limit, tables[seed])
        except (ValueError, SimulationError) as error:  # the run failed, which is the finding
            sections.append(Section(check.name, f"{text} {error}", level=3))
            continue
        caption = "Rows that break the limit are shaded." + ("" if seed is None else f" Seed {seed}.")
        sections.append(Section(check.name, text, figure=figure, caption=caption, level=3))
    write_report(path, outcome.name, summary(outcome), sections)


def _figure(limit: Limit, table: Table) -> Figure:
    """The quantity over time, or of a condition its distance from turning, with the rows that break it."""
    value = limit.quantity.evaluate(table)
    drawn = value.values if value.robustness is None else value.robustness
    drawn = np.where(value.known, np.broadcast_to(drawn, table.time.shape), np.nan)
    unit, factor = in_shown_unit(value.unit)
    figure = Drawing(figsize=(8, 2.6), layout="constrained")
    axis = figure.subplots()
    axis.plot(table.time, factor * drawn, linewidth=1.0, color="#0072b2")
    broken = _broken(limit, table)
    if broken.any():
        low, high = axis.get_ylim()
        axis.fill_between(table.time, low, high, where=broken, color=_BROKEN, alpha=0.25, linewidth=0)
        axis.set_ylim(low, high)
    axis.set_xlabel("time (s)")
    axis.set_ylabel(f"({unit})" if value.robustness is None else f"distance from turning false ({unit})")
    axis.set_title(limit.quantity.text, fontsize="medium")
    axis.grid(alpha=0.3)
    return figure


def _broken(limit: Limit, table: Table) -> np.ndarray:
    """Rows (n,) beyond the bounds of a statistic, or in which a condition is false."""
    value = limit.quantity.evaluate(table)
    if value.robustness is not None:
        return np.broadcast_to(value.known & (value.robustness < 0), table.time.shape)
    size = np.abs(value.values) if limit.statistic in ("rmse", "max", "p95") else value.values
    beyond = np.zeros(len(table.time), bool)
    if limit.at_most is not None and limit.statistic not in ("nees", "settling_time"):
        beyond |= size > bound_in(limit.at_most, value.unit or "1", limit)
    if limit.at_least is not None and limit.statistic not in ("nees", "settling_time"):
        beyond |= size < bound_in(limit.at_least, value.unit or "1", limit)
    return value.known & beyond
