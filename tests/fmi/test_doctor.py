"""Claims about examining FMUs: what is wrong is said, and a crash of the FMU is a finding."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path

import fmpy
import pytest

from imufmu.compiled.compilers import PLATFORMS
from imufmu.fmi import doctor
from imufmu.fmi.build import cached_fmu
from imufmu.fmi.doctor import Level, examine
from imufmu.fmi.native import cached_native_fmu
from imufmu.registry import BLOCKS
from support.rocker import rocker


@pytest.fixture
def changed(tmp_path) -> Callable[..., Path]:
    """lee2012.fmu with members replaced, None to leave one out, or text replaced in its model description."""

    def make(members: dict[str, bytes | None] | None = None, xml: tuple[str, str] = ("", "")) -> Path:
        path = tmp_path / "changed.fmu"
        with zipfile.ZipFile(cached_fmu("lee2012")) as source, zipfile.ZipFile(path, "w") as target:
            for name in source.namelist():
                content = (members or {}).get(name, source.read(name))
                if name == "modelDescription.xml" and content is not None and xml[0]:
                    assert xml[0].encode() in content
                    content = content.replace(xml[0].encode(), xml[1].encode())
                if content is not None:
                    target.writestr(name, content)
            for name in set(members or {}) - set(source.namelist()):
                target.writestr(name, members[name])
        return path

    return make


def problems(path: Path) -> dict[str, str]:
    return {f.topic: f.text for f in examine(path) if f.level is Level.PROBLEM}


# A trial takes seconds. These have slow steps, noise, a solver; the others are tried among the slow tests.
BRIEFLY = ("plumb", "imu", "pendulum")
EACH = [pytest.param(name, marks=() if name in BRIEFLY else pytest.mark.slow) for name in BLOCKS]


@pytest.mark.parametrize("name", EACH)
def test_our_own_native_fmus_have_no_problem_need_no_python_and_take_a_step(name):
    findings = examine(cached_native_fmu(name))
    assert [f for f in findings if f.level is Level.PROBLEM] == []
    assert next(f.text for f in findings if f.topic == "one step") == "works on this machine."
    assert not any("Python" in f.topic + f.text for f in findings)


@pytest.mark.parametrize("name", EACH)
def test_our_own_fmus_have_no_problem_and_take_a_step(name):
    findings = examine(cached_fmu(name))
    assert [f for f in findings if f.level is Level.PROBLEM] == []
    assert next(f.text for f in findings if f.topic == "one step").startswith("works on this machine")
    assert any(f.topic == "Python" and "casadi, numpy" in f.text and "ASCII letters" in f.text for f in findings)
    assert {"Simulink", "Dymola", "OpenModelica", "OMSimulator", "FMPy"} <= {f.topic for f in findings}


def test_a_native_fmu_of_every_platform_has_no_problem_and_each_host_is_told_its_platforms(tmp_path):
    """No compiler needed: empty binaries stand for those of other platforms."""
    path = tmp_path / "all.fmu"
    with zipfile.ZipFile(cached_native_fmu("lee2012")) as source, zipfile.ZipFile(path, "w") as target:
        binaries = {f"binaries/{p.folder}/lee2012{p.suffix}" for p in PLATFORMS.values()}
        for name in {*source.namelist(), *binaries}:
            target.writestr(name, source.read(name) if name in source.namelist() else b"")
    findings = examine(path)
    assert [f for f in findings if f.level is Level.PROBLEM] == []
    assert [f.text.split()[0] for f in findings if f.topic == "binaries"] == sorted(PLATFORMS)
    texts = {f.topic: f.text for f in findings}
    assert texts["Dymola"] == "64-bit Linux, 64-bit Windows"
    assert texts["FMPy"] == "macOS on Apple silicon, Linux on ARM, macOS, 64-bit Linux, 64-bit Windows"


def test_a_host_that_runs_on_none_of_the_platforms_inside_is_told(changed):
    only_arm = {f"binaries/{folder}": None for folder in ("linux64/lee2012.so", "win64/lee2012.dll")}
    findings = examine(changed(only_arm | {"binaries/aarch64-linux/lee2012.so": b""}))
    texts = {f.topic: f.text for f in findings}
    assert texts["Simulink"].startswith("nowhere") and texts["FMPy"] == "Linux on ARM"


def test_a_crash_of_the_fmu_is_a_finding(changed):
    """PythonFMU's wrapper ends the process when its script is missing."""
    found = problems(changed({"resources/lee2012_fmu.py": None}))
    assert "resources/lee2012_fmu.py is missing" in found["Python"]
    assert "crashed its process (SIGSEGV)" in found["one step"]


def test_an_error_of_the_fmu_is_a_finding(changed):
    script = b"from pythonfmu import Fmi2Slave\nclass Lee2012(Fmi2Slave):\n    def do_step(self, t, h): return False\n"
    assert "one step" in problems(changed({"resources/lee2012_fmu.py": script}))


@pytest.mark.parametrize(("code", "expected"), [(0, "before the step was done"), (3, "with exit code 3")])
def test_an_fmu_that_ends_its_process_instead_of_a_step_is_found(code, expected, changed):
    """No crash, and with code 0 no sign of a fault but the step that is missing."""
    script = f"import os\nfrom pythonfmu import Fmi2Slave\nclass Lee2012(Fmi2Slave):\n    pass\nos._exit({code})\n"
    found = problems(changed({"resources/lee2012_fmu.py": script.encode()}))
    assert found["one step"] == f"it ended its process {expected}."


