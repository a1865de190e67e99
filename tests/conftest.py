"""Fixtures of every test, and the folder of what a run builds."""

from __future__ import annotations

import os
import re
import shutil
import signal
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from imufmu.cli import console
from imufmu.cli.main import main
from support.optional import RECORDING_FIXTURES, broad
from support.places import SHARED

__all__ = ["broad"]  # a fixture of every test

# A compiler works half a minute on its C, and each of its samples moves 7300 numbers. It is plumb and what looks back,
# so by default it is run in process only.
SLOW_TO_COMPILE = "plumb_lag"


def pytest_configure(config: pytest.Config) -> None:
    """Make one folder for all workers of this run; the process that starts them deletes it at the end."""
    signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored where the tests run in the background
    if hasattr(config, "workerinput"):
        return
    os.environ[SHARED] = tempfile.mkdtemp(prefix="imufmu_tests_")
    config.add_cleanup(lambda: shutil.rmtree(os.environ.pop(SHARED), ignore_errors=True))


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark tests that read recordings, to be run once more without any; long tests first, lest workers wait for one."""
    for item in items:
        if SLOW_TO_COMPILE in item.name and re.search("tests/fmi|native|python|compiled|at_its_bounds", item.nodeid):
            item.add_marker("slow")
        if RECORDING_FIXTURES & set(getattr(item, "fixturenames", ())):
            item.add_marker("recordings")
    items.sort(key=lambda item: item.get_closest_marker("long") is None)


@pytest.fixture(autouse=True)
def signals_as_they_were() -> Iterator[None]:
    """The command line plans for being asked to end; here it shares the process with other tests."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture
def rng() -> np.random.Generator:
    """Random numbers, the same in every run and whatever other tests ran before."""
    return np.random.default_rng(2012)


@pytest.fixture
def imufmu(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> Callable[..., tuple[int, str, str]]:
    """Run the command in an empty folder; returns exit code, standard output, standard error."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(console, "_BETWEEN_LINES", 1e6)  # s; what is printed must not depend on how long it takes

    def call(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["imufmu", *map(str, arguments)])
        try:
            main()
            code = 0
        except SystemExit as end:
            code = int(end.code or 0)
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    return call
