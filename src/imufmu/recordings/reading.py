"""Real recordings: CSV, and trials of BROAD [1].

A CSV recording has one header line and then one row per sample, in SI units, in any order of columns:

    column                        unit      meaning
    time                          s         increasing; gaps and jitter of the clock are allowed
    gyro[1] .. gyro[3]            rad/s     gyroscope, sensor frame S
    accel[1] .. accel[3]          m/s2      accelerometer (specific force: +g on the axis that points up at rest), S
    mag[1] .. mag[3]              uT        magnetometer, S; optional
    forward_speed                 m/s       speed along the vehicle's x axis as its wheels tell it; optional
    roll, pitch, yaw              rad       true Z-Y-X Euler angles; each optional
    q_NS[1] .. q_NS[4]            1         true attitude, Hamilton, scalar first, S to N (Z up); optional

An empty cell or ``nan`` is a missing reading. Other columns are ignored, with a note.

[1] Laidig, Caruso, Cereatti, Seel, BROAD - A Benchmark for Robust Inertial Orientation Estimation, Data 6(7), 2021,
    doi:10.3390/data6070072
"""

from __future__ import annotations

import csv
import os
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..blocks import vocabulary as v
from ..blocks.rotations import angle_between, euler_from_quaternion, over_rows, vertical_from_roll_pitch
from .matlab import MatlabError, read_matlab
from .sample_clock import ClockError, sample_clock

_REQUIRED = (v.GYRO, v.ACCEL)
_OPTIONAL = (v.MAG, v.FORWARD_SPEED, v.Q_NS, v.ROLL, v.PITCH, v.YAW)
_TRUTH = (v.Q_NS, v.ROLL, v.PITCH, v.YAW)
_UNITS = {"time": "s"} | {name: signal.unit for signal in (*_REQUIRED, *_OPTIONAL) for name in signal.element_names()}
_PERIOD_BOUNDS = v.sample_period(0.01)

Where = Callable[[int], str]  # row -> what a user calls it


class RecordingError(ValueError):
    """A recording cannot be used; the message names file, place, fault and what to do."""


@dataclass(frozen=True, eq=False)
class Recording:
    """Readings of one IMU over time, with truth where there is any. The arrays are read-only.

    time: (n,), s, as in the file. gyro, accel, mag: (n, 3), rad/s, m/s2, uT, in S; not finite where a reading is
    missing. truth: q_NS (n, 4), vertical (n, 3), roll, pitch, yaw (n,), rad, as far as the file tells; NaN where
    unknown. scored: (n,), bool, samples that count for errors. Row i belongs to the instant
    time[0] + sample_index[i] * sample_period; instants that no row belongs to are missing samples. notes: what a user
    should know but that is no error. forward_speed: (n,), m/s; as mag, None where the file has none.
    """

    path: Path
    time: np.ndarray
    gyro: np.ndarray
    accel: np.ndarray
    mag: np.ndarray | None
    truth: Mapping[str, np.ndarray]
    scored: np.ndarray
    sample_period: float
    sample_index: np.ndarray
    notes: tuple[str, ...] = ()
    forward_speed: np.ndarray | None = None

    def __repr__(self) -> str:
        known = ", ".join([*self.readings, *self.truth])
        return f"<Recording {self.path}: {len(self.time)} rows, {1 / self.sample_period:.6g} Hz, {known}>"

    def __post_init__(self) -> None:
        for array in (self.time, self.scored, self.sample_index, *self.readings.values(), *self.truth.values()):
            array.setflags(write=False)

    @property
    def name(self) -> str:
        return self.path.stem

    @property
    def is_broad(self) -> bool:
        """Whether it is a trial of BROAD: no other .mat file is read."""
        return self.path.suffix.lower() == ".mat"

    @property
    def readings(self) -> dict[str, np.ndarray]:
        """Readings by signal name, one row per row of the file."""
        every = {"gyro": self.gyro, "accel": self.accel, "mag": self.mag, "forward_speed": self.forward_speed}
        return {name: array for name, array in every.items() if array is not None}

    def at_instants(self) -> dict[str, np.ndarray]:
        """Readings by signal name at every instant, NaN at missing samples: sample_index[-1] + 1 rows.

        Results of a run over them belong to the rows of the file after indexing with ``sample_index``.
        """
        gridded = {}
        for name, array in self.readings.items():
            gridded[name] = np.full((int(self.sample_index[-1]) + 1, *array.shape[1:]), np.nan)
            gridded[name][self.sample_index] = array
        return gridded


