"""Logs of ArduPilot (.bin), by pymavlink: messages IMU and MAG, their instances 0, 1, 2.

Rates are in rad/s, accelerations in m/s2, fields in milligauss, times in us; the axes are those of the vehicle,
x forward, y right, z down. Old logs call the second and third instance IMU2 and IMU3.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from .sources import Source, damaged, library

_MILLIGAUSS = 0.1  # uT
_FIELDS = {
    "IMU": (("gyro", ("GyrX", "GyrY", "GyrZ"), 1.0), ("accel", ("AccX", "AccY", "AccZ"), 1.0)),
    "MAG": (("mag", ("MagX", "MagY", "MagZ"), _MILLIGAUSS),),
}
_KINDS = [kind + number for kind in _FIELDS for number in ("", "2", "3")]


def read_sources(path: Path) -> tuple[list[Source], list[str]]:
    """A source per kind and instance, and notes. Raises RecordingError."""
    reader = library("pymavlink.DFReader", "ardupilot", path)
    rows: dict[tuple[str, int], list[list[float]]] = {}
    try:
        with reader.DFReader_binary(str(path)) as log:
            while (message := log.recv_match(type=_KINDS)) is not None:
                kind, number = re.fullmatch("([A-Z]+)([23]?)", message.get_type()).groups()  # type: ignore[union-attr]
                instance = getattr(message, "I", int(number or 1) - 1)
                fields = [name for _, names, _ in _FIELDS[kind] for name in names]
                row = [message.TimeUS * 1e-6, *(getattr(message, name) for name in fields)]
                rows.setdefault((kind, instance), []).append(row)
    except Exception as error:  # a damaged log raises whatever the library stumbles over
        raise damaged(path, "a log of ArduPilot", error) from None
    notes = ["axes of ArduPilot: x forward, y right, z down; with --axes NED angles are as there"] if rows else []
    return [_source(*key, np.array(table)) for key, table in sorted(rows.items())], notes


def _source(kind: str, instance: int, table: np.ndarray) -> Source:
    values = {signal: factor * table[:, 1 + 3 * i : 4 + 3 * i] for i, (signal, _, factor) in enumerate(_FIELDS[kind])}
    return Source(f"{kind}[{instance}]", table[:, 0], values)
