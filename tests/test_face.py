"""The public face: what ``import imufmu`` gives, and that nothing heavy comes before it is asked for."""

from __future__ import annotations

import subprocess
import sys

import pytest

import imufmu
from imufmu.registry import BLOCKS
from support import fmu

HEAVY = {"casadi", "matplotlib", "fmpy", "pythonfmu", "h5py", "scipy", "jinja2", "lxml"}


def loaded_by(program: str, *arguments: str) -> set[str]:
    """Top-level packages in memory after a program."""
    program += "\nprint(*sorted({name.split('.')[0] for name in sys.modules}), file=sys.stderr)"
    command = [sys.executable, "-c", f"import sys\n{program}", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return set(done.stderr.splitlines()[-1].split())


@pytest.mark.parametrize("name", imufmu.__all__)
def test_every_name_of_the_face_is_there(name: str) -> None:
    assert getattr(imufmu, name) is not None
    assert name in dir(imufmu)


def test_every_block_is_there_by_its_name() -> None:
    assert {name: getattr(imufmu, name) for name in BLOCKS} == BLOCKS


def test_a_name_that_is_not_there_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'plum'"):
        imufmu.plum  # noqa: B018


def test_importing_the_package_loads_nothing_else() -> None:
    assert not loaded_by("import imufmu") & (HEAVY | {"numpy", "typer", "rich"})


@pytest.mark.parametrize("arguments", [["--help"], ["--version"]])
def test_help_and_version_load_nothing_heavy(arguments: list[str]) -> None:
    program = "import contextlib\nfrom imufmu.cli.main import main\nwith contextlib.suppress(SystemExit): main()"
    assert not loaded_by(program, *arguments) & (HEAVY | {"numpy"})


def test_an_fmu_is_told_about_without_equations_and_figures() -> None:
    program = "import contextlib\nfrom imufmu.cli.main import main\nwith contextlib.suppress(SystemExit): main()"
    assert not loaded_by(program, "info", str(fmu.path("lee2012"))) & {"casadi", "matplotlib", "pythonfmu", "h5py"}


def test_the_list_needs_no_fmu_and_no_figure() -> None:
    program = "import contextlib\nfrom imufmu.cli.main import main\nwith contextlib.suppress(SystemExit): main()"
    assert not loaded_by(program, "list") & {"matplotlib", "pythonfmu", "h5py", "scipy"}
