"""Small logs of robots, written with the libraries that read them, or byte by byte where a library only reads."""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

Vectors = np.ndarray  # (n, 3)


def write_ros1(path: Path, messages: Sequence[tuple[str, int, object]]) -> Path:
    """A .bag. messages: topic, time of recording (ns), message of a typestore."""
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    with Writer(path) as writer:
        connections = {
            topic: writer.add_connection(topic, kind, typestore=store) for topic, kind in _topics(messages).items()
        }
        for topic, received, message in messages:
            writer.write(connections[topic], received, store.serialize_ros1(message, message.__msgtype__))
    return path


def write_ros2(folder: Path, messages: Sequence[tuple[str, int, object]], storage: str = "sqlite3") -> Path:
    """A folder with a bag in it. storage: sqlite3 or mcap."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    with Writer(folder, version=8, storage_plugin=StoragePlugin[storage.upper()]) as writer:
        connections = {
            topic: writer.add_connection(topic, kind, typestore=store) for topic, kind in _topics(messages).items()
        }
        for topic, received, message in messages:
            writer.write(connections[topic], received, store.serialize_cdr(message, message.__msgtype__))
    return folder


def _topics(messages: Sequence[tuple[str, int, object]]) -> dict[str, str]:
    """Type of message by topic."""
    return {topic: message.__msgtype__ for topic, _, message in messages}


def ros_messages(
    release: str, time: np.ndarray, gyro: Vectors, accel: Vectors, mag: Vectors | None = None, stamped: bool = True
) -> list[tuple[str, int, object]]:
    """Messages of the topics /imu/data and, every fifth, /imu/mag (mag in tesla); they arrive 5 ms late."""
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores[release])
    kinds = store.types
    messages = []
    for k, t in enumerate(np.round(time * 1e9).astype(int).tolist()):
        stamp = kinds["builtin_interfaces/msg/Time"](*divmod(t if stamped else 0, 10**9))
        numbered = {"seq": k} if release.startswith("ROS1") else {}
        header = kinds["std_msgs/msg/Header"](**numbered, stamp=stamp, frame_id="imu")
        vector, unknown = kinds["geometry_msgs/msg/Vector3"], np.zeros(9)
        level = kinds["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
        imu = kinds["sensor_msgs/msg/Imu"](
            header, level, unknown, vector(*gyro[k].tolist()), unknown, vector(*accel[k].tolist()), unknown
        )
        messages.append(("/imu/data", t + 5_000_000, imu))
        if mag is not None and k % 5 == 0:
            field = kinds["sensor_msgs/msg/MagneticField"](header, vector(*mag[k].tolist()), unknown)
            messages.append(("/imu/mag", t + 5_000_000, field))
    return messages


def write_ulog(path: Path, topics: Sequence[tuple[str, int, Sequence[str], np.ndarray]]) -> Path:
    """A log of PX4. topics: name, instance, fields, rows (n, 1 + fields) whose first column is the time (us)."""

    def message(kind: str, content: bytes) -> bytes:
        return struct.pack("<HB", len(content), ord(kind)) + content

    content = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0) + message("B", bytes(40))
    for name, fields in {name: fields for name, _, fields, _ in topics}.items():
        sizes = Counter(field.partition("[")[0] for field in fields)  # an array is declared once
        declared = "".join(f"float{f'[{size}]' if size > 1 else ''} {field};" for field, size in sizes.items())
        content += message("F", f"{name}:uint64_t timestamp;{declared}".encode())
    for number, (name, instance, _, _) in enumerate(topics):
        content += message("A", struct.pack("<BH", instance, number) + name.encode())
    for number, (_, _, _, rows) in enumerate(topics):
        for row in rows:
            values = struct.pack(f"<HQ{len(row) - 1}f", number, int(row[0]), *row[1:])
            content += message("D", values)
    path.write_bytes(content)
    return path


def write_ardupilot(path: Path, kinds: Sequence[tuple[str, Sequence[str], np.ndarray]]) -> Path:
    """A log of ArduPilot. kinds: name, fields behind TimeUS and I, rows (n, 2 + fields)."""

    def described(number: int, size: int, name: str, codes: str, fields: Sequence[str]) -> bytes:
        texts = struct.pack("<4s16s64s", name.encode(), codes.encode(), ",".join(fields).encode())
        return struct.pack("<BBBBB", 0xA3, 0x95, 128, number, size) + texts

    content = described(128, 89, "FMT", "BBnNZ", ("Type", "Length", "Name", "Format", "Columns"))
    for number, (name, fields, rows) in enumerate(kinds, 130):
        size = 3 + 8 + 1 + 4 * len(fields)
        content += described(number, size, name, "QB" + "f" * len(fields), ("TimeUS", "I", *fields))
        for row in rows:
            content += struct.pack("<BBB", 0xA3, 0x95, number)
            content += struct.pack(f"<QB{len(fields)}f", int(row[0]), int(row[1]), *row[2:])
    path.write_bytes(content)
    return path


def write_mdf(path: Path, channels: Sequence[tuple[str, str, np.ndarray, np.ndarray]]) -> Path:
    """A measurement file with a group per channel. channels: name, unit, times (s), values."""
    import asammdf

    with asammdf.MDF(version="4.10") as file:
        for name, unit, time, values in channels:
            file.append(asammdf.Signal(values, time, unit, name))
        file.save(path, overwrite=True)
    return path
