"""One model in several engines: how far they are apart at growing times, and which of them stand together.

Each engine runs the file as its users do, at the file's own time step and at half of it; twice of what that changes is
the engine's own error, as it is of a first order. Two engines stand together where they are no further apart than both of their errors.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from spook_tracker.engine.errors import EngineError
from spook_tracker.engine.find import find
from spook_tracker.engine.model_file import ModelFile, ModelRun
from spook_tracker.engine.result import Result
from spook_tracker.scalar_tests.model_file.facts import CHECKPOINTS, apart

LEAST = 1e-9  # of the size: errors below it are rounding
LIMIT = 60.0  # s, of one run


@dataclass(frozen=True, slots=True)
class Checkpoint:
    """Where the engines are at one time."""

    time: float  # s
    error: Mapping[str, float]  # m, of each engine's step; infinite where its half step broke off
    distance: Mapping[tuple[str, str], float]  # m, of every two
    groups: tuple[tuple[str, ...], ...]  # that stand together, the largest first


@dataclass(frozen=True, slots=True)
class Standing:
    """All engines on one model; `refused` says of an engine why it takes no part, or where it broke off."""

    size: float  # m, the largest that an engine says
    checkpoints: tuple[Checkpoint, ...]
    refused: Mapping[str, str]


def standing(model: ModelFile, engines: Sequence[str], duration: float = CHECKPOINTS[-1]) -> Standing:
    """Ask every engine. One that cannot be asked, or fails, is told with its sentence; the others are compared."""
    times = tuple(t for t in CHECKPOINTS if t <= duration)
    runs: dict[str, tuple[Result, Result]] = {}
    refused: dict[str, str] = {}
    for engine in engines:
        try:
            whole, half = (_ran(model, engine, model.time_step / parts, times) for parts in (1, 2))
        except EngineError as error:
            refused[engine] = str(error)
            continue
        runs[engine] = (whole, half)
        if whole.failure:
            refused[engine] = whole.failure
    size = max((float(whole.partial["size"]) for whole, _ in runs.values()), default=0.0)
    found = (_checkpoint(place, time, runs, size) for place, time in enumerate(times))
    return Standing(size, tuple(one for one in found if one.error), refused)


def _ran(model: ModelFile, engine: str, step: float, times: tuple[float, ...]) -> Result:
    asked = ModelRun(model=model, samples=times, elsewhere=True)  # some engines die of some files
    done: Result = find(engine).simulate(asked, time_step=step, duration=times[-1], time_limit=LIMIT)
    return done


def _checkpoint(
    place: int, time: float, runs: Mapping[str, tuple[Result, Result]], size: float
) -> Checkpoint:
    reached = [engine for engine, (whole, _) in runs.items() if len(whole.partial["position"]) > place]
    error = {engine: 2.0 * _at(place, *runs[engine], size) for engine in reached}
    distance = {
        (one, other): _at(place, runs[one][0], runs[other][0], size)
        for k, one in enumerate(reached)
        for other in reached[k + 1 :]
    }
    together = {
        pair for pair, far in distance.items() if far <= error[pair[0]] + error[pair[1]] + LEAST * size
    }
    return Checkpoint(time, error, distance, _groups(reached, together))


def _at(place: int, one: Result, other: Result, size: float) -> float:
    found = apart(one, other, size)
    return float(found[place]) if place < len(found) else float(np.inf)


def _groups(engines: Sequence[str], together: set[tuple[str, str]]) -> tuple[tuple[str, ...], ...]:
    """Engines in groups of which all stand with all, each in the first that takes it."""
    groups: list[list[str]] = []
    for engine in engines:
        for group in groups:
            if all((one, engine) in together or (engine, one) in together for one in group):
                group.append(engine)
                break
        else:
            groups.append([engine])
    return tuple(tuple(group) for group in sorted(groups, key=lambda group: -len(group)))
