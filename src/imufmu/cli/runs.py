"""The verbs that run systems: run, pack, demo."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..cosim.errors import STEP_TIMEOUT
from .arguments import check_folder, check_target, parsed_pairs, parsed_sets
from .connecting import Estimators, Maps, Rate, asker, check_system_or_plant, parsed_maps
from .console import Json, notes, out, print_json, print_table, progress_bar, written
from .saving import kept, save

Sets = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="NAME=VALUE", help="Parameter value: 0.2, 1,2,3 or '500 mm'. Repeatable."),
]
Output = Annotated[Path | None, typer.Option("--output", "-o", help="Write the results to this .csv or .h5 file.")]
Native = Annotated[bool, typer.Option("--native", help="Our blocks as compiled C instead of Python.")]
InProcess = Annotated[
    bool,
    typer.Option("--in-process", help="Let FMUs of others share this process: faster, but a crash takes all along."),
]
StepTimeout = Annotated[
    float,
    typer.Option("--step-timeout", min=0.001, help="Seconds that an FMU of others may take to answer a call."),
]
Strict = Annotated[
    bool, typer.Option("--strict", help="Refuse descriptions and FMUs that break a standard, however clear they are.")
]
Plot = Annotated[bool, typer.Option("--plot", help="Write a figure next to the working folder's other files.")]


def run(
    system: Annotated[
        str | None, typer.Argument(help="Name of a system (see: imufmu list), or an .ssd or .ssp file")
    ] = None,
    plant: Annotated[Path | None, typer.Option("--plant", help="Your own plant, an .fmu file, for SYSTEM.")] = None,
    imu: Annotated[
        str | None,
        typer.Option("--imu", help="Device (see: imufmu list), or an .ssv file. With --plant: mtx."),
    ] = None,
    estimators: Estimators = None,
    maps: Maps = None,
    rate: Rate = None,
    sets: Sets = None,
    stop: Annotated[float | None, typer.Option("--stop", help="Stop time (s).")] = None,
    step: Annotated[float | None, typer.Option("--step", help="Communication step (s).")] = None,
    jacobi: Annotated[
        bool, typer.Option("--jacobi", help="Take all inputs before the step, as simple masters do.")
    ] = False,
    native: Native = False,
    treat: Annotated[
        list[str] | None,
        typer.Option("--treat", metavar="NAME=KIND", help="How a component steps: sampled or continuous. Repeatable."),
    ] = None,
    strict: Strict = False,
    in_process: InProcess = False,
    step_timeout: StepTimeout = STEP_TIMEOUT,
    output: Output = None,
    plot: Plot = False,
    report: Annotated[Path | None, typer.Option("--report", help="Write an HTML report to this file.")] = None,
    animation: Annotated[
        Path | None,
        typer.Option("--animate", help="Draw the body and the estimated horizons into this .gif or .mp4 file."),
    ] = None,
    json: Json = False,
) -> None:
    """Co-simulate a system of FMUs and compare its estimators with its plant.

    \b
      imufmu run pendulum_lee2012
      imufmu run pendulum_lee2012 --set lee2012.mode=3 --set imu.seed=7 --plot
      imufmu run pendulum_swing_up --report swing_up.html --animate swing_up.gif
      imufmu run my_system.ssd --stop 60 --step 0.005 --output run.csv
      imufmu run pendulum_lee2012 --set "imu.gyro_noise_density=0.005 deg/s/sqrt(Hz)"
      imufmu run pendulum_lee2012 --imu mpu9150 --rate 200
      imufmu run --plant my.fmu --imu mpu9150 --estimator plumb --estimator lee2012
      imufmu run --plant my.fmu --map gyro=omega:deg/s --map quaternion=q:wxyz:to-world
      imufmu run pendulum_lee2012 --json

    --plant wires the FMU as imufmu connect does, which tells more of it. --rate sets the step and every sample period.
    The heading counts from East: an estimator without a magnetometer keeps what it does not know at the start.
    With --report or --animate the results also hold the points of the body, where the plant has the local variable
    skeleton. An FMU that imufmu has not built runs in a process of its own: if it crashes or hangs, the run ends, and
    the rows up to there are written, marked as partial.
    """
    from ..cosim.devices import device_parameters, rate_parameters
    from ..cosim.master import simulate
    from ..cosim.system import System
    from ..pictures.bodies import recorded
    from ..reports.present import animate, check_pictures, present_run
    from ..reports.tables import run_facts

    given = check_system_or_plant(system, plant, estimators, maps)
    check_target(output, ".csv", ".h5", inputs=[given])
    check_target(report, ".html")
    check_target(animation, ".gif", ".mp4")
    if plant:
        device = imu or "mtx"
        read = System.connect(
            plant, device, estimators or ["plumb"], parsed_maps(maps), rate=rate, native=native, ask=asker()
        )
        changes: dict[str, object] = {}
    else:
        with progress_bar(f"preparing {system}"):  # builds our FMUs, which can take minutes with --native
            read = System.read(given, native=native, strict=strict)
        changes = device_parameters(read.interfaces, imu) if imu else {}
    changes |= rate_parameters(read.interfaces, rate) if rate else {}
    check_pictures(read, plot, report, animation)
    with kept(output), progress_bar(f"running {read.description.name}") as progress:
        result = simulate(
            read,
            stop_time=stop,
            step=1.0 / rate if rate and step is None else step,
            parameters=changes | parsed_sets(sets),
            record=recorded(read) if report or animation else None,
            jacobi=jacobi,
            treat=parsed_pairs(treat, "--treat", "plant=continuous"),
            in_process=in_process,
            step_timeout=step_timeout,
            progress=progress,
        )
    save(result, output)
    figure = Path(f"{read.description.name}.png") if plot else None
    notes(result.notes)
    table, not_compared, pictures = present_run(result, figure, report)
    notes(not_compared)
    if json:
        print_json(run_facts(result, [*result.notes, *not_compared]))
    else:
        print_table(table)
        written(output, *pictures)
    if animation:
        with progress_bar(f"drawing {animation.name}") as progress:
            notes(animate(result, animation, progress))
        written(None if json else animation)


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
    from ..cosim.packing import pack as pack_system
    from ..cosim.system import locate

    check_target(target, ".ssp", inputs=[system])
    with progress_bar(f"packing {system}"):
        pack_system(locate(system), target, native=native)
    out.print(str(target))


def demo(
    folder: Annotated[Path, typer.Option("--folder", "-f", help="Where figure and report go.")] = Path("imufmu-demo"),
) -> None:
    """Co-simulate a pendulum, an IMU and lee2012 in its three modes.

    \b
      imufmu demo
    """
    from ..reports.demo import run_demo

    check_folder(folder)
    with progress_bar("co-simulating the demo") as progress:
        made = run_demo(folder, progress)
    print_table(made.table)
    written(made.figure, made.report)
