"""Blocks in series as one block: IMU and estimator (a smart sensor), or plant, IMU and estimator.

Each block's outputs feed the inputs of the same name of the blocks behind it, within one sample and without delay:
the numbers are those of the co-simulated chain. All sampled blocks share ``sample_period``. Other parameters and the
signals in between are named ``block.name``; the outputs are those of the last block. Where one block draws noise its
seed is ``seed``; where several do, each keeps its own as ``block.seed``.

A plant may stand first. It advances from sample to sample with its inputs held, in a fixed number of solver steps, and
its time counts from the first sample.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import casadi as ca

from . import vocabulary
from .block import Block, ContinuousBlock, Expressions, SampledBlock
from .instance import solver_steps
from .signals import DeclarationError, Parameter, Signal, State, total_size


def series(*blocks: Block) -> Series:
    """The blocks as one, signals flowing from left to right.

    Raises DeclarationError if they do not fit: fewer than two, a plant that is not the first, nothing to pass on, or
    inputs of one name and different units.
    """
    name = "_".join(block.name for block in blocks)
    _check(blocks)
    sampled = [block for block in blocks if isinstance(block, SampledBlock)]
    inputs, seen = [], set()
    for signal, _ in _open_inputs(blocks):
        if signal.name not in seen:
            inputs.append(signal)
            seen.add(signal.name)
    between = [
        replace(s, name=f"{block.name}.{s.name}")
        for block in blocks
        for s in (block.reported if block is not blocks[-1] else block.locals)
    ]
    parameters = [
        replace(p, name=f"{block.name}.{p.name}")
        for block in blocks
        for p in block.parameters
        if p.name not in ("sample_period", "max_step", "seed")
    ]
    size = sum(total_size(block.held_state) for block in blocks) + 1  # and the number of samples
    return Series(
        name=name,
        summary="In series: " + "; ".join(block.summary for block in blocks),
        doc=" ".join(" ".join(block.doc.split()) for block in blocks),
        reference=" ".join(dict.fromkeys(block.reference for block in blocks)),
        inputs=tuple(inputs),
        outputs=blocks[-1].outputs,
        locals=tuple(between),
        own_parameters=tuple(parameters),
        state=(State("chain", (size,)),),
        output=_nothing,
        initial=_nothing,
        step=_nothing,
        period=sampled[-1].period,
        delayed_by=sampled[-1].delayed_by,
        normals=sum(width for block in blocks for _, width in block.seeds),
        blocks=tuple(blocks),
    )


def _nothing(*_: Any) -> Expressions:
    raise DeclarationError("a series of blocks is made of their Functions")


def _check(blocks: Sequence[Block]) -> None:
    names = [block.name for block in blocks]
    faults = []
    if len(blocks) < 2:
        faults.append("needs at least two blocks")
    if len(set(names)) < len(names):
        faults.append("a block stands in it twice")
    if any(isinstance(block, ContinuousBlock) for block in blocks[1:]):
        faults.append("a plant can only stand first")
    if not any(isinstance(block, SampledBlock) for block in blocks):
        faults.append("has no sampled block")
    for i, block in enumerate(blocks[1:], 1):
        offered = {s.name: s for before in blocks[:i] for s in before.outputs}
        fed = [s for s in block.inputs if s.name in offered]
        if not fed:
            faults.append(f"nothing before {block.name} has an output {' or '.join(s.name for s in block.inputs)}")
        faults += [
            f"{block.name}.{s.name} is in {s.unit}, but fed in {offered[s.name].unit}"
            for s in fed
            if s.unit != offered[s.name].unit or s.shape != offered[s.name].shape
        ]
    if faults:
        raise DeclarationError(f"{'+'.join(names)}: {'; '.join(faults)}")


def _open_inputs(blocks: Sequence[Block]) -> list[tuple[Signal, Block]]:
    """Inputs that no block before feeds."""
    found, offered = [], set()
    for block in blocks:
        found += [(signal, block) for signal in block.inputs if signal.name not in offered]
        offered |= {signal.name for signal in block.outputs}
    return found


@dataclass(frozen=True)
class Series(SampledBlock):
    """A sampled block made of the Functions of ``blocks``."""

    blocks: tuple[Block, ...] = ()

    def _framework_parameters(self) -> tuple[Parameter, ...]:
        period = vocabulary.sample_period(self.period)
        plant = self.blocks[0]
        if isinstance(plant, ContinuousBlock):  # the solver's step must not grow beyond what the plant allows
            period = replace(period, maximum=self._solver_steps * plant.longest_step)
        return (period, *(replace(vocabulary.SEED, name=name) for name, _ in self.seeds))

    @property
    def begins_anew(self) -> bool:
        """Not as a whole: each of its blocks does so by itself."""
        return False

    def bounds_of(self, signal: Signal) -> tuple[float, float]:
        return next(block.bounds_of(given) for given, block in _open_inputs(self.blocks) if given.name == signal.name)

    @property
    def has_solver(self) -> bool:
        return isinstance(self.blocks[0], ContinuousBlock)

    @property
    def seeds(self) -> tuple[tuple[str, int], ...]:
        own = [(block.name, name, width) for block in self.blocks for name, width in block.seeds]
        return tuple((name if len(own) == 1 else f"{block}.{name}", width) for block, name, width in own)

    @property
    def _solver_steps(self) -> int:
        plant = self.blocks[0]
        assert isinstance(plant, ContinuousBlock)
        return solver_steps(self.period, plant.longest_step)

    @cached_property
    def first_function(self) -> Any:
        """CasADi Function (u, p, w) -> (x, y), as of any sampled block."""
        u, p, w = self._mx_arguments()

        def first(block: Block, inputs: Any, parameters: Any) -> tuple[Any, Any]:
            if isinstance(block, ContinuousBlock):
                x = block.initial_function(parameters, self._draws(block, w))
                return x, block.output_function(x, inputs, parameters, 0.0)
            assert isinstance(block, SampledBlock)
            return block.first_function(inputs, parameters, self._draws(block, w))

        x, y = self._chain(u, p, first)
        return ca.Function(
            f"{self.name}_first", [u, p, w], [ca.densify(ca.vertcat(*x, 1, u)), y], ["u", "p", "w"], ["x", "y"]
        )

    @cached_property
    def following_function(self) -> Any:
        """CasADi Function (x, u, p, w) -> (x, y), as of any sampled block."""
        u, p, w = self._mx_arguments()
        sizes = [total_size(block.held_state) for block in self.blocks]
        x_all = ca.MX.sym("x", sum(sizes) + 1 + u.numel())
        *states, samples, u_before = ca.vertsplit(x_all, [0, *_ends(sizes), sum(sizes) + 1, x_all.numel()])
        before = dict(zip((block.name for block in self.blocks), states, strict=True))

        def following(block: Block, inputs: Any, parameters: Any) -> tuple[Any, Any]:
            x = before[block.name]
            if isinstance(block, ContinuousBlock):
                period = p[0]
                x = self._advanced(
                    block, x, self._inputs_of(block, u_before), parameters, (samples - 1) * period, period
                )
                return x, block.output_function(x, inputs, parameters, (samples - 1) * period + period)
            assert isinstance(block, SampledBlock)
            return block.next_function(x, inputs, parameters, self._draws(block, w))

        x, y = self._chain(u, p, following)
        result = [ca.densify(ca.vertcat(*x, samples + 1, u)), y]
        return ca.Function(f"{self.name}_next", [x_all, u, p, w], result, ["x", "u", "p", "w"], ["x_next", "y"])

    def _mx_arguments(self) -> tuple[Any, Any, Any]:
        return (
            ca.MX.sym("u", total_size(self.inputs)),
            ca.MX.sym("p", total_size(self.parameters)),
            ca.MX.sym("w", self.normals),
        )

    def _chain(self, u: Any, p: Any, evaluate: Callable[[Block, Any, Any], tuple[Any, Any]]) -> tuple[list[Any], Any]:
        """States of all blocks, and the reported signals, when each is evaluated behind the ones before."""
        known = dict(zip((s.name for s in self.inputs), _split(u, self.inputs), strict=True))
        states, between = [], []
        outputs: Any = None
        for block in self.blocks:
            inputs = ca.vertcat(*(known[s.name] for s in block.inputs))
            x, y = evaluate(block, inputs, self._parameters_of(block, p))
            known |= dict(zip((s.name for s in block.outputs), _split(y, block.reported), strict=False))
            states.append(x)
            outputs, others = ca.vertsplit(y, [0, total_size(block.outputs), y.numel()])
            between.append(y if block is not self.blocks[-1] else others)
        return states, ca.vertcat(outputs, *between)

    def _parameters_of(self, block: Block, p: Any) -> Any:
        """The block's own flat parameters out of those of the series."""
        places = dict(zip((s.name for s in self.parameters), _split(p, self.parameters), strict=True))
        fixed = {"max_step": 1.0}  # not read: the number of solver steps is that of the series
        values = []
        for parameter in block.parameters:
            own = f"{block.name}.{parameter.name}"
            values.append(fixed.get(parameter.name) or places[own if own in places else parameter.name])
        return ca.vertcat(*values)

    def _inputs_of(self, block: Block, u: Any) -> Any:
        known = dict(zip((s.name for s in self.inputs), _split(u, self.inputs), strict=True))
        return ca.vertcat(*(known[s.name] for s in block.inputs))

    def _draws(self, block: Block, w: Any) -> Any:
        """Those of the draws that belong to a block."""
        widths = [sum(width for _, width in other.seeds) for other in self.blocks]
        return ca.vertsplit(w, [0, *_ends(widths)])[self.blocks.index(block)]

    def _advanced(self, plant: ContinuousBlock, x: Any, u: Any, p: Any, t: Any, period: Any) -> Any:
        """The plant's state one sample period after t (s)."""
        steps = self._solver_steps
        h = period / steps
        for i in range(steps):
            x = plant.advance_function(x, u, p, t + i * h, h)
        return x


def _ends(sizes: Sequence[int]) -> list[int]:
    return [sum(sizes[: i + 1]) for i in range(len(sizes))]


def _split(flat: Any, signals: Sequence[Signal]) -> list[Any]:
    """Parts of a flat vector that belong to the signals; those of the first signals where it is longer."""
    ends = [0, *_ends([s.size for s in signals])]
    return ca.vertsplit(flat, ends) if signals else []
