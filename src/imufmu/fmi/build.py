"""Build Python FMUs: a script of fmu_src, the runtime, the documentation and an icon in one archive.

The same source gives the same bytes: no time stamps, no random GUID, files in sorted order.
"""

from __future__ import annotations

import hashlib
import sys
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from platformdirs import user_cache_path
from pythonfmu.builder import FmuBuilder

from .. import __version__
from ..compiled.compilers import BuildError
from ..files.atomic import WriteError, atomic_write
from ..files.cache import cached
from ..files.locations import fmu_src_folder
from ..files.names import no_such
from ..files.scratch import scratch_folder
from ..registry import BLOCKS
from . import runtime
from .documentation import icon, write_documentation

_FIXED_TIME = (1980, 1, 1, 0, 0, 0)  # the earliest a zip can say


def build_fmu(name: str, folder: Path) -> Path:
    """Write the Python FMU of the registered block ``name`` to folder/name.fmu and return that path.

    Raises BuildError for an unknown name or a folder that cannot be written.
    """
    if "+" in name:
        raise BuildError(f"{name}: blocks in series make a native FMU only; build it with --native")
    if name not in BLOCKS:
        raise BuildError(no_such("block", name, BLOCKS))
    target = folder / f"{name}.fmu"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with scratch_folder("build") as scratch:
            built = _pythonfmu_build(name, scratch)
            with atomic_write(target) as temporary:
                _repack(built, name, temporary)
    except WriteError as error:
        raise BuildError(str(error)) from error
    except OSError as error:
        raise BuildError(f"cannot write {error.filename or target}: {error.strerror or error}") from error
    return target


def cached_fmu(name: str) -> Path:
    """Path of the FMU of a registered block in the user's cache, built when its source has changed."""
    folder = cache_folder(name)
    return cached(folder / f"{name}.fmu", lambda: build_fmu(name, folder))


def cache_folder(name: str) -> Path:
    """Where ``cached_fmu`` keeps the FMU of this block, built from the source as it is."""
    return user_cache_path("imufmu") / f"{__version__}-{source_digest([fmu_src_folder() / f'{name}_fmu.py'])}"


def source_digest(sources: Sequence[Path]) -> str:
    """Short hash of the runtime, of what makes FMUs of it, and of these files; those that are missing are left out."""
    rooms = (runtime.PACKAGE / room for room in ("compiled", "fmi"))
    makers = [path for room in rooms for path in room.rglob("*") if "__pycache__" not in path.parts]
    digest = hashlib.sha256(runtime.fingerprint(runtime.PACKAGE).encode())
    for source in sorted(path for path in (*makers, *sources) if path.is_file()):
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


def _pythonfmu_build(name: str, scratch: Path) -> Path:
    """Let PythonFMU put script, runtime, wrapper binaries and documentation together."""
    staged = scratch / "staged"
    staged.mkdir()
    runtime.copy_to(staged)
    documentation = scratch / "documentation"
    write_documentation(BLOCKS[name], documentation)
    script = fmu_src_folder() / f"{name}_fmu.py"
    if not script.is_file():
        raise BuildError(f"{name}: its script {script.name} is not in {script.parent}")
    try:
        return Path(
            FmuBuilder.build_FMU(
                script,
                dest=scratch / f"{name}.fmu",
                project_files=[staged / "imufmu"],
                documentation_folder=documentation,
                needsExecutionTool=False,
            )
        )
    finally:
        # The builder imports the script by its name and leaves it and its folder behind.
        sys.modules.pop(script.stem, None)
        sys.path[:] = [entry for entry in sys.path if Path(entry) != script.parent]


def _repack(built: Path, name: str, target: Path) -> None:
    """Same members, plus the icon."""
    with zipfile.ZipFile(built) as source:
        members = {member: source.read(member) for member in source.namelist()}
    write_archive(members | {"model.png": icon(name)}, target)


def write_archive(members: Mapping[str, bytes], target: Path) -> None:
    """Zip the members, content by name, in sorted order with a fixed time: the same members give the same bytes."""
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for member, content in sorted(members.items()):
            entry = zipfile.ZipInfo(member, _FIXED_TIME)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, content)
