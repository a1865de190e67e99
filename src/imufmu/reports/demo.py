"""The first thing a new user runs: a pendulum, an IMU and the filter of Lee 2012 in its three modes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ..cosim.master import simulate
from ..cosim.system import System, locate
from ..pictures.figures import attitude_figure, save
from ..scoring.systems import comparisons
from ..scoring.table import Table
from .page import Section, write_report
from .tables import summary_table

SYSTEM = "pendulum_lee2012"
MODES = {1: "mode 1 (acceleration model)", 2: "mode 2 (static)", 3: "mode 3 (threshold)"}

_LEAD = (
    "A pendulum swings as a leg does in walking, faster and faster. An IMU with the errors of an Xsens MTx rides on "
    "it, and its readings go into the estimator of Lee, Park and Robinovitch (2012). All three are FMUs, co-simulated "
    "through FMPy. The same readings go to the filter in each of its three modes."
)
_READING = (
    "Mode 2 takes every acceleration for gravity and fails as soon as the pendulum swings. Mode 1 models the "
    "acceleration; mode 3 leaves the accelerometer out until its norm has stayed near gravity, which a swing can "
    "imitate for a moment. Errors are root mean squares against the plant's exact truth, at the instants of the "
    "samples, over the whole run."
)


@dataclass(frozen=True)
class Demo:
    """What a demo run made."""

    table: Table
    figure: Path
    report: Path


def run_demo(folder: Path, progress: Callable[[int, int], None] | None = None) -> Demo:
    """Build the FMUs, co-simulate each mode, write ``demo.png`` and ``demo.html`` into the folder.

    Raises SimulationError and WriteError.
    """
    system = System.read(locate(SYSTEM))
    found = {}
    for done, (mode, label) in enumerate(MODES.items()):

        def overall(tick: int, ticks: int, before: int = done) -> None:
            if progress:
                progress(before * ticks + tick, len(MODES) * ticks)

        result = simulate(system, parameters={"lee2012.mode": mode}, progress=overall)
        found[label] = next(c for c in comparisons(result) if c.component == "lee2012")
    table = summary_table("lee2012", {label: c.summary for label, c in found.items()})
    truth = next(iter(found.values())).truth
    figure = attitude_figure(
        "Pendulum, IMU and lee2012, three FMUs co-simulated",
        truth,
        {label: c.estimate for label, c in found.items()},
        {label: (c.estimate.time, c.errors) for label, c in found.items()},
    )
    folder.mkdir(parents=True, exist_ok=True)
    paths = folder / "demo.png", folder / "demo.html"
    save(figure, paths[0])
    sections = [
        Section("Result", _READING, table),
        Section("Run", figure=figure, caption="Truth and estimates; tilt error; norm of the external acceleration."),
    ]
    write_report(paths[1], "Which way is up on a swinging pendulum?", _LEAD, sections)
    return Demo(table, *paths)
