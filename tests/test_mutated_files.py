"""Files from anywhere, damaged at random: every reader gives a value or one of our own errors, in one line."""

from __future__ import annotations

import io
import json
import re
import warnings
import zipfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import scipy.io

from imufmu import RecordingError, System, inspect_recording, read_recording
from imufmu.benchmarks.recordings import benchmark
from imufmu.cosim.description import DescriptionError, read_description
from imufmu.cosim.interface import WiringError
from imufmu.files.archives import ArchiveError, unpack
from imufmu.files.csv_table import write_csv
from imufmu.fmi.archive import read_fmu
from imufmu.recordings.inspection import glimpse
from imufmu.scoring.prediction import gyro_noise_density_of
from support.cosim_stubs import LIBRARY, binding, model_description, parameter_set, variable, write_ssd, write_zip
from support.rocking import lines_of, rocking

OURS = (ArchiveError, DescriptionError, RecordingError)
MANY = 125  # mutations of each file; with 17 files of different kinds 2000 in all

XML_PARTS = [
    b'<?xml version="1.0" encoding="GB2312"?>', b'<?xml version="1.0" encoding="no-such"?>', b"<!DOCTYPE a>", b"]]>",
    b"<a>" * 300, b"&#0;", b"&x;", b'"', b"<", b">", b"/>", b"\xff\xfe", b"\xe4", b"-1", b"1e999", b"nan", b"\n", b"",
    b'encoding="utf-16"', b'xmlns:ssd="x"', b" index=\"9999999999999999999999\"", b"</ScalarVariable>", b"true",
]  # fmt: skip
TEXT_PARTS = [b",", b'"', b"\n", b"\r", b"\0", b"nan", b"1e999", b"-", b";", b"\xff", b"\xef\xbb\xbf", b"time", b" "]
BYTES = [bytes([value]) for value in range(256)] + [b"\xff" * 4, b"\0" * 4, b"\0\0\0\x80", b"PK\x05\x06", b"PK\x01\x02"]


def mutated(content: bytes, parts: list[bytes], rng: np.random.Generator) -> bytes:
    """Some parts put in, some bytes cut out or doubled."""
    data = bytearray(content)
    for _ in range(rng.integers(1, 5)):
        at = int(rng.integers(len(data) + 1))
        length = int(rng.choice([0, 1, len(parts[-1]), rng.integers(60)]))
        match rng.integers(4):
            case 0:
                del data[at : at + length]
            case 1:
                data[at:at] = data[at : at + length]
            case _:
                data[at : at + length] = parts[rng.integers(len(parts))]
    return bytes(data)


def zipped(method: int, members: dict[str, bytes]) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", method) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return file.getvalue()


VARIABLES = [variable("u", "input"), variable("p", "parameter", min="-1", max="1"), variable("y", "output")]
DESCRIPTION = model_description(VARIABLES).encode()
FMU = {"modelDescription.xml": DESCRIPTION, LIBRARY: b"\0" * 200}
VALUES = {"p": ("Real", 0.5, "1"), "gyro_noise_density": ("Real", 1e-3, None)}


def ssd(folder: Path) -> bytes:
    path = folder / "made.ssd"
    write_ssd(path, {"a": "a.fmu", "b": "a.fmu"}, ["a.y -> b.u"], bindings={"a": binding(VALUES)})
    return path.read_bytes()


def csv(folder: Path) -> bytes:
    rng = np.random.default_rng(1)
    columns = {"time": 0.01 * np.arange(20), "gyro": rng.normal(size=(20, 3)), "accel": rng.normal(size=(20, 3))}
    write_csv(folder / "made.csv", columns | {"q_NS": np.tile([1.0, 0, 0, 0], (20, 1))})
    return (folder / "made.csv").read_bytes()


