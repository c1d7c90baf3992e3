"""One line for each cause: what became worse with the same commits stands together, with its worst first."""

from __future__ import annotations

import math
from typing import Any

from click import unstyle

from spook_tracker.tracker.cli.report_compare import finding_lines
from spook_tracker.tracker.judge.accepted import Accepted
from spook_tracker.tracker.judge.causes import Cause, causes, causes_tonight
from spook_tracker.tracker.judge.lane import histories, line_of
from spook_tracker.tracker.judge.series_history import judge_all
from spook_tracker.tracker.judge.tonight import tonight
from spook_tracker.tracker.judge.verdict import Verdict
from tests.histories.synthetic import DocumentHistory, document, engine, sample, series
from tests.tracker.judge.test_one_judge import night, rungs

A, B, C = (series(test, "m", role="gate", limit=1.0, unit="m") for test in ("a", "b", "c"))


def nights(*columns: tuple[float | None, ...]) -> list[Any]:
    """Runs of the series a, b, c with these values; None is a night that did not ask for the test."""
    runs = []
    for number, values in enumerate(zip(*columns, strict=True)):
        pairs = [(d, sample(d, v)) for d, v in zip((A, B, C), values, strict=False) if v is not None]
        runs.append(night(number, pairs, trigger="manual"))
    return runs


def found(runs: list[Any], accepted: tuple[Accepted, ...] = ()) -> list[Cause]:
    records = DocumentHistory(runs)
    return causes(judge_all(histories(records, line_of(runs, runs[-1])), accepted))


def commit(number: int) -> str:
    return engine(number).git_hash


def test_what_became_worse_with_one_commit_is_one_cause_and_the_worst_stands_first() -> None:
    (cause,) = found(nights((0.5, 0.5, 3.0), (0.5, 0.5, 7.0), (0.5, 0.5, 0.5)))

    assert (cause.good.engine.git_hash, cause.bad.engine.git_hash) == (commit(1), commit(2))
    assert (cause.tests, cause.standing) == (("b", "a"), "detected")
    assert (cause.worst.margin, cause.worst.measure) == (7.0, "7 × its limit")
    assert f"2 series of 2 tests; first bad commit {commit(2)[:12]}" in cause.sentence


def test_no_value_is_worse_than_any_value_and_any_broken_limit_worse_than_a_growth_inside_it() -> None:
    (cause,) = found(nights((0.001, 0.9), (0.5, 1.1), (0.5, math.nan)))

    assert [hit.test for hit in cause.hits] == ["c", "b", "a"]
    assert [hit.measure for hit in cause.hits] == ["no value", "1.1 × its limit", "900 × before"]


def test_two_commits_are_two_causes_and_a_series_that_worsens_twice_belongs_to_both() -> None:
    newest, older = found(nights((0.5, 3.0, 5.0), (0.5, 0.5, 2.0)))

    assert newest.bad.engine.git_hash == commit(2)
    assert {hit.test for hit in newest.hits} == {"a", "b"}
    assert (older.bad.engine.git_hash, older.tests) == (commit(1), ("a",))


def test_the_narrowest_range_is_the_causes() -> None:
    """Series b was not measured on the second night: its own range is wider."""
    (cause,) = found(nights((0.5, 0.5, 3.0), (0.5, None, 2.0)))

    assert cause.good.engine.git_hash == commit(1)
    assert {hit.good.engine.git_hash for hit in cause.hits} == {commit(0), commit(1)}


def test_a_cause_is_detected_until_the_last_of_its_series_came_back() -> None:
    columns = ((0.5, 3.0, 3.0, 0.5), (0.5, 0.7, 0.5, 0.5))

    assert [cause.standing for cause in found(nights(*(column[:3] for column in columns)))] == ["detected"]
    (cause,) = found(nights(*columns))
    assert cause.standing == "recovered"
    assert {hit.test: hit.standing for hit in cause.hits} == {"a": "recovered", "b": "recovered"}
    assert {hit.test: hit.end.engine.git_hash for hit in cause.hits} == {"a": commit(3), "b": commit(2)}


def test_an_accepted_level_settles_its_part_of_a_cause() -> None:
    level = Accepted(series="a/*", low=0.0, high=0.8, who="Ada", why="a wider beam")
    columns = ((0.5, 0.7), (0.5, 0.5))

    (cause,) = found(nights(*columns), (level,))
    assert (cause.standing, cause.worst.end.engine.git_hash) == ("accepted", commit(1))


def test_a_slow_down_is_blamed_on_its_first_night_and_is_news_on_the_second() -> None:
    runs = [night(n, rungs(1e-3 * (2.0 if n >= 12 else 1.0))) for n in range(15)]
    records = DocumentHistory(runs[:14])

    (told,) = (finding for finding in tonight(records, runs[13]) if finding.red)
    assert told.news
    (cause,) = causes_tonight([told])
    assert (cause.bad.id, cause.good.id) == (runs[12].id, runs[11].id)
    assert abs(cause.worst.margin - 2.0) < 1e-9
    (later,) = (finding for finding in tonight(DocumentHistory(runs), runs[14]) if finding.red)
    assert not later.news


def test_a_map_that_became_worse_is_a_cause_too() -> None:
    runs = [document(0, broken=0), document(1, broken=-3)]
    red = [finding for finding in tonight(DocumentHistory(runs), runs[1]) if finding.red]

    (cause,) = causes_tonight([finding for finding in red if finding.definition is None])
    assert (cause.good.id, cause.bad.id, cause.worst.test) == (runs[0].id, runs[1].id, "pendulum")
    assert math.isnan(cause.worst.margin)


def test_the_night_says_each_cause_once_before_its_series() -> None:
    runs = nights((0.5, 0.5, 3.0), (0.5, 0.5, 7.0))
    lines = [unstyle(line) for line in finding_lines(tonight(DocumentHistory(runs), runs[-1]))]

    assert lines[0].startswith("✗ 2 worse")
    assert lines[1].startswith(f"  2 series of 2 tests; first bad commit {commit(2)[:12]}")
    assert [line[:3] for line in lines[2:]] == ["✗ b", "✗ a"] or [line[:3] for line in lines[2:]] == [
        "✗ a",
        "✗ b",
    ]


def test_nothing_red_has_no_cause() -> None:
    assert found(nights((0.5, 0.5))) == []
    assert causes_tonight([]) == []
    assert not Verdict(word="same", sentence="").red
