"""Recordings of programs that write a file per sensor into a folder, or a .zip of it.

Sensor Logger   Gyroscope.csv, TotalAcceleration.csv (Android) or Accelerometer.csv and Gravity.csv (iOS),
                Magnetometer.csv; columns time (ns), seconds_elapsed, z, y, x; Metadata.csv. On iOS acceleration and
                gravity have the other sign, unless units and frames were standardised.
phyphox         Gyroscope.csv, Accelerometer.csv, Magnetometer.csv; columns Time (s), X (rad/s), ... or
                Gyroscope x (rad/s), ...
x-IMU3          Inertial.csv, Magnetometer.csv; columns Timestamp (us), Gyroscope X (deg/s), ...
"""

from __future__ import annotations

import csv
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..blocks.units import factor
from .columns import UNITS, Choice, Columns, recognised_columns
from .faults import RecordingError, listed
from .raw import Raw, Stream, merged
from .stamps import read_clock
from .text_table import TextTable, read_table

_FILES = ("Gyroscope", "Accelerometer", "TotalAcceleration", "Gravity", "Magnetometer", "Inertial", "Metadata")
_LARGEST = 2**30  # bytes of a file in a .zip
_NONE = Choice(())
_LOCAL_FIELD = 50.0  # uT, for a magnetometer in units of the local field


def read_folder(path: Path, rate: float | None, columns: Columns) -> Raw:
    """Read the files of one recording in a folder or .zip. Raises RecordingError and OSError."""
    if columns:
        raise RecordingError(f"{path}: columns are told of one table; give its file, not the folder")
    if path.is_dir():
        return _read(path, _known(path), rate)
    with tempfile.TemporaryDirectory() as scratch:
        try:
            _unpack(path, Path(scratch))
        except (zipfile.BadZipFile, NotImplementedError, RuntimeError, EOFError, ValueError) as error:
            raise RecordingError(f"{path}: not a .zip that can be read: {error}") from None
        return _read(path, _known(Path(scratch)), rate)


def is_recording_folder(folder: Path) -> bool:
    """Whether a folder holds the files of one recording, and is no folder of recordings."""
    return bool({"Gyroscope", "Inertial"} & _known(folder).keys())


def _known(folder: Path) -> dict[str, Path]:
    """Files of known names, by the name without .csv."""
    return {name: file for name in _FILES if (file := folder / f"{name}.csv").is_file()}


def _unpack(path: Path, folder: Path) -> None:
    """The files of known names, from wherever they are in the archive, into one folder."""
    with zipfile.ZipFile(path) as archive:
        for member in archive.infolist():
            name = member.filename.replace("\\", "/").rpartition("/")[2]
            if name.removesuffix(".csv") in _FILES and name.endswith(".csv"):
                if member.file_size > _LARGEST:
                    raise RecordingError(f"{path}: {name} is larger than {_LARGEST} bytes")
                (folder / name).write_bytes(archive.read(member))


def _read(path: Path, files: Mapping[str, Path], rate: float | None) -> Raw:
    notes: list[str] = []
    streams: dict[str, Stream] = {}
    if "Inertial" in files:
        table = read_table(files["Inertial"])
        for signal in ("gyro", "accel"):
            streams[signal] = _stream(path, table, signal, notes)
        kind = "x-IMU3"
    elif "Gyroscope" in files:
        streams["gyro"] = _stream(path, read_table(files["Gyroscope"]), "gyro", notes)
        accel = _accelerometer(path, files, notes)
        if accel is not None:
            streams["accel"] = accel
        kind = "Sensor Logger" if "seconds_elapsed" in read_table(files["Gyroscope"]).names else "phyphox"
    else:
        raise RecordingError(
            f"{path}: cannot read: no Gyroscope.csv and no Inertial.csv in it, as phyphox, Sensor Logger "
            "or x-IMU3 write them; give the file of a recording"
        )
    if "Magnetometer" in files:
        streams["mag"] = _stream(path, read_table(files["Magnetometer"]), "mag", notes)
    facts = {"file": f"files of {kind}: {', '.join(file.name for file in files.values())}"}
    return merged(path, streams, rate, [f"read as files of {kind}", *dict.fromkeys(notes)], facts)


def _accelerometer(path: Path, files: Mapping[str, Path], notes: list[str]) -> Stream | None:
    """Acceleration with gravity: as it is, or the sum of what an iPhone writes."""
    if "TotalAcceleration" in files:
        return _stream(path, read_table(files["TotalAcceleration"]), "accel", notes)
    if "Accelerometer" not in files:
        return None
    moved = _stream(path, read_table(files["Accelerometer"]), "accel", notes)
    if "Gravity" not in files:
        return moved
    gravity = _stream(path, read_table(files["Gravity"]), "accel", notes)
    pulled = np.column_stack([np.interp(moved.time, gravity.time, axis) for axis in gravity.values.T])
    facts = _metadata(files.get("Metadata"))
    apple = "ios" in facts.get("platform", "").lower() and facts.get("standardisation", "").lower() != "true"
    sign = -1 if apple else 1
    notes.append("accel is the sum of Accelerometer.csv and Gravity.csv" + (", with the sign of iOS turned" * apple))
    return Stream(moved.time, sign * (moved.values + pulled))


def _metadata(path: Path | None) -> dict[str, str]:
    if path is None:
        return {}
    with open(path, newline="", encoding="utf-8", errors="replace") as file:
        rows = list(csv.reader(file))[:2]
    return dict(zip(rows[0], rows[1], strict=False)) if len(rows) == 2 else {}


def _stream(path: Path, table: TextTable, signal: str, notes: list[str]) -> Stream:
    """Time (s) and three axes of a file of one sensor, or of one that has several."""
    where = f"{path}: {table.path.name}"
    found, _ = recognised_columns(table.names)
    lower = [name.lower() for name in table.names]
    if signal in found:
        names = list(found[signal].names)
    elif {"x", "y", "z"} <= set(lower):
        names = [table.names[lower.index(axis)] for axis in "xyz"]
    elif {"x axis", "y axis", "z axis"} <= set(lower):
        names = [table.names[lower.index(f"{axis} axis")] for axis in "xyz"]
    else:
        raise RecordingError(f"{where}: no axes x, y, z among the columns {listed(table.full_names)}")
    time = "seconds_elapsed" if "seconds_elapsed" in table.names else next(iter(found.get("time", _NONE).names), None)
    if time is None:
        raise RecordingError(f"{where}: no column of times among {listed(table.full_names)}")
    places = [table.names.index(name) for name in (time, *names)]
    try:
        values, _ = table.numbers(places)
    except RecordingError as error:
        raise RecordingError(f"{path}: {str(error).replace(str(table.path), table.path.name)}") from None
    values = values[np.isfinite(values[:, 0])]
    if len(values) < 2:
        raise RecordingError(f"{where}: {len(values)} samples; a recording needs at least 2")
    said: list[str] = []
    unit = table.units[places[0]] or ("s" if time == "seconds_elapsed" else None)
    scale = factor(unit, "s") if unit else None
    seconds = values[:, 0] * scale if scale else read_clock(values[:, 0], unit).time
    factors = []
    for place in places[1:]:
        told = table.units[place]
        known = factor(told, UNITS[signal]) if told else 1.0
        if known is None and signal == "mag":
            known = _LOCAL_FIELD
            said.append(f"mag is in units of the local field: taken for {_LOCAL_FIELD:g} uT")
        if known is None:
            raise RecordingError(f"{where}: unit {told!r} of column {table.names[place]!r} is unknown")
        factors.append(known)
    notes += said
    return Stream(seconds, values[:, 1:] * np.array(factors))
