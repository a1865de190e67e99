"""How a run fails, and how long it waits before it does."""

from __future__ import annotations

from typing import Any

STEP_TIMEOUT = 60.0  # s, for each call of an FMU in a process of its own


class SimulationError(RuntimeError):
    """A run cannot go on; the message names component, call, time and what the FMU said.

    result: the rows up to there, a Result or a Replay marked as partial; None where there is no row yet.
    """

    result: Any = None


class EndOfRun(SimulationError):
    """An FMU asks to end the run, which is no failure once the run has begun; the message says who and when."""
