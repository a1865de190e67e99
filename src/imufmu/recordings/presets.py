"""Text files of well-known devices and programs: how each is known, which columns it has, and in which units.

    Xsens MT text export    "// Update Rate" above the header; Acc_X m/s2, Gyr_X rad/s, Mag_X of the local field,
                            PacketCounter (16 bit), SampleTimeFine in 0.1 ms (32 bit) where it is exported
    Movella (Xsens) DOT     "DeviceTag" above the header; Acc_X m/s2, Gyr_X deg/s, SampleTimeFine in us (32 bit)
    Shimmer (Consensys)     ..._Gyro_X_CAL, ..._Accel_LN_X_CAL (low noise) or _WR_ (wide range), a line of units

Files of phyphox and x-io (NGIMU, x-IMU) tell their units in the header and need no entry here; those of programs that
write a file per sensor are read by ``folders``.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from .columns import TIME, Choice
from .faults import RecordingError
from .text_table import TextTable


@dataclass(frozen=True)
class Preset:
    """name: of the device. columns: by signal. tick: s per count of the time column. note: what a user should know."""

    name: str
    columns: dict[str, Choice]
    tick: float | None = None
    note: str = ""


def preset_of(table: TextTable) -> Preset | None:
    """The preset that a file is known by, None for others. Raises RecordingError for a mode that has no readings."""
    for found in (_dot(table), _xsens(table), _shimmer(table)):
        if found:
            return found
    return None


def _vector(table: TextTable, stem: str, unit: str | None) -> dict[str, Choice]:
    signal = {"Gyr": "gyro", "Acc": "accel", "Mag": "mag"}[stem]
    by_name = {name.lower(): name for name in table.names}
    names = [by_name.get(f"{stem}_{axis}".lower()) for axis in "XYZ"]
    return {signal: Choice(tuple(name for name in names if name), unit)} if all(names) else {}


def _is_filled(table: TextTable, name: str) -> bool:
    if name not in table.names:
        return False
    place = table.names.index(name)
    return any(len(row) > place and row[place].strip() for row in table.samples)


def _xsens(table: TextTable) -> Preset | None:
    above = "\n".join(table.preamble)
    if not re.search(r"^\s*//\s*(Update Rate|Sample rate|Start Time)", above, re.MULTILINE | re.IGNORECASE):
        return None
    if not _vector(table, "Acc", None):
        return None
    columns = _vector(table, "Gyr", "rad/s") | _vector(table, "Acc", "m/s2") | _vector(table, "Mag", "a.u.")
    if _is_filled(table, "SampleTimeFine"):
        return Preset("Xsens MT", columns | {TIME: Choice(("SampleTimeFine",))}, 1e-4)
    rate = re.search(r"(?:Update|Sample) Rate\s*:\s*([\d.]+)\s*Hz", above, re.IGNORECASE)
    counter = next((name for name in ("PacketCounter", "Counter") if _is_filled(table, name)), None)
    if counter and rate and float(rate[1]) > 0:
        note = f"times are counted by {counter} at the {float(rate[1]):g} Hz that the file tells"
        return Preset("Xsens MT", columns | {TIME: Choice((counter,))}, 1 / float(rate[1]), note)
    return Preset("Xsens MT", columns)


def _dot(table: TextTable) -> Preset | None:
    above = "\n".join(table.preamble)
    named = re.search(r"DeviceTag|Movella|Xsens DOT", above, re.IGNORECASE)
    if not named or "SampleTimeFine" not in table.names:
        return None
    columns = _vector(table, "Gyr", "deg/s") | _vector(table, "Acc", "m/s2") | _vector(table, "Mag", "a.u.")
    if not {"gyro", "accel"} <= columns.keys():
        raise RecordingError(
            f"{table.path}: a recording of Movella DOT without Acc_X and Gyr_X (free acceleration has no gravity any "
            "more); record a mode with rate quantities, such as Custom mode 4"
        )
    return Preset("Movella DOT", columns | {TIME: Choice(("SampleTimeFine",), "us")})


def _shimmer(table: TextTable) -> Preset | None:
    found: dict[str, Choice] = {}
    for signal, middles in (("gyro", ("Gyro",)), ("accel", ("Accel_LN", "Accel_WR", "Accel")), ("mag", ("Mag",))):
        for middle in middles:
            names = [
                next((n for n in table.names if re.fullmatch(rf"(.*_)?{middle}_{axis}_CAL", n)), None) for axis in "XYZ"
            ]
            if all(names) and signal not in found:
                found[signal] = Choice(tuple(name for name in names if name), _shimmer_unit(table, signal, names[0]))
    times = [n for n in table.names if re.fullmatch(r"(.*_)?Timestamp(Sync)?(_Unix)?_CAL", n) and _is_filled(table, n)]
    if not {"gyro", "accel"} <= found.keys():
        return None
    if times:
        unit = table.units[table.names.index(times[-1])] or "ms"
        found[TIME] = Choice((times[-1],), unit)
    return Preset("Shimmer", found)


def _shimmer_unit(table: TextTable, signal: str, name: str | None) -> str:
    told = table.units[table.names.index(name)] if name else None
    return told or {"gyro": "deg/s", "accel": "m/s2", "mag": "local_flux"}[signal]
