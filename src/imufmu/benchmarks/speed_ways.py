"""Ways to run a block over one record, each with the processor time that it takes per sample.

A round trip of an FMU is: set the inputs, fmi2DoStep, get the outputs. In a C host that is all that happens. A Python
program calls the same functions through ctypes, with arrays made beforehand; what that adds shows where a native FMU
runs in both. A Python FMU is dearer in a C host, where PythonFMU enters and leaves the interpreter at every call.
"""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from ctypes import CDLL, c_double, c_int, c_size_t, c_void_p, cast
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from fmpy.fmi2 import FMU2Slave

from ..blocks.block import SampledBlock
from ..blocks.running import Stream
from ..blocks.signals import total_size
from ..compiled.compilers import compile_program
from ..compiled.library import compiled
from ..compiled.running import run
from ..cosim.errors import SimulationError
from ..cosim.slave import forget_paths
from ..files.locations import fmu_src_folder
from ..fmi.archive import open_fmu
from ..fmi.build import cached_fmu
from ..fmi.native import cached_native_fmu

NATIVE_IN_C = "native FMU, C host"

_SAMPLES = {"C": 300_000, "ctypes": 20_000, "Python": 2_000}  # of one measurement, about: tens of milliseconds each


@dataclass(frozen=True)
class Trip:
    """A block and what it is fed: inputs (n, k) by name, one row per ``period`` (s)."""

    block: SampledBlock
    period: float
    inputs: Mapping[str, np.ndarray]

    @property
    def rows(self) -> np.ndarray:
        """The inputs in the order of the block, (n, number of inputs)."""
        return np.ascontiguousarray(np.hstack([self.inputs[s.name] for s in self.block.inputs]))

    @property
    def first_output(self) -> int:
        """Value reference of the first output."""
        return total_size(self.block.inputs) + total_size(self.block.parameters)

    @property
    def outputs(self) -> int:
        """Number of outputs with ``sample_time``."""
        return total_size(self.block.outputs) + 1

    @property
    def period_reference(self) -> int:
        """Value reference of the sample period."""
        names = [v.name for v in self.block.variables if v.group == "parameter"]
        return total_size(self.block.inputs) + names.index("sample_period")


def ways(trip: Trip, folder: Path, stack: ExitStack) -> dict[str, Callable[[], float]]:
    """By name, functions that measure once and return the processor time of a sample (s).

    folder: for the files that they need, until the stack closes what they have opened. Raises BuildError without a C
    compiler.
    """
    host = folder / "host.exe"
    compile_program(fmu_src_folder() / "host" / "host.c", host)
    native, python = cached_native_fmu(trip.block.name), cached_fmu(trip.block.name)
    found: dict[str, Callable[[], float]] = {NATIVE_IN_C: in_c_host(trip, native, _SAMPLES["C"], host)}
    libpython = _libpython()
    if libpython:
        found["Python FMU, C host"] = in_c_host(trip, python, _SAMPLES["Python"], host, libpython)
    found |= {
        "native FMU, ctypes": through_ctypes(trip, native, _SAMPLES["ctypes"], folder / "native", stack),
        "Python FMU, ctypes": through_ctypes(trip, python, _SAMPLES["Python"], folder / "python", stack),
        "in process, Stream": in_stream(trip),
        "in process, run": on_arrays(trip),
    }
    if find_spec("vqf") and {"gyro", "accel"} <= set(trip.inputs):
        found["VQF (C++), updateBatch"] = in_vqf(trip)
    return found


