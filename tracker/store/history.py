"""Read the history: runs in commit order, two runs side by side, series over versions.

>>> history = History(session)                                        # doctest: +SKIP
>>> old, new = history.resolve("previous"), history.resolve("latest")  # doctest: +SKIP
>>> history.samples(new.id)["pendulum/plain/length/h=0.0166667"]       # doctest: +SKIP
"""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from datetime import timedelta
from functools import partial
from operator import lt
from pathlib import Path
from typing import TYPE_CHECKING

from spook_tracker.tracker.document.collection import no_collection
from spook_tracker.tracker.document.kept import Kept
from spook_tracker.tracker.document.points import Points, Stretches
from spook_tracker.tracker.document.run_document import (
    Point,
    Runs,
    Said,
    Sample,
    SeriesDefinition,
    SeriesHistory,
)

from .damage import told_of_damage
from .identity import identity
from .reader import (
    CHUNK,
    Reader,
    Row,
    file_reader,
    listed,
)
from .sample_rows import (
    OF_ITS_RUN,
    OF_RUN,
    SAMPLE,
    bare_sample_of,
    sample_rows,
)
from .stored_runs import A_DAY, StoredRuns
from .versions import RunInfo

if TYPE_CHECKING:
    import pandas
    from sqlalchemy.orm import Session

    from .columns import Lane
    from .evidence import Pair

__all__ = ["History", "Point", "RunInfo", "SeriesHistory"]


class History(StoredRuns):
    """What is stored, as of the moment the history is made, run by run and series by series."""

    def __init__(
        self, source: Session | Reader, repository: Path | None = None, ahead: timedelta = A_DAY
    ) -> None:
        super().__init__(source, repository, ahead)
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
        from .database import session_on

        with session_on(database, readonly=True) as session:
            yield cls(session, ahead=ahead)

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
        from .evidence import Behind

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
        from .lanes import histories_of, newest_definitions, read_lanes

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

    def to_dataframe(self, names: Iterable[str] = ()) -> pandas.DataFrame:
        """Every value of the runs that `names` stand for (none: all) as a pandas DataFrame, a row each.

        Columns: night, run, engine, version, git_hash, machine, test, configuration, metric, role, kind, time_step [s],
        unit, series, value, outcome, passed, set_point_held, limit_low, limit_high. TableError without pandas.
        """
        from .table import values_table

        runs = [self.resolve(name) for name in names] or self._runs
        return values_table(self._reader, [run.key for run in runs])

    def _ids_of(self, keys: Iterable[str]) -> list[int]:
        """Ids of all series that carry one of these names or have come to carry it."""
        wanted = set(keys)
        asked = {identity("series", key) for key in wanted}
        today = {self._canonical[series_id] for series_id in asked if series_id in self._canonical} | wanted
        return sorted(series_id for series_id, key in self._canonical.items() if key in today)


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
