"""Results of a run: columns by name, and files of them.

HDF5 because Python, MATLAB (h5read) and Julia read it with what they come with or one package, and units travel along.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from ..blocks.columns import Columns, Tabular
from ..files.csv_table import write_csv
from ..files.hdf5_table import Dataset, write_hdf5
from .interface import near

_ELEMENT = re.compile(r"(.+)\[(\d+(?:,\d+)*)\]")


@dataclass(frozen=True, eq=False)
class Result(Tabular):
    """Variables over communication points.

    system: its name. time: (n,), s. columns: (n,) by ``component.variable``, float64, or int32 for Integer and Boolean
    variables. units: by the same names; None where the FMU does not say. notes: what a user should know about the run.
    partial: empty for a run that reached its end; else how far it came and why it ended.

    A row holds the values of its time; outputs of sampled FMUs are those of the sample taken then (the last row: held).
    """

    system: str
    time: np.ndarray
    columns: Mapping[str, np.ndarray]
    units: Mapping[str, str | None]
    notes: tuple[str, ...] = ()
    partial: str = ""

    def __repr__(self) -> str:
        span = f" from {self.time[0]:g} to {self.time[-1]:g} s" if len(self.time) else ""
        return f"<Result of {self.system!r}: {len(self.columns)} variables, {len(self.time)} rows{span}>"

    @property
    def names(self) -> list[str]:
        """Names of the columns, in the order of the description and its FMUs."""
        return list(self.columns)

    def __getitem__(self, name: str) -> np.ndarray:
        """(n,) of a variable; (n, k) or (n, k, m) of a vector or matrix by its name without brackets.

        Elements are numbered from 1 or, where one is numbered 0, from 0.
        """
        if name in self.columns:
            return self.columns[name]
        if name not in self._arrays:
            raise KeyError(f"{name!r} was not recorded. Near: {near(name, [*self.columns, *self._arrays])}")
        elements = [self.columns[column] for column in self._elements(name)]
        return np.stack(elements, axis=-1).reshape(-1, *self._arrays[name].shape)

    def __contains__(self, name: str) -> bool:
        return name in self.columns or name in self._arrays

    @cached_property
    def _arrays(self) -> dict[str, _Array]:
        """The vectors and matrices whose every element was recorded."""
        indices: dict[str, list[tuple[int, ...]]] = {}
        for column in self.columns:
            match = _ELEMENT.fullmatch(column)
            if match:
                indices.setdefault(match[1], []).append(tuple(map(int, match[2].split(","))))
        arrays = {name: _array(found) for name, found in indices.items() if len({len(index) for index in found}) == 1}
        return {
            name: array
            for name, array in arrays.items()
            if all(_element(name, index, array.first) in self.columns for index in np.ndindex(array.shape))
        }

    def as_array(self) -> np.ndarray:
        """Structured array (n,) with the fields ``time`` and one per column."""
        table = np.empty(len(self.time), [("time", float), *((name, c.dtype) for name, c in self.columns.items())])
        table["time"] = self.time
        for name, column in self.columns.items():
            table[name] = column
        return table

    def to_csv(self, path: str | Path) -> None:
        """Write a table with one header line (``time`` and the columns) that holds every number exactly.

        A partial result has a last line that says so, behind a #.
        """
        write_csv(path, {"time": self.time, **self.columns}, partial_remark(self.partial))

    def to_hdf5(self, path: str | Path) -> list[str]:
        """Write ``/time`` and one dataset per variable, ``/component/variable``; a vector is one dataset (n, k).

        Each dataset has the attribute ``unit`` where the FMU names one, and ``first_index`` 0 where its elements are
        numbered from 0; the file has ``system`` and ``notes``, and
        ``partial`` where the result is. Returns notes on variables whose names HDF5 cannot hold: see ``write_hdf5``.
        Raises WriteError.
        """
        variables = (
            Dataset(
                name.split(".", 1),
                self[name],
                self.units[first],
                self._arrays[name].first if name not in self.columns else 1,
            )
            for name, first in self._datasets()
        )
        attributes: dict[str, Any] = {"system": self.system, "notes": list(self.notes)}
        if self.partial:
            attributes["partial"] = self.partial
        return write_hdf5(path, attributes, chain([Dataset(["time"], self.time, "s")], variables))

    def _table(self) -> Columns:
        """Vectors as one signal each."""
        signals = {name: self[name] for name, _ in self._datasets()}
        columns = {name: [name] if name in self.columns else self._elements(name) for name in signals}
        units = {name: self.units.get(columns[name][0]) for name in signals}
        remarks = {"notes": list(self.notes), "partial": self.partial}
        return Columns(self.system, self.time, signals, columns, units, remarks)

    def _elements(self, name: str) -> list[str]:
        """Columns of a vector or matrix, row by row."""
        array = self._arrays[name]
        return [_element(name, index, array.first) for index in np.ndindex(array.shape)]

    def _datasets(self) -> Iterator[tuple[str, str]]:
        """Names of whole vectors and of other columns, in order, each with its first column."""
        written = set()
        for column in self.columns:
            match = _ELEMENT.fullmatch(column)
            is_element = match and match[1] in self._arrays and match[1] not in self.columns
            name = match[1] if match and is_element else column
            if name not in written:
                written.add(name)
                yield name, column


def partial_remark(partial: str) -> str:
    """What a table says of rows that are not all; empty for those that are."""
    return f"partial: {partial}" if partial else ""


def read_hdf5(path: str | Path) -> Result:
    """Read what ``Result.to_hdf5`` wrote. Raises ValueError for any other file."""
    columns: dict[str, np.ndarray] = {}
    units: dict[str, str | None] = {}

    def take(name: str, item: h5py.HLObject) -> None:
        if not isinstance(item, h5py.Dataset) or name == "time":
            return
        values, full_name = item[()], str(item.attrs.get("name", name.replace("/", ".", 1)))
        for index in np.ndindex(values.shape[1:]):
            column = _element(full_name, index, int(item.attrs.get("first_index", 1))) if index else full_name
            columns[column] = np.ascontiguousarray(values[(slice(None), *index)])
            units[column] = item.attrs.get("unit")

    try:
        with h5py.File(path, "r", track_order=True) as file:
            time = file["time"][()]
            file.visititems(take)
            notes = tuple(map(str, file.attrs["notes"]))
            return Result(str(file.attrs["system"]), time, columns, units, notes, str(file.attrs.get("partial", "")))
    except (OSError, KeyError, IndexError, AttributeError) as error:
        raise ValueError(f"{path}: cannot be read as a result: {error}") from error


@dataclass(frozen=True)
class _Array:
    """A vector or matrix. first: what its indices count from."""

    shape: tuple[int, ...]
    first: int


def _array(indices: Sequence[tuple[int, ...]]) -> _Array:
    first = 0 if any(0 in index for index in indices) else 1
    return _Array(tuple(max(along) + 1 - first for along in zip(*indices, strict=True)), first)


def _element(name: str, index: tuple[int, ...], first: int) -> str:
    """Name of the element with an index that counts from 0. first: what the indices in names count from."""
    return f"{name}[{','.join(str(i + first) for i in index)}]"
