"""Read the history: runs in commit order, two runs side by side, series over versions.

>>> history = History(session)                                        # doctest: +SKIP
>>> old, new = history.resolve("previous"), history.resolve("latest")  # doctest: +SKIP
>>> history.samples(new.id)["pendulum/plain/length/h=0.0166667"]       # doctest: +SKIP
"""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from functools import partial
from operator import lt
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar, cast

from spook_tracker.tracker.document import run_document as document
from spook_tracker.tracker.document.collection import no_collection
from spook_tracker.tracker.document.errors import DocumentError, UnknownName
from spook_tracker.tracker.document.kept import Kept
from spook_tracker.tracker.document.points import Points, Stretches
from spook_tracker.tracker.document.run_document import (
    EngineVersion,
    Machine,
    Point,
    RunDocument,
    Runs,
    Said,
    Sample,
    SeriesDefinition,
    SeriesHistory,
)
from spook_tracker.tracker.store import git, rows
from spook_tracker.tracker.store.ancestry import commit_order, lineages
from spook_tracker.tracker.store.damage import told_of_damage
from spook_tracker.tracker.store.identity import identity
from spook_tracker.tracker.store.reader import (
    CHUNK,
    Reader,
    Row,
    SessionReader,
    SqlValue,
    file_reader,
    listed,
)
from spook_tracker.tracker.store.release_order import in_release_order
from spook_tracker.tracker.store.sample_rows import (
    OF_ITS_RUN,
    OF_RUN,
    SAMPLE,
    bare_sample_of,
    sample_of,
    sample_rows,
)
from spook_tracker.tracker.store.versions import RunInfo, resolve

if TYPE_CHECKING:
    import pandas
    from sqlalchemy.orm import Session

    from spook_tracker.tracker.store.columns import Lane
    from spook_tracker.tracker.store.evidence import Pair

__all__ = ["History", "Point", "RunInfo", "SeriesHistory"]

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


