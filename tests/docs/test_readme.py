"""The README is short, tells the numbers of the pages behind it, and shows only the public face."""

from __future__ import annotations

import ast
import re
import sys

import pytest

import imufmu
from imufmu.cli import main as cli
from imufmu.registry import BLOCKS
from imufmu.reports.demo import run_demo
from support.pages import fences, shell_lines, table_rows
from support.places import ROOT

README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = {path.stem: path.read_text(encoding="utf-8") for path in (ROOT / "docs").glob("*.md")}
WAYS = ("Drop in", "Script", "Replay", "Gate")


def test_each_of_the_four_ways_takes_at_most_eight_lines():
    for way in WAYS:
        (part,) = re.findall(rf"^\*\*{way}\.\*\*(.*?)(?=^\*\*|^## )", README, re.DOTALL | re.MULTILINE)
        blocks = re.findall(r"^```(?:sh|python)\n(.*?)^```$", part, re.DOTALL | re.MULTILINE)
        assert blocks, way
        assert sum(len(shell_lines(block)) for block in blocks) <= 8, way


def test_readme_has_one_figure_two_commands_one_table_of_results_and_fits_three_screens():
    assert README.count("![") == 1
    assert [line.split()[1] for line in shell_lines(fences(ROOT / "README.md")[0].text)] == ["demo", "test"]
    (results,) = re.findall(r"^## What came out\n(.*?)^## ", README, re.DOTALL | re.MULTILINE)
    assert len(re.findall(r"^\|---", results, re.MULTILINE)) == 1
    assert len(README.splitlines()) < 140


def test_results_of_the_readme_are_those_of_the_pages():
    """Columns: BROAD and cars with the parameters for real recordings, truth delayed; then three systems."""
    of_readme, broad, cars = (table_rows(text) for text in (README, PAGES["recordings"], PAGES["vehicles"]))
    estimators = next(cells for name, cells in cars.items() if name == "system")
    here = [name.replace(", ours", "").replace(", of others", "") for name in of_readme]
    rows = dict(zip(here, of_readme.values(), strict=True))
    for name in ("lee2012", "leechoi2018", "rizun2008", "plumb", "VQF", "RIANN"):
        cells = next(cells for label, cells in rows.items() if label.replace("`", "") == name)
        assert cells[0] == broad[name][-1] == broad["broad (14)"][broad["kind"].index(name)], name
        assert cells[1] == broad["car (22)"][broad["kind"].index(name)], name
    on_wheels = next(cells for label, cells in rows.items() if label.endswith("the speed of the wheels"))
    assert f"`plumb` has {on_wheels[1]} deg in" in PAGES["recordings"]
    systems = [name.strip("`") for name in of_readme["estimator"][2:]]
    for label, cells in rows.items():
        name = label.replace("`", "")
        column = {"plumb": "plumb without wheels", "plumb with the speed of the wheels": "plumb"}.get(name, name)
        if column in estimators:
            assert cells[2:] == [cars[system][estimators.index(column)] for system in systems], name


@pytest.mark.long
def test_demo_table_is_what_the_demo_prints(tmp_path):
    for row in run_demo(tmp_path).table.rows:
        assert f"| {' | '.join(row)} |" in PAGES["parameters"], row


@pytest.mark.parametrize("trial", ["01_undisturbed_slow_rotation_A", "15_undisturbed_fast_translation_A"])
def test_replay_numbers_are_what_replay_prints(trial, monkeypatch, capsys, tmp_path, broad):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["imufmu", "replay", str(broad / f"{trial}.mat"), "--estimator", "lee2012"])
    with pytest.raises(SystemExit):
        cli.main()
    numbers, page = capsys.readouterr().out.splitlines()[1].split(), PAGES["recordings"]
    assert f"| {' | '.join(numbers)} |" in page or f"{numbers[3]} deg" in page, numbers


def test_every_block_has_a_row_and_every_page_a_link():
    for name in BLOCKS:
        assert f"`{name}`" in PAGES["parameters"]
    for name in PAGES:
        assert f"](docs/{name}.md)" in README, name


def test_readme_pages_and_examples_show_the_public_face_only():
    """All but the page of architecture, which shows how a block is made."""
    shown = {path.name: path.read_text(encoding="utf-8") for path in (ROOT / "examples").glob("*.py")}
    for path in (ROOT / "README.md", *(ROOT / "docs").glob("*.md")):
        if path.name != "architecture.md":
            shown[path.name] = "\n".join(fence.text for fence in fences(path) if fence.language == "python")
    for name, code in shown.items():
        for node in ast.walk(ast.parse(code)):
            if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "imufmu":
                assert node.module == "imufmu", name
                assert {alias.name for alias in node.names} <= set(imufmu.__all__), name
            elif isinstance(node, ast.Import):
                assert not any(alias.name.startswith("imufmu.") for alias in node.names), name
            elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "imufmu":
                assert node.attr in imufmu.__all__, f"{name}: imufmu.{node.attr}"
