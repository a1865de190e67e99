"""Formulas in the plain notation of the docstrings as MathML, which browsers draw by themselves.

    theta_1, sigma_G^2, R_NS, up_z        names with subscripts and powers; Greek ones by their names
    Z+, R-, phi''                         a posteriori, a priori; derivatives, or transposed
    ^g                                    estimated
    s_v^2 q / (2 t_s), d/dt               a fraction: what is multiplied on the left, one factor on the right
    sqrt(x), sin phi, sum_{j<i}, |v|      root, functions, sums, lengths
    w x l, e_l . v, [w x], [1 H; 0 1]     cross and dot product, matrices
    v = 0 with variance s_v^2 / H         words between formulas

What does not follow this notation is no formula: FormulaError.
"""

from __future__ import annotations

import re
from html import escape
from typing import NamedTuple

# By the names that HTML has for them.
GREEK = frozenset(
    re.findall(
        r"\w+",
        """alpha beta gamma delta epsilon eps zeta eta theta iota kappa lambda mu nu xi pi rho sigma tau phi chi psi
        omega Gamma Delta Theta Lambda Xi Pi Sigma Phi Psi Omega""",
    )
)
FUNCTIONS = frozenset(
    re.findall(
        r"\w+",
        """abs sin cos tan asin acos atan atan2 sinh cosh tanh exp log erf max min round floor diag tr trace hypot skew
        det mod vec conj""",
    )
)
SMALL_WORDS = frozenset({"at", "in", "of", "or", "is", "by", "to", "as", "on", "it", "no", "if", "so", "an"})
OPERATORS = {
    "<-": "&larr;",
    "->": "&rarr;",
    "<=": "&le;",
    ">=": "&ge;",
    "<": "&lt;",
    ">": "&gt;",
    "!=": "&ne;",
    "-=": "&minus;=",
    "...": "&hellip;",
    "..": "&hellip;",
    "-": "&minus;",
    "*": "&middot;",
    **{sign: sign for sign in ("=", "+", "+=", ",", ";", ":")},
}
PRIME = "&prime;"
GAP = '<mspace width="0.17em"/>'
WIDE = '<mspace width="0.4em"/>'

_SUB = r"(?:_(?:\{[^{}]*\}|[A-Za-z0-9]+(?:,[A-Za-z0-9]+)*(?:-\d+)?))"
_TOKEN = re.compile(
    rf"""(?P<space>\s+)
    |(?P<number>\d+(?:\.\d+)?(?:e[+-]?\d+)?)
    |(?P<word>[a-z]{{3,}}(?:-[a-z]{{2,}})+)
    |(?P<name>[A-Za-z]+\d*{_SUB}*'*(?:[+-](?=[\s,)\]|]|$))?)
    |(?P<sign><-|->|<=|>=|!=|\+=|-=|\.\.\.|\.\.|[-+*/=<>,;:^.])
    |(?P<prime>'+)
    |(?P<fence>[()\[\]|])""",
    re.VERBOSE,
)
_NAME = re.compile(rf"([A-Za-z]+)(\d*)({_SUB}*)('*)([+-]?)")
_CLOSING = {"(": ")", "[": "]", "|": "|"}


class FormulaError(ValueError):
    """The text is no formula."""


class Token(NamedTuple):
    """kind: number, word, name, sign, prime, fence or end. tight: nothing stands between it and the token before."""

    kind: str
    text: str
    tight: bool


def formula(text: str, *, display: bool = False) -> str:
    """The element <math> of a formula; display: with fractions of full size. Raises FormulaError."""
    parser = _Parser(_tokens(text))
    inside = parser.row("")
    if parser.now.kind != "end":
        raise FormulaError(f"{parser.now.text!r} closes nothing in {text!r}")
    return f'<math displaystyle="true">{inside}</math>' if display else f"<math>{inside}</math>"


def _tokens(text: str) -> list[Token]:
    found, position, tight = [], 0, False
    while position < len(text):
        match = _TOKEN.match(text, position)
        if match is None:
            raise FormulaError(f"{text[position]!r} belongs to no formula")
        kind, position = str(match.lastgroup), match.end()
        if kind != "space":
            found.append(Token(kind, match[0], tight))
        tight = kind != "space"
    return [*found, Token("end", "", False)]


