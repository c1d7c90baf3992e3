"""Series with noise: a night is red when it and the night before both stand clear of what is usual.

Usual is the median of the nights that hold, noise their median absolute deviation. What counts is a relative
change above a floor that follows the noise, and above what the nights that hold have reached themselves: two
clusters, spikes and slow waves are learnt. One slow night is only suspected; if the next one holds, it joins
what is usual. Two fast nights in a row are a new level, so that a slow-down after them is seen. Slow creep
is found by the median of the last nights against those at the last release.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from statistics import median
from typing import Literal

from spook_tracker.tracker.judge.verdict import Verdict

WINDOW = 30  # nights that say what is usual
FEWEST = 5  # of them before noise can be told; until then only a gross change counts
LEAST = 0.01  # relative: no change below is told
FLOOR = 0.05  # relative; less where the noise is less than an eighth of it, of nights enough
ENOUGH = 20  # nights
CLEAR = 8.0  # noises, below the floor: the noise of few nights may be told too small
REACH = 1.25  # times the second largest deviation of nights that hold
FEW_NIGHTS_FLOOR = 0.5  # relative, while the noise is not known
SIGMAS = 4.0
NORMAL = 1.4826  # standard deviations in a median absolute deviation
CREEP = 5  # nights in each median that is compared for drift


Usual = tuple[float, float]  # level, and the relative change that stands clear of its noise


@dataclass(frozen=True, slots=True, kw_only=True)
class Noisy:
    """One night's verdict; `against`, `first_bad`, `last_good` are places in the sequence."""

    verdict: Verdict
    state: Literal["green", "detected", "accepted", "recovered", "suspected"]
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
) -> list[Noisy]:
    """A verdict for each value of one machine, oldest first. Values are positive; worse is larger."""
    releases = releases or [False] * len(values)
    accepted = accepted or [False] * len(values)
    usual: list[int] = []  # places of nights that hold
    anchor: list[int] = []  # places of the nights at the last release
    suspects: list[int] = []  # unusual nights in a row, not yet or already red
    gains: list[int] = []  # fast nights in a row
    red_since: int | None = None
    found: list[Noisy] = []
    levels: list[Usual] = []  # before each night but the first
    for place, value in enumerate(values):
        if not usual:
            usual, anchor = [place], [place]
            found.append(Noisy(verdict=Verdict(word="new", sentence="the first value"), state="green"))
            continue
        level, threshold = _usual([values[i] for i in usual], larger_is_better)
        levels.append((level, threshold))
        change = _worse_by(level, value, larger_is_better)
        if change > threshold:
            suspects.append(place)
            gains = []
            confirmed = len(suspects) > 1 or not math.isfinite(value)
            verdict = _verdict(change, level, value, "slower" if confirmed else "")
            if accepted[place]:
                found.append(Noisy(verdict=verdict, state="accepted", against=usual[-1]))
                usual, anchor, suspects, red_since = [place], [place], [], None
            elif confirmed:
                red_since = suspects[0] if red_since is None else red_since
                found.append(
                    Noisy(
                        verdict=verdict,
                        state="detected",
                        against=usual[-1],
                        first_bad=red_since,
                        last_good=usual[-1],
                    )
                )
            else:
                found.append(Noisy(verdict=verdict, state="suspected", against=usual[-1]))
            continue
        recovered = red_since is not None
        dismissed = [] if recovered else suspects  # what no second night confirmed is noise
        suspects, red_since = [], None
        gains = [*gains, place] if -change > threshold else []
        if gains and recovered:
            usual = usual[-1:]
        elif len(gains) > 1:
            usual = gains[:-1]  # two fast nights are a new level
        usual = [*usual, *dismissed, place][-WINDOW:]
        anchor = _anchor(anchor, place, releases[place])
        creep = _creep(values, usual, anchor, larger_is_better)
        if creep is not None and not accepted[place]:
            found.append(Noisy(verdict=creep, state="detected", against=anchor[0], first_bad=anchor[-1]))
        else:
            faster = Verdict(word="improved", sentence=_words(change)) if -change > threshold else None
            same = Verdict(word="same", sentence=f"{_words(change)}, inside the noise")
            found.append(
                Noisy(verdict=faster or same, state="recovered" if recovered else "green", against=usual[0])
            )
    if found:
        levels.append(_usual([values[i] for i in usual], larger_is_better))
    return [replace(night, usual=after) for night, after in zip(found, levels, strict=True)]


