"""The verb ``imufmu replay``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..cosim.errors import STEP_TIMEOUT
from .arguments import check_target, parsed_sets
from .console import notes, print_table, progress_bar, written
from .recording_options import AxesOption, Columns, File, Mount, Rate, Remember, Stream, Time, read_told
from .runs import InProcess, Native, Output, Plot, Sets, StepTimeout
from .saving import kept, save


def replay(
    recording: File,
    estimators: Annotated[
        list[str] | None,
        typer.Option("--estimator", "-e", help="Name of an estimator, or an .fmu file. Default: lee2012. Repeatable."),
    ] = None,
    sets: Sets = None,
    columns: Columns = None,
    time: Time = None,
    rate: Rate = None,
    axes: AxesOption = None,
    mount: Mount = None,
    stream: Stream = None,
    remember: Remember = False,
    peers: Annotated[bool, typer.Option("--peers", help="Beside VQF and imufusion, where installed.")] = False,
    native: Native = False,
    output: Output = None,
    in_process: InProcess = False,
    step_timeout: StepTimeout = STEP_TIMEOUT,
    local_variables: Annotated[bool, typer.Option("--locals", help="Also write the FMU's local variables.")] = False,
    offline: Annotated[
        bool, typer.Option("--offline", help="Use the whole recording for every row (plumb is smoothed). No FMU.")
    ] = False,
    plot: Plot = False,
) -> None:
    """Feed a recording to an estimator FMU, one step per sample; to several for a comparison.

    \b
      imufmu replay walk.csv --estimator lee2012 --set c_a=0.2 --output tilt.csv --plot
      imufmu replay walk.csv -e lee2012 -e plumb --peers --plot
      imufmu replay 01_undisturbed_slow_rotation_A.mat --estimator my_filter.fmu
      imufmu replay log.txt --columns gyro=wx,wy,wz:deg/s --columns accel=ax,ay,az:g --time t:ms --remember
      imufmu replay drone.csv --axes NED --mount 0,0,90 -e plumb
      imufmu replay bunched_stamps.csv --rate 200 --output tilt.h5
      imufmu replay walk.csv --estimator plumb --offline

    A file of our own names its columns time, gyro[1], gyro[2], gyro[3], accel[1], accel[2], accel[3] and, where there
    are such, mag[1], mag[2], mag[3], forward_speed, forward_speed_valid and the truth: roll, pitch, yaw or q_NS[1] to
    q_NS[4]. Units: s, rad/s, m/s2, uT, m/s, rad. Of others, columns and units are found by their names, or told by
    --columns; what was assumed is said. `imufmu inspect` shows what is in a file. Inputs of the FMU that the file does
    not have stay at their start values; a note tells. With a truth the errors are printed.

    With several estimators --set NAME=VALUE holds for all of them, --set lee2012.NAME=VALUE for one.
    """
    from ..benchmarks.side_by_side import parameters_of, peer_replays, replay_all, together
    from ..cosim.offline import replay_offline
    from ..cosim.replay import Replay, estimator_fmu
    from ..cosim.replay import replay as replay_recording
    from ..reports.present import present_replays

    chosen = list(dict.fromkeys(estimators or ["lee2012"]))
    check_target(output, ".csv", ".h5", inputs=[recording, *chosen])
    read = read_told(recording, columns, time, rate, axes, mount, stream, remember)
    given = parsed_sets(sets)
    with kept(output), progress_bar(f"replaying {read.name}") as progress:

        def replay_one(name: str) -> Replay:
            own = parameters_of(name, given, chosen) if len(chosen) > 1 else given
            if offline:
                return replay_offline(read, name, own)
            return replay_recording(
                read,
                estimator_fmu(name, native=native),
                own,
                local_variables=local_variables,
                in_process=in_process,
                step_timeout=step_timeout,
                progress=progress,
            )

        results = replay_all(chosen, replay_one) + (peer_replays(read) if peers else [])
    save(results[0] if len(results) == 1 else together(results), output)
    figure = Path(f"{read.name}_{results[0].estimator if len(results) == 1 else 'compared'}.png") if plot else None
    notes(together(results).notes)
    table, not_compared = present_replays(results, figure)
    notes(not_compared)
    print_table(table)
    written(output, figure)
