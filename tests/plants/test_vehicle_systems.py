"""What the systems of the car show: estimators that ride out short accelerations fail in long ones."""

from __future__ import annotations

import re
import subprocess
import sys
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

from imufmu import Result, System, locate, simulate
from imufmu.compiled.running import run
from imufmu.files.locations import models_folder
from imufmu.papers.motions import parameter_set
from imufmu.registry import BLOCKS
from imufmu.scoring.systems import comparisons
from imufmu.sensors import imu
from support.motions import angle

SYSTEMS = ("vehicle_roundabout", "vehicle_double_lane_change", "vehicle_braking", "vehicle_slalom")
PAPERS = ("lee2012", "leechoi2018", "zihajehzadeh2014", "rizun2008")
WITHOUT_WHEELS = (*PAPERS, "plumb_alone")
PERIOD = 0.005  # s, of the IMU


@lru_cache(maxsize=len(SYSTEMS))
def result_of(system: str) -> Result:
    return simulate(system)


def tilt_rms_deg(estimator: str, result: Result) -> float:
    """Root mean square angle between true and estimated vertical of an estimator on the system's IMU."""
    block = BLOCKS[estimator]
    readings = {s.name: result[f"imu.{s.name}"][:-1] for s in block.inputs}
    estimate = run(block, readings, {"sample_period": PERIOD})["vertical"]
    return float(np.degrees(np.sqrt(np.mean(angle(estimate, result["plant.vertical"][:-1]) ** 2))))


@lru_cache(maxsize=len(SYSTEMS))
def tilt_rmse_deg(system: str) -> dict[str, float]:
    """By estimator, over the whole run, as `imufmu run` prints it."""
    return {c.component: c.summary["tilt_rmse_deg"] for c in comparisons(result_of(system))}


@pytest.mark.parametrize("system", SYSTEMS)
def test_every_estimator_reads_the_same_imu_and_only_plumb_the_wheels(system: str) -> None:
    described = System.read(locate(system)).description
    assert {"plant", "imu", "plumb", *WITHOUT_WHEELS} == {component.name for component in described.components}
    readings = [f"{sensor}[{i}]" for sensor in ("gyro", "accel") for i in (1, 2, 3)]
    for estimator in ("plumb", *WITHOUT_WHEELS):
        fed = {c.end.connector: str(c.start) for c in described.connections if c.end.element == estimator}
        assert {name: f"imu.{name}" for name in readings}.items() <= fed.items()
        assert ("forward_speed" in fed) == (estimator == "plumb")


@pytest.mark.parametrize("readme", ["docs/vehicles.md", "models/vehicle/README.md"])
@pytest.mark.parametrize("system", SYSTEMS)
def test_the_readmes_tell_the_tilt_errors_that_come_out(system: str, readme: str) -> None:
    """To the digits given: one seed, so that only rounding may differ."""
    text = (models_folder().parent / readme).read_text(encoding="utf-8")
    (row,) = re.findall(rf"^\| `{system}` \|(.*)\|$", text, re.MULTILINE)
    found = tilt_rmse_deg(system)
    expected = [found[name] for name in (*WITHOUT_WHEELS, "plumb")]
    assert [float(cell) for cell in row.split("|")] == pytest.approx(expected, abs=0.006)


@pytest.mark.parametrize("system", SYSTEMS)
def test_every_seed_algorithm_fails_on_the_road(system: str) -> None:
    """None keeps 1 deg, and those that take acceleration for short noise lose over 10 deg where it is longest."""
    found = tilt_rmse_deg(system)
    assert min(found[name] for name in PAPERS) > 1.0
    assert min(found["lee2012"], found["leechoi2018"]) > (10.0 if system == "vehicle_roundabout" else 5.0)


@pytest.mark.parametrize("system", SYSTEMS)
def test_plumb_keeps_the_vertical_in_a_car(system: str) -> None:
    """0.3 deg with the speed of the wheels; without it, better than each of the papers' filters."""
    found = tilt_rmse_deg(system)
    assert found["plumb"] <= 0.3
    assert found["plumb_alone"] < min(found[name] for name in PAPERS)


@pytest.mark.slow
@pytest.mark.parametrize("system", SYSTEMS)
def test_a_device_from_the_factory_costs_plumb_less_than_half_of_what_it_costs_the_papers_filters(system: str) -> None:
    """Without the wheels. Two axes of 50 mg at three sigma alone are 1.35 deg, which nothing can observe."""
    result = result_of(system)
    ideal = {s.name: result[f"plant.{s.name}"][:-1] for s in imu.BLOCK.inputs}
    as_it_comes = run(imu.BLOCK, ideal, parameter_set("imus/mpu9150"))
    truth = result["plant.vertical"][:-1]

    def rmse(estimator: str) -> float:
        readings = {name: as_it_comes[name] for name in ("gyro", "accel")}
        estimate = run(BLOCKS[estimator], readings, {"sample_period": PERIOD})["vertical"]
        return float(np.sqrt(np.mean(angle(estimate, truth) ** 2)))

    assert rmse("plumb") < 0.5 * min(rmse(name) for name in ("lee2012", "leechoi2018", "rizun2008"))


def test_the_error_of_lee2012_in_the_roundabout_is_that_of_the_accelerometer() -> None:
    """The filter follows the specific force: leaning by almost atan(a / g) for as long as the turn lasts."""
    result = result_of("vehicle_roundabout")
    steady = (result.time > 30) & (result.time < 60)
    error = angle(result["lee2012.vertical"][steady], result["plant.vertical"][steady])
    lean = np.arctan(result["plant.lateral_acceleration"][steady] / result["plant.specific_force"][steady, 2])
    assert np.mean(error) > 0.6 * np.mean(lean)
    assert np.ptp(error) < np.radians(0.5)  # it does not recover


@pytest.mark.slow
def test_the_figure_of_the_readme_is_drawn_by_its_command(tmp_path: Path) -> None:
    script, target = models_folder() / "vehicle" / "draw.py", tmp_path / "vehicle.png"
    subprocess.run([sys.executable, script, target], check=True)
    assert target.read_bytes().startswith(b"\x89PNG")


def test_the_braking_car_comes_to_rest() -> None:
    result = result_of("vehicle_braking")
    assert result["plant.speed"].max() == pytest.approx(80 / 3.6, rel=0.01)  # the driver overshoots
    assert result["plant.speed"][-1] < 1e-4
    assert result["plant.longitudinal_acceleration"].min() == pytest.approx(-6.0, abs=0.1)  # air, turning wheels
