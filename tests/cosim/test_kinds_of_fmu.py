"""FMUs of FMI 3.0, and FMUs that bring equations without a solver, run in systems as those of FMI 2.0 do."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest

import imufmu
from imufmu import ArchiveError, Result, SimulationError, WiringError
from imufmu.files.csv_table import write_csv
from imufmu.fmi.archive import read_fmu
from support.cosim_stubs import stub, write_ssd, write_zip
from support.rocker import KINDS, rocker

W = 10**0.5  # rad/s, of the platform
H = 0.01  # s
# Co-simulation is solved in closed form by the FMU; CVode keeps 1e-6 per step, and 2 s are 200 of them.
CLOSE = {"3_cs": 1e-12, "3_me": 2e-5, "2_me": 2e-5}
EQUATIONS = [kind for kind in KINDS if kind.endswith("me")]

pytestmark = pytest.mark.filterwarnings("error")


def rocked(kind: str, folder: Path, *, in_process: bool = True, stop: float = 2.0, **parameters: object) -> Result:
    """A run of the platform alone."""
    system = write_ssd(folder / "rocker.ssd", {"plant": rocker(kind)}, step=H)
    given = {f"plant.{name}": value for name, value in parameters.items()}
    return imufmu.simulate(system, stop_time=stop, parameters=given, in_process=in_process, record=RECORDED[kind])


RECORDED = {kind: ["plant.angle", "plant.vertical", "plant.dcm", "plant.attitude", "plant.hits"] for kind in KINDS}
RECORDED["3_cs"] = [*RECORDED["3_cs"], *(f"plant.{name}" for name in ("small", "steps", "lifted"))]


@pytest.mark.parametrize("in_process", [True, False], ids=["here", "apart"])
@pytest.mark.parametrize("kind", KINDS)
def test_the_platform_swings_as_its_equation_says(kind: str, in_process: bool, tmp_path: Path) -> None:
    result = rocked(kind, tmp_path, in_process=in_process)
    angle = 0.5 * np.cos(W * result.time)
    assert len(result.time) == 201
    np.testing.assert_allclose(result["plant.angle"], angle, atol=CLOSE[kind])
    expected = np.column_stack([0 * angle, np.sin(angle), np.cos(angle)])
    np.testing.assert_allclose(result["plant.vertical"], expected, atol=CLOSE[kind])
    np.testing.assert_array_equal(result["plant.dcm"][:, :, 2], result["plant.vertical"])  # row by row
    assert result.units["plant.vertical[2]"] == "1"


@pytest.mark.parametrize("kind", KINDS)
def test_an_array_of_which_one_element_is_fed_keeps_the_others(kind: str, tmp_path: Path) -> None:
    components = {"plant": rocker(kind), "one": stub("adder")}  # 1 from the start on
    system = write_ssd(tmp_path / "fed.ssd", components, ["one.y -> plant.push[2]"], step=H)
    result = imufmu.simulate(
        system, stop_time=2.0, parameters={"plant.push[1]": 2.0}, record=["plant.angle"], in_process=True
    )
    rest = 3.0 / 10.0
    np.testing.assert_allclose(result["plant.angle"], rest + (0.5 - rest) * np.cos(W * result.time), atol=CLOSE[kind])


@pytest.mark.parametrize("kind", EQUATIONS)
def test_an_input_that_changes_is_an_event_for_the_solver(kind: str, tmp_path: Path) -> None:
    """The input is held over each step: the closed form of each is chained."""
    components = {"plant": rocker(kind), "ramp": stub("clock")}  # its output is the time
    system = write_ssd(tmp_path / "fed.ssd", components, ["ramp.y -> plant.push[1]"], step=0.1)
    result = imufmu.simulate(system, stop_time=2.0, record=["plant.angle", "ramp.y"], in_process=True)
    angle, rate, expected = 0.5, 0.0, [0.5]
    c, s = np.cos(W * 0.1), np.sin(W * 0.1)
    for push in result["ramp.y"][1:]:  # the ramp has moved on when the plant takes its input
        rest = push / 10.0
        angle, rate = rest + (angle - rest) * c + rate / W * s, rate * c - W * (angle - rest) * s
        expected.append(angle)
    np.testing.assert_allclose(result["plant.angle"], expected, atol=CLOSE[kind])


@pytest.mark.parametrize("kind", EQUATIONS)
def test_the_solver_stops_where_a_state_event_happens(kind: str, tmp_path: Path) -> None:
    """The platform bounces at its stops: the time between two hits is known."""
    result = rocked(kind, tmp_path, angle=0.0, rate=1.0, limit=0.2)
    first = np.arcsin(0.2 * W) / W
    hits = np.floor((result.time + first) / (2 * first)).astype(int)
    assert result["plant.hits"].tolist() == hits.tolist()
    assert hits[-1] == 5
    assert np.abs(result["plant.angle"]).max() <= 0.2 + CLOSE[kind]


@pytest.mark.parametrize("kind", EQUATIONS)
def test_the_solver_stops_at_a_time_that_the_fmu_names_between_two_steps(kind: str, tmp_path: Path) -> None:
    result = rocked(kind, tmp_path, kick_time=0.505)
    since = np.maximum(result.time - 0.505, 0.0)
    expected = 0.5 * np.cos(W * result.time) + np.sin(W * since) / W  # 1 rad/s more from then on
    np.testing.assert_allclose(result["plant.angle"], expected, atol=CLOSE[kind])


@pytest.mark.parametrize("kind", EQUATIONS)
@pytest.mark.parametrize("in_process", [True, False], ids=["here", "apart"])
def test_an_error_in_the_equations_is_told_with_call_and_time(kind: str, in_process: bool, tmp_path: Path) -> None:
    call = "fmi2GetDerivatives" if kind == "2_me" else "fmi3GetContinuousStateDerivatives"
    with pytest.raises(SimulationError, match=rf"^plant: {call} failed with status 3 \(error\) at t = 0 s"):
        rocked(kind, tmp_path, in_process=in_process, stiffness=99.0)


@pytest.mark.parametrize(
    ("stiffness", "fate"), [(98.0, r"crashed its process \(SIGABRT\)"), (97.0, "gave no answer within 1 s")]
)
@pytest.mark.parametrize("kind", EQUATIONS)
def test_equations_that_crash_or_hang_take_their_own_process(
    kind: str, stiffness: float, fate: str, tmp_path: Path
) -> None:
    system = write_ssd(tmp_path / "rocker.ssd", {"plant": rocker(kind)}, step=H)
    with pytest.raises(SimulationError, match=rf"^plant: integration of its equations {fate} at t = 0 s, step 0\.01 s"):
        imufmu.simulate(system, stop_time=2.0, parameters={"plant.stiffness": stiffness}, step_timeout=1.0)


@pytest.mark.parametrize("kind", EQUATIONS)
def test_equations_are_solved_as_well_at_any_epoch(kind: str, tmp_path: Path) -> None:
    """Today's time in seconds has a resolution of 2.4e-7 s, of which the solver must see nothing."""
    system = write_ssd(tmp_path / "rocker.ssd", {"plant": rocker(kind)}, step=H)
    at_0, today = (
        imufmu.simulate(system, start_time=start, stop_time=start + 2.0, record=["plant.angle"], in_process=True)
        for start in (0.0, 1.7e9)
    )
    np.testing.assert_array_equal(at_0["plant.angle"], today["plant.angle"])


