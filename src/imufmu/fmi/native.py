"""Build native FMUs: generated C, the wrapper of fmu_src/c and its binaries in one archive that needs nothing else.

Binaries are kept in the user's cache by everything that they depend on: sources, compiler and flags.
"""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import replace
from pathlib import Path
from xml.etree.ElementTree import indent, tostring

from platformdirs import user_cache_path

from .. import __version__
from ..blocks.block import Block, SampledBlock
from ..blocks.series import series
from ..blocks.signals import DeclarationError
from ..compiled.compilers import (
    HEADERS,
    PLATFORMS,
    BuildError,
    Platform,
    commands,
    compile_library,
    compilers_end_with_us,
    identity,
    own_platform,
)
from ..files.atomic import WriteError, atomic_write
from ..files.cache import cached
from ..files.locations import fmu_src_folder
from ..files.names import no_such
from ..files.scratch import scratch_folder
from ..registry import BLOCKS
from .build import source_digest, write_archive
from .documentation import documentation_page, icon
from .model_description import NATIVE_SOURCE, model_description
from .native_table import generate

_HEADERS = ("fmi2Functions.h", "fmi2FunctionTypes.h", "fmi2TypesPlatform.h")


def build_native(
    name: str,
    folder: Path,
    platforms: Sequence[str] | None = None,
    progress: Callable[[int, int], None] | None = None,
    imu: Mapping[str, float] | None = None,
) -> Path:
    """Write the native FMU of a block and return its path in ``folder``: name.fmu.

    name: of a registered block, or of several in series, as imu+lee2012, which makes imu_lee2012.fmu. platforms: names
    from PLATFORMS, compiled in parallel; by default the platform at hand. progress: called with the number of binaries
    that are ready and that of all. imu: start values of parameters of the block imu, such as ``gyro_bias[1]``, in place
    of its own, and the sample period of all.

    Raises BuildError for an unknown name or platform, blocks that do not fit together, no IMU among them where ``imu``
    is given, a compiler that is missing or fails, or a folder that cannot be written.
    """
    block = with_imu(block_called(name), imu) if imu else block_called(name)
    wanted = [_platform(given) for given in dict.fromkeys(platforms or [own_platform()])]
    target = folder / f"{block.name}.fmu"
    try:
        code = sources(block)
        binaries = _binaries(block.name, code, wanted, progress)
        folder.mkdir(parents=True, exist_ok=True)
        with atomic_write(target) as temporary:
            write_archive(_members(block, code, wanted) | binaries, temporary)
    except WriteError as error:
        raise BuildError(str(error)) from error
    except OSError as error:
        raise BuildError(f"cannot write {error.filename or target}: {error.strerror or error}") from error
    return target


def cached_native_fmu(name: str) -> Path:
    """Path of the native FMU of a block, named as for ``build_native``, for the platform at hand; in the user's cache.

    Built when its source or the compiler has changed. Raises BuildError as ``build_native`` does.
    """
    folder = native_cache_folder()
    return cached(folder / f"{block_called(name).name}.fmu", lambda: build_native(name, folder))


def native_cache_folder() -> Path:
    """Where ``cached_native_fmu`` keeps FMUs built from the source as it is. Raises BuildError without a compiler."""
    digest = hashlib.sha256(f"{source_digest(_wrapper())} {identity()}".encode()).hexdigest()
    return user_cache_path("imufmu") / f"{__version__}-native-{digest[:16]}"


def block_called(name: str) -> Block:
    """The registered block of this name, or the series of blocks joined by +. Raises BuildError."""
    parts = name.split("+")
    unknown = [part for part in parts if part not in BLOCKS]
    if unknown:
        raise BuildError(no_such("block", unknown[0], BLOCKS))
    try:
        return BLOCKS[name] if len(parts) == 1 else series(*(BLOCKS[part] for part in parts))
    except DeclarationError as error:
        raise BuildError(str(error)) from error


def with_imu(block: Block, values: Mapping[str, float]) -> Block:
    """The block with other start values of the parameters of its IMU. Raises BuildError."""
    if not isinstance(block, SampledBlock) or not (block.name == "imu" or "imu" in block.name.split("_")):
        raise BuildError(f"{block.name} has no IMU in it; as in imu+lee2012")
    left = dict(values)
    period = left.pop("sample_period", block.period)
    parameters = []
    for parameter in block.own_parameters:
        elements = replace(parameter, name=parameter.name.removeprefix("imu.")).element_names()
        starts = zip(elements, parameter.start_values(), strict=True)
        new = tuple(float(left.pop(element, start)) for element, start in starts)
        parameters.append(replace(parameter, start=new if parameter.shape else new[0]))
    if left:
        raise BuildError(f"{block.name}: its IMU has no parameter {', '.join(left)}")
    return replace(block, own_parameters=tuple(parameters), period=period)


def sources(block: Block) -> dict[str, bytes]:
    """C source by file name, complete: the generated files, the wrapper, and the headers of the FMI standard."""
    headers = [HEADERS / header for header in _HEADERS]
    written = {path.name: path.read_bytes() for path in (*_wrapper(), *headers)}
    return written | {file: text.encode() for file, text in generate(block).items()}


def _wrapper() -> list[Path]:
    return sorted((fmu_src_folder() / "c").glob("*.[ch]"))


def _platform(name: str) -> Platform:
    if name not in PLATFORMS:
        raise BuildError(no_such("platform", name, PLATFORMS))
    return PLATFORMS[name]


def _members(block: Block, code: dict[str, bytes], platforms: Sequence[Platform]) -> dict[str, bytes]:
    """Everything but the binaries, by its place in the archive."""
    description = model_description(block, native=True)
    indent(description)
    page = documentation_page(block, [platform.title for platform in platforms])
    return {
        "modelDescription.xml": tostring(description, encoding="utf-8", xml_declaration=True),
        "documentation/index.html": page.encode(),
        "model.png": icon(block.name),
    } | {f"sources/{file}": content for file, content in code.items()}


def _binaries(
    name: str, code: dict[str, bytes], platforms: Sequence[Platform], progress: Callable[[int, int], None] | None
) -> dict[str, bytes]:
    """Libraries of all platforms, by their place in the archive."""
    with ThreadPoolExecutor(os.cpu_count()) as pool, compilers_end_with_us(pool):
        running = {pool.submit(_library, name, code, platform): platform for platform in platforms}
        done = {}
        for future in as_completed(running):
            platform = running[future]
            done[f"binaries/{platform.folder}/{name}{platform.suffix}"] = future.result()
            if progress:
                progress(len(done), len(platforms))
    return done


def _library(name: str, code: dict[str, bytes], platform: Platform) -> bytes:
    """The library, from the cache or compiled into it. Its sources stay beside it, whether they compile or not."""
    file = f"{name}{platform.suffix}"
    calls = commands(platform, file)
    digest = hashlib.sha256(repr((sorted(code.items()), calls, identity())).encode())
    folder = user_cache_path("imufmu") / "native" / digest.hexdigest()[:16]
    kept = folder / file

    def build() -> None:
        (folder / "sources").mkdir(parents=True, exist_ok=True)
        for source, content in code.items():
            with atomic_write(folder / "sources" / source) as temporary:
                temporary.write_bytes(content)
        with scratch_folder("build") as scratch:
            made = scratch / file
            compile_library(calls, folder / "sources" / NATIVE_SOURCE, made)
            with atomic_write(kept) as temporary:
                shutil.copyfile(made, temporary)

    return cached(kept, build).read_bytes()
