"""Claims about the command line: exit codes, one-line errors, files that appear whole or not at all."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from imufmu.cosim.results import read_hdf5
from imufmu.files.csv_table import write_csv
from support.optional import needs


@pytest.fixture
def walk(tmp_path):
    """A short recording with truth."""
    n = 300
    rng = np.random.default_rng(3)
    columns = {
        "time": np.arange(n) * 0.01,
        "gyro": rng.normal(0, 0.01, (n, 3)),
        "accel": rng.normal((0, 0, 9.8), 0.05, (n, 3)),
        "roll": np.zeros(n),
        "pitch": np.zeros(n),
    }
    write_csv(tmp_path / "walk.csv", columns)
    return tmp_path / "walk.csv"


def test_native_fmus_give_the_table_of_the_python_ones(imufmu):
    arguments = ("run", "pendulum_lee2012", "--stop", 1)
    code, text, _ = imufmu(*arguments, "--native")
    assert (code, text) == imufmu(*arguments)[:2] and code == 0
    code, text, _ = imufmu("pack", "pendulum_lee2012", "native.ssp", "--native")
    assert code == 0
    with zipfile.ZipFile("native.ssp") as packed:
        assert zipfile.ZipFile(packed.open("resources/lee2012.fmu")).namelist().count("sources/fmu.c") == 1


def test_every_command_has_help_that_opens_with_an_example(imufmu):
    code, text, _ = imufmu("--help")
    assert code == 0 and "imufmu demo" in text
    commands = re.findall(r"^  (\w+) ", text.split("Commands:")[1], re.MULTILINE)
    assert {"list", "build", "info", "run", "replay", "pack", "demo"} <= set(commands)
    for command in commands:
        code, text, _ = imufmu(command, "--help")
        assert code == 0
        assert re.search(rf"^ +imufmu {command}", text, re.MULTILINE), command


def test_list_names_every_block_system_and_device(imufmu):
    code, text, _ = imufmu("list")
    assert code == 0
    for name in ("lee2012", "imu", "pendulum", "double_pendulum", "pendulum_lee2012", "double_pendulum_lee2012", "mtx"):
        assert re.search(rf"^\w+ +{name} ", text, re.MULTILINE), name


def test_build_and_info(imufmu, tmp_path):
    assert imufmu("build", "lee2012", "imu", "--folder", "out")[0] == 0
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"lee2012.fmu", "imu.fmu"}
    code, text, _ = imufmu("info", tmp_path / "out" / "lee2012.fmu")
    assert code == 0
    assert "linux64, win64" in text and re.search(r"^c_a .*parameter +tunable +1 +0.1 +0.0 +1.0", text, re.MULTILINE)


def test_native_fmus_and_series_are_built_and_found_healthy(imufmu, tmp_path):
    assert imufmu("build", "lee2012", "imu+lee2012", "--native")[0] == 0
    assert {path.name for path in tmp_path.iterdir()} == {"lee2012.fmu", "imu_lee2012.fmu"}
    code, text, _ = imufmu("doctor", tmp_path / "imu_lee2012.fmu")
    assert code == 0
    assert re.search(r"^ok +one step +works on this machine", text, re.MULTILINE)
    assert not re.search(r"^\w+ +Python ", text, re.MULTILINE)


def test_what_the_doctor_finds_wrong_is_exit_code_1(imufmu, tmp_path):
    (tmp_path / "broken.fmu").write_bytes(b"PK\x03\x04 cut off")
    code, text, _ = imufmu("doctor", "broken.fmu")
    assert code == 1
    assert re.search(r"^problem +archive +.*broken.fmu", text, re.MULTILINE)


def test_run_compares_writes_and_says_where(imufmu, tmp_path):
    arguments = ("run", "pendulum_lee2012", "--stop", 4, "--plot", "--report", "r.html", "--output", "r.csv")
    code, text, errors = imufmu(*arguments)
    assert code == 0, errors
    assert "tilt RMSE (deg)" in text and re.search(r"^lee2012 ", text, re.MULTILINE)
    assert {p.name for p in tmp_path.iterdir()} == {"pendulum_lee2012.png", "r.html", "r.csv"}
    assert text.count("wrote ") == 3
    page = (tmp_path / "r.html").read_text()
    assert "data:image/png;base64," in page and 'src="http' not in page and "<script" not in page


def test_run_animates_and_its_results_then_hold_the_body(imufmu, tmp_path):
    code, text, errors = imufmu("run", "pendulum_swing_up", "--stop", 1, "--animate", "s.gif", "--output", "s.h5")
    assert code == 0, errors
    assert {p.name for p in tmp_path.iterdir()} == {"s.gif", "s.h5"}
    assert text.count("wrote ") == 2
    with Image.open(tmp_path / "s.gif") as picture:
        assert picture.n_frames == 21
    assert read_hdf5(tmp_path / "s.h5")["plant.skeleton"].shape[1:] == (2, 3)


@pytest.mark.parametrize("option", [("--plot",), ("--report", "r.html"), ("--animate", "a.gif")], ids=lambda o: o[0])
@pytest.mark.parametrize(
    "component, fmu, missing", [("plant", "pendulum", "no estimator"), ("lee2012", "lee2012", "no plant that knows")]
)
def test_a_system_with_nothing_to_compare_is_not_drawn(imufmu, tmp_path, option, component, fmu, missing):
    (tmp_path / "alone.ssd").write_text(ALONE.format(component=component, fmu=fmu))
    code, text, errors = imufmu("run", "alone.ssd", *option)
    assert code == 2
    assert missing in errors and "Traceback" not in errors and not text
    assert [path.name for path in tmp_path.iterdir()] == ["alone.ssd"]
    assert imufmu("run", "alone.ssd")[0] == 0  # without pictures it runs


def test_replay_prints_errors_where_there_is_truth_and_writes_every_row(imufmu, tmp_path, walk):
    code, text, errors = imufmu("replay", walk, "--set", "c_a=0.2", "--output", "o.csv", "--plot")
    assert code == 0, errors
    assert "tilt RMSE (deg)" in text
    assert len((tmp_path / "o.csv").read_text().splitlines()) == 301
    assert (tmp_path / "walk_lee2012.png").stat().st_size > 10_000


def test_demo_makes_a_figure_and_a_page(imufmu, tmp_path):
    code, text, errors = imufmu("demo", "--folder", "d")
    assert code == 0, errors
    rows = re.findall(r"^mode (\d) \(.*?\) +([\d.]+ +)+", text, re.MULTILINE)
    assert [mode for mode, _ in rows] == ["1", "2", "3"]
    assert {path.name for path in (tmp_path / "d").iterdir()} == {"demo.png", "demo.html"}
    assert str(tmp_path / "d" / "demo.html") in text


ALONE = """<ssd:SystemStructureDescription xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription"
    version="1.0" name="alone">
  <ssd:System name="Alone"><ssd:Elements>
    <ssd:Component name="{component}" source="resources/{fmu}.fmu" type="application/x-fmu-sharedlibrary"/>
  </ssd:Elements></ssd:System>
  <ssd:DefaultExperiment startTime="0" stopTime="0.1"/>
