"""The verbs about single FMUs: build, doctor, info."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..cosim.errors import STEP_TIMEOUT
from ..scoring.table import Table
from .arguments import check_folder
from .console import Json, out, print_json, print_table, progress_bar

Fmu = Annotated[str, typer.Argument(help="Name of a block, or an .fmu file")]


def build(
    names: Annotated[list[str], typer.Argument(help="Names of blocks (see: imufmu list), or: all")],
    folder: Annotated[Path, typer.Option("--folder", "-f", help="Where the FMUs go.")] = Path(),
    native: Annotated[bool, typer.Option("--native", help="Compiled C, which needs no Python where it runs.")] = False,
    imu: Annotated[
        str | None,
        typer.Option("--imu", help="With --native: bake this device (see: imufmu list), or an .ssv file, into imu."),
    ] = None,
    platforms: Annotated[
        list[str] | None,
        typer.Option(
            "--platform", "-p", help="With --native: a platform inside, or: all. Repeatable. Default: this one."
        ),
    ] = None,
) -> None:
    """Write FMUs, in Python or as native code.

    \b
      imufmu build lee2012
      imufmu build all --folder fmus
      imufmu build lee2012 --native
      imufmu build lee2012 --native --platform all        needs: pip install "imufmu[native]"
      imufmu build imu+lee2012 --native                   both in series, as one FMU
      imufmu build imu+plumb --native --imu mpu9150       its IMU with the errors and the rate of that device
    """
    from ..compiled.compilers import PLATFORMS
    from ..cosim.devices import device_values
    from ..fmi.build import build_fmu
    from ..fmi.native import build_native
    from ..registry import BLOCKS

    if platforms and not native:
        raise typer.BadParameter("give it together with --native", param_hint="--platform")
    if imu and not native:
        raise typer.BadParameter("give it together with --native", param_hint="--imu")
    check_folder(folder)
    device = {name: value.number for name, value in device_values(imu).items()} if imu else None
    for name in BLOCKS if names == ["all"] else names:
        if native:
            with progress_bar(f"compiling {name}") as progress:
                path = build_native(name, folder, [*PLATFORMS] if platforms == ["all"] else platforms, progress, device)
        else:
            path = build_fmu(name, folder)
        out.print(str(path))


def doctor(
    fmu: Fmu,
    step_timeout: Annotated[
        float, typer.Option("--step-timeout", min=0.001, help="Seconds that its one step may take.")
    ] = STEP_TIMEOUT,
) -> None:
    """Say whether and where an FMU will run, and try one step of it. Exit code 1 if something is wrong.

    \b
      imufmu doctor lee2012.fmu
      imufmu doctor lee2012
    """
    from ..fmi.doctor import Level, examine
    from ..fmi.info import file_of

    with progress_bar(f"trying {fmu}"):
        findings = examine(file_of(fmu), step_timeout)
    print_table(Table(["", "what", "finding"], [[f.level.value, f.topic, f.text] for f in findings], words=True))
    if any(finding.level is Level.PROBLEM for finding in findings):
        raise typer.Exit(1)


def info(fmu: Fmu, json: Json = False) -> None:
    """Variables, parameters and platforms of an FMU.

    \b
      imufmu info lee2012
      imufmu info plant.fmu --json
    """
    from ..fmi.info import COLUMNS, described, facts

    told = facts(fmu)
    if json:
        print_json(told)
        return
    heading, rows = described(told)
    for line in heading:
        out.print(line, markup=False)
    print_table(Table(COLUMNS, rows, words=True))
