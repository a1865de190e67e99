"""Which columns of a table are the readings, and in which unit: told by the user, by a preset, or by their names.

The text of a user: ``gyro=wx,wy,wz:deg/s`` names the columns x, y, z of a signal and, behind a colon, their unit (SI
where there is none). A name may be the number of a column, from 1, and a minus before it turns its sign.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from ..blocks import vocabulary as v
from ..blocks.units import factor, spellings
from ..files.names import no_such
from .faults import RecordingError, listed

SIGNALS = {s.name: s for s in (v.GYRO, v.ACCEL, v.MAG, v.FORWARD_SPEED, v.Q_NS, v.ROLL, v.PITCH, v.YAW)}
TIME, VALID = "time", "forward_speed_valid"
UNITS = {TIME: "s", VALID: "1"} | {name: signal.unit for name, signal in SIGNALS.items()}
REQUIRED = (v.GYRO.name, v.ACCEL.name)
OWN = {TIME: (TIME,), VALID: (VALID,)} | {name: tuple(signal.element_names()) for name, signal in SIGNALS.items()}

# Stems of names, in plain letters, that others give to a signal; the axis follows.
_STEMS = {
    "gyro": (
        "gyro",
        "gyroscope",
        "gyr",
        "angularvelocity",
        "angularrate",
        "rotationrate",
        "gyrorotation",
        "omega",
        "w",
        "g",
        "rate",
    ),
    "accel": ("accel", "accelerometer", "acc", "acceleration", "specificforce", "linearacceleration", "a", "f"),
    "mag": ("mag", "magnetometer", "magneticfield", "magn", "m"),
}
_TIMES = ("time", "timestamp", "t", "stamp", "secondselapsed", "elapsed", "elapsedtime", "timestampsample")
_WITHOUT_GRAVITY = ("linear", "user", "free")  # ends of what stands before such an acceleration
_SHORT = {"w", "g", "a", "f", "m", "t", "rate"}
# Ends of names that are units: acc_x_g, gyro_x_dps, time_ms.
_UNIT_ENDS = r"_(dps|deg_?s|deg_per_s|rad_?s|rad_per_s|radps|g|mg|m_?s2|mps2|ut|gauss|ms|us|ns|s|sec)$"
_END_UNITS = {
    "deg_s": "deg/s", "deg_per_s": "deg/s", "rad_s": "rad/s", "rad_per_s": "rad/s", "radps": "rad/s", "m_s2": "m/s2",
    "ms2": "m/s2", "degs": "deg/s", "rads": "rad/s", "sec": "s",
}  # fmt: skip


@dataclass(frozen=True)
class Choice:
    """Columns of one signal. names: as in the file, or numbers from 1. signs: +1 or -1. unit: None where not told."""

    names: tuple[str, ...]
    unit: str | None = None
    signs: tuple[int, ...] = ()

    def text(self) -> str:
        """As a user writes it."""
        signs = self.signs or (1,) * len(self.names)
        names = [("-" if sign < 0 else "") + (f'"{n}"' if re.search('[,:"]', n) else n)
                 for sign, n in zip(signs, self.names, strict=True)]  # fmt: skip
        return ",".join(names) + (f":{self.unit}" if self.unit else "")


Columns = Mapping[str, Choice]  # by signal name


def parsed_columns(texts: Iterable[str] | Mapping[str, str]) -> dict[str, Choice]:
    """``["gyro=wx,wy,wz:deg/s", "time=t:ms"]``, or the same as a mapping. ``--time t:ms`` is such a text, too.

    Raises RecordingError.
    """
    pairs = texts.items() if isinstance(texts, Mapping) else (text.partition("=")[::2] for text in texts)
    chosen = {}
    for name, value in pairs:
        signal = name.strip()
        if signal not in UNITS:
            raise RecordingError("columns: " + no_such("signal", signal, UNITS, "as in gyro=wx,wy,wz:deg/s"))
        chosen[signal] = _parsed(signal, value)
    return chosen


def _parsed(signal: str, text: str) -> Choice:
    unit, wanted = None, len(OWN[signal])
    before, colon, after = text.rpartition(":")
    if colon and '"' not in after:
        if factor(after, UNITS[signal]) is None:
            raise RecordingError(
                f"columns: {signal}={text}: unknown unit {after.strip()!r}; "
                f"there is {', '.join(spellings(UNITS[signal]))}"
            )
        text, unit = before, after.strip()
    cells = next(iter(csv.reader([re.sub(r'(^|,)\s*([-+]?)"', r'\1"\2', text)], skipinitialspace=True)), [])
    cells = [cell.strip() for cell in cells]
    if len(cells) != wanted or not all(cells):
        what = "one column" if wanted == 1 else f"{wanted} columns"
        example = ",".join(OWN[signal])
        raise RecordingError(f"columns: {signal}={text}: give {what}, as {signal}={example}, and a unit after a colon")
    signs = tuple(-1 if cell.startswith("-") else 1 for cell in cells)
    return Choice(tuple(cell.lstrip("+-").strip() for cell in cells), unit, signs)


def own_columns(names: Sequence[str]) -> dict[str, Choice]:
    """Columns that go by our names; none unless a gyro or accel of ours is among them."""
    if not {"gyro[1]", "accel[1]"} & set(names):
        return {}
    return {signal: Choice(columns) for signal, columns in OWN.items() if set(columns) & set(names)}


def recognised_columns(names: Sequence[str]) -> tuple[dict[str, Choice], list[str]]:
    """Columns whose names are like those that others give to a signal; and what could be meant twice, in words."""
    by_axis: dict[tuple[str, str, str], list[tuple[str, str | None]]] = {}
    times: list[tuple[str, str | None]] = []
    for name in names:
        plain, unit = _plain(name)
        if plain in _TIMES:
            times.append((name, unit))
        for prefix, stem, axis in _readings(plain):
            by_axis.setdefault((prefix, stem, axis), []).append((name, unit))
    found, doubts = {}, []
    for signal in _STEMS:
        sets = []
        prefixes = dict.fromkeys(key[0] for key in by_axis if key[1] == signal)
        with_gravity = [prefix for prefix in prefixes if not prefix.endswith(_WITHOUT_GRAVITY)]
        for prefix in with_gravity or prefixes:
            axes = [by_axis.get((prefix, signal, axis), []) for axis in "xyz"]
            if all(len(axis) == 1 for axis in axes):
                sets.append(Choice(tuple(axis[0][0] for axis in axes), axes[0][0][1]))
            elif any(len(axis) > 1 for axis in axes):
                doubts.append(f"{signal} could be any of {listed([name for axis in axes for name, _ in axis])}")
        if len(sets) == 1:
            found[signal] = sets[0]
        elif sets:
            doubts.append(f"{signal} could be {' or '.join(choice.text() for choice in sets)}")
    if len(times) > 1:
        times = [t for t in times if t[0].lower() in ("time", "seconds_elapsed")] or times
    if times:
        found[TIME] = Choice((times[-1][0],), times[-1][1])
    rest = {name: columns for name, columns in OWN.items() if name not in (*_STEMS, TIME)}
    found |= {signal: Choice(columns) for signal, columns in rest.items() if set(columns) <= set(names)}
    return found, doubts


def _plain(name: str) -> tuple[str, str | None]:
    """A name in small letters and digits, and the unit at its end where it has one."""
    text = re.sub(r"[\s.\-/]+", "_", re.sub(r"([a-z])([A-Z])", r"\1_\2", name.strip()).lower())
    match = re.search(_UNIT_ENDS, text)
    unit = _END_UNITS.get(match[1], match[1]) if match else None
    if match:
        text = text[: match.start()]
    return re.sub(r"[^a-z0-9\[\]]", "", text), unit


def _readings(plain: str) -> Iterable[tuple[str, str, str]]:
    """Prefix, signal and axis that a plain name can mean."""
    match = re.fullmatch(r"(.+?)(?:\[([1-3])\]|([xyz]))", plain) or re.fullmatch(r"(.+?)()([xyz])axis", plain)
    if not match:
        early = re.fullmatch(r"()([xyz])(gyro|acc|accel|mag)", plain)
        match_stem, axis = (early[3], early[2]) if early else ("", "")
    else:
        match_stem, axis = match[1], ("xyz"[int(match[2]) - 1] if match[2] else match[3])
    for signal, stems in _STEMS.items():
        for stem in stems:
            if match_stem == stem or (stem not in _SHORT and match_stem.endswith(stem) and len(stem) > 2):
                yield match_stem[: len(match_stem) - len(stem)], signal, axis
                break
