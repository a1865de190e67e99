"""Units: what their names mean, and conversions on connections, in parameter sets, by --set and in replay."""

from __future__ import annotations

import math
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from imufmu import System, WiringError, replay
from imufmu.blocks.signals import UNITS
from imufmu.cosim.units import Base, Linear, Unit, UnitError, conversion, defined, quantity
from imufmu.recordings.reading import read as read_recording
from support.cosim_stubs import binding, edited_fmu, fake_fmu, stub, variable, write_ssd

RAD, DEG = defined("rad/s", {"s": -1, "rad": 1}), defined("deg/s", {"s": -1, "rad": 1, "factor": math.pi / 180})


def factor(source: str | Unit, target: str | Unit) -> float:
    a, b = (unit if isinstance(unit, Unit) else Unit(unit) for unit in (source, target))
    linear = conversion(a, b)
    assert linear.offset == 0
    return linear.factor


@pytest.mark.parametrize(
    ("source", "target", "expected"),
    [
        ("deg/s", "rad/s", math.pi / 180),
        ("degree per second", "deg/s", 1),
        ("°/s", "dps", 1),
        ("m/s^2", "m/s2", 1),
        ("m.s-2", "m/s2", 1),
        ("m·s⁻²", "m/s²", 1),
        ("N.m", "Nm", 1),
        ("km/h", "m/s", 1 / 3.6),
        ("rpm", "rad/s", math.pi / 30),
        ("rev/min", "rpm", 1),
        ("1/min", "Hz", 1 / 60),
        ("deg/s/sqrt(Hz)", "rad/s/sqrt(Hz)", math.pi / 180),
        ("deg/sqrt(h)", "rad/s/sqrt(Hz)", math.pi / 180 / 60),
        ("g", "m/s2", 9.80665),
        ("mg", "m/s2", 9.80665e-3),
        ("g", "kg", 1e-3),
        ("ug/sqrt(Hz)", "m/s2/sqrt(Hz)", 9.80665e-6),
        ("gauss", "uT", 100),
        ("mm", "m", 1e-3),
        ("[bar]", "Pa", 1e5),
        ("%", "1", 0.01),
        ("-", "1", 1),
    ],
)
def test_names_are_understood_in_the_notations_of_fmi_modelica_and_data_sheets(
    source: str, target: str, expected: float
) -> None:
    assert factor(source, target) == pytest.approx(expected, rel=1e-12)  # a few roundings of pint's tables
    assert factor(target, source) == pytest.approx(1 / expected, rel=1e-12)


def test_every_unit_of_our_blocks_is_understood_and_equals_what_our_fmus_define() -> None:
    for name, unit in UNITS.items():
        read = Unit(name)
        assert conversion(read, Unit(f"({name})")) == Linear()
        if unit.base:
            assert conversion(defined(name + " ", unit.base | {"factor": unit.factor}), read) == Linear()


def test_what_a_file_defines_comes_before_what_a_name_means() -> None:
    assert factor(defined("g", {"m": 1, "s": -2, "factor": 9.81}), "m/s2") == 9.81
    assert factor(defined("Hz", {"s": -1, "rad": 1, "factor": 2 * math.pi}), RAD) == 2 * math.pi
    assert factor(defined("smoot", {"m": 1, "factor": 1.7018}), "m") == 1.7018


def test_an_offset_is_converted_and_cancels_in_differences() -> None:
    kelvin = defined("K", {"K": 1})
    assert conversion(defined("degC", {"K": 1, "offset": 273.15}), kelvin) == Linear(1.0, 273.15)
    assert conversion(defined("degC", {"K": 1, "offset": 273.15}, relative=True), kelvin) == Linear()
    assert conversion(Unit("°C"), kelvin)(20) == pytest.approx(293.15)
    assert conversion(Unit("degF"), Unit("degC"))(50) == pytest.approx(10)


def test_a_radian_that_a_file_forgets_is_known_from_the_name_and_rad_per_s_is_not_hz() -> None:
    assert factor(defined("deg/s", {"s": -1, "factor": math.pi / 180}), RAD) == math.pi / 180
    with pytest.raises(UnitError, match="rad/s and Hz differ in kind"):
        conversion(defined("rad/s", {"s": -1}), defined("Hz", {"s": -1}))
    assert factor(defined("deg/s", {}), RAD) == math.pi / 180  # an empty definition, too
    assert conversion(defined("pu", {}), Unit("1")) == Linear()
    torque = {"kg": 1, "m": 2, "s": -2}
    assert conversion(defined("N.m", torque), defined("N.m", torque | {"rad": -1})) == Linear()


