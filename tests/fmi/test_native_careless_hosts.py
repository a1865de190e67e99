"""Claims about native FMUs whose host forgets something: null pointers, other lives of its memory. Nothing crashes."""

from __future__ import annotations

import ctypes
from ctypes import byref, c_char, c_double, c_int, c_size_t, c_uint, c_void_p
from typing import Any

import pytest
from fmpy import fmi2
from fmpy.fmi1 import FMICallException

from support import fmu
from support.fmu import ERROR, OK, WARNING, refusal
from support.native_fmus import enter, native

DISCARD = 2
REAL, INTEGER, INPUT = (c_uint * 1)(20), (c_uint * 1)(7), (c_uint * 1)(0)  # roll or a parameter, mode, gyro[1]
REALS, INTEGERS, BYTES, SIZE = (c_double * 1)(), (c_int * 1)(), (c_char * 4096)(), c_size_t()

# Arguments behind the component, of which one is a null pointer.
WITHOUT: list[tuple[str, tuple[Any, ...], str]] = [
    *((f"{verb}Real", arguments, "got no array") for verb in ("Get", "Set") for arguments in [(None, 1, REALS)]),
    *((f"{verb}Real", arguments, "got no array") for verb in ("Get", "Set") for arguments in [(INPUT, 1, None)]),
    *((f"{verb}Integer", (None, 1, INTEGERS), "got no array") for verb in ("Get", "Set")),
    *((f"{verb}Integer", (INTEGER, 1, None), "got no array") for verb in ("Get", "Set")),
    *((f"{verb}Boolean", (None, 1, INTEGERS), "got no array") for verb in ("Get", "Set")),
    ("GetDirectionalDerivative", (None, 1, INPUT, 1, REALS, REALS), "got no array"),
    ("GetDirectionalDerivative", (REAL, 1, None, 1, REALS, REALS), "got no array"),
    ("GetDirectionalDerivative", (REAL, 1, INPUT, 1, None, REALS), "got no array"),
    ("GetDirectionalDerivative", (REAL, 1, INPUT, 1, REALS, None), "got no array"),
    ("SetDebugLogging", (1, 1, None), "got no array"),
    ("SetDebugLogging", (1, 1, (ctypes.c_char_p * 1)(None)), "no such log category"),
    ("GetFMUstate", (None,), "no place for the state"),
    ("SetFMUstate", (None,), "that of another FMU"),
    ("SerializedFMUstateSize", (None, byref(SIZE)), "got no state"),
    ("SerializeFMUstate", (None, BYTES, len(BYTES)), "got no state"),
    ("DeSerializeFMUstate", (None, len(BYTES), byref(c_void_p())), "got no bytes"),
    ("DeSerializeFMUstate", (BYTES, len(BYTES), None), "no place for the state"),
]


def call(instance: fmu.Fmu, function: str, *arguments: Any) -> int:
    return int(getattr(instance.slave, f"fmi2{function}")(instance.slave.component, *arguments))


@pytest.mark.parametrize(("function", "arguments", "reason"), WITHOUT, ids=[name for name, _, _ in WITHOUT])
def test_a_null_pointer_for_an_array_or_a_state_is_refused(
    function: str, arguments: tuple[Any, ...], reason: str
) -> None:
    instance = native().initialise()
    assert reason in refusal(instance, lambda: call(instance, function, *arguments))
    instance.step(0.0, 0.01)
    instance.close()


def test_a_state_is_not_written_to_nowhere_and_none_is_freed() -> None:
    instance = native().initialise()
    state = instance.slave.getFMUstate()
    assert "got no state" in refusal(instance, lambda: call(instance, "SerializedFMUstateSize", state, None))
    assert "got no state" in refusal(instance, lambda: call(instance, "SerializeFMUstate", state, None, len(BYTES)))
    assert call(instance, "FreeFMUstate", None) == OK
    instance.slave.freeFMUstate(state)
    assert state.value is None
    assert call(instance, "FreeFMUstate", byref(state)) == OK
    instance.close()


def test_a_state_that_is_kept_already_is_written_again() -> None:
    instance = native().initialise()
    state = instance.slave.getFMUstate()
    place = state.value
    instance.step(0.0, 0.05)
    assert call(instance, "GetFMUstate", byref(state)) == OK and state.value == place
    expected = instance.reals()
    instance.step(0.05, 0.05)
    instance.slave.setFMUstate(state)
    assert instance.reals() == expected
    instance.slave.freeFMUstate(state)
    instance.close()


NOBODY: dict[str, tuple[Any, ...]] = {
    "SetDebugLogging": (1, 0, None),
    "SetupExperiment": (0, 0.0, 0.0, 0, 0.0),
    "EnterInitializationMode": (),
    "ExitInitializationMode": (),
    "Terminate": (),
    "Reset": (),
    "GetReal": (REAL, 1, REALS),
    "SetReal": (INPUT, 1, REALS),
    "GetString": (INPUT, 1, (ctypes.c_char_p * 1)()),
    "GetFMUstate": (byref(c_void_p()),),
    "SetFMUstate": (None,),
    "FreeFMUstate": (None,),
    "SerializedFMUstateSize": (None, byref(SIZE)),
    "SerializeFMUstate": (None, BYTES, len(BYTES)),
    "DeSerializeFMUstate": (BYTES, len(BYTES), byref(c_void_p())),
    "GetDirectionalDerivative": (REAL, 1, INPUT, 1, REALS, REALS),
    "DoStep": (0.0, 0.01, 1),
    "CancelStep": (),
    "SetRealInputDerivatives": (INPUT, 1, INTEGERS, REALS),
    "GetRealOutputDerivatives": (REAL, 1, INTEGERS, REALS),
    "GetRealStatus": (2, REALS),
}


