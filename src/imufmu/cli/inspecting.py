"""The verb ``imufmu inspect``."""

from __future__ import annotations

from pathlib import Path

import typer

from ..scoring.table import Table
from .console import Json, notes, print_entries, print_json, print_table, progress_bar
from .recording_options import AxesOption, Columns, File, Mount, Rate, Remember, Stream, Time, read_told
from .timing import tell_timing, timing_facts


def inspect(
    recording: File,
    columns: Columns = None,
    time: Time = None,
    rate: Rate = None,
    axes: AxesOption = None,
    mount: Mount = None,
    stream: Stream = None,
    remember: Remember = False,
    json: Json = False,
) -> None:
    """What is inside a recording: columns and units, rate, gaps, jitter, clipping, and whether its axes fit together.

    \b
      imufmu inspect walk.csv
      imufmu inspect log.txt --columns gyro=wx,wy,wz:deg/s --columns accel=ax,ay,az:g --time t:ms --remember
      imufmu inspect drone.csv --axes NED --json
      imufmu inspect broad                      a line per recording of a folder, and the timing of its device

    The axes of gyroscope and accelerometer are checked against each other: gravity, seen in the sensor, must turn as
    the gyroscope says. That finds deg/s taken for rad/s, a flipped axis, swapped axes and a left-handed set, where
    there is turning enough. Exit code 1 where they do not fit. Of a folder that holds several recordings of one device
    plumb's gyro_index is told, too.
    """
    from ..recordings.faults import RecordingError
    from ..recordings.folders import is_recording_folder
    from ..recordings.inspection import glimpse, is_alarm
    from ..recordings.inspection import inspect as look

    if recording.is_dir() and not is_recording_folder(recording):
        _inspect_folder(recording, json)
        return
    try:
        read = read_told(recording, columns, time, rate, axes, mount, stream, remember)
    except RecordingError:
        if not json and (facts := glimpse(recording)):
            print_entries(list(facts.items()))
        raise
    found = look(read)
    if json:
        print_json({"facts": found.facts, "findings": found.findings})
    else:
        print_entries([*found.facts.items(), *(("note", finding) for finding in found.findings)])
    if is_alarm(read):
        raise typer.Exit(1)


def _inspect_folder(folder: Path, json: bool) -> None:
    """A line per recording of a folder; those that cannot be read are notes."""
    from ..recordings.inspection import overview

    with progress_bar(f"reading {folder}") as progress:
        facts, faults = overview(folder, progress)
    notes(faults)
    if json:
        print_json({"recordings": facts, "findings": faults, "timing": timing_facts(folder)})
    else:
        words = {None: "cannot tell", True: "fit", False: "DO NOT FIT"}
        rows = [
            [
                f["recording"],
                f"{f['rate_hz']:.6g} Hz",
                f"{f['seconds']:.6g} s",
                str(f["missing"]),
                words[f["fits"]],
                ", ".join(f["signals"]),
            ]
            for f in facts
        ]
        print_table(Table(["recording", "rate", "span", "missing", "axes", "signals"], rows, words=True))
        tell_timing(folder)
