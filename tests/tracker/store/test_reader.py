"""The history read by SQLite's driver alone is the history read through SQLAlchemy, and starts without it."""

import sqlite3
import subprocess
import sys
from pathlib import Path

import pytest

from spook_tracker.tracker.document.errors import DatabaseError
from spook_tracker.tracker.document.json_form import encode
from spook_tracker.tracker.store.database import session_on
from spook_tracker.tracker.store.history import History
from spook_tracker.tracker.store.reader import file_reader
from spook_tracker.tracker.store.record import record
from tests.histories.documents import run


@pytest.fixture
def database(tmp_path: Path) -> str:
    url = f"sqlite:///{tmp_path / 'tracker.db'}"
    with session_on(url) as session:
        record(session, run(id="one", idempotency_key="one"))
        record(session, run(id="two", idempotency_key="two", started="2026-11-22T03:17:00+00:00"))
    return url


def test_both_roads_lead_to_the_same_history(database: str) -> None:
    alone = file_reader(database)
    assert alone is not None
    with session_on(database, readonly=True) as session:
        through, direct = History(session), History(alone)
        assert direct.runs() == through.runs()
        for info in through.runs():
            assert encode(direct.document(info.id)) == encode(through.document(info.id))
        assert direct.series() == through.series()
        keys = through.series_keys()
        ids = [info.id for info in through.runs()]
        assert direct.samples_of(ids, keys=keys[:1]) == through.samples_of(ids, keys=keys[:1]) != {}
    alone.close()


def test_as_many_series_and_runs_are_read_as_are_asked_for_whatever_the_driver_binds(database: str) -> None:
    alone = file_reader(database)
    assert alone is not None
    alone.connection.setlimit(sqlite3.SQLITE_LIMIT_VARIABLE_NUMBER, 0)  # usually 32766
    history = History(alone)
    keys, ids = history.series_keys(), [info.id for info in history.runs()]
    assert keys and len(ids) == 2
    assert tuple(history.series(keys)) == keys
    assert all(tuple(sorted(samples)) == keys for samples in history.samples_of(ids, keys=keys).values())
    assert history.series([]) == {}
    alone.close()


def test_a_comparison_starts_without_sqlalchemy(database: str) -> None:
    script = f"""
import sys
from click.testing import CliRunner
from spook_tracker.tracker.cli.main import main
result = CliRunner().invoke(main, ["compare", "one", "two", "--db", {database!r}], standalone_mode=False)
assert "identical" in result.output, result.output
heavy = {{"sqlalchemy", "alembic", "numpy", "pandas", "jinja2", "asyncio"}} & sys.modules.keys()
assert not heavy, heavy
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]


def test_a_website_a_trend_and_a_verdict_are_made_without_sqlalchemy(database: str, tmp_path: Path) -> None:
    asked = [["publish", "--out", str(tmp_path / "site")], ["trend", "pendulum"], ["judge", "two"]]
    script = f"""
import sys
from click.testing import CliRunner
from spook_tracker.tracker.cli.main import main
for command in {asked!r}:
    result = CliRunner().invoke(main, [*command, "--db", {database!r}])
    assert result.exit_code in (0, 1), result.output + result.stderr
    assert "sqlalchemy" not in sys.modules, command
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]


@pytest.mark.parametrize(
    "statement",
    [
        "UPDATE alembic_version SET version_num = '0001'",
        "CREATE TRIGGER t AFTER INSERT ON run BEGIN DELETE FROM run; END",
        "DROP TABLE alembic_version",
    ],
)
def test_a_file_out_of_the_ordinary_is_left_to_those_who_know(database: str, statement: str) -> None:
    with sqlite3.connect(database.removeprefix("sqlite:///")) as connection:
        connection.execute(statement)
    connection.close()
    assert file_reader(database) is None
    with pytest.raises(DatabaseError), History.open(database):
        pass


@pytest.mark.parametrize(
    "name", ["", "sqlite://", "sqlite:///:memory:", "postgresql://host/name", "sqlite:///a?mode=ro"]
)
def test_only_plain_files_are_read_alone(name: str) -> None:
    assert file_reader(name) is None


def test_damage_met_while_reading_is_one_sentence(database: str) -> None:
    reader = file_reader(database)
    assert reader is not None
    with pytest.raises(DatabaseError, match=r"tracker\.db failed: no such table"):
        reader.rows("SELECT 1 FROM nowhere")
    reader.close()


def test_nothing_is_written_on_this_road(database: str) -> None:
    reader = file_reader(database)
    assert reader is not None
    with pytest.raises(DatabaseError, match="read-only"):
        reader.rows("DELETE FROM run")
    reader.close()