def hold_missing(readings: np.ndarray) -> np.ndarray:
    """Readings (n, k) with the last finite value of the column where one is missing; 0 before the first."""
    row = np.arange(len(readings))[:, None]
    last = np.maximum.accumulate(np.where(np.isfinite(readings), row, -1), axis=0)
    held = np.take_along_axis(readings, np.maximum(last, 0), axis=0)
    return np.where(last >= 0, held, 0.0)


def read(path: str | os.PathLike[str], rate: float | None = None) -> Recording:
    """Read a recording: ``.csv`` (see above) or ``.mat`` (a trial of BROAD).

    rate: Hz, of a .csv whose rows are evenly spaced but whose times are of no use, as those of a host that gets samples
    in bunches; they are ignored then. Raises RecordingError.
    """
    path = Path(path)
    readers: dict[str, Callable[[Path], Recording]] = {".csv": partial(_read_csv, rate=rate), ".mat": _read_broad}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise RecordingError(
            f"{path}: cannot read {path.suffix or 'a file without suffix'}; use .csv, or .mat for BROAD"
        )
    if rate is not None and not _PERIOD_BOUNDS.minimum <= 1 / (rate or np.nan) <= _PERIOD_BOUNDS.maximum:
        raise RecordingError(f"{path}: a rate of {rate:g} Hz cannot be; give samples per second")
    try:
        return reader(path)
    except OSError as error:
        raise RecordingError(f"{path}: cannot read: {error.strerror or error}") from None
    except MemoryError:
        raise RecordingError(f"{path}: too large for this machine's memory; split it") from None


def _read_csv(path: Path, rate: float | None) -> Recording:
    """Read the CSV format of the module docstring."""
    lines: list[int] = []
    try:
        with open(path, newline="", encoding="utf-8-sig") as file:
            reader = csv.reader(file)
            header = [name.strip() for name in next(reader, [])]
            places, notes = _places(path, header, rate is None)
            rows = _numbers(path, reader, header, places, lines)
    except UnicodeDecodeError:
        raise RecordingError(f"{path}: not a UTF-8 text file; save the table as CSV in UTF-8") from None
    except csv.Error as error:
        raise RecordingError(f"{path}, after line {reader.line_num}: not a CSV table: {error}") from None
    if len(rows) < 2:
        raise RecordingError(f"{path}: {len(rows)} samples; a recording needs at least 2")
    table = dict(zip(places, np.array(rows).T, strict=True))
    signals = {
        signal.name: np.column_stack([table[name] for name in signal.element_names()]).reshape(-1, *signal.shape)
        for signal in (*_REQUIRED, *_OPTIONAL)
        if signal.element_names()[0] in table
    }

    def where(row: int) -> str:
        return f"{path}, line {lines[row]}"

    if rate is None:
        time = table["time"]
        try:
            period, index = sample_clock(time)
        except ClockError as error:
            hint = "; or give the rate (--rate), if the rows are evenly spaced" if len(time) > 2 else ""
            raise RecordingError(f"{where(error.row)}, column 'time': {error}{hint}") from None
    else:
        period, index = 1 / rate, np.arange(len(rows))
        time = index / rate
        notes.append(f"rows are taken for evenly spaced at {rate:g} Hz; times of the file are not used")
    missing = int(index[-1]) + 1 - len(time)
    if missing:
        longest = int(np.argmax(np.diff(time)))
        notes.append(
            f"{missing} of {index[-1] + 1} samples have no row; the longest gap is after line {lines[longest]}"
        )
    return _recording(path, time, period, index, signals, np.ones(len(time), bool), notes, where)


