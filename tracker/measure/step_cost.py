"""What a step of a test's example scene costs: with and without what it leaves out, against real time, at worst, in memory.

Everything that can be forced in is forced in one after the other and all at once, in rounds that visit every way before
the next round begins; ratios are taken within a round, so that a slow minute of the machine falls on both sides.
"""

from __future__ import annotations

import ctypes
import functools
import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import cast

import numpy as np

from spook_tracker.engine.method import STAGES_THAT_CAN_BE_FORCED
from spook_tracker.engine.observe import Final, Observable, Position, Velocity
from spook_tracker.engine.result import Result
from spook_tracker.engine.run import Run
from spook_tracker.scalar_tests.case import Better, Example, Measurement, Metric, ScalarTest, Simulate
from spook_tracker.scalar_tests.step_limits import REAL_TIME, SAVES
from spook_tracker.tracker.document.json_form import Number
from spook_tracker.tracker.document.run_document import Sample, Saving, SeriesDefinition

from .question import Outcome, Witness, ask, judged_sample, metric_series
from .timing import Prepare, stage_seconds

LIMIT = 60.0  # s of a run
ROUNDS = 5
SHORTEST = 4e-3  # s of a run: a clock and a call are a thousandth of it
FEWEST_STEPS = 20
MOST_RUNS = 16  # of a scene that lasts less than that
COMPARED = 20  # steps after which the answers of both ways are laid beside each other
WATCHED = 200  # steps that are looked at one by one
MEGABYTE = 1e6


@dataclass(frozen=True)
class LeavingOut:
    """What the whole step saves by leaving out what the scene does not need."""

    stages: tuple[str, ...] = ()  # left out, and can be forced in; none: the scene needs all that could be
    saved: Mapping[str, float] = field(default_factory=dict)  # s a step, of each stage alone
    times: tuple[float, ...] = ()  # of each round: the step with all of them over the step as compiled
    difference: float = math.nan  # of the answers after COMPARED steps, over the largest; 0: to the bit

    @property
    def factor(self) -> float:
        """Median of the rounds."""
        return float(np.median(self.times)) if self.times else math.nan

    def told(self) -> Saving:
        """As a run's document says it."""
        return Saving(
            stages=self.stages,
            factor=Number(self.factor) if self.times else None,
            spread=(min(self.times), max(self.times)) if self.times else None,
            difference=Number(self.difference) if self.times else None,
        )


OneRun = Callable[[Simulate], Result]


def leaving_out(test: ScalarTest, simulate: Simulate, prepare: Prepare | None = None) -> LeavingOut | None:
    """Of the test's example scene; None where it cannot be run. `prepare` is the engine's, where it compiles apart from running."""
    example = ask(test.example).value
    kept = _stages_of(example, (), simulate) if example is not None else ()
    if example is None or not kept:
        return None
    added = {
        option: stage
        for option, stage in STAGES_THAT_CAN_BE_FORCED.items()
        if stage not in kept and stage in _stages_of(example, (option,), simulate)
    }
    if not added:
        return LeavingOut()
    every = tuple(added)
    run = functools.partial(_run, example, simulate, prepare)
    steps, repeats = _length(example, run)
    ways: list[tuple[str, ...]] = [(), *((option,) for option in added), *([every] if len(every) > 1 else [])]
    runs = [(run(steps, way), run(1, way)) for way in ways]
    rounds = [[_taken(whole, first, repeats) for whole, first in runs] for _ in range(ROUNDS)]
    whole = [[one for one in taken if one is not None] for taken in rounds]
    if any(len(taken) < len(runs) for taken in whole):
        return None
    saved = {
        stage: max(0.0, float(np.median([taken[i] - taken[0] for taken in whole]))) / steps
        for i, stage in enumerate(added.values(), 1)
    }
    times = tuple(taken[-1] / taken[0] for taken in whole)
    return LeavingOut(tuple(added.values()), saved, times, _difference(example, every, simulate))


def _run(
    example: Example, simulate: Simulate, prepare: Prepare | None, steps: int, stages: tuple[str, ...]
) -> Callable[[], Result]:
    """The test's example scene with nothing observed and some stages forced in; compiled once, where that can be."""
    scene, step, method = example.scene, example.time_step, replace(example.method, force_stages=stages)
    if prepare is None:
        return lambda: simulate(
            scene, time_step=step, steps=steps, method=method, observe={}, time_limit=LIMIT
        )
    kept = ask(lambda: prepare(scene, time_step=step, steps=steps, method=method, observe={})).value
    return lambda: kept.run(time_limit=LIMIT)


