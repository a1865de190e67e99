"""Who takes part in a benchmark on real recordings, and with which parameters.

A contender turns readings into signals. Estimators of the registry come with the parameters of their papers, and once
more with those that suit a hand-held or body-worn device; filters of others (``peers``) come as they are.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Any

import numpy as np

from ..blocks.block import SampledBlock
from ..blocks.running import Trajectory
from ..blocks.vocabulary import ACCEL, FORWARD_SPEED, GYRO, MAG, VERTICAL
from ..compiled.offline import run_offline
from ..compiled.running import run
from ..estimators import plumb
from ..files.names import no_such
from ..registry import ESTIMATORS

Readings = Mapping[str, np.ndarray]  # by signal name, (n, 3) or (n,), NaN where missing
Settings = Mapping[str, Any]  # values by estimator.parameter

TILT_TIME = 3.0  # s; a constant gyroscope bias b ends up as a tilt of TILT_TIME * b

# What the estimators of papers need on real recordings, one set for all of them. All are given the same time constant:
# longer than a movement, so that its acceleration averages out, and short against the drift of the gyroscope.
_LOCAL_G = 9.81  # m/s2, Central Europe
_MID_RATE = 2  # gyro_index: the mean of two samples is the rate half way between them
FOR_REAL_RECORDINGS: Mapping[str, Mapping[str, Any]] = {
    # sigma_a / (g sigma_g) is the time constant. sigma_g = 0.01 rad/s stays: it is no sensor's noise but the error of
    # the scale, 1 % of 1 rad/s. Mode 2, as mode 1 gives the gentle parts of a movement more weight than the vigorous
    # ones, and then the acceleration of a movement to and fro no longer averages out.
    "lee2012": {"mode": 2, "sigma_a2": (_LOCAL_G * 0.01 * TILT_TIME) ** 2, "g": _LOCAL_G, "gyro_index": _MID_RATE},
    # The same with c_b / (1 - c_a) in the place of sigma_a; c_a = 0.1 stays.
    "leechoi2018": {"c_b": 0.9 * _LOCAL_G * 0.01 * TILT_TIME, "g": _LOCAL_G, "gyro_index": _MID_RATE},
    # sqrt(2) / cutoff is the time constant.
    "rizun2008": {"cutoff": 2**0.5 / TILT_TIME, "g": _LOCAL_G, "gyro_index": _MID_RATE},
}

# Its vertical is that of lee2012, with other variances.
_TILT_OF_ANOTHER = ("zihajehzadeh2014",)

# Magnetic North is North, and the norm of the field indoors that of Berlin's BROAD recordings at rest.
_FIELD_OF_THE_RECORDING: Mapping[str, Mapping[str, Any]] = {
    "zihajehzadeh2014": {"m_ref": (0.0, 20.1, -44.9), "h": 44.0, "g": _LOCAL_G, "gyro_index": _MID_RATE}
}

# Variants of an estimator that its paper treats as different filters.
_VARIANTS: Mapping[str, Sequence[Mapping[str, Any]]] = {"lee2012": ({"mode": 2}, {"mode": 3})}


_LAGGING = plumb.LAGGED
_AFTER = 0.5  # s; it tells of whole blocks, next to its lag


@dataclass(frozen=True)
class Contender:
    """One filter with fixed parameters.

    estimate(readings, sample_period): signals by name of imufmu.vocabulary, one row per row of the readings, with at
    least ``vertical``. finds_bias: it estimates a constant gyroscope bias by itself.
    """

    name: str
    estimate: Callable[[Readings, float], Readings]
    parameters: Mapping[str, Any]
    finds_bias: bool = False


def with_papers_parameters(names: Sequence[str] = (), settings: Settings = MappingProxyType({})) -> list[Contender]:
    """The estimators of these names, or all that need no more than gyroscope and accelerometer.

    settings: values by estimator.parameter that replace those of the paper. Raises ValueError.
    """
    found = []
    for block in _blocks(names):
        own = _own(block, settings)
        found.append(_contender(block, own))
        for variant in _VARIANTS.get(block.name, ()):
            label = " ".join(f"{name}={value}" for name, value in variant.items())
            found.append(_contender(block, {**own, **variant}, f"{block.name} {label}"))
    return found


def with_real_parameters(names: Sequence[str] = (), settings: Settings = MappingProxyType({})) -> list[Contender]:
    """The same estimators with parameters for real recordings; as they are where no others are known."""
    return [_with_real(block, settings) for block in _blocks(names)]


def with_wheels(names: Sequence[str] = (), settings: Settings = MappingProxyType({})) -> list[Contender]:
    """Those among them that take the speed of a vehicle's wheels."""
    return [_with_real(block, settings) for block in _blocks(names) if FORWARD_SPEED in block.inputs]


