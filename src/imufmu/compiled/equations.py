"""C source of a block's equations, as CasADi writes them."""

from __future__ import annotations

import re
from typing import Any

import casadi as ca

from ..blocks.block import Block, ContinuousBlock, SampledBlock
from ..blocks.signals import total_size
from ..blocks.vocabulary import Status

_STYLE: dict[str, Any] = {"with_header": False, "casadi_real": "double", "casadi_int": "int", "indent": 4}


def functions_of(block: Block) -> dict[str, Any]:
    """CasADi Functions by the name that C calls them by: everything a run needs.

    C itself lets a block begin anew where ``block_sound`` says that its numbers are not finite.
    """
    if isinstance(block, SampledBlock):
        parts = block.slow_parts
        in_place = {"block_step": parts.step, "block_slow": parts.slow, "block_report": parts.report} if parts else {}
        following = in_place or {"block_next": block.following_function}
        sound = {"block_sound": block.sound_function} if block.begins_anew else {}
        return {"block_first": block.first_function, **following, **sound}
    assert isinstance(block, ContinuousBlock)
    return {
        "block_initial": block.initial_function,
        "block_advance": block.advance_function,
        "block_output": block.output_function,
    }


def derivatives_of(block: Block) -> dict[str, Any]:
    """The same for the derivatives of the outputs, which only FMUs have."""
    if isinstance(block, SampledBlock):
        parts, name = block.slow_parts, f"{block.following_function.name()}_derivative"
        following = parts and parts.derivative(name, total_size(block.outputs))
        return {
            "block_first_derivative": output_derivative(block, block.first_function),
            "block_next_derivative": following or output_derivative(block, block.following_function),
        }
    assert isinstance(block, ContinuousBlock)
    return {"block_output_derivative": output_derivative(block, block.output_function)}


def sizes(block: Block, functions: dict[str, Any]) -> dict[str, int]:
    """Lengths of vectors, the room that the functions need, the place of ``status``: by their names in C."""
    needs = list(functions.values())
    begins_anew = isinstance(block, SampledBlock) and block.begins_anew
    delayed = block.delayed_by if isinstance(block, SampledBlock) else ""
    return {
        "N_INPUTS": total_size(block.inputs),
        "N_PARAMETERS": total_size(block.parameters),
        "N_OUTPUTS": total_size(block.outputs),
        "N_REPORTED": total_size(block.reported),
        "N_STATE": total_size(block.held_state),
        "N_HELD": total_size(block.inputs),  # the last of the state
        "BEGINS_ANEW": int(begins_anew),
        "STATUS_AT": block.place_of("status") if begins_anew else 0,  # in the reported signals
        "RESTARTED": int(Status.RESTARTED),
        "DELAYED": int(bool(delayed)),
        "DELAY_AT": block.place_of(delayed) if delayed else 0,
        "SLOW_STEPS": int("block_slow" in functions),
        "N_FAST": functions["block_step"].numel_out(0) if "block_step" in functions else total_size(block.state),
        "N_NORMALS": block.normals,
        "N_ARGUMENTS": max(function.sz_arg() for function in needs),
        "N_RESULTS": max(function.sz_res() for function in needs),
        "N_WORK": max(function.sz_w() for function in needs),
        "N_INTEGER_WORK": max(function.sz_iw() for function in needs),
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
    """C of these Functions, each with the prefix of the block's name. Every name is static.

    CasADi defines its own helpers as global functions. What was declared static before stays static.
    """
    generator = ca.CodeGenerator("equations", _STYLE | {"prefix": f"{block.name}_"})
    for function in functions.values():
        generator.add(function)
    text = str(generator.dump())
    helpers = re.findall(r"^(casadi_real|casadi_int|void) casadi_(\w+)(\(.*\)) \{", text, re.MULTILINE)
    static = "".join(f"static {kind} {block.name}__{name}{arguments};\n" for kind, name, arguments in helpers)
    return f"#define casadi_real double\n#define casadi_int int\n{static}\n{text}"
