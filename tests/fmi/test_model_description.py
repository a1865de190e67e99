"""Claims about modelDescription.xml and the archive of every registered block's FMU."""

from __future__ import annotations

import dataclasses
import re
import subprocess
import sys
import zipfile

import fmpy.validation
import numpy as np
import pytest
from lxml import etree

from imufmu.blocks.block import SampledBlock
from imufmu.blocks.signals import UNITS
from imufmu.fmi.build import BuildError, build_fmu, cached_fmu
from imufmu.fmi.model_description import guid, model_description
from imufmu.registry import BLOCKS
from support import fmu

NAMES = list(BLOCKS)


def xml(name: str):
    with zipfile.ZipFile(cached_fmu(name)) as archive:
        return etree.fromstring(archive.read("modelDescription.xml"))


@pytest.mark.parametrize("name", NAMES)
def test_fmpy_finds_nothing_to_complain_about(name):
    assert fmpy.validation.validate_fmu(str(cached_fmu(name))) == []


@pytest.mark.parametrize("name", NAMES)
def test_every_variable_says_unit_bounds_nominal_and_meaning(name):
    for variable in fmu.description(name).modelVariables:
        assert variable.description, variable.name
        if variable.type == "Real":
            assert variable.unit in UNITS, variable.name
            assert float(variable.nominal) > 0, variable.name
        if variable.type != "Boolean":
            assert float(variable.min) <= float(variable.max), variable.name
            if variable.start is not None:  # no checker looks at this
                assert float(variable.min) <= float(variable.start) <= float(variable.max), variable.name


@pytest.mark.parametrize("name", NAMES)
def test_angles_are_shown_in_degrees_and_units_have_si_base_units(name):
    root = xml(name)
    units = {unit.get("name"): unit for unit in root.iterfind("UnitDefinitions/Unit")}
    used = {real.get("unit") for real in root.iterfind("ModelVariables/ScalarVariable/Real")}
    assert set(units) == used
    for unit in units.values():
        # A half power, as in 1/sqrt(Hz), is the one thing FMI 2.0 base units cannot say.
        assert unit.find("BaseUnit") is not None or "sqrt" in unit.get("name")
    for real in root.iterfind("ModelVariables/ScalarVariable/Real"):
        if real.get("unit") == "rad":
            assert real.get("displayUnit") == "deg"
            assert float(units["rad"].find("DisplayUnit").get("factor")) == pytest.approx(np.rad2deg(1), rel=1e-15)


@pytest.mark.parametrize("name", NAMES)
def test_dependencies_are_those_that_changing_each_input_shows(name):
    """Each declared dependency may be weak, but no undeclared one may exist."""
    root = xml(name)
    listed = [variable.get("name") for variable in root.iterfind("ModelVariables/ScalarVariable")]
    rng = np.random.default_rng(5)
    for kind, stepping in (("Outputs", True), ("InitialUnknowns", False)):
        declared = {
            listed[int(unknown.get("index")) - 1]: {listed[int(i) - 1] for i in unknown.get("dependencies").split()}
            for unknown in root.iterfind(f"ModelStructure/{kind}/Unknown")
        }
        outputs = list(declared)
        inputs = [v.name for v in fmu.description(name).modelVariables if v.causality == "input"]
        instance = fmu.Fmu(name)
        if stepping:
            instance.initialise()
            instance.step(0.0, 0.1)
        else:
            instance.slave.setupExperiment(startTime=0.0)
            instance.slave.enterInitializationMode()
        instance.set({i: float(v) for i, v in zip(inputs, rng.uniform(0.5, 2.0, len(inputs)), strict=True)})
        before = instance.get(*outputs)
        for changed in inputs:
            (old,) = instance.get(changed)
            instance.set({changed: old + 0.3})
            moved = {o for o, a, b in zip(outputs, before, instance.get(*outputs), strict=True) if a != b}
            assert moved <= {o for o in outputs if changed in declared[o]}, (kind, changed)
            instance.set({changed: old})


