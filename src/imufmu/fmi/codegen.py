"""C source of a block: the equations as CasADi writes them, and the table of variables for the wrapper in fmu_src/c."""

from __future__ import annotations

import json
from typing import Any

import casadi as ca
from jinja2 import Environment, PackageLoader, StrictUndefined

from .. import __version__
from ..block import Block, ContinuousBlock, SampledBlock, Variable
from ..instance import CLOCK_TOLERANCE, LONGEST_STEP
from ..signals import Parameter, total_size
from .model_description import guid, value_references, variable_type

_STYLE: dict[str, Any] = {"with_header": False, "casadi_real": "double", "casadi_int": "int", "indent": 4}


def generate(block: Block) -> dict[str, str]:
    """Text by file name: ``block.c`` and ``equations.c``."""
    functions = _functions(block)
    return {"block.c": _table(block, functions), "equations.c": _equations(block, functions)}


def _functions(block: Block) -> dict[str, Any]:
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


def _equations(block: Block, functions: dict[str, Any]) -> str:
    generator = ca.CodeGenerator("equations", _STYLE | {"prefix": f"{block.name}_"})
    for function in functions.values():
        generator.add(function)
    return str(generator.dump())


def _table(block: Block, functions: dict[str, Any]) -> str:
    environment = Environment(
        loader=PackageLoader("imufmu.fmi"), undefined=StrictUndefined, trim_blocks=True, keep_trailing_newline=True
    )
    references = {variable.name: reference for reference, variable in value_references(block)}
    return environment.get_template("block.c").render(
        block=block,
        version=__version__,
        guid=guid(block, native=True),
        constants=_constants(block, functions, references),
        streams=[(references[name], width) for name, width in block.seeds],
        aliases={alias: function.name() for alias, function in functions.items()},
        variables=[_row(variable) for _, variable in sorted(value_references(block), key=lambda listed: listed[0])],
        c_string=json.dumps,  # the names and units are plain ASCII, which both languages quote alike
    )


def _constants(block: Block, functions: dict[str, Any], references: dict[str, int]) -> dict[str, Any]:
    """Sizes, places and limits; a place is a value reference."""
    sampled, needs = isinstance(block, SampledBlock), list(functions.values())
    assert isinstance(block, SampledBlock | ContinuousBlock)
    return {
        "SAMPLED": int(sampled),
        "N_VARIABLES": len(references),
        "N_INPUTS": total_size(block.inputs),
        "N_PARAMETERS": total_size(block.parameters),
        "N_OUTPUTS": total_size(block.outputs),
        "N_REPORTED": total_size(block.reported),
        "N_STATE": total_size(block.held_state),
        "N_HELD": total_size(block.inputs),  # the last of the state
        "HAS_SOLVER": int(block.has_solver),
        "SLOW_STEPS": int("block_slow" in functions),
        "N_FAST": functions["block_step"].numel_out(0) if "block_step" in functions else total_size(block.state),
        "N_NORMALS": block.normals,
        "N_ARGUMENTS": max(function.sz_arg() for function in needs),
        "N_RESULTS": max(function.sz_res() for function in needs),
        "N_WORK": max(function.sz_w() for function in needs),
        "N_INTEGER_WORK": max(function.sz_iw() for function in needs),
        "PERIOD": references["sample_period" if sampled else "max_step"],
        "SAMPLE_TIME": references.get("sample_time", len(references)),  # a continuous block has none
        "CLOCK_TOLERANCE": repr(CLOCK_TOLERANCE),
        "LONGEST_STEP": repr(float(LONGEST_STEP)),
    }


def _row(variable: Variable) -> dict[str, str]:
    """One line of the table; numbers read back as the same double."""
    signal = variable.signal
    role = variable.group.upper()
    if isinstance(signal, Parameter):
        role = "TUNABLE" if signal.tunable else "FIXED"
    return {
        "name": variable.name,
        "unit": "" if signal.unit == "1" else f" {signal.unit}",
        "type": variable_type(variable).upper(),
        "role": role,
        "start": repr(float(variable.start)),
        "minimum": repr(float(signal.minimum)),
        "maximum": repr(float(signal.maximum)),
    }
