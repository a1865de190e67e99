"""Score filters on a folder of real recordings with truth: inclination RMSE, per group of BROAD [1] and in the mean.

Every filter with the parameters of its paper and the readings as recorded; then with parameters for real recordings
(``contenders``), and without the gyroscope bias of the rest that a recording begins with, unless the filter finds the
bias by itself. Filters of others take part in both.

Estimators of heading and VQF with its magnetometer are compared by ``benchmark_heading``.

The truth comes from another clock than the readings. In BROAD it is ahead by a constant 2.3 ms, in every trial: at 5
rad/s that alone is 0.7 deg. So every filter is scored there against the truth as recorded and the delayed truth.

[1] Laidig, Caruso, Cereatti, Seel, BROAD - A Benchmark for Robust Inertial Orientation Estimation, Data 6(7), 2021,
    doi:10.3390/data6070072
"""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..files.atomic import atomic_write, check_not_read
from ..papers.experiment import Progress
from ..recordings.reading import Recording, RecordingError, read
from ..reports.page import Section
from ..scoring import metrics
from ..scoring.table import Table
from .contenders import Contender, Readings, with_magnetometer, with_papers_parameters, with_real_parameters
from .heading import HeadingScore, heading_scores, heading_tables
from .peers import heading_peers, peers
from .starts import StartScore, start_scores, start_tables

DELAY = 0.0023  # s, of the readings of BROAD against its truth
REST = 3.0  # s
GROUPS_FILE = "trials.json"

_STEADY = 0.02  # rad/s; a gyroscope at rest scatters less
_LARGEST_BIAS = 0.2  # rad/s


@dataclass(frozen=True)
class Score:
    """One filter on one recording. delay: of the truth, s. groups: those that the recording belongs to.

    nees: mean square of the inclination error over tilt_std^2: 1 is honest, more is too sure; NaN without tilt_std.
    """

    contest: str
    contender: str
    parameters: str
    delay: float
    recording: str
    groups: Sequence[str]
    inclination_rmse_deg: float
    nees: float = math.nan
    is_broad: bool = False


@dataclass(frozen=True)
class Benchmark:
    """Every score, the names of the groups in their order, notes for the user, and the files that were read."""

    scores: Sequence[Score]
    groups: Sequence[str]
    notes: Sequence[str]
    headings: Sequence[HeadingScore] = ()
    starts: Sequence[StartScore] = ()
    files: Sequence[Path] = ()


@dataclass(frozen=True)
class _Contest:
    title: str
    contenders: Sequence[Contender]
    rest: float  # s of rest whose mean gyro is subtracted; 0: none


def benchmark(
    folder: Path,
    names: Sequence[str] = (),
    *,
    delay: float | None = None,
    rest: float = REST,
    starts: int = 0,
    progress: Progress | None = None,
) -> Benchmark:
    """Run the estimators of these names, or all, and the installed peers over every recording with truth in a folder.

    delay: of the truth, s, beside no delay; None: DELAY for trials of BROAD, and none for other recordings, of whose
    clocks nothing is known. rest: how much of a recording's start is rest, s; 0 leaves the gyro as it is. starts: how
    often to begin anew inside the motion of each recording. Raises ValueError for an unknown estimator or a folder with
    nothing to score.
    """
    calibrated = f", gyro bias of the first {rest:g} s removed" if rest else ""
    contests = [
        _Contest("parameters of the papers", [*with_papers_parameters(names), *peers()], 0.0),
        _Contest(f"parameters for real recordings{calibrated}", [*with_real_parameters(names), *peers()], rest),
    ]
    known = {contender.name for contest in contests for contender in contest.contenders}
    with_heading = [*(c for c in with_magnetometer() if not names or c.name in known), *heading_peers()]
    paths = recordings_in(folder)
    order, groups_of = _broad_groups(folder / GROUPS_FILE)
    scores: list[Score] = []
    headings: list[HeadingScore] = []
    begun: list[StartScore] = []
    notes: list[str] = []
    for done, path in enumerate(paths):
        try:
            recording = read(path)
            own = (DELAY if recording.is_broad else 0.0) if delay is None else delay
            truths = {d: _delayed(recording, d) for d in dict.fromkeys((0.0, own))}
            scores += _scores(recording, truths, contests, groups_of.get(recording.name, ()), notes)
            begun += start_scores(recording, truths[own], starts, contests[1].contenders)
            headings += heading_scores(recording, groups_of.get(recording.name, ()), with_heading)
        except (RecordingError, _NothingToScore) as fault:
            notes.append(f"left out: {fault}")
        if progress:
            progress(done + 1, len(paths))
    if not scores:
        found = f"; {notes[0]}" if notes else ", or .mat files of BROAD"
        raise ValueError(f"{folder}: no recording to score: put .csv files with a truth there{found}")
    groups = [name for name in order if any(name in s.groups for s in scores)]
    return Benchmark(scores, groups, notes, headings, begun, tuple(paths))


