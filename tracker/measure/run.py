"""Put every question of a catalogue to an engine and return the answers as one run document.

Values come from a pool of processes, each test's work in pieces, so that one long question does not hold up
the rest and a crash of native code costs one piece. Run times are taken afterwards, alone on the machine.
The catalogue and the engine are named as "module:attribute", so that every process can find them itself.
"""

from __future__ import annotations

import difflib
import importlib
import os
import signal
import uuid
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from multiprocessing import get_context
from typing import Any, Literal

import spook_tracker.tracker.measure.others as others
import spook_tracker.tracker.measure.trajectory as motion
from spook_tracker.engine.find import EngineMissing, find
from spook_tracker.scalar_tests.case import ScalarTest, Simulate
from spook_tracker.tracker.document.errors import TrackerError
from spook_tracker.tracker.document.run_document import (
    EngineVersion,
    FigureData,
    MapData,
    RunDocument,
    Sample,
    SeriesDefinition,
    Trajectory,
)
from spook_tracker.tracker.measure import ladder as ladders
from spook_tracker.tracker.measure.cards import engine_version, test_card
from spook_tracker.tracker.measure.machine import machine
from spook_tracker.tracker.measure.question import (
    Measured,
    Outcome,
    Witness,
    draw,
    judged_sample,
    measure,
    metric_series,
    study,
)

Trigger = Literal["manual", "nightly", "import", "test"]
Part = Measured | FigureData | MapData | Trajectory
PEER_TIME_LIMIT = 10.0  # s of wall time per simulation of an engine that is only shown
CRASH = "the engine's process died while answering"


class RunError(TrackerError):
    """The run cannot be started as asked; one sentence that names what to do."""


@dataclass(frozen=True, kw_only=True)
class Questions:
    """Where the questions and the engine are found, by name."""

    catalogue: str = "spook_tracker.scalar_tests.catalogue:CATALOGUE"
    engine: str = "spook"  # as `engine.find` knows it
    limit: float | None = None  # s of wall time for one simulation; None leaves it to the test

    def tests(self) -> Mapping[str, ScalarTest]:
        module, _, attribute = self.catalogue.partition(":")
        try:
            found: Mapping[str, ScalarTest] = getattr(
                importlib.import_module(module), attribute or "CATALOGUE"
            )
        except (ImportError, AttributeError) as error:
            raise RunError(
                f"there is no catalogue {self.catalogue!r} ({error}); name one as module:NAME"
            ) from None
        engine = self.module()
        configurations = getattr(engine, "configurations", ())
        return others.asked_of(found, configurations, engine.gating) if configurations else found

    def module(self) -> Any:
        """The engine: simulate, build_info, and its configurations if it is not ours."""
        try:
            return find(self.engine)
        except EngineMissing as error:
            raise RunError(str(error)) from None

    def simulate(self) -> Simulate:
        module = self.module()
        try:
            simulate: Simulate = module.simulate
        except AttributeError:
            raise RunError(f"engine {self.engine!r} has no function simulate; it is not an engine") from None
        limit = self.limit
        if limit is None and hasattr(module, "configurations"):
            limit = PEER_TIME_LIMIT
        return simulate if limit is None else partial(_limited, simulate, limit)


def _limited(simulate: Simulate, limit: float, scene: Any, **options: Any) -> Any:
    """Simulate for at most `limit` seconds of wall time."""
    options["time_limit"] = min(limit, options.get("time_limit") or limit)
    return simulate(scene, **options)


@dataclass(frozen=True, kw_only=True)
class Request:
    """What to run. No tests named means all of them."""

    tests: tuple[str, ...] = ()
    figures: bool = False
    sweep: bool = False
    stability: bool = False
    trigger: Trigger = "manual"
    workers: int = 2
    repeats: int = 5  # of each timing


Kind = Literal["measure", "figure", "trajectory", "study", "ladder"]


@dataclass(frozen=True, order=True)
class Task:
    """One piece of work: the index says which measurement, figure, study or ladder configuration."""

    position: int
    test: str
    kind: Kind
    index: tuple[int, ...]


@dataclass(frozen=True)
class Progress:
    """What to tell whoever is watching after each piece of work."""

    done: int
    total: int
    test: str
    finished: bool  # every piece of this test is done
    failed: tuple[str, ...] = ()  # series of this piece outside their limits


