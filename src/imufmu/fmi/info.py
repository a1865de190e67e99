"""What an FMU says about itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ..compiled.compilers import BuildError
from ..files.names import no_such
from .archive import kinds_of, read_model

COLUMNS = ("variable", "causality", "variability", "unit", "start", "min", "max", "description")


def facts(fmu: str) -> dict[str, Any]:
    """What there is to say, by name; ``variables`` is a list. ``fmu``: a block's name or a file.

    An array of FMI 3.0 is one variable with its ``shape``. Raises BuildError for a name that is neither, ArchiveError
    for what is no FMU 2.0 or 3.0.
    """
    path = file_of(fmu)
    names, model = read_model(path, [])
    experiment = model.defaultExperiment
    interfaces = [part for part in (model.coSimulation, model.modelExchange, model.scheduledExecution) if part]
    binaries = [name.split("/") for name in names if name.startswith("binaries/")]
    return {
        "file": str(path.resolve()),
        "name": model.modelName,
        "description": model.description,
        "fmi_version": model.fmiVersion,
        "kinds": kinds_of(model),
        "made_with": model.generationTool,
        "guid": model.guid,
        "platforms": sorted({parts[1] for parts in binaries if len(parts) > 2 and parts[2]}),
        "state_can_be_saved": any(bool(part.canGetAndSetFMUstate) for part in interfaces),
        "default_step_s": float(experiment.stepSize) if experiment and experiment.stepSize else None,
        "variables": [
            {
                "name": v.name,
                "causality": v.causality,
                "variability": v.variability,
                "type": v.type,
                "shape": list(v.shape or ()),
                "unit": v.unit or (v.declaredType.unit if v.declaredType else None),
                "start": _value(v, v.start),
                "min": _value(v, v.min),
                "max": _value(v, v.max),
                "description": v.description,
            }
            for v in model.modelVariables
        ],
    }


def described(told: Mapping[str, Any]) -> tuple[list[str], list[list[str]]]:
    """The facts as heading lines, and one row of COLUMNS per variable."""
    step, state = told["default_step_s"], "yes" if told["state_can_be_saved"] else "no"
    heading = [
        f"{told['name']}: {told['description'] or 'no description'}",
        f"FMI {told['fmi_version']} {told['kinds']}, made with {told['made_with'] or 'an unnamed tool'}",
        f"GUID {told['guid']}",
        f"platforms: {', '.join(told['platforms'])}; state can be saved: {state}",
        "no default step" if step is None else f"default step {step} s",
    ]
    return heading, [[_name(v), *(_text(v[column]) for column in COLUMNS[1:])] for v in told["variables"]]


def _name(variable: Mapping[str, Any]) -> str:
    """The name, of an array with its indices."""
    ranges = ",".join(f"1..{size}" for size in variable["shape"])
    return f"{variable['name']}[{ranges}]" if ranges else variable["name"]


def _text(value: Any) -> str:
    """As a model description writes it."""
    return "" if value is None else str(value).lower() if isinstance(value, bool) else str(value)


def _value(variable: Any, text: str | None) -> Any:
    """A value of the model description in the variable's type; as it is written where it is none of that."""
    kinds: dict[str, Callable[[str], Any]] = {
        "Real": float,
        "Float": float,
        "Int": int,
        "UInt": int,
        "Integer": int,
        "Enumeration": int,
        "Boolean": lambda written: written in ("true", "1"),
    }
    kind = variable.type.rstrip("0123456789")
    try:
        return text if text is None or kind not in kinds or variable.shape else kinds[kind](text)
    except ValueError:
        return text


def file_of(fmu: str) -> Path:
    """The file that a user means: an .fmu file, or the Python FMU of a block by its name. Raises BuildError."""
    if Path(fmu).suffix.lower() == ".fmu":
        return Path(fmu)
    from ..registry import BLOCKS  # an .fmu file is told about without the equations of any block
    from .build import cached_fmu

    if fmu not in BLOCKS:
        raise BuildError(no_such("block", fmu, BLOCKS, "or give an .fmu file"))
    return cached_fmu(fmu)
