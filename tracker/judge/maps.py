"""Stability maps over nights: what became of each, and since which run one is gone.

The newest run that holds a map is the last good one, however long ago: retention always keeps one of each. The first
run after it that was asked for stability and has no map is where it was lost, and the loss lasts until the map is back
or given up. Nights of another floating-point environment are a history of their own, as for values.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cache

from spook_tracker.tracker.document.run_document import MapData, Run

from .accepted import Accepted, acceptance
from .judged import night_of
from .lane import Records, asked_for, is_placed
from .verdict import Verdict, judge_map
from .vocabulary import Class, State
from .work import FAMILIES

NO_MAP = Verdict(word="missing", sentence="a stability map asked for and not answered", name="missing")
GIVEN_UP = Verdict(word="accepted", sentence=NO_MAP.sentence)
STABILITY = [kind for kind, family in FAMILIES.items() if family == "stability"]
Kind = tuple[str, str, bool]  # of runs: engine, floating-point environment, whether it has a place
Held = dict[str, list[tuple[int, Run, MapData]]]  # by key, newest first: place in the line, run, map


@dataclass(frozen=True, slots=True, kw_only=True)
class ToldMap:
    """One stability map, as of the newest run of a line."""

    newest: MapData  # as last held
    verdict: Verdict
    good: Run  # the run it is compared with; of a lost map the newest that holds it
    bad: Run  # the run the verdict is about: the newest that holds the map, or the first without it
    tonight: bool  # whether the newest run tells of it: holds it, or was asked for it
    news: bool  # whether `bad` is the newest run
    gone: bool = False  # asked for and not answered, given up or not
    back: bool = False  # held again by the newest run, after runs that had lost it

    @property
    def key(self) -> str:
        return map_key(self.newest)

    @property
    def stands(self) -> Class:
        return stands_of(self.verdict)

    @property
    def state(self) -> State:
        if self.verdict.red:
            return "detected"
        return "accepted" if self.gone else "recovered" if self.back else "green"


def map_key(stability_map: MapData) -> str:
    """The series key of a map."""
    return f"{stability_map.test}/{stability_map.configuration}/map:{stability_map.name}"


def stands_of(verdict: Verdict) -> Class:
    """What a map stands for: one that is gone fails, one with worse cells is looked at."""
    if verdict.word in ("missing", "accepted"):
        return "fail" if verdict.word == "missing" else "accepted"
    return "watch" if verdict.red else "pass"


def told_maps(records: Records, line: Sequence[Run], accepted: Sequence[Accepted] = ()) -> list[ToldMap]:
    """Every stability map that runs of a line hold, compared with the run before that has it, or lost since when."""
    if not line:
        return []
    held = _held(records, line)
    blind = _blind(records, line, held)
    oldest = min((place for of_map in held.values() for place, _, _ in of_map), default=len(line))
    asked = _asked(records, line, oldest)
    found = []
    for of_map in held.values():
        for floats in dict.fromkeys(_floats(run) for _, run, _ in of_map):
            lane = [one for one in of_map if _floats(one[1]) == floats]
            told = _told(line, lane, blind, asked, accepted)
            here = floats == _floats(line[-1])
            if told is not None and (here or (told.gone and lane[0] is of_map[0])):
                found.append(told)
    return sorted(found, key=lambda told: told.key)


def may_be_dropped(records: Records, runs: Sequence[Run]) -> dict[str, set[str]]:
    """By run: keys of the maps that a later run of its kind holds, so that it may have had and lost them to retention."""
    having, wanted = records.with_maps(), {run.id for run in runs}
    later: dict[Kind, set[str]] = {}
    found: dict[str, set[str]] = {}
    for run in reversed(records.runs()):
        of_kind = later.setdefault(_kind(run), set())
        if run.id in wanted:
            found[run.id] = set(of_kind)
        if run.id in having:
            of_kind.update(map(map_key, records.maps(run.id)))
    return found


def _told(
    line: Sequence[Run],
    lane: Sequence[tuple[int, Run, MapData]],
    blind: Mapping[tuple[str, Kind], int],
    asked: Callable[[int, str], bool],
    accepted: Sequence[Accepted],
) -> ToldMap | None:
    last, tonight = len(line) - 1, line[-1]
    place, run, newest = lane[0]
    key = map_key(newest)

    def first_without(start: int, end: int) -> int | None:
        of_floats = (i for i in range(start, end) if _floats(line[i]) == _floats(run))
        seeing = (i for i in of_floats if i > blind.get((key, _kind(line[i])), -1))
        return next((i for i in seeing if asked(i, newest.test)), None)

    lost = first_without(place + 1, last + 1)
    if lost is not None:
        gone = acceptance(accepted, key, math.nan, night_of(tonight), removed=True)
        return ToldMap(
            newest=newest,
            verdict=NO_MAP if gone is None else GIVEN_UP,
            good=run,
            bad=line[lost],
            tonight=_floats(run) == _floats(tonight) and asked(last, newest.test),
            news=lost == last,
            gone=True,
        )
    if len(lane) < 2:
        return None
    earlier, before, older = lane[1]
    return ToldMap(
        newest=newest,
        verdict=judge_map(older, newest),
        good=before,
        bad=run,
        tonight=place == last,
        news=place == last,
        back=place == last and first_without(earlier + 1, place) is not None,
    )


def _held(records: Records, line: Sequence[Run]) -> Held:
    having = records.with_maps()
    found: Held = {}
    for place in range(len(line) - 1, -1, -1):
        if line[place].id in having:
            for one in records.maps(line[place].id):
                found.setdefault(map_key(one), []).append((place, line[place], one))
    return found


def _blind(records: Records, line: Sequence[Run], held: Held) -> dict[tuple[str, Kind], int]:
    """By map and kind of run: up to which place of the line it may have been dropped for a run beside or after it."""
    here = {run.id: place for place, run in enumerate(line)}
    having = records.with_maps()
    blind: dict[tuple[str, Kind], int] = {}
    reached = -1
    for run in records.runs():
        if run.id in here:
            reached = here[run.id]
        elif run.id in having and run.engine.name == line[-1].engine.name:
            for one in records.maps(run.id):
                if map_key(one) in held:
                    blind[map_key(one), _kind(run)] = reached
    return blind


def _asked(records: Records, line: Sequence[Run], oldest: int) -> Callable[[int, str], bool]:
    """Whether a run, at `oldest` or after, was asked for the stability of a test; silent ones tell by their answers."""

    @cache
    def answered() -> Mapping[str, Collection[tuple[str, str]]]:
        return records.answered([run.id for run in line[oldest:] if getattr(run, "asked", None) is None])

    def asked(place: int, test: str) -> bool:
        run = line[place]
        if getattr(run, "asked", None) is not None:
            return test in asked_for(run, {}).get("stability", ())
        return any((test, kind) in answered()[run.id] for kind in STABILITY)

    return asked


def _floats(run: Run) -> str:
    return str(run.machine.float_environment)


def _kind(run: Run) -> Kind:
    """Runs among which retention keeps one of each map."""
    return run.engine.name, _floats(run), is_placed(run)
