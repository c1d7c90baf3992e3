"""Asked for and not answered is missing; a gate that left the catalogue is red until it is accepted."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from msgspec.structs import replace

from spook_tracker.tracker.document.run_document import Asked
from spook_tracker.tracker.judge.accepted import Accepted, read_accepted
from spook_tracker.tracker.judge.lane import RECENT, SPARSE, elsewhere, histories, line_of
from spook_tracker.tracker.judge.tonight import tonight
from spook_tracker.tracker.library import compare
from spook_tracker.tracker.website.publish import publish
from tests.histories.synthetic import DocumentHistory, sample, series
from tests.tracker.judge.test_one_judge import Recorded, night, one, rungs, seconds

GATE = series("gone", "m", role="gate", limit=1.0)
COMPANION = series("t", "n", role="companion", limit=1.0)


def found(runs: list[Any], accepted: tuple[Accepted, ...] = ()) -> dict[str, tuple[str, bool, bool]]:
    told = tonight(DocumentHistory(runs), runs[-1], accepted)
    answers = (
        finding for finding in told if "/work:" not in finding.series
    )  # the sums have a test of their own
    return {finding.series: (finding.verdict.word, finding.red, finding.news) for finding in answers}


def both(number: int) -> Any:
    return night(number, [*one(0.5), (GATE, sample(GATE, 0.5)), (COMPANION, sample(COMPANION, 0.5))])


def test_a_gate_that_left_the_catalogue_is_removed_and_red_until_it_is_accepted(tmp_path: Path) -> None:
    runs = [both(0), night(1, one(0.5)), night(2, one(0.5))]

    assert found(runs[:2])[GATE.key] == ("removed", True, True)
    assert found(runs)[GATE.key] == ("removed", True, False)
    publish(DocumentHistory(runs), tmp_path / "public")
    events = json.loads((tmp_path / "public" / "data" / "regressions.json").read_text())
    assert {(e["series"], e["name"]) for e in events} == {(GATE.key, "removed"), (COMPANION.key, "missing")}
    entry = tmp_path / "accepted.toml"
    entry.write_text('[[accepted]]\nseries = "gone/*"\nremoved = true\nwho = "me"\nwhy = "asked elsewhere"\n')
    assert found(runs, read_accepted(entry))[GATE.key][1] is False


def test_a_value_that_its_test_no_longer_gives_is_missing_that_night() -> None:
    runs = [both(0), night(1, [*one(0.5), (GATE, sample(GATE, 0.5))]), both(2)]

    assert found(runs[:2])[COMPANION.key] == ("missing", True, True)
    assert found(runs)[COMPANION.key][:2] == ("identical", False)


LONG = RECENT + 3 * SPARSE  # nights: of the first, one in so many is looked at closely


def nights_of(runs: list[Any], key: str) -> list[str]:
    return [point.run.id for point in histories(DocumentHistory(runs), runs)[key].points]


def test_a_history_with_a_missing_value_stays_in_its_order_however_long_it_is() -> None:
    """Of runs that do not say what they were asked for."""
    runs = [both(n) for n in range(LONG)]
    runs[-5] = night(LONG - 5, [*one(0.5), (GATE, sample(GATE, 0.5))])

    assert nights_of(runs, COMPANION.key) == [run.id for run in runs]


def test_a_gate_is_not_missed_before_it_was_there() -> None:
    runs = [night(n, one(0.5)) if n < SPARSE + 3 else both(n) for n in range(LONG)]

    assert nights_of(runs, GATE.key) == [run.id for run in runs[SPARSE + 3 :]]


def test_a_run_of_some_tests_misses_nothing_of_the_others() -> None:
    part = replace(night(1, [*one(0.5), (COMPANION, sample(COMPANION, 0.5))]), trigger="manual")

    assert set(found([both(0), part])) == {COMPANION.key, one(0.5)[0][0].key}


def timed(number: int, times: bool, machine: str = "m") -> Any:
    """A night of our own that says it was asked for test t: a value, and a run time where there are `times`."""
    run = asked(number, [*one(0.5), *(seconds(1e-3) if times else [])], "t")
    return replace(run, machine=replace(run.machine, fingerprint=machine))


TIME = "t/plain/time"


def test_a_run_time_that_stops_while_its_siblings_go_on_is_missing_and_red() -> None:
    runs = [timed(n, times=n < 3) for n in range(5)]

    assert found(runs[:4])[TIME] == ("missing", True, True)
    assert found(runs)[TIME] == ("missing", True, False)
    document = compare(Recorded(runs), runs[2].id, runs[3].id)  # type: ignore[arg-type]
    assert {change.series for change in document.changes if change.red} == {TIME}
    assert found([*runs, timed(5, times=True)])[TIME][1] is False


def test_a_run_time_is_not_missed_where_it_never_was_timed() -> None:
    """Neither on another machine, nor by a run of other tests, nor where it is read off a ladder's clock."""
    elsewhere_timed = [timed(0, times=True), timed(1, times=True), timed(2, times=False, machine="n")]
    of_others = replace(asked(2, one(0.5), "u"), machine=elsewhere_timed[0].machine)
    read_off = series("t", "ladder:e:time-to-error", kind="time", better="smaller", time_step=None)
    ladder = [asked(0, [*one(0.5), (read_off, sample(read_off, 1.0))], "t"), asked(1, one(0.5), "t")]

    assert not any(red for _, red, _ in found(elsewhere_timed).values())
    assert not any(red for _, red, _ in found([*elsewhere_timed[:2], of_others]).values())
    assert not any(red for _, red, _ in found(ladder).values())


