"""Claims about native FMUs at run time beyond what every FMU keeps: the FMI 2.0 protocol to the letter."""

from __future__ import annotations

import ctypes
import math
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest
from fmpy import fmi2
from fmpy.fmi1 import FMICallException

from imufmu.fmi.model_description import LOG_CATEGORIES, guid
from imufmu.registry import BLOCKS
from support import fmu
from support.fmu import ERROR, OK, WARNING, refusal
from support.native_fmus import derivative, enter, leave, native, terminate
from support.optional import needs

NAMES = list(BLOCKS)

# The order of calls

CALLS: dict[str, Callable[[fmu.Fmu], Any]] = {
    "fmi2SetupExperiment": lambda i: i.slave.setupExperiment(startTime=0.0),
    "fmi2EnterInitializationMode": enter,
    "fmi2ExitInitializationMode": leave,
    "fmi2DoStep": lambda i: i.step(0.0, 0.01),
    "fmi2GetReal": lambda i: i.get("roll"),
    "fmi2GetInteger": lambda i: i.slave.getInteger([i.variables["mode"].valueReference]),
    "fmi2SetReal": lambda i: i.set({"gyro[1]": 0.1}),
    "fmi2SetInteger": lambda i: i.set({"mode": 2}),
    "fmi2GetDirectionalDerivative": lambda i: derivative(i, "roll", "accel[2]"),
    "fmi2Terminate": terminate,
}
SETS = {"fmi2SetReal", "fmi2SetInteger"}
GETS = {"fmi2GetReal", "fmi2GetInteger", "fmi2GetDirectionalDerivative"}
PHASES: dict[str, tuple[list[Callable[[fmu.Fmu], None]], set[str]]] = {
    "before initialisation": ([], {"fmi2SetupExperiment", "fmi2EnterInitializationMode"} | SETS),
    "during initialisation": ([enter], {"fmi2ExitInitializationMode"} | SETS | GETS),
    "once the simulation runs": ([enter, leave], {"fmi2DoStep", "fmi2Terminate"} | SETS | GETS),
    "after fmi2Terminate": ([enter, leave, terminate], GETS),
}


@pytest.mark.parametrize("function", CALLS)
@pytest.mark.parametrize("phase", PHASES)
def test_a_function_works_in_its_phases_and_is_refused_in_the_others(phase: str, function: str) -> None:
    way, allowed = PHASES[phase]
    instance = native()
    for call in way:
        call(instance)
    if function in allowed:
        CALLS[function](instance)
        assert instance.log == []
    else:
        assert refusal(instance, lambda: CALLS[function](instance)) == f"lee2012: {function} cannot be called {phase}"
    instance.slave.reset()  # always a way out
    instance.initialise().close()


def test_a_start_time_that_is_no_time_is_refused() -> None:
    instance = native()
    assert "start time nan" in refusal(instance, lambda: instance.slave.setupExperiment(startTime=math.nan))
    instance.slave.freeInstance()


def test_a_wrong_parameter_can_be_corrected_before_initialisation_ends() -> None:
    instance = native()
    assert "c_a = 2 is outside [0, 1]" in refusal(instance, lambda: instance.initialise({"c_a": 2.0}))
    instance.set({"c_a": 0.2})
    leave(instance)
    instance.step(0.0, 0.01)
    instance.close()


def test_during_initialisation_the_outputs_follow_parameters_of_every_type() -> None:
    """Set one by one, the outputs read between."""
    tilted = {"initial_roll": 0.5, "use_initial_angles": 1.0}
    for name, parameters in {"lee2012": tilted, "imu": {"gyro_noise_density": 0.1, "seed": 7}}.items():
        instance, expected = native(name), native(name).initialise(parameters)
        enter(instance)
        outputs = [v.name for v in instance.model.modelVariables if v.causality == "output"]
        for parameter, value in parameters.items():
            before = instance.get(*outputs)
            instance.set({parameter: value})
        assert instance.get(*outputs) == expected.get(*outputs) != before, name
        instance.slave.freeInstance()
        expected.close()


def test_every_wrong_parameter_is_named_in_one_message() -> None:
    instance = native()
    message = refusal(instance, lambda: instance.initialise({"c_a": math.nan, "mode": 4, "P0": -1.0}))
    assert message.startswith("lee2012: mode = 4 is outside [1, 3]; c_a = nan is outside [0, 1]; P0 = -1 is outside")
    instance.slave.freeInstance()


