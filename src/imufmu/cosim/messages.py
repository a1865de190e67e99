"""What FMUs log, kept per instance.

fmpy's proxy, which formats C messages, knows one logger per process: the last one installed. So there is one here too;
it tells instances apart by the environment that they were given, and prints what is not from an instance of ours.

The proxy is a binary of fmpy that is not there for every platform, as on 64-bit ARM Linux. Messages then arrive as
formats, their arguments not put in.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from contextlib import suppress
from ctypes import byref
from itertools import count
from typing import Any

import fmpy
from fmpy.fmi1 import printLogMessage
from fmpy.fmi2 import (
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
    fmi2OK,
)

_LATEST = 3  # messages quoted with an error
_MOST_WARNINGS = 50  # different warnings kept of one instance
_ADDED = "Fatal py exception encountered"  # by PythonFMU, to what its slave has said of the same call
_environments = count(1)
_listening: dict[int, Messages] = {}


class Messages:
    """The messages of one FMU instance. ``callbacks`` is what the instance must be given; call ``close`` in the end.

    say: called with what is the latest after each message.
    """

    def __init__(self, say: Callable[[str], None] | None = None) -> None:
        self._say = say
        self._environment = next(_environments)
        self._complaints: deque[str] = deque(maxlen=_LATEST)
        self._remarks: deque[str] = deque(maxlen=_LATEST)
        self._warnings: dict[str, None] = {}
        self.callbacks = fmi2CallbackFunctions(
            logger=_LOGGER,
            allocateMemory=_ALLOCATE,
            freeMemory=_FREE,
            componentEnvironment=self._environment,
        )
        _format_messages_of(self.callbacks)
        _listening[self._environment] = self

    def close(self) -> None:
        """Stop listening: the instance is gone."""
        _listening.pop(self._environment, None)

    def add(self, status: int, text: str) -> None:
        """Keep a message with its fmi2Status."""
        if self._complaints and text.startswith(_ADDED):
            return
        (self._remarks if status == fmi2OK else self._complaints).append(text)
        if status != fmi2OK and len(self._warnings) < _MOST_WARNINGS:
            self._warnings[text] = None
        if self._say:
            self._say(self.latest)

    @property
    def warnings(self) -> list[str]:
        """Different messages with a status other than OK, in order."""
        return list(self._warnings)

    @property
    def latest(self) -> str:
        """The last complaints, or the last remarks if there was no complaint; empty if the FMU said nothing."""
        return "; ".join(self._complaints or self._remarks)


def _format_messages_of(callbacks: fmi2CallbackFunctions) -> None:
    """Put fmpy's proxy before the logger, where there is one for this platform."""
    with suppress(OSError):  # its library is loaded by the import
        from fmpy.logging import addLoggerProxy

        addLoggerProxy(byref(callbacks))


def _receive(environment: int | None, instance: bytes, status: int, category: bytes, message: bytes) -> None:
    listener = _listening.get(environment or 0)
    if listener is None:
        printLogMessage(environment, instance, status, category, message)
    else:
        listener.add(status, (message or b"").decode(errors="replace").strip())


_LOGGER: Any = fmi2CallbackLoggerTYPE(_receive)
_ALLOCATE: Any = fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
_FREE: Any = fmi2CallbackFreeMemoryTYPE(fmpy.free)
