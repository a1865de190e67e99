"""Tables of a benchmark, and its scores as files.

All but the tables of the inclination RMSE are of one contest, with parameters for real recordings and each recording's
own delay of the truth. The limit of a recording is LIMIT_RATIO times the RMSE of VQF plus LIMIT_DEG: a filter over it
does worse there than chance would have it.
"""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..files.atomic import atomic_write, check_not_read
from ..reports.page import Section
from ..scoring.table import Table
from .heading import heading_tables
from .recordings import DELAY, FAR, Benchmark, Score
from .sources import grouped
from .starts import start_tables

REFERENCE = "VQF"
LIMIT_RATIO, LIMIT_DEG = 1.3, 0.2
HONEST = (0.3, 3.0)  # NEES
WORST = 3  # recordings of each filter


def tables(result: Benchmark) -> list[Section]:
    """Inclination per contest and delay; what each filter is worth beside VQF; honesty; starts; heading."""
    contests = dict.fromkeys(s.contest for s in result.scores)
    found = [section for contest in contests for section in _inclination(result, contest)]
    found += [*_beside_reference(result), *_worst(result), *_honesty(result)]
    return [*found, *start_tables(result.starts, result.kinds), *heading_tables(result.headings, result.groups)]


def _inclination(result: Benchmark, contest: str) -> list[Section]:
    """One table against the truth as recorded, and one with the delays of the recordings where they have any."""
    scores = [s for s in result.scores if s.contest == contest]
    delays = sorted({s.delay for s in scores if s.own} - {0.0})
    views = [("truth as recorded", [s for s in scores if s.delay == 0])]
    if delays:
        whose = "" if all(s.delay for s in scores if s.own) else " where it is BROAD's"
        views.append((f"truth delayed by {1e3 * delays[0]:g} ms{whose}", [s for s in scores if s.own]))
    return [_means(result, f"Inclination RMSE (deg), {contest}, {truth}", some) for truth, some in views]


def _means(result: Benchmark, heading: str, scores: Sequence[Score]) -> Section:
    listed = (s for s in scores if s.parameters and not s.contender.endswith(s.parameters))
    parameters = dict.fromkeys(f"{s.contender}: {s.parameters}" for s in listed)
    delay = max(s.delay for s in scores)
    why = f"each sample against the truth of {1e3 * delay:g} ms before"
    if delay == DELAY and all(s.is_broad for s in scores if s.delay):
        why += ": in every trial of BROAD it is ahead by that"
    table = _by_group(result, scores, lambda s: s.inclination_rmse_deg)
    return Section(heading, table=table, points=[*([why] if delay else []), *parameters])


def _by_group(
    result: Benchmark, scores: Sequence[Score], measure: Callable[[Score], float], scale: float = 1.0, digits: int = 2
) -> Table:
    """Means of a measure: a row per group, or per recording without groups; a column per filter."""
    contenders = list(dict.fromkeys(s.contender for s in scores))
    groups_of = {s.recording: s.groups for s in scores}
    chosen = grouped(groups_of, result.groups)
    if not result.groups:
        chosen += [(name, {name}) for name in groups_of]

    def row(label: str, members: set[str]) -> list[str]:
        some = [s for s in scores if s.recording in members]
        means = (np.mean([measure(s) for s in some if s.contender == name]) for name in contenders)
        return [label, *(f"{scale * mean:.{digits}f}" for mean in means)]

    return Table(["recordings", *contenders], [row(*one) for one in chosen])


def _judged(result: Benchmark) -> list[Score]:
    return [s for s in result.scores if s.contest == result.judged and s.own]


def _reference(result: Benchmark) -> dict[str, float]:
    """RMSE (deg) of VQF by recording; empty where it is not installed."""
    return {s.recording: s.inclination_rmse_deg for s in _judged(result) if s.contender == REFERENCE}


def limit(reference_deg: float) -> float:
    """What a filter must not exceed on a recording where VQF has this RMSE (deg)."""
    return LIMIT_RATIO * reference_deg + LIMIT_DEG


def _beside_reference(result: Benchmark) -> list[Section]:
    """Ratio to the RMSE of VQF per group, and how often the limit is exceeded."""
    reference = _reference(result)
    scores = [s for s in _judged(result) if s.contender != REFERENCE] if reference else []
    if not scores:
        return []
    table = _by_group(result, scores, lambda s: s.inclination_rmse_deg / reference[s.recording])
    over = {name: 0 for name in table.columns[1:]}
    for s in scores:
        over[s.contender] += s.inclination_rmse_deg > limit(reference[s.recording])
    last = [f"recordings over {LIMIT_RATIO:g} {REFERENCE} + {LIMIT_DEG:g} deg", *map(str, over.values())]
    heading = f"Ratio to the inclination RMSE of {REFERENCE} on the same recording, {result.judged}"
    return [Section(heading, table=Table(table.columns, [*table.rows, last]))]


