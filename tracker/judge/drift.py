"""Drift of a noisy series: the last nights against those of the last release, without a step between them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from spook_tracker.tracker.document.middle import median

from .level import CREEP, PresentLevel
from .noisy import Noisy
from .slower import change_in_words
from .verdict import Verdict

LONG = 3  # times the nights whose middle tells a drift, before it is gone


@dataclass
class DriftingLevel(PresentLevel):
    """The present level, and whether it crept away from that of the last release."""

    anchor: list[int] = field(default_factory=list)  # the nights at the last release
    anchored: float = math.nan  # the middle of these
    crept: float = 0.0  # the largest drift since it is red; zero while it is not
    crept_at: int = 0  # the night when that was told

    def _anchors(self, place: int, release: bool) -> None:
        if release and len(self.anchor) >= CREEP:
            self.anchor, self.crept = [place], 0.0
        elif len(self.anchor) < CREEP:
            self.anchor = [*self.anchor, place]
            self.anchored = median(self.values[i] for i in self.anchor)

    def _crept(self) -> tuple[float, float] | None:
        """Drift against the last release, where both ends have nights enough: red until half of it is gone."""
        last = self.now.places[-CREEP:]
        if len(self.anchor) < CREEP or len(last) < CREEP:
            return None
        old, recent = self.anchored, median([self.values[i] for i in last])
        change, threshold = self._worse_by(old, recent), self._level()[2]
        enough = min(threshold, 0.5 * self.crept) if self.crept else threshold
        if self.crept and change <= enough:  # a few fast nights do not end it
            recent = median([self.values[i] for i in self.now.places[-LONG * CREEP :]])
            change = self._worse_by(old, recent)
        if change <= enough or (not self.crept and change * abs(old) <= self._wanders()):
            self.crept = 0.0
            return None
        self.crept = max(self.crept, change)
        return old, recent

    def _drifted(self, old: float, recent: float, news: bool) -> Noisy:
        change = self._worse_by(old, recent)
        words = f"{change_in_words(change)}, little by little since the last release"
        verdict = Verdict(word="regressed", sentence=words, name="drift")
        if news:
            self.crept_at = self.until - 1
        good, bad = self.anchor[-1], self.crept_at  # no commit did it: any since then may have a share
        return Noisy(
            verdict=verdict, state="detected", against=self.anchor[0], first_bad=bad, last_good=good,
            worse_at=bad, news=news, accused=(good, bad), levels=(old, recent),
        )  # fmt: skip
