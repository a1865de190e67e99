"""The limits of every system of ours hold."""

from __future__ import annotations

import subprocess
import sys

import pytest

from support.places import ROOT

SYSTEMS = sorted((ROOT / "models").rglob("*.ssd"))


@pytest.mark.parametrize("system", SYSTEMS, ids=lambda path: path.stem)
def test_every_system_has_limits(system) -> None:
    assert system.with_name(f"{system.stem}.limits.toml").is_file()


@pytest.mark.slow
def test_pytest_finds_that_they_hold(tmp_path) -> None:
    command = [sys.executable, "-m", "pytest", "-q", "-n", "auto", "--dist", "loadfile", "-p", "no:cacheprovider"]
    done = subprocess.run([*command, str(ROOT / "models")], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stdout
    assert "passed" in done.stdout
