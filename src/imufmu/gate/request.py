"""What is asked for: the system, the limits and the number of runs, from a limits file and a command line."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from ..cosim.system import locate
from .limits import SUFFIX, Limit, Limits, LimitsError, read_limits, required
from .trials import Plan


def requested(
    target: str, limits: Path | None, require: Iterable[str], seeds: int | None, **options: Any
) -> tuple[Plan, list[Limit], int | None]:
    """Plan, limits and number of seeds (None for one run as the system is).

    target: a system by name or file, or a limits file. limits: a limits file; without one, and with nothing required,
    that beside the system is taken. options: of a Plan; they go before what the limits file says. Raises LimitsError,
    OSError, and ValueError for a system that does not exist.
    """
    if target.endswith(SUFFIX):
        if limits is not None:
            raise LimitsError(f"{target} is a limits file already; give its system, or leave --limits out")
        limits, target = Path(target), ""
    given = [required(text) for text in require]
    beside = None if limits or given or not target else _beside(target)
    read = read_limits(limits or beside) if limits or beside else Limits(())  # type: ignore[arg-type]
    asked = [*read.limits, *given]
    if not asked:
        wanted = Path(target).stem + SUFFIX
        raise LimitsError(f'{target}: no limits: there is no {wanted} beside it; give --limits or --require "..."')
    chosen = {name: value for name, value in options.items() if value is not None}
    from_file = {"stop_time": read.stop_time, "step": read.step}
    plan = {**{name: value for name, value in from_file.items() if value is not None}, **chosen}
    plan["parameters"] = {**read.parameters, **chosen.get("parameters", {})}
    return Plan(target or _system_of(read), **plan), asked, seeds if seeds is not None else read.seeds


def _beside(target: str) -> Path | None:
    path = Path(locate(target))
    beside = path.with_name(path.stem + SUFFIX)
    return beside if beside.is_file() else None


def _system_of(limits: Limits) -> str:
    """The system that a limits file names, or that has its name."""
    assert limits.path is not None
    folder = limits.path.parent
    if limits.system:
        beside = folder / limits.system
        return str(beside) if beside.suffix in (".ssd", ".ssp") else limits.system
    stem = limits.path.name.removesuffix(SUFFIX)
    for suffix in (".ssd", ".ssp"):
        if (folder / (stem + suffix)).is_file():
            return str(folder / (stem + suffix))
    raise LimitsError(f'{limits.path}: of which system? There is no {stem}.ssd beside it; write system = "..."')
