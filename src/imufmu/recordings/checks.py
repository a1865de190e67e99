"""Checks of a whole recording that take a moment, and what they say."""

from __future__ import annotations

from functools import lru_cache

from .reading import Recording
from .turning import Turning, told, turning


@lru_cache(maxsize=4)
def turning_of(recording: Recording) -> Turning:
    """Whether gyroscope and accelerometer of the recording fit together."""
    return turning(recording.gyro, recording.accel, recording.sample_index, recording.sample_period)


def axes_doubts(recording: Recording) -> list[str]:
    """What does not fit between gyroscope and accelerometer, and what to do: at most one sentence."""
    if not (names := recording.names.get("gyro")):
        names = ("gyro[1]", "gyro[2]", "gyro[3]")
    said = told(turning_of(recording), names)
    return [said] if said else []
