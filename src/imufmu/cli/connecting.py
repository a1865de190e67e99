"""The verb connect, and what run has of it: a plant of others, wired to an IMU and estimators."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from ..files.atomic import atomic_write
from .arguments import check_target
from .console import err, notes, out, written

Estimators = Annotated[
    list[str] | None,
    typer.Option("--estimator", "-e", help="Name of an estimator, or an .fmu file. Repeatable. Default: plumb."),
]
Maps = Annotated[
    list[str] | None,
    typer.Option("--map", metavar="WHAT=NAME", help="What is what in your FMU: gyro=omega:deg/s. Repeatable."),
]
Rate = Annotated[
    float | None, typer.Option("--rate", min=1e-3, max=1e6, help="Samples per second of everything: the step, too.")
]


def connect(
    plant: Annotated[Path, typer.Argument(help="Your plant: an FMU 2.0 or 3.0")],
    imu: Annotated[
        str,
        typer.Option("--imu", help="Device (see: imufmu list), an .ssv file, ideal, or none for sensors of its own."),
    ] = "mtx",
    estimators: Estimators = None,
    maps: Maps = None,
    rate: Rate = None,
    stop: Annotated[float | None, typer.Option("--stop", help="Stop time (s).")] = None,
    target: Annotated[
        Path | None, typer.Option("--out", "-o", help="The .ssd file to write; without it only say what was found.")
    ] = None,
) -> None:
    """Wire your own plant to an IMU and estimators: finds what it offers, writes the system.

    \b
      imufmu connect plant.fmu
      imufmu connect plant.fmu --imu mtx --estimator plumb --estimator lee2012 --out my.ssd
      imufmu connect plant.fmu --map gyro=p,q,r:deg/s --map accel=Body.f --map pitch=theta --map roll=phi
      imufmu connect plant.fmu --map accel=ax,-ay,-az --map quaternion=att:xyzw:to-world --out my.ssd
      imufmu run my.ssd --report my.html

    WHAT is gyro, accel, mag, forward_speed (of wheels, for plumb), and of the truth vertical, roll, pitch, yaw,
    quaternion, matrix, external_acceleration, position. NAME is a vector, or its elements with commas, - before one
    that points the other way; behind colons follow the unit, if the FMU names none, and of a quaternion its order
    (wxyz, xyzw) and whether it turns the components of a vector to-world or to-body. The accelerometer reads
    specific force: +9.8 on the axis that points up at rest. The world's z axis points up. What is not clear is
    asked on a terminal, and refused elsewhere.
    """
    from ..cosim.connecting.connect import connect as connected

    check_target(target, ".ssd", inputs=[plant])
    result = connected(plant, imu, estimators or ["plumb"], parsed_maps(maps), rate=rate, stop_time=stop, ask=asker())
    for line in (*result.found, result.compared):
        out.print(line, markup=False)
    notes(result.notes)
    if target:
        with atomic_write(target) as temporary:
            temporary.write_bytes(result.text(target.absolute().parent))
        written(target)


def parsed_maps(maps: Sequence[str] | None) -> dict[str, str]:
    """WHAT=NAME as a dict."""
    found = {}
    for text in maps or []:
        what, equals, name = text.partition("=")
        if not (what.strip() and equals and name.strip()):
            raise typer.BadParameter(f"{text!r}: expected WHAT=NAME, such as gyro=omega", param_hint="--map")
        found[what.strip()] = name.strip()
    return found


def check_system_or_plant(
    system: str | None, plant: Path | None, estimators: Sequence[str] | None, maps: Sequence[str] | None
) -> str | Path:
    """The one of both that is given."""
    if (system is None) == (plant is None):
        raise typer.BadParameter("give a SYSTEM (see: imufmu list), or your own plant by --plant my.fmu")
    for option, values in (("--estimator", estimators), ("--map", maps)):
        if values and plant is None:
            raise typer.BadParameter("give it together with --plant: a system has estimators", param_hint=option)
    return plant or str(system)


class _Asker:
    """Asks on the terminal, by number."""

    def __call__(self, question: str, answers: Sequence[str]) -> str:
        err.print(question, markup=False)
        for number, answer in enumerate(answers, 1):
            err.print(f"  {number}  {answer}", markup=False)
        while True:
            text = typer.prompt("number", err=True)
            if text.strip().isdigit() and 0 < int(text) <= len(answers):
                return answers[int(text) - 1]
            err.print(f"a number from 1 to {len(answers)}, please", markup=False)


def asker() -> _Asker | None:
    """Asks a user where there is one: at a terminal."""
    return _Asker() if sys.stdin and sys.stdin.isatty() and err.is_terminal else None
