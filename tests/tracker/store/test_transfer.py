"""Runs travel as files, whole histories between databases; what arrives is what was sent."""

from __future__ import annotations

import json

import jsonschema
import msgspec
import pytest
from msgspec.structs import replace
from sqlalchemy import delete, select, text, update
from sqlalchemy.orm import Session

from spook_tracker.tracker.document.errors import DatabaseError, DocumentError
from spook_tracker.tracker.document.json_form import decode
from spook_tracker.tracker.document.run_document import RunDocument
from spook_tracker.tracker.document.schema import document_schema
from spook_tracker.tracker.store import border, models, transfer
from spook_tracker.tracker.store.database import open_database
from spook_tracker.tracker.store.database_check import check
from spook_tracker.tracker.store.database_copy import copy_database
from spook_tracker.tracker.store.history import History
from spook_tracker.tracker.store.record import record
from spook_tracker.tracker.store.retention import drop_old_figures
from spook_tracker.tracker.store.storage_counts import statistics
from spook_tracker.tracker.store.transfer import encoded, export_runs, import_files, read_document
from tests.histories.documents import KEY, definition, engine, figure, run, run_of, stability_map


def recorded(session, *runs):
    for document in runs:
        assert record(session, document)
    return runs


def test_exported_runs_are_the_recorded_ones(session, tmp_path):
    given = recorded(session, run(), run_of({KEY: "nan", "b": -0.0}))

    files = export_runs(History(session), tmp_path / "out")

    assert {read_document(file).id: read_document(file) for file in files} == {d.id: d for d in given}


def test_only_the_runs_named_are_exported(session, tmp_path):
    one, _ = recorded(session, run(), run())

    (file,) = export_runs(History(session), tmp_path, [one.id, one.id])

    assert read_document(file) == one


def test_importing_twice_changes_nothing(session, tmp_path):
    given = run()
    (tmp_path / "run.json").write_bytes(encoded(given))

    assert import_files(session, [tmp_path]).stored == (given.id,)
    assert import_files(session, [tmp_path / "run.json"]).present == (given.id,)
    assert History(session).document(given.id) == given


def test_runs_stored_together_are_each_whole_or_absent_and_an_import_broken_off_goes_on(
    session, tmp_path, monkeypatch
):
    given = [run_of({KEY: float(n), "b": -0.0}) for n in range(5)]
    for place, document in enumerate(given):
        (tmp_path / f"{place}.json").write_bytes(encoded(document))
    monkeypatch.setattr(transfer, "TOGETHER", 4)  # two runs of two samples each
    store, told = transfer.record_together, []

    def breaks_off(session, runs):
        if told:
            raise KeyboardInterrupt
        told.append(runs)
        return store(session, runs)

    monkeypatch.setattr(transfer, "record_together", breaks_off)
    with pytest.raises(KeyboardInterrupt):
        import_files(session, [tmp_path])
    assert {found.id for found in History(session).runs()} == {document.id for document in given[:2]}
    session.rollback()

    monkeypatch.setattr(transfer, "record_together", store)
    done = import_files(session, [tmp_path])

    assert (len(done.present), len(done.stored)) == (2, 3)
    assert [History(session).document(document.id) for document in given] == given


def test_what_a_session_knows_to_be_there_is_asked_again_once_it_is_not(session, url):
    record(session, run())
    other = open_database(url)
    with Session(other) as elsewhere:  # nothing of ours does this; a hand in the database may
        for table in reversed(models.Base.metadata.sorted_tables):
            elsewhere.execute(delete(table))
        elsewhere.commit()
    other.dispose()
    again = run()

    assert record(session, again)
    assert History(session).document(again.id) == again


def test_every_type_of_a_document_has_a_rule_for_what_can_be_stored_of_it():
    fits = border._fits(RunDocument)

    assert fits(run())
    for series in (run().series[0], replace(run().series[0], aliases=("a" * (border.MAX_TEXT + 1),))):
        assert fits(run(series=(series,))) == (series.aliases == run().series[0].aliases)