class _NothingToScore(ValueError):
    """A recording without a vertical that counts; the message names it."""


def recordings_in(folder: Path) -> list[Path]:
    """Every file in a folder that is read as a recording. Raises ValueError if there is no such folder."""
    try:
        return sorted(path for path in folder.iterdir() if path.suffix.lower() in (".csv", ".mat"))
    except OSError as error:
        raise ValueError(f"{folder}: cannot list the folder: {error.strerror}") from None


def _delayed(recording: Recording, delay: float) -> np.ndarray:
    """True up vector (n, 3) of ``delay`` s before each row; NaN where that is unknown or does not count."""
    if "vertical" not in recording.truth:
        raise _NothingToScore(f"{recording.path}: no true attitude")
    vertical, time = recording.truth["vertical"].copy(), recording.time
    if delay:
        earlier = (np.interp(time - delay, time, c, left=np.nan, right=np.nan) for c in vertical.T)
        vertical = np.column_stack(list(earlier))
    vertical[~recording.scored] = np.nan
    if not np.isfinite(vertical).all(axis=1).any():
        raise _NothingToScore(f"{recording.path}: no sample counts")
    return vertical


def _scores(
    recording: Recording,
    truths: Mapping[float, np.ndarray],
    contests: Sequence[_Contest],
    groups: Sequence[str],
    notes: list[str],
) -> Iterator[Score]:
    for contest in contests:
        as_recorded = {name: recording.at_instants()[name] for name in ("gyro", "accel")}
        without_bias = _without_bias(recording, as_recorded, contest.rest, notes)
        for contender in contest.contenders:
            readings = as_recorded if contender.finds_bias else without_bias
            signals = contender.estimate(readings, recording.sample_period)
            vertical_hat = signals["vertical"][recording.sample_index]
            std = (
                signals["tilt_std"][recording.sample_index]
                if "tilt_std" in signals
                else np.full(len(vertical_hat), np.nan)
            )
            for delay, vertical in truths.items():
                counts = np.isfinite(vertical).all(axis=1)
                error = metrics.inclination_error(vertical_hat[counts], vertical[counts])
                rmse = float(np.rad2deg(metrics.rms(error)))
                yield Score(
                    contest.title,
                    contender.name,
                    " ".join(f"{name}={value:.4g}" for name, value in contender.parameters.items()),
                    delay,
                    recording.name,
                    groups,
                    rmse,
                    float(np.mean((error / std[counts]) ** 2)),
                    recording.is_broad,
                )


def _without_bias(recording: Recording, readings: Readings, rest: float, notes: list[str]) -> Readings:
    """The readings less the mean gyro of the first ``rest`` s; as they are where that was no rest."""
    if not rest:
        return readings
    gyro = recording.gyro[recording.time < recording.time[0] + rest]
    gyro = gyro[np.isfinite(gyro).all(axis=1)]
    is_rest = len(gyro) and gyro.std(axis=0).max() < _STEADY and np.abs(gyro.mean(axis=0)).max() < _LARGEST_BIAS
    if not is_rest:
        notes.append(f"{recording.name}: its first {rest:g} s are no rest; gyro bias left in")
        return readings
    return {**readings, "gyro": readings["gyro"] - gyro.mean(axis=0)}


