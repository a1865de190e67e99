"""C compilers for the binaries of native FMUs: ziglang from PyPI for every platform, or the system's for its own.

FMI 2.0 names a folder for each platform. ``darwin64`` holds one file for both processors of a Mac; newer importers also
look into ``aarch64-darwin`` and ``aarch64-linux``.
"""

from __future__ import annotations

import importlib.metadata
import importlib.util
import os
import shlex
import shutil
import signal
import struct
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO

import fmpy


class BuildError(ValueError):
    """An FMU or a library cannot be built; the message says why."""


HEADERS = Path(fmpy.__file__).parent / "c-code"  # of the FMI standard

# Old systems on purpose: what runs on them runs on all later ones. glibc 2.17 is of 2012, macOS 10.13 of 2017.
_LINUX = {"x86_64": "x86_64-linux-gnu.2.17", "aarch64": "aarch64-linux-gnu.2.17"}
_MACOS = {"x86_64": "x86_64-macos.10.13", "aarch64": "aarch64-macos.11.0"}


@dataclass(frozen=True)
class Platform:
    """A folder below ``binaries``: suffix of its libraries, zig targets that go into one file, name for people."""

    folder: str
    suffix: str
    targets: tuple[str, ...]
    title: str


PLATFORMS = {
    platform.folder: platform
    for platform in (
        Platform("linux64", ".so", (_LINUX["x86_64"],), "64-bit Linux (Intel)"),
        Platform("win64", ".dll", ("x86_64-windows-gnu",), "64-bit Windows (Intel)"),
        Platform("darwin64", ".dylib", (_MACOS["x86_64"], _MACOS["aarch64"]), "macOS (Intel and Apple)"),
        Platform("aarch64-linux", ".so", (_LINUX["aarch64"],), "64-bit Linux (ARM)"),
        Platform("aarch64-darwin", ".dylib", (_MACOS["aarch64"],), "macOS (Apple)"),
    )
}

_OWN_FOLDER = {
    "x86_64-linux": "linux64",
    "x86_64-windows": "win64",
    "x86_64-darwin": "darwin64",
    "aarch64-darwin": "darwin64",
    "aarch64-linux": "aarch64-linux",
}

# Results are to be those of the run in process, bit for bit: no shortcuts in floating point. Nobody reads errno. In
# scalar equations, pairs of numbers that share one instruction cost more to put together than they spare.
_ARITHMETIC = ("-fno-fast-math", "-ffp-contract=off", "-fno-math-errno", "-fno-tree-slp-vectorize")
_FLAGS = ("-std=c99", "-O2", *_ARITHMETIC, "-fvisibility=hidden", "-shared", "-s")

_running: set[subprocess.Popen[bytes]] = set()  # compilers, in any thread
_starting = threading.Lock()  # held while a compiler is started, or all are ended
_SECONDS = 600.0  # of one call; the first one for Windows takes 75 s on a slow machine

# Named behind the source, or the linker leaves it out.
_LIBRARIES = {".so": ("-lm",)}


def own_platform() -> str:
    """Folder name of the platform at hand. Raises BuildError where native FMUs are not built."""
    folder = _OWN_FOLDER.get(fmpy.platform_tuple)
    if folder is None:
        raise BuildError(f"native FMUs are not built for {fmpy.platform_tuple}; name platforms to build for others")
    return folder


def has_ziglang() -> bool:
    """Whether the compiler for every platform is installed."""
    return importlib.util.find_spec("ziglang") is not None


def commands(platform: Platform, name: str) -> list[list[str]]:
    """One compiler call without files per processor. name: file name of the library.

    Raises BuildError if no compiler for the platform is installed.
    """
    if has_ziglang():
        compiler = [sys.executable, "-m", "ziglang", "cc"]
        return [[*compiler, "-target", target, *_FLAGS, *_linking(platform, name)] for target in platform.targets]
    if platform.folder != _OWN_FOLDER.get(fmpy.platform_tuple) or platform.suffix == ".dll":
        raise BuildError(f"a binary for {platform.folder} needs the compiler ziglang: pip install imufmu[native]")
    macos = ["-arch", "x86_64", "-arch", "arm64", "-mmacosx-version-min=10.13"]
    both = macos if platform.suffix == ".dylib" else []
    return [[*_system_compiler(), *both, *_FLAGS, *_linking(platform, name)]]


def compile_program(source: Path, target: Path, platform: Platform | None = None) -> None:
    """Make a program for a platform, the one at hand without. Raises BuildError with what the compiler said."""
    target_flags = ["-target", platform.targets[0]] if platform else []
    compiler = [sys.executable, "-m", "ziglang", "cc", *target_flags] if has_ziglang() else _system_compiler()
    suffix = (platform or PLATFORMS[own_platform()]).suffix
    libraries = ["-ldl"] if suffix == ".so" else []
    _compile([*compiler, "-std=c99", "-O2", f"-I{HEADERS}"], source, target, libraries)


