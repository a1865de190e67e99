"""C source of a block's equations, as CasADi writes them."""

from __future__ import annotations

from typing import Any

import casadi as ca

from ..blocks.block import Block, ContinuousBlock, SampledBlock
from ..blocks.signals import total_size

_STYLE: dict[str, Any] = {"with_header": False, "casadi_real": "double", "casadi_int": "int", "indent": 4}


def functions_of(block: Block) -> dict[str, Any]:
    """CasADi Functions by the name that the wrapper calls them by."""
    if isinstance(block, SampledBlock):
        first, following, parts = block.first_function, block.next_function, block.slow_parts
        in_place = {"block_step": parts.step, "block_slow": parts.slow, "block_report": parts.report} if parts else {}
        return {
            "block_first": first,
            **(in_place or {"block_next": following}),
            "block_first_derivative": output_derivative(block, first),
            "block_next_derivative": output_derivative(block, following),
        }
    assert isinstance(block, ContinuousBlock)
    return {
        "block_initial": block.initial_function,
        "block_advance": block.advance_function,
        "block_output": block.output_function,
        "block_output_derivative": output_derivative(block, block.output_function),
    }


def output_derivative(block: Block, function: Any) -> Any:
    """CasADi Function (the arguments of ``function``, du) -> (dy): change of the outputs with that of the inputs."""
    is_list = function.is_a("SXFunction")  # of instructions; else a graph of Functions
    arguments: list[Any] = function.sx_in() if is_list else function.mx_in()
    u = arguments[function.index_in("u")]
    y = function.call(arguments)[function.index_out("y")][: total_size(block.outputs)]
    du: Any = (ca.SX if is_list else ca.MX).sym("du", u.shape[0])
    dy = ca.densify(ca.jtimes(y, u, du))
    return ca.Function(f"{function.name()}_derivative", [*arguments, du], [dy], {"cse": True})


def equations(block: Block, functions: dict[str, Any]) -> str:
    """C of these Functions, each with the prefix of the block's name."""
    generator = ca.CodeGenerator("equations", _STYLE | {"prefix": f"{block.name}_"})
    for function in functions.values():
        generator.add(function)
    return str(generator.dump())