def _branched() -> list[Any]:
    """Main 0, 1, 2, and a branch from 0."""
    runs = [night(n, one(value)) for n, value in ((0, 0.5), (1, 0.25), (2, 0.25), (3, 0.5))]
    fork = runs[0].engine.git_hash
    return [*runs[:3], replace(runs[3], engine=replace(runs[3].engine, parents=(fork,)))]


def test_a_branch_is_judged_against_its_fork_point() -> None:
    runs = _branched()

    assert [run.id for run in line_of(runs, runs[3])] == [runs[0].id, runs[3].id]
    assert found(runs)[one(0.5)[0][0].key][:2] == ("identical", False)


def test_where_a_way_back_breaks_off_the_order_of_commits_has_to_do() -> None:
    runs = _branched()
    lost = replace(runs[3], engine=replace(runs[3].engine, parents=("e" * 40,)))

    assert elsewhere(runs[:3], lost) == set()
    assert len(line_of([*runs[:3], lost], lost)) == 4


def asked(number: int, pairs: list[Any], *tests: str, whole: bool = False) -> Any:
    """A run that stores what it was asked for; not a nightly."""
    wanted = Asked(tests=tests, families=("values",), whole=whole)
    return replace(night(number, pairs), trigger="manual", asked=wanted)


def test_a_test_that_was_asked_for_and_gave_nothing_at_all_is_missing() -> None:
    """No value of it is there to tell by: only the request says so."""
    runs = [both(0), asked(1, one(0.5), "t", "gone")]

    assert found(runs)[GATE.key] == ("missing", True, True)
    assert GATE.key not in found([both(0), asked(1, one(0.5), "t")])
    assert GATE.key not in found([both(0), replace(asked(1, one(0.5), "t"), asked=None)])


def test_a_gate_is_removed_if_the_whole_catalogue_was_asked_by_any_run() -> None:
    runs = [both(0), asked(1, one(0.5), "t", whole=True)]

    assert found(runs)[GATE.key] == ("removed", True, True)


def test_a_sweep_that_was_not_asked_for_is_not_missed() -> None:
    runs = [night(0, [*one(0.5), *rungs(1e-3)]), asked(1, one(0.5), "t")]

    assert set(found(runs)) == {one(0.5)[0][0].key}


def test_a_comparison_misses_what_the_later_run_was_asked_for(tmp_path: Path) -> None:
    from click.testing import CliRunner

    from spook_tracker.tracker.cli.main import main
    from spook_tracker.tracker.store.database import session_on
    from spook_tracker.tracker.store.record import record

    runs = [replace(both(0), trigger="manual"), asked(1, one(0.5), "t", "gone")]
    database = f"sqlite:///{tmp_path}/t.db"
    with session_on(database) as session:
        for run in runs:
            record(session, run)

    shown = CliRunner().invoke(main, ["compare", "previous", "latest", "--db", database])
    assert shown.exit_code == 1
    assert "gone" in shown.output
    judged = CliRunner().invoke(main, ["judge", "latest", "--db", database])
    assert judged.exit_code == 1
    assert "missing" in judged.output
