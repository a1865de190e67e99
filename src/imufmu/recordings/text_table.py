"""Tables of numbers in text files, however they were written: CSV of any make.

Found out by looking at the first lines: the encoding, lines before the header (comments, ``sep=``, a device's facts),
what separates the columns (comma, semicolon, tab, bar, spaces), whether numbers have a decimal comma, where the header
is, and whether a line of units follows it.
"""

from __future__ import annotations

import codecs
import csv
import io
import itertools
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from ..blocks.units import factor
from .faults import RecordingError, listed

_LOOKED_AT = 200  # lines at most before the first sample
_SAMPLES = 8  # rows that are looked at
_NO_TEXT = "not a text file; save the table as CSV in UTF-8"
_COMMENT = ("#", "//", "%")
_SEPARATORS = ",;\t|"
_NUMBER = r"[-+]?(\d+([.,]\d*)?|[.,]\d+)([eE][-+]?\d+)?"
_UNIT_IN_NAME = re.compile(
    r"^(?P<name>.*?)\s*(?:\[(?P<a>[^\[\]]*)\]|\((?P<b>[^()]*(?:\([^()]*\))?)\)|\{(?P<c>[^{}]*)\})$"
)


@dataclass(frozen=True)
class TextTable:
    """What the first lines of a file tell of it. Rows are read when columns are chosen.

    names: of the columns, as in the file, without the unit in brackets; or their numbers from 1 where the file has no
    header. units: by column, None where the file does not tell. full_names: with the brackets. preamble: the lines
    before the header. first_row: number of lines before the first row of numbers.
    """

    path: Path
    encoding: str
    separator: str
    decimal_comma: bool
    names: list[str]
    units: list[str | None]
    full_names: list[str]
    preamble: list[str]
    header_line: int
    first_row: int
    has_header: bool
    samples: list[list[str]] = field(default_factory=list)

    @property
    def description(self) -> str:
        """How the file is written, for a person."""
        separator = {",": "commas", ";": "semicolons", "\t": "tabs", "|": "bars", " ": "spaces"}[self.separator]
        return f"{len(self.names)} columns between {separator}" + (", decimal comma" if self.decimal_comma else "")

    def numbers(self, places: Sequence[int]) -> tuple[np.ndarray, list[int]]:
        """Values (n, k) of the columns at these places, NaN for an empty cell, and the line of each row, from 1."""
        rows, lines = [], []
        width = len(self.names)
        for line, cells in self._rows():
            if len(cells) == width + 1 and not cells[-1].strip():
                cells = cells[:-1]
            if len(cells) == width:
                texts = [cells[place] for place in places]
                try:
                    rows.append([float(text) for text in texts])
                except ValueError:
                    rows.append([self._number(cells[place], line, place) for place in places])
                lines.append(line)
            elif "".join(cells).strip():
                what = "but the header names" if self.has_header else "but the first row has"
                raise RecordingError(f"{self.path}, line {line}: {len(cells)} fields, {what} {width}")
        return np.array(rows, float).reshape(len(rows), len(places)), lines

    def _rows(self) -> Iterator[tuple[int, list[str]]]:
        with open(self.path, newline="", encoding=self.encoding) as file:
            line = self.first_row + 1
            try:
                for _ in range(self.first_row):
                    file.readline()
                reader = _reader(file, self.separator)
                for cells in reader:
                    if cells and not cells[0].lstrip().startswith(_COMMENT):
                        yield line, cells
                    line = self.first_row + reader.line_num + 1
            except UnicodeDecodeError:
                raise RecordingError(f"{self.path}: {_NO_TEXT}") from None
            except csv.Error as error:
                raise RecordingError(f"{self.path}, after line {line}: not a CSV table: {error}") from None

    def _number(self, cell: str, line: int, place: int) -> float:
        text = cell.strip()
        try:
            return float(text.replace(",", ".") if self.decimal_comma else text) if text else np.nan
        except ValueError:
            if text.lower() in ("na", "n/a", "null", "none", "-"):
                return np.nan
            if (seconds := _seconds(text)) is not None:
                return seconds
            raise RecordingError(
                f"{self.path}, line {line}, column {self.full_names[place]!r}: {listed([cell])} is not a number"
            ) from None


