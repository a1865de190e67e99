"""What an FMU says about itself is told for every version and kind, also where it cannot run."""

from __future__ import annotations

import zipfile
from pathlib import Path

import pytest

from imufmu.fmi.info import described, facts
from support.rocker import rocker


@pytest.mark.parametrize(
    ("kind", "told"),
    [
        ("3_cs", "FMI 3.0 co-simulation and model exchange, made with an unnamed tool"),
        ("3_me", "FMI 3.0 model exchange, made with an unnamed tool"),
        ("2_me", "FMI 2.0 model exchange, made with an unnamed tool"),
    ],
)
def test_version_and_kinds_are_those_of_the_fmu(kind: str, told: str) -> None:
    heading, _ = described(facts(str(rocker(kind))))
    assert heading[1] == told


def test_an_array_is_one_variable_with_its_shape() -> None:
    told = facts(str(rocker("3_cs")))
    variables = {v["name"]: v for v in told["variables"]}
    assert variables["dcm"]["shape"] == [3, 3]
    assert variables["dcm"]["type"] == "Float64"
    assert variables["push"]["start"] == "0 0"
    assert variables["stiffness"]["start"] == 10.0
    assert variables["hits_before"]["start"] == 0
    _, rows = described(told)
    assert {"dcm[1..3,1..3]", "push[1..2]", "angle"} <= {row[0] for row in rows}


def test_an_fmu_of_another_platform_is_told_about(tmp_path: Path) -> None:
    path = tmp_path / "elsewhere.fmu"
    with zipfile.ZipFile(rocker("3_cs")) as source, zipfile.ZipFile(path, "w") as target:
        target.writestr("modelDescription.xml", source.read("modelDescription.xml"))
        target.writestr("binaries/", b"")
        target.writestr("binaries/riscv64-linux/rocker.so", b"")
    assert facts(str(path))["platforms"] == ["riscv64-linux"]
