"""Reading and packing system descriptions."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path
from typing import Any

import pytest
from fmpy.ssp.ssd import read_ssd
from lxml import etree

from imufmu import ArchiveError, DescriptionError, System, WiringError, locate, pack
from imufmu.cosim import system as system_module
from imufmu.cosim.packing import PARAMETER_SET
from imufmu.cosim.ssp.files import NAMESPACES
from imufmu.registry import BLOCKS
from support.cosim_stubs import binding, fake_fmu, parameter_set, simulate, stub, variable, write_ssd, write_zip


@pytest.fixture
def ssd(tmp_path: Path) -> Path:
    """clock -> sampler with a parameter set beside the description, the FMUs in a folder with a space."""
    (tmp_path / "my fmus").mkdir()
    for name in ("clock", "sampler"):
        (tmp_path / "my fmus" / f"{name}.fmu").write_bytes(stub(name).read_bytes())
    (tmp_path / "set.ssv").write_text(parameter_set({"offset": ("Real", 10, None)}))
    return write_ssd(
        tmp_path / "system.ssd",
        {"clock": "my%20fmus/clock.fmu", "sampler": "my%20fmus/sampler.fmu"},
        ["clock.y -> sampler.u"],
        bindings={"clock": '<ssd:ParameterBinding source="set.ssv"/>'},
    )


def edited(ssd: Path, old: str, new: str) -> Path:
    text = ssd.read_text()
    assert old in text
    ssd.write_text(text.replace(old, new))
    return ssd


def test_sources_are_relative_to_the_description(ssd: Path) -> None:
    system = System.read(ssd)
    assert [part.fmu for part in system.parts] == [ssd.parent / "my fmus" / f"{n}.fmu" for n in ("clock", "sampler")]
    assert (system.description.step, system.description.stop_time, system.description.start_time) == (0.25, 1.0, None)
    assert simulate(system)["clock.y"][0] == 10


def test_a_packed_system_runs_like_the_original(ssd: Path) -> None:
    packed = pack(ssd, ssd.parent / "system.ssp")
    original, result = simulate(ssd), simulate(packed)
    assert result.names == original.names
    for name in original.names:
        assert result[name].tolist() == original[name].tolist()


def test_packing_twice_gives_the_same_bytes(ssd: Path) -> None:
    first, second = pack(ssd, ssd.parent / "a.ssp"), pack(ssd, ssd.parent / "b.ssp")
    assert first.read_bytes() == second.read_bytes()


def test_a_packed_system_is_plain_ssp_for_other_readers(ssd: Path) -> None:
    packed = pack(ssd, ssd.parent / "a.ssp")
    assert zipfile.ZipFile(packed).namelist() == [
        "SystemStructure.ssd",
        "resources/clock.fmu",
        "resources/sampler.fmu",
    ]
    other = read_ssd(packed, validate=True)
    assert [component.source for component in other.system.elements] == ["resources/clock.fmu", "resources/sampler.fmu"]
    assert other.system.elements[0].parameterBindings[0].parameterValues[0].parameters[0].value == "10.0"


def test_a_packed_system_has_one_parameter_set_for_each_component_that_has_values(tmp_path: Path) -> None:
    """Those of the component, then those of the system: tools differ in which of several sets they apply."""
    fake_fmu(tmp_path / "a.fmu", [variable("y", "output"), *(variable(n, "parameter") for n in "pqr")])
    own = binding({"p": ("Real", 1, None), "q": ("Real", 2, None)}) + binding({"q": ("Real", 3, None)})
    ssd = write_ssd(
        tmp_path / "a.ssd", {"a": "a.fmu", "b": "a.fmu"}, bindings={"a": own, "": binding({"a.r": ("Real", 4, None)})}
    )
    original, packed = System.read(ssd), System.read(pack(ssd, tmp_path / "a.ssp"))
    values = [(s.component, s.variable.name, s.value) for s in packed.settings]
    assert values == [(s.component, s.variable.name, s.value) for s in original.settings]
    assert values == [("a", "p", 1.0), ("a", "q", 3.0), ("a", "r", 4.0)]
    root = etree.fromstring(zipfile.ZipFile(tmp_path / "a.ssp").read("SystemStructure.ssd"))
    (one,) = root.iterfind(".//ssv:ParameterSet", NAMESPACES)
    assert one.get("name") == PARAMETER_SET


def omsimulator_steps(packed: Path) -> list[str]:
    """By its own path and prefix: it knows no namespaces."""
    text = zipfile.ZipFile(packed).read("SystemStructure.ssd").decode()
    (system,) = re.findall(r"<ssd:System .*</ssd:System>", text, re.DOTALL)
    return re.findall(
        r'<ssd:Annotations>\s*<ssc:Annotation type="org.openmodelica">\s*<oms:Annotations [^>]*>\s*'
        r'<oms:SimulationInformation>\s*<oms:FixedStepMaster description="oms-ma" stepSize="([^"]*)"',
        system,
    )


@pytest.mark.parametrize("step", ["0.25", "0.008333333333333333", "0.00001"])
def test_a_packed_system_tells_omsimulator_its_step_once(ssd: Path, step: str) -> None:
    """Without, its program does not load the system."""
    packed = pack(edited(ssd, 'stepSize="0.25"', f'stepSize="{step}"'), ssd.parent / "a.ssp")
    assert omsimulator_steps(packed) == [step]
    assert omsimulator_steps(pack(packed, ssd.parent / "b.ssp")) == [step]
    assert read_ssd(packed, validate=True).system.elements


def test_a_system_without_a_step_says_nothing_to_omsimulator(ssd: Path) -> None:
    assert omsimulator_steps(pack(edited(ssd, "imufmu:Communication", "imufmu:Other"), ssd.parent / "a.ssp")) == []


def test_fmus_of_the_same_name_are_packed_apart(tmp_path: Path) -> None:
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        fake_fmu(tmp_path / name / "same.fmu", [variable(name, "output")])
    ssd = write_ssd(tmp_path / "a.ssd", {name: f"{name}/same.fmu" for name in ("one", "two")})
    parts = System.read(pack(ssd, tmp_path / "a.ssp")).parts
    assert [part.fmu.name for part in parts] == ["same.fmu", "same_2.fmu"]
    assert [part.model.modelVariables[0].name for part in parts] == ["one", "two"]


def test_a_packed_system_can_be_packed_again(ssd: Path) -> None:
    packed = pack(ssd, ssd.parent / "a.ssp")
    assert pack(packed, ssd.parent / "b.ssp").read_bytes() == packed.read_bytes()


def test_packing_what_does_not_fit_leaves_the_old_file(ssd: Path) -> None:
    target = ssd.parent / "a.ssp"
    target.write_text("old")
    with pytest.raises(ValueError, match="does not fit"):
        pack(edited(ssd, 'endConnector="u"', 'endConnector="x"'), target)
    assert target.read_text() == "old"


def test_an_fmu_of_ours_that_is_not_there_is_built(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    built = fake_fmu(tmp_path / "elsewhere.fmu", [variable("y", "output")])
    asked: list[str] = []
    monkeypatch.setattr(system_module, "cached_fmu", lambda name: asked.append(name) or built)
    name = next(iter(BLOCKS))
    system = System.read(write_ssd(tmp_path / "a.ssd", {"a": f"resources/{name}.fmu"}))
    assert system.parts[0].fmu == built
    assert asked == [name]


def test_an_fmu_that_is_there_is_not_replaced_by_ours(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(system_module, "cached_fmu")
    own = fake_fmu(tmp_path / f"{next(iter(BLOCKS))}.fmu", [variable("mine", "output")])
    assert System.read(write_ssd(tmp_path / "a.ssd", {"a": own.name})).parts[0].fmu == own


DAMAGE: dict[str, tuple[str, str, str]] = {
    "missing FMU": ("clock.fmu", "nothing.fmu", r"component 'clock': there is no file .*nothing\.fmu, and no block"),
    "missing package": ("my%20fmus/clock.fmu", "nothing.ssp", r"nothing\.ssp: there is no such file"),
    "missing parameter set": ("set.ssv", "nothing.ssv", r"nothing\.ssv: cannot be read: No such file"),
    "source on the web": ("my%20fmus/clock.fmu", "http://example.invalid/clock.fmu", "expected a path relative"),
    "source in the document": ("my%20fmus/clock.fmu", "#other", "no system here has the id 'other'"),
    "no source": (' source="my%20fmus/clock.fmu"', "", "component 'clock' has no source: there is nothing to run"),
    "no FMU": ('name="clock" source', 'name="clock" type="text/csv" source', "is no FMU and no system, but text/csv"),
    "model exchange": (
        'name="clock" source',
        'name="clock" implementation="ModelExchange" source',
        "'clock': ModelExchange is asked for; its FMU is for co-simulation",
    ),
    "repeated name": ('Component name="sampler"', 'Component name="clock"', "the name occurs twice"),
    "binding of another type": ('source="set.ssv"', 'source="set.ssv" type="x"', "only parameter sets"),
    "binding inside an FMU": ('source="set.ssv"', 'source="set.ssv" sourceBase="component"', "no such file in .*clock"),
    "mapping": (
        'source="set.ssv"/>',
        'source="set.ssv"><ssd:ParameterMapping source="m.ssm"/></ssd:ParameterBinding>',
        r"m\.ssm: cannot be read: No such file",
    ),
    "step": ('stepSize="0.25"', 'stepSize="soon"', r"line \d+: stepSize='soon' is not a number"),
}


@pytest.mark.parametrize(("old", "new", "message"), DAMAGE.values(), ids=DAMAGE)
def test_what_cannot_be_used_is_refused_with_file_and_reason(ssd: Path, old: str, new: str, message: str) -> None:
    with pytest.raises((DescriptionError, ArchiveError), match=message) as caught:
        System.read(edited(ssd, old, new))
    assert str(ssd.parent) in str(caught.value)


@pytest.mark.parametrize(
    ("name", "old", "new", "message"),
    [
        ("system.ssd", "<ssd:Sys", "<!DOCTYPE a><ssd:Sys", r"system\.ssd, line 1: a DOCTYPE is not allowed"),
        (
            "set.ssv",
            "<ssv:ParameterSet",
            "<!DOCTYPE a><ssv:ParameterSet",
            r"set\.ssv, line 1: a DOCTYPE is not allowed",
        ),
        ("system.ssd", "</ssd:System>", "", r"system\.ssd, line \d+: not well-formed XML: mismatched tag"),
    ],
)
def test_unsafe_or_broken_xml_is_refused(ssd: Path, name: str, old: str, new: str, message: str) -> None:
    path = ssd.parent / name
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(ArchiveError, match=message):
        System.read(ssd)


def test_an_inline_parameter_set_follows_its_schema_too(ssd: Path) -> None:
    edited(ssd, '<ssd:ParameterBinding source="set.ssv"/>', binding({"offset": ("Real", "much", None)}))
    with pytest.raises(WiringError, match=r"line \d+: clock\.offset = much: expected a value of type Real"):
        System.read(ssd)


@pytest.mark.parametrize("name", ["nothing.ssd", "nothing.ssp"])
def test_a_missing_file_is_told(tmp_path: Path, name: str) -> None:
    with pytest.raises(ValueError, match=rf"{name}: (cannot be read: No such|there is no such)"):
        System.read(tmp_path / name)


def test_an_archive_without_description_is_no_ssp(tmp_path: Path) -> None:
    with pytest.raises(ArchiveError, match=r"a\.ssp: SystemStructure\.ssd is missing"):
        System.read(write_zip(tmp_path / "a.ssp", {"a.txt": ""}))


def test_sources_of_a_packed_system_must_not_leave_it(tmp_path: Path) -> None:
    outside = fake_fmu(tmp_path / "outside.fmu", [variable("y", "output")])
    for source in (f"../{outside.name}", str(outside)):
        text = write_ssd(tmp_path / "a.ssd", {"a": source}).read_text()
        with pytest.raises(DescriptionError, match="leaves the archive"):
            System.read(write_zip(tmp_path / "a.ssp", {"SystemStructure.ssd": text}))


def test_messages_about_a_packed_system_name_the_archive(tmp_path: Path) -> None:
    text = write_ssd(tmp_path / "a.ssd", {"a": "resources/none.fmu"}).read_text()
    archive = write_zip(tmp_path / "a.ssp", {"SystemStructure.ssd": text})
    with pytest.raises(DescriptionError) as caught:
        System.read(archive)
    assert str(caught.value).startswith(f"{archive}: SystemStructure.ssd, line 5: component 'a'")


def test_systems_are_found_by_name_or_path(tmp_path: Path) -> None:
    assert locate("pendulum_lee2012").name == "pendulum_lee2012.ssd"
    assert locate(tmp_path / "a.ssp") == tmp_path / "a.ssp"
    with pytest.raises(ValueError, match=r"no system is called 'pendulm'; .*pendulum_lee2012"):
        locate("pendulm")


def test_description_options_are_all_optional(tmp_path: Path) -> None:
    described: Any = System.read(write_ssd(tmp_path / "a.ssd", {"a": stub("clock")}, stop=None, step=None)).description
    assert (described.start_time, described.stop_time, described.step) == (None, None, None)


def test_a_system_of_imufmu_is_read_by_its_name_as_it_is_simulated() -> None:
    assert System.read("pendulum_lee2012").path == locate("pendulum_lee2012").resolve()
    with pytest.raises(ValueError, match=r"no system is called 'pendulum_lee2021'; .*did you mean pendulum_lee2012"):
        System.read("pendulum_lee2021")


def test_a_parameter_that_is_text_takes_what_was_typed(tmp_path: Path) -> None:
    """Also text that looks like a number; of a parameter set, which has types, the type must fit."""
    fmu = fake_fmu(tmp_path / "a.fmu", [variable("y", "output"), variable("file", "parameter", "String", start="none")])
    system = System.read(write_ssd(tmp_path / "s.ssd", {"a": fmu}))
    for given, value in (("log.txt", "log.txt"), (12, "12"), ("007", "007")):
        assert [s.value for s in system.settings_with({"a.file": given})] == [value]
    bindings = {"a": binding({"file": ("Real", 12, None)})}
    with pytest.raises(WiringError, match=r"a\.file = 12: expected a value of type String"):
        System.read(write_ssd(tmp_path / "typed.ssd", {"a": fmu}, bindings=bindings))