</ssd:SystemStructureDescription>"""

WRONG = {
    "unknown command": (["walk"], "walk"),
    "unknown block": (["build", "lee2013"], "no block is called 'lee2013'"),
    "blocks that do not fit": (["build", "imu+pendulum", "--native"], "a plant can only stand first"),
    "platform without native": (["build", "lee2012", "--platform", "win64"], "together with --native"),
    "unknown platform": (["build", "lee2012", "--native", "--platform", "amiga"], "no platform is called 'amiga'"),
    "unknown system": (["run", "pendulum"], "no system is called 'pendulum'"),
    "unknown parameter": (["run", "pendulum_lee2012", "--set", "lee2012.c_b=1"], "Near: c_a"),
    "unknown component": (["run", "pendulum_lee2012", "--set", "lee.c_a=1"], "no component 'lee'"),
    "parameter out of range": (["run", "pendulum_lee2012", "--set", "lee2012.c_a=2"], "outside [0, 1]"),
    "no value": (["run", "pendulum_lee2012", "--set", "lee2012.c_a"], "expected NAME=VALUE"),
    "text for a number": (
        ["run", "pendulum_lee2012", "--set", "lee2012.c_a=high"],
        "c_a = high: expected a value of type Real",
    ),
    "negative step": (["run", "pendulum_lee2012", "--step", "-0.1"], "steps of -0.1"),
    "animation of another kind": (["run", "pendulum_lee2012", "--animate", "a.avi"], ".gif or .mp4"),
    "animation into no folder": (["run", "pendulum_lee2012", "--animate", "none/a.gif"], "none"),
    "no such recording": (["replay", "none.csv"], "none.csv"),
    "not a recording": (["replay", "notes.txt"], "notes.txt"),
    "unknown estimator": (["replay", "{walk}", "-e", "lee2013"], "no estimator is called 'lee2013'"),
    "broken FMU": (["replay", "{walk}", "-e", "broken.fmu"], "broken.fmu"),
    "another sample period": (["replay", "{walk}", "--set", "sample_period=0.02"], "has a sample every 0.01 s"),
    "output of another kind": (["replay", "{walk}", "-o", "o.xlsx"], ".csv"),
    "output into no folder": (["replay", "{walk}", "-o", "none/o.csv"], "none"),
    "a recording as FMU": (["info", "{walk}"], "no block is called"),
    "a block spelt wrong": (["build", "Lee2012"], "did you mean lee2012?"),
    "a system spelt wrong": (["run", "pendulum_lee2021"], "did you mean pendulum_lee2012?"),
    "a device spelt wrong": (["predict", "--imu", "mtz"], "did you mean mtx?"),
    "a block spelt wrong for the doctor": (["doctor", "plump"], "did you mean plumb?"),
    "a file as folder": (["build", "lee2012", "--folder", "notes.txt"], "notes.txt is a file; give a folder"),
    "a file as a part of a folder": (["demo", "--folder", "notes.txt/demo"], "notes.txt is a file; give a folder"),
    "the recording as output": (["replay", "{walk}", "-o", "walk.csv"], "walk.csv: cannot write: it is read here"),
    "the recording as output by another name": (["replay", "{walk}", "-o", "link.csv"], "link.csv: cannot write"),
    "a recording of the folder as output": (
        ["benchmark", ".", "--csv", "walk.csv"],
        "walk.csv: cannot write: it is read",
    ),
    "the packed system as output": (["pack", "a.ssp", "./a.ssp"], "a.ssp: cannot write: it is read here"),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_users_mistake_is_one_clear_message_and_exit_code_2(case, imufmu, tmp_path, walk):
    (tmp_path / "broken.fmu").write_bytes(b"PK\x03\x04 cut off")
    (tmp_path / "notes.txt").write_text("hello")
    (tmp_path / "a.ssp").write_bytes(b"a system")
    (tmp_path / "link.csv").symlink_to(walk)
    contents = walk.read_bytes()
    before = {path.name for path in tmp_path.iterdir()}
    arguments, expected = WRONG[case]
    code, _, errors = imufmu(*(str(walk) if a == "{walk}" else a for a in arguments))
    assert code == 2, errors
    assert expected in errors
    assert "Traceback" not in errors
    assert {path.name for path in tmp_path.iterdir()} == before
    assert walk.read_bytes() == contents and (tmp_path / "a.ssp").read_bytes() == b"a system"


@needs("POSIX")  # sends SIGINT as a terminal does there
def test_ctrl_c_ends_a_long_run_without_a_trace(tmp_path):
    environment = os.environ | {"TMPDIR": str(tmp_path / "scratch")}
    (tmp_path / "scratch").mkdir()
    command = [Path(sys.executable).with_name("imufmu"), "run", "pendulum_lee2012", "--stop", "1e5", "-o", "r.csv"]
    process = subprocess.Popen(
        command,
        cwd=tmp_path,
        env=environment,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # ignored if the tests run in the background
    )
    deadline = time.monotonic() + 60
    while not list((tmp_path / "scratch").glob("imufmu_run_*/2/binaries")) and time.monotonic() < deadline:
        assert process.poll() is None, process.stderr.read()
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in errors
    assert [path.name for path in tmp_path.iterdir()] == ["scratch"]
    assert list((tmp_path / "scratch").iterdir()) == []
