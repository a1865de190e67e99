"""A C FMU that crashes, exits, hangs, leaks or floods, as its parameter ``fault`` says."""

from __future__ import annotations

import subprocess
from enum import IntEnum, auto
from pathlib import Path

from support.cosim_stubs import LIBRARY, model_description, variable, write_ssd, write_zip
from support.optional import skip_without
from support.places import built_once

H = 0.125  # s
INPUTS = [f"{signal}[{i}]" for signal in ("gyro", "accel") for i in (1, 2, 3)]


class Fault(IntEnum):
    """In the step from t = 0.5, or where the name says otherwise."""

    NONE = 0
    EXIT_0 = auto()
    EXIT_3 = auto()
    SEGMENTATION = auto()
    ABORT = auto()
    SIGTERM = auto()
    HANG = auto()
    CRASH_IN_FREE = auto()
    HANG_IN_FREE = auto()
    THREAD = auto()
    CHDIR = auto()
    FLOOD = auto()
    STATUS_MINUS_5 = auto()
    STATUS_99 = auto()
    FORK_AND_EXIT = auto()
    CLOSE_DESCRIPTORS = auto()
    SIGINT = auto()
    CHILD = auto()
    BAD_INITIALISATION = auto()
    GARBLE = auto()


def rogue() -> Path:
    """The FMU, with gyro and accel as an estimator has them; skips the test where there is no compiler for it."""
    skip_without("POSIX", "cc")

    def build(path: Path) -> None:
        library, source = path.with_suffix(".library"), Path(__file__).with_name("rogue.c")
        command = ["cc", "-shared", "-fPIC", "-w", "-o", str(library), str(source), "-lpthread"]
        subprocess.run(command, check=True)
        variables = [variable("y", "output"), *(variable(name, "input") for name in INPUTS)]
        description = model_description([*variables, variable("fault", "parameter", "Integer")])
        write_zip(path, {"modelDescription.xml": description, LIBRARY: library.read_bytes()})

    return built_once("rogue.fmu", build)


def rogue_system(folder: Path) -> Path:
    """A system of the rogue alone: 9 rows, 5 of them up to its fault."""
    return write_ssd(folder / "rogues.ssd", {"rogue": rogue()}, step=H)
