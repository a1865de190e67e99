"""The README is true: its lines run, its numbers are what the commands print, its links lead somewhere."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

from imufmu.cli import main as cli
from imufmu.registry import BLOCKS
from imufmu.reports.demo import run_demo
from support.places import ROOT

README = (ROOT / "README.md").read_text(encoding="utf-8")
BROAD = ROOT.parent / "shared" / "data" / "broad"


def test_python_lines_run(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (block,) = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    assert len([line for line in block.splitlines() if line.strip()]) <= 8
    exec(block, {})
    assert 0 < float(capsys.readouterr().out.split()[-1]) < 90
    assert [path.name for path in tmp_path.iterdir()] == ["run.csv"]


def test_demo_table_is_what_the_demo_prints(tmp_path):
    for row in run_demo(tmp_path).table.rows:
        assert f"| {' | '.join(row)} |" in README, row


@pytest.mark.skipif(not BROAD.is_dir(), reason="the BROAD recordings are not beside the checkout")
@pytest.mark.parametrize("trial", ["01_undisturbed_slow_rotation_A", "15_undisturbed_fast_translation_A"])
def test_replay_numbers_are_what_replay_prints(trial, monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["imufmu", "replay", str(BROAD / f"{trial}.mat"), "--estimator", "lee2012"])
    with pytest.raises(SystemExit):
        cli.main()
    numbers = capsys.readouterr().out.splitlines()[1].split()
    assert f"| {' | '.join(numbers)} |" in README or f"{numbers[3]} deg" in README, numbers


def test_every_block_is_in_the_table_and_every_link_leads_somewhere():
    for name in BLOCKS:
        assert f"`{name}`" in README
    for target in re.findall(r"\]\(([^)]+)\)", README):
        assert target.startswith("https://") or (ROOT / target).exists(), target
    for command in re.findall(r"`imufmu (\w+)", README):
        assert f'@app.command("{command}")' in Path(cli.__file__).read_text() or hasattr(cli, command), command
