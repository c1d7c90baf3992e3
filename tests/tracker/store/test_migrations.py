"""The tables in a database are those of the models, made at once or by revisions. They go up and down with rows."""

from __future__ import annotations

import hashlib
import signal
import sqlite3
from functools import partial
from shutil import copytree
from types import SimpleNamespace
from typing import get_args

import pytest
from alembic.script import ScriptDirectory
from sqlalchemy import DateTime, create_engine, inspect, select, text
from sqlalchemy.orm import Session

from spook_tracker.tracker.document.errors import DatabaseError
from spook_tracker.tracker.document.run_document import OutcomeClass
from spook_tracker.tracker.resources import resource
from spook_tracker.tracker.store import models, schema
from spook_tracker.tracker.store.connection import connected
from spook_tracker.tracker.store.database import database_url, head, open_database, upgrade
from spook_tracker.tracker.store.database_check import check
from spook_tracker.tracker.store.database_copy import digest
from spook_tracker.tracker.store.history import History
from spook_tracker.tracker.store.record import record
from spook_tracker.tracker.store.revisions import configuration, differences, revert
from spook_tracker.tracker.website.publish import publish
from tests.histories.documents import definition, run, run_of, sample
from tests.tracker.store.database_work import go_down_and_die, migrate_and_die
from tests.tracker.store.forked import begun, said

SCRIPTS = ScriptDirectory.from_config(configuration())
REVISIONS = [script.revision for script in reversed(list(SCRIPTS.walk_revisions()))]


def filled(session):
    """Rows in every table."""
    record(session, run_of({"old": 1.0}))
    record(session, run(series=(definition("new", aliases=("old",)),), samples=(sample("new", "nan"),)))


def counts(connection):
    return {
        name: connection.execute(text(f'SELECT count(*) FROM "{name}"')).scalar_one()
        for name in inspect(connection).get_table_names()
        if name != "alembic_version"
    }


def test_there_is_one_line_of_revisions_and_its_head_is_read_from_file_names():
    assert SCRIPTS.get_heads() == [head()]
    assert sorted(REVISIONS) == REVISIONS


@pytest.fixture
def climbed(url):
    """A session on a database that has gone up by every revision; a new one is made from the models at once."""
    engine = connected(database_url(url), readonly=False)
    upgrade(engine, REVISIONS[0])
    upgrade(engine)
    with Session(engine) as session:
        yield session
    engine.dispose()


def tables(connection):
    """All that the two databases know of the tables, but for the order of columns."""
    found = inspect(connection)

    def plain(value):
        if isinstance(value, dict):
            return sorted((name, plain(part)) for name, part in value.items())
        if isinstance(value, list):
            return sorted(map(plain, value), key=repr)
        return " ".join(str(value).split())

    return {
        name: {
            what: plain(getattr(found, f"get_{what}")(name))
            for what in (
                "columns",
                "pk_constraint",
                "foreign_keys",
                "unique_constraints",
                "check_constraints",
                "indexes",
            )
        }
        for name in [*found.get_table_names(), *found.get_view_names()]
    }


def test_the_newest_revision_is_the_models(climbed):
    with climbed.get_bind().connect() as connection:
        assert differences(connection) == []


def test_a_new_database_is_what_the_revisions_make(climbed, tmp_path):
    with climbed.get_bind().connect() as connection:
        by_revisions = tables(connection)
    if climbed.get_bind().dialect.name == "postgresql":
        with climbed.get_bind().begin() as connection:
            revert(connection, "base")
        upgrade(climbed.get_bind())
        new = climbed.get_bind()
    else:
        new = open_database(str(tmp_path / "new.db"))
    with new.connect() as connection:
        at_once = tables(connection)
    new.dispose()
    assert at_once.keys() == by_revisions.keys()
    for name, told in at_once.items():
        assert told == by_revisions[name], name


def test_a_difference_would_be_seen(session):
    with session.get_bind().connect() as connection:
        connection.execute(text("ALTER TABLE machine ADD COLUMN extra TEXT"))
        connection.execute(text("DROP INDEX ix_sample_series_id"))

        kinds = {difference[0] for difference in differences(connection)}

        assert kinds == {"remove_column", "add_index"}
        connection.rollback()


