"""A block as a library in this process: generated C, compiled once per machine and kept in the user's cache."""

from __future__ import annotations

import ctypes
import hashlib
import os
import platform
import shutil
import sys
import tempfile
import warnings
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from platformdirs import user_cache_path

from ..blocks.block import Block, SampledBlock
from ..files.atomic import atomic_write
from ..files.cache import cached, is_whole
from .equations import equations, functions_of, sizes

_TEMPLATES = Path(__file__).parent / "c"
_EXPORT = "#ifdef _WIN32\n#define EXPORTED __declspec(dllexport)\n#else\n"
_EXPORT += '#define EXPORTED __attribute__((visibility("default")))\n#endif\n'
_SUFFIX = {"win32": ".dll", "darwin": ".dylib"}.get(sys.platform, ".so")

# Rows that the interpreter evaluates in the time in which a compiler gets through the same equations, about.
_ROWS_FOR_A_COMPILATION = 30_000


class Compiled:
    """The library of one block, as far as it is worth having."""

    def __init__(self, block: Block) -> None:
        self._source = _source_of(block)
        self._path = _folder() / _digest(self._source) / f"{block.name}{_SUFFIX}"
        self._rows, self._kept = 0, False

    def library(self, rows: int) -> Any | None:
        """The library (ctypes) for so many more samples or solver steps, or None where the interpreter serves better.

        One that is kept is always used. One is made when the interpreter would by now have taken as long as that takes,
        in all calls together, and there is a compiler.
        """
        self._rows += rows
        self._kept = self._kept or is_whole(self._path)
        if not self._kept:
            if self._rows < _ROWS_FOR_A_COMPILATION or not _made(self._path, self._source):
                return None
            self._kept = True
        return _loaded(self._path)


@lru_cache(maxsize=64)
def compiled(block: Block) -> Compiled:
    """The one object of a block."""
    return Compiled(block)


def _digest(source: str) -> str:
    """Of what decides about the binary: the source and the compilers' flags."""
    flags = Path(__file__).with_name("compilers.py").read_bytes()
    return hashlib.sha256(source.encode() + flags).hexdigest()[:20]


def _source_of(block: Block) -> str:
    """The whole C: equations, their names and sizes, the loop over rows."""
    functions = functions_of(block)
    names = [f"#define {alias} {function.name()}" for alias, function in functions.items()]
    numbers = [f"#define {name} {number}" for name, number in sizes(block, functions).items()]
    loop = (_TEMPLATES / ("sampled.c" if isinstance(block, SampledBlock) else "continuous.c")).read_text()
    return "\n".join([equations(block, functions), _EXPORT, *names, *numbers, loop])


def _folder() -> Path:
    """In the user's cache, apart for every kind of machine."""
    return user_cache_path("imufmu") / "compiled" / f"{sys.platform}-{platform.machine()}"


def _made(path: Path, source: str) -> bool:
    """Whether the library could be compiled; a warning says once why not."""
    from . import compilers  # with fmpy, which a library that is kept does not need

    def build() -> None:
        with tempfile.TemporaryDirectory(prefix="imufmu_build_") as scratch:
            code, made = Path(scratch) / "block.c", Path(scratch) / path.name
            code.write_text(source)
            here = compilers.PLATFORMS[compilers.own_platform()]
            compilers.compile_library(compilers.commands(here, path.name), code, made)
            with atomic_write(path) as temporary:
                shutil.copyfile(made, temporary)

    try:
        cached(path, build)
    except (compilers.BuildError, OSError) as error:
        _say_once(str(error).splitlines()[0])
        return False
    return True


@cache
def _say_once(reason: str) -> None:
    warnings.warn(f"blocks run in CasADi's interpreter, some ten times slower: {reason}", stacklevel=2)


@lru_cache
def _loaded(path: Path) -> Any | None:
    """The library; None where others could have put it there."""
    if os.name == "posix":
        for place in (path, path.parent):
            status = place.stat()
            if status.st_uid != os.getuid() or status.st_mode & 0o022:
                _say_once(f"{place} belongs to others or can be written by them; delete it")
                return None
    return ctypes.CDLL(str(path))


def pointer(array: np.ndarray) -> Any:
    """Address of a contiguous array of doubles, for a call."""
    assert array.flags.c_contiguous and array.dtype == float
    return ctypes.c_void_p(array.ctypes.data)
