"""The SQL that lays tables out by month runs on a real PostgreSQL with runs in it; everything answers as before.

That for TimescaleDB and Citus is run on a real PostgreSQL whose extensions are stood in for by what they demand.

TimescaleDB wants the time in every unique key of a hypertable; Citus the distribution column in every one, and that
references from distributed tables go to reference tables. The stand-ins look all of this up in the server's catalogue.
"""

from __future__ import annotations

import re
from datetime import UTC, datetime

import pytest
from msgspec.structs import replace
from sqlalchemy import text
from sqlalchemy.orm import Session

from spook_tracker.tracker.document.json_form import encode
from spook_tracker.tracker.store import models
from spook_tracker.tracker.store.database import open_database
from spook_tracker.tracker.store.history import History
from spook_tracker.tracker.store.partition import is_large, statements
from spook_tracker.tracker.store.record import record
from spook_tracker.tracker.store.revisions import differences
from tests.histories.documents import definition, run, sample

IN_EVERY_KEY = """
CREATE FUNCTION in_every_key(laid regclass, wanted text) RETURNS void LANGUAGE plpgsql AS $$
BEGIN
    IF EXISTS (SELECT FROM pg_index i WHERE i.indrelid = laid AND i.indisunique AND NOT EXISTS (
        SELECT FROM pg_attribute a WHERE a.attrelid = laid AND a.attname = wanted AND a.attnum = ANY (i.indkey)))
    THEN RAISE EXCEPTION '% is not in every unique key of %', wanted, laid; END IF;
END $$"""
STAND_INS = {
    "timescaledb": (
        """CREATE FUNCTION create_hypertable(relation regclass, dimension name,
            chunk_time_interval interval DEFAULT NULL, migrate_data boolean DEFAULT false) RETURNS void
            LANGUAGE sql AS $$ SELECT in_every_key(relation, dimension) $$""",
    ),
    "citus": (
        "CREATE TABLE referred (name text)",
        """CREATE FUNCTION create_reference_table(laid regclass) RETURNS void LANGUAGE sql AS
            $$ INSERT INTO referred VALUES (laid::text) $$""",
        """CREATE FUNCTION create_distributed_table(laid regclass, wanted text, colocate_with regclass DEFAULT NULL)
            RETURNS void LANGUAGE plpgsql AS $$
            BEGIN
                PERFORM in_every_key(laid, wanted);
                IF EXISTS (SELECT FROM pg_constraint c WHERE c.conrelid = laid AND c.contype = 'f'
                    AND c.confrelid::regclass::text NOT IN (SELECT name FROM referred))
                THEN RAISE EXCEPTION '% refers to a table that is not a reference table', laid; END IF;
            END $$""",
    ),
}


@pytest.mark.parametrize("extension", ["timescaledb", "citus"])
def test_the_statements_ask_for_nothing_the_keys_do_not_give(postgresql_url: str, extension: str) -> None:
    engine = open_database(postgresql_url)
    with engine.begin() as connection:
        for statement in (IN_EVERY_KEY, *STAND_INS[extension]):
            connection.execute(text(statement.replace(":", "\\:")))
        first, *rest = statements(extension)  # type: ignore[arg-type]
        assert first == f"CREATE EXTENSION IF NOT EXISTS {extension};"
        for statement in rest:
            connection.execute(text(statement))
    engine.dispose()


def test_every_table_has_its_place() -> None:
    tables = models.Base.metadata.sorted_tables
    large = [table.name for table in tables if is_large(table)]
    by_time, over_servers = list(statements("timescaledb"))[1:], list(statements("citus"))[1:]

    assert [sql.split("'")[1] for sql in by_time] == large
    assert sorted(sql.split("'")[1] for sql in over_servers) == sorted(table.name for table in tables)


def test_the_stand_in_would_see_a_key_without_the_time(postgresql_url: str) -> None:
    engine = open_database(postgresql_url)
    with engine.begin() as connection:
        connection.execute(text(IN_EVERY_KEY.replace(":", "\\:")))
        with pytest.raises(Exception, match="not in every unique key"):
            connection.execute(text("SELECT in_every_key('run', 'started_at')"))
    engine.dispose()


def night(month: int, value: float):
    return run(
        series=(definition("t/c/m"),),
        samples=(sample("t/c/m", value),),
        started=f"2026-{month:02}-03T03:00:00+00:00",
    )