def test_one_bad_file_and_nothing_is_imported(session, tmp_path):
    (tmp_path / "a.json").write_bytes(encoded(run()))
    (tmp_path / "b.json").write_bytes(b'{"schema_version": 1}')

    with pytest.raises(DocumentError, match=r"b\.json is not a valid run document: .*required field"):
        import_files(session, [tmp_path])

    assert History(session).runs() == ()


def test_an_id_from_outside_never_names_a_path(session, tmp_path):
    recorded(session, run(id="../../etc/passwd"), run(id="CON"), run(id="💥"))

    files = export_runs(History(session), tmp_path / "out")

    assert len(files) == 3
    assert all(file.parent == tmp_path / "out" and file.name.isascii() for file in files)


@pytest.mark.parametrize("line_number", [0, 5])
def test_an_exported_file_keeps_the_published_schema(line_number):
    document = json.loads(encoded(run_of({KEY: ["nan", 1.0][line_number > 0]})))

    jsonschema.Draft202012Validator.check_schema(document_schema())
    jsonschema.validate(document, document_schema())


def test_the_published_schema_refuses_what_import_refuses():
    document = json.loads(encoded(run()))
    document["samples"][0]["outcome"] = "fine"

    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(document, document_schema())
    with pytest.raises(DocumentError, match=r"samples\[0\].outcome|samples\[\.\.\.\].outcome|outcome"):
        border.decoded(json.dumps(document).encode())


def changed(change):
    document = json.loads(encoded(run()))
    change(document)
    return json.dumps(document).encode()


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "not JSON"),
        (b"\xff\xfe", "not JSON"),
        (b"[]", "Expected `object`"),
        (b"[" * 100_000, "Expected `object`"),
        (b'{"a":' * 600 + b"1" + b"}" * 600, "unknown field `a`"),
        (b'{"schema_version": NaN}', "not JSON"),
        (b'{"schema_version": 1, "id": NaN}', "id"),
        (b'{"schema_version": 1e999}', "out of range"),
        (changed(lambda d: d.update(extra=1)), "unknown field"),
        (changed(lambda d: d.update(schema_version=2)), "schema_version"),
        (changed(lambda d: d.update(ci_address="x" * 70_000)), "a text of 70000 characters|length <= 65536"),
        (changed(lambda d: d["samples"][0].update(value="Infinity")), "value"),
        (changed(lambda d: d["samples"][0].update(value=None)), "value"),
        (changed(lambda d: d["engine"].update(name="")), "length >= 1"),
        (changed(lambda d: d.update(started="2026-13-45")), "is not a time"),
        (changed(lambda d: d["machine"].update(cores=2**70)), "64 bits|out of range"),
    ],
    ids=lambda value: value[:20] if isinstance(value, str) else "content",
)
def test_what_is_not_a_run_document_is_refused_in_one_line(content, words):
    with pytest.raises(DocumentError, match=words) as caught:
        border.decoded(content, "x.json")

    assert str(caught.value).startswith("x.json")
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 400


@pytest.mark.parametrize(
    ("written", "read"),
    [
        (rb"\ud800", "\ufffd"),
        (rb"a\udc00b", "a\ufffdb"),
        (rb"\ud83d\udca5", "💥"),
        (rb"\ud83d\ud83d\udca5\udca5", "\ufffd💥\ufffd"),
        (rb"\ud83dx\udca5", "\ufffdx\ufffd"),
        (rb"\\ud800", "\\ud800"),
        (rb"\u0000", "\ufffd"),
    ],
)
def test_text_of_other_tools_is_made_storable(written, read):
    content = encoded(run(ci_address="here")).replace(b"here", written)

    assert border.decoded(content).ci_address == read


