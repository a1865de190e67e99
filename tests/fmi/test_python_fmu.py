"""Claims about Python FMUs at run time that follow from Python; test_fmu_contract.py has those of every FMU."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from imufmu.fmi import runtime
from imufmu.fmi.build import cached_fmu
from support import fmu


def test_an_fmu_refuses_to_start_on_another_imufmu_in_memory(tmp_path):
    folder = shutil.copytree(fmu.unpacked("lee2012"), tmp_path / "edited")
    source = Path(folder) / "resources" / "imufmu" / "estimators" / "lee2012.py"
    source.write_text(source.read_text() + "\n# edited\n")
    reason = runtime.refusal(Path(folder) / "resources")
    assert "another version of imufmu" in reason and str(runtime.PACKAGE) in reason
    for _ in range(50):  # and no host crashes from trying
        with pytest.raises(Exception, match="Failed to instantiate"):
            fmu.Fmu("lee2012", folder=str(folder))
    fmu.Fmu("lee2012").initialise().close()


def test_an_fmu_whose_modules_lie_elsewhere_is_refused_too(tmp_path):
    """Built before a module moved: the package in memory must not serve it by accident."""
    folder = shutil.copytree(fmu.unpacked("lee2012"), tmp_path / "older")
    package = Path(folder) / "resources" / "imufmu"
    for module in (package / "blocks").glob("*.py"):
        module.rename(package / module.name) if module.stem != "__init__" else module.unlink()
    assert "another version of imufmu" in runtime.refusal(Path(folder) / "resources")
    with pytest.raises(Exception, match="Failed to instantiate"):
        fmu.Fmu("lee2012", folder=str(folder))


def test_a_script_may_simulate_again_and_again_with_fmpy(tmp_path):
    """FMPy deletes what it unpacked, with it the imufmu that the first FMU brought into the process."""
    program = """if True:
        import fmpy, sys
        for k in range(3):
            result = fmpy.simulate_fmu(sys.argv[1], stop_time=0.1, start_values={"c_a": 0.1 * k})
        assert not __import__("pathlib").Path(sys.modules["imufmu"].__file__).exists()
        from imufmu import simulate  # the rest of the installed imufmu can still be had
        from imufmu.plants import pendulum
        print(len(result))
    """
    command = [sys.executable, "-c", program, str(cached_fmu("lee2012"))]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert done.stdout.strip() == "11", done.stderr


def test_line_ends_do_not_make_another_version(tmp_path):
    runtime.copy_to(tmp_path)
    for path in (tmp_path / "imufmu").rglob("*.py"):
        path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    assert runtime.refusal(tmp_path) == ""


def test_a_percent_sign_in_a_message_arrives_as_it_is():
    """PythonFMU takes messages for C formats."""
    instance = fmu.Fmu("lee2012")
    slave = sys.modules["lee2012_fmu"].Lee2012(instance_name="i", resources=f"{fmu.unpacked('lee2012')}/resources")
    slave.log("5% of %s")
    assert slave.log_queue[-1].msg % () == "5% of %s"
    instance.slave.freeInstance()
