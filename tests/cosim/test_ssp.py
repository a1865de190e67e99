"""System descriptions as other tools write them: nested, mapped, transformed, of SSP 2.0, and with formal faults."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from imufmu import ArchiveError, DescriptionError, System, WiringError, pack
from imufmu.cosim.ssp.files import NAMESPACES
from support.cosim_stubs import binding, fake_fmu, parameter_set, simulate, stub, variable, write_zip

HEAD = " ".join(f'xmlns:{prefix}="{uri}"' for prefix, uri in NAMESPACES.items())


def connector(name: str, kind: str, inner: str = "") -> str:
    return f'<ssd:Connector name="{name}" kind="{kind}">{inner}</ssd:Connector>'


def wire(start: str, end: str, inner: str = "", attributes: str = "") -> str:
    """A connection between element.connector and element.connector; without an element, of the system around it."""

    def side(name: str, text: str) -> str:
        element, _, own = text.rpartition(".")
        return (f'{name}Element="{element}" ' if element else "") + f'{name}Connector="{own}"'

    return f"<ssd:Connection {side('start', start)} {side('end', end)} {attributes}>{inner}</ssd:Connection>"


def component(name: str, source: Any, connectors: Sequence[str] = (), bindings: str = "", attributes: str = "") -> str:
    inner = f"<ssd:Connectors>{''.join(connectors)}</ssd:Connectors>" if connectors else ""
    inner += f"<ssd:ParameterBindings>{bindings}</ssd:ParameterBindings>" if bindings else ""
    return f'<ssd:Component name="{name}" source="{source}" {attributes}>{inner}</ssd:Component>'


def system(
    name: str,
    elements: Sequence[str],
    wires: Sequence[str] = (),
    connectors: Sequence[str] = (),
    bindings: str = "",
    dictionaries: str = "",
    attributes: str = "",
) -> str:
    inner = f"<ssd:Connectors>{''.join(connectors)}</ssd:Connectors>" if connectors else ""
    inner += f"<ssd:ParameterBindings>{bindings}</ssd:ParameterBindings>" if bindings else ""
    inner += f"<ssd:Elements>{''.join(elements)}</ssd:Elements>"
    inner += f"<ssd:Connections>{''.join(wires)}</ssd:Connections>" if wires else ""
    inner += f"<ssd:SignalDictionaries>{dictionaries}</ssd:SignalDictionaries>" if dictionaries else ""
    return f'<ssd:System name="{name}" {attributes}>{inner}</ssd:System>'


def write(path: Path, whole: str, *, version: str = "1.0", after: str = "", experiment: str = "") -> Path:
    """A description whose System is given; it runs from 0 to 1 s in steps of 0.25 s."""
    step = '<ssc:Annotation type="org.imufmu"><imufmu:Communication stepSize="0.25"/></ssc:Annotation>'
    path.write_text(
        f'<ssd:SystemStructureDescription {HEAD} version="{version}" name="test">{whole}{after}'
        f'<ssd:DefaultExperiment stopTime="1"><ssd:Annotations>{experiment or step}</ssd:Annotations>'
        "</ssd:DefaultExperiment></ssd:SystemStructureDescription>"
    )
    return path


CLOCK = component("clock", stub("clock"), [connector("y", "output"), connector("offset", "parameter")])
LATE = binding({"offset": ("Real", 9, None)})
DOUBLE, TRIPLE = (f'<ssc:LinearTransformation factor="{factor}" offset="1"/>' for factor in (2, 3))


def nested(folder: Path, **options: Any) -> Path:
    """clock -> (down a level) -> adder -> (up) -> sampler, transformed on the way."""
    inner = system(
        "middle",
        [component("adder", stub("adder"), [connector("u", "input"), connector("y", "output")])],
        [wire("into", "adder.u", TRIPLE), wire("adder.y", "out")],
        [connector("into", "input"), connector("out", "output")],
    )
    sampler = component("sampler", stub("sampler"), [connector("u", "input")])
    wires = [wire("clock.y", "middle.into", DOUBLE), wire("sampler.u", "middle.out")]  # the order says nothing
    return write(folder / "nested.ssd", system("whole", [CLOCK, inner, sampler], wires, **options))


def test_a_nested_system_runs_with_what_its_connectors_do_on_the_way(tmp_path: Path) -> None:
    read = System.read(nested(tmp_path))
    assert [part.name for part in read.parts] == ["clock", "middle.adder", "sampler"]
    assert [str(link) for link in read.links] == ["clock.y -> middle.adder.u", "middle.adder.y -> sampler.u"]
    result = simulate(read)
    # y = t + 0 inside the clock; 3 (2 t + 1) + 1 reaches the adder, which adds 1.
    assert result["sampler.y"][:-1].tolist() == [6 * t + 5 for t in (0, 0.25, 0.5, 0.75)]
    assert "middle.adder.y" in result.names


def test_a_packed_nested_system_runs_like_the_original(tmp_path: Path) -> None:
    source = nested(tmp_path, bindings=binding({"clock.offset": ("Real", 10, None)}))
    packed = pack(source, tmp_path / "a.ssp")
    assert simulate(packed)["sampler.y"].tolist() == simulate(source)["sampler.y"].tolist()
    assert simulate(packed)["clock.y"][0] == 10


def test_names_of_nested_components_work_in_arguments_records_and_files(tmp_path: Path) -> None:
    result = simulate(nested(tmp_path), parameters={"middle.adder.u": 4, "clock.offset": 1}, record=["middle.adder.y"])
    assert result.names == ["middle.adder.y"]
    result.to_hdf5(tmp_path / "r.h5")
    from imufmu import read_hdf5

    assert read_hdf5(tmp_path / "r.h5").names == ["middle.adder.y"]


def offsets(path: Path, **given: Any) -> dict[str, Any]:
    read = System.read(path)
    found = read.settings_with({name.replace("__", "."): value for name, value in given.items()})
    return {f"{s.component}.{s.variable.name}": s.value for s in found}


def test_a_parameter_of_the_system_reaches_the_fmu_that_it_is_connected_to(tmp_path: Path) -> None:
    inner = system("inner", [CLOCK], [wire("shift", "clock.offset", DOUBLE)], [connector("shift", "parameter")])
    bound = binding({"height": ("Real", 5, None)})
    whole = system("w", [inner], [wire("height", "inner.shift", DOUBLE)], [connector("height", "parameter")], bound)
    path = write(tmp_path / "a.ssd", whole)
    assert offsets(path) == {"inner.clock.offset": 23.0}  # 2 (2 5 + 1) + 1
    assert offsets(path, height=1) == {"inner.clock.offset": 7.0}
    assert simulate(path)["inner.clock.y"][0] == 23.0
    idle = write(tmp_path / "c.ssd", system("w", [CLOCK], connectors=[connector("height", "parameter")]))
    with pytest.raises(WiringError, match="height = 1: nothing is connected to it"):
        offsets(idle, height=1)
    unbound = write(tmp_path / "b.ssd", whole.replace(bound, ""))
    assert "nothing gives height a value: inner.clock.offset keeps its start value" in System.read(unbound).notes


def test_values_of_a_system_go_before_those_inside_it_and_later_before_earlier_ones(tmp_path: Path) -> None:
    def value(name: str, number: float) -> str:
        return binding({name: ("Real", number, None)})

    clocks = [component(n, stub("clock"), bindings=value("offset", 1)) for n in "abc"]
    inner = system("inner", clocks, bindings=value("b.offset", 2) + value("b.offset", 3) + value("c.offset", 3))
    path = write(tmp_path / "a.ssd", system("w", [inner], bindings=value("inner.c.offset", 4)))
    assert offsets(path) == {"inner.a.offset": 1, "inner.b.offset": 3, "inner.c.offset": 4}


MAPPING = (
    '<ssm:ParameterMapping version="1.0">'
    '<ssm:MappingEntry source="s.shift" target="clock.offset"><ssc:LinearTransformation factor="4" offset="5"/>'
    "</ssm:MappingEntry>"
    '<ssm:MappingEntry source="s.count" target="clock.start_steps"><ssc:IntegerMappingTransformation>'
    '<ssc:MapEntry source="1" target="70"/></ssc:IntegerMappingTransformation></ssm:MappingEntry>'
    "</ssm:ParameterMapping>"
)


@pytest.mark.parametrize("external", [False, True])
def test_a_parameter_mapping_renames_and_transforms_and_leaves_the_rest_out(tmp_path: Path, external: bool) -> None:
    given = {"shift": ("Real", 2, None), "count": ("Integer", 1, None), "clock.offset": ("Real", 9, None)}
    values = f"<ssd:ParameterValues>{parameter_set(given)}</ssd:ParameterValues>"
    (tmp_path / "m.ssm").write_text(MAPPING.replace(" version", f" {HEAD} version", 1))
    mapping = (
        '<ssd:ParameterMapping source="m.ssm"/>'
        if external
        else f"<ssd:ParameterMapping>{MAPPING}</ssd:ParameterMapping>"
    )
    bound = f'<ssd:ParameterBinding prefix="s.">{values}{mapping}</ssd:ParameterBinding>'
    path = write(tmp_path / "a.ssd", system("w", [CLOCK], bindings=bound))
    assert offsets(path) == {"clock.offset": 13.0, "clock.start_steps": 70}
    lost = write(tmp_path / "b.ssd", system("w", [CLOCK], bindings=bound.replace('name="count"', 'name="amount"')))
    noted(lost, "no value is called s.count, which is to be mapped")
    assert not [note for note in System.read(path).notes if "standard" in note]


def table(kind: str, *entries: tuple[str, str]) -> str:
    inner = "".join(f'<ssc:MapEntry source="{a}" target="{b}"/>' for a, b in entries)
    return f"<ssc:{kind}MappingTransformation>{inner}</ssc:{kind}MappingTransformation>"


def test_tables_of_whole_numbers_and_truth_values_change_what_a_connection_carries(tmp_path: Path) -> None:
    clock = component("clock", stub("clock"), [connector("steps", "output"), connector("even", "output")])
    sampler = component("sampler", stub("sampler"), [connector("n", "input"), connector("b", "input")])
    wires = [
        wire("clock.steps", "sampler.n", table("Integer", ("1", "100"), ("3", "-3"))),
        wire("clock.even", "sampler.b", table("Boolean", ("true", "false"), ("0", "1"))),
    ]
    result = simulate(write(tmp_path / "a.ssd", system("w", [clock, sampler], wires)))
    assert result["clock.steps"][:-1].tolist() == [0, 1, 2, 3]
    assert result["sampler.m"][:-1].tolist() == [0, 100, 2, -3]
    assert result["sampler.c"][:-1].tolist() == [0, 1, 0, 1]


GEARS = (
    '<TypeDefinitions><SimpleType name="Gear"><Enumeration><Item name="reverse" value="-1"/>'
    '<Item name="park" value="0"/><Item name="drive" value="7"/></Enumeration></SimpleType></TypeDefinitions>'
)


def geared(folder: Path) -> Path:
    shown = '<ScalarVariable name="gear" valueReference="REF" causality="{}" variability="{}">'
    shown += '<Enumeration declaredType="Gear" {}/></ScalarVariable>'
    variables = [
        shown.format("output", "discrete", ""),
        shown.format("parameter", "fixed", 'start="0"').replace('"gear"', '"first"'),
        shown.format("input", "discrete", 'start="0"').replace('"gear"', '"asked"'),
    ]
    return fake_fmu(folder / "car.fmu", variables, types=GEARS)


def test_enumerations_are_given_and_mapped_by_the_names_of_their_items(tmp_path: Path) -> None:
    car = geared(tmp_path)
    bound = binding({"first": ("Enumeration", "drive", None)})
    elements = [component("a", car, [connector("gear", "output")], bound), component("b", car)]
    wires = [wire("a.gear", "b.asked", table("Enumeration", ("drive", "reverse")))]
    path = write(tmp_path / "a.ssd", system("w", elements, wires))
    read = System.read(path)
    assert offsets(path) == {"a.first": 7}
    assert offsets(path, a__first="reverse") == {"a.first": -1}
    assert read.links[0].table == {7: -1}
    with pytest.raises(WiringError, match=r"b\.first = fly: expected a value of type Enumeration"):
        read.settings_with({"b.first": "fly"})
    wrong = binding({"first": ("Enumeration", "fly", None)})
    with pytest.raises(WiringError, match="first has no item 'fly'; its items are reverse, park, drive"):
        System.read(write(tmp_path / "b.ssd", system("w", [component("a", car, bindings=wrong)])))


DICTIONARY = (
    '<ssb:SignalDictionary version="1.0"><ssb:DictionaryEntry name="t"><ssc:Real/></ssb:DictionaryEntry>'
    "</ssb:SignalDictionary>"
)


@pytest.mark.parametrize("external", [False, True])
def test_a_signal_dictionary_carries_values_across_levels(tmp_path: Path, external: bool) -> None:
    def reference(name: str, kind: str) -> str:
        return (
            f'<ssd:SignalDictionaryReference name="{name}" dictionary="bus"><ssd:Connectors>{connector("t", kind)}'
            "</ssd:Connectors></ssd:SignalDictionaryReference>"
        )

    sampler = component("sampler", stub("sampler"), [connector("u", "input")])
    inner = system("inner", [sampler, reference("below", "inout")], [wire("below.t", "sampler.u", DOUBLE)])
    whole = [CLOCK, reference("above", "inout"), inner]
    (tmp_path / "bus.ssb").write_text(DICTIONARY.replace(" version", f" {HEAD} version", 1))
    inside = ' source="bus.ssb"/>' if external else f">{DICTIONARY}</ssd:SignalDictionary>"
    path = write(
        tmp_path / "a.ssd",
        system("w", whole, [wire("above.t", "clock.y")], dictionaries=f'<ssd:SignalDictionary name="bus"{inside}'),
    )
    assert [str(link) for link in System.read(path).links] == ["clock.y -> inner.sampler.u"]
    assert simulate(path)["inner.sampler.y"][:-1].tolist() == [1.0, 1.5, 2.0, 2.5]
    assert simulate(pack(path, tmp_path / "a.ssp"))["inner.sampler.y"][1] == 1.5
    lost = path.read_text().replace('dictionary="bus"', 'dictionary="train"')
    path.write_text(lost)
    with pytest.raises(DescriptionError, match="there is no signal dictionary 'train'; there is bus"):
        System.read(path)


def test_a_system_may_stand_in_a_file_of_its_own_or_be_used_twice(tmp_path: Path) -> None:
    inner = system("inner", [CLOCK], [wire("clock.y", "out")], [connector("out", "output")], attributes='id="twice"')
    write(tmp_path / "inner.ssd", inner)
    sampler = component("sampler", stub("sampler"), [connector("u", "input")])
    bound = binding({"clock.offset": ("Real", 5, None)})
    for source, kind in (("inner.ssd", 'type="application/x-ssp-definition"'), ("#twice", "")):
        elements = [component("part", source, bindings=bound, attributes=kind), sampler, inner]
        path = write(tmp_path / "a.ssd", system("w", elements, [wire("part.out", "sampler.u")]))
        assert simulate(path)["sampler.y"][0] == 5.0
        with pytest.raises(DescriptionError, match="part refers to another system; put that in its place to pack it"):
            pack(path, tmp_path / "a.ssp")


def test_an_archive_may_be_a_component_and_hold_several_descriptions(tmp_path: Path) -> None:
    inner = system("inner", [component("clock", "clock.fmu", [connector("y", "output")])])
    late = inner.replace("</ssd:Component>", f"<ssd:ParameterBindings>{LATE}</ssd:ParameterBindings></ssd:Component>")
    descriptions = {
        "SystemStructure.ssd": write(tmp_path / "one.ssd", inner).read_text(),
        "late.ssd": write(tmp_path / "two.ssd", late).read_text(),
    }
    write_zip(tmp_path / "a.ssp", {**descriptions, "clock.fmu": stub("clock").read_bytes()})
    elements = [component("early", "a.ssp"), component("late", "a.ssp#late.ssd")]
    result = simulate(write(tmp_path / "a.ssd", system("w", elements)))
    assert (result["early.clock.y"][0], result["late.clock.y"][0]) == (0.0, 9.0)
    assert simulate(System.read(tmp_path / "a.ssp#late.ssd"))["clock.y"][0] == 9.0
    missing = write(tmp_path / "b.ssd", system("w", [component("none", "a.ssp#../one.ssd")]))
    with pytest.raises(ArchiveError, match=r"a\.ssp: \.\./one\.ssd is missing"):
        System.read(missing)


def test_descriptions_that_hold_each_other_are_refused(tmp_path: Path) -> None:
    write(tmp_path / "a.ssd", system("w", [component("again", "a.ssd")]))
    with pytest.raises(DescriptionError, match="systems inside systems without an end"):
        System.read(tmp_path / "a.ssd")


@pytest.mark.parametrize(
    "source", ["fmus\\clock.fmu", "fmus/clock.fmu", "file:fmus/clock.fmu", "file://{}/fmus/clock.fmu"]
)
def test_sources_are_found_as_others_write_them(tmp_path: Path, source: str) -> None:
    (tmp_path / "fmus").mkdir()
    (tmp_path / "fmus" / "clock.fmu").write_bytes(stub("clock").read_bytes())
    path = write(tmp_path / "a.ssd", system("w", [component("clock", source.format(tmp_path))]))
    read = System.read(path)
    assert read.parts[0].fmu == tmp_path / "fmus" / "clock.fmu"
    assert any("backslashes are no URI; write 'fmus/clock.fmu'" in note for note in read.notes) == ("\\" in source)
    path.write_text(path.read_text().replace(source.format(tmp_path), "proxyfmu://localhost?file=fmus/clock.fmu"))
    assert System.read(path).parts[0].fmu.name == "clock.fmu"


def noted(path: Path, fragment: str) -> System:
    """The system, in which this is noted as against the standard, and refused where that is asked for."""
    read = System.read(path)
    assert any(note.startswith("not as the standard has it") and fragment in note for note in read.notes), read.notes
    with pytest.raises(WiringError) as caught:
        System.read(path, strict=True)
    assert any(fragment in problem for problem in caught.value.problems)
    return read


PAIR = [CLOCK, component("sampler", stub("sampler"), [connector("u", "input")])]
PLAIN = system("w", PAIR, [wire("clock.y", "sampler.u")])


def test_a_description_of_ssp_2_runs(tmp_path: Path) -> None:
    modern = PLAIN.replace(connector("y", "output"), connector("y", "output", "<ssc:Float64/>"))
    read = System.read(write(tmp_path / "a.ssd", modern, version="2.0"), strict=True)
    assert simulate(read)["sampler.y"][1] == 0.25
    noted(write(tmp_path / "b.ssd", modern), "Float64 came with SSP 2.0; the file says 1.0")
    noted(write(tmp_path / "c.ssd", PLAIN, version="3.0"), "version '3.0' of SSP is not known; read as 1.0")


def test_what_ssp_2_adds_and_we_lack_is_named(tmp_path: Path) -> None:
    clocked = connector("y", "output", "<ssc:Real/><ssd:Clock name='tick'/>")
    described = PLAIN.replace(connector("y", "output"), clocked)
    told = "SSP 2.0, not supported and left out: Clock of 'y': a clock"
    noted(write(tmp_path / "a.ssd", described, version="2.0"), told)


def test_values_of_arrays_of_ssp_2_go_to_the_elements_of_a_vector(tmp_path: Path) -> None:
    fmu = fake_fmu(tmp_path / "a.fmu", [variable(f"v[{i}]", "parameter") for i in (1, 2, 3)])
    bound = binding({"v": ("Float64", "1 2 3", None)}).replace('version="1.0"', 'version="2.0"')
    path = write(tmp_path / "a.ssd", system("w", [component("a", fmu, bindings=bound)]), version="2.0")
    assert offsets(path) == {"a.v[1]": 1, "a.v[2]": 2, "a.v[3]": 3}


def test_other_prefixes_are_as_good_and_an_undeclared_one_is_noted(tmp_path: Path) -> None:
    path = write(tmp_path / "a.ssd", PLAIN)
    text = path.read_text()
    path.write_text(text.replace("ssd:", "q:").replace(":ssd=", ":q=").replace("ssc:", "r:").replace(":ssc=", ":r="))
    assert simulate(System.read(path, strict=True))["sampler.y"][1] == 0.25
    path.write_text(text.replace("<ssd:", "<").replace("</ssd:", "</").replace(":ssd=", "="))
    assert System.read(path, strict=True).links
    path.write_text(text.replace(f'xmlns:ssd="{NAMESPACES["ssd"]}"', ""))
    assert noted(path, "the prefix ssd is not declared (xmlns)").links
    path.write_text(text.replace(NAMESPACES["ssd"], "http://example.invalid/ssd"))
    assert noted(path, "the namespace of SystemStructureDescription is not").links
    path.write_text(text.replace("http://ssp-standard.org/SSP1/SystemStructure", "urn:draft:SystemStructure"))
    assert noted(path, "the namespace of Annotation is not").links
    path.write_text(text.replace("</ssd:Connections>", "</ssd:Connections><oms:Hint/>"))
    assert noted(path, "the prefix oms is not declared (xmlns)").links


def test_what_breaks_the_schema_and_is_clear_runs_with_a_note(tmp_path: Path) -> None:
    path = write(tmp_path / "a.ssd", PLAIN.replace('<ssd:Connector name="u"', '<ssd:Connector type="Real" name="u"'))
    assert noted(path, "The attribute 'type' is not allowed").links


def test_the_step_that_another_tool_wrote_is_taken(tmp_path: Path) -> None:
    others = {
        "com.opensimulationplatform": ('<o:FixedStepAlgorithm baseStepSize="1e-3"/>', 1e-3),
        "org.openmodelica": ('<o:FixedStepMaster stepSize="2e-3"/>', 2e-3),
    }
    for kind, (inner, step) in others.items():
        annotation = f'<ssc:Annotation type="{kind}"><o:A xmlns:o="urn:o">{inner}</o:A></ssc:Annotation>'
        assert System.read(write(tmp_path / "a.ssd", PLAIN, experiment=annotation)).description.step == step


def test_a_system_of_connectors_alone_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "a.ssd", system("w", [system("inner", [])]).replace("<ssd:Elements></ssd:Elements>", ""))
    with pytest.raises(DescriptionError, match="the system has no components, so there is nothing to run"):
        System.read(path)


def test_both_ends_that_only_give_are_refused(tmp_path: Path) -> None:
    inner = system("inner", [CLOCK], [wire("clock.y", "out")], [connector("out", "output")])
    path = write(tmp_path / "a.ssd", system("w", [CLOCK, inner], [wire("clock.y", "inner.out")]))
    with pytest.raises(WiringError, match=r"inner\.out cannot be an input here; see the kinds of the connectors"):
        System.read(path)


def test_many_values_cost_one_look_each(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each variable is asked once whether it can be set, however many values there are."""
    from imufmu.cosim import settings

    fmu = fake_fmu(tmp_path / "a.fmu", [variable(f"p{i}", "parameter") for i in range(200)])
    values = binding(
        {f"p{i}": ("Real", i, None) for i in range(150)} | {"q": ("Real", 1, None), "r": ("Real", 1, None)}
    )
    asked: list[str] = []
    plain = settings._is_settable
    monkeypatch.setattr(settings, "_is_settable", lambda v: asked.append(v.name) or plain(v))
    read = System.read(write(tmp_path / "a.ssd", system("w", [component("a", fmu, bindings=values)])))
    assert len(read.settings) == 150
    assert len(asked) <= 2 * 200  # once for the values, once for the names near the first that is unknown
