"""A change measured beside its base in one job: values compared exactly, run times between fresh processes.

What is deterministic is compared as ever, and asked again before it is red: a value that differs between processes of
one side is noise of the process, too, and then decided as run times are (tracker/judge/pairs.py).
"""

from __future__ import annotations

import math
import random
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import msgspec

from spook_tracker.tracker.document.errors import TrackerError
from spook_tracker.tracker.document.json_form import Number
from spook_tracker.tracker.document.run_document import RunDocument, Sample, SeriesDefinition
from spook_tracker.tracker.judge.accepted import Accepted
from spook_tracker.tracker.judge.calibration import geometric_mean
from spook_tracker.tracker.judge.compare import (
    ComparedRun,
    accept,
    compare,
    exit_code,
    overall,
    side_of,
)
from spook_tracker.tracker.judge.comparison_document import Change, CompareDocument
from spook_tracker.tracker.judge.explaining import EXPLAINING, TIMES, beside_run_times
from spook_tracker.tracker.judge.lane import asked_for, asked_whole
from spook_tracker.tracker.judge.pairs import (
    BLOCKS,
    SMALLEST,
    UNUSUAL,
    Decision,
    Paired,
    to_be_repeated,
    usual_spread,
)
from spook_tracker.tracker.judge.verdict import badness, same_bits
from spook_tracker.tracker.judge.work import is_read_off, with_work
from spook_tracker.tracker.measure.commits import CommitError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from spook_tracker.tracker.document.run_document import Run
    from spook_tracker.tracker.judge.lane import Records

Ask = Callable[[Sequence[str]], RunDocument]  # puts these tests, all if none are named, to a fresh process
Samples = Mapping[str, tuple[SeriesDefinition, Sample]]
Line = Callable[[str], None]
Usual = Callable[
    [str, Mapping[str, Sequence[str]]], Mapping[str, float]
]  # spread of run times on a machine, relative
GONE = ("removed", "missing")  # what a second process would not bring back


@dataclass
class _Sides:
    """Fresh processes of both sides, in an order that is drawn."""

    base: Ask
    change: Ask
    order: random.Random
    taken: int = 0  # of either side
    names: dict[str, str] = field(default_factory=dict)  # a series of the base: what the change calls it

    def block(self, size: int, tests: Sequence[str]) -> tuple[list[Samples], list[Samples]]:
        """So many of each."""
        places = [0] * size + [1] * size
        self.order.shuffle(places)
        found: tuple[list[Samples], list[Samples]] = ([], [])
        for side in places:
            found[side].append(self._samples((self.base, self.change)[side](tests)))
        self.taken += size
        return found

    def first(self) -> tuple[RunDocument, RunDocument]:
        """All tests once."""
        places = [0, 1]
        self.order.shuffle(places)
        found = {side: (self.base, self.change)[side](()) for side in places}
        self.taken = 1
        for series in found[1].series:
            self.names |= dict.fromkeys(series.aliases, series.key)
        return found[0], found[1]

    def compared(self, run: RunDocument) -> ComparedRun:
        samples = self._samples(run)
        whole, asked = asked_whole(run), asked_for(run, samples)
        return ComparedRun(side=side_of(run), samples=samples, maps=run.maps, whole=whole, asked=asked)

    def _samples(self, run: RunDocument) -> Samples:
        definitions = {series.key: series for series in run.series}
        pairs = {self.names.get(s.series, s.series): (definitions[s.series], s) for s in run.samples}
        return with_work(pairs, run.engine)


