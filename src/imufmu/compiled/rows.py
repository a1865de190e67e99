"""Rows of a record by a compiled block, or by CasADi's interpreter where compiling does not pay."""

from __future__ import annotations

from ctypes import c_double, c_longlong

import numpy as np

from ..blocks import running
from ..blocks.block import ContinuousBlock, SampledBlock
from ..blocks.running import reached_at
from ..blocks.signals import total_size
from .library import compiled, pointer

_SOLVER_STEPS = 10**6  # in one call, which nothing interrupts


def following(
    block: SampledBlock, x: np.ndarray, u: np.ndarray, p: np.ndarray, w: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Samples in a row: state behind the last one, and the reported signals of each."""
    library = compiled(block).library(len(u))
    if library is None:
        return running.interpreted(block, x, u, p, w)
    x, u, w = x.copy(), np.ascontiguousarray(u), np.ascontiguousarray(w)
    y = np.empty((len(u), total_size(block.reported)))
    library.block_rows(c_longlong(len(u)), *map(pointer, (x, u, p, w, y)))
    return x, y


def solved(
    block: ContinuousBlock, x: np.ndarray, u: np.ndarray, p: np.ndarray, time: np.ndarray, step: float, per_row: int
) -> tuple[np.ndarray, np.ndarray]:
    """Solver steps in a row: states and reported signals at ``time`` (s)."""
    n = len(time) - 1
    library = compiled(block).library(n * per_row)
    if library is None:
        return running.solved_by_interpreter(block, x, u, p, time, step, per_row)
    u, time, reached = map(np.ascontiguousarray, (u, time, reached_at(time, step)))
    states, y = np.empty((n + 1, len(x))), np.empty((n + 1, total_size(block.reported)))
    states[0] = x
    h, rows = c_double(step / per_row), max(1, _SOLVER_STEPS // per_row)
    for first in range(0, n, rows):
        count, parts = min(rows, n - first), (states[first:], u[first:], p, time[first:])
        library.block_rows(c_longlong(count), c_longlong(per_row), *map(pointer, parts), h)
    library.block_outputs(c_longlong(n + 1), *map(pointer, (states, u, p, reached, y)))
    return states, y
