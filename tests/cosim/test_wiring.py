"""A description that does not fit its FMUs is refused with every problem, where it stands and what would fit."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from imufmu import System, WiringError
from imufmu.cosim.exchange import Exchange
from support.cosim_stubs import binding, fake_fmu, parameter_set, variable, write_ssd

PLANT = [
    variable("w", "output", unit="rad/s"),
    variable("w_deg", "output", unit="deg/s"),
    variable("f", "output", unit="m/s2"),
    variable("bare", "output"),
    variable("count", "output", "Integer"),
    variable("on", "output", "Boolean"),
    variable("title", "output", "String"),
    variable("torque", "input", unit="N.m"),
]
SENSOR = [
    variable("rate", "input", unit="rad/s"),
    variable("force", "input", unit="m/s2"),
    variable("anything", "input"),
    variable("mode", "input", "Integer"),
    variable("armed", "input", "Boolean"),
    variable("name", "input", "String"),
    variable("gyro", "output", unit="rad/s"),
    variable("range", "parameter", unit="rad/s", min="1", max="9", start="5"),
    variable("level", "parameter", "Integer", min="1", max="3", start="1"),
    variable("quiet", "parameter", "Boolean"),
    variable("file", "parameter", "String", start="a"),
    variable("v[1]", "parameter"),
    variable("v[2]", "parameter"),
]
UNITS = "".join(f'<Unit name="{unit}"/>' for unit in ("rad/s", "deg/s", "m/s2", "N.m"))
UNITS = f"<UnitDefinitions>{UNITS}</UnitDefinitions>"


def read(folder: Path, connections: Sequence[str] = (), **options: Any) -> System:
    fmus = {
        "plant": fake_fmu(folder / "plant.fmu", PLANT, types=UNITS),
        "sensor": fake_fmu(folder / "sensor.fmu", SENSOR, types=UNITS),
    }
    return System.read(write_ssd(folder / "system.ssd", fmus, connections, **options))


def problems(folder: Path, connections: Sequence[str] = (), **options: Any) -> list[str]:
    """The problems without their place, connectors that follow from the test's own connections left out."""
    with pytest.raises(WiringError) as caught:
        read(folder, connections, **options)
    assert str(caught.value).startswith(f"{folder / 'system.ssd'} does not fit its FMUs:")
    assert all(problem in str(caught.value) for problem in caught.value.problems)
    found = [problem.split(": ", 1) for problem in caught.value.problems]
    assert all(place.startswith(("line ", str(folder))) for place, _ in found)
    return [text for _, text in found if not text.startswith("connector ")]


def test_fitting_connections_become_links(tmp_path: Path) -> None:
    system = read(tmp_path, ["plant.w -> sensor.rate", "plant.count -> sensor.mode", "plant.on -> sensor.armed"])
    assert [str(link) for link in system.links] == [
        "plant.w [rad/s] -> sensor.rate [rad/s]",
        "plant.count -> sensor.mode",
        "plant.on -> sensor.armed",
    ]
    assert system.notes == (
        "plant: not connected, at their start values: torque",
        "sensor: not connected, at their start values: force, anything, name",
    )


def test_an_input_with_a_value_of_the_description_is_not_noted_as_idle(tmp_path: Path) -> None:
    system = read(tmp_path, [], bindings={"plant": binding({"torque": ("Real", 1, None)})})
    assert not [note for note in system.notes if "torque" in note]


def test_all_problems_are_told_at_once(tmp_path: Path) -> None:
    connections = ["plant.w -> sensor.force", "plant.f -> sensor.rate", "plant.count -> sensor.armed"]
    assert len(problems(tmp_path, connections, bindings={"sensor": binding({"range": ("Real", 99, None)})})) == 4


