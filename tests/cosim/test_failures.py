"""A run that cannot go on says who failed, in which call, when and why, and leaves nothing behind."""

from __future__ import annotations

import gc
import signal
import sys
import tempfile
import threading
from collections.abc import Iterator
from ctypes import CFUNCTYPE, c_char_p, c_int, c_void_p, cast
from pathlib import Path
from typing import Any

import fmpy.fmi1
import pytest

from imufmu import DescriptionError, SimulationError, System, pack
from imufmu.cosim import master
from imufmu.cosim.messages import Messages, _listening, _receive
from imufmu.cosim.slave import Slave
from support.cosim_stubs import (
    LIBRARY,
    Call,
    fake_fmu,
    model_description,
    recorded_calls,
    simulate,
    stub,
    variable,
    write_ssd,
    write_zip,
)
from support.optional import needs


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[Call]:
    return recorded_calls(monkeypatch)


@pytest.fixture(autouse=True)
def nothing_stays_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """No temporary file, no import path, no other working folder, signal handler or listener survives a test."""
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(scratch))
    paths, folder, handler = list(sys.path), Path.cwd(), signal.getsignal(signal.SIGINT)
    yield
    gc.collect()  # an .ssp is unpacked for as long as its System lives
    assert list(scratch.iterdir()) == []
    assert sys.path == paths
    assert Path.cwd() == folder
    assert signal.getsignal(signal.SIGINT) is handler
    assert not _listening


def system(folder: Path) -> Path:
    """clock -> sampler, and a faulty component beside them, instantiated between the two."""
    parts = {name: stub(name) for name in ("clock", "faulty", "sampler")}
    return write_ssd(folder / "system.ssd", parts, ["clock.y -> sampler.u"])


def of(calls: list[Call], instance: str) -> list[str]:
    """What was called on an instance."""
    return [function for name, function, _ in calls if name == instance]


def ends(calls: list[Call], instance: str) -> list[str]:
    """What was called on an instance from its failing call on."""
    return of(calls, instance)[-3:]


@pytest.mark.parametrize(
    ("fault", "message", "last"),
    [
        (
            1,
            r"^faulty: fmi2ExitInitializationMode failed with status 4 \(fatal\) at t = 0 s: the fuse is blown",
            ["fmi2GetReal", "fmi2GetReal", "fmi2ExitInitializationMode"],
        ),
        (
            2,
            r"^faulty: fmi2DoStep failed with status 2 \(discard\) at t = 0\.5 s, step 0\.25 s: out of fuel",
            ["fmi2DoStep", "fmi2Terminate", "fmi2FreeInstance"],
        ),
        (
            3,
            r"^faulty: fmi2DoStep failed with status 4 \(fatal\) at t = 0\.5 s, step 0\.25 s: .*exception",
            ["fmi2DoStep", "fmi2GetReal", "fmi2DoStep"],
        ),
        (4, r"^faulty\.y = nan at t = 0\.75 s", ["fmi2GetReal", "fmi2Terminate", "fmi2FreeInstance"]),
    ],
    ids=["exit of initialisation", "discard", "fatal", "not finite"],
)
def test_a_failure_is_told_and_every_instance_is_left_as_fmi_demands(
    tmp_path: Path, calls: list[Call], monkeypatch: pytest.MonkeyPatch, fault: int, message: str, last: list[str]
) -> None:
    monkeypatch.setattr(Slave, "_ends", lambda _: False)  # PythonFMU tells the end of the run with every discard
    parts = {name: stub(name) for name in ("clock", "faulty", "sampler")}
    wires = ["clock.y -> sampler.u", "faulty.y -> clock.u"]
    with pytest.raises(SimulationError, match=message):
        simulate(write_ssd(tmp_path / "s.ssd", parts, wires), parameters={"faulty.fault": fault})
    assert ends(calls, "faulty") == last  # after fatal: no call at all
    for healthy in ("clock", "sampler"):
        assert ends(calls, healthy)[-1] == "fmi2FreeInstance"
        assert of(calls, healthy).count("fmi2FreeInstance") == 1


def test_warnings_reach_the_notes_once(tmp_path: Path) -> None:
    notes = simulate(system(tmp_path), parameters={"faulty.fault": 5}).notes
    assert notes.count("faulty: oil is low") == 1


def test_an_fmu_that_cannot_be_instantiated_is_named(tmp_path: Path, calls: list[Call]) -> None:
    parts = {"clock": stub("clock"), "born": stub("stillborn")}
    with pytest.raises(SimulationError, match=r"^born: cannot be instantiated"):
        simulate(write_ssd(tmp_path / "system.ssd", parts))
    assert "fmi2FreeInstance" in of(calls, "clock")
    assert "fmi2Terminate" not in of(calls, "clock")  # it was never initialised
    assert "fmi2FreeInstance" not in of(calls, "born")


def test_a_binary_that_cannot_be_loaded_is_named(tmp_path: Path) -> None:
    fmu = fake_fmu(tmp_path / "fake.fmu", [variable("y", "output")])  # its library is an empty file
    with pytest.raises(SimulationError, match=r"^fake: its binary cannot be loaded"):
        simulate(write_ssd(tmp_path / "system.ssd", {"fake": fmu}))


