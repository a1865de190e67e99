"""The pages are true: what they say to type works, top to bottom in one folder, and their links lead somewhere.

Blocks in `sh` and `python` are run; a block in `text` that follows is what they print. What takes long runs among the
slow tests; otherwise its arguments are parsed.
"""

from __future__ import annotations

import re
import shlex
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
import typer

from imufmu.cli import main as cli
from imufmu.files.csv_table import write_csv
from support.pages import PAGES, anchors, commands, fences, links, mentions, name_of, shell_lines
from support.places import ROOT

SLOW = re.compile(r"imufmu (validate|speed|demo)\b|imufmu run vehicle_|--animate")
RUN = [page for page in PAGES if any(fence.language in ("sh", "python") for fence in fences(page))]
RUN = [page for page in RUN if "models" not in page.parts]  # they draw figures of the repository
SLOWLY = [page for page in RUN if any(SLOW.search(line) for fence in fences(page) for line in shell_lines(fence.text))]


def understood(line: str, *, whole: bool = True) -> None:
    """Parse a command line as `imufmu` does, without doing what it says. whole: no argument may be missing."""
    verb, *arguments = shlex.split(line)[1:]
    if verb.startswith("-"):
        return
    group = typer.main.get_command(cli.app)
    assert verb in group.commands, line  # type: ignore[attr-defined]
    try:
        group.commands[verb].make_context(verb, arguments)  # type: ignore[attr-defined]
    except Exception as error:
        allowed = {"Exit"} if whole else {"Exit", "MissingParameter", "NoArgsIsHelpError"}  # Exit: after --help
        assert type(error).__name__ in allowed, f"{line}: {error}"


def call(line: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run a command line of imufmu in this process."""
    monkeypatch.setattr(sys, "argv", shlex.split(line))
    try:
        cli.main()
    except SystemExit as end:
        assert not end.code, f"{line}: exit code {end.code}"


def shell(line: str, monkeypatch: pytest.MonkeyPatch, slowly: bool) -> None:
    """Run a line of imufmu; of make and pip, look whether what they ask for is there."""
    program, *arguments = shlex.split(line)
    if program == "imufmu" and (slowly or not SLOW.search(line)):
        call(line, monkeypatch)
    elif program == "imufmu":
        understood(line)
    elif program == "make":
        targets = re.findall(r"^(\w[\w-]*):", (ROOT / "Makefile").read_text(), re.MULTILINE)
        assert set(arguments) <= set(targets), line
    elif program == "pip":
        extras = re.findall(r"\w+", "".join(re.findall(r"\[(.*?)\]", line)))
        project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
        assert set(extras) <= set(project["optional-dependencies"]), line
    else:
        pytest.fail(f"{line}: no test knows how to try {program!r}")


def rocking(seed: int) -> dict[str, np.ndarray]:
    """Six seconds of rest and of rocking about x, with the truth."""
    time = np.arange(600) * 0.01
    roll = 0.3 * np.sin(2 * np.maximum(time - 3.5, 0)) ** 2
    rng = np.random.default_rng(seed)
    gyro = np.column_stack([np.gradient(roll, time), 0 * time, 0 * time])
    accel = 9.81 * np.column_stack([0 * time, np.sin(roll), np.cos(roll)])
    noisy = {"gyro": gyro + rng.normal(0, 1e-3, (600, 3)), "accel": accel + rng.normal(0, 1e-2, (600, 3))}
    return {"time": time, **noisy, "roll": roll, "pitch": 0 * roll}


def readers_folder(folder: Path) -> None:
    """What a reader has at hand: a recording of a walk, and a folder of recordings."""
    write_csv(folder / "walk.csv", rocking(1))
    for seed, kind in ((2, "broad"), (3, "broad"), (4, "field/phone"), (5, "field/robot")):
        (folder / kind).mkdir(parents=True, exist_ok=True)
        write_csv(folder / kind / f"trial_{seed}.csv", rocking(seed))


def follow(page: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], slowly: bool) -> None:
    """Do what a page says, block by block."""
    printed = ""
    for fence in fences(page):
        place = f"{name_of(page)}, line {fence.line}"
        if fence.language == "text":
            assert printed == fence.text, place
        elif fence.language == "python":
            exec(compile(fence.text, place, "exec"), {"__name__": "__main__"})
        elif fence.language == "sh":
            for line in shell_lines(fence.text):
                shell(line, monkeypatch, slowly)
        printed = capsys.readouterr().out


@pytest.mark.long
@pytest.mark.parametrize("page", RUN, ids=name_of)
def test_what_a_page_says_to_type_works(page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    readers_folder(tmp_path)
    follow(page, monkeypatch, capsys, slowly=False)


@pytest.mark.slow
@pytest.mark.parametrize("page", SLOWLY, ids=name_of)
def test_what_takes_long_works_too(page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    readers_folder(tmp_path)
    follow(page, monkeypatch, capsys, slowly=True)


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_every_command_of_a_page_is_one_that_imufmu_understands(page):
    for line in commands(page):
        understood(line)
    for line in mentions(page):
        understood(line, whole=False)


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_every_link_of_a_page_leads_somewhere(page):
    for link in links(page):
        if not link.startswith("https://"):
            path, _, anchor = link.partition("#")
            target = page.parent / path if path else page
            assert target.exists(), link
            assert not anchor or anchor in anchors(target), link


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_every_script_that_a_page_names_is_there(page):
    for script in re.findall(r"\bpython ([\w/]+\.py)", page.read_text(encoding="utf-8")):
        assert (ROOT / script).is_file(), script


def test_pages_that_are_checked_are_all_there_are():
    found = {path.relative_to(ROOT) for path in ROOT.rglob("*.md")}
    own = {path for path in found if path.parts[0] not in ("src", "tests") and not path.parts[0].startswith(".")}
    assert own == {page.relative_to(ROOT) for page in PAGES} | {Path("CHANGELOG.md")}
