"""Values that can be right but look like a wrong unit, axis or convention."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..blocks.rotations import angle_between, over_rows


def doubts(
    readings: Mapping[str, np.ndarray], truth: Mapping[str, np.ndarray], scored: np.ndarray, period: float
) -> list[str]:
    """Notes on values that can be right but look like a wrong unit, axis or convention."""
    vectors = {name: array for name, array in readings.items() if array.ndim > 1}
    usual = {name: _typical_length(array) for name, array in vectors.items()}
    found = [f"{name} has no complete sample" for name, length in usual.items() if np.isnan(length)]
    if usual["accel"] < 5 or usual["accel"] > 20:
        hint = "; are the values in g?" if 0.5 < usual["accel"] < 2 else ""
        hint += "; was gravity taken out of them? Estimators of tilt need it" if usual["accel"] < 2 else ""
        found.append(f"accel has a median length of {usual['accel']:.3g} m/s2, far from gravity{hint}")
    fast = _typical_length(readings["gyro"], 0.99)
    if fast > 20:
        found.append(f"gyro exceeds {fast:.3g} rad/s in 1 % of the samples; are the values in deg/s?")
    if "mag" in usual and (usual["mag"] < 10 or usual["mag"] > 150):
        found.append(f"mag has a median length of {usual['mag']:.3g} uT; the Earth's field has 22 to 67 uT")
    if period > 0.5:
        found.append(f"samples are {period:g} s apart; are the times in milliseconds?")
    if not scored.any():
        found.append("no sample counts for errors: truth is missing everywhere")
    if "vertical" in truth:
        off_vertical = over_rows(angle_between, readings["accel"], truth["vertical"])[:, 0]
        off = np.rad2deg(_quantile(off_vertical, 0.5))
        if off > 30:
            found.append(
                f"accel is {off:.0f} deg off the true vertical in half of the samples; is the truth in rad, scalar "
                "first, S to N, Z up, and does accel read +g on the axis that points up?"
            )
    return found


def _typical_length(vectors: np.ndarray, quantile: float = 0.5) -> float:
    return _quantile(np.linalg.norm(vectors, axis=1), quantile)


def _quantile(values: np.ndarray, quantile: float) -> float:
    """Quantile of the finite values; NaN if there are none."""
    finite = values[np.isfinite(values)]
    return float(np.quantile(finite, quantile)) if finite.size else np.nan
