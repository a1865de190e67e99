"""Results go to disk before anything else can fail on them, also those of a run that fails."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ..cosim.errors import SimulationError
from .console import notes


def save(result: Any, path: Path | None) -> None:
    """Write a result to a .h5 or .csv file."""
    if path:
        notes((result.to_hdf5 if path.suffix.lower() == ".h5" else result.to_csv)(path) or ())


@contextmanager
def kept(path: Path | None) -> Iterator[None]:
    """Write the rows of a run that fails, marked as partial. Who interrupts a run wants no file of it."""
    try:
        yield
    except SimulationError as error:
        if path and error.result is not None:
            try:
                save(error.result, path)
                notes([f"{path} is partial: {error.result.partial.partition(':')[0]}"])
            except OSError as fault:
                notes([str(fault)])
        raise
