"""Read the history: runs in commit order, two runs side by side, series over versions.

>>> history = History(session)                                        # doctest: +SKIP
>>> old, new = history.resolve("previous"), history.resolve("latest")  # doctest: +SKIP
>>> history.samples(new.id)["pendulum/plain/length/h=0.0166667"]       # doctest: +SKIP
"""

from __future__ import annotations

import gc
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from sqlalchemy import ColumnElement, and_, select
from sqlalchemy.orm import Session

from spook_tracker.tracker.document import run_document as document
from spook_tracker.tracker.document.errors import DocumentError, UnknownName
from spook_tracker.tracker.document.run_document import (
    Point,
    RunDocument,
    Sample,
    SeriesDefinition,
    SeriesHistory,
)
from spook_tracker.tracker.store import git, models, rows
from spook_tracker.tracker.store.ancestry import commit_order
from spook_tracker.tracker.store.release_order import in_release_order
from spook_tracker.tracker.store.versions import RunInfo, resolve

if TYPE_CHECKING:
    import pandas

__all__ = ["History", "Point", "RunInfo", "SeriesHistory"]

CHUNK = 500  # ids in one IN (...)
LAST = "9999"  # sorts after every time: commits whose time is unknown
Body = TypeVar("Body")
Found = tuple[RunInfo, int, SeriesDefinition, Sample]  # run, series id, definition, sample


