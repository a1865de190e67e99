"""The gate: papers' experiments run side by side, and their verdict is told to people and to programs."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from xml.etree import ElementTree

import pytest

from imufmu.cli import main as cli
from imufmu.papers import validate as gate
from imufmu.papers.validate import PAPERS, Verdict, validate
from imufmu.papers.verdicts import failure_table, verdict_table, write_json, write_page
from imufmu.reports.junit import write_junit
from imufmu.scoring.checks import Check
from support.optional import needs

GOOD = """
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter
from imufmu.papers.experiment import Experiment, Outcome
from imufmu.scoring.checks import Check
from imufmu.reports.page import Section
from imufmu.scoring.table import Table

def run(quick, progress):
    progress(1, 2)
    figure = Figure()
    axis = figure.subplots()
    axis.plot([0, 1], [0, 1])
    axis.xaxis.set_major_formatter(FuncFormatter(lambda x, _: str(x)))  # a figure that cannot be pickled
    sections = [Section("Table I", "Ours beside the paper's.", Table(["test", "here", "paper"], [["A", "1.9", "1.8"]])),
                Section("Fig. 1", figure=figure, caption="A line")]
    checks = [Check("error is small", 1.9 if quick else 1.8, 2.0, unit="deg", reason="Table I says so"),
              Check("ratio is large", 12.0, 4.0, at_most=False, reason="every seed had 6 & more")]
    return Outcome(sections, checks, ["Test C improves with <eps> there, not here."])

EXPERIMENT = Experiment("good", "A good paper", "A. Uthor 2012", run)
"""
BAD = """
import numpy as np
from imufmu.papers.experiment import Experiment, Outcome
from imufmu.scoring.checks import Check

def run(quick, progress):
    checks = [Check("holds", np.float64(1.0), 2.0),
              Check("error is small", np.float64(3.0), 2.0, unit="deg", reason="Table <I>"),
              Check("is a number", float("nan"), 2.0)]
    return Outcome([], checks)

EXPERIMENT = Experiment("bad", "A bad paper", "B. Uthor 2013", run)
"""
BROKEN = """
from imufmu.papers.experiment import Experiment

def run(quick, progress):
    raise ArithmeticError("no\\x00thing \\x1b left")

