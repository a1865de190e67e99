"""How an FMU steps and how it ends a run: what it is told of the time, what it is taken for, what its values may be."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import imufmu
from imufmu import DescriptionError, SimulationError, WiringError, replay
from imufmu.cosim.results import Result, read_hdf5
from imufmu.recordings.reading import read as read_recording
from support.cosim_stubs import edited_fmu, fake_fmu, recorded_calls, simulate, stub, variable, write_ssd

BOTH = pytest.mark.parametrize("in_process", [True, False], ids=["here", "apart"])


def faulty(folder: Path, fault: int, *wires: str, in_process: bool = True, **options: Any) -> Result:
    """A run of clock and a component that does something odd in the step from 0.5 s; its step is 0.25 s."""
    system = write_ssd(folder / "s.ssd", {"clock": stub("clock"), "faulty": stub("faulty")}, wires)
    return imufmu.simulate(system, parameters={"faulty.fault": fault}, in_process=in_process, **options)


def test_the_end_of_the_run_is_told_to_every_fmu(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calls = recorded_calls(monkeypatch)
    faulty(tmp_path, 0, stop_time=0.9)  # four steps of 0.25 s
    told = [arguments[-2:] for _, function, arguments in calls if function == "fmi2SetupExperiment"]
    assert told == [(1, 1.0)] * 2
    last = [arguments[1:3] for _, function, arguments in calls if function == "fmi2DoStep"][-1]
    assert sum(last) <= 1.0


@BOTH
def test_an_fmu_that_ends_the_run_ends_it_well(tmp_path: Path, in_process: bool) -> None:
    result = faulty(tmp_path, 2, in_process=in_process)
    assert result.time.tolist() == result["clock.y"].tolist() == [0, 0.25, 0.5]
    assert not result.partial
    assert "faulty ended the run at t = 0.5 s, step 0.25 s: out of fuel; 3 of 5 rows" in result.notes


def test_a_sampled_fmu_that_ends_the_run_leaves_the_row_before_its_sample(tmp_path: Path) -> None:
    result = faulty(tmp_path, 2, treat={"faulty": "sampled"})
    assert result.time.tolist() == result["clock.y"].tolist() == [0, 0.25, 0.5]


def test_a_replay_that_the_fmu_ends_keeps_its_rows(tmp_path: Path) -> None:
    rows = "\n".join(f"{0.25 * k},0,0,0,0,0,9.8" for k in range(9))
    (tmp_path / "a.csv").write_text("time,gyro[1],gyro[2],gyro[3],accel[1],accel[2],accel[3]\n" + rows)
    ended = replay(read_recording(tmp_path / "a.csv"), stub("finite"), in_process=True)
    assert ended.columns["y"].tolist() == [0, 0.25]
    assert ended.partial.startswith("2 of 9 rows: ") and "ended the run at t = 0.5 s" in ended.partial


@BOTH
def test_a_value_that_nobody_reads_may_be_no_number(tmp_path: Path, in_process: bool) -> None:
    result = faulty(tmp_path, 4, in_process=in_process)
    assert np.isnan(result["faulty.y"]).tolist() == [False, False, False, True, True]
    assert [note for note in result.notes if "nan" in note] == ["faulty: y = nan at t = 0.75 s; nothing is fed by it"]


@BOTH
def test_a_value_that_something_is_fed_by_must_be_one(tmp_path: Path, in_process: bool) -> None:
    with pytest.raises(SimulationError, match=r"^faulty\.y = nan at t = 0\.75 s") as caught:
        faulty(tmp_path, 4, "faulty.y -> clock.u", in_process=in_process)
    assert len(caught.value.result.time) == 3


def counted(folder: Path, marked: str = "", **options: Any) -> Result:
    """A run of a component whose outputs are all discrete, and advance with the time. marked: in the description."""

    fmu = edited_fmu(folder / "counter.fmu", stub("clock"), lambda text: text.replace(*DISCRETE))
    system = write_ssd(folder / "s.ssd", {"counter": fmu})
    if marked:
        annotation = f'<ssc:Annotation type="org.imufmu"><imufmu:Treat as="{marked}"/></ssc:Annotation>'
        text = system.read_text().replace(
            "</ssd:Component>", f"<ssd:Annotations>{annotation}</ssd:Annotations></ssd:Component>"
        )
        system.write_text(text)
    return simulate(system, **options)


# The Real output of the clock becomes discrete.
DISCRETE = (
    'name="y" valueReference="1" causality="output"',
    'name="y" valueReference="1" causality="output" variability="discrete"',
)


def test_discrete_outputs_alone_do_not_make_an_fmu_sampled_and_the_choice_is_told(tmp_path: Path) -> None:
    result = counted(tmp_path)
    assert result["counter.steps"].tolist() == [0, 1, 2, 3, 4]  # steps made by the time of the row
    (note,) = [note for note in result.notes if "treat" in note]
    assert note.startswith("counter: has discrete outputs and no sample_time; treated as continuous")
    assert note.endswith("--treat counter=sampled")


@pytest.mark.parametrize("way", ["call", "mark"])
def test_a_component_may_be_said_to_be_sampled(tmp_path: Path, way: str) -> None:
    result = counted(tmp_path, marked="sampled") if way == "mark" else counted(tmp_path, treat={"counter": "sampled"})
    assert result["counter.steps"].tolist() == [1, 2, 3, 4, 4]
    assert not [note for note in result.notes if "treat" in note]


def test_a_sampled_one_may_be_said_to_be_continuous(tmp_path: Path) -> None:
    system = write_ssd(tmp_path / "s.ssd", {n: stub(n) for n in ("clock", "sampler")}, ["clock.y -> sampler.u"])
    result = simulate(system, treat={"sampler": "continuous"})
    assert result["sampler.y"].tolist() == [-1, 0.25, 0.5, 0.75, 1.0]


def test_a_treatment_that_is_none_is_told(tmp_path: Path) -> None:
    with pytest.raises(WiringError) as caught:
        counted(tmp_path, treat={"counter": "gently", "clock": "sampled"})
    assert caught.value.problems == (
        "treat counter = gently: expected sampled or continuous",
        "treat clock: there is no such component; there is counter",
    )
    with pytest.raises(DescriptionError, match="as='gently': expected sampled or continuous"):
        counted(tmp_path, marked="gently")


def vector(name: str, first: int, causality: str = "output") -> list[str]:
    return [variable(f"{name}[{i}]", causality) for i in range(first, first + 3)]


def from_zero(result: Result) -> None:
    assert result["a.w"].tolist() == [[1.0, 2.0, 3.0]]
    assert "a.w" in result


def test_a_vector_from_0_is_one_in_results_and_files(tmp_path: Path) -> None:
    columns = {f"a.w[{i}]": np.array([float(i + 1)]) for i in range(3)}
    columns |= {f"a.m[{i},{j}]": np.array([10.0 * i + j]) for i in range(2) for j in range(2)}
    columns |= {f"a.late[{i}]": np.array([0.0]) for i in (2, 3)}  # no vector: its first elements are missing
    result = Result("s", np.array([0.0]), columns, dict.fromkeys(columns, "rad/s"))
    from_zero(result)
    assert result["a.m"].tolist() == [[[0.0, 1.0], [10.0, 11.0]]]
    assert "a.late" not in result
    result.to_hdf5(tmp_path / "r.h5")
    read = read_hdf5(tmp_path / "r.h5")
    from_zero(read)
    assert sorted(read.names) == sorted(columns)
    assert read.units["a.w[0]"] == "rad/s"


def test_a_truth_that_counts_from_0_is_compared() -> None:
    time = np.arange(4) * 0.25
    up = np.array([0.0, 0.0, 1.0])
    columns = {f"plant.vertical[{i}]": np.full(4, up[i]) for i in range(3)}
    columns |= {f"mine.vertical[{i + 1}]": np.full(4, up[i]) for i in range(3)} | {"mine.sample_time": time}
    (compared,) = imufmu.comparisons(Result("s", time, columns, dict.fromkeys(columns, "1")))
    assert compared.summary["tilt_rmse_deg"] < 1e-12  # nothing but what keeps the norm differentiable


def test_a_truth_in_degrees_is_compared_in_radians() -> None:
    time = np.arange(4) * 0.25
    columns = {f"{c}.vertical[{i + 1}]": np.full(4, float(i == 2)) for c in ("plant", "mine") for i in range(3)}
    columns |= {"plant.yaw": np.full(4, 90.0), "mine.yaw": np.full(4, math.pi / 2), "mine.sample_time": time}
    units: dict[str, str | None] = dict.fromkeys(columns, "1") | {"plant.yaw": "deg", "mine.yaw": "rad"}
    units["mine.sample_time"] = "s"
    (compared,) = imufmu.comparisons(Result("s", time, columns, units))
    assert compared.truth.values["yaw"].tolist() == [math.pi / 2] * 4
    assert np.abs(compared.errors["yaw"]).max() < 1e-12  # a rounding of pi / 2


def test_equal_indices_of_vectors_from_0_and_from_1_are_noted_as_shifted(tmp_path: Path) -> None:
    plant = fake_fmu(tmp_path / "plant.fmu", vector("w", 0))
    imu = fake_fmu(tmp_path / "imu.fmu", vector("gyro", 1, "input"))
    fmus = {"plant": plant, "imu": imu}
    shifted = ["plant.w[1] -> imu.gyro[1]", "plant.w[2] -> imu.gyro[2]"]
    notes = imufmu.System.read(write_ssd(tmp_path / "a.ssd", fmus, shifted)).notes
    told = "plant.w[1] -> imu.gyro[1]: plant.w counts from 0 and imu.gyro counts from 1: the axes are shifted by one"
    assert any(note.startswith(told) for note in notes)
    right = [f"plant.w[{i}] -> imu.gyro[{i + 1}]" for i in range(3)]
    assert not any("shifted" in note for note in imufmu.System.read(write_ssd(tmp_path / "b.ssd", fmus, right)).notes)


def test_values_of_a_vector_go_by_index_not_by_the_order_of_the_fmu(tmp_path: Path) -> None:
    fmu = fake_fmu(tmp_path / "a.fmu", [variable(f"v[{i}]", "parameter") for i in (2, 10, 0, 1)])
    system = imufmu.System.read(write_ssd(tmp_path / "a.ssd", {"a": fmu}))
    found = {s.variable.name: s.value for s in system.settings_with({"a.v": [1, 2, 3, 4]})}
    assert found == {"v[0]": 1, "v[1]": 2, "v[2]": 3, "v[10]": 4}


def test_infinity_is_no_number_either(tmp_path: Path) -> None:
    assert math.isinf(faulty(tmp_path, 7)["faulty.y"][-1])


def test_start_values_and_steps_that_are_no_numbers_hinder_nobody(tmp_path: Path) -> None:
    """They break the schema, which is noted; what an FMU does not say is as if it had not tried."""

    def damaged(text: str) -> str:
        text = text.replace("<ModelVariables>", '<DefaultExperiment stepSize="soon"/><ModelVariables>')
        return text.replace('name="u"', 'name="u" initial="exact"').replace('start="0', 'start="zero')

    fmu = edited_fmu(tmp_path / "clock.fmu", stub("clock"), damaged)
    system = write_ssd(tmp_path / "s.ssd", {"clock": fmu, "other": stub("clock")}, ["other.y -> clock.u"])
    result = simulate(system)
    assert result["clock.y"].tolist() == [0, 0.5, 1.0, 1.5, 2.0]
    assert any("zero" in note for note in result.notes)
