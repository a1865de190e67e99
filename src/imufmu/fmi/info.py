"""What an FMU says about itself."""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ..compiled.compilers import BuildError
from ..files.names import no_such
from .archive import read_fmu

COLUMNS = ("variable", "causality", "variability", "unit", "start", "min", "max", "description")


def facts(fmu: str) -> dict[str, Any]:
    """What there is to say, by name; ``variables`` is a list. ``fmu``: a block's name or a file.

    Raises BuildError for a name that is neither, ArchiveError for an FMU that cannot be used here.
    """
    path = file_of(fmu)
    model = read_fmu(path)
    slave, experiment = model.coSimulation, model.defaultExperiment
    with zipfile.ZipFile(path) as archive:
        platforms = sorted({name.split("/")[1] for name in archive.namelist() if name.startswith("binaries/")})
    return {
        "file": str(path.resolve()),
        "name": model.modelName,
        "description": model.description,
        "fmi_version": model.fmiVersion,
        "made_with": model.generationTool,
        "guid": model.guid,
        "platforms": platforms,
        "state_can_be_saved": bool(slave.canGetAndSetFMUstate),
        "default_step_s": float(experiment.stepSize) if experiment and experiment.stepSize else None,
        "variables": [
            {
                "name": v.name,
                "causality": v.causality,
                "variability": v.variability,
                "type": v.type,
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
        f"FMI {told['fmi_version']} co-simulation, made with {told['made_with'] or 'an unnamed tool'}",
        f"GUID {told['guid']}",
        f"platforms: {', '.join(told['platforms'])}; state can be saved: {state}",
        "no default step" if step is None else f"default step {step} s",
    ]
    return heading, [[_text(v[column]) for column in ("name", *COLUMNS[1:])] for v in told["variables"]]


def _text(value: Any) -> str:
    """As a model description writes it."""
    return "" if value is None else str(value).lower() if isinstance(value, bool) else str(value)


def _value(variable: Any, text: str | None) -> Any:
    """A value of the model description in the variable's type; as it is written where it is none of that."""
    kinds: dict[str, Callable[[str], Any]] = {
        "Real": float,
        "Integer": int,
        "Enumeration": int,
        "Boolean": lambda written: written in ("true", "1"),
    }
    try:
        return text if text is None or variable.type not in kinds else kinds[variable.type](text)
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