class _Parser:
    """One pass over the tokens; each method takes what it draws."""

    def __init__(self, tokens: list[Token]) -> None:
        self.tokens = tokens
        self.place = 0
        self.bars = 0

    @property
    def now(self) -> Token:
        return self.tokens[self.place]

    def take(self) -> Token:
        self.place += 1
        return self.tokens[self.place - 1]

    def row(self, closing: str) -> str:
        """Terms, signs and words up to the closing fence, which stays."""
        parts: list[str] = []
        while self.now.kind != "end" and not (self.now.kind == "fence" and self.now.text == closing):
            if self.now.kind == "fence" and self.now.text in ")]":
                break
            if self.is_word():
                before, text = parts and WIDE, self.words()
                inside = self.now.kind != "end" and self.now.text not in (closing, ",")
                parts.append(f"{before or ''}{text}{WIDE if inside else ''}")
            elif self.now.kind == "sign" and self.now.text in OPERATORS:
                sign = self.take().text
                parts.append(f"<mo>{OPERATORS[sign]}</mo>" + (WIDE if sign in ",;" else ""))
            else:
                parts.append(self.term())
        return f"<mrow>{''.join(parts)}</mrow>"

    def is_word(self) -> bool:
        """Whether a word of English stands here: it is long, and no function, no symbol, and called with nothing."""
        token, after = self.now, self.tokens[min(self.place + 1, len(self.tokens) - 1)]
        if token.kind == "word":
            return True
        called = after.text == "(" and after.tight
        about_a_sum = token.text == "sum" and after.kind == "name" and _is_english(after.text)
        return token.kind == "name" and not called and (about_a_sum or _is_english(token.text))

    def words(self) -> str:
        """Words in a row; a fraction where they are divided by something."""
        found = []
        while self.is_word():
            found.append(self.take().text)
        text = f"<mtext>{' '.join(found)}</mtext>"
        return self.product([text]) if self.now.text == "/" else text

    def term(self) -> str:
        return self.product([self.factor()])

    def product(self, factors: list[str]) -> str:
        """Factors side by side; a slash puts all before it over the one after it, a tight one, d/dt, the last only."""
        while True:
            if self.now.kind == "sign" and self.now.text == "/":
                kept = factors[:-1] if self.take().tight else []
                above, below = factors[len(kept) :], self.factor()
                factors = [*kept, f"<mfrac>{_bare(GAP.join(above))}{_bare(below)}</mfrac>"]
            elif self.now.kind == "sign" and self.now.text == ".":
                self.take()
                factors[-1] += "<mo>&middot;</mo>" + self.factor()
            elif self.is_cross():
                self.take()
                factors[-1] += "<mo>&times;</mo>" + ("" if self.now.text == "]" else self.factor())
            elif self.starts_factor():
                factors.append(self.factor())
            else:
                return GAP.join(factors)

    def is_cross(self) -> bool:
        """An x between two factors, or before a closing bracket, [w x]."""
        after = self.tokens[min(self.place + 1, len(self.tokens) - 1)]
        factor = after.kind in ("name", "number") or after.text in ("(", "[", "]")
        return self.now.text == "x" and not self.now.tight and factor and (after.text == "]" or not after.tight)

    def starts_factor(self) -> bool:
        if self.is_word():
            return False
        if self.now.text == "|":
            return not self.bars
        return self.now.kind in ("number", "name") or self.now.text in ("(", "[")

    def factor(self) -> str:
        """An atom with its powers and primes."""
        base = self.atom()
        while self.now.kind == "prime" or self.now.text == "^":
            if self.now.kind == "prime":
                base = f"<msup>{_one(base)}<mo>{PRIME * len(self.take().text)}</mo></msup>"
            else:
                self.take()
                base = f"<msup>{_one(base)}{self.exponent()}</msup>"
        return base

    def exponent(self) -> str:
        if self.now.text in ("-", "+"):
            return f"<mrow><mo>{OPERATORS[self.take().text]}</mo>{self.atom()}</mrow>"
        return _bare(self.atom())

    def atom(self) -> str:
        token = self.take()
        if token.kind == "number":
            return f"<mn>{token.text}</mn>"
        if token.kind == "fence" and token.text in _CLOSING:
            return self.fenced(token.text)
        if token.text == "^" and self.now.kind == "name":
            return f'<mover accent="true">{self.atom()}<mo>^</mo></mover>'
        if token.kind == "name":
            return self.named(token.text)
        raise FormulaError(f"{token.text or 'the end'!r} where a factor should stand")

    def fenced(self, opening: str) -> str:
        closing, outside = _CLOSING[opening], self.bars
        self.bars = 1 if opening == "|" else 0
        start = self.place
        inside = self.row(closing)
        if self.now.text != closing:
            raise FormulaError(f"{opening!r} is not closed")
        rows = self.matrix(start) if opening == "[" else ""
        self.take()
        self.bars = outside
        return f'<mrow><mo fence="true">{opening}</mo>{rows or inside}<mo fence="true">{closing}</mo></mrow>'

    def matrix(self, start: int) -> str:
        """A table of what stands between brackets, where semicolons part it into rows."""
        inside = self.tokens[start : self.place]
        if not any(token.text == ";" for token in inside):
            return ""
        rows: list[list[str]] = [[]]
        part = _Parser([*inside, Token("end", "", False)])
        while part.now.kind != "end":
            if part.now.text == ";":
                part.take()
                rows.append([])
            else:
                rows[-1].append(f"<mtd>{part.ratio()}</mtd>")
        return "<mtable>" + "".join(f"<mtr>{''.join(row)}</mtr>" for row in rows) + "</mtable>"

    def ratio(self) -> str:
        """A factor, or one over another: what a cell of a matrix holds."""
        above = self.factor()
        if self.now.text != "/":
            return above
        self.take()
        return f"<mfrac>{_bare(above)}{_bare(self.factor())}</mfrac>"

    def named(self, text: str) -> str:
        if text == "sqrt":
            return f"<msqrt>{_bare(self.factor())}</msqrt>"
        match = _NAME.fullmatch(text)
        if match and match[1] in ("sum", "int"):
            sign = f"<mo>{'&sum;' if match[1] == 'sum' else '&int;'}</mo>"
            return f"<munder>{sign}{_subscript(match[3])}</munder>" if match[3] else sign
        if text in FUNCTIONS:
            argument = self.factor() if self.now.text == "(" or self.starts_factor() else ""
            return f"<mrow><mi>{text}</mi><mo>&#x2061;</mo>{'' if self._fenced(argument) else GAP}{argument}</mrow>"
        drawn = symbol(text)
        if self.now.text == "(" and self.now.tight:
            drawn = f"<mrow>{drawn}<mo>&#x2061;</mo>{self.atom()}</mrow>"
        return drawn

    @staticmethod
    def _fenced(drawn: str) -> bool:
        return drawn.startswith("<mrow><mo fence")