def test_calls_without_an_instance_are_errors() -> None:
    instance = native()
    for function, arguments in NOBODY.items():
        with pytest.raises(FMICallException) as raised:
            getattr(instance.slave, f"fmi2{function}")(None, *arguments)
        assert raised.value.status == ERROR, function
    assert instance.log == []
    instance.slave.dll.fmi2FreeInstance(None)
    instance.slave.freeInstance()


def test_every_number_but_zero_is_true() -> None:
    instance = native()
    switch, value = (c_uint * 1)(instance.variables["use_initial_angles"].valueReference), (c_int * 1)()
    enter(instance)
    for given, expected in ((2, 1), (0, 0), (-1, 1)):
        assert call(instance, "SetBoolean", switch, 1, (c_int * 1)(given)) == OK
        instance.set({"initial_roll": 0.3})
        assert instance.get("roll") == [pytest.approx(0.3 * expected, abs=1e-15)]  # rounded once or twice
        assert call(instance, "GetBoolean", switch, 1, value) == OK and value[0] == expected
    instance.slave.freeInstance()


def callbacks_into(messages: list[tuple[Any, ...]]) -> fmi2.fmi2CallbackFunctions:
    """Callbacks that collect instance name, status, category and text of each message."""
    callbacks = fmi2.fmi2CallbackFunctions()
    callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(lambda _environment, *message: messages.append(message))
    return callbacks


@pytest.mark.parametrize(
    ("name", "kind", "has_guid", "reason"),
    [
        (None, fmi2.fmi2CoSimulation, True, b"lee2012: an instance needs a name"),
        (b"i", fmi2.fmi2ModelExchange, True, b"lee2012: for co-simulation only"),
        (b"i", fmi2.fmi2CoSimulation, False, b"lee2012: the GUID is not {"),
    ],
    ids=["no name", "model exchange", "no GUID"],
)
def test_an_instance_that_cannot_be_is_refused_with_a_reason(
    name: bytes | None, kind: int, has_guid: bool, reason: bytes
) -> None:
    instance, messages = native(), list[tuple[Any, ...]]()
    guid, callbacks = instance.model.guid.encode() if has_guid else None, callbacks_into(messages)
    assert instance.slave.dll.fmi2Instantiate(name, kind, guid, None, byref(callbacks), 0, 0) is None
    ((named, status, _category, text),) = messages
    assert (named, status) == (name or b"", ERROR) and text.startswith(reason)
    instance.slave.freeInstance()


def test_messages_name_the_instance_and_the_category_of_their_status_whatever_the_host_does_with_its_memory() -> None:
    other, messages = native(), list[tuple[Any, ...]]()
    callbacks, name = callbacks_into(messages), ctypes.create_string_buffer(b"left wheel")
    library, identity = other.slave.dll, other.model.guid.encode()
    component = library.fmi2Instantiate(name, fmi2.fmi2CoSimulation, identity, None, byref(callbacks), 0, 1)
    name.value = b"XXXXXXXXXX"
    library.fmi2SetupExperiment(component, 0, 0.0, 0.0, 0, 0.0)
    library.fmi2EnterInitializationMode(component)
    library.fmi2ExitInitializationMode(component)
    assert library.fmi2SetReal(component, INPUT, 1, (c_double * 1)(float("nan"))) == OK
    assert library.fmi2DoStep(component, 0.0, 0.01, 1) == WARNING
    assert library.fmi2DoStep(component, 0.0, -0.01, 1) == ERROR
    library.fmi2FreeInstance(component)
    named = b"left wheel"
    expected = [(named, WARNING, b"logStatusWarning"), (named, ERROR, b"logStatusError")]
    assert [message[:3] for message in messages] == expected
    other.slave.freeInstance()


@pytest.mark.parametrize("kind", ["", "Real", "Integer", "Boolean", "String"])
def test_the_status_of_a_pending_step_is_discarded_for_there_is_none(kind: str) -> None:
    instance = native().initialise()
    with pytest.raises(FMICallException) as raised:
        call(instance, f"Get{kind}Status", 2, None)
    assert raised.value.status == DISCARD
    instance.close()


def test_a_message_about_more_parameters_than_it_has_room_for_is_cut() -> None:
    """The buffer has 2048 bytes; the 80 parameters of a car need more."""
    instance = native("vehicle")
    instance.slave.setupExperiment()
    enter(instance)
    parameters = [v for v in instance.model.modelVariables if v.causality == "parameter" and v.type == "Real"]
    instance.set({v.name: 1e300 for v in parameters})
    message = refusal(instance, instance.slave.exitInitializationMode)
    assert 1900 < len(message) < 2048
    instance.slave.freeInstance()
