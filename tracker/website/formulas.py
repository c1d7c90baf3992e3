"""Formulas as formulas: what a line of theory says in Unicode, set as MathML where it is mathematics.

A line mixes words and formulas: "Sliding: Δv = μ (1 + e) u." A run of words without prose that holds a sign of
mathematics is set; everything else stays text. A fraction takes the factors that touch its bar: v²/r, h² v²/(4 l).
What cannot be read as a formula stays as it was written. No library does this: those that write MathML read LaTeX or
Python, and a line of theory is one of Unicode, since terminals and logs show it as well.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator

from markupsafe import Markup, escape

FUNCTIONS = frozenset(
    [
        "sin",
        "cos",
        "tan",
        "cot",
        "asin",
        "acos",
        "atan",
        "sinh",
        "cosh",
        "tanh",
        "exp",
        "log",
        "min",
        "max",
        "det",
        "diag",
        "tr",
        "cd",
        "sn",
        "dn",
    ]
)
UNITS = frozenset({"m", "s", "kg", "N", "J", "%", "rad"})
RAISED = dict(zip("⁰¹²³⁴⁵⁶⁷⁸⁹⁺⁻ⁿⁱᵀ", "0123456789+−niT", strict=True))
LOWERED = dict(zip("₀₁₂₃₄₅₆₇₈₉₊₋ᵢⱼₙₖₓₜ", "0123456789+−ijnkxt", strict=True))
PRIMES = {"'": "′", "′": "′", "″": "″"}
OPERATORS = frozenset("=<>≤≥≈→+−-·×∫Σ±|,;:⋅∂/")
OPENING = {"(": ")", "[": "]"}
MARKS = frozenset("=<>≤≥≈→+−·×√∫Σ/^_|⁄") | RAISED.keys() | LOWERED.keys()
NUMBER = re.compile(r"(?:\d+(?:\.\d+)?|\.\d+)(?:e[-−]?\d+)?")
VULGAR = re.compile(r"[½⅓⅔¼¾⅕⅖⅗⅘⅙⅛]")
FUNCTION = re.compile(r"[a-z]{2,}(?![a-z])")
CAPITALS = re.compile(r"[A-Z]{2}")
SMALL_FRACTION = re.compile(r"([⁰-⁹¹²³]+)⁄([₀-₉]+)")
APPLIED = re.compile(rf"^(?:<msup>)?<mi>(?:{'|'.join(FUNCTIONS)})</mi>(?:<mrow>.*</mrow></msup>)?$")
LOW_NAME = re.compile(r"[A-Za-zα-ω0-9]+")
BRACKETED = re.compile(r"<mrow><mo[^>]*>\(</mo>(.*)<mo[^>]*>\)</mo></mrow>")
DEEPEST = 20  # brackets in each other; more is no formula to read
THIN = '<mspace width=".17em"/>'


def formula(line: str) -> Markup:
    """The line with its formulas as MathML, all of it escaped."""
    return Markup("").join(
        set_formula(text) if mathematics else escape(text) for mathematics, text in runs(line)
    )


def runs(line: str) -> Iterator[tuple[bool, str]]:
    """The line in pieces, each either mathematics or text; together they are the line."""
    words = re.findall(r"\s+|[^\s]+", line)
    run: list[str] = []
    depth = 0
    for word in words:
        if word.isspace():
            run.append(word)
            continue
        core = word.rstrip(".,:;")
        if not is_mathematical(core):
            yield from _closed(run, goes_on=True)
            run, depth = [], 0
            yield False, word
            continue
        depth += sum(core.count(c) for c in "([") - sum(core.count(c) for c in ")]")
        if depth > 0 and word.endswith(","):
            run.append(word)
            continue
        run.append(core)
        if core != word:
            yield from _closed(run)
            run, depth = [], 0
            yield False, word[len(core) :]
    yield from _closed(run)


def is_mathematical(word: str) -> bool:
    """Whether a word may stand in a formula: no run of letters in it but names that formulas have."""
    bare = re.sub(r"_[A-Za-zα-ω0-9]+", "", word)
    for letters in re.findall(r"[A-Za-z]{2,}", bare):
        unit = letters in UNITS and bare == letters
        if letters not in FUNCTIONS and not re.fullmatch(r"[A-Z]{2}|d[A-Zx-z]|d[tw]", letters) and not unit:
            return False
    return bool(bare) or bool(word)


def _closed(run: list[str], *, goes_on: bool = False) -> Iterator[tuple[bool, str]]:
    """A run that ends here. Spaces around it, articles and brackets of the sentence are text."""
    text = "".join(run)
    inside = text.strip()
    begin = text.find(inside)
    end = begin + len(inside)
    if article := re.match(r"[aA] +(?=[^\s=<>≤≥≈→+−·×])", inside):
        begin += article.end()
    if goes_on and (article := re.search(r" +a$", text[begin:end])):
        end -= len(article.group())
    while text[begin:end].count(")") > text[begin:end].count("(") and text[end - 1] == ")":
        end -= 1
    while text[begin:end].count("(") > text[begin:end].count(")") and text[begin] == "(":
        begin += 1
    if begin > 0:
        yield False, text[:begin]
    if end > begin:
        yield has_marks(text[begin:end]), text[begin:end]
    if end < len(text):
        yield False, text[max(begin, end) :]


def has_marks(text: str) -> bool:
    """Whether a run holds a sign of mathematics: an operator, an index, a power, a Greek letter."""
    greek = any("GREEK" in unicodedata.name(c, "") for c in text)
    return (greek or not MARKS.isdisjoint(text)) and any(c.isalnum() for c in text)


def set_formula(text: str) -> Markup:
    """One formula as MathML, or the text if its brackets do not close."""
    try:
        reader = _Reader(text)
        body = reader.row("")
    except ValueError:
        return escape(text)
    return Markup('<math displaystyle="true">{}</math>').format(Markup(body))


class _Reader:
    """Reads a formula from left to right."""

    def __init__(self, text: str) -> None:
        self.text, self.at = text, 0
        self.open = 0  # brackets
        self.small = 0  # how many bars, roots and exponents this is inside of

    def peek(self) -> str:
        return self.text[self.at] if self.at < len(self.text) else ""

    def row(self, end: str) -> str:
        """Everything up to the closing bracket, or to the end."""
        parts: list[str] = []
        touching = True  # nothing to keep apart yet
        while self.peek() != end:
            sign = self.peek()
            if not sign:
                raise ValueError("a bracket does not close")
            if sign.isspace():
                self.at += 1
                touching = False
            elif sign in OPERATORS:
                self.at += 1
                parts.append(_operator(sign))
                touching = True
            else:
                # What a function takes after a blank may end before a stroke or behind it: the line does not say.
                argument = not touching and bool(parts) and APPLIED.search(parts[-1]) is not None
                if not touching:
                    parts.append(THIN)
                self.small += argument
                parts.append(self.fraction(parts))
                self.small -= argument
                touching = False
        self.at += len(end)
        return "".join(parts)

    def fraction(self, before: list[str]) -> str:
        """Factors that touch each other, over those behind a bar that touches both."""
        begin = self.at
        upper = self.factors()
        if upper == ["%"] or (len(upper) == 1 and before and self.is_unit(upper[0])):
            return f'<mi mathvariant="normal">{escape(_bare(upper[0]))}</mi>'
        told = "".join(upper)
        while self.is_bar():
            if self.small:  # in small letters a stroke reads better than a bar
                self.at += 1
                told += f"{_operator('/')}{''.join(self.factors())}"
                continue
            self.at, self.small = begin, 1  # once more, now as what stands over a bar
            over = _unbracketed(self.factors())
            while True:
                self.at += 1
                under = _unbracketed(self.factors())
                if not self.is_bar():
                    break
                over = f"{over}{_operator('/')}{under}"
            self.small = 0
            told = f"<mfrac><mrow>{over}</mrow><mrow>{under}</mrow></mfrac>"
        return told

    def is_bar(self) -> bool:
        """A stroke that touches both sides; one with spaces around it stays a stroke."""
        return self.peek() == "/" and bool(self.text[self.at + 1 : self.at + 2].strip())

    def is_unit(self, factor: str) -> bool:
        """A unit stands at the end, after a number: 1.635 m."""
        name = _bare(factor)
        begin = self.text[: self.at - len(name)].rstrip()
        return not self.text[self.at :].strip() and name in UNITS and bool(re.search(r"[\d.]$", begin))

    def factors(self) -> list[str]:
        found = []
        while (sign := self.peek()) and not sign.isspace() and sign not in OPERATORS and sign not in ")]":
            found.append(self.scripted())
        if not found:
            raise ValueError("an operator has nothing to stand on")
        return found

    def scripted(self) -> str:
        """A factor with what stands above and below it."""
        if match := SMALL_FRACTION.match(self.text, self.at):
            self.at = match.end()
            over, under = (
                "".join(table[c] for c in part)
                for part, table in zip(match.groups(), (RAISED, LOWERED), strict=True)
            )
            return f"<mfrac><mn>{over}</mn><mn>{under}</mn></mfrac>"
        base = self.base()
        above, below = "", ""
        while sign := self.peek():
            if sign in RAISED:
                above += self.gathered(RAISED)
            elif sign in LOWERED:
                below += self.gathered(LOWERED)
            elif sign in PRIMES:
                self.at += 1
                above += f"<mo>{PRIMES[sign]}</mo>"
            elif sign in "^_":
                self.at += 1
                self.small += 1
                if sign == "^":
                    above += _unbracketed([self.base()])
                else:
                    below += self.low()
                self.small -= 1
            else:
                break
        if above and below:
            return f"<msubsup>{base}<mrow>{below}</mrow><mrow>{above}</mrow></msubsup>"
        if above:
            return f"<msup>{base}<mrow>{above}</mrow></msup>"
        return f"<msub>{base}<mrow>{below}</mrow></msub>" if below else base

    def gathered(self, table: dict[str, str]) -> str:
        found = ""
        while self.peek() in table and self.peek():
            sign = table[self.peek()]
            found += (
                f"<mn>{sign}</mn>"
                if sign.isdigit()
                else f"<mo>{sign}</mo>"
                if sign in "+−"
                else f"<mi>{sign}</mi>"
            )
            self.at += 1
        return found

    def low(self) -> str:
        """What an underscore puts below: a name, or a bracket."""
        if self.peek() in OPENING:
            return _unbracketed([self.base()])
        match = LOW_NAME.match(self.text, self.at)
        if not match:
            raise ValueError("nothing follows an underscore")
        self.at = match.end()
        return f"<mi>{match.group()}</mi>" if not match.group().isdigit() else f"<mn>{match.group()}</mn>"

    def base(self) -> str:
        sign = self.peek()
        if match := NUMBER.match(self.text, self.at) or VULGAR.match(self.text, self.at):
            self.at = match.end()
            return f"<mn>{match.group()}</mn>"
        if sign == "√":
            self.at += 1
            return f"<msqrt>{_unbracketed([self.scripted() if self.peek() not in OPENING else self.base()])}</msqrt>"
        if sign in OPENING:
            self.at += 1
            self.open += 1
            if self.open > DEEPEST:
                raise ValueError("brackets are nested too deeply")
            inside = self.row(OPENING[sign])
            self.open -= 1
            tall = "" if "<mfrac>" in inside else ' stretchy="false"'
            return f"<mrow><mo{tall}>{sign}</mo>{inside}<mo{tall}>{OPENING[sign]}</mo></mrow>"
        if (match := FUNCTION.match(self.text, self.at)) and match.group() in FUNCTIONS:
            self.at = match.end()
            return f"<mi>{match.group()}</mi>"
        if match := CAPITALS.match(self.text, self.at):
            self.at = match.end()
            return f"<mi>{match.group()}</mi>"
        if not sign or sign.isspace() or sign in ")]_^" or sign in OPERATORS:
            raise ValueError("a bracket opens nowhere")
        self.at += 1
        while unicodedata.combining(self.peek() or " "):
            sign += self.peek()
            self.at += 1
        return f"<mi>{'μ' if sign == 'µ' else escape(sign)}</mi>"  # the letter, not the prefix of units


def _operator(sign: str) -> str:
    shown = "−" if sign == "-" else sign
    bars = ' stretchy="false"' if sign == "|" else ""
    return f"<mo{bars}>{escape(shown)}</mo>"


def _unbracketed(factors: list[str]) -> str:
    """A bracket alone above or below a bar, under a root or in an exponent needs no sign."""
    if len(factors) == 1 and (match := BRACKETED.fullmatch(factors[0])):
        return match.group(1)
    return "".join(factors)


def _bare(factor: str) -> str:
    return re.sub(r"<[^>]*>", "", factor)
