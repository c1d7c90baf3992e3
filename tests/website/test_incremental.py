"""A site written on top of an older one is byte for byte the site written from nothing, whatever changed between."""

from __future__ import annotations

import math
from collections.abc import Callable
from datetime import datetime, timedelta
from pathlib import Path

import pytest
from msgspec.structs import replace

from spook_tracker.tracker.document.json_form import Number
from spook_tracker.tracker.document.run_document import RunDocument
from spook_tracker.tracker.judge.accepted import Accepted
from spook_tracker.tracker.library import record
from spook_tracker.tracker.store.database import session_on
from spook_tracker.tracker.store.history import History
from spook_tracker.tracker.store.reader import FileReader
from spook_tracker.tracker.store.remove import remove
from spook_tracker.tracker.website.options import SiteOptions
from spook_tracker.tracker.website.publish import publish
from tests.histories.synthetic import DocumentHistory, document, engine, of_test, rival
from tests.tracker.judge.test_one_judge import night, one
from tests.website.scripts import handed_over

NIGHTS = [night(n, one(0.1 if n < 3 else 0.3 if n < 6 else 0.5)) for n in range(8)]  # worse on two nights
LATE = 3  # the first of them
WITHOUT_IT = [run for n, run in enumerate(NIGHTS) if n != LATE]
TAKEN = Accepted(series="t/*", low=0.2, high=0.4, who="Ada Example", why="a trade", until=None)


