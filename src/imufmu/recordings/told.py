"""What a user tells of a recording, and the file beside it that remembers that.

Beside ``walk.csv`` that is ``walk.csv.toml``:

    rate = 100.0
    axes = "NED"
    mount = "0,0,90"

    [columns]
    gyro = "wx,wy,wz:deg/s"
    time = "t:ms"
"""

from __future__ import annotations

import json
import os
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..files.atomic import atomic_write
from ..files.names import no_such
from .columns import Choice, parsed_columns
from .faults import RecordingError

_TEXTS = ("axes", "mount", "stream")


@dataclass(frozen=True)
class Told:
    """columns: by signal. rate: Hz. axes, mount: as text. stream: which sensor of a log. None where nothing is told."""

    columns: Mapping[str, Choice] = field(default_factory=dict)
    rate: float | None = None
    axes: str | None = None
    mount: str | None = None
    stream: str | None = None

    def completed(self, remembered: Told | None, path: Path) -> tuple[Told, list[str]]:
        """With what is remembered wherever nothing is told, and a note that says so."""
        if remembered is None:
            return self, []
        whole = Told(
            {**remembered.columns, **self.columns},
            self.rate if self.rate is not None else remembered.rate,
            *(getattr(self, name) or getattr(remembered, name) for name in _TEXTS),
        )
        return whole, [f"as remembered in {memory_of(path).name}: {remembered.text()}"] if whole != self else []

    def text(self) -> str:
        """As options of the command line."""
        parts = [f"--columns {signal}={choice.text()}" for signal, choice in self.columns.items()]
        parts += [f"--rate {self.rate:g}"] if self.rate is not None else []
        return " ".join([*parts, *(f"--{name} {value}" for name in _TEXTS if (value := getattr(self, name)))])


def memory_of(path: str | os.PathLike[str]) -> Path:
    """The file that remembers what was told of a recording."""
    return Path(path).with_name(Path(path).name + ".toml")


def recall(path: Path) -> Told | None:
    """What is remembered of a recording, None for nothing. Raises RecordingError for a file that is no such memory."""
    memory = memory_of(path)
    try:
        content = tomllib.loads(memory.read_text(encoding="utf-8"))
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        raise RecordingError(f"{memory}: cannot read: {error.strerror or error}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise RecordingError(f"{memory}: not TOML: {error}") from None
    try:
        return _told(content)
    except RecordingError as error:
        raise RecordingError(f"{memory}: {error}") from None


def _told(content: Mapping[str, Any]) -> Told:
    known = ("columns", "rate", *_TEXTS)
    for name in content:
        if name not in known:
            raise RecordingError(no_such("setting", name, known))
    columns, rate = content.get("columns", {}), content.get("rate")
    if not isinstance(columns, Mapping) or not all(isinstance(value, str) for value in columns.values()):
        raise RecordingError('[columns] has lines as gyro = "wx,wy,wz:deg/s"')
    if rate is not None and (isinstance(rate, bool) or not isinstance(rate, int | float)):
        raise RecordingError("rate is a number, samples per second")
    texts = [content.get(name) for name in _TEXTS]
    if not all(text is None or isinstance(text, str) for text in texts):
        raise RecordingError(f"{', '.join(_TEXTS)} are texts in quotes")
    return Told(parsed_columns(columns), None if rate is None else float(rate), *texts)


def remember(path: str | os.PathLike[str], told: Told) -> Path:
    """Write what was told of a recording beside it, over what was remembered before. Raises WriteError."""
    lines = [] if told.rate is None else [f"rate = {told.rate!r}"]
    lines += [f"{name} = {json.dumps(value)}" for name in _TEXTS if (value := getattr(told, name))]
    if told.columns:
        lines += [
            "",
            "[columns]",
            *(f"{s} = {json.dumps(c.text(), ensure_ascii=False)}" for s, c in told.columns.items()),
        ]
    memory = memory_of(path)
    with atomic_write(memory) as temporary:
        temporary.write_text("\n".join(lines).lstrip("\n") + "\n", encoding="utf-8")
    return memory
