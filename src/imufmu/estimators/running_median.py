"""Median of five samples: centred, of a whole record, and of a stream as a CasADi expression.

A record has the median of sample k from samples k-2 to k+2. At its ends the window shrinks to the samples there are.
A stream knows that median two samples later: DELAY.
"""

from __future__ import annotations

from typing import Any, Literal

import casadi as ca
import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

WINDOW = 5  # samples
DELAY = WINDOW // 2  # samples from the centre of the window to its newest sample
_ABSENT = 1e31  # larger than any input that is not missing: sorts to the end


def centred_median(values: np.ndarray, edge: Literal["shrink", "zero"] = "shrink") -> np.ndarray:
    """Median of the five samples around each row.

    values: (n,) or (n, k), finite. edge: what the window has beyond the ends of the record: nothing, or zeros as in
    MATLAB's medfilt1. Returns an array of the same shape. Raises ValueError for another edge.
    """
    beyond = {"shrink": np.nan, "zero": 0.0}
    if edge not in beyond:
        raise ValueError(f"edge = {edge!r}; expected one of {', '.join(beyond)}")
    values = np.asarray(values, dtype=float)
    padding = [(DELAY, DELAY)] + [(0, 0)] * (values.ndim - 1)
    padded = np.pad(values, padding, constant_values=beyond[edge])
    return np.nanmedian(sliding_window_view(padded, WINDOW, axis=0), axis=-1)


def running_median(window: Any, taken: Any) -> Any:
    """Median (k, 1) of the newest rows of a stream, five of them as soon as there are five.

    From the third sample on it is the centred median as of DELAY samples ago.
    window: (WINDOW, k), newest row first. taken: samples so far, at least 1; older rows do not count.
    """
    rows = [ca.if_else(taken > i, row, _ABSENT) for i, row in enumerate(ca.vertsplit(window))]
    for last in range(WINDOW - 1, 0, -1):
        for i in range(last):
            rows[i], rows[i + 1] = ca.fmin(rows[i], rows[i + 1]), ca.fmax(rows[i], rows[i + 1])
    medians = [(rows[(n - 1) // 2] + rows[n // 2]) / 2 for n in range(1, WINDOW + 1)]  # of n rows
    result = medians[-1]
    for n, median in enumerate(medians[:-1], start=1):
        result = ca.if_else(taken == n, median, result)
    return result.T
