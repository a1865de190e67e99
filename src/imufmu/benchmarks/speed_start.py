"""What it costs to start: processor time of whole commands that do next to nothing."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median

from ..fmi.build import cached_fmu

_BLOCK = "lee2012"


@dataclass(frozen=True)
class StartTiming:
    """Processor time of a command, its whole process (s): median and least."""

    command: str
    seconds: float
    least: float


def start_timings(repeats: int, one_more: Callable[[], None]) -> list[StartTiming]:
    """``import imufmu`` and the quick verbs, in turn and again; empty where a system does not tell processor time."""
    if not repeats or os.name != "posix":
        return []
    fmu = str(cached_fmu(_BLOCK))
    verb = [sys.executable, "-m", "imufmu"]
    commands = {
        "python -c pass": [sys.executable, "-c", "pass"],
        "python -c 'import imufmu'": [sys.executable, "-c", "import imufmu"],
        "imufmu --version": [*verb, "--version"],
        "imufmu --help": [*verb, "--help"],
        f"imufmu info {_BLOCK}.fmu": [*verb, "info", fmu],
        "imufmu list": [*verb, "list"],
    }
    seconds: dict[str, list[float]] = {name: [] for name in commands}
    for _ in range(repeats):
        for name, command in commands.items():
            seconds[name].append(_processor_time(command))
        one_more()
    return [StartTiming(name, median(some), min(some)) for name, some in seconds.items()]


def _processor_time(command: Sequence[str]) -> float:
    before = os.times()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system
