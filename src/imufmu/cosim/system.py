"""A system that is ready to run: its description, checked against its FMUs."""

from __future__ import annotations

import weakref
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ..files.locations import models_folder
from ..files.names import no_such
from ..files.scratch import new_scratch
from ..fmi.archive import interface_of, kinds_of, read_fmu
from ..fmi.build import cached_fmu
from ..fmi.native import cached_native_fmu
from ..fmi.own import is_ours
from ..registry import BLOCKS
from .arrays import one_by_one
from .connecting.connect import connect
from .connecting.matching import Ask
from .description import Description, DescriptionError, read_description
from .interface import Interface, WiringError
from .links import Link, Wiring
from .settings import Setting, bound_settings, given_settings, merged
from .ssp.flat import Component
from .ssp.packages import Packages
from .wiring import find_wiring


@dataclass(frozen=True, eq=False)
class Part:
    """One component: its FMU file and that FMU's ModelDescription (fmpy). ours: imufmu has built it here."""

    name: str
    fmu: Path
    model: Any
    ours: bool = False


@dataclass(frozen=True, eq=False)
class System:
    """A description, its FMUs, and the wiring between them.

    path: the file it was read from. notes: what is unusual but no error, and what is formally wrong but clear.
    """

    path: Path
    description: Description
    parts: tuple[Part, ...]
    wiring: Wiring
    settings: tuple[Setting, ...]
    notes: tuple[str, ...]

    @staticmethod
    def read(path: str | Path, *, native: bool = False, strict: bool = False) -> System:
        """Read an .ssd or .ssp file, or a system of imufmu by its name.

        "a.ssp#late.ssd" is another description in an archive than the usual one.
        An FMU that is not where the .ssd says, but is named after a block of imufmu, is built into the user's cache: in
        Python, or with ``native`` as compiled C. An FMU that is there is taken as it is. strict: refuse what breaks a
        standard, also where its meaning is clear. Raises DescriptionError, ArchiveError (FMU, archive or XML unfit),
        BuildError or WiringError (all misfits at once).
        """
        path, variant = locate(path).resolve(), ""
        if ".ssp#" in path.name:
            archive, _, variant = path.name.partition("#")
            path = path.with_name(archive)
        packages = Packages()
        try:
            ssd, inside = packages.structure(path, variant) if path.suffix.lower() == ".ssp" else (path, None)
            system = _read(ssd, native, strict, packages, inside)
        except BaseException as error:
            packages.delete()
            error.args = tuple(packages.shown(str(part)) for part in error.args)
            raise
        system = replace(system, path=path, notes=tuple(map(packages.shown, system.notes)))
        weakref.finalize(system, packages.delete)
        return system

    @staticmethod
    def connect(
        plant: str | Path,
        imu: str | Path = "mtx",
        estimators: Sequence[str | Path] = ("plumb",),
        mapping: Mapping[str, str] | None = None,
        *,
        rate: float | None = None,
        stop_time: float | None = None,
        native: bool = False,
        ask: Ask | None = None,
    ) -> System:
        """A plant of others with an IMU and estimators, wired by names and units; see ``connect.connect``.

        What was found is in ``notes``. To keep the description: ``imufmu connect``. Raises WiringError with everything
        that is unclear, and what ``System.read`` raises.
        """
        connected = connect(plant, imu, estimators, mapping, rate=rate, stop_time=stop_time, ask=ask)
        folder, delete = new_scratch("connect")
        try:
            path = folder / f"{connected.name}.ssd"
            path.write_bytes(connected.text(folder))
            system = _read(path, native, False, Packages(), None)
        finally:
            delete()
        return replace(system, notes=(*connected.lines, *system.notes))

    @property
    def interfaces(self) -> Mapping[str, Interface]:
        """What each component offers, by component name."""
        return self.wiring.interfaces

    @property
    def links(self) -> tuple[Link, ...]:
        """Inputs and the outputs that feed them."""
        return self.wiring.links

    def settings_with(self, parameters: Mapping[str, Any]) -> tuple[Setting, ...]:
        """The settings, with values by ``component.variable`` in force. Raises WiringError."""
        problems: list[str] = []
        given = given_settings(parameters, self.wiring, problems)
        if problems:
            raise WiringError(self.path, problems)
        return merged(self.settings, given)


