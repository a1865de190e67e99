"""Limits files (TOML): what they hold, and everything that can be wrong with one, by line.

The schema, for editors too, is limits.schema.json beside this file.
"""

from __future__ import annotations

import json
import os
import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal

from ..cosim.units import Unit, UnitError, quantity
from .expressions import Expression, ExpressionError, parse
from .statistics import NAMES

SUFFIX = ".limits.toml"
_NEEDS = {"nees": "sigma", "settling_time": "band"}
_REQUIRED = re.compile(
    r"(?P<quantity>.+)\.(?P<statistic>{})\s*(?P<sign><=?|>=?)\s*(?P<bound>[^<>=]+)".format("|".join(NAMES))
)


class LimitsError(ValueError):
    """A limits file, or a limit, cannot be used; the message names file, line, fault and what to do."""


@dataclass(frozen=True)
class Bound:
    """A number and its unit, None where it is bare."""

    value: float
    unit: str | None

    def __str__(self) -> str:
        return f"{self.value:g}" + (f" {self.unit}" if self.unit else "")


@dataclass(frozen=True)
class Window:
    """Rows to look at. begin, end: s, from the start of the run or the first row in which ``after`` holds."""

    begin: float = 0.0
    end: float | None = None
    after: Expression | None = None
    where: Expression | None = None


@dataclass(frozen=True)
class Limit:
    """One line of a verdict.

    Either a statistic of a quantity with a bound, or a condition (kind always or eventually) that holds in every row,
    or comes true within some seconds of every row, in which ``when`` holds. runs, confidence: parts of 1.
    """

    name: str
    kind: Literal["statistic", "always", "eventually"]
    quantity: Expression
    window: Window
    statistic: str = ""
    sigma: Expression | None = None
    band: Bound | None = None
    at_most: Bound | None = None
    at_least: Bound | None = None
    when: Expression | None = None
    within: float | None = None
    runs: float = 1.0
    confidence: float | None = None
    reason: str = ""

    @property
    def expressions(self) -> list[Expression]:
        """All that is looked at."""
        parts = (self.quantity, self.sigma, self.when, self.window.after, self.window.where)
        return [part for part in parts if part is not None]


@dataclass(frozen=True)
class Limits:
    """A limits file. path: None for limits of the command line. stop_time, step: s."""

    limits: Sequence[Limit]
    path: Path | None = None
    system: str | None = None
    stop_time: float | None = None
    step: float | None = None
    seeds: int | None = None
    parameters: Mapping[str, Any] = field(default_factory=dict)


def read_limits(path: str | os.PathLike[str]) -> Limits:
    """Raises LimitsError and OSError."""
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
        content = tomllib.loads(text)
    except UnicodeDecodeError:
        raise LimitsError(f"{path}: not a text file in UTF-8") from None
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise LimitsError(f"{path}: not TOML: {error}") from None
    _check_form(path, text, content)
    found: list[Limit] = []
    for place, entry in enumerate(content["limit"]):
        try:
            limit = _limit(entry)
        except (LimitsError, ExpressionError, UnitError) as error:
            key = next(
                (key for key, value in entry.items() if isinstance(value, str) and repr(value) in str(error)), ""
            )
            raise LimitsError(
                f"{path}, {_where(text, ['limit', place, key] if key else ['limit', place])}: {error}"
            ) from None
        if limit.name in {other.name for other in found}:
            raise LimitsError(f"{path}, {_where(text, ['limit', place])}: two limits are called {limit.name!r}")
        found.append(limit)
    try:
        seconds = {name: _number(content[name], "s") for name in ("stop_time", "step") if name in content}
    except (ValueError, UnitError) as error:
        raise LimitsError(f"{path}: {error}") from None
    return Limits(
        tuple(found),
        path,
        content.get("system"),
        seconds.get("stop_time"),
        seconds.get("step"),
        content.get("seeds"),
        content.get("parameters", {}),
    )


def required(text: str) -> Limit:
    """A limit of the command line: ``plumb.tilt.max < 2 deg``, or a condition that always holds. Raises LimitsError."""
    match = _REQUIRED.fullmatch(text.strip())
    try:
        if not match:
            return _limit({"always": text})
        bound = "at_most" if "<" in match["sign"] else "at_least"
        return _limit({"quantity": match["quantity"], "statistic": match["statistic"], bound: match["bound"]})
    except (ExpressionError, UnitError) as error:
        raise LimitsError(f"--require: {error}") from None


def _check_form(path: Path, text: str, content: Mapping[str, Any]) -> None:
    """Raises LimitsError for the first thing that the schema does not allow."""
    from jsonschema import Draft202012Validator  # takes longer to load than most of what is here takes to run

    schema = json.loads(files(__package__).joinpath("limits.schema.json").read_text(encoding="utf-8"))
    for error in sorted(
        Draft202012Validator(schema).iter_errors(content), key=lambda error: list(map(str, error.path))
    ):
        place = list(error.path)
        if error.validator == "additionalProperties":
            known = list(error.schema["properties"])
            unknown = next(key for key in error.instance if key not in known)
            close = get_close_matches(unknown, known, 1)
            meant = f"; did you mean {close[0]}?" if close else f"; there is {', '.join(known)}"
            raise LimitsError(f"{path}, {_where(text, [*place, unknown])}: no key is called {unknown!r}{meant}")
        if error.validator == "required":
            raise LimitsError(f"{path}: has no [[limit]]")
        if error.validator == "enum":
            close = get_close_matches(str(error.instance), error.validator_value, 1)
            meant = f"; did you mean {close[0]}?" if close else ""
            there = ", ".join(error.validator_value)
            raise LimitsError(f"{path}, {_where(text, place)}: {error.instance!r} is not one of {there}{meant}")
        if error.validator == "pattern":
            raise LimitsError(f'{path}, {_where(text, place)}: {error.instance!r} is no percentage, as "95 %"')
        raise LimitsError(f"{path}, {_where(text, place)}: {error.message}")