def in_c_host(trip: Trip, fmu: Path, samples: int, host: Path, libpython: Path | None = None) -> Callable[[], float]:
    """An FMU in the program ``host``, a process of its own for every measurement; a Python FMU needs libpython."""
    folder = host.with_name(f"{'python' if libpython else 'native'}_fmu")
    folder.mkdir()
    library, model = open_fmu(fmu, folder)
    rows, record = trip.rows, folder / "record"
    record.write_bytes(rows.tobytes())
    numbers = [rows.shape[1], trip.first_output, trip.outputs, repr(trip.period), max(1, samples // len(rows))]
    addresses = [library, (folder / "resources").as_uri(), model.guid, record]
    command = [str(part) for part in (host, *addresses, *numbers, f"{trip.period_reference}={trip.period!r}")]
    environment = os.environ | (_python_environment(libpython) if libpython else {})

    def measure() -> float:
        done = subprocess.run(command, capture_output=True, text=True, env=environment)
        if not done.stdout:
            raise SimulationError(f"{fmu} failed in a C host: {done.stderr.strip() or f'exit code {done.returncode}'}")
        return 1e-9 * float(done.stdout)  # PythonFMU may crash its process after that, when it ends

    return measure


def _libpython() -> Path | None:
    """The interpreter at hand as a shared library; None where there is none or no way to load it first."""
    folder, name = sysconfig.get_config_vars("LIBDIR", "INSTSONAME")
    library = Path(folder or "", name or "")
    return library if sys.platform == "linux" and sysconfig.get_config_var("Py_ENABLE_SHARED") else None


def _python_environment(libpython: Path) -> dict[str, str]:
    """Variables that give a C program this interpreter and its packages."""
    packages = dict.fromkeys((sysconfig.get_path("purelib"), sysconfig.get_path("platlib")))
    return {
        "LD_PRELOAD": str(libpython),
        "PYTHONHOME": sys.base_prefix,
        "PYTHONPATH": os.pathsep.join(packages),
    }


def through_ctypes(trip: Trip, fmu: Path, samples: int, folder: Path, stack: ExitStack) -> Callable[[], float]:
    """An FMU in this process, unpacked into a new folder, by its C functions."""
    folder.mkdir()
    _, model = open_fmu(fmu, folder)
    stack.callback(forget_paths, folder)
    slave = FMU2Slave(
        guid=model.guid,
        unzipDirectory=str(folder),
        modelIdentifier=model.coSimulation.modelIdentifier,
        instanceName=f"speed_{trip.block.name}",
    )
    slave.instantiate()
    stack.callback(slave.freeInstance)
    slave.setReal([trip.period_reference], [trip.period])
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    calls = CDLL(str(slave.dll._name))  # the same library, loaded once: functions without FMPy's argument types
    instance, rows = c_void_p(cast(slave.component, c_void_p).value), trip.rows
    u, y = np.zeros(rows.shape[1]), np.zeros(trip.outputs)
    u_at, y_at = np.arange(len(u), dtype=np.uint32), trip.first_output + np.arange(len(y), dtype=np.uint32)
    to_set, to_get = (
        (instance, at.ctypes.data_as(c_void_p), c_size_t(len(at)), values.ctypes.data_as(c_void_p))
        for at, values in ((u_at, u), (y_at, y))
    )
    h, yes = c_double(trip.period), c_int(1)
    done = 0

    def measure() -> float:
        nonlocal done
        set_real, do_step, get_real = calls.fmi2SetReal, calls.fmi2DoStep, calls.fmi2GetReal
        began = process_time()
        for k in range(done, done + samples):
            u[:] = rows[k % len(rows)]
            statuses = set_real(*to_set)
            statuses |= do_step(instance, c_double(k * trip.period), h, yes)
            statuses |= get_real(*to_get)
            if statuses:
                raise SimulationError(f"{fmu}: a call failed at t = {k * trip.period:g} s")
        took = process_time() - began
        done += samples
        return took / samples

    return measure


def in_stream(trip: Trip) -> Callable[[], float]:
    """The streaming object, sample by sample."""
    stream = Stream(trip.block, {"sample_period": trip.period})
    count = min(_SAMPLES["Python"], len(trip.rows))
    samples = [{name: values[k] for name, values in trip.inputs.items()} for k in range(count)]

    def measure() -> float:
        began = process_time()
        for sample in samples:
            stream.update(**sample)
        return (process_time() - began) / len(samples)

    return measure


def on_arrays(trip: Trip) -> Callable[[], float]:
    """The whole record in one call."""
    compiled(trip.block).library(sys.maxsize)  # made now, not while it is measured

    def measure() -> float:
        began = process_time()
        run(trip.block, trip.inputs, {"sample_period": trip.period})
        return (process_time() - began) / len(trip.rows)

    return measure


def in_vqf(trip: Trip) -> Callable[[], float]:
    """VQF's C++ loop over whole records."""
    import vqf

    filter_: Any = vqf.VQF(trip.period)
    gyro, accel = (np.ascontiguousarray(trip.inputs[name]) for name in ("gyro", "accel"))
    rounds = max(1, _SAMPLES["C"] // len(gyro))

    def measure() -> float:
        began = process_time()
        for _ in range(rounds):
            filter_.updateBatch(gyro, accel)
        return (process_time() - began) / (rounds * len(gyro))

    return measure
