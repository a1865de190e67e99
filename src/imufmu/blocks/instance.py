"""A block at work: flat buffers, time, state. The FMU adapters and the streaming object stand on it.

Times are seconds. A sampled block processes every instant t_k = start_time + k sample_period in [t, t + h) of a step
(t, h) with the inputs in force and holds its outputs between; k is a whole number. A continuous block integrates over
[t, t + h] with the inputs held and reports its outputs at the end, with the inputs in force there.

The clock of a sampled block counts samples, not seconds: a step that begins where the last one ended, as far as times
are told apart there, goes on from there by h / sample_period samples. So a start at 1.7e9 s, where a double moves on in
steps of 0.2 us, gives the samples of a start at 0.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from .block import Block, ContinuousBlock, ParameterError, SampledBlock
from .noise import draws
from .signals import total_size

CLOCK_TOLERANCE = 1e-6  # of a sample: a step that ends this little after an instant does not contain it
TIME_ROUNDING = 2.0**-50  # of a time, relative: what two ways to compute it may differ by
LONGEST_STEP = 10**6  # samples or solver steps in one step; more is taken for a wrong unit or a broken time
_DRAWS_AHEAD = 256  # samples whose noise is drawn in one go


class StepError(ValueError):
    """An impossible step; nothing has changed."""


class StateError(ValueError):
    """A saved state that is not one of this block, or is not as it was saved; nothing has changed."""


def buffered(function: Any, arguments: tuple[np.ndarray, ...], results: tuple[np.ndarray, ...]) -> Callable[[], None]:
    """Evaluate a CasADi Function from and into fixed arrays, without allocation."""
    buffer, trigger = function.buffer()
    for i, array in enumerate(arguments):
        buffer.set_arg(i, array.data)
    for i, array in enumerate(results):
        buffer.set_res(i, array.data)

    def evaluate(_keep_alive: tuple = (function, buffer, arguments, results)) -> None:
        trigger()

    return evaluate


class Instance:
    """Buffers of one block (flat, float64): inputs ``u``, parameters ``p``, state ``x``, reported signals ``y``.

    u, p and y are parts of ``values``, which holds every variable in the order of ``block.variables``.
    """

    def __init__(self, block: Block) -> None:
        self.block = block
        inputs, parameters = block.start_vector(block.inputs), block.start_vector(block.parameters)
        self.values = np.concatenate([inputs, parameters, np.zeros(total_size(block.reported))])
        self.u, self.p, self.y = np.split(self.values, [len(inputs), len(inputs) + len(parameters)])
        self.x = np.zeros(total_size(block.held_state))
        self.start_time = 0.0
        self._input_bounds = [block.bounds_of(signal) for signal in block.inputs for _ in range(signal.size)]

    def initialise(self, start_time: float) -> None:
        """Check the parameters, compute the initial state and outputs. Raises ParameterError."""
        problems = self.block.parameter_problems(self.p)
        if not math.isfinite(start_time):
            problems.append(f"start time {start_time} is not a time")
        if problems:
            raise ParameterError(f"{self.block.name}: " + "; ".join(problems))
        self.start_time = start_time

    def missing_inputs(self) -> list[str]:
        """Names of the inputs that count as missing."""
        bounded = zip(self.block.variables, self.u.tolist(), self._input_bounds, strict=False)
        return [variable.name for variable, value, (least, largest) in bounded if not least <= value <= largest]

    def do_step(self, t: float, h: float) -> None:
        """Step from t to t + h. Raises StepError, state unchanged, if that is impossible."""
        raise StepError(f"{self.block.name} has no step")

    def _check_step(self, t: float, h: float, period: float) -> None:
        if not (math.isfinite(t) and math.isfinite(h) and h > 0):
            raise StepError(
                f"{self.block.name}: cannot step from t = {t:.15g} s by h = {h:.15g} s; h must be positive and finite"
            )
        if h / period > LONGEST_STEP:
            raise StepError(f"{self.block.name}: a step of h = {h:.15g} s is more than {LONGEST_STEP:g} internal steps")

    def get_state(self) -> dict[str, Any]:
        """Everything that determines the future, as JSON-able values; floats survive bit for bit."""
        content = self._content()
        return content | {"digest": _digest(content)}

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Return to a state from ``get_state`` of an instance of the same block. Raises StateError."""
        expected = self._content()
        content = {name: state[name] for name in expected if name in state}
        fits = content.keys() == expected.keys() and all(_alike(content[name], expected[name]) for name in expected)
        if not fits or state.get("digest") != _digest(content):
            raise StateError(f"{self.block.name}: not a state of this block, or changed since it was saved")
        self._restore(content)

    def _content(self) -> dict[str, Any]:
        return {
            "block": self.block.name,
            "values": self.values.tolist(),
            "x": self.x.tolist(),
            "start_time": float(self.start_time),
        }

    def _restore(self, content: Mapping[str, Any]) -> None:
        self.values[:] = content["values"]
        self.x[:] = content["x"]
        self.start_time = content["start_time"]


