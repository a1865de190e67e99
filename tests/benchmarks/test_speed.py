"""Claims about the speed command: what it measures runs, and it says what it measured. No test here is about time."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from imufmu import SimulationError
from imufmu.benchmarks import speed as speed_module
from imufmu.benchmarks import speed_isolation
from imufmu.benchmarks.speed import Speed, speed, tables, write_json
from imufmu.benchmarks.speed_ways import NATIVE_IN_C, Trip, in_c_host
from imufmu.compiled.compilers import compile_program
from imufmu.files.locations import fmu_src_folder
from imufmu.fmi.native import cached_native_fmu
from imufmu.registry import BLOCKS
from support.optional import needs

pytestmark = needs("a C compiler", "POSIX")


@pytest.fixture(scope="module")
def result() -> Speed:
    """One measurement of each way, a short system."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(speed_module, "_RECORD", 1.0)
        patch.setattr(speed_module, "_SYSTEM_TIMES", {True: 0.1, False: 0.1})
        patch.setattr(speed_isolation, "_STEPS", 100)
        return speed(["lee2012"], [200.0], repeats=1)


def test_every_way_is_measured_at_every_rate_beside_the_native_fmu(result: Speed) -> None:
    ways = [t.way for t in result.timings if t.rate == 100.0]
    assert ways == [t.way for t in result.timings if t.rate == 200.0]
    assert {NATIVE_IN_C, "native FMU, ctypes", "Python FMU, ctypes", "in process, Stream", "in process, run"} <= set(
        ways
    )
    for timing in result.timings:
        (native,) = (t for t in result.timings if t.way == NATIVE_IN_C and t.rate == timing.rate)
        assert timing.ratio == timing.seconds / native.seconds
        assert 0 < timing.least <= timing.seconds


def test_a_system_of_each_kind_of_fmu_is_measured_against_real_time(result: Speed) -> None:
    assert [s.fmus for s in result.systems] == ["native FMUs", "Python FMUs"]
    assert all(s.times_real_time == s.simulated / s.seconds for s in result.systems)


def test_a_process_of_its_own_is_measured_beside_this_one(result: Speed) -> None:
    assert [i.fmus for i in result.isolation] == ["in this process", "in a process each"]


def test_the_file_holds_what_the_tables_show(result: Speed, tmp_path: Path) -> None:
    write_json(tmp_path / "speed.json", result)
    content = json.loads((tmp_path / "speed.json").read_text())
    shown = [len(table.rows) for table in tables(result)]
    assert shown == [len(content[part]) for part in ("timings", "systems", "isolation", "starts")]
    assert content["machine"]["processor"] and "imufmu" in content["machine"]


def test_measuring_leaves_no_path_to_import_from(result: Speed) -> None:
    """A process started later would take its imufmu from the Python FMU that was measured."""
    left = [entry for entry in sys.path if "imufmu_speed_" in entry or entry.endswith("resources")]
    assert left == []


@pytest.mark.parametrize(
    ("names", "rates", "fault"),
    [
        (["lee2013"], [285.0], r"no sampled block is called 'lee2013'; there is lee2012"),
        (["pendulum"], [285.0], r"no sampled block is called 'pendulum'"),
        (["bennett2014"], [285.0], r"bennett2014 cannot be fed: a hand-held IMU has no"),
        (["lee2012"], [0.0], r"sample rates must be positive and finite, not 0"),
    ],
)
def test_what_cannot_be_measured_is_refused_before_anything_is(
    names: list[str], rates: list[float], fault: str
) -> None:
    with pytest.raises(ValueError, match=fault):
        speed(["lee2012", *names], rates, with_system=False)


def test_an_fmu_that_fails_in_the_c_host_is_told_with_its_reason(tmp_path: Path) -> None:
    compile_program(fmu_src_folder() / "host" / "host.c", tmp_path / "host")
    wrong = Trip(BLOCKS["lee2012"], -1.0, {name: np.zeros((10, 3)) for name in ("gyro", "accel")})
    with pytest.raises(SimulationError, match=r"lee2012.fmu failed in a C host: .*sample_period = -1 s is outside"):
        in_c_host(wrong, cached_native_fmu("lee2012"), 10, tmp_path / "host")()
