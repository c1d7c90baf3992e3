"""Series with noise: a night is red when it and the night before both stand clear of what is usual.

Usual is the median of the nights that hold, noise their median absolute deviation. What counts is a relative
change above a floor that follows the noise, and above what the nights that hold have reached themselves: two
clusters and spikes are learnt. One slow night is only suspected; if the next one holds, it joins what is usual.
Nights in a row that chance explains too well are suspected as well: every alarm is rarer than `RARE`, so that a
night with a thousand series stays silent nineteen times in twenty if nothing happened. Smaller changes are found
by several nights together (tracker/judge/shifts.py) and stay red until the last nights came halfway back. Two
fast nights in a row are a new level, so that a slow-down after them is seen. A level that was left again twice is
one of the machine's: a third visit that is no longer than those before is no news. Slow creep is found by the
median of the last nights against those at the last release, and is red until half of it is gone.
"""

from __future__ import annotations

import math
from bisect import insort
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import chain
from typing import TYPE_CHECKING, Any, NamedTuple

from msgspec.structs import replace

from spook_tracker.tracker.document.middle import median, median_of_sorted
from spook_tracker.tracker.judge.normal_nights import exceeded
from spook_tracker.tracker.judge.shifts import (
    BASE,
    FEWEST_BASE,
    RARE,
    SPANS,
    remembered,
    shift,
    standard_error,
)
from spook_tracker.tracker.judge.slower import LEAST, Usual, change_in_words, slower, worse_by
from spook_tracker.tracker.judge.usual import level_and_noise, outermost_two
from spook_tracker.tracker.judge.verdict import Verdict
from spook_tracker.tracker.judge.visits import Visited, Visits, left_before, steadiness
from spook_tracker.tracker.judge.vocabulary import State

if TYPE_CHECKING:
    from spook_tracker.tracker.judge.shifts import Shift, Values

WINDOW = 30  # nights that say what is usual
FEWEST = 5  # of them before noise can be told; until then only a gross change counts
FLOOR = 0.05  # relative; less where the noise is less than an eighth of it, of nights enough
ENOUGH = 20  # nights
CLEAR = 8.0  # noises, below the floor: the noise of few nights may be told too small
REACH = 1.25  # times the second largest deviation of nights that hold
UNSEEN = 25  # nights: of fewer, as much again may be reached by those to come
REACHED = 200  # nights of which that is remembered, whatever their level
FEW_NIGHTS_FLOOR = 0.5  # relative, while the noise is not known
SIGMAS = 4.0
SECOND = 2.5  # standard deviations that the second largest of two hundred nights reaches
CREEP = 5  # nights in each median that is compared for drift
BACK = 4  # nights whose mean must have come halfway back from a shift


class Noisy(NamedTuple):
    """One night's verdict; `against`, `first_bad`, `last_good` are places in the sequence."""

    verdict: Verdict
    state: State
    against: int | None = None
    first_bad: int | None = None
    last_good: int | None = None
    worse_at: int | None = None  # where it last became worse
    usual: Usual | None = None  # after this night


def judge_noisy(
    values: Sequence[float],
    *,
    larger_is_better: bool = False,
    releases: Sequence[bool] | None = None,
    accepted: Sequence[bool] | None = None,
    tolerance: float = 0.0,
    absolute: float = 0.0,
    ages: Sequence[int] | None = None,
) -> list[Noisy]:
    """A verdict for each value of one machine, oldest first. Values are positive; worse is larger.

    `tolerance` and `absolute`: the change, relative and in the unit of the values, up to which the series' definition
    tells none, whatever its noise. `ages`: how many nights each value lies after the first, where some are left out.
    """
    walk = _Walk(values, larger_is_better, tolerance, absolute, ages or ())
    releases = releases or [False] * len(values)
    accepted = accepted or [False] * len(values)
    found = [walk.night(place, releases[place], accepted[place]) for place in range(len(values))]
    levels = [*walk.levels[1:], walk.usual_now()] if found else []
    return [night._replace(usual=after) for night, after in zip(found, levels, strict=True)]


