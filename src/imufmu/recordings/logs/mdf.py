"""Measurement files of ASAM (.mf4, .mdf), by asammdf. Channels are found by their names and units, as columns are."""

from __future__ import annotations

import gc
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from ...blocks.units import factor, spellings
from ..columns import TIME, UNITS, Choice, recognised_columns
from ..faults import RecordingError, listed
from .sources import Source, damaged, library

_MARKS = (b"MDF     ", b"UnFinMF ")  # first bytes; the second of a file whose writing was cut off
_HEAD = 168  # bytes at least, of its first two blocks
_MASTERS = ("time", "t")  # names of the times of a group


def read_sources(path: Path, chosen: Mapping[str, Choice]) -> tuple[list[Source], list[str]]:
    """A source per signal, and notes. chosen: channels by signal, as a user names them. Raises RecordingError."""
    asammdf = library("asammdf", "mdf", path)
    with path.open("rb") as file:
        head = file.read(_HEAD)
        if head[:8] not in _MARKS or len(head) < _HEAD:  # asammdf says so, too, and more that is no help
            raise RecordingError(f"{path}: not a measurement file (MDF): it does not begin as one")
    failure = None
    with _without_last_words():
        try:
            names, choices, doubts, channels = _found(asammdf, path, chosen)
        except Exception as error:  # a damaged file raises whatever the library stumbles over
            failure = damaged(path, "a measurement file (MDF)", error)
    if failure:
        raise failure
    missing = [name for choice in choices.values() for name in choice.names if name not in channels]
    if missing:
        raise RecordingError(f"{path}: no channel {listed(missing)}; the channels are {listed(names)}")
    lacking = [signal for signal in ("gyro", "accel") if signal not in choices]
    if lacking:
        raise RecordingError(
            f"{path}: which channels are {' and '.join(lacking)}? {'; '.join([*doubts, ''])}there is "
            f"{listed(names)}: name them, as --columns {lacking[0]}=X,Y,Z:{spellings(UNITS[lacking[0]])[0]}"
        )
    return [_source(path, signal, choice, channels) for signal, choice in choices.items()], []


def _found(
    asammdf: Any, path: Path, chosen: Mapping[str, Choice]
) -> tuple[list[str], dict[str, Choice], list[str], dict[str, Any]]:
    """Names of all channels, those of each signal, what could be meant twice, and the channels as far as they exist."""
    with asammdf.MDF(str(path)) as file:
        places = {name: where[0] for name, where in file.channels_db.items() if name.lower() not in _MASTERS}
        recognised, doubts = recognised_columns(list(places))
        choices = {signal: choice for signal, choice in {**recognised, **chosen}.items() if signal != TIME}
        wanted = [name for choice in choices.values() for name in choice.names if name in places]
        return list(places), choices, doubts, {name: file.get(name, *places[name]) for name in wanted}


@contextmanager
def _without_last_words() -> Iterator[None]:
    """A file that could not be opened complains once more when it is freed, to the terminal and to no use."""
    hook = sys.unraisablehook
    sys.unraisablehook = lambda _: None
    try:
        yield
    finally:
        gc.collect()
        sys.unraisablehook = hook


def _source(path: Path, signal: str, choice: Choice, channels: Mapping[str, Any]) -> Source:
    """The channels of a signal at the times of the first of them."""
    first = channels[choice.names[0]]
    columns = []
    for name, sign in zip(choice.names, choice.signs or (1,) * len(choice.names), strict=True):
        channel = channels[name]
        unit = choice.unit or channel.unit or UNITS[signal]
        scale = factor(unit, UNITS[signal])
        if scale is None:
            raise RecordingError(
                f"{path}: channel {name!r} has the unit {unit!r}, which is none of {signal}; give one of "
                f"{', '.join(spellings(UNITS[signal]))} behind a colon, as --columns {signal}={choice.text()}"
            )
        values = np.asarray(channel.samples, float)
        if not np.array_equal(channel.timestamps, first.timestamps):
            values = np.interp(first.timestamps, channel.timestamps, values)
        columns.append(sign * scale * values)
    values = np.column_stack(columns) if len(columns) > 1 else columns[0]
    return Source(signal, np.asarray(first.timestamps, float), {signal: values})
