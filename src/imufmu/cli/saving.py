"""Results go to disk before anything else can fail on them, also those of a run that fails."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ..cosim.errors import SimulationError
from ..cosim.interrupt import Terminated
from .console import notes


def save(result: Any, path: Path | None) -> None:
    """Write a result to a .h5 or .csv file."""
    if path:
        (result.to_hdf5 if path.suffix.lower() == ".h5" else result.to_csv)(path)


@contextmanager
def kept(path: Path | None) -> Iterator[None]:
    """Write the rows of a run that fails or is interrupted, marked as partial."""
    try:
        yield
    except (SimulationError, KeyboardInterrupt, Terminated) as error:
        result = getattr(error, "result", None)
        if path and result is not None:
            try:
                save(result, path)
                notes([f"{path} is partial: {result.partial.partition(':')[0]}"])
            except OSError as fault:
                notes([str(fault)])
        raise
