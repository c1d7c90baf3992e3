"""Accepting a level is text in git: read strictly, in force until its day."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from datetime import date
from pathlib import Path

import msgspec
import pytest
from click import unstyle

from spook_tracker.tracker.cli.report_ci import night_markdown
from spook_tracker.tracker.cli.report_compare import finding_lines, findings_json
from spook_tracker.tracker.cli.report_junit import junit_of_night
from spook_tracker.tracker.judge.accepted import Accepted, AcceptedError, acceptance, read_accepted, unused
from spook_tracker.tracker.judge.compare import compare
from spook_tracker.tracker.judge.judged import night_of
from spook_tracker.tracker.judge.series_history import judge_history
from spook_tracker.tracker.judge.tonight import tonight
from spook_tracker.tracker.website.causes import causes_of
from spook_tracker.tracker.website.nights import book
from spook_tracker.tracker.website.page_index import lead
from tests.histories.synthetic import DocumentHistory, sample, series
from tests.places import ROOT
from tests.tracker.judge.test_analyse import SERIES, history
from tests.tracker.judge.test_one_judge import night, one

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


def test_a_folder_of_its_name_is_one_sentence(tmp_path):
    (tmp_path / "accepted.toml").mkdir()

    with pytest.raises(AcceptedError, match="cannot be read: Is a directory"):
        read_accepted(tmp_path / "accepted.toml")


def test_the_file_in_the_repository_is_valid():
    assert read_accepted(ROOT / "accepted.toml") == ()


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("[[accepted]]", "[[accepted", "not valid TOML"),
        ("[0.0, 0.5]", f"[0.0, 1{'0' * 400}]", "range is a whole number of more than 19 digits"),
        ("[0.0, 0.5]", f"[0.0, 1{'0' * 5000}]", "not valid TOML"),
        ("[0.0, 0.5]", "[" * 5000 + "]" * 5000, "it is nested too deeply"),
        ("[[accepted]]", "a." * 5000 + "b = 1\n[[accepted]]", "it is nested too deeply"),
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


EXPECTED = Accepted(
    series="t/*", low=math.inf, high=math.inf, who="Ada", why="known since spring", expected=True
)


def expected_of(*values: float, levels: tuple[Accepted, ...] = (EXPECTED,)) -> list[tuple[str, str, bool]]:
    told = judge_history("t/c/m", SERIES, history(*values), levels)
    return [(night.verdict.word, night.state, night.red) for night in told]


def test_what_is_expected_to_fail_is_not_red_whatever_it_gives() -> None:
    words = expected_of(0.01, 3.0, math.nan, 0.01)

    assert [word for word, _, _ in words] == ["new", "expected", "expected", "identical"]
    assert not any(red for _, _, red in words)


def test_an_expected_failure_is_no_new_level() -> None:
    """When its day is over the series is red against the level from before."""
    until = replace(EXPECTED, until=date(2026, 1, 3))
    told = judge_history("t/c/m", SERIES, history(0.01, 3.0, 3.0, 3.0), (until,))

    assert [night.red for night in told] == [False, False, False, True]
    assert told[-1].last_good is not None
    assert told[-1].last_good.value == 0.01


def test_the_file_may_name_expected_failures(tmp_path: Path) -> None:
    file = tmp_path / "accepted.toml"
    file.write_text('[[expected]]\nseries = "t/*"\nwho = "Ada"\nwhy = "known"\nuntil = 2027-01-31\n')
    (entry,) = read_accepted(file)

    assert (entry.expected, entry.series, entry.until) == (True, "t/*", date(2027, 1, 31))
    file.write_text('[[expected]]\nseries = "t/*"\nwho = "Ada"\nwhy = "known"\nrange = [0, 1]\n')
    with pytest.raises(AcceptedError, match="expected entry 1: 'range' is not known"):
        read_accepted(file)


def test_an_expected_failure_that_holds_or_is_misspelt_is_reported() -> None:
    night = date(2026, 1, 1)

    assert unused([EXPECTED], ["t/c/m"], night) == []
    (holds,) = unused([EXPECTED], ["t/c/m"], night, held=["t/c/m"])
    assert "expected to fail, and it holds: t/*" in holds
    (typo,) = unused([EXPECTED], ["u/c/m"], night, held=["u/c/m"])
    assert "no such series: t/*" in typo


def test_a_comparison_knows_what_is_expected() -> None:
    from tests.tracker.judge.test_blame import _side

    found = compare(_side("a", 0.01), _side("b", 3.0), [EXPECTED])

    assert (found.changes[0].word, found.exit_code) == ("expected", 0)


def test_what_is_expected_to_fail_and_becomes_a_hundred_times_worse_is_said() -> None:
    told = judge_history("t/c/m", SERIES, history(0.01, 3.0, 3.0, 300.0), (EXPECTED,))

    assert [night.verdict.word for night in told] == ["new", "expected", "expected", "expected"]
    assert "; since" not in told[2].verdict.sentence
    assert "; since" in told[3].verdict.sentence and "by 2.0 decades" in told[3].verdict.sentence


def test_night_and_page_say_what_is_expected_and_became_worse_and_hold_no_level_of_it() -> None:
    other = series("u", "m", role="gate", limit=2.0, unit="m")
    levels = (EXPECTED, Accepted(series="u/*", low=0.0, high=5.0, who="Ada", why="for a while"))
    for values, said in ((3.0, 3.0), False), ((3.0, 300.0), True):
        runs = [
            night(n, [*one(0.01 if n == 0 else x), (other, sample(other, 0.01 if n < 2 else 1.0))])
            for n, x in enumerate((0.01, *values))
        ]
        records = DocumentHistory(runs)
        findings = tonight(records, runs[-1], levels)
        lines = [unstyle(line) for line in finding_lines(findings)]
        told = [line for line in lines if line.startswith("! t/")]
        site = book(records, levels)

        assert lines[0].endswith("; 1 are worse and accepted; 1 fail as expected")
        assert len(told) == said
        assert all("worse than expected; 0.01 → 300 m" in line and "by 2.0 decades" in line for line in told)
        assert [f["name"] for f in json.loads(findings_json(findings))].count("worse than expected") == said
        assert ("worse than expected: expected to fail; " in junit_of_night(findings)) == said
        assert ("| worse than expected | 0.01 | 300 m |" in night_markdown(runs[-1], findings)) == said
        page = lead(site, causes_of(site))["blamed"]
        assert ("1 expected failure is worse than before." in page) == said


def test_a_run_time_accepted_until_a_day_is_red_after_it_and_news_once() -> None:
    times = msgspec.structs.replace(SERIES, kind="time", better="smaller", limit=None)
    nights = history(*[1.0] * 12, *[1.5] * 12)
    until = night_of(nights[19].run)
    for day, red in ((until, 4), (None, 0)):
        level = Accepted(series="t/*", low=1.4, high=1.6, who="Ada", why="for now", until=day)
        told = judge_history("t/c/m", times, nights, (level,))

        assert [night.red for night in told[13:]] == [False] * (11 - red) + [True] * red
        assert sum(night.news for night in told) == (red > 0)
        if red:
            assert told[20].news
            assert told[-1].worse_at is nights[12]
            assert told[-1].levels == (1.0, 1.5)
