"""The pages of documentation, taken apart: what a reader can copy out of them and run, and where their links lead."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from support.places import ROOT

PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")), *sorted((ROOT / "models").rglob("README.md"))]


@dataclass(frozen=True)
class Fence:
    """A fenced block: the number of its first line in the page, its language, its text."""

    line: int
    language: str
    text: str


def name_of(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


def fences(page: Path) -> list[Fence]:
    text = page.read_text(encoding="utf-8")
    found = re.finditer(r"^```(\w*)\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)
    return [Fence(text.count("\n", 0, match.start()) + 2, match[1], match[2]) for match in found]


def shell_lines(text: str) -> list[str]:
    """The commands of a shell block without comments, where two spaces stand before one."""
    return [line for line in (re.sub(r"(^|\s\s+)#.*", "", line).strip() for line in text.splitlines()) if line]


def commands(page: Path) -> list[str]:
    """Every command line of imufmu in the blocks of a page, indented or fenced, a workflow's too."""
    lines = page.read_text(encoding="utf-8").splitlines()
    blocks = [line.replace("- run: ", "") for line in lines if re.match(r"\s*(- run: )?imufmu ", line)]
    return shell_lines("\n".join(blocks))


def mentions(page: Path) -> list[str]:
    """Every command of imufmu between the backticks of a page's text; it may leave arguments out."""
    text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    return [" ".join(line.split()) for line in re.findall(r"`(imufmu [^`]*)`", text)]


def links(page: Path) -> list[str]:
    return re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8"))


def anchors(page: Path) -> set[str]:
    """Names that a link may lead to within a page, as GitHub makes them of headings."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def table_rows(text: str) -> dict[str, list[str]]:
    """Cells of every row of the tables in a text, by the first cell; the last of a name counts."""
    rows = re.findall(r"^\| (.+) \|$", text, re.MULTILINE)
    cells = [[cell.strip() for cell in row.split(" | ")] for row in rows]
    return {first.strip("`"): rest for first, *rest in cells}
