"""Two values of one series: what became of it? Pure functions on values, one rule after the other.

1. Not comparable: another definition of the test, another float environment, run times of another machine.
2. The same bits are identical. Two values of one commit are non-deterministic, if the series has no noise.
3. A worse outcome class is a regression, a better one is fixed. Crossing the limit is a change of class.
4. Leaving the set point is a regression even inside the limit.
5. Errors are compared by magnitude, the rest by what is better. A growth within the tolerance is only
   "changed", and so is one that ends at least three decades inside the limit: it is named in decades, and the
   comparison with the last release catches it if it creeps on.
6. Where pushes of the last bits were measured beside a value, what they grow to is rounding, and all beyond it a
   change, told against what halving the time step changes.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence

import msgspec

from spook_tracker.tracker.document.run_document import (
    MapData,
    OutcomeClass,
    Sample,
    Sensitivity,
    SeriesDefinition,
)

from .standing import HAVE_VALUES, honest
from .vocabulary import CALLED_WORSE, RED, Word

RANK: dict[OutcomeClass, int] = {
    "value": 0,
    "unsettled": 1,
    "out_of_limit": 2,
    "not_finite": 3,
    "diverged": 4,
    "crashed": 4,
    "timed_out": 4,
    "missing": 5,
}
DEEP_INSIDE = 1e-3  # of the limit: an error that small may grow without being called a regression
SAID_IN_ULPS = 1e-10  # decades, a million doubles: below, a difference of logarithms is rounding
LAST_BITS = 16  # doubles apart: a limit crossed by so few is a matter of rounding, and is said to be
EXACT_ZERO = 1e-6  # of the limit: how far a value may leave an exact zero
ROUNDING = {"ladder": 1e-10}  # of the reference or of 1: what is rounding where no limit gives a scale
ROUNDING_ELSE = 1e-12
AS_DOUBLES, AS_WHOLES = struct.Struct("<dd").pack, struct.Struct("<qq").unpack  # the bits of two doubles
NEW_DEFINITION = "the definition of the test changed"
CELL_RANK = {"settled": 0, "bounded": 1, "growing": 2, "diverged": 3, "not_finite": 4}


class Verdict(msgspec.Struct, frozen=True, kw_only=True):
    """What became of a value, in a word and a sentence; `name` is what to call a regression."""

    word: Word
    sentence: str
    name: str = ""
    decades: float | None = None  # of error magnitude; positive is larger
    ulps: int | None = None  # doubles between the two values

    @property
    def red(self) -> bool:
        """Whether a person has to look."""
        return self.word in RED


def judge(
    definition: SeriesDefinition,
    before: Sample,
    after: Sample,
    *,
    same_definition: bool = True,
    same_environment: bool = True,
    same_commit: bool = False,
) -> Verdict:
    """Compare two samples of a series without noise. `definition` is the later one's."""
    if not same_definition:
        return _incomparable(NEW_DEFINITION)
    if not same_environment:
        return _incomparable("measured in another float environment")
    if "not_supported" in (before.outcome, after.outcome):
        return _unasked(before, after)
    before, after = honest(before), honest(after)
    old, new = before.value, after.value
    decades, ulps = _decades(definition, old, new), ulp_distance(old, new)
    if same_bits(old, new) and before.outcome == after.outcome:
        same_state = before.state_hash == after.state_hash or "" in (before.state_hash, after.state_hash)
        if same_state or definition.kind == "work":
            return Verdict(word="identical", sentence="the same bits", ulps=0)
        if same_commit:
            return _unrepeatable(decades, 0)
        return Verdict(word="changed", sentence="the same value from another final state", ulps=0)
    if same_commit:
        return _unrepeatable(decades, ulps)
    if definition.kind == "work" and before.state_hash != after.state_hash:
        return Verdict(word="changed", sentence=_distance(decades, None, "other work for other answers"))
    by_class = _by_class(before, after, decades, ulps)
    if by_class is not None:
        return by_class
    if not (math.isfinite(old) and math.isfinite(new)):
        return Verdict(word="same", sentence=f"still {_words(after.outcome)}")
    if before.set_point_held and not after.set_point_held and definition.set_point is not None:
        low, high = definition.set_point
        words = f"left its set point {low:g} … {high:g}"
        return Verdict(word="regressed", sentence=words, name="set point left", decades=decades, ulps=ulps)
    if after.set_point_held and not before.set_point_held and definition.set_point is not None:
        return Verdict(word="fixed", sentence="back at its set point", decades=decades, ulps=ulps)
    return _by_size(definition, old, new, decades, ulps)


