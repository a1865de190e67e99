"""An FMU of others may exit, crash, hang, leak or flood: it takes its own process with it, and no other."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import tempfile
import time
import zipfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from imufmu import Result, SimulationError, System, locate, read_hdf5, simulate
from imufmu.cli.main import app
from imufmu.cosim import apart, master
from imufmu.cosim.interrupt import Terminated
from imufmu.cosim.replay import replay
from imufmu.files.csv_table import write_csv
from imufmu.fmi.build import cached_fmu
from imufmu.fmi.own import is_ours
from imufmu.recordings import reading
from support.cosim_stubs import stub, write_ssd
from support.rogue import INPUTS, Fault, H, rogue, rogue_system

SHORT = 1.0  # s; enough for a call of an FMU that does answer
PLACE = r"at t = 0\.5 s, step 0\.125 s"
FAULTS = {
    Fault.EXIT_0: rf"^rogue: fmi2DoStep ended its process with exit code 0 {PLACE}",
    Fault.EXIT_3: rf"^rogue: fmi2DoStep ended its process with exit code 3 {PLACE}",
    Fault.SEGMENTATION: rf"^rogue: fmi2DoStep crashed its process \(SIGSEGV\) {PLACE}",
    Fault.ABORT: rf"^rogue: fmi2DoStep crashed its process \(SIGABRT\) {PLACE}: the matrix is singular",
    Fault.SIGTERM: rf"^rogue: fmi2DoStep crashed its process \(SIGTERM\) {PLACE}",
    Fault.HANG: rf"^rogue: fmi2DoStep gave no answer within 1 s {PLACE}",
    Fault.STATUS_MINUS_5: rf"^rogue: fmi2DoStep failed with status -5 \(.*\) {PLACE}",
    Fault.STATUS_99: rf"^rogue: fmi2DoStep failed with status 99 \(.*\) {PLACE}",
    Fault.FORK_AND_EXIT: rf"^rogue: fmi2DoStep ended its process with exit code 0 {PLACE}",
    # It goes on meanwhile: with the next call or not.
    Fault.GARBLE: r"^rogue: fmi2(DoStep|GetReal) garbled the connection to its process at t = 0\.(5|625) s",
    Fault.CRASH_IN_FREE: r"^rogue: fmi2FreeInstance crashed its process \(SIGSEGV\) at t = 1 s",
    Fault.HANG_IN_FREE: r"^rogue: fmi2FreeInstance gave no answer within 1 s at t = 1 s",
}
HARMLESS = (Fault.NONE, Fault.THREAD, Fault.CHDIR, Fault.FLOOD, Fault.CLOSE_DESCRIPTORS, Fault.SIGINT, Fault.CHILD)


@pytest.fixture(autouse=True)
def nothing_stays_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """No temporary file, other working folder, or child process survives a test."""
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(scratch))
    folder, before = Path.cwd(), children()
    yield
    assert list(scratch.iterdir()) == []
    assert Path.cwd() == folder
    assert children() <= before


def children() -> set[str]:
    """Processes that this one has started, also those that have ended and were not waited for. On Linux."""
    return {child for file in Path("/proc/self/task").glob("*/children") for child in file.read_text().split()}


def alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    # A process that was killed counts until it has been waited for, by the first process of the system.
    state = Path(f"/proc/{process}/stat")
    return not (state.exists() and state.read_text().rpartition(")")[2].split()[0] == "Z")


def ended(process: int) -> bool:
    """Whether a process ends, which may take it a moment."""
    patience = time.monotonic() + 30
    while alive(process) and time.monotonic() < patience:
        time.sleep(0.05)
    return not alive(process)


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_a_fault_is_told_once_and_the_rows_up_to_there_are_kept(tmp_path: Path, fault: Fault) -> None:
    with pytest.raises(SimulationError, match=FAULTS[fault]) as raised:
        simulate(rogue_system(tmp_path), parameters={"rogue.fault": fault}, step_timeout=SHORT)
    rows = 9 if "Free" in FAULTS[fault] else 5
    result = raised.value.result
    assert isinstance(result, Result)
    assert result.time.tolist() == result["rogue.y"].tolist() == [H * k for k in range(rows)]
    assert result.partial == f"{rows} of 9 rows: {raised.value}"


def test_a_failure_before_the_first_row_has_no_result(tmp_path: Path) -> None:
    with pytest.raises(SimulationError, match=r"fmi2EnterInitializationMode failed with status -5 .* at t = 0 s") as e:
        simulate(rogue_system(tmp_path), parameters={"rogue.fault": Fault.BAD_INITIALISATION})
    assert e.value.result is None


def test_a_status_that_fmi_does_not_know_is_an_error_in_this_process_too(tmp_path: Path) -> None:
    with pytest.raises(SimulationError, match=FAULTS[Fault.STATUS_MINUS_5]):
        simulate(rogue_system(tmp_path), parameters={"rogue.fault": Fault.STATUS_MINUS_5}, in_process=True)


@pytest.mark.parametrize("fault", HARMLESS, ids=lambda fault: fault.name)
def test_what_harms_only_the_fmus_own_process_disturbs_nothing(
    tmp_path: Path, fault: Fault, capfd: pytest.CaptureFixture[str]
) -> None:
    result = simulate(rogue_system(tmp_path), parameters={"rogue.fault": fault})
    assert result["rogue.y"].tolist() == [H * k for k in range(9)] and not result.partial
    printed = capfd.readouterr()
    assert printed.out == ""  # where results go
    assert len(printed.err) < 70_000
    assert ("[more output, not shown]" in printed.err) == (fault == Fault.FLOOD)
    for started in re.findall(r"rogue: started (\d+)", "\n".join(result.notes)):
        assert ended(int(started))
    assert any("started" in note for note in result.notes) == (fault == Fault.CHILD)


def test_values_of_every_kind_pass_between_processes_as_in_one(tmp_path: Path) -> None:
    connections = [
        "clock.y -> sampler.u |<ssc:LinearTransformation factor='2' offset='3'/>",
        "clock.steps -> sampler.n",
        "clock.even -> sampler.b",
        "sampler.y -> clock.u",
    ]
    system = write_ssd(tmp_path / "a.ssd", {name: stub(name) for name in ("clock", "sampler")}, connections)
    parameters = {"clock.offset": 0.1, "clock.start_steps": 7}
    options = {"parameters": parameters, "record": ["clock", "sampler.inside", "sampler.m", "sampler.c", "clock.y"][1:]}
    apart_, together = simulate(system, **options), simulate(system, in_process=True, **options)
    assert apart_.names == together.names and apart_.notes == together.notes
    for name in together.names:
        assert apart_[name].dtype == together[name].dtype
        assert np.array_equal(apart_[name], together[name])


def test_messages_and_failures_of_a_python_fmu_are_those_of_a_run_in_process(tmp_path: Path) -> None:
    system = write_ssd(tmp_path / "a.ssd", {"faulty": stub("faulty")})
    for fault in (1, 3):
        said = []
        for in_process in (False, True):
            with pytest.raises(SimulationError) as raised:
                simulate(system, parameters={"faulty.fault": fault}, in_process=in_process)
            said.append(str(raised.value))
        assert said[0] == said[1]
    assert "faulty: oil is low" in simulate(system, parameters={"faulty.fault": 5}).notes


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda number: number.name)
def test_one_signal_ends_a_run_whose_fmu_hangs(
    tmp_path: Path, number: signal.Signals, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(master, "_BETWEEN_PROGRESS", -1.0)

    def press(done: int, _total: int) -> None:
        if done == 4:  # the next step hangs
            signal.raise_signal(number)

    with pytest.raises((KeyboardInterrupt, Terminated)) as raised:
        simulate(rogue_system(tmp_path), parameters={"rogue.fault": Fault.HANG}, progress=press)
    assert raised.type is (KeyboardInterrupt if number == signal.SIGINT else Terminated)
    assert raised.value.result.partial == "5 of 9 rows: interrupted"
    assert signal.getsignal(number) in (signal.default_int_handler, signal.SIG_DFL)


KILLED = """
import sys
from imufmu import simulate
from imufmu.cosim import master
from imufmu.fmi.child import Child

