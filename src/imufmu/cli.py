"""Command line: thin verbs over public functions. Exit codes: 0 success, 1 a finding, 2 wrong usage or input."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from . import __version__
from .evaluate.report import Table

EXAMPLES = """IMU attitude estimators as drop-in FMUs, with the plants and IMU models to test them.

\b
  imufmu demo                                   pendulum, IMU and lee2012: table, figure, report
  imufmu list                                   blocks, systems, devices
  imufmu build lee2012                          writes lee2012.fmu
  imufmu info lee2012.fmu                       what is inside
  imufmu run pendulum_lee2012 --set lee2012.mode=3 --plot
  imufmu replay walk.csv --estimator lee2012 --set c_a=0.2 --output tilt.csv
  imufmu pack pendulum_lee2012 pendulum.ssp     for other tools

Exit codes: 0 success, 1 a finding (a simulation failed), 2 wrong usage or input.
"""

app = typer.Typer(
    help=EXAMPLES, no_args_is_help=True, add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False
)
out = Console(highlight=False, soft_wrap=True)
err = Console(stderr=True, highlight=False, soft_wrap=True)

Sets = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="NAME=VALUE", help="Parameter value; a vector as 1,2,3. Repeatable."),
]
Output = Annotated[Path | None, typer.Option("--output", "-o", help="Write the results to this .csv or .h5 file.")]
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
    from .locations import models_folder
    from .registry import ESTIMATORS, PLANTS, SENSORS

    for kind, blocks in (("estimator", ESTIMATORS), ("sensor", SENSORS), ("plant", PLANTS)):
        for block in blocks:
            out.print(f"{kind:10} {block.name:32} {block.summary}")
    for path in sorted(models_folder().rglob("*.ssd")):
        out.print(f"{'system':10} {path.stem:32} {_description(path)}")
    for path in sorted((models_folder() / "imus").glob("*.ssv")):
        out.print(f"{'device':10} {path.stem:32} parameter set of the sensor imu: {path}")


def _description(path: Path) -> str:
    from .cosim.description import read_description

    return read_description(path).description


@app.command()
def build(
    names: Annotated[list[str], typer.Argument(help="Names of blocks (see: imufmu list), or: all")],
    folder: Annotated[Path, typer.Option("--folder", "-f", help="Where the FMUs go.")] = Path(),
) -> None:
    """Write FMUs.

    \b
      imufmu build lee2012
      imufmu build all --folder fmus
    """
    from .fmi.build import build_fmu
    from .registry import BLOCKS

    for name in BLOCKS if names == ["all"] else names:
        out.print(str(build_fmu(name, folder)))


@app.command()
def info(fmu: Annotated[str, typer.Argument(help="Name of a block, or an .fmu file")]) -> None:
    """Variables, parameters and platforms of an FMU.

    \b
      imufmu info lee2012
      imufmu info plant.fmu
    """
    from .fmi.info import COLUMNS, describe

    heading, rows = describe(fmu)
    for line in heading:
        out.print(line, markup=False)
    _print_table(Table(COLUMNS, rows, words=True))


@app.command()
def run(
    system: Annotated[str, typer.Argument(help="Name of a system (see: imufmu list), or an .ssd or .ssp file")],
    sets: Sets = None,
    stop: Annotated[float | None, typer.Option("--stop", help="Stop time (s).")] = None,
    step: Annotated[float | None, typer.Option("--step", help="Communication step (s).")] = None,
    jacobi: Annotated[
        bool, typer.Option("--jacobi", help="Take all inputs before the step, as simple masters do.")
    ] = False,
    output: Output = None,
    plot: Plot = False,
    report: Annotated[Path | None, typer.Option("--report", help="Write an HTML report to this file.")] = None,
) -> None:
    """Co-simulate a system of FMUs and compare its estimators with its plant.

    \b
      imufmu run pendulum_lee2012
      imufmu run pendulum_lee2012 --set lee2012.mode=3 --set imu.seed=7 --plot
      imufmu run my_system.ssd --stop 60 --step 0.005 --output run.csv
    """
    from .cosim import System, locate, simulate
    from .evaluate.present import present_run

    _check_suffix(output, ".csv", ".h5")
    _check_suffix(report, ".html")
    read = System.read(locate(system))
    with _progress(f"running {read.description.name}") as progress:
        result = simulate(read, stop_time=stop, step=step, parameters=_parsed(sets), jacobi=jacobi, progress=progress)
    figure = Path(f"{read.description.name}.png") if plot else None
    _notes(result.notes)
    _print_table(present_run(result, figure, report))
    if output:
        (result.to_csv if output.suffix.lower() == ".csv" else result.to_hdf5)(output)
    _written(output, figure, report)


@app.command()
def replay(
    recording: Annotated[Path, typer.Argument(help="Recording: .csv in SI units, or a BROAD .mat file")],
    estimator: Annotated[
        str, typer.Option("--estimator", "-e", help="Name of an estimator, or an .fmu file.")
    ] = "lee2012",
    sets: Sets = None,
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

    _check_suffix(output, ".csv")
    read_recording = read(recording)
    with _progress(f"replaying {read_recording.name}") as progress:
        result = replay_recording(
            read_recording,
            estimator_fmu(estimator),
            _parsed(sets),
            local_variables=local_variables,
            progress=progress,
        )
    figure = Path(f"{read_recording.name}_{result.estimator}.png") if plot else None
    _notes(result.notes)
    _print_table(present_replay(result, figure))
    if output:
        result.to_csv(output)
    _written(output, figure)


@app.command()
def pack(
    system: Annotated[str, typer.Argument(help="Name of a system, or an .ssd file")],
    target: Annotated[Path, typer.Argument(help="The .ssp file to write")],
) -> None:
    """Write a system, its FMUs and its parameter sets as one .ssp file for other tools.

    \b
      imufmu pack pendulum_lee2012 pendulum.ssp
    """
    from .cosim import locate
    from .cosim import pack as pack_system

    _check_suffix(target, ".ssp")
    pack_system(locate(system), target)
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

    with _progress("co-simulating the demo") as progress:
        made = run_demo(folder, progress)
    _print_table(made.table)
    _written(made.figure, made.report)


def _parsed(sets: list[str] | None) -> dict[str, Any]:
    """NAME=VALUE as a dict with numbers, truth values and vectors."""
    values: dict[str, Any] = {}
    for text in sets or []:
        name, equals, value = text.partition("=")
        if not (name.strip() and equals and value.strip()):
            raise typer.BadParameter(f"{text!r}: expected NAME=VALUE, such as c_a=0.2", param_hint="--set")
        parts = [_number(part.strip(), text) for part in value.split(",")]
        values[name.strip()] = parts[0] if len(parts) == 1 else parts
    return values


def _number(text: str, whole: str) -> Any:
    if text.lower() in ("true", "false"):
        return text.lower() == "true"
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    raise typer.BadParameter(f"{whole!r}: {text!r} is not a number", param_hint="--set")


def _check_suffix(path: Path | None, *suffixes: str) -> None:
    if path and path.suffix.lower() not in suffixes:
        raise typer.BadParameter(f"{path}: the name must end in {' or '.join(suffixes)}")


def _print_table(table: Table) -> None:
    """Aligned columns: words left, numbers right. Lines are never folded, so that they survive a pipe."""
    lines = [table.columns, *table.rows]
    widths = [max(len(line[i]) for line in lines) for i in range(len(table.columns))]
    for line in lines:
        left = [table.words or i == 0 for i in range(len(widths))]
        cells = (c.ljust(w) if to_left else c.rjust(w) for c, w, to_left in zip(line, widths, left, strict=True))
        out.print("  ".join(cells).rstrip(), markup=False)


def _written(*paths: Path | None) -> None:
    for path in paths:
        if path:
            out.print(f"wrote {path.resolve()}", markup=False)


def _notes(notes: tuple[str, ...]) -> None:
    for note in notes:
        err.print(f"note: {note}", markup=False)


@contextmanager
def _progress(what: str) -> Iterator[Callable[[int, int], None]]:
    """A bar on a terminal, nothing elsewhere."""
    columns = (TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn())
    with Progress(*columns, console=err, transient=True, disable=not err.is_terminal) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


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
