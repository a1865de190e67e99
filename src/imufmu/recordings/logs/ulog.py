"""Logs of PX4 (.ulg), by pyulog.

    topic                           fields                                    unit
    sensor_combined                 gyro_rad[0..2], accelerometer_m_s2[0..2]  rad/s, m/s2
    sensor_gyro, sensor_accel       x, y, z                                   rad/s, m/s2
    vehicle_magnetometer            magnetometer_ga[0..2]                     gauss
    sensor_mag                      x, y, z                                   gauss

Axes are those of the vehicle, x forward, y right, z down, but of sensor_gyro, _accel and _mag, which are the sensor's.
"""

from __future__ import annotations

import contextlib
import io
from pathlib import Path
from typing import Any

import numpy as np

from .sources import Source, damaged, library

_GAUSS = 100.0  # uT
_XYZ = ("x", "y", "z")
_FIELDS = {
    "sensor_combined": (
        ("gyro", tuple(f"gyro_rad[{i}]" for i in range(3)), 1.0),
        ("accel", tuple(f"accelerometer_m_s2[{i}]" for i in range(3)), 1.0),
    ),
    "sensor_gyro": (("gyro", _XYZ, 1.0),),
    "sensor_accel": (("accel", _XYZ, 1.0),),
    "vehicle_magnetometer": (("mag", tuple(f"magnetometer_ga[{i}]" for i in range(3)), _GAUSS),),
    "sensor_mag": (("mag", _XYZ, _GAUSS),),
}


def read_sources(path: Path) -> tuple[list[Source], list[str]]:
    """A source per topic and instance, and notes. Raises RecordingError."""
    core = library("pyulog.core", "px4", path)
    try:
        with contextlib.redirect_stdout(io.StringIO()):  # it prints what it stumbles over
            log = core.ULog(str(path), list(_FIELDS))
        instances = {kind: sum(data.name == kind for data in log.data_list) for kind in _FIELDS}
        order = list(_FIELDS)
        topics = sorted(log.data_list, key=lambda data: order.index(data.name))
        sources = [_source(data, instances[data.name] > 1) for data in topics]
    except Exception as error:  # a damaged log raises whatever the library stumbles over
        raise damaged(path, "a log of PX4", error) from None
    notes = (
        ["axes of PX4: x forward, y right, z down; with --axes NED angles are as there"]
        if instances["sensor_combined"]
        else []
    )
    if log.file_corruption:
        notes.append("the log is damaged in places, which were skipped")
    if log.dropouts:
        notes.append(
            f"the logger lost data {len(log.dropouts)} times, {sum(d.duration for d in log.dropouts)} ms in all"
        )
    return [source for source in sources if source.values], notes


def _source(data: Any, several: bool) -> Source:
    table = data.data
    taken = table.get("timestamp_sample")
    microseconds = taken if taken is not None and np.all(taken > 0) else table["timestamp"]
    values = {
        signal: factor * np.column_stack([table[name] for name in names]).astype(float)
        for signal, names, factor in _FIELDS[data.name]
        if all(name in table for name in names)
    }
    name = f"{data.name}[{data.multi_id}]" if several else data.name
    return Source(name, microseconds.astype(float) * 1e-6, values)
