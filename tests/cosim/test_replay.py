"""Claims about replaying recordings through estimator FMUs."""

from __future__ import annotations

import csv
import zipfile
from pathlib import Path

import numpy as np
import pytest

from imufmu import SimulationError, WiringError
from imufmu.compiled.running import run
from imufmu.cosim.replay import estimator_fmu, replay
from imufmu.cosim.results import read_hdf5
from imufmu.estimators import lee2012
from imufmu.files.atomic import WriteError
from imufmu.files.csv_table import write_csv
from imufmu.fmi.build import cached_fmu
from imufmu.recordings import reading as recordings
from imufmu.registry import BLOCKS
from support import golden
from support.cosim_stubs import edited_fmu

PERIOD = 0.0035  # s, that of BROAD


def record(path: Path, rng: np.random.Generator, n: int = 400, keep: slice | np.ndarray | None = None, **extra) -> Path:
    """A CSV recording of n samples of noise around rest; ``keep`` selects the rows that are written."""
    columns = {
        "time": 5.0 + PERIOD * np.arange(n),
        "gyro": rng.normal(0, 0.3, (n, 3)),
        "accel": rng.normal((0.0, 1.0, 9.7), 0.3, (n, 3)),
        **extra,
    }
    write_csv(path, {name: np.asarray(c)[slice(None) if keep is None else keep] for name, c in columns.items()})
    return path


def test_replay_equals_the_run_on_arrays_bit_for_bit(tmp_path, rng):
    recording = recordings.read(record(tmp_path / "r.csv", rng))
    replayed = replay(recording, cached_fmu("lee2012"), {"c_a": 0.3, "mode": 1}, local_variables=True).signals()
    inputs = {"gyro": recording.gyro, "accel": recording.accel}
    direct = run(lee2012.BLOCK, inputs, {"c_a": 0.3, "sample_period": PERIOD}, start_time=5.0)
    assert recording.sample_period == PERIOD
    for signal in lee2012.BLOCK.reported:
        assert np.array_equal(replayed[signal.name].reshape(direct[signal.name].shape), direct[signal.name]), (
            signal.name
        )
    # FMU and array add up the start time in the same way
    assert np.array_equal(replayed["sample_time"], direct.time)


@pytest.mark.parametrize("case", golden.names("lee2012"))
def test_golden_cases_survive_the_way_through_csv_and_fmu(case, tmp_path):
    reference = golden.load(case)
    gyro, accel = golden.columns(reference.inputs, "gyro", 3), golden.columns(reference.inputs, "acc", 3)
    p = reference.parameters
    source = tmp_path / "in.csv"
    write_csv(source, {"time": np.arange(len(gyro)) * p["dt"], "gyro": gyro, "accel": accel})
    parameters = {name: p[name] for name in ("mode", "c_a", "sigma_g2", "sigma_a2", "g", "eps_a", "n")}
    result = replay(recordings.read(source), cached_fmu("lee2012"), parameters, local_variables=True)
    target = tmp_path / "out.csv"
    result.to_csv(target)
    with target.open(newline="") as file:
        header, *rows = csv.reader(file)
    written = dict(zip(header, np.array(rows, dtype=float).T, strict=True))
    for i in range(3):
        golden.assert_equal(written[f"vertical[{i + 1}]"], reference.outputs[f"Z{i}"], f"Z{i}")
        golden.assert_equal(written[f"external_acceleration[{i + 1}]"], reference.outputs[f"a{i}"], f"a{i}")
    for i in range(9):
        golden.assert_equal(written[f"P[{i // 3 + 1},{i % 3 + 1}]"], reference.outputs[f"P{i}"], f"P{i}")
    golden.assert_equal(written["roll"], reference.outputs["roll"], "roll")
    golden.assert_equal(written["pitch"], reference.outputs["pitch"], "pitch")


def test_missing_rows_are_missing_samples_and_every_row_keeps_its_own_outputs(tmp_path, rng):
    n, gap = 400, np.r_[0:150, 170:400]
    whole = recordings.read(record(tmp_path / "whole.csv", np.random.default_rng(1), n))
    cut = recordings.read(record(tmp_path / "cut.csv", np.random.default_rng(1), n, gap))
    result = replay(cut, cached_fmu("lee2012"))
    inputs = {"gyro": whole.gyro.copy(), "accel": whole.accel.copy()}
    for values in inputs.values():
        values[150:170] = np.nan
    expected = run(lee2012.BLOCK, inputs, {"sample_period": PERIOD}, start_time=5.0)
    assert len(result.columns["roll"]) == len(gap)
    assert np.array_equal(result.signals()["vertical"], expected["vertical"][gap])
    # The file's own time and the instant of the sample differ by rounding alone.
    assert np.abs(result.columns["sample_time"] - cut.time).max() < 1e-12
    assert any("20 of 400 samples" in note for note in result.notes)


