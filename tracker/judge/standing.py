"""What a value is on its own, against its limit and its set point, and how many limits and set points hold.

The one count: a limit is counted once for every series that carries one and decides something, whichever engine it
belongs to; what carries neither limit nor set point is followed and can only become worse than it was.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

import msgspec

from spook_tracker.tracker.document.run_document import Point, Sample, SeriesDefinition

from .vocabulary import CLASS_RANK, Class

NOT_SUPPORTED = "not_supported"  # outside the order: an engine cannot be asked this
FOLLOWED = ("reported", "explaining")  # roles of which nothing is expected
HAVE_VALUES = ("value", "unsettled", "out_of_limit")
NO_VALUE = ("not_finite", "diverged", "crashed", "timed_out", "missing")
NO_NUMBER = frozenset({*NO_VALUE, NOT_SUPPORTED})


def honest(sample: Sample) -> Sample:
    """A sample whose class fits its value: what is not finite is no value, whatever a document says."""
    if math.isfinite(sample.value) or sample.outcome in NO_NUMBER:
        return sample
    return msgspec.structs.replace(sample, outcome="not_finite", passed=False, set_point_held=False)


def expected(definition: SeriesDefinition) -> bool:
    """Whether theory or a limit expects something of this series."""
    return definition.role not in FOLLOWED and not (definition.limit is None and definition.set_point is None)


def standing(definition: SeriesDefinition, sample: Sample) -> Class:
    """fail, watch (set point left inside the limit), pass, or followed where nothing is expected."""
    if sample.outcome == NOT_SUPPORTED:
        return "none"
    if definition.role in FOLLOWED:
        return "followed"
    sample = honest(sample)
    if not sample.passed:
        return "fail"
    if definition.limit is None and definition.set_point is None:
        return "followed"
    return "pass" if sample.set_point_held or definition.set_point is None else "watch"


def against_limit(definition: SeriesDefinition, sample: Sample) -> Class:
    """What a value is for its limit alone, of any engine: engines that decide nothing are shown for what they are."""
    if sample.outcome == NOT_SUPPORTED:
        return "none"
    if not honest(sample).passed:
        return "fail"
    return "followed" if definition.limit is None else "pass"


def is_red(definition: SeriesDefinition, sample: Sample) -> bool:
    """A broken limit, a set point left, or no value where one is expected."""
    return standing(definition, sample) in ("fail", "watch")


def worst(classes: Iterable[Class]) -> Class:
    """The worst of some classes; none of none."""
    return min(classes, key=CLASS_RANK.__getitem__, default="none")


@dataclass(frozen=True, slots=True)
class Count:
    """Limits and set points of one run."""

    expected: int = 0  # series with a limit, a set point or both
    gates: int = 0  # among them those that decide for their test
    limits: int = 0
    broken: int = 0
    set_points: int = 0
    left: int = 0  # set points, the limit beside it holding
    lost: int = 0  # values that are not there, of series that are only followed

    @property
    def kept(self) -> int:
        """Limits that hold."""
        return self.limits - self.broken

    @property
    def red(self) -> bool:
        return self.broken + self.left + self.lost > 0


def count_points(points: Iterable[tuple[SeriesDefinition, Point]]) -> Count:
    """The count of a run from its place in the histories: only what the run recorded, whatever became of it."""
    return count((definition, point.sample) for definition, point in points if point.recorded)


def count(pairs: Iterable[tuple[SeriesDefinition, Sample]]) -> Count:
    """How many limits and set points there are in a run, and how many of them do not hold."""
    found: Counter[str] = Counter()
    for definition, sample in pairs:
        stands = standing(definition, sample)
        if stands == "none":
            continue
        if not expected(definition):
            found["lost"] += stands == "fail"
            continue
        limited = definition.limit is not None
        found["expected"] += 1
        found["gates"] += definition.role == "gate"
        found["limits"] += limited
        found["set_points"] += definition.set_point is not None
        found["broken"] += limited and stands == "fail"
        found["left"] += stands == "watch" or (not limited and stands == "fail")
    return Count(**found)
