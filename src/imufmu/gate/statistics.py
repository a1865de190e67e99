"""One number from a quantity over time, in the window that a limit looks at."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.ndimage import maximum_filter1d

Statistic = Callable[[np.ndarray], float]


class Reduced(NamedTuple):
    """value: of the statistic. row: the one that decides it, of those looked at."""

    value: float
    row: int


def _largest_magnitude(x: np.ndarray) -> int:
    return int(np.argmax(np.abs(x)))


# Of values (n,): the number, and the row to look at where it breaks its bound.
_STATISTICS: dict[str, tuple[Statistic, Callable[[np.ndarray], int]]] = {
    "rmse": (lambda x: float(np.sqrt(np.mean(x**2))), _largest_magnitude),
    "max": (lambda x: float(np.max(np.abs(x))), _largest_magnitude),
    "p95": (lambda x: float(np.quantile(np.abs(x), 0.95)), _largest_magnitude),
    "mean": (lambda x: float(np.mean(x)), _largest_magnitude),
    "std": (lambda x: float(np.std(x)), lambda x: _largest_magnitude(x - np.mean(x))),
    "highest": (lambda x: float(np.max(x)), lambda x: int(np.argmax(x))),
    "lowest": (lambda x: float(np.min(x)), lambda x: int(np.argmin(x))),
    "final": (lambda x: float(x[-1]), lambda x: len(x) - 1),
}
NAMES = (*_STATISTICS, "share", "nees", "settling_time", "finite")


def reduced(name: str, values: np.ndarray) -> Reduced:
    """rmse, max and p95 (of the magnitude), mean, std, highest, lowest or final of values (n,)."""
    number, row = _STATISTICS[name]
    return Reduced(number(values), row(values))


def share(holds: np.ndarray) -> Reduced:
    """Part of the rows (n,) in which a condition holds."""
    return Reduced(float(np.mean(holds)), int(np.argmax(holds)))


def nees(error: np.ndarray, sigma: np.ndarray) -> Reduced:
    """Mean of squared error over variance, (n,) each: 1 where sigma is the standard deviation of the error."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(error == 0, 0.0, (error / sigma) ** 2)
    return Reduced(float(np.mean(ratio)), int(np.argmax(ratio)))


def settling_time(time: np.ndarray, values: np.ndarray, band: float) -> Reduced:
    """Time (s) from the first row to that from which on the magnitude of values (n,) stays within the band.

    Infinite where it is outside in the last row.
    """
    outside = np.flatnonzero(~(np.abs(values) <= band))
    if not outside.size:
        return Reduced(0.0, 0)
    last = int(outside[-1])
    settled = last + 1 < len(time)
    return Reduced(float(time[last + 1] - time[0]) if settled else np.inf, last)


def within(time: np.ndarray, robustness: np.ndarray, seconds: float) -> np.ndarray:
    """Greatest robustness (n,) from each row to ``seconds`` later; time: (n,), evenly spaced."""
    if len(time) < 2:
        return robustness
    ahead = int(np.floor(seconds / float(np.median(np.diff(time))) + 1e-6))
    if ahead >= len(time):
        return np.maximum.accumulate(robustness[::-1])[::-1]
    size = ahead + 1
    # Moved from around a row to the row and those after it.
    return np.asarray(maximum_filter1d(robustness, size, origin=-(size // 2), mode="constant", cval=-np.inf))
