"""A plant of others is wired by its names, units and sizes; what may mean something else is asked, never guessed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest

import imufmu
from imufmu import Result, System, WiringError
from imufmu.cosim.connecting.connect import connect
from imufmu.cosim.connecting.vectors import vectors
from imufmu.cosim.description import read_description
from imufmu.scoring.systems import compare_all
from support.cosim_stubs import fake_fmu, variable
from support.rocker import KINDS, rocker

UNITS = """<UnitDefinitions>
<Unit name="rad/s"><BaseUnit rad="1" s="-1"/></Unit>
<Unit name="deg/s"><BaseUnit rad="1" s="-1" factor="0.017453292519943295"/></Unit>
<Unit name="m/s2"><BaseUnit m="1" s="-2"/></Unit><Unit name="g"><BaseUnit m="1" s="-2" factor="9.80665"/></Unit>
<Unit name="deg"><BaseUnit rad="1" factor="0.017453292519943295"/></Unit><Unit name="m"><BaseUnit m="1"/></Unit>
<Unit name="T"><BaseUnit kg="1" s="-2" A="-1"/></Unit></UnitDefinitions>"""
RATES = {f"omega_{axis}": "rad/s" for axis in "xyz"}
FORCES = {f"specific_force[{i}]": "m/s2" for i in (1, 2, 3)}


def plant(folder: Path, outputs: Mapping[str, str], name: str = "plant.fmu") -> Path:
    """An FMU with these outputs, which can be read but not run. outputs: units by name, "" for none."""
    lines = [variable(n, "output", **({"unit": unit} if unit else {})) for n, unit in outputs.items()]
    return fake_fmu(folder / name, lines, types=UNITS)


def factors_into(path: Path, component: str) -> dict[str, float]:
    """Factors of the connections to the inputs of a component, all the conversion there is."""
    connections = [c for c in read_description(path).connections if c.end.element == component]
    assert not any(c.same_units for c in connections)
    return {c.end.connector: c.transformation.linear.factor for c in connections}


@pytest.mark.parametrize(
    ("names", "elements"),
    [
        ("w[1] w[2] w[3]", "w[1] w[2] w[3]"),
        ("Body.w[2] Body.w[0] Body.w[1]", "Body.w[0] Body.w[1] Body.w[2]"),
        ("omega_z omega_x omega_y", "omega_x omega_y omega_z"),
        ("omegaX omegaY omegaZ", "omegaX omegaY omegaZ"),
        ("wx wy wz", "wx wy wz"),
        ("acc_x_body acc_y_body acc_z_body", "acc_x_body acc_y_body acc_z_body"),
        ("gyro.x gyro.y gyro.z", "gyro.x gyro.y gyro.z"),
        ("w1 w2 w3", "w1 w2 w3"),
        ("r p q", "p q r"),
        ("veh.p veh.q veh.r", "veh.p veh.q veh.r"),
        ("q_x q_y q_z q_w", "q_w q_x q_y q_z"),
        ("q[0] q[1] q[2] q[3]", "q[0] q[1] q[2] q[3]"),
        (" ".join(f"R[{i},{j}]" for i in (1, 2, 3) for j in (1, 2, 3)),) * 2,
    ],
)
def test_vectors_are_found_however_their_elements_are_named(names: str, elements: str) -> None:
    assert [v.elements for v in vectors([*names.split(), "height", "x_position"]) if len(v.elements) > 1] == [
        tuple(elements.split())
    ]


@pytest.mark.parametrize("names", ["w[1] w[2]", "w[1] w[2] w[4]", "omega_x omega_y", "apex index phi p q", "x1 y1 z2"])
def test_half_a_vector_is_none(names: str) -> None:
    assert [v for v in vectors(names.split()) if len(v.elements) > 1] == []


@pytest.mark.parametrize(
    "rates",
    [
        RATES,
        {"p": "rad/s", "q": "rad/s", "r": "rad/s"},
        {f"Body.w[{i}]": "rad/s" for i in (1, 2, 3)},
        {f"w[{i}]": "rad/s" for i in (0, 1, 2)},
        {f"car.bodyAngularVelocity{axis}": "rad/s" for axis in "XYZ"},
        {f"gyro{i}": "" for i in (1, 2, 3)},
    ],
    ids=lambda rates: next(iter(rates)),
)
def test_an_angular_velocity_is_known_by_its_name(rates: dict[str, str], tmp_path: Path) -> None:
    found = connect(plant(tmp_path, {**FORCES, "speed": "", **rates}))
    assert found.found[0].startswith(f"gyro: {', '.join(rates)} [")
    assert any("name no unit; taken for rad/s" in note for note in found.notes) == ("" in rates.values())


def test_our_own_name_goes_before_one_that_ends_like_it(tmp_path: Path) -> None:
    upper = {f"upper_{name}": unit for name, unit in FORCES.items()}
    assert connect(plant(tmp_path, RATES | upper | FORCES)).found[1].startswith("accel: specific_force[1]")


def test_units_of_the_plant_are_converted_in_the_description(tmp_path: Path) -> None:
    outputs = {f"w[{i}]": "deg/s" for i in (1, 2, 3)} | {f"f_b[{i}]": "g" for i in (1, 2, 3)}
    outputs |= {"roll": "deg", "pitch": "deg"} | {f"mag_{axis}": "T" for axis in "xyz"}
    path = tmp_path / "my.ssd"
    path.write_bytes(connect(plant(tmp_path, outputs)).text(tmp_path))
    factors = factors_into(path, "imu")
    assert factors["angular_velocity[1]"] == pytest.approx(np.pi / 180, rel=1e-15)
    assert factors["specific_force[3]"] == pytest.approx(9.80665, rel=1e-15)
    assert factors["magnetic_field[2]"] == pytest.approx(1e6, rel=1e-15)
    assert read_description(path).truth[0].factors[0] == pytest.approx(np.pi / 180, rel=1e-15)


def test_the_user_knows_a_unit_better_than_an_fmu(tmp_path: Path) -> None:
    """The FMU says rad/s; the description converts once, from what the user says."""
    mapping = {"gyro": "omega:deg/s", "accel": "f,specific_force[2],-specific_force[3]"}
    system = System.connect(plant(tmp_path, RATES | FORCES | {"f": "g"}), "ideal", ["plumb"], mapping)
    factors = {link.target[1].name: link.factor for link in system.links if link.target[0] == "imu"}
    assert factors["angular_velocity[3]"] == pytest.approx(np.pi / 180, rel=1e-15)
    assert factors["specific_force[1]"] == pytest.approx(9.80665, rel=1e-15)  # each element from its own unit
    assert (factors["specific_force[2]"], factors["specific_force[3]"]) == (1.0, -1.0)


@pytest.mark.parametrize(
    ("outputs", "message"),
    [
        ({f"a_{x}": "m/s2" for x in "xyz"}, "does it contain gravity.* Say it: --map accel=a_x,a_y,a_z"),
        ({f"acc[{i}]": "m/s2" for i in (1, 2, 3)}, "does it contain gravity"),
        ({f"z{i}": "m/s2" for i in (1, 2, 3)}, r"specific_force may be z1, z2, z3 \[m/s2\]"),  # by its unit
        (
            {f"accel[{i}]": "m/s2" for i in (1, 2, 3)} | {f"sf_{x}": "m/s2" for x in "xyz"},
            r"may be accel\[1\], accel\[2\], accel\[3\] \[m/s2\] or sf_x, sf_y, sf_z",
        ),
        ({}, "nothing looks like specific_force: say --map accel=...; there is omega_x, omega_y, omega_z"),
        ({f"specific_force[{i}]": "m" for i in (1, 2, 3)}, "nothing looks like specific_force"),
    ],
)
def test_what_may_mean_something_else_is_refused_with_the_words_to_say_it(
    outputs: dict[str, str], message: str, tmp_path: Path
) -> None:
    with pytest.raises(WiringError, match=message):
        connect(plant(tmp_path, RATES | outputs))


def test_what_may_mean_something_else_is_asked_where_somebody_can_answer(tmp_path: Path) -> None:
    outputs = RATES | {f"a_{x}": "m/s2" for x in "xyz"} | {f"acc[{i}]": "m/s2" for i in (1, 2, 3)}
    questions = []

    def answer(question: str, answers: Sequence[str]) -> str:
        questions.append((question, list(answers)))
        return answers[1]

    found = connect(plant(tmp_path, outputs), ask=answer)
    assert found.found[1] == "accel: a_x, a_y, a_z [m/s2]"
    [(question, answers)] = questions
    assert "does it contain gravity" in question
    assert answers == ["acc[1], acc[2], acc[3] [m/s2]", "a_x, a_y, a_z [m/s2]", "none of these"]
    with pytest.raises(WiringError, match="nothing looks like specific_force"):
        connect(plant(tmp_path, outputs), ask=lambda _, answers: answers[-1])


@pytest.mark.parametrize(
    ("mapping", "found"),
    [
        ({"gyro": "rot"}, "gyro: rot.a, rot.b, rot.c"),
        ({"gyro": "rot.b,-rot.a,rot.c:deg/s"}, "gyro: rot.b, -rot.a, rot.c [deg/s]"),
        ({"angular_velocity": "rot.a,rot.b,rot.c:rpm"}, "gyro: rot.a, rot.b, rot.c [rpm]"),
    ],
)
def test_the_user_says_what_is_what(mapping: dict[str, str], found: str, tmp_path: Path) -> None:
    if mapping == {"gyro": "rot"}:  # no vector by its names
        with pytest.raises(WiringError, match="has no single vector of 3 of that name"):
            connect(plant(tmp_path, FORCES | dict.fromkeys(("rot.a", "rot.b", "rot.c"), "")), mapping=mapping)
    else:
        told = connect(plant(tmp_path, FORCES | dict.fromkeys(("rot.a", "rot.b", "rot.c"), "")), mapping=mapping)
        assert told.found[0] == found


@pytest.mark.parametrize(
    ("mapping", "message"),
    [
        (
            {"gyro": "nothing"},
            "gyro=nothing: plant.fmu has no single vector of 3 of that name; there is specific_force",
        ),
        ({"gyro": "omega_x,omega_y"}, "gyro=omega_x,omega_y: 2 names, not 3"),
        ({"gyro": "omega_x,omega_y,up"}, "no variable up"),
        ({"gyro": "specific_force"}, "m/s2 and rad/s differ in kind"),
        ({"gyro": "omega:furlong"}, "gyro=omega:furlong: "),
        (
            {"quaternion": "att"},
            r"att: add :wxyz\|xyzw \(its order\) and :to-world\|to-body \(what it turns vectors to\)",
        ),
        ({"quaternion": "att:wxyz"}, r"att:wxyz: add :to-world\|to-body"),
        ({"gyro": "omega:to-world"}, "to-world is for a quaternion or a matrix"),
    ],
)
def test_what_the_user_says_wrongly_is_told(mapping: dict[str, str], message: str, tmp_path: Path) -> None:
    outputs = RATES | FORCES | {f"att[{i}]": "" for i in range(4)}
    with pytest.raises(WiringError, match=message):
        connect(plant(tmp_path, outputs), mapping=mapping)


def test_names_that_are_none_of_ours_are_told(tmp_path: Path) -> None:
    path = plant(tmp_path, RATES | FORCES)
    for options, message in (
        ({"mapping": {"gyros": "omega"}}, "no quantity is called 'gyros'.*did you mean gyro"),
        ({"imu": "mty"}, "no device is called 'mty'.*did you mean mtx"),
        ({"estimators": ["plum"]}, "no estimator is called 'plum'.*did you mean plumb"),
        ({"estimators": ["bennett2014"]}, "not the readings of one IMU"),
        ({"rate": 0.0}, "expected samples per second"),
    ):
        with pytest.raises(ValueError, match=message):
            connect(path, **options)


TOLD = {
    "vertical": ({f"vertical[{i}]": "" for i in (1, 2, 3)}, None, "truth: vertical, roll, pitch; compared: tilt, roll"),
    "angles": ({"roll": "deg", "pitch": "deg"}, None, "truth: vertical, roll, pitch; compared: tilt"),
    "all angles": ({"roll": "deg", "pitch": "deg", "yaw": "deg"}, None, "truth: vertical, roll, pitch, yaw, q_NS; "),
    "ours": ({f"q_NS[{i}]": "" for i in (1, 2, 3, 4)}, None, "truth: vertical, roll, pitch, yaw, q_NS; "),
    "told": ({f"q_{x}": "" for x in "xyzw"}, {"quaternion": "q:to-body"}, "truth: vertical, roll, pitch, yaw, q_NS; "),
    "half": ({"roll": "deg"}, None, "no truth: "),
    "unknown": ({f"att[{i}]": "" for i in range(4)}, None, "no truth: "),
    "none": ({}, None, "no truth: "),
}


@pytest.mark.parametrize("case", TOLD)
def test_it_is_said_which_truth_there_is_and_what_can_be_compared(case: str, tmp_path: Path) -> None:
    outputs, mapping, compared = TOLD[case]
    found = connect(plant(tmp_path, RATES | FORCES | outputs), mapping=mapping)
    assert found.compared.startswith(compared)
    hint = "--map quaternion=att:wxyz|xyzw:to-world|to-body"
    assert any(hint in note for note in found.notes) == (case == "unknown")


def test_the_form_of_an_attitude_is_asked_for(tmp_path: Path) -> None:
    path = plant(tmp_path, RATES | FORCES | {f"att[{i}]": "" for i in range(4)})
    answers = iter(["xyzw", "to-body"])
    found = connect(path, ask=lambda *_: next(answers))
    assert found.found[-1] == "quaternion: att[0], att[1], att[2], att[3] [no unit] xyzw to-body"


def test_an_estimator_of_others_is_wired_by_its_inputs(tmp_path: Path) -> None:
    inputs = [variable(f"w{x}", "input", unit="deg/s") for x in "XYZ"]
    inputs += [variable(f"accel[{i}]", "input", unit="g") for i in range(3)]
    mine = fake_fmu(tmp_path / "my.filter.fmu", inputs, types=UNITS)
    path = tmp_path / "my.ssd"
    connected = connect(plant(tmp_path, RATES | FORCES), estimators=["plumb", mine, mine])
    path.write_bytes(connected.text(tmp_path))
    description = read_description(path)
    assert [c.name for c in description.components] == ["plant", "imu", "plumb", "my_filter", "my_filter_2"]
    assert factors_into(path, "my_filter")["wX"] == pytest.approx(180 / np.pi, rel=1e-15)
    assert factors_into(path, "my_filter_2")["accel[0]"] == pytest.approx(1 / 9.80665, rel=1e-15)
    without = fake_fmu(tmp_path / "half.fmu", inputs[:3], types=UNITS)
    with pytest.raises(WiringError, match=r"half\.fmu has no input that looks like accel: say --map half\.accel="):
        connect(plant(tmp_path, RATES | FORCES), estimators=[without])


def test_the_speed_of_wheels_goes_to_plumb_where_the_user_says_so(tmp_path: Path) -> None:
    outputs = RATES | FORCES | {"forward_speed": "", "v": "m"}
    path = tmp_path / "my.ssd"
    for mapping, fed in ((None, False), ({"forward_speed": "forward_speed:km/h"}, True)):
        path.write_bytes(
            connect(plant(tmp_path, outputs), estimators=["plumb", "lee2012"], mapping=mapping).text(tmp_path)
        )
        factors = factors_into(path, "plumb")
        assert factors.get("forward_speed") == (pytest.approx(1 / 3.6, rel=1e-15) if fed else None)
        assert "forward_speed" not in factors_into(path, "lee2012")
        values = {value.name: value.value for value in read_description(path).values}
        assert ("plumb.forward_speed_valid" in values) == fed
    with pytest.raises(WiringError, match="m and m/s differ in kind"):
        connect(plant(tmp_path, outputs), mapping={"forward_speed": "v"})


def test_a_map_for_an_estimator_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(
        WiringError, match=r"--map plum\.gyro=\.\.\.: there is no estimator 'plum'; there is imu, plumb"
    ):
        connect(plant(tmp_path, RATES | FORCES), mapping={"plum.gyro": "omega"})


def test_sensors_of_the_plants_own_need_no_imu(tmp_path: Path) -> None:
    path = tmp_path / "my.ssd"
    path.write_bytes(connect(plant(tmp_path, RATES | FORCES), imu="none").text(tmp_path))
    description = read_description(path)
    assert [c.name for c in description.components] == ["plant", "plumb"]
    assert ("omega_x", "gyro[1]") in {(c.start.connector, c.end.connector) for c in description.connections}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    "mapping", [None, {"quaternion": "attitude:wxyz:to-world"}, {"matrix": "dcm:to-body"}], ids=["up", "q", "R"]
)
def test_a_platform_of_any_kind_is_estimated_and_compared(kind: str, mapping: dict[str, str] | None) -> None:
    system = System.connect(rocker(kind), "ideal", ["plumb"], mapping, rate=100.0)
    result = imufmu.simulate(system, stop_time=3.0, in_process=True)
    angle = result["truth.roll"]
    np.testing.assert_allclose(angle, 0.5 * np.cos(10**0.5 * result.time), atol=5e-5)  # CVode keeps 1e-6 per step
    [compared] = imufmu.comparisons(result)
    assert compared.component == "plumb"
    assert compared.summary["tilt_rmse_deg"] < 0.5  # of plumb with an ideal IMU, from the first sample on
    assert ("heading_rmse_deg" in compared.summary) == (mapping is not None)


def test_a_local_variable_is_taken_where_the_user_names_it() -> None:
    system = System.connect(rocker("3_cs"), "ideal", ["plumb"], {"roll": "angle", "pitch": "small"})
    result = imufmu.simulate(system, stop_time=1.0, in_process=True)
    np.testing.assert_allclose(result["truth.roll"], result["plant.angle"], rtol=0, atol=1e-15)  # one rounding each way
    assert not [line for line in connect(rocker("3_cs")).found if "angle" in line]


def test_a_description_in_another_folder_finds_its_plant(tmp_path: Path) -> None:
    for name in ("a b", "c"):
        (tmp_path / name).mkdir()
    fmu = plant(tmp_path / "a b", RATES | FORCES)
    path = tmp_path / "c" / "my.ssd"
    path.write_bytes(connect(fmu).text(path.parent))
    assert read_description(path).components[0].source == fmu.resolve()
    assert str(tmp_path) not in path.read_text()  # the folders can be moved together


def test_a_packed_system_has_the_truth_with_it(tmp_path: Path) -> None:
    path = tmp_path / "my.ssd"
    path.write_bytes(connect(rocker("3_cs"), "ideal", mapping={"matrix": "dcm:to-body"}).text(tmp_path))
    imufmu.pack(path, tmp_path / "my.ssp")
    packed, plain = (imufmu.simulate(tmp_path / name, stop_time=1.0, in_process=True) for name in ("my.ssp", "my.ssd"))
    np.testing.assert_array_equal(packed["truth.q_NS"], plain["truth.q_NS"])
    assert packed.units["truth.yaw"] == "rad"


def test_an_estimator_that_does_not_tell_its_instants_is_named_and_not_taken_for_the_truth(
    rng: np.random.Generator,
) -> None:
    vertical = rng.uniform(0.1, 1.0, (3, 4))
    columns = {f"{c}.vertical[{i + 1}]": vertical[i] for c in ("truth", "plant", "mine", "plumb") for i in range(3)}
    columns["plumb.sample_time"] = np.arange(4.0)
    found, notes = compare_all(Result("s", np.arange(4.0), columns, dict.fromkeys(columns)))
    assert [one.component for one in found] == ["plumb"]
    assert notes == ["mine is not compared: it has no output sample_time, as an estimator needs"]