def _length(example: Example, run: Callable[[int, tuple[str, ...]], Callable[[], Result]]) -> tuple[int, int]:
    """Steps of a run that is long enough for the clock, and how many runs are: a scene is over when its motion is, and what has died
    away is in denormal numbers, with which a step of oscillator_filter costs five times as much."""
    steps, more, last, taken = (
        FEWEST_STEPS,
        FEWEST_STEPS,
        round(example.duration / example.time_step),
        math.inf,
    )
    while more <= last:
        found = _once(run(more, ()))
        if found is None:  # a scene that ends, as a path does: no longer than it lasts
            break
        steps, more, taken = more, 2 * more, found
        if taken >= SHORTEST:
            break
    return steps, max(1, min(MOST_RUNS, math.ceil(SHORTEST / taken)))


def _taken(run: Callable[[], Result], first: Callable[[], Result], repeats: int) -> float | None:
    """Mean seconds of so many runs beyond those of their first step: a scene of steps of 15 ns that is over after a hundred is
    timed by the clock's own calls else. None if one failed."""
    each = [(_once(run), _once(first)) for _ in range(repeats)]
    done = [whole - one for whole, one in each if whole is not None and one is not None]
    return max(math.fsum(done) / repeats, 1e-12) if len(done) == repeats else None


def _once(run: Callable[[], Result]) -> float | None:
    """Seconds of the processor in the loop of one run, of the clock where the engine cannot tell; None if it failed."""
    result = ask(run).value
    if result is None or not result.completed:
        return None
    return float(result.cpu_seconds or result.seconds)


def _stages_of(example: Example, forced: tuple[str, ...], simulate: Simulate) -> tuple[str, ...]:
    """What a step of it goes through; nothing where it fails."""
    answer = ask(lambda: tuple(example_run(example, 1, forced)(simulate).stages))
    return answer.value or ()


def _difference(example: Example, forced: tuple[str, ...], simulate: Simulate) -> float:
    """How far places and velocities of both ways are apart after a few steps, over the largest of them."""
    observe = {"x": Final(quantity=Position()), "v": Final(quantity=Velocity())}

    def ends(stages: tuple[str, ...]) -> list[np.ndarray]:
        result = example_run(example, COMPARED, stages, observe)(simulate)
        return [np.asarray(result[name]) for name in observe]

    answer = ask(lambda: list(zip(ends(()), ends(forced), strict=True)))
    pairs: list[tuple[np.ndarray, np.ndarray]] = answer.value or []
    return max(
        (
            float(np.abs(a - b).max(initial=0.0)) / max(float(np.abs(a).max(initial=0.0)), 1e-300)
            for a, b in pairs
        ),
        default=math.nan,
    )


@dataclass(frozen=True)
class StepCost:
    """Seconds per step, all of one run: of each stage with a clock of its own, and of the whole step."""

    stages: Mapping[str, float]
    whole: float

    @property
    def beside(self) -> float:
        """Between the stages: keeping a state to go back to, checks of it, the clock itself."""
        return self.whole - sum(self.stages.values())


def step_cost(test: ScalarTest, simulate: Simulate) -> StepCost | None:
    """Of the test's example scene with nothing observed, stages timed; the fastest of a few runs. None if it fails, or
    the engine has no such clock."""
    example = test.example()
    steps = max(1, min(2000, round(1.0 / example.time_step)))
    run = example_run(example, steps, ())
    costs = [stage_seconds(run, simulate) for _ in range(ROUNDS)]
    told = [
        StepCost({stage: seconds / steps for stage, seconds in stages.items()}, whole / steps)
        for stages, whole in costs
        if stages
    ]
    return min(told, key=lambda cost: cost.whole, default=None)


def example_run(
    example: Example, steps: int, stages: tuple[str, ...], observe: Mapping[str, Observable] | None = None
) -> OneRun:
    """The test's example scene with nothing else observed and some stages forced in."""
    method = replace(example.method, force_stages=stages)
    return lambda simulate: simulate(
        example.scene, time_step=example.time_step, steps=steps, method=method, observe=observe or {}
    )


# --- against real time, at worst, in memory -------------------------------------------------------------------


