"""Real recordings of any kind: the one door through which all of them come.

Of our own kind is a CSV table with one header line and one row per sample, in SI units, columns in any order:

    column                        unit      meaning
    time                          s         increasing; gaps and jitter of the clock are allowed
    gyro[1] .. gyro[3]            rad/s     gyroscope, sensor frame S
    accel[1] .. accel[3]          m/s2      accelerometer (specific force: +g on the axis that points up at rest), S
    mag[1] .. mag[3]              uT        magnetometer, S; optional
    forward_speed                 m/s       speed along the vehicle's x axis as its wheels tell it; optional
    forward_speed_valid           1         0 where forward_speed is to be left out; optional
    roll, pitch, yaw              rad       true Z-Y-X Euler angles; each optional
    q_NS[1] .. q_NS[4]            1         true attitude, Hamilton, scalar first, S to N (Z up); optional

An empty cell or ``nan`` is a missing reading. Other columns are ignored, with a note. Other names, units and
separators: ``columns``, ``text_table``, ``presets``; other axes: ``axes``; times of other kinds: ``stamps``.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..blocks import vocabulary as v
from ..blocks.rotations import euler_from_quaternion, over_rows, vertical_from_roll_pitch
from .axes import Axes, parsed_axes
from .broad import read_broad
from .columns import parsed_columns
from .doubts import doubts
from .faults import RecordingError
from .folders import read_folder
from .logs.reading import LOGS, is_log, read_log
from .raw import Raw, Where
from .text_reading import read_text
from .told import Told, recall

TEXTS = (".csv", ".txt", ".tsv", ".dat", ".log")
KINDS = (*TEXTS, ".zip", *LOGS, ".mat")  # ends of names of what is read
_READINGS = (v.GYRO.name, v.ACCEL.name, v.MAG.name, v.FORWARD_SPEED.name)
_TRUTH = (v.Q_NS.name, v.ROLL.name, v.PITCH.name, v.YAW.name)
_PERIOD_BOUNDS = v.sample_period(0.01)

__all__ = ["Recording", "RecordingError", "hold_missing", "is_recording", "read", "recordings_in"]


@dataclass(frozen=True, eq=False)
class Recording:
    """Readings of one IMU over time, with truth where there is any. The arrays are read-only.

    time: (n,), s, as in the file. gyro, accel, mag: (n, 3), rad/s, m/s2, uT, in S; not finite where a reading is
    missing. truth: q_NS (n, 4), vertical (n, 3), roll, pitch, yaw (n,), rad, as far as the file tells; NaN where
    unknown. scored: (n,), bool, samples that count for errors. Row i belongs to the instant
    time[0] + sample_index[i] * sample_period; instants that no row belongs to are missing samples. notes: what a user
    should know but that is no error. forward_speed: (n,), m/s; as mag, None where the file has none. axes: those of
    the file, in which estimates are given back. facts, names: about the file, and its columns by signal.
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
    axes: Axes = field(default_factory=Axes)
    facts: Mapping[str, str] = field(default_factory=dict)
    names: Mapping[str, Sequence[str]] = field(default_factory=dict)

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


def read(
    path: str | os.PathLike[str],
    rate: float | None = None,
    *,
    columns: Iterable[str] | Mapping[str, str] = (),
    axes: str | None = None,
    mount: str | None = None,
    stream: str | None = None,
) -> Recording:
    """Read a recording of any kind that is known: a text table, a folder or .zip of them, a log, a trial of BROAD.

    rate: Hz, of rows that are evenly spaced but whose times are of no use; they are ignored then. columns: which
    columns of a table are what, ``["gyro=wx,wy,wz:deg/s", "time=t:ms"]`` or ``{"gyro": "wx,wy,wz:deg/s"}``. axes: the
    convention of the file, such as ``NED``. mount: how the sensor sits on the body, ``roll,pitch,yaw`` in degrees or
    its axes, ``x,-y,-z``. stream: which of several sensors of a log. What is not given here is taken from the file
    ``NAME.toml`` beside the recording NAME, where there is one (``remember``). Raises RecordingError.
    """
    path = Path(path)
    told = Told(parsed_columns(columns), rate, axes, mount, stream)
    remembered = recall(path)
    told, notes = told.completed(remembered, path)
    if told.rate is not None and not _PERIOD_BOUNDS.minimum <= 1 / (told.rate or np.nan) <= _PERIOD_BOUNDS.maximum:
        raise RecordingError(f"{path}: a rate of {told.rate:g} Hz cannot be; give samples per second")
    turned = parsed_axes(told.axes, told.mount)
    _check_told(path, told)
    try:
        raw = _reader(path)(path, told)
    except OSError as error:
        raise RecordingError(f"{path}: cannot read: {error.strerror or error}") from None
    except MemoryError:
        raise RecordingError(f"{path}: too large for this machine's memory; split it") from None
    return _recording(path, raw, turned, [*notes, *raw.notes])


def is_recording(path: Path) -> bool:
    """Whether a file has the name of a recording: what ``read`` would not refuse for its name alone."""
    return is_log(path) or (path.is_file() and path.suffix.lower() in KINDS)


def recordings_in(folder: Path) -> list[Path]:
    """Every file in a folder that is read as a recording. Raises RecordingError if there is no such folder."""
    try:
        return sorted(path for path in folder.iterdir() if is_recording(path))
    except OSError as error:
        raise RecordingError(f"{folder}: cannot list the folder: {error.strerror}") from None


def _check_told(path: Path, told: Told) -> None:
    """Raises RecordingError for what says nothing of a file of this kind, and would be passed over."""
    suffix = path.suffix.lower()
    if told.columns and suffix == ".mat":
        raise RecordingError(f"{path}: a trial of BROAD has no columns to tell")
    if told.stream and not is_log(path):
        raise RecordingError(f"{path}: a file of this kind holds one recording; --stream is for logs")


def _reader(path: Path) -> Callable[[Path, Told], Raw]:
    """What reads a file of this kind. Raises RecordingError."""
    suffix = path.suffix.lower()
    if is_log(path):
        return read_log
    if path.is_dir() or suffix == ".zip":
        return lambda path, told: read_folder(path, told.rate, told.columns)
    if suffix in TEXTS:
        return lambda path, told: read_text(path, told.rate, told.columns)
    if suffix == ".mat":
        return lambda path, told: read_broad(path)
    kinds = ", ".join(KINDS)
    raise RecordingError(f"{path}: cannot read {suffix or 'a file without suffix'}; use {kinds} (of BROAD)")


def _recording(path: Path, raw: Raw, axes: Axes, notes: Sequence[str]) -> Recording:
    """The recording of checked signals in our axes: truth completed, doubts noted."""
    clock = raw.clock
    with np.errstate(over="ignore", invalid="ignore"):  # absurd values are for the notes
        signals = axes.to_ours(raw.signals)
        truth = _complete({name: signals[name] for name in _TRUTH if name in signals}, raw.where)
        scored = np.ones(len(clock.time), bool) if raw.scored is None else raw.scored
        for values in truth.values():
            scored = scored & np.isfinite(values.reshape(len(clock.time), -1)).all(axis=1)
        readings = {name: signals[name] for name in _READINGS if name in signals}
        doubtful = doubts(readings, truth, scored, clock.period)
    return Recording(
        path,
        clock.time,
        signals["gyro"],
        signals["accel"],
        signals.get("mag"),
        truth,
        scored,
        clock.period,
        clock.index,
        tuple(note for note in (*notes, axes.note(), *doubtful) if note),
        signals.get("forward_speed"),
        axes,
        raw.facts or {},
        raw.names or {},
    )


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
