"""Values over time in the hands of other tools: pandas, xarray, a figure, a page of a notebook."""

from __future__ import annotations

import importlib
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from html import escape
from typing import Any

import numpy as np

_SHOWN = 12  # signals in a notebook


@dataclass(frozen=True)
class Columns:
    """What a table holds. time: (n,), s. signals: (n, ...) by name, with their units where there are such.

    columns: names of the scalars of each signal, by its name, in the order of its elements. remarks: by name, what else
    is to be told, left out where empty.
    """

    title: str
    time: np.ndarray
    signals: Mapping[str, np.ndarray]
    columns: Mapping[str, Sequence[str]]
    units: Mapping[str, str | None]
    remarks: Mapping[str, Any] = field(default_factory=dict)

    def scalars(self) -> dict[str, tuple[str, np.ndarray]]:
        """Signal and values (n,) by name of a column."""
        return {
            column: (name, values)
            for name, array in self.signals.items()
            for column, values in zip(self.columns[name], array.reshape(len(self.time), -1).T, strict=True)
        }


class Tabular(ABC):
    """Anything with ``_table()``, for tools that people work with."""

    @abstractmethod
    def _table(self) -> Columns:
        """What there is."""

    def to_pandas(self) -> Any:
        """A pandas DataFrame: one column per scalar, ``gyro[1]``, over the index ``time`` (s).

        ``attrs["units"]`` has the unit of every column that has one. Raises ImportError where pandas is missing.
        """
        pandas = _library("pandas", "to_pandas")
        table = self._table()
        scalars = table.scalars()
        frame = pandas.DataFrame(
            {c: values for c, (_, values) in scalars.items()}, pandas.Index(table.time, name="time")
        )
        frame.attrs["units"] = {c: table.units[name] for c, (name, _) in scalars.items() if table.units.get(name)}
        frame.attrs.update(_told(table))
        return frame

    def to_xarray(self) -> Any:
        """An xarray Dataset over the dimension ``time`` (s), each signal an array with the attribute ``units``.

        A vector of three elements has the second dimension ``element_3``, a matrix of three by two ``row_3`` and
        ``column_2``. Raises ImportError where xarray is missing.
        """
        xarray = _library("xarray", "to_xarray")
        table = self._table()
        arrays = {
            name: (_dimensions(values), values, {"units": table.units[name]} if table.units.get(name) else {})
            for name, values in table.signals.items()
        }
        time = ("time", table.time, {"units": "s"})
        return xarray.Dataset(arrays, {"time": time}, _told(table))

    def plot(self, *names: str) -> Any:
        """Draw signals, or elements of them such as ``gyro[1]``, over time: one panel per unit, angles in degrees.

        Returns the figure (matplotlib), which a notebook shows, and which has savefig(path). Raises KeyError for a name
        that is not there.
        """
        from .drawing import draw  # matplotlib takes longer to load than most of what is drawn takes to run

        table = self._table()
        return draw(table.time, _lines(table, names))

    def _repr_html_(self) -> str:
        """A short table for notebooks."""
        table = self._table()
        head = "".join(f"<th>{text}</th>" for text in ("signal", "unit", "elements", "least", "greatest"))
        rows = []
        for name, values in list(table.signals.items())[:_SHOWN]:
            least, greatest = (f"{f.reduce(values, axis=None):.6g}" if values.size else "" for f in (np.fmin, np.fmax))
            size = values[0].size if len(values) else len(table.columns[name])
            cells = (name, table.units.get(name) or "", str(size), least, greatest)
            rows.append("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>")
        more = len(table.signals) - len(rows)
        told = [f"{name}: {text}" for name, text in _told(table).items() if name == "partial"]
        told += [f"and {more} more signals"] if more > 0 else []
        below = "".join(f"<p>{escape(text)}</p>" for text in told)
        return f"<p>{escape(repr(self))}</p><table><tr>{head}</tr>{''.join(rows)}</table>{below}"


def element_names(name: str, shape: Sequence[int]) -> list[str]:
    """Names of the scalars of a signal of this shape, counted from 1; of a scalar its own."""
    return [f"{name}[{','.join(str(i + 1) for i in index)}]" if index else name for index in np.ndindex(*shape)]


def _dimensions(values: np.ndarray) -> tuple[str, ...]:
    if values.ndim == 3:
        return "time", f"row_{values.shape[1]}", f"column_{values.shape[2]}"
    return ("time", *(f"element_{size}" for size in values.shape[1:]))


def _told(table: Columns) -> dict[str, Any]:
    return {"title": table.title} | {name: remark for name, remark in table.remarks.items() if remark}


def _lines(table: Columns, names: Sequence[str]) -> list[tuple[str, str, np.ndarray]]:
    """Label, unit and values of every line to draw. Raises KeyError."""
    scalars = table.scalars()
    known = list(dict.fromkeys([*table.signals, *scalars]))
    if not names:
        raise KeyError(f"name what to draw, such as {', '.join(map(repr, list(table.signals)[:2]))}")
    lines = []
    for name in names:
        columns = table.columns.get(name) or ([name] if name in scalars else [])
        if not columns:
            near = ", ".join(get_close_matches(name, known, 4, 0.3)) or ", ".join(known[:4])
            raise KeyError(f"{name!r} is not there. Near: {near}")
        lines += [(column, table.units.get(scalars[column][0]) or "", scalars[column][1]) for column in columns]
    return lines


def _library(name: str, wanted_by: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise ImportError(
            f'{wanted_by} needs {name}, which is not installed: pip install "imufmu[notebook]"'
        ) from error
