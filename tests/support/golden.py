"""Reference vectors: inputs and outputs of independent implementations of the papers.

``golden/<case>_in.csv`` and ``golden/<case>_out.csv`` hold 17 digits under one header line; ``golden/cases.json`` holds
the parameters of every case.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np

from support.places import ROOT

FOLDER = ROOT / "tests" / "golden"
TOLERANCE = 1e-9  # absolute and relative; rounding alone moves these filters by less than 1e-12 over such records


@dataclass(frozen=True)
class Case:
    """One reference run. inputs, outputs: (n,) by column name, SI units."""

    parameters: dict[str, Any]
    inputs: dict[str, np.ndarray]
    outputs: dict[str, np.ndarray]


def names(paper: str) -> list[str]:
    """Names of all cases of one paper."""
    return [name for name in _parameters() if name.startswith(f"{paper}_")]


def load(name: str) -> Case:
    """The case of this name."""
    return Case(_parameters()[name], _columns(f"{name}_in.csv"), _columns(f"{name}_out.csv"))


def columns(table: dict[str, np.ndarray], prefix: str, count: int) -> np.ndarray:
    """Columns prefix0, prefix1, ... of a table, (n, count)."""
    return np.column_stack([table[f"{prefix}{i}"] for i in range(count)])


def assert_equal(actual: np.ndarray, expected: np.ndarray, what: str) -> None:
    """Every element agrees within TOLERANCE."""
    np.testing.assert_allclose(actual, expected, rtol=TOLERANCE, atol=TOLERANCE, err_msg=what)


def _parameters() -> dict[str, dict[str, Any]]:
    return json.loads((FOLDER / "cases.json").read_text(encoding="utf-8"))


def _columns(file: str) -> dict[str, np.ndarray]:
    with (FOLDER / file).open(encoding="utf-8") as lines:
        header = next(lines).strip().split(",")
        rows = np.loadtxt(lines, delimiter=",", ndmin=2)
    return dict(zip(header, rows.T, strict=True))