@pytest.mark.parametrize(
    ("connection", "message"),
    [
        (
            "plant.w_ -> sensor.rate",
            "plant.w_ -> sensor.rate: plant has no variable w_. Outputs of plant in rad/s: w",
        ),
        (
            "plant.w -> sensor.rat",
            "plant.w -> sensor.rat: sensor has no variable rat. Inputs of sensor in rad/s: rate",
        ),
        (
            "plant.w -> sensor.gyro",
            "plant.w -> sensor.gyro: sensor.gyro is output; input is needed. Inputs of sensor in rad/s: rate",
        ),
        (
            "plant.torque -> sensor.rate",
            "plant.torque -> sensor.rate: plant.torque is input; output is needed. Outputs of plant in rad/s: w",
        ),
        (
            "plant.w -> sensor.range",
            "plant.w -> sensor.range: sensor.range is parameter; input is needed. Inputs of sensor in rad/s: rate",
        ),
        (
            "plant.f -> sensor.rate",
            "plant.f [m/s2] -> sensor.rate [rad/s]: m/s2 and rad/s differ in kind. Outputs of plant in rad/s: w. "
            'To pass the numbers as they are: suppressUnitConversion="true"',
        ),
        ("plant.w -> sensor.mode", "plant.w [rad/s] -> sensor.mode: types differ: Real and Integer"),
        ("plant.on -> sensor.mode", "plant.on -> sensor.mode: types differ: Boolean and Integer"),
        ("plant.title -> sensor.name", "plant.title -> sensor.name: String variables cannot be connected"),
        (
            "plant.count -> sensor.mode |<ssc:LinearTransformation factor='2'/>",
            "plant.count -> sensor.mode: a LinearTransformation needs Real variables, not Integer",
        ),
    ],
)
def test_a_connection_that_does_not_fit_is_told_with_what_would(tmp_path: Path, connection: str, message: str) -> None:
    assert problems(tmp_path, [connection]) == [message]


def test_a_missing_component_is_told(tmp_path: Path) -> None:
    lines = (tmp_path / "system.ssd", "plant.w -> sensor.rate")
    read(tmp_path, [lines[1]])
    lines[0].write_text(lines[0].read_text().replace('startElement="plant"', 'startElement="plan"'))
    with pytest.raises(
        WiringError, match=r"plan\.w -> sensor\.rate: there is no component 'plan'; there is plant, sen"
    ):
        System.read(lines[0])


def test_two_sources_of_one_input_are_told(tmp_path: Path) -> None:
    assert problems(tmp_path, ["plant.w -> sensor.rate", "sensor.gyro -> sensor.rate"]) == [
        "sensor.gyro [rad/s] -> sensor.rate [rad/s]: it is fed by plant.w [rad/s] already; keep one of the two"
    ]


def test_units_may_differ_where_the_author_converts(tmp_path: Path) -> None:
    transformation = '|<ssc:LinearTransformation factor="0.017453"/>'
    system = read(tmp_path, [f'plant.w_deg -> sensor.rate suppressUnitConversion="true"{transformation}'])
    assert system.links[0].factor == 0.017453


def test_a_unit_that_one_end_does_not_name_is_a_note(tmp_path: Path) -> None:
    notes = read(tmp_path, ["plant.bare -> sensor.rate"]).notes
    assert "plant.bare -> sensor.rate [rad/s]: one end does not name its unit; taken for the same" in notes


def test_whole_numbers_feed_a_real_input(tmp_path: Path) -> None:
    link = read(tmp_path, ["plant.count -> sensor.anything |<ssc:LinearTransformation factor='2'/>"]).links[0]
    assert (link.source[1].type, link.target[1].type, link.factor) == ("Integer", "Real", 2.0)


@pytest.mark.parametrize(
    ("name", "xml", "message"),
    [
        ("sensor.rte", '<ssd:Connector name="rte" kind="input"/>', "the FMU has no such variable. Near: rate"),
        ("sensor.rate", '<ssd:Connector name="rate" kind="output"/>', "declared as output; the FMU says input"),
        (
            "sensor.rate",
            '<ssd:Connector name="rate" kind="input"><ssc:Integer/></ssd:Connector>',
            "declared as Integer; the FMU says Real",
        ),
    ],
)
def test_a_connector_that_contradicts_its_fmu_is_a_note_and_an_error_where_that_is_asked_for(
    tmp_path: Path, name: str, xml: str, message: str
) -> None:
    system = read(tmp_path, ["plant.w -> sensor.rate"], connectors={name: xml})
    assert any(f"connector {name}: {message}" in note for note in system.notes)
    assert len(system.links) == 1
    with pytest.raises(WiringError, match="breaks a standard, and was to be read strictly") as caught:
        System.read(system.path, strict=True)
    assert f"connector {name}: {message}" in caught.value.problems[0]


