"""The sources in a log, and which of them make one recording: a gyroscope and what goes with it."""

from __future__ import annotations

import importlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...files.names import no_such
from ..faults import RecordingError, listed
from ..raw import Stream


@dataclass(frozen=True)
class Source:
    """Readings of one sensor. name: what the file calls it. time: (n,), s. values: (n, k) by signal, in our units."""

    name: str
    time: np.ndarray
    values: Mapping[str, np.ndarray]


def library(name: str, extra: str, path: Path) -> Any:
    """The module that reads such a file. Raises RecordingError where it is not installed."""
    try:
        return importlib.import_module(name)
    except ImportError:
        raise RecordingError(
            f'{path}: to read it {name.partition(".")[0]} is needed: pip install "imufmu[{extra}]"'
        ) from None


def damaged(path: Path, kind: str, error: Exception) -> RecordingError:
    """The error for what a library says of a file, in one line."""
    said = " ".join(str(error).split()) or type(error).__name__
    return RecordingError(f"{path}: cannot be read as {kind}: {said[:200]}")


def streams_of(path: Path, sources: Sequence[Source], wanted: str | None) -> tuple[dict[str, Stream], list[str]]:
    """The streams of one gyroscope and of what else there is, by signal, and notes.

    wanted: name of the source whose gyroscope it is; of several the first if None. Raises RecordingError.
    """
    sources = [source for source in sources if len(source.time)]
    gyros = {source.name: source for source in sources if "gyro" in source.values}
    if wanted is not None and wanted not in gyros:
        raise RecordingError(f"{path}: {no_such('gyroscope', wanted, gyros)}")
    whole = [name for name, source in gyros.items() if "accel" in source.values]
    name = wanted or next(iter([*whole, *gyros]), None)
    if name is None:
        return {}, []
    base, notes = gyros[name], []
    if len(gyros) > 1 and wanted is None:
        others = [other for other in gyros if other != name]
        notes.append(f"gyro is that of {name}; there is {listed(others)} too: --stream NAME")
    streams = {signal: Stream(base.time, values) for signal, values in base.values.items()}
    for signal in dict.fromkeys(signal for source in sources for signal in source.values):
        if signal not in streams:
            source = _beside(base, [source for source in sources if signal in source.values])
            streams[signal] = Stream(source.time, source.values[signal])
            notes.append(f"{signal} is that of {source.name}")
    return streams, notes


def _beside(base: Source, sources: Sequence[Source]) -> Source:
    """The one to go with a gyroscope: of the same number, as in ``sensor_accel[1]``, else the first."""
    number = base.name.partition("[")[2]
    return next((source for source in sources if number and source.name.partition("[")[2] == number), sources[0])