Watch = Callable[[Progress], None]


def select(catalogue: Mapping[str, ScalarTest], names: Iterable[str]) -> dict[str, ScalarTest]:
    """The tests asked for, in catalogue order; an unknown name is answered with its nearest neighbours."""
    wanted = list(names)
    for name in wanted:
        if name not in catalogue:
            near = difflib.get_close_matches(name, catalogue, n=3)
            hint = f"did you mean {' or '.join(near)}?" if near else "`tracker list` shows them all"
            raise RunError(f"there is no test named {name!r}; {hint}")
    return {name: test for name, test in catalogue.items() if not wanted or name in wanted}


def run(source: Questions, request: Request, watch: Watch = lambda progress: None) -> RunDocument:
    """Everything asked for at the engine's present version on this machine. Raises RunError only."""
    started = _now()
    tests = select(source.tests(), request.tests)
    simulate, engine = source.simulate(), source.module()
    version = engine_version(engine)
    tasks = list(_tasks(tests, request))
    parts = dict(_perform_all(source, tasks, tests, request.workers, watch))
    measured: list[tuple[SeriesDefinition, Sample]] = []
    figures: list[FigureData] = []
    maps: list[MapData] = []
    trajectories: list[Trajectory] = []
    errors: dict[tuple[str, int, int], ladders.ErrorPoints] = {}
    for task in tasks:
        for part in parts[task.position]:
            if isinstance(part, FigureData):
                figures.append(part)
            elif isinstance(part, MapData):
                maps.append(part)
            elif isinstance(part, Trajectory):
                trajectories.append(part)
            elif isinstance(part, ladders.ErrorPoints):
                errors[(task.test, task.index[0], task.index[1])] = part
            else:
                measured.extend(part)
    saved: Mapping[str, Mapping[str, float]] = {}
    if request.sweep:
        measured += ladders.timed_series(tests, errors, simulate, request.repeats)
        if not hasattr(engine, "configurations"):
            saved = ladders.saved_by_leaving_out(tests, simulate)
    _refuse_doubles(series.key for series, _ in measured)
    return RunDocument(
        schema_version=1,
        id=(identity := str(uuid.uuid4())),
        idempotency_key=identity,
        started=started,
        finished=_now(),
        trigger=request.trigger,
        tracker_version=tracker_version(),
        ci_address=ci_address(os.environ),
        engine=version,
        machine=machine(),
        tests=tuple(test_card(name, test, engine, saved.get(name, {})) for name, test in tests.items()),
        series=tuple(series for series, _ in measured),
        samples=tuple(sample for _, sample in measured),
        figures=tuple(figures),
        maps=tuple(maps),
        trajectories=tuple(trajectories),
    )


def _tasks(tests: Mapping[str, ScalarTest], request: Request) -> Iterator[Task]:
    """The pieces of work of every test, in the order in which a reader meets their results."""
    position = 0
    for name, test in tests.items():
        wanted: list[tuple[Kind, tuple[int, ...]]] = []
        wanted += [("measure", (i,)) for i in range(len(test.measurements))]
        if request.figures:
            wanted += [("figure", (i,)) for i in range(len(test.figures))]
            wanted += [("trajectory", (0,))]
        if request.stability:
            wanted += [("study", (i,)) for i in range(len(test.stability))]
        if request.sweep:
            wanted += [
                ("ladder", (i, j))
                for i, rungs in enumerate(test.ladders)
                for j in range(len(rungs.configurations))
            ]
        for kind, index in wanted:
            yield Task(position, name, kind, index)
            position += 1


def perform(source: Questions, task: Task) -> tuple[Any, ...]:
    """Do one piece of work in this process."""
    test, simulate = source.tests()[task.test], source.simulate()
    first = task.index[0]
    if task.kind == "measure":
        return (measure(task.test, test, test.measurements[first], simulate),)
    if task.kind == "figure":
        return (draw(task.test, test.figures[first], simulate),)
    if task.kind == "trajectory":
        moved = motion.trajectory(task.test, test, simulate)
        return () if moved is None else (moved,)
    if task.kind == "study":
        return (study(task.test, test, test.stability[first], simulate),)
    rungs = test.ladders[first]
    return (ladders.error_points(rungs, rungs.configurations[task.index[1]], simulate),)


