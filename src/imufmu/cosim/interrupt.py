"""Ctrl-C between two calls instead of inside an FMU, where Python code of the FMU would take it for its own fault.

The signals that ask a program to end, SIGTERM and SIGHUP, are treated alike.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

_ASKING_TO_END = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]


class Terminated(SystemExit):
    """The process was asked to end by a signal other than that of Ctrl-C; the exit code is the shell's for it."""


def raise_at_once(number: int, frame: FrameType | None) -> None:
    """Handler of a signal: raises KeyboardInterrupt, or Terminated."""
    if number == signal.SIGINT:
        signal.default_int_handler(number, frame)
    raise Terminated(128 + number)


def clean_up_when_asked_to_end() -> None:
    """Let SIGTERM and SIGHUP raise Terminated, where nothing else is planned: what is unfinished is cleaned up."""
    for number in _ASKING_TO_END:
        if signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, raise_at_once)


@contextmanager
def interrupt_between_calls() -> Iterator[Callable[[], None]]:
    """Give a function that raises KeyboardInterrupt if Ctrl-C was pressed since; a second Ctrl-C interrupts at once.

    The end of the block checks too. Does nothing outside the main thread, or for a signal that the program handles
    itself. Asked to end by SIGTERM or SIGHUP it raises Terminated.
    """
    pressed = 0

    def check() -> None:
        if pressed:
            raise_at_once(pressed, None)

    def remember(number: int, frame: FrameType | None) -> None:
        nonlocal pressed
        if pressed:
            raise_at_once(number, frame)
        pressed = number

    usual = {signal.SIGINT: (signal.default_int_handler,)}
    usual |= {number: (signal.SIG_DFL, raise_at_once) for number in _ASKING_TO_END}
    before = {}
    if threading.current_thread() is threading.main_thread():
        before = {number: signal.getsignal(number) for number in usual if signal.getsignal(number) in usual[number]}
    for number in before:
        signal.signal(number, remember)
    try:
        yield check
        check()
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
