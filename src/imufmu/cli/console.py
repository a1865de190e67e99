"""What the command line prints: results on standard output; notes and progress on standard error."""

from __future__ import annotations

import codecs
import json
import math
import os
import shutil
import sys
import textwrap
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from io import TextIOWrapper
from pathlib import Path
from threading import Event, Thread
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from ..scoring.table import Table

out = Console(highlight=False, emoji=False, soft_wrap=True)
err = Console(stderr=True, highlight=False, emoji=False, soft_wrap=True)

Json = Annotated[bool, typer.Option("--json", help="Print it as JSON, for programs.")]

_NARROWEST = 24  # characters of a folded column; where there is less room it stands below, indented by _BELOW
_BELOW = 4
_BETWEEN_LINES = 10.0  # s; of progress where there is no terminal

# For encodings that lack the first; any other character becomes a question mark.
_SUBSTITUTES = {"≤": "<=", "≥": ">=", "²": "2", "³": "3", "°": "deg", "µ": "u", "±": "+-", "…": "..."}
_SUBSTITUTES |= dict(zip("×−–—“”‘’", "x---\"\"''", strict=True))  # noqa: RUF001


def _substitute(error: UnicodeError) -> tuple[str, int]:
    """Error handler of a codec: what comes nearest to the characters that it does not have."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    characters = error.object[error.start : error.end]
    return "".join(" " if c.isspace() else _SUBSTITUTES.get(c, "?") for c in characters), error.end


codecs.register_error("imufmu", _substitute)


def show_what_can_be_shown() -> None:
    """From here on no character stops the program that the terminal, or the file behind a pipe, cannot hold."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="imufmu")


def shown(text: str) -> str:
    """The text as it will appear on standard output."""
    encoding = out.encoding
    return text.encode(encoding, errors="imufmu").decode(encoding)


def print_table(table: Table) -> None:
    """Aligned columns: words left, numbers right. Lines are never folded, so that they survive a pipe."""
    lines = [[shown(cell) for cell in line] for line in (table.columns, *table.rows)]
    widths = [max(len(line[i]) for line in lines) for i in range(len(table.columns))]
    for line in lines:
        left = [table.words or i == 0 for i in range(len(widths))]
        cells = (c.ljust(w) if to_left else c.rjust(w) for c, w, to_left in zip(line, widths, left, strict=True))
        out.print("  ".join(cells).rstrip(), markup=False)


def print_entries(rows: Sequence[Sequence[str]]) -> None:
    """Columns of words. On a terminal the last one is folded to fit; in a pipe every entry stays one line."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]) - 1)]
    has_width = out.is_terminal or "COLUMNS" in os.environ
    width = shutil.get_terminal_size().columns if has_width else sys.maxsize
    start = sum(widths) + 2 * len(widths)
    start = start if width - start >= _NARROWEST else _BELOW
    for row in rows:
        before = "".join(f"{cell:{w}}  " for cell, w in zip(row, widths, strict=False))
        if start == _BELOW:
            out.print(before.rstrip(), markup=False)
            before = " " * start
        for line in textwrap.wrap(shown(row[-1]), width - start, break_on_hyphens=False) or [""]:
            out.print((before + line).rstrip(), markup=False)
            before = " " * start


def print_json(content: Any) -> None:
    """For programs: nothing else may go to standard output then. Numbers that are not finite become null."""
    out.print(json.dumps(_finite(content), indent=2, allow_nan=False), markup=False)


def _finite(content: Any) -> Any:
    if isinstance(content, Mapping):
        return {key: _finite(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [_finite(value) for value in content]
    return None if isinstance(content, float) and not math.isfinite(content) else content


def written(*paths: Path | None) -> None:
    for path in paths:
        if path:
            out.print(f"wrote {path.resolve()}", markup=False)


def notes(texts: Iterable[str]) -> None:
    for note in texts:
        err.print(f"note: {note}", markup=False)


@contextmanager
def progress_bar(what: str) -> Iterator[Callable[[int, int], None]]:
    """A bar on a terminal; elsewhere, as in the log of a CI server, a line every ten seconds."""
    if not err.is_terminal:
        with _progress_lines(what) as progress:
            yield progress
        return
    columns = (TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn())
    with Progress(*columns, console=err, transient=True) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


@contextmanager
def _progress_lines(what: str) -> Iterator[Callable[[int, int], None]]:
    """Lines from a thread of their own, as some work reports no progress for a while."""
    share, ended, begin = "", Event(), time.monotonic()

    def progress(done: int, total: int) -> None:
        nonlocal share
        share = f"{100 * done / total:.0f} % after " if total else ""

    def tell() -> None:
        while not ended.wait(_BETWEEN_LINES):
            err.print(f"{what}: {share}{time.monotonic() - begin:.0f} s", markup=False)

    teller = Thread(target=tell, daemon=True)
    teller.start()
    try:
        yield progress
    finally:
        ended.set()
        teller.join()
