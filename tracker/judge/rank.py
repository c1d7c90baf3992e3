"""Engines beside each other on the same questions: nothing is red, one is ahead.

Read from the ladders: an engine's error at h = 1/60 and the run time it needs for a given error, each in the
configuration that does it best. Run times are the processor's where the engine tells them: what else a machine does while
one engine is timed is no merit of another. Those of different machines are not set against each other.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from spook_tracker.tracker.document.order import time_at_error
from spook_tracker.tracker.document.run_document import Sample, SeriesDefinition

from .standing import against_limit
from .vocabulary import Class

ERRORS = (1e-2, 1e-4, 1e-6)
STEP = 1.0 / 60.0  # s
TIE = 1e-12  # in the unit of a scene, whose quantities are about one in size: errors closer than this are rounding
Samples = Mapping[str, tuple[SeriesDefinition, Sample]]
Rungs = list[tuple[SeriesDefinition, Sample]]


@dataclass(frozen=True, kw_only=True)
class Standing:
    """One engine on one scene. A `configuration` of "" means that none gave a value."""

    test: str
    ladder: str
    unit: str
    engine: str
    error: float | None  # magnitude at h = 1/60, the best configuration
    configuration: str
    seconds: tuple[float | None, ...]  # to reach each of ERRORS, the best configuration
    settings: tuple[str, ...] = ()  # which configuration that is, for each of ERRORS
    outcome: str  # "value", what became of the rung at h = 1/60 in every configuration, or that there is none


@dataclass(frozen=True, kw_only=True)
class Lead:
    """Which reaches an error sooner, and by what factor; where only one reaches it, the factor is infinite."""

    test: str
    ladder: str
    error: float
    unit: str
    ahead: str
    factor: float


@dataclass(frozen=True, kw_only=True)
class Race:
    """One error on one scene: which engines come within it, soonest first; one that never does is missing."""

    test: str
    ladder: str
    unit: str
    error: float
    order: tuple[tuple[float, str], ...]  # run time [s] and engine, at least one
    settings: tuple[str, ...] = ()  # the configuration of each in `order`

    def behind(self, engine: str) -> tuple[str, float, float | None] | None:
        """Which is first, in what time, and the time of this engine (None: never); None if none is sooner."""
        best, first = self.order[0]
        mine = {name: time for time, name in self.order}.get(engine)
        return None if mine is not None and mine <= best else (first, best, mine)


@dataclass(frozen=True, kw_only=True)
class Answer:
    """What one engine says to the question of a gate, in the configuration that it names first."""

    engine: str
    definition: SeriesDefinition | None  # None: it was not asked
    sample: Sample | None
    stands: Class  # for the limit alone


# test, kind, metric, time step and parameters
Question = tuple[str, str, str, float | None, tuple[tuple[str, float], ...]]


def question(definition: SeriesDefinition) -> Question:
    """What makes two series of different engines the same question: all but the configuration."""
    parameters = tuple(sorted(definition.parameters.items()))
    return definition.test, definition.kind, definition.metric, definition.time_step, parameters


def answers(
    gates: Sequence[SeriesDefinition], engines: Mapping[str, Samples]
) -> list[tuple[SeriesDefinition, list[Answer]]]:
    """Every gate with what each engine says to it."""
    first: dict[str, dict[Question, tuple[SeriesDefinition, Sample]]] = {}
    for name, samples in engines.items():
        asked = first.setdefault(name, {})
        for definition, sample in samples.values():
            asked.setdefault(question(definition), (definition, sample))
    return [(gate, [_answer(gate, name, asked) for name, asked in first.items()]) for gate in gates]


def _answer(
    gate: SeriesDefinition, engine: str, asked: Mapping[Question, tuple[SeriesDefinition, Sample]]
) -> Answer:
    definition, sample = asked.get(question(gate), (None, None))
    if definition is None or sample is None:
        return Answer(engine=engine, definition=None, sample=None, stands="none")
    return Answer(
        engine=engine, definition=definition, sample=sample, stands=against_limit(definition, sample)
    )


def standings(engines: Mapping[str, Samples]) -> list[Standing]:
    """Every engine on every ladder that at least one of them was asked, scene by scene."""
    groups = {name: ladders(samples) for name, samples in engines.items()}
    places = dict.fromkeys(place for found in groups.values() for place in found)
    return [
        _standing(place, name, found.get(place, {})) for place in places for name, found in groups.items()
    ]


def scenes(found: Sequence[Standing]) -> list[list[Standing]]:
    """The standings of each scene that at least two engines were asked."""
    groups: dict[tuple[str, str, str], list[Standing]] = {}
    for one in found:
        groups.setdefault((one.test, one.ladder, one.unit), []).append(one)
    return [group for group in groups.values() if sum(one.outcome != "not asked" for one in group) > 1]


def races(found: Sequence[Standing]) -> list[Race]:
    """Every scene with every error that an engine reaches."""
    run = []
    for group in scenes(found):
        for place, error in enumerate(ERRORS):
            order = sorted(
                (t, one.engine, one.settings[place] if one.settings else "")
                for one in group
                if (t := one.seconds[place]) is not None
            )
            if order:
                first = group[0]
                run.append(
                    Race(
                        test=first.test,
                        ladder=first.ladder,
                        unit=first.unit,
                        error=error,
                        order=tuple((t, engine) for t, engine, _ in order),
                        settings=tuple(setting for _, _, setting in order),
                    )
                )
    return run


def leads(found: Sequence[Standing], before: str, after: str) -> list[Lead]:
    """Two engines at equal error: scene by scene, which is ahead and by what factor."""
    by_place: dict[tuple[str, str], dict[str, Standing]] = {}
    for one in found:
        by_place.setdefault((one.test, one.ladder), {})[one.engine] = one
    told: list[Lead] = []
    for (test, ladder), pair in by_place.items():
        if before not in pair or after not in pair:
            continue
        for error, first, second in zip(ERRORS, pair[before].seconds, pair[after].seconds, strict=True):
            if first is None and second is None:
                continue
            unit = pair[before].unit
            mine, theirs = (math.inf if t is None else t for t in (first, second))
            ahead, factor = (before, theirs / mine) if mine <= theirs else (after, mine / theirs)
            told.append(Lead(test=test, ladder=ladder, error=error, unit=unit, ahead=ahead, factor=factor))
    return told


def ladders(samples: Samples) -> dict[tuple[str, str, str], dict[str, Rungs]]:
    """The rungs of an engine: (test, ladder, unit) -> configuration -> rungs."""
    found: dict[tuple[str, str, str], dict[str, Rungs]] = {}
    for definition, sample in samples.values():
        if definition.kind == "ladder" and definition.time_step is not None:
            place = (definition.test, definition.metric.split(":")[1], definition.unit)
            found.setdefault(place, {}).setdefault(definition.configuration, []).append((definition, sample))
    return found


def _standing(place: tuple[str, str, str], engine: str, configurations: Mapping[str, Rungs]) -> Standing:
    test, ladder, unit = place
    best, chosen, outcomes = math.inf, "", []
    for name, rungs in configurations.items():
        for definition, sample in rungs:
            assert definition.time_step is not None
            if not math.isclose(definition.time_step, STEP, rel_tol=1e-9):
                continue
            outcomes.append(sample.outcome)
            if sample.outcome == "value" and abs(sample.value) < best:
                best, chosen = abs(sample.value), name
    times = [soonest(configurations, error) for error in ERRORS]
    none = "not run at this time step" if configurations else "not asked"
    outcome = "value" if chosen else (outcomes[0] if outcomes else none)
    return Standing(
        test=test,
        ladder=ladder,
        unit=unit,
        engine=engine,
        error=best if chosen else None,
        configuration=chosen,
        seconds=tuple(seconds for seconds, _ in times),
        settings=tuple(name for _, name in times),
        outcome=outcome,
    )


def soonest(configurations: Mapping[str, Rungs], error: float) -> tuple[float | None, str]:
    """Least run time at which some configuration reaches the error, and which that is."""
    times: list[tuple[float, str]] = []
    for name, rungs in configurations.items():
        timed = [
            (min(sample.timing.cpu_seconds or sample.timing.seconds), abs(sample.value))
            for _, sample in rungs
            if sample.outcome == "value" and sample.timing is not None and sample.timing.seconds
        ]
        reached = time_at_error([t for t, _ in timed], [e for _, e in timed], error)
        if reached is not None and math.isfinite(reached):
            times.append((reached, name))
    return min(times, default=(None, ""))
