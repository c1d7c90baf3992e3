"""Did the last few nights shift? A permutation test of their mean against the nights of the level before.

Under "nothing happened" every choice of m nights among all is as likely to be the last m as any other, whatever
the distribution: clusters, spikes and tails included (Pitman 1937). The share of choices whose sum is at least
as large as that of the last m is counted exactly on a grid, by the elementary symmetric polynomial of all. Nights that
remember each other are not exchangeable: the shift must also stand clear of a t test whose standard error and
degrees of freedom follow their autocorrelation. Of nights that look independent and normal the fewest nights, and
those off two clusters, need no permutation: Student's test decides (tracker/judge/normal_nights.py).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, TypeAlias

from spook_tracker.tracker.document.middle import median_of_sorted

from .normal_nights import MEMORY, chance, student
from .segments import middle_and_noise
from .slower import LEAST

if TYPE_CHECKING:  # NumPy takes a fifth of a second to import, and most histories ask for nothing here
    import numpy as np
    import numpy.typing as npt

    Values: TypeAlias = npt.NDArray[np.float64]

SPANS = (4, 6)  # last nights looked at together
MOSTLY = 2.0 / 3.0  # of the last many nights are of a slower level
MANY = (12, 24)  # the same of two clusters, where four nights in a row of the slower one are chance
BASE = 100  # nights of the level before they are compared with
FEWEST_BASE = 16  # fewer give no probability as small as this:
RARE = 5e-5  # of an alarm in one series on one night: of a thousand series, a night in twenty has a false one
RAREST = 1e-5  # of what no second test has to confirm
REACHED = 200  # nights of which is remembered what they reached, how they moved and how far off they lay
ROUNDING = 1e-12  # relative: nights that differ by less are equal
LEARNING = 60  # nights: of a longer history, less is spent on each night
CLIP = 6.0  # noises: what lies further out counts as if it lay there
GRID = 300  # steps between the smallest and the largest value
CHANCE = 2.6  # standard deviations of an autocorrelation that is none
APART = (
    5.0  # standard deviations inside two clusters between their middles; noise of one hump cut in two shows 3
)
OFTEN_ENOUGH = 1.5  # standard deviations: one in fifteen draws changes cluster less often; slow weekends do
NEAR_ENOUGH = 3.0  # the same of squared distances from the nearer cluster
FEWEST_CLUSTER, SMALLEST_CLUSTER = 6, 0.1  # nights, and share of all, in the smaller cluster


@dataclass(frozen=True, slots=True)
class Shift:
    """The last `span` nights lie `change` of the level above it, which chance does with `probability`.

    `apart`: above whichever of two clusters is the nearer, and nights are drawn from them at random: no visit to one
    of them explains it.
    """

    span: int
    change: float
    probability: float
    apart: bool = False


def spent(age: float) -> float:
    """How rare a shift of normal nights has to be, so many nights after a series began.

    `RARE` while it is young, then falling as one over the nights to `RAREST`: what is learnt about level and noise
    makes up for it, and a thousand nights cost what `RAREST` in each of two spans does.
    """
    return max(RAREST, RARE * min(1.0, LEARNING / max(age, 1.0)))


def shift(
    values: Sequence[float],
    clusters_only: bool = False,
    age: float = math.inf,
    before: Sequence[float] = (),
) -> Shift | None:
    """The most probable shift for the worse of the last nights, None if there is none. Worse is larger.

    Values are positive, of one level until the shift, oldest first. `clusters_only`: the last nights lie inside the
    spread of all, so that only the smaller noise inside clusters can tell. `age`: nights since the series began.
    `before`: as in `remembered`.
    """
    import numpy as np

    found: Shift | None = None
    if clusters_only and clusters(np.array(values[-BASE - max(SPANS) : -max(SPANS)])) is None:
        return None
    for span in SPANS:
        base, last = values[-BASE - span : -span], values[-span:]
        if len(base) < FEWEST_BASE or min(last) <= min(base):
            continue
        old, new = np.array(base), np.array(last)
        every = None if clusters_only else _tried(old, new, spent(age) if span == min(SPANS) else 0.0, before)
        for tried in (every, _apart_from_clusters(old, new, spent(age), before)):
            if tried is not None and (found is None or _tells_more(tried, found)):
                found = tried
    return found


def more_of_the_slower(values: Sequence[float]) -> Shift | None:
    """The last twelve or 24 nights, if more of them are of the slower of two clusters than chance draws; see `shift`.

    By the hypergeometric distribution. A night slower than each of the faster cluster counts, and so does a level between
    the two: sums of so spread values would need many more nights to tell it.
    """
    for span in MANY:
        base, last = values[-BASE - span : -span], values[-span:]
        if len(base) < FEWEST_BASE:
            return None
        middle = sum(base) / len(base)
        change = sum(last) / (span * middle) - 1.0
        if change <= LEAST or sum(night > middle for night in last) < MOSTLY * span:
            continue
        if (probability := _drawn_by_chance(base, last)) < RAREST:
            return Shift(span, change, probability)
    return None


def _drawn_by_chance(base: Sequence[float], last: Sequence[float]) -> float:
    """How probably nights drawn at random have as many of the slower cluster among the last; 1 if nothing tells it."""
    import numpy as np

    nights = np.array(base)
    if (split := clusters(nights)) is None:
        return 1.0
    above = float(nights[nights <= 0.5 * sum(split)].max())
    slow = nights > above
    for values in (slow, nights):
        off = values - values.mean()
        if float(off[1:] @ off[:-1]) > CHANCE / math.sqrt(len(off)) * float(off @ off):
            return 1.0  # visits to the slower one last
    of_last = sum(night > above for night in last)
    of_all, every = of_last + int(slow.sum()), len(base) + len(last)
    ways = range(of_last, min(len(last), of_all) + 1)
    chosen = sum(math.comb(of_all, k) * math.comb(every - of_all, len(last) - k) for k in ways)
    return chosen / math.comb(every, len(last))


def _tells_more(one: Shift, other: Shift) -> bool:
    """A shift away from both clusters, which no visit explains, before any other; else the rarer."""
    return (one.apart, -one.probability) > (other.apart, -other.probability)


def _apart_from_clusters(
    base: Values, last: Values, rare: float = RAREST, before: Sequence[float] = ()
) -> Shift | None:
    """The same where the nights before lie in two clusters: of how far each night lies off the nearer of them.

    Which cluster a night falls into is chance and says nothing; a change moves both, and what is left is small noise.
    """
    import numpy as np

    change = float(last.sum() / len(last) / (base.sum() / len(base))) - 1.0
    if change <= LEAST or (split := clusters(base)) is None:
        return None
    low, high = split
    near = [nights / np.where(nights - low < high - nights, low, high) for nights in (base, last)]
    tried = _tried(near[0], near[1], rare)
    if tried is None or ((memory := remembered(base, before)) and tried.probability >= RAREST):
        return None  # where visits last, no second test knows of them: off the nearer cluster nothing is remembered
    return replace(tried, change=change, apart=not memory)


def clusters(base: Values) -> tuple[float, float] | None:
    """The middles of two clusters of nights, parted by their widest gap; None if they are not clearly two."""
    import numpy as np

    ordered = np.sort(base)
    fewest = max(FEWEST_CLUSTER, math.ceil(SMALLEST_CLUSTER * len(ordered)))
    if len(ordered) < 2 * fewest:
        return None
    gaps = ordered[fewest : len(ordered) - fewest + 1] - ordered[fewest - 1 : len(ordered) - fewest]
    split = fewest + int(gaps.argmax())
    low, high = ordered[:split], ordered[split:]
    inside = math.sqrt((_scatter(low) + _scatter(high)) / len(ordered))
    middles = median_of_sorted(low), median_of_sorted(high)
    return middles if middles[1] - middles[0] > APART * inside else None


def drawn_anew(nights: Values, last: int) -> bool:
    """Whether nights fall into two clusters at random, and the last so many lie as near to the nearer one as the others.

    At random: as often from one to the other as chance goes (Wald and Wolfowitz 1940). A change moves both clusters.
    """
    if (split := clusters(nights)) is None:
        return False
    low, high = nights - split[0], nights - split[1]
    slow = low > -high
    count, of_them = len(slow), float(slow.sum())
    changes = 2.0 * of_them * (count - of_them) / count
    spread = math.sqrt(changes * (changes - 1.0) / (count - 1))
    if float((slow[1:] != slow[:-1]).sum()) <= changes - OFTEN_ENOUGH * spread:
        return False
    squares = (low * ~slow + high * slow) ** 2
    wide = 1.0 + NEAR_ENOUGH * math.sqrt(2.0 / last)
    return float(squares[-last:].mean()) <= wide * float(squares[:-last].mean())


def _scatter(values: Values) -> float:
    """The sum of squares about the mean; NumPy's variance takes three times as long for as few."""
    off = values - values.sum() / len(values)
    return float(off @ off)


