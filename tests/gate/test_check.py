"""``imufmu check``: a verdict as a line per limit, an exit code, JUnit, JSON, a page and tests of pytest."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import pytest

from imufmu.cosim.master import locate
from imufmu.gate.limits import required
from imufmu.gate.trials import Plan
from imufmu.gate.verdict import check_system
from support.rogue import Fault, rogue_system

Command = Callable[..., tuple[int, str, str]]
SHORT = ("--stop", "0.5")  # s; a run takes a second
HOLDS, BREAKS = "plumb.tilt.max < 30 deg", "plumb.tilt.max < 1e-6 deg"
BY_SEED = "imu.gyro[1].mean < 1e-9 rad/s"  # noise decides


def test_a_limit_that_holds_is_exit_code_0_and_one_that_breaks_is_1(imufmu: Command) -> None:
    code, out, _ = imufmu("check", "pendulum_lee2012", "--require", HOLDS, *SHORT)
    assert code == 0
    assert "every limit holds" in out
    code, out, err = imufmu("check", "pendulum_lee2012", "--require", HOLDS, "--require", BREAKS, *SHORT)
    assert code == 1
    assert "1 of 2 limits broken" in out
    assert "BROKEN" in out
    assert "Traceback" not in err


def test_the_verdict_is_written_for_programs_and_people(imufmu: Command, tmp_path: Path) -> None:
    asked = ("--require", HOLDS, "--require", BREAKS, "--seeds", 2, "--jobs", 1, *SHORT)
    files = ("--junit", "v.xml", "--json", "v.json", "--report", "v.html")
    assert imufmu("check", "pendulum_lee2012", *asked, *files)[0] == 1
    suite = ElementTree.parse(tmp_path / "v.xml").getroot().find("testsuite")
    assert suite is not None
    assert (suite.get("tests"), suite.get("failures")) == ("2", "1")
    failure = suite.find("testcase/failure")
    assert failure is not None
    assert "seed 1, t = " in (failure.get("message") or "")
    content = json.loads((tmp_path / "v.json").read_text(encoding="utf-8"))
    assert (content["passed"], content["runs"], content["planned"]) == (False, 2, 2)
    assert [limit["passed"] for limit in content["limits"]] == [True, False]
    page = (tmp_path / "v.html").read_text(encoding="utf-8")
    assert "1 of 2 limits broken" in page
    assert page.count("data:image/png") == 2


def test_a_limits_file_beside_the_system_is_found_and_names_its_system(imufmu: Command, tmp_path: Path) -> None:
    folder = tmp_path / "mine"
    folder.mkdir()
    shutil.copy(locate("pendulum_lee2012"), folder / "mine.ssd")
    shutil.copy(locate("pendulum_lee2012").parents[1] / "imus" / "mtx.ssv", folder / "mtx.ssv")
    (folder / "mine.ssd").write_text(
        (folder / "mine.ssd").read_text(encoding="utf-8").replace("../imus/", ""), encoding="utf-8"
    )
    limits = folder / "mine.limits.toml"
    limits.write_text(
        'stop_time = "0.5 s"\n[[limit]]\nquantity = "plumb.tilt"\nstatistic = "max"\nat_most = "30 deg"\n'
    )
    for target in (folder / "mine.ssd", limits):
        code, out, err = imufmu("check", target)
        assert code == 0, err
        assert "max of plumb.tilt ≤ 30 deg" in out
    code, _, err = imufmu("check", "pendulum_lee2012", "--limits", "none.limits.toml")
    assert code == 2
    assert "none.limits.toml" in err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["pendulum_lee"], "no system is called 'pendulum_lee'"),
        (["pendulum_lee2012", "--require", "plumb.tlt.max < 2 deg", *SHORT], "did you mean plumb.tilt?"),
        (["pendulum_lee2012", "--require", "plumb.tilt.max < 2", *SHORT], "needs a unit"),
        (["pendulum_lee2012", "--require", "plumb.tilt.max <", *SHORT], "--require: 'plumb.tilt.max <' cannot be read"),
    ],
)
def test_wrong_input_is_exit_code_2_and_one_line(arguments: list[str], said: str, imufmu: Command) -> None:
    code, _, err = imufmu("check", *arguments)
    assert code == 2
    assert said in " ".join(err.split())
    assert "Traceback" not in err


def test_a_system_without_limits_is_no_verdict(imufmu: Command, tmp_path: Path) -> None:
    code, _, err = imufmu("check", rogue_system(tmp_path))
    assert code == 2
    assert "no limits: there is no rogues.limits.toml beside it" in " ".join(err.split())


def test_a_run_that_fails_breaks_the_limit_and_says_why(imufmu: Command, tmp_path: Path) -> None:
    system = rogue_system(tmp_path)
    asked = ("check", system, "--require", "rogue.y.highest < 1e9", "--json", "v.json")
    assert imufmu(*asked)[0] == 0
    code, out, _ = imufmu(*asked, "--set", f"rogue.fault={int(Fault.SEGMENTATION)}")
    assert code == 1
    assert "BROKEN" in out
    (limit,) = json.loads((tmp_path / "v.json").read_text(encoding="utf-8"))["limits"]
    assert "SIGSEGV" in limit["where"]
    assert limit["value"] is None


def test_the_verdict_does_not_depend_on_the_number_of_processes() -> None:
    plan = Plan("pendulum_lee2012", stop_time=0.3)
    limits = [required(BY_SEED), required(HOLDS)]
    one, two = (check_system(plan, limits, 4, jobs) for jobs in (1, 2))
    assert one.checks == two.checks
    assert (one.worst, one.runs) == (two.worst, two.runs)


def test_no_further_run_is_made_once_the_verdict_is_certain() -> None:
    outcome = check_system(Plan("pendulum_lee2012", stop_time=0.3), [required(BREAKS)], 50, 1)
    assert (outcome.passed, outcome.runs, outcome.planned) == (False, 1, 50)
    assert any("1 of 50 runs were enough" in note for note in outcome.notes)


def test_limits_files_are_tests_of_pytest(tmp_path: Path) -> None:
    path = tmp_path / "swing.limits.toml"
    limit = (
        '[[limit]]\nname = "{}"\nreason = "the platform"\nquantity = "plumb.tilt"\nstatistic = "max"\nat_most = "{}"\n'
    )
    head = 'system = "pendulum_lee2012"\nstop_time = "0.3 s"\n'
    path.write_text(head + limit.format("holds", "30 deg") + limit.format("breaks", "1e-6 deg"))
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert "1 failed, 1 passed" in done.stdout
    assert "breaks: " in done.stdout
    assert "the platform" in done.stdout
    assert "Traceback" not in done.stdout
    path.write_text(head + "[[limt]]\n")
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert "no key is called 'limt'; did you mean limit?" in done.stdout
