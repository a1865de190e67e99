"""What is printed: on any terminal, in a pipe, and for programs."""

from __future__ import annotations

import io
import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from threading import Event

import pytest

from imufmu.cli import console
from imufmu.cli.arguments import parsed_sets
from imufmu.cli.main import main
from imufmu.papers import validate as gate
from imufmu.papers.experiment import Outcome
from imufmu.papers.validate import Verdict
from imufmu.registry import BLOCKS
from imufmu.scoring.checks import Check
from imufmu.scoring.table import Table

Command = Callable[..., tuple[int, str, str]]


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], Callable[..., tuple[int, str]]]:
    """Run the command with a standard output of this encoding; returns exit code and what was printed."""

    def of(encoding: str) -> Callable[..., tuple[int, str]]:
        def call(*arguments: object) -> tuple[int, str]:
            printed = io.BytesIO()
            monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(printed, encoding))
            monkeypatch.setattr(sys, "argv", ["imufmu", *map(str, arguments)])
            try:
                main()
                code = 0
            except SystemExit as end:
                code = int(end.code or 0)
            sys.stdout.flush()
            return code, printed.getvalue().decode(encoding)

        return call

    return of


ENCODINGS = ("ascii", "cp1252", "cp1251", "utf-8")


def failing(*_arguments: object, **_options: object) -> list[Verdict]:
    checks = [Check("speed is kept", 1.0, 2.0, at_most=False, unit="m/s²", reason="µ ≥ 0 — 多")]
    return [Verdict("lee2012", "title", "reference", 1.0, Outcome([], checks, ["90° ± 1"]))]


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_a_failing_gate_writes_its_files_and_its_table_on_any_terminal(
    encoding: str, terminal: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(gate, "validate", failing)
    monkeypatch.chdir(tmp_path)
    code, text = terminal(encoding)("validate", "--junit", "v.xml", "--json", "v.json", "--report", "v.html")
    assert code == 1
    assert {path.name for path in tmp_path.iterdir()} == {"v.xml", "v.json", "v.html"}
    assert "m/s²" in (tmp_path / "v.xml").read_text(encoding="utf-8")
    assert text.count("wrote ") == 3
    expected = {
        "ascii": (">= 2 m/s2", "u >= 0 - ?", "90deg +- 1"),
        "cp1252": (">= 2 m/s²", "µ >= 0 — ?", "90° ± 1"),
        "cp1251": (">= 2 m/s2", "µ >= 0 — ?", "90° ± 1"),
        "utf-8": ("≥ 2 m/s²", "µ ≥ 0 — 多", "90° ± 1"),
    }[encoding]
    assert all(part in text for part in expected), text


@pytest.mark.parametrize("encoding", ["ascii", "cp1252"])
def test_a_run_is_written_and_its_table_stays_aligned_on_any_terminal(
    encoding: str, terminal: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    code, text = terminal(encoding)("run", "pendulum_lee2012", "--stop", 1, "--output", "r.csv")
    assert code == 0
    assert (tmp_path / "r.csv").is_file()
    header, *rows = text.splitlines()[:3]
    assert header.endswith({"ascii": "(m/s2)", "cp1252": "(m/s²)"}[encoding])
    assert {len(row) for row in rows} == {len(header)}


def test_characters_that_a_table_cannot_show_are_replaced_before_it_is_aligned(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    printed = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(printed, "ascii"))
    console.print_table(Table(["a", "≥…"], [["1", "2"]]))
    sys.stdout.flush()
    assert printed.getvalue().decode().splitlines() == ["a  >=...", "1      2"]


def test_text_between_colons_is_printed_as_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    """It may be a time, or JSON; the library behind would make pictures of words."""
    console.out.print("a:x:b [bold]", markup=False)
    console.notes(["12:30:00 :warning:"])
    assert tuple(capsys.readouterr()) == ("a:x:b [bold]\n", "note: 12:30:00 :warning:\n")


def test_too_little_memory_is_one_line(imufmu: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_arguments: object, **_options: object) -> list[Verdict]:
        raise MemoryError

    monkeypatch.setattr(gate, "validate", fails)
    assert imufmu("validate") == (2, "", "error: not enough memory\n")


def test_a_file_name_that_is_no_text_can_be_printed(terminal: Command, tmp_path: Path) -> None:
    name = os.fsdecode(b"\xff.csv")
    code, _ = terminal("utf-8")("replay", tmp_path / name)
    assert code == 2


def test_tables_are_printed_even_if_a_file_cannot_be_written(
    imufmu: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(gate, "validate", failing)
    (tmp_path / "v.xml").mkdir()
    code, text, errors = imufmu("validate", "--junit", "v.xml", "--json", "v.json")
    assert code == 2 and "v.xml: cannot write" in errors
    assert "speed is kept" in text
    assert (tmp_path / "v.json").is_file()


# In a pipe


def test_long_work_in_a_pipe_tells_now_and_then_how_far_it_is(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(console, "_BETWEEN_LINES", 0.01)
    told = Event()
    monkeypatch.setattr(console.err, "print", lambda text, **_: (print(text, file=sys.stderr), told.set()))
    with console.progress_bar("sawing") as progress:
        assert told.wait(60)
        progress(1, 4)
        told.clear()
        assert told.wait(60)
        told.clear()
        assert told.wait(60)
    first, *_, last = capsys.readouterr().err.splitlines()
    assert re.fullmatch(r"sawing: \d+ s", first)
    assert re.fullmatch(r"sawing: 25 % after \d+ s", last)


def test_each_paper_is_told_of_as_soon_as_it_is_done(imufmu: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    def validate(*_arguments: object, finished: Callable[[Verdict], None], **_options: object) -> list[Verdict]:
        (verdict,) = failing()
        finished(verdict)
        print("between", file=sys.stderr)
        return [verdict]

    monkeypatch.setattr(gate, "validate", validate)
    assert imufmu("validate")[2].splitlines() == ["lee2012: failed after 1 s", "between"]


# For people and programs


@pytest.mark.parametrize("width", [60, 80, 200])
def test_the_list_fits_the_terminal_and_says_everything(
    width: int, imufmu: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    code, text, _ = imufmu("list")
    assert code == 0
    assert max(map(len, text.splitlines())) <= width
    words = " ".join(text.split())
    for name, block in BLOCKS.items():
        assert name in words and all(word in words for word in block.summary.split())


def test_the_list_in_a_pipe_has_a_line_per_entry(imufmu: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("COLUMNS", raising=False)
    lines = imufmu("list")[1].splitlines()
    assert len(lines) == len(json.loads(imufmu("list", "--json")[1]))
    assert all(line.split()[0] in ("estimator", "sensor", "plant", "system", "device") for line in lines)


def test_list_info_and_run_answer_programs_in_json(imufmu: Command) -> None:
    entries = {entry["name"]: entry for entry in json.loads(imufmu("list", "--json")[1])}
    assert entries["plumb"]["kind"] == "estimator" and entries["plumb"]["file"] is None
    assert Path(entries["mtx"]["file"]).is_file() and Path(entries["pendulum_lee2012"]["file"]).is_file()
    told = json.loads(imufmu("info", "lee2012", "--json")[1])
    variables = {variable["name"]: variable for variable in told["variables"]}
    assert told["platforms"] == ["linux64", "win64"] and told["default_step_s"] == 0.01
    assert variables["c_a"] | {"description": ""} == {
        "name": "c_a", "causality": "parameter", "variability": "tunable", "type": "Real", "unit": "1",
        "start": 0.1, "min": 0.0, "max": 1.0, "description": "", "shape": [],
    }  # fmt: skip
    assert variables["use_initial_angles"]["start"] is False and variables["mode"]["start"] == 1
    code, text, _ = imufmu("run", "pendulum_lee2012", "--stop", 1, "--json", "--output", "r.csv")
    run = json.loads(text)
    assert code == 0
    assert (run["system"], run["stop_time_s"], run["rows"]) == ("pendulum_lee2012", 1.0, 101)
    assert 0 < run["estimators"]["lee2012"]["tilt_rmse_deg"] < 90
    assert any("torque" in note for note in run["notes"])


def test_numbers_that_json_cannot_hold_become_null(capsys: pytest.CaptureFixture[str]) -> None:
    console.print_json({"a": [float("nan"), 1.5], "b": float("inf")})
    assert json.loads(capsys.readouterr().out) == {"a": [None, 1.5], "b": None}


def test_every_command_has_short_help(imufmu: Command) -> None:
    for command in ([], ["run"], ["list"]):
        assert imufmu(*command, "-h")[:2] == imufmu(*command, "--help")[:2]


def test_the_doctor_takes_the_name_of_a_block_as_info_does(imufmu: Command) -> None:
    code, text, _ = imufmu("doctor", "lee2012")
    assert code == 0 and re.search(r"^ok +one step +works", text, re.MULTILINE)


def test_parameters_are_numbers_truth_values_vectors_or_text() -> None:
    given = ["a=1", "b=1e-3", "c=true", "d=1, 2.5,3", "e=a,b", 'f="007"', "g=x=y", "h=/tmp/a b"]
    assert parsed_sets(given) == {
        "a": 1, "b": 1e-3, "c": True, "d": [1, 2.5, 3], "e": "a,b", "f": "007", "g": "x=y", "h": "/tmp/a b",
    }  # fmt: skip


# Where FMPy's logging library does not load, as on 64-bit ARM Linux

WITHOUT_PROXY = """
import sys

class Finder:  # fails as the loader of libraries does there
    def find_spec(self, name, path=None, target=None):
        if name == "fmpy.logging":
            raise OSError("logging.so: cannot open shared object file: No such file or directory")

sys.meta_path.insert(0, Finder())
from imufmu.cli.main import main

for command in COMMANDS:
    sys.argv = ["imufmu", *command]
    try:
        main()
    except SystemExit as end:
        assert not end.code, command
"""


def test_commands_work_where_fmpys_logging_library_does_not_load(tmp_path: Path) -> None:
    rows = "\n".join(f"{0.01 * k:.2f},0,0,0.1,0,0,9.81" for k in range(20))
    (tmp_path / "rec.csv").write_text(f"time,gyro[1],gyro[2],gyro[3],accel[1],accel[2],accel[3]\n{rows}\n")
    commands = [["list"], ["info", "lee2012"], ["build", "lee2012"], ["replay", "rec.csv", "-o", "o.csv"]]
    commands += [["doctor", "lee2012.fmu"], ["run", "pendulum_lee2012", "--stop", "0.1", "-o", "r.csv"]]
    program = WITHOUT_PROXY.replace("COMMANDS", repr(commands))
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    assert {path.name for path in tmp_path.iterdir()} == {"rec.csv", "lee2012.fmu", "o.csv", "r.csv"}
