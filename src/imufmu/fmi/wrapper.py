"""What the adapter must know of PythonFMU's compiled wrapper, version 0.7.0, to leave its host alive.

The wrapper calls a slave's methods through Python's C interface. Three of its faults are made good here: it gives some
references back twice (``hold``), it may write into freed memory when the process ends (``let_go_at_the_end``), and it
filters messages by categories of which it knows nothing (``Log``).
"""

from __future__ import annotations

import ctypes
import os
import sys
from typing import Any

LOG_ALL = "logAll"

_on_linux = sys.platform == "linux"  # the wrapper's other binary is for Windows, where none of this could be tried


def hold(*things: Any) -> None:
    """Add a reference to each that is never given back.

    The wrapper releases some objects once more than it acquired them: the namespace of the FMU's script when it looks
    up the class in it; after an exception the slave, its class and its log. Without a reference to spare they are
    freed, and the next call crashes the host.
    """
    for thing in things:
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(thing))


class _DlInfo(ctypes.Structure):
    """What dladdr tells of an address: the library that it lies in."""

    _fields_ = [
        ("file", ctypes.c_char_p),
        ("base", ctypes.c_void_p),
        ("symbol", ctypes.c_char_p),
        ("address", ctypes.c_void_p),
    ]


_RTLD_NOLOAD, _RTLD_NODELETE = 0x4, 0x1000  # of Linux
_pinned: set[int | None] = set()  # addresses of the libraries that will let go at exit


def let_go_at_the_end(logger: int) -> None:
    """Make the wrapper release Python once, and in time. logger: address of its log, 0 if there is none.

    It keeps the interpreter in a static variable. That is destroyed when the process ends, but not cleared, and then
    the library's own destructor releases it again: it writes into freed memory, and the next malloc or free may abort.
    A Python program does not need the wrapper to keep Python alive: it is released now. Elsewhere the wrapper started
    Python: it is released at exit, before whatever was loaded until this call is destroyed, so before the variable and
    before libraries that Python's objects lie in. For that the wrapper has to stay loaded.
    """
    if not (_on_linux and logger):
        return
    import _ctypes

    process, info = ctypes.CDLL(None), _DlInfo()
    table = ctypes.c_void_p.from_address(logger)  # of functions: the first member of an object with virtual ones
    in_python = bool(sys.orig_argv)  # which an embedded interpreter has not
    stay = 0 if in_python else _RTLD_NODELETE
    try:
        process.dladdr(table, ctypes.byref(info))
        library = ctypes.PyDLL(os.fsdecode(info.file or b""), os.RTLD_NOW | _RTLD_NOLOAD | stay)
        finalize, at_exit = library.finalizePythonInterpreter, process.__cxa_atexit
    except (OSError, AttributeError):  # no such library or function: another wrapper, which this is not for
        return
    if in_python:
        finalize()
    elif info.base not in _pinned:
        _pinned.add(info.base)
        at_exit(ctypes.cast(finalize, ctypes.c_void_p), None, None)
    _ctypes.dlclose(library._handle)


class Log:
    """The wrapper's log, read where it lies: whether the host wants messages, and of which categories.

    Its members, as the GNU C++ library lays them out: the table of virtual functions, a flag, the name of the instance
    (a string), the categories (a vector of strings; empty for all). ``is_known`` says whether they are where they
    should be, by the name.
    """

    _ON, _NAME, _CATEGORIES, _STRING = 8, 16, 48, 32  # bytes from the start; size of a string

    def __init__(self, logger: int, instance_name: str) -> None:
        self._at = logger
        name = instance_name.encode()
        self.is_known = bool(_on_linux and logger) and self._text(logger + self._NAME, len(name)) == name

    @property
    def is_on(self) -> bool:
        """Whether messages arrive at all; true where that is not known."""
        return not self.is_known or ctypes.c_bool.from_address(self._at + self._ON).value

    def category(self, own: str) -> str:
        """The category for a message of category ``own``: that for all, another name, if the host asked for it."""
        if not self.is_known:
            return own
        begin, end = ((ctypes.c_size_t * 2).from_address(self._at + self._CATEGORIES))[:]
        all_ = LOG_ALL.encode()
        wanted = [self._text(at, len(all_)) == all_ for at in range(begin, end, self._STRING)]
        return LOG_ALL if any(wanted) else own

    @staticmethod
    def _text(at: int, length: int) -> bytes | None:
        """The C++ string at an address if it has this length."""
        start, size = ((ctypes.c_size_t * 2).from_address(at))[:]
        return ctypes.string_at(start, size) if size == length else None