class History:
    """What is stored, as of the moment the history is made. `repository`: where git may know tags."""

    def __init__(self, session: Session, repository: Path | None = None) -> None:
        self._session = session
        self.repository = repository or Path.cwd()
        self._runs = self._read_runs()
        self._by_id = {run.id: run for run in self._runs}
        self._canonical = self._read_names()
        self._definitions: dict[int, SeriesDefinition] = {}

    @classmethod
    @contextmanager
    def open(cls, database: str) -> Iterator[History]:
        """The history in a database, for reading: sqlite:///FILE or postgresql://…"""
        from spook_tracker.tracker.store.database import session_on

        with session_on(database, readonly=True) as session:
            yield cls(session)

    def runs(self, engine: str | None = None) -> tuple[RunInfo, ...]:
        """All runs, or those of one engine, ancestors first; dirty and unversioned builds at the end."""
        return tuple(run for run in self._runs if engine is None or run.engine.name == engine)

    def series_keys(self) -> tuple[str, ...]:
        """Today's keys of all series, in order."""
        return tuple(sorted(set(self._canonical.values())))

    def run(self, run_id: str) -> RunInfo:
        """The run with exactly this id. UnknownName if there is none."""
        if run_id not in self._by_id:
            raise UnknownName(f"there is no run {run_id!r}; list them with: tracker db stats")
        return self._by_id[run_id]

    def resolve(self, name: str) -> RunInfo:
        """The run `name` stands for: see tracker/store/versions.py. UnknownName if none or several."""
        return resolve(self._runs, name, lambda tag: git.commit(self.repository, tag))

    def samples(self, run_id: str) -> dict[str, tuple[SeriesDefinition, Sample]]:
        """Every sample of a run with its definition in that run, by the key the series has today."""
        run = self.run(run_id)
        found = {}
        for _, series_id, definition, sample in self._read_samples(_of_run(run)):
            key = self._canonical.get(series_id, definition.key)
            if key not in found or definition.key == key:  # today's name wins over an earlier one
                found[key] = definition, sample
        return found

    def samples_of(
        self, run_ids: Sequence[str], tests: set[str] | None = None
    ) -> dict[str, dict[str, tuple[SeriesDefinition, Sample]]]:
        """The samples of several runs, of these tests (all if None): `samples` of each, read at once."""
        if tests is None:
            return {run_id: self.samples(run_id) for run_id in run_ids}
        of_tests = [i for i, key in self._canonical.items() if key.partition("/")[0] in tests]
        found: dict[str, dict[str, tuple[SeriesDefinition, Sample]]] = {run_id: {} for run_id in run_ids}
        for start in range(0, len(run_ids), CHUNK):
            runs = [self.run(run_id) for run_id in run_ids[start : start + CHUNK]]
            conditions = [
                models.Sample.series_id.in_(of_tests),
                models.Sample.run_key.in_([run.key for run in runs]),
                models.Sample.started_at.in_([run.started_at for run in runs]),
            ]
            for run, series_id, definition, sample in self._read_samples(conditions):
                key = self._canonical.get(series_id, definition.key)
                if key not in found[run.id] or definition.key == key:
                    found[run.id][key] = definition, sample
        return found

    def series(self, keys: Iterable[str] | None = None, *, evidence: bool = True) -> dict[str, SeriesHistory]:
        """Histories of all series or those named (by today's or an earlier name), by today's key.

        Unknown keys are left out. `evidence=False` leaves out failure, counters, state hash and timing, which
        makes reading long histories several times faster.
        """
        conditions: list[ColumnElement[bool]] = []
        if keys is not None:
            conditions = [models.Sample.series_id.in_(self._ids_of(keys))]
        with _no_collection():
            return self._gathered(conditions, evidence)

    def _gathered(
        self, conditions: Sequence[ColumnElement[bool]], evidence: bool
    ) -> dict[str, SeriesHistory]:
        gathered: dict[str, dict[str, tuple[SeriesDefinition, Sample]]] = {}
        for run, series_id, definition, sample in self._read_samples(conditions, evidence):
            key = self._canonical.get(series_id, definition.key)
            points = gathered.setdefault(key, {})
            if run.id not in points or definition.key == key:
                points[run.id] = definition, sample
        result = {}
        for key in sorted(gathered):
            points = gathered[key]
            ordered = [(run, *points[run.id]) for run in self._runs if run.id in points]
            result[key] = SeriesHistory(
                ordered[-1][1], tuple(Point(run, sample, d.test_version) for run, d, sample in ordered)
            )
        return result

    def figures(self, run_id: str) -> tuple[document.FigureData, ...]:
        """The figures of a run; empty once the retention rule has dropped them."""
        return self._bodies(models.Figure, run_id, document.FigureData)

    def maps(self, run_id: str) -> tuple[document.MapData, ...]:
        """The stability maps of a run; empty once the retention rule has dropped them."""
        return self._bodies(models.StabilityMap, run_id, document.MapData)

    def trajectories(self, run_id: str) -> tuple[document.Trajectory, ...]:
        """The motions recorded in a run; empty once the retention rule has dropped them."""
        return self._bodies(models.Trajectory, run_id, document.Trajectory)

    def cards(self, run_id: str) -> tuple[document.TestCard, ...]:
        """What the run says about its tests."""
        cards = select(models.TestCards.body).join(models.Run).where(models.Run.key == self.run(run_id).key)
        return rows.cards_of(self._session.execute(cards).scalar_one())

    def document(self, run_id: str) -> RunDocument:
        """The run as one document, equal to the one that was recorded."""
        run = self.run(run_id)
        stored = self._session.execute(
            select(
                models.Run.idempotency_key,
                models.Run.schema_version,
                models.Run.series_list_id,
                models.Run.partial,
            ).where(models.Run.key == run.key)
        ).one()
        listed = self._session.execute(
            select(models.SeriesListItem.definition_id)
            .where(models.SeriesListItem.list_id == stored.series_list_id)
            .order_by(models.SeriesListItem.position)
        ).scalars()
        definition_ids = list(listed)
        definitions = self._read_definitions(definition_ids)
        samples = [sample for _, _, _, sample in self._read_samples(_of_run(run))]
        return RunDocument(
            schema_version=stored.schema_version,
            id=run.id,
            idempotency_key=stored.idempotency_key,
            started=run.started,
            finished=run.finished,
            trigger=run.trigger,  # type: ignore[arg-type]
            tracker_version=run.tracker_version,
            ci_address=run.ci_address,
            engine=run.engine,
            machine=run.machine,
            tests=self.cards(run_id),
            series=tuple(definitions[definition_id] for definition_id in definition_ids),
            samples=tuple(samples),
            figures=self.figures(run_id),
            maps=self.maps(run_id),
            trajectories=self.trajectories(run_id),
            partial=stored.partial,
            asked=run.asked,
        )

    def to_dataframe(self, names: Iterable[str] = ()) -> pandas.DataFrame:
        """Every value of the runs that `names` stand for (none: all) as a pandas DataFrame, a row each.

        Columns: night, run, engine, version, git_hash, machine, test, configuration, metric, role, kind, time_step [s],
        unit, series, value, outcome, passed, set_point_held, limit_low, limit_high. TableError without pandas.
        """
        from spook_tracker.tracker.store.table import values_table

        runs = [self.resolve(name) for name in names] or self._runs
        return values_table(self._session, [run.key for run in runs])

    def _read_runs(self) -> tuple[RunInfo, ...]:
        connection = self._session.connection()
        found = connection.execute(select(models.EngineVersion.__table__)).mappings()
        engines = {row["id"]: rows.engine_of(dict(row)) for row in found}
        found = connection.execute(select(models.Machine.__table__)).mappings()
        machines = {row["id"]: rows.machine_of(dict(row)) for row in found}
        same = (
            "id", "started", "finished", "trigger", "tracker_version", "ci_address", "key", "started_at",
            "gates", "gates_passed",
        )  # fmt: skip
        columns = [getattr(models.Run, name) for name in (*same, "asked", "engine_version_id", "machine_id")]
        runs = [
            RunInfo(
                engine=engines[row[-2]],
                machine=machines[row[-1]],
                asked=rows.asked_of(row[-3]),
                **dict(zip(same, row[:-3], strict=True)),
            )
            for row in connection.execute(select(*columns))
        ]
        return self._in_commit_order(runs)

    def _in_commit_order(self, runs: list[RunInfo]) -> tuple[RunInfo, ...]:
        parents: dict[str, tuple[str, ...]] = {}
        age: dict[str, tuple[str, ...]] = {}
        for run in runs:
            if run.ordered:
                engine = run.engine
                parents[engine.git_hash] = engine.parents
                made = (_utc(engine.commit_time), _utc(run.started))
                age[engine.git_hash] = min(age.get(engine.git_hash, made), made)
        known = git.order(self.repository, age) if len(age) > 1 else []
        place = {
            commit: index for index, commit in enumerate(commit_order(age, parents, age.__getitem__, known))
        }
        last = len(place)
        ordered = sorted(
            runs,
            key=lambda run: (place[run.engine.git_hash] if run.ordered else last, run.started_at, run.id),
        )
        return tuple(in_release_order(ordered))

    def _read_names(self) -> dict[int, str]:
        """Series id to the key the series has today: renames followed to their end."""
        keys = {row.id: row.key for row in self._session.execute(select(models.Series.id, models.Series.key))}
        renamed: dict[int, int] = {}
        for row in self._session.execute(select(models.Alias.alias, models.Alias.series_id)):
            renamed.setdefault(models.identity("series", row.alias), row.series_id)
        names = {}
        for series_id in keys:
            today, steps = series_id, 0
            while today in renamed and steps <= len(renamed):  # the bound ends a circle of renames
                today, steps = renamed[today], steps + 1
            names[series_id] = keys.get(today, keys[series_id])
        return names

    def _ids_of(self, keys: Iterable[str]) -> list[int]:
        """Ids of all series that carry one of these names or have come to carry it."""
        wanted = set(keys)
        asked = {models.identity("series", key) for key in wanted}
        today = {self._canonical[series_id] for series_id in asked if series_id in self._canonical} | wanted
        return sorted(series_id for series_id, key in self._canonical.items() if key in today)

    def _read_definitions(self, ids: Iterable[int]) -> dict[int, SeriesDefinition]:
        lacking = sorted(set(ids) - self._definitions.keys())
        table = models.Definition
        for start in range(0, len(lacking), CHUNK):
            query = select(table.id, table.body).where(table.id.in_(lacking[start : start + CHUNK]))
            for row in self._session.execute(query):
                self._definitions[row.id] = rows.definition_of(row.body)
        return self._definitions

    def _read_samples(self, conditions: Sequence[ColumnElement[bool]], evidence: bool = True) -> list[Found]:
        """Samples in the order of time, then of their document."""
        sample, proof, timing = models.Sample, models.Evidence, models.Timing
        columns: list[Any] = [
            sample.run_key, sample.series_id, sample.definition_id, sample.value, sample.special,
            sample.outcome, sample.passed, sample.set_point_held,
        ]  # fmt: skip
        query = select(*columns)
        if evidence:
            query = (
                query.add_columns(
                    proof.failure, proof.state_hash, proof.counters, timing.seconds,
                    timing.runs_per_repeat, timing.instructions, timing.stage_seconds, timing.cpu_seconds,
                    timing.calibration,
                )
                .outerjoin(proof, _same_place(sample, proof))
                .outerjoin(timing, _same_place(sample, timing))
            )  # fmt: skip
        query = query.where(*conditions).order_by(sample.started_at, sample.run_key, sample.position)
        stored = self._session.connection().execute(query).all()
        definitions = self._read_definitions(row[2] for row in stored)
        runs = {run.key: run for run in self._runs}
        found = []
        for row in stored:
            if row[0] not in runs:  # recorded by another process since
                continue
            definition = definitions[row[2]]
            more: dict[str, Any] = {}
            if evidence and row[8] is not None:
                more = {"failure": row[8], "state_hash": row[9], "counters": rows.counters_of(row[10])}
            if evidence and row[11] is not None:
                more["timing"] = rows.timing_of(*row[11:17])
            read = Sample(
                series=definition.key,
                value=rows.joined(row[3], row[4]),
                outcome=row[5],
                passed=row[6],
                set_point_held=row[7],
                **more,
            )
            found.append((runs[row[0]], row[1], definition, read))
        return found

    def _bodies(self, model: Any, run_id: str, kind: type[Body]) -> tuple[Body, ...]:
        run = self.run(run_id)
        query = (
            select(model.body)
            .where(model.started_at == run.started_at, model.run_key == run.key)
            .order_by(model.position)
        )
        return tuple(rows.unpacked(body, kind) for body in self._session.execute(query).scalars())


@contextmanager
def _no_collection() -> Iterator[None]:
    """No garbage collection while millions of long-lived objects are made: it would halve the speed."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


def _of_run(run: RunInfo) -> list[ColumnElement[bool]]:
    """The leading columns of the key: one range of the table, however large it is."""
    return [models.Sample.started_at == run.started_at, models.Sample.run_key == run.key]


def _same_place(sample: Any, other: Any) -> ColumnElement[bool]:
    return and_(
        other.started_at == sample.started_at,
        other.run_key == sample.run_key,
        other.series_id == sample.series_id,
    )


def _utc(time: str) -> str:
    """A time as text that sorts; unknown times sort last."""
    try:
        return rows.moment(time).isoformat()
    except DocumentError:
        return LAST
