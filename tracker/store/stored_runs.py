"""Runs as they are stored: in commit order, and each of them as the document that was recorded."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar, cast

from spook_tracker.tracker.document import run_document as document
from spook_tracker.tracker.document.errors import DocumentError, UnknownName
from spook_tracker.tracker.document.run_document import (
    EngineVersion,
    Machine,
    RunDocument,
    Sample,
    SeriesDefinition,
)

from . import git, rows
from .ancestry import commit_order, lineages
from .identity import identity
from .reader import (
    CHUNK,
    Reader,
    SessionReader,
    SqlValue,
    listed,
)
from .release_order import in_release_order
from .sample_rows import (
    OF_RUN,
    sample_of,
    sample_rows,
)
from .versions import RunInfo, is_ordered, resolve

if TYPE_CHECKING:
    from sqlalchemy.orm import Session


A_DAY = timedelta(days=1)  # by which clocks may differ, and time zones be mistaken
LAST = "9999"  # sorts after every time: commits whose time is unknown
Body = TypeVar("Body")
RUN = (
    "id",
    "started",
    "finished",
    "trigger",
    "tracker_version",
    "ci_address",
    "key",
    "gates",
    "gates_passed",
    "content",
)
Found = tuple[RunInfo, int, SeriesDefinition, Sample]  # run, series id, definition, sample


class StoredRuns:
    """What is stored, as of the moment the history is made. `repository`: where git may know tags.

    A run that says it began later than that, by more than `ahead`, is among `ahead` and in no history: some
    clock was wrong, and until its day came it would be the newest. By its id it can be read and removed.
    """

    def __init__(
        self, source: Session | Reader, repository: Path | None = None, ahead: timedelta = A_DAY
    ) -> None:
        self._reader = cast("Reader", source) if hasattr(source, "rows") else SessionReader(source)
        self.repository = repository or Path.cwd()
        every, latest = self._read_runs(), datetime.now(UTC) + ahead
        self._runs = tuple(run for run in every if run.started_at <= latest)
        self.ahead = tuple(run for run in every if run.started_at > latest)
        self._by_id = {run.id: run for run in every}
        self._by_key = {run.key: run for run in every}
        self._canonical = self._read_names()
        self._definitions: dict[int, SeriesDefinition] = {}
        self._with_maps: frozenset[str] | None = None
        self._maps: dict[str, tuple[document.MapData, ...]] = {}  # by run, those that were asked for

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

    def content(self, run_id: str) -> str:
        """A hash of all that was measured in a run; empty where it is not known."""
        return self.run(run_id).content

    def resolve(self, name: str) -> RunInfo:
        """The run `name` stands for: see tracker/store/versions.py. UnknownName if none or several."""
        if name in {run.id for run in self.ahead}:
            return self._by_id[name]
        return resolve(self._runs, name, lambda tag: git.commit(self.repository, tag))

    def dated_ahead(self) -> str:
        """A sentence that names the runs dated ahead and the way out; empty if there are none."""
        if not self.ahead:
            return ""
        first = self.ahead[0]
        many = f"{len(self.ahead)} runs are" if len(self.ahead) > 1 else "1 run is"
        return (
            f"{many} dated ahead of this clock and left out, such as {first.id}, {first.started}; where that is "
            f"wrong: tracker db remove {first.id}"
        )

    def samples(self, run_id: str) -> dict[str, tuple[SeriesDefinition, Sample]]:
        """Every sample of a run with its definition in that run, by the key the series has today."""
        run = self.run(run_id)
        found = {}
        for _, series_id, definition, sample in self._read_samples(OF_RUN, {"run": run.key}):
            key = self._canonical.get(series_id, definition.key)
            if key not in found or definition.key == key:  # today's name wins over an earlier one
                found[key] = definition, sample
        return found

    def figures(self, run_id: str) -> tuple[document.FigureData, ...]:
        """The figures of a run; empty once the retention rule has dropped them."""
        return self._bodies("figure", run_id, document.FigureData)

    def maps(self, run_id: str) -> tuple[document.MapData, ...]:
        """The stability maps of a run; empty once the retention rule has dropped them."""
        if run_id not in self._maps:
            self._maps[run_id] = self._bodies("stability_map", run_id, document.MapData)
        return self._maps[run_id]

    def with_maps(self) -> frozenset[str]:
        """Ids of the runs that have stability maps; read once."""
        if self._with_maps is None:
            having = {key for (key,) in self._reader.rows("SELECT DISTINCT run_key FROM stability_map")}
            self._with_maps = frozenset(run.id for run in self._runs if run.key in having)
        return self._with_maps

    def trajectories(self, run_id: str) -> tuple[document.Trajectory, ...]:
        """The motions recorded in a run; empty once the retention rule has dropped them."""
        return self._bodies("trajectory", run_id, document.Trajectory)

    def cards(self, run_id: str) -> tuple[document.TestCard, ...]:
        """What the run says about its tests."""
        of_run = "SELECT c.body FROM run r JOIN test_cards c ON c.id = r.test_cards_id WHERE r.key = :run"
        ((body,),) = self._reader.rows(of_run, run=self.run(run_id).key)
        return rows.cards_of(body)

    def document(self, run_id: str) -> RunDocument:
        """The run as one document, equal to the one that was recorded."""
        run = self.run(run_id)
        ((key, schema_version, list_id, partial, workers),) = self._reader.rows(
            "SELECT idempotency_key, schema_version, series_list_id, partial, workers FROM run WHERE key = :run",
            run=run.key,
        )
        items = "SELECT definition_id FROM series_list_item WHERE list_id = :list ORDER BY position"
        definition_ids = [found for (found,) in self._reader.rows(items, list=list_id)]
        definitions = self._read_definitions(definition_ids)
        samples = [sample for _, _, _, sample in self._read_samples(OF_RUN, {"run": run.key})]
        return RunDocument(
            schema_version=schema_version,
            id=run.id,
            idempotency_key=key,
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
            partial=bool(partial),
            asked=run.asked,
            workers=rows.workers_of(workers),
        )

    def _read_runs(self) -> tuple[RunInfo, ...]:
        engines = {
            row["id"]: rows.engine_of(row) for row in self._table("engine_version", document.EngineVersion)
        }
        machines = {row["id"]: rows.machine_of(row) for row in self._table("machine", document.Machine)}
        columns = ", ".join(
            f'"{name}"' for name in (*RUN, "started_at", "asked", "engine_version_id", "machine_id")
        )
        stored = [
            (rows.stored_moment(began), engines[engine], machines[machine], rows.asked_of(asked), told)
            for *told, began, asked, engine, machine in self._reader.rows(f"SELECT {columns} FROM run")
        ]
        place, lineage = self._commits((engine, started) for started, engine, *_ in stored)
        last = len(place)
        runs = [
            RunInfo(
                started_at=started, engine=engine, machine=machine, asked=asked,
                lineage=lineage[engine.git_hash] if is_ordered(engine) else "",
                **dict(zip(RUN, told, strict=True)),
            )
            for started, engine, machine, asked, told in stored
        ]  # fmt: skip
        runs.sort(
            key=lambda run: (place[run.engine.git_hash] if run.ordered else last, run.started_at, run.id)
        )
        return tuple(in_release_order(runs))

    def _commits(
        self, runs: Iterable[tuple[EngineVersion, datetime]]
    ) -> tuple[dict[str, int], dict[str, str]]:
        """Of what was run and when: by commit, its place in the order of commits and its lineage."""
        parents: dict[str, tuple[str, ...]] = {}
        age: dict[str, tuple[str, ...]] = {}
        for engine, started in runs:
            if is_ordered(engine):
                parents[engine.git_hash] = engine.parents
                made = _utc(engine.commit_time), started.isoformat()
                age[engine.git_hash] = min(age.get(engine.git_hash, made), made)
        known = git.order(self.repository, age) if len(age) > 1 else []
        ordered = commit_order(age, parents, age.__getitem__, known)
        return {commit: place for place, commit in enumerate(ordered)}, lineages(age, parents, known)

    def _table(self, table: str, kind: type[EngineVersion | Machine]) -> list[rows.Row]:
        """The rows of a table that holds such things, by their columns."""
        columns = ("id", *kind.__struct_fields__)
        named = ", ".join(f'"{name}"' for name in columns)
        return [
            dict(zip(columns, row, strict=True)) for row in self._reader.rows(f"SELECT {named} FROM {table}")
        ]

    def _read_names(self) -> dict[int, str]:
        """Series id to the key the series has today: renames followed to their end."""
        keys = {row[0]: row[1] for row in self._reader.rows('SELECT id, "key" FROM series')}
        renamed: dict[int, int] = {}
        for alias, series_id in self._reader.rows("SELECT alias, series_id FROM series_alias"):
            renamed.setdefault(identity("series", alias), series_id)
        names = {}
        for series_id in keys:
            today, steps = series_id, 0
            while today in renamed and steps <= len(renamed):  # the bound ends a circle of renames
                today, steps = renamed[today], steps + 1
            names[series_id] = keys.get(today, keys[series_id])
        return names

    def _read_definitions(self, ids: Iterable[int]) -> dict[int, SeriesDefinition]:
        lacking = sorted(set(ids) - self._definitions.keys())
        for start in range(0, len(lacking), CHUNK):
            query = f"SELECT id, body FROM definition WHERE id IN {listed(lacking[start : start + CHUNK])}"
            for definition_id, body in self._reader.rows(query):
                self._definitions[definition_id] = rows.definition_of(body)
        return self._definitions

    def _read_samples(self, where: str, parameters: dict[str, SqlValue], by_run: bool = False) -> list[Found]:
        """Samples in the order of time, then of their document; `by_run` where the conditions name runs."""
        stored = sample_rows(self._reader, where, parameters, by_run)
        definitions = self._read_definitions(row[2] for row in stored)
        runs = self._by_key
        found = []
        for row in stored:
            if row[0] not in runs:  # recorded by another process since
                continue
            definition = definitions[row[2]]
            found.append((runs[row[0]], row[1], definition, sample_of(definition.key, row)))
        return found

    def _bodies(self, table: str, run_id: str, kind: type[Body]) -> tuple[Body, ...]:
        query = f"SELECT s.body FROM {table} s WHERE {OF_RUN} ORDER BY s.position"
        return tuple(
            rows.unpacked(body, kind) for (body,) in self._reader.rows(query, run=self.run(run_id).key)
        )


def _utc(time: str) -> str:
    """A time as text that sorts; unknown times sort last."""
    try:
        return rows.moment(time).isoformat()
    except DocumentError:
        return LAST
