"""The error that every reader of a recording raises."""

from __future__ import annotations


class RecordingError(ValueError):
    """A recording cannot be used; the message names file, place, fault and what to do."""


def listed(names: list[str]) -> str:
    """Names for a message, shortened: a file of another kind may have any."""
    shown = [repr(name if len(name) <= 30 else name[:30] + "...") for name in names[:20]]
    return ", ".join(shown) + (f" and {len(names) - 20} more" if len(names) > 20 else "")