@pytest.fixture(autouse=True)
def small_histories(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is kept of long histories is kept of these: checkpoints two nights back, one night in two read closely,
    charts whose beginning moves."""
    monkeypatch.setattr("spook_tracker.tracker.judge.lane.RECENT", 2)
    monkeypatch.setattr("spook_tracker.tracker.judge.lane.SPARSE", 2)
    monkeypatch.setattr("spook_tracker.tracker.judge.checkpoints.LATE", 3)
    monkeypatch.setattr("spook_tracker.tracker.judge.checkpoints.STEP", 1)
    monkeypatch.setattr(
        "spook_tracker.tracker.website.diagrams.MOST_NIGHTS", 1
    )  # charts of four nights, and no more
    monkeypatch.setattr("spook_tracker.tracker.website.diagrams.MOVES", 2)


def other_engine(number: int) -> RunDocument:
    run = night(number, one(0.2))
    named = {"id": f"other {number}", "idempotency_key": f"other {number}", "trigger": "import"}
    return replace(run, engine=engine(number, "other"), **named)


def corrected(place: int, value: float | None = None, **changes: object) -> list[RunDocument]:
    """The nights with one of them taken out and put back, not as it was."""
    run = NIGHTS[place]
    if value is not None:
        run = replace(run, samples=(replace(run.samples[0], value=Number(value)),))
    return [*NIGHTS[:place], replace(run, **changes), *NIGHTS[place + 1 :]]


def with_sample(place: int, **changes: object) -> list[RunDocument]:
    """The nights with the value of one of them changed in what stands behind it only."""
    return corrected(place, samples=(replace(NIGHTS[place].samples[0], **changes),))


def last_with(**changes: object) -> list[RunDocument]:
    return [*NIGHTS[:-1], replace(NIGHTS[-1], series=(replace(NIGHTS[-1].series[0], **changes),))]


@pytest.mark.parametrize(
    ("before", "after", "levels"),
    [
        pytest.param(NIGHTS[:-1], NIGHTS, (), id="one more night"),
        pytest.param(NIGHTS, NIGHTS, (TAKEN,), id="a level accepted"),
        pytest.param(NIGHTS, WITHOUT_IT, (), id="the first bad run removed"),
        pytest.param(NIGHTS, NIGHTS[:-1], (), id="the newest run removed"),
        pytest.param(WITHOUT_IT, NIGHTS, (), id="an older run imported late"),
        pytest.param(NIGHTS[2:], NIGHTS, (), id="the beginning imported late"),
        pytest.param(
            NIGHTS, corrected(4, id="another", engine=engine(40)), (), id="another run in its place"
        ),
        pytest.param(
            NIGHTS, corrected(4, 0.31), (), id="a run removed and imported again with another value"
        ),
        pytest.param(
            NIGHTS, with_sample(4, state_hash="c3d4"), (), id="a run imported again with other state bits"
        ),
        pytest.param(
            NIGHTS, with_sample(4, counters={"steps": 7}), (), id="a run imported again with other work"
        ),
        pytest.param(NIGHTS, with_sample(4, failure="why"), (), id="a run imported again with other words"),
        pytest.param(NIGHTS, [*NIGHTS, *map(other_engine, range(3))], (), id="another engine"),
        pytest.param(NIGHTS, last_with(test_version="v2"), (), id="the definition changed"),
        pytest.param(NIGHTS, last_with(description="other words"), (), id="the words changed"),
    ],
)
def test_what_changed_is_written_again(
    before: list[RunDocument], after: list[RunDocument], levels: tuple[Accepted, ...], tmp_path: Path
) -> None:
    grown, anew = tmp_path / "grown", tmp_path / "anew"
    publish(DocumentHistory(before), grown)
    publish(DocumentHistory(after), grown, levels)
    publish(DocumentHistory(after), anew, levels)

    assert files(grown) == files(anew)


def test_what_a_team_says_of_its_site_is_written_again(tmp_path: Path) -> None:
    grown, anew = tmp_path / "grown", tmp_path / "anew"
    said = SiteOptions(title="Another name", home_page="https://example.org/engine")
    publish(DocumentHistory(NIGHTS), grown)
    publish(DocumentHistory(NIGHTS), grown, options=said)
    publish(DocumentHistory(NIGHTS), anew, options=said)

    assert files(grown) == files(anew)


def test_a_database_that_grew_and_shrank_gives_the_site_of_what_it_holds(tmp_path: Path) -> None:
    """Night by night, a run removed, put back with another value, and one more night: each time as from nothing."""
    url, grown = f"sqlite:///{tmp_path / 'tracker.db'}", tmp_path / "grown"

    def published(step: str) -> None:
        with History.open(url) as history:
            publish(history, grown)
            publish(history, tmp_path / step)
        assert files(grown) == files(tmp_path / step), step

    for number, run in enumerate(NIGHTS[:-1]):
        record(run, url)
        published(f"night {number}")
    with session_on(url) as session:
        remove(session, History(session).run(NIGHTS[LATE].id))
    published("removed")
    record(corrected(LATE, 0.31)[LATE], url)
    published("put back with another value")
    record(NIGHTS[-1], url)
    published("one more night")


def test_one_more_night_reads_its_own_samples(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    url, site = f"sqlite:///{tmp_path / 'tracker.db'}", tmp_path / "site"
    read: list[str] = []
    once = FileReader.each_row
    monkeypatch.setattr(
        FileReader, "each_row", lambda reader, query: read.append(query) or once(reader, query)
    )
    many = [night(n, one(0.1)) for n in range(5)]
    for run in many[:-1]:
        record(run, url)
    with History.open(url) as history:
        publish(history, site)
    record(many[-1], url)
    read.clear()

    with History.open(url) as history:
        publish(history, site)
        (newest,) = (run.key for run in history.runs() if run.id == many[-1].id)

    (query,) = read
    assert f"r.key IN ({newest})" in query


@pytest.mark.parametrize(
    "damage", [Path.unlink, lambda file: file.write_bytes(file.read_bytes()[:-9] + b"unlikely!")]
)
def test_what_is_kept_beside_the_site_may_go_or_be_damaged(
    damage: Callable[[Path], object], tmp_path: Path
) -> None:
    publish(DocumentHistory(NIGHTS[:-1]), tmp_path / "site")
    damage(tmp_path / ".site.kept")
    publish(DocumentHistory(NIGHTS), tmp_path / "site")
    publish(DocumentHistory(NIGHTS), tmp_path / "anew")

    assert files(tmp_path / "site") == files(tmp_path / "anew")


def of_many(number: int, *tests: str, days: int = 27) -> RunDocument:
    """A night with ladders, run times, figures and maps, of these tests; the month ends after the fourth."""
    run = document(number, broken=3)
    parts = [of_test(run, test) for test in tests]
    moved = {
        end: (datetime.fromisoformat(getattr(run, end)) + timedelta(days=days)).isoformat()
        for end in ("started", "finished")
    }
    return replace(
        run,
        series=sum((part.series for part in parts), ()),
        samples=sum((part.samples for part in parts), ()),
        tests=sum((part.tests for part in parts), ()),
        figures=tuple(f for f in run.figures if f.test in tests),
        maps=tuple(m for m in run.maps if m.test in tests),
        **moved,
    )


def renamed(run: RunDocument, old: str, new: str) -> RunDocument:
    """The test under its new name, which says what it was called formerly."""

    def key(text: str) -> str:
        return f"{new}/{text.removeprefix(old + '/')}" if text.startswith(f"{old}/") else text

    return replace(
        run,
        series=tuple(
            replace(d, test=new, key=key(d.key), aliases=(d.key,)) if d.test == old else d for d in run.series
        ),
        samples=tuple(replace(s, series=key(s.series)) for s in run.samples),
        tests=tuple(replace(c, name=new) if c.name == old else c for c in run.tests),
        figures=tuple(replace(f, test=new) if f.test == old else f for f in run.figures),
    )


def crashed(run: RunDocument, test: str) -> RunDocument:
    why = {"outcome": "crashed", "passed": False, "set_point_held": False, "failure": "it crashed"}
    return replace(
        run,
        samples=tuple(
            replace(s, value=Number(math.nan), timing=None, **why) if s.series.startswith(f"{test}/") else s
            for s in run.samples
        ),
    )


def other(version: str) -> RunDocument:
    return replace(rival(version), trigger="import", tracker_version="0.1")


def test_nights_of_every_kind_one_after_the_other_give_the_site_of_all_at_once(tmp_path: Path) -> None:
    """A test appears, one is renamed, one crashes, one is gone; a night comes late, and two releases of another engine,
    the older one later; the month changes. After every step, as from nothing."""
    url, grown = f"sqlite:///{tmp_path / 'tracker.db'}", tmp_path / "grown"
    steps = {
        "the first": of_many(0, "friction", "door"),
        "a test appears": of_many(2, "friction", "door", "pendulum"),
        "another engine": other("3.10"),
        "a value is worse": of_many(3, "friction", "door", "pendulum"),
        "a test is renamed, in another month": renamed(
            of_many(4, "friction", "door", "pendulum"), "door", "gate"
        ),
        "a night comes late": of_many(1, "friction", "door"),
        "a test crashes": crashed(
            renamed(of_many(5, "friction", "door", "pendulum"), "door", "gate"), "pendulum"
        ),
        "an older release": other("3.9"),
        "a test is gone": of_many(6, "friction", "pendulum"),
    }
    for number, (step, run) in enumerate(steps.items()):
        record(run, url)
        with History.open(url) as history:
            publish(history, grown)
            publish(history, tmp_path / str(number))
        assert files(grown) == files(tmp_path / str(number)), step


@pytest.mark.parametrize(
    "damage",
    [
        pytest.param(Path.unlink, id="gone"),
        pytest.param(lambda file: file.write_bytes(file.read_bytes()[:-1]), id="cut short"),
    ],
)
def test_a_damaged_file_is_written_again(damage: Callable[[Path], object], tmp_path: Path) -> None:
    publish(DocumentHistory(NIGHTS), tmp_path)
    whole = files(tmp_path)
    for name in ("index.html", "data/t.csv", "feed.xml"):
        damage(tmp_path / name)

    assert publish(DocumentHistory(NIGHTS), tmp_path).written == 3
    assert files(tmp_path) == whole


def test_the_first_bad_run_imported_late_is_blamed_on_the_page_of_comparisons(tmp_path: Path) -> None:
    blamed = NIGHTS[LATE].engine.git_hash[:12]
    compared = tmp_path / "site" / "compare" / "newest.js"
    publish(DocumentHistory(WITHOUT_IT), tmp_path / "site")
    assert blamed not in str(handed_over(compared, "compared")["newest"])

    publish(DocumentHistory(NIGHTS), tmp_path / "site")

    assert blamed in str(handed_over(compared, "compared")["newest"])


def test_other_rules_of_the_judge_write_every_page_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    publish(DocumentHistory(NIGHTS), tmp_path / "site")
    rules = tmp_path / "rules.py"
    rules.write_text("LEAST = 0.5\n")
    monkeypatch.setattr("spook_tracker.tracker.website.publish._sources", lambda: [rules])

    told = publish(DocumentHistory(NIGHTS), tmp_path / "site")

    kept = publish(DocumentHistory(NIGHTS), tmp_path / "site")
    assert kept.written == 0
    assert told.written >= sum(path.suffix == ".html" for path in (tmp_path / "site").rglob("*"))


def files(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
