"""Arguments of the command line that need more than a type."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import typer

from ..files.atomic import check_not_read


def parsed_sets(sets: list[str] | None) -> dict[str, Any]:
    """NAME=VALUE as a dict with numbers, truth values and vectors of them; other text, and text in quotes, as text."""
    return {name: _parsed(value) for name, value in parsed_pairs(sets, "--set", "c_a=0.2").items()}


def parsed_pairs(texts: list[str] | None, option: str, example: str) -> dict[str, str]:
    """NAME=VALUE as a dict of texts."""
    values: dict[str, str] = {}
    for text in texts or []:
        name, equals, value = text.partition("=")
        if not (name.strip() and equals and value.strip()):
            raise typer.BadParameter(f"{text!r}: expected NAME=VALUE, such as {example}", param_hint=option)
        values[name.strip()] = value.strip()
    return values


def _parsed(text: str) -> Any:
    if len(text) > 1 and text[0] == text[-1] == '"':
        return text[1:-1]
    try:
        parts = [_number(part.strip()) for part in text.split(",")]
    except ValueError:
        return text
    return parts[0] if len(parts) == 1 else parts


def _number(text: str) -> Any:
    if text.lower() in ("true", "false"):
        return text.lower() == "true"
    try:
        return int(text)
    except ValueError:
        return float(text)


def check_target(path: Path | None, *suffixes: str, inputs: Iterable[str | Path] = ()) -> None:
    """Refuse a file to write before any work is done for it: of another kind, in no folder, or one of the inputs."""
    if not path:
        return
    if path.suffix.lower() not in suffixes:
        raise typer.BadParameter(f"{path}: the name must end in {' or '.join(suffixes)}")
    if not path.absolute().parent.is_dir():
        raise typer.BadParameter(f"{path}: no folder {path.absolute().parent}")
    check_not_read(path, inputs)


def check_folder(path: Path) -> None:
    """Refuse a folder to write to that cannot be one, before any work is done for it."""
    for part in (path, *path.parents):
        if part.exists() and not part.is_dir():
            raise typer.BadParameter(f"{part} is a file; give a folder, made if need be", param_hint="--folder")
