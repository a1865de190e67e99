"""What an FMU says about itself, for people."""

from __future__ import annotations

import zipfile
from pathlib import Path

from ..compiled.compilers import BuildError
from .archive import read_fmu

COLUMNS = ("variable", "causality", "variability", "unit", "start", "min", "max", "description")


def describe(fmu: str) -> tuple[list[str], list[list[str]]]:
    """Heading lines, and one row of COLUMNS per variable. ``fmu``: a block's name or a file.

    Raises BuildError for a name that is neither, ArchiveError for an FMU that cannot be used here.
    """
    path = Path(fmu) if Path(fmu).suffix.lower() == ".fmu" else _of_block(fmu)
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


def _of_block(name: str) -> Path:
    """FMU of a registered block. Raises BuildError."""
    from ..registry import BLOCKS  # an .fmu file is told about without the equations of any block
    from .build import cached_fmu

    if name not in BLOCKS:
        raise BuildError(f"no block is called {name!r}; there is {', '.join(BLOCKS)}, or give an .fmu file")
    return cached_fmu(name)