def test_revisions_carry_the_comments_of_the_models(postgresql_url):
    """SQLite keeps no comments; PostgreSQL shows them to readers of the tables."""
    engine = open_database(postgresql_url)
    inspector = inspect(engine)
    for table in models.Base.metadata.sorted_tables:
        assert inspector.get_table_comment(table.name)["text"] == table.comment
        stored = {column["name"]: column["comment"] for column in inspector.get_columns(table.name)}
        assert stored == {column.name: column.comment for column in table.columns}
    engine.dispose()


def test_every_class_of_outcome_can_be_stored(climbed):
    """A constraint left behind by an older revision refused one of them."""
    classes = get_args(OutcomeClass)
    keys = [f"t/c/m{place}" for place in range(len(classes))]
    samples = tuple(
        sample(key, 1.0, outcome=outcome, passed=False) for key, outcome in zip(keys, classes, strict=True)
    )
    record(climbed, run(series=tuple(definition(key) for key in keys), samples=samples))

    assert {row.outcome for row in climbed.scalars(select(models.Sample))} == set(classes)


def test_all_the_way_down_and_up_again(session, migrated_url):
    filled(session)
    session.close()
    engine = session.get_bind().engine
    with engine.connect() as connection:
        assert all(counts(connection).values()), "the stairs are walked with rows in every table"

    for step in reversed(REVISIONS):
        below = SCRIPTS.get_revision(step).down_revision or "base"
        with engine.begin() as connection:
            revert(connection, str(below))
        upgrade(engine, step, keep_copy=False)
        with engine.begin() as connection:
            revert(connection, str(below))

    with engine.connect() as connection:
        assert counts(connection) == {}
    upgrade(engine)
    filled(session)
    assert len(History(session).runs()) == 2


def at_head_with_rows(url):
    engine = open_database(url)
    with Session(engine) as session:
        filled(session)
    return engine


def pretend_a_newer_tracker(monkeypatch, tmp_path, body):
    """Add a revision to a copy of the migrations, as the next tracker will."""
    folder = copytree(resource("migrations"), tmp_path / "migrations")
    number = f"{len(REVISIONS) + 1:04}"
    (folder / "versions" / f"{number}_next.py").write_text(
        "import sqlalchemy as sa\nfrom alembic import op\n"
        f"revision = {number!r}\ndown_revision = {REVISIONS[-1]!r}\n\n"
        f"def upgrade():\n{body}\n\ndef downgrade():\n    pass\n"
    )
    monkeypatch.setattr("spook_tracker.tracker.store.head.resource", lambda name: folder)
    monkeypatch.setattr("spook_tracker.tracker.store.revisions.resource", lambda name: folder)
    return number


REBUILD = """
    with op.batch_alter_table("run") as batch:
        batch.alter_column("ci_address", nullable=True)
    with op.batch_alter_table("engine_version") as batch:
        batch.alter_column("flags", nullable=True)
"""


def test_rebuilding_a_table_costs_no_rows(url, monkeypatch, tmp_path):
    """On SQLite a rebuilt table is dropped; with foreign keys on, that would delete what refers to it."""
    engine = at_head_with_rows(url)
    with engine.connect() as connection:
        before = counts(connection)
        samples = digest(connection, models.Base.metadata.tables["sample"])
    engine.dispose()
    number = pretend_a_newer_tracker(monkeypatch, tmp_path, REBUILD)

    engine = open_database(url)

    with engine.connect() as connection:
        assert connection.execute(text("SELECT version_num FROM alembic_version")).scalar_one() == number
        assert counts(connection) == before
        assert digest(connection, models.Base.metadata.tables["sample"]) == samples
        if engine.dialect.name == "sqlite":
            assert connection.execute(text("PRAGMA foreign_keys")).scalar_one() == 1
            assert connection.execute(text("PRAGMA foreign_key_check")).all() == []
    engine.dispose()