def test_a_connection_without_declared_connectors_runs_and_is_noted(tmp_path: Path) -> None:
    read(tmp_path, ["plant.w -> sensor.rate"])
    path = tmp_path / "system.ssd"
    path.write_text(
        path.read_text().replace('<ssd:Connectors><ssd:Connector name="w" kind="output"/></ssd:Connectors>', "")
    )
    system = System.read(path)
    assert [str(link) for link in system.links] == ["plant.w [rad/s] -> sensor.rate [rad/s]"]
    assert any("plant.w is not among the component's connectors; add it there" in note for note in system.notes)
    with pytest.raises(WiringError, match=r"plant\.w is not among the component's connectors"):
        System.read(path, strict=True)


def test_an_input_that_the_whole_system_offers_keeps_its_start_value_with_a_note(tmp_path: Path) -> None:
    read(tmp_path, ["plant.w -> sensor.rate"])
    path = tmp_path / "system.ssd"
    path.write_text(path.read_text().replace('startElement="plant"', ""))
    notes = System.read(path).notes
    assert "nothing gives w a value: sensor.rate keeps its start value" in notes
    assert any("w is not among the connectors of its system" in note for note in notes)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("gyro", ("Real", 5, None), "sensor.gyro = 5: no parameter of its FMU. Near: "),
        ("range", ("Real", 10, None), "sensor.range = 10: outside [1, 9] rad/s"),
        ("range", ("Real", 5, "m/s2"), "sensor.range = 5 m/s2: the FMU wants rad/s: m/s2 and rad/s differ in kind"),
        ("range", ("Real", 5, "furlong/x"), "sensor.range = 5 furlong/x: the FMU wants rad/s: nothing says what"),
        ("range", ("Real", "NaN", None), "sensor.range = NaN: expected a value of type Real"),
        ("range", ("Real", "INF", None), "sensor.range = INF: expected a value of type Real"),
        ("range", ("Boolean", "true", None), "sensor.range = true: expected a value of type Real"),
        ("range", ("String", "5", None), "sensor.range = 5: expected a value of type Real"),
        ("level", ("Integer", 4, None), "sensor.level = 4: outside [1, 3]"),
        ("level", ("Real", 1.5, None), "sensor.level = 1.5: expected a value of type Integer"),
        ("quiet", ("Integer", 2, None), "sensor.quiet = 2: expected a value of type Boolean"),
        ("file", ("Real", 2, None), "sensor.file = 2: expected a value of type String"),
    ],
)
def test_a_value_that_does_not_fit_is_told(
    tmp_path: Path, name: str, value: tuple[str, Any, str], message: str
) -> None:
    found = problems(tmp_path, bindings={"sensor": binding({name: value})})
    assert len(found) == 1
    assert found[0].startswith(message)


def test_a_value_for_nothing_is_left_out_as_ssp_has_it_and_noted(tmp_path: Path) -> None:
    system = read(tmp_path, bindings={"sensor": binding({"rnage": ("Real", 5, None)})})
    assert system.settings == ()
    assert any("nothing has the name: sensor.rnage. no parameter of its FMU. Near: range" in n for n in system.notes)
    with pytest.raises(WiringError, match="rnage"):
        System.read(system.path, strict=True)


def values(system: System) -> dict[str, Any]:
    return {setting.variable.name: setting.value for setting in system.settings}


def test_values_arrive_in_the_type_of_the_variable(tmp_path: Path) -> None:
    given = {
        "range": ("Integer", 5, None),
        "level": ("Real", 2.0, None),
        "quiet": ("Boolean", "true", None),
        "file": ("String", "b", None),
        "v[1]": ("Real", 1.5, "rad"),
        "rate": ("Real", 0.5, "rad/s"),
    }
    expected = {"range": 5.0, "level": 2, "quiet": True, "file": "b", "v[1]": 1.5, "rate": 0.5}
    found = values(read(tmp_path, bindings={"sensor": binding(given)}))
    assert found == expected
    assert {name: type(value) for name, value in found.items()} == {n: type(v) for n, v in expected.items()}


def test_the_last_binding_wins_and_the_system_over_its_components(tmp_path: Path) -> None:
    (tmp_path / "set.ssv").write_text(parameter_set({"range": ("Real", 2, "rad/s"), "v[1]": ("Real", 2, None)}))
    own = '<ssd:ParameterBinding source="set.ssv"/>' + binding({"range": ("Real", 3, None), "v[2]": ("Real", 3, None)})
    whole = '<ssd:ParameterBinding source="whole.ssv" prefix="sensor."/>'
    (tmp_path / "whole.ssv").write_text(parameter_set({"v[2]": ("Real", 4, None)}))
    assert values(read(tmp_path, bindings={"sensor": own, "": whole})) == {"range": 3, "v[1]": 2, "v[2]": 4}


