"""Command line: thin verbs over public functions. Exit codes: 0 success, 1 a finding, 2 wrong usage or input."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from . import __version__
from .arguments import check_target, parsed_sets
from .cli_fmus import build, doctor, info
from .cli_speed import speed
from .console import err, notes, out, print_table, progress_bar, written

EXAMPLES = """IMU attitude estimators as drop-in FMUs, with the plants and IMU models to test them.

\b
  imufmu demo                                   pendulum, IMU and lee2012: table, figure, report
  imufmu list                                   blocks, systems, devices
  imufmu build lee2012                          writes lee2012.fmu
  imufmu build lee2012 --native                 the same without Python inside
  imufmu info lee2012.fmu                       what is inside
  imufmu doctor lee2012.fmu                     whether and where it runs
  imufmu run pendulum_lee2012 --set lee2012.mode=3 --plot
  imufmu run pendulum_swing_up --report swing_up.html --animate swing_up.gif
  imufmu replay walk.csv --estimator lee2012 --set c_a=0.2 --output tilt.csv
  imufmu pack pendulum_lee2012 pendulum.ssp     for other tools
  imufmu validate --junit verdict.xml           do the papers' conclusions hold?
  imufmu benchmark broad                        every filter on a folder of recordings
  imufmu speed                                  what a sample costs, native and in Python
  imufmu predict --imu mtx --slosh 1            how well this gyroscope can know the vertical