def _broad_groups(path: Path) -> tuple[list[str], dict[str, list[str]]]:
    """Names of the groups in their order, and the groups of each trial, as BROAD lists them beside its files."""
    if not path.is_file():
        return [], {}
    try:
        content: Any = json.loads(path.read_text(encoding="utf-8"))
        order = [group["name"] for group in content["groups"]]
        return order, {name: list(trial["groups"]) for name, trial in content["trials"].items()}
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as fault:
        raise ValueError(f"{path}: not the list of trials that comes with BROAD ({fault!r})") from None


def tables(result: Benchmark) -> list[Section]:
    """One table per contest and delay: a row per group, or per recording without groups; a column per filter."""
    contests = dict.fromkeys((s.contest, s.delay) for s in result.scores)
    found = [_table(result, contest, delay) for contest, delay in contests]
    return [*found, *_honesty(result), *start_tables(result.starts), *heading_tables(result.headings, result.groups)]


def _table(result: Benchmark, contest: str, delay: float) -> Section:
    scores = [s for s in result.scores if (s.contest, s.delay) == (contest, delay)]
    contenders = list(dict.fromkeys(s.contender for s in scores))
    recordings = list(dict.fromkeys(s.recording for s in scores))

    def row(label: str, members: set[str]) -> list[str]:
        chosen = [s for s in scores if s.recording in members]
        means = [np.mean([s.inclination_rmse_deg for s in chosen if s.contender == name]) for name in contenders]
        return [label, *(f"{mean:.2f}" for mean in means)]

    rows = [row(f"mean of {len(recordings)}", set(recordings))]
    for group in result.groups:
        members = {s.recording for s in scores if group in s.groups}
        if len(members) < len(recordings):
            rows.append(row(f"{group} ({len(members)})", members))
    if not result.groups:
        rows += [row(name, {name}) for name in recordings]
    truth = f"truth delayed by {1e3 * delay:g} ms" if delay else "truth as recorded"
    listed = (s for s in scores if s.parameters and not s.contender.endswith(s.parameters))
    parameters = dict.fromkeys(f"{s.contender}: {s.parameters}" for s in listed)
    why = f"each sample against the truth of {1e3 * delay:g} ms before"
    if delay == DELAY and all(s.is_broad for s in scores):
        why += ": in every trial of BROAD it is ahead by that"
    points = [*([why] if delay else []), *parameters]
    heading = f"Inclination RMSE (deg), {contest}, {truth}"
    return Section(heading, table=Table(["recordings", *contenders], rows), points=points)


def _honesty(result: Benchmark) -> list[Section]:
    """NEES of every filter with a tilt_std, per recording, against the most delayed truth."""
    latest = {s.recording: s.delay for s in sorted(result.scores, key=lambda s: s.delay)}
    real = (s for s in result.scores if "real" in s.contest and s.delay == latest[s.recording])
    scores = [s for s in real if math.isfinite(s.nees)]
    if not scores:
        return []
    contenders = list(dict.fromkeys(s.contender for s in scores))
    by_place = {(s.recording, s.contender): s.nees for s in scores}
    recordings = list(dict.fromkeys(s.recording for s in scores))
    rows = [[name, *(f"{by_place[name, c]:.2f}" for c in contenders)] for name in recordings]
    heading = "NEES of the inclination, parameters for real recordings: 1 is an honest tilt_std, more is too sure"
    return [Section(heading, table=Table(["recording", *contenders], rows))]


def write_scores(path: Path, result: Benchmark) -> None:
    """Write every score as a row of a CSV file. Raises WriteError."""
    check_not_read(path, result.files)
    with atomic_write(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(
            ["contest", "filter", "parameters", "truth_delay_s", "recording", "groups", "inclination_rmse_deg", "nees"]
        )
        for s in result.scores:
            row = [s.contest, s.contender, s.parameters, s.delay, s.recording, " ".join(s.groups)]
            writer.writerow([*row, f"{s.inclination_rmse_deg:.17g}", f"{s.nees:.17g}"])
