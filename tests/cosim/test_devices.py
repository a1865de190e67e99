"""A device is a set of errors: it replaces another one wholly, in a system and in a compiled FMU."""

from __future__ import annotations

import numpy as np
import pytest

import imufmu
from imufmu import BuildError, DescriptionError, System
from imufmu.cosim.devices import changed_device, device_parameters, device_values, rate_parameters
from imufmu.fmi.native import block_called, with_imu
from support.cosim_stubs import parameter_set

PENDULUM = "pendulum_lee2012"  # with an mtx at 100 Hz


@pytest.fixture(scope="module")
def system() -> System:
    return System.read(PENDULUM)


def test_another_device_leaves_nothing_of_the_one_before(system: System) -> None:
    before = {s.variable.name: s.value for s in system.settings if s.component == "imu"}
    assert before["gyro_noise_density"] == device_values("mtx")["gyro_noise_density"].number
    changes = {
        name.removeprefix("imu."): value for name, value in device_parameters(system.interfaces, "mpu9150").items()
    }
    own = {name: value.number for name, value in device_values("mpu9150").items() if name != "sample_period"}
    assert {name: changes[name] for name in own} == own
    rest = set(before) - set(own) - {"sample_period"}
    assert rest and all(changes[name] == 0.0 or name.endswith("_time") for name in rest)
    assert "sample_period" not in changes  # the system's stays


def test_the_ideal_device_has_no_error(system: System) -> None:
    changes = device_parameters(system.interfaces, "ideal")
    assert all(value == 0.0 for name, value in changes.items() if "bias_time" not in name)
    result = imufmu.simulate(system, stop_time=1.0, parameters=changes, record=["imu.gyro", "plant.angular_velocity"])
    np.testing.assert_array_equal(result["imu.gyro"][:-1], result["plant.angular_velocity"][:-1])


def test_a_device_with_less_errors_than_others_sets_theirs_to_their_start() -> None:
    starts = {"gyro_bias[1]": 0.0, "gyro_bias_instability": 0.0, "seed": 1.0}
    changed = changed_device("mpu9150", starts)
    assert changed["gyro_bias_instability"] == 0.0  # of the mtx; no figure for the mpu9150
    assert changed["gyro_bias[1]"] != 0.0
    assert "seed" not in changed


def test_a_device_of_another_unit_is_converted_and_one_of_another_kind_refused(tmp_path) -> None:
    values = {"gyro_noise_density": ("Real", 1.0, "deg/s/sqrt(Hz)"), "accel_range": ("Real", 16, "g")}
    (tmp_path / "mine.ssv").write_text(parameter_set(values))
    mine = device_values(tmp_path / "mine.ssv")
    assert mine["gyro_noise_density"].number == pytest.approx(np.pi / 180, rel=1e-12)  # a few roundings
    assert (mine["accel_range"].number, mine["accel_range"].unit) == (pytest.approx(16 * 9.80665), "m/s2")
    (tmp_path / "mine.ssv").write_text(parameter_set({"accel_range": ("Real", 16, "rad/s")}))
    with pytest.raises(DescriptionError, match=r"mine\.ssv, line 2: accel_range = 16: rad/s and m/s2 differ in kind"):
        device_values(tmp_path / "mine.ssv")


def test_a_rate_is_that_of_everything(system: System) -> None:
    rates = rate_parameters(system.interfaces, 200.0)
    assert set(rates) == {"imu.sample_period", "lee2012.sample_period", "plumb.sample_period"}
    assert set(rates.values()) == {0.005}
    with pytest.raises(ValueError, match="expected samples per second"):
        rate_parameters(system.interfaces, 0.0)


def test_names_that_are_not_known_are_told(system: System, tmp_path) -> None:
    with pytest.raises(ValueError, match=r"no device is called 'mtz'.*did you mean mtx"):
        device_parameters(system.interfaces, "mtz")
    with pytest.raises(ValueError, match=r"or give an \.ssv file"):
        device_values(tmp_path / "none.ssv")


def test_a_device_is_baked_into_blocks_in_series() -> None:
    values = {name: value.number for name, value in device_values("mpu9150").items()}
    block = with_imu(block_called("imu+plumb"), values)
    starts = {
        name: start for p in block.parameters for name, start in zip(p.element_names(), p.start_values(), strict=True)
    }
    for name, value in values.items():
        assert starts["sample_period" if name == "sample_period" else f"imu.{name}"] == value
    alone = with_imu(block_called("imu"), values)
    assert {p.name: p.start for p in alone.parameters}["gyro_bias"] == tuple(
        values[f"gyro_bias[{i}]"] for i in (1, 2, 3)
    )


def test_a_block_without_an_imu_takes_no_device() -> None:
    with pytest.raises(BuildError, match=r"plumb has no IMU in it; as in imu\+lee2012"):
        with_imu(block_called("plumb"), {"gyro_bias[1]": 0.1})
    with pytest.raises(BuildError, match="its IMU has no parameter gyro_bais"):
        with_imu(block_called("imu"), {"gyro_bais": 0.1})
