"""What passes between a run and the process of a foreign FMU: commands and answers in pipes, values in shared memory.

A command is of fixed size; a few bring data along, as JSON. The answer to it has a kind and a text. The shared memory
is a file mapped by both: which call is being made, what the FMU said last, and a buffer per inlet and outlet.
"""

from __future__ import annotations

import json
import mmap
import os
import struct
from collections.abc import Callable, Sequence
from ctypes import c_int
from pathlib import Path
from typing import Any

import numpy as np

from .slave import DTYPES

_COMMAND = struct.Struct("=iIddd")  # verb, bytes of data, three times
_ANSWER = struct.Struct("=iI")  # done or failed, bytes of text
_DONE = _ANSWER.pack(1, 0)
_LONGEST_ANSWER = 2**20  # bytes
_NOW, _SAID, _BUFFERS = 0, 8, 1024  # places in the shared memory
_MOST_SAID = _BUFFERS - _SAID - 4
_ALIGNED = 64  # bytes

Numbers = tuple[float, float, float]


class Verb:
    """What the process is asked to do. Plain numbers: members of an Enum would cost more than the pipe."""

    ADVANCE, CONNECT, INSTANTIATE, ENTER, WRITE, READ_INITIAL, EXIT, READ, NOTES, FREE = range(10)


class Answer:
    """What came of a command: nothing, all that was wanted, or the end of the run. Plain numbers, as Verb."""

    FAILED, DONE, ENDED = range(3)


def send_command(pipe: int, verb: int, times: Numbers, data: Any = None) -> None:
    """Raises BrokenPipeError where nobody listens any more."""
    if data is None:
        os.write(pipe, _COMMAND.pack(verb, 0, *times))  # so short that it is written whole
    else:
        content = json.dumps(data).encode()
        _write(pipe, _COMMAND.pack(verb, len(content), *times) + content)


def receive_command(pipe: int) -> tuple[int, Numbers, Any]:
    """The next command: verb, times, data. Raises EOFError where none can come any more."""
    verb, size, time, h, reached = _COMMAND.unpack(_read(pipe, _COMMAND.size))
    return verb, (time, h, reached), json.loads(_read(pipe, size)) if size else None


def send_answer(pipe: int, kind: int, text: str = "") -> None:
    """kind: one of Answer, with the text of the error or end."""
    if kind == Answer.DONE and not text:
        os.write(pipe, _DONE)
    else:
        content = text.encode(errors="replace")
        _write(pipe, _ANSWER.pack(kind, len(content)) + content)


def receive_answer(pipe: int, wait: Callable[[], bool]) -> tuple[int, str]:
    """The answer to the last command, the beginning of which is there.

    wait: waits for more; False where there is none in time. Raises EOFError where no answer can come any more, also
    where there is something in its place that is none.
    """
    header = os.read(pipe, _ANSWER.size)
    if header == _DONE:
        return Answer.DONE, ""
    if len(header) < _ANSWER.size:
        raise EOFError
    kind, size = _ANSWER.unpack(header)
    if kind not in (Answer.FAILED, Answer.DONE, Answer.ENDED) or size > _LONGEST_ANSWER:
        raise EOFError
    text = b""
    while len(text) < size:
        more = os.read(pipe, size - len(text)) if wait() else b""
        if not more:
            raise EOFError
        text += more
    return kind, text.decode(errors="replace")


def _write(pipe: int, content: bytes) -> None:
    written = os.write(pipe, content)
    while written < len(content):
        written += os.write(pipe, content[written:])


def _read(pipe: int, size: int) -> bytes:
    content = os.read(pipe, size)
    while len(content) < size:
        more = os.read(pipe, size - len(content))
        if not more:
            raise EOFError
        content += more
    return content


class Shared:
    """Memory that two processes see. sizes: (kind, number of values) of each buffer, in order.

    now: number of the call that is being made. buffers: arrays. Raises OSError where the disk is full.
    """

    def __init__(self, path: Path, sizes: Sequence[tuple[str, int]]) -> None:
        places, end = [], _BUFFERS
        for kind, count in sizes:
            places.append(end)
            end += -(-count * np.dtype(DTYPES[kind]).itemsize // _ALIGNED) * _ALIGNED
        with path.open("a+b") as file:
            if file.tell() == 0:
                file.write(bytes(end))  # not left as a hole: a disk that is full says so here, not by a signal later
                file.flush()
            self._memory = mmap.mmap(file.fileno(), end)
        self.now = c_int.from_buffer(self._memory, _NOW)
        self.buffers = [
            np.frombuffer(self._memory, DTYPES[kind], count, place)
            for (kind, count), place in zip(sizes, places, strict=True)
        ]

    @property
    def said(self) -> str:
        """What the FMU said last."""
        size = min(int.from_bytes(self._memory[_SAID : _SAID + 4], "little"), _MOST_SAID)
        return self._memory[_SAID + 4 : _SAID + 4 + size].decode(errors="replace")

    def say(self, text: str) -> None:
        """Leave a text for the case that the process cannot answer any more."""
        content = text.encode(errors="replace")[:_MOST_SAID]
        self._memory[_SAID : _SAID + 4 + len(content)] = len(content).to_bytes(4, "little") + content