@dataclass
class _Walk:
    """What is known of a series, night after night."""

    values: Sequence[float]
    larger_is_better: bool
    tolerance: float = 0.0
    absolute: float = 0.0
    ages: Sequence[int] = ()
    usual: list[int] = field(default_factory=list)  # places of the last nights that hold
    level_since: list[int] = field(default_factory=list)  # the same, back to where the level began
    reached: list[float] = field(default_factory=list)  # deviations of nights that hold; worse is positive
    anchor: list[int] = field(default_factory=list)  # places of the nights at the last release
    suspects: list[int] = field(default_factory=list)  # unusual nights in a row, not yet or already red
    gains: list[int] = field(default_factory=list)  # fast nights in a row
    red_since: int | None = None
    crept: float = 0.0  # the largest drift since it is red; zero while it is not
    shifted: tuple[int, float] | None = None  # the place and the size of a shift that is red
    visits: Visits = field(init=False)
    start: int = 0  # the first night there is, or the last that was accepted
    levels: list[Usual] = field(default_factory=list)  # before each night
    _stretch: tuple[Any, int, list[float]] = (
        None,
        0,
        [],
    )  # since when and off which level, until when, in order
    _told: tuple[list[int], Usual] | None = None  # what was asked last, of which nights
    _known_spread: tuple[list[int], tuple[float, float], int] | None = None
    _known_outermost: tuple[list[float], list[float]] | None = None
    _known_anchor: tuple[list[int], float | None] | None = None

    def __post_init__(self) -> None:
        self.visits = Visits(self._size_of, self._noise)
        self.ages = self.ages or range(len(self.values))

    def usual_now(self) -> Usual:
        """The level, and what stands clear of it for the worse."""
        if self._told is None or self._told[0] is not self.usual:
            self._told = self.usual, self._clear(self._outermost())
        return self._told[1]

    def night(self, place: int, release: bool, accepted: bool) -> Noisy:
        """The verdict of one more night."""
        if not self.usual:
            self.levels.append((self.values[place], FEW_NIGHTS_FLOOR))
            self._begin(place)
            return Noisy(verdict=Verdict(word="new", sentence="the first value"), state="green")
        level, threshold = self.usual_now()
        self.levels.append((level, threshold))
        value = self.values[place]
        change = worse_by(level, value, self.larger_is_better)
        if not accepted and self._visits(place, change, threshold):
            if (off := self._off_both_clusters(place)) is not None:
                return off
            words = f"{change_in_words(change)}, at a level that was left again before"
            return Noisy(verdict=Verdict(word="same", sentence=words), state="green", against=self.usual[-1])
        if self.shifted is not None and not change > threshold:
            return self._after_shift(place, change, level, accepted)
        if self._stands_clear(change, threshold):
            self.gains = []
            return self._slow(place, change, level, accepted)
        return self._holds(place, change, threshold, release, accepted)

    def _stands_clear(self, change: float, threshold: float) -> bool:
        """Whether a night is beyond what is usual; a red stretch lasts until a night came halfway back."""
        if self.shifted is not None:
            return change > threshold
        if self.red_since is not None:
            return change > min(threshold, 0.5 * self._size(self.red_since, self.suspects[-1] + 1))
        return change > threshold and not self._remembers(change)

    def _size(self, start: int, end: int) -> float:
        """How far the nights of a stretch lie off, in the middle. A stretch grows by its end: the rest is in order."""
        level, _ = self._spread()
        known, until, off = self._stretch
        if known != (start, level) or until > end:
            until, off = start, []
        for place in range(until, end):
            insort(off, worse_by(level, self.values[place], self.larger_is_better))
        self._stretch = (start, level), end, off
        return median_of_sorted(off)

    def _begin(self, place: int) -> None:
        """A level that starts here."""
        self.usual, self.level_since, self.anchor = [place], [place], [place]
        self.suspects, self.gains, self.red_since, self.shifted = [], [], None, None
        self.crept = 0.0
        self.visits, self.start = Visits(self._size_of, self._noise), place

    def _slow(self, place: int, change: float, level: float, accepted: bool) -> Noisy:
        """A night that stands clear of what is usual."""
        value, against = self.values[place], self.usual[-1]
        self.suspects.append(place)
        known = self.red_since is not None or self.shifted is not None or not math.isfinite(value)
        confirmed = known or (len(self.suspects) > 1 and self._chance(self.suspects) <= RARE)
        verdict = slower(change, level, value, "slower" if confirmed else "")
        if accepted:
            self._begin(place)
            return Noisy(verdict=verdict, state="accepted", against=against)
        if not confirmed and self.crept:  # red already, and no better for this night
            return self._drifted(replace(verdict, word="regressed", name="drift"))
        if confirmed and not known and (been := self._been_here(self.suspects)) is not None:
            self.visits.begin(self.suspects, been)
            self.suspects = []
            words = f"{change_in_words(change)}, at a level that was left again before"
            return Noisy(verdict=Verdict(word="same", sentence=words), state="green", against=against)
        if not confirmed and (together := self._shift(self.suspects)) is not None:
            self.suspects = []
            return together
        if not confirmed:
            return Noisy(verdict=verdict, state="suspected", against=against)
        if self.red_since is None:
            self.red_since = self.suspects[0]
        return self._red(verdict)

    def _drifted(self, verdict: Verdict) -> Noisy:
        first = self.anchor
        return Noisy(verdict=verdict, state="detected", against=first[0], first_bad=first[-1])

    def _chance(self, nights: Sequence[int]) -> float:
        """How probable it is that these nights lie so far off by chance: the tail of Student's t.

        The noise is what the nights that hold show about the level, or have reached, whichever is more.
        """
        _, (level, noise), count = self._known()
        off = [worse_by(level, self.values[i], self.larger_is_better) for i in nights]
        reached = self._outermost()
        noise = max(noise, reached[1] / SECOND) if len(reached) > 1 else noise
        if count < FEWEST:
            noise = max(noise, FEW_NIGHTS_FLOOR / SIGMAS)
        if noise <= 0.0 or count == 0:
            return 0.0
        t = sum(off) / len(off) / (noise * math.sqrt(1.0 / len(off) + 1.0 / count))
        return exceeded(min(t, 1e9), max(FEWEST, count + len(off) - 2))

    def _red(self, verdict: Verdict) -> Noisy:
        good = self.usual[-1]
        return Noisy(
            verdict=verdict, state="detected", against=good, first_bad=self.red_since, last_good=good
        )

    def _remembers(self, change: float) -> bool:
        """Whether nights that remember each other go so far by themselves."""
        base = self._base()
        if len(base) < FEWEST_BASE or not math.isfinite(change) or not remembered(base):
            return False
        return change * self._spread()[0] <= standard_error(base, 1)

    def _base(self) -> Values:
        """The values of the present level."""
        import numpy as np

        finite = [self.values[i] for i in self.level_since if math.isfinite(self.values[i])]
        return np.array(finite[-BASE:])

    def _visits(self, place: int, change: float, threshold: float) -> bool:
        """Whether the night is at a level that the machine went to and left again, and no longer than it does."""
        if self.red_since is not None:
            self.visits.left(change, counts=False)
            return False
        visits, seemed = self.visits.takes(place, change, threshold)
        if seemed:
            self.suspects = seemed  # it stays, or is another level: red since it came
        return visits

    def _size_of(self, nights: Sequence[int]) -> float:
        """How far some nights lie off, in the middle."""
        level, _ = self._spread()
        return median(worse_by(level, self.values[i], self.larger_is_better) for i in nights)

    def _been_here(self, nights: Sequence[int]) -> Visited | None:
        """The level of these nights, if it was reached and left again before: red or not."""
        here = sum(self._cost(self.values[i]) for i in nights) / len(nights)
        before = [self._cost(value) for value in self.values[self.start : nights[0]]]
        return left_before(before, here, self._cost(self._spread()[0]), len(nights))

    def _noise(self) -> float:
        """The relative change that may be noise about a level, whatever levels there are."""
        level, _ = self._spread()
        last = [self.values[i] for i in self.level_since[-BASE:] if math.isfinite(self.values[i])]
        if len(last) < FEWEST or not 0.0 < level < math.inf:
            return LEAST
        return max(LEAST, SIGMAS * steadiness(last) / level)

    def _leave(self, place: int) -> None:
        """A red stretch that ends by itself is a visit to a level."""
        assert self.red_since is not None
        change, nights = self._size(self.red_since, place), place - self.red_since
        if not math.isfinite(change):
            return
        self.visits.add(change, nights)

    def _after_shift(self, place: int, change: float, level: float, accepted: bool) -> Noisy:
        """A night not clear of what is usual, while several nights together were: red until they came back."""
        assert self.shifted is not None
        since, size = self.shifted
        verdict = slower(change, level, self.values[place], "slower")
        if accepted:
            self._begin(place)
            return Noisy(verdict=verdict, state="accepted", against=self.usual[-1])
        last = range(max(since, place - BACK + 1), place + 1)
        mean = sum(worse_by(level, self.values[i], self.larger_is_better) for i in last) / len(last)
        if mean > 0.5 * size:
            return self._red(replace(verdict, sentence=f"{change_in_words(mean)} over the last nights"))
        self._leave(place)
        self.shifted, self.red_since, self.suspects, self.gains = None, None, [], []
        self._join([place])
        words = f"{change_in_words(change)}, inside the noise"
        return Noisy(verdict=Verdict(word="same", sentence=words), state="recovered", against=self.usual[0])

    def _holds(self, place: int, change: float, threshold: float, release: bool, accepted: bool) -> Noisy:
        """A night that is usual, or better."""
        recovered = self.red_since is not None
        if recovered:
            self._leave(place)
        dismissed = [] if recovered else self.suspects  # what no second night confirmed is noise
        self.suspects, self.red_since = [], None
        fast = -change > threshold and -change > self._clear(outermost_two([-x for x in self.reached]))[1]
        self.gains = [*self.gains, place] if fast else []
        if self.gains and recovered:
            self.usual, self.level_since = self.usual[-1:], self.usual[-1:]
        elif len(self.gains) > 1:
            self.usual, self.level_since = self.gains[:-1], self.gains[:-1]  # two fast nights are a new level
        self._join([*dismissed, place])
        if release and len(self.anchor) >= CREEP:
            self.anchor, self.crept = [place], 0.0
        elif len(self.anchor) < CREEP:
            self.anchor = [*self.anchor, place]
        drifted = self.crept > 0.0
        creep = self._creep()
        recovered = recovered or (drifted and creep is None)
        if creep is not None and not accepted:
            return self._drifted(creep)
        if not fast and not accepted and (together := self._shift()) is not None:
            return together
        faster = Verdict(word="improved", sentence=change_in_words(change)) if fast else None
        same = Verdict(word="same", sentence=f"{change_in_words(change)}, inside the noise")
        state: State = "recovered" if recovered else "green"
        return Noisy(verdict=faster or same, state=state, against=self.usual[0])

    def _join(self, places: list[int]) -> None:
        """Nights that hold join what is usual; how far they lay off is remembered."""
        level, _ = self._spread()
        if len(self.usual) >= FEWEST:
            off = [worse_by(level, self.values[i], self.larger_is_better) for i in places]
            self._reach([x for x in off if math.isfinite(x)])
        self.usual = [*self.usual, *places][-WINDOW:]
        self.level_since = [*self.level_since, *places][-BASE - max(SPANS) :]

    def _reach(self, more: list[float]) -> None:
        """Remember how far these nights lay off; the largest two of all are known again without a look at each."""
        outermost = self._outermost()
        every = [*self.reached, *more]
        gone, self.reached = every[:-REACHED], every[-REACHED:]
        if len(outermost) == 2 and len(self.reached) >= 2 and all(x < outermost[1] for x in gone):
            self._known_outermost = self.reached, sorted((*outermost, *more), reverse=True)[:2]

    def _outermost(self) -> list[float]:
        """The largest two deviations that nights which hold have reached."""
        if self._known_outermost is None or self._known_outermost[0] is not self.reached:
            self._known_outermost = self.reached, outermost_two(self.reached)
        return self._known_outermost[1]

    def _shift(self, suspects: Sequence[int] = ()) -> Noisy | None:
        """Red if the last nights together, suspects among them, lie above those of the level before them.

        They leave what is usual.
        """
        level, deviation = self._spread()
        if not 0.0 < level < math.inf:
            return None
        near = self._nearby(level, suspects)
        if near < LEAST:
            return None  # most nights: nothing to count
        nights, found = self._looked_at((*self.level_since, *suspects), clusters_only=near < deviation)
        if found is None:
            return None
        self.level_since, nights = nights[: -found.span], nights[-found.span :]
        self.usual = [i for i in self.usual if i not in nights] or self.level_since[-WINDOW:]
        self.reached = self.reached[: len(suspects) - found.span]
        if not found.apart:
            known = self.visits.known(self._size_of(nights), len(nights))
            been = None if known is not None else self._been_here(nights)
            if known is not None or been is not None:
                self.visits.begin(nights, been)
                return None
        return self._shifted(found, nights[0])

    def _off_both_clusters(self, place: int) -> Noisy | None:
        """Red if nights that seem to visit a level lie above both of two clusters, of which it is one."""
        first, (level, _) = max(self.start, place - BASE - max(SPANS)), self._spread()
        last = self.values[place - min(SPANS) + 1 : place + 1]
        off = (worse_by(level, value, self.larger_is_better) for value in last)
        if not sum(map(self.visits.above_the_nearest, off)) > 0.5 * LEAST * len(last):
            return None  # most nights: at one of the levels
        nights, found = self._looked_at(range(first, place + 1), clusters_only=True)
        if found is None or not found.apart:
            return None
        nights = nights[-found.span :]
        if not (usual := [i for i in self.usual if i not in nights]):
            return None
        self.usual, self.level_since = usual, [i for i in self.level_since if i not in nights]
        self.visits.end()
        return self._shifted(found, nights[0])

    def _looked_at(self, places: Sequence[int], clusters_only: bool) -> tuple[list[int], Shift | None]:
        """Those of the nights that have a value, and the shift of the last ones, if it is not tolerated."""
        nights = [i for i in places if math.isfinite(self._cost(self.values[i]))]
        age = self.ages[places[-1]] - self.ages[self.start]
        found = shift([self._cost(self.values[i]) for i in nights], clusters_only, age)
        told = found is not None and found.change > self._tolerates(self._spread()[0])
        return nights, found if told else None

    def _shifted(self, found: Shift, since: int) -> Noisy:
        self.red_since, self.shifted = since, (since, found.change)
        words = f"{change_in_words(found.change)} over {found.span} nights, by chance once in {1.0 / found.probability:.0e}"
        decades = math.log10(1.0 + found.change)
        return self._red(Verdict(word="regressed", sentence=words, name="slower", decades=decades))

    def _nearby(self, level: float, suspects: Sequence[int]) -> float:
        """How far the last few nights of the level lie off, suspects among them."""
        off: list[float] = []
        for i in chain(reversed(suspects), reversed(self.level_since)):
            if math.isfinite(self._cost(self.values[i])):
                off.append(worse_by(level, self.values[i], self.larger_is_better))
                if len(off) == min(SPANS):
                    break
        return sum(reversed(off)) / len(off)

    def _cost(self, value: float) -> float:
        """A value of which larger is worse, and a change as many per cent: a rate gives the time of one."""
        if not self.larger_is_better:
            return value
        return 1.0 / value if value else math.inf

    def _spread(self) -> tuple[float, float]:
        """Level and noise of the nights that are usual."""
        return self._known()[1]

    def _known(self) -> tuple[list[int], tuple[float, float], int]:
        """The nights that are usual, their level and noise, and how many of them have a value."""
        if self._known_spread is None or self._known_spread[0] is not self.usual:
            values = [self.values[i] for i in self.usual]
            self._known_spread = self.usual, level_and_noise(values), sum(map(math.isfinite, values))
        return self._known_spread

    def _clear(self, outermost: Sequence[float]) -> Usual:
        """The level, and what stands clear of it: of its noise, and of what its definition tolerates."""
        level, clear = self._clear_of_noise(outermost)
        return level, max(clear, self._tolerates(level))

    def _tolerates(self, level: float) -> float:
        """The relative change of a level that the definition does not tell."""
        known = self.absolute and math.isfinite(level) and level != 0.0
        return max(self.tolerance, self.absolute / abs(level) if known else 0.0)

    def _clear_of_noise(self, outermost: Sequence[float]) -> Usual:
        """The level, and what stands clear of it on the side where nights that hold have reached so far."""
        _, (level, noise), count = self._known()
        if not math.isfinite(level):
            return math.inf, FLOOR
        if (count < FEWEST and len(self.reached) < FEWEST) or level == 0.0:
            return level, FEW_NIGHTS_FLOOR
        clear = max(FLOOR, SIGMAS * noise)
        if count >= ENOUGH:
            clear = max(LEAST, min(clear, CLEAR * noise))
        if len(outermost) < 2:
            return level, clear
        return level, max(clear, REACH * (1.0 + UNSEEN / len(self.reached)) * outermost[1])

    def _wanders(self) -> float:
        """How far the means of two spans of nights may lie apart, a trend of these nights taken out."""
        import numpy as np

        base = self._base()
        if len(base) < FEWEST_BASE:
            return 0.0
        nights = np.arange(len(base))
        level = base - np.polyval(np.polyfit(nights, base, 1), nights)
        return math.sqrt(2.0) * standard_error(level, CREEP) if remembered(level) else 0.0

    def _anchored(self) -> float | None:
        """The middle of the nights at the last release, None of too few."""
        if self._known_anchor is None or self._known_anchor[0] is not self.anchor:
            self._known_anchor = self.anchor, self._middle(self.anchor)
        return self._known_anchor[1]

    def _middle(self, places: Sequence[int]) -> float | None:
        finite = [self.values[i] for i in places if math.isfinite(self.values[i])]
        return median(finite) if len(finite) >= CREEP else None

    def _creep(self) -> Verdict | None:
        """Drift against the last release, where both ends have nights enough."""
        old, recent = self._anchored(), self._middle(self.usual[-CREEP:])
        if old is None or recent is None:
            return None
        _, threshold = self.usual_now()
        change = worse_by(old, recent, self.larger_is_better)
        enough = min(threshold, 0.5 * self.crept) if self.crept else threshold
        if change <= enough or (not self.crept and change * old <= self._wanders()):
            self.crept = 0.0
            return None
        self.crept = max(self.crept, change)
        words = f"{change_in_words(change)}, little by little since the last release"
        return Verdict(word="regressed", sentence=words, name="drift")
