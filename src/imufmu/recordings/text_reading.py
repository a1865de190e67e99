"""Read a recording from a text table: choose columns, find units, make a clock of the times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from ..blocks.units import factor, spellings
from .columns import OWN, REQUIRED, SIGNALS, TIME, UNITS, VALID, Choice, Columns, own_columns, recognised_columns
from .faults import RecordingError, listed
from .presets import preset_of
from .raw import Raw, Where
from .sample_clock import ClockError
from .stamps import Clock, evenly, read_clock
from .text_table import TextTable, read_table
from .turning import DEGREE, best_scale

# Lengths of a reading in the median, by the unit that they tell. Not for a gyroscope, which may be at rest.
_USUAL: Mapping[str, Mapping[str, tuple[float, float]]] = {
    "gyro": {},
    "accel": {"m/s2": (5, 20), "g": (0.5, 2), "mg": (500, 2000)},
    "mag": {"uT": (10, 150), "gauss": (0.1, 1.5), "mG": (150, 1500), "nT": (1e4, 1.5e5)},
}
_TRUTH = ("q_NS", "roll", "pitch", "yaw")
_GUESSED = (*_USUAL, "roll", "pitch", "yaw")
_FASTEST = 35.0  # rad/s; gyroscopes for hands and vehicles end there, at 2000 deg/s
_LARGEST_ANGLE = 6.5  # rad

# A magnetometer in units of the field of its place, as Xsens and Shimmer write it.
_LOCAL_FIELD = 50.0  # uT
_LOCAL_UNITS = ("a.u.", "au", "local_flux", "arbitrary")


def read_text(path: Path, rate: float | None, columns: Columns) -> Raw:
    """Read a text table. columns: those that the user tells. Raises RecordingError and OSError."""
    table = read_table(path)
    chosen, tick, notes, guessed = _chosen(table, columns, rate is None)
    places = {
        signal: [_place(table, name, signal) for name in choice.names]
        for signal, choice in chosen.items()
        if signal != TIME or rate is None
    }
    order = sorted({place for found in places.values() for place in found})
    values, lines = table.numbers(order)
    time_place = order.index(places[TIME][0]) if TIME in places else None
    values, lines = _without_doubles(values, lines, time_place, notes)
    if len(values) < 2:
        raise RecordingError(f"{path}: {len(values)} samples; a recording needs at least 2")
    raw = {signal: values[:, [order.index(place) for place in found]] for signal, found in places.items()}

    def where(row: int) -> str:
        return f"{path}, line {lines[row]}"

    clock = _clock(table, raw.pop(TIME, None), chosen.get(TIME), tick, len(values), rate, where)
    signals = {}
    for signal, array in raw.items():
        choice = chosen[signal]
        factors = _factors(table, choice, signal, places[signal], raw, clock, signal in guessed, notes)
        shape = SIGNALS[signal].shape if signal in SIGNALS else ()
        with np.errstate(over="ignore"):  # absurd values are for the notes
            signals[signal] = (array * factors * (choice.signs or 1)).reshape(len(array), *shape)
    if (valid := signals.pop(VALID, None)) is not None and "forward_speed" in signals:
        signals["forward_speed"] = np.where(valid == 0, np.nan, signals["forward_speed"])
    notes += clock.notes
    missing = int(clock.index[-1]) + 1 - len(clock.index)
    if missing:
        longest = int(np.argmax(np.diff(clock.index)))
        total = clock.index[-1] + 1
        notes.append(f"{missing} of {total} samples have no row; the longest gap is after line {lines[longest]}")
    facts = {"file": table.description, "columns": ", ".join(table.full_names)}
    names = {signal: [table.names[place] for place in found] for signal, found in places.items()}
    return Raw(signals, clock, where, notes, facts=facts, names=names)


def _chosen(
    table: TextTable, told: Columns, timed: bool
) -> tuple[dict[str, Choice], float | None, list[str], set[str]]:
    """Columns by signal, s per count of the time column, notes, and signals whose unit nobody has told."""
    notes: list[str] = []
    tick, guessed = None, set[str]()
    if not table.has_header and not told:
        raise RecordingError(
            f"{table.path}, line 1: no names; the first line must name the columns: time, gyro[1], ...; or tell them "
            "by number: --columns time=1 --columns gyro=2,3,4 --columns accel=5,6,7"
        )
    found = own_columns(table.names)
    doubts: list[str] = []
    if found:
        _check_own(table, found, told, timed)
    elif preset := preset_of(table):
        found, tick = dict(preset.columns), preset.tick
        notes.append(f"read as a file of {preset.name}: " + _told(found) + (f"; {preset.note}" if preset.note else ""))
    else:
        found, doubts = recognised_columns(table.names)
        guessed = {signal for signal, choice in found.items() if choice.unit is None and signal in _GUESSED}
        shown = {s: c for s, c in found.items() if s not in told and (OWN[s] != c.names or s in _TRUTH)}
        if shown:
            truth = [signal for signal in _TRUTH if signal in shown]
            as_truth = f"; {', '.join(truth)} are taken for the truth" if truth else ""
            notes.append("columns by their names: " + _told(shown) + as_truth)
    if TIME in told:
        tick = None
    guessed -= set(told)
    found |= told
    _check_complete(table, found, doubts, timed)
    ignored = [n for n in table.names if n and all(n not in choice.names for choice in found.values())]
    if ignored and table.has_header:
        notes.append(f"ignored columns: {listed(ignored)}")
    return found, tick, notes, guessed


def _told(columns: Columns) -> str:
    return " ".join(f"{signal}={choice.text()}" for signal, choice in columns.items())


def _check_own(table: TextTable, found: dict[str, Choice], told: Columns, timed: bool) -> None:
    """Raises RecordingError with every problem of a header with names of ours."""
    names, problems = table.names, []
    for choice in found.values():
        problems += [f"column {n!r} appears {names.count(n)} times" for n in choice.names if names.count(n) > 1]
    if problems:
        raise RecordingError(f"{table.path}, line {table.header_line}: " + "; ".join(problems))
    wanted = [s for s in (*REQUIRED, *([TIME] if timed else [])) if s not in told]
    needed = dict.fromkeys([*wanted, *(s for s in found if s not in told and (timed or s != TIME))])
    missing = [n for s in needed for n in OWN[s] if n not in names]
    if missing:
        listing = ", ".join(f"{n} ({_unit_of(n)})" for n in missing)
        raise RecordingError(
            f"{table.path}, line {table.header_line}: missing: {listing}; the columns are {listed(table.full_names)}: "
            "rename them, or tell which they are: --columns gyro=wx,wy,wz:deg/s"
        )


def _unit_of(name: str) -> str:
    return UNITS[next(signal for signal, names in OWN.items() if name in names)]


def _check_complete(table: TextTable, found: Columns, doubts: Sequence[str], timed: bool) -> None:
    wanted = (*REQUIRED, TIME) if timed else REQUIRED
    missing = [signal for signal in wanted if signal not in found]
    if not missing:
        return
    there = f"the columns are {listed(table.full_names)}"
    unclear = [doubt for doubt in doubts if doubt.split()[0] in missing]
    asked = " ".join(
        f"--columns {s}=" + {"gyro": "wx,wy,wz:deg/s", "accel": "ax,ay,az:g", TIME: "t:ms"}[s] for s in missing
    )
    names = ", ".join(f"{n} ({_unit_of(n)})" for s in missing for n in OWN[s])
    reason = f"unclear: {'; '.join(unclear)}" if unclear else f"missing: {names}; {there}"
    also = _siblings(table.path) if not unclear else ""
    rate = "; or without times --rate 100" if missing == [TIME] else ""
    raise RecordingError(
        f"{table.path}, line {max(table.header_line, 1)}: {reason}: tell which they are, as {asked}{rate}{also}"
    )


def _siblings(path: Path) -> str:
    """A hint where the other sensor is in a file beside this one."""
    others = [n for n in ("Gyroscope.csv", "Accelerometer.csv", "TotalAcceleration.csv") if n != path.name]
    beside = [n for n in others if (path.parent / n).is_file()]
    one_sensor = path.stem.lower().startswith(("gyro", "acc", "totalacc", "mag"))
    return f"; or give the folder {path.parent}, where {beside[0]} is" if one_sensor and beside else ""


def _place(table: TextTable, name: str, signal: str) -> int:
    for names in (table.names, table.full_names):
        if names.count(name) > 1:
            raise RecordingError(f"{table.path}: column {name!r} appears {names.count(name)} times; tell it by number")
        if name in names:
            return names.index(name)
    if name.isdigit() and 1 <= int(name) <= len(table.names):
        return int(name) - 1
    raise RecordingError(f"{table.path}: no column {name!r} for {signal}; the columns are {listed(table.full_names)}")


def _without_doubles(
    values: np.ndarray, lines: list[int], time: int | None, notes: list[str]
) -> tuple[np.ndarray, list[int]]:
    """Rows that repeat the row before them, time and all, are one. time: place of its column."""
    if time is None or len(values) < 3:
        return values, lines
    at_once = np.concatenate([[False], values[1:, time] == values[:-1, time]])
    same = np.concatenate([[False], (values[1:] == values[:-1]).all(axis=1)])
    if not same.any() or same.sum() < 0.9 * at_once.sum() or same.mean() > 0.6:
        return values, lines
    notes.append(f"{same.sum()} rows repeat the row before them, time and all, and are left out")
    return values[~same], [line for line, double in zip(lines, same, strict=True) if not double]


def _clock(
    table: TextTable, stamps: np.ndarray | None, choice: Choice | None, tick: float | None, rows: int,
    rate: float | None, where: Where,
) -> Clock:  # fmt: skip
    if rate is not None:
        return evenly(rows, rate)
    assert stamps is not None and choice is not None  # as _check_complete has seen to
    unit = choice.unit or table.units[_place(table, choice.names[0], TIME)]
    try:
        return read_clock(stamps[:, 0] * (choice.signs or (1,))[0], unit, tick)
    except ClockError as error:
        hint = "; or give the rate (--rate), if the rows are evenly spaced" if rows > 2 else ""
        column = f"column {choice.names[0]!r}"
        raise RecordingError(f"{where(error.row)}, {column}: {error}{hint}") from None


def _factors(
    table: TextTable, choice: Choice, signal: str, places: Sequence[int], raw: Mapping[str, np.ndarray],
    clock: Clock, guess: bool, notes: list[str],
) -> np.ndarray:  # fmt: skip
    """What the values of each column are multiplied with."""
    wanted, found = UNITS[signal], []
    for place in places:
        unit = choice.unit or table.units[place]
        if not unit:
            found.append(_guessed(table, choice, signal, raw, clock, notes) if guess else 1.0)
            continue
        known = factor(unit, wanted)
        if known is None and signal == "mag" and unit.strip().lower() in _LOCAL_UNITS:
            known = _LOCAL_FIELD
        if known is None:
            raise RecordingError(
                f"{table.path}, line {table.header_line}: unit {unit!r} of column {table.names[place]!r} is unknown; "
                f"there is {', '.join(spellings(wanted))}: --columns {signal}={choice.text()}:{wanted}"
            )
        found.append(known)
    if signal == "mag" and _LOCAL_FIELD in found:
        notes.append(f"mag is in units of the local field: taken for {_LOCAL_FIELD:g} uT")
    return np.array(found)


@np.errstate(over="ignore", invalid="ignore")
def _guessed(
    table: TextTable, choice: Choice, signal: str, raw: Mapping[str, np.ndarray], clock: Clock, notes: list[str]
) -> float:
    """Factor of a reading whose unit nobody has told, from its values, with a note. Raises RecordingError."""
    length = np.linalg.norm(raw[signal], axis=1)
    typical = float(np.median(length[np.isfinite(length)])) if np.isfinite(length).any() else np.nan
    unit = next((u for u, (least, most) in _USUAL.get(signal, {}).items() if least <= typical <= most), None)
    if signal in _TRUTH:  # told for all angles together: small ones say nothing
        angles = [np.nanmax(np.abs(raw[name]), initial=0.0) for name in _TRUTH[1:] if name in raw]
        unit = "deg" if max(angles) > _LARGEST_ANGLE else "rad"
    elif signal == "mag" and unit is None:
        notes.append(f"nothing tells the unit of mag: its median length is taken for {_LOCAL_FIELD:g} uT")
        return _LOCAL_FIELD / typical if typical > 0 else 1.0
    elif signal == "gyro":
        place = best_scale(raw["gyro"], raw["accel"], clock.index, clock.period, (1.0, DEGREE))
        fast = np.nanquantile(length, 0.99) > _FASTEST if np.isfinite(length).any() else False
        unit = ("rad/s", "deg/s")[place] if place >= 0 else "deg/s" if fast else None
    said = f"{signal} is taken for {unit}, as its values tell; another unit: --columns {signal}=...:UNIT"
    if unit is None:
        units = {"gyro": "deg/s; counts as deg/s/131", "accel": "g, mg; counts as g/16384"}[signal]
        raise RecordingError(
            f"{table.path}: neither the header nor the values tell the unit of {signal}: tell it with its columns, as "
            f"--columns {signal}={choice.text()}:{UNITS[signal]} (or {units})"
        )
    notes += [said] if said not in notes else []
    return factor(unit, UNITS[signal]) or 1.0