EXPERIMENT = Experiment("broken", "A broken paper", "C. Uthor 2014", run)
"""
DEAD = "import os\nos._exit(3)\n"
IDLE = "from imufmu.papers.experiment import Experiment, Outcome\n"
IDLE += "EXPERIMENT = Experiment('idle', 'An idle paper', 'D. Uthor 2015', lambda quick, progress: Outcome([], []))\n"


Papers = Callable[..., dict[str, str]]


@pytest.fixture(scope="module")
def papers(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Papers]:
    """Write experiments as modules that other processes can import; returns papers for ``validate``."""
    folder = tmp_path_factory.mktemp("experiments")

    def write(**sources: str) -> dict[str, str]:
        for name, source in sources.items():
            (folder / f"experiment_{name}.py").write_text(source)
        return {name: f"experiment_{name}" for name in sources}

    sys.path.insert(0, str(folder))
    yield write
    sys.path.remove(str(folder))


def verdicts_of(papers: dict[str, str], **options: object) -> dict[str, Verdict]:
    return {verdict.name: verdict for verdict in validate(papers=papers, **options)}


# Running


def test_every_paper_is_run_and_verdicts_come_in_order(papers):
    steps: list[tuple[int, int]] = []
    found = validate(papers=papers(bad=BAD, good=GOOD), quick=True, progress=lambda *step: steps.append(step))
    assert [verdict.name for verdict in found] == ["bad", "good"]
    assert [verdict.passed for verdict in found] == [False, True]
    assert found[1].checks[0].value == 1.9  # quick arrives
    assert found[1].title == "A good paper" and found[1].seconds > 0
    assert steps[-1] == (2000, 2000)
    assert all(done <= total for done, total in steps)


def test_papers_can_be_chosen_and_are_run_once(papers):
    known = papers(bad=BAD, good=GOOD)
    assert [verdict.name for verdict in validate(["good", "good"], papers=known)] == ["good"]
    with pytest.raises(ValueError, match="no paper is called 'goof'; there is bad, good"):
        validate(["good", "goof"], papers=known)


def test_an_experiment_that_breaks_off_fails_and_leaves_the_others_alone(papers):
    found = verdicts_of(papers(broken=BROKEN, good=GOOD, missing="raise ImportError('no such equation')"))
    assert not found["broken"].passed and "ArithmeticError: no" in found["broken"].error
    assert found["broken"].title == "A broken paper"
    assert not found["missing"].passed and "no such equation" in found["missing"].error
    assert found["good"].passed


def test_a_process_that_dies_is_a_failure_not_a_hang(papers):
    found = verdicts_of(papers(dead=DEAD))
    assert not found["dead"].passed and "BrokenProcessPool" in found["dead"].error


@needs("POSIX")  # sends SIGINT as a terminal does there
def test_an_experiment_leaves_ctrl_c_to_the_parent_process(papers):
    signalled = GOOD.replace("    progress(1, 2)\n", "    os.kill(os.getpid(), signal.SIGINT)\n")
    found = verdicts_of(papers(signalled="import os, signal\n" + signalled))
    assert found["signalled"].passed, found["signalled"].error


def test_checking_nothing_is_not_passing(papers):
    found = verdicts_of(papers(idle=IDLE))
    assert not found["idle"].passed
    assert failure_table(list(found.values())).rows[0][1] == "checks nothing"


def test_the_smallest_margin_is_that_of_the_worst_check_and_nan_is_worse_than_any():
    def table_of(*checks: Check) -> list[str]:
        outcome = gate.Outcome([], checks)
        return verdict_table([Verdict("p", "P", "", 1.0, outcome)]).rows[0]

    fine, close = Check("a", 1.0, 4.0), Check("b", 9.0, 8.0, at_most=False)
    exact = Check("e", 0.0, 0.0)
    assert table_of(fine, close, exact) == ["p", "passed", "3", "0", "12.5 %", "1.0"]
    assert table_of(fine, Check("c", 5.0, 4.0)) == ["p", "failed", "1", "1", "-25.0 %", "1.0"]
    assert table_of(fine, Check("d", float("nan"), 4.0)) == ["p", "failed", "1", "1", "-", "1.0"]


# Telling


@pytest.fixture(scope="module")
def found(papers: Papers) -> list[Verdict]:
    """A paper that passes, one that fails, one that breaks off."""
    return validate(papers=papers(good=GOOD, bad=BAD, broken=BROKEN), drawn=True)


@pytest.fixture
def imufmu(imufmu, found, monkeypatch):
    """Run ``imufmu validate`` as if the experiments were ``found``; returns exit code, output, standard error."""

    def ready(names: Sequence[str], **options: object) -> list[Verdict]:
        return [verdict for verdict in found if verdict.name in (names or ("good", "bad", "broken"))]

    monkeypatch.setattr(gate, "validate", ready)
    return partial(imufmu, "validate")


def test_passing_is_exit_code_0_and_says_what_does_not_reproduce(imufmu):
    code, text, _ = imufmu("good")
    assert code == 0
    assert "good" in text and "passed" in text and "failed" in text.splitlines()[0]
    assert "remark on good: Test C improves with <eps> there, not here." in text
    assert "criterion not met" not in text


def test_failing_is_exit_code_1_and_names_value_limit_margin_and_reason(imufmu):
    code, text, errors = imufmu()
    assert code == 1
    (line,) = [line for line in text.splitlines() if line.startswith("bad") and "error is small" in line]
    assert line.split("  ")[-1] == "Table <I>" and "3 deg" in line and "≤ 2 deg" in line and "-50.0 %" in line
    assert any(line.startswith("broken") and "broke off: ArithmeticError" in line for line in text.splitlines())
    assert "Traceback" not in text + errors


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["--junit", "v.txt"], ".xml"),
        (["--report", "none/v.html"], "no folder"),
        (["--json", "v.xml"], ".json"),
    ],
)
def test_a_file_that_cannot_be_written_is_refused_before_any_work(imufmu, monkeypatch, arguments, expected):
    monkeypatch.setattr(gate, "validate", pytest.fail)
    code, _, errors = imufmu(*arguments)
    assert code == 2 and expected in errors and "Traceback" not in errors
    assert list(Path().iterdir()) == []


def test_junit_has_a_suite_per_paper_and_a_case_per_check(imufmu):
    imufmu("--junit", "v.xml")
    root = ElementTree.parse("v.xml").getroot()
    assert root.tag == "testsuites"
    assert {name: root.get(name) for name in ("tests", "failures", "errors")} == dict(
        tests="6", failures="2", errors="1"
    )
    suites = {suite.get("name"): suite for suite in root}
    assert list(suites) == ["imufmu.validate.good", "imufmu.validate.bad", "imufmu.validate.broken"]
    for suite in root:
        cases = suite.findall("testcase")
        assert int(suite.get("tests")) == len(cases)
        assert int(suite.get("failures")) == len(suite.findall("testcase/failure"))
        assert int(suite.get("errors")) == len(suite.findall("testcase/error"))
        assert all(case.get("classname") == suite.get("name") for case in cases)
        # Each time is written with three digits.
        assert sum(float(case.get("time")) for case in cases) == pytest.approx(float(suite.get("time")), abs=0.002)
    good, bad, broken = root
    assert [case.get("name") for case in good.findall("testcase")] == ["error is small", "ratio is large"]
    assert good.find("testcase/system-out").text == "1.8 deg, limit ≤ 2 deg"
    assert "<eps>" in good.find("system-out").text
    failure = bad.find("testcase/failure")
    assert failure.get("message") == "3 deg, limit ≤ 2 deg" and "Table <I>" in failure.text
    assert "Traceback" in broken.find("testcase/error").text
    assert broken.find("testcase/error").get("message") == "ArithmeticError: no?thing ? left"


def test_json_has_everything_and_null_for_what_is_not_finite(imufmu):
    imufmu("--quick", "--json", "v.json")
    content = json.loads(Path("v.json").read_text(encoding="utf-8"), parse_constant=pytest.fail)
    assert content["quick"] is True and content["passed"] is False
    good, bad, broken = content["papers"]
    assert good["passed"] is True and bad["passed"] is False
    assert good["reference"] == "A. Uthor 2012"
    assert good["tables"][0]["rows"] == [["A", "1.9", "1.8"]]
    assert good["remarks"] == ["Test C improves with <eps> there, not here."]
    expected = dict(name="ratio is large", value=12.0, limit=4.0, at_most=False, unit="1", margin=2.0, passed=True)
    assert good["checks"][1] == expected | {"reason": "every seed had 6 & more", "where": ""}
    assert bad["checks"][2]["value"] is None and bad["checks"][2]["passed"] is False
    assert "ArithmeticError" in broken["error"]


def test_the_page_is_self_contained_and_shows_tables_figures_checks_and_remarks(imufmu):
    imufmu("--report", "v.html")
    page = Path("v.html").read_text(encoding="utf-8")
    for part in (
        "Table I",
        "<td>1.9</td>",
        "every seed had 6 &amp; more",
        "&lt;eps&gt;",
        "Criteria not met",
        "B. Uthor",
    ):
        assert part in page, part
    assert page.count("data:image/png;base64,") == 1
    assert 'class="failed"' in page and 'class="passed"' in page
    assert 'src="http' not in page and "href=" not in page and "<script" not in page


def test_an_unknown_paper_is_one_clear_message_and_exit_code_2(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["imufmu", "validate", "lee2012", "lee2013"])
    with pytest.raises(SystemExit) as end:
        cli.main()
    assert end.value.code == 2
    assert capsys.readouterr().err.startswith("error: no paper is called 'lee2013'; there is lee2012, leechoi2018,")


@pytest.mark.long
@pytest.mark.parametrize("paper", PAPERS)
def test_a_paper_passes_its_quick_run_and_can_be_told_in_every_form(paper, tmp_path):
    found = validate([paper], quick=True, drawn=True)
    assert {verdict.name: verdict.error for verdict in found} == {paper: ""}
    assert [(v.name, check.name, check.value) for v in found for check in v.failed] == []
    for verdict in found:
        names = [check.name for check in verdict.checks]
        assert len(set(names)) == len(names)
        assert all(check.reason for check in verdict.checks)
        assert any(section.figure for section in verdict.outcome.sections)
        assert any(section.table for section in verdict.outcome.sections)
    write_page(tmp_path / "v.html", found, quick=True)
    write_junit(tmp_path / "v.xml", "validate", [verdict.suite() for verdict in found])
    write_json(tmp_path / "v.json", found, quick=True)
    count = sum(len(verdict.checks) for verdict in found)
    assert ElementTree.parse(tmp_path / "v.xml").getroot().get("tests") == str(count)
    assert (tmp_path / "v.html").read_text(encoding="utf-8").count('class="passed"') == count + len(found)


@needs("POSIX")  # sends SIGINT as a terminal does there
def test_ctrl_c_ends_the_experiments_too(tmp_path):
    done = "import pathlib\npathlib.Path('done').touch()\n"
    (tmp_path / "experiment_done.py").write_text(done + IDLE)
    endless = "import os, pathlib, threading\nwhile not pathlib.Path('done').exists(): pass\n"
    endless += "pathlib.Path('starting').write_text(str(os.getpid()))\nos.rename('starting', 'started')\n"
    (tmp_path / "experiment_endless.py").write_text(endless + "threading.Event().wait()\n")
    script = "import signal, sys\nfrom imufmu.cli import main as cli\nfrom imufmu.papers.validate import validate\n"
    script += "if __name__ == '__main__':\n"
    script += (
        "    signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # ignored if the tests run in the background
    )
    script += "    papers = {name: 'experiment_' + name for name in ('done', 'endless')}\n"
    script += "    validate.__kwdefaults__['papers'] = papers\n"
    script += "    sys.argv = ['imufmu', 'validate', '--json', 'v.json']\n    cli.main()\n"
    (tmp_path / "main.py").write_text(script)
    command = [sys.executable, "main.py"]
    process = subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True, start_new_session=True)
    try:
        deadline = time.monotonic() + 60
        while not (tmp_path / "started").exists() and time.monotonic() < deadline:
            assert process.poll() is None, process.stderr.read()
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does
        _, errors = process.communicate(timeout=60)
        assert process.returncode == 130
        assert "Traceback" not in errors
        assert not (tmp_path / "v.json").exists()
        with pytest.raises(ProcessLookupError):
            os.kill(int((tmp_path / "started").read_text()), 0)
    finally:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