def identity() -> str:
    """Which compiler ``commands`` uses, with its version."""
    if has_ziglang():
        return f"ziglang {importlib.metadata.version('ziglang')}"
    return _said([*_system_compiler(), "--version"])[1]


def _system_compiler() -> list[str]:
    """The command in the variable CC, or cc. Raises BuildError if there is none."""
    wanted = os.environ.get("CC", "cc")
    try:
        compiler = shlex.split(wanted)
    except ValueError as error:
        raise BuildError(f"the variable CC is {wanted!r}, which is no command: {error}") from error
    if not compiler or not shutil.which(compiler[0]):
        raise BuildError(f"no C compiler: {wanted!r} is not installed, nor is ziglang. pip install imufmu[native]")
    return compiler


def _linking(platform: Platform, name: str) -> list[str]:
    match platform.suffix:
        case ".so":
            return ["-fPIC", "-Wl,-Bsymbolic,-z,defs"]
        case ".dylib":
            return [f"-Wl,-install_name,@rpath/{name}"]
        case _:
            return []


def compile_library(calls: list[list[str]], source: Path, target: Path) -> None:
    """Make the library ``target`` by calls from ``commands``. Raises BuildError with what the compiler said."""
    parts = []
    for i, call in enumerate(calls):
        part = target.with_name(f"{i}_{target.name}")
        _compile(call, source, part, _LIBRARIES.get(target.suffix, ()))
        parts.append(part.read_bytes())
    target.write_bytes(parts[0] if len(parts) == 1 else universal(parts))


def _compile(call: Sequence[str], source: Path, target: Path, libraries: Sequence[str]) -> None:
    code, said = _said([*call, str(source), "-o", str(target), *libraries])
    if code:
        lines = [line for line in said.splitlines() if "error" in line] or said.splitlines()
        raise BuildError(f"{_named(call)} failed on {source}:\n" + "\n".join(lines[:5]))
    if not target.is_file() or not target.stat().st_size:
        raise BuildError(f"{_named(call)} says that it compiled {source}, but made no file: is it a C compiler?")


def _said(command: Sequence[str]) -> tuple[int, str]:
    """Exit code and words of a compiler. Raises BuildError if it cannot be started or does not end.

    It runs in a session of its own, so that what it starts ends with it, and through files, which nobody waits for.
    """
    with TemporaryFile() as words, _started(command, words) as process:
        try:
            process.wait(_SECONDS)
        except subprocess.TimeoutExpired:
            _end(process)
            raise BuildError(f"{_named(command)} did not end within {_SECONDS:g} s; it was stopped") from None
        except BaseException:
            _end(process)
            raise
        finally:
            _running.discard(process)
        words.seek(0)
        return process.returncode, words.read().decode(errors="replace")


def _started(command: Sequence[str], words: IO[bytes]) -> subprocess.Popen[bytes]:
    with _starting:  # one that runs already is in the set when another thread ends them all
        try:
            process = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=words, stderr=subprocess.STDOUT, start_new_session=True
            )
        except OSError as error:
            raise BuildError(f"{_named(command)} cannot be started: {error.strerror or error}") from error
        _running.add(process)
        return process


def _end(process: subprocess.Popen[bytes]) -> None:
    if os.name == "nt":
        process.kill()
        return
    with suppress(ProcessLookupError, PermissionError):  # of its session nobody is left
        os.killpg(process.pid, signal.SIGKILL)


@contextmanager
def compilers_end_with_us(pool: Executor) -> Iterator[None]:
    """After Ctrl-C or any other exception no compiler that ``pool`` has started goes on, and none starts."""
    try:
        yield
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        with _starting:
            for process in set(_running):
                _end(process)
        raise


def _named(command: Sequence[str]) -> str:
    return shlex.join(command[:5])


def universal(libraries: list[bytes]) -> bytes:
    """Mach-O libraries for different processors as one file: a table of them, then each at the start of a page."""
    page = 14  # 2^14 bytes, the larger pages of Apple's processors
    table = struct.pack(">II", 0xCAFEBABE, len(libraries))
    file = bytearray(len(table) + 20 * len(libraries))
    for library in libraries:
        processor, variant = struct.unpack_from("<4xII", library)
        file += bytes(-len(file) % 2**page)
        table += struct.pack(">IIIII", processor, variant, len(file), len(library), page)
        file += library
    file[: len(table)] = table
    return bytes(file)
