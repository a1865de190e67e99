"""Results by name, and files that give back exactly what went in."""

from __future__ import annotations

import csv
from pathlib import Path

import h5py
import numpy as np
import pytest

from imufmu import Result, read_hdf5


@pytest.fixture
def result(rng: np.random.Generator) -> Result:
    """A scalar, a vector, a matrix, an integer, and a vector of which one element is missing."""
    names = ["imu.gyro[1]", "imu.gyro[2]", "filter.P[1,1]", "filter.P[1,2]", "filter.P[2,1]", "filter.P[2,2]", "imu.t"]
    columns = {name: rng.standard_normal(7) * 10.0 ** rng.integers(-300, 300, 7) for name in names}
    columns |= {"imu.n": np.arange(7, dtype=np.int32), "imu.part[2]": rng.standard_normal(7)}
    units = {name: {"gyro": "rad/s", "t": "s"}.get(name.split(".")[1].split("[")[0]) for name in columns}
    return Result("a system", 0.1 + np.arange(7) * 0.1, columns, units, ("first note", "zweite Notiz: µ"))


def test_elements_vectors_and_matrices_are_found_by_name(result: Result) -> None:
    assert result["imu.gyro[2]"] is result.columns["imu.gyro[2]"]
    assert result["imu.gyro"].shape == (7, 2)
    assert result["imu.gyro"][:, 1].tolist() == result["imu.gyro[2]"].tolist()
    assert result["filter.P"].shape == (7, 2, 2)
    assert result["filter.P"][:, 0, 1].tolist() == result["filter.P[1,2]"].tolist()
    assert "imu.gyro" in result
    assert "imu.part" not in result


def test_an_unknown_name_is_told_with_near_ones(result: Result) -> None:
    with pytest.raises(KeyError, match=r"'imu\.gyr' was not recorded\. Near: imu\.gyro"):
        result["imu.gyr"]
    with pytest.raises(KeyError, match=r"'imu\.part' was not recorded\. Near: imu\.part\[2\]"):
        result["imu.part"]


def test_the_structured_array_has_every_column_in_its_type(result: Result) -> None:
    table = result.as_array()
    assert table.dtype.names == ("time", *result.names)
    assert table["imu.n"].dtype == np.int32
    assert table["imu.gyro[1]"].tolist() == result["imu.gyro[1]"].tolist()


def test_csv_gives_back_every_number_exactly(result: Result, tmp_path: Path) -> None:
    result.to_csv(tmp_path / "a.csv")
    with (tmp_path / "a.csv").open(newline="", encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    assert header == ["time", *result.names]  # also P[1,2], whose name has a comma
    numbers = np.array(rows, dtype=float)
    assert numbers[:, 0].tolist() == result.time.tolist()
    for i, name in enumerate(result.names, 1):
        assert numbers[:, i].tolist() == result[name].tolist()
    assert [row[header.index("imu.n")] for row in rows] == list("0123456")


def test_hdf5_gives_back_the_whole_result(result: Result, tmp_path: Path) -> None:
    result.to_hdf5(tmp_path / "a.h5")
    again = read_hdf5(tmp_path / "a.h5")
    assert (again.system, again.notes, dict(again.units)) == (result.system, result.notes, dict(result.units))
    assert sorted(again.names) == sorted(result.names)
    assert again.time.tolist() == result.time.tolist()
    for name in result.names:
        assert again[name].dtype == result[name].dtype
        assert again[name].tolist() == result[name].tolist()


def test_hdf5_has_one_dataset_per_vector_with_its_unit(result: Result, tmp_path: Path) -> None:
    result.to_hdf5(tmp_path / "a.h5")
    with h5py.File(tmp_path / "a.h5") as file:
        assert file["time"].attrs["unit"] == "s"
        assert file["imu/gyro"].shape == (7, 2)
        assert file["imu/gyro"].attrs["unit"] == "rad/s"
        assert file["filter/P"].shape == (7, 2, 2)
        assert file["imu/part[2]"].shape == (7,)


def test_an_empty_result_can_be_written_and_read(tmp_path: Path) -> None:
    Result("empty", np.array([0.0, 1.0]), {}, {}).to_hdf5(tmp_path / "a.h5")
    assert read_hdf5(tmp_path / "a.h5").names == []


def test_names_that_hdf5_cannot_hold_are_changed_with_a_note_and_come_back(tmp_path: Path) -> None:
    names = ["f.a", "f.a/b", "f.a%2Fb", "f.", "f..", "f.v", "f.v[1]", "f.v[2]", "time.x", "/.y", "f.w/x[1]", "f.w/x[2]"]
    names += ["f.der(x)", "f.ü"]
    columns = {name: np.arange(3.0) + i for i, name in enumerate(names)}
    result = Result("s", np.arange(3.0), columns, dict.fromkeys(names, "m"))
    notes = result.to_hdf5(tmp_path / "a.h5")
    assert f"f.a/b is f/a%2Fb in {tmp_path / 'a.h5'}, as HDF5 has no such names" in notes
    assert {note.split(" is ")[0] for note in notes} == {
        "f.a/b", "f.a%2Fb", "f.", "f..", "time.x", "/.y", "f.w/x"
    }  # fmt: skip
    again = read_hdf5(tmp_path / "a.h5")
    assert set(again.names) == set(names)
    for name in names:
        assert again[name].tolist() == columns[name].tolist(), name
        assert again.units[name] == "m"


def test_a_result_is_shown_in_one_short_line(result: Result) -> None:
    assert repr(result) == "<Result of 'a system': 9 variables, 7 rows from 0.1 to 0.7 s>"
    assert repr(Result("none", np.empty(0), {}, {})) == "<Result of 'none': 0 variables, 0 rows>"


@pytest.mark.parametrize("content", [None, b"", b"not HDF5"])
def test_what_is_no_result_is_refused(tmp_path: Path, content: bytes | None) -> None:
    if content is not None:
        (tmp_path / "a.h5").write_bytes(content)
    with pytest.raises(ValueError, match=r"a\.h5: cannot be read as a result"):
        read_hdf5(tmp_path / "a.h5")


def test_another_hdf5_file_is_refused(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["x"] = 1
    with pytest.raises(ValueError, match="cannot be read as a result"):
        read_hdf5(tmp_path / "a.h5")


def test_a_write_that_fails_leaves_the_old_file(tmp_path: Path) -> None:
    (tmp_path / "a.h5").write_text("old")
    broken = Result("x", np.arange(2.0), {"a.b": np.arange(2.0)}, units={})
    with pytest.raises(KeyError):
        broken.to_hdf5(tmp_path / "a.h5")
    assert [path.name for path in tmp_path.iterdir()] == ["a.h5"]
    assert (tmp_path / "a.h5").read_text() == "old"
