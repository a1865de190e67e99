"""Logs by the ends of their names."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ..raw import Raw, merged
from ..told import Told
from . import ardupilot, mdf, ros, ulog
from .sources import Source, streams_of

_Reader = Callable[[Path, Told], tuple[list[Source], list[str]]]
_READERS: dict[str, _Reader] = {
    ".bag": lambda path, told: ros.read_sources(path),
    ".db3": lambda path, told: ros.read_sources(path),
    ".mcap": lambda path, told: ros.read_sources(path),
    ".ulg": lambda path, told: ulog.read_sources(path),
    ".bin": lambda path, told: ardupilot.read_sources(path),
    ".mf4": lambda path, told: mdf.read_sources(path, told.columns),
    ".mdf": lambda path, told: mdf.read_sources(path, told.columns),
}
LOGS = tuple(_READERS)


def is_log(path: Path) -> bool:
    """Whether this is a log: a file with such a name, or the folder of a bag of ROS 2."""
    return (path / ros.METADATA).is_file() if path.is_dir() else path.suffix.lower() in _READERS


def read_log(path: Path, told: Told) -> Raw:
    """Read a log. Raises RecordingError and OSError."""
    reader = _READERS[".mcap" if path.is_dir() else path.suffix.lower()]
    if not path.is_dir():
        path.open("rb").close()  # so that a missing file is told as everywhere, not in the words of a library
    sources, notes = reader(path, told)
    streams, more = streams_of(path, sources, told.stream)
    return merged(path, streams, told.rate, [*notes, *more])