def locate(name: str | Path) -> Path:
    """The system description that a user means: a file, or the name of a system of imufmu. Raises ValueError."""
    if Path(name).suffix.lower() in (".ssd", ".ssp"):
        return Path(name)
    systems = {path.stem: path for path in sorted(models_folder().rglob("*.ssd"))}
    if str(name) not in systems:
        raise ValueError(no_such("system", str(name), systems, "or give an .ssd or .ssp file"))
    return systems[str(name)]


def _read(path: Path, native: bool, strict: bool, packages: Packages, inside: Path | None) -> System:
    """Read an .ssd; ``inside``: the folder that its files must not leave."""
    description = read_description(path, inside, packages)
    _check_names(description)
    faults = list(description.faults)
    models: dict[Path, Any] = {}
    parts = []
    for component in description.components:
        fmu, ours = _fmu_file(component, native)
        if fmu not in models:
            models[fmu] = read_fmu(fmu, faults)
        parts.append(Part(component.name, fmu, _as_asked(models[fmu], component), ours))
    interfaces = {part.name: Interface.of_model(part.name, part.model) for part in parts}
    problems = _instance_problems(parts)
    notes: list[str] = []
    description = one_by_one(description, interfaces, problems)
    wiring = find_wiring(description, interfaces, problems, notes, faults)
    settings = bound_settings(wiring, problems, faults)
    faults = [fault.removeprefix(f"{path}, ") for fault in faults]
    if problems:
        raise WiringError(path, [problem.removeprefix(f"{path}, ") for problem in problems])
    if strict and faults:
        raise WiringError(path, faults, "breaks a standard, and was to be read strictly")
    notes += _idle_inputs(wiring, settings)
    notes += [f"not as the standard has it: {fault}" for fault in faults]
    return System(path, description, tuple(parts), wiring, settings, tuple(notes))


def _check_names(description: Description) -> None:
    if not description.components:
        raise DescriptionError(f"{description.path}: the system has no components, so there is nothing to run")
    seen = set()
    for component in description.components:
        if component.name in seen or component.name in description.systems:
            where = f"{component.where}: component {component.name!r}"
            raise DescriptionError(f"{where}: the name occurs twice; rename one of them")
        seen.add(component.name)


def _fmu_file(component: Component, native: bool) -> tuple[Path, bool]:
    """The component's FMU, built if it is one of ours and not there, and whether it is ours."""
    if component.source.is_file():
        return component.source, is_ours(component.source)
    if component.source.stem in BLOCKS:
        return (cached_native_fmu if native else cached_fmu)(component.source.stem), True
    raise DescriptionError(
        f"{component.where}: component {component.name!r}: there is no file {component.source}, and "
        + no_such("block of imufmu", component.source.stem, BLOCKS)
    )


def _as_asked(model: Any, component: Component) -> Any:
    """The ModelDescription (fmpy) with the kind of simulation that the description wants. Raises DescriptionError."""
    offered = {"CoSimulation": model.coSimulation, "ModelExchange": model.modelExchange, "any": model}
    if not offered.get(component.implementation):
        raise DescriptionError(
            f"{component.where}: component {component.name!r}: {component.implementation} is asked for; its FMU is for "
            + kinds_of(model)
        )
    if component.implementation == "ModelExchange" and model.coSimulation:
        model = copy(model)
        model.coSimulation = None
    return model


def _idle_inputs(wiring: Wiring, settings: Sequence[Setting]) -> list[str]:
    """What nothing feeds and no parameter set gives a value: connectors of systems, and a note per component."""
    given = {(link.target[0], link.target[1].name) for link in wiring.links}
    given |= {(setting.component, setting.variable.name) for setting in settings}
    notes = []
    for way in wiring.ways:
        if way[-1] not in given:
            source, target = (".".join(filter(None, node)) for node in (way[0], way[-1]))
            notes.append(f"nothing gives {source} a value: {target} keeps its start value")
            given.add(way[-1])
    for interface in wiring.interfaces.values():
        idle = [v.name for v in interface.of("input") if (interface.component, v.name) not in given]
        if idle:
            notes.append(f"{interface.component}: not connected, at their start values: {', '.join(idle)}")
    return notes


def _instance_problems(parts: list[Part]) -> list[str]:
    """Components that share an FMU which can only be instantiated once."""
    problems = []
    for i, part in enumerate(parts):
        earlier = [other.name for other in parts[:i] if other.fmu == part.fmu]
        if earlier and interface_of(part.model).canBeInstantiatedOnlyOncePerProcess:
            problems.append(f"{part.name}: its FMU can be instantiated once, and {earlier[0]} uses it already")
    return problems
