"""Docstrings as HTML: paragraphs, tables of symbols, formulas with their numbers, references with links.

Indented paragraphs are shown apart. One whose lines all have columns is a table, one with formulas becomes MathML line
by line, and anything else stays as it was typed.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from html import escape

from .mathml import GREEK, FormulaError, formula, symbol

WIDTH = 120  # of the sources: a line that ends well before ends a paragraph
INDENT = 4
_OPENING = 14  # columns before a text that begins behind its keyword

_COLUMN_GAP = re.compile(r"\s{2,}")
_NUMBER = re.compile(r"\s{2,}(\(\d+\w?\)(?:, \(\d+\w?\))*|\[\d+, \(\d+\)\])$")
_HEADER_WORDS = {"here", "symbol", "paper", "unit", "meaning", "section"}
_REFERENCE = re.compile(r"\[(\d+)\] ")
_DOI = re.compile(r"\bdoi:(10\.[^\s<>]*[^\s<>.,;:)])")
_VARIABLE = re.compile(r"(?<![\w.])([xup]\.)?\b([A-Za-z]\w*(?(1)|_\w+))\b")  # x.P, u.gyro, or with an underscore
_SYMBOL = re.compile(
    rf"(?<![\w./&;-])(?:{'|'.join(sorted(GREEK))}|[A-Za-z](?=_|\^\d))(?:_[A-Za-z0-9]+(?:-\d)?)*'*(?:\^(\d))?(?![\w(]|\.\w)"
)


def section(text: str, code: Collection[str] = ()) -> str:
    """A docstring as HTML. code: names that are variables of the block, to be set as code."""
    return "\n".join(_part(part, code) for part in _parts(text))


def paragraphs(text: str) -> list[str]:
    """Paragraphs of a text for users: parted by empty lines, and where a line ends though a word would have fit."""
    found: list[list[str]] = [[]]
    lines = text.splitlines() or [""]
    for line, following in zip(lines, [*lines[1:], ""], strict=True):
        if line.strip():
            found[-1].append(line.strip())
        next_word = following.split()[0] if following.split() else ""
        room = WIDTH - len(line) - (_OPENING if line is lines[0] else 2)
        if not line.strip() or (line.endswith((".", ":")) and len(next_word) < room):
            found.append([])
    return [" ".join(lines) for lines in found if lines]


def words(text: str, code: Collection[str] = ()) -> str:
    """Running text: code, emphasis, links and single symbols in it."""

    def drawn(match: re.Match[str]) -> str:
        name = match[0].split("^")[0]
        if name in code:
            return f"<code>{match[0]}</code>"
        power = f"^{match[1]}" if match[1] else ""
        return formula(name + power) if power else f"<math>{symbol(name)}</math>"

    pieces = []
    for i, piece in enumerate(re.split(r"``?([^`]+)``?", text)):
        if i % 2:
            pieces.append(f"<code>{escape(piece)}</code>")
            continue
        plain = escape(piece, quote=False)
        plain = _VARIABLE.sub(lambda m: f"<code>{m[0]}</code>" if m[1] or m[2] in code else m[0], plain)
        plain = "".join(
            part if part.startswith("<code>") else _SYMBOL.sub(drawn, part)
            for part in re.split(r"(<code>.*?</code>)", plain)
        )
        plain = re.sub(r"(?<=[\w)])\^(\d)", r"<sup>\1</sup>", plain)
        plain = re.sub(r"\*\*?([A-Za-z][^*]*?)\*\*?", r"<em>\1</em>", plain)
        pieces.append(_DOI.sub(r'<a href="https://doi.org/\1">doi:\1</a>', plain))
    return "".join(pieces)


def _parts(text: str) -> Iterator[list[str]]:
    """Runs of lines that are all indented, or all not; a reference keeps its hanging lines."""
    run: list[str] = []
    for line in [*text.splitlines(), ""]:
        hanging = bool(run and _REFERENCE.match(run[0]))
        changes = bool(run) and not hanging and _is_indented(line) != _is_indented(run[0])
        if run and (not line.strip() or changes):
            yield run
            run = []
        if line.strip():
            run.append(line)


def _is_indented(line: str) -> bool:
    return line.startswith(" " * INDENT)


def _part(lines: list[str], code: Collection[str]) -> str:
    if _REFERENCE.match(lines[0]):
        return _references(lines)
    if not _is_indented(lines[0]):
        return f"<p>{words(' '.join(line.strip() for line in lines), code)}</p>"
    shift = min(len(line) - len(line.lstrip()) for line in lines)
    lines = [line[shift:].rstrip() for line in lines]
    return (
        _matrix(lines) or _table(lines, code) or _formulas(lines, code) or f"<pre>{escape(chr(10).join(lines))}</pre>"
    )


def _references(lines: list[str]) -> str:
    entries: list[str] = []
    for line in lines:
        if _REFERENCE.match(line):
            entries.append(line)
        else:
            entries[-1] += f" {line.strip()}"
    return "".join(f'<p class="reference">{words(entry)}</p>' for entry in entries)


def _table(lines: list[str], code: Collection[str]) -> str:
    """Columns as in the first line: a header, or the first row of a table without one. Empty where it is no table."""
    header = bool(_HEADER_WORDS & set(_COLUMN_GAP.split(lines[0])))
    if any(_NUMBER.search(line) for line in lines):
        return ""
    if not header and not all(len(_COLUMN_GAP.split(line)) > 1 and "=" not in line for line in lines):
        return ""
    starts = [0, *(match.end() for match in _COLUMN_GAP.finditer(lines[0]))]
    rows: list[list[str]] = []
    for line in lines:
        cells = _cells(line, starts)
        if rows and not cells[0] and line.startswith("  "):  # goes on with the row before
            rows[-1] = [f"{a} {b}".strip() for a, b in zip(rows[-1], cells, strict=True)]
        else:
            rows.append(cells)
    titles = rows.pop(0) if header else [""] * len(starts)
    head = f"<tr>{''.join(f'<th>{escape(title)}</th>' for title in titles)}</tr>" if header else ""
    drawn = [[_cell(cell, i, titles[i], code) for i, cell in enumerate(row)] for row in rows]
    body = "".join(f"<tr>{''.join(f'<td>{cell}</td>' for cell in row)}</tr>" for row in drawn)
    return f'<div class="wide"><table class="symbols">{head}{body}</table></div>'


def _cells(line: str, starts: list[int]) -> list[str]:
    """Text by column: by the gaps where there are as many, else by where the columns start, if no cell runs over."""
    pieces = list(re.finditer(r"\S+(?: \S+)*", line))
    if len(pieces) == len(starts):
        return [piece[0] for piece in pieces]
    ends = [*starts[1:], len(line)]
    if all(start == 0 or start >= len(line) or line[start - 1] == " " for start in starts):
        return [line[start:end].strip() for start, end in zip(starts, ends, strict=True)]
    cells = [""] * len(starts)
    for piece in pieces:
        column = max(i for i, start in enumerate(starts) if start <= piece.start())
        cells[column] = f"{cells[column]} {piece[0]}".strip()
    return cells


def _cell(text: str, column: int, title: str, code: Collection[str]) -> str:
    """Symbols in the first column; names of the code in the one that is called "here"; words in the others."""
    if column == 0:
        try:
            return ", ".join(formula(part) for part in re.split(r",\s+", text)) if text else ""
        except FormulaError:
            return words(text, code)
    if title == "here" and re.fullmatch(r"[\w.]+(?:, [\w.]+)*", text):
        return ", ".join(f"<code>{escape(part)}</code>" for part in text.split(", "))
    return escape(text, quote=False) if title == "unit" else words(text, code)


def _formulas(lines: list[str], code: Collection[str]) -> str:
    """One row per line: formulas, then words that explain it, then its number. Empty where no line is a formula."""
    rows, count = [], 0
    for line in _whole(lines):
        number = _NUMBER.search(line)
        text = line[: number.start()] if number else line
        try:
            drawn = " ".join(formula(part, display=True) for part in _apart(text.strip()))
            count += 1
        except FormulaError:
            drawn = words(text.strip(), code)
        beside = f'<span class="number">{escape(number[1])}</span>' if number else ""
        indent = ' class="on"' if line.startswith("  ") else ""
        rows.append(f"<div{indent}><span>{drawn}</span>{beside}</div>")
    return f'<div class="formulas">{"".join(rows)}</div>' if count else ""


def _whole(lines: list[str]) -> list[str]:
    """Lines, each with those after it that close its parentheses."""
    found: list[str] = []
    for line in lines:
        if found and found[-1].count("(") > found[-1].count(")"):
            found[-1] += f" {line.strip()}"
        else:
            found.append(line)
    return found


def _apart(text: str) -> list[str]:
    """Formulas that stand side by side with a gap between them, outside of any parentheses."""
    parts: list[str] = [""]
    for piece in re.split(r"(\s{2,})", text):
        open_fences = parts[-1].count("(") > parts[-1].count(")")
        if piece.isspace() and not open_fences:
            parts.append("")
        else:
            parts[-1] += piece
    return parts


def _matrix(lines: list[str]) -> str:
    """A matrix drawn with bars, a line per row, with what stands before and behind it on one line; empty for none."""
    found = [re.fullmatch(r"([^|]*)\|([^|]*)\|([^|]*)", line) for line in lines]
    if len(lines) < 2 or not all(found):
        return ""
    before, behind = ("".join(match[group].strip() for match in found if match) for group in (1, 3))
    try:
        rows = [[f"<mtd>{formula(cell)}</mtd>" for cell in match[2].split()] for match in found if match]
        around = [_inner(part) for part in (before, behind)]
    except FormulaError:
        return ""
    table = "".join(f"<mtr>{''.join(row)}</mtr>" for row in rows)
    inside = f'<mrow><mo fence="true">(</mo><mtable>{table}</mtable><mo fence="true">)</mo></mrow>'
    whole = f'<math displaystyle="true">{around[0]}{inside}<mspace width="2em"/>{around[1]}</math>'
    return f'<div class="formulas"><div><span>{whole}</span></div></div>'


def _inner(text: str) -> str:
    """A formula without the element around it; empty for none."""
    return formula(text).removeprefix("<math>").removesuffix("</math>") if text else ""