@pytest.mark.parametrize(
    "spoiled",
    [
        {"counters": {"a\0b": 1}},
        {"counters": {"steps": 2**63}},
        {"failure": "a\0b"},
        {"failure": "x" * 70_000},
        {"value": "nan", "outcome": "value"},
    ],
)
def test_what_is_wrong_deep_inside_a_file_is_found_on_the_quick_way_too(spoiled):
    content = changed(lambda d: d["samples"][0].update(spoiled))

    def told(way):
        try:
            return way()
        except (DocumentError, msgspec.ValidationError) as error:
            return str(error)

    quick = told(lambda: border.decoded(content))
    thorough = told(lambda: border.checked(decode(content, RunDocument)))

    assert quick == thorough or str(quick).endswith(str(thorough))
    assert quick != told(lambda: decode(content, RunDocument))


def test_a_file_too_large_is_refused_before_it_is_read_whole(tmp_path, monkeypatch):
    monkeypatch.setattr("spook_tracker.tracker.store.transfer.MAX_BYTES", 1000)
    monkeypatch.setattr("spook_tracker.tracker.store.border.MAX_BYTES", 1000)
    (tmp_path / "a.json").write_bytes(encoded(run()))

    with pytest.raises(DocumentError, match="at most 1000"):
        read_document(tmp_path / "a.json")


def test_a_missing_file_and_an_empty_folder_are_named(session, tmp_path):
    with pytest.raises(DocumentError, match=r"nothing\.json cannot be read: No such file"):
        import_files(session, [tmp_path / "nothing.json"])
    with pytest.raises(DocumentError, match=r"holds no \*\.json files"):
        import_files(session, [tmp_path])


def test_export_into_a_file_is_refused(session, tmp_path):
    (tmp_path / "file").write_text("mine")

    with pytest.raises(DocumentError, match="cannot be made"):
        export_runs(History(session), tmp_path / "file")

    assert (tmp_path / "file").read_text() == "mine"


def everything():
    """Runs that put rows into every table, with the values databases disagree about."""
    renamed = definition(
        "new", aliases=("old",), limit=-0.0, reference=-0.0, time_step=None, parameters={"x": -0.0}
    )
    return (
        run_of({"old": 5e-324, "b": "nan", "c": "inf", "d": "-inf", "e": -0.0, "f": 0.1 + 0.2}),
        run(series=(renamed,), samples=(), ci_address="a\0b\ud800 Größe 💥 'quoted' \\ %s {{7*7}}"),
    )


@pytest.mark.parametrize("kinds", [("sqlite", "postgresql"), ("postgresql", "sqlite"), ("sqlite", "sqlite")])
def test_a_history_moves_between_databases_without_loss(request, tmp_path, kinds):
    source = request.getfixturevalue(f"{kinds[0]}_url")
    target = (
        f"sqlite:///{tmp_path}/copy.db" if kinds[1] == "sqlite" else request.getfixturevalue("postgresql_url")
    )
    old = open_database(source)
    with Session(old) as session:
        recorded(session, *everything())
        given = [History(session).document(info.id) for info in History(session).runs()]
    old.dispose()

    digests = copy_database(source, target)

    assert set(digests) == set(models.Base.metadata.tables)
    assert all(digest.rows for digest in digests.values())  # rows in every table
    new = open_database(target, readonly=True)
    with Session(new) as session:
        assert [History(session).document(info.id) for info in History(session).runs()] == given
    assert check(new) == ()
    new.dispose()


def test_a_copy_into_a_used_database_is_refused(session, migrated_url, tmp_path):
    recorded(session, run())
    session.close()

    with pytest.raises(DatabaseError, match="already holds runs"):
        copy_database(migrated_url, migrated_url)


def test_a_copy_that_arrives_changed_is_taken_back(session, migrated_url, tmp_path, monkeypatch):
    recorded(session, run())
    session.close()
    monkeypatch.setattr("spook_tracker.tracker.store.database_copy.digest", lambda connection, table: None)

    with pytest.raises(DatabaseError, match="differs; nothing was copied"):
        copy_database(migrated_url, f"sqlite:///{tmp_path}/copy.db")

    copied = open_database(f"sqlite:///{tmp_path}/copy.db")
    assert sum(statistics(copied).rows.values()) == 0
    copied.dispose()


