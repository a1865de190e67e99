"""Native FMUs under test: an instance and its phases."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import fmpy

from imufmu.blocks.block import Block
from imufmu.fmi.native import build_native
from support import fmu


def native(name: str = "lee2012", **options: Any) -> fmu.Fmu:
    return fmu.Fmu(name, kind="native", **options)


def unpacked_toy(block: Block, folder: Path) -> str:
    """Folder of the unpacked native FMU of a block that the test has registered, built on the first call."""
    unpacked = folder / f"{block.name}_unpacked"
    if not unpacked.is_dir():
        fmpy.extract(str(build_native(block.name, folder)), str(unpacked))
    return str(unpacked)


def enter(instance: fmu.Fmu) -> None:
    instance.slave.enterInitializationMode()


def leave(instance: fmu.Fmu) -> None:
    instance.slave.exitInitializationMode()


def terminate(instance: fmu.Fmu) -> None:
    instance.slave.terminate()


def derivative(instance: fmu.Fmu, output: str, with_respect_to: str) -> float:
    unknown, known = instance.variables[output].valueReference, instance.variables[with_respect_to].valueReference
    return float(instance.slave.getDirectionalDerivative([unknown], [known], [1.0])[0])
