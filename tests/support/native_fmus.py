"""Native FMUs under test: an instance, its phases, and what it says of a call that it refuses."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from fmpy.fmi1 import FMICallException

from support import fmu

WARNING, ERROR = 1, 3


def native(name: str = "lee2012", **options: Any) -> fmu.Fmu:
    return fmu.Fmu(name, kind="native", **options)


def refusal(instance: fmu.Fmu, call: Callable[[], Any]) -> str:
    """The one message of a call that is to return fmi2Error."""
    before = len(instance.log)
    with pytest.raises(FMICallException) as raised:
        call()
    assert raised.value.status == ERROR
    messages = instance.log[before:]
    assert [status for status, _ in messages] == [ERROR]
    return messages[0][1]


def enter(instance: fmu.Fmu) -> None:
    instance.slave.enterInitializationMode()


def leave(instance: fmu.Fmu) -> None:
    instance.slave.exitInitializationMode()


def terminate(instance: fmu.Fmu) -> None:
    instance.slave.terminate()


def derivative(instance: fmu.Fmu, output: str, with_respect_to: str) -> float:
    unknown, known = instance.variables[output].valueReference, instance.variables[with_respect_to].valueReference
    return float(instance.slave.getDirectionalDerivative([unknown], [known], [1.0])[0])