def test_a_step_that_comes_back_early_is_no_step(tmp_path: Path) -> None:
    with pytest.raises(
        SimulationError, match=r"^plant: fmi3DoStep came back early at t = 0 s, step 0\.01 s, at t = 0\.01"
    ):
        rocked("3_cs", tmp_path, stiffness=96.0)


def test_an_estimator_of_fmi_3_takes_a_recording(tmp_path: Path) -> None:
    """Its arrays gyro and accel are fed; here by a platform whose outputs are renamed to inputs."""
    path = changed(
        tmp_path,
        *(
            (
                f'name="{old}" valueReference="{ref}" causality="output" variability="continuous"',
                f'name="{new}" valueReference="{ref}" causality="input" variability="continuous" start="0 0 0"',
            )
            for old, ref, new in (("angular_velocity", 12, "gyro"), ("specific_force", 15, "accel"))
        ),
        *((f'<Output valueReference="{ref}"/>', "") for ref in (12, 15)),
        *((f'<InitialUnknown valueReference="{ref}"/>', "") for ref in (12, 15)),
    )
    time = np.arange(50) * H
    write_csv(tmp_path / "walk.csv", {"time": time, "gyro": np.zeros((50, 3)), "accel": np.tile([0, 0, 9.8], (50, 1))})
    replayed = imufmu.replay(imufmu.read_recording(tmp_path / "walk.csv"), path, in_process=True)
    expected = np.sin(0.5 * np.cos(W * (time + H)))  # it is at the end of each step
    np.testing.assert_allclose(replayed.columns["vertical[2]"], expected, atol=CLOSE["3_cs"])


@pytest.mark.parametrize("in_process", [True, False], ids=["here", "apart"])
def test_numbers_of_every_type_arrive_as_they_are(in_process: bool, tmp_path: Path) -> None:
    result = rocked("3_cs", tmp_path, in_process=in_process, hits_before=-5, steps_before=250, label="frame 7")
    assert set(result["plant.hits"].tolist()) == {-5}
    assert result["plant.steps"].tolist() == [(250 + k) % 256 for k in range(201)]
    assert result["plant.steps"].dtype == np.int32
    assert result["plant.small"].tolist() == result["plant.angle"].astype(np.float32).astype(float).tolist()
    assert result["plant.lifted"].tolist() == (result["plant.angle"] > 0).astype(int).tolist()
    assert any("plant: frame 7" in note for note in result.notes)  # what the FMU logs as a warning
    still = rocked("3_cs", tmp_path, in_process=in_process, calm=True)
    assert set(still["plant.angle"]) == {0.5}