def to_be_confirmed(verdict: Verdict) -> Verdict:
    """A slow night that no second one has confirmed yet is not red."""
    if not verdict.red:
        return verdict
    return replace(
        verdict, word="same", name="", sentence=f"{verdict.sentence}, to be confirmed by another night"
    )


def only_followed(verdict: Verdict) -> Verdict:
    """A time read off a ladder is not red: the ladder's errors and its run time are judged themselves.

    Between two rungs a little noise of time moves it by the order times as much, or by a whole rung.
    """
    if not verdict.red:
        return verdict
    words = f"{verdict.sentence}; the ladder's errors and its run time decide"
    return replace(verdict, word="changed", name="", sentence=words)


def judge_time(usual: Usual, value: float, larger_is_better: bool = False) -> Verdict:
    """One value against what was usual: red if it stands clear of the noise."""
    level, threshold = usual
    change = _worse_by(level, value, larger_is_better)
    if change > threshold:
        return _verdict(change, level, value, "slower")
    if -change > threshold:
        return Verdict(word="improved", sentence=_words(change))
    return Verdict(word="same", sentence=f"{_words(change)}, inside the noise (±{100.0 * threshold:.0f} %)")


def _usual(values: Sequence[float], larger_is_better: bool = False) -> Usual:
    """Level, and the relative change that stands clear of it."""
    finite = [value for value in values if math.isfinite(value)]
    if not finite:
        return math.inf, FLOOR
    level = median(finite)
    if len(finite) < FEWEST or level == 0.0:
        return level, FEW_NIGHTS_FLOOR
    deviations = sorted(abs(value - level) / abs(level) for value in finite)
    noise = NORMAL * median(deviations)
    worse = sorted(_worse_by(level, value, larger_is_better) for value in finite)
    clear = max(FLOOR, SIGMAS * noise)
    if len(finite) >= ENOUGH:
        clear = max(LEAST, min(clear, CLEAR * noise))
    return level, max(clear, REACH * worse[-2])


def _worse_by(level: float, value: float, larger_is_better: bool) -> float:
    """Relative change for the worse; infinite for what is not finite."""
    if not math.isfinite(value):
        return math.inf if math.isfinite(level) else 0.0
    if not math.isfinite(level):
        return -math.inf
    if level == 0.0:
        return 0.0 if value == 0.0 else math.inf
    change = value / level - 1.0
    return -change if larger_is_better else change


def _anchor(anchor: list[int], place: int, release: bool) -> list[int]:
    """The nights at the last release: it and the ones after it, until there are enough for a median."""
    if release and len(anchor) >= CREEP:
        return [place]
    return [*anchor, place] if len(anchor) < CREEP else anchor


def _creep(
    values: Sequence[float], usual: Sequence[int], anchor: Sequence[int], larger_is_better: bool
) -> Verdict | None:
    """Drift against the last release, where both ends have nights enough."""
    recent = [values[i] for i in usual[-CREEP:] if math.isfinite(values[i])]
    old = [values[i] for i in anchor if math.isfinite(values[i])]
    if len(recent) < CREEP or len(old) < CREEP:
        return None
    _, threshold = _usual([values[i] for i in usual], larger_is_better)
    change = _worse_by(median(old), median(recent), larger_is_better)
    if change <= threshold:
        return None
    return Verdict(
        word="regressed", sentence=f"{_words(change)}, little by little since the last release", name="drift"
    )


def _verdict(change: float, level: float, value: float, name: str) -> Verdict:
    if not math.isfinite(value):
        return Verdict(
            word="regressed", sentence=f"no finite value any more, {level:g} before", name="not finite"
        )
    if not name:
        return Verdict(word="same", sentence=f"{_words(change)}, to be confirmed by another night")
    return Verdict(
        word="regressed",
        sentence=_words(change),
        name=name,
        decades=math.log10(abs(value / level)) if level else None,
    )


def _words(change: float) -> str:
    return f"{100.0 * change:+.1f} % for the {'worse' if change > 0.0 else 'better'}"
