"""A table of text, as shown on the terminal and in reports."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Table:
    """Cells as shown. The first column names the row; ``words``: the other cells are words, not numbers."""

    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    words: bool = False