def test_cells_without_a_number_are_missing_samples_with_flag_and_one_warning(tmp_path, rng):
    accel = rng.normal((0.0, 1.0, 9.7), 0.3, (400, 3))
    accel[200:210, 1] = np.nan
    result = replay(recordings.read(record(tmp_path / "r.csv", rng, accel=accel)), cached_fmu("lee2012"))
    assert set(np.flatnonzero(result.columns["status"])) == set(range(200, 210))
    assert np.isfinite(list(result.columns.values())).all()
    assert sum("not finite" in note for note in result.notes) == 1


def test_missing_samples_are_held_for_an_fmu_that_cannot_say_it_misses_them(tmp_path, rng):
    plain = tmp_path / "plain.fmu"
    with zipfile.ZipFile(cached_fmu("lee2012")) as source, zipfile.ZipFile(plain, "w") as target:
        for member in source.namelist():
            target.writestr(member, source.read(member).replace(b'name="status"', b'name="flags"'))
    accel, gyro = rng.normal((0.0, 1.0, 9.7), 0.3, (400, 3)), rng.normal(0, 0.3, (400, 3))
    accel[0] = accel[200:210, 1] = gyro[205:230, 2] = np.nan
    recording = recordings.read(record(tmp_path / "r.csv", rng, accel=accel, gyro=gyro))
    result = replay(recording, plain)
    accel[0], accel[200:210, 1], gyro[205:230, 2] = 0.0, accel[199, 1], gyro[204, 2]
    expected = run(lee2012.BLOCK, {"gyro": gyro, "accel": accel}, {"sample_period": PERIOD}, start_time=5.0)
    assert np.array_equal(result.signals()["vertical"], expected["vertical"])
    assert any("31 of 400 samples are incomplete; held" in note for note in result.notes)


def test_inputs_that_count_from_0_are_the_same_axes(tmp_path, rng):
    from_0 = tmp_path / "from_0.fmu"
    with zipfile.ZipFile(cached_fmu("lee2012")) as source, zipfile.ZipFile(from_0, "w") as target:
        for member in source.namelist():
            content = source.read(member)
            for i in (1, 2, 3):
                for name in ("gyro", "accel"):
                    content = content.replace(f'name="{name}[{i}]"'.encode(), f'name="{name}[{i - 1}]"'.encode())
            target.writestr(member, content)
    recording = recordings.read(record(tmp_path / "r.csv", rng, n=50))
    result = replay(recording, from_0)
    assert np.array_equal(result.columns["roll"], replay(recording, cached_fmu("lee2012")).columns["roll"])
    assert sum("count from 0" in note for note in result.notes) == 2


def test_four_inputs_from_0_are_no_three_axes(tmp_path, rng):
    fourth = '<ScalarVariable name="gyro[0]" valueReference="900" causality="input"><Real start="0"/></ScalarVariable>'
    fmu = edited_fmu(
        tmp_path / "four.fmu",
        cached_fmu("lee2012"),
        lambda text: text.replace("</ModelVariables>", f"{fourth}</ModelVariables>"),
    )
    with pytest.raises(ValueError, match=r"inputs gyro\[0\] to gyro\[3\] of the FMU: which three of them are x, y, z"):
        replay(recordings.read(record(tmp_path / "r.csv", rng, n=50)), fmu)


def test_the_sample_period_follows_the_recording_and_no_other_is_accepted(tmp_path, rng):
    recording = recordings.read(record(tmp_path / "r.csv", rng))
    with pytest.raises(WiringError, match=r"sample_period = 0.01 s, but .*r.csv has a sample every 0.0035 s"):
        replay(recording, cached_fmu("lee2012"), {"sample_period": 0.01})
    replay(recording, cached_fmu("lee2012"), {"sample_period": PERIOD})


def test_an_fmu_without_gyro_and_wrong_parameters_are_refused_all_at_once(tmp_path, rng):
    recording = recordings.read(record(tmp_path / "r.csv", rng))
    with pytest.raises(WiringError, match=r"no input gyro\[1\]"):
        replay(recording, cached_fmu("pendulum"))
    with pytest.raises(WiringError) as refused:
        replay(recording, cached_fmu("lee2012"), {"c_b": 1, "c_a": 3.0, "mode": 1.5})
    assert len(refused.value.problems) == 3
    assert "Near: c_a" in refused.value.problems[0]