@pytest.mark.parametrize(("a", "b"), [("m", "s"), ("rad/s", "Hz"), ("deg", "1"), ("m/s2", "rad/s")])
def test_units_of_different_kinds_are_refused(a: str, b: str) -> None:
    with pytest.raises(UnitError, match="differ in kind"):
        conversion(Unit(a), Unit(b))


@pytest.mark.parametrize("name", ["foo", "os.system", "9**9**9", "((9)**9)**9)**9", "__import__", "5", "2 m", "m" * 99])
def test_a_name_that_means_nothing_is_told_and_not_evaluated(name: str) -> None:
    with pytest.raises(UnitError, match="nothing says what the unit"):
        conversion(Unit(name), Unit("m"))
    assert conversion(Unit(name), Unit(name)) == Linear()  # equal names need no meaning


@pytest.mark.parametrize(
    ("text", "unit", "expected"),
    [
        ("500mm", "m", 0.5),
        ("0.005 deg/s/sqrt(Hz)", "rad/s/sqrt(Hz)", 0.005 * math.pi / 180),
        ("-1e-3 km", "m", -1.0),
        (".5", "m", 0.5),
        ("30°", "rad", math.pi / 6),
    ],
)
def test_a_text_with_its_unit_is_a_number_in_another(text: str, unit: str, expected: float) -> None:
    assert quantity(text, Unit(unit)) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "unit", "message"),
    [
        ("500 kg", Unit("m"), "kg and m differ in kind"),
        ("500 parsnips", Unit("m"), "the unit 'parsnips' is not known"),
        ("500 mm", None, "the FMU names no unit, so nobody knows what mm is there; give the bare number"),
        ("tall", Unit("m"), "'tall' is no number"),
    ],
)
def test_a_text_that_does_not_fit_is_told(text: str, unit: Unit | None, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        quantity(text, unit)


def test_pint_is_loaded_only_where_names_must_be_read() -> None:
    """It takes half a second, more than imufmu --help."""
    program = (
        "import sys, imufmu.cli.main; from imufmu.cosim.units import Unit, conversion, defined; "
        "conversion(defined('a', {'m': 1}), defined('b', {'m': 1, 'factor': 2})); conversion(Unit('m'), Unit('m')); "
        "assert 'pint' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", program], check=True)


def units_of(*units: tuple[str, str]) -> str:
    inner = "".join(f'<Unit name="{name}">{base}</Unit>' for name, base in units)
    return f"<UnitDefinitions>{inner}</UnitDefinitions>"


TURNS = units_of(
    ("rad/s", '<BaseUnit s="-1" rad="1"/>'),
    ("turns", '<BaseUnit s="-1" rad="1" factor="6.5"/>'),  # not 2 pi: the FMU's own factor counts
    ("degC", '<BaseUnit K="1" offset="273.15"/>'),
    ("K", '<BaseUnit K="1"/>'),
    ("m", '<BaseUnit m="1"/>'),
    ("deg/s", ""),
)


def two(folder: Path, output: str, target: str, attributes: str = "", **options: Any) -> System:
    source = fake_fmu(folder / "a.fmu", [variable("y", "output", unit=output)], types=TURNS)
    sink = fake_fmu(
        folder / "b.fmu", [variable("u", "input", unit=target), variable("k", "parameter", unit=target)], types=TURNS
    )
    fmus = {"a": source, "b": sink}
    return System.read(write_ssd(folder / "s.ssd", fmus, [f"a.y -> b.u {attributes}"], **options))


@pytest.mark.parametrize(
    ("output", "target", "attributes", "expected"),
    [
        ("turns", "rad/s", "", (6.5, 0.0)),
        ("degC", "K", "", (1.0, 273.15)),
        ("deg/s", "rad/s", "", (math.pi / 180, 0.0)),
        # First the units, then the transformation (SSP 1.0, LinearTransformation); with suppression that alone.
        ("degC", "K", '|<ssc:LinearTransformation factor="2" offset="1"/>', (2.0, 547.3)),
        ("turns", "rad/s", 'suppressUnitConversion="true"|<ssc:LinearTransformation factor="2"/>', (2.0, 0.0)),
        ("turns", "m", 'suppressUnitConversion="true"', (1.0, 0.0)),
    ],
)
def test_a_connection_converts(
    tmp_path: Path, output: str, target: str, attributes: str, expected: tuple[float, float]
) -> None:
    link = two(tmp_path, output, target, attributes).links[0]
    assert (link.factor, link.offset) == pytest.approx(expected, rel=1e-14)