def test_months_of_postgresql_hold_what_was_there_and_what_comes(postgresql_url: str) -> None:
    engine = open_database(postgresql_url)
    before = [night(9, 0.1), night(10, float("nan")), night(11, -0.0)]
    with Session(engine) as session:
        for document in before:
            record(session, document)
        told = [encode(History(session).document(document.id)) for document in before]

    with engine.connect() as connection:
        driver = connection.connection.driver_connection
        driver.autocommit = True
        driver.execute("\n".join(statements("postgresql")))  # as psql does
        driver.autocommit = False
    engine.dispose()

    engine = open_database(postgresql_url)  # nothing to upgrade, nothing to refuse
    later = [night(12, 0.4), run(samples=(), series=(), started="2199-01-01T00:00:00+00:00")]
    with Session(engine) as session:
        for document in later:
            assert record(session, document)
        assert [encode(History(session).document(document.id)) for document in before] == told
        assert session.scalar(text("SELECT count(*) FROM run")) == 5
        (kept,) = session.execute(text("SELECT count(*) FROM months.sample_2026_10")).one()
        assert kept == 1
        assert len(session.execute(text("SELECT * FROM gate_values")).all()) == 4
    with engine.connect() as connection:
        assert differences(connection) == []
        connection.rollback()

        def read(condition: str) -> set[str]:
            plan = connection.execute(text(f"EXPLAIN SELECT * FROM sample WHERE {condition}")).scalars()
            return set(re.findall(r"sample_(\d{4}_\d\d|other)", "\n".join(plan)))

        assert read("started_at = '2026-10-03 03:00:00+00'") == {"2026_10"}
        since = "started_at >= '2026-11-01 00:00:00+00' AND started_at < '2026-12-15 00:00:00+00'"
        assert read(since) == {"2026_11", "2026_12"}
        assert {"2026_09", "2026_10", "other"} < read("series_id = 7")
    with engine.begin() as connection:  # a year later
        connection.execute(text("SELECT months.make(now(), INTERVAL '3 years')"))
    engine.dispose()


def test_months_are_made_for_nights_that_had_none(postgresql_url: str) -> None:
    """A clock that was wrong, before the tables are laid out or after it, and a team that forgot to make further months."""
    engine = open_database(postgresql_url)
    later = datetime.now(UTC).year + 5
    make = text(f"SELECT months.make('{later}-01-01 00:00:00+00', INTERVAL '6 years')")
    stray = [replace(night(3, 0.1), started=f"{year}-03-03T03:00:00+00:00") for year in (1970, later, 2199)]
    with Session(engine) as session:
        assert record(session, stray[0])
    with engine.connect() as connection:
        driver = connection.connection.driver_connection
        driver.autocommit = True
        driver.execute("\n".join(statements("postgresql")))
        driver.autocommit = False
    engine.dispose()

    engine = open_database(postgresql_url)
    parts = text(
        "SELECT substring(relname FROM 8), n FROM pg_class c JOIN pg_namespace s ON s.oid = relnamespace, "
        "LATERAL (SELECT (xpath('/row/n/text()', query_to_xml(format("
        "'SELECT count(*) AS n FROM months.%I', relname), false, true, '')))[1]::text::int AS n) AS held "
        "WHERE nspname = 'months' AND relkind = 'r' AND relname LIKE 'sample\\_%'"
    )
    with Session(engine) as session:
        held = dict(session.execute(parts).all())
        assert held["1970_03"] == 1
        assert (
            len(held) == 1 + 25 + 1
        )  # its month, this one and those of two years, and the part for the rest
        session.rollback()
        for document in stray[1:]:
            assert record(session, document)
        assert dict(session.execute(parts).all())["other"] == 2
        told = [encode(History(session).document(document.id)) for document in stray]
        session.execute(make)
        session.commit()
        held = dict(session.execute(parts).all())
        assert (held[f"{later}_03"], held["2199_03"], held["other"]) == (1, 1, 0)
        assert sum(held.values()) == 3
        assert [encode(History(session).document(document.id)) for document in stray] == told
        session.execute(make)  # finds nothing to do
        session.rollback()
    with engine.connect() as connection:
        assert differences(connection) == []
    engine.dispose()
