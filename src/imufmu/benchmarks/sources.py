"""Which recordings a benchmark reads, and the groups they belong to.

A place is a folder, with all that is below it, a file, or a pattern such as ``field/*``. Recordings are of one kind
that lie in one folder, or whose paths agree with a rule in the same way. BROAD lists further groups beside its trials.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from glob import glob, has_magic
from os import PathLike
from pathlib import Path
from typing import Any

from ..recordings.folders import is_recording_folder
from ..recordings.reading import is_recording

GROUPS_FILE = "trials.json"
Place = str | PathLike[str]


@dataclass(frozen=True)
class Source:
    """A file to read. name: unique among all. groups: its kind first, where the recordings are of several."""

    path: Path
    name: str
    groups: Sequence[str]


@dataclass(frozen=True)
class Sources:
    """Every file, the kinds in the order in which they were given, and the groups that files beside them list."""

    files: Sequence[Source]
    kinds: Sequence[str]
    groups: Sequence[str]


def sources(places: Place | Iterable[Place], rule: str = "") -> Sources:
    """The recordings of one place or several.

    rule: a regular expression for the path of a recording; its first group, or else what it fits, is the kind. Raises
    ValueError for a place that is none, a rule that is none, and a list of groups that is not BROAD's.
    """
    many = [places] if isinstance(places, str | PathLike) else list(places)
    paths = list({path.resolve(): path for place in many for path in _paths(place)}.values())
    folders = list(dict.fromkeys(path.parent for path in paths))
    kind_of = _by_rule(paths, rule) if rule else _by_folder(paths)
    kinds = [kind for kind in dict.fromkeys(kind_of.values()) if kind]
    listed = {folder: _listed_groups(folder / GROUPS_FILE) for folder in folders}
    order = dict.fromkeys(name for names, _ in listed.values() for name in names)
    names = {path: f"{path.parent.name}/{path.stem}" if len(folders) > 1 else path.stem for path in paths}
    if len(set(names.values())) < len(names):
        names = {path: str(path) for path in paths}
    if len(kinds) < 2 and not rule:
        kinds, kind_of = [], dict.fromkeys(paths, "")
    files = [
        Source(path, names[path], [*filter(None, [kind_of[path]]), *listed[path.parent][1].get(path.stem, ())])
        for path in paths
    ]
    return Sources(files, kinds, list(order))


def grouped(groups_of: Mapping[str, Sequence[str]], groups: Sequence[str]) -> list[tuple[str, set[str]]]:
    """Label and members of every row of a table of means: all recordings, then each group that is not one of these.

    groups_of: the groups of each recording, by its name.
    """
    found = [(f"mean of {len(groups_of)}", set(groups_of))]
    for group in groups:
        members = {name for name, own in groups_of.items() if group in own}
        if members and members not in [known for _, known in found]:
            found.append((f"{group} ({len(members)})", members))
    return found


def _paths(place: Place) -> list[Path]:
    """Every recording of one place, sorted."""
    path = Path(place)
    if path.is_dir():
        return _within(path)
    if path.exists():
        return [path]
    if not has_magic(str(place)):
        raise ValueError(f"{place}: no such file or folder")
    found = [Path(name) for name in sorted(glob(str(place), recursive=True))]
    if not found:
        raise ValueError(f"{place}: no file and no folder fits this pattern")
    every = (_within(p) if p.is_dir() else [p] * is_recording(p) for p in found)
    return [p for some in every for p in some]


def _within(folder: Path) -> list[Path]:
    """The recordings in a folder and below, sorted; itself, where it is one."""
    if is_recording_folder(folder) or is_recording(folder):
        return [folder]
    try:
        parts = sorted(folder.iterdir())
    except OSError as error:
        raise ValueError(f"{folder}: cannot list the folder: {error.strerror}") from None
    return [p for part in parts for p in (_within(part) if part.is_dir() else [part] * is_recording(part))]


def _by_folder(paths: Sequence[Path]) -> dict[Path, str]:
    """The name of each file's folder; its whole path where several have that name."""
    folders = dict.fromkeys(path.absolute().parent for path in paths)
    names = [folder.name for folder in folders]
    shown = {folder: str(folder) if names.count(folder.name) > 1 else folder.name for folder in folders}
    return {path: shown[path.absolute().parent] for path in paths}


def _by_rule(paths: Sequence[Path], rule: str) -> dict[Path, str]:
    try:
        pattern = re.compile(rule)
    except re.error as fault:
        raise ValueError(f"rule for groups {rule!r}: not a regular expression: {fault}") from None
    found = {path: pattern.search(path.as_posix()) for path in paths}
    if paths and not any(found.values()):
        raise ValueError(f"rule for groups {rule!r}: fits no recording, as {paths[0].as_posix()}")
    return {path: (match[1 if pattern.groups else 0] or "") if match else "" for path, match in found.items()}


def _listed_groups(path: Path) -> tuple[list[str], dict[str, list[str]]]:
    """Names of the groups in their order, and the groups of each trial, as BROAD lists them beside its files."""
    if not path.is_file():
        return [], {}
    try:
        content: Any = json.loads(path.read_text(encoding="utf-8"))
        order = [group["name"] for group in content["groups"]]
        return order, {name: list(trial["groups"]) for name, trial in content["trials"].items()}
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as fault:
        raise ValueError(f"{path}: not the list of trials that comes with BROAD ({fault!r})") from None
