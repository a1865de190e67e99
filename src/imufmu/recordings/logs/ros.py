"""Bags of ROS 1 (.bag) and ROS 2 (a folder, .db3, .mcap), by rosbags: messages Imu and MagneticField.

They are in rad/s, m/s2 and tesla [1]; a covariance whose first element is -1 says that its readings are none.

[1] ROS enhancement proposal 145, Conventions for IMU Sensor Drivers
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..faults import RecordingError
from .sources import Source, damaged, library

METADATA = "metadata.yaml"  # in the folder of a bag of ROS 2

_Read = tuple[str, Callable[[Any], Any], Callable[[Any], Any], float]  # signal, vector, covariance, factor to our unit
_TESLA = 1e6  # uT
_KINDS: dict[str, Sequence[_Read]] = {
    "sensor_msgs/msg/Imu": (
        ("gyro", lambda m: m.angular_velocity, lambda m: m.angular_velocity_covariance, 1.0),
        ("accel", lambda m: m.linear_acceleration, lambda m: m.linear_acceleration_covariance, 1.0),
    ),
    "sensor_msgs/msg/MagneticField": (
        ("mag", lambda m: m.magnetic_field, lambda m: m.magnetic_field_covariance, _TESLA),
    ),
}  # fmt: skip


def read_sources(path: Path) -> tuple[list[Source], list[str]]:
    """A source per topic, and notes. Raises RecordingError."""
    highlevel, typesys = library("rosbags.highlevel", "ros", path), library("rosbags.typesys", "ros", path)
    rows: dict[str, list[tuple[int, int, Any]]] = {}  # by topic: stamp of the message and of the bag (ns), message
    kinds: dict[str, str] = {}
    try:
        usual = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)  # older bags do not bring their definitions
        with highlevel.AnyReader([path], default_typestore=usual) as reader:
            wanted = [connection for connection in reader.connections if connection.msgtype in _KINDS]
            topics = [f"{connection.topic} ({connection.msgtype})" for connection in reader.connections]
            for connection, received, raw in reader.messages(connections=wanted) if wanted else ():
                message = reader.deserialize(raw, connection.msgtype)
                stamp = message.header.stamp
                row = (stamp.sec * 10**9 + stamp.nanosec, received, message)
                rows.setdefault(connection.topic, []).append(row)
                kinds[connection.topic] = connection.msgtype
    except Exception as error:  # a damaged bag raises whatever the library stumbles over
        raise damaged(path, "a ROS bag", error) from None
    if not rows:
        raise RecordingError(
            f"{path}: no message of the types {' or '.join(_KINDS)}; the topics are {', '.join(topics[:20]) or 'none'}"
        )
    notes: list[str] = []
    return [_source(topic, kinds[topic], messages, notes) for topic, messages in rows.items()], notes


def _source(topic: str, kind: str, rows: Sequence[tuple[int, int, Any]], notes: list[str]) -> Source:
    stamped = all(stamp for stamp, _, _ in rows)
    if not stamped:
        notes.append(f"{topic}: its messages have no stamp; the times are those at which they were recorded")
    time = np.array([(stamp if stamped else received) * 1e-9 for stamp, received, _ in rows])
    values = {}
    for signal, vector, covariance, factor in _KINDS[kind]:
        if covariance(rows[0][2])[0] != -1:
            read = [vector(message) for _, _, message in rows]
            values[signal] = factor * np.array([(v.x, v.y, v.z) for v in read])
    return Source(topic, time, values)
