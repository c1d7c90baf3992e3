"""The history as one file a month: complete, small, appended to, and never obeyed when it is damaged."""

from __future__ import annotations

import errno
import lzma
import os
import tracemalloc
from pathlib import Path

import pytest
from sqlalchemy.orm import Session

from spook_tracker.tracker.document.errors import DocumentError
from spook_tracker.tracker.document.json_form import encode
from spook_tracker.tracker.store.database import open_database
from spook_tracker.tracker.store.history import History
from spook_tracker.tracker.store.months import export_months, import_months, is_month
from spook_tracker.tracker.store.record import record
from tests.histories.documents import definition, run, sample


@pytest.fixture
def desk(tmp_path):
    """A function that opens a database of that name, for as long as the test runs."""
    opened = []

    def session_on(name):
        engine = open_database(f"sqlite:///{tmp_path}/{name}.db")
        opened.append((engine, Session(engine)))
        return opened[-1][1]

    yield session_on
    for engine, session in opened:
        session.close()
        engine.dispose()


def night(day, value=1.0, month="11"):
    return run(
        series=(definition("t/c/m"),),
        samples=(sample("t/c/m", value),),
        started=f"2026-{month}-{day:02}T03:00:00+00:00",
    )


def test_what_went_out_comes_in_again_whole(desk, tmp_path):
    first, months = desk("first"), tmp_path / "history"
    nights = [night(1, 0.1), night(2, "nan"), night(1, -0.0, month="10")]
    for document in nights:
        record(first, document)

    written = export_months(History(first), months)
    second = desk("second")
    counted = import_months(second, sorted(months.iterdir()))

    assert [path.name for path in written] == ["2026-10.jsonl.xz", "2026-11.jsonl.xz"]
    assert counted == (3, 0)
    old, new = History(first), History(second)
    assert [encode(new.document(n.id)) for n in nights] == [encode(old.document(n.id)) for n in nights]


def test_a_night_rewrites_its_own_month_and_keeps_what_is_there(desk, tmp_path):
    session, months = desk("first"), tmp_path / "history"
    record(session, night(1, month="10"))
    record(session, night(1))
    export_months(History(session), months)
    before = (months / "2026-10.jsonl.xz").stat().st_mtime_ns
    there = lzma.decompress((months / "2026-11.jsonl.xz").read_bytes())
    record(session, night(2))

    assert [path.name for path in export_months(History(session), months)] == ["2026-11.jsonl.xz"]
    assert (months / "2026-10.jsonl.xz").stat().st_mtime_ns == before
    assert lzma.decompress((months / "2026-11.jsonl.xz").read_bytes()).startswith(there)
    assert export_months(History(session), months) == ()


def test_a_month_is_whole_until_the_new_one_takes_its_name(desk, tmp_path, monkeypatch):
    session, months = desk("first"), tmp_path / "history"
    record(session, night(1))
    (file,) = export_months(History(session), months)
    old, seen, rename = file.read_bytes(), [], Path.replace
    record(session, night(2))

    def stands(beside: Path, place: Path) -> Path:
        seen.append((place.read_bytes(), lzma.decompress(beside.read_bytes()).count(b"\n")))
        return rename(beside, place)

    monkeypatch.setattr(Path, "replace", stands)
    export_months(History(session), months)

    assert seen == [(old, 2)]


def test_a_disk_that_is_full_in_the_middle_of_a_month_costs_nothing_that_was_there(
    desk, tmp_path, monkeypatch
):
    session, months = desk("first"), tmp_path / "history"
    record(session, night(1))
    (file,) = export_months(History(session), months)
    old = file.read_bytes()
    record(session, night(2))

    def full(*_: object) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(lzma.LZMAFile, "write", full)
    with pytest.raises(DocumentError, match="No space left on device"):
        export_months(History(session), months)

    assert [(path, path.read_bytes()) for path in months.iterdir()] == [(file, old)]


def test_a_known_run_is_not_decoded_again(desk, tmp_path, monkeypatch):
    session, months = desk("first"), tmp_path / "history"
    record(session, night(1))
    (file,) = export_months(History(session), months)
    monkeypatch.setattr("spook_tracker.tracker.store.months.decoded", None)

    assert import_months(session, [file]) == (0, 1)


def test_a_further_night_costs_a_fraction_of_the_first(desk, tmp_path):
    """Most of it is the night before again: words of the tests, definitions, numbers that did not change."""
    session, months = desk("first"), tmp_path / "history"
    series = tuple(definition(f"t/c/m{n}", description=os.urandom(40).hex()) for n in range(200))
    sizes = []
    for day in (1, 2):
        samples = tuple(sample(s.key, 1.0 / (place + 3)) for place, s in enumerate(series))
        record(session, run(series=series, samples=samples, started=f"2026-11-{day:02}T03:00:00+00:00"))
        (file,) = export_months(History(session), months)
        sizes.append(file.stat().st_size)

    assert sizes[1] - sizes[0] < sizes[0] / 10


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"no xz file", "damaged"),
        (lzma.compress(b"{}\n" * 3), "no run"),
        (lzma.compress(b'{"id": "a", "started": "now"}\n'), "not a valid run"),
        (lzma.compress(encode(night(1)) + b"\n")[:-20], "damaged"),
        (lzma.compress(b"\xff\xfe\n"), "no run"),
        (lzma.compress(b"[" * 100_000 + b"\n"), "no run"),
    ],
)
def test_a_damaged_month_is_named_and_records_nothing(desk, tmp_path, content, said):
    file = tmp_path / "2026-11.jsonl.xz"
    file.write_bytes(content)
    session = desk("first")

    with pytest.raises(DocumentError, match=said) as refused:
        import_months(session, [file])

    assert file.name in str(refused.value)
    assert len(str(refused.value)) < 600


def test_a_line_that_never_ends_is_refused_before_it_fills_the_memory(desk, tmp_path, monkeypatch):
    monkeypatch.setattr("spook_tracker.tracker.store.months.MAX_BYTES", 1000)
    file = tmp_path / "2026-11.jsonl.xz"
    file.write_bytes(lzma.compress(b" " * 30_000_000))
    session = desk("first")

    tracemalloc.start()
    try:
        with pytest.raises(DocumentError, match="more than"):
            import_months(session, [file])
        _, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()

    assert most < 10_000_000, "the line was read to its end first"


def test_only_months_are_taken_for_months(tmp_path):
    assert is_month(tmp_path / "2026-11.jsonl.xz")
    assert not any(
        is_month(tmp_path / name) for name in ("2026-11.json", ".2026-11.jsonl.xz.7.part", "x.jsonl.xz")
    )
