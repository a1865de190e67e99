"""Draw the manoeuvres of the vehicle: python models/vehicle/draw.py models/vehicle/vehicle.png"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from imufmu import Result, simulate
from imufmu.plants.vehicle.driver import LANE_LENGTHS, LANE_OFFSET, lane_widths

CAR, MARK = "#26323f", "#e07a1f"
ESTIMATES = {"lee2012": "#d1495b", "rizun2008": "#edae49", "plumb_alone": "#6a994e", "plumb": "#2e86ab"}
RECORDED = [f"plant.{name}" for name in ("position", "vertical", "lateral_acceleration", "skeleton")]
RECORDED += [f"{name}.vertical" for name in ESTIMATES]
FLOOR = [0, 3, 6, 9, 0]  # corners of the floor in the skeleton, once round
BMW_WIDTH = 1.61  # m
CONES, CONE_DISTANCE, SLALOM_START = 8, 30.0, 50.0  # m, of vehicle_slalom.ssd
LANES_START = 120.0  # m, of vehicle_double_lane_change.ssd


def draw(target: Path) -> None:
    """Write the figure of three of the systems to this file."""
    systems = ("vehicle_double_lane_change", "vehicle_slalom", "vehicle_roundabout")
    lanes, slalom, roundabout = (simulate(name, record=RECORDED) for name in systems)
    figure = Figure(figsize=(9, 7.5), layout="constrained")
    rows = figure.subfigures(2, 1, height_ratios=(1, 1))
    upper = rows[0].subplots(2, 1)
    draw_course(upper[0], lanes, "ISO 3888-1 double lane change, 80 km/h, BMW 320i", LANES_START - 15, every=60)
    draw_lanes(upper[0])
    draw_course(upper[1], slalom, "slalom, 54 km/h, VW Vanagon", SLALOM_START, every=80)
    upper[1].plot(SLALOM_START + CONE_DISTANCE * np.arange(1, CONES + 1), np.zeros(CONES), "^", color=MARK, ms=5)
    left, right = rows[1].subplots(1, 2, width_ratios=(2, 3))
    draw_path(left, roundabout, every=300)
    left.set(title="roundabout, 29 km/h, BMW 320i", xlabel="East (m)", ylabel="North (m)", aspect="equal")
    draw_errors(right, roundabout)
    figure.savefig(target, dpi=80)


def draw_path(axis: Axes, result: Result, every: int) -> None:
    """Path of the sensor, and the car after each so many rows."""
    position = result["plant.position"]
    axis.plot(position[:, 0], position[:, 1], color=CAR, linewidth=0.8)
    for points in result["plant.skeleton"][::every, FLOOR]:
        axis.plot(points[:, 0], points[:, 1], color=CAR, linewidth=1.2)
    axis.grid(alpha=0.3)


def draw_course(axis: Axes, result: Result, title: str, start: float, every: int) -> None:
    """A long and narrow course, stretched across."""
    draw_path(axis, result, every)
    axis.set(title=title, xlabel="East (m)", ylabel="North (m)", xlim=(start, result["plant.position"][-1, 0]))


def draw_lanes(axis: Axes) -> None:
    """The three lanes of the double lane change."""
    begins = LANES_START + np.concatenate([[0.0], np.cumsum(LANE_LENGTHS)])
    widths = lane_widths(BMW_WIDTH)
    right = -widths[0] / 2
    for (begin, end), edge, width in zip(
        ((0, 1), (2, 3), (4, 6)), (right, right + LANE_OFFSET, right), widths, strict=True
    ):
        for y in (edge, edge + width):
            axis.plot(begins[[begin, end]], [y, y], "^-", color=MARK, ms=4, linewidth=0.8)


def draw_errors(axis: Axes, result: Result) -> None:
    """Angle between true and estimated vertical."""
    for name, colour in ESTIMATES.items():
        cosine = np.sum(result["plant.vertical"][:-1] * result[f"{name}.vertical"][:-1], axis=1)
        error = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
        axis.plot(result.time[:-1], error, color=colour, linewidth=1.2, label=name)
    lateral = result["plant.lateral_acceleration"]
    axis.plot(result.time, lateral, color=CAR, linewidth=0.8, label="lateral acceleration (m/s²)")
    axis.set(title="tilt error in the roundabout", xlabel="time (s)", ylabel="tilt error (deg)", ylim=(-1, 25))
    axis.grid(alpha=0.3)
    axis.legend(loc="upper right", ncols=1)


if __name__ == "__main__":
    draw(Path(sys.argv[1]))
