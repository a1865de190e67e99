"""Arguments of the command line that need more than a type."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import typer


def parsed_sets(sets: list[str] | None) -> dict[str, Any]:
    """NAME=VALUE as a dict with numbers, truth values and vectors."""
    values: dict[str, Any] = {}
    for text in sets or []:
        name, equals, value = text.partition("=")
        if not (name.strip() and equals and value.strip()):
            raise typer.BadParameter(f"{text!r}: expected NAME=VALUE, such as c_a=0.2", param_hint="--set")
        parts = [_number(part.strip(), text) for part in value.split(",")]
        values[name.strip()] = parts[0] if len(parts) == 1 else parts
    return values


def _number(text: str, whole: str) -> Any:
    if text.lower() in ("true", "false"):
        return text.lower() == "true"
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    raise typer.BadParameter(f"{whole!r}: {text!r} is not a number", param_hint="--set")


def check_target(path: Path | None, *suffixes: str) -> None:
    """Refuse a file to write before any work is done for it."""
    if path and path.suffix.lower() not in suffixes:
        raise typer.BadParameter(f"{path}: the name must end in {' or '.join(suffixes)}")
    if path and not path.absolute().parent.is_dir():
        raise typer.BadParameter(f"{path}: no folder {path.absolute().parent}")
