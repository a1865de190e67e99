"""``plumb`` over a whole record: forward, then back with what came later."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ..blocks.rotations import multiply, over_rows, quaternion_from_rotation_vector, rotate_back
from ..blocks.running import by_name, input_rows
from ..blocks.vocabulary import Status
from ..estimators.plumb import block_end
from ..estimators.plumb.record import AT_ENDS, RECORDING
from ..estimators.plumb.smoother import along, smoothed, tilt_std
from .rows import following

_PORTION = 8192  # rows that are known in full at a time; of the others what stands at the ends of blocks

Rows = Mapping[str, np.ndarray]


def run_smoothed(
    inputs: Mapping[str, Any], parameters: Mapping[str, Any] | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time (s), vertical (n, 3) and tilt_std (rad) of every sample."""
    pieces = [_smoothed_piece(piece) for piece in blocks(inputs, parameters)]
    p = RECORDING.parameter_vector(parameters)
    period = p[[signal.name for signal in RECORDING.parameters].index("sample_period")]
    vertical, deviation = (np.concatenate(parts) for parts in zip(*pieces, strict=True))
    return np.arange(len(vertical)) * period, vertical, deviation


def blocks(inputs: Mapping[str, Any], parameters: Mapping[str, Any] | None) -> Iterator[Rows]:
    """What RECORDING tells, apart for every stretch without a restart.

    AT_ENDS of the rows that end a block; the rest, with ``ends``, 1 for these, and ``tilt_variance`` of all.
    """
    return _pieces(input_rows(RECORDING, inputs), RECORDING.parameter_vector(parameters))


def _pieces(u: np.ndarray, p: np.ndarray) -> Iterator[Rows]:
    """What RECORDING tells, apart for every stretch without a restart: of all rows, or of those that end a block."""
    told: list[Rows] = []
    for rows in _portions(u, p):
        restarts = np.flatnonzero(rows["status"].astype(int) & int(Status.RESTARTED))
        for first, last in zip([0, *restarts], [*restarts, len(rows["status"])], strict=True):
            if first in restarts and told:
                yield _joined(told)
                told = []
            if last > first:
                told.append(_of_interest({name: values[first:last] for name, values in rows.items()}))
    yield _joined(told)


def _portions(u: np.ndarray, p: np.ndarray) -> Iterator[Rows]:
    nothing = np.zeros((len(u), 0))
    x, y = (part.full().ravel() for part in RECORDING.first_function(u[0], p, nothing[0]))
    yield by_name(RECORDING.reported, y[None, :])
    for first in range(1, len(u), _PORTION):
        some = slice(first, first + _PORTION)
        x, rows = following(RECORDING, x, u[some], p, nothing[some])
        yield by_name(RECORDING.reported, rows)


def _of_interest(rows: Rows) -> Rows:
    """All of what every sample changes, and the rest where a block ends."""
    ends = (rows["started"] > 0) & (rows["samples"] == 0)
    P = rows["P"]
    kept = {name: values[ends] if name in AT_ENDS else values.copy() for name, values in rows.items()}
    return kept | {"ends": ends, "tilt_variance": P[:, 0] + P[:, block_end.N_ERRORS]}


def _joined(told: list[Rows]) -> Rows:
    return {name: np.concatenate([rows[name] for rows in told]) for name in told[0]}


def _smoothed_piece(rows: Rows) -> tuple[np.ndarray, np.ndarray]:
    """Vertical (n, 3) and tilt_std (n,)."""
    q, n, ends = rows["q"], len(rows["q"]), np.flatnonzero(rows["ends"])
    psi, variance = np.zeros((n, 3)), rows["tilt_variance"]
    if len(ends):
        coarse = {"coarse": rows["coarse"][ends]}
        result = smoothed({name: rows[name] for name in AT_ENDS} | coarse)
        psi = along(result.before, result.after, ends, n)
        tilt = (result.P[:, 0, 0] + result.P[:, 1, 1])[:, None]
        variance = along(tilt, tilt, ends, n)[:, 0]
    up = over_rows(lambda psi, q: rotate_back(multiply(quaternion_from_rotation_vector(psi), q), block_end.UP), psi, q)
    return up, tilt_std(rows["tilt_std"], rows["tilt_variance"], variance, rows["coarse"])