@pytest.mark.parametrize("wrong", [{"guid": "{00000000-0000-0000-0000-000000000000}"}, {"instance_name": ""}])
def test_an_instance_needs_the_guid_of_its_description_and_a_name(wrong: dict[str, str]) -> None:
    with pytest.raises(Exception, match="Failed to instantiate"):
        native(**wrong)


# Variables


def test_a_call_sets_all_its_values_or_none() -> None:
    instance = native().initialise()
    references = [instance.variables[name].valueReference for name in ("c_a", "gyro[1]", "g")]
    message = refusal(instance, lambda: instance.slave.setReal(references, [0.7, 5.0, 9.0]))
    assert message == "lee2012: g is fixed once the simulation runs; it keeps 9.8"
    assert instance.get("c_a", "gyro[1]") == [0.1, 0.0]
    instance.close()


def test_variables_are_refused_by_name_in_the_functions_of_another_type() -> None:
    instance = native().initialise()
    mode, roll = (instance.variables[name].valueReference for name in ("mode", "roll"))
    assert "mode is Integer, not Real" in refusal(instance, lambda: instance.slave.getReal([mode]))
    assert "mode is Integer, not Boolean" in refusal(instance, lambda: instance.slave.setBoolean([mode], [True]))
    assert "roll is Real, not Integer" in refusal(instance, lambda: instance.slave.setInteger([roll], [1]))
    assert "no variable has value reference 100000" in refusal(instance, lambda: instance.slave.getReal([100_000]))
    assert "roll is calculated" in refusal(instance, lambda: instance.set({"roll": 1.0}))
    instance.close()


@pytest.mark.parametrize("name", NAMES)
def test_the_first_and_last_variable_of_each_kind_is_set_and_read_by_the_rules_of_its_kind(name: str) -> None:
    """Value references count inputs, parameters, outputs, locals: neighbours follow different rules."""
    instance = native(name).initialise()
    variables = sorted(instance.model.modelVariables, key=lambda v: v.valueReference)
    first_and_last = [
        kind[end] for c in ("input", "output", "local") for end in (0, -1) if (kind := of_causality(variables, c))
    ]
    for variable in first_and_last:
        references, value = [variable.valueReference], instance.slave.getReal([variable.valueReference])
        if variable.causality == "input":
            instance.slave.setReal(references, [0.25])
            assert instance.slave.getReal(references) == [0.25]
        else:
            message = refusal(instance, lambda: instance.slave.setReal(references, value))  # noqa: B023
            assert message == f"{name}: {variable.name} is calculated and cannot be set"
    for variable in (of_causality(variables, "parameter")[end] for end in (0, -1)):
        setter = {"Real": instance.slave.setReal, "Integer": instance.slave.setInteger}[variable.type]
        if variable.variability == "fixed":
            message = refusal(instance, lambda: setter([variable.valueReference], [1]))  # noqa: B023
            assert message.startswith(f"{name}: {variable.name} is fixed once the simulation runs")
    one_more = variables[-1].valueReference + 1
    for call in (lambda: instance.slave.getReal([one_more]), lambda: instance.slave.setReal([one_more], [0.0])):
        assert refusal(instance, call) == f"{name}: no variable has value reference {one_more}"
    instance.close()


def of_causality(variables: list[Any], causality: str) -> list[Any]:
    return [variable for variable in variables if variable.causality == causality]


def test_what_is_not_there_is_refused_and_says_so() -> None:
    instance = native().initialise()
    slave, gyro = instance.slave, [instance.variables["gyro[1]"].valueReference]
    assert "no string variables" in refusal(instance, lambda: slave.getString(gyro))
    assert "no string variables" in refusal(instance, lambda: slave.setString(gyro, ["a"]))
    assert "canInterpolateInputs is false" in refusal(instance, lambda: slave.setRealInputDerivatives(gyro, [1], [1.0]))
    assert "maxOutputDerivativeOrder is 0" in refusal(instance, lambda: slave.getRealOutputDerivatives(gyro, [1]))
    assert "no step is pending" in refusal(instance, slave.cancelStep)
    assert slave.getString([]) == []
    instance.close()


