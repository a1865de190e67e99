"""Well-known filters of others as baselines, where their packages are installed: ``pip install 'imufmu[peers]'``.

VQF, BasicVQF: Laidig, Seel, Information Fusion 91, 2023, doi:10.1016/j.inffus.2022.10.014; package ``vqf``.
imufusion: the revised filter of Madgwick's thesis (2014), chapter 7; package ``imufusion``.
RIANN: Weber, Gühmann, Seel, AI 2, 2021, doi:10.3390/ai2030028, a recurrent neural network; packages ``riann``,
``onnxruntime``.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache, partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from ..blocks.vocabulary import GRAVITY
from ..recordings.reading import hold_missing
from ..scoring.metrics import vertical_of
from .contenders import Contender, Readings

# What the authors' own example for real data sets.
_FUSION_SETTINGS: Mapping[str, Any] = {
    "gain": 0.5,
    "gyroscope_range": 2000.0,
    "acceleration_rejection": 10.0,
    "rejection_timeout": 5.0,
}


NAMES = ("VQF", "BasicVQF", "imufusion", "RIANN", "offlineVQF")  # of all, installed or not


def peers() -> list[Contender]:
    """The filters whose packages are installed, with the parameters their authors advise."""
    found = []
    if find_spec("vqf"):
        found.append(Contender("VQF", partial(_vqf, "VQF"), {}, finds_bias=True))
        found.append(Contender("BasicVQF", partial(_vqf, "BasicVQF"), {}))
    if find_spec("imufusion"):
        found.append(Contender("imufusion", _imufusion, _FUSION_SETTINGS))
    if find_spec("riann") and find_spec("onnxruntime"):
        found.append(Contender("RIANN", _riann, {}))
    return found


def offline_peers() -> list[Contender]:
    """The same, of filters that want the whole record before they begin."""
    return [Contender("offlineVQF", _vqf_offline, {}, finds_bias=True)] if find_spec("vqf") else []


def heading_peers() -> list[Contender]:
    """The same, of filters that use a magnetometer."""
    return [Contender("VQF", _vqf_9_axis, {}, finds_bias=True)] if find_spec("vqf") else []


def _vqf_9_axis(readings: Readings, sample_period: float) -> Mapping[str, np.ndarray]:
    import vqf

    mag = np.ascontiguousarray(hold_missing(readings["mag"]))
    q_NS = vqf.VQF(sample_period).updateBatch(*_complete(readings), mag)["quat9D"]
    return {"q_NS": q_NS, "vertical": vertical_of(q_NS)}


def _vqf(kind: str, readings: Readings, sample_period: float) -> Mapping[str, np.ndarray]:
    import vqf

    result = getattr(vqf, kind)(sample_period).updateBatch(*_complete(readings))
    return {"vertical": vertical_of(result["quat6D"])}


def _vqf_offline(readings: Readings, sample_period: float) -> Mapping[str, np.ndarray]:
    import vqf

    return {"vertical": vertical_of(vqf.offlineVQF(*_complete(readings), None, sample_period)["quat6D"])}


def _imufusion(readings: Readings, sample_period: float) -> Mapping[str, np.ndarray]:
    import imufusion

    gyro, accel = _complete(readings)
    settings = imufusion.AhrsSettings(sample_rate=1 / sample_period, **_FUSION_SETTINGS)
    ahrs: Any = imufusion.Ahrs()
    ahrs.set_settings(settings)
    vertical = np.empty_like(accel)
    for k, (degrees_per_second, in_g) in enumerate(zip(np.rad2deg(gyro), accel / GRAVITY, strict=True)):
        ahrs.update_no_magnetometer(degrees_per_second, in_g)
        vertical[k] = ahrs.get_gravity()  # what an accelerometer would read at rest: up
    return {"vertical": vertical}


def _riann(readings: Readings, sample_period: float) -> Mapping[str, np.ndarray]:
    gyro, accel = _complete(readings)
    return {"vertical": vertical_of(_network().predict(accel, gyro, fs=1 / sample_period).astype(float))}


@cache
def _network() -> Any:
    """The trained network, read once."""
    import riann

    return riann.RIANN(str(Path(riann.__file__).with_name("riann.onnx")))  # by itself 0.2.0 looks in the wrong place


def _complete(readings: Readings) -> tuple[np.ndarray, np.ndarray]:
    """Gyroscope and accelerometer readings with no gaps, which these filters cannot take."""
    gyro, accel = (np.ascontiguousarray(hold_missing(readings[name])) for name in ("gyro", "accel"))
    return gyro, accel
