"""Find truth and estimates in the results of a co-simulated system, and compare them.

A component that reports a ``vertical`` knows an attitude. With a ``sample_time`` it is an estimator, without one it is
a plant and tells the truth.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from ..blocks.running import Trajectory
from ..cosim.results import Result
from ..cosim.truth import COMPONENT as TRUTH
from ..cosim.truth import PLANT
from ..cosim.units import SAME, Unit, UnitError, conversion
from . import metrics

# What is compared, each in this unit.
_COMPARED = {
    "vertical": "1",
    "roll": "rad",
    "pitch": "rad",
    "yaw": "rad",
    "q_NS": "1",
    "external_acceleration": "m/s2",
    "sample_time": "s",
    "tilt_std": "rad",
}


@dataclass(frozen=True)
class Comparison:
    """Truth and estimates of one run at the estimators' own instants.

    truth, estimate: trajectories with equal time. errors: over time, as metrics.errors gives them. summary: figures by
    name with the unit in the name. delay: s, from the instant of a sample to the row that first holds its outputs, in
    the mean.
    """

    component: str
    truth: Trajectory
    estimate: Trajectory
    errors: dict[str, np.ndarray]
    summary: dict[str, float]
    delay: float


def comparisons(result: Result) -> list[Comparison]:
    """One comparison per estimator that can be compared; empty without a truth or an estimator."""
    return compare_all(result)[0]


def compare_all(result: Result) -> tuple[list[Comparison], list[str]]:
    """One comparison per estimator, and notes that say what could not be compared and why."""
    plants, estimators = knowing(result.names)
    if not plants or not estimators:
        return [], []
    if len(plants) > 1:
        return [], [
            f"nothing is compared: {' and '.join(plants)} report a vertical and no sample_time, as a plant does, and "
            "which one tells the truth is unclear; an estimator needs the output sample_time"
        ]
    found: list[Comparison] = []
    notes = [
        f"{component} is not compared: it has no output sample_time, as an estimator needs"
        for component in _with_attitude(result.names)
        if plants == [TRUTH] and component not in (TRUTH, PLANT, *estimators)
    ]
    for component in estimators:
        try:
            found.append(_compare(result, plants[0], component, notes))
        except ValueError as error:
            notes.append(f"{component} is not compared with {plants[0]}: {error}")
    return found, notes


def knowing(names: Iterable[str]) -> tuple[list[str], list[str]]:
    """Plants that tell the truth and estimators among the components with these variables, in their order.

    A truth that follows from what a plant says in words of its own is the only one.
    """
    known = list(names)
    attitudes = _with_attitude(known)
    estimators = [component for component in attitudes if f"{component}.sample_time" in known]
    plants = [component for component in attitudes if component not in estimators]
    return [TRUTH] if TRUTH in plants else plants, estimators


def _with_attitude(names: Iterable[str]) -> list[str]:
    """Components that report a vertical."""
    endings = (".vertical[1]", ".vertical[0]")  # a vector from 0 has both
    return list(dict.fromkeys(name[: -len(endings[0])] for name in names if name.endswith(endings)))


def _compare(result: Result, plant: str, component: str, notes: list[str]) -> Comparison:
    """Signals of unequal size are left out, with a note. Raises ValueError for what cannot be compared at all."""
    estimate, truth = _signals(result, component), _signals(result, plant)
    notes += leave_out_unequal(estimate, truth, component, plant)
    instants = np.unique(estimate["sample_time"])
    period = float(np.median(np.diff(instants))) if len(instants) > 1 else 1.0
    rows_hat, rows = metrics.equal_instants(estimate["sample_time"], result.time, period)
    at_samples = metrics.at_rows(estimate, rows_hat)
    true_then = metrics.at_rows(truth, rows)
    errors = metrics.errors(at_samples, true_then)
    time = result.time[rows]
    return Comparison(
        component,
        Trajectory(time, true_then, {name: _COMPARED[name] for name in true_then}),
        Trajectory(time, at_samples, {name: _COMPARED[name] for name in at_samples}),
        errors,
        metrics.summary(errors),
        float(np.mean(result.time[rows_hat] - at_samples["sample_time"])),
    )


def leave_out_unequal(
    estimate: dict[str, np.ndarray], truth: Mapping[str, np.ndarray], component: str, plant: str
) -> list[str]:
    """Take those signals out of the estimate that have another size in the truth; a note for each."""
    notes = []
    for name in sorted(estimate.keys() & truth.keys()):
        sizes = [math.prod(signals[name].shape[1:]) for signals in (estimate, truth)]
        if sizes[0] != sizes[1]:
            notes.append(f"{component}: {name} is not compared: it has {sizes[0]} elements, that of {plant} {sizes[1]}")
            del estimate[name]
    return notes


def _signals(result: Result, component: str) -> dict[str, np.ndarray]:
    """What a component reports, in our units. Raises ValueError for a unit of another kind."""
    signals = {name: result[f"{component}.{name}"] for name in _COMPARED if f"{component}.{name}" in result}
    for name, unit in _units(result, component, signals).items():
        try:
            linear = conversion(None if unit in (None, "", "1") else Unit(unit), Unit(_COMPARED[name]))
        except UnitError as error:
            raise ValueError(f"{component}.{name}: {error}") from error
        if linear != SAME:
            signals[name] = linear.factor * signals[name] + linear.offset
    return signals


def _units(result: Result, component: str, signals: Iterable[str]) -> dict[str, str | None]:
    """Units of signals, those of vectors from their first element."""
    names = {name: f"{component}.{name}" for name in signals}
    return {
        name: result.units.get(full, result.units.get(f"{full}[1]")) for name, full in names.items()
    }  # [0] has it too
