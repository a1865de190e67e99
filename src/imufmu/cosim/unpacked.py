"""What a process needs to know of an FMU to run it: where it lies, of which kind it is, and its variables."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple


class Equations(NamedTuple):
    """What it takes to solve an FMU for model exchange. told_of_steps: it wants to know of every step of the solver."""

    states: int
    indicators: int
    tolerance: float
    told_of_steps: bool


@dataclass(frozen=True)
class Unpacked:
    """An FMU on disk: its shared library, the folder it is unpacked in, its GUID and modelIdentifier.

    version: 2 or 3, of FMI. equations: of an FMU for model exchange; None for one for co-simulation.
    """

    library: Path
    folder: Path
    guid: str
    identifier: str
    version: int = 2
    equations: Equations | None = None


class Variable(NamedTuple):
    """What a slave needs to know of a variable. wire: its type in FMI 3.0. place, size: which element of an array."""

    name: str
    valueReference: int
    wire: str = ""
    place: int = 0
    size: int = 1

    @staticmethod
    def of(variable: Any) -> Variable:
        """Of a ModelVariable (fmpy), or one element of it."""
        element = [getattr(variable, name) for name in ("wire", "place", "size") if hasattr(variable, name)]
        return Variable(variable.name, variable.valueReference, *element)