def read_table(path: Path) -> TextTable:
    """Look at the first lines of a text file. Raises RecordingError and OSError."""
    encoding = _encoding(path)
    try:
        with open(path, newline="", encoding=encoding) as file:
            head = list(itertools.islice(file, _LOOKED_AT))
    except UnicodeDecodeError:
        raise RecordingError(f"{path}: {_NO_TEXT}") from None
    if any(len(line) > csv.field_size_limit() for line in head):
        raise RecordingError(f"{path}, line 1: not a CSV table: a line of {max(map(len, head))} characters")
    lines = [line.strip("\r\n") for line in head]
    told = next(
        (match[1] for line in lines[:3] if (match := re.fullmatch(r'"?sep=([,;|\t ])"?,*', line.strip("\ufeff")))), None
    )
    separator = told or _separator(lines)
    header, units_row, first = _layout(lines, separator)
    width = len(_cells(lines[first], separator)) if first < len(lines) else 0
    if header is None:
        full_names = [str(i + 1) for i in range(width)]
    else:
        full_names = [name.strip() for name in _cells(_uncommented(lines[header]), separator)]
    while len(full_names) > 1 and not full_names[-1] and len(full_names) >= width:
        full_names.pop()
    split = [_UNIT_IN_NAME.match(name) for name in full_names]
    names = [
        match["name"] if match and match["name"] and not _is_index(match) else name
        for match, name in zip(split, full_names, strict=True)
    ]
    units: list[str | None] = [
        next((match[g] for g in "abc" if match[g] is not None), None) if match and not _is_index(match) else None
        for match in split
    ]
    if units_row is not None:
        written = [*(cell.strip() for cell in _cells(lines[units_row], separator)), *[""] * len(names)]
        units = [cell or told_unit for cell, told_unit in zip(written, units, strict=False)]
    samples = [_cells(line, separator) for line in lines[first:] if _is_row(line, separator)][:_SAMPLES]
    numbers = [cell.strip() for row in samples for cell in row]
    return TextTable(
        path,
        encoding,
        separator,
        separator != "," and any(re.fullmatch(r"[-+]?\d*,\d+([eE][-+]?\d+)?", cell) for cell in numbers),
        names,
        units,
        full_names,
        [line for i, line in enumerate(lines[:first]) if line.strip() and i not in (header, units_row)],
        0 if header is None else header + 1,
        first,
        header is not None,
        samples,
    )


def _seconds(text: str) -> float | None:
    """Seconds since 1970 of a date with a time, since midnight of a time; None for what is neither."""
    try:
        if re.match(r"\d+-\d+-\d+[T ]", text):
            date = datetime.fromisoformat(text)
            return (date if date.tzinfo else date.replace(tzinfo=UTC)).timestamp()
        time = datetime.fromisoformat(f"1970-01-01T{text}+00:00") if re.match(r"\d+:\d+:\d+", text) else None
    except (ValueError, OverflowError):
        return None
    return time.timestamp() if time else None


