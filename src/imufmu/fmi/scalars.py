"""FMI 3.0 as scalars: an array of Float64 becomes Real variables x[1], x[2], ... as they are in FMI 2.0.

What FMI 2.0 has no word for, Binary and Clock, keeps its type, which nothing can be connected to.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import Any

from attrs import asdict, define
from fmpy.model_description import ModelVariable

_KINDS = {"Float32": "Real", "Float64": "Real", "Boolean": "Boolean", "Enumeration": "Enumeration", "String": "String"}
_KINDS |= {f"{sign}Int{bits}": "Integer" for sign in ("", "U") for bits in (8, 16, 32, 64)}


@define(eq=False)
class Scalar(ModelVariable):
    """An FMI 3.0 variable, or one element of it. wire: its FMI 3.0 type. place, size: which element, of how many."""

    wire: str = ""
    place: int = 0
    size: int = 1


def as_scalars(variables: list[Any]) -> list[Any]:
    """Variables (fmpy ModelVariable) of FMI 3.0, arrays taken apart row by row."""
    return [scalar for variable in variables for scalar in _elements(variable)]


def _elements(variable: Any) -> Iterator[Scalar]:
    own = asdict(variable, recurse=False)
    own["python_type"] = own.pop("_python_type")
    own |= {"type": _KINDS.get(variable.type, variable.type)}
    wire = "Int64" if variable.type == "Enumeration" else variable.type
    indices = list(product(*(range(1, size + 1) for size in variable.shape or ())))
    starts = [variable.start] if variable.start is None or wire in ("String", "Binary") else str(variable.start).split()
    for place, index in enumerate(indices):
        name = f"{variable.name}[{','.join(map(str, index))}]" if index else variable.name
        start = starts[place] if place < len(starts) else starts[-1] if starts else None
        yield Scalar(**own | {"name": name, "start": start}, wire=wire, place=place, size=len(indices))