# Logging


@pytest.mark.parametrize("callbacks", [None, fmi2.fmi2CallbackFunctions()], ids=["none", "no logger"])
def test_a_host_without_callbacks_is_served_in_silence(callbacks: fmi2.fmi2CallbackFunctions | None) -> None:
    instance = native()
    library, identity = instance.slave.dll, instance.model.guid.encode()
    given = None if callbacks is None else ctypes.byref(callbacks)
    assert library.fmi2Instantiate(b"quiet", fmi2.fmi2CoSimulation, b"wrong", None, given, 0, 1) is None
    component = library.fmi2Instantiate(b"quiet", fmi2.fmi2CoSimulation, identity, None, given, 0, 1)
    assert library.fmi2DoStep(component, 0.0, 0.01, 1) == ERROR
    library.fmi2FreeInstance(component)
    instance.slave.freeInstance()


def test_logging_off_leaves_the_refusals() -> None:
    instance = native(logging=False).initialise()
    instance.set({"gyro[1]": math.nan})
    instance.step(0.0, 0.01)
    assert instance.log == []
    refusal(instance, lambda: instance.step(0.01, -1.0))
    instance.close()


@pytest.mark.parametrize(
    ("on", "categories", "logged"),
    [
        (True, [], {WARNING, ERROR}),
        (True, ["logAll"], {WARNING, ERROR}),
        (True, ["logStatusWarning"], {WARNING}),
        (True, ["logStatusError", "logStatusFatal"], {ERROR}),
        (False, ["logStatusWarning"], {ERROR}),
        (False, ["logStatusError"], {WARNING}),
        (False, [], set()),
    ],
)
def test_categories_choose_what_is_logged(on: bool, categories: list[str], logged: set[int]) -> None:
    instance = native().initialise()
    instance.slave.setDebugLogging(on, categories)
    instance.set({"gyro[1]": math.nan})
    instance.step(0.0, 0.01)
    with pytest.raises(FMICallException):
        instance.step(0.01, -1.0)
    assert {status for status, _ in instance.log} == logged
    instance.close()


def test_categories_are_those_of_the_description() -> None:
    instance = native()
    instance.slave.setDebugLogging(True, list(LOG_CATEGORIES))
    message = refusal(instance, lambda: instance.slave.setDebugLogging(True, ["logEvents"]))
    assert all(category in message for category in LOG_CATEGORIES)
    instance.slave.freeInstance()


def test_the_step_that_meets_missing_inputs_first_returns_a_warning() -> None:
    instance = native().initialise()
    statuses = []
    for k, value in enumerate([0.0, math.nan, math.nan, 0.0, math.inf]):
        instance.set({"gyro[1]": value})
        statuses.append(do_step(instance, 0.01 * k, 0.01))
    assert statuses == [fmi2.fmi2OK, fmi2.fmi2Warning, fmi2.fmi2OK, fmi2.fmi2OK, fmi2.fmi2Warning]
    instance.close()


def do_step(instance: fmu.Fmu, t: float, h: float) -> int:
    """Status of the plain C function, which FMPy's wrapper keeps to itself."""
    function = instance.slave.dll.fmi2DoStep
    function.argtypes = [ctypes.c_void_p, ctypes.c_double, ctypes.c_double, ctypes.c_int]
    return int(function(instance.slave.component, t, h, 1))


# State


def test_a_state_that_was_changed_or_is_of_another_block_or_length_is_refused_and_changes_nothing() -> None:
    instance, other = native().initialise(), native("imu").initialise()
    instance.step(0.0, 0.05)
    before = instance.reals()
    foreign = fmu.serialised(other)
    own = fmu.serialised(instance)
    other_build = own.replace(instance.model.guid.encode(), guid(BLOCKS["imu"], native=True).encode())
    assert own != other_build
    places = [0, *range(48, len(own), 61), len(own) - 1]  # before the GUID, and behind it
    changed = [own[:i] + bytes([own[i] ^ 1]) + own[i + 1 :] for i in places]
    for saved in (foreign, own[:-8], own + b"\0", other_build, *changed):
        message = refusal(instance, lambda saved=saved: fmu.restore(instance, saved))
        assert "was changed, or is that of another FMU" in message
        assert instance.reals() == before
    instance.close()
    other.close()


