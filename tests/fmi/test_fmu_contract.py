"""Claims about FMUs of both kinds at run time: the contract that FMI hosts rely on."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

from imufmu.blocks.block import SampledBlock
from imufmu.blocks.vocabulary import Status
from imufmu.registry import BLOCKS, ESTIMATORS
from support import fmu
from support.fmu import ERROR, WARNING, refusal

NAMES = list(BLOCKS)


@pytest.fixture(params=fmu.KINDS)
def kind(request):
    """Python FMU, native FMU."""
    return request.param


@pytest.mark.parametrize("name", NAMES)
def test_a_parameter_out_of_bounds_ends_initialisation_with_its_name_value_and_range(kind, name):
    period = "sample_period" if any(p.name == "sample_period" for p in BLOCKS[name].parameters) else "max_step"
    instance = fmu.Fmu(name, kind=kind)
    instance.slave.setupExperiment(startTime=0.0)
    instance.slave.enterInitializationMode()
    instance.set({period: -0.5})
    assert f"{period} = -0.5 s is outside [" in refusal(instance, instance.slave.exitInitializationMode)
    instance.slave.freeInstance()


def test_a_host_survives_hundreds_of_failed_initialisations_and_instances(kind):
    for _ in range(300):
        instance = fmu.Fmu("lee2012", kind=kind)
        with pytest.raises(FMICallException):
            instance.initialise({"c_a": 2.0})
        instance.slave.freeInstance()
    fmu.Fmu("lee2012", kind=kind).initialise().close()


FAR = 1.5e6  # s: more samples away than one step may take

IMPOSSIBLE = [(0.05, h) for h in (0.0, -0.01, math.nan, math.inf, 1e300)]
IMPOSSIBLE += [(t, 0.05) for t in (math.nan, -math.inf, 1e300, FAR, -FAR)]


@pytest.mark.parametrize(("t", "h"), IMPOSSIBLE)
def test_an_impossible_step_is_refused_and_changes_nothing(kind, t, h):
    instance = fmu.Fmu("lee2012", kind=kind).initialise()
    instance.set(fmu.elements("gyro", (0.1, 0.2, 0.3)))
    instance.step(0.0, 0.05)
    before = instance.reals()
    message = refusal(instance, lambda: instance.step(t, h))
    what, value = ("h", h) if t == 0.05 else ("t", t)
    (written,) = re.findall(rf"\b{what} = (\S+) s", message)
    assert np.array_equal(float(written), value, equal_nan=True)
    assert instance.reals() == before
    instance.step(0.05, 0.05)
    assert instance.get("sample_time") == [pytest.approx(0.09)]
    instance.close()


def test_a_step_in_which_the_solver_diverges_is_refused_and_changes_nothing(kind):
    """Damping of 1e4 N.m.s/rad is far outside the stability of RK4 at 1 s, and within it at 0.1 ms."""
    stiff = {"max_step": 1.0, "damping[1]": 1e4, "initial_rate[1]": 1.0}
    stiff |= {"disturbances": 1, "disturbance_stop[1]": 2000.0, "disturbance_field[1]": 20.0}  # shows the time
    tried, spared = (fmu.Fmu("pendulum", kind=kind).initialise(stiff) for _ in range(2))
    for instance in (tried, spared):
        instance.step(0.0, 1e-4)
    assert "max_step" in refusal(tried, lambda: tried.step(1e-4, 1000.0))
    assert tried.reals() == spared.reals()
    for instance in (tried, spared):
        instance.step(1e-4, 1e-4)
    assert tried.reals() == spared.reals()
    tried.close()
    spared.close()


def test_samples_and_the_motion_of_a_plant_count_from_the_start_time(kind):
    """The step from 4.99 to 5.06 holds six instants of lee2012: 5.00 to 5.05."""
    estimator = fmu.Fmu("lee2012", kind=kind).initialise(start_time=5.0)
    assert estimator.get("sample_time") == [5.0]
    estimator.step(4.99, 0.07)
    assert estimator.get("sample_time") == [5.05]
    estimator.close()
    disturbed = {"disturbances": 1, "disturbance_stop[1]": 10.0, "disturbance_field[1]": 20.0}
    early, late = (fmu.Fmu("pendulum", kind=kind).initialise(disturbed, start_time=t) for t in (0.0, 5.0))
    assert early.get("magnetic_field[1]") != late.get("magnetic_field[1]")
    early.close()
    late.close()


@pytest.mark.parametrize("block", [b.name for b in ESTIMATORS])
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_missing_samples_raise_flags_warn_once_per_episode_and_leave_outputs_finite(kind, block, value):
    instance = fmu.Fmu(block, kind=kind).initialise()
    inputs = [s.name for s in BLOCKS[block].inputs]  # gyro and accel, or gyro1, gyro2, accel2 of a block with two IMUs
    gyro, accel = (next(name for name in inputs if name.startswith(what)) for what in ("gyro", "accel"))
    instance.step(0.0, 0.01)
    for episode in (1, 2):
        for k in range(5):
            instance.set({f"{gyro}[2]": value, f"{accel}[1]": value})
            instance.step(0.01 + 0.2 * episode + 0.01 * k, 0.01)
            assert np.isfinite(instance.reals()).all()
            flags = Status(int(instance.get("status")[0]))
            assert Status.GYRO_MISSING in flags and Status.ACCEL_MISSING in flags
        warnings = [message for status, message in instance.log if status == WARNING]
        assert len(warnings) == episode
        assert f"{gyro}[2]" in warnings[-1] and f"{accel}[1]" in warnings[-1] and f"{gyro}[1]" not in warnings[-1]
        instance.set({f"{gyro}[2]": 0.0, f"{accel}[1]": 0.0})
        instance.step(0.1 + 0.2 * episode, 0.01)
        assert Status.GYRO_MISSING not in Status(int(instance.get("status")[0]))
    instance.close()


def test_fixed_parameters_keep_their_value_once_the_simulation_runs_and_tunable_ones_change(kind):
    instance = fmu.Fmu("lee2012", kind=kind).initialise()
    instance.step(0.0, 0.01)
    instance.set({"c_a": 0.5})
    assert "g is fixed" in refusal(instance, lambda: instance.set({"g": 5.0}))
    message = refusal(instance, lambda: instance.set({"sigma_a2": -1.0}))
    assert "sigma_a2 = -1" in message and "is outside [1e-09, 1e+06]" in message
    assert instance.get("g", "c_a", "sigma_a2") == [9.8, 0.5, 1e-4]
    assert [status for status, _ in instance.log] == [ERROR] * 2
    instance.close()


@pytest.mark.parametrize("name", [name for name, block in BLOCKS.items() if isinstance(block, SampledBlock)])
def test_outputs_hold_between_samples_whatever_is_set(kind, name):
    instance = fmu.Fmu(name, kind=kind).initialise()
    instance.step(0.0, 0.05)
    before = instance.reals()
    instance.set({v.name: 0.7 for v in instance.model.modelVariables if v.causality == "input"})
    assert instance.reals() == before
    instance.close()


def test_the_outputs_of_a_plant_follow_its_inputs_at_once(kind):
    """A torque turns the rod faster at the next instant only, but a sensor on it feels it now."""
    instance = fmu.Fmu("pendulum", kind=kind).initialise({"motion": 0})
    instance.step(0.0, 0.1)
    outcomes = []
    for torque in (0.0, 1.0, 0.0):
        instance.set({"torque[1]": torque})
        outcomes.append(instance.get(*(f"specific_force[{axis}]" for axis in (1, 2, 3))))
    assert outcomes[0] == outcomes[2] != outcomes[1]
    instance.close()


@pytest.mark.parametrize("name", NAMES)
def test_reset_returns_to_the_state_after_instantiation(kind, name):
    fresh = fmu.Fmu(name, kind=kind).initialise()
    used = fmu.Fmu(name, kind=kind).initialise(start_time=3.0)
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
def test_instances_in_one_process_share_nothing(kind, name):
    alone = fmu.Fmu(name, kind=kind).initialise()
    # What tells plants without inputs apart: the seed, or gravity where nothing is drawn.
    other = next(({n: value} for n, value in (("seed", 2.0), ("g", 5.0)) if n in alone.variables), {})
    first, second = fmu.Fmu(name, "first", kind=kind).initialise(), fmu.Fmu(name, "second", kind=kind).initialise(other)
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
def test_a_serialised_state_survives_the_instance_that_wrote_it(kind, name):
    writer = fmu.Fmu(name, kind=kind).initialise()
    inputs = [v.name for v in writer.model.modelVariables if v.causality == "input"]
    for k in range(7):
        writer.set({i: math.sin(j + k) for j, i in enumerate(inputs)})
        writer.step(k * 0.013, 0.013)
    saved = fmu.serialised(writer)
    writer.step(7 * 0.013, 0.1)
    expected = writer.reals()
    writer.close()
    reader = fmu.Fmu(name, kind=kind).initialise(start_time=99.0)
    fmu.restore(reader, saved)
    reader.step(7 * 0.013, 0.1)
    assert reader.reals() == expected
    reader.close()


def test_a_restored_state_remembers_that_it_warned(kind):
    instance = fmu.Fmu("lee2012", kind=kind).initialise()
    instance.set({"gyro[1]": math.nan})
    instance.step(0.0, 0.01)
    saved = fmu.serialised(instance)
    instance.set({"gyro[1]": 0.0})
    instance.step(0.01, 0.01)
    fmu.restore(instance, saved)
    instance.step(0.01, 0.01)
    assert [status for status, _ in instance.log] == [WARNING]
    instance.close()


@pytest.mark.parametrize("entered", [False, True])
def test_a_state_from_before_the_end_of_initialisation_holds_phase_and_start_time(kind, entered):
    writer, reader = fmu.Fmu("lee2012", kind=kind), fmu.Fmu("lee2012", kind=kind).initialise(start_time=7.0)
    writer.slave.setupExperiment(startTime=2.0)
    if entered:
        writer.slave.enterInitializationMode()
    writer.set({"use_initial_angles": 1, "initial_roll": 0.3})
    fmu.restore(reader, fmu.serialised(writer))
    if not entered:
        reader.slave.enterInitializationMode()
    assert reader.get("sample_time", "roll") == [2.0, pytest.approx(0.3, abs=1e-15)]  # rounded once or twice
    reader.slave.exitInitializationMode()
    reader.step(2.0, 0.02)
    assert reader.get("sample_time") == [2.01]
    writer.slave.freeInstance()
    reader.close()


def test_outputs_during_initialisation_already_follow_inputs_and_parameters(kind):
    """A master exchanges outputs before the first step."""
    instance = fmu.Fmu("lee2012", kind=kind)
    instance.slave.setupExperiment(startTime=2.0)
    instance.slave.enterInitializationMode()
    instance.set(fmu.elements("accel", (0.0, 9.8, 0.0)))
    assert instance.get("roll") == [pytest.approx(math.pi / 2, abs=1e-15)]
    instance.set({"use_initial_angles": 1, "initial_roll": 0.3})
    assert instance.get("roll", "sample_time") == [pytest.approx(0.3, abs=1e-15), 2.0]
    instance.slave.exitInitializationMode()
    assert instance.get("roll") == [pytest.approx(0.3, abs=1e-15)]
    instance.close()
