"""Two versions that were measured in several runs each: paired machine by machine, and told as one comparison.

A version is all runs of its commit: on several machines, in several environments or files. Times are compared on one
machine, so each machine that measured both is a comparison of its own; there, of each series its newest run counts.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from msgspec.structs import replace

from spook_tracker.tracker.document.run_document import MapData, Run, Sample, SeriesDefinition

from .compare import exit_code, overall
from .comparison_document import CompareDocument
from .lane import asked_for, asked_whole, machine_of
from .maps import map_key
from .vocabulary import WORD_RANK
from .work import families_of

OneRun = TypeVar("OneRun", bound=Run)
Samples = Mapping[str, tuple[SeriesDefinition, Sample]]
MOST_NAMED = 5  # machines or series in a note


@dataclass(frozen=True, kw_only=True)
class Paired(Generic[OneRun]):
    """Runs of both versions by machine, each side's newest first; and in a sentence each what was left out."""

    pairs: tuple[tuple[list[OneRun], list[OneRun]], ...]
    left_out: tuple[str, ...]


def paired(
    before: Sequence[OneRun], after: Sequence[OneRun], keys_of: Callable[[OneRun], Collection[str]]
) -> Paired[OneRun]:
    """The runs of two versions, each in their order, paired by machine; the newest of each if they share none."""
    olds, news = _by_machine(before), _by_machine(after)
    both = [machine for machine in news if machine in olds]
    if not both:
        old, new = before[-1], after[-1]
        chosen = f"no machine measured both: compared are {machine_of(old)} and {machine_of(new)}"
        several = len(before) > 1 or len(after) > 1
        return Paired(pairs=(([old], [new]),), left_out=(chosen,) if several else ())
    left_out = []
    for version, mine, others in ((before[-1], olds, news), (after[-1], news, olds)):
        alone = [machine_of(runs[0]) for machine, runs in mine.items() if machine not in others]
        if alone:
            many = "1 machine" if len(alone) == 1 else f"{len(alone)} machines"
            left_out.append(
                f"not compared, {many} that measured {version.engine.version} alone: {_some(alone)}"
            )
    pairs = []
    for machine in both:
        keys: dict[str, set[str]] = {run.id: set(keys_of(run)) for run in (*olds[machine], *news[machine])}
        sides: list[list[OneRun]] = []
        for own, beside in ((olds[machine], news[machine]), (news[machine], olds[machine])):
            shared = set().union(*(keys[run.id] for run in beside))
            kept = [run for run in own if getattr(run, "trigger", "") != "import" or keys[run.id] & shared]
            sides.append(kept or own[:1])
            if aside := sorted(set().union(*(keys[run.id] for run in own if kept and run not in kept))):
                left_out.append(
                    f"not compared, {len(aside)} series of runs that only {own[0].engine.version} has: {_some(aside)}"
                )
        pairs.append((sides[0], sides[1]))
    return Paired(pairs=tuple(pairs), left_out=tuple(left_out))


def _by_machine(runs: Sequence[OneRun]) -> dict[str, list[OneRun]]:
    found: dict[str, list[OneRun]] = {}
    for run in reversed(runs):
        found.setdefault(run.machine.fingerprint, []).append(run)
    return found


def _some(names: Sequence[str]) -> str:
    return ", ".join(names[:MOST_NAMED]) + (", …" if len(names) > MOST_NAMED else "")


def together(
    runs: Sequence[Run], samples: Callable[[str], Samples], maps: Callable[[str], Sequence[MapData]]
) -> tuple[Samples, list[MapData]]:
    """What some runs measured, named newest first: an earlier one tells only what no later one was asked for."""
    found: dict[str, tuple[SeriesDefinition, Sample]] = {}
    drawn: dict[str, MapData] = {}
    asked: dict[str, set[str]] = {}
    for run in runs:
        own = samples(run.id)
        found |= {
            key: pair
            for key, pair in own.items()
            if key not in found and not any(pair[0].test in asked.get(f, ()) for f in families_of(pair[0]))
        }
        for one in maps(run.id):
            if one.test not in asked.get("stability", ()):
                drawn.setdefault(map_key(one), one)
        if asked_whole(run):
            break
        if getattr(run, "trigger", "") != "import":  # what an imported run misses it says itself
            for family, tests in asked_for(run, own).items():
                asked.setdefault(family, set()).update(tests)
    return found, list(drawn.values())


def joined(
    documents: Sequence[CompareDocument], machines: Sequence[str], left_out: Sequence[str]
) -> CompareDocument:
    """The comparisons of some machines as one, each change with its machine where there are several."""
    first = documents[0]
    if len(documents) == 1:
        return replace(first, notes=(*first.notes, *left_out)) if left_out else first
    changes = [
        replace(change, machine=machine)
        for document, machine in zip(documents, machines, strict=True)
        for change in document.changes
    ]
    changes.sort(key=lambda change: (WORD_RANK[change.word], change.role != "gate", change.series))
    frontiers = [
        replace(frontier, machine=machine)
        for document, machine in zip(documents, machines, strict=True)
        for frontier in document.frontiers
    ]
    said: dict[str, list[str]] = {}
    for document, machine in zip(documents, machines, strict=True):
        for note in document.notes:
            said.setdefault(note, []).append(machine)
    notes = (note if len(of) == len(machines) else f"on {_some(of)}: {note}" for note, of in said.items())
    compared = f"compared on {len(machines)} machines: {_some(machines)}"
    verdict = overall(changes)
    return replace(
        first,
        verdict=verdict,
        exit_code=exit_code(verdict),
        counts=dict(Counter(change.word for change in changes)),
        changes=tuple(changes),
        frontiers=tuple(frontiers),
        notes=(*notes, compared, *left_out),
    )