def _incomparable(why: str) -> Verdict:
    return Verdict(word="not_comparable", sentence=why)


def _unasked(before: Sample, after: Sample) -> Verdict:
    """An engine that cannot be asked is neither better nor worse; one that gave a value and gives none is."""
    if before.outcome == after.outcome:
        return Verdict(word="same", sentence="still not supported")
    if after.outcome == "not_supported":
        words = "no longer supported" + (f": {after.failure}" if after.failure else "")
        if honest(before).outcome in HAVE_VALUES:
            return Verdict(word="removed", sentence=words, name="no longer supported")
        return _incomparable(words)
    return _incomparable("supported for the first time")


def _unrepeatable(decades: float | None, ulps: int | None) -> Verdict:
    return Verdict(
        word="non_deterministic",
        sentence="the same commit gave two answers",
        name="non-deterministic",
        decades=decades,
        ulps=ulps,
    )


def _words(outcome: OutcomeClass) -> str:
    return outcome.replace("_", " ")


def _by_class(before: Sample, after: Sample, decades: float | None, ulps: int | None) -> Verdict | None:
    old, new = RANK[before.outcome], RANK[after.outcome]
    if after.outcome == "missing" and new > old:
        gone: Word = "removed" if after.failure.startswith("removed") else "missing"
        return Verdict(word=gone, sentence=after.failure or "asked for and not answered", name=gone)
    if new > old:
        crossed = after.outcome == "out_of_limit"
        far = "" if ulps is None or ulps > LAST_BITS else f" by {ulps} ULP: the last bits decide"
        if ulps == 0:
            far = ": the same value, at another limit"
        what = (
            f"crossed its limit{far}"
            if crossed
            else f"{_words(before.outcome)} became {_words(after.outcome)}"
        )
        return Verdict(
            word="regressed",
            sentence=what + (f": {after.failure}" if after.failure else ""),
            name="limit crossed" if crossed else _words(after.outcome),
            decades=decades,
            ulps=ulps,
        )
    if new < old:
        word: Word = "fixed" if new == 0 else "improved"
        return Verdict(word=word, sentence=f"{_words(before.outcome)} became {_words(after.outcome)}")
    if before.outcome != after.outcome:
        return Verdict(word="changed", sentence=f"{_words(before.outcome)} became {_words(after.outcome)}")
    return None


def _by_size(
    definition: SeriesDefinition, old: float, new: float, decades: float | None, ulps: int | None
) -> Verdict:
    if definition.sensitivity is not None:
        return _by_sensitivity(definition, definition.sensitivity, old, new)
    badness_before, badness_after = badness(definition, old), badness(definition, new)
    if badness_before is None or badness_after is None:
        return Verdict(
            word="changed", sentence=_distance(decades, ulps, "changed"), decades=decades, ulps=ulps
        )
    growth = badness_after - badness_before
    if growth == 0.0:
        return Verdict(word="same", sentence="the same magnitude", decades=decades, ulps=ulps)
    allowed = max(
        definition.tolerance, definition.relative_tolerance * abs(badness_before), _rounding(definition)
    )
    if abs(growth) <= allowed:
        words = _distance(decades, ulps, "changed inside the tolerance")
        return Verdict(word="changed", sentence=words, decades=decades, ulps=ulps)
    worse = "worse" if growth > 0.0 else "better"
    words = _distance(decades, ulps, worse)
    if max(badness_before, badness_after) <= _deep_inside(definition, min(badness_before, badness_after)):
        return Verdict(word="changed", sentence=words + ", far inside the limit", decades=decades, ulps=ulps)
    if growth > 0.0:
        return Verdict(
            word="regressed",
            sentence=words,
            name=called_worse(definition.kind, definition.unit),
            decades=decades,
            ulps=ulps,
        )
    return Verdict(word="improved", sentence=words, decades=decades, ulps=ulps)