def test_a_connector_in_another_unit_than_its_variable_converts_on_both_sides(tmp_path: Path) -> None:
    declared = {"a.y": '<ssd:Connector name="y" kind="output"><ssc:Real unit="turns"/></ssd:Connector>'}
    plain = two(tmp_path, "rad/s", "rad/s", connectors=declared)
    # 1 rad/s is 1/6.5 turns by the FMU's definition, and so is what the transformation doubles.
    doubled = two(tmp_path, "rad/s", "rad/s", '|<ssc:LinearTransformation factor="2"/>', connectors=declared)
    assert plain.links[0].factor == pytest.approx(1.0, rel=1e-15)
    assert doubled.links[0].factor == pytest.approx(2.0, rel=1e-15)
    assert plain.links[0].offset == 0


def setting(system: System, **given: Any) -> Any:
    return [s.value for s in system.settings_with({f"b.{name}": value for name, value in given.items()})]


def test_values_of_parameter_sets_and_of_a_call_are_converted(tmp_path: Path) -> None:
    bound = two(tmp_path, "rad/s", "rad/s", bindings={"b": binding({"k": ("Real", 2, "turns")})})
    assert [s.value for s in bound.settings] == [13.0]
    assert setting(bound, k="2 turn/s") == pytest.approx([4 * math.pi])  # typed: what everybody calls a turn
    assert setting(bound, k=3) == [3.0]
    with pytest.raises(WiringError, match=r"b\.k = 2 kg: kg and rad/s differ in kind"):
        setting(bound, k="2 kg")


def test_units_that_an_ssv_defines_count_for_its_values(tmp_path: Path) -> None:
    cubit = '<ssv:Units><ssc:Unit name="cubit"><ssc:BaseUnit m="1" factor="0.5"/></ssc:Unit></ssv:Units>'
    inline = binding({"k": ("Real", 2, "cubit")}).replace("</ssv:ParameterSet>", f"{cubit}</ssv:ParameterSet>")
    assert [s.value for s in two(tmp_path, "m", "m", bindings={"b": inline}).settings] == [1.0]


def test_one_unit_behind_a_vector_counts_for_all_its_elements(tmp_path: Path) -> None:
    elements = [variable(f"v[{i}]", "parameter", unit="m") for i in (1, 2, 3)]
    fmu = fake_fmu(tmp_path / "b.fmu", elements, types=TURNS)
    system = System.read(write_ssd(tmp_path / "s.ssd", {"b": fmu}))
    assert setting(system, v="1, 2, 3 mm") == pytest.approx([0.001, 0.002, 0.003])
    assert setting(system, v="1 mm, 2 cm, 3") == pytest.approx([0.001, 0.02, 3.0])
    assert setting(system, v="5 mm") == pytest.approx([0.005] * 3)


def test_bounds_are_checked_in_the_unit_of_the_variable(tmp_path: Path) -> None:
    fmu = fake_fmu(tmp_path / "b.fmu", [variable("k", "parameter", unit="m", min="0", max="1")], types=TURNS)
    system = System.read(write_ssd(tmp_path / "s.ssd", {"b": fmu}))
    assert setting(system, k="900 mm") == [0.9]
    with pytest.raises(WiringError, match=r"b\.k = 1100 mm: 1\.1 m is outside \[0, 1\] m"):
        setting(system, k="1100 mm")


def test_a_recording_is_converted_to_the_units_of_the_fmu(tmp_path: Path) -> None:
    rows = "\n".join(f"{0.01 * k:.2f},0.1,0.2,0.3,1,2,9" for k in range(9))
    header = "time,gyro[1],gyro[2],gyro[3],accel[1],accel[2],accel[3]\n"
    (tmp_path / "a.csv").write_text(header + rows)
    recording = read_recording(tmp_path / "a.csv")

    def in_degrees(text: str) -> str:
        text = re.sub(r'(name="gyro.*?<Real)', r'\1 unit="deg/s"', text, flags=re.DOTALL)
        text = re.sub(r'(name="accel.*?<Real)', r'\1 unit="g"', text, flags=re.DOTALL)
        return text.replace("<ModelVariables>", units_of(("deg/s", ""), ("g", "")) + "<ModelVariables>")

    plain = replay(recording, stub("echo"), in_process=True)
    converted = replay(recording, edited_fmu(tmp_path / "deg.fmu", stub("echo"), in_degrees), in_process=True)
    np.testing.assert_allclose(converted.signals()["seen"], np.rad2deg(plain.signals()["seen"]), rtol=1e-14)
    np.testing.assert_allclose(converted.signals()["felt"], plain.signals()["felt"] / 9.80665, rtol=1e-14)


def test_a_base_knows_its_exponents_by_place() -> None:
    assert defined("N", {"kg": 1, "m": 1, "s": -2}).base == Base((1.0, 1.0, -2.0, 0.0, 0.0, 0.0, 0.0, 0.0))
