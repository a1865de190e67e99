"""Command line: thin verbs over public functions. Exit codes: 0 success, 1 a finding, 2 wrong usage or input."""

from __future__ import annotations

import io
import platform
import sys
from contextlib import redirect_stdout
from typing import Annotated

import typer

from .. import __version__
from ..cosim.errors import SimulationError
from ..cosim.interrupt import clean_up_when_asked_to_end
from .checking import check
from .connecting import connect
from .console import err, out, show_what_can_be_shown
from .fmus import build, doctor, info
from .inspecting import inspect
from .listing import list_
from .replaying import replay
from .runs import demo, pack, run
from .speed import speed
from .verdicts import benchmark, predict, validate

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
  imufmu connect plant.fmu --out my.ssd         wires your own plant to an IMU and estimators
  imufmu replay walk.csv --estimator lee2012 --set c_a=0.2 --output tilt.csv
  imufmu inspect log.txt                        what is in a recording, its rate, gaps, units and axes
  imufmu pack pendulum_lee2012 pendulum.ssp     for other tools
  imufmu check pendulum_lee2012 --require "plumb.tilt.max < 2 deg"
  imufmu validate --junit verdict.xml           do the papers' conclusions hold?
  imufmu benchmark broad                        every filter on a folder of recordings
  imufmu speed                                  what a sample costs, native and in Python
  imufmu predict --imu mtx --slosh 1            how well this gyroscope can know the vertical

Exit codes: 0 success, 1 a finding (a criterion not met, a simulation failed), 2 wrong usage or input.
"""

app = typer.Typer(
    help=EXAMPLES,
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


@app.callback(invoke_without_command=True)
def _root(version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False) -> None:
    if version:
        out.print(f"imufmu {__version__}")
        raise typer.Exit


app.command("list")(list_)
VERBS = (build, doctor, info, connect, run, replay, inspect, pack, demo, check, validate, benchmark, speed, predict)
for verb in VERBS:
    app.command()(verb)


def main() -> None:
    """Entry point: errors of the user become one line, never a stack trace."""
    show_what_can_be_shown()
    clean_up_when_asked_to_end()
    if sys.platform == "linux" and platform.machine() != "x86_64":
        with redirect_stdout(io.StringIO()):  # FMPy says there that its logging library is not for this machine
            import fmpy  # noqa: F401
    try:
        app()
    except KeyboardInterrupt:
        err.print("interrupted")
        sys.exit(130)
    except SimulationError as error:
        err.print(f"error: {error}", markup=False)
        sys.exit(1)
    except (ValueError, OSError, MemoryError) as error:
        err.print(f"error: {str(error) or 'not enough memory'}", markup=False)
        sys.exit(2)
