"""Tables of numbers as CSV files."""

from __future__ import annotations

import csv
import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from .atomic import atomic_write


def write_csv(path: str | os.PathLike[str], columns: Mapping[str, Any], remark: str = "") -> None:
    """Write a table that reads back bit for bit (17 digits), whole or not at all.

    columns: (n,), or (n, k) for the columns name[1] .. name[k], by name; whole-number arrays are written as such.
    remark: a last line, which # tells from the rows.
    Raises ValueError if the lengths differ, WriteError if the file cannot be written.
    """
    flat: dict[str, np.ndarray] = {}
    for name, values in columns.items():
        array = np.asarray(values)
        if array.ndim not in (1, 2):
            raise ValueError(f"{name}: shape {array.shape}, expected (n,) or (n, k)")
        flat |= {name: array} if array.ndim == 1 else {f"{name}[{i + 1}]": c for i, c in enumerate(array.T)}
    lengths = {name: len(column) for name, column in flat.items()}
    if len(set(lengths.values())) != 1:
        raise ValueError(f"{path}: columns must be of one length, got {lengths}")
    table = np.rec.fromarrays(list(flat.values()))
    formats = ["%d" if column.dtype.kind in "iub" else "%.17g" for column in flat.values()]
    with atomic_write(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerow(flat)
        np.savetxt(file, table, fmt=",".join(formats))
        if remark:
            file.write(f"# {' '.join(remark.split())}\n")