def test_a_state_that_another_fmu_keeps_is_refused() -> None:
    instance, other = native().initialise(), native("imu").initialise()
    before, state = instance.reals(), other.slave.getFMUstate()
    message = refusal(instance, lambda: instance.slave.setFMUstate(state))
    assert message == "lee2012: the state is that of another FMU and was not set"
    assert instance.reals() == before
    other.slave.freeFMUstate(state)
    instance.close()
    other.close()


def test_a_state_is_not_written_into_less_room_than_it_needs() -> None:
    instance = native().initialise()
    state = instance.slave.getFMUstate()
    room = (ctypes.c_char * len(fmu.serialised(instance)))()
    refusal(
        instance, lambda: instance.slave.fmi2SerializeFMUstate(instance.slave.component, state, room, len(room) - 1)
    )
    assert bytes(room) == bytes(len(room))
    instance.slave.freeFMUstate(state)
    instance.close()


def test_a_host_that_frees_the_state_itself_instead_of_a_pointer_to_it_lives() -> None:
    """As fmusim does. What it frees would be the first bytes of the state, taken for an address."""
    instance = native().initialise()
    instance.step(0.0, 0.01)
    state, expected = instance.slave.getFMUstate(), instance.reals()
    assert ctypes.c_void_p.from_address(state.value).value is None  # else the next call takes this process down
    taken_for_a_pointer = ctypes.cast(state, ctypes.POINTER(ctypes.c_void_p))
    assert instance.slave.dll.fmi2FreeFMUstate(instance.slave.component, taken_for_a_pointer) == OK
    instance.step(0.01, 0.01)
    instance.slave.setFMUstate(state)  # it is still there
    assert instance.reals() == expected
    instance.slave.freeFMUstate(state)
    instance.close()


@pytest.mark.parametrize("name", NAMES)
def test_a_state_kept_in_memory_returns_bit_for_bit_also_to_another_phase(name: str) -> None:
    instance = native(name)
    fresh = instance.slave.getFMUstate()
    instance.initialise(start_time=1.0)
    instance.step(1.0, 0.1)
    running, expected = instance.slave.getFMUstate(), instance.reals()
    instance.step(1.1, 0.3)
    instance.slave.setFMUstate(running)
    assert instance.reals() == expected
    instance.slave.setFMUstate(fresh)
    instance.initialise(start_time=1.0)
    instance.step(1.0, 0.1)
    assert instance.reals() == expected
    for state in (fresh, running):
        instance.slave.freeFMUstate(state)
    instance.close()


@needs("POSIX")
def test_states_and_instances_that_are_freed_leave_no_memory_behind() -> None:
    """A state of plumb has 6 kB, an instance twice that: 30 and 24 MB, were they kept."""
    import resource

    unit = 1 if sys.platform == "darwin" else 1024  # bytes
    instance = native("plumb").initialise()
    serialised = fmu.serialised(instance)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for _ in range(2500):
        instance.slave.freeFMUstate(instance.slave.getFMUstate())
        instance.slave.freeFMUstate(instance.slave.deSerializeFMUstate(serialised))
    for _ in range(2000):
        library, guid = instance.slave.dll, instance.model.guid.encode()
        library.fmi2FreeInstance(library.fmi2Instantiate(b"i", fmi2.fmi2CoSimulation, guid, None, None, 0, 0))
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * unit
    assert grown < 8e6
    instance.close()


# Threads


@pytest.mark.parametrize("name", ["lee2012", "imu", "double_pendulum"])
def test_instances_in_several_threads_at_once_give_what_each_gives_alone(name: str) -> None:
    """FMPy lets go of Python's lock during a call, so long steps do overlap."""

    def outcome(index: int) -> list[float]:
        instance = native(name, instance_name=f"instance{index}").initialise()
        inputs = [v.name for v in instance.model.modelVariables if v.causality == "input"]
        for k in range(20):
            instance.set({i: math.sin(index + j + k) for j, i in enumerate(inputs)})
            instance.step(10.0 * k, 10.0)
        values = instance.reals()
        instance.close()
        return values

    alone = [outcome(index) for index in range(4)]
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(outcome, range(4))) == alone
