"""Checks of a whole recording that take a moment, and what they say."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from .reading import Recording
from .turning import UNKNOWN, Turning, columns_told, told, turning


@lru_cache(maxsize=4)
def turning_of(recording: Recording) -> Turning:
    """Whether gyroscope and accelerometer of the recording fit together."""
    return turning(recording.gyro, recording.accel, recording.sample_index, recording.sample_period)


@lru_cache(maxsize=4)
def field_turning_of(recording: Recording) -> Turning:
    """Whether gyroscope and magnetometer fit together; unknown without one, or where it is much slower."""
    if recording.mag is None:
        return UNKNOWN
    return turning(recording.gyro, recording.mag, recording.sample_index, recording.sample_period)


def axes_doubts(recording: Recording) -> list[str]:
    """What does not fit between gyroscope, accelerometer and magnetometer, and what to do: at most one sentence.

    Of three sensors the one is wrong that fits neither of the others.
    """
    by_gravity, by_field = turning_of(recording), field_turning_of(recording)
    gravity_fits, field_fits = by_gravity.fits and by_gravity.seen, by_field.fits and by_field.seen
    if not by_gravity.fits and field_fits and by_gravity.is_of_vector:
        matrix = by_gravity.vector_matrix
        return [
            "accel does not turn as gyro and mag say: its axes are not theirs; it fits as --columns "
            f"accel={columns_told(matrix, _names(recording, 'accel'))}, or with every sign turned"
        ]
    if not by_gravity.fits and field_fits:  # no sign of the accelerometer does that: it is motion
        return []
    if not by_gravity.fits:
        return [told(by_gravity, _names(recording, "gyro")) + _of_both(recording, by_gravity)]
    if gravity_fits and not by_field.fits and by_field.scale != 1:
        return ["mag does not turn as gyro and accel say: it stands still, or is disturbed all the time"]
    if gravity_fits and not by_field.fits and by_field.is_of_vector:
        matrix = _downwards(recording, by_field.vector_matrix)
        return [
            "mag does not turn as gyro and accel say: its axes are not theirs; it fits as --columns "
            f"mag={columns_told(matrix, _names(recording, 'mag'))} (South of the equator with every sign turned)"
        ]
    if not by_field.fits and by_field.scale == 1:
        return [told(by_field, _names(recording, "gyro"), "the magnetic field")]
    return []


def _of_both(recording: Recording, fit: Turning) -> str:
    """The remedy for a left-handed set whose flipped axis shows: the one that points down at the start."""
    if fit.scale != 1 or not (fit.matrix == -np.eye(3)).all():
        return ""
    first = recording.accel[recording.time < recording.time[0] + 1.0]
    up = (
        np.median(first[np.isfinite(first).all(axis=1)], axis=0)
        if np.isfinite(first).all(axis=1).any()
        else np.zeros(3)
    )
    axis = int(np.argmin(up))
    if up[axis] > -0.9 * np.linalg.norm(up):
        return ""
    signs = np.diag([-1 if i == axis else 1 for i in range(3)])
    both = [f"--columns {signal}={columns_told(signs, _names(recording, signal))}" for signal in ("gyro", "accel")]
    return f"; if {'xyz'[axis]}, which points down at the start, is flipped in both: {' '.join(both)}"


def _names(recording: Recording, signal: str) -> Sequence[str]:
    return recording.names.get(signal) or [f"{signal}[{i}]" for i in (1, 2, 3)]


def _downwards(recording: Recording, matrix: np.ndarray) -> np.ndarray:
    """The matrix of the magnetometer's axes, or minus it: so that the field points down, as North of the equator."""
    assert recording.mag is not None
    upwards = (recording.mag @ matrix.T * recording.accel).sum(axis=1)
    known = upwards[np.isfinite(upwards)]
    return np.asarray(-matrix if known.size and np.median(known) > 0 else matrix)