def _worst(result: Benchmark) -> list[Section]:
    """Of each filter the recordings that are furthest over the limit, or nearest to it; without VQF by RMSE."""
    reference, scores = _reference(result), _judged(result)
    if len({s.recording for s in scores}) <= WORST:
        return []

    def badness(s: Score) -> float:
        return s.inclination_rmse_deg / (limit(reference[s.recording]) if reference else 1.0)

    rows = []
    for name in dict.fromkeys(s.contender for s in scores):
        some = sorted((s for s in scores if s.contender == name), key=badness, reverse=True)[:WORST]
        for s in some if name != REFERENCE else []:
            beside = [f"{reference[s.recording]:.2f}", f"{badness(s):.2f}"] if reference else []
            rows.append([name, s.recording, f"{s.inclination_rmse_deg:.2f}", *beside])
    columns = ["filter", "recording", "RMSE (deg)"]
    columns += [f"{REFERENCE} (deg)", f"part of {LIMIT_RATIO:g} {REFERENCE} + {LIMIT_DEG:g} deg"] if reference else []
    return [Section(f"Worst recordings of each filter, {result.judged}", table=Table(columns, rows, words=True))]


def _honesty(result: Benchmark) -> list[Section]:
    """What tilt_std is worth, of every filter that has one."""
    scores = [s for s in _judged(result) if math.isfinite(s.nees)]
    if not scores:
        return []
    nees = _by_group(result, scores, lambda s: s.nees)
    near = _by_group(result, scores, lambda s: s.near, 100, 1)
    by_filter = {name: [s.nees for s in scores if s.contender == name] for name in nees.columns[1:]}
    low, high = HONEST
    rows = [
        ["smallest", *(f"{min(values):.2f}" for values in by_filter.values())],
        ["largest", *(f"{max(values):.2f}" for values in by_filter.values())],
        [f"recordings below {low:g}", *(str(sum(v < low for v in values)) for values in by_filter.values())],
        [f"recordings above {high:g}", *(str(sum(v > high for v in values)) for values in by_filter.values())],
    ]
    return [
        Section(
            f"NEES of the inclination, {result.judged}",
            table=Table(nees.columns, [*nees.rows, *rows]),
            points=[f"1 is an honest tilt_std, more is too sure; {low:g} to {high:g} will do"],
        ),
        Section(f"% of the time with an error below {FAR:g} tilt_std, {result.judged}", table=near),
    ]


def write_scores(path: Path, result: Benchmark) -> None:
    """Write every score as a row of a CSV file. Raises WriteError."""
    check_not_read(path, result.files)
    columns = ["contest", "filter", "parameters", "truth_delay_s", "recording", "groups", "inclination_rmse_deg"]
    with atomic_write(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*columns, "nees", "below_3_tilt_std"])
        for s in result.scores:
            row = [s.contest, s.contender, s.parameters, s.delay, s.recording, " ".join(s.groups)]
            writer.writerow([*row, *(f"{v:.17g}" for v in (s.inclination_rmse_deg, s.nees, s.near))])


def write_json(path: Path, result: Benchmark) -> None:
    """Write all scores and the tables as printed; a number that is not finite becomes null. Raises WriteError."""
    check_not_read(path, result.files)
    content = {
        "imufmu": __version__,
        "groups": list(result.groups),
        "scores": [asdict(s) for s in result.scores],
        "starts": [asdict(s) for s in result.starts],
        "headings": [asdict(s) for s in result.headings],
        "notes": list(result.notes),
        "tables": [
            {"heading": s.heading, "columns": list(s.table.columns), "rows": [list(row) for row in s.table.rows]}
            for s in tables(result)
            if s.table
        ],
    }
    with atomic_write(path) as temporary:
        text = json.dumps(_finite(content), indent=2, ensure_ascii=False, allow_nan=False)
        temporary.write_text(text + "\n", encoding="utf-8")


def _finite(content: Any) -> Any:
    if isinstance(content, Mapping):
        return {key: _finite(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [_finite(value) for value in content]
    return None if isinstance(content, float) and not math.isfinite(content) else content
