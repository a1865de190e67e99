"""Replay a recording through an estimator that sees all of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..blocks.block import SampledBlock
from ..compiled.offline import run_offline
from ..files.names import no_such
from ..recordings.checks import axes_doubts
from ..recordings.reading import Recording
from ..registry import ESTIMATORS
from .replay import VALID, Replay, in_axes_of
from .units import Unit, quantity


def replay_offline(recording: Recording, name: str, parameters: Mapping[str, Any] | None = None) -> Replay:
    """Readings of the recording through an estimator of imufmu that knows all of them for every row.

    parameters: by name; ``sample_period`` follows the recording. Raises ValueError for an estimator that cannot do so
    and for parameters that do not fit.
    """
    blocks = {block.name: block for block in ESTIMATORS if isinstance(block, SampledBlock)}
    if name not in blocks:
        raise ValueError(no_such("estimator", name, list(blocks), "an FMU runs forward only"))
    block, readings = blocks[name], recording.at_instants()
    given = {name: _in_unit(block, name, value) for name, value in (parameters or {}).items()}
    inputs = {signal.name: readings[signal.name] for signal in block.inputs if signal.name in readings}
    valid = {name + VALID: np.isfinite(rows).reshape(len(rows), -1).all(axis=1) for name, rows in inputs.items()}
    inputs |= {signal.name: valid[signal.name] for signal in block.inputs if signal.name in valid}
    found = run_offline(block, inputs, {**given, "sample_period": recording.sample_period})
    units = {signal.name: signal.unit for signal in block.outputs}
    columns: dict[str, np.ndarray] = {}
    for signal_name, values in found.values.items():
        rows = values[recording.sample_index]
        parts = {signal_name: rows} if rows.ndim == 1 else {f"{signal_name}[{i + 1}]": rows[:, i] for i in range(3)}
        columns |= parts
    notes = (*recording.notes, *axes_doubts(recording))
    of_columns = {column: units[column.split("[")[0]] for column in columns}
    return Replay(recording, name, in_axes_of(recording, columns, of_columns), of_columns, notes)


def _in_unit(block: SampledBlock, name: str, value: Any) -> Any:
    """A value that may be a text with its unit, such as "0.1 deg/s"."""
    units = {parameter.name: parameter.unit for parameter in block.parameters}
    if not isinstance(value, str) or name not in units:
        return value
    try:
        return quantity(value, Unit(units[name]))
    except ValueError as error:
        raise ValueError(f"{name} = {value}: {error}") from error
