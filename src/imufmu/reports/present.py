"""What a user sees after a run or a replay: a table, and on request a figure and a report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from ..blocks.running import Trajectory
from ..cosim.replay import Replay
from ..cosim.results import Result
from ..cosim.system import System
from ..cosim.truth import derived_names
from ..pictures import animation
from ..pictures.bodies import body_of
from ..pictures.figures import attitude_figure, save
from ..pictures.movies import check_movie
from ..scoring import metrics
from ..scoring.systems import compare_all, comparisons, knowing, leave_out_unequal
from ..scoring.table import Table
from .run_report import write_run_report
from .tables import range_table, summary_table


def check_pictures(system: System, figure: bool, report: Path | None, movie: Path | None) -> None:
    """Raises ValueError where a run of this system cannot be drawn as asked, before it is run."""
    if not (figure or report or movie):
        return
    names = [f"{name}.{variable}" for name, found in system.interfaces.items() for variable in found.variables]
    names += derived_names(system.description.truth)
    plants, estimators = knowing(names)
    for found, what in (
        (plants, "no plant that knows the truth (outputs vertical[1..3], and no sample_time)"),
        (estimators, "no estimator (outputs vertical[1..3] and sample_time)"),
    ):
        if not found:
            raise ValueError(f"{system.description.name}: nothing to draw: the system has {what}")
    if len(plants) > 1:
        raise ValueError(
            f"{system.description.name}: nothing to draw: {' and '.join(plants)} report a vertical and no sample_time, "
            "as a plant does; which one tells the truth is unclear"
        )
    if movie:
        check_movie(movie)
        for name in ("position[1]", "q_NS[1]"):
            if f"{plants[0]}.{name}" not in names:
                raise ValueError(f"{system.description.name}: cannot animate: {plants[0]} has no output {name}")


def animate(result: Result, path: Path, progress: animation.Progress | None = None) -> list[str]:
    """Write a moving picture of a run of a system that ``check_pictures`` let pass, recorded with ``recorded``.

    Returns notes. Raises WriteError, and ValueError where the picture cannot be written.
    """
    body = body_of(result)
    if body is None or body.axes is None:
        raise ValueError(f"{result.system}: cannot animate: no plant tells position and q_NS")
    return animation.animate(path, result.system, body, comparisons(result), progress)


def present_run(
    result: Result, figure: Path | None = None, report: Path | None = None
) -> tuple[Table, list[str], list[Path]]:
    """Errors of every estimator of the system, or the ranges of all variables where there is nothing to compare.

    Writes a figure and an HTML report where paths are given and there is a comparison. Returns the table, notes that
    say what could not be compared, and the files written. Raises WriteError.
    """
    found, notes = compare_all(result)
    if not found:
        if figure or report:
            notes.append("no figure and no report: there is no truth and estimator to compare")
        units = {name: unit or "" for name, unit in result.units.items()}
        return range_table(dict(result.columns), units), notes, []
    if figure:
        drawn = attitude_figure(
            result.system,
            found[0].truth,
            {c.component: c.estimate for c in found},
            {c.component: (c.estimate.time, c.errors) for c in found},
        )
        save(drawn, figure)
    if report:
        write_run_report(report, replace(result, notes=(*result.notes, *notes)), found)
    table = summary_table("estimator", {c.component: c.summary for c in found})
    return table, notes, [path for path in (figure, report) if path]


def present_replay(replay: Replay, figure: Path | None = None) -> tuple[Table, list[str]]:
    """Errors over the scored samples, or the ranges of all outputs where there is nothing to compare; and notes.

    Writes a figure where a path is given. Raises WriteError.
    """
    return present_replays([replay], figure)


def present_replays(replays: Sequence[Replay], figure: Path | None = None) -> tuple[Table, list[str]]:
    """The same of several replays of one recording, side by side; without a truth, how far they are from the first."""
    recording = replays[0].recording
    scored, notes = recording.scored, []
    errors: dict[str, dict[str, np.ndarray]] = {}
    figures: dict[str, dict[str, float]] = {}
    truth = replays[0].truth()
    for replay in replays:
        signals = replay.signals()
        if not scored.any() or not truth.keys() & signals.keys():
            continue
        estimated, true = (metrics.at_rows(some, scored) for some in (signals, truth))
        notes += leave_out_unequal(estimated, true, replay.estimator, recording.name)
        try:
            found = metrics.errors(estimated, true)
            figures[replay.estimator] = metrics.summary(found)
            errors[replay.estimator] = found
        except ValueError as error:
            notes.append(f"{replay.estimator} is not compared with the truth: {error}")
    if figure:
        save(_drawn(replays, {name: (recording.time[scored], found) for name, found in errors.items()}), figure)
    if figures:
        return summary_table("estimator", figures), notes
    if len(replays) > 1:
        return _apart_table(replays), notes
    return range_table(replays[0].columns, replays[0].units), notes


def _drawn(replays: Sequence[Replay], errors: Mapping[str, tuple[np.ndarray, Mapping[str, np.ndarray]]]) -> Figure:
    """Attitude and acceleration, or all outputs of the first FMU where none tells of either."""
    recording, truth = replays[0].recording, replays[0].truth()
    estimates = {replay.estimator: Trajectory(recording.time, replay.signals()) for replay in replays}
    told = {name for estimate in estimates.values() for name in estimate.values}
    if not errors and not told & {"roll", "pitch", "external_acceleration"}:
        outputs: Figure = replays[0].plot(*replays[0].columns)
        return outputs
    return attitude_figure(recording.name, Trajectory(recording.time, truth) if truth else None, estimates, errors)


def _apart_table(replays: Sequence[Replay]) -> Table:
    """How far the verticals of the estimators are from that of the first which has one."""
    verticals = {r.estimator: r.signals()["vertical"] for r in replays if "vertical" in r.signals()}
    first = next(iter(verticals), "")
    rows = []
    for name, vertical in verticals.items():
        apart = np.rad2deg(metrics.inclination_error(vertical, verticals[first]))
        rows.append([name, f"{metrics.rms(apart):.3f}", f"{apart.max():.3f}"])
    return Table(["estimator", f"tilt from {first}: RMS (deg)", "max (deg)"], rows)
