"""The experiments of Zihajehzadeh et al. 2014: magnetic disturbance at rest, a vertical jump, rollerblading.

The paper tells times, thresholds and variances, and shows its results as figures only, so every limit is one that a
correct filter keeps on motions of these kinds.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ...blocks.running import Trajectory
from ...pictures.figures import COLOURS, TRUTH_COLOUR
from ...reports.page import Section
from ...scoring.checks import Check
from ...scoring.metrics import rms
from ...scoring.table import Table
from ..experiment import Experiment, Outcome, Progress
from .magnetic import (
    directions,
    disturb,
    disturbance_checks,
    disturbance_figure,
    disturbance_section,
    hole,
    hole_checks,
    hole_section,
)
from .motions import PEAK, jump, skating
from .runs import ANGLES, PERIOD, STRICT, errors, filtered, read


@dataclass(frozen=True)
class Moved:
    """One moved record: truth, readings, and the filter with the paper's c_a and with none."""

    truth: Trajectory
    readings: Trajectory
    estimate: Trajectory
    static: Trajectory

    @staticmethod
    def of(truth: Trajectory, seed: int) -> Moved:
        readings = read(truth, seed)
        return Moved(truth, readings, filtered(readings), filtered(readings, c_a=0.0))


def rms_of(runs: Sequence[Moved], c_a: bool = True) -> np.ndarray:
    """Root mean square errors of roll, pitch, yaw, (len(runs), 3), deg. c_a: with the acceleration model."""
    return np.array([rms(errors(r.estimate if c_a else r.static, r.truth)) for r in runs])


def jump_checks(runs: Sequence[Moved]) -> list[Check]:
    largest = max(np.abs(errors(r.estimate, r.truth)).max() for r in runs)
    worse = rms_of(runs, c_a=False).mean(axis=0) / rms_of(runs).mean(axis=0)
    return [
        Check(
            "Jump: all angles are tracked", float(rms_of(runs).max()), 0.5, unit="deg", reason="largest RMSE; Fig. 4"
        ),
        Check("Jump: no angle is lost for a moment", float(largest), 2.5, unit="deg", reason="largest error; Fig. 4"),
        Check(
            "Jump: without acceleration model the tilt is worse",
            float(worse[:2].min()),
            4.0,
            at_most=False,
            reason="mean RMSE with c_a = 0 / c_a = 0.3, the smaller of roll and pitch; the model is the method",
        ),
    ]