def test_a_copy_of_the_file_is_kept_before_an_upgrade(sqlite_url, monkeypatch, tmp_path):
    at_head_with_rows(sqlite_url).dispose()
    pretend_a_newer_tracker(monkeypatch, tmp_path, REBUILD)

    open_database(sqlite_url).dispose()

    copies = list(tmp_path.glob("tracker.db.revision-*"))
    assert [path.name for path in copies] == [f"tracker.db.revision-{REVISIONS[-1]}"]
    kept = create_engine(f"sqlite:///{copies[0]}")
    with kept.connect() as connection:
        assert connection.execute(select(models.Run.id)).all()
        assert (
            connection.execute(text("SELECT version_num FROM alembic_version")).scalar_one() == REVISIONS[-1]
        )
    kept.dispose()


def test_a_copy_has_its_name_only_when_it_is_whole(sqlite_url, monkeypatch, tmp_path):
    """Killed while copying: the file that bears the name of a copy would hold nothing."""
    at_head_with_rows(sqlite_url).dispose()
    pretend_a_newer_tracker(monkeypatch, tmp_path, REBUILD)

    class Killed(sqlite3.Connection):
        def backup(self, target, **named):
            target.execute("CREATE TABLE half (done)")
            raise KeyboardInterrupt

    with monkeypatch.context() as dying:
        dying.setattr(schema, "sqlite3", SimpleNamespace(connect=partial(sqlite3.connect, factory=Killed)))
        with pytest.raises(KeyboardInterrupt):
            upgrade(connected(database_url(sqlite_url), readonly=False))
    assert [path.name for path in tmp_path.glob("*.revision-*") if path.suffix != ".part"] == []

    open_database(sqlite_url).dispose()
    assert [path.name for path in tmp_path.glob("*.revision-*")] == [f"tracker.db.revision-{REVISIONS[-1]}"]


def test_an_upgrade_that_fails_leaves_everything_as_it_was(url, monkeypatch, tmp_path):
    engine = at_head_with_rows(url)
    with engine.connect() as connection:
        before = counts(connection)
    engine.dispose()
    with monkeypatch.context() as newer:
        pretend_a_newer_tracker(newer, tmp_path, REBUILD + "    op.execute('SELECT * FROM nowhere')")
        with pytest.raises(DatabaseError, match="nowhere"):
            open_database(url)

    engine = open_database(url, readonly=True)
    with engine.connect() as connection:
        assert counts(connection) == before
        assert differences(connection) == []
    engine.dispose()


def test_an_older_database_is_not_upgraded_by_reading_it(url, monkeypatch, tmp_path):
    at_head_with_rows(url).dispose()
    pretend_a_newer_tracker(monkeypatch, tmp_path, REBUILD)

    with pytest.raises(DatabaseError, match="older schema than this tracker; run: tracker db upgrade"):
        open_database(url, readonly=True)


def test_a_newer_database_is_refused(url, monkeypatch, tmp_path):
    with monkeypatch.context() as newer:
        number = pretend_a_newer_tracker(newer, tmp_path, "    pass")
        at_head_with_rows(url).dispose()

    for readonly in (False, True):
        with pytest.raises(DatabaseError, match=f"has schema revision {number}, .* update the tracker"):
            open_database(url, readonly=readonly)


def test_no_key_of_a_large_table_lacks_the_time():
    """Hypertables and partitions ask for it, and that no table refers to the large ones."""
    metadata = models.Base.metadata
    large = {name for name, table in metadata.tables.items() if "run_key" in table.columns}

    assert large == {"sample", "evidence", "timing", "figure", "stability_map", "trajectory"}
    for name in large:
        table = metadata.tables[name]
        assert next(iter(table.primary_key.columns)).name == "started_at"
        assert all("started_at" in index.columns for index in table.indexes)
        assert not table.foreign_keys & {key for key in table.foreign_keys if key.column.table.name in large}
    for table in metadata.tables.values():
        assert {key.column.table.name for key in table.foreign_keys}.isdisjoint(large)


def test_every_table_and_column_says_what_it_holds():
    for table in models.Base.metadata.tables.values():
        assert table.comment
        for column in table.columns:
            assert column.comment, f"{table.name}.{column.name} has no comment"