def test_an_fmu_without_the_fmi_functions_is_named(tmp_path: Path) -> None:
    libraries = (Path(fmpy.__file__).parent / "logging" / fmpy.platform).glob(f"*{fmpy.sharedLibraryExtension}")
    members = {"modelDescription.xml": model_description([variable("y", "output")])}
    fmu = write_zip(tmp_path / "fake.fmu", members | {LIBRARY: next(libraries).read_bytes()})
    with pytest.raises(SimulationError, match=r"^fake: its binary cannot be loaded: .*fmi2"):
        simulate(write_ssd(tmp_path / "system.ssd", {"fake": fmu}))


def test_an_fmu_that_vanished_since_it_was_read_is_named(tmp_path: Path) -> None:
    fmu = tmp_path / "clock.fmu"
    fmu.write_bytes(stub("clock").read_bytes())
    read = System.read(write_ssd(tmp_path / "system.ssd", {"clock": fmu}))
    fmu.unlink()
    with pytest.raises(ValueError, match=r"clock\.fmu: there is no such file"):
        simulate(read)


def test_ctrl_c_ends_the_run_and_frees_every_instance(
    tmp_path: Path, calls: list[Call], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(master, "_BETWEEN_PROGRESS", -1.0)
    with pytest.raises(KeyboardInterrupt):
        simulate(system(tmp_path), progress=lambda *_: signal.raise_signal(signal.SIGINT))
    assert of(calls, "clock").count("fmi2DoStep") == 2  # the step that was under way, and the next one at most
    for name in ("clock", "faulty", "sampler"):
        assert ends(calls, name)[-2:] == ["fmi2Terminate", "fmi2FreeInstance"]


def test_ctrl_c_after_the_last_step_is_not_lost(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        simulate(system(tmp_path), progress=lambda *_: signal.raise_signal(signal.SIGINT))  # reports the end only


def test_ctrl_c_inside_a_python_fmu_is_no_fault_of_the_fmu(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        simulate(system(tmp_path), parameters={"faulty.fault": 6})


def test_a_second_ctrl_c_interrupts_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(master, "_BETWEEN_PROGRESS", -1.0)
    reached: list[int] = []

    def press_twice(done: int, _total: int) -> None:
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)
        reached.append(done)

    with pytest.raises(KeyboardInterrupt):
        simulate(system(tmp_path), progress=press_twice)
    assert reached == []


def test_an_exception_of_the_caller_frees_every_instance(tmp_path: Path, calls: list[Call]) -> None:
    def fail(*_: int) -> None:
        raise RuntimeError("mine")

    with pytest.raises(RuntimeError, match="mine"):
        simulate(system(tmp_path), progress=fail)
    assert sum(function == "fmi2FreeInstance" for _, function, _ in calls) == 3


def test_a_run_outside_the_main_thread_works(tmp_path: Path) -> None:
    path = system(tmp_path)
    results: list[Any] = []
    thread = threading.Thread(target=lambda: results.append(simulate(path)))
    thread.start()
    thread.join()
    assert len(results) == 1


def test_an_unpacked_ssp_lives_as_long_as_its_system(tmp_path: Path) -> None:
    packed = pack(system(tmp_path), tmp_path / "system.ssp")
    read = System.read(packed)
    folder = read.parts[0].fmu.parent
    assert simulate(read).names
    assert folder.is_dir()
    del read
    gc.collect()
    assert not folder.exists()


def test_an_ssp_that_cannot_be_read_leaves_nothing(tmp_path: Path) -> None:
    text = write_ssd(tmp_path / "a.ssd", {"a": "resources/none.fmu"}).read_text()
    with pytest.raises(DescriptionError, match="there is no file"):
        System.read(write_zip(tmp_path / "a.ssp", {"SystemStructure.ssd": text}))


def test_messages_of_other_programs_fmus_are_printed(capsys: pytest.CaptureFixture[str]) -> None:
    _receive(None, b"theirs", 1, b"logAll", b"hello")
    assert capsys.readouterr().out == "[WARNING] hello\n"


@needs("x86-64")  # calls a variadic function as a plain one
def test_the_values_in_a_message_of_a_c_fmu_are_filled_in() -> None:
    messages = Messages()
    logger = CFUNCTYPE(None, c_void_p, c_char_p, c_int, c_char_p, c_char_p, c_int)(
        cast(messages.callbacks.logger, c_void_p).value
    )
    logger(messages.callbacks.componentEnvironment, b"x", 1, b"", b"%d is too hot", 451)
    assert messages.warnings == ["451 is too hot"]
    messages.close()


def test_messages_keep_complaints_apart_from_remarks_and_survive_bad_bytes() -> None:
    messages = Messages()
    environment = next(iter(_listening))
    _receive(environment, b"x", 0, b"", b"starting")
    assert (messages.latest, messages.warnings) == ("starting", [])
    _receive(environment, b"x", 3, b"", b"broken \xff")
    _receive(environment, b"x", 0, b"", b"going on")
    assert (messages.latest, messages.warnings) == ("broken \ufffd", ["broken \ufffd"])
    messages.close()
