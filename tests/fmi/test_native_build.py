"""Claims about building native FMUs: what is inside, from which compiler, and what goes wrong how."""

from __future__ import annotations

import re
import shutil
import struct
import subprocess
import zipfile
from dataclasses import replace
from pathlib import Path

import fmpy
import fmpy.build
import fmpy.validation
import numpy as np
import pytest

from imufmu.compiled import compilers
from imufmu.compiled.compilers import PLATFORMS, own_platform, universal
from imufmu.fmi import native, native_table
from imufmu.fmi.build import BuildError, build_fmu
from imufmu.fmi.model_description import guid
from imufmu.fmi.native import block_called, build_native, cached_native_fmu, sources
from imufmu.fmi.native_table import generate
from imufmu.registry import BLOCKS
from support import fmu
from support.optional import needs, skip_without

NAMES = list(BLOCKS)
NEEDS_ZIG = needs("ziglang")
FMI_FUNCTIONS = {
    "GetTypesPlatform", "GetVersion", "SetDebugLogging", "Instantiate", "FreeInstance", "SetupExperiment",
    "EnterInitializationMode", "ExitInitializationMode", "Terminate", "Reset", "GetReal", "GetInteger", "GetBoolean",
    "GetString", "SetReal", "SetInteger", "SetBoolean", "SetString", "GetFMUstate", "SetFMUstate", "FreeFMUstate",
    "SerializedFMUstateSize", "SerializeFMUstate", "DeSerializeFMUstate", "GetDirectionalDerivative",
    "SetRealInputDerivatives", "GetRealOutputDerivatives", "DoStep", "CancelStep", "GetStatus", "GetRealStatus",
    "GetIntegerStatus", "GetBooleanStatus", "GetStringStatus",
}  # fmt: skip


# What is inside


@pytest.mark.parametrize("name", NAMES)
def test_fmpy_finds_nothing_to_complain_about(name: str) -> None:
    assert fmpy.validation.validate_fmu(str(cached_native_fmu(name))) == []


@pytest.mark.parametrize("name", NAMES)
def test_a_native_fmu_declares_what_it_can_do_and_has_a_guid_of_its_own(name: str) -> None:
    native_model, python_model = (fmu.description(name, kind) for kind in ("native", "python"))
    slave = native_model.coSimulation
    assert slave.providesDirectionalDerivative and slave.canGetAndSetFMUstate and slave.canSerializeFMUstate
    assert not slave.needsExecutionTool and not slave.canBeInstantiatedOnlyOncePerProcess
    assert not slave.canInterpolateInputs and not slave.maxOutputDerivativeOrder
    assert native_model.buildConfigurations[0].sourceFileSets[0].sourceFiles == ["fmu.c"]
    assert not python_model.buildConfigurations
    assert native_model.guid == guid(BLOCKS[name], native=True) != python_model.guid


def test_archive_holds_complete_sources_documentation_icon_and_nothing_in_python() -> None:
    with zipfile.ZipFile(cached_native_fmu("lee2012")) as archive:
        members = set(archive.namelist())
        page = archive.read("documentation/index.html").decode()
        picture = archive.read("model.png")
    own = PLATFORMS[own_platform()]
    assert f"binaries/{own.folder}/lee2012{own.suffix}" in members
    assert {"sources/fmu.c", "sources/block.c", "sources/equations.c", "sources/fmi2Functions.h"} <= members
    assert not any(member.endswith(".py") for member in members)
    assert picture.startswith(b"\x89PNG")
    assert "needs" in page and own.title in page and "LD_PRELOAD" not in page


def test_the_same_source_gives_the_same_bytes(tmp_path: Path) -> None:
    assert build_native("lee2012", tmp_path).read_bytes() == cached_native_fmu("lee2012").read_bytes()
    assert generate(BLOCKS["lee2012"]) == generate(BLOCKS["lee2012"])
    assert [path.name for path in tmp_path.iterdir()] == ["lee2012.fmu"]


@needs("cmake")
def test_fmpy_compiles_the_sources_to_a_binary_with_the_same_results(tmp_path: Path) -> None:
    shutil.copytree(fmu.unpacked("lee2012", "native"), tmp_path, dirs_exist_ok=True)
    shutil.rmtree(tmp_path / "binaries")
    fmpy.build.build_platform_binary(tmp_path)
    ours, theirs = fmu.Fmu("lee2012", kind="native"), fmu.Fmu("lee2012", kind="native", folder=str(tmp_path))
    for instance in (ours, theirs):
        instance.initialise()
        instance.set(fmu.elements("gyro", (0.1, -0.2, 0.3)))
        instance.step(0.0, 1.0)
    # Its flags leave out -ffp-contract=off, which matters on other processors; there rounding differs.
    np.testing.assert_allclose(theirs.reals(), ours.reals(), rtol=0, atol=1e-12)
    ours.close()
    theirs.close()