def _alike(value: Any, other: Any) -> bool:
    """Whether a value can stand for another: numbers for numbers, as many of them; a word for itself."""
    if isinstance(other, list):
        return isinstance(value, list) and len(value) == len(other) and all(isinstance(v, int | float) for v in value)
    return value == other if isinstance(other, str) else isinstance(value, int | float)


def _digest(content: Mapping[str, Any]) -> str:
    """Of every bit of a state: -0.0 is not 0.0."""
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:32]


class SampledInstance(Instance):
    """A sampled block with its sample clock."""

    block: SampledBlock

    def __init__(self, block: SampledBlock) -> None:
        super().__init__(block)
        self.next_sample = 0
        self._reached = 0.0  # s, end of the last step
        self._ahead = 0.0  # samples by which that end is past the instant of the next sample
        self._w = np.full(block.normals, 0.5)
        self._draws = np.zeros((0, block.normals))
        self._draws_from: tuple[list[tuple[float, int]], int] = ([], 0)  # streams and first sample of those at hand
        self._x_next = np.zeros_like(self.x)
        self._first = buffered(block.first_function, (self.u, self.p, self._w), (self._x_next, self.y))
        self._next = buffered(block.next_function, (self.x, self.u, self.p, self._w), (self._x_next, self.y))
        names = [v.name for v in block.variables if v.group == "parameter"]
        self._period_at = names.index("sample_period")
        self._delay_at = block.place_of(block.delayed_by) if block.delayed_by else None

    @property
    def sample_period(self) -> float:
        return float(self.p[self._period_at])

    @property
    def sample_time(self) -> float:
        """Instant of the sample that the outputs belong to (s); the start time before the first."""
        delay = float(self.y[self._delay_at]) if self._delay_at is not None else 0.0
        return self.start_time + (max(self.next_sample - 1, 0) * self.sample_period - delay)

    def initialise(self, start_time: float) -> None:
        super().initialise(start_time)
        self.next_sample = 0
        self._reached, self._ahead = start_time, 0.0
        self.refresh()

    def refresh(self) -> None:
        """Outputs as of the first sample if it were taken now; nothing once it was taken."""
        if self.next_sample == 0:
            self._draw(0)
            self._first()

    def sample(self) -> None:
        """Take the next sample with the inputs in force."""
        self._draw(self.next_sample)
        if self.next_sample == 0:
            self._first()
        else:
            self._next()
        self.x[:] = self._x_next
        self.next_sample += 1

    def do_step(self, t: float, h: float) -> None:
        period = self.sample_period
        self._check_step(t, h, period)
        ahead = self._ahead_at(t) + h / period
        if not abs(ahead) <= LONGEST_STEP:
            raise StepError(f"{self.block.name}: t = {t:.15g} s lies more than {LONGEST_STEP:g} samples away")
        before = self._content() if self.block.has_solver else None
        due = max(0, math.ceil(ahead - CLOCK_TOLERANCE))
        for _ in range(due):
            self.sample()
        self._reached, self._ahead = t + h, ahead - due
        if before and not np.isfinite(self.y).all():
            self._restore(before)
            raise StepError(chain_diverged(self.block, t + h, period))

    def _ahead_at(self, t: float) -> float:
        """Samples by which t (s) is past the instant of the next sample."""
        rounding = TIME_ROUNDING * max(abs(t), abs(self.start_time))
        if abs(t - self._reached) <= rounding:
            return self._ahead
        ahead = (t - self.start_time) / self.sample_period - self.next_sample
        whole = float(np.floor(ahead + 0.5))
        return whole if abs(ahead - whole) * self.sample_period <= rounding else ahead

    def _draw(self, k: int) -> None:
        if not self.block.normals:
            return
        streams, first = [(self.p[at], width) for at, width in self.block.seeds_at], k - k % _DRAWS_AHEAD
        if self._draws_from != (streams, first):
            self._draws = draws(streams, first, _DRAWS_AHEAD)
            self._draws_from = (streams, first)
        self._w[:] = self._draws[k - first]

    def _content(self) -> dict[str, Any]:
        clock = {"next_sample": self.next_sample, "reached": float(self._reached), "ahead": float(self._ahead)}
        return super()._content() | clock

    def _restore(self, content: Mapping[str, Any]) -> None:
        super()._restore(content)
        self.next_sample, self._reached, self._ahead = content["next_sample"], content["reached"], content["ahead"]


