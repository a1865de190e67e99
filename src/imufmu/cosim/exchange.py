"""Where the values of a running system lie: one array per kind for all components, and one table of records."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .interface import WiringError, near, number_of, representation, unit_of
from .links import Link
from .slave import DTYPES, Inlet, Outlet
from .system import System

_WHOLE = np.iinfo(DTYPES["Integer"]).min, np.iinfo(DTYPES["Integer"]).max
Name = tuple[str, str]  # component, variable


class Exchange:
    """Values that the components of a system read, exchange and record.

    record: names of variables, or of vectors without brackets, that the result shall have; None: every output. also:
    names that it shall have in any case. Raises WiringError for a name that the system does not have.
    """

    def __init__(self, system: System, record: Sequence[str] | None, also: Sequence[str] = ()) -> None:
        self._links = system.links
        recorded = _outputs(system) if record is None else _requested(system, record)
        self._recorded = list(dict.fromkeys([*recorded, *_requested(system, also)]))
        needed = set(self._recorded) | {(link.source[0], link.source[1].name) for link in system.links}
        self._variables: dict[str, list[tuple[str, Any]]] = {kind: [] for kind in DTYPES}
        for name, interface in system.interfaces.items():
            # Outputs first: during initialisation they are read alone.
            some = [v for v in interface.variables.values() if (name, v.name) in needed]
            for variable in sorted(some, key=lambda v: v.causality != "output"):
                self._variables[representation(variable)].append((name, variable))
        self.values = {kind: np.zeros(len(some), DTYPES[kind]) for kind, some in self._variables.items()}
        self.rows = 0  # recorded
        self._place = {
            (component, variable.name): (kind, i)
            for kind, some in self._variables.items()
            for i, (component, variable) in enumerate(some)
        }
        self._begin()

    def _begin(self) -> None:
        """Values before the first exchange, read by the broken end of a loop: the start of the output, or the input."""
        for link in self._links:
            start = number_of(link.target[1].start)
            if start is not None and link.factor:
                kind, place = self._place[link.source[0], link.source[1].name]
                self.values[kind][place] = (start - link.offset) / link.factor
        for kind, place in self._place.values():
            start = number_of(self._variables[kind][place][1].start)
            if start is not None:
                self.values[kind][place] = np.clip(start, *_WHOLE) if kind == "Integer" else start

    def outlets(self, component: str) -> list[Outlet]:
        """What a component reads."""
        outlets = []
        feeding = {(link.source[0], link.source[1].name) for link in self._links}
        for kind, some in self._variables.items():
            own = [i for i, (name, _) in enumerate(some) if name == component]
            if own:
                variables = [some[i][1] for i in own]
                outputs = sum(variable.causality == "output" for variable in variables)
                needed = [i for i, variable in enumerate(variables) if (component, variable.name) in feeding]
                values = self.values[kind][own[0] : own[-1] + 1]
                outlets.append(Outlet(kind, variables, outputs, values, needed))
        return outlets

    def inlets(self, component: str) -> list[Inlet]:
        """What a component's inputs are set from."""
        inlets = []
        to_it = [link for link in self._links if link.target[0] == component]
        for kind in self.values:
            for before, pool in self.values.items():  # whole numbers may feed real ones
                kinds = before, kind
                links = [k for k in to_it if (representation(k.source[1]), representation(k.target[1])) == kinds]
                if links:
                    sources = np.array([self._source(link) for link in links])
                    factor, offset = (np.array([getattr(k, part) for k in links]) for part in ("factor", "offset"))
                    tables = {i: link.table for i, link in enumerate(links) if link.table}
                    inlets.append(Inlet(kind, [k.target[1] for k in links], pool, sources, factor, offset, tables))
        return inlets

    def _source(self, link: Link) -> int:
        component, variable = link.source
        return self._place[component, variable.name][1]

    def new_tables(self, rows: int) -> None:
        """Room for the rows of a run."""
        self._sources = {
            kind: np.array([i for k, i in map(self._place.__getitem__, self._recorded) if k == kind], dtype=int)
            for kind in self.values
        }
        self._tables = {kind: np.empty((rows, len(some)), DTYPES[kind]) for kind, some in self._sources.items()}
        self.rows = 0

    def record(self, row: int) -> None:
        """Copy the present values into a row."""
        for kind, table in self._tables.items():
            self.values[kind].take(self._sources[kind], out=table[row], mode="clip")
        self.rows = row + 1

    def columns(self) -> dict[str, np.ndarray]:
        """Recorded variables by ``component.variable``, as far as rows were recorded."""
        by_kind = {kind: iter(np.ascontiguousarray(table[: self.rows].T)) for kind, table in self._tables.items()}
        return {f"{c}.{v}": next(by_kind[self._place[c, v][0]]) for c, v in self._recorded}

    def units(self) -> dict[str, str | None]:
        """Units by ``component.variable``."""
        every = [pair for some in self._variables.values() for pair in some]
        return {f"{component}.{variable.name}": unit_of(variable) for component, variable in every}


def _outputs(system: System) -> list[Name]:
    return [
        (name, variable.name)
        for name, interface in system.interfaces.items()
        for variable in interface.of("output")
        if representation(variable) in DTYPES
    ]


def _requested(system: System, record: Sequence[str]) -> list[Name]:
    known = {
        f"{name}.{variable.name}": (name, variable.name)
        for name, interface in system.interfaces.items()
        for variable in interface.variables.values()
        if representation(variable) in DTYPES
    }
    found: dict[Name, None] = {}
    problems = []
    for name in record:
        names = [name] if name in known else [other for other in known if other.startswith(f"{name}[")]
        found.update(dict.fromkeys(known[other] for other in names))
        if not names:
            problems.append(f"record {name!r}: there is no such variable. Near: {near(name, known)}")
    if problems:
        raise WiringError(system.path, problems)
    return list(found)
