"""What a column gives back is what was put in, on every database."""

from __future__ import annotations

import math
import random
import struct
import zlib
from datetime import UTC, datetime, timedelta, timezone

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from sqlalchemy import insert, select
from sqlalchemy.exc import IntegrityError

from spook_tracker.tracker.document.errors import DatabaseError
from spook_tracker.tracker.document.json_form import Number
from spook_tracker.tracker.document.outside import clean_text
from spook_tracker.tracker.document.run_document import RunDocument
from spook_tracker.tracker.store import models, rows
from spook_tracker.tracker.store.border import checked
from spook_tracker.tracker.store.history import History
from spook_tracker.tracker.store.identity import identity
from spook_tracker.tracker.store.record import record
from spook_tracker.tracker.store.rows import joined, split
from tests.histories.documents import KEY, definition, run, sample

ANY_TEXT = st.text(st.characters(), max_size=60)
ANY_FLOAT = st.floats(allow_nan=True, allow_infinity=True, width=64)
STORED = settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])


def same_bits(one: float, other: float) -> bool:
    return struct.pack("<d", one) == struct.pack("<d", other) or (math.isnan(one) and math.isnan(other))


@given(ANY_FLOAT)
def test_any_float_survives_being_split_into_columns(value):
    assert same_bits(joined(*split(value)), value)


@STORED
@given(value=ANY_FLOAT, words=ANY_TEXT, finite=st.floats(allow_nan=False, allow_infinity=False), key=ANY_TEXT)
def test_any_float_and_any_text_come_back_from_the_database(session, value, words, finite, key):
    outcome = "value" if math.isfinite(value) else "not_finite"
    key = key or "key"
    given_run = run(
        ci_address=words,
        series=(
            definition(key, description=words, parameters={words: finite}, reference=finite, limit=finite),
        ),
        samples=(
            sample(key, Number(value), outcome=outcome, passed=False, failure=words, counters={words: 1}),
        ),
    )

    record(session, given_run)

    stored = History(session).document(given_run.id)
    assert stored == checked(given_run)
    assert same_bits(stored.samples[0].value, value)
    assert same_bits(stored.series[0].reference, finite)
    assert same_bits(stored.series[0].parameters[clean_text(words)], finite)
    if clean_text(words) == words and clean_text(key) == key:
        assert stored == given_run


@pytest.mark.parametrize(
    "words",
    [
        "<script>alert(1)</script>", "{{7*7}}", "=cmd()", "../../etc/passwd", "a\r\nb", "\u202eRTL\u202c",
        "x" * 65_536, "💥" * 1000, "'; DROP TABLE run; --", "%s %(x)s :x ?", "\\", "\ufeff", "e\u0301", "\uffff",
    ],
    ids=range(14),
)  # fmt: skip
def test_hostile_text_is_data(session, words):
    given_run = run(ci_address=words, samples=(sample(failure=words),))

    record(session, given_run)

    assert History(session).document(given_run.id) == given_run


@pytest.mark.parametrize(
    ("hostile", "clean"),
    [
        ("a\0b", "a\ufffdb"),
        ("\ud800", "\ufffd"),
        ("\udc80x", "\ufffdx"),
        ("\ud83d\udca5", "💥"),
        ("ok", "ok"),
    ],
)
def test_text_no_database_takes_is_replaced(hostile, clean):
    assert clean_text(hostile) == clean


def test_a_document_keeps_every_field_of_its_parts(session):
    """Equality of documents compares values; -0.0 equals 0.0 there, so look closer."""
    given_run = run(series=(definition(limit=-0.0, set_point=(-0.0, 1.0)),))

    record(session, given_run)

    stored = History(session).document(given_run.id).series[0]
    assert same_bits(stored.limit, -0.0)
    assert same_bits(stored.set_point[0], -0.0)


def test_times_are_utc_whatever_their_zone(session):
    east = timezone(timedelta(hours=9))
    for number, hour in enumerate(
        ("2026-11-21T12:00:00+09:00", "2026-11-21T03:00:00Z", "2026-11-21T03:00:00")
    ):
        record(session, run(id=f"run {number}", started=hour))

    stored = set(session.scalars(select(models.Run.started_at)))

    assert stored == {datetime(2026, 11, 21, 12, tzinfo=east)}
    assert {time.tzinfo for time in stored} == {UTC}


def test_a_time_without_a_zone_is_refused_by_the_column(session):
    with pytest.raises(DatabaseError, match="has no zone"):
        session.scalars(select(models.Run).where(models.Run.started_at > datetime(2026, 1, 1)))


@pytest.mark.parametrize(
    "wrong",
    [
        {"outcome": "fine"},
        {"value": None},
        {"special": "nan"},
        {"special": "NaN"},
        {"run_key": 1},
        {"series_id": 1},
    ],
    ids=str,
)
def test_a_sample_that_makes_no_sense_is_refused_by_the_database(session, wrong):
    """The last line of defence: the tables themselves say no."""
    record(session, run())
    row = dict(session.execute(select(models.Sample.__table__)).mappings().one())

    with pytest.raises(IntegrityError):
        session.execute(insert(models.Sample), row | {"started_at": row["started_at"] + timedelta(1)} | wrong)


def test_identities_are_the_same_everywhere_and_fit_a_column():
    """These numbers stand in databases: they may never change but by a migration, as 0008 took ten bits off each."""
    assert identity("series", KEY) == 9216153591385901499 >> 10
    assert all(0 <= identity("series", str(number)) < 2**53 for number in range(1000))
    assert identity("run", "x") != identity("series", "x")


def test_the_document_is_frozen():
    with pytest.raises(AttributeError):
        run().id = "other"  # type: ignore[misc]
    assert RunDocument.__struct_config__.frozen


def test_bodies_kept_compressed_are_bounded_by_bytes():
    kept = rows.Compressed(1000)
    contents = [random.Random(n).randbytes(300) for n in range(9)]
    bodies = [kept.of(content) for content in contents]

    assert list(map(zlib.decompress, bodies)) == contents
    assert 600 < kept.size == sum(map(len, kept.bodies.values())) <= 1000
    assert kept.of(contents[-1]) is bodies[-1]
    assert kept.of(contents[0]) is not bodies[0], "the oldest went first"
    before = dict(kept.bodies)
    assert zlib.decompress(kept.of(bytes(random.Random(9).randbytes(2000))))
    assert kept.bodies == before, "what is larger than all of it drives nothing out"
