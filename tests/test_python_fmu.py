"""Claims about Python FMUs at run time: the contract that FMI hosts rely on."""

from __future__ import annotations

import math
import shutil
import subprocess
import sys
from pathlib import Path

import fmu
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

from imufmu.fmi import runtime
from imufmu.fmi.build import cached_fmu
from imufmu.registry import BLOCKS, ESTIMATORS
from imufmu.vocabulary import Status

NAMES = list(BLOCKS)
WARNING, ERROR, FATAL = 1, 3, 4


@pytest.mark.parametrize("name", NAMES)
def test_a_parameter_out_of_bounds_ends_initialisation_with_its_name_value_and_range(name):
    period = "sample_period" if any(p.name == "sample_period" for p in BLOCKS[name].parameters) else "max_step"
    instance = fmu.Fmu(name)
    with pytest.raises(FMICallException, match="ExitInitializationMode"):
        instance.initialise({period: -0.5})
    messages = [message for status, message in instance.log if status == ERROR]
    assert len(messages) == 1
    assert f"{period} = -0.5 s is outside [" in messages[0]


def test_a_host_survives_hundreds_of_failed_initialisations_and_instances():
    for _ in range(300):
        instance = fmu.Fmu("lee2012")
        with pytest.raises(FMICallException):
            instance.initialise({"c_a": 2.0})
        instance.slave.freeInstance()
    fmu.Fmu("lee2012").initialise().close()


@pytest.mark.parametrize("h", [0.0, -0.01, math.nan, math.inf, 1e300])
def test_an_impossible_step_is_discarded_and_changes_nothing(h):
    instance = fmu.Fmu("lee2012").initialise()
    instance.set(fmu.elements("gyro", (0.1, 0.2, 0.3)))
    instance.step(0.0, 0.05)
    before = instance.reals()
    with pytest.raises(FMICallException):
        instance.step(0.05, h)
    assert [status for status, _ in instance.log] == [ERROR]
    assert f"h = {h} s" in instance.log[0][1]
    assert instance.reals() == before
    instance.step(0.05, 0.05)
    assert instance.get("sample_time") == [pytest.approx(0.09)]
    instance.close()


@pytest.mark.parametrize("block", [b.name for b in ESTIMATORS])
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_missing_samples_raise_flags_warn_once_per_episode_and_leave_outputs_finite(block, value):
    instance = fmu.Fmu(block).initialise()
    instance.step(0.0, 0.01)
    for episode in (1, 2):
        for k in range(5):
            instance.set({"gyro[2]": value, "accel[1]": value})
            instance.step(0.01 + 0.2 * episode + 0.01 * k, 0.01)
            assert np.isfinite(instance.reals()).all()
            flags = Status(int(instance.get("status")[0]))
            assert Status.GYRO_MISSING in flags and Status.ACCEL_MISSING in flags
        warnings = [message for status, message in instance.log if status == WARNING]
        assert len(warnings) == episode
        assert "gyro[2]" in warnings[-1] and "accel[1]" in warnings[-1] and "gyro[1]" not in warnings[-1]
        instance.set({"gyro[2]": 0.0, "accel[1]": 0.0})
        instance.step(0.1 + 0.2 * episode, 0.01)
        assert Status.GYRO_MISSING not in Status(int(instance.get("status")[0]))
    instance.close()


def test_fixed_parameters_keep_their_value_once_the_simulation_runs_and_tunable_ones_change():
    instance = fmu.Fmu("lee2012").initialise()
    instance.step(0.0, 0.01)
    instance.set({"g": 5.0, "c_a": 0.5, "sigma_a2": -1.0})
    assert instance.get("g", "c_a", "sigma_a2") == [9.8, 0.5, 1e-4]
    messages = [message for status, message in instance.log if status == ERROR]
    assert len(messages) == 2
    assert "g is fixed" in messages[0] and "sigma_a2 = -1 is outside" in messages[1]
    instance.close()