def log(_folder: Path) -> bytes:
    """As another program writes it: semicolons, decimal commas, units in the header, times in bunches."""
    motion = rocking(0.5)
    header = "sep=;\nt [ms];Gyro X [deg/s];Gyro Y [deg/s];Gyro Z [deg/s];Acc X (g);Acc Y (g);Acc Z (g)"
    table = (motion["time"] // 0.02 * 20, motion["gyro"], motion["accel"])
    return lines_of(header, *table, separator=";").replace(".", ",").encode()


def look(path: Path) -> None:
    """What `imufmu inspect` does, also with what cannot be read."""
    glimpse(path)
    inspect_recording(read_recording(path))


def mat(compressed: bool, _folder: Path) -> bytes:
    content = {
        "imu_gyr": np.zeros((30, 3)),
        "imu_acc": np.ones((30, 3)),
        "imu_mag": np.ones((30, 3)),
        "opt_quat": np.tile([1.0, 0, 0, 0], (30, 1)),
        "movement": np.ones((30, 1), np.uint8),
        "sampling_rate": np.array([[250.0]]),
    }
    file = io.BytesIO()
    scipy.io.savemat(file, content, do_compression=compressed)
    return file.getvalue()


def trials(_folder: Path) -> bytes:
    return json.dumps({"groups": [{"name": "all"}], "trials": {"a": {"groups": ["all"]}}}).encode()


def read_archive(path: Path) -> None:
    read_fmu(path)
    unpack(path, path.parent)


def read_system(path: Path) -> None:
    try:
        System.read(path)
    except WiringError as error:  # a list, one line each
        assert not any("\n" in problem for problem in error.problems)


def read_groups(path: Path) -> None:
    """The list of groups comes first; without recordings the benchmark has nothing to do after it."""
    try:
        benchmark(path.parent, ["rizun2008"])
    except ValueError as error:
        assert re.search(r"not the list of trials|no recording to score", str(error))


Make = Callable[[Path], bytes]
METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA)
KINDS: dict[str, tuple[str, Make, list[bytes], Callable[[Path], object]]] = {
    **{
        f"fmu, method {method}": ("a.fmu", lambda _, method=method: zipped(method, FMU), BYTES, read_archive)
        for method in METHODS
    },
    **{
        f"ssp, method {method}": (
            "a.ssp",
            lambda folder, method=method: zipped(method, {"SystemStructure.ssd": ssd(folder), "a.fmu": zipped(0, FMU)}),
            BYTES,
            read_system,
        )
        for method in METHODS[:2]
    },
    "model description": ("modelDescription.xml", lambda _: DESCRIPTION, XML_PARTS, lambda path: read_fmu(
        write_zip(path.with_name("b.fmu"), FMU | {path.name: path.read_bytes()})
    )),
    "model description, bytes": ("modelDescription.xml", lambda _: DESCRIPTION, BYTES, lambda path: read_fmu(
        write_zip(path.with_name("b.fmu"), FMU | {path.name: path.read_bytes()})
    )),
    "ssd": ("a.ssd", ssd, XML_PARTS, read_description),
    "ssd, bytes": ("a.ssd", ssd, BYTES, read_description),
    "ssv": ("a.ssv", lambda _: parameter_set(VALUES).encode(), XML_PARTS, gyro_noise_density_of),
    "csv": ("a.csv", csv, TEXT_PARTS, read_recording),
    "csv, bytes": ("a.csv", csv, BYTES, read_recording),
    "log": ("a.txt", log, TEXT_PARTS, look),
    "mat": ("a.mat", partial(mat, False), BYTES, read_recording),
    "mat, compressed": ("a.mat", partial(mat, True), BYTES, read_recording),
    "trials.json": ("trials.json", trials, TEXT_PARTS, read_groups),
}  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
def test_a_damaged_file_is_read_or_refused_in_one_line(kind: str, tmp_path: Path) -> None:
    name, make, parts, read = KINDS[kind]
    whole = make(tmp_path)
    rng = np.random.default_rng(len(whole))
    path = tmp_path / "folder" / name
    path.parent.mkdir()
    refused = 0
    for _ in range(MANY):
        path.write_bytes(mutated(whole, parts, rng))
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                read(path)
        except OURS as error:
            refused += 1
            assert "\n" not in str(error)
            assert path.parent.name in str(error)
    assert refused or name == "trials.json"
