"""Read a trial of BROAD [1]: a MATLAB file.

[1] Laidig, Caruso, Cereatti, Seel, BROAD - A Benchmark for Robust Inertial Orientation Estimation, Data 6(7), 2021,
    doi:10.3390/data6070072
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..blocks.vocabulary import sample_period
from .faults import RecordingError, listed
from .matlab import MatlabError, read_matlab
from .raw import Raw
from .stamps import Clock

_PERIOD_BOUNDS = sample_period(0.01)


def read_broad(path: Path) -> Raw:
    """Variables imu_gyr, imu_acc, imu_mag, opt_quat, movement, sampling_rate. Raises RecordingError and OSError."""
    try:
        content = read_matlab(path)
    except MatlabError as error:
        raise RecordingError(f"{path}: {error}") from None

    def array(key: str, width: int, rows: int | None = None) -> np.ndarray:
        if key not in content:
            found = listed(list(content)) or "none"
            raise RecordingError(f"{path}: no variable {key!r}, so not a trial of BROAD; the variables are {found}")
        value = content[key]
        if value is None or value.ndim != 2 or value.shape[1] != width or rows not in (None, len(value)):
            shape = "no matrix of real numbers" if value is None else f"of shape {value.shape}"
            raise RecordingError(f"{path}: {key!r} is {shape}, expected ({'n' if rows is None else rows}, {width})")
        return value

    rate = array("sampling_rate", 1, 1).item()
    if not _PERIOD_BOUNDS.minimum <= 1 / (rate or np.nan) <= _PERIOD_BOUNDS.maximum:
        raise RecordingError(f"{path}: 'sampling_rate' is {rate:g}, expected a rate in Hz")
    gyro = array("imu_gyr", 3)
    n = len(gyro)
    if n < 2:
        raise RecordingError(f"{path}: {n} samples; a recording needs at least 2")
    signals = {"gyro": gyro, "accel": array("imu_acc", 3, n), "mag": array("imu_mag", 3, n)}
    signals["q_NS"] = array("opt_quat", 4, n)
    scored = array("movement", 1, n).ravel() != 0
    index = np.arange(n)
    clock = Clock(index / rate, 1 / rate, index)
    return Raw(signals, clock, lambda row: f"{path}, row {row + 1}", scored=scored, facts={"file": "a trial of BROAD"})
