"""The C host of fmu_src/host with Python FMUs: what it has to be told of this interpreter."""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from imufmu.blocks.signals import total_size
from imufmu.registry import BLOCKS
from support import fmu


def libpython() -> Path | None:
    """This interpreter as a shared library; None where there is none or no way to load it first."""
    folder, name = sysconfig.get_config_vars("LIBDIR", "INSTSONAME")
    shared = sys.platform == "linux" and sysconfig.get_config_var("Py_ENABLE_SHARED")
    return Path(folder, name) if shared else None


def environment(*packages: str) -> dict[str, str]:
    """Variables that give a C program this interpreter; packages: folders in front of its own packages."""
    own = dict.fromkeys((sysconfig.get_path("purelib"), sysconfig.get_path("platlib")))
    path = os.pathsep.join([*packages, *own])
    return {"LD_PRELOAD": str(libpython()), "PYTHONHOME": sys.base_prefix, "PYTHONPATH": path}


def run_python_fmu(
    host: Path, name: str, folder: Path, variables: Mapping[str, str], before: Sequence[str] = (), steps: int = 10
) -> subprocess.CompletedProcess[str]:
    """Step the Python FMU of a block with inputs of 0.1, recorded in ``folder``. before: what runs the host."""
    block, unpacked = BLOCKS[name], Path(fmu.unpacked(name))
    inputs = total_size(block.inputs)
    record = folder / "record"
    record.write_bytes(np.full((steps, max(1, inputs)), 0.1).tobytes())
    library = unpacked / "binaries" / "linux64" / f"{name}.so"
    first = inputs + total_size(block.parameters)
    numbers = (inputs, first, total_size(block.outputs), 0.01, 0)
    address = (unpacked / "resources").as_uri()
    command = [*before, host, library, address, fmu.description(name).guid, record, *numbers]
    return subprocess.run([str(part) for part in command], capture_output=True, text=True, env=dict(variables))