def _tried(base: Values, last: Values, rare: float, before: Sequence[float] = ()) -> Shift | None:
    """`rare`: the probability at which normal nights need no permutation test; zero asks for one of all."""
    import numpy as np

    pooled = np.concatenate([base, last])
    middle, noise = middle_and_noise(base)
    if noise > 0.0:
        far = max(CLIP * noise, 2.0 * LEAST * middle)
        pooled = np.minimum(np.maximum(pooled, middle - far), middle + far)
    near, off = pooled[: len(base)], pooled[len(base) :]
    level = float(near.sum()) / len(near)
    rise = float(off.sum()) / len(off) - level
    if rise <= LEAST * level:
        return None
    memory = remembered(near, before)
    probability = _permuted(near, off, rise, memory)
    if probability is None and rare and not memory:
        probability = by_chance if (by_chance := chance(base, last, rare)) < rare else None
    return Shift(len(last), rise / level, probability) if probability is not None else None


def _permuted(base: Values, last: Values, rise: float, memory: float) -> float | None:
    """The probability of such a rise whatever the noise is, None if it is not rare or nights remember each other."""
    at_random = not memory and clusters(base) is not None  # in two clusters: exchangeable indeed
    if not at_random and rise <= standard_error(base, len(last), memory):
        return None
    enough = RAREST if at_random else RARE
    probability = permutation_probability(base, last, enough)
    return probability if probability < enough else None


