"""The laws of the machine that judges values without noise, over random histories."""

from __future__ import annotations

import math
from datetime import date
from typing import Any

import msgspec
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from spook_tracker.tracker.document.run_document import Point
from spook_tracker.tracker.judge.accepted import Accepted
from spook_tracker.tracker.judge.exact_values import KnownValue, Series, judge_values, step
from spook_tracker.tracker.judge.judged import Judged
from tests.tracker.judge.test_analyse import SERIES, run, sample, series

VALUES = st.sampled_from([0.01, 0.01, 0.01, 0.0101, 0.0104, 0.012, 0.05, 0.5, -0.01, 0.0, -0.0, math.nan])
ANSWERS = st.sampled_from(["as measured"] * 12 + ["not_supported", "missing", "removed"])
ENTRY = st.builds(
    Accepted,
    series=st.just("t/*"),
    low=st.sampled_from([0.0, 0.011]),
    high=st.sampled_from([0.06, 1.0]),
    who=st.just("Ada"),
    why=st.just("known"),
    until=st.sampled_from([None, date(2026, 1, 8), date(2026, 1, 15)]),
    expected=st.sampled_from([False, False, True]),
)


@st.composite
def nights(draw: Any) -> list[Point]:
    found = []
    for number in range(draw(st.integers(1, 24))):
        measured, answer = sample(draw(VALUES)), draw(ANSWERS)
        if answer == "not_supported":
            measured = msgspec.structs.replace(measured, outcome="not_supported", passed=True)
        elif answer != "as measured":
            why = "removed from the catalogue" if answer == "removed" else "asked for and not answered"
            measured = msgspec.structs.replace(
                measured, value=math.nan, outcome="missing", passed=False, failure=why
            )
        version = draw(st.sampled_from(["1.0.0", "1.0.1.dev1", "1.0.1.dev1"]))
        found.append(Point(run(number, version=version), measured, "1"))
    return found


SETTINGS = settings(max_examples=150, deadline=None, suppress_health_check=list(HealthCheck))
DEFINITION = st.sampled_from([SERIES, series(relative_tolerance=0.02), series(limit=None)])
HISTORY = given(DEFINITION, nights(), st.lists(ENTRY, max_size=2))


def walked(asked: Series, history: list[Point]) -> list[tuple[KnownValue, Judged, KnownValue]]:
    """Each night with what was known before it and after it."""
    found, state = [], KnownValue()
    for night in history:
        before = state
        state, judged = step(asked, state, night)
        found.append((before, judged, state))
    return found


@SETTINGS
@HISTORY
def test_a_state_is_named_by_the_last_verdict_that_said_anything(
    definition: Any, history: list[Point], accepted: list[Accepted]
) -> None:
    for before, judged, after in walked(Series("t/c/m", definition, accepted), history):
        if judged.state == "unjudged":
            assert (after.name == "red") == (before.name == "red")
        else:
            assert (after.name == "red") == judged.red
        assert (after.red is not None) == (after.name == "red")
        assert (judged.state == "recovered") <= (before.name == "red")


@SETTINGS
@HISTORY
def test_what_is_red_is_never_the_level_that_holds_after_a_good_night(
    definition: Any, history: list[Point], accepted: list[Accepted]
) -> None:
    for before, judged, after in walked(Series("t/c/m", definition, accepted), history):
        if judged.red and before.level is not None and before.lent is None:
            assert after.level is before.level
            assert (after.release, after.settled) == (before.release, before.settled)
        elif judged.state in ("green", "recovered") and judged.verdict.word != "expected":
            assert after.level is judged.night


@SETTINGS
@HISTORY
def test_a_calm_night_passed_without_a_look_is_what_a_look_would_say(
    definition: Any, history: list[Point], accepted: list[Accepted]
) -> None:
    asked = Series("t/c/m", definition, accepted)
    for before, judged, after in walked(asked, history):
        if before.name == "calm":
            looked, seen = step(asked, msgspec.structs.replace(before, name="held"), judged.night)
            assert (seen.verdict.word, seen.state, seen.stands) == (
                judged.verdict.word,
                judged.state,
                judged.stands,
            )
            assert looked == after


@SETTINGS
@HISTORY
def test_one_more_night_leaves_what_was_said_of_the_others(
    definition: Any, history: list[Point], accepted: list[Accepted]
) -> None:
    asked = Series("t/c/m", definition, accepted)
    whole = [(j.state, j.verdict) for j in judge_values(asked, history)]
    shorter = [(j.state, j.verdict) for j in judge_values(asked, history[:-1])]

    assert whole[:-1] == shorter
