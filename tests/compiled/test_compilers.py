"""A compiler that fails, hangs or does nothing ends in one message that names it, and with nothing left behind."""

from __future__ import annotations

import os
import shlex
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from imufmu.compiled import compilers
from imufmu.compiled.compilers import BuildError, compile_program, compilers_end_with_us, identity
from support.optional import needs

pytestmark = needs("POSIX")  # the compilers of these tests are shell scripts


@pytest.fixture(autouse=True)
def only_the_systems_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compilers, "has_ziglang", lambda: False)


def compiler(folder: Path, monkeypatch: pytest.MonkeyPatch, lines: str) -> Path:
    """Let this shell script be the compiler of the system."""
    script = folder / "a compiler"
    script.write_text(f"#!/bin/sh\n{lines}\n")
    script.chmod(0o755)
    monkeypatch.setenv("CC", shlex.quote(str(script)))
    return script


@pytest.mark.parametrize(
    "lines", ["exit 0", "for last; do :; done; touch empty", 'while [ "$1" != -o ]; do shift; done; : > "$2"']
)
def test_a_compiler_that_makes_nothing_is_named(lines: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    script = compiler(tmp_path, monkeypatch, lines)
    with pytest.raises(BuildError, match="made no file: is it a C compiler") as caught:
        compile_program(tmp_path / "a.c", tmp_path / "a")
    assert str(script) in str(caught.value)


def test_a_compiler_that_fails_is_named_with_what_it_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    script = compiler(tmp_path, monkeypatch, "echo a.c:1: error: no such thing >&2; exit 3")
    with pytest.raises(BuildError, match=r"failed on .*a\.c:\na\.c:1: error: no such thing$") as caught:
        compile_program(tmp_path / "a.c", tmp_path / "a")
    assert str(script) in str(caught.value)


HANGS = "trap '' TERM\nsleep 1000 &\necho $! > child\nwait"


def test_a_compiler_that_hangs_is_stopped_with_all_that_it_started(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(compilers, "_SECONDS", 1.0)
    script = compiler(tmp_path, monkeypatch, HANGS)
    for use in (identity, lambda: compile_program(tmp_path / "a.c", tmp_path / "a")):
        with pytest.raises(BuildError, match="did not end within 1 s") as caught:
            use()
        assert str(script) in str(caught.value)
        assert ended(int((tmp_path / "child").read_text()))


def test_ctrl_c_stops_the_compilers_of_other_threads_and_those_that_wait(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    compiler(tmp_path, monkeypatch, HANGS)
    with (
        pytest.raises(KeyboardInterrupt),
        ThreadPoolExecutor(1) as pool,
        compilers_end_with_us(pool),
    ):
        running, waiting = (pool.submit(compile_program, tmp_path / "a.c", tmp_path / "a") for _ in range(2))
        while not (tmp_path / "child").exists() or not (tmp_path / "child").read_text().strip():
            threading.Event().wait(0.01)
        raise KeyboardInterrupt
    assert isinstance(running.exception(), BuildError) and waiting.cancelled()
    assert ended(int((tmp_path / "child").read_text()))


def test_a_compiler_that_cannot_be_started_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    script = compiler(tmp_path, monkeypatch, "")
    script.write_bytes(b"\x7fELF nothing that runs")
    with pytest.raises(BuildError, match="cannot be started") as caught:
        compile_program(tmp_path / "a.c", tmp_path / "a")
    assert str(script) in str(caught.value)


def ended(process: int) -> bool:
    """Whether a process is gone, or only waits for somebody to ask how it ended."""
    for _ in range(500):
        try:
            os.kill(process, 0)
        except ProcessLookupError:
            return True
        state = Path(f"/proc/{process}/stat")
        if state.exists() and state.read_text().split(")")[-1].split()[0] == "Z":
            return True
        threading.Event().wait(0.01)
    return False