def compare_by_pairs(
    base: Ask,
    change: Ask,
    by_old: Ask,
    accepted: Sequence[Accepted] = (),
    seed: str = "",
    tell: Line = lambda line: None,
    usual: Usual = lambda machine, rungs: {},
) -> CompareDocument:
    """The change against its base. `seed` draws the order of the processes. Raises what asking raises.

    `usual` is what the history knows of a machine and of run times made of these series; it is told beside the spread
    between processes, and decides nothing. `by_old` puts the base's questions to the change, where its own are others; what CommitError it raises is said.
    """
    sides = _Sides(base, change, random.Random(seed))
    before, after = map(sides.compared, sides.first())
    if before.side.git_hash and before.side.git_hash == after.side.git_hash:
        raise TrackerError(
            f"both sides answer as commit {after.side.git_hash[:12]}: there is no change to measure"
        )
    document = compare(before, after, accepted)
    rungs = _rungs(before.samples, after.samples)
    times = {
        key: Paired(
            smallest=max(SMALLEST, tolerance),
            first=(_level(before.samples, keys), _level(after.samples, keys)),
        )
        for key, (keys, tolerance) in rungs.items()
    }
    tested = {key: paired for key, paired in times.items() if paired.worth_a_look}
    of_test = {change.series: change.test for change in document.changes}
    doubted = [c for c in document.changes if c.red and c.kind not in TIMES and c.word not in GONE]
    if doubted:
        size = to_be_repeated(len(doubted))
        tell(f"{len(doubted)} values are worse: asked again in {size} processes of either side")
        again = sides.block(size, _tests(of_test, (c.series for c in doubted)))
        first = before.samples, after.samples
        for key in (c.series for c in doubted):
            if not all(_repeated(key, *side) for side in zip(first, again, strict=True)):
                rungs[key] = ((key,), 0.0)
                tested[key] = Paired(smallest=0.0, first=(_level(first[0], [key]), _level(first[1], [key])))
    decided: dict[str, Decision] = dict.fromkeys(times.keys() - tested.keys(), "not slower")
    left, count = dict(tested), len(tested)
    for number, size in enumerate(BLOCKS, start=1):
        if not left:
            break
        tell(f"block {number}: {len(left)} of {len(times)} run times in {size} processes of either side")
        blocks = sides.block(size, _tests(of_test, left))
        for key, paired in [*left.items()]:
            keys = rungs[key][0]
            paired.blocks.append(([_level(s, keys) for s in blocks[0]], [_level(s, keys) for s in blocks[1]]))
            decided[key] = paired.decision(count)
            if decided[key] != "open":
                del left[key]
    known = usual(after.side.machine, {key: rungs[key][0] for key in tested if key in times})
    changes = [_told(c, times | tested, decided, known) for c in document.changes]
    changes = beside_run_times(changes, before.samples, after.samples)
    changes, why_not = _by_old_questions(sides, before, changes, by_old)
    changes = [accept(c, accepted, after.night) for c in changes]
    verdict = overall(changes)
    note = (
        f"run times: {len(times)} compared in fresh processes of base and change in random order, "
        f"{len(tested)} of them in more than one, {sides.taken} at most of either"
    )
    return msgspec.structs.replace(
        document, changes=tuple(changes), verdict=verdict, exit_code=exit_code(verdict),
        counts=dict(Counter(c.word for c in changes)), notes=(*document.notes, note, *_unusual(tested, known), *why_not),
    )  # fmt: skip


def _by_old_questions(
    sides: _Sides, before: ComparedRun, changes: list[Change], ask: Ask
) -> tuple[list[Change], list[str]]:
    """What could not be compared because the change asks something else, by what the base asks."""
    left = {c.series: c.test for c in changes if c.word == "not_comparable"}
    if not left:
        return changes, []
    try:
        answers = sides.compared(ask(tuple(sorted(set(left.values())))))
    except CommitError as error:
        return changes, [f"not compared by the questions of the base: {error}"]
    old = {c.series: c for c in compare(before, answers).changes if c.series in left}
    told = [
        msgspec.structs.replace(
            now, sentence=f"{now.sentence}, by the question of the base; the change asks another"
        )
        if (now := old.get(c.series, c)).word != "not_comparable"
        else c
        for c in changes
    ]
    return told, []


def _tests(of_test: Mapping[str, str], keys: Iterable[str]) -> tuple[str, ...]:
    return tuple(sorted({of_test[key] for key in keys}))


def _rungs(before: Samples, after: Samples) -> dict[str, tuple[tuple[str, ...], float]]:
    """What each run time is made of: the series both sides have under one definition, and its own tolerance."""
    found: dict[str, list[str]] = {}
    tolerance: dict[str, float] = {}
    for key, (definition, sample) in after.items():
        if key not in before or before[key][0].test_version != definition.test_version:
            continue
        if definition.role == EXPLAINING:
            continue
        timed = sample.timing is not None and before[key][1].timing is not None
        if timed:
            run_time = f"{definition.test}/{definition.configuration}/{definition.metric}:run-time"
            found.setdefault(run_time, []).append(key)
            own = definition.time_tolerance if definition.kind == "ladder" else definition.relative_tolerance
            tolerance[run_time] = max(own, tolerance.get(run_time, 0.0))
        elif definition.kind == "time" and not is_read_off(definition):
            found[key], tolerance[key] = [key], definition.relative_tolerance
    return {key: (tuple(rungs), tolerance[key]) for key, rungs in found.items()}


