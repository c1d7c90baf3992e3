"""Accepting a level is text in git: read strictly, in force until its day."""

from __future__ import annotations

import math
from datetime import date
from pathlib import Path

import pytest

from spook_tracker.tracker.judge.accepted import AcceptedError, acceptance, read_accepted

ENTRY = """
[[accepted]]
series = "pendulum/plain/*"
range = [0.0, 0.5]
who = "Ada"
why = "the new solver rounds otherwise"
until = 2027-01-31
"""
NIGHT = date(2026, 12, 1)


def read(tmp_path: Path, text: str):
    file = tmp_path / "accepted.toml"
    file.write_text(text, encoding="utf-8")
    return read_accepted(file)


def test_an_entry_takes_its_series_in_its_range_until_its_day(tmp_path):
    levels = read(tmp_path, ENTRY)

    assert acceptance(levels, "pendulum/plain/length/h=0.01", 0.4, NIGHT) is levels[0]
    assert acceptance(levels, "pendulum/plain/length/h=0.01", 0.4, date(2027, 1, 31))
    assert acceptance(levels, "pendulum/plain/length/h=0.01", 0.4, date(2027, 2, 1)) is None
    assert acceptance(levels, "pendulum/plain/length/h=0.01", 0.6, NIGHT) is None
    assert acceptance(levels, "pendulum/curved/length/h=0.01", 0.4, NIGHT) is None
    assert str(levels[0]) == "accepted by Ada: the new solver rounds otherwise, until 2027-01-31"


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_what_is_not_finite_is_never_accepted(tmp_path, value):
    levels = read(tmp_path, ENTRY.replace("[0.0, 0.5]", "[0.0, inf]"))

    assert acceptance(levels, "pendulum/plain/length/h=0.01", value, NIGHT) is None


def test_no_file_accepts_nothing(tmp_path):
    assert read_accepted(tmp_path / "accepted.toml") == ()


def test_the_file_in_the_repository_is_valid():
    assert read_accepted(Path(__file__).resolve().parents[1] / "accepted.toml") == ()


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("[[accepted]]", "[[accepted", "not valid TOML"),
        ("[[accepted]]", "[[acepted]]", r"\[\[accepted\]\] tables only"),
        ('who = "Ada"', "", "who must be a text"),
        ('"Ada"', '" "', "who must be a text"),
        ("[0.0, 0.5]", "[0.5, 0.0]", r"range must be \[low, high\]"),
        ("[0.0, 0.5]", "0.5", r"range must be \[low, high\]"),
        ("2027-01-31", '"2027-01-31"', "without quotes"),
        ("until", "untill", "'untill' is not known"),
    ],
)
def test_a_mistake_is_refused_with_its_place(tmp_path, old, new, sentence):
    assert old in ENTRY
    with pytest.raises(AcceptedError, match=sentence):
        read(tmp_path, ENTRY.replace(old, new))