@pytest.mark.parametrize("kind", fmu.KINDS)
@pytest.mark.parametrize("name", NAMES)
def test_outputs_of_sampled_blocks_declare_no_feed_through_and_native_ones_say_what_their_derivative_is_of(
    name: str, kind: str
) -> None:
    """Their outputs are held, which test_fmu_contract.py shows; a derivative that is not zero needs a word then."""
    with zipfile.ZipFile(fmu.path(name, kind)) as archive:
        root = etree.fromstring(archive.read("modelDescription.xml"))
        page = archive.read("documentation/index.html").decode()
    sampled = isinstance(BLOCKS[name], SampledBlock)
    dependencies = [unknown.get("dependencies") for unknown in root.iterfind("ModelStructure/Outputs/Unknown")]
    assert None not in dependencies  # nothing said would mean: on everything
    assert not sampled or set(dependencies) == {""}
    told = root.findtext("VendorAnnotations/Tool[@name='imufmu']/DirectionalDerivative", "")
    assert ("no feed-through" in told and "of the last sample" in told) == (sampled and kind == "native")
    assert ("no feed-through" in " ".join(page.split())) == (sampled and kind == "native")


@pytest.mark.parametrize("rate", [100, 120, 285, 3, 7, 1.0 / 3])
def test_the_default_step_is_written_so_that_it_reads_back_as_the_same_double(rate: float) -> None:
    """Nine digits of 1/120 s take 721 steps to 6 s, or 720, by how a host rounds."""
    block = dataclasses.replace(BLOCKS["lee2012"], period=1.0 / rate)
    experiment = model_description(block).find("DefaultExperiment")
    assert experiment is not None and float(experiment.get("stepSize", "")) == 1.0 / rate
    assert float(experiment.get("tolerance", "")) > 0


def test_outputs_of_sampled_blocks_are_discrete_and_those_of_plants_continuous():
    """A master tells from this whether a value belongs to the start or the end of a step."""
    for name, block in BLOCKS.items():
        found = {v.variability for v in fmu.description(name).modelVariables if v.causality == "output"}
        assert found == ({"discrete"} if isinstance(block, SampledBlock) else {"continuous"}), name


@pytest.mark.parametrize("name", NAMES)
def test_archive_holds_documentation_icon_sources_and_a_binary_of_its_name(name):
    with zipfile.ZipFile(cached_fmu(name)) as archive:
        members = set(archive.namelist())
        page = archive.read("documentation/index.html").decode()
        picture = archive.read("model.png")
    assert f"binaries/linux64/{name}.so" in members and f"binaries/win64/{name}.dll" in members
    assert f"resources/{name}_fmu.py" in members and "resources/imufmu/blocks/block.py" in members
    assert picture.startswith(b"\x89PNG")
    for parameter in BLOCKS[name].parameters:
        assert parameter.name in page and parameter.description.split(";")[0][:20] in page
    assert BLOCKS[name].reference.split(",")[0] in page


@pytest.mark.parametrize("name", NAMES)
def test_capabilities_are_declared(name):
    """States and several instances work (tests of the FMUs); interpolation and derivatives are not offered."""
    declared = xml(name).find("CoSimulation").attrib
    offered = ("canGetAndSetFMUstate", "canSerializeFMUstate", "canHandleVariableCommunicationStepSize")
    assert all(declared[capability] == "true" for capability in offered)
    refused = ("needsExecutionTool", "canBeInstantiatedOnlyOncePerProcess", "canInterpolateInputs")
    assert all(declared[capability] == "false" for capability in refused)


def test_the_same_source_gives_the_same_bytes(tmp_path):
    with zipfile.ZipFile(cached_fmu("lee2012")) as archive:
        assert {member.date_time for member in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}  # not that of the build
    first = build_fmu("lee2012", tmp_path / "one").read_bytes()
    assert build_fmu("lee2012", tmp_path / "two").read_bytes() == first
    assert sorted(path.name for path in (tmp_path / "one").iterdir()) == ["lee2012.fmu"]


def test_guid_follows_from_the_declaration_in_any_process():
    program = "from imufmu.fmi.model_description import guid; from imufmu.estimators import lee2012 as m"
    told = subprocess.run([sys.executable, "-c", f"{program}; print(guid(m.BLOCK))"], capture_output=True, text=True)
    assert told.stdout.strip() == guid(BLOCKS["lee2012"]) == fmu.description("lee2012").guid
    assert len({guid(block) for block in BLOCKS.values()}) == len(BLOCKS)


def test_an_unknown_block_and_a_folder_that_is_a_file_are_refused_by_name(tmp_path):
    with pytest.raises(BuildError, match=r"'lee2013'.*lee2012"):
        build_fmu("lee2013", tmp_path)
    (tmp_path / "file").write_text("")
    with pytest.raises(BuildError, match=re.escape(str(tmp_path / "file"))):
        build_fmu("lee2012", tmp_path / "file")
