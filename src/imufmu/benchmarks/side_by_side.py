"""Replays of one recording through several estimators, and through filters of others, for one table and one figure."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..blocks.rotations import over_rows, roll_pitch
from ..cosim.replay import Replay, in_axes_of
from ..cosim.results import Result
from ..recordings.reading import Recording
from .peers import peers


def parameters_of(estimator: str, given: Mapping[str, Any], every: Sequence[str]) -> dict[str, Any]:
    """Parameters of one of several estimators: those with its name before a dot, and those with none of the names."""
    names = {Path(name).stem for name in every}
    own = {}
    for key, value in given.items():
        before, dot, after = key.partition(".")
        if not dot or before not in names:
            own[key] = value
        elif before == Path(estimator).stem:
            own[after] = value
    return own


def replay_all(estimators: Sequence[str], replay_one: Callable[[str], Replay]) -> list[Replay]:
    """A replay per estimator, each once."""
    return [replay_one(name) for name in dict.fromkeys(estimators)]


def peer_replays(recording: Recording) -> list[Replay]:
    """Replays through the filters of others that are installed. Raises ValueError where none is."""
    found = peers()
    if not found:
        raise ValueError('no filter of others is installed; pip install "imufmu[peers]" brings VQF and imufusion')
    readings = recording.at_instants()
    replays = []
    for peer in found:
        vertical = peer.estimate(readings, recording.sample_period)["vertical"][recording.sample_index]
        angles = over_rows(lambda u: roll_pitch(u), vertical)
        columns = {"roll": angles[:, 0], "pitch": angles[:, 1]}
        columns |= {f"vertical[{i + 1}]": vertical[:, i] for i in range(3)}
        units = {name: "rad" if name in ("roll", "pitch") else "1" for name in columns}
        replays.append(Replay(recording, peer.name, in_axes_of(recording, columns, units), units, ()))
    return replays


def together(replays: Sequence[Replay]) -> Result:
    """Results of all replays as one, with the estimator's name before each variable."""
    recording = replays[0].recording
    columns: dict[str, np.ndarray] = {}
    units: dict[str, str | None] = {}
    for replay in replays:
        columns |= {f"{replay.estimator}.{name}": values for name, values in replay.columns.items()}
        units |= {f"{replay.estimator}.{name}": unit for name, unit in replay.units.items()}
    notes = tuple(dict.fromkeys(note for replay in replays for note in replay.notes))
    return Result(recording.name, recording.time, columns, units, notes)
