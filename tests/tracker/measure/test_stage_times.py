"""Where the time of a step goes."""

from __future__ import annotations

import re
from typing import Any

import click
import pytest

from spook_tracker import engine
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.tracker.cli.report_catalogue import stage_table
from spook_tracker.tracker.measure.cards import explained
from spook_tracker.tracker.measure.step_cost import ROUNDS, leaving_out
from spook_tracker.tracker.website.nights import book
from spook_tracker.tracker.website.stage_times import stage_times
from tests.histories.synthetic import history


def test_shares_are_of_the_longest_run_and_add_up() -> None:
    test = next(t for t in book(history(2)).tests if t.name == "beam")

    plain, half = stage_times(test)

    assert (plain.configuration, half.configuration) == ("plain", "half-step")
    assert [(part.stage, part.share) for part in plain.parts] == [
        ("solve_path", "75 %"),
        ("apply_gravity", "25 %"),
    ]
    assert sum(float(part.width) for part in plain.parts) == pytest.approx(100.0)
    assert plain.time_step == "0.00625 s"
    assert plain.total == "200\u202fns"


def test_without_clocks_there_are_no_bars() -> None:
    test = book(history(1)).tests[0]
    test.trends = test.gates()

    assert stage_times(test) == []


@pytest.mark.parametrize(
    ("name", "stages"),
    [
        ("pendulum", {"collision", "solve_block", "integrate_rotations"}),
        ("falling_object", {"collision", "integrate_rotations"}),  # without rows there is nothing to solve
        ("squeezer", {"collision"}),  # turns and is solved in blocks already
        ("falling_chain", set()),  # has all three, and is heavy: nothing is timed
    ],
)
def test_only_what_is_left_out_is_forced_in_and_timed(name: str, stages: set[str]) -> None:
    """Under the name by which `explain` calls the stage; each round times the scene as it is once."""
    test, asked = CATALOGUE[name], []

    def simulate(scene: Any, **options: Any) -> Any:
        asked.append(options["steps"])
        return engine.simulate(scene, **options)

    found = leaving_out(test, simulate)
    left_out = {choice.stage for choice in explained(test, engine) if not choice.kept}

    assert found is not None
    assert set(found.saved) == set(found.stages) == stages
    assert stages <= left_out
    assert all(seconds >= 0.0 for seconds in found.saved.values())
    assert len(found.times) == ROUNDS * bool(stages)
    if not stages:
        assert set(asked) == {1}


@pytest.mark.parametrize("name", ["pendulum", "falling_pile", "vehicle"])
def test_kept_stages_are_told_first_and_both_in_the_order_of_a_step(name: str) -> None:
    test = CATALOGUE[name]
    order = {choice.stage: choice.kept for choice in explained(test, engine)}
    table = click.unstyle(stage_table(name, test, engine))
    told = re.findall(r"^[✓·] (?:kept|left out) +(\w+) ", table, re.MULTILINE)

    assert told == [s for s, kept in order.items() if kept] + [s for s, kept in order.items() if not kept]
    assert told != list(order), "some that is left out comes before one that is kept"
