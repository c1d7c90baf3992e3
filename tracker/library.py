"""What the command line does, as functions: measure, record, compare, judge, publish, and a whole night.

>>> from spook_tracker import tracker
>>> document = tracker.run(["pendulum"])                              # doctest: +SKIP
>>> tracker.record(document, "sqlite:///tracker.db")                  # doctest: +SKIP
>>> with tracker.History.open("sqlite:///tracker.db") as history:     # doctest: +SKIP
...     tracker.compare(history, "previous", "latest").exit_code
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

from spook_tracker.misuse import explain_misuse, explained
from spook_tracker.tracker.document.collection import no_collection
from spook_tracker.tracker.document.run_document import RunDocument, SeriesHistory
from spook_tracker.tracker.judge.accepted import Accepted
from spook_tracker.tracker.judge.comparison_document import CompareDocument
from spook_tracker.tracker.judge.maps import ToldMap
from spook_tracker.tracker.judge.series_history import Told
from spook_tracker.tracker.judge.tonight import Finding, to_be_timed_again
from spook_tracker.tracker.store.history import History as StoredHistory
from spook_tracker.tracker.website.options import DEFAULTS, SiteOptions

if TYPE_CHECKING:
    from spook_tracker.tracker.measure.limits import Limits
    from spook_tracker.tracker.measure.questions import Questions
    from spook_tracker.tracker.measure.request import Progress, Request, Trigger
    from spook_tracker.tracker.measure.timing import Repeats
    from spook_tracker.tracker.store.database import Session
    from spook_tracker.tracker.store.versions import RunInfo
    from spook_tracker.tracker.website.plotly_figures import Figure
    from spook_tracker.tracker.website.publish import Report

__all__ = [
    "History",
    "NightlyReport",
    "RunOptions",
    "SiteOptions",
    "compare",
    "judge_run",
    "nightly",
    "publish",
    "record",
    "run",
]


class History(StoredHistory):
    """What is stored, as of the moment it is opened: `runs`, `series`, `samples`, `to_dataframe`, `plot`."""

    def plot(self, test: str, metric: str = "", *, ladder: bool = False) -> Figure:
        """A test over versions as a Plotly figure, with limit and set point: its gate, or `metric`, in its own unit.

        `ladder`: its error against run time [s] instead, all configurations and engines. The traces are those of the
        website. UnknownName for what is not recorded; TrackerError without Plotly.
        """
        from .notebook import ladder_figure, trend_figure

        return ladder_figure(self, test) if ladder else trend_figure(self, test, metric)


explain_misuse([SiteOptions])


class RunOptions(TypedDict, total=False):
    """What is asked of which engine, and how it is measured; all that is left out is as `tracker run` has it."""

    catalogue: str  # "standard", a module:attribute, several with commas between them
    engine: str  # a name as `tracker engines` lists it, or module:NAME
    limit: float | None  # s for one simulation
    patience: float | None  # s after which a piece of work begins no further simulation
    every_setting: bool  # whether single values are asked in each setting of another engine
    limits: Limits  # a team's own, by series
    folder: str  # where engine and catalogue are looked for, too
    figures: bool
    sweep: bool  # ladders of error against run time
    stability: bool  # maps and break points
    trigger: Trigger
    workers: int  # processes, each watched; 0: in this one, where nothing can be ended
    time_limit: float  # s for one piece of work
    memory_limit: int  # bytes for one piece of work
    repeats: int | Repeats  # of each timing
    apart: bool  # in a process of its own
    executor: str  # where values are measured


Watch = Callable[["Progress"], None]


def run(tests: Iterable[str] = (), *, watch: Watch | None = None, **asked: Unpack[RunOptions]) -> RunDocument:
    """Put the questions (all, or those named) to the engine, in a process of its own; nothing is recorded.

    `watch` is told after each piece of work. TypeError for an option that RunOptions does not have; RunError if the run
    cannot be started as asked.
    """
    from spook_tracker.tracker.measure.apart import run as measure

    source, request = _asked(tests, asked)
    return measure(source, request, watch or (lambda progress: None))


def time_again(
    document: RunDocument,
    tests: Iterable[str],
    watch: Watch | None = None,
    **asked: Unpack[RunOptions],
) -> RunDocument:
    """The document with the ladders of these tests timed once more; `asked` as for the run it comes from."""
    from spook_tracker.tracker.measure.apart import timed_again

    source, request = _asked((), asked)
    return timed_again(source, request, document, tests, watch or (lambda progress: None))


def _asked(tests: Iterable[str], asked: RunOptions) -> tuple[Questions, Request]:
    """What is asked, and how: fields of Questions, and those of a Request, told apart."""
    from dataclasses import fields

    from spook_tracker.engine.check import nearest
    from spook_tracker.tracker.measure.questions import Questions
    from spook_tracker.tracker.measure.request import Request

    for name in asked:
        if name not in RunOptions.__annotations__:
            raise TypeError(f"a run has no option {name!r}; {nearest(name, RunOptions.__annotations__)}")
    whose = {field.name for field in fields(Questions)}
    where: dict[str, Any] = {name: value for name, value in asked.items() if name in whose}
    how: dict[str, Any] = {name: value for name, value in asked.items() if name not in whose}
    return Questions(**where), Request(tests=tuple(tests), **how)


@explained
def record(document: RunDocument, database: str) -> bool:
    """Store a run; False if it was there already."""
    from spook_tracker.tracker.store.database import session_on
    from spook_tracker.tracker.store.record import record as store

    with session_on(database) as session:
        return store(session, document)


FORK_POINT = "fork-point"


def fork_point(history: StoredHistory, after: str) -> RunInfo:
    """The run that a version's branch is to be compared with: the nearest measured commit it builds on."""
    from spook_tracker.tracker.document.errors import UnknownName
    from spook_tracker.tracker.judge.lane import forked_from
    from spook_tracker.tracker.store import git

    run = history.resolve(after)
    found = forked_from(history.runs(), run, git.fork_point(history.repository, run.engine.git_hash))
    if found is None:
        raise UnknownName(f"nothing was measured that {after!r} builds on; record its fork point first")
    return found


