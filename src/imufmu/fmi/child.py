"""A process of its own for what may crash it, hang in it or flood it with output."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO

_SHOWN = 64 * 1024  # bytes of output handed on
_TAIL = 2048  # bytes kept for messages
_QUOTED = 3  # lines
_AWAKE = 1e-4  # s without sleep while an answer is awaited: to fall asleep and be woken takes longer than most steps
_GRACE = 2.0  # s to end after the pipes were closed

Listener = Callable[[bytes], None]


class Child:
    """A Python process that reads requests from its standard input and answers on its standard output.

    arguments: what follows the name of the interpreter. on_output: called, in a thread, with what arrives on standard
    error, up to 64 kB of it; the rest is read and dropped, so that a flood blocks nothing and fills nothing. folder:
    for temporary files of the process.

    It leads a process group of its own: Ctrl-C does not reach it, and ``kill`` also ends what it has started.
    """

    def __init__(self, arguments: Sequence[str], folder: Path, on_output: Listener | None = None) -> None:
        places = {name: str(folder) for name in ("TMPDIR", "TEMP", "TMP")}
        self._process = subprocess.Popen(
            [sys.executable, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            bufsize=0,
            start_new_session=True,
            creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),
            env=os.environ | places,
        )
        assert self._process.stdin and self._process.stdout and self._process.stderr
        self.requests, self.answers = self._process.stdin.fileno(), self._process.stdout.fileno()
        self._tail = b""
        self._listener = on_output
        self._ready = _readiness(self.answers)
        self._reader = threading.Thread(target=self._drain, args=(self._process.stderr,), daemon=True)
        self._reader.start()

    def _drain(self, output: IO[bytes]) -> None:
        """Read the output to its end, whatever its size."""
        shown = 0
        with output:
            while chunk := os.read(output.fileno(), 65536):
                self._tail = (self._tail + chunk)[-_TAIL:]
                if self._listener and shown < _SHOWN:
                    self._listener(chunk[: _SHOWN - shown])
                    shown += len(chunk)
                    if shown >= _SHOWN:
                        self._listener(b"\n[more output, not shown]\n")

    def wait(self, seconds: float, check: Callable[[], None] = lambda: None) -> bool:
        """Wait until there is an answer to read, or none to come; False if that takes longer.

        check: called every 0.1 s; what it raises ends the waiting.
        """
        if self._ready(min(seconds, 0.1)):
            return True
        deadline = time.monotonic() + seconds
        while not self._ready(min(seconds, 0.1)):
            check()
            if self._process.poll() is not None:
                self._kill_group()  # something that it started may hold the pipe open
                return True
            if time.monotonic() > deadline:
                return self._ready(0.0)  # this process may have been the one that slept
        return True

    def fate(self) -> str:
        """How the process ended, for a message, once it answers no more."""
        with suppress(subprocess.TimeoutExpired):
            code = self._process.wait(_GRACE)
            self._reader.join(_GRACE)
            if code < 0:
                return f"crashed its process ({_signal_name(-code)})"
            return f"ended its process with exit code {code}"
        return "garbled the connection to its process"

    @property
    def last_lines(self) -> str:
        """The last lines of its output, without empty ones."""
        lines = self._tail.decode(errors="replace").splitlines()
        return "\n".join([line.strip() for line in lines if line.strip()][-_QUOTED:])

    def end(self) -> None:
        """Wait a moment for its end, and see that it and all it has started are gone."""
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(_GRACE)
        self.kill()

    def kill(self) -> None:
        """End the process and all it has started, at once."""
        self._kill_group()
        self._process.wait()
        self._reader.join(_GRACE)  # it closes its pipe
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe
            pipe.close()

    def _kill_group(self) -> None:
        if sys.platform == "win32":
            self._process.kill()
        else:
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self._process.pid, signal.SIGKILL)


def _signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


if sys.platform == "win32":
    import msvcrt
    from _winapi import PeekNamedPipe

    def _readiness(pipe: int) -> Callable[[float], bool]:
        """Whether there is something to read, or the end, within seconds. Windows cannot wait for a plain pipe."""

        def ready(seconds: float) -> bool:
            deadline = time.monotonic() + seconds
            with suppress(OSError):  # the other end is closed
                while not PeekNamedPipe(msvcrt.get_osfhandle(pipe), 0)[0]:
                    if time.monotonic() > deadline:
                        return False
                    time.sleep(0)
            return True

        return ready
else:

    def _readiness(pipe: int) -> Callable[[float], bool]:
        """Whether there is something to read, or the end, within seconds."""
        poll = select.poll()
        poll.register(pipe, select.POLLIN)
        give_way = getattr(os, "sched_yield", lambda: None)  # macOS has none

        def ready(seconds: float) -> bool:
            sleep_at = time.perf_counter() + min(seconds, _AWAKE)
            while time.perf_counter() < sleep_at:
                if poll.poll(0):
                    return True
                give_way()
            return bool(poll.poll(1000 * seconds))

        return ready
