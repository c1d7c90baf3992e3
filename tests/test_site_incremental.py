"""A site written on top of an older one is byte for byte the site written from nothing, whatever changed between."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec.structs import replace

from spook_tracker.tracker.document.json_form import Number
from spook_tracker.tracker.document.run_document import RunDocument
from spook_tracker.tracker.judge.accepted import Accepted
from spook_tracker.tracker.library import record
from spook_tracker.tracker.store.database import session_on
from spook_tracker.tracker.store.history import History
from spook_tracker.tracker.store.remove import remove
from spook_tracker.tracker.website.options import SiteOptions
from spook_tracker.tracker.website.publish import publish
from tests.synthetic_history import DocumentHistory, engine
from tests.test_tracker_one_judge import night, one

NIGHTS = [night(n, one(0.1 if n < 3 else 0.3 if n < 6 else 0.5)) for n in range(8)]  # worse on two nights
LATE = 3  # the first of them
WITHOUT_IT = [run for n, run in enumerate(NIGHTS) if n != LATE]
TAKEN = Accepted(series="t/*", low=0.2, high=0.4, who="somebody", why="a trade", until=None)


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


def test_the_first_bad_run_imported_late_is_blamed_on_the_page_of_comparisons(tmp_path: Path) -> None:
    blamed = NIGHTS[LATE].engine.git_hash[:12].encode()
    publish(DocumentHistory(WITHOUT_IT), tmp_path / "site")
    assert blamed not in files(tmp_path / "site")["compare/newest.js"]

    publish(DocumentHistory(NIGHTS), tmp_path / "site")

    assert blamed in files(tmp_path / "site")["compare/newest.js"]


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
