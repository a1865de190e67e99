"""What a test may need and a machine may lack: asked for here and nowhere else, and a reason to skip where it is not.

Recordings of others lie in the folder that the environment variable IMUFMU_RECORDINGS names, by default ../shared/data
seen from the repository: the trials of BROAD in its folder ``broad``. docs/recordings.md tells where they come from. A
test that reads them takes the fixture ``broad`` and thereby gets the marker ``recordings``.
"""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Callable
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import pytest

from support.places import ROOT

RECORDINGS = Path(os.environ.get("IMUFMU_RECORDINGS") or ROOT.parent / "shared" / "data")
RECORDING_FIXTURES = {"broad"}

ARM_SYSTEM = Path("/usr/aarch64-linux-gnu")  # where Debian puts the C library of 64-bit ARM


def _package(name: str) -> str:
    return "" if find_spec(name) else f"the package {name} is not installed"


def _program(name: str) -> str:
    return "" if shutil.which(name) else f"the program {name} is not installed"


def _host(package: str) -> str:
    """Imported in a process of its own: a host that lacks a library can take its process with it."""
    done = subprocess.run([sys.executable, "-c", f"import {package}"], capture_output=True, text=True)
    return (done.stderr.strip().splitlines() or [f"{package} does not load"])[-1] if done.returncode else ""


def _a_compiler() -> str:
    return "" if find_spec("ziglang") or shutil.which("cc") else "no C compiler is installed, neither ziglang nor cc"


def _arm() -> str:
    if not ARM_SYSTEM.is_dir():
        return f"the C library of 64-bit ARM is not in {ARM_SYSTEM}"
    return _program("qemu-aarch64")


def _libpython() -> str:
    from support.c_host import libpython  # with every block, which few tests need

    return "" if libpython() else "no Python with a shared library, as hosts on Linux need it"


_PARTS: dict[str, Callable[[], str]] = {
    "imufusion": lambda: _package("imufusion"),
    "riann": lambda: _package("riann") or _package("onnxruntime"),
    "vqf": lambda: _package("vqf"),
    "pandas": lambda: _package("pandas"),
    "xarray": lambda: _package("xarray"),
    "nbclient": lambda: _package("nbclient"),
    "ipykernel": lambda: _package("ipykernel"),
    "rosbags": lambda: _package("rosbags"),
    "pyulog": lambda: _package("pyulog"),
    "pymavlink": lambda: _package("pymavlink"),
    "asammdf": lambda: _package("asammdf"),
    "ziglang": lambda: _package("ziglang"),
    "fmpy": lambda: _host("fmpy"),
    "libcosim": lambda: _host("libcosimpy"),
    "ecos": lambda: _host("ecospy"),
    "cc": lambda: _program("cc"),
    "gcc": lambda: _program("gcc"),
    "g++": lambda: _program("g++"),
    "clang": lambda: _program("clang"),
    "clang++": lambda: _program("clang++"),
    "cmake": lambda: _program("cmake"),
    "false": lambda: _program("false"),
    "ffmpeg": lambda: _program("ffmpeg"),
    "nm": lambda: _program("nm"),
    "objdump": lambda: _program("objdump"),
    "wine": lambda: _program("wine"),
    "qemu": _arm,
    "libpython": _libpython,
    "a C compiler": _a_compiler,
    "Linux": lambda: "" if sys.platform == "linux" else "only on Linux",
    "POSIX": lambda: "only on Linux and macOS" if os.name == "nt" else "",
    "x86-64": lambda: "" if platform.machine() in ("x86_64", "AMD64") else "only on 64-bit Intel",
}


@cache
def missing(part: str) -> str:
    """Why an optional part cannot be used here; empty if it can."""
    return _PARTS[part]()


def needs(*parts: str) -> pytest.MarkDecorator:
    """Skip a test unless all these parts are there."""
    reasons = [reason for reason in map(missing, parts) if reason]
    return pytest.mark.skipif(bool(reasons), reason="; ".join(reasons))


def skip_without(*parts: str) -> None:
    """Skip the test that runs unless all these parts are there."""
    reasons = [reason for reason in map(missing, parts) if reason]
    if reasons:
        pytest.skip("; ".join(reasons))


@pytest.fixture(scope="session")
def broad() -> Path:
    """Folder of the trials of BROAD."""
    folder = RECORDINGS / "broad"
    if not any(folder.glob("*.mat")):
        pytest.skip(f"no recordings of BROAD in {folder}: docs/recordings.md tells how to get them")
    return folder