Exit codes: 0 success, 1 a finding (a criterion not met, a simulation failed), 2 wrong usage or input.
"""

app = typer.Typer(
    help=EXAMPLES, no_args_is_help=True, add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False
)

Sets = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="NAME=VALUE", help="Parameter value; a vector as 1,2,3. Repeatable."),
]
Output = Annotated[Path | None, typer.Option("--output", "-o", help="Write the results to this .csv or .h5 file.")]
Native = Annotated[bool, typer.Option("--native", help="Our blocks as compiled C instead of Python.")]
Plot = Annotated[bool, typer.Option("--plot", help="Write a figure next to the working folder's other files.")]


@app.callback(invoke_without_command=True)
def _root(version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False) -> None:
    if version:
        out.print(f"imufmu {__version__}")
        raise typer.Exit


@app.command("list")
def list_() -> None:
    """What there is: blocks, systems, devices.

    \b
      imufmu list
    """
    from .cosim.description import read_description
    from .locations import models_folder
    from .registry import ESTIMATORS, PLANTS, SENSORS

    for kind, blocks in (("estimator", ESTIMATORS), ("sensor", SENSORS), ("plant", PLANTS)):
        for block in blocks:
            out.print(f"{kind:10} {block.name:32} {block.summary}")
    for path in sorted(models_folder().rglob("*.ssd")):
        out.print(f"{'system':10} {path.stem:32} {read_description(path).description}")
    for path in sorted((models_folder() / "imus").glob("*.ssv")):
        out.print(f"{'device':10} {path.stem:32} parameter set of the sensor imu: {path}")


for verb in (build, doctor, info):
    app.command()(verb)


@app.command()
def run(
    system: Annotated[str, typer.Argument(help="Name of a system (see: imufmu list), or an .ssd or .ssp file")],
    sets: Sets = None,
    stop: Annotated[float | None, typer.Option("--stop", help="Stop time (s).")] = None,
    step: Annotated[float | None, typer.Option("--step", help="Communication step (s).")] = None,
    jacobi: Annotated[
        bool, typer.Option("--jacobi", help="Take all inputs before the step, as simple masters do.")
    ] = False,
    native: Native = False,
    output: Output = None,
    plot: Plot = False,
    report: Annotated[Path | None, typer.Option("--report", help="Write an HTML report to this file.")] = None,
    animation: Annotated[
        Path | None,
        typer.Option("--animate", help="Draw the body and the estimated horizons into this .gif or .mp4 file."),
    ] = None,
) -> None:
    """Co-simulate a system of FMUs and compare its estimators with its plant.

    \b
      imufmu run pendulum_lee2012
      imufmu run pendulum_lee2012 --set lee2012.mode=3 --set imu.seed=7 --plot
      imufmu run pendulum_swing_up --report swing_up.html --animate swing_up.gif
      imufmu run my_system.ssd --stop 60 --step 0.005 --output run.csv

    The heading counts from East: an estimator without a magnetometer keeps what it does not know at the start.
    With --report or --animate the results also hold the points of the body, where the plant has the local variable
    skeleton.
    """
    from .cosim import System, locate, simulate
    from .evaluate.bodies import recorded
    from .evaluate.present import animate, check_pictures, present_run

    check_target(output, ".csv", ".h5")
    check_target(report, ".html")
    check_target(animation, ".gif", ".mp4")
    read = System.read(locate(system), native=native)
    check_pictures(read, plot, report, animation)
    with progress_bar(f"running {read.description.name}") as progress:
        result = simulate(
            read,
            stop_time=stop,
            step=step,
            parameters=parsed_sets(sets),
            record=recorded(read) if report or animation else None,
            jacobi=jacobi,
            progress=progress,
        )
    figure = Path(f"{read.description.name}.png") if plot else None
    notes(result.notes)
    print_table(present_run(result, figure, report))
    if output:
        (result.to_csv if output.suffix.lower() == ".csv" else result.to_hdf5)(output)
    if animation:
        with progress_bar(f"drawing {animation.name}") as progress:
            notes(animate(result, animation, progress))
    written(output, figure, report, animation)


@app.command()
def replay(
    recording: Annotated[Path, typer.Argument(help="Recording: .csv in SI units, or a BROAD .mat file")],
    estimator: Annotated[
        str, typer.Option("--estimator", "-e", help="Name of an estimator, or an .fmu file.")
    ] = "lee2012",
    sets: Sets = None,
    native: Native = False,
    output: Output = None,
    local_variables: Annotated[bool, typer.Option("--locals", help="Also write the FMU's local variables.")] = False,
    plot: Plot = False,
) -> None:
    """Feed a recording to an estimator FMU, one step per sample.

    \b
      imufmu replay walk.csv --estimator lee2012 --set c_a=0.2 --output tilt.csv --plot
      imufmu replay 01_undisturbed_slow_rotation_A.mat --estimator my_filter.fmu

    A CSV file names its columns time, gyro[1], gyro[2], gyro[3], accel[1], accel[2], accel[3] and, where there are
    such, mag[1], mag[2], mag[3] and the truth: roll, pitch, yaw or q_NS[1] to q_NS[4]. Units: s, rad/s, m/s2, uT, rad.
    With a truth the errors are printed.
    """
    from .cosim.replay import estimator_fmu
    from .cosim.replay import replay as replay_recording
    from .evaluate.present import present_replay
    from .recordings import read

    check_target(output, ".csv")
    read_recording = read(recording)
    with progress_bar(f"replaying {read_recording.name}") as progress:
        result = replay_recording(
            read_recording,
            estimator_fmu(estimator, native=native),
            parsed_sets(sets),
            local_variables=local_variables,
            progress=progress,
        )
    figure = Path(f"{read_recording.name}_{result.estimator}.png") if plot else None
    notes(result.notes)
    print_table(present_replay(result, figure))
    if output:
        result.to_csv(output)
    written(output, figure)


@app.command()
def pack(
    system: Annotated[str, typer.Argument(help="Name of a system, or an .ssd file")],
    target: Annotated[Path, typer.Argument(help="The .ssp file to write")],
    native: Native = False,
) -> None:
    """Write a system, its FMUs and its parameters as one .ssp file for other tools.

    \b
      imufmu pack pendulum_lee2012 pendulum.ssp
      imufmu pack pendulum_lee2012 pendulum.ssp --native      for tools without Python, on this platform
    """
    from .cosim import locate
    from .cosim import pack as pack_system

    check_target(target, ".ssp")
    pack_system(locate(system), target, native=native)
    out.print(str(target))


@app.command()
def demo(
    folder: Annotated[Path, typer.Option("--folder", "-f", help="Where figure and report go.")] = Path("imufmu-demo"),
) -> None:
    """Co-simulate a pendulum, an IMU and lee2012 in its three modes.

    \b
      imufmu demo
    """
    from .evaluate.demo import run_demo

    with progress_bar("co-simulating the demo") as progress:
        made = run_demo(folder, progress)
    print_table(made.table)
    written(made.figure, made.report)


@app.command()
def validate(
    papers: Annotated[list[str] | None, typer.Argument(help="Papers, by the names of their estimators; or all")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Fewer random motions: two minutes instead of ten.")] = False,
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
    from .evaluate.junit import write_junit
    from .evaluate.validate import validate as run_experiments
    from .evaluate.verdicts import failure_table, verdict_table, write_json, write_page

    check_target(report, ".html")
    check_target(junit, ".xml")
    check_target(json, ".json")
    with progress_bar("the papers' experiments") as progress:
        verdicts = run_experiments(papers or (), quick=quick, drawn=report is not None, progress=progress)
    print_table(verdict_table(verdicts))
    for verdict in verdicts:
        for remark in verdict.remarks:
            out.print(f"remark on {verdict.name}: {remark}", markup=False)
    failures = failure_table(verdicts)
    if failures:
        print_table(failures)
    if report:
        write_page(report, verdicts, quick)
    if junit:
        write_junit(junit, verdicts)
    if json:
        write_json(json, verdicts, quick)
    written(report, junit, json)
    if failures:
        raise typer.Exit(1)


@app.command()
def benchmark(
    folder: Annotated[Path, typer.Argument(help="Folder with recordings that know the truth: .csv, or .mat of BROAD")],
    estimators: Annotated[
        list[str] | None, typer.Option("--estimator", "-e", help="Name of an estimator; all without. Repeatable.")
    ] = None,
    delay: Annotated[
        float, typer.Option(min=-1.0, max=1.0, help="Score once more with the truth delayed by this (s).")
    ] = 0.0023,
    rest_bias: Annotated[
        float, typer.Option(min=0.0, help="Rest at the start (s) whose mean gyro the second contest removes; 0: none.")
    ] = 3.0,
    csv: Annotated[Path | None, typer.Option("--csv", help="Write every score to this .csv file.")] = None,
) -> None:
    """Score every estimator of tilt on real recordings, beside VQF and imufusion where those are installed.

    \b
      imufmu benchmark broad
      imufmu benchmark broad --estimator rizun2008 --delay 0 --csv scores.csv

    Twice: with the parameters of the papers, then with parameters for real recordings. For the columns of a .csv file
    see imufmu replay --help.
    """
    from .evaluate.benchmark import benchmark as score
    from .evaluate.benchmark import tables, write_scores

    check_target(csv, ".csv")
    with progress_bar(f"scoring {folder}") as progress:
        result = score(folder, estimators or (), delay=delay, rest=rest_bias, progress=progress)
    notes(result.notes)
    for section in tables(result):
        out.print(section.heading, markup=False)
        for point in section.points:
            out.print(f"  {point}", markup=False)
        if section.table:
            print_table(section.table)
        out.print()
    if csv:
        write_scores(csv, result)
    written(csv)


app.command()(speed)


@app.command()
def predict(
    imu: Annotated[str, typer.Option("--imu", help="Device (see: imufmu list), or an .ssv file.")] = "mtx",
    slosh: Annotated[float, typer.Option("--slosh", help="Density of the sensor's velocity (m/s/sqrt(Hz)).")] = 1.0,
) -> None:
    """How well this gyroscope can know the vertical in this motion, from the error formulas of Rizun 2008.

    \b
      imufmu predict --imu mtx --slosh 1.0

    A slosh of 1 m/s/sqrt(Hz) is that of a shoe in running.
    """
    from .evaluate.prediction import predict as expected

    print_table(expected(imu, slosh))


def main() -> None:
    """Entry point: errors of the user become one line, never a stack trace."""
    from .cosim import SimulationError

    try:
        app()
    except KeyboardInterrupt:
        err.print("interrupted")
        sys.exit(130)
    except SimulationError as error:
        err.print(f"error: {error}", markup=False)
        sys.exit(1)
    except (ValueError, OSError) as error:
        err.print(f"error: {error}", markup=False)
        sys.exit(2)
