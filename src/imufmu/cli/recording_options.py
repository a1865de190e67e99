"""Options of every verb that reads a recording: what a user tells of the file, and that it is to be remembered."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from ..recordings.reading import Recording

File = Annotated[
    Path,
    typer.Argument(
        help="Recording: a text table (.csv, .txt, ...); a folder or .zip of phyphox, Sensor Logger or x-IMU3; a log "
        "of ROS, PX4, ArduPilot or MDF; a .mat of BROAD"
    ),
]
Columns = Annotated[
    list[str] | None,
    typer.Option("--columns", metavar="SIGNAL=X,Y,Z:UNIT", help="Columns of a signal, by name or number. Repeatable."),
]
Time = Annotated[str | None, typer.Option("--time", metavar="NAME:UNIT", help="The column of times.")]
Rate = Annotated[
    float | None, typer.Option("--rate", help="Samples per second of a recording whose times are not to be used.")
]
AxesOption = Annotated[
    str | None, typer.Option("--axes", help="Convention of the recording: ENU (ours), NED, NWU, android or ios.")
]
Mount = Annotated[
    str | None,
    typer.Option("--mount", help="The sensor on the body: roll,pitch,yaw in degrees, or the body's axes as x,-y,-z."),
]
Stream = Annotated[str | None, typer.Option("--stream", help="Which of several sensors of a log.")]
Remember = Annotated[
    bool, typer.Option("--remember", help="Write what is told here into NAME.toml beside the recording NAME.")
]


def read_told(
    path: Path,
    columns: list[str] | None,
    time: str | None,
    rate: float | None,
    axes: str | None,
    mount: str | None,
    stream: str | None,
    remember: bool,
) -> Recording:
    """The recording as the user tells it. What is to be remembered is written once the recording was read."""
    from ..recordings.columns import parsed_columns
    from ..recordings.reading import read
    from ..recordings.told import Told, memory_of, recall
    from ..recordings.told import remember as write
    from .console import notes

    texts = [*(columns or ()), *([f"time={time}"] if time else ())]
    recording = read(path, rate, columns=texts, axes=axes, mount=mount, stream=stream)
    if remember:
        told, _ = Told(parsed_columns(texts), rate, axes, mount, stream).completed(recall(path), path)
        if told == Told():
            notes([f"nothing was told of {path} that could be remembered"])
        else:
            write(path, told)
            notes([f"remembered in {memory_of(path)}: {told.text()}"])
    return recording