def _by_sensitivity(definition: SeriesDefinition, known: Sensitivity, old: float, new: float) -> Verdict:
    """A value without a reference: rounding, or a change, which is told against what else moves it."""
    moved, unit = abs(new - old), definition.unit
    if moved <= known.rounding:
        if math.isinf(known.rounding):
            words = "beyond the time until which this can be predicted, or not at rest"
        else:
            words = f"rounding: {moved:.2g} {unit}, and pushes of the last bits grow to {known.rounding:.2g}"
        return Verdict(word="same", sentence=words)
    told = f"moved by {moved:.3g} {unit}"
    if known.step_error is not None and known.step_error <= known.rounding:
        told += ": halving the time step does not move it"
    elif known.step_error is not None and math.isfinite(known.step_error):
        told += f": {_times(moved / known.step_error)} what halving the time step changes"
    if known.scale and math.isfinite(known.scale) and unit == "m":
        told += f", {moved / known.scale:.2g} of the size"
    if 0.0 < definition.tolerance < moved:
        return Verdict(word="regressed", sentence=told, name="moved")
    return Verdict(word="changed", sentence=told)


def _times(ratio: float) -> str:
    return f"{ratio:.2g} times" if 1e-3 <= ratio < 1e6 else f"{ratio:.0e} times"


def called_worse(kind: str, unit: str) -> str:
    """What a growth of badness is called: only what is timed, or a rate of work, is slower."""
    if kind == "time" and unit != "s" and not unit.endswith("/s"):
        return "worse"
    return CALLED_WORSE.get(kind, "worse")


def badness(definition: SeriesDefinition, value: float) -> float | None:
    """A number that grows as the value gets worse; None where one value is as good as another.

    Where a reference says what is right, the distance from it decides: energy that is gained is no better than lost.
    """
    if definition.better == "smaller_magnitude":
        return abs(value)
    if definition.reference is not None:
        return abs(value - definition.reference)
    return {"larger": -value, "smaller": value}.get(definition.better)


def half_width(definition: SeriesDefinition) -> float | None:
    """The limit as a magnitude of error, for those judged by magnitude."""
    if definition.better in ("larger", "smaller") or definition.limit is None:
        return None
    if isinstance(definition.limit, tuple):
        return 0.5 * abs(definition.limit[1] - definition.limit[0])
    return abs(definition.limit)


def limit_ratio(definition: SeriesDefinition, value: float) -> float:
    """How many times its limit a value is, above 1 where it is broken; NaN where no ratio says it."""
    bound, half = definition.limit, half_width(definition)
    if isinstance(bound, tuple):
        return abs(value - 0.5 * sum(bound)) / half if half else math.nan
    if half is not None:
        return abs(value) / half if half else math.nan
    if bound is None or bound * value <= 0.0:
        return math.nan
    larger_is_worse = (definition.better == "smaller") == (bound > 0.0)
    return value / bound if larger_is_worse else bound / value


def worse_times(definition: SeriesDefinition, fails: bool, before: float, value: float) -> float:
    """How many times its limit a value that fails is, or the value before where no limit says how bad it is.

    Infinite where there is no value; NaN where neither says how bad it is.
    """
    if not math.isfinite(value):
        return math.inf
    if fails and not math.isnan(ratio := limit_ratio(definition, value)):
        return ratio
    own, old = badness(definition, value), badness(definition, before)
    if own is None or old is None or not math.isfinite(old) or 0.0 in (own, old):
        return math.nan
    return old / own if own < 0.0 else own / old


