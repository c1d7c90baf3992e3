"""Lines of theory: what is mathematics is set as mathematics, what is prose stays prose, and nothing is lost."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st

from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.tracker.website.formulas import FUNCTIONS, formula, runs
from tests.histories.synthetic import HOSTILE

SIGNS = "abz IEm=+−/·²₀ⁿ√()[]_^|½θ′%.,: 12<>&\"'"


def told(line: str) -> ElementTree.Element:
    return ElementTree.fromstring(f"<p>{formula(line)}</p>")


def shape(line: str) -> str:
    """The elements of a line that is one formula, without those that only group or keep apart."""

    def of(element: ElementTree.Element) -> str:
        inside = "".join(of(child) for child in element) if len(element) else (element.text or "")
        return (
            inside
            if element.tag in ("math", "mrow", "mspace", "mi", "mn", "mo")
            else f"{element.tag}[{inside}]"
        )

    (found,) = told(line)
    assert found.tag == "math"
    return of(found)


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("E = ½ m v²", "E=½mmsup[v2]"),
        ("F_t/F_n = µ", "mfrac[msub[Ft]msub[Fn]]=μ"),
        ("h² v²/(4 l)", "msup[h2]mfrac[msup[v2]4l]"),
        ("T = 4 √(l/g)", "T=4msqrt[mfrac[lg]]"),
        ("x_(i−1) + z₊", "msub[xi−1]+msub[z+]"),
        ("ω_i² = a^(3/2)", "msubsup[ωi2]=msup[a3/2]"),
        ("⁴⁄₃ θ̈₁ = 0", "mfrac[43]msub[θ̈1]=0"),
        ("(1 − e)²/x", "mfrac[msup[(1−e)2]x]"),
        ("a = F/(m + J/r²)", "a=mfrac[Fm+J/msup[r2]]"),
        (
            "a = g sin θ/(M + m)",
            "a=gsinθ/(M+m)",
        ),  # whether the sine ends before the stroke, the line does not say
        ("K(sin² φ/2)", "K(msup[sin2]φ/2)"),
        ("sin(φ/2)/r", "mfrac[sin(φ/2)r]"),
    ],
)
def test_a_formula_has_the_shape_it_says(line: str, expected: str) -> None:
    assert shape(line) == expected


def test_what_has_no_sign_of_mathematics_stays_text() -> None:
    for line in (
        "Nothing moves, so no energy is gained.",
        "A drive at its bound carries the bound.",
        "At 20 s.",
    ):
        assert formula(line) == line


def test_words_and_formulas_are_told_apart_in_one_line() -> None:
    line = "Rolls iff tan θ ≤ 3.5 µ: a = (5/7) g sin θ, and a wheel (say, e = 1) takes a √α more."

    assert [text for mathematics, text in runs(line) if mathematics] == [
        "tan θ ≤ 3.5 µ",
        "a = (5/7) g sin θ",
        "e = 1",
        "√α",
    ]


def test_a_unit_after_a_number_is_upright_and_a_factor_is_not() -> None:
    unit = told("s = 1.635 m")[0].findall(".//mi[@mathvariant]")
    factor = told("T = 3 m g")[0].findall(".//mi[@mathvariant]")

    assert [found.text for found in unit] == ["m"]
    assert factor == []


def test_every_line_of_the_catalogue_is_read_and_loses_no_letter() -> None:
    lines = [line for test in CATALOGUE.values() for line in test.theory]

    unread = []
    for line in lines:
        letters = [c for c in "".join(told(line).itertext()) if c.isalpha()]
        plain = [c for c in line.replace("µ", "μ") if c.isalpha()]
        assert sorted(c for c in letters if c.isascii()) == sorted(
            c for c in _unraised("".join(plain)) if c.isascii()
        ), line
        unread += [text for mathematics, text in runs(line) if mathematics and "<math" not in formula(text)]

    assert len(lines) > 100
    assert unread == ["ω = min(T t/J,"]  # goes on with words


def test_no_line_of_the_catalogue_leaves_open_where_the_argument_of_a_function_ends() -> None:
    functions = "|".join(FUNCTIONS)
    open_ended = re.compile(rf"\b(?:{functions})[²³]? +[^\s(]*/\S")

    assert open_ended.search("a = g sin θ/(M + m)")
    assert [line for test in CATALOGUE.values() for line in test.theory if open_ended.search(line)] == []


def _unraised(text: str) -> str:
    table = dict(zip("ⁿⁱᵀᵢⱼₙₖₓₜ", "niTijnkxt", strict=True))
    return "".join(table.get(c, c) for c in text)


def test_brackets_that_do_not_close_leave_the_line_as_it_is() -> None:
    for line in ("f(x = 2", "x] = 2", "((" * 5000 + "=", "= /", "x_ = 1", "√ = 2"):
        assert "".join(told(line).itertext()).replace("−", "-") == line.replace("−", "-")


def test_hostile_text_is_text() -> None:
    assert "<img" not in formula(HOSTILE) and "<script" not in formula(HOSTILE)


@given(st.text(alphabet=SIGNS, max_size=40))
def test_any_line_gives_well_formed_mathematics_and_its_pieces_are_the_line(line: str) -> None:
    assert "".join(text for _, text in runs(line)) == line
    told(line)
