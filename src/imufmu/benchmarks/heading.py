"""Heading by a magnetometer on real recordings: RMSE of every filter that uses one.

The heading error is that of BROAD [1]: the turn about the vertical in the error of the attitude, against the truth as
recorded. Truth and field agree about North only as well as somebody aligned them, so the RMSE is given once more
without the mean error of each recording: what is left is drift and disturbance. Readings as recorded.

[1] Laidig, Caruso, Cereatti, Seel, Data 6(7), 2021, doi:10.3390/data6070072
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..recordings.reading import Recording
from ..reports.page import Section
from ..scoring import metrics
from ..scoring.table import Table
from .contenders import Contender
from .sources import Source, grouped


@dataclass(frozen=True)
class HeadingScore:
    """One filter on one recording. aligned_rmse_deg: without the mean error."""

    contender: str
    recording: str
    groups: Sequence[str]
    rmse_deg: float
    aligned_rmse_deg: float


def heading_scores(source: Source, recording: Recording, contenders: Sequence[Contender]) -> Iterator[HeadingScore]:
    """Every filter on a recording with a magnetometer and a true attitude; nothing otherwise."""
    truth, readings = recording.truth.get("q_NS"), recording.at_instants()
    if truth is None or "mag" not in readings:
        return
    counts = recording.scored & np.isfinite(truth).all(axis=1)
    for contender in contenders:
        q_NS = contender.estimate(readings, recording.sample_period)["q_NS"][recording.sample_index]
        error = metrics.heading_error(q_NS[counts], truth[counts])
        mean = np.angle(np.mean(np.exp(1j * error)))
        both = (np.rad2deg(metrics.rms(e)) for e in (error, metrics.angle_difference(error, mean)))
        yield HeadingScore(contender.name, source.name, source.groups, *map(float, both))


def heading_tables(scores: Sequence[HeadingScore], groups: Sequence[str]) -> list[Section]:
    """One table: a row per group and recording, two columns per filter."""
    if not scores:
        return []
    contenders = list(dict.fromkeys(s.contender for s in scores))
    recordings = list(dict.fromkeys(s.recording for s in scores))

    def row(label: str, members: set[str]) -> list[str]:
        cells = []
        for name in contenders:
            chosen = [s for s in scores if s.contender == name and s.recording in members]
            cells += [
                f"{np.mean([s.rmse_deg for s in chosen]):.2f}",
                f"{np.mean([s.aligned_rmse_deg for s in chosen]):.2f}",
            ]
        return [label, *cells]

    groups_of = {s.recording: s.groups for s in scores}
    rows = [row(label, members) for label, members in grouped(groups_of, groups)]
    rows += [row(name, {name}) for name in recordings]
    header = [column for name in contenders for column in (name, f"{name}, aligned")]
    return [
        Section("Heading RMSE (deg), with magnetometer, truth as recorded", table=Table(["recordings", *header], rows))
    ]