def symbol(text: str) -> str:
    """A name with its subscripts, primes and sign: theta_1, y_G,t-1, phi'', Z+. Raises FormulaError."""
    match = _NAME.fullmatch(text)
    if match is None:
        raise FormulaError(f"{text!r} is no name")
    letters, digits, subscripts, primes, sign = match.groups()
    if len(letters) > 2 and letters not in GREEK and len(subscripts) > 3:
        return f"<mtext>{text}</mtext>"  # a variable of the code
    drawn = _letters(letters)
    if digits or subscripts:
        drawn = f"<msub>{drawn}{_subscript((f'_{digits}' if digits else '') + subscripts)}</msub>"
    above = PRIME * len(primes) + OPERATORS.get(sign, "")
    return f"<msup>{drawn}<mo>{above}</mo></msup>" if above else drawn


def _greek(name: str) -> str:
    return "&epsilon;" if name == "eps" else f"&{name};"


def _letters(text: str) -> str:
    if text in GREEK:
        return f"<mi>{_greek(text)}</mi>"
    if len(text) > 3 and text.endswith("bar"):
        return f'<mover accent="true">{_letters(text[:-3])}<mo stretchy="false">&oline;</mo></mover>'
    if text[0] == "d" and text[1:] in GREEK:
        return f"<mi>d{_greek(text[1:])}</mi>"
    return f"<mi>{text}</mi>"


def _subscript(text: str) -> str:
    """Of one underscore or several, in braces or not."""
    parts = []
    for part in re.findall(r"_(\{[^{}]*\}|[^_]+)", text):
        for piece in re.findall(r"\d+|[A-Za-z]+|[-+,<>=]|\S", part.strip("{}")):
            if piece.isdigit():
                parts.append(f"<mn>{piece}</mn>")
            elif piece.isalpha():
                parts.append(f"<mi>{_greek(piece) if piece in GREEK else piece}</mi>")
            else:
                parts.append(f"<mo>{OPERATORS.get(piece) or escape(piece)}</mo>")
    return f"<mrow>{''.join(parts)}</mrow>"


def _is_english(text: str) -> bool:
    """A long word, or one of the small ones between formulas; no Greek letter, no constant in capitals."""
    if not text.isalpha() or text in GREEK or text in FUNCTIONS or text in ("sqrt", "sum", "int"):
        return False
    if text in SMALL_WORDS:
        return True
    symbolic = text.isupper() or text.endswith("bar") or text[1:] in GREEK
    return len(text) > 2 and not symbolic


def _one(drawn: str) -> str:
    return f"<mrow>{drawn}</mrow>"


def _bare(drawn: str) -> str:
    """Without the parentheses around all of it: a fraction, a root or a power needs none."""
    opening, closing = '<mrow><mo fence="true">(</mo>', '<mo fence="true">)</mo></mrow>'
    if drawn.startswith(opening) and drawn.endswith(closing) and _spans(drawn):
        return drawn[len(opening) : -len(closing)]
    return _one(drawn)


def _spans(drawn: str) -> bool:
    """Whether the first element is all there is."""
    depth = 0
    for match in re.finditer(r"<(/?)\w+[^>]*?(/?)>", drawn):
        depth += 0 if match[2] else -1 if match[1] else 1
        if depth == 0:
            return match.end() == len(drawn)
    return False
