"""Verdicts that hold: whose history it is, which commit is blamed, what an acceptance lends, what drifts."""

from __future__ import annotations

import math
from datetime import date

import msgspec

from spook_tracker.tracker.document.json_form import NAN
from spook_tracker.tracker.document.run_document import SeriesHistory
from spook_tracker.tracker.judge.accepted import Accepted, unused
from spook_tracker.tracker.judge.compare import ComparedRun, compare, known
from spook_tracker.tracker.judge.comparison_document import Side
from spook_tracker.tracker.judge.judged import blame, blame_of
from spook_tracker.tracker.judge.lane import histories, line_of
from spook_tracker.tracker.judge.series_history import judge_all, judge_history
from spook_tracker.tracker.judge.standing import Count, count
from spook_tracker.tracker.judge.tonight import tonight
from tests.histories.synthetic import DocumentHistory
from tests.tracker.judge.test_analyse import SERIES, history, run, sample, series, states
from tests.tracker.judge.test_one_judge import night, one


def test_each_regression_of_a_red_series_is_blamed_on_its_own_commit() -> None:
    points = history(0.03, 0.03, 0.035, 0.035, 0.06, 0.06)
    told = judge_all({"t/c/m": SeriesHistory(SERIES, tuple(points))})
    nights = told["t/c/m"].nights

    assert [judged.news for judged in nights] == [False, False, True, False, True, False]
    assert [j.first_bad.run.id for j in nights[2:] if j.first_bad] == ["run-2"] * 4
    assert known(told, ("run-3",), ("run-4",)).first_bad["t/c/m"] == (f"{3:040d}"[:12], f"{4:040d}"[:12])


def test_a_comparison_blames_a_range_where_commits_lie_between() -> None:
    told = judge_all({"t/c/m": SeriesHistory(SERIES, tuple(history(0.03, 0.03, 0.06)))})
    blamed = known(told, ("run-1",), ("run-2",)).blame["t/c/m"]

    assert blamed == blame_of(told["t/c/m"].nights[2])
    assert "any commit between may be the first" in blamed


def test_a_range_of_commits_is_blamed_where_not_every_commit_was_measured() -> None:
    good, bad = run(1), run(2)
    child = msgspec.structs.replace(bad.engine, parents=(good.engine.git_hash,))

    assert "any commit between may be the first" in blame(bad, good)
    assert blame(type(bad)(bad.id, bad.started, child, bad.machine), good).startswith("first bad commit")
    assert blame(type(bad)(bad.id, bad.started, good.engine, bad.machine), good).endswith("no commit did it")


def test_results_of_another_engine_are_not_our_history() -> None:
    ours, later = night(0, one(0.25)), night(2, one(0.25))
    theirs = night(1, one(0.1))
    other = msgspec.structs.replace(theirs.engine, name="other")
    records = DocumentHistory([ours, msgspec.structs.replace(theirs, engine=other, trigger="import"), later])
    (found,) = (f for f in tonight(records, later) if "work:" not in f.series)

    assert (found.verdict.word, found.red) == ("identical", False)
    assert [
        point.run.id for point in histories(records, line_of(records.runs(), later))[found.series].points
    ] == [
        ours.id,
        later.id,
    ]


def test_an_acceptance_is_lent_until_its_day_and_then_red_again() -> None:
    level = Accepted(series="t/*", low=0.0, high=0.03, who="me", why="known", until=date(2026, 1, 4))
    told = judge_history("t/c/m", SERIES, history(0.01, 0.02, 0.02, 0.02, 0.02, 0.02), [level])

    assert states(told) == ["green", "accepted", "green", "green", "detected", "detected"]
    for_ever = Accepted(series="t/*", low=0.0, high=0.03, who="me", why="known")
    assert states(judge_history("t/c/m", SERIES, history(0.01, 0.02, 0.02), [for_ever]))[-1] == "green"


def test_entries_that_do_nothing_are_reported() -> None:
    def entry(name: str, until: date | None = None) -> Accepted:
        return Accepted(series=name, low=0.0, high=1.0, who="me", why="known", until=until)

    said = unused(
        [entry("t/*"), entry("typo/*"), entry("t/c/m", date(2026, 1, 1))], ["t/c/m"], date(2026, 2, 1)
    )

    assert len(said) == 2
    assert "no such series: typo/*" in said[0]
    assert "accepted until 2026-01-01 and over" in said[1]


def test_a_limit_crossed_by_the_last_bit_says_so() -> None:
    nights = history(0.1, math.nextafter(0.1, 1.0))
    told = judge_history("t/c/m", SERIES, nights)

    assert told[1].verdict.name == "limit crossed"
    assert "by 1 ULP" in told[1].verdict.sentence


def test_a_value_that_comes_and_goes_is_a_flip_flop() -> None:
    told = judge_history("t/c/m", SERIES, history(0.01, 0.02, 0.01, 0.02, 0.01))

    assert [judged.verdict.name for judged in told if judged.red] == ["worse", "flip-flop"]


def test_slow_gains_are_improved_and_slow_losses_over_releases_are_drift() -> None:
    definition = series(relative_tolerance=0.02)
    better = judge_history("t/c/m", definition, history(*(0.01 * 0.999**n for n in range(200))))
    every = tuple(range(60))
    worse = judge_history("t/c/m", definition, history(*(0.01 * 1.009**n for n in every), releases=every))

    assert any(judged.verdict.word == "improved" for judged in better)
    assert not any(judged.red for judged in better)
    first = next(judged for judged in worse if judged.red)
    assert first.verdict.name == "drift"
    assert worse.index(first) == 11  # 1.009^11 is the first beyond five times the tolerance
    assert all(judged.red for judged in worse[11:])


def _side(name: str, value: float, **facts: object) -> ComparedRun:
    definition = series(**facts)
    side = Side(
        run=name, engine="toy", version=name, git_hash=name * 40, dirty=False,
        started="2026-11-21T03:00:00+00:00", machine="m", float_environment="f",
    )  # fmt: skip
    return ComparedRun(side=side, samples={"t/c/m": (definition, sample(value))})


def test_another_limit_or_unit_is_not_compared() -> None:
    for facts in ({"limit": 0.2}, {"unit": "cm"}):
        document = compare(_side("a", 0.05), _side("b", 0.0005, **facts))
        assert (document.changes[0].word, document.exit_code) == ("not_comparable", 3)


def test_no_value_on_either_side_is_said() -> None:
    document = compare(_side("a", math.nan), _side("b", math.nan))

    assert any("no value on either side: 1 series" in note for note in document.notes)


def test_what_an_engine_never_could_be_asked_is_no_limit_broken() -> None:
    (night,) = history(0.01)
    never = msgspec.structs.replace(
        night.sample, value=NAN, outcome="not_supported", passed=False, set_point_held=False
    )
    (told,) = judge_history("t/c/m", SERIES, [night._replace(sample=never)])

    assert (told.state, told.stands) == ("unjudged", "none")
    assert count([(SERIES, never)]) == Count()