def _earlier(history: StoredHistory, before: str, after: str) -> RunInfo:
    """The run that `before` stands for beside `after`."""
    if before == FORK_POINT:
        return fork_point(history, after)
    whose, at, word = after.rpartition("@")
    if word == "latest" and before == f"{whose}{at}previous":
        return _previous(history, after) or history.resolve(before)
    if word == "latest" and before == f"{whose}{at}last-green":
        history.resolve(before)  # where none at all is green, that is said
        return _previous(history, after, green=True) or _no_green()
    return history.resolve(before)


def _no_green() -> RunInfo:
    """UnknownName: a run is no news against itself."""
    from spook_tracker.tracker.document.errors import UnknownName

    raise UnknownName(
        "no version before the latest has kept every limit on its branch; name one to compare with"
    )


def _previous(history: StoredHistory, name: str, green: bool = False) -> RunInfo | None:
    """The run before another as that is judged: on its branch, and of its version only if it measured the same there.

    With `green` the newest of them that kept every limit.
    """
    from spook_tracker.tracker.judge.lane import line_of, of_version

    *line, run = line_of(history.runs(), history.resolve(name))
    version = {other.id for other in of_version(line, run)}
    for other in reversed(line):
        if green and not other.green:
            continue
        if other.id not in version:
            return other
        if other.machine.fingerprint == run.machine.fingerprint and (
            history.samples(other.id).keys() & history.samples(run.id).keys()
        ):
            return other
    return None


def _runs_of(history: StoredHistory, name: str, run: RunInfo) -> list[RunInfo]:
    """The runs that are meant by a name that stands for `run`: that one by its id, else all of its version."""
    from spook_tracker.tracker.judge.lane import of_version

    return [run] if _by_id(name, run) else of_version(history.runs(), run)


def _by_id(name: str, run: RunInfo) -> bool:
    """Whether a name that stands for a run is its id, or the start of it."""
    word = name.rpartition("@")[2]
    return run.id.startswith(word) and word != run.engine.version