def run_time_levels(run: RunDocument) -> dict[str, float]:
    """The one number that a process gives for each of its run times."""
    samples = {s.series: (d, s) for d, s in zip(run.series, run.samples, strict=True)}
    return {key: _level(samples, keys) for key, (keys, _) in _rungs(samples, samples).items()}


def _level(samples: Samples, keys: Sequence[str]) -> float:
    """The one number of a process: of its run times the geometric mean, of a value how bad it is; inf without one."""
    levels = []
    for key in keys:
        if key not in samples:
            return math.inf
        definition, sample = samples[key]
        if sample.timing is not None:
            levels.append(min(sample.timing.cpu_seconds or sample.timing.seconds))
        elif not math.isfinite(sample.value):
            return math.inf
        elif definition.kind == "time":
            levels.append(1.0 / sample.value if definition.better == "larger" else float(sample.value))
        else:
            return _bad(definition, sample)
    return geometric_mean(levels) if all(level > 0.0 for level in levels) else math.inf


def _bad(definition: SeriesDefinition, sample: Sample) -> float:
    worse = badness(definition, sample.value)
    return math.inf if worse is None or sample.outcome not in ("value", "out_of_limit") else worse


def _repeated(key: str, first: Samples, again: Sequence[Samples]) -> bool:
    """Whether every process of a side gives this value to the last bit."""
    if key not in first:
        return all(key not in samples for samples in again)
    sample = first[key][1]
    return all(
        key in samples
        and samples[key][1].outcome == sample.outcome
        and same_bits(samples[key][1].value, sample.value)
        for samples in again
    )


def usual_spreads(
    history: Records, nights: Sequence[Run], rungs: Mapping[str, Sequence[str]]
) -> dict[str, float]:
    """What is usual between nights, of run times made of these series; those of too few nights are left out."""
    measured = history.samples_of(
        [night.id for night in nights], keys={k for keys in rungs.values() for k in keys}
    )
    told = {
        key: usual_spread([_level(measured[night.id], keys) for night in nights])
        for key, keys in rungs.items()
    }
    return {key: spread for key, spread in told.items() if math.isfinite(spread)}


def _unusual(tested: Mapping[str, Paired], known: Mapping[str, float]) -> list[str]:
    """A sentence where processes differ more than nights of this machine do: small changes may not be proven."""
    ratios = [tested[key].spread / usual for key, usual in known.items() if usual > 0.0]
    more = [ratio for ratio in ratios if ratio > UNUSUAL]
    if not more:
        return []
    return [
        f"busy: {len(more)} of {len(ratios)} run times differ between processes by up to {max(more):.1f} times what is "
        "usual between nights of this machine, so small changes may not be proven"
    ]


def _told(
    change: Change,
    times: Mapping[str, Paired],
    decided: Mapping[str, Decision],
    known: Mapping[str, float],
) -> Change:
    """A change as the processes decided it."""
    paired, decision = times.get(change.series), decided.get(change.series)
    if paired is None or decision is None:  # what is read off the clock of one process says nothing
        quiet = change.kind in TIMES and not change.red and change.word in ("changed", "improved")
        return msgspec.structs.replace(change, word="same", stands="followed") if quiet else change
    processes = 1 + sum(len(base) for base, _ in paired.blocks)
    of = f"in {processes} process{'es' * (processes > 1)} of either side"
    spread = f", which differ by {100.0 * paired.spread:.1f} %" if math.isfinite(paired.spread) else ""
    if spread and change.series in known:
        spread += f" ({100.0 * known[change.series]:.1f} % is usual)"
    red = decision == "slower"
    if change.kind not in TIMES:
        words = f"{change.sentence}; differs from process to process, {'worse' if red else 'no worse'} {of}"
        calm = {} if red else {"word": "same", "red": False, "name": ""}
        return msgspec.structs.replace(change, sentence=words, **calm)
    ratio = paired.ratio
    size = f"{100.0 * (ratio - 1.0):+.1f} % run time" if math.isfinite(ratio) else "no run time"
    proof = {"slower": f"by chance in {paired.probability:.0e}", "not proven": "not proven"}.get(decision, "")
    return msgspec.structs.replace(
        change, word="regressed" if red else "same", red=red, stands="watch" if red else "followed",
        name="slower" if red else "", sentence=f"{size} {of}{spread}" + f"; {proof}" * bool(proof),
        after=Number(change.before * ratio) if change.before and math.isfinite(ratio) else change.after,
        decades=math.log10(ratio) if math.isfinite(ratio) else None,
    )  # fmt: skip
