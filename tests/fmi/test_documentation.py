"""Claims about the page inside an FMU: equations, use and settings are there, readable, and the markup holds."""

from __future__ import annotations

import inspect
import random
import re
import subprocess
import sys

import pytest

from imufmu.blocks.block import Block
from imufmu.blocks.series import series
from imufmu.fmi.datasheet import rule_for, sheet_rows
from imufmu.fmi.documentation import documentation_page, modules
from imufmu.fmi.prose import paragraphs, section, words
from imufmu.plants import truth
from imufmu.registry import BLOCKS, ESTIMATORS, SENSORS
from support.markup import plain, tree

every_block = pytest.mark.parametrize("block", BLOCKS.values(), ids=lambda block: block.name)
every_estimator = pytest.mark.parametrize("block", ESTIMATORS, ids=lambda block: block.name)


def part(page: str, title: str) -> str:
    """What stands under a heading."""
    return re.split(rf"<h2>{title}</h2>", page)[1].split("<h2>")[0]


@every_block
def test_the_page_holds_the_equations_of_every_module_that_the_block_is_made_of(block: Block) -> None:
    """Its own, those of a module of the same room that numbers equations, and what every plant's truth is."""
    module = sys.modules[block.output.__module__]
    used = [sys.modules[getattr(value, "__module__", None) or module.__name__] for value in vars(module).values()]
    used += [value for value in vars(module).values() if inspect.ismodule(value)]
    equations = part(documentation_page(block), "Equations")
    for each in {module, *used}:
        text = inspect.cleandoc(each.__doc__ or "")
        if each.__name__.rpartition(".")[0] == module.__package__ and ("(1)" in text or each is truth):
            assert words(text.splitlines()[0]) in equations, each
            for number in re.findall(r"\s{2,}(\(\d+\))$", text, re.MULTILINE):
                assert f'<span class="number">{number}' in equations or f", {number}</span>" in equations, (
                    each,
                    number,
                )


@every_block
def test_the_markup_of_the_equations_is_closed_and_nothing_is_left_as_typed(block: Block) -> None:
    for name, text in modules(block):
        drawn = section(text)
        tree(drawn)
        assert "<pre>" not in drawn, name
        assert "``" not in plain(drawn) and "**" not in plain(drawn), name


@every_estimator
def test_every_estimator_shows_equations_says_when_to_use_it_and_how_to_set_it(block: Block) -> None:
    page = documentation_page(block)
    assert part(page, "Equations").count('<math displaystyle="true">') >= 3
    when = part(page, "When to use it, and what instead")
    assert "Use it" in when and "Instead:" in when
    named = [other.name for other in ESTIMATORS if re.search(rf"\b{other.name}\b", when)]
    assert named and block.name not in named
    assert "/√Hz" in part(page, "Set it for your IMU")
    assert "deg/h" in part(page, "Set it for your IMU")
    assert "<b>S</b>" in page and "<b>N</b>" in page


def test_a_series_tells_of_each_of_its_blocks() -> None:
    chain = [BLOCKS[name] for name in ("pendulum", "imu", "lee2012")]
    page = documentation_page(series(*chain))
    for block in chain:
        assert words(paragraphs(block.doc)[0], {s.name for s in block.parameters})[:60] in part(page, "What it does")
        assert f"<h3>{block.name}</h3>" in part(page, "Equations")
    assert "<h3>direction_filter</h3>" in part(page, "Equations")
    assert "imu.gyro_noise_density" in part(page, "Set it for your IMU")


def test_the_page_follows_the_screen_in_width_and_brightness() -> None:
    page = documentation_page(BLOCKS["lee2012"])
    assert '<meta name="viewport" content="width=device-width, initial-scale=1">' in page
    assert "prefers-color-scheme: dark" in page
    assert re.sub(r"<table class=\"symbols\">|<table>", "", page).count("<table") == 0
    assert page.count('<div class="wide"><table') == page.count("<table")  # each scrolls by itself


@pytest.mark.parametrize("block", [*ESTIMATORS, *SENSORS], ids=lambda block: block.name)
def test_formulas_of_data_sheet_figures_give_the_start_value(block: Block) -> None:
    """What the page prints as the figure, put into its formula. Three digits: 0.5 %, twice that in a square."""
    starts = {parameter.name: parameter.start_values()[0] for parameter in block.parameters}
    rules = {parameter.name: rule_for(parameter) for parameter in block.parameters}
    for row in sheet_rows(block):
        rule = rules[row["name"]]
        assert rule is not None
        python = rule.formula.replace("N pi", "N * pi").replace("6 N", "6 * N").replace("5 N", "5 * N")
        python = re.sub(r"(e-\d) N", r"\1 * N", python).replace("2 T", "2 * T").replace("^", "**")
        names = {"N": float(row["start"]), "pi": 3.141592653589793, "T": starts["sample_period"]}
        assert eval(python, {}, names) == pytest.approx(starts[row["name"]], rel=1e-2, abs=1e-12), row


def test_figures_of_a_real_device_become_its_parameters() -> None:
    """Xsens MTx at 100 Hz: 0.1 deg/s/sqrt(Hz) is 1.5e-4 rad2/s2 per sample (models/imus/README.md)."""
    rules = {p.name: rule_for(p) for block in (*ESTIMATORS, *SENSORS) for p in block.parameters}
    variance, density = rules["sigma_g2"], rules["gyro_noise_density"]
    assert variance is not None and density is not None
    assert variance.figure_of(1.523e-4, 0.01) == pytest.approx(0.1, rel=1e-3)
    assert density.figure_of(0.0017453, 0.01) == pytest.approx(0.1, rel=1e-4)


def test_paragraphs_of_a_text_are_kept() -> None:
    for block in BLOCKS.values():
        assert " ".join(paragraphs(block.doc)).split() == block.doc.split()
    assert len(paragraphs(BLOCKS["plumb"].doc)) >= 3
    assert paragraphs("A line that ends early.\nAnother one\ngoes on.") == [
        "A line that ends early.",
        "Another one goes on.",
    ]


def test_links_code_and_symbols_in_running_text() -> None:
    assert words("see doi:10.3390/s18092775.") == (
        'see <a href="https://doi.org/10.3390/s18092775">doi:10.3390/s18092775</a>.'
    )
    assert words("set eps_yaw, not ``x``", {"eps_yaw"}) == "set <code>eps_yaw</code>, not <code>x</code>"
    assert words("a < b & c") == "a &lt; b &amp; c"
    assert plain(words("theta_1 + sigma_A^2")) == "\u03b81 + \u03c3A2"


def test_whatever_a_docstring_holds_the_markup_is_closed() -> None:
    rng = random.Random(3)
    text = "\n\n".join(text for block in BLOCKS.values() for _, text in modules(block))
    for _ in range(300):
        place = rng.randrange(len(text))
        cut = text[place : place + rng.randint(1, 600)]
        torn = "".join(rng.choice("()[]|^_'`*<&x \n") if rng.random() < 0.03 else sign for sign in cut)
        tree(section(torn, {"rr_v", "g"}))


def test_an_fmu_that_runs_loads_nothing_of_the_page() -> None:
    program = "import sys, imufmu.fmi.slave; print([m for m in sys.modules if m.startswith('imufmu.fmi.')])"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert not re.search("documentation|prose|mathml|datasheet", done.stdout)
