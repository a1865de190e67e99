"""Claims about Python FMUs at run time that follow from Python; test_fmu_contract.py has those of every FMU."""

from __future__ import annotations

import math
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from fmpy.fmi1 import FMICallException

from imufmu.fmi import runtime
from imufmu.fmi.build import cached_fmu
from imufmu.fmi.component import Component
from imufmu.fmi.slave import Refused
from support import fmu


def test_an_fmu_refuses_to_start_on_another_imufmu_in_memory(tmp_path):
    folder = shutil.copytree(fmu.unpacked("lee2012"), tmp_path / "edited")
    source = Path(folder) / "resources" / "imufmu" / "estimators" / "lee2012.py"
    source.write_text(source.read_text() + "\n# edited\n")
    reason = runtime.refusal(Path(folder) / "resources")
    assert "another version of imufmu" in reason and str(runtime.PACKAGE) in reason
    for _ in range(50):  # and no host crashes from trying
        with pytest.raises(Exception, match="Failed to instantiate"):
            fmu.Fmu("lee2012", folder=str(folder))
    fmu.Fmu("lee2012").initialise().close()


def test_an_fmu_whose_modules_lie_elsewhere_is_refused_too(tmp_path):
    """Built before a module moved: the package in memory must not serve it by accident."""
    folder = shutil.copytree(fmu.unpacked("lee2012"), tmp_path / "older")
    package = Path(folder) / "resources" / "imufmu"
    for module in (package / "blocks").glob("*.py"):
        module.rename(package / module.name) if module.stem != "__init__" else module.unlink()
    assert "another version of imufmu" in runtime.refusal(Path(folder) / "resources")
    with pytest.raises(Exception, match="Failed to instantiate"):
        fmu.Fmu("lee2012", folder=str(folder))


def test_a_script_may_simulate_again_and_again_with_fmpy(tmp_path):
    """FMPy deletes what it unpacked, with it the imufmu that the first FMU brought into the process."""
    program = """if True:
        import fmpy, sys
        for k in range(3):
            result = fmpy.simulate_fmu(sys.argv[1], stop_time=0.1, start_values={"c_a": 0.1 * k})
        assert not __import__("pathlib").Path(sys.modules["imufmu"].__file__).exists()
        from imufmu import simulate  # the rest of the installed imufmu can still be had
        from imufmu.plants import pendulum
        print(len(result))
    """
    command = [sys.executable, "-c", program, str(cached_fmu("lee2012"))]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert done.stdout.strip() == "11", done.stderr


def test_fmus_of_several_blocks_run_one_after_the_other_where_no_imufmu_is_installed(tmp_path: Path) -> None:
    """Hosts delete what they unpacked. Equal edits keep the installed imufmu out of the process."""
    folders = []
    for name in ("imu", "lee2012", "imu"):
        folder = Path(shutil.copytree(fmu.unpacked(name), tmp_path / f"{name}{len(folders)}"))
        source = folder / "resources" / "imufmu" / "blocks" / "noise.py"
        source.write_text(source.read_text() + "\n# edited\n")
        folders.append(str(folder))
    program = """if True:
        import fmpy, shutil, sys
        for folder in sys.argv[1:]:
            print(len(fmpy.simulate_fmu(folder, stop_time=0.1, output_interval=0.01)))
            shutil.rmtree(folder)
        imufmu = sys.modules["imufmu"]
        print(len(imufmu.__path__), len(imufmu.blocks.__path__))
    """
    done = subprocess.run([sys.executable, "-c", program, *folders], capture_output=True, text=True)
    assert done.stdout.split() == ["11", "11", "11", "1", "1"], done.stderr


def test_line_ends_do_not_make_another_version(tmp_path):
    runtime.copy_to(tmp_path)
    for path in (tmp_path / "imufmu").rglob("*.py"):
        path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    assert runtime.refusal(tmp_path) == ""


def test_a_percent_sign_in_a_message_arrives_as_it_is():
    """PythonFMU takes messages for C formats."""
    instance = fmu.Fmu("lee2012")
    slave = sys.modules["lee2012_fmu"].Lee2012(instance_name="i", resources=f"{fmu.unpacked('lee2012')}/resources")
    slave.log("5% of %s")
    assert slave.log_queue[-1].msg % () == "5% of %s"
    assert repr(Refused("5% of %s")) % () == "5% of %s"
    instance.slave.freeInstance()


