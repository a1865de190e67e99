"""What a step of the filter costs by order: the paper's Table 3.

The block computes every order and picks one, so as it stands its cost does not depend on the order. Here the step is
compiled once per filter with its order as a constant, as one would for a small processor.
"""

from __future__ import annotations

from collections.abc import Sequence
from time import perf_counter
from typing import Any

import casadi as ca
import numpy as np

from ...blocks.instance import buffered
from ...estimators.leechoi2018 import BLOCK
from .runs import Filter

_STEPS = 2000  # evaluations of one timing
_REPEATS = 15


def compiled(tried: Filter) -> Any:
    """CasADi Function of one step with the parameters of the filter as constants; what depends on no input is gone."""
    x, u, p, w = BLOCK.following_function.sx_in()
    names = [v.name for v in BLOCK.variables if v.group == "parameter"]
    constants = {"normalise": 0, "gyro_index": 0, "use_initial_angles": 0, **tried.parameters}
    fixed = ca.vertcat(*(constants.get(name, p[i]) for i, name in enumerate(names)))
    return ca.Function(
        f"order_{tried.order}_{tried.process_noise_order}", [x, u, p, w], BLOCK.following_function(x, u, fixed, w)
    )


def operations(tried: Filter) -> int:
    """Arithmetic operations of one step."""
    function = compiled(tried)
    moves = (ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_CONST)
    return sum(function.instruction_id(i) not in moves for i in range(function.n_instructions()))


def times(filters: Sequence[Filter]) -> list[float]:
    """Time of one step of each filter in CasADi's interpreter, relative to the first; all measured side by side."""
    evaluations = []
    for tried in filters:
        function = compiled(tried)
        shapes = [function.numel_in(i) for i in range(3)]
        x, u, p = np.ones(shapes[0]), np.ones(shapes[1]), BLOCK.parameter_vector()
        results = tuple(np.zeros(function.numel_out(i)) for i in range(2))
        evaluations.append(buffered(function, (x, u, p, np.zeros(0)), results))
    best = np.full(len(filters), np.inf)
    for _ in range(_REPEATS):
        for i, evaluate in enumerate(evaluations):
            start = perf_counter()
            for _ in range(_STEPS):
                evaluate()
            best[i] = min(best[i], perf_counter() - start)
    return list(best / best[0])