def held(example: Example, start: Callable[..., Run]) -> Mapping[str, float]:
    """A second of the scene, held and stepped one by one three times: each step's time is its least of the three."""
    steps = max(1, min(WATCHED, round(1.0 / example.time_step)))
    least = [math.inf] * steps
    before, most = allocated(), 0.0
    for _ in range(3):
        run = start(example.scene, time_step=example.time_step, method=example.method)
        for step in range(steps):
            begun = time.perf_counter()
            run.step()
            least[step] = min(least[step], time.perf_counter() - begun)
        if before is not None:
            most = max(most, (allocated() or 0.0) - before)
        del run
    found = {"real_time_factor": steps * example.time_step / math.fsum(least), "worst_step_time": max(least)}
    return found if before is None else {**found, "memory": most / MEGABYTE}


class _Account(ctypes.Structure):
    """What glibc's mallinfo2 tells, in bytes."""

    _fields_ = [
        (name, ctypes.c_size_t)
        for name in (
            "arena",
            "ordblks",
            "smblks",
            "hblks",
            "hblkhd",
            "usmblks",
            "fsmblks",
            "uordblks",
            "fordblks",
            "keepcost",
        )
    ]


@functools.cache
def _of_allocator() -> Callable[[], _Account] | None:
    """glibc's account of what is allocated; other libraries give none."""
    account = getattr(ctypes.CDLL(None), "mallinfo2", None)
    if account is None:
        return None
    account.restype = _Account
    return cast("Callable[[], _Account]", account)


def allocated() -> float | None:
    """Bytes in use of the C allocator in this process."""
    account = _of_allocator()
    if account is None:
        return None
    now = account()
    return float(now.uordblks + now.hblkhd)


# --- as series ------------------------------------------------------------------------------------------------


def _metric(
    name: str,
    description: str,
    unit: str,
    growth: float,
    better: Better,
    least: float | None = None,
    why: str = "",
) -> Metric:
    return Metric(
        name=name,
        description=description,
        unit=unit,
        role="reported" if least is None else "companion",
        better=better,
        limit=least,
        limit_source=why,
        noisy=True,
        relative_tolerance=growth,  # what other work on the machine may add: no news
    )


def metrics(name: str) -> tuple[Metric, ...]:
    """What is followed of the example scene of a test."""
    return (
        _metric(
            "leaving_out",
            "the step with everything forced in that can be, over the step as compiled",
            "1",
            0.3,
            "larger",
            SAVES.get(name),
            "a choice: a third of what leaving out saved when it was first measured; below it a stage runs that is not needed",
        ),
        _metric(
            "real_time_factor",
            "simulated time over the time it takes, step by step",
            "1",
            0.3,
            "larger",
            REAL_TIME.get(name),
            "real time: one that is watched or held must keep up with the world",
        ),
        _metric(
            "worst_step_time",
            "the longest step of a second of the scene, least of three",
            "s",
            1.0,
            "smaller",
        ),
        _metric("memory", "allocated for a run that is held", "MB", 0.5, "smaller"),
    )


Pair = tuple[SeriesDefinition, Sample]


def step_costs(
    name: str,
    test: ScalarTest,
    simulate: Simulate,
    start: Callable[..., Run] | None,
    prepare: Prepare | None = None,
) -> tuple[list[Pair], LeavingOut | None]:
    """The series of a test's example scene, and what leaving out saves it."""
    found = leaving_out(test, simulate, prepare)
    values: dict[str, float] = {} if found is None or not found.times else {"leaving_out": found.factor}
    example = ask(test.example).value
    if start is not None and example is not None:
        values |= ask(lambda: held(example, start)).value or {}
    if example is None:
        return [], found
    return list(_pairs(name, test, example, values, simulate)), found


def _pairs(
    name: str, test: ScalarTest, example: Example, values: Mapping[str, float], simulate: Simulate
) -> Iterator[Pair]:
    asked: Sequence[Metric] = metrics(name)
    where = Measurement(
        configuration="example",
        time_step=example.time_step,
        metrics=tuple(asked),
        measure=cast("Callable[[Simulate], Mapping[str, float]]", test.example),
    )
    for metric in asked:
        if metric.name in values:
            series = metric_series(name, test, where, metric)
            outcome = Outcome(values[metric.name], "value", "")
            yield series, judged_sample(series.key, metric, outcome, Witness(simulate))
