"""A block that begins anew where its numbers are not finite, as a CasADi Function."""

from __future__ import annotations

from typing import Any

import casadi as ca

from .vocabulary import STATUS, Status


def or_anew(block: Any) -> Any:
    """Function (x, u, p, w) -> (x, y) of a sampled block: its ``following_function``, as long as y of it is finite.

    Else its ``first_function``; ``status`` then has the flag RESTARTED.
    """
    arguments = block.following_function.mx_in()
    _, u, p, w = arguments
    x, y = block.following_function(*arguments)
    results = [ca.MX.sym("x_next", x.numel()), ca.MX.sym("y", y.numel())]
    x_first, y_first = block.first_function(u, p, w)
    y_first[block.place_of(STATUS.name)] += int(Status.RESTARTED)
    keep = ca.Function(f"{block.name}_keep", [*results, u, p, w], results)
    anew = ca.Function(f"{block.name}_anew", [*results, u, p, w], [x_first, y_first])
    choice = ca.Function.if_else(f"{block.name}_or_anew", keep, anew)
    result = choice(block.sound_function(y), x, y, u, p, w)
    return ca.Function(f"{block.name}_next", arguments, result, ["x", "u", "p", "w"], ["x_next", "y"])
