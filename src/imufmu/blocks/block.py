"""What a block is: a declaration, and the CasADi Functions that everything else is derived from.

Two kinds. A **sampled** block (IMU, estimator) advances at multiples of its parameter ``sample_period``:

    initial(u, p) -> state        the first sample
    step(x, u, p) -> state        every further sample
    output(x, u, p) -> outputs and locals, after either

A sampled block with an output ``status`` never stays without finite numbers: where a step reports one that is not
finite, the sample counts as the first one, and ``status`` has the flag RESTARTED.

What is costly and rarely due (a covariance update, say) may stand apart, declared by both of

    slow_due(x, u, p) -> number       asked after every ``step``, with its result: which slow step is due; 0 none
    slow_steps                        1, 2, ...; each (x, u, p) -> state; really skipped where it is not due, in C too

A slow step returns the states that it changes; ``step`` then returns as many as it changes, the first ones declared.

A **continuous** block (plant) is integrated by RK4 with steps no longer than its parameter ``max_step``:

    initial(p) -> state
    dynamics(x, u, p, t) -> time derivative of the state
    output(x, u, p, t) -> outputs and locals

x, u, p are namespaces of CasADi SX expressions with the declared names and shapes; functions return dicts by name.

Inputs never carry NaN or infinity into the equations, and those of a block with a ``status`` nothing outside their
declared bounds, which no sensor reads. An input with such an element counts as missing: the block keeps the last vector
that was not (at first the start value). For an input ``gyro`` a sampled block sees

    u.gyro            this sample, or the last one that was not missing
    u.gyro_previous   the same, one sample ago
    u.gyro_missing    1 where this sample is missing, else 0

``u.normal`` holds the standard normal draws of this sample, where a sampled block declares any. A continuous block has
draws at its start only: ``p.normal`` in ``initial``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import SimpleNamespace
from typing import Any, Literal

import casadi as ca
import numpy as np

from . import vocabulary
from .expressions import all_of, function, is_finite, is_within, namespace, shaped
from .noise import standard_normal
from .parameter_values import ParameterError, flat_parameters, parameter_problems
from .restart import or_anew
from .signals import DeclarationError, Parameter, Signal, State, total_size
from .slow_parts import SlowParts, one_of

LARGEST_INPUT = 1e30  # larger magnitudes count as missing whatever is declared: powers of them would overflow

Expressions = Mapping[str, Any]


@dataclass(frozen=True)
class Variable:
    """One scalar variable of a block, in the order of every interface: inputs, parameters, outputs, locals."""

    name: str
    signal: Signal
    group: Literal["input", "parameter", "output", "local"]
    index: int  # position in the flat vector of its group
    start: float


@dataclass(frozen=True, kw_only=True)
class Block:
    """Common part of both kinds of block.

    doc: the text for its users. reference: the paper. when: when to use it, and what instead.
    """

    name: str
    summary: str
    doc: str
    reference: str
    inputs: tuple[Signal, ...]
    outputs: tuple[Signal, ...]
    locals: tuple[Signal, ...]
    own_parameters: tuple[Parameter, ...]
    state: tuple[State, ...]
    output: Callable[..., Expressions]
    when: str = ""
    normals: int = 0  # standard normal draws per sample, or at the start of a continuous block

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Every parameter: the framework's first."""
        return (*self._framework_parameters(), *self.own_parameters)

    def _framework_parameters(self) -> tuple[Parameter, ...]:
        raise DeclarationError(f"{self.name}: a block is a SampledBlock or a ContinuousBlock")

    @property
    def seeds(self) -> tuple[tuple[str, int], ...]:
        """Its streams of noise: the parameter that holds the seed, and the number of draws at a time."""
        return ((vocabulary.SEED.name, self.normals),) if self.normals else ()

    @cached_property
    def seeds_at(self) -> tuple[tuple[int, int], ...]:
        """``seeds`` by position in the flat parameter vector."""
        names = [variable.name for variable in self.variables if variable.group == "parameter"]
        return tuple((names.index(name), width) for name, width in self.seeds)

    @property
    def has_solver(self) -> bool:
        """Whether a plant is inside, whose solution may diverge: then what is reported need not be finite."""
        return False

    @property
    def has_status(self) -> bool:
        """Whether it can say that an input is missing, or that it began anew."""
        return vocabulary.STATUS.name in (signal.name for signal in self.outputs)

    @property
    def reported(self) -> tuple[Signal, ...]:
        """Every signal the block reports: outputs, then locals."""
        return (*self.outputs, *self.locals)

    def place_of(self, name: str) -> int:
        """Where a reported signal begins in the vector of all of them."""
        return total_size(self.reported[: [signal.name for signal in self.reported].index(name)])

    @cached_property
    def variables(self) -> tuple[Variable, ...]:
        """The flat, scalar view of the block."""
        found: list[Variable] = []
        groups: tuple[tuple[Literal["input", "parameter", "output", "local"], tuple[Signal, ...]], ...] = (
            ("input", self.inputs),
            ("parameter", self.parameters),
            ("output", self.outputs),
            ("local", self.locals),
        )
        for group, signals in groups:
            elements = [(s, n, v) for s in signals for n, v in zip(s.element_names(), s.start_values(), strict=True)]
            # Locals follow the outputs in the vector of reported signals.
            shift = total_size(self.outputs) if group == "local" else 0
            found += [Variable(name, signal, group, shift + i, v) for i, (signal, name, v) in enumerate(elements)]
        names = [variable.name for variable in found]
        twice = {name for name in names if names.count(name) > 1}
        if twice:
            raise DeclarationError(f"{self.name}: declared twice: {', '.join(sorted(twice))}")
        return tuple(found)

    @cached_property
    def held_state(self) -> tuple[State, ...]:
        """The block's own state, then the last value of every input that was not missing."""
        return (*self.state, *(State(f"held_{s.name}", s.shape) for s in self.inputs))

    def start_vector(self, signals: Sequence[Signal]) -> np.ndarray:
        """Start values of the signals, flat."""
        return np.array([value for signal in signals for value in signal.start_values()])

    def parameter_vector(self, values: Mapping[str, Any] | None = None) -> np.ndarray:
        """Flat parameter vector from values by name: of a whole parameter (``mount``) or an element (``mount[2]``).

        Raises ParameterError naming every unknown name, wrong size and value out of bounds.
        """
        p, problems = flat_parameters(self.parameters, values or {}, self.name)
        problems += self.parameter_problems(p)
        if problems:
            raise ParameterError(f"{self.name}: " + "; ".join(problems))
        return p

    def parameter_problems(self, p: np.ndarray) -> list[str]:
        """One line per element of the flat parameter vector that is out of bounds or of the wrong kind."""
        return parameter_problems(self.parameters, p)

    def _symbols(self, name: str, items: Sequence[Signal | State]) -> Any:
        return ca.SX.sym(name, total_size(items))

    def _with_held_inputs(self, raw: Any, held: Any) -> tuple[SimpleNamespace, list[Any]]:
        """Namespace of inputs without those that are missing, and their flat values for the next step."""
        u, values, first = SimpleNamespace(), [], 0
        for signal in self.inputs:
            part = slice(first, first + signal.size)
            there = all_of(is_within(raw[part], *self.bounds_of(signal)))
            value = ca.if_else(there, raw[part], held[part])
            setattr(u, signal.name, shaped(value, signal.shape))
            setattr(u, f"{signal.name}_previous", shaped(held[part], signal.shape))
            setattr(u, f"{signal.name}_missing", 1 - there)
            values.append(value)
            first += signal.size
        return u, values

    def bounds_of(self, signal: Signal) -> tuple[float, float]:
        """Least and largest value of an input that do not make it count as missing."""
        if not self.has_status:
            return -LARGEST_INPUT, LARGEST_INPUT
        return max(signal.minimum, -LARGEST_INPUT), min(signal.maximum, LARGEST_INPUT)

    def _flatten(self, what: str, items: Sequence[Signal | State], values: Expressions) -> Any:
        """Flat column of the named expressions, checked against the declaration."""
        expected = {item.name for item in items}
        if set(values) != expected:
            raise DeclarationError(f"{self.name}.{what} must return {sorted(expected)}, returned {sorted(values)}")
        columns = []
        for item in items:
            value = ca.SX(values[item.name])
            if value.numel() != item.size or (len(item.shape) == 2 and value.shape != item.shape):
                raise DeclarationError(f"{self.name}.{what}: {item.name} has shape {value.shape}, not {item.shape}")
            columns.append(ca.vec(value.T) if len(item.shape) == 2 else ca.vec(value))
        return ca.densify(ca.vertcat(*columns))


