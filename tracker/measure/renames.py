"""Series that had another name before: a test, a metric or a ladder's configuration says what it was called, and its history
goes on."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping

import msgspec

from spook_tracker.scalar_tests.case import ScalarTest
from spook_tracker.tracker.document.run_document import SeriesDefinition


def with_aliases(
    series: Iterable[SeriesDefinition], tests: Mapping[str, ScalarTest]
) -> tuple[SeriesDefinition, ...]:
    """The series with the keys they had under earlier names of their test, their configuration and their metric."""
    earlier = {
        (name, metric.name): metric.formerly
        for name, test in tests.items()
        for _, metric in test.metrics()
        if metric.formerly
    }
    ways = {
        (name, way.name): way.formerly
        for name, test in tests.items()
        for ladder in test.ladders
        for way in ladder.configurations
        if way.formerly
    }
    return tuple(
        _renamed(
            found,
            tests,
            earlier.get((found.test, found.metric), ()),
            ways.get((found.test, found.configuration), ()) if found.metric.startswith("ladder:") else (),
        )
        for found in series
    )


def _renamed(
    found: SeriesDefinition,
    tests: Mapping[str, ScalarTest],
    metrics: tuple[str, ...],
    configurations: tuple[str, ...],
) -> SeriesDefinition:
    test = tests.get(found.test)
    names = test.formerly if test else ()
    if not names and not metrics and not configurations:
        return found
    _, configuration, _, *rest = found.key.split("/")
    earlier = itertools.product(
        (found.test, *names), (configuration, *configurations), (found.metric, *metrics)
    )
    keys = ("/".join([name, way, metric, *rest]) for name, way, metric in earlier)
    return msgspec.structs.replace(found, aliases=tuple(key for key in keys if key != found.key))