def _places(path: Path, header: Sequence[str], timed: bool) -> tuple[dict[str, int], list[str]]:
    """Place of every known column, and notes. Raises RecordingError with every problem of the header."""
    if not re.search("[a-df-z]", "".join(header), re.IGNORECASE):  # at most the e of 1e-3
        raise RecordingError(f"{path}, line 1: no names; the first line must name the columns: time, gyro[1], ...")
    if len(header) == 1 and re.search(r"[;\t|]", header[0]):
        raise RecordingError(f"{path}, line 1: separate the columns by commas, and write numbers with a decimal point")
    places = {name: place for place, name in enumerate(header) if name in _UNITS}
    problems = [f"column {name!r} appears {header.count(name)} times" for name in places if header.count(name) > 1]
    decorated = r"({})\s*[\[({{/].*".format("|".join(map(re.escape, _UNITS)))
    for name in header:
        if name not in _UNITS and (match := re.fullmatch(decorated, name)):
            known = match[1]
            problems.append(f"name column {name!r} just {known!r}, in SI units ({_UNITS[known]})")
    if not problems:
        needed = ["time"] * timed + [name for signal in _REQUIRED for name in signal.element_names()]
        for signal in _OPTIONAL:
            needed += signal.element_names() if places.keys() & set(signal.element_names()) else []
        missing = [name for name in needed if name not in places]
        if missing:
            wanted = ", ".join(f"{name} ({_UNITS[name]})" for name in missing)
            problems.append(f"missing: {wanted}; the columns are {_listed(header)}: rename them and use SI units")
    if problems:
        raise RecordingError(f"{path}, line 1: " + "; ".join(problems))
    ignored = [name for name in header if name not in _UNITS]
    return places, [f"ignored columns: {_listed(ignored)}"] if ignored else []


def _listed(names: Sequence[str]) -> str:
    """Names for a message, shortened: a file of another kind may have any."""
    shown = [repr(name if len(name) <= 30 else name[:30] + "...") for name in names[:20]]
    return ", ".join(shown) + (f" and {len(names) - 20} more" if len(names) > 20 else "")


def _numbers(
    path: Path, reader: Any, header: Sequence[str], places: Mapping[str, int], lines: list[int]
) -> list[list[float]]:
    """Values of the known columns; ``lines`` receives the line of each row, counted from 1."""
    rows = []
    order = list(places.values())
    line = reader.line_num + 1
    for cells in reader:
        if len(cells) == len(header):
            try:
                rows.append([float(cells[place]) for place in order])
            except ValueError:
                rows.append([_number(cells[p], f"{path}, line {line}, column {header[p]!r}") for p in order])
            lines.append(line)
        elif "".join(cells).strip():
            raise RecordingError(f"{path}, line {line}: {len(cells)} fields, but the header names {len(header)}")
        line = reader.line_num + 1
    return rows


def _number(cell: str, where: str) -> float:
    try:
        return float(cell) if cell.strip() else np.nan
    except ValueError:
        raise RecordingError(f"{where}: {_listed([cell])} is not a number") from None


def _read_broad(path: Path) -> Recording:
    """Read a trial of BROAD: a MATLAB file with imu_gyr, imu_acc, imu_mag, opt_quat, movement, sampling_rate."""
    try:
        content = read_matlab(path)
    except MatlabError as error:
        raise RecordingError(f"{path}: {error}") from None

    def array(key: str, width: int, rows: int | None = None) -> np.ndarray:
        if key not in content:
            found = _listed(list(content)) or "none"
            raise RecordingError(f"{path}: no variable {key!r}, so not a trial of BROAD; the variables are {found}")
        value = content[key]
        if value is None or value.ndim != 2 or value.shape[1] != width or rows not in (None, len(value)):
            shape = "no matrix of real numbers" if value is None else f"of shape {value.shape}"
            raise RecordingError(f"{path}: {key!r} is {shape}, expected ({'n' if rows is None else rows}, {width})")
        return value

    rate = array("sampling_rate", 1, 1).item()
    if not _PERIOD_BOUNDS.minimum <= 1 / (rate or np.nan) <= _PERIOD_BOUNDS.maximum:
        raise RecordingError(f"{path}: 'sampling_rate' is {rate:g}, expected a rate in Hz")
    gyro = array("imu_gyr", 3)
    n = len(gyro)
    if n < 2:
        raise RecordingError(f"{path}: {n} samples; a recording needs at least 2")
    signals = {"gyro": gyro, "accel": array("imu_acc", 3, n), "mag": array("imu_mag", 3, n)}
    signals["q_NS"] = array("opt_quat", 4, n)
    scored = array("movement", 1, n).ravel() != 0
    index = np.arange(n)
    return _recording(path, index / rate, 1 / rate, index, signals, scored, [], lambda row: f"{path}, row {row + 1}")


