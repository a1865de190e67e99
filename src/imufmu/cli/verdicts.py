"""The verbs that judge filters: validate, benchmark, predict."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .arguments import check_target, parsed_sets
from .console import err, notes, out, print_table, progress_bar, written

if TYPE_CHECKING:
    from ..papers.validate import Verdict


def validate(
    papers: Annotated[list[str] | None, typer.Argument(help="Papers, by the names of their estimators; or all")] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="Fewer random motions: under a minute instead of some.")
    ] = False,
    report: Annotated[Path | None, typer.Option("--report", help="Write an HTML report to this file.")] = None,
    junit: Annotated[
        Path | None, typer.Option("--junit", help="Write the checks to this .xml file, for a CI server.")
    ] = None,
    json: Annotated[
        Path | None, typer.Option("--json", help="Write everything but figures to this .json file.")
    ] = None,
) -> None:
    """Do the papers' experiments again and check their conclusions; exit code 1 if a criterion is not met.

    \b
      imufmu validate
      imufmu validate lee2012 rizun2008 --quick
      imufmu validate --report verdict.html --junit verdict.xml --json verdict.json
    """
    from ..papers.validate import validate as run_experiments
    from ..papers.verdicts import failure_table, verdict_table, write_json, write_page
    from ..reports.junit import write_junit

    check_target(report, ".html")
    check_target(junit, ".xml")
    check_target(json, ".json")
    chosen = () if papers in (None, ["all"]) else papers
    with progress_bar("the papers' experiments") as progress:
        verdicts = run_experiments(
            chosen, quick=quick, drawn=report is not None, progress=progress, finished=_tell_of_one
        )
    failures = failure_table(verdicts)
    try:  # minutes of work: to files before anything else, and to the terminal whatever becomes of the files
        if json:
            write_json(json, verdicts, quick)
        if junit:
            write_junit(junit, "validate", [verdict.suite() for verdict in verdicts])
        if report:
            write_page(report, verdicts, quick)
    finally:
        print_table(verdict_table(verdicts))
        for verdict in verdicts:
            for remark in verdict.remarks:
                out.print(f"remark on {verdict.name}: {remark}", markup=False)
        if failures:
            print_table(failures)
    written(report, junit, json)
    if failures:
        raise typer.Exit(1)


def _tell_of_one(verdict: Verdict) -> None:
    """A line as soon as the experiments of one paper are done."""
    word = "passed" if verdict.passed else "failed"
    err.print(f"{verdict.name}: {word} after {verdict.seconds:.0f} s", markup=False)


def benchmark(
    places: Annotated[
        list[str],
        typer.Argument(metavar="PLACE...", help="Folders, recordings or patterns, that know the truth"),
    ],
    estimators: Annotated[
        list[str] | None, typer.Option("--estimator", "-e", help="Name of an estimator; all without. Repeatable.")
    ] = None,
    without: Annotated[
        list[str] | None, typer.Option("--without", help="Name of a filter to leave out, as RIANN, the slowest.")
    ] = None,
    sets: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="Parameter, as plumb.gyro_index=1. Repeatable."),
    ] = None,
    group: Annotated[
        str, typer.Option("--group", metavar="REGEX", help="What of a path is the group; without, its folder is.")
    ] = "",
    delay: Annotated[
        float | None,
        typer.Option(
            min=-1.0,
            max=1.0,
            help="Score once more with the truth delayed by this (s). Default: 0.0023 for trials of BROAD, else 0.",
        ),
    ] = None,
    rest_bias: Annotated[
        float, typer.Option(min=0.0, help="Rest at the start (s) whose mean gyro the second contest removes; 0: none.")
    ] = 3.0,
    starts: Annotated[
        int, typer.Option(min=0, max=1000, help="Begin so often inside the motion of each recording, too.")
    ] = 0,
    lags: Annotated[
        list[float] | None, typer.Option("--lag", help="Score plumb_lag, too, told this much later (s). Repeatable.")
    ] = None,
    offline: Annotated[
        bool, typer.Option("--offline", help="Score once more with the whole record known, beside offlineVQF.")
    ] = False,
    csv: Annotated[Path | None, typer.Option("--csv", help="Write every score to this .csv file.")] = None,
    json: Annotated[Path | None, typer.Option("--json", help="Write everything to this .json file.")] = None,
) -> None:
    """Score every estimator of tilt on real recordings, beside VQF, imufusion and RIANN where those are installed.

    \b
      imufmu benchmark broad
      imufmu benchmark broad walks "cars/*/slow_*.csv" --starts 6 --json scores.json
      imufmu benchmark broad --estimator plumb --set plumb.gyro_index=1 --csv scores.csv
      imufmu benchmark walks --group "(stairs|street)"

    Twice: with the parameters of the papers, then with parameters for real recordings, which all that follows is about:
    the ratio to VQF, the worst recordings, how honest tilt_std is, starts inside a motion, the heading. Of what can
    be a recording see imufmu inspect --help.
    """
    from ..benchmarks.recordings import benchmark as score
    from ..benchmarks.sources import sources
    from ..benchmarks.summary import tables, write_json, write_scores

    inputs = [source.path for source in sources(places, group).files]
    check_target(csv, ".csv", inputs=inputs)
    check_target(json, ".json", inputs=inputs)
    begin = partial(score, delay=delay, rest=rest_bias, starts=starts, group=group, lags=lags or (), offline=offline)
    more = f" and {len(places) - 1} more" if len(places) > 1 else ""
    with progress_bar(f"scoring {places[0]}{more}") as progress:
        result = begin(places, estimators or (), without=without or (), settings=parsed_sets(sets), progress=progress)
    if csv:
        write_scores(csv, result)
    if json:
        write_json(json, result)
    notes(result.notes)
    for section in tables(result):
        out.print(section.heading, markup=False)
        for point in section.points:
            out.print(f"  {point}", markup=False)
        if section.table:
            print_table(section.table)
        out.print()
    written(csv, json)


def predict(
    imu: Annotated[str, typer.Option("--imu", help="Device (see: imufmu list), or an .ssv file.")] = "mtx",
    slosh: Annotated[float, typer.Option("--slosh", help="Density of the sensor's velocity (m/s/sqrt(Hz)).")] = 1.0,
) -> None:
    """How well this gyroscope can know the vertical in this motion, from the error formulas of Rizun 2008.

    \b
      imufmu predict --imu mtx --slosh 1.0

    A slosh of 1 m/s/sqrt(Hz) is that of a shoe in running.
    """
    from ..scoring.prediction import predict as expected

    print_table(expected(imu, slosh))