def written(name: str, folder: Path) -> Path:
    """The sources of a block's FMU, in a new folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for file, content in sources(block_called(name)).items():
        (folder / file).write_bytes(content)
    return folder


COMPILERS = {
    "gcc": ("-std=c99",),
    "clang": ("-std=c99",),
    "g++": ("-x", "c++", "-std=c++17"),
    "clang++": ("-x", "c++", "-std=c++17"),
}


@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize("name", ["lee2012", "pendulum", "plumb", "handheld+imu+lee2012"])
def test_compilers_of_c_and_of_c_plus_plus_are_silent(name: str, compiler: str, tmp_path: Path) -> None:
    skip_without(compiler)
    strict = ("-Wall", "-Wextra", "-Wconversion", "-pedantic", "-Werror", "-fsyntax-only")
    command = [compiler, *COMPILERS[compiler], *strict, "fmu.c"]
    said = subprocess.run(command, cwd=written(name, tmp_path), capture_output=True, text=True)
    assert (said.returncode, said.stderr) == (0, "")


@needs("cc", "nm")
def test_sources_of_several_fmus_are_linked_into_one_program(tmp_path: Path) -> None:
    """As the standard says: each compiled with the prefix of its name. The program asks each for its version."""
    names, objects = ["lee2012", "imu", "imu+lee2012"], []
    identifiers = [name.replace("+", "_") for name in names]
    for name, identifier in zip(names, identifiers, strict=True):
        prefix, target = f"-DFMI2_FUNCTION_PREFIX={identifier}_", tmp_path / f"{identifier}.o"
        folder = written(name, tmp_path / identifier)
        subprocess.run(["cc", "-std=c99", prefix, "-c", "fmu.c", "-o", target], cwd=folder, check=True)
        objects.append(str(target))
        table = subprocess.run(["nm", "-g", "--defined-only", target], capture_output=True, text=True, check=True)
        found = {line.split()[-1].removeprefix("_") for line in table.stdout.splitlines()}
        assert found == {f"{identifier}_fmi2{function}" for function in FMI_FUNCTIONS}
    program = tmp_path / "main.c"
    declared = "".join(f"const char *{identifier}_fmi2GetVersion(void);\n" for identifier in identifiers)
    printed = "".join(f"puts({identifier}_fmi2GetVersion());" for identifier in identifiers)
    program.write_text(f"#include <stdio.h>\n{declared}int main(void) {{ {printed} return 0; }}\n")
    subprocess.run(["cc", program, *objects, "-lm", "-o", tmp_path / "main"], check=True)
    done = subprocess.run([tmp_path / "main"], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["2.0"] * len(names)


@needs("cc", "nm")
@pytest.mark.parametrize(
    ("defined", "expected"),
    [
        (["FMI2_OVERRIDE_FUNCTION_PREFIX=other_", "FMI2_FUNCTION_PREFIX=lee2012_"], "other_fmi2DoStep"),
        ([], "fmi2DoStep"),
    ],
)
def test_an_overriding_prefix_goes_before_and_without_one_the_names_are_plain(
    defined: list[str], expected: str, tmp_path: Path
) -> None:
    command = ["cc", "-std=c99", *(f"-D{macro}" for macro in defined), "-c", "fmu.c"]
    subprocess.run(command, cwd=written("lee2012", tmp_path), check=True)
    table = subprocess.run(["nm", "-g", "--defined-only", "fmu.o"], cwd=tmp_path, capture_output=True, text=True)
    assert expected in {line.split()[-1].removeprefix("_") for line in table.stdout.splitlines() if "DoStep" in line}


@needs("Linux", "cc", "objdump")
@pytest.mark.parametrize("name", ["lee2012", "plumb", "handheld"])
def test_all_globals_are_constants_and_memory_is_asked_for_with_instances_and_states_only(
    name: str, tmp_path: Path
) -> None:
    """Unoptimised, so that each function calls what its text says."""
    written(name, tmp_path)
    subprocess.run(["cc", "-std=c99", "-O0", "-fPIC", "-c", "fmu.c"], cwd=tmp_path, check=True)
    table = subprocess.run(["objdump", "-t", "fmu.o"], cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    data = {line.split()[-3] for line in table.splitlines() if " O " in line}
    assert data and all(section.startswith((".rodata", ".data.rel.ro")) for section in data), data
    code = subprocess.run(["objdump", "-dr", "fmu.o"], cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    functions = {part.split(">:")[0].split("<")[-1]: part for part in code.split("\n\n") if ">:" in part}
    allocating = {name for name, text in functions.items() if re.search(r"\b(malloc|calloc|realloc)\b", text)}
    assert allocating == {"fmi2Instantiate", "room_for"}
    states = {name for name, text in functions.items() if "<room_for>" in text.partition("\n")[2]}
    assert states - {"room_for"} == {"fmi2GetFMUstate", "fmi2DeSerializeFMUstate"}


@needs("Linux", "nm")
@pytest.mark.parametrize("name", NAMES)
def test_a_library_exports_the_fmi_functions_and_needs_the_c_library_only(name: str) -> None:
    own = PLATFORMS[own_platform()]
    library = Path(fmu.unpacked(name, "native")) / "binaries" / own.folder / f"{name}{own.suffix}"
    exported = subprocess.run(["nm", "-D", "--defined-only", str(library)], capture_output=True, text=True).stdout
    symbols = {line.split()[-1].split("@")[0] for line in exported.splitlines()} - {"_init", "_fini"}
    assert symbols == {f"fmi2{function}" for function in FMI_FUNCTIONS}
    needed = subprocess.run(["objdump", "-p", str(library)], capture_output=True, text=True).stdout
    libraries = {line.split()[1] for line in needed.splitlines() if "NEEDED" in line}
    assert libraries == {"libc.so.6", "libm.so.6"}


def test_numbers_of_the_table_read_back_as_the_same_doubles() -> None:
    odd = replace(BLOCKS["lee2012"].own_parameters[1], start=1 / 3, minimum=-1 / 7, maximum=1e300 / 3, kind="real")
    block = replace(BLOCKS["lee2012"], own_parameters=(odd,))
    (variable,) = (v for v in block.variables if v.signal is odd)
    row = native_table._row(block, variable)
    assert [float(row[name]) for name in ("start", "minimum", "maximum")] == [1 / 3, -1 / 7, 1e300 / 3]


# Compilers and platforms


def test_binaries_are_compiled_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    build_native("lee2012", tmp_path)
    calls: list[object] = []
    monkeypatch.setattr(native, "compile_library", lambda *arguments: calls.append(arguments))
    told: list[tuple[int, int]] = []
    build_native("lee2012", tmp_path, progress=lambda done, total: told.append((done, total)))
    assert calls == [] and told == [(1, 1)]


def test_a_compiler_error_names_the_source_that_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    broken = sources(BLOCKS["lee2012"]) | {"block.c": b"int broken = ;\n"}
    monkeypatch.setattr(native, "sources", lambda block: broken)
    monkeypatch.setattr(native, "user_cache_path", lambda name: tmp_path / "cache")
    with pytest.raises(BuildError) as raised:
        build_native("lee2012", tmp_path / "out")
    (kept,) = (tmp_path / "cache").rglob("fmu.c")
    assert str(kept) in str(raised.value) and "block.c:1" in str(raised.value)
    assert kept.with_name("block.c").read_bytes() == broken["block.c"]
    assert not (tmp_path / "out").exists()


def test_without_a_compiler_the_message_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compilers, "has_ziglang", lambda: False)
    monkeypatch.setenv("CC", "no-such-compiler")
    for build in (lambda: build_native("lee2012", tmp_path), lambda: cached_native_fmu("lee2012")):
        with pytest.raises(BuildError, match=r"'no-such-compiler' is not installed.*pip install imufmu\[native\]"):
            build()
    monkeypatch.setenv("CC", '"cc')
    with pytest.raises(BuildError, match="variable CC is '\"cc', which is no command"):
        build_native("lee2012", tmp_path)
    other = next(platform for platform in PLATFORMS if platform != own_platform())
    with pytest.raises(BuildError, match=rf"{other} needs .*ziglang"):
        build_native("lee2012", tmp_path, [other])


def test_unknown_or_unfit_blocks_platforms_and_closed_folders_are_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(BuildError, match=r"'lee2013'.*lee2012"):
        build_native("lee2013", tmp_path)
    with pytest.raises(BuildError, match=r"imu\+lee2012: .* build it with --native"):
        build_fmu("imu+lee2012", tmp_path)
    with pytest.raises(BuildError, match=r"lee2012\+pendulum: a plant can only stand first"):
        build_native("lee2012+pendulum", tmp_path)
    with pytest.raises(BuildError, match=r"'amiga'.*linux64, win64, darwin64"):
        build_native("lee2012", tmp_path, ["amiga"])
    (tmp_path / "file").write_text("")
    with pytest.raises(BuildError, match=r"cannot write .*file"):
        build_native("lee2012", tmp_path / "file")


def test_a_cache_that_cannot_be_written_is_named_and_not_the_target(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setattr(native, "user_cache_path", lambda name: tmp_path / "file")
    with pytest.raises(BuildError, match=r"file.native.*: cannot write"):
        build_native("lee2012", tmp_path / "out")


def test_a_universal_library_holds_each_library_where_its_table_says() -> None:
    thin = [struct.pack("<III", 0xFEEDFACF, processor, 3) + bytes(size) for processor, size in ((7, 5), (12, 40_000))]
    file = universal(thin)
    assert struct.unpack_from(">II", file) == (0xCAFEBABE, 2)
    for i, library in enumerate(thin):
        processor, variant, start, size, align = struct.unpack_from(">IIIII", file, 8 + 20 * i)
        assert (processor, variant) == struct.unpack_from("<II", library, 4)
        assert start % 2**align == 0 and start >= 48
        assert file[start : start + size] == library


X86_64, ARM64 = 0x01000007, 0x0100000C  # processors of Mach-O


def processors(content: bytes) -> dict[int, bytes]:
    """Mach-O libraries by processor, of a universal file or of one library."""
    if content.startswith(b"\xcf\xfa\xed\xfe"):
        return {struct.unpack_from("<I", content, 4)[0]: content}
    parts = [struct.unpack_from(">IIII", content, 8 + 20 * i) for i in range(struct.unpack_from(">I", content, 4)[0])]
    return {processor: content[start : start + size] for processor, _, start, size in parts}


def oldest_macos(library: bytes) -> tuple[int, int]:
    """Version in the load command LC_BUILD_VERSION or LC_VERSION_MIN_MACOSX."""
    (count,) = struct.unpack_from("<I", library, 16)
    at = 32
    for _ in range(count):
        command, size = struct.unpack_from("<II", library, at)
        if command in (0x32, 0x24):
            (version,) = struct.unpack_from("<I", library, at + (12 if command == 0x32 else 8))
            return version >> 16, version >> 8 & 0xFF
        at += size
    raise AssertionError("the library names no version")


@NEEDS_ZIG
def test_ziglang_builds_every_platform_with_all_functions_and_no_build_paths(tmp_path: Path) -> None:
    fmu_path = build_native("lee2012", tmp_path, list(PLATFORMS))
    magic = {".so": b"\x7fELF", ".dll": b"MZ", ".dylib": b"\xca\xfe\xba\xbe"}
    machine = {"linux64": 62, "aarch64-linux": 183}
    with zipfile.ZipFile(fmu_path) as archive:
        binaries = {member: archive.read(member) for member in archive.namelist() if member.startswith("binaries/")}
    assert set(binaries) == {f"binaries/{p.folder}/lee2012{p.suffix}" for p in PLATFORMS.values()}
    for member, content in binaries.items():
        folder = Path(member).parent.name
        expected = b"\xcf\xfa\xed\xfe" if folder == "aarch64-darwin" else magic[Path(member).suffix]
        assert content.startswith(expected), member
        if folder in machine:
            assert struct.unpack_from("<H", content, 18)[0] == machine[folder]
        if folder.endswith("darwin64") or folder == "aarch64-darwin":
            assert b"@rpath/lee2012.dylib" in content
            oldest = {X86_64: (10, 13), ARM64: (11, 0)}
            found = {processor: oldest_macos(library) for processor, library in processors(content).items()}
            assert found == (oldest if folder == "darwin64" else {ARM64: oldest[ARM64]})
        assert all(f"fmi2{function}".encode() in content for function in FMI_FUNCTIONS)
        assert str(Path.home()).encode() not in content and b"imufmu_build_" not in content
    assert fmpy.validation.validate_fmu(str(fmu_path)) == []
