"""Random heaps never gain energy, whichever solver holds them."""

from __future__ import annotations

import datetime
import importlib.util
import itertools
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
import yaml

from tests.places import ROOT

FILE = ROOT / "bench" / "campaign.py"


@pytest.fixture(scope="module")
def campaign() -> Any:
    spec = importlib.util.spec_from_file_location("campaign", FILE)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    sys.modules["campaign"] = module
    spec.loader.exec_module(module)
    module.STEP_LIMIT = 60.0  # s: that a machine is busy is no fault of a heap
    return module


@pytest.mark.parametrize("number", range(9))
def test_a_random_heap_never_gains_energy(campaign: Any, number: int) -> None:
    ending = campaign.fall(number)

    assert ending.outcome == "completed"
    assert ending.rise <= campaign.RISE


@pytest.mark.parametrize("number", [27, 33, 54])
def test_edges_and_ends_that_turn_in_within_a_step_gain_none(campaign: Any, number: int) -> None:
    """Boxes and bars at some 10 rad/s: what no manifold knew of sank in by up to 87 mm, and was lifted."""
    assert campaign.fall(number).kept


@pytest.mark.parametrize("number", [4, 45, 117, 161, 243])
def test_what_bounces_between_walls_never_gains_energy(campaign: Any, number: int) -> None:
    """Balls that touch in flight were taken for carried, and kept the kick that the blow was to turn round."""
    assert campaign.fall(number, bouncy=True).kept


def test_what_feels_something_out_of_reach_is_counted(campaign: Any) -> None:
    """A ball amid the walls that does more than fall; beside one it may."""
    walls = np.array([body.position for body in campaign.bouncy_heap(0)[0].bodies if body.motion == "static"])
    speeds, time_step = np.zeros((len(walls) + 1, 3)), 1 / 60
    after = speeds.copy()
    after[-1] = time_step * campaign.GRAVITY
    for place, ghosts in (((0.0, 0.0, 1.5), 1), ((1.2, 0.0, 1.5), 0), ((0.0, 0.0, 2.7), 0)):
        places = np.vstack((walls, place))
        assert campaign.felt(places, speeds, after, time_step, len(walls), True) == 0
        assert campaign.felt(places, speeds, speeds, time_step, len(walls), True) == ghosts


def test_what_rebounds_faster_than_its_restitution_says_has_gained(campaign: Any) -> None:
    """A ball of 2 kg that comes at 5 m/s and leaves a hundredth faster; one that only falls, lies or leaves as fast wins nothing."""
    h, fall = 1 / 60, 9.81 / 60
    masses = np.array([0.0, 2.0])

    def won(before: float, after: float) -> float:
        v = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, before]])
        w = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, after]])
        height = h * after
        return float(campaign.rise(masses, v, w, after**2 - before**2 + 2.0 * 9.81 * height, h))

    assert won(-5.0, -5.0 - fall) < 0.0
    assert won(0.0, 0.0) == 0.0
    assert won(-5.0, 5.0) <= 0.0
    assert won(-5.0, 1.01 * 5.0) > 0.2


def test_what_gains_energy_is_not_kept(campaign: Any) -> None:
    assert not campaign.Ending(0, "direct", "completed", 2e-9, 1).kept
    assert not campaign.Ending(0, "direct", "timed_out", 0.0, 1).kept
    assert campaign.Ending(0, "direct", "unsettled", -1e-3, 1).kept


def test_a_campaign_is_of_as_many_heaps_as_are_asked_for(campaign: Any) -> None:
    assert campaign.HEAPS >= 2000


def test_no_week_asks_what_another_has_asked(campaign: Any) -> None:
    monday = datetime.date(2026, 1, 5)
    days = [monday + datetime.timedelta(days=k) for k in range(800)]
    firsts = [campaign.first_of_week(day, 2000) for day in days]

    assert {b - a for a, b in itertools.pairwise(firsts)} == {0, 2000}
    assert all(b - a == 2000 for a, b in zip(firsts, firsts[7:], strict=False))


def test_every_outcome_is_counted_and_a_lost_heap_is_not_kept(campaign: Any) -> None:
    outcomes = ("completed", "completed", "unsettled", "diverged", "timed_out")
    told = list(campaign.told([campaign.Ending(k, "direct", o, -1.0, 1) for k, o in enumerate(outcomes)]))
    words = [" ".join(line.split()) for line in told]

    assert {"completed 2 of 5", "unsettled 1 of 5", "diverged 1 of 5", "timed_out 1 of 5"} <= set(words)
    assert words[-1] == "4 of 5 heaps kept their energy and their time"


def test_two_processes_find_what_one_finds(campaign: Any) -> None:
    asked = [sys.executable, str(FILE), "--heaps", "3", "--first", "3"]
    alone, shared = (
        subprocess.run([*asked, "--workers", n], capture_output=True, text=True, timeout=300) for n in "12"
    )

    assert alone.stdout.startswith("3 ordinary heaps from number 3\n")
    assert alone.stdout == shared.stdout
    assert alone.returncode == shared.returncode == 0, alone.stderr + shared.stderr


def test_both_campaigns_run_every_week(campaign: Any) -> None:
    root = FILE.parents[1]
    weekly = yaml.safe_load((root / ".github" / "workflows" / "weekly.yml").read_text())
    recipes = (root / "Makefile").read_text()

    for target, kind in (("campaign", ""), ("campaign-wide", " --wide")):
        assert target in weekly["jobs"]["heavy"]["strategy"]["matrix"]["target"]
        assert (
            f"{target}: develop\n\t$(BIN)/python bench/campaign.py --this-week --workers 2{kind}\n" in recipes
        )
