"""One model in several engines: how far they are apart at growing times, which of them stand together, and how it ends in each.

Each engine runs the file as its users do, at the file's own time step and at half of it. Three times what that changes, at
this time or the one before, counts as the engine's own error: twice, as it is of a first order, and half as much for what is
not yet; an error that changes its sign passes through zero. Two engines stand together where they are no further apart than both of their errors.

Where two that can leave parts of a model out stand apart, those parts are named without which they do not: both are asked
again without contacts, without limits, and so on, up to the first time at which they part.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np

from spook_tracker.engine.errors import EngineError
from spook_tracker.engine.find import find
from spook_tracker.engine.model_file import PARTS, ModelFile, ModelRun
from spook_tracker.engine.result import Result
from spook_tracker.scalar_tests.model_file.facts import CHECKPOINTS, LONGEST_REST, apart

ERROR = 3.0  # times what halving the step changes
SPLIT = ("mujoco", "spook")  # engines that can leave parts of a model out
GONE = 0.1  # of a distance: what is left of it without the parts that make it
SOFT = {"contacts", "limits", "ties"}  # parts that give way in MuJoCo
AT_ONCE = 1e-6  # s
FINER = 32  # parts of the file's step, where they are asked as if they did not
LEAST = 1e-9  # of the size: errors below it are rounding
LIMIT = 60.0  # s, of one run
FALLS = 0.25  # of the size: what ends lower by more has fallen
ALIKE = 0.01  # of the size: no further apart two rest alike


@dataclass(frozen=True, slots=True)
class Checkpoint:
    """Where the engines are at one time."""

    time: float  # s
    error: Mapping[str, float]  # m, of each engine's step; infinite where its half step broke off
    distance: Mapping[tuple[str, str], float]  # m, of every two, in the order they were asked in
    size: float  # m
    groups: tuple[tuple[str, ...], ...] = ()  # that stand together, the largest first

    def apart(self, one: str, other: str) -> float:
        """How far [m] two engines are apart; infinite where one is not there."""
        return self.distance.get((one, other), self.distance.get((other, one), np.inf))

    def beyond(self, one: str, other: str) -> float:
        """How much further [m] than both of their errors."""
        both = self.error.get(one, 0.0) + self.error.get(other, 0.0)
        return self.apart(one, other) - both - LEAST * self.size

    def together(self, one: str, other: str) -> bool:
        """Whether they are no further apart than that."""
        return self.beyond(one, other) <= 0.0

    def blurred(self, one: str, other: str) -> bool:
        """Whether their errors are too large to tell: a tenth of the size, or without end."""
        return not self.error.get(one, 0.0) + self.error.get(other, 0.0) < 0.1 * self.size


@dataclass(frozen=True, slots=True)
class Cause:
    """Why two engines part: without `parts` of the model they stand together at that time, or `left` of the distance is small.

    `parts` is empty where no parts explain it. `rigid` is how far they are then apart where what gives way in MuJoCo does not,
    does not rebound, and begins within its limits, both in small steps; None where no such part is among them, or one breaks
    off. What begins `beyond` its limits, or with an `overlap`, each engine brings back in its own way.
    """

    engines: tuple[str, str]
    time: float  # s, the first checkpoint at which they stand apart
    apart: float  # m, there
    parts: tuple[str, ...]
    left: float  # m
    rigid: float | None = None  # m
    beyond: float = 0.0  # m or rad
    overlap: float = 0.0  # m


@dataclass(frozen=True, slots=True)
class Ending:
    """How a model ends in one engine, without controls: at rest, or after ten seconds."""

    settled: float  # s, since when it rests; NaN where it moves
    sunk: float  # m, by which the watched body that sinks most is lower than at the start

    @property
    def rests(self) -> bool:
        """Whether it has come to rest."""
        return bool(np.isfinite(self.settled))


@dataclass(frozen=True, slots=True)
class Standing:
    """All engines on one model; `refused` says of an engine why it takes no part, or where it broke off."""

    size: float  # m, the largest that an engine says
    checkpoints: tuple[Checkpoint, ...]
    refused: Mapping[str, str]
    cause: Cause | None = None
    ends: Mapping[str, Ending] = field(default_factory=dict)
    at_rest: Mapping[tuple[str, str], float] = field(
        default_factory=dict
    )  # m, between engines in which it rests

    def falls(self, engine: str) -> bool:
        """Whether it ends lower than it begins."""
        return self.ends[engine].sunk > FALLS * self.size

    def rest_apart(self, one: str, other: str) -> float:
        """How far [m] it rests in one engine from where it does in the other."""
        return self.at_rest.get((one, other), self.at_rest.get((other, one), np.inf))

    def rests_alike(self, one: str, other: str) -> bool:
        """Whether it rests in both, and no further apart than a hundredth of the size."""
        return self.rest_apart(one, other) <= ALIKE * self.size


def standing(model: ModelFile, engines: Sequence[str], duration: float = CHECKPOINTS[-1]) -> Standing:
    """Ask every engine. One that cannot be asked, or fails, is told with its sentence; the others are compared."""
    times = tuple(t for t in CHECKPOINTS if t <= duration)
    runs: dict[str, tuple[Result, Result]] = {}
    refused: dict[str, str] = {}
    for engine in engines:
        try:
            # some engines die of some files
            whole, half = (
                _ran(model, engine, model.time_step / parts, times, elsewhere=True, rests=parts == 1)
                for parts in (1, 2)
            )
        except EngineError as error:
            refused[engine] = str(error)
            continue
        runs[engine] = (whole, half)
        if whole.failure:
            refused[engine] = whole.failure
    size = max((float(whole.partial["size"]) for whole, _ in runs.values()), default=0.0)
    found = _checkpoints(times, runs, size)
    cause = None
    both = (one for one in found if all(engine in one.error for engine in SPLIT))
    if parted := next((one for one in both if not one.together(*SPLIT)), None):
        cause = _cause(model, tuple(t for t in times if t <= parted.time), parted.apart(*SPLIT), size)
    ended = {engine: whole for engine, (whole, _) in runs.items() if not whole.failure}
    ends = {engine: _ending(model, whole) for engine, whole in ended.items()}
    resting = [engine for engine, end in ends.items() if end.rests]
    at_rest = {pair: _rest_apart(ended[pair[0]], ended[pair[1]], size) for pair in combinations(resting, 2)}
    return Standing(size, found, refused, cause, ends, at_rest)


def _ending(model: ModelFile, run: Result) -> Ending:
    gravity = np.asarray(model.gravity)
    down = gravity / max(float(np.linalg.norm(gravity)), 1e-300)
    final = np.array([run.final_state[body.label][:3] for body in model.watched])
    return Ending(float(run["settled"]), float(np.max((final - run["position"][0]) @ down)))


def _rest_apart(one: Result, other: Result, size: float) -> float:
    """As far as `apart`, where they end."""

    def last(run: Result) -> Result:
        states = np.array(list(run.final_state.values()))
        return replace(
            run, observables={"position": states[None, :, :3], "orientation": states[None, :, 3:7]}
        )

    return float(apart(last(one), last(other), size)[0])


def _ran(
    model: ModelFile,
    engine: str,
    step: float,
    times: tuple[float, ...],
    without: tuple[str, ...] = (),
    rigid: bool = False,
    elsewhere: bool = False,
    rests: bool = False,
) -> Result:
    """From the start, which is the first sample; on until all `rests`."""
    run = ModelRun(
        model=model,
        samples=(0.0, *times),
        until_settled=rests,
        without=frozenset(without),
        rigid=rigid,
        elsewhere=elsewhere,
    )
    lasts = max(times[-1], LONGEST_REST) if rests else times[-1]
    done: Result = find(engine).simulate(run, time_step=step, duration=lasts, time_limit=LIMIT)
    return done


def _cause(model: ModelFile, times: tuple[float, ...], apart_now: float, size: float) -> Cause:
    """All parts are left out; those that can come back one by one without the engines parting are not the cause."""

    def without(parts: tuple[str, ...]) -> Checkpoint | None:
        """Where the engines are then, if that is together or nearly so; None also where one breaks off."""
        try:
            runs = {
                engine: (
                    _ran(model, engine, model.time_step, times, parts),
                    _ran(model, engine, model.time_step / 2, times, parts),
                )
                for engine in SPLIT
            }
        except EngineError:
            return None
        reached = _checkpoints(times, runs, size)
        if len(reached) < len(times) or not all(engine in reached[-1].error for engine in SPLIT):
            return None
        point = reached[-1]
        alike = point.together(*SPLIT) and not point.blurred(*SPLIT)
        return point if alike or point.apart(*SPLIT) < GONE * apart_now else None

    parts: tuple[str, ...] = PARTS
    point = without(parts)
    if point is None:
        return Cause(SPLIT, times[-1], apart_now, (), apart_now)
    for part in reversed(PARTS):
        rest = tuple(one for one in parts if one != part)
        if alike := without(rest):
            parts, point = rest, alike
    left = point.apart(*SPLIT)
    if not SOFT.intersection(parts):
        return Cause(SPLIT, times[-1], apart_now, parts, left)
    begun = _ran(model, SPLIT[0], AT_ONCE, (AT_ONCE,))
    beyond, overlap = (float(np.ravel(begun[name])[0]) for name in ("violation", "overlap"))
    try:
        hard, ours = (_ran(model, engine, model.time_step / FINER, times, rigid=True) for engine in SPLIT)
        rigid = _at(len(times), hard, ours, size)
    except EngineError:  # ties that do not hold within the limits
        rigid = np.inf
    return Cause(
        SPLIT, times[-1], apart_now, parts, left, rigid if np.isfinite(rigid) else None, beyond, overlap
    )


def _checkpoints(
    times: Sequence[float], runs: Mapping[str, tuple[Result, Result]], size: float
) -> tuple[Checkpoint, ...]:
    """Those that some engine has reached."""
    found: list[Checkpoint] = []
    before: dict[str, float] = {}  # at the time before
    for place, time in enumerate(times, start=1):
        reached = [engine for engine, (whole, _) in runs.items() if len(whole.partial["position"]) > place]
        if not reached:
            break
        now = {engine: ERROR * _at(place, *runs[engine], size) for engine in reached}
        distance = {
            pair: _at(place, runs[pair[0]][0], runs[pair[1]][0], size) for pair in combinations(reached, 2)
        }
        error = {engine: max(now[engine], before.get(engine, 0.0)) for engine in reached}
        before = now
        point = Checkpoint(time, error, distance, size)
        found.append(replace(point, groups=_groups(reached, point)))
    return tuple(found)


def _at(place: int, one: Result, other: Result, size: float) -> float:
    found = apart(one, other, size)
    return float(found[place]) if place < len(found) else float(np.inf)


def _groups(engines: Sequence[str], point: Checkpoint) -> tuple[tuple[str, ...], ...]:
    """Engines in groups of which all stand with all, each in the first that takes it."""
    groups: list[list[str]] = []
    for engine in engines:
        for group in groups:
            if all(point.together(one, engine) for one in group):
                group.append(engine)
                break
        else:
            groups.append([engine])
    return tuple(tuple(group) for group in sorted(groups, key=lambda group: -len(group)))