def standard_error(base: Values, span: int, memory: float | None = None) -> float:
    """What the mean of `span` more nights may lie above that of these by rare chance.

    For nights that remember each other as a first-order process does; the spread of few such nights is too small
    by what their mean takes up.
    """

    count, memory = len(base), remembered(base) if memory is None else memory
    together = (1.0 + memory) / (1.0 - memory)
    independent = count / together
    if independent <= 2.0:
        return math.inf
    own = sum((1.0 - k / span) * memory**k for k in range(1, span))
    variance = _scatter(base) / (count - 1) / (1.0 - together / count if memory else 1.0)
    return student(independent - 1.0) * math.sqrt(variance * ((1.0 + 2.0 * own) / span + together / count))


def remembered(base: Values, before: Sequence[float] = ()) -> float:
    """Autocorrelation from one night to the next, zero unless it is told from chance; at most 0.98.

    A hundred nights tell no weak one. `before`: how far earlier nights lay off the levels of their own segments; as many
    help out as are missing to `REACHED`, unless the nights of the base tell that these remember each other otherwise.
    """
    import numpy as np

    centred = base - base.sum() / len(base)
    total = float(centred @ centred)
    if total <= len(base) * (ROUNDING * float(np.abs(base).max())) ** 2:
        return 0.0
    earlier = np.array(before[len(base) - REACHED :] if len(base) < REACHED else ())
    spread = float(earlier @ earlier)
    strongest = 0.0
    for lag in MEMORY:
        found, count = float(centred[lag:] @ centred[:-lag]) / total, len(base)
        if spread > 0.0 and len(earlier) > lag:
            once = float(earlier[lag:] @ earlier[:-lag]) / spread
            if abs(once - found) <= CHANCE / math.sqrt(count):
                found = (count * found + len(earlier) * once) / (count + len(earlier))
                count += len(earlier)
        if found > CHANCE / math.sqrt(count):
            found += (1.0 + 3.0 * found) / count  # few nights show too little of it
            strongest = max(strongest, min(found, 1.0) ** (1.0 / lag))
    return min(strongest, 0.98)


def permutation_probability(base: Values, last: Values, enough: float = math.inf) -> float:
    """The share of choices of as many values among all whose sum is at least that of the last.

    Where choices of values that each reach the mean of the last are as many as `enough` already, their share is told.
    """
    import numpy as np

    pooled = np.concatenate([base, last])
    low, high = float(np.min(pooled)), float(np.max(pooled))
    if high <= low:
        return 1.0
    steps = np.rint((pooled - low) * (GRID / (high - low))).astype(np.int64)
    span, reached = len(last), int(steps[len(base) :].sum())
    every = math.comb(len(pooled), span)
    surely = math.comb(int((span * steps >= reached).sum()), span) / every
    if surely >= enough:
        return surely
    size, powers = _turned(span)
    turn = np.fft.fft(np.bincount(steps, minlength=size))
    sums = [
        turn[power] for power in powers
    ]  # of the steps' powers, and by Newton's identities of their choices
    chosen: list[float | npt.NDArray[np.complex128]] = [1.0]
    for count in range(1, span + 1):
        signed = (sums[i] * chosen[count - 1 - i] * (1.0 - 2.0 * (i % 2)) for i in range(count))
        chosen.append(sum(signed) / count)
    ways = np.rint(np.fft.irfft(chosen[span], size))  # whole numbers, of 10^9: told to a millionth of one
    return float(ways[reached:].sum()) / every


@lru_cache(maxsize=8)
def _turned(span: int) -> tuple[int, list[npt.NDArray[np.int64]]]:
    """A length that holds every sum of so many steps, and the places of a transform's first powers in itself."""
    import numpy as np

    size = span * (GRID + GRID // 15)
    places = np.arange(size // 2 + 1)
    return size, [places * power % size for power in range(1, span + 1)]