def _perform_all(
    source: Questions, tasks: Sequence[Task], tests: Mapping[str, ScalarTest], workers: int, watch: Watch
) -> Iterator[tuple[int, tuple[Any, ...]]]:
    """Results by position, as they come; a dead process loses only the piece that killed it."""
    left = {name: sum(task.test == name for task in tasks) for name in tests}
    for done, (task, parts) in enumerate(_answers(source, tasks, tests, workers), start=1):
        left[task.test] -= 1
        bad = tuple(
            s.key for p in parts if isinstance(p, tuple) for s, m in p if not m.passed and s.role == "gate"
        )
        watch(Progress(done, len(tasks), task.test, left[task.test] == 0, bad))
        yield task.position, parts


def _answers(
    source: Questions, tasks: Sequence[Task], tests: Mapping[str, ScalarTest], workers: int
) -> Iterator[tuple[Task, tuple[Any, ...]]]:
    if workers <= 1:
        yield from ((task, perform(source, task)) for task in tasks)
        return
    waiting = list(tasks)
    answered: set[int] = set()
    with _pool(workers) as pool:
        for task, parts in _gather(pool, source, waiting):
            if parts is not None:
                answered.add(task.position)
                yield task, parts
    for task in (task for task in waiting if task.position not in answered):
        with _pool(1) as pool:  # alone, so that only the culprit is lost
            ((_, parts),) = _gather(pool, source, [task])
        yield task, parts if parts is not None else _crashed(task, tests[task.test])


def _pool(workers: int) -> ProcessPoolExecutor:
    return ProcessPoolExecutor(
        max_workers=workers, mp_context=get_context("spawn"), initializer=_begin_quietly
    )


def _begin_quietly() -> None:
    """A worker says what it has to say in samples: no warnings on the terminal, no trace when interrupted."""
    warnings.simplefilter("ignore")
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _gather(
    pool: Executor, source: Questions, tasks: Iterable[Task]
) -> Iterator[tuple[Task, tuple[Any, ...] | None]]:
    futures: dict[Future[tuple[Any, ...]], Task] = {}
    try:
        for task in tasks:
            futures[pool.submit(perform, source, task)] = task
    except BrokenProcessPool:
        pass  # what was not submitted is asked again, alone
    for future in as_completed(futures):
        try:
            yield futures[future], future.result()
        except BrokenProcessPool:
            yield futures[future], None


def _crashed(task: Task, test: ScalarTest) -> tuple[Any, ...]:
    """What is recorded for a piece of work that took its process down."""
    first = task.index[0]
    if task.kind == "measure":
        measurement = test.measurements[first]
        lost = []
        for metric in measurement.metrics:
            series = metric_series(task.test, test, measurement, metric)
            outcome = Outcome(None, "crashed", CRASH)
            lost.append((series, judged_sample(series.key, metric, outcome, Witness(_dead))))
        return (tuple(lost),)
    if task.kind == "figure":
        return (draw(task.test, test.figures[first], _dead),)
    if task.kind == "trajectory":
        return ()
    if task.kind == "study":
        return (study(task.test, test, test.stability[first], _dead),)
    rungs = test.ladders[first]
    return (ladders.error_points(rungs, rungs.configurations[task.index[1]], _dead),)


def _dead(*arguments: Any, **options: Any) -> Any:
    raise RuntimeError(CRASH)


def _refuse_doubles(keys: Iterable[str]) -> None:
    seen: set[str] = set()
    for key in keys:
        if key in seen:
            raise RunError(
                f"two series are called {key!r}; give one measurement another configuration or parameter"
            )
        seen.add(key)


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="microseconds")


def tracker_version() -> str:
    """Version of the installed tracker; "unknown" when it runs from a bare checkout."""
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("spook-tracker")
    except PackageNotFoundError:
        return "unknown"


def ci_address(environment: Mapping[str, str]) -> str:
    """Where the log of this night is, if a CI service says so."""
    if environment.get("GITHUB_RUN_ID"):
        server, repository = (
            environment.get("GITHUB_SERVER_URL", ""),
            environment.get("GITHUB_REPOSITORY", ""),
        )
        return f"{server}/{repository}/actions/runs/{environment['GITHUB_RUN_ID']}"
    return environment.get("CI_JOB_URL") or environment.get("BUILD_URL") or ""


def present_version(source: Questions) -> EngineVersion:
    """The engine that would be measured now."""
    return engine_version(source.module())
