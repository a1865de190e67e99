"""Score filters on real recordings with truth: inclination RMSE, per group and in the mean.

Every filter with the parameters of its paper and the readings as recorded; then with parameters for real recordings
(``contenders``), and without the gyroscope bias of the rest that a recording begins with, unless the filter finds the
bias by itself. Filters of others (``peers``) take part in both. Where wheels tell the speed, filters that take it are
scored once more. Starts inside a motion (``starts``) and the heading (``heading``) are scored beside.

The truth comes from another clock than the readings. In BROAD [1] it is ahead by a constant 2.3 ms, in every trial: at
5 rad/s that alone is 0.7 deg. So every filter is scored there against the truth as recorded and the delayed truth.

[1] Laidig, Caruso, Cereatti, Seel, BROAD - A Benchmark for Robust Inertial Orientation Estimation, Data 6(7), 2021,
    doi:10.3390/data6070072
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from ..files.names import no_such
from ..papers.experiment import Progress
from ..recordings.reading import Recording, RecordingError, read
from ..scoring import metrics
from .contenders import (
    Contender,
    Readings,
    Settings,
    check_settings,
    lagging_contenders,
    offline_contenders,
    with_magnetometer,
    with_papers_parameters,
    with_real_parameters,
    with_wheels,
)
from .heading import HeadingScore, heading_scores
from .peers import NAMES as PEERS
from .peers import heading_peers, offline_peers, peers
from .sources import Place, Source, sources
from .starts import StartScore, start_scores

DELAY = 0.0023  # s, of the readings of BROAD against its truth
REST = 3.0  # s
FAR = 3.0  # tilt_std; of a normal error 99 % in two directions are nearer

_STEADY = 0.02  # rad/s; a gyroscope at rest scatters less
_LARGEST_BIAS = 0.2  # rad/s


@dataclass(frozen=True)
class Score:
    """One filter on one recording. delay: of the truth, s; own: the one that is assumed of this recording.

    groups: those that the recording belongs to, its kind first. nees: mean square of the inclination error over
    tilt_std^2: 1 is honest, more is too sure. near: how much of the error is below FAR tilt_std. Both NaN without one.
    """

    contest: str
    contender: str
    parameters: str
    delay: float
    own: bool
    recording: str
    groups: Sequence[str]
    inclination_rmse_deg: float
    nees: float = math.nan
    near: float = math.nan
    is_broad: bool = False


@dataclass(frozen=True)
class Benchmark:
    """Every score, the names of the groups in their order, notes for the user, and the files that were read.

    kinds: the groups by folder or rule, first among ``groups``. judged: the contest that all but the first table is of.
    """

    scores: Sequence[Score]
    groups: Sequence[str]
    notes: Sequence[str]
    headings: Sequence[HeadingScore] = ()
    starts: Sequence[StartScore] = ()
    files: Sequence[Path] = ()
    kinds: Sequence[str] = ()
    judged: str = ""


@dataclass(frozen=True)
class _Contest:
    title: str
    contenders: Sequence[Contender]
    rest: float = 0.0  # s of rest whose mean gyro is subtracted; 0: none
    on_wheels: bool = False  # with the speed of the wheels, and only where there is one


def benchmark(
    places: Place | Iterable[Place],
    names: Sequence[str] = (),
    *,
    without: Iterable[str] = (),
    delay: float | None = None,
    rest: float = REST,
    starts: int = 0,
    group: str = "",
    lags: Sequence[float] = (),
    offline: bool = False,
    settings: Settings = MappingProxyType({}),
    progress: Progress | None = None,
) -> Benchmark:
    """Run the estimators of these names, or all, and the installed peers over every recording with truth.

    places: a folder, a file or a pattern, or several. group: a rule for groups (``sources``); without, a folder is one.
    delay: of the truth, s, beside no delay; None: DELAY for trials of BROAD, and none for other recordings, of whose
    clocks nothing is known. rest: how much of a recording's start is rest, s; 0 leaves the gyro as it is. starts: how
    often to begin anew inside the motion of each recording. lags: score plumb_lag, too, told so many seconds later.
    offline: score once more with the whole record known.
    settings: values by estimator.parameter, in place of those that it would run with. without: filters, also of others,
    to leave out. Raises ValueError for what cannot be among these, and where there is nothing to score.
    """
    check_settings(settings)
    contests = _contests(names, settings, rest, lags, offline, set(without))
    known = {contender.name for contest in contests for contender in contest.contenders}
    with_heading = [c for c in with_magnetometer(settings) if c.name in known or (not names and c.name not in without)]
    with_heading += [c for c in heading_peers() if c.name in known]
    found = sources(places, group)
    scores: list[Score] = []
    headings: list[HeadingScore] = []
    begun: list[StartScore] = []
    notes: list[str] = []
    restless: list[str] = []
    for done, source in enumerate(found.files):
        try:
            recording = read(source.path)
            own = (DELAY if recording.is_broad else 0.0) if delay is None else delay
            truths = {d: _delayed(recording, d) for d in dict.fromkeys((0.0, own))}
            scores += _scores(source, recording, truths, own, contests, restless)
            begun += start_scores(source, recording, truths[own], starts, contests[1].contenders)
            headings += heading_scores(source, recording, with_heading)
        except (RecordingError, _NothingToScore) as fault:
            notes.append(f"left out: {fault}")
        if progress:
            progress(done + 1, len(found.files))
    if restless:
        notes.append(f"no rest in the first {rest:g} s, so gyro bias left in: {', '.join(restless)}")
    if not scores:
        where = str(places) if isinstance(places, str | PathLike) else ", ".join(map(str, places))
        why = f"; {notes[0]}" if notes else ", or .mat files of BROAD"
        raise ValueError(f"{where}: no recording to score: put .csv files with a truth there{why}")
    of_some = {name for s in scores for name in s.groups}
    kinds = [name for name in found.kinds if name in of_some]
    groups = [name for name in (*kinds, *found.groups) if name in of_some]
    return Benchmark(scores, groups, notes, headings, begun, [s.path for s in found.files], kinds, contests[1].title)


def _contests(
    names: Sequence[str], settings: Settings, rest: float, lags: Sequence[float], offline: bool, without: set[str]
) -> list[_Contest]:
    """Who takes part in what; the second contest is the one that is judged."""
    calibrated = f", gyro bias of the first {rest:g} s removed" if rest else ""
    contests = [
        _Contest("parameters of the papers", [*with_papers_parameters(names, settings), *peers()]),
        _Contest(
            f"parameters for real recordings{calibrated}", [*with_real_parameters(names, settings), *peers()], rest
        ),
        _Contest("with the speed of the wheels", with_wheels(names, settings), on_wheels=True),
    ]
    if lags:
        contests.append(_Contest("told later", lagging_contenders(lags, settings)))
    if offline:
        contenders = [*offline_contenders(names, settings), *offline_peers()]
        contests.append(_Contest("offline, the whole record known", contenders))
    known = {c.name: None for contest in contests for c in contest.contenders} | dict.fromkeys(PEERS)
    for name in without - known.keys():
        raise ValueError(no_such("filter", name, known))
    return [replace(c, contenders=[x for x in c.contenders if x.name not in without]) for c in contests]


class _NothingToScore(ValueError):
    """A recording without a vertical that counts; the message names it."""


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
    source: Source,
    recording: Recording,
    truths: Mapping[float, np.ndarray],
    own: float,
    contests: Sequence[_Contest],
    restless: list[str],
) -> Iterator[Score]:
    as_recorded = {name: recording.at_instants()[name] for name in ("gyro", "accel")}
    on_wheels = _with_speed(recording, as_recorded)
    known: dict[Any, Readings] = {}  # a filter that is given the same twice runs once
    for contest in contests:
        if contest.on_wheels and on_wheels is None:
            continue
        without_bias = _without_bias(recording, as_recorded, contest.rest)
        if without_bias is None:
            restless.append(source.name)
            without_bias = as_recorded
        for contender in contest.contenders:
            readings = as_recorded if contender.finds_bias else without_bias
            if contest.on_wheels and on_wheels is not None:
                readings = on_wheels
            key = contender.name, str(contender.parameters), id(readings)
            if key not in known:
                known[key] = contender.estimate(readings, recording.sample_period)
            for delay, vertical in truths.items():
                yield Score(
                    contest.title,
                    contender.name,
                    " ".join(f"{name}={value:.4g}" for name, value in contender.parameters.items()),
                    delay,
                    delay == own,
                    source.name,
                    source.groups,
                    *_errors(known[key], recording.sample_index, vertical),
                    recording.is_broad,
                )


def _errors(signals: Readings, rows: np.ndarray, vertical: np.ndarray) -> tuple[float, float, float]:
    """RMSE (deg), NEES, and the share of the error below FAR tilt_std."""
    counts = np.isfinite(vertical).all(axis=1)
    error = metrics.inclination_error(signals["vertical"][rows][counts], vertical[counts])
    rmse = float(np.rad2deg(metrics.rms(error)))
    if "tilt_std" not in signals:
        return rmse, math.nan, math.nan
    ratio = error / signals["tilt_std"][rows][counts]
    return rmse, float(np.mean(ratio**2)), float(np.mean(ratio < FAR))


def _with_speed(recording: Recording, readings: Readings) -> Readings | None:
    """The readings with the speed of the wheels; None where there is none."""
    if recording.forward_speed is None:
        return None
    speed = recording.at_instants()["forward_speed"]
    return {**readings, "forward_speed": speed, "forward_speed_valid": np.isfinite(speed).astype(float)}


def _without_bias(recording: Recording, readings: Readings, rest: float) -> Readings | None:
    """The readings less the mean gyro of the first ``rest`` s; None where that was no rest."""
    if not rest:
        return readings
    gyro = recording.gyro[recording.time < recording.time[0] + rest]
    gyro = gyro[np.isfinite(gyro).all(axis=1)]
    is_rest = len(gyro) and gyro.std(axis=0).max() < _STEADY and np.abs(gyro.mean(axis=0)).max() < _LARGEST_BIAS
    return {**readings, "gyro": readings["gyro"] - gyro.mean(axis=0)} if is_rest else None