@dataclass(frozen=True)
class SampledBlock(Block):
    """A block that advances at multiples of ``sample_period`` (default ``period``, s).

    delayed_by: the output that says how long before the sample (s) the instant lies that the outputs belong to.
    """

    initial: Callable[..., Expressions]
    step: Callable[..., Expressions]
    period: float = 0.01
    delayed_by: str = ""
    slow_due: Callable[..., Any] | None = None
    slow_steps: tuple[Callable[..., Expressions], ...] = ()

    def __post_init__(self) -> None:
        if (self.slow_due is None) != (not self.slow_steps):
            raise DeclarationError(f"{self.name}: declare both of slow_due and slow_steps, or neither")

    def _framework_parameters(self) -> tuple[Parameter, ...]:
        period = vocabulary.sample_period(self.period)
        return (period, vocabulary.SEED) if self.normals else (period,)

    @cached_property
    def first_function(self) -> Any:
        """CasADi Function (u, p, w) -> (x, y): the first sample; w are ``normals`` uniform draws."""
        u, p, w = self._arguments()
        held = self.start_vector(self.inputs)
        inputs, finite = self._inputs(u, ca.DM(held), w)
        x = self._flatten("initial", self.state, self.initial(inputs, namespace(self.parameters, p)))
        y = self._outputs(x, inputs, p)
        return function(f"{self.name}_first", [u, p, w], [ca.vertcat(x, *finite), y], ["u", "p", "w"], ["x", "y"])

    @cached_property
    def next_function(self) -> Any:
        """CasADi Function (x, u, p, w) -> (x, y): every further sample. It begins anew where it would not be finite."""
        return or_anew(self) if self.begins_anew else self.following_function

    @cached_property
    def following_function(self) -> Any:
        """CasADi Function (x, u, p, w) -> (x, y): every further sample, finite or not.

        One list of instructions (SX); with slow steps a graph (MX) of such lists, some of them behind a switch.
        """
        if self.slow_parts:
            return self.slow_parts.in_a_row(f"{self.name}_following")
        u, p, w = self._arguments()
        x_all = self._symbols("x", self.held_state)
        n = total_size(self.state)
        inputs, finite = self._inputs(u, x_all[n:], w)
        state = namespace(self.state, x_all[:n])
        x = self._flatten("step", self.state, self.step(state, inputs, namespace(self.parameters, p)))
        y = self._outputs(x, inputs, p)
        result = [ca.vertcat(x, *finite), y]
        return function(f"{self.name}_following", [x_all, u, p, w], result, ["x", "u", "p", "w"], ["x_next", "y"])

    @property
    def begins_anew(self) -> bool:
        """Whether a sample whose numbers are not finite counts as the first one: where the block can say so."""
        return self.has_status

    @cached_property
    def sound_function(self) -> Any:
        """CasADi Function (y) -> (1 where every number that a sample reports is finite, else 0)."""
        y = self._symbols("y", self.reported)
        return function(f"{self.name}_sound", [y], [is_finite(y)])

    @cached_property
    def slow_parts(self) -> SlowParts | None:
        """The parts of ``next_function`` of a block with slow steps, else None."""
        if self.slow_due is None:
            return None
        x, held = self._symbols("x", self.state), self._symbols("held", self.inputs)
        u, p, w = self._arguments()
        inputs, finite = self._inputs(u, held, w)
        parameters, before = namespace(self.parameters, p), namespace(self.state, x)
        stepped = self.step(before, inputs, parameters)
        fast = self._flatten("step", self.state[: len(stepped)], stepped)
        n = fast.numel()
        due = self.slow_due(namespace(self.state, ca.vertcat(fast, x[n:])), inputs, parameters)
        step = function(f"{self.name}_step", [ca.vertcat(x, held), u, p, w], [fast, ca.vertcat(*finite), due])

        def slow(number: int, slow_step: Callable[..., Expressions]) -> Any:
            changed = vars(before) | dict(slow_step(before, inputs, parameters))
            slowed = self._flatten(f"slow_steps[{number - 1}]", self.state, changed)
            return function(f"{self.name}_slow_step_{number}", [x, held, u, p, w], [slowed])

        choice = [slow(number, slow_step) for number, slow_step in enumerate(self.slow_steps, 1)]
        return SlowParts(step, one_of(f"{self.name}_slow", choice), self._report(x, held, u, p, w), tuple(choice))

    def _report(self, x: Any, held: Any, u: Any, p: Any, w: Any) -> Any:
        """Function ``report`` of SlowParts: it is given the inputs without those that are missing."""
        inputs, _ = self._inputs(u, held, w)
        given = self._symbols("given", self.inputs)
        vars(inputs).update(vars(namespace(self.inputs, given)))
        arguments = [ca.vertcat(x, given), held, u, p, w]
        return function(f"{self.name}_report", arguments, [self._outputs(x, inputs, p)])

    @cached_property
    def output_function(self) -> Any:
        """CasADi Function (x, u, p, w) -> (y): what a state that was just reached reports; x without held inputs."""
        u, p, w = self._arguments()
        x = self._symbols("x", self.state)
        inputs, _ = self._inputs(u, ca.DM(self.start_vector(self.inputs)), w)
        y = self._outputs(x, inputs, p)
        return function(f"{self.name}_output", [x, u, p, w], [y], ["x", "u", "p", "w"], ["y"])

    def _arguments(self) -> tuple[Any, Any, Any]:
        u, p = self._symbols("u", self.inputs), self._symbols("p", self.parameters)
        return u, p, ca.SX.sym("w", self.normals)

    def _inputs(self, u: Any, held: Any, w: Any) -> tuple[SimpleNamespace, list[Any]]:
        inputs, finite = self._with_held_inputs(u, held)
        if self.normals:
            inputs.normal = standard_normal(w)
        return inputs, finite

    def _outputs(self, x: Any, inputs: SimpleNamespace, p: Any) -> Any:
        parameters = namespace(self.parameters, p)
        return self._flatten("output", self.reported, self.output(namespace(self.state, x), inputs, parameters))


