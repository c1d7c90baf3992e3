"""Put every question of a catalogue to an engine and return the answers as one run document.

Values come from several processes, each test's work in pieces, so that one long question does not hold up the
rest, and a hang, a crash or greed for memory costs one piece. Run times are taken afterwards, alone on the machine.
The catalogue and the engine are named as "module:attribute", so that every process can find them itself.
"""

from __future__ import annotations

import difflib
import os
import uuid
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal, NoReturn

import msgspec

import spook_tracker.engine as ours
from spook_tracker.scalar_tests.case import OutOfTime, ScalarTest, Simulate
from spook_tracker.tracker.document.errors import TrackerError
from spook_tracker.tracker.document.run_document import (
    Asked,
    EngineVersion,
    Family,
    FigureData,
    Machine,
    MapData,
    RunDocument,
    Sample,
    SeriesDefinition,
    Trajectory,
    Worker,
)

from . import executors, first_look
from . import ladder as ladders
from . import trajectory as motion
from . import workers as crew
from .cards import engine_version, test_card
from .fitting import fitted, fitted_figure, unfit
from .machine import machine
from .model_motion import model_trajectory
from .question import (
    Measured,
    NoAnswer,
    Outcome,
    Witness,
    ask,
    draw,
    judged_sample,
    measure,
    metric_series,
    sentence,
    study,
)
from .questions import PEER_TIME_LIMIT as PEER_TIME_LIMIT
from .questions import Questions as Questions
from .questions import RunError as RunError
from .remembered import of_test
from .renames import with_aliases
from .request import Interrupted as Interrupted
from .request import Progress as Progress
from .request import Request as Request
from .request import Trigger as Trigger
from .request import Watch as Watch
from .run_times import Timed, run_times

Part = Measured | FigureData | MapData | Trajectory
Parts = tuple[Part | ladders.ErrorPoints | first_look.LeftOut, ...]  # of a piece of work


Kind = Literal["measure", "figure", "trajectory", "study", "ladder"]


@dataclass(frozen=True, order=True)
class Task:
    """One piece of work: the index says which measurement, figure, study or ladder configuration."""

    position: int
    test: str
    kind: Kind
    index: tuple[int, ...]


def select(catalogue: Mapping[str, ScalarTest], names: Iterable[str]) -> dict[str, ScalarTest]:
    """The tests asked for, in catalogue order; an unknown name is answered with its nearest neighbours."""
    wanted = list(names)
    for name in wanted:
        if name not in catalogue:
            near = difflib.get_close_matches(name, catalogue, n=3)
            hint = f"did you mean {' or '.join(near)}?" if near else "`tracker list` shows them all"
            raise RunError(f"there is no test named {name!r}; {hint}")
    return {name: catalogue[name] for name in catalogue if not wanted or name in wanted}


def run(source: Questions, request: Request, watch: Watch = lambda progress: None) -> RunDocument:
    """Everything asked for at the engine's present version on this machine.

    RunError if it cannot be started; Interrupted, with what was finished, if the user or the system ends it.
    """
    started = _now()
    tests = select(source.tests(), request.tests)
    source.simulate()  # an engine without it is refused before anything is measured
    version = engine_version(source.module())
    tasks = list(_tasks(tests, request))
    watch(
        Progress(0, _total(tasks, tests, request), "", False)
    )  # all is imported: a caller that waited for that knows
    parts: dict[int, Parts] = {}
    workers: Counter[Machine] = Counter()
    timed: Timed = ([], {})
    try:
        for task, part in _perform_all(source, tasks, tests, request, watch, workers):
            parts[task.position] = part
        if request.sweep:
            timed = timings(source, request, tests, _errors(tasks, parts), watch)
    except KeyboardInterrupt:
        unfinished = {task.test for task in tasks if task.position not in parts}
        finished = {name: test for name, test in tests.items() if name not in unfinished}
        if not finished:
            raise
        tasks = [task for task in tasks if task.test in finished]
        document = _document(source, request, started, version, finished, tasks, parts, workers, timed)
        raise Interrupted(msgspec.structs.replace(document, partial=True), len(tests)) from None
    document = _document(source, request, started, version, tests, tasks, parts, workers, timed)
    if document.partial and not document.samples:
        raise RunError(f"nothing was measured: {first_look.why_nothing(document)}")
    return document


def _errors(tasks: Iterable[Task], parts: Mapping[int, Parts]) -> Errors:
    return {
        (task.test, task.index[0], task.index[1]): found
        for task in tasks
        if task.kind == "ladder" and isinstance(found := parts[task.position][0], ladders.ErrorPoints)
    }