def _deep_inside(definition: SeriesDefinition, smaller: float) -> float:
    """Below this magnitude growth is no regression; -inf where there is no limit to be inside of."""
    half = half_width(definition)
    if half is None:
        return -math.inf
    return half * (EXACT_ZERO if smaller == 0.0 else DEEP_INSIDE) * (1.0 + 1e-9)


def _rounding(definition: SeriesDefinition) -> float:
    """What may be rounding, where no limit says how large an error matters."""
    if definition.limit is not None or definition.better in ("larger", "smaller"):
        return 0.0
    return ROUNDING.get(definition.kind, ROUNDING_ELSE) * max(1.0, abs(definition.reference or 0.0))


def same_bits(a: float, b: float) -> bool:
    """Equal as stored: the sign of zero counts, every NaN equals every other."""
    if a == b:
        return a != 0.0 or math.copysign(1.0, a) == math.copysign(1.0, b)
    return a != a and b != b


def ulp_distance(a: float, b: float) -> int | None:
    """How many doubles lie from one to the other; None where one is not finite."""
    if not (math.isfinite(a) and math.isfinite(b)):
        return None
    first, second = AS_WHOLES(AS_DOUBLES(a, b))
    return abs(_rank(first) - _rank(second))


def _rank(bits: int) -> int:
    """Of a double among all doubles; both zeros have rank 0."""
    return bits if bits >= 0 else -(bits & 0x7FFF_FFFF_FFFF_FFFF)


def _decades(definition: SeriesDefinition, old: float, new: float) -> float | None:
    if definition.better != "smaller_magnitude" and definition.reference is not None:
        old, new = old - definition.reference, new - definition.reference
    if not (math.isfinite(old) and math.isfinite(new)) or old == 0.0 or new == 0.0:
        return None
    return math.log10(abs(new)) - math.log10(abs(old))


def _distance(decades: float | None, ulps: int | None, what: str) -> str:
    parts = [what]
    if decades is not None and abs(decades) >= 0.05:
        parts.append(f"by {abs(decades):.1f} decades")
    elif decades is not None and abs(decades) > SAID_IN_ULPS:
        parts.append(f"by {100.0 * abs(10.0**decades - 1.0):.2g} %")
    if ulps is not None and ulps < 1_000_000:
        parts.append(f"({ulps} ULP)")
    return " ".join(parts)


def judge_map(before: MapData, after: MapData) -> Verdict:
    """Compare two stability maps cell by cell; a cell that moved for the worse is a regression."""
    if (before.x, before.y, before.definition) != (after.x, after.y, after.definition):
        return _incomparable("the map's grid or its definition of stable changed")
    worse, better = _moved(before, after)
    if worse:
        first = f"x = {worse[0][0]:g}, y = {worse[0][1]:g}: {worse[0][2]} became {worse[0][3]}"
        words = f"{len(worse)} cells worse, {len(better)} better; {first}"
        return Verdict(word="regressed", sentence=words, name="less stable")
    if better:
        return Verdict(word="improved", sentence=f"{len(better)} cells better")
    return Verdict(word="identical", sentence="the same cells")


def cell_rank(cell: str) -> int:
    """How bad a cell is; an unknown word is the worst."""
    return CELL_RANK.get(cell, len(CELL_RANK))


Cell = tuple[float, float, str, str]


def _moved(before: MapData, after: MapData) -> tuple[Sequence[Cell], Sequence[Cell]]:
    worse, better = [], []
    for y, old_row, new_row in zip(after.y, before.cells, after.cells, strict=True):
        for x, old, new in zip(after.x, old_row, new_row, strict=True):
            step = cell_rank(new) - cell_rank(old)
            if step > 0:
                worse.append((x, y, old, new))
            elif step < 0:
                better.append((x, y, old, new))
    return worse, better
