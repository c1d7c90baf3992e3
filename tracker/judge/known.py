"""What judged histories know about two runs that are compared: usual times, suspects, and who is to blame."""

from __future__ import annotations

import math
from collections.abc import Collection, Hashable, Mapping, Sequence
from dataclasses import dataclass, field

from spook_tracker.tracker.document.run_document import Point, Runs

from .judged import Judged, blame_of, commit_of
from .level import FEW_NIGHTS_FLOOR
from .repeats import Nights
from .series_history import Told, on_one_clock
from .slower import Usual


@dataclass(frozen=True, kw_only=True)
class Known:
    """What the history knows about two runs: see `known`."""

    usual: Mapping[str, Usual] = field(default_factory=dict)  # times of the earlier run, and the noise of two
    values: Mapping[str, tuple[float, float]] = field(default_factory=dict)  # of made series of run time
    suspected: tuple[str, ...] = ()  # times whose slow night is not confirmed yet
    first_bad: Mapping[str, tuple[str, str]] = field(default_factory=dict)  # last good, first bad commit
    blame: Mapping[str, str] = field(default_factory=dict)  # the same in words


def known(told: Mapping[str, Told], before: Sequence[str], after: Sequence[str]) -> Known:
    """What judged histories know about two sides, by the ids of their runs, the newest first.

    Times are compared with the earlier run's own: of the history they have the noise alone. A red series is blamed on the
    commit where it last became worse, where that lies after the earlier run and not after the later one.
    """
    return known_of(told, newest_in(told, before), newest_in(told, after))


def newest_in(told: Mapping[str, Told], runs: Sequence[str]) -> dict[str, Judged]:
    """By series, the verdict of the newest of these runs, named newest first, that has one."""
    found = judged_in(told, runs)
    return {key: judged for run in reversed(runs) for key, judged in found[run].items()}


def judged_in(told: Mapping[str, Told], runs: Collection[str]) -> dict[str, dict[str, Judged]]:
    """The verdicts of some runs, by the run's id and by series."""
    found: dict[str, dict[str, Judged]] = {run: {} for run in runs}
    places: dict[Runs, list[tuple[str, int]]] = {}  # of series that were measured in the same runs
    for key, series in told.items():
        if isinstance(nights := series.nights, Nights):
            of = nights.points.runs
            if of not in places:
                places[of] = [(run.id, i) for i, run in enumerate(of) if run.id in found]
            for run_id, i in places[of]:
                found[run_id][key] = nights.state_at(i)
            continue
        missing = len(found)
        for judged in reversed(series.nights):
            if judged.night.run.id in found:
                found[judged.night.run.id].setdefault(key, judged)
                missing -= 1
                if not missing:
                    break
    return found


def known_of(told: Mapping[str, Told], before: Mapping[str, Judged], after: Mapping[str, Judged]) -> Known:
    """The same of the verdicts of both runs."""
    usual: dict[str, Usual] = {}
    values: dict[str, tuple[float, float]] = {}
    first_bad: dict[str, tuple[str, str]] = {}
    blamed: dict[str, str] = {}
    suspected = []
    for key, series in told.items():
        old, new = before.get(key), after.get(key)
        if (
            new is not None
            and new.red
            and new.worse_at is not None
            and _lies_after(series, new.worse_at, old)
        ):
            good = new.before_worse
            first_bad[key] = (commit_of(good.run) if good else "", commit_of(new.worse_at.run))
            blamed[key] = blame_of(new)
        if series.definition.kind != "time" or old is None or old.usual is None:
            continue
        young = old.usual[1] >= FEW_NIGHTS_FLOOR
        usual[key] = of_two(_time(old), known_noise(series)[old.night.run.id] if young else old.usual)
        if new is not None:
            values[key] = (_time(old), _time(new))
            if new.state == "suspected":
                suspected.append(key)
    return Known(usual=usual, values=values, suspected=tuple(suspected), first_bad=first_bad, blame=blamed)


def _lies_after(series: Told, night: Point, before: Judged | None) -> bool:
    """Whether a night comes later in the history than the earlier run; yes where that did not measure it."""
    if before is None:
        return True
    nights = series.nights
    runs = nights.points.runs if isinstance(nights, Nights) else (judged.night.run for judged in nights)
    for run in runs:
        if run.id == before.night.run.id:
            return True
        if run.id == night.run.id:
            return False
    return True


def known_noise(series: Told) -> dict[str, Usual]:
    """What is usual after each night, by its run; the nights too young to tell noise have what the next that could tells.

    Of the newest night's noise no other night of its lane knows yet.
    """
    found: dict[str, Usual] = {}
    later: dict[
        Hashable, float
    ] = {}  # by lane: the noise that the next night tells; infinite behind the newest
    for judged in reversed(series.nights):
        lane, usual = on_one_clock(judged.night), judged.usual
        if usual is not None:
            level, threshold = usual
            young = threshold >= FEW_NIGHTS_FLOOR
            found[judged.night.run.id] = (
                (level, min(threshold, later.get(lane, math.inf))) if young else usual
            )
            if not young and lane in later:
                later[lane] = threshold
        later.setdefault(lane, math.inf)
    return found


def of_two(value: float, usual: Usual) -> Usual:
    """One night's time with the noise of a difference: of two nights, where a threshold is of one against a level."""
    return (value, math.sqrt(2.0) * usual[1])


def _time(judged: Judged) -> float:
    return judged.night.value if judged.time is None else judged.time