class ContinuousInstance(Instance):
    """A continuous block with its solver."""

    block: ContinuousBlock

    def __init__(self, block: ContinuousBlock) -> None:
        super().__init__(block)
        self._t = np.zeros(1)
        self._solver_t, self._solver_h = np.zeros(1), np.zeros(1)
        self._x_next = np.zeros_like(self.x)
        self._w = np.full(block.normals, 0.5)
        self._initial = buffered(block.initial_function, (self.p, self._w), (self.x,))
        arguments = (self.x, self.u, self.p, self._solver_t, self._solver_h)
        self._advance = buffered(block.advance_function, arguments, (self._x_next,))
        self._output = buffered(block.output_function, (self.x, self.u, self.p, self._t), (self.y,))
        names = [v.name for v in block.variables if v.group == "parameter"]
        self._max_step_at = names.index("max_step")

    @property
    def time(self) -> float:
        return float(self._t[0])

    def initialise(self, start_time: float) -> None:
        super().initialise(start_time)
        self._t[0] = start_time
        self._w[:] = draws([(self.p[at], width) for at, width in self.block.seeds_at], 0, 1)[0]
        self._initial()
        self.refresh()

    def refresh(self) -> None:
        """Outputs at the present time with the inputs in force."""
        self._output()

    def do_step(self, t: float, h: float) -> None:
        max_step = self.p[self._max_step_at]
        self._check_step(t, h, max_step)
        substeps = solver_steps(h, max_step)
        self._solver_h[0] = h / substeps
        before, time_before = self.x.copy(), self.time
        for i in range(substeps):
            self._solver_t[0] = t + i * (h / substeps)
            self._advance()
            self.x[:] = self._x_next
        self._t[0] = t + h
        self.refresh()
        if not (np.isfinite(self.y).all() and np.isfinite(self.x).all()):
            self.x[:], self._t[0] = before, time_before
            self.refresh()
            raise StepError(diverged(self.block, t + h, max_step))

    def _content(self) -> dict[str, Any]:
        return super()._content() | {"time": self.time}

    def _restore(self, content: Mapping[str, Any]) -> None:
        super()._restore(content)
        self._t[0] = content["time"]


def solver_steps(h: float, max_step: float) -> int:
    """Number of equal solver steps, none longer than max_step (up to rounding), that make one step of h (s)."""
    return max(1, math.ceil(h / max_step - 1e-9))


def diverged(block: Block, t: float, max_step: float) -> str:
    """Message for a solution that is not finite any more at t (s)."""
    needs = f"the solver needs a max_step below {max_step:g} s, or calmer inputs"
    return f"{block.name}: not finite at t = {t:.15g} s; {needs}"


def chain_diverged(block: Block, t: float, sample_period: float) -> str:
    """Message for a series whose plant's solution is not finite any more at t (s)."""
    needs = f"its plant needs a sample_period below {sample_period:g} s, or calmer inputs"
    return f"{block.name}: not finite at t = {t:.15g} s; {needs}"


def instantiate(block: Block) -> SampledInstance | ContinuousInstance:
    """The instance class that fits the block."""
    if isinstance(block, SampledBlock):
        return SampledInstance(block)
    assert isinstance(block, ContinuousBlock)
    return ContinuousInstance(block)
