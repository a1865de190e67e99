"""Verbs that read recordings: a file of the user's own is read, looked at and compared, or one line says why not."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from imufmu.cosim.results import read_hdf5
from imufmu.files.csv_table import write_csv
from support.cosim_stubs import stub
from support.optional import skip_without
from support.rocking import lines_of, rocking

MOTION = rocking(8.0)
READINGS = {name: MOTION[name] for name in ("time", "gyro", "accel")}


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """A table of another make: semicolons, decimal commas, milliseconds, degrees."""
    columns = (1e3 * MOTION["time"], np.rad2deg(MOTION["gyro"]), MOTION["accel"] / 9.80665)
    text = lines_of("t;wx;wy;wz;bx;by;bz", *columns, separator=";").replace(".", ",")
    (tmp_path / "log.txt").write_text(text)
    return tmp_path / "log.txt"


TOLD = ("--columns", "gyro=wx,wy,wz:deg/s", "--columns", "accel=bx,by,bz:g", "--time", "t:ms")


def test_a_log_is_told_once_and_then_remembered(imufmu, log):
    code, _, errors = imufmu("replay", log)
    assert code == 2 and "missing: accel[1]" in errors and "--columns accel=" in errors
    code, _, errors = imufmu("replay", log, *TOLD, "--remember", "-o", "told.csv")
    assert code == 0, errors
    assert "remembered in" in errors and log.with_name("log.txt.toml").is_file()
    code, _, errors = imufmu("replay", log, "-o", "again.csv")
    assert code == 0 and "as remembered in log.txt.toml" in errors
    assert Path("told.csv").read_text() == Path("again.csv").read_text()


def test_nothing_told_is_nothing_remembered(imufmu, tmp_path):
    write_csv(tmp_path / "walk.csv", READINGS)
    code, _, errors = imufmu("inspect", tmp_path / "walk.csv", "--remember")
    assert code == 0 and "nothing was told" in errors
    assert not (tmp_path / "walk.csv.toml").exists()


def test_estimators_are_compared_in_one_table_one_figure_and_one_file(imufmu, tmp_path):
    write_csv(tmp_path / "walk.csv", READINGS | {"q_NS": MOTION["q_NS"]})
    code, text, errors = imufmu(
        *("replay", "walk.csv", "-e", "lee2012", "-e", "rizun2008", "--set", "rizun2008.cutoff=0.5"),
        *("--set", "g=9.81", "--plot", "-o", "both.csv"),
    )
    assert code == 0, errors
    header, *rows = text.splitlines()[:3]
    assert "tilt RMSE (deg)" in header
    assert [row.split()[0] for row in rows] == ["lee2012", "rizun2008"]
    assert Path("walk_compared.png").read_bytes().startswith(b"\x89PNG")
    names = next(csv.reader(Path("both.csv").read_text().splitlines()))
    assert {"time", "lee2012.roll", "rizun2008.roll", "rizun2008.vertical[3]"} <= set(names)


def test_what_holds_for_one_of_several_is_told_with_its_name(imufmu, tmp_path):
    write_csv(tmp_path / "walk.csv", READINGS)
    code, _, errors = imufmu("replay", "walk.csv", "-e", "lee2012", "-e", "rizun2008", "--set", "cutoff=0.5")
    assert code == 2 and "cutoff" in errors and "lee2012" in errors


def test_the_figure_of_an_fmu_without_an_attitude_has_its_outputs(imufmu, tmp_path):
    write_csv(tmp_path / "walk.csv", READINGS)
    code, _, errors = imufmu("replay", "walk.csv", "-e", stub("echo"), "--plot")
    assert code == 0, errors
    (figure,) = tmp_path.glob("walk_*.png")  # the FMU calls itself by the name of its class
    assert figure.read_bytes().startswith(b"\x89PNG")


def test_without_a_truth_a_comparison_tells_how_far_estimators_are_apart(imufmu, tmp_path):
    write_csv(tmp_path / "walk.csv", READINGS)
    code, text, _ = imufmu("replay", "walk.csv", "-e", "lee2012", "-e", "leechoi2018")
    assert code == 0
    header, first, second = text.splitlines()
    assert "tilt from lee2012: RMS (deg)" in header
    assert first.split() == ["lee2012", "0.000", "0.000"]
    assert 0 < float(second.split()[1]) < 5


def test_filters_of_others_stand_beside_ours(imufmu, tmp_path):
    skip_without("vqf", "imufusion")
    write_csv(tmp_path / "walk.csv", READINGS | {"q_NS": MOTION["q_NS"]})
    code, text, errors = imufmu("replay", "walk.csv", "-e", "lee2012", "--peers", "-o", "all.h5")
    assert code == 0, errors
    assert {"lee2012", "VQF", "BasicVQF", "imufusion"} <= {line.split()[0] for line in text.splitlines()}
    assert "VQF.vertical" in read_hdf5(Path("all.h5"))


def test_peers_that_are_not_installed_are_one_line(imufmu, tmp_path, monkeypatch):
    monkeypatch.setattr("imufmu.benchmarks.peers.find_spec", lambda name: None)
    write_csv(tmp_path / "walk.csv", READINGS)
    code, _, errors = imufmu("replay", "walk.csv", "--peers")
    assert code == 2 and 'pip install "imufmu[peers]"' in errors


def test_estimates_are_given_in_the_axes_of_the_file(imufmu, tmp_path):
    """The same motion, written as an aircraft would: the same errors, pitch with the other sign, z downwards."""
    flip = np.array([1, -1, -1])
    write_csv(tmp_path / "ours.csv", READINGS)
    theirs = {"time": MOTION["time"], "gyro": MOTION["gyro"] * flip, "accel": MOTION["accel"] * flip}
    write_csv(tmp_path / "theirs.csv", theirs)
    assert imufmu("replay", "ours.csv", "-o", "a.csv")[0] == 0
    code, _, errors = imufmu("replay", "theirs.csv", "--axes", "NED", "-o", "b.csv")
    assert code == 0 and "axes are NED" in errors
    ours, found = (np.genfromtxt(name, delimiter=",", names=True, deletechars="") for name in ("a.csv", "b.csv"))
    for name, sign in {"roll": 1, "pitch": -1, "vertical[1]": 1, "vertical[2]": -1, "vertical[3]": -1}.items():
        np.testing.assert_allclose(found[name], sign * ours[name], atol=1e-12)  # there and back by quaternions


# inspect


def test_inspect_shows_what_is_inside(imufmu, log):
    code, text, _ = imufmu("inspect", log, *TOLD)
    assert code == 0
    text = " ".join(text.split())  # however long the name of the folder is
    for words in (
        "7 columns between semicolons, decimal comma",
        "800 rows over 7.99 s from 0 s, 100 Hz",
        "rad/s from wx, wy, wz",
        "up along +z, at rest, accel reads 1 g",
        "fit together: gravity turns as the gyroscope says",
    ):
        assert words in text
    code, text, _ = imufmu("inspect", log, *TOLD, "--json")
    assert json.loads(text)["facts"]["gaps"] == "none"


def test_inspect_finds_axes_that_do_not_fit_and_replay_notes_them(imufmu, tmp_path):
    flipped = READINGS | {"gyro": MOTION["gyro"] * [1, 1, -1], "accel": MOTION["accel"] * [1, 1, -1]}
    write_csv(tmp_path / "walk.csv", flipped)
    code, text, _ = imufmu("inspect", "walk.csv")
    assert code == 1
    assert "left-handed set" in text and "up along -z" in text
    code, _, errors = imufmu("replay", "walk.csv")
    assert code == 0 and "left-handed set" in errors


def test_inspect_finds_clipping_gaps_jitter_and_slow_sensors(imufmu, tmp_path):
    rows = np.delete(np.arange(800), np.arange(300, 340))
    rng = np.random.default_rng(3)
    changed = READINGS | {
        "time": MOTION["time"] + rng.normal(0, 5e-4, 800),
        "gyro": np.clip(MOTION["gyro"], -0.8, 0.8),
        "accel": MOTION["accel"][np.arange(800) // 4 * 4],
    }
    write_csv(tmp_path / "walk.csv", {name: values[rows] for name, values in changed.items()})
    code, text, _ = imufmu("inspect", "walk.csv")
    assert code == 0
    for words in ("40 samples missing", "the longest of 0.4 s at", " ms RMS", "clipped there", "accel repeats"):
        assert words in text, words


def test_a_magnetometer_that_points_up_is_doubted(imufmu, tmp_path):
    write_csv(tmp_path / "walk.csv", READINGS | {"mag": -MOTION["mag"]})
    assert "mag points up" in imufmu("inspect", "walk.csv")[1]
    write_csv(tmp_path / "walk.csv", READINGS | {"mag": MOTION["mag"]})
    assert "mag points up" not in imufmu("inspect", "walk.csv")[1]


def test_inspect_shows_the_columns_of_what_it_cannot_read(imufmu, log):
    code, text, errors = imufmu("inspect", log)
    assert code == 2
    assert "'wx'" in text and "column 7" in text
    assert errors.count("\n") == 1 and "missing: accel[1]" in errors


def test_inspect_lists_a_folder(imufmu, tmp_path):
    (tmp_path / "logs").mkdir()
    write_csv(tmp_path / "logs" / "a.csv", READINGS)
    (tmp_path / "logs" / "b.csv").write_text("nothing")
    code, text, errors = imufmu("inspect", "logs")
    assert code == 0
    assert text.splitlines()[1].split()[:5] == ["a.csv", "100", "Hz", "7.99", "s"]
    assert "b.csv" in errors
    assert json.loads(imufmu("inspect", "logs", "--json")[1])["recordings"][0]["fits"] is True
    (tmp_path / "empty").mkdir()
    assert imufmu("inspect", "empty")[0] == 2


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["none.csv"], "none.csv: cannot read"),
        (["walk.csv", "--axes", "NEU"], "no convention is called 'NEU'"),
        (["walk.csv", "--mount", "x,y,-z"], "mirror image"),
        (["walk.csv", "--columns", "gyro"], "give 3 columns"),
        (["walk.csv", "--rate", "-1"], "cannot be"),
        (["walk.csv", "--time", "t"], "no column 't' for time"),
    ],
)
def test_what_cannot_be_is_one_line(imufmu, tmp_path, arguments, words):
    write_csv(tmp_path / "walk.csv", READINGS)
    for verb in ("inspect", "replay"):
        code, _, errors = imufmu(verb, *arguments)
        assert code == 2
        assert words in errors and "Traceback" not in errors
