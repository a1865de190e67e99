"""Read a system description: SSP 1.0 or 2.0 (System Structure and Parameterization), nested systems laid out flat.

The elements are read here, and not by a library: fmpy.ssp drops types and units of connectors, inline
mappings, transformations and the default experiment; pyssp-standard 0.9 drops transformations of connections,
suppressUnitConversion, signal dictionaries and the lines that messages name, and stops at an experiment without times.

The communication step size, for which SSP has no place, is an annotation of the default experiment; those of
OMSimulator and of the Open Simulation Platform are understood, too:

    <ssd:DefaultExperiment startTime="0" stopTime="20">
      <ssd:Annotations>
        <ssc:Annotation type="org.imufmu">
          <imufmu:Communication xmlns:imufmu="urn:imufmu:ssp" stepSize="0.01"/>
        </ssc:Annotation>
      </ssd:Annotations>
    </ssd:DefaultExperiment>
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .ssp.connectors import Connector
from .ssp.files import NAMESPACES, DescriptionError, Sources, number, read_bytes, read_root, units_in
from .ssp.flat import ROOT, Component, Connection, Flat, system_of
from .ssp.packages import Packages
from .ssp.parameters import ParameterValue
from .ssp.signals import Dictionaries
from .truth import Told, read_truth

# Attributes that hold a step size (s), each with the type of the annotation that it is in.
_STEPS = (
    ("org.imufmu", "Communication", "stepSize"),
    ("com.opensimulationplatform", "FixedStepAlgorithm", "baseStepSize"),
    ("org.openmodelica", "FixedStepMaster", "stepSize"),
)


@dataclass(frozen=True)
class Description:
    """A system as written: paths absolute, nothing checked against the FMUs.

    systems: connectors of the systems and signal dictionaries by their names, "" for the whole. values: by their names
    in the whole system, in order of increasing precedence. faults: what is formally wrong, but clear.
    """

    path: Path
    name: str
    description: str
    components: tuple[Component, ...]
    systems: dict[str, dict[str, Connector]]
    connections: tuple[Connection, ...]
    values: tuple[ParameterValue, ...]
    start_time: float | None
    stop_time: float | None
    step: float | None
    faults: tuple[str, ...] = ()
    truth: tuple[Told, ...] = ()  # what the plant tells of its attitude, where that is not in our words


def read_description(path: Path, inside: Path | None = None, packages: Packages | None = None) -> Description:
    """Read an .ssd file; ``inside``: the folder that its sources must not leave.

    packages: unpacks the archives that it refers to; None: it may refer to none. Raises DescriptionError, and
    ArchiveError for XML that is unsafe or not well-formed.
    """
    faults: list[str] = []
    root = read_root(read_bytes(path), path, ROOT, faults)
    flat = Flat(packages, faults)
    flat.add(system_of(root, path), "", Sources(path, inside, faults), units_in(root), Dictionaries())
    experiment = root.find("ssd:DefaultExperiment", NAMESPACES)
    start, stop = (
        None if experiment is None else number(experiment, attribute, path) for attribute in ("startTime", "stopTime")
    )
    values = sorted(flat.values, key=lambda leveled: -leveled[0])  # values of a system go before those inside it
    return Description(
        path,
        name=root.get("name") or path.stem,
        description=system_of(root, path).get("description") or root.get("description") or "",
        components=tuple(flat.components),
        systems=flat.systems,
        connections=tuple(flat.connections),
        values=tuple(value for _, value in values),
        start_time=start,
        stop_time=stop,
        step=_step(root, path),
        faults=tuple(faults),
        truth=_truth(root, path),
    )


def _truth(root: Any, path: Path) -> tuple[Told, ...]:
    try:
        return read_truth(root)
    except ValueError as error:
        raise DescriptionError(f"{path}, {error}") from None


def _step(root: Any, path: Path) -> float | None:
    """The step size of an annotation, ours first."""
    for kind, name, attribute in _STEPS:
        for found in root.iterfind(f".//{{*}}Annotation[@type='{kind}']//{{*}}{name}"):
            return number(found, attribute, path)
    return None
