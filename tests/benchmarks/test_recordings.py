"""The benchmark: filters scored on folders of real recordings, and what that asks of parameters and peers."""

from __future__ import annotations

import csv
import json
import math
import re
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat
from scipy.spatial.transform import Rotation

from imufmu.benchmarks import peers
from imufmu.benchmarks.contenders import FOR_REAL_RECORDINGS, TILT_TIME, with_real_parameters
from imufmu.benchmarks.recordings import DELAY, Benchmark, benchmark
from imufmu.benchmarks.summary import tables, write_scores
from imufmu.compiled.running import run
from imufmu.cosim.replay import estimator_fmu, replay
from imufmu.estimators import plumb
from imufmu.files.atomic import WriteError
from imufmu.files.csv_table import write_csv
from imufmu.recordings.reading import read
from imufmu.scoring import metrics
from support.optional import needs
from support.places import ROOT

PEERS = {contender.name: contender for contender in peers.peers()}
needs_peers = needs("vqf", "imufusion", "riann")

G = 9.81
PERIOD = 0.005
REST = 4.0  # s at the start of a recording


def rocking(duration: float = 12.0, bias: float = 0.0, ahead: float = 0.0, rest: float = REST) -> dict[str, np.ndarray]:
    """A sensor at rest, then rocking about its x axis without any acceleration; noise-free readings.

    bias: of the gyroscope, rad/s, about y. ahead: of the truth, s.
    """
    time = np.arange(round(duration / PERIOD)) * PERIOD

    def roll(t: np.ndarray) -> np.ndarray:
        return 0.2 + 0.5 * (1 - np.cos(3 * np.maximum(t - rest, 0)))

    rate = 1.5 * np.sin(3 * np.maximum(time - rest, 0))
    return {
        "time": time,
        "gyro": np.column_stack([rate, np.full_like(time, bias), 0 * time]),
        "accel": G * np.column_stack([0 * time, np.sin(roll(time)), np.cos(roll(time))]),
        "roll": roll(time + ahead),
        "pitch": 0 * time,
    }


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Two recordings with truth."""
    write_csv(tmp_path / "calm.csv", rocking())
    write_csv(tmp_path / "drifting.csv", rocking(bias=0.01))
    return tmp_path


def rmse_of(result: Benchmark, contender: str, recording: str, *, real: bool = False, delay: float = 0.0) -> float:
    (found,) = [
        s.inclination_rmse_deg
        for s in result.scores
        if (s.contender, s.recording, s.delay) == (contender, recording, delay) and ("real" in s.contest) == real
    ]
    return found


# Scores


def test_a_score_is_what_a_replay_through_the_fmu_gives(folder: Path) -> None:
    """The same numbers from the run in this process; 1e-12 as for every backend."""
    result = benchmark(folder, ["lee2012"])
    recording = read(folder / "drifting.csv")
    replayed = replay(recording, estimator_fmu("lee2012"), {"mode": 2}).signals()
    expected = metrics.summary(metrics.errors(replayed, recording.truth))["tilt_rmse_deg"]
    assert rmse_of(result, "lee2012 mode=2", "drifting") == pytest.approx(expected, rel=1e-12)


def test_a_truth_that_runs_ahead_costs_rate_times_delay_and_delaying_it_mends_that(tmp_path: Path) -> None:
    write_csv(tmp_path / "ahead.csv", rocking(ahead=0.0023))
    result = benchmark(tmp_path, ["rizun2008"], delay=0.0023)
    raw = rmse_of(result, "rizun2008", "ahead", real=True)
    moving = (12 - REST) / 12  # of the time, at 1.5 rad/s, a sine: 8 s are nearly 4 whole periods of the rate
    expected = math.degrees(0.0023 * 1.5 * math.sqrt(moving / 2))
    assert raw == pytest.approx(expected, rel=0.05)
    assert rmse_of(result, "rizun2008", "ahead", real=True, delay=0.0023) < 0.1 * raw


def test_gyro_bias_of_the_rest_is_removed_for_real_recordings_only(folder: Path) -> None:
    result = benchmark(folder, ["rizun2008"])
    assert rmse_of(result, "rizun2008", "drifting", real=True) == pytest.approx(
        rmse_of(result, "rizun2008", "calm", real=True), abs=1e-6
    )
    assert rmse_of(result, "rizun2008", "drifting") > 2  # deg; 0.01 rad/s at the paper's cut-off: 6 deg in the end
    left = benchmark(folder, ["rizun2008"], rest=0.0)
    assert rmse_of(left, "rizun2008", "drifting", real=True) > 0.5


@pytest.mark.parametrize("rest", [0.5, 0.0])
def test_a_start_in_motion_is_not_taken_for_rest(tmp_path: Path, rest: float) -> None:
    write_csv(tmp_path / "moving.csv", rocking(rest=rest))
    result = benchmark(tmp_path, ["rizun2008"])
    assert list(result.notes) == ["no rest in the first 3 s, so gyro bias left in: moving"]
    untouched = benchmark(tmp_path, ["rizun2008"], rest=0.0)
    assert rmse_of(result, "rizun2008", "moving", real=True) == rmse_of(untouched, "rizun2008", "moving", real=True)


def test_gaps_in_readings_and_truth_are_no_obstacle(tmp_path: Path) -> None:
    """Also for peers, which cannot take NaN."""
    columns = rocking()
    columns["gyro"][900:905] = np.nan
    columns["accel"][1000:1003, 1] = np.nan
    columns["roll"][1200:1300] = np.nan
    write_csv(tmp_path / "gaps.csv", columns)
    result = benchmark(tmp_path)
    assert {s.contender for s in result.scores} >= {"lee2012", "leechoi2018", "rizun2008", *PEERS}
    assert all(0 < s.inclination_rmse_deg < 10 for s in result.scores)


def test_a_row_that_is_not_there_counts_as_a_sample_without_reading_and_truth(tmp_path: Path) -> None:
    columns = rocking()
    hole = slice(900, 950)
    write_csv(tmp_path / "short.csv", {name: np.delete(values, hole, axis=0) for name, values in columns.items()})
    for name in ("gyro", "accel", "roll"):
        columns[name][hole] = np.nan
    write_csv(tmp_path / "full.csv", columns)
    result = benchmark(tmp_path, ["rizun2008"], delay=0.0)
    assert rmse_of(result, "rizun2008", "short") == rmse_of(result, "rizun2008", "full")


def test_a_sample_with_no_truth_that_long_before_does_not_count(folder: Path) -> None:
    with pytest.raises(ValueError, match="no sample counts"):
        benchmark(folder, ["rizun2008"], delay=12.0)


# Parameters and peers


@pytest.mark.parametrize(
    "contender", [c for c in with_real_parameters() if c.name in FOR_REAL_RECORDINGS], ids=lambda c: c.name
)
def test_a_constant_bias_tilts_every_paper_by_the_same_time(contender: Any) -> None:
    """Within 1 %: half a sample period and the variances left out of the rule of thumb, together 0.7 %."""
    n = 12000
    readings = {"gyro": np.tile([0.0, 0.002, 0.0], (n, 1)), "accel": np.tile([0.0, 0.0, G], (n, 1))}
    vertical = contender.estimate(readings, PERIOD)["vertical"]
    tilt = math.acos(vertical[-1] @ [0, 0, 1])
    assert tilt == pytest.approx(TILT_TIME * 0.002, rel=0.01)


@needs_peers
@pytest.mark.parametrize("name", ["VQF", "BasicVQF", "imufusion", "RIANN"])
def test_peers_report_the_up_vector_of_a_moving_sensor(name: str) -> None:
    columns = rocking()
    up = PEERS[name].estimate(columns, PERIOD)["vertical"]
    true_up = np.column_stack([0 * columns["roll"], np.sin(columns["roll"]), np.cos(columns["roll"])])
    settled = columns["time"] > REST  # imufusion and RIANN start upright
    error = np.rad2deg(metrics.inclination_error(up[settled], true_up[settled]))
    assert error.max() < 2  # wrong axes or signs would give tens; RIANN, which is learnt, has 1


@needs_peers
def test_a_filter_can_be_left_out(folder: Path) -> None:
    result = benchmark(folder, ["rizun2008"], without=["RIANN", "imufusion"])
    assert {s.contender for s in result.scores} == {"rizun2008", "VQF", "BasicVQF"}


def test_without_the_peers_the_estimators_are_scored_alone(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(peers, "find_spec", lambda name: None)
    assert {s.contender for s in benchmark(folder, ["rizun2008"], without=["RIANN"]).scores} == {"rizun2008"}


# Tables and files


def test_groups_are_means_over_their_recordings(folder: Path) -> None:
    groups = [{"name": name} for name in ("all_trials", "biased", "absent")]
    trials = {"drifting": {"groups": ["all_trials", "biased"]}, "calm": {"groups": ["all_trials"]}}
    (folder / "trials.json").write_text(json.dumps({"groups": groups, "trials": trials}))
    result = benchmark(folder, ["rizun2008"], delay=DELAY)
    first, second, *_ = tables(result)
    assert first.heading == "Inclination RMSE (deg), parameters of the papers, truth as recorded"
    assert second.heading.endswith("truth delayed by 2.3 ms")
    assert [row[0] for row in first.table.rows] == ["mean of 2", "biased (1)"]
    both = [rmse_of(result, "rizun2008", name) for name in ("calm", "drifting")]
    assert first.table.columns[1] == "rizun2008"
    assert [row[1] for row in first.table.rows] == [f"{np.mean(both):.2f}", f"{both[1]:.2f}"]


def test_without_groups_every_recording_is_a_row(folder: Path) -> None:
    section = tables(benchmark(folder, ["rizun2008"], delay=0.0))
    assert [row[0] for row in section[0].table.rows] == ["mean of 2", "calm", "drifting"]


def test_nees_is_the_squared_error_over_the_squared_tilt_std(folder: Path) -> None:
    result = benchmark(folder, ["plumb"], delay=0.0)
    recording = read(folder / "drifting.csv")
    replayed = run(plumb.BLOCK, recording.readings, {"sample_period": PERIOD})
    error = metrics.inclination_error(replayed["vertical"], recording.truth["vertical"])[recording.scored]
    expected = np.mean((error / replayed["tilt_std"][recording.scored]) ** 2)
    found = [s.nees for s in result.scores if (s.contender, s.recording) == ("plumb", "drifting")]
    assert found == pytest.approx([expected] * 2, rel=1e-12)  # plumb has one set of parameters for both contests
    assert math.isnan(next((s.nees for s in result.scores if s.contender == "VQF"), math.nan))
    (honesty,) = (section for section in tables(result) if section.heading.startswith("NEES"))
    rows = dict(honesty.table.rows)
    assert list(rows)[:3] == ["mean of 2", "calm", "drifting"] and rows["drifting"] == f"{expected:.2f}"
    values = [s.nees for s in result.scores if s.contest == result.judged]
    assert rows["recordings below 0.3"] == str(sum(value < 0.3 for value in values))
    assert rows["largest"] == f"{max(values):.2f}"


def test_the_heading_is_scored_where_there_is_a_magnetometer(tmp_path: Path) -> None:
    """Truth turned by 0.1 rad against the field: that is the error as recorded, and none once it is aligned."""
    record = rocking()
    roll = record["roll"]
    field = np.column_stack([0 * roll, 20 * np.cos(roll) - 45 * np.sin(roll), -20 * np.sin(roll) - 45 * np.cos(roll)])
    attitude = Rotation.from_euler("ZYX", np.column_stack([0 * roll + 0.1, 0 * roll, roll]))
    write_csv(tmp_path / "nine.csv", record | {"mag": field, "q_NS": np.roll(attitude.as_quat(), 1, axis=1)})
    write_csv(tmp_path / "six.csv", record)
    result = benchmark(tmp_path, ["plumb"])
    scores = {s.contender: s for s in result.headings}
    assert {s.recording for s in result.headings} == {"nine"}
    assert scores["plumb"].rmse_deg == pytest.approx(math.degrees(0.1), abs=0.1)  # the filter's own lag
    assert scores["plumb"].aligned_rmse_deg < 0.1
    table = tables(result)[-1].table
    assert table and table.columns[1:3] == ["plumb", "plumb, aligned"]
    assert table.rows[-1][:2] == ["nine", f"{scores['plumb'].rmse_deg:.2f}"]


def test_a_delayed_truth_is_explained_in_a_sentence(folder: Path) -> None:
    as_recorded, delayed, *_ = tables(benchmark(folder, ["rizun2008"], delay=DELAY))
    assert not any("truth" in point for point in as_recorded.points)
    assert delayed.points[0] == "each sample against the truth of 2.3 ms before"


def test_only_trials_of_broad_are_taken_for_recorded_with_its_delay(folder: Path) -> None:
    """Of the clocks of other recordings nothing is known, unless the user says it."""
    columns = rocking(duration=4.0, rest=0.0)
    attitude = np.column_stack([np.cos(columns["roll"] / 2), np.sin(columns["roll"] / 2)])
    broad = {"imu_gyr": columns["gyro"], "imu_acc": columns["accel"], "imu_mag": columns["accel"]}
    broad |= {"opt_quat": np.pad(attitude, ((0, 0), (0, 2))), "movement": np.ones((len(attitude), 1))}
    savemat(folder / "trial.mat", broad | {"sampling_rate": np.array([[1 / PERIOD]])})
    result = benchmark(folder, ["plumb"])
    delays = {name: {s.delay for s in result.scores if s.recording == name} for name in ("trial", "calm", "drifting")}
    assert delays == {"trial": {0.0, DELAY}, "calm": {0.0}, "drifting": {0.0}}
    sections = {section.heading: section for section in tables(result)}
    (delayed,) = (
        s for heading, s in sections.items() if "papers, truth delayed by 2.3 ms where it is BROAD's" in heading
    )
    assert delayed.points[0].endswith("ms before: in every trial of BROAD it is ahead by that")
    assert [row[0] for row in delayed.table.rows] == ["mean of 3", "calm", "drifting", "trial"]
    own = {(s.recording, s.delay) for s in result.scores if s.own}
    assert own == {("trial", DELAY), ("calm", 0.0), ("drifting", 0.0)}


def test_the_csv_file_holds_every_score_bit_for_bit(folder: Path, tmp_path: Path) -> None:
    result = benchmark(folder, ["lee2012"])
    write_scores(tmp_path / "s.csv", result)
    with open(tmp_path / "s.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(result.scores)
    for row, score in zip(rows, result.scores, strict=True):
        assert float(row["inclination_rmse_deg"]) == score.inclination_rmse_deg
        assert (row["filter"], row["recording"]) == (score.contender, score.recording)
    assert {row["parameters"] for row in rows if row["filter"] == "lee2012 mode=3"} == {"mode=3"}


def test_scores_never_overwrite_a_recording(folder: Path) -> None:
    result = benchmark(folder, ["rizun2008"])
    before = (folder / "calm.csv").read_bytes()
    with pytest.raises(WriteError, match=r"calm\.csv: cannot write: it is read here"):
        write_scores(folder / "calm.csv", result)
    assert (folder / "calm.csv").read_bytes() == before


# The command


@pytest.fixture
def imufmu(imufmu):
    """The command ``imufmu benchmark``."""
    return partial(imufmu, "benchmark")


def test_the_command_prints_tables_parameters_and_what_it_left_out(imufmu, folder):
    (folder / "notes.csv").write_text("not,a,recording\n1,2,3\n")
    write_csv(folder / "untrue.csv", {k: v for k, v in rocking().items() if k not in ("roll", "pitch")})
    code, text, errors = imufmu(folder, "-e", "rizun2008", "--csv", "s.csv")
    assert code == 0, errors
    assert text.count("Inclination RMSE (deg)") == 2
    assert "BROAD" not in text + errors
    assert "  rizun2008: cutoff=0.4714 g=9.81 gyro_index=2\n" in text
    assert re.search(r"^mean of 2 +\d+\.\d\d", text, re.MULTILINE)
    assert "note: left out: " in errors and "notes.csv" in errors and "untrue.csv: no true attitude" in errors
    assert (folder / "s.csv").is_file()


def test_a_users_mistake_is_one_clear_message_and_exit_code_2(imufmu, tmp_path):
    (tmp_path / "empty").mkdir()
    (tmp_path / "untrue").mkdir()
    write_csv(tmp_path / "untrue" / "walk.csv", {k: v for k, v in rocking().items() if k not in ("roll", "pitch")})
    (tmp_path / "torn").mkdir()
    (tmp_path / "torn" / "trials.json").write_text('{"groups": 3}')
    (tmp_path / "torn" / "walk.csv").write_text("")
    for arguments, expected in (
        (["none"], "none: no such file or folder"),
        (["empty", "none"], "none: no such file or folder"),
        (["none/*.csv"], "none/*.csv: no file and no folder fits this pattern"),
        (["untrue/walk.csv"], "walk.csv: no true attitude"),
        (["untrue", "--group", "("], "not a regular expression"),
        (["untrue", "--group", "stairs"], "'stairs': fits no recording, as untrue/walk.csv"),
        (["untrue", "--set", "gyro_index=1"], "name estimator and parameter, as plumb.gyro_index"),
        (["untrue", "--set", "plum.gyro_index=1"], "did you mean plumb?"),
        (["untrue", "--set", "plumb.gyro=1"], "gyro: unknown; plumb has"),
        (["untrue", "--set", "plumb.gyro_index=9"], "gyro_index = 9 is outside [0, 3]"),
        (["untrue", "--json", "s.txt"], ".json"),
        (["untrue", "--without", "plum"], "no filter is called 'plum'"),
        (["untrue", "--csv", "untrue/walk.csv"], "it is read here"),
        (["empty"], "empty: no recording to score"),
        (["untrue"], "walk.csv: no true attitude"),
        (["torn"], "trials.json: not the list of trials"),
        (["empty", "-e", "lee2013"], "is called 'lee2013'; there is lee2012, leechoi2018, rizun2008"),
        (["empty", "-e", "zihajehzadeh2014"], "no estimator of tilt from gyro and accel"),
        (["empty", "--csv", "s.txt"], ".csv"),
        (["empty", "--rest-bias", "-1"], "--rest-bias"),
    ):
        code, _, errors = imufmu(*arguments)
        assert code == 2, arguments
        assert expected in errors, errors
        assert "Traceback" not in errors


# Real recordings


def test_two_trials_of_broad_score_as_replayed(tmp_path, broad):
    """Figures of docs/recordings.md, three digits, from the replay through the FMU."""
    for trial in ("01_undisturbed_slow_rotation_A", "15_undisturbed_fast_translation_A"):
        (tmp_path / f"{trial}.mat").symlink_to(broad / f"{trial}.mat")
    (tmp_path / "trials.json").symlink_to(broad / "trials.json")
    result = benchmark(tmp_path, ["lee2012"], without=PEERS)
    assert rmse_of(result, "lee2012", "01_undisturbed_slow_rotation_A") == pytest.approx(0.832, abs=5e-4)
    assert rmse_of(result, "lee2012", "15_undisturbed_fast_translation_A") == pytest.approx(15.626, abs=5e-4)
    assert list(result.groups)[:3] == ["all_trials", "undisturbed", "rotation"]


@pytest.mark.slow
@needs_peers
def test_the_page_on_recordings_tells_what_the_benchmark_prints(broad):
    """One row per filter: mean with the papers' parameters, truth delayed, with those for real recordings, delayed.

    Then one of every table per kind of recording, and the means of the heading errors in the text.
    """
    page = (ROOT / "docs" / "recordings.md").read_text(encoding="utf-8")
    sections = [section for section in tables(benchmark(broad)) if section.table]
    means: dict[str, list[str]] = {}
    for section in sections:
        if section.heading.startswith("Inclination RMSE"):
            for name, mean in zip(section.table.columns[1:], section.table.rows[0][1:], strict=True):
                means.setdefault(name, []).append(mean)
    for name, row in means.items():
        assert f"| {name} | {' | '.join(row)} |" in page, row
    (heading,) = (section.table for section in sections if section.heading.startswith("Heading RMSE"))
    for mean in heading.rows[0][heading.columns.index("plumb") :]:
        assert re.search(rf"\b{re.escape(mean)}\b", page), mean


@pytest.mark.slow
@needs_peers
@pytest.mark.parametrize("kind", ["car", "chain", "handheld", "phone", "robot"])
def test_the_page_on_recordings_tells_what_each_kind_gives(kind, broad):
    if not (folder := broad.parent / "field" / kind).is_dir():
        pytest.skip(f"no recordings in {folder}")
    page = (ROOT / "docs" / "recordings.md").read_text(encoding="utf-8")
    result = benchmark(folder)
    (section,) = (s for s in tables(result) if s.heading.startswith("Inclination RMSE (deg), parameters for real"))
    assert section.table
    assert f"| {kind} ({len(result.files)}) | {' | '.join(section.table.rows[0][1:])} |" in page
