"""Run blocks in this process: a whole record in one call, or sample by sample."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from .block import Block, ContinuousBlock, SampledBlock
from .columns import Columns, Tabular, element_names
from .instance import LONGEST_STEP, SampledInstance, StepError, chain_diverged, diverged, solver_steps
from .noise import draws
from .signals import Signal, State, total_size

_CHUNK = 1024  # steps evaluated by one call into CasADi, at most
_PORTION = 64 * _CHUNK  # samples whose noise is drawn at a time


@dataclass(frozen=True)
class Trajectory(Tabular):
    """Signals over time. time: (n,), s. values: by signal name, (n,), (n, 3) or (n, 3, 3), in the signal's unit.

    units: by signal name, where they are known.
    """

    time: np.ndarray
    values: Mapping[str, np.ndarray]
    units: Mapping[str, str | None] = field(default_factory=dict)

    def __getitem__(self, name: str) -> np.ndarray:
        return self.values[name]

    def __repr__(self) -> str:
        return f"<Trajectory of {len(self.time)} rows: {', '.join(self.values)}>"

    def _table(self) -> Columns:
        columns = {name: element_names(name, values.shape[1:]) for name, values in self.values.items()}
        return Columns("trajectory", self.time, self.values, columns, self.units)


# (block, state behind a sample, u, p, w of the samples that follow) -> (state behind the last one, y)
Following = Callable[[SampledBlock, np.ndarray, np.ndarray, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
# (block, state at the start, u, p, time (s) of all rows, step (s), solver steps in it) -> (states, y) of all rows
Solved = Callable[
    [ContinuousBlock, np.ndarray, np.ndarray, np.ndarray, np.ndarray, float, int], tuple[np.ndarray, np.ndarray]
]


def interpreted(
    block: SampledBlock, x: np.ndarray, u: np.ndarray, p: np.ndarray, w: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Samples in a row by CasADi's interpreter: state behind the last one, and the reported signals of each."""
    n, size = len(u), min(_CHUNK, 1 << (len(u) - 1).bit_length()) if len(u) else 1
    chunk, p_columns = _chunk(block.next_function, size), np.tile(p[:, None], size)
    y = np.empty((n, total_size(block.reported)))
    for first in range(0, n, size):
        some = slice(first, min(first + size, n))
        states, rows = chunk(x, _padded(u[some], size), p_columns, _padded(w[some], size))
        x = states[:, some.stop - first - 1].full().ravel()
        y[some] = rows.full().T[: some.stop - first]
    return x, y