def test_check_finds_nothing_wrong_with_a_history(session):
    recorded(session, *everything())

    assert check(session.get_bind().engine) == ()


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (update(models.Definition).values(body=models.Definition.body + " "), "definition"),
        (update(models.Machine).values(cores=64), "machine"),
        (update(models.EngineVersion).values(git_hash="0" * 40), "engine version"),
        (delete(models.SeriesListItem), "entries"),
        (update(models.Figure).values(body=b"junk"), "cannot be read"),
        (update(models.Sample).values(value=0.25), "was changed after"),
        (text("CREATE TABLE mine (x INTEGER)"), "differ from the models"),
    ],
)
def test_check_names_what_is_wrong(session, damage, words):
    recorded(session, run())
    session.execute(damage)
    session.commit()

    assert any(words in fault for fault in check(session.get_bind().engine))


def test_statistics_count_what_is_stored(session):
    one, two = recorded(session, run(), run(engine=engine("", name="mujoco", version="3.3")))

    found = statistics(session.get_bind().engine)

    assert found.rows["run"] == 2
    assert found.engines == {"mujoco": 1, "spook": 1}
    assert found.size > 0
    assert found.first is not None
    assert found.first.isoformat() == one.started
    assert found.last is not None
    assert found.last.isoformat() == two.started


A, B, C = "a1" * 20, "b2" * 20, "c3" * 20


def test_figures_of_the_newest_and_of_released_versions_stay(session, tmp_path):
    release = run(engine=engine(A, version="1.0.0", parents=()))
    older = run(engine=engine(B, version="1.0.1.dev1", parents=(A,)))
    newest = run(engine=engine(C, version="1.0.1.dev2", parents=(B,)))
    recorded(session, older, newest, release)

    assert drop_old_figures(session, History(session, tmp_path)) == 2  # a figure and a map

    history = History(session, tmp_path)
    assert history.figures(release.id) == release.figures
    assert history.maps(newest.id) == newest.maps
    assert history.figures(older.id) == history.maps(older.id) == ()
    assert history.document(older.id).samples == older.samples  # values are never dropped
    assert drop_old_figures(session, history) == 0


def test_a_run_of_one_test_does_not_cost_the_others_their_figures(session, tmp_path):
    whole = run(engine=engine(A, parents=()), figures=(figure("one"), figure("two")), maps=())
    partial = run(engine=engine(B, parents=(A,)), figures=(figure("two"),), maps=())
    recorded(session, whole, partial)

    drop_old_figures(session, History(session, tmp_path))

    history = History(session, tmp_path)
    assert [found.name for found in history.figures(whole.id)] == ["one"]
    assert [found.name for found in history.figures(partial.id)] == ["two"]


def test_a_dirty_build_does_not_cost_the_newest_commit_its_figures(session, tmp_path):
    clean, dirty = run(engine=engine(A)), run(engine=engine(A, dirty=True))
    recorded(session, dirty, clean)

    assert drop_old_figures(session, History(session, tmp_path)) == 0


def test_an_export_after_retention_is_importable(session, tmp_path):
    old = run(engine=engine(A, parents=()), maps=(stability_map(),))
    recorded(session, old, run(engine=engine(B, parents=(A,))))
    drop_old_figures(session, History(session, tmp_path))

    exported = History(session, tmp_path).document(old.id)

    assert exported == msgspec.structs.replace(old, figures=(), maps=())


def test_times_in_the_database_are_times(session):
    """For those who read with SQL: the start is a time in UTC, not a text."""
    (given,) = recorded(session, run(started="2026-11-21T03:17:00+02:00"))

    started = session.scalars(select(models.Run.started_at)).one()

    assert started.isoformat() == "2026-11-21T01:17:00+00:00"
    assert History(session).run(given.id).started == "2026-11-21T03:17:00+02:00"
