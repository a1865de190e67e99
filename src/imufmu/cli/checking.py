"""The verb that judges a system by limits of its user: check."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..cosim.errors import STEP_TIMEOUT
from .arguments import check_target, parsed_sets
from .console import notes, out, print_table, progress_bar, written
from .runs import InProcess, Native, Sets, StepTimeout


def check(
    system: Annotated[str, typer.Argument(help="Name of a system, an .ssd or .ssp file, or a .limits.toml file")],
    limits: Annotated[
        Path | None,
        typer.Option(
            "--limits", help="Limits file; without it, and without --require, NAME.limits.toml beside NAME.ssd."
        ),
    ] = None,
    require: Annotated[
        list[str] | None,
        typer.Option("--require", metavar="LIMIT", help='A limit, as "plumb.tilt.max < 2 deg". Repeatable.'),
    ] = None,
    seeds: Annotated[
        int | None,
        typer.Option("--seeds", min=1, help="Number of runs, each with another seed."),
    ] = None,
    sets: Sets = None,
    stop: Annotated[float | None, typer.Option("--stop", help="Stop time (s).")] = None,
    step: Annotated[float | None, typer.Option("--step", help="Communication step (s).")] = None,
    native: Native = False,
    in_process: InProcess = False,
    step_timeout: StepTimeout = STEP_TIMEOUT,
    jobs: Annotated[int | None, typer.Option("--jobs", "-j", min=1, help="Processes at once (one per core).")] = None,
    junit: Annotated[Path | None, typer.Option("--junit", help="Write the verdict to this .xml file, for CI.")] = None,
    json: Annotated[Path | None, typer.Option("--json", help="Write the verdict to this .json file.")] = None,
    report: Annotated[Path | None, typer.Option("--report", help="Write a page with figures: .html.")] = None,
) -> None:
    """Judge a system by limits, over one run or many seeds; exit code 1 if a limit is broken.

    \b
      imufmu check pendulum_lee2012 --require "plumb.tilt.max < 2 deg"
      imufmu check my_system.ssd --limits my.limits.toml --seeds 200 --junit verdict.xml
      imufmu check roundabout.limits.toml --report verdict.html

    A limit is a statistic of a quantity with a bound, or a condition over time:

    \b
      [[limit]]
      quantity = "plumb.tilt"            # an error, a variable, or an expression
      statistic = "p95"
      at_most = "1.5 deg"
      where = "plant.speed > 5 m/s"
      runs = "95 %"                      # of the seeds; all without it
      [[limit]]
      always = "abs(plumb.roll_error) < 3 deg"

    docs/gate.md tells the rest. The verdict is the same for any number of processes.
    """
    from ..gate.page import summary, verdict_table, write_json, write_page
    from ..gate.request import requested
    from ..gate.trials import cores
    from ..gate.verdict import check_system
    from ..reports.junit import write_junit

    check_target(junit, ".xml", inputs=[system])
    check_target(json, ".json", inputs=[system])
    check_target(report, ".html", inputs=[system])
    plan, asked, runs = requested(
        system,
        limits,
        require or (),
        seeds,
        native=native,
        stop_time=stop,
        step=step,
        parameters=parsed_sets(sets),
        in_process=in_process,
        step_timeout=step_timeout,
    )
    with progress_bar(f"preparing {plan.system}"):  # builds our FMUs once, before the workers ask for them
        plan.read()
    with progress_bar(f"checking {plan.system}") as progress:
        outcome = check_system(plan, asked, runs, jobs or cores(), progress)
    try:
        if json:
            write_json(json, outcome)
        if junit:
            write_junit(junit, "check", [outcome.suite()])
        if report:
            with progress_bar(f"drawing {report.name}"):
                write_page(report, plan, asked, outcome)
    finally:
        notes(outcome.notes)
        print_table(verdict_table(outcome))
        out.print(summary(outcome), markup=False)
    written(report, junit, json)
    if not outcome.passed:
        raise typer.Exit(1)
