"""Devices: parameter sets of the block imu, from data sheets, and what they change in a system."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..files.locations import models_folder
from ..files.names import no_such
from ..registry import BLOCKS
from .interface import Interface
from .ssp.files import DescriptionError
from .ssp.parameters import ParameterValue, read_parameter_set
from .units import SAME, Unit, conversion

_COUNTS = ("seed",)
_FASTEST = 1e6  # Hz
NO_DEVICE = "ideal"  # an IMU without errors, at the sample rate of the run


@dataclass(frozen=True)
class DeviceValue:
    """One value as its file has it: SSP type, text, unit."""

    kind: str
    text: str
    unit: str | None

    @property
    def number(self) -> Any:
        """The value in its type."""
        if self.kind == "Boolean":
            return self.text in ("true", "1")
        return int(self.text) if self.kind == "Integer" else float(self.text)


def device_file(name: str | Path) -> Path:
    """The parameter set that a user means: a device (see: imufmu list), or an .ssv file. Raises ValueError."""
    path = Path(name)
    if path.suffix.lower() != ".ssv":
        path = models_folder() / "imus" / f"{name}.ssv"
    if not path.is_file():
        raise ValueError(no_such("device", str(name), [*_devices(), NO_DEVICE], "or give an .ssv file"))
    return path


def device_values(name: str | Path) -> dict[str, DeviceValue]:
    """Values of a device by parameter of the block imu, in its units; none for "ideal".

    Raises ValueError where there is no such device, and DescriptionError.
    """
    if str(name) == NO_DEVICE:
        return {}
    return {value.name: _in_our_unit(value) for value in read_parameter_set(device_file(name))}


def _in_our_unit(value: ParameterValue) -> DeviceValue:
    units = {parameter.name: Unit(parameter.unit) for parameter in BLOCKS["imu"].parameters}
    unit = units.get(value.name.partition("[")[0])
    try:
        linear = conversion(value.unit, unit)
        text = value.value if linear == SAME else repr(linear(float(value.value)))
    except ValueError as error:
        raise DescriptionError(f"{value.where}: {value.name} = {value.value}: {error}") from error
    named = unit if value.unit and unit else value.unit
    return DeviceValue(value.type, text, named.name if named else None)


def changed_device(name: str | Path, starts: Mapping[str, Any]) -> dict[str, Any]:
    """Values that turn the block imu into this device, whatever device it was: others' errors go back to their start.

    starts: start values of the parameters of its FMU by name. Raises ValueError and DescriptionError.
    """
    others = {parameter for known in _devices() for parameter in device_values(known)} - {"sample_period"}
    own = {parameter: value.number for parameter, value in device_values(name).items()}
    return {parameter: starts[parameter] for parameter in sorted(others) if parameter in starts} | own


def device_parameters(interfaces: Mapping[str, Interface], name: str | Path) -> dict[str, Any]:
    """Values by ``component.parameter`` that turn every IMU of a system into this device, at the system's own rate.

    interfaces: of its components by name. Raises ValueError where none is an IMU of imufmu, or there is no such device.
    """
    found: dict[str, Any] = {}
    for component, interface in interfaces.items():
        starts = {v.name: v.start for v in interface.of("parameter") if v.start is not None}
        if {"gyro_noise_density", "accel_range"} <= starts.keys():  # the errors of the block imu
            numbers = {parameter: float(start) for parameter, start in starts.items() if parameter not in _COUNTS}
            values = changed_device(name, numbers)
            values.pop("sample_period", None)
            found |= {f"{component}.{parameter}": value for parameter, value in values.items()}
    if not found:
        raise ValueError(f"no component has the parameters of the block imu; there is {', '.join(interfaces)}")
    return found


def rate_parameters(interfaces: Mapping[str, Interface], rate: float) -> dict[str, Any]:
    """Values by ``component.parameter`` with which everything takes ``rate`` samples per second. Raises ValueError."""
    if not 0 < rate < _FASTEST:
        raise ValueError(f"rate = {rate:g}: expected samples per second, such as 200")
    return {
        f"{component}.sample_period": 1.0 / rate
        for component, interface in interfaces.items()
        if any(variable.name == "sample_period" for variable in interface.of("parameter"))
    }


def _devices() -> list[str]:
    return sorted(path.stem for path in (models_folder() / "imus").glob("*.ssv"))
