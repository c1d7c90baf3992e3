"""Recording stores a document whole, exactly and once; reading gives the same document back."""

from __future__ import annotations

import math
import struct

import msgspec
import pytest
from sqlalchemy.orm import Session

from spook_tracker.tracker.document import run_document as document
from spook_tracker.tracker.document.errors import DatabaseError, DocumentError
from spook_tracker.tracker.store.database import open_database
from spook_tracker.tracker.store.history import History
from spook_tracker.tracker.store.record import record
from tests.histories.documents import KEY, definition, figure, run, run_of, sample, stability_map


def bits(value: float) -> bytes:
    return struct.pack("<d", value)


def test_a_recorded_document_comes_back_equal(session):
    given = run(
        series=(
            definition(),
            definition("b", limit=(0.0, 1.0), better="inside"),
            definition("c", limit=None),
        ),
        samples=(
            sample("b", "nan"),
            sample(KEY, timing=None),
            sample("c", failure="", counters={}, state_hash=""),
        ),
        figures=(figure("one"), figure("two")),
        maps=(stability_map("one"), stability_map("two")),
    )

    assert record(session, given)

    assert History(session).document(given.id) == given


def test_a_recorded_run_is_there_for_every_reader_at_once(session, migrated_url):
    given = run()
    record(session, given)

    reader = open_database(migrated_url, readonly=True)
    with Session(reader) as reading:
        assert [info.id for info in History(reading).runs()] == [given.id]
    reader.dispose()


@pytest.mark.parametrize(
    "value", [0.1 + 0.2, 5e-324, -1.7976931348623157e308, 0.0, -0.0, 2.0**53 + 2, "nan", "inf", "-inf"]
)
def test_every_float_comes_back_with_the_same_bits(session, value):
    given = run_of({KEY: value})

    record(session, given)

    _, stored = History(session).samples(given.id)[KEY]
    assert bits(stored.value) == bits(float(value))
    assert stored.value == float(value) or math.isnan(float(value))


def test_the_same_idempotency_key_is_stored_once(session):
    given = run()

    assert record(session, given)
    assert not record(session, given)
    assert len(History(session).runs()) == 1


def test_a_second_run_with_the_same_id_is_refused(session):
    given = run()
    record(session, given)

    with pytest.raises(DatabaseError, match="another run with the id"):
        record(session, msgspec.structs.replace(given, idempotency_key="another"))


def test_text_that_databases_refuse_is_made_storable(session):
    given = run(ci_address="a\0b\ud800c\U0001f600")

    record(session, given)

    assert History(session).run(given.id).ci_address == "a\ufffdb\ufffdc\U0001f600"


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"samples": (sample("unknown"),)}, "does not define"),
        ({"samples": (sample(), sample())}, "2 samples"),
        ({"series": (definition(), definition())}, "defined 2 times"),
        ({"started": "yesterday"}, "is not a time"),
        ({"series": (definition(tolerance=math.nan),)}, r"tolerance"),
        ({"samples": (sample(value="nan", outcome="value"),)}, "called good"),
        ({"samples": (sample(counters={"steps": 2**64}),)}, "64 bits"),
        ({"trigger": "whim"}, "trigger"),
        (
            {"workers": (document.Worker(fingerprint="a", processor="b", operating_system="c", pieces=0),)},
            r"workers.*pieces",
        ),
    ],
)
def test_a_document_that_makes_no_sense_is_refused_and_nothing_is_stored(session, changes, words):
    with pytest.raises(DocumentError, match=words):
        record(session, run(**changes))

    assert History(session).runs() == ()


def test_the_machines_that_measured_come_back(session):
    ash = document.Worker(fingerprint="ash", processor="a", operating_system="Linux", pieces=3)
    oak = document.Worker(fingerprint="oak", processor="b", operating_system="Linux", pieces=1)
    given = run(workers=(ash, oak))

    record(session, given)

    assert History(session).document(given.id).workers == (ash, oak)


def test_storage_knows_every_field_of_the_document():
    """A field added to the document needs a column: without one it would silently be dropped."""
    assert document.Sample.__struct_fields__ == (
        "series", "value", "outcome", "passed", "set_point_held", "failure", "counters", "state_hash",
        "timing",
    )  # fmt: skip
    assert document.Timing.__struct_fields__ == (
        "seconds",
        "runs_per_repeat",
        "instructions",
        "stage_seconds",
        "cpu_seconds",
        "calibration",
        "again",
    )
    assert document.RunDocument.__struct_fields__ == (
        "schema_version", "id", "idempotency_key", "started", "finished", "trigger", "tracker_version",
        "ci_address", "engine", "machine", "tests", "series", "samples", "figures", "maps",
        "trajectories", "partial", "asked", "workers",
    )  # fmt: skip
