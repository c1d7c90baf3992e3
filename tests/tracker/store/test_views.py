"""Views for people who ask with SQL, on both databases: the same rows as the library reads, and every column explained."""

from __future__ import annotations

import pandas
import pytest
from sqlalchemy import inspect, text

from spook_tracker.tracker.judge.standing import is_red
from spook_tracker.tracker.store import models
from spook_tracker.tracker.store.history import History
from spook_tracker.tracker.store.record import record
from spook_tracker.tracker.store.revisions import revert
from spook_tracker.tracker.store.table import write_table
from spook_tracker.tracker.store.views import ABOUT, COLUMNS, columns_of
from tests.histories.documents import definition, engine, run, sample

GATE = {"role": "gate", "limit": 1.0, "set_point": (-0.5, 0.5)}


def two_nights(session):
    """Two engines; of one an older night that was worse."""
    series = (*tuple(definition(f"t/c/m{n}", **GATE) for n in range(4)), definition("t/c/r", role="reported"))
    values = (
        sample("t/c/m0", 0.25),
        sample("t/c/m1", 0.75, set_point_held=False),
        sample("t/c/m2", "nan", outcome="not_finite", passed=False, set_point_held=False),
        sample("t/c/m3", "nan", outcome="not_supported", passed=False, set_point_held=False),
        sample("t/c/r", 7.0),
    )
    worse = (sample("t/c/m0", 9.0, outcome="out_of_limit", passed=False, set_point_held=False), *values[1:])
    newest = run(series=series, samples=values, started="2026-11-20T03:00:00+00:00")
    record(session, run(series=series, samples=worse, started="2026-11-19T03:00:00+00:00"))
    record(session, newest)
    other = engine(name="other", git_hash="")
    record(
        session, run(series=series[:1], samples=values[:1], engine=other, started="2026-11-18T03:00:00+00:00")
    )
    return newest


def rows(session, query):
    return [dict(row) for row in session.execute(text(query)).mappings()]


def test_gate_values_by_night_need_no_join(session):
    two_nights(session)

    found = rows(
        session, "SELECT * FROM gate_values WHERE series = 't/c/m0' AND engine = 'spook' ORDER BY night"
    )

    assert [row["value"] for row in found] == [9.0, 0.25]
    assert [bool(row["passed"]) for row in found] == [False, True]
    assert {(row["limit_low"], row["limit_high"]) for row in found} == {(-1.0, 1.0)}
    assert len(rows(session, "SELECT * FROM gate_values")) == 9  # nothing that is only reported


def test_the_latest_verdicts_are_those_of_the_judge(session):
    newest = two_nights(session)
    defined = {d.key: d for d in newest.series if d.role == "gate"}

    found = {
        r["series"]: r["verdict"]
        for r in rows(session, "SELECT * FROM latest_verdicts WHERE engine = 'spook'")
    }

    expected = {
        s.series: "not supported" if s.outcome == "not_supported"
        else "red" if is_red(defined[s.series], s) else "green"
        for s in newest.samples
        if s.series in defined
    }  # fmt: skip
    assert found == expected
    assert set(found.values()) == {"green", "red", "not supported"}
    assert len(rows(session, "SELECT * FROM latest_verdicts WHERE engine = 'other'")) == 1


def test_run_times_read_the_shortest_and_the_mean_of_the_repeats(session):
    document = run()
    record(session, document)
    timed = {s.series: s for s in document.samples if s.timing is not None}
    assert timed

    for row in rows(session, "SELECT * FROM run_times"):
        seconds = timed[row["series"]].timing.seconds
        assert row["seconds"] == min(seconds)
        assert abs(row["middle_seconds"] - sum(seconds) / len(seconds)) <= 1e-15 * max(seconds) + 1e-300
    assert len(rows(session, "SELECT * FROM run_times")) == len(timed)


def test_every_column_of_every_table_and_view_is_explained(session):
    """Also on SQLite, which keeps no comments."""
    told = {
        (r["table_name"], r["column_name"]): r["comment"]
        for r in rows(session, "SELECT * FROM column_comments")
    }
    inspector = inspect(session.connection())

    for table in models.Base.metadata.tables.values():
        assert told[table.name, ""] == table.comment
        assert {c.name: told[table.name, c.name] for c in table.columns} == {
            c.name: c.comment for c in table.columns
        }
    for view in ABOUT:
        assert [c["name"] for c in inspector.get_columns(view)] == columns_of(view)
        assert all(told[view, name] for name in columns_of(view))
    assert set(COLUMNS) == {name for view in ABOUT for name in columns_of(view)}


def test_no_id_is_larger_than_what_javascript_holds_exactly(session):
    two_nights(session)

    for table in models.Base.metadata.tables.values():
        for column in table.columns:
            if column.name in ("id", "key") or column.name.endswith(("_id", "_key")):
                numbers = list(session.scalars(text(f'SELECT "{column.name}" FROM "{table.name}"')))
                assert all(isinstance(n, str) or 0 <= n < 2**53 for n in numbers), (table.name, column.name)


def test_views_do_not_stand_in_the_way_of_going_down(session):
    two_nights(session)
    session.close()
    bound = session.get_bind().engine
    with bound.begin() as connection:
        revert(connection, "0007")
        assert inspect(connection).get_view_names() == []


def test_the_history_as_a_dataframe_keeps_every_bit(session):
    series = tuple(definition(f"t/c/m{n}") for n in range(5))
    numbers = (0.1 + 0.2, "nan", "inf", -0.0, 5e-324)
    record(
        session,
        run(series=series, samples=tuple(sample(s.key, n) for s, n in zip(series, numbers, strict=True))),
    )

    table = History(session).to_dataframe()

    assert [float(n).hex() for n in table["value"]] == [float(n).hex() for n in numbers]
    assert list(table["series"]) == [s.key for s in series]
    assert str(table["night"].dtype).endswith("UTC]")


@pytest.mark.parametrize("form", ["csv", "parquet"])
def test_a_table_written_and_read_again_keeps_every_bit(session, tmp_path, form):
    series = tuple(definition(f"t/c/m{n}") for n in range(4))
    numbers = (0.1 + 0.2, "inf", -0.0, 5e-324)
    samples = tuple(sample(s.key, n) for s, n in zip(series, numbers, strict=True))
    record(session, run(series=series, samples=samples))
    file = tmp_path / f"values.{form}"

    assert write_table(History(session).to_dataframe(), file, form) == 4

    read = pandas.read_csv(file) if form == "csv" else pandas.read_parquet(file)
    assert [float(n).hex() for n in read["value"]] == [float(n).hex() for n in numbers]
    assert list(read["series"]) == [s.key for s in series]