def _document(
    source: Questions,
    request: Request,
    started: str,
    version: EngineVersion,
    tests: Mapping[str, ScalarTest],
    tasks: Iterable[Task],
    parts: Mapping[int, Parts],
    workers: Mapping[Machine, int],
    timed: Timed,
) -> RunDocument:
    """The answers in the order of the questions, whatever order they came in."""
    measured: list[tuple[SeriesDefinition, Sample]] = []
    figures: list[FigureData] = []
    maps: list[MapData] = []
    trajectories: list[Trajectory] = []
    left: list[first_look.LeftOut] = []
    for part in (part for task in tasks for part in parts[task.position]):
        if isinstance(part, first_look.LeftOut):
            left.append(part)
        elif isinstance(part, FigureData):
            figures.append(fitted_figure(part))
        elif isinstance(part, MapData | Trajectory):
            if not unfit(part):  # a map that is not there is told of as lost
                (maps if isinstance(part, MapData) else trajectories).append(part)  # type: ignore[arg-type]
        elif not isinstance(part, ladders.ErrorPoints):  # those are among the timed series
            measured.extend(part)
    measured = [(series, fitted(sample)) for series, sample in (*measured, *timed[0])]
    _refuse_doubles(series.key for series, _ in measured)
    engine = source.module()
    cards = (test_card(name, test, engine, timed[1].get(name)) for name, test in tests.items())
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
        tests=tuple(
            msgspec.structs.replace(card, lacks=card.lacks | first_look.told(card, left)) for card in cards
        ),
        series=with_aliases((series for series, _ in measured), tests),
        samples=tuple(sample for _, sample in measured),
        figures=tuple(figures),
        maps=tuple(maps),
        trajectories=tuple(trajectories),
        partial=bool(left),
        asked=_asked(source, request),
        workers=tuple(
            Worker(
                fingerprint=worker.fingerprint,
                processor=worker.processor,
                operating_system=worker.operating_system,
                pieces=pieces,
            )
            for worker, pieces in sorted(workers.items(), key=lambda item: str(item[0]))
        ),
    )


def _asked(source: Questions, request: Request) -> Asked:
    """What the run was asked for, whatever came of it."""
    families: list[Family] = ["values"]
    families += ["sweep"] if request.sweep else []
    families += ["stability"] if request.stability else []
    tests = tuple(select(source.tests(), request.tests))
    return Asked(tests=tests, families=tuple(families), whole=not request.tests)


def _tasks(tests: Mapping[str, ScalarTest], request: Request) -> Iterator[Task]:
    """The pieces of work of every test, in the order in which a reader meets their results."""
    position = 0
    for name, test in tests.items():
        wanted: list[tuple[Kind, tuple[int, ...]]] = []
        wanted += [("measure", (i,)) for i in range(len(test.measurements))]
        if request.figures:
            wanted += [("figure", (i,)) for i in range(len(test.figures))]
        if request.figures or test.seen is not None:
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


def _test_of(task: Task) -> str:
    return task.test


def perform(
    source: Questions, task: Task, shared: Path | None = None, look: first_look.Share | None = None
) -> Parts | crew.Lost:
    """Do one piece of work in this process; whatever it throws costs this piece alone. `shared` is a folder of all
    processes that are at work on these tests, `look` the time for a first look."""
    try:
        if look is None:
            return _performed(source, task, source.simulate(), shared)
        return _looked(source, task, first_look.look(task.test, source.simulate(), look), shared)
    except TrackerError:
        raise
    except Exception as error:
        return crew.Lost("crashed", sentence(f"the answer cannot be taken: {type(error).__name__}: {error}"))


def _looked(source: Questions, task: Task, look: first_look.Look, shared: Path | None) -> Parts:
    """The same, or what of it was left out."""
    measured = source.tests()[task.test].measurements
    name = measured[task.index[0]].configuration if task.kind == "measure" else "replay"
    try:
        parts = _performed(source, task, look, shared)
    except OutOfTime as over:
        return (first_look.LeftOut(task.test, name, False, str(over)),)
    if not look.why:
        return parts
    known = [tuple((s, m) for s, m in p if m.outcome != "missing") for p in parts if isinstance(p, tuple)]
    return (*known, first_look.LeftOut(task.test, name, True, ""))


def _performed(source: Questions, task: Task, simulate: Simulate, shared: Path | None) -> Parts:
    test = source.tests()[task.test]
    simulate = of_test(task.test, simulate, source.module() is ours, shared)
    first = task.index[0]
    if task.kind == "measure":
        return (measure(task.test, test, test.measurements[first], simulate),)
    if task.kind == "figure":
        return (draw(task.test, test.figures[first], simulate),)
    if task.kind == "trajectory":
        moved = moves(task.test, test, simulate)
        return () if moved is None else (moved,)
    if task.kind == "study":
        return (study(task.test, test, test.stability[first], simulate),)
    rungs = test.ladders[first]
    return (ladders.error_points(rungs, rungs.configurations[task.index[1]], simulate),)


