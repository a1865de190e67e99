"""The verb ``imufmu speed``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .arguments import check_target
from .console import out, print_table, progress_bar, written


def speed(
    blocks: Annotated[
        list[str] | None, typer.Argument(help="Names of sampled blocks. Default: lee2012 and plumb")
    ] = None,
    rates: Annotated[
        list[float] | None,
        typer.Option("--rate", help="Sample rate (Hz) beside the block's own; 285 without. Repeatable."),
    ] = None,
    json: Annotated[Path | None, typer.Option("--json", help="Write everything to this .json file.")] = None,
) -> None:
    """What a sample costs: native FMU, Python FMU, in process, and VQF's C++ where that is installed. Takes a minute.

    \b
      imufmu speed
      imufmu speed plumb --rate 285 --json speed.json

    Every line is measured in turn with the others, and again; the last column is its ratio to the native FMU in a C
    host. A C compiler is needed: the system's, or that of pip install "imufmu[native]".
    """
    from ..benchmarks.speed import BLOCKS_BY_DEFAULT, BROAD_RATE, tables, write_json
    from ..benchmarks.speed import speed as measure

    check_target(json, ".json")
    with progress_bar("measuring") as progress:
        result = measure(blocks or BLOCKS_BY_DEFAULT, rates or [BROAD_RATE], progress=progress)
    if json:
        write_json(json, result)
    out.print("; ".join(f"{what}: {name}" for what, name in result.machine.items()), markup=False)
    for table in tables(result):
        out.print()
        print_table(table)
    written(json)