def skating_checks(runs: Sequence[Moved]) -> list[Check]:
    found = rms_of(runs)
    worse = rms_of(runs, c_a=False).mean(axis=0) / found.mean(axis=0)
    last = [np.abs(errors(r.estimate, r.truth)[-len(r.truth.time) // 10 :].mean(axis=0)).max() for r in runs]
    return [
        Check("Rollerblading: roll and pitch are tracked", float(found[:, :2].max()), 2.5, unit="deg", reason="Fig. 5"),
        Check(
            "Rollerblading: yaw is tracked", float(found[:, 2].max()), 5.0, unit="deg", reason="largest RMSE; Fig. 5"
        ),
        Check(
            "Rollerblading: no angle drifts away",
            float(max(last)),
            2.0,
            unit="deg",
            reason="largest mean error of the last 12 s; Fig. 5",
        ),
        Check(
            "Rollerblading: without acceleration model the tilt is worse",
            float(worse[:2].min()),
            2.5,
            at_most=False,
            reason="mean RMSE with c_a = 0 / c_a = 0.3, the smaller of roll and pitch; the model is the method",
        ),
        Check(
            "The stricter test leaves undisturbed motion alone",
            max(float(np.abs(filtered(r.readings, **STRICT)["q_NS"] - r.estimate["q_NS"]).max()) for r in runs),
            0.0,
            reason="bit for bit, rollerblading; eps_yaw exceeds every innovation",
        ),
    ]


def moved_section(heading: str, text: str, runs: Sequence[Moved], caption: str) -> Section:
    """Table of errors, and the last record over time as in Fig. 4 and 5."""
    rows = []
    for label, with_model in (("c_a = 0.3", True), ("c_a = 0", False)):
        found = rms_of(runs, with_model)
        rows.append([label, *(f"{f(found, axis=0)[i]:.2f}" for i in range(3) for f in (np.mean, np.max))])
    columns = [f"RMSE of {angle} (deg), {f}" for angle in ANGLES for f in ("mean", "largest")]
    return Section(heading, text, Table(["filter", *columns], rows), moved_figure(runs[-1]), caption)


def moved_figure(one: Moved) -> Figure:
    """Roll, pitch, heading, their errors, and the norm of the accelerometer."""
    time = one.truth.time
    figure = Figure(figsize=(10, 9), layout="constrained")
    *angles, error, force = figure.subplots(5, 1, sharex=True)
    for axis, name in zip(angles, ANGLES, strict=True):
        shown = "heading" if name == "yaw" else name
        for label, signals, colour in (("truth", one.truth, TRUTH_COLOUR), ("estimate", one.estimate, COLOURS[0])):
            degrees = np.degrees(signals[name])
            degrees = (90 - degrees) % 360 if name == "yaw" else degrees
            degrees[1:][np.abs(np.diff(degrees)) > 180] = np.nan
            axis.plot(time, degrees, color=colour, linewidth=1.2, label=label)
        axis.set_ylabel(f"{shown} (deg)")
    for name, column, colour in zip(ANGLES, errors(one.estimate, one.truth).T, COLOURS[1:], strict=False):
        error.plot(time, column, color=colour, linewidth=0.8, label=f"error of {name}")
    error.set_ylabel("error (deg)")
    force.plot(time, np.linalg.norm(one.readings["accel"], axis=1), color=TRUTH_COLOUR, linewidth=0.8)
    force.set_ylabel("accelerometer,\nnorm (m/s²)")
    force.set_xlabel("time (s)")
    for axis in (*angles, error, force):
        axis.grid(alpha=0.3)
    angles[0].legend(loc="upper right")
    error.legend(loc="upper right", ncols=3)
    return figure


# What the paper does not show


def limits_section(seed: int) -> Section:
    """One record of rollerblading as in experiment 3, and what spoils it."""
    plain, moving, circling = skating(seed, PERIOD), skating(seed, PERIOD, stand=-1), skating(seed, PERIOD, speed=4)
    knowing = {"dip_of_m_ref": True}
    cases: tuple[tuple[str, Trajectory, Mapping[str, Any]], ...] = (
        ("as above", plain, {}),
        ("skating from the first sample on", moving, {}),
        ("the same, dip known (dip_of_m_ref)", moving, knowing),
        ("rounds at 4 m/s", circling, {}),
        ("the same, dip known (dip_of_m_ref)", circling, knowing),
    )
    rows = []
    for label, truth, changes in cases:
        estimate = filtered(read(truth, seed), **changes)
        found = rms(errors(estimate, truth))
        rows.append([label, f"{100 * np.mean(estimate['mag_ok']):.0f}", *(f"{error:.2f}" for error in found)])
    columns = ["record", "samples of the magnetometer used (%)", *(f"RMSE of {angle} (deg)" for angle in ANGLES)]
    return Section(
        "Where the filter ends",
        "The dip of the first sample decides what counts as disturbed: a start in motion spoils it for good. The "
        "centripetal acceleration of a round, 0.4 m/s² for a minute, is no external acceleration of the kind that the "
        "model knows.",
        Table(columns, rows),
    )


JUMP_TEXT = (
    f"The largest specific force is {PEAK:g} m/s² as in the paper; in flight it is zero. The paper says that the "
    "orientation is tracked accurately (Fig. 4) and prints no numbers."
)
SKATING_TEXT = (
    "120 s of random acceleration, 2.5 m/s² on average. The paper says that the orientation is reasonably good and "
    "does not drift (Fig. 5), and prints no numbers."
)
REMARKS = (
    "The test (26) has a hole: a horizontal disturbance that turns the field and keeps its norm and dip is not seen, "
    "whatever the angle. One square to the field passes up to 23 deg at a dip of 70.5 deg; a stronger one passes while "
    "it comes and leaves the heading turned.",
    "The test depends on the first sample: where the sensor moves then, its tilt and so the dip are wrong, and most "
    "samples of the magnetometer are rejected for the rest of the record.",
    "That the orientation does not drift holds for acceleration that keeps changing, not in long curves.",
)

DIRECTIONS = 10


def run(quick: bool, progress: Progress) -> Outcome:
    """All of it; quick takes a tenth of the records."""
    sets, jumps, skates = (1, 5, 2) if quick else (10, 50, 20)
    sizes = np.array([0.06, 0.1, 0.14, 0.2, 0.4, 0.8]) if quick else np.linspace(0.02, 0.8, 40)
    total = sets * DIRECTIONS + jumps + skates + 3
    steps = iter(range(1, total + 1))

    def counted(result: Any) -> Any:
        progress(next(steps), total)
        return result

    sides = directions(DIRECTIONS)
    still = [counted(disturb(side, DIRECTIONS * i + k)) for i in range(sets) for k, side in enumerate(sides)]
    largest = counted(hole(sizes, 1))
    jumped = [counted(Moved.of(jump(seed, PERIOD), seed)) for seed in range(jumps)]
    skated = [counted(Moved.of(skating(seed, PERIOD), seed)) for seed in range(skates)]
    checks = [
        *disturbance_checks(still),
        *hole_checks(largest),
        *jump_checks(jumped),
        *skating_checks(skated),
    ]
    sections = [
        disturbance_section(still),
        Section(
            "The disturbance of Fig. 3",
            figure=counted(disturbance_figure(sides[1], 1)),
            caption="Heading with and without the test; norm of the field.",
        ),
        hole_section(sizes, largest),
        moved_section("Experiment 2: vertical jump", JUMP_TEXT, jumped, "One jump, as in Fig. 4; errors."),
        moved_section("Experiment 3: rollerblading", SKATING_TEXT, skated, "One record, as in Fig. 5; errors."),
        counted(limits_section(1)),
    ]
    return Outcome(sections, checks, REMARKS)


EXPERIMENT = Experiment(
    name="zihajehzadeh2014",
    title="Cascaded two-step Kalman filter for orientation of human body segments",
    reference="S. Zihajehzadeh, D. Loh, M. Lee, R. Hoskinson, E. J. Park, EMBC 2014, doi:10.1109/EMBC.2014.6945062",
    run=run,
)
