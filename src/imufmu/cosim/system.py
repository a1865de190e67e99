"""A system that is ready to run: its description, checked against its FMUs."""

from __future__ import annotations

import os
import weakref
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ..files.archives import ArchiveError, unpack
from ..files.locations import models_folder
from ..files.names import no_such
from ..files.scratch import new_scratch
from ..fmi.archive import interface_of, read_fmu
from ..fmi.build import cached_fmu
from ..fmi.native import cached_native_fmu
from ..fmi.own import is_ours
from ..registry import BLOCKS
from .description import Component, Description, DescriptionError, read_description
from .interface import Interface, WiringError
from .links import Link, find_links
from .settings import Setting, bound_settings, given_settings, merged

STRUCTURE = "SystemStructure.ssd"  # the description inside an .ssp


@dataclass(frozen=True, eq=False)
class Part:
    """One component: its FMU file and that FMU's ModelDescription (fmpy). ours: imufmu has built it here."""

    name: str
    fmu: Path
    model: Any
    ours: bool = False


@dataclass(frozen=True, eq=False)
class System:
    """A description, its FMUs, and the wiring between them, without faults.

    path: the file it was read from. notes: what is unusual but no error.
    """

    path: Path
    description: Description
    parts: tuple[Part, ...]
    links: tuple[Link, ...]
    settings: tuple[Setting, ...]
    notes: tuple[str, ...]

    @staticmethod
    def read(path: str | Path, *, native: bool = False) -> System:
        """Read an .ssd or .ssp file, or a system of imufmu by its name.

        An FMU that is not where the .ssd says, but is named after a block of imufmu, is built into the user's cache: in
        Python, or with ``native`` as compiled C. An FMU that is there is taken as it is. Raises DescriptionError,
        ArchiveError (FMU, archive or XML unfit), BuildError or WiringError (all misfits at once).
        """
        path = locate(path).resolve()
        if path.suffix.lower() != ".ssp":
            return _read(path, native)
        scratch, delete = new_scratch("ssp")
        folder = str(scratch)
        try:
            unpack(path, Path(folder))
            if not (Path(folder) / STRUCTURE).is_file():
                raise ArchiveError(f"{path}: {STRUCTURE} is missing: this is no SSP")
            system = replace(_read(Path(folder) / STRUCTURE, native, inside=Path(folder)), path=path)
        except BaseException as error:
            delete()
            # A user knows the archive, not the folder that it was unpacked to.
            error.args = tuple(str(part).replace(f"{folder}{os.sep}", f"{path}: ") for part in error.args)
            raise
        weakref.finalize(system, delete)
        return system

    @property
    def interfaces(self) -> dict[str, Interface]:
        """What each component offers, by component name."""
        return {part.name: _interface(part) for part in self.parts}

    def settings_with(self, parameters: Mapping[str, Any]) -> tuple[Setting, ...]:
        """The settings, with values by ``component.variable`` in force. Raises WiringError."""
        problems: list[str] = []
        given = given_settings(parameters, self.interfaces, problems)
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


def _read(path: Path, native: bool, inside: Path | None = None) -> System:
    """Read an .ssd; ``inside``: the folder that its files must not leave."""
    description = read_description(path, inside)
    _check_names(description)
    models: dict[Path, Any] = {}
    parts = []
    for component in description.components:
        fmu, ours = _fmu_file(component, path, native)
        if fmu not in models:
            models[fmu] = read_fmu(fmu)
        parts.append(Part(component.name, fmu, models[fmu], ours))
    interfaces = {part.name: _interface(part) for part in parts}
    problems = _instance_problems(parts)
    notes: list[str] = []
    links = find_links(description, interfaces, problems, notes)
    settings = bound_settings(description, interfaces, problems)
    if problems:
        raise WiringError(path, problems)
    notes += _idle_inputs(interfaces, links, settings)
    return System(path, description, tuple(parts), links, settings, tuple(notes))


def _check_names(description: Description) -> None:
    names = [component.name for component in description.components]
    if not names:
        raise DescriptionError(f"{description.path}: the system has no components")
    for component in description.components:
        where = f"{description.path}, line {component.line}: component {component.name!r}"
        if "." in component.name:
            raise DescriptionError(f"{where}: a name with a dot would be ambiguous in component.variable; rename it")
        if names.count(component.name) > 1:
            raise DescriptionError(f"{where}: the name occurs twice; rename one of them")


def _fmu_file(component: Component, path: Path, native: bool) -> tuple[Path, bool]:
    """The component's FMU, built if it is one of ours and not there, and whether it is ours."""
    if component.source.is_file():
        return component.source, is_ours(component.source)
    if component.source.stem in BLOCKS:
        return (cached_native_fmu if native else cached_fmu)(component.source.stem), True
    raise DescriptionError(
        f"{path}, line {component.line}: component {component.name!r}: there is no file {component.source}, and "
        + no_such("block of imufmu", component.source.stem, BLOCKS)
    )


def _interface(part: Part) -> Interface:
    return Interface(part.name, {variable.name: variable for variable in part.model.modelVariables})


def _idle_inputs(interfaces: Mapping[str, Interface], links: Sequence[Link], settings: Sequence[Setting]) -> list[str]:
    """A note per component with inputs that nothing feeds and no parameter set gives a value."""
    given = {(link.target[0], link.target[1].name) for link in links}
    given |= {(setting.component, setting.variable.name) for setting in settings}
    notes = []
    for interface in interfaces.values():
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
