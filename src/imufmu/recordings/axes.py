"""Axes and mounting of other people's sensors: readings to ours, and estimates back to theirs.

Ours: the world is East, North, Up; the accelerometer reads +g on the axis that points up at rest. A convention of
others says how their world lies, and which of their body's axes are ours with which sign:

    ENU       as ours (ROS: REP 103)
    NWU       North, West, Up: body as ours, yaw counts from North
    NED       North, East, Down, body x forward, y right, z down (aerospace, PX4, ArduPilot); at rest z reads -g
    android   as ours: x right, y up along the screen, z out of it
    ios       axes as Android, but the accelerometer reads -g on the axis that points up

A mounting says how the sensor sits on the body whose attitude is wanted.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..blocks.rotations import euler_from_quaternion, multiply, over_rows, quaternion_from_euler
from ..files.names import no_such
from .faults import RecordingError

# Vectors in the body's axes among readings and estimates.
_VECTORS = ("gyro", "accel", "mag", "vertical", "external_acceleration", "gyro_bias")
_HALF = float(np.sqrt(0.5))


@dataclass(frozen=True)
class Convention:
    """flip: (3,), signs of the body's axes. world: quaternion of our world's axes in theirs, ENU to theirs."""

    flip: tuple[int, int, int] = (1, 1, 1)
    world: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    accel_sign: int = 1


CONVENTIONS = {
    "ENU": Convention(),
    "NWU": Convention(world=(_HALF, 0.0, 0.0, -_HALF)),
    "NED": Convention(flip=(1, -1, -1), world=(0.0, _HALF, _HALF, 0.0)),
    "android": Convention(),
    "ios": Convention(accel_sign=-1),
}


@dataclass(frozen=True)
class Axes:
    """A convention by name, and the matrix (3, 3) that brings a vector from the sensor's axes to the body's."""

    name: str = "ENU"
    mount: tuple[tuple[float, ...], ...] | None = None

    @property
    def are_ours(self) -> bool:
        return CONVENTIONS[self.name] == Convention() and self.mount is None

    def note(self) -> str:
        """What is done to the readings; empty for nothing."""
        if self.are_ours:
            return ""
        mounted = "" if self.mount is None else "readings are turned from the sensor to the body it is mounted on"
        other = CONVENTIONS[self.name]
        told = "" if other == Convention() else f"axes are {self.name}: estimates are given in them, too"
        return "; ".join(part for part in (mounted, told) if part)

    def to_ours(self, signals: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Readings, (n, 3), and truth (q_NS (n, 4), roll, pitch, yaw (n,)) of a file in our axes."""
        other, ours = CONVENTIONS[self.name], dict(signals)
        for name in ("gyro", "accel", "mag"):
            if name in ours:
                turned = ours[name] if self.mount is None else ours[name] @ np.array(self.mount).T
                ours[name] = turned * np.array(other.flip) * (other.accel_sign if name == "accel" else 1)
        return ours | self._attitude(ours, inwards=True)

    def from_ours(self, signals: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Estimates in the convention's axes: vectors (n, 3), and the attitude."""
        other, theirs = CONVENTIONS[self.name], dict(signals)
        for name in _VECTORS:
            if name in theirs and theirs[name].shape[1:] == (3,):
                theirs[name] = theirs[name] * np.array(other.flip)
        return theirs | self._attitude(theirs, inwards=False)

    def _attitude(self, signals: Mapping[str, np.ndarray], inwards: bool) -> dict[str, np.ndarray]:
        """Quaternion and angles from theirs to ours, or back, where there are any."""
        other = CONVENTIONS[self.name]
        if other.world == (1.0, 0.0, 0.0, 0.0):
            return {}
        body = (1.0, 0.0, 0.0, 0.0) if other.flip == (1, 1, 1) else (0.0, 1.0, 0.0, 0.0)
        world = np.array(other.world) * ([1, -1, -1, -1] if inwards else [1, 1, 1, 1])
        found = {}
        if "q_NS" in signals:
            found["q_NS"] = over_rows(lambda q: multiply(multiply(world.tolist(), q), list(body)), signals["q_NS"])
        if {"roll", "pitch"} <= signals.keys():
            yaw = signals.get("yaw", np.zeros_like(signals["roll"]))
            q = over_rows(quaternion_from_euler, signals["roll"], signals["pitch"], yaw)
            turned = over_rows(lambda q: multiply(multiply(world.tolist(), q), list(body)), q)
            angles = over_rows(euler_from_quaternion, turned)
            found |= {"roll": angles[:, 0], "pitch": angles[:, 1]}
            found |= {"yaw": angles[:, 2]} if "yaw" in signals else {}
        return found


def parsed_axes(name: str | None, mount: str | None) -> Axes:
    """``NED``, and a mounting ``roll,pitch,yaw`` (deg) or ``x,-y,-z``: the body's axes as those of the sensor.

    roll, pitch, yaw: turns of the sensor on the body, Z-Y-X. Raises RecordingError.
    """
    convention = "ENU"
    if name:
        known = {key.lower(): key for key in CONVENTIONS}
        if name.lower() not in known:
            raise RecordingError("axes: " + no_such("convention", name, CONVENTIONS, "other axes: --mount"))
        convention = known[name.lower()]
    return Axes(convention, None if not mount else _matrix(mount))


def _matrix(text: str) -> tuple[tuple[float, ...], ...]:
    parts = [part.strip().lower() for part in text.split(",")]
    if len(parts) == 3 and all(re.fullmatch(r"[-+]?[xyz]", part) for part in parts):
        matrix = np.zeros((3, 3))
        for row, part in enumerate(parts):
            matrix[row, "xyz".index(part[-1])] = -1 if part.startswith("-") else 1
        if abs(abs(np.linalg.det(matrix)) - 1) > 1e-9:
            raise RecordingError(f"mount: {text}: name each of x, y and z once, as x,-y,-z")
        if np.linalg.det(matrix) < 0:
            raise RecordingError(
                f"mount: {text} is a mirror image, which no mounting is; if a sensor's axis has the wrong sign, "
                "say so with its columns: --columns gyro=gx,gy,-gz"
            )
        return tuple(tuple(row) for row in matrix.tolist())
    try:
        roll, pitch, yaw = (float(part) for part in parts)
    except ValueError:
        raise RecordingError(
            f"mount: {text}: give roll,pitch,yaw of the sensor on the body in degrees, or its axes as x,-y,-z"
        ) from None
    if not np.isfinite([roll, pitch, yaw]).all():
        raise RecordingError(f"mount: {text}: angles must be finite")
    x, y, z = np.radians([roll, pitch, yaw])
    about_x = np.array([[1, 0, 0], [0, np.cos(x), -np.sin(x)], [0, np.sin(x), np.cos(x)]])
    about_y = np.array([[np.cos(y), 0, np.sin(y)], [0, 1, 0], [-np.sin(y), 0, np.cos(y)]])
    about_z = np.array([[np.cos(z), -np.sin(z), 0], [np.sin(z), np.cos(z), 0], [0, 0, 1]])
    return tuple(tuple(row) for row in (about_z @ about_y @ about_x).tolist())