WRONG: dict[str, Callable[[fmu.Fmu], Any]] = {
    "setupExperiment": lambda i: i.slave.setupExperiment(startTime=math.nan),
    "enterInitializationMode": lambda i: i.slave.enterInitializationMode(),
    "exitInitializationMode": lambda i: i.slave.exitInitializationMode(),
    "doStep": lambda i: i.step(0.0, -1.0),
    "getReal": lambda i: i.slave.getReal([2**31]),
    "getInteger": lambda i: i.slave.getInteger([2**32 - 1]),
    "getBoolean": lambda i: i.slave.getBoolean([0]),
    "getString": lambda i: i.slave.getString([7]),
    "setReal": lambda i: i.slave.setReal([2**31], [1.0]),
    "setInteger": lambda i: i.slave.setInteger([2**31], [1]),
    "setBoolean": lambda i: i.slave.setBoolean([2**31], [True]),
    "setString": lambda i: i.slave.setString([2**31], ["a"]),
    "deSerializeFMUstate": lambda i: i.slave.deSerializeFMUstate(b"\0garbage" * 30),
}


@pytest.mark.parametrize("function", WRONG)
def test_an_error_in_any_function_is_survived_by_it_by_free_and_by_other_instances(function: str) -> None:
    """The wrapper releases too much then, which crashes the process within a few times."""
    other = fmu.Fmu("lee2012", "other").initialise()
    for _ in range(20):
        instance = fmu.Fmu("lee2012").initialise()
        for _ in range(2):
            with pytest.raises(FMICallException) as raised:
                WRONG[function](instance)
            assert raised.value.status == fmu.FATAL
        instance.slave.freeInstance()
    other.step(0.0, 0.01)
    other.close()


def test_garbage_for_a_state_takes_no_reference_from_any_instance() -> None:
    """The wrapper gives back one of an instance that it does not name."""
    instances = [fmu.Fmu("lee2012").initialise() for _ in range(2)]
    living = list(sys.modules["lee2012_fmu"].Lee2012._living)
    before = [sys.getrefcount(slave) for slave in living]
    with pytest.raises(FMICallException):
        instances[0].slave.deSerializeFMUstate(b"garbage" * 30)
    after = [sys.getrefcount(slave) for slave in living]
    assert len(living) >= 2
    assert all(now >= then for now, then in zip(after, before, strict=True))
    for instance in instances:
        instance.slave.freeInstance()


def test_after_an_error_it_can_be_read_and_goes_on_from_a_saved_state_or_after_a_reset_only() -> None:
    """PythonFMU calls the error fatal, after which FMI lets nothing go on as if it were well."""
    instance = fmu.Fmu("lee2012").initialise()
    instance.set({"gyro[1]": 0.3})
    instance.step(0.0, 0.05)
    before = instance.reals()
    for _ in range(2):
        with pytest.raises(FMICallException):
            instance.step(0.05, -1.0)
        assert instance.reals() == before
        for call in (lambda: instance.step(0.05, 0.01), lambda: instance.set({"gyro[1]": 0.0})):
            with pytest.raises(FMICallException):
                call()
            assert "after an error; reset the FMU or restore a saved state" in instance.log[-2][1]
        fmu.restore(instance, fmu.serialised(instance))
        instance.step(0.05, 1e-9)
    with pytest.raises(FMICallException):
        instance.step(0.05, -1.0)
    instance.slave.reset()
    instance.initialise().step(0.0, 0.01)
    instance.close()


@pytest.mark.parametrize("error", [ZeroDivisionError("by nothing"), KeyboardInterrupt("Ctrl-C")])
def test_any_other_error_is_told_and_leaves_the_host_alive(
    error: BaseException, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: float) -> None:
        raise error

    instance = fmu.Fmu("lee2012").initialise()
    monkeypatch.setattr(Component, "do_step", fail)
    with pytest.raises(FMICallException):
        instance.step(0.0, 0.01)
    assert instance.log[-2] == (fmu.ERROR, f"lee2012: {type(error).__name__}: {error}")
    instance.slave.freeInstance()


@pytest.mark.parametrize("categories", [[], ["logAll"], ["logStatusError"], ["logStatusWarning", "logAll"]])
def test_categories_are_those_that_the_host_asked_for_and_all_is_all(categories: list[str]) -> None:
    instance = fmu.Fmu("lee2012").initialise()
    instance.slave.setDebugLogging(True, categories)
    instance.set({"gyro[1]": math.nan})
    instance.step(0.0, 0.01)
    with pytest.raises(FMICallException):
        instance.step(0.01, -1.0)
    warned = [text for status, text in instance.log if status == fmu.WARNING]
    refused = [text for status, text in instance.log if status == fmu.ERROR]
    assert len(warned) == (categories != ["logStatusError"]) and len(refused) == 1
    instance.slave.freeInstance()
