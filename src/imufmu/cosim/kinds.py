"""The kinds of FMU that run: FMI 2.0 and 3.0, for co-simulation and for model exchange."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from .slave import Slave
from .unpacked import Unpacked


def slave_of(name: str, fmu: Unpacked, now: Any = None, say: Callable[[str], None] | None = None) -> Slave:
    """A new instance of the FMU, whatever its kind. Raises SimulationError."""
    kind = Slave
    if fmu.version == 3:
        from .slave3 import Slave3 as kind
    if fmu.equations is not None:
        from .solving import Solved2, Solved3

        kind = Solved3 if fmu.version == 3 else Solved2
    return kind(name, fmu, now, say)