@dataclass(frozen=True)
class ContinuousBlock(Block):
    """A block integrated by RK4 with steps no longer than ``max_step`` (default ``longest_step``, s)."""

    initial: Callable[..., Expressions]
    dynamics: Callable[..., Expressions]
    longest_step: float = 1e-3

    def _framework_parameters(self) -> tuple[Parameter, ...]:
        max_step = vocabulary.max_step(self.longest_step)
        return (max_step, vocabulary.SEED) if self.normals else (max_step,)

    @property
    def has_solver(self) -> bool:
        return True

    @cached_property
    def initial_function(self) -> Any:
        """CasADi Function (p, w) -> (x); w are ``normals`` uniform draws."""
        p, w = self._symbols("p", self.parameters), ca.SX.sym("w", self.normals)
        parameters = namespace(self.parameters, p)
        if self.normals:
            parameters.normal = standard_normal(w)
        x = self._flatten("initial", self.state, self.initial(parameters))
        held = ca.DM(self.start_vector(self.inputs))
        return function(f"{self.name}_initial", [p, w], [ca.vertcat(x, held)], ["p", "w"], ["x"])

    @cached_property
    def advance_function(self) -> Any:
        """CasADi Function (x, u, p, t, h) -> (x): one RK4 step of h from t, inputs held."""
        x_all, u, p = self._vectors()
        t, h = ca.SX.sym("t"), ca.SX.sym("h")
        n = total_size(self.state)
        inputs, finite = self._with_held_inputs(u, x_all[n:])
        parameters = namespace(self.parameters, p)

        def slope(state: Any, time: Any) -> Any:
            derivative = self.dynamics(namespace(self.state, state), inputs, parameters, time)
            return self._flatten("dynamics", self.state, derivative)

        x = x_all[:n]
        k1 = slope(x, t)
        k2 = slope(x + h / 2 * k1, t + h / 2)
        k3 = slope(x + h / 2 * k2, t + h / 2)
        k4 = slope(x + h * k3, t + h)
        x_next = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        names = ["x", "u", "p", "t", "h"]
        return function(f"{self.name}_advance", [x_all, u, p, t, h], [ca.vertcat(x_next, *finite)], names, ["x_next"])

    @cached_property
    def output_function(self) -> Any:
        """CasADi Function (x, u, p, t) -> (y)."""
        x_all, u, p = self._vectors()
        t = ca.SX.sym("t")
        n = total_size(self.state)
        inputs, _ = self._with_held_inputs(u, x_all[n:])
        values = self.output(namespace(self.state, x_all[:n]), inputs, namespace(self.parameters, p), t)
        y = self._flatten("output", self.reported, values)
        return function(f"{self.name}_output", [x_all, u, p, t], [y], ["x", "u", "p", "t"], ["y"])

    def _vectors(self) -> tuple[Any, Any, Any]:
        return (
            self._symbols("x", self.held_state),
            self._symbols("u", self.inputs),
            self._symbols("p", self.parameters),
        )