def _recording(
    path: Path,
    time: np.ndarray,
    period: float,
    index: np.ndarray,
    signals: Mapping[str, np.ndarray],
    scored: np.ndarray,
    notes: Iterable[str],
    where: Where,
) -> Recording:
    """The recording of checked signals: truth completed, samples without truth not scored, doubts noted."""
    gyro, accel, mag = signals["gyro"], signals["accel"], signals.get("mag")
    with np.errstate(over="ignore", invalid="ignore"):  # absurd values are for the notes
        truth = _complete({s.name: signals[s.name] for s in _TRUTH if s.name in signals}, where)
        for values in truth.values():
            scored = scored & np.isfinite(values.reshape(len(time), -1)).all(axis=1)
        speed = signals.get("forward_speed")
        recording = Recording(path, time, gyro, accel, mag, truth, scored, period, index, forward_speed=speed)
        return replace(recording, notes=(*notes, *_doubts(recording)))


def _complete(truth: Mapping[str, np.ndarray], where: Where) -> dict[str, np.ndarray]:
    """The truth of the file and what follows from it: angles from q_NS, the vertical from roll and pitch."""
    full = dict(truth)
    if "q_NS" in truth:
        length = np.linalg.norm(truth["q_NS"], axis=1)
        wrong = np.flatnonzero(np.abs(length - 1) > 0.01)  # rounded to two digits at worst; false for NaN
        if wrong.size:
            raise RecordingError(f"{where(wrong[0])}: q_NS has length {length[wrong[0]]:g}, not 1")
        full["q_NS"] = truth["q_NS"] / length[:, None]
        angles = over_rows(euler_from_quaternion, full["q_NS"])
        full = dict(zip(("roll", "pitch", "yaw"), angles.T, strict=True)) | full
    if {"roll", "pitch"} <= full.keys():
        full["vertical"] = over_rows(vertical_from_roll_pitch, full["roll"], full["pitch"])
    return full


def _doubts(recording: Recording) -> list[str]:
    """Notes on values that can be right but look like a wrong unit, axis or convention."""
    vectors = {name: array for name, array in recording.readings.items() if array.ndim > 1}
    usual = {name: _typical_length(array) for name, array in vectors.items()}
    doubts = [f"{name} has no complete sample" for name, length in usual.items() if np.isnan(length)]
    if usual["accel"] < 5 or usual["accel"] > 20:
        hint = "; are the values in g?" if 0.5 < usual["accel"] < 2 else ""
        doubts.append(f"accel has a median length of {usual['accel']:.3g} m/s2, far from gravity{hint}")
    fast = _typical_length(recording.gyro, 0.99)
    if fast > 20:
        doubts.append(f"gyro exceeds {fast:.3g} rad/s in 1 % of the samples; are the values in deg/s?")
    if "mag" in usual and (usual["mag"] < 10 or usual["mag"] > 150):
        doubts.append(f"mag has a median length of {usual['mag']:.3g} uT; the Earth's field has 22 to 67 uT")
    if recording.sample_period > 0.5:
        doubts.append(f"samples are {recording.sample_period:g} s apart; are the times in milliseconds?")
    if not recording.scored.any():
        doubts.append("no sample counts for errors: truth is missing everywhere")
    if "vertical" in recording.truth:
        off_vertical = over_rows(angle_between, recording.accel, recording.truth["vertical"])[:, 0]
        off = np.rad2deg(_quantile(off_vertical, 0.5))
        if off > 30:
            doubts.append(
                f"accel is {off:.0f} deg off the true vertical in half of the samples; is the truth in rad, scalar "
                "first, S to N, Z up, and does accel read +g on the axis that points up?"
            )
    return doubts


def _typical_length(vectors: np.ndarray, quantile: float = 0.5) -> float:
    return _quantile(np.linalg.norm(vectors, axis=1), quantile)


def _quantile(values: np.ndarray, quantile: float) -> float:
    """Quantile of the finite values; NaN if there are none."""
    finite = values[np.isfinite(values)]
    return float(np.quantile(finite, quantile)) if finite.size else np.nan