def moves(name: str, test: ScalarTest, simulate: Simulate) -> Trajectory | None:
    """How what is seen of a test moves."""
    if (seen := test.seen) is not None:
        found: Trajectory | None = ask(lambda: model_trajectory(name, seen, simulate)).value
        return found
    return motion.trajectory(name, test, simulate)


def _perform_all(
    source: Questions,
    tasks: Sequence[Task],
    tests: Mapping[str, ScalarTest],
    request: Request,
    watch: Watch,
    workers: Counter[Machine],
) -> Iterator[tuple[Task, Parts]]:
    """Pieces of work and what came of them, as they come; one that hangs or dies loses only its own answer.

    `workers` counts the answers of each machine of an executor.
    """
    left = {name: sum(task.test == name for task in tasks) for name in tests}
    look = None if request.look is None else first_look.Share(request.look)
    found: Iterator[tuple[Task, Parts | crew.Lost]] = (
        (task, perform(source, task, look=look)) for task in tasks
    )
    if request.executor != executors.PROCESS:
        at_work = (
            partial(perform, source, look=look),
            tasks,
            partial(_place, source),
            lambda machine: workers.update([machine]),
        )
        found = executors.answers(request.executor, *at_work)
    elif request.workers:
        limits = crew.Limits(seconds=request.time_limit, memory=request.memory_limit)
        found = _answers(source, tasks, request.workers, limits, look)
    for done, (task, parts) in enumerate(found, start=1):
        if isinstance(parts, crew.Lost):
            parts = _lost(task, tests[task.test], parts)
        left[task.test] -= 1
        bad = tuple(
            s.key
            for p in parts
            if isinstance(p, tuple)
            for s, m in p
            if s.role == "gate" and not m.passed and m.outcome != "not_supported"
        )
        watch(Progress(done, _total(tasks, tests, request), task.test, left[task.test] == 0, bad))
        yield task, parts


def _answers(
    source: Questions,
    tasks: Sequence[Task],
    workers: int,
    limits: crew.Limits,
    look: first_look.Share | None,
) -> Iterator[tuple[Task, Parts | crew.Lost]]:
    with TemporaryDirectory(prefix="tracker-runs-") as shared:
        work = partial(perform, source, shared=Path(shared), look=look)
        yield from crew.answers(work, tasks, workers, limits, _test_of)


def _place(source: Questions) -> executors.Place:
    return executors.place_of(source.module())


Errors = ladders.Errors


def _total(tasks: Sequence[Task], tests: Mapping[str, ScalarTest], request: Request) -> int:
    """Pieces of work of a run: those that measure, and one for the run times of each test."""
    return len(tasks) + (len(tests) if request.sweep else 0)


def timings(
    source: Questions, request: Request, tests: Mapping[str, ScalarTest], errors: Errors, watch: Watch
) -> Timed:
    """Run times of these tests' ladders, taken while nothing else is at work."""
    done = len(list(_tasks(tests, request)))
    total = done + len(tests)

    def timed(name: str) -> None:
        nonlocal done
        done += 1
        watch(Progress(done, total, f"{name}, run times", True))

    limits = crew.Limits(seconds=request.time_limit, memory=request.memory_limit)
    return run_times(source, tests, errors, request.repeats, limits if request.workers else None, timed)


def _gone(lost: crew.Lost) -> Callable[..., NoReturn]:
    """What simulating comes to where the process is lost."""

    def gone(*arguments: object, **options: object) -> NoReturn:
        raise NoAnswer(lost.outcome, lost.failure)

    return gone


def _lost(task: Task, test: ScalarTest, lost: crew.Lost) -> Parts:
    """What is recorded for a piece of work without an answer."""
    gone = _gone(lost)
    first = task.index[0]
    outcome = Outcome(None, lost.outcome, lost.failure)
    if task.kind == "measure":
        measurement = test.measurements[first]
        series = [(m, metric_series(task.test, test, measurement, m)) for m in measurement.metrics]
        return (tuple((s, judged_sample(s.key, m, outcome, Witness(gone))) for m, s in series),)
    if task.kind == "figure":
        return (draw(task.test, replace(test.figures[first], draw=gone), gone),)
    if task.kind == "trajectory":
        return ()
    if task.kind == "study":
        return (study(task.test, test, test.stability[first], gone, outcome),)
    rungs = replace(test.ladders[first], error=gone)
    return (ladders.error_points(rungs, rungs.configurations[task.index[1]], gone),)


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
