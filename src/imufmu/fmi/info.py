"""What an FMU says about itself, for people."""

from __future__ import annotations

import zipfile
from pathlib import Path

from ..archives import read_fmu
from ..registry import BLOCKS
from .build import BuildError, cached_fmu

COLUMNS = ("variable", "causality", "variability", "unit", "start", "min", "max", "description")


def describe(fmu: str) -> tuple[list[str], list[list[str]]]:
    """Heading lines, and one row of COLUMNS per variable. ``fmu``: a block's name or a file.

    Raises BuildError for a name that is neither, ArchiveError for an FMU that cannot be used here.
    """
    if fmu not in BLOCKS and Path(fmu).suffix.lower() != ".fmu":
        raise BuildError(f"no block is called {fmu!r}; there is {', '.join(BLOCKS)}, or give an .fmu file")
    path = cached_fmu(fmu) if fmu in BLOCKS else Path(fmu)
    model = read_fmu(path)
    slave, experiment = model.coSimulation, model.defaultExperiment
    with zipfile.ZipFile(path) as archive:
        platforms = sorted({name.split("/")[1] for name in archive.namelist() if name.startswith("binaries/")})
    heading = [
        f"{model.modelName}: {model.description or 'no description'}",
        f"FMI {model.fmiVersion} co-simulation, made with {model.generationTool or 'an unnamed tool'}",
        f"GUID {model.guid}",
        f"platforms: {', '.join(platforms)}; state can be saved: {'yes' if slave.canGetAndSetFMUstate else 'no'}",
        f"default step {experiment.stepSize} s" if experiment and experiment.stepSize else "no default step",
    ]
    rows = []
    for v in model.modelVariables:
        declared = v.declaredType
        unit = v.unit or (declared.unit if declared else None)
        texts = (v.name, v.causality, v.variability, unit, v.start, v.min, v.max, v.description)
        rows.append(["" if text is None else str(text) for text in texts])
    return heading, rows
