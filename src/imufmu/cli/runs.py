"""The verbs that run something: run, replay, pack, demo."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..cosim.errors import STEP_TIMEOUT
from .arguments import check_folder, check_target, parsed_sets
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
    system: Annotated[str, typer.Argument(help="Name of a system (see: imufmu list), or an .ssd or .ssp file")],
    sets: Sets = None,
    stop: Annotated[float | None, typer.Option("--stop", help="Stop time (s).")] = None,
    step: Annotated[float | None, typer.Option("--step", help="Communication step (s).")] = None,
    jacobi: Annotated[
        bool, typer.Option("--jacobi", help="Take all inputs before the step, as simple masters do.")
    ] = False,
    native: Native = False,
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
      imufmu run pendulum_lee2012 --json

    The heading counts from East: an estimator without a magnetometer keeps what it does not know at the start.
    With --report or --animate the results also hold the points of the body, where the plant has the local variable
    skeleton. An FMU that imufmu has not built runs in a process of its own: if it crashes or hangs, the run ends, and
    the rows up to there are written, marked as partial.
    """
    from ..cosim.master import simulate
    from ..cosim.system import System
    from ..pictures.bodies import recorded
    from ..reports.present import animate, check_pictures, present_run
    from ..reports.tables import run_facts

    check_target(output, ".csv", ".h5", inputs=[system])
    check_target(report, ".html")
    check_target(animation, ".gif", ".mp4")
    with progress_bar(f"preparing {system}"):  # builds our FMUs, which can take minutes with --native
        read = System.read(system, native=native, strict=strict)
    check_pictures(read, plot, report, animation)
    with kept(output), progress_bar(f"running {read.description.name}") as progress:
        result = simulate(
            read,
            stop_time=stop,
            step=step,
            parameters=parsed_sets(sets),
            record=recorded(read) if report or animation else None,
            jacobi=jacobi,
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


def replay(
    recording: Annotated[Path, typer.Argument(help="Recording: .csv in SI units, or a BROAD .mat file")],
    estimator: Annotated[
        str, typer.Option("--estimator", "-e", help="Name of an estimator, or an .fmu file.")
    ] = "lee2012",
    sets: Sets = None,
    native: Native = False,
    output: Output = None,
    in_process: InProcess = False,
    step_timeout: StepTimeout = STEP_TIMEOUT,
    rate: Annotated[
        float | None, typer.Option("--rate", help="Samples per second of a .csv whose times are not to be used.")
    ] = None,
    local_variables: Annotated[bool, typer.Option("--locals", help="Also write the FMU's local variables.")] = False,
    offline: Annotated[
        bool, typer.Option("--offline", help="Use the whole recording for every row: forward and backward, no FMU.")
    ] = False,
    plot: Plot = False,
) -> None:
    """Feed a recording to an estimator FMU, one step per sample.

    \b
      imufmu replay walk.csv --estimator lee2012 --set c_a=0.2 --output tilt.csv --plot
      imufmu replay 01_undisturbed_slow_rotation_A.mat --estimator my_filter.fmu
      imufmu replay bunched_stamps.csv --rate 200 --output tilt.h5
      imufmu replay walk.csv --estimator plumb --offline

    A CSV file names its columns time, gyro[1], gyro[2], gyro[3], accel[1], accel[2], accel[3] and, where there are
    such, mag[1], mag[2], mag[3], forward_speed and the truth: roll, pitch, yaw or q_NS[1] to q_NS[4]. Units: s, rad/s,
    m/s2, uT, m/s, rad. Inputs of the FMU that the file does not have stay at their start values; a note tells. With a
    truth the errors are printed.
    """
    from ..cosim.offline import replay_offline
    from ..cosim.replay import estimator_fmu
    from ..cosim.replay import replay as replay_recording
    from ..recordings.reading import read
    from ..reports.present import present_replay

    check_target(output, ".csv", ".h5", inputs=[recording, estimator])
    read_recording = read(recording, rate)
    with kept(output), progress_bar(f"replaying {read_recording.name}") as progress:
        if offline:
            result = replay_offline(read_recording, estimator, parsed_sets(sets))
        else:
            result = replay_recording(
                read_recording,
                estimator_fmu(estimator, native=native),
                parsed_sets(sets),
                local_variables=local_variables,
                in_process=in_process,
                step_timeout=step_timeout,
                progress=progress,
            )
    save(result, output)
    figure = Path(f"{read_recording.name}_{result.estimator}.png") if plot else None
    notes(result.notes)
    table, not_compared = present_replay(result, figure)
    notes(not_compared)
    print_table(table)
    written(output, figure)


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