def test_arguments_may_name_elements_or_whole_vectors(tmp_path: Path) -> None:
    system = read(tmp_path)

    def given(parameters: dict[str, Any]) -> dict[str, Any]:
        return {setting.variable.name: setting.value for setting in system.settings_with(parameters)}

    assert given({"sensor.v": [1, 2.5]}) == {"v[1]": 1.0, "v[2]": 2.5}
    assert given({"sensor.v": 3}) == {"v[1]": 3.0, "v[2]": 3.0}
    assert given({"sensor.v": 3, "sensor.v[2]": 4}) == {"v[1]": 3.0, "v[2]": 4.0}
    assert given({"sensor.quiet": True, "sensor.file": "c", "sensor.level": 2}) == {
        "quiet": True,
        "file": "c",
        "level": 2,
    }
    with pytest.raises(WiringError) as caught:
        system.settings_with({"sensor.v": [1, 2, 3], "sensr.v": 1, "sensor.w": 1, "sensor.level": 9})
    assert caught.value.problems == (
        "parameters: sensor.v = 1, 2, 3: 3 values for 2 elements",
        "parameters: sensr.v = 1: there is no component 'sensr'; there is plant, sensor",
        "parameters: sensor.w = 1: no parameter of its FMU. Near: anything, armed, file, force",
        "parameters: sensor.level = 9: outside [1, 3]",
    )


def test_bounds_and_units_of_a_declared_type_count(tmp_path: Path) -> None:
    types = (
        UNITS
        + '<TypeDefinitions><SimpleType name="Rate"><Real unit="rad/s" min="0" max="2"/></SimpleType></TypeDefinitions>'
    )
    fmu = fake_fmu(tmp_path / "a.fmu", [variable("r", "parameter", declaredType="Rate")], types=types)
    for value, message in (((3, "rad/s"), r"outside \[0, 2\] rad/s"), ((1, "m"), "the FMU wants rad/s")):
        bound = binding({"r": ("Real", *value)})
        with pytest.raises(WiringError, match=message):
            System.read(write_ssd(tmp_path / "b.ssd", {"a": fmu}, bindings={"a": bound}))


def test_an_fmu_for_one_instance_is_not_used_twice(tmp_path: Path) -> None:
    fmu = fake_fmu(tmp_path / "a.fmu", [variable("y", "output")], once=True)
    with pytest.raises(WiringError, match="two: its FMU can be instantiated once, and one uses it already"):
        System.read(write_ssd(tmp_path / "b.ssd", {"one": fmu, "two": fmu}))


def state(name: str, start: float) -> str:
    """An output with a start value of its own."""
    return variable(name, "output", start=str(start)).replace("variability=", 'initial="exact" variability=')


def test_a_state_with_a_start_value_of_its_own_can_be_set(tmp_path: Path) -> None:
    fmu = fake_fmu(tmp_path / "a.fmu", [state("angle", 0), variable("rate", "output")])
    system = System.read(write_ssd(tmp_path / "a.ssd", {"a": fmu}))
    assert [setting.value for setting in system.settings_with({"a.angle": 0.1})] == [0.1]
    with pytest.raises(WiringError, match=r"a\.rate = 1: no parameter of its FMU"):
        system.settings_with({"a.rate": 1})


def test_before_the_first_exchange_a_connection_carries_the_start_of_its_output_or_of_its_input(tmp_path: Path) -> None:
    """What the broken end of a loop reads; a 0 there may be no value that the other end can take."""
    fmu = fake_fmu(tmp_path / "a.fmu", [variable("u", "input", start="7"), state("x", 80), variable("y", "output")])
    wires = ["a.x -> b.u", "b.y -> a.u |<ssc:LinearTransformation factor='2' offset='3'/>"]
    exchange = Exchange(System.read(write_ssd(tmp_path / "a.ssd", {"a": fmu, "b": fmu}, wires)), ["a.x", "b.y"])
    assert exchange.values["Real"].tolist() == [80.0, 2.0]  # 2 * 2 + 3 = 7