master._BETWEEN_PROGRESS = -1.0
start = Child.__init__

def tell(self, *arguments):
    start(self, *arguments)
    print(self._process.pid, flush=True)

def last_before_it_hangs(done, total):
    if done == 4:
        print("now", flush=True)

Child.__init__ = tell
simulate(sys.argv[1], parameters={"rogue.fault": 6}, progress=last_before_it_hangs)
"""


def test_processes_and_folders_of_a_killed_run_do_not_survive_it(tmp_path: Path) -> None:
    scratch = tmp_path / "scratch"
    command = [sys.executable, "-c", KILLED, str(rogue_system(tmp_path))]
    run = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=os.environ | {"TMPDIR": str(scratch)})
    assert run.stdout
    process = int(run.stdout.readline())
    assert run.stdout.readline() == "now\n"
    time.sleep(0.2)  # until the step has begun; a process that is told nothing more would end by itself
    run.kill()
    run.communicate()
    assert ended(process)
    assert [path for path in scratch.iterdir() if path.is_dir()] != []
    simulate(rogue_system(tmp_path), in_process=True)  # sweeps


def test_ours_are_those_built_here_to_the_last_byte(tmp_path: Path) -> None:
    built, copy = cached_fmu("lee2012"), tmp_path / "lee2012.fmu"
    copy.write_bytes(built.read_bytes())
    assert is_ours(built) and is_ours(copy)
    changed = bytearray(built.read_bytes())
    changed[-1] ^= 1  # the last byte of the archive's comment, or of its length
    copy.write_bytes(changed)
    os.utime(copy, ns=(built.stat().st_atime_ns, built.stat().st_mtime_ns))
    assert not is_ours(copy)
    assert not is_ours(copy.rename(tmp_path / "other.fmu"))
    assert not is_ours(tmp_path / "lee2012.fmu")  # which is gone


def test_ours_run_in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(apart, "Guest", None)
    assert all(part.ours for part in System.read(locate("pendulum_lee2012")).parts)
    assert simulate("pendulum_lee2012", stop_time=0.1).names


def test_an_fmu_that_brings_another_imufmu_along_runs_in_its_own_process(tmp_path: Path) -> None:
    other = tmp_path / "lee2012.fmu"
    with zipfile.ZipFile(cached_fmu("lee2012")) as source, zipfile.ZipFile(other, "w") as target:
        for member in source.namelist():
            version = b"# of another version\n" if member.endswith("blocks/block.py") else b""
            target.writestr(member, source.read(member) + version)
    recording = recorded(tmp_path)
    with pytest.raises(SimulationError, match="another version of imufmu"):
        replay(recording, other, in_process=True)
    expected = replay(recording, cached_fmu("lee2012"))
    for name, values in replay(recording, other).columns.items():
        assert np.array_equal(values, expected.columns[name])


def recorded(folder: Path) -> reading.Recording:
    """1 s at rest, without the sample at 0.25 s."""
    rows = np.delete(np.arange(9), 2)
    path = folder / "rest.csv"
    at_rest = {"gyro": np.zeros((8, 3)), "accel": np.tile([0, 0, 9.81], (8, 1))}
    write_csv(path, {"time": H * rows, **at_rest})
    return reading.read(path)


def test_a_replay_keeps_the_rows_up_to_a_fault(tmp_path: Path) -> None:
    with pytest.raises(SimulationError, match=FAULTS[Fault.SEGMENTATION].replace("rogue", "Fake")) as raised:
        replay(recorded(tmp_path), rogue(), {"fault": Fault.SEGMENTATION})
    partial = raised.value.result
    assert partial.columns["y"].tolist() == [0.125, 0.25, 0.5]
    assert partial.partial.startswith("3 of 8 rows: Fake: ")
    partial.to_csv(tmp_path / "out.csv")
    lines = (tmp_path / "out.csv").read_text().splitlines()
    assert lines[1:4] == ["0,0.125", "0.125,0.25", "0.375,0.5"]
    assert lines[4:] == [f"# partial: {partial.partial}"]
    assert len(INPUTS) == 6


def test_an_impossible_patience_is_refused(tmp_path: Path) -> None:
    for seconds in (0.0, -1.0, float("nan")):
        with pytest.raises(ValueError, match="step_timeout"):
            simulate(rogue_system(tmp_path), step_timeout=seconds)


@pytest.mark.parametrize("suffix", ["csv", "h5"])
def test_the_command_line_ends_with_1_one_line_and_a_file_marked_as_partial(tmp_path: Path, suffix: str) -> None:
    output = tmp_path / f"r.{suffix}"
    command = ["run", str(rogue_system(tmp_path)), "--set", f"rogue.fault={Fault.EXIT_0:d}", "--output", str(output)]
    done = CliRunner().invoke(app, command)
    assert isinstance(done.exception, SimulationError)  # which main() turns into a line and exit code 1
    assert "is partial: 5 of 9 rows" in " ".join(done.output.split())
    if suffix == "csv":
        lines = output.read_text().splitlines()
        assert len(lines) == 1 + 5 + 1 and lines[-1] == f"# partial: 5 of 9 rows: {done.exception}"
    else:
        result = read_hdf5(output)
        assert len(result.time) == 5 and result.partial == f"5 of 9 rows: {done.exception}"