def solved_by_interpreter(
    block: ContinuousBlock, x: np.ndarray, u: np.ndarray, p: np.ndarray, time: np.ndarray, step: float, per_row: int
) -> tuple[np.ndarray, np.ndarray]:
    """Solver steps in a row by CasADi's interpreter: states and reported signals at ``time``."""
    n, h = len(time) - 1, step / per_row
    states = np.empty((n + 1, len(x)))
    states[0] = x
    t = (time[:-1, None] + np.arange(per_row) * h).reshape(-1, 1)
    u_held = np.repeat(u[:-1], per_row, axis=0)
    chunk, p_columns, h_columns = (
        _chunk(block.advance_function, _CHUNK),
        np.tile(p[:, None], _CHUNK),
        np.full((1, _CHUNK), h),
    )
    for first in range(0, len(t), _CHUNK):
        some = slice(first, min(first + _CHUNK, len(t)))
        reached = chunk(x, _padded(u_held[some], _CHUNK), p_columns, _padded(t[some], _CHUNK), h_columns).full().T
        x = reached[some.stop - first - 1]
        done = np.arange(some.start + 1, some.stop + 1)  # solver steps behind us after each column
        whole = done % per_row == 0
        states[done[whole] // per_row] = reached[: len(done)][whole]
    p_columns = np.tile(p[:, None], n + 1)
    return states, block.output_function.map(n + 1)(states.T, u.T, p_columns, reached_at(time, step)[None, :]).full().T


def run(
    block: SampledBlock,
    inputs: Mapping[str, Any],
    parameters: Mapping[str, Any] | None = None,
    *,
    initial_state: Mapping[str, Any] | None = None,
    start_time: float = 0.0,
    following: Following = interpreted,
) -> Trajectory:
    """Run a sampled block over a record, one row per sample.

    inputs: array (n,) or (n, k) per input name; a missing name stays at its start value. NaN marks missing samples.
    parameters: values by name. initial_state: replaces the block's own state of that name after the first sample.
    following: evaluates all samples behind the first; by default ``interpreted``. What a block tells late has a signal
    ``sample_time`` (s), too: the instant that each row belongs to.
    Raises ParameterError for parameters, ValueError for inputs that do not fit, StepError where the plant of a series
    diverges.
    """
    u = input_rows(block, inputs)
    p = block.parameter_vector(parameters)
    n = len(u)
    streams = _streams(block, p)
    w = draws(streams, 0, 1)[0]
    x, y0 = (part.full().ravel() for part in block.first_function(u[0], p, w))
    if initial_state:
        _replace(x, block.held_state, initial_state)
        own = total_size(block.state)
        y0 = block.output_function(x[:own], u[0], p, w).full().ravel()
    y = np.empty((n, len(y0)))
    y[0] = y0
    for first in range(1, n, _PORTION):
        some = slice(first, min(first + _PORTION, n))
        x, y[some] = following(block, x, u[some], p, draws(streams, first, some.stop - first))
    period = p[_names(block).index("sample_period")]
    since_start = np.arange(n) * period
    time = start_time + since_start
    if block.has_solver and not np.isfinite(y).all():
        raise StepError(chain_diverged(block, time[np.argmin(np.isfinite(y).all(axis=1))], period))
    values = by_name(block.reported, y)
    units: dict[str, str | None] = {signal.name: signal.unit for signal in block.reported}
    if block.delayed_by:
        values["sample_time"], units["sample_time"] = start_time + (since_start - values[block.delayed_by]), "s"
    return Trajectory(time, values, units)


def simulate(
    block: ContinuousBlock,
    duration: float,
    step: float,
    inputs: Mapping[str, Any] | None = None,
    parameters: Mapping[str, Any] | None = None,
    *,
    start_time: float = 0.0,
    solved: Solved = solved_by_interpreter,
) -> Trajectory:
    """Run a continuous block over ``duration`` (s) with outputs every ``step`` (s), the first at the start.

    inputs: array (n + 1,) or (n + 1, k) per input name, n = round(duration / step), row i held from i * step on; or one
    value for the whole run. solved: the solver; by default ``solved_by_interpreter``. Raises ParameterError and
    ValueError as ``run``, StepError where the solution diverges.
    """
    if not (0 < step < np.inf and 0.5 * step < duration < np.inf):
        raise ValueError(f"duration {duration} s must be finite and at least one step of {step} s")
    n = round(duration / step)
    u = input_rows(block, inputs or {}, n + 1)
    p = block.parameter_vector(parameters)
    per_row = solver_steps(step, p[_names(block).index("max_step")])
    if per_row > LONGEST_STEP:
        raise ValueError(f"{block.name}: a step of {step} s is more than {LONGEST_STEP:g} internal steps")
    time = start_time + np.arange(n + 1) * step
    x = block.initial_function(p, draws(_streams(block, p), 0, 1)[0]).full().ravel()
    states, y = solved(block, x, u, p, time, step, per_row)
    bad = np.flatnonzero(~np.isfinite(np.hstack([y, states])).all(axis=1))
    if bad.size:
        raise StepError(diverged(block, time[bad[0]], p[_names(block).index("max_step")]))
    return Trajectory(time, by_name(block.reported, y), {signal.name: signal.unit for signal in block.reported})


class Stream:
    """A sampled block fed sample by sample.

        tilt = Stream(lee2012.BLOCK, {"sample_period": 0.01})
        out = tilt.update(gyro=(0, 0, 0.1), accel=(0, 0, 9.8))
        out["roll"]

    Raises ParameterError for parameters out of bounds.
    """

    def __init__(
        self, block: SampledBlock, parameters: Mapping[str, Any] | None = None, start_time: float = 0.0
    ) -> None:
        self._instance = SampledInstance(block)
        self._instance.p[:] = block.parameter_vector(parameters)
        self._instance.initialise(start_time)
        self._inputs, first = {}, 0
        for signal in block.inputs:
            self._inputs[signal.name] = slice(first, first + signal.size)
            first += signal.size

    def update(self, **inputs: Any) -> dict[str, Any]:
        """Take the next sample. Returns float or array by signal name, and ``sample_time`` (s).

        Inputs not given keep their value. Raises ValueError for an unknown input or a wrong size.
        """
        for name, value in inputs.items():
            if name not in self._inputs:
                raise ValueError(f"{self._instance.block.name} has no input {name!r}; it has {', '.join(self._inputs)}")
            flat = _numbers(name, value).reshape(-1)
            part = self._inputs[name]
            if flat.size != part.stop - part.start:
                raise ValueError(f"{name}: {flat.size} values, expected {part.stop - part.start}")
            self._instance.u[part] = flat
        self._instance.sample()
        values = by_name(self._instance.block.reported, self._instance.y[None, :].copy())
        result: dict[str, Any] = {name: value[0] for name, value in values.items()}
        return result | {"sample_time": self._instance.sample_time}


def reached_at(time: np.ndarray, step: float) -> np.ndarray:
    """Time of each row as an instance has it, t + h behind a step, to the last bit (s)."""
    return np.append(time[0], time[:-1] + step)


@lru_cache(maxsize=64)
def _chunk(function: Any, size: int) -> Any:
    """The function applied so many times, its first argument accumulated."""
    return function.mapaccum(size)


def _padded(rows: np.ndarray, size: int) -> np.ndarray:
    """Rows as so many columns, the last one repeated."""
    return np.pad(rows, ((0, size - len(rows)), (0, 0)), mode="edge").T


def _streams(block: Block, p: np.ndarray) -> list[tuple[float, int]]:
    return [(p[at], width) for at, width in block.seeds_at]


def _names(block: Block) -> list[str]:
    return [v.name for v in block.variables if v.group == "parameter"]


def input_rows(block: Block, inputs: Mapping[str, Any], length: int | None = None) -> np.ndarray:
    """Inputs as rows (n, size of all inputs); n is ``length``, or that of the longest input."""
    unknown = set(inputs) - {signal.name for signal in block.inputs}
    if unknown:
        known = ", ".join(signal.name for signal in block.inputs)
        raise ValueError(f"{block.name} has no input {', '.join(sorted(unknown))}; it has {known}")
    arrays = {name: _numbers(name, value) for name, value in inputs.items()}
    shapes = {signal.name: signal.shape for signal in block.inputs}
    lengths = [len(a) for name, a in arrays.items() if a.ndim and a.shape != shapes[name]]  # the others are constant
    n = length if length is not None else max(lengths, default=0)
    if n == 0:
        raise ValueError(f"{block.name}: no samples given")
    columns = []
    for signal in block.inputs:
        value = arrays.get(signal.name, np.array(signal.start_values()).reshape(signal.shape))
        if value.shape == signal.shape:
            value = np.broadcast_to(value.reshape(-1), (n, signal.size))
        if value.size != n * signal.size or len(value) != n:
            raise ValueError(f"{signal.name}: shape {value.shape}, expected {(n, *signal.shape)}")
        columns.append(value.reshape(n, signal.size))
    return np.hstack(columns) if columns else np.zeros((n, 0))


def _numbers(name: str, value: Any) -> np.ndarray:
    try:
        return np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"{name}: not an array of numbers, or its rows differ in length") from None


def by_name(signals: Sequence[Signal], rows: np.ndarray) -> dict[str, np.ndarray]:
    result, first = {}, 0
    for signal in signals:
        result[signal.name] = rows[:, first : first + signal.size].reshape(len(rows), *signal.shape)
        first += signal.size
    return result


def _replace(x: np.ndarray, items: Sequence[State], values: Mapping[str, Any]) -> None:
    unknown = set(values) - {item.name for item in items}
    if unknown:
        raise ValueError(f"no state {', '.join(sorted(unknown))}; there is {', '.join(item.name for item in items)}")
    first = 0
    for item in items:
        if item.name in values:
            value = _numbers(item.name, values[item.name])
            if value.size not in (1, item.size):
                raise ValueError(f"state {item.name}: {value.size} values, expected {item.size}")
            x[first : first + item.size] = value.ravel()
        first += item.size
