"""Verdicts of the papers' experiments for people (tables, an HTML page) and for programs (JSON)."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from .. import __version__
from ..files.atomic import atomic_write
from ..reports.page import Section, write_report
from ..scoring.checks import Check, limit_text, value_text
from ..scoring.table import Table
from .validate import Verdict

_LEAD = (
    "The experiments of the papers, done again on synthetic motions with the papers' statistics, since the recordings "
    "are not public. Each criterion has a limit with a reason; the margin is the distance from the limit as a part of "
    "it."
)
_QUICK = " This was a quick run, with fewer seeds."


def verdict_table(verdicts: Sequence[Verdict]) -> Table:
    """One row per paper. The smallest margin is that of the criteria which are not met to the digit, as counts are."""
    rows = []
    for v in verdicts:
        margins = [_margin(check) for check in v.checks if check.value != check.limit]
        rows.append([v.name, _word(v.passed), *_counts(v), _percent(min(margins, default=math.inf)), _time(v)])
    return Table(["paper", "result", "checks passed", "failed", "smallest margin", "seconds"], rows)


def failure_table(verdicts: Sequence[Verdict]) -> Table | None:
    """One row per criterion that is not met, and per paper that broke off; None if all is well."""
    rows: list[Sequence[str]] = []
    for verdict in verdicts:
        if verdict.error:
            rows.append([verdict.name, f"broke off: {verdict.error.strip().splitlines()[-1]}", "", "", "", ""])
        elif not verdict.checks:
            rows.append([verdict.name, "checks nothing", "", "", "", ""])
        rows += [
            [verdict.name, c.name, value_text(c), limit_text(c), _percent(_margin(c)), c.reason] for c in verdict.failed
        ]
    return (
        Table(["paper", "criterion not met", "value", "limit", "margin", "reason"], rows, words=True) if rows else None
    )


def write_page(path: Path, verdicts: Sequence[Verdict], quick: bool) -> None:
    """Write the HTML report. Raises WriteError."""
    sections = [Section("Verdict", table=verdict_table(verdicts))]
    failures = failure_table(verdicts)
    if failures:
        sections.append(Section("Criteria not met", table=failures, level=3))
    for verdict in verdicts:
        sections += _paper(verdict)
    write_report(path, "Do the papers' experiments reproduce?", _LEAD + (_QUICK if quick else ""), sections)


def _paper(verdict: Verdict) -> list[Section]:
    head = Section(verdict.title, f"{verdict.reference} ({_time(verdict)} s)".strip())
    if verdict.outcome is None:
        return [head]
    rows = []
    for check in verdict.checks:
        numbers = (value_text(check), limit_text(check), _percent(_margin(check)))
        unbroken = (text.replace(" ", "\N{NO-BREAK SPACE}") for text in numbers)
        rows.append([check.name, *unbroken, _word(check.passed), check.reason])
    checks = Table(["criterion", "value", "limit", "margin", "result", "reason"], rows, words=True)
    sections = [head, *(replace(section, level=3) for section in verdict.outcome.sections)]
    if verdict.remarks:
        sections.append(Section("Remarks: what does not reproduce, and why", points=verdict.remarks, level=3))
    return [*sections, Section("Checks", table=checks, level=3)]


def write_json(path: Path, verdicts: Sequence[Verdict], quick: bool) -> None:
    """Write everything but the figures; a number that is not finite becomes null. Raises WriteError."""
    content = {
        "imufmu": __version__,
        "quick": quick,
        "passed": all(verdict.passed for verdict in verdicts),
        "papers": [_plain(verdict) for verdict in verdicts],
    }
    with atomic_write(path) as temporary:
        text = json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False)
        temporary.write_text(text + "\n", encoding="utf-8")


def _plain(verdict: Verdict) -> dict[str, Any]:
    checks = [asdict(check) | {"margin": check.margin, "passed": check.passed} for check in verdict.checks]
    tables = [
        {
            "heading": s.heading,
            "text": s.text,
            "columns": list(s.table.columns),
            "rows": [list(r) for r in s.table.rows],
        }
        for s in (verdict.outcome.sections if verdict.outcome else ())
        if s.table
    ]
    return {
        "name": verdict.name,
        "title": verdict.title,
        "reference": verdict.reference,
        "passed": verdict.passed,
        "seconds": verdict.seconds,
        "error": verdict.error,
        "checks": [{key: _finite(value) for key, value in check.items()} for check in checks],
        "remarks": list(verdict.remarks),
        "tables": tables,
    }


def _finite(value: Any) -> Any:
    """The value, as a number of Python where it is one of NumPy; None where it is not finite."""
    if isinstance(value, str | bool):
        return value
    return float(value) if math.isfinite(value) else None


def _margin(check: Check) -> float:
    """The margin, of a value or limit that is not finite the worst or best there is."""
    return check.margin if math.isfinite(check.margin) else math.copysign(math.inf, check.passed - 0.5)


def _percent(margin: float) -> str:
    return f"{100 * margin:.1f} %" if math.isfinite(margin) else "-"


def _word(passed: bool) -> str:
    return "passed" if passed else "failed"


def _counts(verdict: Verdict) -> tuple[str, str]:
    return str(len(verdict.checks) - len(verdict.failed)), str(len(verdict.failed))


def _time(verdict: Verdict) -> str:
    return f"{verdict.seconds:.1f}"
