"""Take run times so that they can be compared: nothing recorded, alone, interleaved, short runs repeated.

Every repeat visits all runs once before the next repeat begins, so that a slow minute of the machine falls on
all of them alike. The minimum is the estimate; every repeat is kept, because the spread says what a
difference means. Beside each stands the processor time, which leaves out what the machine spent elsewhere, and
what the calibration kernel took just before or just after it, whichever is less.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

from spook_tracker.engine.result import Result
from spook_tracker.scalar_tests.case import Simulate
from spook_tracker.tracker.document.run_document import Timing

from .calibration import calibrate
from .instructions import InstructionCounter, can_count
from .question import Outcome, ask, sentence

if TYPE_CHECKING:
    from spook_tracker.engine.scene import Scene

RESOLVED = 1e-3  # s that one repeat should last, far above the clock's grain
COLD_UP_TO = 2e-3  # s: after the kernel a shorter run finds cold caches, so that each repeat has a second one
MOST_RUNS = 200  # in one repeat
POINT_BUDGET = 0.06  # s for all repeats of one run: what takes longer is steadier, too
FEWEST_REPEATS = 2
STAGES_UP_TO = 0.2  # s of a run whose stages are timed
COUNTS_FROM = 5e-3  # s: of longer runs the first counts as a repeat
BESIDE = 2e-3  # s: so long the machine is what the calibration kernel has found it to be

Timed = Callable[["Stopwatch"], object]
Prepare = Callable[..., Any]  # as `engine.prepare`: compiles, and what it gives runs again and again
Taken = tuple[float, float | None]  # s of one run, and s of the processor where the engine can tell


class Repeats(NamedTuple):
    """How often a run is timed: so often where all that takes no more than `seconds`, and so often at least."""

    most: int = 5
    seconds: float = POINT_BUDGET
    fewest: int = FEWEST_REPEATS
    stages_up_to: float = STAGES_UP_TO  # s
    counts_from: float = COUNTS_FROM  # s
    runs: int = MOST_RUNS  # in one repeat, where each costs a model that is built anew


@dataclass
class Stopwatch:
    """Stands between a run and the engine and adds up the time of the native loops."""

    simulate: Simulate
    options: Mapping[str, Any] = field(default_factory=dict)
    seconds: float = 0.0
    cpu: float | None = 0.0  # s of the processor; None once a run could not tell
    results: list[Result] = field(default_factory=list)
    counter: InstructionCounter | None = None
    prepare: Prepare | None = None  # where programs are to be kept
    programs: list[Callable[[], Result]] = field(default_factory=list)  # one for each simulation, in order

    def __call__(self, scene: Scene, **options: Any) -> Result:
        if self.prepare is not None:
            asked = {**options, **self.options}
            how = {name: asked.pop(name) for name in ("time_limit", "time_stages") if name in asked}
            run = self.prepare(scene, **asked).run
            self.programs.append(partial(run, **{name: how[name] for name in how if name in options}))
            return self.take(run(**how))
        if self.counter is None:
            result = self.simulate(scene, **{**options, **self.options})
        else:
            with self.counter.counting():
                result = self.simulate(scene, **{**options, **self.options})
        return self.take(result)

    def take(self, result: Result) -> Result:
        """Add what a simulation took."""
        self.seconds += result.seconds
        own = getattr(result, "cpu_seconds", 0.0)
        self.cpu = self.cpu + own if self.cpu is not None and own > 0.0 else None
        self.results[:] = [result]
        return result


@dataclass
class _Lane:
    """One run on its way through the repeats."""

    run: Timed
    runs: int
    repeats: int
    programs: Sequence[Callable[[], Result]] = ()  # what the run asks of the engine, compiled once
    stage_seconds: dict[str, float] = field(default_factory=dict)  # of the run that warmed the caches
    seconds: list[float] = field(default_factory=list)
    cpu: list[float] = field(default_factory=list)
    kernel: list[float] = field(default_factory=list)
    failed: Outcome | None = None  # the first failure; nothing is timed after it

    def keep(self, kernel: float, taken: Sequence[Taken | Outcome]) -> None:
        """Add a repeat, of at least one run; one that failed in it is what came of the whole."""
        whole = [both for both in taken if not isinstance(both, Outcome)]
        self.failed = next((both for both in taken if isinstance(both, Outcome)), None)
        if self.failed is None:
            self.kernel.append(kernel)
            self.seconds.append(_undisturbed([seconds for seconds, _ in whole]))
            own = [cpu for _, cpu in whole if cpu is not None]
            self.cpu += [_undisturbed(own)] if len(own) == len(whole) else []


@dataclass
class _Kernel:
    """The calibration kernel, taken between repeats: interference only ever makes it slower."""

    seconds: float = math.nan
    taken: float = -math.inf  # when
    beside: list[tuple[_Lane, int]] = field(default_factory=list)  # repeats since then

    def now(self) -> float:
        """What it takes, or took a moment ago; repeats that it comes after have it, too, where it is less."""
        if time.perf_counter() - self.taken >= BESIDE:
            self.seconds = calibrate()
            self.taken = time.perf_counter()
            for lane, repeat in self.beside:
                lane.kernel[repeat] = min(lane.kernel[repeat], self.seconds)
            self.beside.clear()
        return self.seconds

    def keep(self, lane: _Lane, kernel: float, taken: Sequence[Taken | Outcome]) -> None:
        """A repeat of a lane."""
        lane.keep(kernel, taken)
        if lane.failed is None:
            self.beside.append((lane, len(lane.kernel) - 1))


def once(run: Timed, simulate: Simulate, time_limit: float | None = None) -> float | None:
    """Seconds of one run, None if it failed."""
    taken = _both(run, simulate, time_limit)
    return None if isinstance(taken, Outcome) else taken[0]


def _both(run: Timed, simulate: Simulate, time_limit: float | None = None) -> Taken | Outcome:
    """Seconds of one run, and of the processor for it where the engine can tell; else what came of it."""
    return _taken(run, Stopwatch(simulate, {} if time_limit is None else {"time_limit": time_limit}))


def _taken(run: Timed, watch: Stopwatch) -> Taken | Outcome:
    before = time.perf_counter()
    answer = ask(partial(run, watch))
    if answer.outcome != "value":
        return answer
    for result in watch.results:
        if result.status != "completed":
            return Outcome(None, result.status, sentence(result.failure))
    if not watch.results:
        return time.perf_counter() - before, None
    return watch.seconds, watch.cpu


def _again(programs: Sequence[Callable[[], Result]]) -> Timed:
    """A run that only runs again what was compiled for it."""

    def run(watch: Stopwatch) -> None:
        for program in programs:
            watch.take(program())

    return run


def interleaved(
    runs: Sequence[Timed],
    simulate: Simulate,
    repeats: int | Repeats,
    begin: Callable[[int], None] = lambda number: None,
    prepare: Prepare | None = None,
    expected: Sequence[float] = (),
    staged: Collection[int] = (),
) -> list[Timing | Outcome]:
    """A timing of each run, for those that fail what came of them; instructions and stages where they can be had.

    `begin` is told the number of the run whose turn it is. The first run of each warms the caches, tells how often
    it can be repeated, and has the clock of stages on. One that is `expected` to take long [s] goes without that clock,
    unless it is among the numbers `staged`: if it does, it has no cold caches to speak of and counts as the first
    repeat. With `prepare` its scenes are compiled there, and only run from then on.
    """
    often = Repeats(repeats) if isinstance(repeats, int) else repeats
    lanes: list[_Lane] = []
    beside = _Kernel()
    clock = True  # until a run comes without one: an engine has it for all its stages or for none
    for number, run in enumerate(runs):
        begin(number)
        known = number < len(expected)
        long = expected[number] if known else 0.0
        clocked = clock and long <= (often.stages_up_to if number in staged else often.counts_from)
        counts = long > often.counts_from and not clocked
        kernel = math.nan if known and clocked else beside.now()
        watch = Stopwatch(simulate, {"time_stages": True} if clocked else {}, prepare=prepare)
        first = _taken(run, watch)
        if isinstance(first, Outcome):
            lanes.append(_Lane(run=run, runs=0, repeats=0, failed=first))
            continue
        grain = max(first[0], 1e-9)
        affordable = int(often.seconds / max(first[1] or grain, RESOLVED))  # however busy the machine is
        fresh = _Lane(
            run=run,
            runs=min(often.runs, max(1 + (grain < COLD_UP_TO), math.ceil(RESOLVED / grain))),
            repeats=max(often.fewest, min(often.most, affordable)),
            programs=watch.programs,
            stage_seconds=_stages(watch) if clocked else {},
        )
        clock = clock and (not clocked or bool(fresh.stage_seconds))
        lanes.append(fresh)
        if not (fresh.stage_seconds or math.isnan(kernel)) and grain > (
            often.counts_from if counts else often.seconds
        ):
            beside.keep(fresh, kernel, [first])
    for _ in range(often.most):
        for number, lane in enumerate(lanes):
            if lane.failed is None and len(lane.kernel) < lane.repeats:
                begin(number)
                kernel = beside.now()
                again = _again(lane.programs) if lane.programs else lane.run
                beside.keep(lane, kernel, [_both(again, simulate) for _ in range(lane.runs)])
    timings: list[Timing | Outcome] = []
    for number, lane in enumerate(lanes):
        begin(number)
        timings.append(_timing(lane, simulate, often.stages_up_to) if lane.failed is None else lane.failed)
    return timings


def _undisturbed(seconds: Sequence[float]) -> float:
    """Mean of the faster half of the runs of one repeat: interference only ever makes a run slower."""
    faster = sorted(seconds)[: (len(seconds) + 1) // 2]
    return sum(faster) / len(faster)


def _timing(lane: _Lane, simulate: Simulate, bound: float) -> Timing:
    short = min(lane.seconds) <= bound
    return Timing(
        seconds=tuple(lane.seconds),
        runs_per_repeat=lane.runs,
        instructions=_instructions(lane.run, simulate) if short and can_count() else None,
        stage_seconds=lane.stage_seconds if short else {},
        cpu_seconds=tuple(lane.cpu) if len(lane.cpu) == len(lane.seconds) else (),
        calibration=tuple(lane.kernel),
    )


def _instructions(run: Timed, simulate: Simulate) -> int | None:
    """The fewest of two runs: what is not the engine's own work varies a little."""
    counts = []
    for _ in range(2):
        counter = InstructionCounter()
        ask(partial(run, Stopwatch(simulate, counter=counter)))
        counter.close()
        counts.append(counter.count)
    return min((count for count in counts if count), default=None)


def stage_seconds(run: Timed, simulate: Simulate) -> tuple[dict[str, float], float]:
    """Time by stage, and of the whole run that it was measured in; empty for an engine that has no such clock."""
    watch = Stopwatch(simulate, {"time_stages": True})
    answer = ask(partial(run, watch))
    if answer.outcome != "value" or not watch.results:
        return {}, math.nan
    return _stages(watch), float(watch.results[0].seconds)


def _stages(watch: Stopwatch) -> dict[str, float]:
    """Of its last simulation."""
    if not watch.results:
        return {}
    return {stage: float(seconds) for stage, seconds in watch.results[0].stage_seconds.items()}