@explained
@no_collection()
def compare(
    history: StoredHistory,
    before: str,
    after: str,
    accepted: Sequence[Accepted] = (),
    against_history: bool = False,
) -> CompareDocument:
    """What changed between two versions, each named as on the command line; `before` may be fork-point.

    A version is all runs of its commit: they are compared on every machine that measured both, and what only one of
    them has is named in a note. With `against_history` run times that are red against their history are red here, too.
    """
    from spook_tracker.tracker.judge.compare import ComparedRun, compare_in, side_of
    from spook_tracker.tracker.judge.lane import machine_of
    from spook_tracker.tracker.judge.machine_pairs import joined, paired, together
    from spook_tracker.tracker.judge.maps import may_be_dropped
    from spook_tracker.tracker.judge.work import with_work

    new = history.resolve(after)
    old = _earlier(history, before, after)
    olds, news = _runs_of(history, before, old), _runs_of(history, after, new)
    if old in news and old.id != new.id:  # one version measured twice
        olds, news = [old], [new]
    found = paired(olds, news, lambda run: history.samples(run.id))
    dropped = may_be_dropped(history, [side[0] for pair in found.pairs for side in pair])

    def side(runs: Sequence[RunInfo]) -> ComparedRun:
        samples, maps = together(runs, history.samples, history.maps)
        return ComparedRun(
            side=side_of(runs[0]),
            samples=with_work(samples, runs[0].engine),
            maps=maps,
            dropped=dropped[runs[0].id],
            runs=tuple(run.id for run in runs),
        )

    documents = [
        compare_in(history, (earlier[0], side(earlier)), (later[0], side(later)), accepted, against_history)
        for earlier, later in found.pairs
    ]
    return joined(documents, [machine_of(later[0]) for _, later in found.pairs], found.left_out)


@explained
@no_collection()
def judge_run(history: StoredHistory, run: str, accepted: Sequence[Accepted] = ()) -> list[Finding]:
    """What became of a recorded run, against everything measured before it; red first.

    A version is all runs of its commit, of each series on each machine the last. `latest` is the latest night of every
    machine: what is red of the last runs of others within a day is among it.
    """
    from spook_tracker.tracker.judge.tonight import tonight

    whose, at, word = run.rpartition("@")
    before = _previous(history, f"{whose}{at}latest") if word == "previous" else None
    meant = before or history.resolve(run)
    return tonight(history, meant, accepted, version=not _by_id(run, meant), others=word == "latest")


def idle_entries(
    history: StoredHistory, run: str, findings: Sequence[Finding], accepted: Sequence[Accepted]
) -> list[str]:
    """A sentence for each entry of accepted.toml that does nothing to this run's findings."""
    from spook_tracker.tracker.judge.accepted import unused
    from spook_tracker.tracker.judge.judged import night_of

    names = {finding.series for finding in findings} | set(history.series_keys())
    held = {f.series for f in findings if not f.red and f.verdict.word != "expected"}
    return unused(accepted, names, night_of(history.resolve(run)), held)


@no_collection()
def trend(
    history: StoredHistory,
    test: str,
    metric: str | None = None,
    accepted: Sequence[Accepted] = (),
    engine: str | None = None,
) -> list[Told]:
    """The series of a test (or of a key), or of one of its metrics, every night judged; UnknownName if none.

    They are of `engine`, or of the first one that answers the test.
    """
    from spook_tracker.tracker.document.errors import UnknownName
    from spook_tracker.tracker.judge.lane import histories, lines
    from spook_tracker.tracker.judge.series_history import judge_all
    from spook_tracker.tracker.store.versions import unknown_test

    stem = test.removesuffix(":run-time")
    keys = [key for key in history.series_keys() if key == test or key.startswith(f"{stem}/")]
    if not keys:
        raise unknown_test(history.series_keys(), test)
    if metric is not None and not metric.startswith("work:"):
        stems = (metric, metric.removesuffix(":run-time"))
        keys = [key for key in keys if key.split("/")[2:3] and key.split("/")[2] in stems] or keys
    found: dict[str, SeriesHistory] = {}
    runs = history.runs(engine)
    if not runs and engine is not None:
        names = ", ".join(sorted({run.engine.name for run in history.runs()}))
        raise UnknownName(f"nothing is recorded of an engine {engine!r}; there are {names}")
    for line in lines(runs):
        found = found or histories(history, line, keys)
    if stem != test:
        found = {key: series for key, series in found.items() if key == test}
    if not found:
        whose = f"of an engine {engine!r}" if engine is not None else "in any run that is left"
        raise UnknownName(f"{test!r} was not measured {whose}; `tracker db stats` shows what is recorded")
    if metric is not None:
        known = sorted({s.definition.metric for s in found.values()})
        found = {key: s for key, s in found.items() if s.definition.metric == metric}
        if not found:
            raise UnknownName(f"{test} has no metric {metric!r}; it has {', '.join(known)}")
    return list(judge_all(found, accepted).values())


