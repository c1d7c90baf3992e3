"""Stretches of red nights: where they begin, how they end, what they are called."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from spook_tracker.tracker.judge.accepted import Accepted
from spook_tracker.tracker.website.events import all_events
from spook_tracker.tracker.website.nights import Book, book
from tests.histories.synthetic import DocumentHistory, document, engine, sample, series

GATE = series("t", "m", role="gate", limit=1.0, unit="m")


def told(*values: float, accepted: Sequence[Accepted] = (), **changes: Any) -> Book:
    """A book of one gate with these values, night by night."""
    from msgspec.structs import replace

    definition = series("t", "m", **({"role": "gate", "limit": 1.0, "unit": "m"} | changes))
    runs = []
    for night, value in enumerate(values):
        empty = document(night)
        card = replace(empty.tests[0], name="t")
        runs.append(
            replace(
                empty,
                series=(definition,),
                samples=(sample(definition, value),),
                tests=(card,),
                figures=(),
                maps=(),
            )
        )
    return book(DocumentHistory(runs), accepted)


def test_a_broken_limit_is_told_from_its_first_night_until_it_is_mended() -> None:
    made = told(0.5, 0.5, 3.0, 3.0, 0.5)

    (event,) = all_events(made)
    assert (event.first.index, event.last.index) == (2, 3)
    assert (event.before, event.value) == (0.5, 3.0)
    assert event.good is not None
    assert event.good.index == 1
    assert event.end is not None
    assert event.end.index == 4
    assert (event.name, event.standing, event.stands) == ("limit crossed", "recovered", "fail")


def test_a_regression_that_lasts_has_no_end() -> None:
    (event,) = all_events(told(0.5, 0.5, 0.7))

    assert event.lasting
    assert event.end is None
    assert event.stands == "watch"
    assert event.first.engine.git_hash == engine(2).git_hash


def test_no_finite_value_is_red_that_same_night() -> None:
    (event,) = all_events(told(0.5, math.nan))

    assert event.stands == "fail"
    assert event.name == "not finite"


def test_an_accepted_level_is_told_as_accepted() -> None:
    level = Accepted(series="t/*", low=0.0, high=0.8, who="Ada", why="a wider beam", until=None)

    (event,) = all_events(told(0.5, 0.7, 0.7, accepted=[level]))
    assert event.standing == "accepted"
    assert not event.lasting
    assert "Ada" in event.accepted


def test_a_value_that_is_red_from_the_first_night_on_is_told() -> None:
    (event,) = all_events(told(3.0, 3.0))

    assert event.lasting
    assert event.first.index == 0
    assert math.isnan(event.before)


def test_a_build_with_local_changes_is_tonight_only_while_it_is_the_newest() -> None:
    from msgspec.structs import replace

    dirty = replace(document(1), engine=replace(engine(1), dirty=True))

    assert len(book(DocumentHistory([document(0), document(2), dirty])).nights) == 2
    newest = replace(dirty, id="run-last", started="2027-01-01T00:00:00+00:00")
    assert book(DocumentHistory([document(0), document(2), newest])).tonight.id == "run-last"


def test_a_renamed_series_keeps_its_newest_definition() -> None:
    made = told(0.5, 0.6, limit=2.0)

    assert made.tests[0].trends[0].definition.limit == 2.0
    assert made.tests[0].trends[0].values[:] == [0.5, 0.6]
    assert GATE.key == made.tests[0].trends[0].definition.key
