"""The part of a native FMU's C that only an FMU needs: its table of variables, sizes and names for the wrapper."""

from __future__ import annotations

import json
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from .. import __version__
from ..blocks.block import Block, ContinuousBlock, SampledBlock, Variable
from ..blocks.instance import CLOCK_TOLERANCE, LONGEST_STEP, TIME_ROUNDING
from ..blocks.signals import Parameter
from ..compiled.equations import derivatives_of, equations, functions_of, sizes
from .model_description import guid, value_references, variable_type


def generate(block: Block) -> dict[str, str]:
    """Text by file name: ``block.c`` and ``equations.c``."""
    functions = functions_of(block) | derivatives_of(block)
    return {"block.c": _table(block, functions), "equations.c": equations(block, functions)}


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
        variables=[_row(block, v) for _, v in sorted(value_references(block), key=lambda listed: listed[0])],
        c_string=json.dumps,  # the names and units are plain ASCII, which both languages quote alike
    )


def _constants(block: Block, functions: dict[str, Any], references: dict[str, int]) -> dict[str, Any]:
    """Sizes, places and limits; a place is a value reference."""
    sampled = isinstance(block, SampledBlock)
    assert isinstance(block, SampledBlock | ContinuousBlock)
    return {
        "SAMPLED": int(sampled),
        "N_VARIABLES": len(references),
        "HAS_SOLVER": int(block.has_solver),
        **sizes(block, functions),
        "PERIOD": references["sample_period" if sampled else "max_step"],
        "SAMPLE_TIME": references.get("sample_time", len(references)),  # a continuous block has none
        "CLOCK_TOLERANCE": repr(CLOCK_TOLERANCE),
        "TIME_ROUNDING": repr(TIME_ROUNDING),
        "LONGEST_STEP": repr(float(LONGEST_STEP)),
    }


def _row(block: Block, variable: Variable) -> dict[str, str]:
    """One line of the table; numbers read back as the same double. An input is missing outside minimum and maximum."""
    signal = variable.signal
    bounds = block.bounds_of(signal) if variable.group == "input" else (signal.minimum, signal.maximum)
    role = variable.group.upper()
    if isinstance(signal, Parameter):
        role = "TUNABLE" if signal.tunable else "FIXED"
    return {
        "name": variable.name,
        "unit": "" if signal.unit == "1" else f" {signal.unit}",
        "type": variable_type(variable).upper(),
        "role": role,
        "start": repr(float(variable.start)),
        "minimum": repr(float(bounds[0])),
        "maximum": repr(float(bounds[1])),
    }
