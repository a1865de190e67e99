"""Python and native FMUs are driven through the same calls, and give the same answers in the same words."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest
from fmpy.fmi1 import FMICallException

from support import fmu
from support.fmu import ERROR, OK, refusal

Call = Callable[[fmu.Fmu], Any]


def reference(instance: fmu.Fmu, name: str) -> list[int]:
    return [instance.variables[name].valueReference]


def setup(start: float = 0.0) -> Call:
    return lambda i: i.slave.setupExperiment(startTime=start)


def set_to(**values: float) -> Call:
    return lambda i: i.set(values)


def set_input(value: float) -> Call:
    return lambda i: i.set({"gyro[1]": value})


def get(*names: str) -> Call:
    return lambda i: i.get(*names)


def step(t: float, h: float = 0.01) -> Call:
    return lambda i: i.step(t, h)


def real(reference: int) -> Call:
    return lambda i: i.slave.getReal([reference])


def set_real(*references: int) -> Call:
    return lambda i: i.slave.setReal(list(references), [0.5] * len(references))


def get_as_real(name: str) -> Call:
    return lambda i: i.slave.getReal(reference(i, name))


def get_as_integer(name: str) -> Call:
    return lambda i: i.slave.getInteger(reference(i, name))


def set_as_boolean(name: str) -> Call:
    return lambda i: i.slave.setBoolean(reference(i, name), [True])


def set_integers(i: fmu.Fmu) -> Any:
    return i.slave.setInteger([*reference(i, "mode"), *reference(i, "n")], [2, 5])


def set_input_as_integer(i: fmu.Fmu) -> Any:
    return i.slave.setInteger(reference(i, "gyro[1]"), [1])


def get_integers(i: fmu.Fmu) -> Any:
    return i.slave.getInteger([*reference(i, "n"), *reference(i, "mode")])


def get_switches(i: fmu.Fmu) -> Any:
    return i.slave.getBoolean([*reference(i, "use_initial_angles"), *reference(i, "early_is_moving")])


def get_string(i: fmu.Fmu) -> Any:
    return i.slave.getString([0])


def set_string(i: fmu.Fmu) -> Any:
    return i.slave.setString([2**31], ["a"])


def log_all(i: fmu.Fmu) -> Any:
    return i.slave.setDebugLogging(True, ["logAll"])


def log_warnings(i: fmu.Fmu) -> Any:
    return i.slave.setDebugLogging(True, ["logStatusWarning"])


def log_nothing(i: fmu.Fmu) -> Any:
    return i.slave.setDebugLogging(False, [])


def garbage(i: fmu.Fmu) -> Any:
    return i.slave.deSerializeFMUstate(b"\xff\x00 no state" * 40)


def changed_state(i: fmu.Fmu) -> Any:
    """Another time, one bit."""
    saved = bytearray(fmu.serialised(i))
    saved[-3] ^= 1
    return fmu.restore(i, bytes(saved))


def cut_state(i: fmu.Fmu) -> Any:
    return fmu.restore(i, fmu.serialised(i)[:-8])


def same_state(i: fmu.Fmu) -> Any:
    return fmu.restore(i, fmu.serialised(i))


def enter(i: fmu.Fmu) -> Any:
    return i.slave.enterInitializationMode()


def leave(i: fmu.Fmu) -> Any:
    return i.slave.exitInitializationMode()


def terminate(i: fmu.Fmu) -> Any:
    return i.slave.terminate()


def reset(i: fmu.Fmu) -> Any:
    return i.slave.reset()


START = [setup(), enter, leave, step(0.0)]
LATE = [setup(2.0), enter, leave, set_input(math.nan), step(2.0)]
DATED = [setup(1.7e9), enter, leave]  # seconds since 1970
FAR = 2**31

# Each list of calls up to one that is refused, or that only warns, and what follows a reset.
CALLS: dict[str, list[Call]] = {
    "nothing wrong": [*START, set_to(c_a=0.5), get("c_a", "roll", "sample_time"), step(0.01), same_state, terminate],
    "whole numbers": [setup(), set_integers, enter, get_integers, leave, step(0.0), get_integers],
    "switches": [setup(), set_to(use_initial_angles=True), enter, get_switches, leave, step(0.0), get_switches],
    "a fixed parameter is set after the start": [*START, set_to(g=5.0)],
    "the first parameter is set after the start": [*START, set_to(sample_period=0.02)],
    "an output is set": [*START, set_to(roll=1.0)],
    "a local variable is set": [*START, lambda i: i.set({"innovation[1]": 1.0})],
    "the clock is set": [setup(), set_to(sample_time=1.0)],
    "a tunable parameter is set out of its range": [*START, set_to(sigma_a2=-1.0)],
    "a tunable parameter is set to its bounds": [*START, set_to(sigma_a2=1e-9), set_to(sigma_a2=1e6), get("sigma_a2")],
    "a parameter is out of range at the end of initialisation": [setup(), enter, set_to(c_a=2.0, P0=math.nan), leave],
    "inputs do not count among parameters out of range": [setup(), enter, set_to(c_a=2.0), set_input(math.nan), leave],
    "the first parameter is out of range": [setup(), enter, set_to(sample_period=0.0), leave],
    "the last parameter is out of range": [setup(), enter, set_to(initial_pitch=9.0), leave],
    "a parameter of whole numbers is out of range": [setup(), enter, set_to(mode=9), leave],
    "an input is not a number": [*START, set_input(math.nan), step(0.01), step(0.02), set_input(0.0), step(0.03)],
    "an input is infinite": [*START, set_input(-math.inf), step(0.01)],
    "a step of zero": [*START, step(0.01, 0.0)],
    "a step backwards": [*START, step(0.01, -0.01)],
    "a step that is not a number": [*START, step(0.01, math.nan)],
    "a step from no time": [*START, step(math.nan)],
    "a step that is far too long": [*START, step(0.01, 1e300)],
    "a step that is a little too long": [*START, step(0.01, 10001.0)],
    "a step without an end": [*START, step(0.01, math.inf)],
    "a step from far away": [*START, step(1.5e6, 0.05)],
    "a step before initialisation": [setup(), step(0.0)],
    "a step during initialisation": [setup(), enter, step(0.0)],
    "a step after terminate": [*START, terminate, step(0.01)],
    "a set after terminate": [*START, terminate, set_input(1.0)],
    "a get after terminate": [*START, terminate, get("roll")],
    "terminate twice": [*START, terminate, terminate],
    "terminate before initialisation": [setup(), terminate],
    "a get before initialisation": [setup(), get("roll")],
    "a get of whole numbers before initialisation": [get_as_integer("mode")],
    "a start time that is not a number": [setup(math.nan)],
    "an infinite start time": [setup(math.inf)],
    "setup after the start": [*START, setup(1.0)],
    "initialisation twice": [*START, enter],
    "the end of initialisation before its begin": [setup(), leave],
    "an unknown variable is read": [*START, real(100_000)],
    "an unknown variable is read whose reference is negative as an int": [*START, real(FAR)],
    "the last of all references is read": [*START, real(2**32 - 1)],
    "an unknown variable is set": [*START, set_real(0, 100_000)],
    "an unknown variable is set whose reference is negative as an int": [*START, set_real(0, FAR + 5)],
    "the last of all references is set": [*START, set_real(2**32 - 1)],
    "an integer is read as a real": [*START, get_as_real("mode")],
    "a real is read as an integer": [*START, get_as_integer("roll")],
    "an integer is set as a boolean": [*START, set_as_boolean("mode")],
    "an input is set as an integer": [*START, set_input_as_integer],
    "the clock is read as an integer": [*START, get_as_integer("sample_time")],
    "a string is read": [*START, get_string],
    "a string is set": [*START, set_string],
    "a state is garbage": [*START, garbage],
    "a state has a bit changed": [*START, changed_state],
    "a state is cut short": [*START, cut_state],
    "all messages are wanted": [*START, log_all, set_input(math.nan), step(0.01), step(0.02, -1.0)],
    "only warnings are wanted": [*START, log_warnings, set_input(math.nan), step(0.01)],
    "a get during initialisation, nothing set": [setup(2.0), enter, get("sample_time", "roll", "vertical[3]")],
    "outputs stay while a parameter is out of range": [
        setup(),
        enter,
        get("tilt_std"),
        set_to(P0=math.nan),
        get("tilt_std"),
    ],
    "a gap in time far from zero": [*DATED, step(1.7e9, 0.01), step(1.7e9 + 0.05, 0.01), get("sample_time")],
    "a reset forgets the start and what was missing": [*LATE, reset, enter, get("sample_time"), leave, *LATE[-2:]],
    "a reset": [*START, set_input(1.0), step(0.01), reset, *START, get("roll", "g", "sample_time")],
}

# The wrapper refuses where it can only discard, and says of a step with a warning that it is well.
IN_NATIVE_WORDS = {fmu.FATAL: ERROR}


def answer(instance: fmu.Fmu, call: Call) -> tuple[int, list[str], Any]:
    """Status, messages and value of a call. A warning of a step is an OK: PythonFMU cannot tell."""
    before, status, value = len(instance.log), OK, None
    try:
        value = call(instance)
    except FMICallException as error:
        status = IN_NATIVE_WORDS.get(error.status, error.status)
    texts = [text for level, text in instance.log[before:] if level != fmu.FATAL]
    if not texts:  # refused by the class, to which PythonFMU lends no log
        texts = [text.rpartition("\n")[2] for _, text in instance.log[before:]]
    return status, texts, value


@pytest.mark.parametrize("calls", CALLS.values(), ids=CALLS)
def test_both_kinds_answer_the_same_calls_alike(calls: list[Call]) -> None:
    python, native = (fmu.Fmu("lee2012", kind=kind) for kind in fmu.KINDS)
    for number, call in enumerate(calls):
        told, expected = answer(python, call), answer(native, call)
        assert told[:2] == expected[:2], number
        assert told[2] == pytest.approx(expected[2], abs=1e-12), number  # DESIGN.md's bound between backends
    for instance in (python, native):
        instance.slave.freeInstance()


def test_what_is_wrong_is_refused_and_nothing_else() -> None:
    """The lists above do end in errors, so that equal answers are no equal silence."""
    well = {
        "nothing wrong",
        "whole numbers",
        "switches",
        "a get after terminate",
        "only warnings are wanted",
        "a reset",
    }
    well |= {"an input is not a number", "an input is infinite", "a get during initialisation, nothing set"}
    well |= {"a gap in time far from zero", "outputs stay while a parameter is out of range"}
    well |= {"a tunable parameter is set to its bounds", "a reset forgets the start and what was missing"}
    for name, calls in CALLS.items():
        instance = fmu.Fmu("lee2012", kind="native")
        statuses = [answer(instance, call)[0] for call in calls]
        assert statuses == [OK] * (len(calls) - 1) + [OK if name in well else ERROR], name
        instance.slave.freeInstance()


def test_a_plant_whose_solution_diverges_is_refused_in_the_same_words() -> None:
    stiff = {"max_step": 1.0, "damping[1]": 1e4, "initial_rate[1]": 1.0}
    told = []
    for kind in fmu.KINDS:
        instance = fmu.Fmu("pendulum", kind=kind).initialise(stiff)
        told.append(refusal(instance, lambda: instance.step(0.0, 1000.0)))  # noqa: B023
        instance.close()
    assert told[0] == told[1]


def test_behind_the_last_variable_of_a_plant_there_is_none() -> None:
    """A sampled block has its clock there."""
    for kind in fmu.KINDS:
        instance = fmu.Fmu("pendulum", kind=kind).initialise()
        behind = max(v.valueReference for v in instance.model.modelVariables) + 1
        for call in (lambda: instance.slave.getReal([behind]), lambda: instance.slave.setReal([behind], [0.0])):  # noqa: B023
            assert refusal(instance, call) == f"pendulum: no variable has value reference {behind}"
        instance.close()


def test_a_block_that_tells_no_status_takes_inputs_out_of_their_declared_bounds_without_a_word() -> None:
    """It could not say that it takes them for missing."""
    readings = []
    for kind in fmu.KINDS:
        instance = fmu.Fmu("imu", kind=kind).initialise()
        beyond = 2 * float(instance.variables["angular_velocity[1]"].max)
        instance.set({"angular_velocity[1]": beyond})
        instance.step(0.0, 0.01)
        readings.append(instance.get("gyro[1]"))
        assert instance.log == []
        instance.close()
    assert readings[0] == readings[1] != [0.0]
