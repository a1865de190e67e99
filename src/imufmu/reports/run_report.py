"""The report of a run: the motion, truth and estimates, errors, external acceleration."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..cosim.results import Result
from ..pictures.bodies import Body, body_of
from ..pictures.figures import acceleration_figure, direction_figure, error_figure
from ..pictures.motion_figures import enlargement, path_figure, stick_figure
from ..scoring.systems import Comparison
from .page import Section, write_report
from .tables import run_table


def write_run_report(path: Path, result: Result, compared: Sequence[Comparison]) -> None:
    """Write the HTML page of a run with at least one comparison. Raises WriteError."""
    seconds = result.time[-1] - result.time[0]
    lead = f"Co-simulation of FMUs over {seconds:.4g} s: {', '.join(c.component for c in compared)} against the truth."
    write_report(path, result.system, lead, _sections(result, compared))


def _sections(result: Result, compared: Sequence[Comparison]) -> list[Section]:
    body, truth = body_of(result), compared[0].truth
    estimates = {c.component: c.estimate for c in compared}
    sections = [Section("Errors and delay", _ERRORS, run_table(compared))]
    sections += _motion(body) if body is not None else []
    directions = direction_figure(truth, estimates)
    sections.append(
        Section(
            "Truth and estimates",
            figure=directions,
            caption="Attitude of the sensor: Z-Y-X angles, or where those jump, the components of the up vector.",
        )
    )
    errors = error_figure(estimates, {c.component: c.errors for c in compared})
    sections.append(Section("Errors over time", _BAND, figure=errors, caption="Errors at the instants of the samples."))
    acceleration = acceleration_figure(truth, estimates)
    if acceleration is not None:
        shown = "Acceleration without gravity along the axes of the sensor."
        sections.append(Section("External acceleration", figure=acceleration, caption=shown))
    return [*sections, *([Section("Notes", points=result.notes)] if result.notes else [])]


def _motion(body: Body) -> list[Section]:
    """The path of a body that travels, or that has no skeleton; then the body from the side."""
    sections = []
    if body.travels:
        times = enlargement(body)
        bodily = (
            f"the body{f', {times} times as large,' if times > 1 else ''} and " if body.skeleton is not None else ""
        )
        shown = f"Path of the sensor from above, with {bodily}the sensor's axes at equal times."
        sections.append(Section("Motion", figure=path_figure(body), caption=shown))
    if body.skeleton is not None:
        where = "meanwhile" if body.travels else "in the whole run"
        shown = f"The body from the side at equal times of its fastest movement; path of the sensor {where}."
        level = 3 if sections else 2
        heading = "Fastest movement" if sections else "Motion"
        sections.append(Section(heading, figure=stick_figure(body), caption=shown, level=level))
    return sections


_ERRORS = (
    "Root mean square, largest and 95th percentile of the errors against the plant's truth, at the instants of the "
    "samples. Delay: from the instant of a sample to the row of results that first holds its outputs, in the mean; "
    "it is no part of the errors. The heading counts from East, which an estimator without a magnetometer cannot know: "
    "what it does not know at the start stays in its heading error; the figure of errors counts from the start."
)
_BAND = "A band is the estimator's own one-sigma angle, tilt_std, where it states one."