def offline_contenders(names: Sequence[str] = (), settings: Settings = MappingProxyType({})) -> list[Contender]:
    """Those among them that find a bias, with the whole record before them."""
    found = [c for c in with_real_parameters(names, settings) if c.finds_bias]
    blocks = {block.name: block for block in _blocks(names)}
    return [
        Contender(f"{c.name} offline", partial(_estimate, blocks[c.name], c.parameters, runs=run_offline), c.parameters)
        for c in found
    ]


def lagging_contenders(lags: Sequence[float], settings: Settings = MappingProxyType({})) -> list[Contender]:
    """plumb_lag, told so many seconds later, with what came since. Raises ValueError for a lag that cannot be."""
    found = []
    for lag in lags:
        parameters = {**_own(_LAGGING, settings), "lag": lag}
        _LAGGING.parameter_vector(parameters)
        found.append(Contender(f"{_LAGGING.name} {lag:g} s", partial(_estimate_later, parameters), parameters, True))
    return found


def _estimate_later(
    parameters: Mapping[str, Any], readings: Readings, sample_period: float
) -> Mapping[str, np.ndarray]:
    """Signals of every instant of the readings; what belongs to the last ones is told when nothing is read any more."""
    n, more = len(readings["gyro"]), math.ceil((parameters["lag"] + _AFTER) / sample_period)
    padded = {name: np.vstack([readings[name], np.full((more, 3), np.nan)]) for name in ("gyro", "accel")}
    told = run(_LAGGING, padded, {"sample_period": sample_period, **parameters})
    instants = np.round(told["sample_time"] / sample_period)
    last = np.searchsorted(instants, np.arange(n), side="right") - 1  # row that tells of each instant
    return {name: told[name][last] for name in ("vertical", "tilt_std")}


def check_settings(settings: Settings) -> None:
    """Raises ValueError for an estimator or a parameter that is none, and a value that cannot be."""
    blocks = {block.name: block for block in (*_of_tilt(), _LAGGING)}
    for key, value in settings.items():
        owner, dot, name = key.partition(".")
        if not dot:
            raise ValueError(f"{key}: name estimator and parameter, as plumb.{key}")
        if owner not in blocks:
            raise ValueError(no_such("estimator of tilt", owner, blocks))
        blocks[owner].parameter_vector({name: value})


def _own(block: SampledBlock, settings: Settings) -> dict[str, Any]:
    """Values by parameter, of one estimator."""
    return {key.partition(".")[2]: value for key, value in settings.items() if key.partition(".")[0] == block.name}


def _with_real(block: SampledBlock, settings: Settings) -> Contender:
    return _contender(block, {**FOR_REAL_RECORDINGS.get(block.name, {}), **_own(block, settings)})


def _blocks(names: Sequence[str]) -> list[SampledBlock]:
    six_axis = {block.name: block for block in _of_tilt() if block.name not in _TILT_OF_ANOTHER}
    for name in names:
        if name not in six_axis:
            raise ValueError(no_such("estimator of tilt from gyro and accel", name, six_axis))
    return [six_axis[name] for name in dict.fromkeys(names)] or list(six_axis.values())


def with_magnetometer(settings: Settings = MappingProxyType({})) -> list[Contender]:
    """The estimators of heading, with parameters for real recordings: North is where the field points."""
    return [
        _contender(block, {**_FIELD_OF_THE_RECORDING.get(block.name, {}), **_own(block, settings)})
        for block in _of_tilt()
        if MAG in block.inputs
    ]


def _of_tilt() -> list[SampledBlock]:
    return [
        block
        for block in ESTIMATORS
        if isinstance(block, SampledBlock) and {GYRO, ACCEL} <= set(block.inputs) and VERTICAL in block.outputs
    ]


def _contender(block: SampledBlock, parameters: Mapping[str, Any], name: str = "") -> Contender:
    finds_bias = any(signal.name == "gyro_bias" for signal in block.outputs)
    return Contender(name or block.name, partial(_estimate, block, parameters), parameters, finds_bias)


def _estimate(
    block: SampledBlock,
    parameters: Mapping[str, Any],
    readings: Readings,
    sample_period: float,
    runs: Callable[..., Trajectory] = run,
) -> Mapping[str, np.ndarray]:
    inputs = {signal.name: readings[signal.name] for signal in block.inputs if signal.name in readings}
    return runs(block, inputs, {"sample_period": sample_period, **parameters}).values
