"""What a user sees after a run or a replay: a table, and on request a figure and a report."""

from __future__ import annotations

from pathlib import Path

from ..blocks.running import Trajectory
from ..cosim.replay import Replay
from ..cosim.results import Result
from ..cosim.system import System
from ..pictures import animation
from ..pictures.bodies import body_of
from ..pictures.figures import attitude_figure, save
from ..pictures.movies import check_movie
from ..scoring import metrics
from ..scoring.systems import comparisons, knowing
from ..scoring.table import Table
from .run_report import write_run_report
from .tables import range_table, summary_table


def check_pictures(system: System, figure: bool, report: Path | None, movie: Path | None) -> None:
    """Raises ValueError where a run of this system cannot be drawn as asked, before it is run."""
    if not (figure or report or movie):
        return
    names = [f"{name}.{variable}" for name, found in system.interfaces.items() for variable in found.variables]
    plants, estimators = knowing(names)
    for found, what in (
        (plants, "no plant that knows the truth (outputs vertical[1..3], and no sample_time)"),
        (estimators, "no estimator (outputs vertical[1..3] and sample_time)"),
    ):
        if not found:
            raise ValueError(f"{system.description.name}: nothing to draw: the system has {what}")
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


def present_run(result: Result, figure: Path | None = None, report: Path | None = None) -> Table:
    """Errors of every estimator of the system, or the ranges of all variables where there is nothing to compare.

    Writes a figure and an HTML report where paths are given. Raises WriteError, and ValueError where a figure is asked
    for but the system has no truth and estimator.
    """
    found = comparisons(result)
    if not found:
        if figure or report:
            raise ValueError(
                f"{result.system}: no figure: the system has no plant with a truth and estimator to compare"
            )
        return range_table(dict(result.columns), {name: unit or "" for name, unit in result.units.items()})
    if figure:
        drawn = attitude_figure(
            result.system,
            found[0].truth,
            {c.component: c.estimate for c in found},
            {c.component: (c.estimate.time, c.errors) for c in found},
        )
        save(drawn, figure)
    if report:
        write_run_report(report, result, found)
    return summary_table("estimator", {c.component: c.summary for c in found})


def present_replay(replay: Replay, figure: Path | None = None) -> Table:
    """Errors over the scored samples, or the ranges of all outputs where the recording has no truth.

    Writes a figure where a path is given. Raises WriteError.
    """
    recording, signals = replay.recording, replay.signals()
    scored = recording.scored
    errors = {}
    if scored.any() and recording.truth.keys() & signals.keys():
        errors = metrics.errors(metrics.at_rows(signals, scored), metrics.at_rows(recording.truth, scored))
    if figure:
        estimate = Trajectory(recording.time, signals)
        truth = Trajectory(recording.time, recording.truth) if recording.truth else None
        drawn = attitude_figure(
            recording.name,
            truth,
            {replay.estimator: estimate},
            {replay.estimator: (recording.time[scored], errors)} if errors else {},
        )
        save(drawn, figure)
    if errors:
        return summary_table("estimator", {replay.estimator: metrics.summary(errors)})
    return range_table(replay.columns, replay.units)