def trend_of_maps(
    history: StoredHistory, test: str, accepted: Sequence[Accepted] = (), engine: str | None = None
) -> list[ToldMap]:
    """What became of the stability maps of a test (or of one map, by its key), of `engine` or the first that has such."""
    from spook_tracker.tracker.judge.lane import lines
    from spook_tracker.tracker.judge.maps import told_maps

    for line in lines(history.runs(engine)):
        told = [
            found for found in told_maps(history, line, accepted) if test in (found.newest.test, found.key)
        ]
        if told:
            return told
    return []


@explained
def publish(
    history: StoredHistory,
    out: Path,
    accepted: Sequence[Accepted] = (),
    database: str = "",
    options: SiteOptions = DEFAULTS,
) -> Report:
    """Build the website in the folder `out`; returns how many files were written.

    `database` is the URL of the SQLite file that readers can load where the options say so. FolderError if `out` holds
    files of others.
    """
    from spook_tracker.tracker.website.publish import publish as build

    offered = None
    if database and options.with_database:
        from spook_tracker.tracker.store.offered import database_file

        offered = database_file(database)
    return build(history, out, accepted, offered, options)


def judged_again(
    session: Session, document: RunDocument, accepted: Sequence[Accepted] = (), **asked: Unpack[RunOptions]
) -> tuple[RunDocument, list[Finding]]:
    """What became of a run just recorded; what seems slower is timed once more at once, stored, and judged again.

    `asked` as for the run it comes from.
    """
    from spook_tracker.tracker.store.record import add_again

    findings = judge_run(History(session, ahead=NO_TIME), document.id, accepted)
    if seem_slower := to_be_timed_again(findings):
        document = time_again(document, seem_slower, **asked)
        add_again(session, document)
        findings = judge_run(History(session, ahead=NO_TIME), document.id, accepted)
    return document, findings


NO_TIME = timedelta()  # by which a run may be dated ahead of a night that has just been recorded


@dataclass(frozen=True, kw_only=True)
class NightlyReport:
    """One night: what was measured, what became of it, and what was published."""

    document: RunDocument
    findings: list[Finding]
    published: Report
    notes: tuple[str, ...] = ()  # entries of accepted.toml that do nothing, runs dated ahead

    @property
    def red(self) -> bool:
        """Whether a person has to look: the judge decides, and nothing else."""
        return any(finding.red for finding in self.findings)


def nightly(
    database: str,
    out: Path,
    *,
    accepted: Sequence[Accepted] = (),
    watch: Watch | None = None,
    tell: Callable[[RunDocument | list[Finding]], None] = lambda news: None,
    site: SiteOptions = DEFAULTS,
    **asked: Unpack[RunOptions],
) -> NightlyReport:
    """Measure everything, record it, judge it against the history, publish the website.

    The database and what the website is told are looked at first: no night is measured in vain. `tell` is called with the run
    document and with the findings as soon as they are there. `asked` as for `run`. An interrupted night is recorded
    as far as it came (Interrupted says which run), neither judged nor published.
    """
    from spook_tracker.tracker.measure.request import Interrupted
    from spook_tracker.tracker.store.database import session_on
    from spook_tracker.tracker.store.record import record as store
    from spook_tracker.tracker.store.retention import drop_old_figures
    from spook_tracker.tracker.website.colours import accent

    asked["trigger"] = "nightly"
    accent(site.colour)
    if site.mutants:
        from spook_tracker.tracker.website.page_mutants import read_mutants

        read_mutants(site.mutants)
    with session_on(database) as session:
        try:
            document = run(watch=watch, **asked)
        except Interrupted as ended:
            ended.recorded = store(session, ended.document)
            raise
        store(session, document)
        tell(document)
        document, findings = judged_again(session, document, accepted, **asked)
        recorded = StoredHistory(session, ahead=NO_TIME)
        tell(findings)
        notes = idle_entries(recorded, document.id, findings, accepted)
        drop_old_figures(session, recorded)  # once they have been compared
    with History.open(database, NO_TIME) as history:
        notes += [history.dated_ahead()] if history.ahead else []
        published = publish(history, out, accepted, database, site)
    return NightlyReport(document=document, findings=findings, published=published, notes=tuple(notes))
