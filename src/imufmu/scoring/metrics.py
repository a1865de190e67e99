"""Errors of an estimate against the truth, at equal instants.

Signals go by their names in imufmu.vocabulary. Angles are rad inside; a summary is in degrees and m/s2, as its names
say. NaN never enters a figure silently: it raises ValueError, so leave out samples without truth beforehand.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..blocks.instance import CLOCK_TOLERANCE
from ..blocks.rotations import angle_between, angle_of, conjugate, multiply, over_rows, rotate_back
from ..blocks.running import Trajectory

Signals = Mapping[str, np.ndarray]


def vertical_of(q_NS: np.ndarray) -> np.ndarray:
    """Up vector in S, (n, 3), of the attitude q_NS (n, 4)."""
    return over_rows(lambda q: rotate_back(q, [0, 0, 1]), q_NS)


def inclination_error(vertical_hat: np.ndarray, vertical: np.ndarray) -> np.ndarray:
    """Angle between estimated and true vertical.

    vertical_hat, vertical: (n, 3), up vectors in S, of any length. Returns (n,), rad, in [0, pi]. Independent of
    heading; the inclination error of BROAD (doi:10.3390/data6070072).
    """
    return over_rows(angle_between, vertical_hat, vertical)[:, 0]


def heading_error(q_NS_hat: np.ndarray, q_NS: np.ndarray) -> np.ndarray:
    """Turn about the vertical in the error of an attitude, also where Euler angles have their singularity.

    q_NS_hat, q_NS: (n, 4). Returns (n,), rad, in (-pi, pi]. The heading error of BROAD, with its sign.
    """

    def half_turn(p: Any, q: Any) -> Any:
        error_N = multiply(p, conjugate(q))
        return angle_of(error_N[3], error_N[0])

    return angle_difference(2 * over_rows(half_turn, q_NS_hat, q_NS)[:, 0], 0.0)


def angle_difference(a: np.ndarray | float, b: np.ndarray | float) -> np.ndarray:
    """a - b in rad, brought into (-pi, pi] by whole turns; exact where it already is."""
    difference = np.subtract(a, b)
    return difference - 2 * np.pi * np.ceil((difference - np.pi) / (2 * np.pi))


def rms(x: np.ndarray) -> np.ndarray:
    """Root of the mean square of x (n,) or (n, k), over the rows: () or (k,). Raises ValueError for NaN or no rows."""
    return np.sqrt(np.mean(_complete(x) ** 2, axis=0))


def _complete(x: np.ndarray) -> np.ndarray:
    x = np.asarray(x, dtype=float)
    if len(x) == 0:
        raise ValueError("no samples to compute an error from")
    missing = np.flatnonzero(~np.isfinite(x).reshape(len(x), -1).all(axis=1))
    if missing.size:
        raise ValueError(f"{missing.size} of {len(x)} samples are not finite, the first in row {missing[0]}")
    return x


def errors(estimate: Signals, truth: Signals) -> dict[str, np.ndarray]:
    """Error over time, (n,), of every signal that both have. Rows belong to equal instants.

    tilt (from vertical), heading (from q_NS), roll, pitch, yaw: rad. external_acceleration_norm: difference of the
    norms, as in Lee 2012, Table I; external_acceleration_x, _y, _z: differences in S; m/s2.
    """
    both = estimate.keys() & truth.keys()
    for name in both:
        if np.shape(estimate[name]) != np.shape(truth[name]):
            raise ValueError(f"{name}: estimate {np.shape(estimate[name])}, truth {np.shape(truth[name])}")
    found = {}
    if "vertical" in both:
        found["tilt"] = inclination_error(estimate["vertical"], truth["vertical"])
    for name in ("roll", "pitch", "yaw"):
        if name in both:
            found[name] = angle_difference(estimate[name], truth[name])
    if "q_NS" in both:
        found["heading"] = heading_error(estimate["q_NS"], truth["q_NS"])
    if "external_acceleration" in both:
        a_hat, a = estimate["external_acceleration"], truth["external_acceleration"]
        found["external_acceleration_norm"] = np.linalg.norm(a_hat, axis=1) - np.linalg.norm(a, axis=1)
        found |= {f"external_acceleration_{axis}": e for axis, e in zip("xyz", (a_hat - a).T, strict=True)}
    if not found:
        raise ValueError(f"estimate ({', '.join(estimate)}) and truth ({', '.join(truth)}) share no signal to compare")
    return found


def summary(errors: Signals) -> dict[str, float]:
    """RMSE, largest magnitude and its 95th percentile of each error over time, such as ``tilt_rmse_deg``.

    errors: from ``errors``. Angles end in ``_deg``, accelerations in ``_m_s2``. Raises ValueError for NaN.
    """
    figures = {}
    for name, error in errors.items():
        factor, unit = (1.0, "m_s2") if name.startswith("external_acceleration") else (np.rad2deg(1.0), "deg")
        try:
            size = factor * np.abs(_complete(error))
        except ValueError as fault:
            raise ValueError(f"{name}: {fault}") from None
        figures[f"{name}_rmse_{unit}"] = float(rms(size))
        figures[f"{name}_max_{unit}"] = float(size.max())
        figures[f"{name}_p95_{unit}"] = float(np.quantile(size, 0.95))
    return figures


def equal_instants(sample_time: np.ndarray, time: np.ndarray, sample_period: float) -> tuple[np.ndarray, np.ndarray]:
    """Rows of an estimate and rows of the truth that belong to the same instants.

    sample_time: (n,), s, the instant that each row of the estimate belongs to; of rows that repeat an instant (outputs
    held between samples) the first counts. time: (m,), s, increasing, of the truth. Instants are equal within 1e-6 of
    ``sample_period`` (s). Returns two (k,) int. Raises ValueError where an estimate has no truth.
    """
    instants, rows_hat = np.unique(sample_time, return_index=True)
    after = np.clip(np.searchsorted(time, instants), 1, len(time) - 1)
    rows = np.where(instants - time[after - 1] < time[after] - instants, after - 1, after)
    # Far from zero, as with calendar time, doubles are coarser than that.
    tolerance = np.maximum(CLOCK_TOLERANCE * sample_period, 4 * np.spacing(np.abs(instants)))
    apart = np.flatnonzero(~(np.abs(time[rows] - instants) <= tolerance))
    if apart.size:
        row = apart[0]
        raise ValueError(
            f"{apart.size} of {len(instants)} estimates have no truth at their instant; the first belongs to "
            f"{instants[row]} s, the nearest truth to {time[rows[row]]} s"
        )
    return rows_hat, rows


def compare(estimate: Trajectory, truth: Trajectory, sample_period: float) -> dict[str, float]:
    """Summary of the errors of an estimate, at the instants of its samples.

    Its signal ``sample_time`` says which instant a row belongs to; without one, its time does. Raises ValueError as
    ``equal_instants``, ``errors`` and ``summary`` do.
    """
    rows_hat, rows = equal_instants(estimate.values.get("sample_time", estimate.time), truth.time, sample_period)
    return summary(errors(at_rows(estimate.values, rows_hat), at_rows(truth.values, rows)))


def at_rows(signals: Signals, rows: np.ndarray) -> dict[str, np.ndarray]:
    """The signals at some rows: numbers (k,) or a mask (n,)."""
    return {name: values[rows] for name, values in signals.items()}