def test_outputs_and_unknown_variables_cannot_be_set_and_do_not_crash_the_host():
    instance = fmu.Fmu("lee2012").initialise()
    before = instance.reals()
    instance.set({"roll": 1.0})
    instance.slave.setReal([100_000], [1.0])
    assert instance.slave.getReal([100_000]) == [0.0]
    assert instance.reals() == before
    assert len(instance.log) == 3
    instance.close()


@pytest.mark.parametrize("name", NAMES)
def test_reset_returns_to_the_state_after_instantiation(name):
    fresh = fmu.Fmu(name).initialise()
    used = fmu.Fmu(name).initialise(start_time=3.0)
    used.set({v.name: 0.7 for v in used.model.modelVariables if v.causality == "input"})
    used.step(3.0, 0.5)
    used.slave.reset()
    used.initialise()
    assert used.reals() == fresh.reals()
    for instance in (used, fresh):
        instance.step(0.0, 0.2)
    assert used.reals() == fresh.reals()
    used.close()
    fresh.close()


@pytest.mark.parametrize("name", NAMES)
def test_instances_in_one_process_share_nothing(name):
    alone = fmu.Fmu(name).initialise()
    first, second = fmu.Fmu(name, "first").initialise(), fmu.Fmu(name, "second").initialise()
    inputs = [v.name for v in alone.model.modelVariables if v.causality == "input"]
    for k in range(20):
        second.set({i: float(j + k) for j, i in enumerate(inputs)})
        second.step(k * 0.01, 0.01)
        for instance in (alone, first):
            instance.set({i: 0.1 * (j + 1) for j, i in enumerate(inputs)})
            instance.step(k * 0.01, 0.01)
        assert first.reals() == alone.reals()
    assert second.reals() != alone.reals()
    for instance in (alone, first, second):
        instance.close()


@pytest.mark.parametrize("name", NAMES)
def test_a_serialised_state_survives_the_instance_that_wrote_it(name):
    writer = fmu.Fmu(name).initialise()
    inputs = [v.name for v in writer.model.modelVariables if v.causality == "input"]
    for k in range(7):
        writer.set({i: math.sin(j + k) for j, i in enumerate(inputs)})
        writer.step(k * 0.013, 0.013)
    saved = fmu.serialised(writer)
    writer.step(7 * 0.013, 0.1)
    expected = writer.reals()
    writer.close()
    reader = fmu.Fmu(name).initialise(start_time=99.0)
    fmu.restore(reader, saved)
    reader.step(7 * 0.013, 0.1)
    assert reader.reals() == expected
    reader.close()


def test_a_restored_state_remembers_that_it_warned():
    instance = fmu.Fmu("lee2012").initialise()
    instance.set({"gyro[1]": math.nan})
    instance.step(0.0, 0.01)
    saved = fmu.serialised(instance)
    instance.set({"gyro[1]": 0.0})
    instance.step(0.01, 0.01)
    fmu.restore(instance, saved)
    instance.step(0.01, 0.01)
    assert [status for status, _ in instance.log] == [WARNING]
    instance.close()


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


def test_a_script_may_simulate_again_and_again_with_fmpy(tmp_path):
    """FMPy deletes what it unpacked, with it the imufmu that the first FMU brought into the process."""
    program = """if True:
        import fmpy, sys
        for k in range(3):
            result = fmpy.simulate_fmu(sys.argv[1], stop_time=0.1, start_values={"c_a": 0.1 * k})
        assert not __import__("pathlib").Path(sys.modules["imufmu"].__file__).exists()
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


def test_outputs_during_initialisation_already_follow_inputs_and_parameters():
    """A master exchanges outputs before the first step."""
    instance = fmu.Fmu("lee2012")
    instance.slave.setupExperiment(startTime=2.0)
    instance.slave.enterInitializationMode()
    instance.set(fmu.elements("accel", (0.0, 9.8, 0.0)))
    assert instance.get("roll") == [pytest.approx(math.pi / 2, abs=1e-15)]
    instance.set({"use_initial_angles": 1, "initial_roll": 0.3})
    assert instance.get("roll", "sample_time") == [pytest.approx(0.3, abs=1e-15), 2.0]
    instance.slave.exitInitializationMode()
    assert instance.get("roll") == [pytest.approx(0.3, abs=1e-15)]
    instance.close()
