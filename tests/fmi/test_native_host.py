"""Native FMUs in hosts without Python: a C program on this system, under wine and under qemu."""

from __future__ import annotations

import html
import os
import re
import shutil
import subprocess
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import fmpy.build
import numpy as np
import pytest

from imufmu.blocks.block import Block, SampledBlock
from imufmu.blocks.instance import instantiate
from imufmu.compiled.compilers import PLATFORMS, compile_program, own_platform
from imufmu.files.locations import fmu_src_folder
from imufmu.fmi.model_description import guid
from imufmu.fmi.native import block_called, build_native
from imufmu.registry import BLOCKS
from support.optional import ARM_SYSTEM, needs

STEPS, H = 50, 0.01
HOST = fmu_src_folder() / "host" / "host.c"


def inputs(count: int) -> np.ndarray:
    """What the block is fed, (STEPS, count)."""
    return np.array([[((i + 3 * k) % 7 - 3) / 4 for i in range(max(1, count))] for k in range(STEPS)])


def in_process(name: str) -> np.ndarray:
    """What the host is to print: every output, (STEPS, number of outputs)."""
    instance = instantiate(block_called(name))
    instance.initialise(0.0)
    rows = []
    for k, u in enumerate(inputs(len(instance.u))):
        instance.u[:] = u[: len(instance.u)]
        instance.do_step(k * H, H)
        rows.append(instance.y.copy())
    return np.array(rows)


def in_host(
    name: str,
    runner: Sequence[str],
    host: Path,
    folder: Path,
    platform: str,
    environment: Mapping[str, str] | None = None,
) -> np.ndarray:
    """What it prints, with an empty environment unless one is given."""
    fmu, block = build_native(name, folder, [platform]), block_called(name)
    library = f"binaries/{platform}/{block.name}{PLATFORMS[platform].suffix}"
    with zipfile.ZipFile(fmu) as archive:
        archive.extract(library, folder)
    return printed(block, [*runner, str(host)], folder / library, environment or {})


def printed(block: Block, host: Sequence[str], library: Path, environment: Mapping[str, str]) -> np.ndarray:
    """What the host prints of a library."""
    sizes = [sum(s.size for s in signals) for signals in (block.inputs, block.parameters, block.reported)]
    record = library.with_name("record")
    record.write_bytes(inputs(sizes[0]).tobytes())
    arguments = ["", guid(block, native=True), record, sizes[0], sizes[0] + sizes[1], sizes[2], H, 0]
    run = subprocess.run(
        [*host, str(library), *map(str, arguments)], capture_output=True, text=True, env=dict(environment)
    )
    assert run.returncode == 0, run.stderr
    return np.array([[float(value) for value in line.split()] for line in run.stdout.splitlines()])


@pytest.fixture(scope="module")
def host(tmp_path_factory: pytest.TempPathFactory) -> Path:
    program = tmp_path_factory.mktemp("host") / "host"
    compile_program(HOST, program)
    return program


@needs("POSIX")
# The last one takes a compilation of a minute.
@pytest.mark.parametrize(
    "name",
    [
        *BLOCKS,
        "imu+lee2012",
        "pendulum+imu+lee2012",
        pytest.param("handheld+imu+plumb", marks=pytest.mark.slow),
    ],
)
def test_a_c_program_gets_the_numbers_of_the_run_in_process(name: str, host: Path, tmp_path: Path) -> None:
    """Bit for bit: the same operations in the same order, the same C library."""
    assert np.array_equal(in_host(name, [], host, tmp_path, own_platform()), in_process(name))


@needs("Linux", "cmake")
def test_what_fmpy_compiles_as_documented_runs_in_a_host_without_the_mathematical_library(
    host: Path, tmp_path: Path
) -> None:
    """FMPy does not link it by itself; the page of documentation inside the FMU tells how it does."""
    with zipfile.ZipFile(build_native("lee2012", tmp_path)) as archive:
        archive.extractall(tmp_path)
    shutil.rmtree(tmp_path / "binaries")
    page = html.unescape((tmp_path / "documentation" / "index.html").read_text(encoding="utf-8"))
    (given,) = re.findall(r"--cmake-options ([^<]+)<", page)
    options = dict(option.split("=", 1) for option in given.split())
    fmpy.build.build_platform_binary(tmp_path, cmake_options=options)
    (library,) = (tmp_path / "binaries").rglob("lee2012.so")
    # GCC for that one, ziglang for ours: the same operations, compiled by another compiler.
    assert np.array_equal(printed(block_called("lee2012"), [str(host)], library, {}), in_process("lee2012"))


def close(name: str, actual: np.ndarray) -> None:
    """Another C library rounds sin, log and their like differently in the last digit."""
    scale = [max(1.0, s.nominal) for s in BLOCKS[name].reported for _ in range(s.size)]
    assert np.max(np.abs(actual - in_process(name)) / scale) < 1e-12


PORTABLE = [name for name, block in BLOCKS.items() if isinstance(block, SampledBlock)] + ["pendulum"]


@pytest.fixture(scope="module")
def windows(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """What wine must be told: folders of its own, silence, and nothing of a display."""
    home = tmp_path_factory.mktemp("wine")
    return {"PATH": os.environ["PATH"], "HOME": str(home), "WINEPREFIX": str(home / "prefix"), "WINEDEBUG": "-all"}


# Noise, a slow step, a plant; the others take a compilation each.
BRIEFLY = ("imu", "plumb", "pendulum")


@needs("ziglang", "wine")
@pytest.mark.parametrize("name", [pytest.param(n, marks=() if n in BRIEFLY else pytest.mark.slow) for n in PORTABLE])
def test_the_windows_build_gets_the_same_numbers_under_wine(
    name: str, windows: Mapping[str, str], tmp_path: Path
) -> None:
    program = tmp_path / "host.exe"
    compile_program(HOST, program, PLATFORMS["win64"])
    close(name, in_host(name, ["wine"], program, tmp_path, "win64", windows))


@needs("ziglang", "qemu")
@pytest.mark.parametrize("name", PORTABLE)
def test_the_arm_build_gets_the_same_numbers_under_qemu(name: str, tmp_path: Path) -> None:
    program = tmp_path / "host"
    compile_program(HOST, program, PLATFORMS["aarch64-linux"])
    close(name, in_host(name, ["qemu-aarch64", "-L", str(ARM_SYSTEM)], program, tmp_path, "aarch64-linux"))
