"""Claims about Python FMUs and their host: its process ends well, and is told what is missing or wrong."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import imufmu
from imufmu.compiled.compilers import compile_program
from imufmu.files.locations import fmu_src_folder
from support import c_host, fmu
from support.optional import needs, skip_without
from support.places import ROOT

RUNS = 2

# Its destructor runs after the C++ variables of libraries are destroyed and before the wrapper's own destructor. It
# takes the memory that they gave back and fills it with ones: to a C++ library, reference counts of an object that the
# next release has to destroy, by a table of functions that is not there.
AMPLIFIER = """
#include <stdlib.h>
__attribute__((destructor)) static void use_memory(void) {
    for (size_t size = 16; size <= 512; size += 16) {
        for (int i = 0; i < 200; i++) {
            int *taken = malloc(size);
            for (size_t k = 0; taken && k < size / sizeof *taken; k++) taken[k] = 1;
        }
    }
}
"""


@pytest.fixture(scope="module")
def amplifier(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A library by which a use of freed memory at the end of a process kills it."""
    skip_without("Linux", "cc")
    source = tmp_path_factory.mktemp("amplifier") / "amplifier.c"
    source.write_text(AMPLIFIER)
    library = source.with_suffix(".so")
    subprocess.run(["cc", "-shared", "-fPIC", "-O0", source, "-o", library], check=True)
    return library


@pytest.fixture(scope="module")
def host(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The C host; skipped where Python FMUs cannot run in one."""
    skip_without("libpython", "a C compiler")
    program = tmp_path_factory.mktemp("host") / "host"
    compile_program(fmu_src_folder() / "host" / "host.c", program)
    return program


@pytest.mark.parametrize("name", ["fmpy", "libcosim", "ecos"])
def test_a_python_host_ends_well_whatever_uses_the_freed_memory(name: str, amplifier: Path) -> None:
    skip_without(name)
    program = f"""if True:
        import ctypes, sys
        from pathlib import Path
        sys.path.insert(0, {str(ROOT / "tests" / "support")!r})
        from foreign_hosts import HOSTS, INSTANCE
        HOSTS[{name!r}](Path(sys.argv[1]), {{}}, 10, 0.01, [f"{{INSTANCE}}.roll"])
        ctypes.CDLL({str(amplifier)!r})
    """
    for _ in range(RUNS):
        done = subprocess.run([sys.executable, "-c", program, fmu.path("lee2012")], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr


def test_a_c_host_ends_well_whatever_uses_the_freed_memory(host: Path, amplifier: Path, tmp_path: Path) -> None:
    """Python loads the library when it starts, which is after the wrapper was loaded."""
    (tmp_path / "sitecustomize.py").write_text(f"import ctypes\nctypes.CDLL({str(amplifier)!r})\n")
    for _ in range(RUNS):
        done = c_host.run_python_fmu(host, "lee2012", tmp_path, c_host.environment(str(tmp_path)))
        assert done.returncode == 0, done.stderr
        assert len(done.stdout.splitlines()) == 10


@pytest.mark.parametrize("package", ["numpy", "casadi"])
def test_a_c_host_without_a_package_gets_the_reason(host: Path, package: str, tmp_path: Path) -> None:
    (tmp_path / "sitecustomize.py").write_text(f"import sys\nsys.modules[{package!r}] = None\n")
    done = c_host.run_python_fmu(host, "lee2012", tmp_path, c_host.environment(str(tmp_path)))
    assert done.returncode == 1
    assert package in done.stderr and "needs NumPy and CasADi in the Python interpreter of this host" in done.stderr
    assert "cannot instantiate" in done.stderr


def in_python(program: str) -> subprocess.CompletedProcess[str]:
    """A program in a process of its own that has class Fmu of the tests, for the FMU of lee2012."""
    start = f"import sys; sys.path.insert(0, {str(ROOT / 'tests')!r}); from support.fmu import *\n"
    return subprocess.run([sys.executable, "-c", start + program], capture_output=True, text=True)


def test_a_python_host_without_casadi_gets_the_reason_also_with_logging_off() -> None:
    done = in_python("""if True:
        path, model = unpacked("lee2012"), description("lee2012")
        for name in [name for name in sys.modules if name.split(".")[0] in ("imufmu", "casadi")]:
            del sys.modules[name]
        sys.modules["casadi"] = None
        for logging in (False, True):
            try:
                Fmu("lee2012", folder=path, logging=logging)
            except Exception as error:
                print(error)
    """)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("Failed to instantiate") == 2
    assert done.stderr.count("lee2012: ") == 1 and "casadi" in done.stderr


def test_a_host_with_logging_off_reads_on_stderr_what_is_wrong_and_only_once() -> None:
    done = in_python("""if True:
        for logging in (False, True):
            instance = Fmu("lee2012", logging=logging)
            instance.slave.setupExperiment()
            instance.slave.enterInitializationMode()
            instance.set({"c_a": 2.0})
            for _ in range(3):
                try:
                    instance.slave.exitInitializationMode()
                except FMICallException:
                    pass
            instance.slave.freeInstance()
            print(len(instance.log))
    """)
    assert done.returncode == 0, done.stderr
    assert done.stderr == "lee2012: c_a = 2 is outside [0, 1]\n"
    assert done.stdout.split() == ["0", "6"]  # with logging on, each time our message and the wrapper's


def test_a_host_without_stderr_gets_nothing_on_stdout_instead() -> None:
    done = in_python("""if True:
        instance = Fmu("lee2012", logging=False).initialise()
        sys.stderr = None
        try:
            instance.step(0.0, -1.0)
        except FMICallException:
            print("refused")
    """)
    assert (done.returncode, done.stdout) == (0, "refused\n")


@needs("Linux")
def test_a_python_host_that_unloads_fmus_does_not_gather_their_wrappers_in_memory() -> None:
    """FMPy unpacks each time anew, so each time another library is loaded."""
    done = in_python("""if True:
        from pathlib import Path
        for _ in range(3):
            fmpy.simulate_fmu(path("lee2012"), stop_time=0.05, output_interval=0.01)
            print(Path("/proc/self/maps").read_text().count("/lee2012.so"))
    """)
    assert done.returncode == 0, done.stderr
    assert len(set(done.stdout.split())) == 1


def test_the_paths_of_a_python_host_and_of_its_own_imufmu_do_not_grow() -> None:
    before = [*sys.path, *imufmu.__path__]
    for _ in range(5):
        fmu.Fmu("lee2012").initialise().close()
        fmu.Fmu("imu").initialise().close()
    assert [*sys.path, *imufmu.__path__] == before