@pytest.mark.parametrize(
    ("parameter", "value", "message"),
    [
        ("steps_before", 300, r"^plant\.steps_before = 300: beyond what uint8 holds, 0 to 255"),
        ("hits_before", 2**70, r"^plant: hits_before = \d+: beyond -9223372036854775808 to"),
    ],
)
def test_a_whole_number_that_does_not_fit_is_refused(parameter: str, value: int, message: str, tmp_path: Path) -> None:
    with pytest.raises(SimulationError, match=message):
        rocked("3_cs", tmp_path, **{parameter: value})


@pytest.mark.parametrize("in_process", [True, False], ids=["here", "apart"])
def test_a_whole_number_of_more_than_32_bits_is_told_and_stops_a_run_only_where_it_feeds_something(
    in_process: bool, tmp_path: Path
) -> None:
    told = r"hits = 1099511627776: beyond what int32 holds, -2147483648 to 2147483647"
    result = rocked("3_cs", tmp_path, in_process=in_process, stop=0.1, hits_before=2**40)
    assert set(result["plant.hits"].tolist()) == {2**31 - 1}
    assert f"plant: {told}; recorded as the nearest of these" in result.notes
    components = {"plant": rocker("3_cs"), "end": stub("sampler")}
    system = write_ssd(tmp_path / "s.ssd", components, ["plant.hits -> end.n"], step=H)
    with pytest.raises(SimulationError, match=rf"^plant\.{told}"):
        imufmu.simulate(system, stop_time=0.1, parameters={"plant.hits_before": 2**40}, in_process=in_process)


def test_a_start_of_more_than_32_bits_is_no_fault(tmp_path: Path) -> None:
    old = '<Int64 name="hits" valueReference="100" causality="output"/>'
    path = changed(tmp_path, (old, old.replace("/>", ' initial="exact" start="9876543210"/>')))
    system = write_ssd(tmp_path / "s.ssd", {"plant": path}, step=H)
    assert imufmu.simulate(system, stop_time=0.1, in_process=True)["plant.hits"][-1] == 0


def test_what_carries_no_number_cannot_be_connected(tmp_path: Path) -> None:
    components = {"plant": rocker("3_cs"), "one": stub("adder")}
    system = write_ssd(tmp_path / "s.ssd", components, ["plant.picture -> one.u"], step=H)
    with pytest.raises(WiringError, match=r"plant\.picture -> one\.u: types differ: Binary and Real"):
        imufmu.System.read(system)


def changed(folder: Path, *replacements: tuple[str, str]) -> Path:
    """The FMU 3.0 for both kinds with text replaced in its model description."""
    with zipfile.ZipFile(rocker("3_cs")) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    xml = members["modelDescription.xml"].decode()
    for before, after in replacements:
        assert before in xml
        xml = xml.replace(before, after)
    return write_zip(folder / "changed.fmu", members | {"modelDescription.xml": xml})


@pytest.mark.parametrize(
    ("replacements", "message"),
    [
        (
            [("<ModelExchange", "<ScheduledExecution"), ('<CoSimulation modelIdentifier="rocker"/>', "")],
            "for scheduled execution only; expected co-simulation or model exchange. Export it for one of these",
        ),
        ([('fmiVersion="3.0"', 'fmiVersion="4.0"')], "FMI 4.0; expected FMI 2.0 or 3.0. Export it as one of these"),
        (
            [('modelIdentifier="rocker"', 'modelIdentifier="other"')],
            "no binary belongs to modelIdentifier 'other': expected other.so, there is rocker.so",
        ),
    ],
)
def test_what_cannot_run_is_refused_in_one_sentence(
    replacements: list[tuple[str, str]], message: str, tmp_path: Path
) -> None:
    with pytest.raises(ArchiveError) as raised:
        read_fmu(changed(tmp_path, *replacements))
    assert str(raised.value) == f"{tmp_path / 'changed.fmu'}: {message}"


def test_co_simulation_is_taken_where_an_fmu_offers_both(tmp_path: Path) -> None:
    """Its solver is exact, and it ends the run beyond the limit, where the equations bounce."""
    result = rocked("3_cs", tmp_path, limit=0.1)
    assert len(result.time) == 1 and not result.partial
    assert any(note.startswith("plant ended the run at t = 0 s, step 0.01 s") for note in result.notes)
