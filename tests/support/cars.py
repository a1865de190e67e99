"""Drives of the car for its tests."""

from __future__ import annotations

from typing import Any

from imufmu.blocks.running import Trajectory
from imufmu.compiled.running import simulate
from imufmu.plants.vehicle.plant import BLOCK

CARS = ("ford_escort", "bmw_320i", "vw_vanagon")  # parameter sets in models/vehicle


def drive(duration: float, inputs: dict[str, Any] | None = None, step: float = 0.01, **parameters: Any) -> Trajectory:
    """Run the car; inputs and parameters as of ``simulate``."""
    return simulate(BLOCK, duration, step, inputs, parameters)
