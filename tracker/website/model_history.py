"""What became of a model with each version, in words: for tests whose values carry their rounding."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field

from spook_tracker.tracker.document.run_document import Point
from spook_tracker.tracker.judge.model_words import Moved, severity, words
from spook_tracker.tracker.judge.verdict import judge

from .nights import Trend

MOST = 50  # versions on a page, newest first


@dataclass(slots=True)
class Version:
    """One version beside the one before it."""

    version: str
    before: str
    moves: list[Moved] = field(default_factory=list)
    same: int = 0  # values with the same bits
    rounded: int = 0  # values that differ by rounding

    @property
    def told(self) -> list[str]:
        """What changed; or that nothing did."""
        if self.moves:
            return words(self.moves)
        if self.rounded:
            return [f"the same but for rounding, in {self.rounded} of {self.same + self.rounded} values"]
        return [f"the same bits in all {self.same} values"]


def _question(night: Point) -> tuple[str, str]:
    """What must be the same for two nights to be compared."""
    return night.test_version, night.run.machine.float_environment


def model_history(trends: Sequence[Trend]) -> list[Version]:
    """The versions a model was asked in after the first one, newest first; none for what is no model."""
    found: dict[tuple[str, str], Version] = {}
    for trend in trends:
        if trend.definition.sensitivity is None:
            continue
        nights = list(trend.told.points)
        for earlier, later in itertools.pairwise(nights):
            versions = earlier.run.engine.version, later.run.engine.version
            if versions[0] == versions[1] or _question(earlier) != _question(later):
                continue
            here = found.setdefault(versions, Version(versions[1], versions[0]))
            verdict = judge(trend.definition, earlier.sample, later.sample)
            if verdict.word == "identical" or (verdict.ulps == 0 and verdict.word == "changed"):
                here.same += 1
            elif verdict.word == "same":
                here.rounded += 1
            else:
                other = earlier.sample.outcome != later.sample.outcome
                here.moves.append(
                    Moved(
                        metric=trend.definition.metric,
                        unit=trend.definition.unit,
                        before=earlier.value,
                        after=later.value,
                        severity=severity(verdict.sentence),
                        became=verdict.sentence if other else "",
                    )
                )
    return list(reversed(found.values()))[:MOST]
