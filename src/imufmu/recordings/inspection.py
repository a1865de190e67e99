"""What is inside a recording: rate, gaps, jitter, clipping, noise at rest, and whether its axes fit together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..blocks.vocabulary import GRAVITY
from .checks import axes_doubts, field_turning_of, turning_of
from .faults import RecordingError
from .reading import TEXTS, Recording, read, recordings_in
from .text_table import read_table

_AT_THE_END = 3  # samples in a row at one end of the range: the sensor clips
_STILL = 0.02  # rad/s, scatter of a gyroscope at rest


@dataclass(frozen=True)
class Inspection:
    """facts: words by topic. findings: what should be looked at before the recording is used."""

    facts: dict[str, str]
    findings: list[str]


@np.errstate(over="ignore", invalid="ignore")  # absurd values are for the findings
def inspect(recording: Recording) -> Inspection:
    """Look at a recording."""
    facts = {"recording": str(recording.path), **recording.facts}
    facts["time"] = _time(recording)
    facts["gaps"] = _gaps(recording)
    facts["jitter"] = _jitter(recording)
    for name, readings in recording.readings.items():
        facts[name] = _readings(name, readings, recording)
    facts["at the start"] = _start(recording)
    facts["truth"] = ", ".join(recording.truth) or "none"
    doubtful = axes_doubts(recording)
    facts["axes"] = _axes(recording, doubtful)
    findings = [*recording.notes, *_clipping(recording), *_frozen(recording), *_field(recording), *doubtful]
    return Inspection(facts, list(dict.fromkeys(findings)))


def is_alarm(recording: Recording) -> bool:
    """Whether something is wrong with axes or units."""
    return bool(axes_doubts(recording))


def glimpse(path: Path) -> dict[str, str]:
    """What can be told of a file that is not read as a recording yet: how it is written, its columns, its first row."""
    if path.suffix.lower() not in TEXTS or not path.is_file():
        return {}
    try:
        table = read_table(path)
    except (RecordingError, OSError):
        return {}
    facts = {"file": f"{path}: {table.description}"}
    facts |= {f"above ({i + 1})": line[:120] for i, line in enumerate(table.preamble[:5])}
    for i, name in enumerate(table.full_names):
        values = [row[i].strip() for row in table.samples if i < len(row)][:3]
        facts[f"column {i + 1}"] = f"{name[:60]!r}: {', '.join(values)[:60]}, ..."
    return facts


def overview(
    folder: Path, progress: Callable[[int, int], None] | None = None
) -> tuple[list[dict[str, Any]], list[str]]:
    """Facts per recording of a folder, by name with the unit in it; and why others cannot be read."""
    facts: list[dict[str, Any]] = []
    faults: list[str] = []
    paths = recordings_in(folder)
    for done, path in enumerate(paths):
        try:
            recording = read(path)
        except RecordingError as fault:
            faults.append(str(fault))
        else:
            missing = int(recording.sample_index[-1]) + 1 - len(recording.time)
            facts.append(
                {
                    "recording": path.name,
                    "rate_hz": 1 / recording.sample_period,
                    "seconds": float(recording.time[-1] - recording.time[0]),
                    "missing": missing,
                    "signals": [*recording.readings, *recording.truth],
                    "fits": _fits(recording),
                }
            )
        if progress:
            progress(done + 1, len(paths))
    if not facts:
        raise RecordingError(f"{folder}: no recording in it" + (f"; {faults[0]}" if faults else ""))
    return facts, faults


def _fits(recording: Recording) -> bool | None:
    """Whether the axes fit together; None where nothing tells."""
    if axes_doubts(recording):
        return False
    return True if turning_of(recording).seen or field_turning_of(recording).seen else None


def _time(recording: Recording) -> str:
    count, span = len(recording.time), recording.time[-1] - recording.time[0]
    return f"{count} rows over {span:.6g} s from {recording.time[0]:.10g} s, {1 / recording.sample_period:.6g} Hz"


def _gaps(recording: Recording) -> str:
    steps = np.diff(recording.sample_index)
    missing = int((steps - 1).sum())
    if not missing:
        return "none"
    longest = int(np.argmax(steps))
    lasting = (steps[longest] - 1) * recording.sample_period
    return (
        f"{missing} samples missing ({missing / (recording.sample_index[-1] + 1):.2%}) in {(steps > 1).sum()} gaps, "
        f"the longest of {lasting:.3g} s at {recording.time[longest]:.10g} s"
    )


def _jitter(recording: Recording) -> str:
    """Scatter of the stamps about the sample clock."""
    late = recording.time - recording.time[0] - recording.sample_index * recording.sample_period
    late -= np.polyval(np.polyfit(recording.sample_index, late, 1), recording.sample_index) if len(late) > 2 else late
    spread = late.std()
    if spread < 1e-6 * recording.sample_period:
        return "none"
    return f"{1e3 * spread:.3g} ms RMS, {1e3 * np.abs(late).max():.3g} ms at most"


def _readings(name: str, readings: np.ndarray, recording: Recording) -> str:
    flat = readings.reshape(len(readings), -1)
    known = np.isfinite(flat).all(axis=1)
    if not known.any():
        return "no complete sample"
    lengths = np.linalg.norm(flat[known], axis=1)
    least, most = flat[known].min(axis=0), flat[known].max(axis=0)
    unit = {"gyro": "rad/s", "accel": "m/s2", "mag": "uT", "forward_speed": "m/s"}[name]
    ranges = ", ".join(
        f"{axis} {low:.4g} to {high:.4g}" for axis, low, high in zip(("x", "y", "z"), least, most, strict=False)
    )
    if flat.shape[1] == 1:
        ranges = f"{least[0]:.4g} to {most[0]:.4g}"
    typical = f"; length {np.median(lengths):.4g} in the median" if flat.shape[1] > 1 and name != "gyro" else ""
    absent = f"; {(~known).sum()} of {len(known)} missing" if not known.all() else ""
    columns = recording.names.get(name)
    origin = f" from {', '.join(columns)}" if columns and tuple(columns) != _own(name, len(columns)) else ""
    return f"{ranges} {unit}{typical}{absent}{origin}"


def _own(name: str, size: int) -> tuple[str, ...]:
    return (name,) if size == 1 else tuple(f"{name}[{i + 1}]" for i in range(size))


def _start(recording: Recording) -> str:
    """Which way is up, and whether the sensor rests."""
    first = recording.time < recording.time[0] + 1.0
    gyro, accel = recording.gyro[first], recording.accel[first]
    complete = np.isfinite(gyro).all(axis=1) & np.isfinite(accel).all(axis=1)
    if not complete.any():
        return "no complete sample in the first second"
    up = np.median(accel[complete], axis=0)
    length = float(np.linalg.norm(up))
    axis = int(np.argmax(np.abs(up)))
    shown = (
        f"up along {'-' if up[axis] < 0 else '+'}{'xyz'[axis]}" if length and abs(up[axis]) > 0.9 * length else "tilted"
    )
    rests = "at rest" if gyro[complete].std(axis=0).max() < _STILL else "moving"
    hint = ""
    if shown == "up along -z":
        hint = "; the z axis points down (--axes NED, if the body was level), or accel is negated"
    return f"{shown}, {rests}, accel reads {length / GRAVITY:.4g} g{hint}"


def _axes(recording: Recording, doubtful: list[str]) -> str:
    if doubtful:
        return "gyro and accel, or mag, do not fit together"
    fits = [
        name for name, of in (("gravity", turning_of), ("the magnetic field", field_turning_of)) if of(recording).seen
    ]
    if fits:
        return f"fit together: {' and '.join(fits)} turn{'s' * (len(fits) == 1)} as the gyroscope says"
    return "too little turning, or too much motion, to tell whether they fit together"


def _clipping(recording: Recording) -> list[str]:
    """Axes that stay at their largest reading while the other axes go on."""
    found = []
    for name in ("gyro", "accel"):
        readings = recording.readings[name]
        if len(readings) < _AT_THE_END or not np.isfinite(readings).all(axis=1).any():
            continue
        goes_on = np.concatenate([[True], (np.diff(readings, axis=0) != 0).any(axis=1)])
        largest = np.nanmax(np.abs(readings))
        for axis, column in zip("xyz", readings.T, strict=True):
            for end in (np.nanmax(column), np.nanmin(column)):
                at_end = (column == end) & goes_on
                runs = np.convolve(at_end, np.ones(_AT_THE_END), "valid")
                if runs.max() == _AT_THE_END and abs(end) > 0.5 * largest and at_end.mean() < 0.5:
                    found.append(f"{name} {axis} stays at {end:.6g} for {at_end.sum()} samples: clipped there")
    return found


def _frozen(recording: Recording) -> list[str]:
    """A sensor whose complete sample repeats for long: it gives no new readings, or its rows are filled up."""
    found = []
    for name in ("gyro", "accel"):
        readings = recording.readings[name]
        same = (np.diff(readings, axis=0) == 0).all(axis=1)
        if same.mean() > 0.3:
            found.append(
                f"{name} repeats the sample before in {same.mean():.0%} of the rows: it is slower than the file"
            )
    return found


def _field(recording: Recording) -> list[str]:
    """The Earth's field points down North of the equator: else accel or mag may be negated."""
    if recording.mag is None:
        return []
    complete = np.isfinite(recording.mag).all(axis=1) & np.isfinite(recording.accel).all(axis=1)
    mag, accel = recording.mag[complete], recording.accel[complete]
    lengths = np.linalg.norm(mag, axis=1) * np.linalg.norm(accel, axis=1)
    if not len(lengths) or not (lengths > 0).any():
        return []
    upward = float(np.median((mag * accel).sum(axis=1)[lengths > 0] / lengths[lengths > 0]))
    if upward < 0.3:
        return []
    return ["mag points up: so it does South of the equator; elsewhere the sign of mag, or of accel, is wrong"]
