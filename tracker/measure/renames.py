"""Series that had another name before: a test or a metric says what it was called, and its history goes on."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping

import msgspec

from spook_tracker.scalar_tests.case import ScalarTest
from spook_tracker.tracker.document.run_document import SeriesDefinition


def with_aliases(
    series: Iterable[SeriesDefinition], tests: Mapping[str, ScalarTest]
) -> tuple[SeriesDefinition, ...]:
    """The series with the keys they had under earlier names of their test and of their metric."""
    earlier = {
        (name, metric.name): metric.formerly
        for name, test in tests.items()
        for _, metric in test.metrics()
        if metric.formerly
    }
    return tuple(_renamed(found, tests, earlier.get((found.test, found.metric), ())) for found in series)


def _renamed(
    found: SeriesDefinition, tests: Mapping[str, ScalarTest], metrics: tuple[str, ...]
) -> SeriesDefinition:
    test = tests.get(found.test)
    names = test.formerly if test else ()
    if not names and not metrics:
        return found
    _, configuration, _, *rest = found.key.split("/")
    pairs = itertools.product((found.test, *names), (found.metric, *metrics))
    keys = ("/".join([name, configuration, metric, *rest]) for name, metric in pairs)
    return msgspec.structs.replace(found, aliases=tuple(key for key in keys if key != found.key))
