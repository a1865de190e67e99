"""Native FMUs under test: an instance and its phases."""

from __future__ import annotations

from typing import Any

from support import fmu


def native(name: str = "lee2012", **options: Any) -> fmu.Fmu:
    return fmu.Fmu(name, kind="native", **options)


def enter(instance: fmu.Fmu) -> None:
    instance.slave.enterInitializationMode()


def leave(instance: fmu.Fmu) -> None:
    instance.slave.exitInitializationMode()


def terminate(instance: fmu.Fmu) -> None:
    instance.slave.terminate()


def derivative(instance: fmu.Fmu, output: str, with_respect_to: str) -> float:
    unknown, known = instance.variables[output].valueReference, instance.variables[with_respect_to].valueReference
    return float(instance.slave.getDirectionalDerivative([unknown], [known], [1.0])[0])