def test_no_type_or_default_that_one_database_lacks():
    for table in models.Base.metadata.tables.values():
        for column in table.columns:
            assert column.server_default is None
            assert "ENUM" not in str(column.type).upper()
            if isinstance(column.type, DateTime):
                assert column.type.timezone


def test_urls_are_understood(monkeypatch):
    monkeypatch.delenv("TRACKER_DB", raising=False)
    assert str(database_url()) == "sqlite:///tracker.db"
    assert database_url("history.db").database == "history.db"
    monkeypatch.setenv("TRACKER_DB", "postgresql://user:secret@host/db")
    assert database_url().get_backend_name() == "postgresql"
    for wrong in ("mysql://host/db", "://", "sqlite://host:port/x"):
        with pytest.raises(DatabaseError):
            database_url(wrong)


def contents(url):
    """Every row of every table."""
    engine = create_engine(url)
    with engine.connect() as connection:
        found = {
            name: sorted(map(repr, connection.execute(text(f'SELECT * FROM "{name}"'))))
            for name in inspect(connection).get_table_names()
        }
    engine.dispose()
    return found


def test_down_and_up_again_loses_the_hash_of_what_was_measured_and_nothing_else(url, tmp_path):
    """Below 0010 there is none; a run without one is checked and published like those from before it. (No run time
    of these rows was taken again: that would be lost below 0009.)"""

    def of_columns(name):
        with engine.connect() as connection:
            found = connection.execute(text(f'SELECT * FROM "{name}"')).mappings().all()
        return sorted((dict(row) for row in found), key=repr)

    engine = at_head_with_rows(url)
    names = [name for name in inspect(engine).get_table_names() if name != "alembic_version"]
    before = {name: of_columns(name) for name in names}
    assert all(row["content"] for row in before["run"])
    with engine.begin() as connection:
        revert(connection, "0008")
    upgrade(engine, keep_copy=False)
    after = {name: of_columns(name) for name in names}

    assert {row["content"] for row in after["run"]} == {""}
    for rows in (before["run"], after["run"]):
        for row in rows:
            del row["content"]
        rows.sort(key=repr)
    assert after == before
    assert check(engine) == ()
    with Session(engine) as session:
        publish(History(session), tmp_path / "public")
    engine.dispose()
    assert list((tmp_path / "public" / "compare").glob("nights-*.js"))


def test_a_migration_that_moves_every_row_is_whole_or_absent_wherever_it_is_killed(url):
    """Revision 0008 gives every id a new number: up, down, and killed after each of several statements."""
    engine = at_head_with_rows(url)
    with (
        engine.begin() as connection
    ):  # what later revisions added is lost below them: the next test says what
        revert(connection, "0008")
    upgrade(engine, keep_copy=False)
    above = contents(url)
    with engine.begin() as connection:
        revert(connection, "0007")
    below = contents(url)
    engine.dispose()
    assert below != above
    assert {name: len(rows) for name, rows in below.items()} == {
        name: len(rows) for name, rows in above.items()
    }

    for statement in (1, 4, 9, 17):
        process, pipe = begun(migrate_and_die, url, statement)
        assert said(pipe) == []
        process.join()
        assert process.exitcode == -signal.SIGKILL
        assert contents(url) == below

    open_database(url).dispose()
    assert contents(url) == above

    for statement in (1, 6, 15, 40):
        process, pipe = begun(go_down_and_die, url, "0007", statement)
        assert said(pipe) == []
        process.join()
        assert process.exitcode == -signal.SIGKILL
        assert contents(url) == above

    with engine.begin() as connection:
        revert(connection, "0007")
    engine.dispose()
    assert contents(url) == below


def test_going_down_gives_the_ids_that_older_trackers_compute(session):
    """63 bits of the same hash: such a tracker finds its own runs again and stores nothing twice."""
    filled(session)
    keys = list(session.scalars(select(models.Series.key)))
    session.close()
    with session.get_bind().engine.begin() as connection:
        revert(connection, "0007")
        found = dict(connection.execute(text("SELECT key, id FROM series")).all())

    for key in keys:
        digest_of = hashlib.sha256(f"series\0{key}".encode()).digest()
        assert found[key] == int.from_bytes(digest_of[:8], "big") >> 1
