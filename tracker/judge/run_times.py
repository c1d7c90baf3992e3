"""A run time night by night: a list of level segments, and what they say by short rules.

A segment ends when two nights in a row stand clear of it, or when several together do (tracker/judge/shifts.py); one
night ends none. Each rule is a function: `_stands_clear`, `_begins`, `_worse`, `_came_back`, `_flaky`, `_crept`. Noise
is that of nights about the level of their own segment; where a segment is young, the last nights before it help out.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TypedDict, Unpack

from msgspec.structs import replace

from spook_tracker.tracker.document.middle import median

from .drift import DriftingLevel
from .level import (
    FLOOR,
    SIGMAS,
    WINDOW,
    Growing,
    Reference,
    as_usual,
    way_back,
)
from .noisy import Noisy
from .segments import Boundary, Segment, boundary, spread_of, until_the_next
from .shifts import (
    BASE,
    FEWEST_BASE,
    MANY,
    RARE,
    REACHED,
    SPANS,
    Shift,
    drawn_anew,
    more_of_the_slower,
    shift,
)
from .slower import CONFIRM, LEAST, Usual, change_in_words, flaky, slower
from .verdict import Verdict
from .vocabulary import with_recoveries

MENDED = 0.25  # of its size: a red level that is left of it is none
SETTLED = 30  # nights of a segment after which its boundary is known
BACK, WEIGHT = 9.0, 6.0  # log likelihoods: to believe that a red level was left; of one night at most
FEWEST_SPAN, LONGEST_SPAN = min(SPANS), max(SPANS)
OFTEN = 2  # times left before: such a level is flaky,
LONGER = 2  # until it lasts so many times its longest


class Options(TypedDict, total=False):  # of judged_and_segments
    larger_is_better: bool
    releases: Sequence[bool] | None
    accepted: Sequence[bool] | None
    tolerance: float
    absolute: float
    ages: Sequence[int] | None


def judge_noisy(values: Sequence[float], **options: Unpack[Options]) -> list[Noisy]:
    """A verdict for each value of one machine, oldest first: `judged_and_segments` without the segments."""
    return judged_and_segments(values, **options)[0]


def judged_and_segments(
    values: Sequence[float],
    *,
    larger_is_better: bool = False,
    releases: Sequence[bool] | None = None,
    accepted: Sequence[bool] | None = None,
    tolerance: float = 0.0,
    absolute: float = 0.0,
    ages: Sequence[int] | None = None,
) -> tuple[list[Noisy], list[Segment]]:
    """Verdicts and segments, oldest first. Worse is larger, unless larger is better.

    `tolerance` and `absolute`: the change, relative and in the unit of the values, up to which the series' definition
    tells none, whatever its noise. `ages`: how many nights each value lies after the first, where some are left out.
    """
    if (usual := as_usual(values, absolute)) is not None:
        near, absolute, mirrored, back = usual
        nights, segments = judged_and_segments(near, larger_is_better=larger_is_better != mirrored, releases=releases, accepted=accepted, tolerance=tolerance, absolute=absolute, ages=ages)  # fmt: skip
        segments = [dataclasses.replace(segment, level=back(segment.level)) for segment in segments]
        return [night.scaled(back) for night in nights], segments
    walk = _Walk(values, larger_is_better, tolerance, absolute, ages=ages or range(len(values)))
    told = []
    for place in range(len(values)):
        night = walk.night(place, bool(releases and releases[place]), bool(accepted and accepted[place]))
        told.append(Noisy(*night[:-1], walk.held_to()))
    states = with_recoveries([night.state for night in told])
    return [
        night if night.state == state else night._replace(state=state)
        for night, state in zip(told, states, strict=True)
    ], walk.segments()


@dataclass
class _Walk(DriftingLevel):
    """What is known of a series, night after night."""

    ages: Sequence[int] = ()
    off: list[int] = field(default_factory=list)  # the last nights in a row that stand clear, on one side
    reference: Reference | None = None  # while red or flaky
    over: list[Segment] = field(default_factory=list)
    first: tuple[int, int] | None = None  # of the red: last good and first bad night
    broken: int | None = None  # the night since which there is no finite value

    def held_to(self) -> Usual:
        """The level that a night is held to, and by which change of the value it stands clear of it for the worse."""
        level, threshold = math.inf, FLOOR
        if self.reference is not None:
            level, threshold = self.reference.level, self.reference.threshold
        elif self.now.places:
            level, _, threshold = self._level()
        return level, threshold / (1.0 + threshold) if self.larger_is_better else threshold

    # One more night.

    def night(self, place: int, release: bool, accepted: bool) -> Noisy:
        value, self.until = self.values[place], place + 1
        if not self.now.places:
            return self._without_a_level(place)
        level, _, threshold = self._level()
        if not self.timed[place]:
            return self._no_value(place, accepted)
        change = self._worse_by(level, value)
        self.broken = None
        self._see(place, self._costlier_by(level, value) if self.larger_is_better else change, threshold)
        found = self._begins()
        if not accepted and (mixed := self._of_two_levels(value, found)) is not None:
            return self._drawn_anew(place, mixed)
        if found is not None:
            return self._new_segment(place, found, accepted)
        if accepted and (self._red or (self.off and not self.better)):
            return self._accept(place)
        return self._holds(place, change, level, release)

    @property
    def _red(self) -> bool:
        return self.now.standing == "red" or self.crept > 0.0

    def _without_a_level(self, place: int) -> Noisy:
        """Before the first number there is nothing to be worse than."""
        if self.timed[place]:
            self._start(place)
        if place == self.start:
            return Noisy(verdict=Verdict(word="new", sentence="the first value"), state="green")
        verdict = Verdict(word="same", sentence="no number yet")
        return Noisy(verdict=verdict, state="green", against=place - 1)

    def _start(self, place: int) -> None:
        """A history that begins here."""
        self.now, self.anchor, self.start = Growing([place]), [place], place
        self.off, self.reference, self.first, self.crept = [], None, None, 0.0
        self.remembers, self.earlier, self.reached, self.runs = [], [], [], [[]]
        self._told = self._outer = None

    def _no_value(self, place: int, accepted: bool) -> Noisy:
        level = self._level()[0]
        good = self.now.places[-1]
        verdict = slower(math.inf, level, math.inf, "not finite")
        if accepted:
            return Noisy(verdict=verdict, state="accepted", against=good)
        news = self.broken is None
        self.broken = place if self.broken is None else self.broken
        if news and not self._red:
            self.first = good, place
        last, first = self.first or (good, place)
        return Noisy(verdict=verdict, state="detected", against=good, first_bad=first, last_good=last, worse_at=self.broken, news=news, levels=(level, self.values[place]))  # fmt: skip

    def _see(self, place: int, change: float, threshold: float) -> None:
        """The nights in a row that stand clear of the segment on one side; what no second one confirmed is noise."""
        worse = change > threshold and self._stands_clear(change)
        faster = way_back(change) if change < 0.0 else 0.0
        better = faster > threshold and faster > self._reach_down(threshold)
        if self.off and (not (worse or better) or better != self.better):
            self._join(self.off)
            self.off = []
        if worse or better:
            self.off, self.better = [*self.off, place], better
        else:
            self._join([place])

    # Rules: when a segment ends.

    def _begins(self) -> tuple[int, Shift | None] | None:
        """How many of the last nights are a new segment, and by which test; None if they are none."""
        if len(self.off) > 1 and self._chance(self.off) <= RARE:
            return len(self.off), None
        if self.reference is not None and (back := self._came_back()) is not None:
            return back
        return self._together() or self._above_both()

    def _together(self) -> tuple[int, Shift | None] | None:
        """Several nights that together lie above the segment's others."""
        level, noise, threshold = self._level()
        if len(self.now.places) + len(self.off) < FEWEST_BASE + FEWEST_SPAN or level <= 0.0:
            return None
        mean = self._last_above(level, self.off)
        strays = threshold > FLOOR and self._strays_often(len(self.off))
        if mean < LEAST and not strays:
            return None  # most nights: nothing to count
        nights = [*self.now.places[-BASE - max(MANY) :], *self.off]
        costs, found = self._costs(nights), None
        if mean >= LEAST:
            age = self.ages[nights[-1]] - self.ages[self.start]
            found = shift(costs, mean < noise, age, self._earlier())
        if found is None and strays:
            found = more_of_the_slower(costs)
        return (found.span, found) if found is not None and found.change > self._moves_by(found) else None

    def _above_both(self) -> tuple[int, Shift | None] | None:
        """Several nights above both of two clusters that nights are drawn from at random, whatever segments they made."""
        if not self.over or self.now.standing == "red" or len(self.now.places) >= BASE:
            return None
        level = self._level()[0]
        first = max(self.start, self.until - BASE - LONGEST_SPAN)
        if self.until - first < FEWEST_BASE + FEWEST_SPAN or self._last_above(level, self.off) < 0.5 * LEAST:
            return None
        nights = [i for i in range(first, self.until) if self.timed[i]]
        found = shift(self._costs(nights), True, self.ages[nights[-1]] - self.ages[self.start])
        told = found is not None and found.apart and found.change > self._tolerated(level)
        return (found.span, found) if found is not None and told else None

    def _came_back(self) -> tuple[int, None] | None:
        """Whether the last nights of a red segment are more probably of the level before it (Page's cumulative sum)."""
        assert self.reference is not None
        places = self.now.places
        settled = [
            self.values[i] for i in places[-WINDOW - LONGEST_SPAN : -LONGEST_SPAN] or places[:FEWEST_SPAN]
        ]
        level = median(settled)
        noise = max(spread_of(settled, level), self.reference.noise, 0.1 * LEAST)
        apart = self._worse_by(self.reference.level, level) / noise
        total = 0.0
        for recent, i in enumerate(reversed([*self.now.places[-SETTLED:], *self.off]), start=1):
            off = self._worse_by(self.reference.level, self.values[i]) / noise
            total += max(-WEIGHT, min(WEIGHT, apart * (0.5 * apart - off)))
            if total > BACK:
                return recent, None
            if total < -BACK:
                return None
        return None

    def _of_two_levels(self, value: float, found: tuple[int, Shift | None] | None) -> int | None:
        """Which segment's nights and all after them are drawn anew from two levels, where such would begin or keep one.

        As a place in `over`, behind whose end lies the present segment.
        """
        if found is None:
            if self.reference is None or self.now.standing != "red":
                return None
            half, last = 0.5 * self.now.size, [*self.now.places[-2:], *self.off][-2]
            if self._worse_by(self.reference.level, value) > half:
                return None  # as red as before
            if self._worse_by(self.reference.level, self.values[last]) <= half:
                return None  # as on the night before
        elif found[1] is not None:
            return None  # more of them than chance draws from one
        import numpy as np

        begun = [
            (place, segment.first)
            for place, segment in enumerate(self.over)
            if segment.first >= self.start and segment.standing in ("usual", "accepted")
        ]
        begun.append((len(self.over), self.now.places[0]))
        asked = found[0] if found else len(self.now.places) + len(self.off)  # of the last nights
        for place, first in begun:
            nights = [i for i in range(max(first, self.until - BASE), self.until) if self.timed[i]]
            if len(nights) >= max(FEWEST_BASE, asked + 1) and drawn_anew(
                np.array(self._costs(nights)), asked
            ):
                return place
        return None

    def _drawn_anew(self, place: int, segment: int) -> Noisy:
        """Segments that nights drawn anew from two levels seemed to make are one."""
        held, _ = self.held_to()
        joined = self.over[segment:]
        first = joined[0].first if joined else self.now.places[0]
        nights = [i for i in range(self.start, self.until) if self.timed[i]]
        if joined:
            del self.over[segment:]
            before = [i for i in nights if i < first][-WINDOW:]
            self.now = Growing([], joined[0].standing, before, joined[0].boundary)
            self.reference, self.first = None, None
        self.now.places, self.off = [i for i in nights if i >= first], []
        self._reach_again()
        if self.now.standing == "red":
            return self._red_night(news=False)
        value = self.values[place]
        words = f"{change_in_words(self._worse_by(held, value))}, of two levels that nights are drawn from"
        return Noisy(verdict=flaky(words), state="green", against=self.now.places[0], levels=(held, value))

    # A new segment.

    def _new_segment(self, place: int, found: tuple[int, Shift | None], accepted: bool) -> Noisy:
        nights = [*self.now.places, *self.off]
        count, told = found
        if count >= len(nights):  # the segment is as young: what was before it
            first = max(self.start, place - WINDOW - SETTLED)
            nights = [i for i in range(first, place + 1) if self.timed[i]]
        _, noise, threshold = self._level()
        near = nights[-WINDOW - count :]
        where = boundary(near, self._costs(near), count)
        first = where.best
        after = [i for i in nights if i >= first]
        before = [i for i in nights if i < first]
        usual = [self.values[i] for i in before[-WINDOW:]]
        old = median(usual)
        noise = spread_of(usual, old) if len(usual) >= FEWEST_BASE else noise
        level = median([self.values[i] for i in after])
        was, began = self.now.standing, self.now.where
        held = self.reference or Reference(old, threshold, noise, before[-1], min(len(before), WINDOW))
        self.over.append(
            Segment(nights[0] if began is None else began.best, before[-1], old, noise, was, began)
        )
        off = [self._costlier_by(old, self.values[i]) for i in before[-REACHED:]]
        self.earlier = [*self.earlier, *off][-REACHED:]
        self.remembers, self.reached = [*self.remembers, *off[-WINDOW:]][-WINDOW:], []
        self._outer = None
        self.now = Growing(after, "usual", before[-WINDOW:], where)
        self.off, self._told, self.crept, self.runs = [], None, 0.0, [*self.runs, []]
        change = self._worse_by(held.level, level)
        words = change_in_words(change)
        if accepted and change > 0.0:
            return self._accept(place)
        rose = self._worse_by(old, level) > 0.0
        if change > 0.0 and ((rose and self.reference is None) or self._worse(held, level, len(after))):
            apart = told is not None and told.apart
            if was != "red" and not apart and (stay := self._flaky(held, level, len(after))):
                self.reference, self.now.standing, self.now.stay = held, "flaky", stay
                return self._flaky_night(level)
            self.reference, self.now.standing, self.now.size = held, "red", change
            if was != "red":
                self.first = before[-1], where.best
            if rose and told is not None:
                words += f" over {told.span} nights, by chance once in {1.0 / told.probability:.0e}"
            return self._red_night(news=rose, words=words)
        self.reference, self.first = None, None
        self.now.standing = "recovered" if was == "red" else "usual"
        better = Verdict(
            word="improved" if self._worse_by(old, level) < 0 and was != "red" else "same", sentence=words
        )
        if was == "red":
            better = replace(better, sentence=f"{words}, inside the noise")
        return Noisy(verdict=better, state="green", against=before[-1], levels=(held.level, level))

    def _settle(self) -> None:
        """The boundary of a young segment again, with one more night behind it; nights change sides with it."""
        old = self.now.where
        if old is None or len(old.places) == 1 or len(self.now.places) > SETTLED:
            return  # or it is sure already
        if self.now.places[0] != old.best:
            return
        nights = [*self.now.before, *self.now.places]
        where = boundary(nights, self._costs(nights), len(self.now.places))
        best = where.best
        if best not in old.places:
            return
        before = [i for i in nights if i < best]
        if self.first is not None and self.first[1] == old.best:
            self.first = before[-1], best
        self.now.where, self.now.before, self.now.places = where, before, nights[len(before) :]
        self._told = None

    def _worse(self, held: Reference, level: float, nights: int) -> bool:
        """Whether a level is worse than what it is held to, beyond noise and tolerance."""
        noise = max(held.noise, self._level()[1])
        noise *= SIGMAS * math.sqrt(1.0 / nights + 1.0 / held.nights)
        return self._costlier_by(held.level, level) > max(
            LEAST, min(noise, held.threshold), self._tolerated(held.level)
        )

    def _flaky(self, held: Reference, level: float, nights: int) -> int:
        """How long a level may last that was reached and left again before, often; zero of another."""
        change = self._worse_by(held.level, level)
        near = SIGMAS * max(held.noise, LEAST) / math.sqrt(nights)
        been = [
            segment.last - segment.first + 1
            for segment in self.over
            if segment.first >= self.start
            and abs(self._worse_by(held.level, segment.level) - change) <= near
            and segment.standing in ("red", "flaky")
        ]
        return LONGER * max(been) if len(been) >= OFTEN else 0

    # What is said.

    def _holds(self, place: int, change: float, level: float, release: bool) -> Noisy:
        """A night that ends no segment."""
        self._settle()
        self._split_inside()
        fast = bool(self.off) and self.better
        if self.now.standing == "red":
            return self._mended() or self._second_at_once(self._red_night(news=False), change)
        if self.now.standing == "flaky":
            assert self.reference is not None
            if len(self.now.places) <= self.now.stay:
                return self._flaky_night(self._level()[0])
            self.now.standing, self.now.size = "red", self._worse_by(self.reference.level, self._level()[0])
            assert self.now.where is not None
            self.first = self.reference.last, self.now.where.best
            return self._red_night(news=True)
        if not self.off or self.better:
            self._anchors(place, release)
        good = self.now.places[0]
        was = self.crept > 0.0
        if (creep := self._crept()) is not None:
            return self._drifted(*creep, news=not was)
        if self.off and not self.better:
            verdict = slower(change, level, self.values[place], "")
            return Noisy(verdict=verdict, state="suspected", against=good, levels=(level, self.values[place]))
        words = change_in_words(change)
        verdict = Verdict(word="same", sentence=f"{words}, inside the noise")
        if fast:
            verdict = Verdict(word="improved", sentence=words)
        elif change > FLOOR and change > self._strays():
            verdict = flaky(f"{words}, and nights of this level go as far now and then")
        return Noisy(verdict=verdict, state="green", against=good, levels=(level, self.values[place]))

    def _red_night(self, news: bool, words: str = "") -> Noisy:
        assert self.reference is not None and self.now.where is not None and self.first is not None
        held, level = self.reference.level, self._level()[0]
        verdict = slower(self._worse_by(held, level), held, level, "slower")
        if words:
            verdict = replace(verdict, sentence=words)
        where = self.now.where
        good, first = self.first
        step = self._worse_by(self.over[-1].level, level)
        risen = step > 0.0
        if risen and where.best != first:
            words = f"{verdict.sentence}; the last step alone is {100.0 * step:+.1f} %"
            verdict = replace(verdict, sentence=words)
        began = where if risen else self._began_at(first)
        accused = (max(began.places[0] - 1, 0), began.places[-1]) if began else (good, first)
        return Noisy(
            verdict=verdict, state="detected", against=good, first_bad=first, last_good=good,
            worse_at=where.best if risen else first, news=news, accused=accused,
            probability=began.probability if began else None, levels=(held, level),
        )  # fmt: skip

    def _began_at(self, first: int) -> Boundary | None:
        """Where the red began, of which the present segment is a better part: it is to blame, and not what mended some."""
        began = (segment.boundary for segment in reversed(self.over))
        return next((found for found in began if found is not None and found.best == first), None)

    def _second_at_once(self, night: Noisy, change: float) -> Noisy:
        """A red night that stands clear of its own level, too: told on that night, and blamed when another confirms it."""
        if not self.off or self.better:
            return night
        words = f"{night.verdict.sentence}; tonight {change_in_words(change)} on top of that"
        return night._replace(verdict=replace(night.verdict, sentence=f"{words}, {CONFIRM}"))

    def _mended(self) -> Noisy | None:
        """Recovered, if the red level came to lie where the one before it was, little by little."""
        assert self.reference is not None
        held, level = self.reference.level, self._level()[0]
        change = self._worse_by(held, level)
        if change > MENDED * self.now.size:
            return None
        good = self.reference.last
        self.reference, self.first, self.now.standing = None, None, "recovered"
        verdict = Verdict(word="same", sentence=f"{change_in_words(change)}, inside the noise")
        return Noisy(verdict=verdict, state="green", against=good, levels=(held, level))

    def _flaky_night(self, level: float) -> Noisy:
        assert self.reference is not None
        held = self.reference.level
        words = f"{change_in_words(self._worse_by(held, level))}, at a level that was left again before"
        return Noisy(verdict=flaky(words), state="green", against=self.reference.last, levels=(held, level))

    def _accept(self, place: int) -> Noisy:
        """The present level is the one that others are held to from now on."""
        held, _ = self.held_to()
        change = self._worse_by(held, self.values[place])
        good = self.now.places[-1]
        verdict = slower(change, held, self.values[place], "slower")
        level, noise, _ = self._level()
        began = self.now.where.best if self.now.where else self.start
        self.over.append(Segment(began, good, level, noise, self.now.standing, self.now.where))
        self._start(place)
        self.now.standing = "accepted"
        return Noisy(verdict=verdict, state="accepted", against=good, levels=(held, self.values[place]))

    def segments(self) -> list[Segment]:
        """All segments, the present one last; each lasts until the next begins."""
        if not self.now.places:
            return []
        level, noise, _ = self._level()
        first = self.now.where.best if self.now.where else self.start
        last = Segment(first, self.until - 1, level, noise, self.now.standing, self.now.where)
        return until_the_next([*self.over, last])