class History:
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
        self.kept = (
            Kept()
        )  # of an earlier reading: its runs are not read again by `series_of` and `evidence_of`
        self._lanes: dict[str, Lane] = {}

    @classmethod
    @contextmanager
    def open(cls, database: str, ahead: timedelta = A_DAY) -> Iterator[History]:
        """The history in a database, for reading: sqlite:///FILE or postgresql://…"""
        with told_of_damage(database):
            if (reader := file_reader(database)) is not None:
                with closing(reader):
                    yield cls(reader, ahead=ahead)
                return
        from spook_tracker.tracker.store.database import session_on

        with session_on(database, readonly=True) as session:
            yield cls(session, ahead=ahead)

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

    def samples_of(
        self, run_ids: Sequence[str], tests: set[str] | None = None, keys: Iterable[str] | None = None
    ) -> dict[str, dict[str, tuple[SeriesDefinition, Sample]]]:
        """The samples of several runs, of these tests or series (all if None): `samples` of each, read at once."""
        if tests is None and keys is None:
            return self._whole(run_ids)
        chosen = self._canonical.keys() if keys is None else self._ids_of(keys)
        wanted = [i for i in chosen if tests is None or self._canonical[i].partition("/")[0] in tests]
        series = listed(wanted)
        found: dict[str, dict[str, tuple[SeriesDefinition, Sample]]] = {run_id: {} for run_id in run_ids}
        for start in range(0, len(run_ids), CHUNK):
            runs = [self.run(run_id) for run_id in run_ids[start : start + CHUNK]]
            where = f"r.key IN {listed(run.key for run in runs)} AND {OF_ITS_RUN} AND s.series_id IN {series}"
            for run, series_id, definition, sample in self._read_samples(where, {}, by_run=True):
                key = self._canonical.get(series_id, definition.key)
                if key not in found[run.id] or definition.key == key:
                    found[run.id][key] = definition, sample
        return found

    def _whole(self, run_ids: Sequence[str]) -> dict[str, dict[str, Pair]]:
        """`samples` of each: what is equal is one object, and what is kept of them is not read again."""
        from spook_tracker.tracker.store.evidence import Behind

        behind = Behind(self.run(run_ids[0]).engine.name if run_ids else "", self.kept)
        found: dict[str, dict[str, Pair]] = {}
        for run_id in run_ids:
            run = self.run(run_id)
            read = partial(sample_rows, self._reader, OF_RUN, {"run": run.key})
            found[run_id] = {} if behind.take(run_id, run.key, run.content, read) else self.samples(run_id)
        behind.keep(self.kept)
        return found | behind.samples(self._canonical, self._read_definitions)

    def answered(self, run_ids: Sequence[str]) -> dict[str, set[tuple[str, str]]]:
        """By run: tests and kinds of the series that it has samples of."""
        places = {self.run(run_id).key: run_id for run_id in run_ids}
        having: dict[str, set[int]] = {run_id: set() for run_id in run_ids}
        for start in range(0, len(run_ids), CHUNK):
            runs = listed(self.run(run_id).key for run_id in run_ids[start : start + CHUNK])
            query = f"SELECT s.run_key, s.definition_id FROM run r CROSS JOIN sample s WHERE r.key IN {runs} AND {OF_ITS_RUN}"
            for run_key, definition_id in self._reader.rows(query):
                having[places[run_key]].add(definition_id)
        definitions = self._read_definitions({one for ids in having.values() for one in ids})
        kinds = {one: (definition.test, definition.kind) for one, definition in definitions.items()}
        return {run_id: {kinds[one] for one in ids} for run_id, ids in having.items()}

    def series(self, keys: Iterable[str] | None = None, *, evidence: bool = True) -> dict[str, SeriesHistory]:
        """Histories of all series or those named (by today's or an earlier name), by today's key.

        Unknown keys are left out. `evidence=False` leaves out failure, counters, state hash and timing, which
        makes reading long histories several times faster.
        """
        where = "" if keys is None else f"s.series_id IN {listed(self._ids_of(keys))}"
        with no_collection():
            return self._gathered(where, evidence)

    def series_of(self, engine: str) -> dict[str, SeriesHistory]:
        """Histories of all series over the runs of an engine, by today's key, without evidence.

        As `series` gives them: the definition is that of the newest run that has the series, whichever engine's it is.
        """
        from spook_tracker.tracker.store.lanes import histories_of, newest_definitions, read_lanes

        with no_collection():
            if not self._lanes:
                engines = dict.fromkeys(run.engine.name for run in self._runs)
                ours = {engine: self.runs(engine) for engine in engines}
                self._lanes = read_lanes(self._reader, ours, self.kept)
            place = {run.key: i for i, run in enumerate(self._runs)}
            newest = newest_definitions(self._lanes, place, self._canonical, self._read_definitions)
            return histories_of(
                self._lanes[engine], self.runs(engine), newest, self._canonical, self._read_definitions
            )

    def _gathered(self, where: str, evidence: bool) -> dict[str, SeriesHistory]:
        if not evidence:
            return self._bare(where)
        gathered: dict[str, dict[int, tuple[SeriesDefinition, Sample]]] = {}
        place = {run.key: i for i, run in enumerate(self._runs)}
        for run, series_id, definition, sample in self._read_samples(where, {}):
            key = self._canonical.get(series_id, definition.key)
            here = place.get(run.key)
            if here is None:  # dated ahead
                continue
            points = gathered.setdefault(key, {})
            if here not in points or definition.key == key:
                points[here] = definition, sample
        result = {}
        for key in sorted(gathered):
            points = gathered[key]
            ordered = sorted(points)
            told = [
                Point(self._runs[i], sample, d.test_version) for i in ordered for d, sample in (points[i],)
            ]
            result[key] = SeriesHistory(points[ordered[-1]][0], tuple(told))
        return result

    def _bare(self, where: str) -> dict[str, SeriesHistory]:
        """The same without evidence: what says the same night after night is read into one object."""
        place = {run.key: i for i, run in enumerate(self._runs)}
        gathered: dict[
            int, tuple[array[int], array[int]]
        ] = {}  # by series id: places of runs, and of what they say
        known: dict[Row, int] = {}  # rows without run and series
        query = f"SELECT {SAMPLE} FROM sample s" + (f" WHERE {where}" if where else "")
        for run_key, series_id, *told in self._reader.each_row(query):
            here = place.get(run_key)
            if here is None:  # dated ahead, or recorded by another process since
                continue
            if (columns := gathered.get(series_id)) is None:
                columns = gathered[series_id] = array("l"), array("l")
            columns[0].append(here)
            columns[1].append(known.setdefault(tuple(told), len(known)))
        definitions = self._read_definitions(told[0] for told in known)
        said = [
            (definitions[i], (bare_sample_of(definitions[i].key, *told), definitions[i].test_version, True))
            for i, *told in known
        ]
        by_key: dict[str, list[int]] = {}
        for series_id, (_, of_series) in gathered.items():
            key = self._canonical.get(series_id, said[of_series[0]][0].key)
            by_key.setdefault(key, []).append(series_id)
        shared: dict[bytes, Runs] = {}
        result = {}
        for key in sorted(by_key):
            places, what = _in_order(key, [gathered.pop(i) for i in by_key[key]], said)
            name = places.tobytes()
            if name not in shared:
                shared[name] = Runs(self._runs[i] for i in places)
            result[key] = SeriesHistory(
                said[what[-1]][0], Points(shared[name], Stretches.of([said[i][1] for i in what]))
            )
        return result

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

    def to_dataframe(self, names: Iterable[str] = ()) -> pandas.DataFrame:
        """Every value of the runs that `names` stand for (none: all) as a pandas DataFrame, a row each.

        Columns: night, run, engine, version, git_hash, machine, test, configuration, metric, role, kind, time_step [s],
        unit, series, value, outcome, passed, set_point_held, limit_low, limit_high. TableError without pandas.
        """
        from spook_tracker.tracker.store.table import values_table

        runs = [self.resolve(name) for name in names] or self._runs
        return values_table(self._reader, [run.key for run in runs])

    def _read_runs(self) -> tuple[RunInfo, ...]:
        engines = {
            row["id"]: rows.engine_of(row) for row in self._table("engine_version", document.EngineVersion)
        }
        machines = {row["id"]: rows.machine_of(row) for row in self._table("machine", document.Machine)}
        columns = ", ".join(
            f'"{name}"' for name in (*RUN, "started_at", "asked", "engine_version_id", "machine_id")
        )
        runs = [
            RunInfo(
                engine=engines[row[-2]],
                machine=machines[row[-1]],
                asked=rows.asked_of(row[-3]),
                started_at=rows.stored_moment(row[-4]),
                **dict(zip(RUN, row[:-4], strict=True)),
            )
            for row in self._reader.rows(f"SELECT {columns} FROM run")
        ]
        return self._in_commit_order(runs)

    def _table(self, table: str, kind: type[EngineVersion | Machine]) -> list[rows.Row]:
        """The rows of a table that holds such things, by their columns."""
        columns = ("id", *kind.__struct_fields__)
        named = ", ".join(f'"{name}"' for name in columns)
        return [
            dict(zip(columns, row, strict=True)) for row in self._reader.rows(f"SELECT {named} FROM {table}")
        ]

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
        lineage = lineages(age, parents, known)
        runs = [replace(run, lineage=lineage[run.engine.git_hash]) if run.ordered else run for run in runs]
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

    def _ids_of(self, keys: Iterable[str]) -> list[int]:
        """Ids of all series that carry one of these names or have come to carry it."""
        wanted = set(keys)
        asked = {identity("series", key) for key in wanted}
        today = {self._canonical[series_id] for series_id in asked if series_id in self._canonical} | wanted
        return sorted(series_id for series_id, key in self._canonical.items() if key in today)

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


def _in_order(
    key: str, parts: Sequence[tuple[array[int], array[int]]], said: Sequence[tuple[SeriesDefinition, Said]]
) -> tuple[array[int], array[int]]:
    """The columns of a series over the runs in their order; today's name wins over an earlier one in the same run."""
    (places, told), *others = parts
    if not others and all(map(lt, places, places[1:])):
        return places, told
    chosen: dict[int, int] = {}
    for here, what in ((here, what) for part in parts for here, what in zip(*part, strict=True)):
        if here not in chosen or said[what][0].key == key:
            chosen[here] = what
    ordered = array("l", sorted(chosen))
    return ordered, array("l", map(chosen.__getitem__, ordered))


def _utc(time: str) -> str:
    """A time as text that sorts; unknown times sort last."""
    try:
        return rows.moment(time).isoformat()
    except DocumentError:
        return LAST