@pytest.mark.parametrize("script", [None, b"def broken(:", b"import no_such_package_anywhere"])
def test_a_python_fmu_whose_script_fails_is_an_error_not_a_crash(script, tmp_path, rng):
    """PythonFMU's wrapper would end the process."""
    broken = tmp_path / "broken.fmu"
    with zipfile.ZipFile(cached_fmu("lee2012")) as source, zipfile.ZipFile(broken, "w") as target:
        for member in source.namelist():
            name = member.replace("lee2012_fmu.py", "broken_fmu.py")
            content = {"resources/broken_fmu.py": script, "resources/slavemodule.txt": b"broken_fmu"}.get(
                name, source.read(member)
            )
            if content is not None:
                target.writestr(name, content)
    recording = recordings.read(record(tmp_path / "r.csv", rng))
    with pytest.raises(SimulationError, match="lee2012: its Python script fails to load"):
        replay(recording, broken)


def test_inputs_that_the_recording_does_not_have_stay_at_their_start_values_and_a_note_tells(tmp_path, rng):
    recording = recordings.read(record(tmp_path / "six_axes.csv", rng))
    for name, idle in (
        ("plumb", "mag[1], mag[2], mag[3], forward_speed, forward_speed_valid"),
        ("zihajehzadeh2014", "mag[1], mag[2], mag[3]"),
    ):
        result = replay(recording, cached_fmu(name))
        assert f"inputs not in the recording stay at their start values: {idle}" in result.notes
        direct = run(BLOCKS[name], recording.readings, {"sample_period": PERIOD}, start_time=5.0)
        assert np.array_equal(result.signals()["vertical"], direct["vertical"])


def test_the_speed_of_a_vehicle_is_used_where_the_recording_tells_it(tmp_path, rng):
    speed = np.linspace(0.0, 20.0, 400)
    speed[100:150] = np.nan
    recording = recordings.read(record(tmp_path / "drive.csv", rng, forward_speed=speed))
    assert np.array_equal(recording.at_instants()["forward_speed"], speed, equal_nan=True)
    result = replay(recording, cached_fmu("plumb"))
    assert "inputs not in the recording stay at their start values: mag[1], mag[2], mag[3]" in result.notes
    inputs = recording.readings | {"forward_speed_valid": np.isfinite(speed).astype(float)}
    direct = run(BLOCKS["plumb"], inputs, {"sample_period": PERIOD}, start_time=5.0)
    without = run(BLOCKS["plumb"], {n: inputs[n] for n in ("gyro", "accel")}, {"sample_period": PERIOD}, start_time=5.0)
    assert np.array_equal(result.signals()["vertical"], direct["vertical"])
    assert not np.array_equal(direct["vertical"], without["vertical"])


def test_a_replay_is_written_as_hdf5_too_and_never_over_its_recording(tmp_path, rng):
    source = record(tmp_path / "r.csv", rng)
    result = replay(recordings.read(source), cached_fmu("lee2012"))
    assert result.to_hdf5(tmp_path / "o.h5") == []
    again = read_hdf5(tmp_path / "o.h5")
    assert again.system == "r" and again.units["lee2012.roll"] == "rad"
    assert np.array_equal(again.time, result.recording.time)
    for name, column in result.columns.items():
        assert np.array_equal(again[f"lee2012.{name}"], column)
    before = source.read_bytes()
    with pytest.raises(WriteError, match=r"r\.csv: cannot write: it is read here"):
        result.to_csv(source)
    assert source.read_bytes() == before
    assert len(repr(result)) < 100 and len(repr(result.recording)) < 300


def test_an_estimator_is_a_name_or_a_file():
    assert estimator_fmu("lee2012") == cached_fmu("lee2012")
    assert estimator_fmu("some/filter.fmu") == Path("some/filter.fmu")
    with pytest.raises(ValueError, match="no estimator is called 'lee2013'; there is lee2012"):
        estimator_fmu("lee2013")


@pytest.mark.parametrize("name", ["Käse", "50%", "a#b", "it's"])
def test_a_temporary_folder_that_fmus_do_not_understand_is_not_used(name, tmp_path, rng, monkeypatch):
    odd = tmp_path / name
    odd.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(odd))
    recording = recordings.read(record(tmp_path / "r.csv", rng, n=20))
    assert len(replay(recording, cached_fmu("lee2012")).columns["roll"]) == 20


def test_replays_leave_nothing_behind(tmp_path, rng, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    (tmp_path / "in").mkdir()
    recording = recordings.read(record(tmp_path / "in" / "r.csv", rng))
    replay(recording, cached_fmu("lee2012"))

    def interrupt(done: int, total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        replay(recording, cached_fmu("lee2012"), progress=interrupt)
    assert [path.name for path in tmp_path.iterdir()] == ["in"]
