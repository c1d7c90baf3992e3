"""A value that was given and is not any more is a loss: an engine turns no gate green by saying that it cannot be asked."""

from __future__ import annotations

from dataclasses import replace
from datetime import date
from pathlib import Path

import msgspec
import pytest
from click.testing import CliRunner, Result

from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.document.json_form import NAN
from spook_tracker.tracker.document.run_document import Point
from spook_tracker.tracker.judge.accepted import Accepted
from spook_tracker.tracker.judge.series_history import judge_history
from tests.tracker.judge.test_analyse import SERIES, history, sample, states

pytestmark = pytest.mark.usefixtures("desk", "in_process")
LOST = "fall/plain/position_error"
GIVEN_UP = """
[[accepted]]
series = "fall/plain/*"
removed = true
who = "Ada"
why = "the team gave it up"
"""


def tracker(*command: str, lacks: str = "nan", error: str = "0") -> Result:
    """The command, with the toy engine, which lacks something and whose answers are off by so much."""
    of_engine = ["--engine", "toy_engine", "--catalogue", "toy_questions:CATALOGUE", "--workers", "0"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TOY_LACKS", lacks)
        patch.setenv("TOY_ERROR", error)
        return CliRunner().invoke(main, [*command, *of_engine], prog_name="tracker")


def night(lacks: str = "nan", error: str = "0") -> Result:
    return tracker("nightly", "--quick", lacks=lacks, error=error)


FALLING = "0.01"  # s: what alone is asked with this step


def test_a_value_that_an_engine_no_longer_gives_is_red_until_it_is_accepted() -> None:
    assert night().exit_code == 0

    first, second = night(FALLING), night(FALLING)
    assert (first.exit_code, second.exit_code) == (1, 1), first.output
    assert LOST in first.output and "no longer supported: it does not support falling" in first.output

    Path("accepted.toml").write_text(GIVEN_UP)
    assert night(FALLING).exit_code == 0


def test_a_red_value_does_not_become_green_by_being_withdrawn() -> None:
    assert night(error="9.0").exit_code == 1

    assert night(FALLING).exit_code == 1


def test_what_an_engine_never_gave_is_not_red_and_nothing_is_lost_without_a_history() -> None:
    assert tracker("run", lacks=FALLING).exit_code == 0
    assert night(FALLING).exit_code == 0


def test_a_change_that_withdraws_a_value_is_blocked() -> None:
    assert tracker("run").exit_code == 0
    assert tracker("run", lacks=FALLING).exit_code == 0

    done = CliRunner().invoke(main, ["compare", "previous", "latest"], prog_name="tracker")

    assert done.exit_code == 1, done.output
    assert "no longer supported: it does not support falling" in done.output


def lost(night: Point) -> Point:
    nothing = msgspec.structs.replace(
        night.sample, value=NAN, outcome="not_supported", passed=False, set_point_held=False
    )
    return night._replace(sample=nothing)


def told(*nights: Point, accepted: tuple[Accepted, ...] = ()) -> list[str]:
    return states(judge_history("t/c/m", SERIES, nights, accepted))


def test_it_is_news_once_and_recovers_when_the_value_is_back() -> None:
    one, two, three, four = history(0.01, 0.01, 0.01, 0.01)

    judged = judge_history("t/c/m", SERIES, [one, lost(two), lost(three), four])

    assert states(judged) == ["green", "detected", "detected", "recovered"]
    assert [night.news for night in judged] == [False, True, False, False]
    assert {night.stands for night in judged if night.red} == {"fail"}


@pytest.mark.parametrize("before", ["crashed", "timed_out", "missing", "not_finite"])
def test_what_failed_stays_red_while_it_is_not_supported(before: str) -> None:
    one, two, three = history(0.01, 0.01, 0.01)
    failed = two._replace(sample=msgspec.structs.replace(sample(NAN), outcome=before, passed=False))

    assert told(failed, lost(three)) == ["detected", "detected"]
    assert told(one, failed, lost(three)) == ["green", "detected", "detected"]


def test_another_definition_at_the_same_time_hides_no_loss() -> None:
    one, two, three = history(0.01, 0.01, 0.01)
    anew = [lost(night)._replace(test_version="2") for night in (two, three)]

    assert told(one, *anew) == ["green", "detected", "detected"]
    assert told(one, lost(two), anew[1]) == ["green", "detected", "detected"]
    assert told(lost(one), *anew) == ["unjudged", "unjudged", "unjudged"]


def test_a_loss_that_was_accepted_stays_accepted_under_another_definition_and_until_its_day() -> None:
    entry = Accepted(series="t/c/m", low=0.0, high=0.0, who="Ada", why="known", removed=True)
    one, two, three, four = history(0.01, 0.01, 0.01, 0.01)

    assert told(one, lost(two), lost(three), accepted=(entry,)) == ["green", "accepted", "unjudged"]
    anew = [lost(night)._replace(test_version="2") for night in (three, four)]
    assert told(one, lost(two), *anew, accepted=(entry,)) == ["green", "accepted", "unjudged", "unjudged"]
    short = replace(entry, until=date.fromisoformat(two.run.started[:10]))
    assert told(one, lost(two), lost(three), accepted=(short,)) == ["green", "accepted", "detected"]
