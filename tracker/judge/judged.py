"""A night with its verdict, and what is asked of a night: its day, its commit, whether it is a release, who is to blame."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from datetime import UTC, date, datetime
from functools import lru_cache

import msgspec

from spook_tracker.tracker.document.json_form import Number
from spook_tracker.tracker.document.run_document import Point, Run, Sample

from .segments import Segment
from .slower import FLAKY, Usual
from .standing import NO_NUMBER
from .verdict import Verdict
from .vocabulary import Class, State

RELEASE = re.compile(r"v?\d+(\.\d+)*")
BY_TIME = "ordered by time, as neither parents nor git here tell how these commits descend from each other"
SURE = 0.995  # a boundary as probable needs no range


class Judged(msgspec.Struct, frozen=True, kw_only=True):
    """A night with its verdict. `against` is the night it was compared with."""

    night: Point
    verdict: Verdict
    state: State
    stands: Class  # what a reader sees: FAIL, WATCH, PASS …
    against: Point | None = None
    first_bad: Point | None = None  # where the present red began
    last_good: Point | None = None
    worse_at: Point | None = None  # where it last became worse while red: first_bad, or a later night
    before_worse: Point | None = None  # the night before that
    accepted: str = ""
    usual: Usual | None = None  # of run times: level and noise after this night
    time: float | None = None  # of run times: the value judged (tracker.judge.calibration.engines_own)
    confirms: bool | None = None  # of run times: whether a red segment is told for the first time tonight
    levels: tuple[float, float] | None = None  # of run times: what the percentage is of, before and now
    accused: tuple[Point, Point] | None = None  # of red run times: last surely good, first surely bad night
    probability: float | None = None  # that `worse_at` is right
    segment: Segment | None = (
        None  # of run times: the level that the night belongs to, as far as is known today
    )

    @property
    def red(self) -> bool:
        return self.state == "detected"

    @property
    def news(self) -> bool:
        """Red for a reason of tonight, or red since tonight, and not only still red."""
        return self.red and (self.worse_at is self.night if self.confirms is None else self.confirms)

    @property
    def pair(self) -> tuple[Number | None, Number]:
        """What is printed beside the sentence: the value before and now, of run times red, slow or recovered their levels."""
        told = self.state in ("detected", "recovered", "suspected") or self.verdict.name == FLAKY
        if told and self.levels is not None:
            return Number(self.levels[0]), Number(self.levels[1])
        return None if self.against is None else self.against.sample.value, self.night.sample.value

    @property
    def worsening(self) -> tuple[float, float]:
        """The value before it last became worse, NaN where there was none, and the one then; of run times the levels."""
        if self.levels is not None:
            return self.levels
        bad, good = self.worse_at or self.first_bad or self.night, self.before_worse or self.last_good
        return good.value if good else math.nan, bad.value


def commit_of(run: Run) -> str:
    """How a reader finds the version: twelve digits of its commit, or its version."""
    return run.engine.git_hash[:12] or run.engine.version


def night_of(run: Run) -> date:
    """The day of a run in UTC."""
    return datetime.fromisoformat(run.started).astimezone(UTC).date()


def is_release(run: Run) -> bool:
    """Whether the engine's version is one that was released, not one in between."""
    return not run.engine.dirty and _released(run.engine.version)


@lru_cache(maxsize=4096)
def _released(version: str) -> bool:
    return RELEASE.fullmatch(version) is not None


def blame_of(judged: Judged) -> str:
    """Which commit a red series became worse with, and how sure that is; empty if it is not red."""
    if judged.worse_at is None:
        return ""
    words = blame(judged.worse_at.run, judged.before_worse and judged.before_worse.run)
    if judged.accused is None or judged.probability is None or judged.probability >= SURE:
        return words
    good, bad = (commit_of(night.run) for night in judged.accused)
    return f"{words} ({100.0 * judged.probability:.0f} % sure; certainly after {good}, up to {bad})"


def blame(bad: Run, good: Run | None) -> str:
    """Which commit, or which range of commits, a change came with."""
    if good is None:
        return f"first bad commit {commit_of(bad)}, last good unknown"
    if same_commit(good, bad):
        return f"bad since a repeated run of {commit_of(bad)}, which was good before: no commit did it"
    if bad.engine.git_hash and good.engine.git_hash not in ("", *bad.engine.parents):
        words = (
            f"bad since {commit_of(bad)}, last good {commit_of(good)}: any commit between may be the first"
        )
        return words if of_one_lineage((good, bad)) else f"{words}; {BY_TIME}"
    return f"first bad commit {commit_of(bad)}, last good {commit_of(good)}"


def of_one_lineage(runs: Iterable[Run]) -> bool:
    """Whether ancestry tells the order of these runs' commits, and not time alone."""
    return len({getattr(run, "lineage", "") for run in runs} - {""}) < 2


def red_class(own: Class, sample: Sample) -> Class:
    """A limit broken or no value is FAIL; what only became worse than it was is WATCH."""
    return (
        "fail" if own == "fail" or sample.outcome in NO_NUMBER or not math.isfinite(sample.value) else "watch"
    )


def same_commit(before: Run, after: Run) -> bool:
    """Built from one clean commit of one engine: the answers must agree bit for bit."""
    old, new = before.engine, after.engine
    clean = old.git_hash != "" and not old.dirty and not new.dirty
    return clean and (old.name, old.git_hash) == (new.name, new.git_hash)