def _encoding(path: Path) -> str:
    """By the marks at its start, else UTF-8, else Western European. Raises RecordingError for what is no text."""
    with open(path, "rb") as file:
        start = file.read(1 << 16)
    if start.startswith((b"\xff\xfe", b"\xfe\xff")) and not start.startswith(b"\xff\xfe\0\0"):
        try:
            start[: len(start) // 2 * 2].decode("utf-16")
            return "utf-16"
        except UnicodeDecodeError:
            pass
    controls = sum(byte < 9 or 13 < byte < 32 for byte in start)
    try:
        codecs.getincrementaldecoder("utf-8")().decode(start)  # the last character may be cut
        fits = "utf-8-sig"
    except UnicodeDecodeError:
        fits = "cp1252"
        try:
            start.decode(fits)
        except UnicodeDecodeError:
            fits = "latin-1"
    unusual = sum(byte > 127 for byte in start) if fits != "utf-8-sig" else 0
    if controls or unusual > len(start) / 50 + 12:
        raise RecordingError(f"{path}: {_NO_TEXT}")
    return fits


def _reader(lines: Iterator[str] | io.TextIOBase, separator: str) -> csv._reader:  # type: ignore[name-defined]
    return csv.reader(lines, delimiter=separator, skipinitialspace=separator == " ")


def _cells(line: str, separator: str) -> list[str]:
    try:
        return next(iter(csv.reader([line.strip() if separator == " " else line], delimiter=separator,
                                    skipinitialspace=separator == " ")), [])  # fmt: skip
    except csv.Error:
        return [line]


def _separator(lines: Sequence[str]) -> str:
    """The one that splits most lines into the same number of fields, three or more; a comma if none does."""
    plain = [line for line in lines if line.strip() and not line.lstrip().startswith(_COMMENT)][-60:]
    best, most = ",", (0, 0)
    for separator in (*_SEPARATORS, " "):
        counts = [len(_cells(line, separator)) for line in plain]
        usual = max(set(counts), key=counts.count, default=0)
        numbers = sum(_is_row(line, separator) for line in plain)
        if usual > 1 and (numbers, counts.count(usual)) > most:
            best, most = separator, (numbers, counts.count(usual))
    return best


def _is_row(line: str, separator: str) -> bool:
    """Whether a line holds numbers: two at least, and more of them than words."""
    cells = [cell.strip() for cell in _cells(line, separator)]
    if separator == ",":
        numbers = sum(bool(re.fullmatch(_NUMBER.replace("[.,]", "[.]"), cell)) for cell in cells)
    else:
        numbers = sum(bool(re.fullmatch(_NUMBER, cell)) for cell in cells)
    words = sum(bool(cell) and cell.lower() not in ("nan", "inf") for cell in cells) - numbers
    return numbers >= 2 and numbers >= words


def _layout(lines: Sequence[str], separator: str) -> tuple[int | None, int | None, int]:
    """Lines (from 0) of names and of units, None where there is none, and the number of lines before the rows."""
    numbers = (i for i, line in enumerate(lines) if not _is_comment(line) and _is_row(line, separator))
    first = next(numbers, len(lines))
    plain = [i for i in range(first) if not _is_comment(lines[i]) and _words(lines[i], separator) > 1]
    if not plain:
        width = len(_cells(lines[first], separator)) if first < len(lines) else 0
        named = [i for i in range(first) if len(_cells(lines[i], separator)) == width > 1]
        return (named[-1], None, first) if named else (None, None, first)
    if first == len(lines):
        return plain[0], None, plain[0] + 1
    names, last = (plain[-2] if len(plain) > 1 else None), plain[-1]
    if names is not None and len(_cells(lines[names], separator)) == len(_cells(lines[last], separator)):
        cells = [cell.strip() for cell in _cells(lines[last], separator) if cell.strip()]
        if any(factor(cell, unit) for cell in cells for unit in ("rad/s", "m/s2")):
            return names, last, last + 1
    return last, None, last + 1


def _is_comment(line: str) -> bool:
    return line.lstrip().startswith(_COMMENT) or bool(re.fullmatch(r'"?sep=.*', line.strip()))


def _words(line: str, separator: str) -> int:
    """Number of cells that are no numbers, and not empty."""
    cells = (cell.strip() for cell in _cells(line, separator))
    return sum(bool(cell) and cell.lower() != "nan" and not re.fullmatch(_NUMBER, cell) for cell in cells)


def _uncommented(line: str) -> str:
    """A header behind a comment sign without it."""
    return re.sub(r"^\s*(#+|//|%)\s*", "", line)


def _is_index(match: re.Match[str]) -> bool:
    """Whether the brackets hold an axis, as gyro[1], and no unit."""
    inside = next((match[g] for g in "abc" if match[g] is not None), "")
    return bool(re.fullmatch(r"\s*([0-9]|[xyz])\s*", inside, re.IGNORECASE)) and match["a"] is not None
