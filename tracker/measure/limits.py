"""Limits a team sets its own engine, by series: they take the place of a test's, and what has one gates."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase

from spook_tracker.scalar_tests.case import Measurement, Metric, ScalarTest
from spook_tracker.tracker.document.errors import TrackerError

from .catalogues import Changed
from .question import series_key

Limit = float | tuple[float, float]
Limits = tuple[tuple[str, Limit], ...]  # pattern of series keys (* matches anything), limit
SOURCE = "tracker.toml"


class LimitError(TrackerError):
    """A limit that cannot be applied; one sentence that names it."""


def held_to(tests: Mapping[str, ScalarTest], limits: Limits) -> Mapping[str, ScalarTest]:
    """The tests with these limits; of two that match, the later one counts. LimitError if one matches nothing."""
    used: set[str] = set()

    def held(name: str, test: ScalarTest) -> ScalarTest:
        return replace(
            test,
            measurements=tuple(
                replace(m, metrics=tuple(_metric(name, m, metric, limits, used) for metric in m.metrics))
                for m in test.measurements
            ),
        )

    found = Changed(tests, held)
    for name in found:
        if any(_may_match(pattern, name) for pattern, _ in limits):
            _ = found[name]  # a limit that cannot be applied is refused now, not when its test is asked
    for pattern, _ in limits:
        if pattern not in used:
            raise LimitError(
                f"{SOURCE}: no series is called {pattern!r}; `tracker run --no-record --json FILE` names them all"
            )
    return found


def _may_match(pattern: str, test: str) -> bool:
    """Whether a pattern may be of a series of this test, by its characters before the first that stands for others."""
    beginning, key = re.split(r"[*?\[]", pattern, maxsplit=1)[0], f"{test}/"
    return key.startswith(beginning) or beginning.startswith(key)


def _metric(
    test: str, measurement: Measurement, metric: Metric, limits: Sequence[tuple[str, Limit]], used: set[str]
) -> Metric:
    key = series_key(
        test, measurement.configuration, metric.name, measurement.time_step, measurement.parameters
    )
    for pattern, limit in limits:
        if not fnmatchcase(key, pattern):
            continue
        used.add(pattern)
        if isinstance(limit, tuple) != (metric.better == "inside"):
            wanted = "two numbers" if metric.better == "inside" else "one number"
            raise LimitError(f"{SOURCE}: the limit of {key} is {wanted}, not {limit!r}")
        metric = replace(metric, limit=limit, limit_source=SOURCE, limit_kind="method", role="gate")
    return metric
