"""How a change of a noisy series is put: slower or faster, by how much, to be confirmed, or only followed."""

from __future__ import annotations

import math

from msgspec.structs import replace

from spook_tracker.tracker.document.run_document import Sample

from .verdict import Verdict, called_worse

FROM_NONE = 1e9  # times as much stands for something in place of a value of 0
LEAST = 0.01  # relative: no change of a time below is told, whatever the evidence
FLAKY = "flaky"
CONFIRM = "to be confirmed by another night"
Usual = tuple[float, float]  # level, and the relative change that stands clear of its noise


def to_be_confirmed(verdict: Verdict) -> Verdict:
    """A slow night that no second one has confirmed yet is not red."""
    if not verdict.red:
        return verdict
    return replace(verdict, word="same", name="", sentence=f"{verdict.sentence}, {CONFIRM}")


def only_followed(verdict: Verdict) -> Verdict:
    """A time read off a ladder is not red: the ladder's errors and its run time are judged themselves.

    Between two rungs a little noise of time moves it by the order times as much, or by a whole rung.
    """
    if not verdict.red:
        return verdict
    words = f"{verdict.sentence}; the ladder's errors and its run time decide"
    return replace(verdict, word="changed", name="", sentence=words)


def judge_time(usual: Usual, value: float, larger_is_better: bool = False, unit: str = "s") -> Verdict:
    """One value against what was usual: red if it stands clear of the noise."""
    level, threshold = usual
    change = worse_by(level, value, larger_is_better)
    if change > threshold:
        return slower(change, level, value, called_worse("time", unit))
    if -change > threshold:
        return Verdict(word="improved", sentence=change_in_words(change))
    return Verdict(
        word="same", sentence=f"{change_in_words(change)}, inside the noise (±{100.0 * threshold:.0f} %)"
    )


def worse_by(level: float, value: float, larger_is_better: bool) -> float:
    """Change for the worse, relative to how large the level is; infinite for what is not finite."""
    if not math.isfinite(value):
        return math.inf if math.isfinite(level) else 0.0
    if not math.isfinite(level):
        return -math.inf
    if level == 0.0:
        return 0.0 if value == 0.0 else math.copysign(math.inf, -value if larger_is_better else value)
    change = value / level - 1.0
    return -change if larger_is_better == (level > 0.0) else change


def slower(change: float, level: float, value: float, name: str) -> Verdict:
    """The verdict on a time so much worse; without a name it is to be confirmed first."""
    if not math.isfinite(value):
        return Verdict(
            word="regressed", sentence=f"no finite value any more, {level:g} before", name="not finite"
        )
    if not name:
        return Verdict(word="same", sentence=f"{change_in_words(change)}, {CONFIRM}")
    ratio = abs(value / level) if level else 0.0
    decades = math.log10(ratio) if 2.0 / FROM_NONE < ratio < 0.5 * FROM_NONE else None
    return Verdict(word="regressed", sentence=change_in_words(change), name=name, decades=decades)


def flaky(words: str) -> Verdict:
    """Of a night slower than usual at a level that comes and goes: it is none that lasts."""
    return Verdict(word="same", name=FLAKY, sentence=words)


def by_outcome(verdict: Verdict, sample: Sample, unit: str) -> Verdict:
    """The same, where what is worse is no time, and a night without a number is called what became of it."""
    if verdict.name == "slower":
        return replace(verdict, name=called_worse("time", unit))
    if verdict.name != "not finite" or sample.outcome == "value":
        return verdict
    if sample.outcome == "missing":
        return replace(verdict, word="missing", name="missing", sentence=sample.failure or verdict.sentence)
    why = f"{sample.failure}; " if sample.failure else ""
    return replace(verdict, name=sample.outcome.replace("_", " "), sentence=f"{why}{verdict.sentence}")


def change_in_words(change: float) -> str:
    """A relative change, and whether for the worse."""
    size = "from 0" if change >= 0.5 * FROM_NONE else f"{100.0 * change:+.1f} %"
    return f"{size} for the {'worse' if change > 0.0 else 'better'}"
