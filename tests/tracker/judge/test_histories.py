"""Histories that a stranger may bring, through the command line: what is red stays red, whatever comes between."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from msgspec.structs import replace

from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.document.run_document import Asked, RunDocument, Timing
from spook_tracker.tracker.judge.lane import RECENT, SPARSE, lines
from spook_tracker.tracker.store.database import session_on
from spook_tracker.tracker.store.record import record
from tests.histories.synthetic import MACHINE, DocumentHistory, sample, series
from tests.tracker.judge.test_one_judge import night, noise, one, red_on_the_site, rungs

LONG = RECENT + 2 * SPARSE  # nights: what happened before is not looked at night by night


@pytest.fixture
def tracker(tmp_path: Path) -> Any:
    """Records documents and runs one command on them: exit code and output."""

    def call(runs: list[RunDocument], *command: str) -> tuple[int, str]:
        database = f"sqlite:///{tmp_path}/t{len(list(tmp_path.iterdir()))}.db"
        with session_on(database) as session:
            for run in runs:
                record(session, run)
        shown = CliRunner().invoke(main, [*command, "--db", database], env={"COLUMNS": "200"})
        return shown.exit_code, shown.output

    return call


def worked(value: float, operations: int) -> list[Any]:
    definition, found = one(value)[0]
    return [(definition, replace(found, counters={"block_operations": operations}))]


def on(run: RunDocument, floats: str) -> RunDocument:
    return replace(run, machine=replace(MACHINE, fingerprint=floats, float_environment=floats))


def test_machines_of_two_float_environments_by_turns_hide_no_regression(tracker: Any) -> None:
    runs = [on(night(n, one(0.1 if n < 6 else 0.2)), "ab"[n % 2]) for n in range(10)]

    assert tracker(runs[:6], "judge", "latest")[0] == 0
    code, said = tracker(runs, "judge", "latest")
    assert (code, "worse by 0.3 decades" in said) == (1, True)


def test_a_definition_that_is_taken_back_goes_on_from_its_old_level(tracker: Any) -> None:
    versions = ("v1", "v2", "v1")
    runs = [night(n, one(0.1 + 0.1 * (n == 2), test_version=v)) for n, v in enumerate(versions)]

    assert tracker(runs[:2], "judge", "latest")[0] == 0
    assert tracker(runs, "judge", "latest")[0] == 1


def test_a_red_series_with_a_new_definition_does_not_stay_red_on_the_site(tmp_path: Path) -> None:
    runs = [night(n, one(value)) for n, value in enumerate((0.1, 0.2))]
    again = night(2, one(0.2, test_version="v2"))

    assert red_on_the_site(runs, tmp_path / "red")
    assert not red_on_the_site([*runs, again], tmp_path / "green")


def test_more_work_stays_red_however_long_it_is_not_mended(tracker: Any) -> None:
    runs = [night(n, worked(0.1, 100 if n < 10 else 200)) for n in range(LONG)]

    code, said = tracker(runs, "judge", "latest")
    assert (code, "more work" in said) == (1, True)


def test_a_slow_down_stays_red_however_long_it_is_not_mended(tracker: Any) -> None:
    slow = 3 * SPARSE  # a level needs nights to be known
    runs = [night(n, rungs(1e-3 * noise(n) * (1.3 if n >= slow else 1.0))) for n in range(LONG + slow)]

    code, said = tracker(runs, "judge", "latest")
    assert (code, "slower" in said) == (1, True)


def test_a_gate_long_missing_is_blamed_on_the_night_it_went(tracker: Any) -> None:
    gone = series("gone", "m", role="gate", limit=1.0)
    both = [*one(0.1), (gone, sample(gone, 0.1))]
    asked = Asked(tests=("t", "gone"), families=("values",), whole=False)
    runs = [replace(night(n, both if n < 3 else one(0.1)), asked=asked) for n in range(LONG)]

    code, said = tracker(runs, "judge", "latest")
    assert code == 1
    assert f"first bad commit {runs[3].engine.git_hash[:12]}" in said


def branched() -> list[RunDocument]:
    """Main turns bad with its fourth commit; a branch forked before that is measured between its nights."""
    runs = [night(n, one(0.1 if n < 3 else 0.3)) for n in range(7)]
    fork = replace(runs[5].engine, git_hash="b" * 40, parents=(runs[1].engine.git_hash,))
    after = replace(runs[6].engine, parents=(runs[4].engine.git_hash,))
    return [*runs[:5], replace(night(5, one(0.1)), engine=fork), replace(runs[6], engine=after)]


def test_a_branch_from_before_a_regression_marks_nothing_recovered(tracker: Any) -> None:
    code, said = tracker(branched(), "trend", "t", "m")

    assert code == 1
    assert "bbbbbbbbbbbb" not in said
    assert "recovered" not in said
    assert "flip-flop" not in said
    (line,) = lines(DocumentHistory(branched()).runs())
    assert "b" * 40 not in [run.engine.git_hash for run in line]


def test_the_branch_itself_is_judged_by_its_fork_point(tracker: Any) -> None:
    assert tracker(branched(), "judge", "bbbbbbb")[0] == 0
    assert tracker(branched(), "judge", "latest")[0] == 1


def test_two_versions_are_compared_with_each_other_and_with_the_history_where_asked(tracker: Any) -> None:
    """Two slow nights: no change from one to the other, though both are slow by their history."""
    runs = [night(n, rungs(1e-3 * noise(n) * (1.4 if n >= 12 else 1.0))) for n in range(14)]
    runs[-1] = night(13, rungs(1e-3 * 1.3))

    code, said = tracker(runs, "compare", "previous", "latest", "--format", "json")
    told = json.loads(said)
    assert code == 0
    assert not any(change["red"] for change in told["changes"])
    assert "1 time is red against the history" in told["notes"][-1]

    code, said = tracker(runs, "compare", "previous", "latest", "--against-history", "--format", "json")
    (slow,) = (c for c in json.loads(said)["changes"] if c["red"])
    assert code == 1
    assert slow["before"] < slow["after"] and "against the history" in slow["sentence"]


@pytest.mark.parametrize("pair", [(3, 9), (9, 3), (10, 12), (12, 13), (5, 13)])
def test_a_printed_pair_agrees_with_its_percentage(tracker: Any, pair: tuple[int, int]) -> None:
    """Levels that came and went before do not enter: V1 to V2 is what is printed and what is judged."""
    level = (1.0, 1.0, 1.0, 1.6, 1.6, 1.6, 1.6, 1.6, 1.6, 1.2, 1.2, 1.2, 1.25, 1.3)
    runs = [night(n, rungs(1e-3 * noise(n) * level[n])) for n in range(14)]

    told = json.loads(tracker(runs, "compare", *(runs[n].id for n in pair), "--format", "json")[1])
    for change in told["changes"]:
        if change["kind"] == "run_time" and (said := re.search(r"([+-][\d.]+) % for", change["sentence"])):
            ratio = 100.0 * (change["after"] / change["before"] - 1.0)
            assert float(said[1]) == pytest.approx(ratio, abs=0.06)
            assert change["red"] <= (ratio > 1.0)


def test_one_slow_night_is_told_by_every_command_and_red_in_none(tracker: Any) -> None:
    runs = [night(n, rungs(1e-3 * noise(n) * (2.0 if n == 13 else 1.0))) for n in range(14)]

    for command in (["judge", "latest"], ["trend", "t"], ["compare", "previous", "latest"]):
        code, said = tracker(runs, *command)
        assert code == 0
        assert "slow for one night: t/" in said if "compare" in command else "; 1 to be confirmed" in said
        assert re.search(r"\+\d+\.\d % for the worse, to be confirmed", said)
        if pair := re.search(r"suspected; ([\d.e-]+) → ([\d.e-]+) s; .*?\+([\d.]+) %", said):
            assert 100.0 * (float(pair[2]) / float(pair[1]) - 1.0) == pytest.approx(float(pair[3]), abs=0.1)
        assert (pair is not None) == ("judge" in command)


def test_timing_is_told_from_a_clock_that_stands_still(tracker: Any) -> None:
    """Zero seconds are no level to be slower than, and no crash."""
    definition = series("t", "ladder:e", kind="ladder", time_step=0.1)
    timing = Timing(seconds=(0.0, 0.0), runs_per_repeat=1)
    runs = [night(n, [(definition, sample(definition, 0.1, timing=timing))]) for n in range(8)]

    assert tracker(runs, "judge", "latest")[0] == 0


def test_new_definitions_are_counted_and_named_by_night_and_comparison(tracker: Any) -> None:
    runs = [night(0, one(0.1)), night(1, one(99.0, limit=1000.0, test_version="v2"))]

    for command in (("judge", "latest"), ("compare", "previous", "latest")):
        said = tracker(runs, *command)[1]
        assert "not compared, 1 series of 1 tests (t): the definition of the test changed" in said
        assert "tracker backfill COMMIT" in said