def _where(text: str, place: Sequence[str | int]) -> str:
    """Line and column of a key: ["limit", 2, "at_most"] is the key of the third [[limit]]."""
    lines = text.splitlines()
    first, last = 0, len(lines)
    if len(place) > 1 and isinstance(place[1], int):
        heads = [i for i, line in enumerate(lines) if re.match(r"\s*\[\[\s*limit\s*\]\]", line)]
        if place[1] < len(heads):
            first = heads[place[1]]
            last = heads[place[1] + 1] if place[1] + 1 < len(heads) else len(lines)
    key = next((part for part in reversed(place) if isinstance(part, str)), "")
    for i in range(first, last):
        match = re.match(rf"\s*\[*\s*[\"']?({re.escape(key)})\b", lines[i])
        if match:
            return f"line {i + 1}, column {match.start(1) + 1}"
    return f"line {first + 1}"


def _limit(entry: Mapping[str, Any]) -> Limit:
    """Raises LimitsError, ExpressionError and UnitError."""
    kinds = [kind for kind in ("quantity", "always", "eventually") if kind in entry]
    if len(kinds) != 1:
        raise LimitsError("give one of quantity (with a statistic), always, eventually")
    kind = kinds[0]
    statistic = entry.get("statistic", "")
    bounds = {name: _bound(entry[name]) for name in ("at_most", "at_least") if name in entry}
    if kind == "quantity":
        _check_statistic(entry, statistic, bounds)
    else:
        misplaced = [key for key in ("statistic", "sigma", "band", *bounds) if key in entry]
        if misplaced:
            raise LimitsError(f"{misplaced[0]} goes with quantity, not with {kind}")
    for key, with_ in (("within", "eventually"), ("confidence", "runs")):
        if key in entry and with_ not in entry:
            raise LimitsError(f"{key} goes with {with_}")
    if "when" in entry and kind == "quantity":
        raise LimitsError("when goes with always and eventually; for a statistic give where")
    parsed = {key: parse(entry[key]) for key in ("sigma", "when", "after", "where") if key in entry}
    window = Window(
        _number(entry.get("from", 0.0), "s"),
        _number(entry["to"], "s") if "to" in entry else None,
        parsed.get("after"),
        parsed.get("where"),
    )
    if window.end is not None and window.end <= window.begin:
        raise LimitsError(f"the window ends at {window.end:g} s and begins at {window.begin:g} s")
    return Limit(
        entry.get("name") or _name(entry, kind, bounds),
        "statistic" if kind == "quantity" else kind,  # type: ignore[arg-type]
        parse(entry[kind]),
        window,
        statistic,
        parsed.get("sigma"),
        _bound(entry["band"]) if "band" in entry else None,
        bounds.get("at_most"),
        bounds.get("at_least"),
        parsed.get("when"),
        _number(entry["within"], "s") if "within" in entry else None,
        _part(entry.get("runs", "100 %")),
        _part(entry["confidence"]) if "confidence" in entry else None,
        entry.get("reason", ""),
    )


def _check_statistic(entry: Mapping[str, Any], statistic: str, bounds: Mapping[str, Bound]) -> None:
    if not statistic:
        raise LimitsError(f"which statistic of {entry['quantity']!r}? There is {', '.join(NAMES)}")
    if bool(bounds) == (statistic == "finite"):
        raise LimitsError("finite has no bound" if bounds else "give at_most, at_least or both")
    for name, key in _NEEDS.items():
        if (key in entry) != (statistic == name):
            raise LimitsError(f"{name} needs {key}" if statistic == name else f"{key} goes with {name}")


def _name(entry: Mapping[str, Any], kind: str, bounds: Mapping[str, Bound]) -> str:
    """What a limit says, for one without a name."""
    if kind == "quantity":
        signs = [f"{'≤' if name == 'at_most' else '≥'} {bound}" for name, bound in bounds.items()]
        text = f"{entry['statistic']} of {entry['quantity']} {' and '.join(signs)}".strip()
    else:
        text = f"{kind} {entry[kind]}" + (f" within {entry['within']}" if "within" in entry else "")
    for key in ("when", "after", "where"):
        text += f" {key} {entry[key]}" if key in entry else ""
    return text


def _bound(value: str | float) -> Bound:
    if not isinstance(value, str):
        return Bound(float(value), None)
    match = re.fullmatch(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(\S.*?)?\s*", value)
    if not match:
        raise LimitsError(f"{value!r} is no number with a unit, as '2 deg'")
    return Bound(float(match[1]), match[2])


def _number(value: str | float, unit: str) -> float:
    """In this unit; a bare number is in it already."""
    bound = _bound(value)
    return quantity(f"{bound.value!r} {bound.unit or unit}", Unit(unit))


def _part(text: str) -> float:
    part = float(text.strip().rstrip("%")) / 100
    if not 0 < part <= 1:
        raise LimitsError(f"{text!r} is not between 0 and 100 %")
    return part


def components(limits: Iterable[Limit]) -> set[str]:
    """Names of the components that limits look at."""
    names = (name for limit in limits for expression in limit.expressions for name in expression.names)
    return {name.partition(".")[0] for name in names if "." in name}
