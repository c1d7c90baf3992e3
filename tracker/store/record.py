"""Store runs: each in one transaction, alone or with others. Killed at any moment, a run is whole or absent."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

from sqlalchemy import Table, insert, or_, select, update
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from spook_tracker.tracker.document.errors import DatabaseError
from spook_tracker.tracker.document.run_document import RunDocument

from . import models, rows
from .border import checked
from .database import in_words, one_writer
from .identity import identity
from .reader import SqlValue

if TYPE_CHECKING:
    from spook_tracker.tracker.document.run_document import FigureData, MapData, Trajectory

ATTEMPTS = 5  # at storing, when other processes store the same things at the same time
CHUNK = 500  # ids in one IN (...), well below every database's limit
Present = dict[tuple[str, int], rows.Row]  # by table and id
PRESENT = "rows known to be there"  # where a session keeps them


def record(session: Session, run: RunDocument) -> bool:
    """Store `run` and commit. False if a run with the same idempotency key was there: nothing changes then.

    DocumentError if the document is not valid, DatabaseError if it cannot be written; either way nothing is.
    """
    return record_checked(session, checked(run))


def record_checked(session: Session, run: RunDocument) -> bool:
    """The same for a document that tracker/store/border.py has given out."""
    return record_together(session, [run])[0]


def record_together(session: Session, runs: Sequence[RunDocument]) -> list[bool]:
    """The same for several such documents in one transaction: whether each of them was new."""
    with in_words(session):
        for attempt in range(ATTEMPTS):
            there = dict(session.info.get(PRESENT, {}))
            try:
                stored = [_store(session, run, there) for run in runs]
                session.commit()
                session.info[PRESENT] = there
                return stored
            except IntegrityError:  # another process stored the same engine, series, ... meanwhile
                session.rollback()
                session.info.pop(PRESENT, None)
                if attempt == ATTEMPTS - 1:
                    raise
            except BaseException:
                session.rollback()
                raise
    raise AssertionError("unreachable")


def _known(session: Session, run: RunDocument) -> bool:
    """Whether the run is stored, asked once: between two questions another process could store it."""
    same = or_(models.Run.idempotency_key == run.idempotency_key, models.Run.id == run.id)
    keys = set(session.scalars(select(models.Run.idempotency_key).where(same)))
    if keys and run.idempotency_key not in keys:
        raise DatabaseError(f"another run with the id {run.id!r} is already stored; give this one a new id")
    return bool(keys)


def _store(session: Session, run: RunDocument, there: Present) -> bool:
    one_writer(session)  # two that insert the same rows in another order would wait for each other
    if _known(session, run):
        return False
    engine, machine = rows.engine_row(run.engine), rows.machine_row(run.machine)
    cards = rows.cards_row(run.tests)
    definitions = [rows.definition_row(definition) for definition in run.series]
    _ensure(session, models.EngineVersion, [engine], there)
    _ensure(session, models.Machine, [machine], there)
    _ensure(session, models.TestCards, [cards], there)
    ids = {definition.key: row["series_id"] for definition, row in zip(run.series, definitions, strict=True)}
    _ensure(session, models.Series, [{"id": ids[key], "key": key} for key in sorted(ids)], there)
    _ensure_aliases(session, run)
    _ensure(session, models.Definition, definitions, there)
    list_id = _ensure_list(session, [definition["id"] for definition in definitions])

    gates = {definition.key for definition in run.series if definition.role == "gate"}
    gate_samples = [sample for sample in run.samples if sample.series in gates]
    started_at, run_key = rows.moment(run.started), identity("run", run.id)
    session.execute(
        insert(models.Run),
        {
            "key": run_key,
            "id": run.id,
            "idempotency_key": run.idempotency_key,
            "started_at": started_at,
            "started": run.started,
            "finished": run.finished,
            "trigger": run.trigger,
            "tracker_version": run.tracker_version,
            "ci_address": run.ci_address,
            "schema_version": run.schema_version,
            "partial": run.partial,
            "asked": rows.asked_text(run.asked),
            "workers": rows.workers_text(run.workers),
            "engine_version_id": engine["id"],
            "machine_id": machine["id"],
            "test_cards_id": cards["id"],
            "series_list_id": list_id,
            "gates": sum(sample.outcome != "not_supported" for sample in gate_samples),
            "gates_passed": sum(sample.passed for sample in gate_samples),
            "content": rows.content_of(run, definitions),
        },
    )
    place = {"started_at": started_at, "run_key": run_key}
    definition_ids = dict(zip((d.key for d in run.series), (row["id"] for row in definitions), strict=True))
    samples, evidence, timings = [], [], []
    for position, sample in enumerate(run.samples):
        here = place | {"series_id": ids[sample.series]}
        where = {"definition_id": definition_ids[sample.series], "position": position}
        samples.append(here | where | rows.sample_row(sample))
        if (proof := rows.evidence_row(sample)) is not None:
            evidence.append(here | proof)
        if sample.timing is not None:
            timings.append(here | rows.timing_row(sample.timing))
    _append(session, models.Sample, samples)
    _append(session, models.Evidence, evidence)
    _append(session, models.Timing, timings)
    _append(session, models.Figure, _bodies(place, run.figures))
    _append(session, models.StabilityMap, _bodies(place, run.maps))
    _append(session, models.Trajectory, _bodies(place, run.trajectories))
    return True


def _bodies(place: rows.Row, parts: Sequence[FigureData | MapData | Trajectory]) -> list[rows.Row]:
    return [
        place | {"position": position, "test": part.test, "name": part.name, "body": rows.packed(part)}
        for position, part in enumerate(parts)
    ]


def _append(session: Session, model: type[models.Base], new: list[rows.Row]) -> None:
    """Insert rows, all with the same columns: by the driver, for SQLAlchemy looks at each value of each row."""
    if not new:
        return
    connection, table, names = session.connection(), model.__table__, list(new[0])
    assert isinstance(table, Table)
    mark = {"qmark": "?", "format": "%s", "pyformat": "%s"}[connection.dialect.paramstyle]
    columns, marks = ", ".join(f'"{name}"' for name in names), ", ".join([mark] * len(names))
    values: Iterable[tuple[SqlValue, ...]] = (tuple(row.values()) for row in new)
    if "started_at" in names:  # the one column that a database may write in a way of its own; it comes first
        kind = table.c.started_at.type.dialect_impl(connection.dialect)
        written = lru_cache(kind.bind_processor(connection.dialect) or (lambda moment: moment))
        values = ((written(moment), *rest) for moment, *rest in values)
    connection.exec_driver_sql(f'INSERT INTO "{table.name}" ({columns}) VALUES ({marks})', list(values))


def _ensure(session: Session, model: type[models.Base], wanted: list[rows.Row], there: Present) -> None:
    """Insert the rows whose id is not there yet. Equal ids mean equal content, which is verified.

    `there` are rows of which that is known: such rows are never changed or removed.
    """
    table = model.__table__
    assert isinstance(table, Table)
    by_id = {row["id"]: row for row in wanted if there.get((table.name, row["id"])) != row}
    new = dict(by_id)
    for ids in _chunks(sorted(by_id)):
        for stored in session.execute(select(table).where(table.c.id.in_(ids))).mappings():
            if dict(stored) != new.pop(stored["id"]):
                raise DatabaseError(f"two different rows of {table.name} have the id {stored['id']}")
    _append(session, model, list(new.values()))
    there.update(((table.name, row_id), row) for row_id, row in by_id.items())


def add_again(session: Session, run: RunDocument) -> None:
    """Store what was timed once more after the run was recorded; it is written once and never changed."""
    table, place = models.Timing, {"started_at": rows.moment(run.started), "run_key": identity("run", run.id)}
    for sample in run.samples:
        if sample.timing is not None and sample.timing.again is not None:
            here = place | {"series_id": identity("series", sample.series)}
            session.execute(
                update(table).filter_by(**here, again="").values(again=rows.json_of(sample.timing.again))
            )
    content = update(models.Run).where(models.Run.id == run.id).values(content=rows.content_of(run))
    session.execute(content)
    session.commit()


def _ensure_aliases(session: Session, run: RunDocument) -> None:
    wanted = {
        (alias, identity("series", definition.key))
        for definition in run.series
        for alias in definition.aliases
        if alias != definition.key
    }
    if wanted:
        table = models.Alias
        there = session.execute(
            select(table.alias, table.series_id).where(
                table.alias.in_(sorted({alias for alias, _ in wanted}))
            )
        )
        wanted -= {(row.alias, row.series_id) for row in there}
    _append(session, models.Alias, [{"alias": alias, "series_id": id_} for alias, id_ in sorted(wanted)])


def _ensure_list(session: Session, definition_ids: list[int]) -> int:
    list_id = identity("series list", rows.json_of(definition_ids))
    if session.get(models.SeriesList, list_id) is None:
        session.execute(insert(models.SeriesList), {"id": list_id, "length": len(definition_ids)})
        items = [
            {"list_id": list_id, "position": position, "definition_id": definition_id}
            for position, definition_id in enumerate(definition_ids)
        ]
        _append(session, models.SeriesListItem, items)
    return list_id


def _chunks(ids: Sequence[int]) -> Iterable[Sequence[int]]:
    return (ids[start : start + CHUNK] for start in range(0, len(ids), CHUNK))
