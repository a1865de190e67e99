"""imufmu connect and run --plant: what was found is said, what is unclear is asked or refused, what is written runs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from imufmu.cli import connecting
from imufmu.cli.main import app
from support.rocker import rocker

ATTITUDE = "quaternion=attitude:wxyz:to-world"


def test_connect_says_what_it_found_and_writes_a_system_that_runs(imufmu, tmp_path: Path) -> None:
    arguments = ["connect", rocker("3_cs"), "--imu", "mpu9150", "-e", "plumb", "-e", "lee2012", "--rate", 100]
    code, text, errors = imufmu(*arguments, "--map", ATTITUDE)
    assert code == 0
    assert text.splitlines() == [
        "gyro: angular_velocity[1], angular_velocity[2], angular_velocity[3] [rad/s]",
        "accel: specific_force[1], specific_force[2], specific_force[3] [m/s2]",
        "vertical: vertical[1], vertical[2], vertical[3] [1]",
        "quaternion: attitude[1], attitude[2], attitude[3], attitude[4] [1] wxyz to-world",
        "truth: vertical, roll, pitch, yaw, q_NS; compared: tilt, roll and pitch, yaw, where an estimator knows it",
    ]
    assert "no magnetic field in the plant" in errors
    assert not list(tmp_path.glob("*.ssd"))
    assert imufmu(*arguments, "--map", ATTITUDE, "--out", "my.ssd", "--stop", 1)[0] == 0
    code, table, _ = imufmu("run", "my.ssd", "--in-process", "--output", "r.csv", "--report", "r.html")
    assert code == 0
    assert re.search(r"^plumb .*\n.*lee2012|^lee2012 ", table, re.MULTILINE)
    assert "plumb" in (tmp_path / "r.html").read_text(encoding="utf-8")  # and no Binary output is in its way
    header, *rows = (tmp_path / "r.csv").read_text().splitlines()
    assert "truth.q_NS[1]" in header and len(rows) == 101
    assert imufmu(*arguments[:2], "--out", "my.txt")[0] == 2


def test_run_takes_a_plant_as_it_is(imufmu) -> None:
    arguments = ["run", "--plant", rocker("3_me"), "--stop", 1, "--rate", 200, "--in-process"]
    code, text, errors = imufmu(*arguments, "--imu", "ideal", "-e", "plumb", "--set", "plant.stiffness=5")
    assert code == 0
    assert "tilt RMSE" in text
    assert "note: gyro: angular_velocity[1]" in errors
    code, _, errors = imufmu(*arguments, "--map", "gyro=spin")
    assert code == 2
    assert "--map gyro=spin: " in errors and "has no single vector of 3 of that name" in errors


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["run"], "give a SYSTEM"),
        (["run", "pendulum_lee2012", "--plant", "x.fmu"], "give a SYSTEM"),
        (["run", "pendulum_lee2012", "-e", "plumb"], "give it together with --plant"),
        (["run", "pendulum_lee2012", "--map", "gyro=w"], "give it together with --plant"),
        (["run", "pendulum_lee2012", "--imu", "mtz"], "did you mean mtx"),
        (["run", "--plant", "none.fmu"], "there is no such file"),
        (["connect", "none.fmu"], "there is no such file"),
        (["connect", "none.fmu", "--map", "gyro"], "expected WHAT=NAME"),
        (["build", "imu", "--imu", "mtx"], "give it together with --native"),
        (["build", "plumb", "--native", "--imu", "mtx"], "plumb has no IMU in it"),
    ],
)
def test_wrong_use_is_one_message(arguments: list[str], message: str, imufmu) -> None:
    code, _, errors = imufmu(*arguments)
    assert code == 2
    assert message in " ".join(errors.split())
    assert "Traceback" not in errors


def test_another_device_and_another_rate_change_a_system(imufmu, tmp_path: Path) -> None:
    results = {}
    for device in ("mtx", "mpu9150"):
        code, table, errors = imufmu(
            "run", "pendulum_lee2012", "--imu", device, "--rate", 50, "--stop", 1, "-o", "r.csv"
        )
        assert code == 0 and "samples every" not in errors  # no sample falls between communication points
        results[device] = table
        assert len((tmp_path / "r.csv").read_text().splitlines()) == 52
    assert results["mtx"] != results["mpu9150"]


def test_what_is_unclear_is_asked_at_a_terminal_by_number(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(connecting, "asker", connecting._Asker)
    from support.cosim_stubs import fake_fmu, variable

    names = [f"omega_{axis}" for axis in "xyz"], [f"a_{axis}" for axis in "xyz"]
    outputs = [variable(name, "output") for some in names for name in some]
    fake_fmu(tmp_path / "plant.fmu", outputs)
    asked = CliRunner().invoke(app, ["connect", "plant.fmu"], input="seven\n9\n1\n")
    assert asked.exit_code == 0
    assert "accel: a_x, a_y, a_z [no unit]" in asked.output
    assert asked.output.count("a number from 1 to 2, please") == 2


def test_a_device_is_baked_into_a_compiled_fmu(imufmu, tmp_path: Path) -> None:
    assert imufmu("build", "imu+lee2012", "--native", "--imu", "mpu9150")[0] == 0
    code, text, _ = imufmu("info", tmp_path / "imu_lee2012.fmu")
    assert code == 0
    assert re.search(r"^imu\.gyro_bias\[1\] .* -0\.01745329 ", text, re.MULTILINE)
    assert re.search(r"^sample_period .* 0\.005 ", text, re.MULTILINE)
