"""Claims about plumb where readings are missing or saturated."""

from __future__ import annotations

import math

import numpy as np
import pytest

from imufmu.compiled.running import run
from support.plumb_motions import BLOCK, G, moving, rms, tilt_deg


@pytest.mark.parametrize(("name", "rows"), [("gyro", 20), ("accel", 100)])
def test_it_bridges_a_hole_and_doubts_meanwhile(name: str, rows: int) -> None:
    """A fifth of a second with a gyroscope that is held, or a second without accelerometer."""
    motion = moving(10, 40, rest=2.0)
    holed = {"gyro": motion.gyro.copy(), "accel": motion.accel.copy()}
    whole = run(BLOCK, holed, {"g": G})
    holed[name][2000 : 2000 + rows] = math.nan
    result = run(BLOCK, holed, {"g": G})
    assert result["tilt_std"][1999 + rows] > 1.05 * whole["tilt_std"][1999 + rows]
    assert np.all(np.deg2rad(tilt_deg(motion, result)[2000:2500]) < 4 * result["tilt_std"][2000:2500])
    assert rms(tilt_deg(motion, result)[3000:]) < 0.6


def test_a_saturated_axis_makes_it_doubt() -> None:
    """Clipped at 2 rad/s and told so, or not: then two levels that agree tell, and cost little."""
    motion = moving(11, 30, rate=1.5, rest=2.0)
    clipped = {"gyro": np.clip(motion.gyro, -2, 2), "accel": motion.accel}
    whole = run(BLOCK, {"gyro": motion.gyro, "accel": motion.accel}, {"g": G})
    told, notices = run(BLOCK, clipped, {"g": G, "gyro_range": 2.0}), run(BLOCK, clipped, {"g": G})
    for result in (told, notices):
        assert rms(result["tilt_std"][300:]) > 2 * rms(whole["tilt_std"][300:])
        assert np.mean((np.deg2rad(tilt_deg(motion, result)[300:]) / result["tilt_std"][300:]) ** 2) < 5
    assert rms(tilt_deg(motion, notices)[300:]) < 1.5 * rms(tilt_deg(motion, told)[300:])
