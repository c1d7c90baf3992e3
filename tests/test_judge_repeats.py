"""What is not looked at again is judged as if it were: nights that stay red, and where the nights looked at begin."""

from __future__ import annotations

import math
from typing import Any
from unittest.mock import patch

from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from spook_tracker.tracker.document.run_document import Point
from spook_tracker.tracker.judge import series_history
from spook_tracker.tracker.judge.lane import SPARSE, looked_at_again
from spook_tracker.tracker.judge.series_history import judge_history
from tests.synthetic_history import document, engine, sample, series

RUN = replace(document(0), series=(), samples=(), tests=(), figures=(), maps=())
COMMITS = [engine(n) for n in range(64)]
VALUES = (0.5, 0.5, 0.7, 0.7, 0.7, -0.7, 0.0, -0.0, 0.7000001, 1.5, 1.5, math.nan, math.inf)
NIGHT = st.tuples(
    st.sampled_from(VALUES),
    st.sampled_from(["", "", "", "a", "b"]),  # state
    st.sampled_from(["", "", "lost an axle"]),  # failure
    st.sampled_from([True, True, True, False]),  # set point
    st.sampled_from(["next", "next", "next", "same commit", "release"]),
)


def histories(told: list[tuple[Any, ...]], **facts: Any) -> tuple[Any, list[Point]]:
    definition = series("t", "m", **({"unit": "m", "role": "gate", "limit": 1.0} | facts))
    points, commit = [], 0
    for n, (value, state, failure, held, kind) in enumerate(told):
        commit += kind != "same commit"
        found = sample(definition, value, state_hash=state, failure=failure, set_point_held=held)
        build = COMMITS[commit]
        build = replace(build, version=f"1.{n}") if kind == "release" else build
        points.append(Point(replace(RUN, id=f"run-{n}", engine=build), found, definition.test_version))
    return definition, points


@settings(max_examples=80, deadline=None)
@given(
    st.lists(NIGHT, min_size=2, max_size=40),
    st.sampled_from(["smaller_magnitude", "larger", "inside"]),
    st.sampled_from([None, (0.4, 0.6)]),
    st.sampled_from([1e-9, 0.1]),
)
def test_nights_that_stay_red_are_told_as_if_each_were_judged(
    told: list[tuple[Any, ...]], better: str, set_point: Any, tolerance: float
) -> None:
    limit = (-1.0, 1.0) if better == "inside" else 1.0
    definition, points = histories(
        told, better=better, limit=limit, set_point=set_point, relative_tolerance=tolerance
    )
    quick = judge_history(definition.key, definition, points)
    with patch.object(series_history, "_stays_red", lambda *_: False):
        each = judge_history(definition.key, definition, points)

    assert [repr(night) for night in quick] == [repr(night) for night in each]


def test_a_red_night_that_repeats_is_not_judged_again() -> None:
    definition, points = histories([(v, "a", "", True, "next") for v in [0.5] * 3 + [0.7] * 50])
    with patch.object(series_history, "judge", wraps=series_history.judge) as judged:
        told = judge_history(definition.key, definition, points)

    assert [night.state for night in told] == ["green"] * 3 + ["detected"] * 50
    assert judged.call_count <= 4
    assert {night.worse_at.run.id for night in told[3:] if night.worse_at} == {"run-3"}


def test_one_more_night_seldom_moves_where_the_nights_looked_at_begin() -> None:
    """So that it changes nothing of what was said, and no page of what is over."""
    moved = []
    for count in range(1, 400):
        now, then = looked_at_again(count + 1, 60), looked_at_again(count, 60)
        assert {*range(max(0, count - 59), count + 1)} <= {*now}
        assert len(now) <= 60 + SPARSE + count // SPARSE
        moved.append(now != [*then, count])

    assert sum(moved) == (400 - 60) // SPARSE
