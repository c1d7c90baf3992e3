"""Numbers, limits and names as a reader sees them."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from spook_tracker.tracker.document import wording
from tests.histories.synthetic import engine, series


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (1.635, "1.635"),
        (0.0, "0"),
        (-0.0, "0"),
        (4.9e-9, "4.9×10⁻⁹"),
        (-1e-3, "−0.001"),
        (1e-12, "10⁻¹²"),
        (1404000.0, "1.404×10⁶"),
        (100000.0, "100000"),
        (math.nan, "not a number"),
        (-math.inf, "−∞"),
        (None, "–"),
    ],
)
def test_a_number_in_words(value: float | None, words: str) -> None:
    assert wording.number(value) == words


@given(st.floats(-1e300, 1e300), st.integers(1, 17))
def test_a_number_in_words_means_the_number(value: float, digits: int) -> None:
    """Read back, the words give the value to the digits shown."""
    back = wording.number(value, digits).translate(str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻−", "0123456789--"))
    if "×10" in back:
        mantissa, _, exponent = back.partition("×10")
        back = f"{mantissa}e{exponent}"
    elif back.lstrip("-").startswith("10") and not (1e-3 <= abs(value) < 1e6) and value != 0.0:
        back = back.replace("10", "1e", 1)

    assert float(back) == pytest.approx(value, rel=0.51 * 10.0 ** (1 - digits))


def test_units_and_prefixes() -> None:
    assert wording.quantity(1.635, "m") == "1.635\u202fm"
    assert wording.quantity(0.5, "1") == "0.5"
    assert wording.seconds(1.84e-6) == "1.84\u202fµs"
    assert wording.seconds(8.6e-10) == "0.86\u202fns"


@pytest.mark.parametrize(
    ("limit", "better", "value", "words"),
    [
        (4.904, "smaller_magnitude", 1.635, "33.3 % of the limit"),
        (4.904, "smaller_magnitude", -1.635, "33.3 % of the limit"),
        (4.9e-9, "smaller_magnitude", 4.1e-16, "over a million times below the limit"),
        (4.9e-9, "smaller_magnitude", 1.0584e-13, "46000 times below the limit"),
        (4.9e-9, "smaller_magnitude", 0.0, "exact"),
        (1.0, "smaller_magnitude", 3.0, "3 times the limit"),
        (1.0, "smaller_magnitude", 1.02, "2 % over"),
        ((0.4999, 0.5001), "inside", 0.5002, "2 times the limit"),
        (10.0, "larger", 20.0, "50 % of the limit"),
        (10.0, "larger", 5.0, "2 times the limit"),
        (0.0, "smaller_magnitude", 1.0, "outside"),
        (-40.0, "larger", -36.0, "inside"),
        (None, "smaller_magnitude", 1.0, "–"),
        (1.0, "smaller_magnitude", math.nan, "no value"),
    ],
)
def test_the_margin_in_words(limit: object, better: str, value: float, words: str) -> None:
    assert wording.margin(series("t", "m", limit=limit, better=better), value).text == words


def test_a_band_shows_digits_enough_to_tell_its_ends_apart() -> None:
    assert wording.band((0.407037, 0.407039), "%") == "0.407037 … 0.407039\u202f%"


@given(st.text(max_size=80))
def test_a_slug_is_always_a_safe_file_name_of_its_own(name: str) -> None:
    made = wording.slug(name)

    assert wording.SLUG.fullmatch(made)
    assert made not in wording.RESERVED
    assert wording.slug(made) == made


def test_names_that_differ_have_slugs_that_differ() -> None:
    names = ["beam", "Beam", "beam ", "../beam", "con", "CON", "", "x" * 61, "x" * 62, "ü", "é"]

    assert len({wording.slug(name).casefold() for name in names}) == len(names)


def test_what_cannot_be_seen_is_shown() -> None:
    assert wording.clean("a\u202eb\x00c\ud800") == "a�b�c�"
    assert wording.clean("h² v²\nλ") == "h² v²\nλ"


def test_only_plain_addresses_become_links() -> None:
    commit = engine(1)

    assert wording.web_address("https://ci.example/run/1") == "https://ci.example/run/1"
    for hostile in ("javascript:alert(1)", 'https://x/"onclick=', "data:text/html,x", "//x", "https://x y"):
        assert wording.web_address(hostile) == ""
        assert wording.commit_address(commit, hostile) == ""
    link = wording.commit_address(commit, "https://github.com/example/spook/actions/runs/17")
    assert link == f"https://github.com/example/spook/commit/{commit.git_hash}"


def test_a_sentence_opens_with_a_capital_but_a_formula_does_not() -> None:
    assert wording.opening("largest deviation") == "Largest deviation"
    assert wording.opening("max|x - x0|") == "max|x - x0|"
    assert wording.opening("h w at the edge") == "h w at the edge"


def test_a_title_that_begins_with_an_owner_begins_with_a_capital() -> None:
    assert wording.opening("centre's distance") == "Centre's distance"
