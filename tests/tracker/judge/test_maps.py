"""A stability map that is gone: since which run, where it is news, and until when, told alike by every reader."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import msgspec
from click.testing import CliRunner

from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.document.run_document import Asked, RunDocument
from spook_tracker.tracker.judge.accepted import Accepted
from spook_tracker.tracker.judge.causes import causes_tonight
from spook_tracker.tracker.judge.maps import may_be_dropped
from spook_tracker.tracker.judge.tonight import tonight
from spook_tracker.tracker.library import trend_of_maps
from spook_tracker.tracker.store.database import session_on
from spook_tracker.tracker.store.history import History
from spook_tracker.tracker.store.record import record
from spook_tracker.tracker.store.retention import drop_old_figures
from spook_tracker.tracker.website.causes import anchor, causes_of
from spook_tracker.tracker.website.comparisons import comparisons
from spook_tracker.tracker.website.feed import atom
from spook_tracker.tracker.website.nights import book
from spook_tracker.tracker.website.page_index import health, index
from tests.histories.synthetic import DocumentHistory, document

KEY = "pendulum/plain/map:damping-compliance"
WHOLE = ("values", "sweep", "stability")


def run(night: int, held: bool = True, families: tuple[str, ...] = WHOLE, **changes: Any) -> RunDocument:
    """One night of one test with one map, or without it; `families` are asked for."""
    made = document(night)
    series = tuple(d for d in made.series if d.test == "pendulum")
    keys = {d.key for d in series}
    facts: dict[str, Any] = {
        "tests": tuple(card for card in made.tests if card.name == "pendulum"),
        "series": series,
        "samples": tuple(s for s in made.samples if s.series in keys),
        "figures": (),
        "maps": tuple(m for m in made.maps if m.test == "pendulum") if held else (),
        "asked": Asked(tests=("pendulum",), families=families, whole=True),
    }
    return msgspec.structs.replace(made, **(facts | changes))


def elsewhere(made: RunDocument) -> RunDocument:
    """The same on a machine with other floating-point arithmetic."""
    machine = msgspec.structs.replace(made.machine, fingerprint="other", float_environment="other")
    return msgspec.structs.replace(made, machine=machine)


def branched(made: RunDocument, fork: RunDocument) -> RunDocument:
    """The same as a commit of a branch that left after the commit of another run."""
    commit = hashlib.sha1(made.id.encode()).hexdigest()
    engine = msgspec.structs.replace(made.engine, git_hash=commit, parents=(fork.engine.git_hash,))
    return msgspec.structs.replace(made, id=f"{made.id}-branch", engine=engine)


def lost(runs: list[RunDocument], accepted: tuple[Accepted, ...] = ()) -> Any:
    """What the night says of the loss in its last run: None, or the runs it is between and whether it is news.

    The website, its feed and the trend have to say the same.
    """
    records = DocumentHistory(runs)
    found = [f for f in tonight(records, runs[-1], accepted) if f.series == KEY and f.red]
    told = book(records, accepted)
    causes = [c for c in causes_of(told) if any(hit.series == KEY and hit.stands == "fail" for hit in c.hits)]
    trends = [t for t in trend_of_maps(records, "pendulum", accepted) if t.gone and t.verdict.red]
    if not found:
        assert not any(one.tonight for test in told.tests for one in test.lost_maps)
        return None
    ((finding,), (cause,), (trend,)) = found, causes, trends
    (hit,) = [hit for hit in causes_tonight(found)[0].hits if hit.series == KEY]
    for one in (finding, cause, trend, hit):
        assert (one.good.id, one.bad.id) == (finding.good.id, finding.bad.id)
    assert finding.verdict.word == "missing"
    assert finding.stands == hit.stands == cause.worst.stands == trend.stands == "fail"
    assert finding.news == trend.news == (finding.bad.id == runs[-1].id)
    assert (finding.last_good, finding.first_bad) != ("", "")
    assert health(told)[0] == "fail"
    assert {test.state for test in told.tests if test.lost_maps} == {"fail"}
    return finding.good.id, finding.bad.id, finding.news


def between(good: RunDocument, bad: RunDocument, last: RunDocument) -> tuple[str, str, bool]:
    """What is expected."""
    return good.id, bad.id, bad.id == last.id


def test_a_map_that_is_gone_is_blamed_on_the_first_run_without_it_however_long_ago() -> None:
    runs = [run(0), *(run(n, held=False) for n in range(1, 75))]
    for last in (1, 2, 3, 13, 14, 61, 62, 74):
        assert lost(runs[: last + 1]) == between(runs[0], runs[1], runs[last])


def test_every_night_the_loss_stands_under_one_address_and_in_one_entry_of_the_feed() -> None:
    runs = [run(0), run(1), *(run(n, held=False) for n in range(2, 20))]
    entries, anchors = set(), set()
    for last in range(2, 20):
        told = book(DocumentHistory(runs[: last + 1]))
        causes = [c for c in causes_of(told) if any(hit.series == KEY for hit in c.hits)]
        anchors.update(anchor(cause) for cause in causes)
        feed = ElementTree.fromstring(atom(told, causes))
        entries.update(e.findtext("{*}id") for e in feed.iter() if e.tag.endswith("entry"))
    assert (len(anchors), len(entries)) == (1, 1)


def test_nights_that_were_not_asked_are_no_loss_and_no_end_of_one() -> None:
    quick = ("values",)
    runs = [
        run(0),
        run(1, held=False, families=quick),
        run(2, held=False),
        run(3, held=False, families=quick),
    ]
    assert lost(runs[:2]) is None
    assert lost(runs[:3]) == between(runs[0], runs[2], runs[2])
    assert lost(runs) is None  # tonight says nothing of it
    (cause,) = causes_of(book(DocumentHistory(runs)))  # and it is still gone
    assert (cause.good.id, cause.bad.id) == (runs[0].id, runs[2].id)
    assert lost([*runs, run(4, held=False)]) == between(runs[0], runs[2], run(4))


def test_runs_that_do_not_say_what_they_were_asked_are_known_by_their_answers() -> None:
    runs = [msgspec.structs.replace(run(n, held=n == 0), asked=None) for n in range(4)]
    points = {d.key for d in runs[0].series if d.kind == "break_point"}
    for n in (1, 3):  # break points were not asked for
        values = tuple(s for s in runs[n].samples if s.series not in points)
        runs[n] = msgspec.structs.replace(runs[n], samples=values)
    assert lost(runs[:2]) is None
    assert lost(runs[:3]) == between(runs[0], runs[2], runs[2])
    assert lost(runs) is None


def test_a_map_that_is_lost_twice_is_lost_since_the_second_time() -> None:
    runs = [run(n, held=n not in (2, 5, 6)) for n in range(7)]
    assert lost(runs[:3]) == between(runs[1], runs[2], runs[2])
    assert lost(runs[:4]) is None
    assert lost(runs) == between(runs[4], runs[5], runs[6])


def test_another_float_environment_has_lost_nothing_it_never_had() -> None:
    runs = [run(0), elsewhere(run(1, held=False)), elsewhere(run(2, held=False))]
    assert lost(runs) is None
    assert not causes_of(book(DocumentHistory(runs)))
    back = [*runs, run(3, held=False), elsewhere(run(4)), run(5, held=False)]
    assert lost(back[:4]) == between(runs[0], back[3], back[3])
    assert lost(back) == between(runs[0], back[3], back[5])


def test_what_a_machine_lost_is_over_where_another_has_it_for_good() -> None:
    runs = [run(0), run(1, held=False), elsewhere(run(2))]
    (cause,) = causes_of(book(DocumentHistory(runs[:2])))
    assert cause.bad.id == runs[1].id
    assert not causes_of(book(DocumentHistory(runs)))


def test_a_run_on_another_branch_neither_loses_a_map_for_us_nor_keeps_it() -> None:
    runs = [run(0), run(1)]
    beside = branched(run(7, held=False), runs[0])
    assert lost([*runs, beside, run(2)]) is None
    later = [run(2, held=False), run(3, held=False)]
    assert lost([*runs, beside, later[0]]) == between(runs[1], later[0], later[0])
    kept = branched(run(7), runs[0])  # holds the map, but is not before ours
    assert lost([*runs, kept, *later]) == between(runs[1], later[0], later[1])


def test_maps_that_retention_dropped_are_not_missed() -> None:
    """Releases keep theirs: between them and the newest run every map has been dropped."""
    runs = [run(0), *(run(n, held=False) for n in range(1, 4)), run(4)]
    assert lost(runs) is None
    records = DocumentHistory(runs)
    assert not [f for f in tonight(records, runs[2]) if f.series == KEY]
    assert health(book(records))[0] != "fail"
    assert '"missing"' not in json.dumps(comparisons(records, book(records), (), {}).pairs)
    assert may_be_dropped(records, runs[2:]) == {
        runs[2].id: {KEY},
        runs[3].id: {KEY},
        runs[4].id: set(),
    }
    assert lost([*runs, run(5, held=False)]) == between(runs[4], run(5), run(5))


def test_a_build_with_local_changes_does_not_hide_a_loss() -> None:
    """Of those retention keeps one of its own, so that none of the others was dropped for it."""
    mine = run(9)
    mine = msgspec.structs.replace(mine, engine=msgspec.structs.replace(mine.engine, dirty=True))
    runs = [run(0), run(1), run(2, held=False)]
    found = [f for f in tonight(DocumentHistory([*runs, mine]), runs[2]) if f.series == KEY and f.red]
    assert [(f.good.id, f.bad.id) for f in found] == [(runs[1].id, runs[2].id)]


def test_a_test_that_was_removed_loses_no_map_then_but_keeps_the_loss_from_before() -> None:
    without = Asked(tests=("door",), families=WHOLE, whole=True)
    left = document(1)
    door = {d.key: d for d in left.series if d.test == "door"}
    facts = {
        "series": tuple(door.values()),
        "samples": tuple(s for s in left.samples if s.series in door),
        "tests": tuple(card for card in left.tests if card.name == "door"),
    }
    removed = [run(n, held=False, asked=without, **facts) for n in (2, 3)]
    assert lost([run(0), run(1), *removed]) is None
    assert not [t for t in trend_of_maps(DocumentHistory([run(0), run(1), *removed]), "pendulum") if t.gone]
    (told,) = trend_of_maps(DocumentHistory([run(0), run(1, held=False), *removed]), "pendulum")
    assert (told.bad.id, told.tonight, told.news) == (run(1).id, False, False)


def test_a_map_given_up_is_accepted_until_its_day_and_red_after_it() -> None:
    runs = [run(0), run(1, held=False), run(2, held=False)]
    given = Accepted(series=KEY, low=0.0, high=0.0, who="A", why="w", removed=True)
    assert lost(runs, (given,)) is None
    assert not causes_of(book(DocumentHistory(runs), (given,)))
    over = replace(given, until=date(2025, 10, 2))
    assert lost(runs[:2], (over,)) is None
    assert lost(runs, (over,)) == between(runs[0], runs[1], runs[2])


def test_retention_keeps_a_map_of_each_machine_and_the_command_tells_the_loss(tmp_path: Path) -> None:
    """What another machine drew in between does not let the last map of ours go."""
    address = f"sqlite:///{tmp_path / 'h.db'}"
    ours, theirs, mine, after = run(0), elsewhere(run(1)), run(2, held=False), run(3, held=False)
    with session_on(address) as session:
        for made in (ours, theirs, mine, after):
            assert record(session, made)
            drop_old_figures(session, History(session))
        history = History(session)
        assert history.with_maps() == {ours.id, theirs.id}
        (found,) = [f for f in tonight(history, history.run(after.id)) if f.series == KEY]
        assert (found.good.id, found.bad.id, found.news) == (ours.id, mine.id, False)
    done = CliRunner().invoke(main, ["trend", "pendulum", "--db", address])
    assert done.exit_code == 1, done.output
    assert "series red" in done.output.splitlines()[0]
    (line,) = [line for line in done.output.splitlines() if line.startswith(f"✗ {KEY}: missing")]
    assert mine.engine.git_hash[:8] in line
    told = CliRunner().invoke(main, ["trend", "pendulum", "--kind", "map", "--json", "--db", address])
    (only,) = json.loads(told.output)
    assert (only["series"], only["word"], only["stands"]) == (KEY, "missing", "fail")
    assert (only["last_good"], only["first_bad"]) == (ours.engine.git_hash, mine.engine.git_hash)


def test_a_map_with_worse_cells_is_red_on_the_page_as_in_the_night() -> None:
    """And only there and then: the next night, as good as the one before, is told no more."""
    before, after = run(0), run(1)
    worse = msgspec.structs.replace(
        before.maps[0], cells=tuple(tuple("growing" for _ in row) for row in before.maps[0].cells)
    )
    after = msgspec.structs.replace(after, maps=(worse, *after.maps[1:]))
    records = DocumentHistory([before, after])
    assert [(f.series, f.stands) for f in tonight(records, after) if f.red] == [(KEY, "watch")]
    told = book(records)
    assert health(told)[0] == "watch"
    assert [test.state for test in told.tests] == ["watch"]
    assert "red" in index(told, causes_of(told)).context["headline"]
    later = msgspec.structs.replace(run(2), maps=after.maps)
    records = DocumentHistory([before, after, later])
    assert not [f for f in tonight(records, later) if f.red]
    assert health(book(records))[0] == health(book(DocumentHistory([before])))[0]
