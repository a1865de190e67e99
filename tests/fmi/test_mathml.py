"""Claims about the converter of formulas: what it draws, and that it refuses the rest instead of drawing nonsense."""

from __future__ import annotations

import random
import re

import pytest

from imufmu.fmi.mathml import FormulaError, formula
from support.markup import plain, tree


def shape(text: str) -> str:
    """MathML without rows, gaps and entities: what is over what, and in which order."""
    drawn = re.sub(r"</?mrow>|<mspace[^>]*/>|<mo>&#x2061;</mo>| fence=\"true\"|</?math[^>]*>", "", formula(text))
    return re.sub(r"</?m[ino]>|</mo>", "", drawn.replace("<mo>", "").replace("</mi>", " "))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("theta_1", "<msub>&theta; 1</msub>"),
        ("sigma_G^2", "<msup><msub>&sigma; G </msub>2</msup>"),
        ("x1", "<msub>x 1</msub>"),
        ("Z+", "<msup>Z +</msup>"),
        ("phi''", "<msup>&phi; &prime;&prime;</msup>"),
        ("a b / c d", "<mfrac>a b c </mfrac>d "),
        ("(a + b) / (2 c)", "<mfrac>a +b 2c </mfrac>"),
        ("(a) (b) / c", "<mfrac>(a )(b )c </mfrac>"),
        ("tau d/dt", "&tau; <mfrac>d dt </mfrac>"),
        ("a - b", "a &minus;b "),
        ("sqrt(2) x", "<msqrt>2</msqrt>x "),
        ("e^(-t)", "<msup>e &minus;t </msup>"),
        ("w x l", "w &times;l "),
        ("y = z x x", "y =z &times;x "),
        ("[w x]", "[w &times;]"),
        ("e_z . v", "<msub>e z </msub>&middot;v "),
        ("sum_{j<i} l_j", "<munder>&sum;j &lt;i </munder><msub>l j </msub>"),
        ("|a|^2", "<msup>|a |2</msup>"),
        ("^g", '<mover accent="true">g ^</mover>'),
        ("a <= b", "a &le;b "),
        ("R <- Q", "R &larr;Q "),
    ],
)
def test_notation_becomes_structure(text, expected):
    assert shape(text) == expected


def test_a_matrix_has_a_cell_per_factor():
    drawn = tree(formula("[T^2/2 T; 0 1]"))
    assert [len(row) for row in drawn.iter("mtr")] == [2, 2]


def test_words_stand_apart_from_symbols():
    drawn = tree(formula("v = 0 with variance s_v^2 / H"))
    assert [text.text for text in drawn.iter("mtext")] == ["with variance"]
    assert plain(formula("b = low-passed y_g")) == "b=low-passedyg"


@pytest.mark.parametrize("text", ["(a", "a)", "a +% b", "a / ", "[1 2", "|a", "``code``", "a ^ ^", ""])
def test_what_is_no_formula_is_refused_or_empty(text):
    if text:
        with pytest.raises(FormulaError):
            formula(text)
    else:
        assert plain(formula(text)) == ""


def test_whatever_is_typed_gives_closed_markup_or_a_formula_error():
    rng = random.Random(7)
    pieces = [
        "a",
        "theta_1",
        "2",
        "+",
        "-",
        "/",
        "^",
        "(",
        ")",
        "[",
        "]",
        "|",
        ";",
        " ",
        "x",
        ".",
        "sum_i",
        "sqrt",
        "sin",
    ]
    drawn = 0
    for _ in range(3000):
        text = "".join(rng.choice(pieces) for _ in range(rng.randint(1, 9)))
        try:
            tree(formula(text))
            drawn += 1
        except FormulaError:
            continue
    assert drawn > 300  # or the test would say nothing about what is drawn