def test_an_fmu_that_does_not_come_back_is_tried_once(changed, monkeypatch):
    script = b"import time\nfrom pythonfmu import Fmi2Slave\nclass Lee2012(Fmi2Slave):\n    pass\ntime.sleep(1e6)\n"
    tried, once = [], doctor.try_step

    def counted(path, seconds):
        tried.append(path)
        return once(path, seconds)

    monkeypatch.setattr(doctor, "try_step", counted)
    found = {f.topic: f.text for f in examine(changed({"resources/lee2012_fmu.py": script}), step_timeout=3.0)}
    assert found["one step"] == "it did not finish one step within 3 s."
    assert len(tried) == 1


def test_the_trial_takes_a_step_where_the_default_step_is_zero(changed):
    assert "one step" not in problems(changed(xml=('stepSize="0.01"', 'stepSize="0"')))


def test_missing_packages_and_broken_python_are_found(changed):
    missing = problems(changed({"resources/lee2012_fmu.py": b"import no_such_package\n"}))
    assert "not installed here: no_such_package" in missing["Python"]
    broken = problems(changed({"resources/lee2012_fmu.py": b"def broken(:\n"}))
    assert "lee2012_fmu.py is no valid Python" in broken["Python"]


def test_a_platform_without_its_library_is_found(changed):
    found = problems(changed({"binaries/win64/lee2012.dll": b"", "binaries/linux64/lee2012.so": None}))
    assert "not tried: no binary for this machine" in found["one step"]
    renamed = examine(changed(xml=('modelIdentifier="lee2012"', 'modelIdentifier="other"')))
    assert all("other" in f.text and "is missing" in f.text for f in renamed if f.topic == "binaries")
    assert next(f.text for f in renamed if f.topic == "Simulink").startswith("nowhere")


@pytest.mark.parametrize(
    ("before", "after", "expected"),
    [
        ('start="0.1"', 'start="7"', "c_a: start 7 is outside [0, 1]"),
        ('min="0.0" max="1.0"', 'min="3.0" max="1.0"', "min 3 exceeds max 1"),
    ],
)
def test_start_values_and_bounds_that_contradict_each_other_are_found(before, after, expected, changed):
    found = [f.text for f in examine(changed(xml=(before, after))) if f.topic == "bounds"]
    assert any(expected in text for text in found), found


def test_a_violation_of_the_standard_is_found(changed):
    assert "validation" in problems(changed(xml=('causality="output"', 'causality="outcome"')))


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 cut off", b"time,gyro[1]\n"])
def test_what_is_no_archive_is_one_problem(content, tmp_path):
    (tmp_path / "broken.fmu").write_bytes(content)
    (finding,) = examine(tmp_path / "broken.fmu")
    assert finding.level is Level.PROBLEM and "broken.fmu" in finding.text


def test_a_file_that_is_not_there_is_one_problem(tmp_path):
    (finding,) = examine(tmp_path / "none.fmu")
    assert "no such file" in finding.text


def test_a_crash_when_it_is_closed_is_told_apart_from_one_in_the_step(changed):
    """PythonFMU's wrapper sometimes ends the process after correct results."""
    script = b"""import os
from pythonfmu import Fmi2Slave
class Lee2012(Fmi2Slave):
    def __init__(self, **kwargs): super().__init__(**kwargs)
    def get_real(self, vrs): return [0.0 for _ in vrs]
    def set_real(self, vrs, values): pass
    def set_integer(self, vrs, values): pass
    def set_boolean(self, vrs, values): pass
    def do_step(self, t, h): return True
    def terminate(self): os.abort()
"""
    findings = examine(changed({"resources/lee2012_fmu.py": script}))
    (trial,) = (f for f in findings if f.topic == "one step")
    assert trial.level is Level.NOTE
    assert trial.text.startswith("works on this machine, but when closed it crashed its process (SIGABRT)")


def test_an_fmu_3_is_told_what_runs_it():
    """Its folders have other names than those of FMI 2.0, which is no reason for a host not to run on them."""
    texts = {f.topic: f.text for f in examine(rocker("3_cs"))}
    assert texts["kind"] == "FMI 3.0, co-simulation and model exchange"
    assert texts["imufmu"] == "runs it as a component of a system on this machine"
    assert texts["one step"] == "works on this machine."
    if fmpy.platform_tuple == "x86_64-linux":
        assert texts["Simulink"] == "64-bit Linux; needs a release that reads FMI 3.0"
        assert texts["OpenModelica"] == "64-bit Linux; needs an FMU 2.0"
    assert problems(rocker("3_cs")) == {}


@pytest.mark.parametrize("kind", ["3_me", "2_me"])
def test_an_fmu_for_model_exchange_runs_by_a_solver(kind):
    texts = {f.topic: f.text for f in examine(rocker(kind))}
    assert texts["kind"] == f"FMI {kind[0]}.0, model exchange"
    assert texts["imufmu"].endswith("on this machine, its equations solved by CVode of FMPy")
    assert texts["one step"] == "works on this machine."


def test_scheduled_execution_is_nothing_that_a_host_is_promised_for(tmp_path):
    path = tmp_path / "scheduled.fmu"
    with zipfile.ZipFile(rocker("3_me")) as source, zipfile.ZipFile(path, "w") as target:
        for name in source.namelist():
            target.writestr(name, source.read(name).replace(b"<ModelExchange", b"<ScheduledExecution"))
    texts = {f.topic: f.text for f in examine(path)}
    assert texts["kind"] == "FMI 3.0, scheduled execution"
    assert texts["imufmu"].startswith("does not run it: for scheduled execution only")
    assert texts["hosts"].startswith("for scheduled execution, which none of Simulink, ")
    assert "Simulink" not in texts
    assert problems(path) == {}
