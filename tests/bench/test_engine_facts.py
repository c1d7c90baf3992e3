"""What follows from how an engine is made comes out: on the published page, and of MuJoCo where it is installed."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import partial

import pytest

import bench.engine_kinds as engine_kinds
from bench.engine_facts import FACTS, TWINS
from bench.engine_places import SINGLE
from spook_tracker.engine import PLAIN, Method, simulate
from spook_tracker.engine.find import find
from spook_tracker.engine.result import SimulationFailed
from spook_tracker.scalar_tests.case import Simulate
from spook_tracker.scalar_tests.ropes.hanging_chain.stability import predicted_break
from tests.places import ROOT

PAGE = ROOT / "docs" / "engines.md"


def cells() -> dict[str, list[str]]:
    """The page's table of facts: what each setting of each engine answered."""
    table = PAGE.read_text(encoding="utf-8").partition("## What kinds of engines do")[2].partition("\n## ")[0]
    rows = [line.strip("|").split("|") for line in table.splitlines() if re.match(r"\| \w+ \(", line)]
    return {row[0].strip(): [cell.strip() for cell in row[1:]] for row in rows[1:]}


def column(place: int) -> Mapping[str, float]:
    return engine_kinds.columns(cells())[place]


def test_joint_coordinates_with_semi_implicit_euler_explode_on_the_chain_to_a_240th_of_a_second() -> None:
    for place in (0, 1):
        gain = column(place)
        for name in engine_kinds.JOINT_COORDINATES:
            assert gain[name] > 1e3, name
        assert gain["mujoco (rk4)"] < 1.0
        assert gain["spook (plain)"] < 1.0


def test_the_page_says_what_its_table_of_kinds_shows() -> None:
    """Each sentence above the table is asked of every setting in it, as when the page is made."""
    shown, lacking = engine_kinds.carried(cells())
    told = PAGE.read_text(encoding="utf-8").partition("## What kinds of engines do")[2].partition("\n| ")[0]

    assert lacking == []
    assert told.strip().splitlines()[2:] == shown


@pytest.mark.parametrize(
    ("setting", "place", "now", "words"),
    [
        ("jolt (defaults)", 1, "0.6", "A chain of 26 links"),
        ("mujoco (rk4)", 2, "0.9", "A door on ten hinges"),
        ("spook (plain)", 3, "1.4", "A beam of 80 locked boxes"),
        ("spook (plain)", 4, "0.1", "A box"),
        ("rapier (defaults)", 5, "1.7×10⁻¹⁴", "Uniform motion"),
        ("newton (xpbd)", 6, "2", "A pendulum"),
        ("sapien (pgs)", 7, "1000", "A load on a light chain"),
        ("newton (xpbd)", 8, "10⁶", "A heavy box on a light one"),
    ],
)
def test_a_sentence_that_the_table_does_not_carry_is_left_out(
    setting: str, place: int, now: str, words: str
) -> None:
    changed = cells()
    changed[setting][place] = now
    shown, lacking = engine_kinds.carried(changed)

    assert lacking == [words]
    assert not [line for line in shown if line.startswith(f"- **{words}**")]


def test_two_engines_split_the_doors_load_unevenly() -> None:
    split = column(2)

    assert split["spook (plain)"] < 1e-12
    assert len({name.split()[0] for name, uneven in split.items() if uneven > 0.5}) >= 2


def test_engines_of_constraints_let_the_beam_fall() -> None:
    sag = column(3)

    assert sag["spook (plain)"] < 1e-12
    assert sum(fallen > 0.5 for fallen in sag.values()) >= 5
    assert sag["mujoco (equalities)"] > 1.0
    assert sag["pybullet (constraints)"] > 1.0


def test_the_friction_of_mujocos_defaults_creeps() -> None:
    creep = column(4)

    assert creep["mujoco (defaults)"] > 0.01
    assert creep["mujoco (defaults)"] > 10.0 * creep["mujoco (rk4)"]
    assert creep["spook (plain)"] < 1e-12


def test_single_precision_loses_digits_that_double_keeps() -> None:
    lost = column(5)
    single = set(SINGLE)

    for name, error in lost.items():
        if name.split()[0] in single or name == "p2 (defaults)":
            assert 1e-6 < error < 1e-2, name
        else:
            assert error < 1e-12, name
    assert single <= {name.split()[0] for name in lost}


def test_mujoco_shows_three_of_them_here() -> None:
    pytest.importorskip("mujoco")
    ask = partial(find("mujoco").simulate, configuration="defaults")
    chain = FACTS["fact_chain"].measurements[0]

    with pytest.raises(SimulationFailed, match="bad"):
        chain.measure(ask)
    assert chain.measure(partial(find("mujoco").simulate, configuration="rk4"))["energy_gain"] < 1.0
    assert FACTS["fact_creep"].measurements[0].measure(ask)["creep"] > 0.01
    held = partial(find("mujoco").simulate, configuration="equalities")
    assert FACTS["fact_beam"].measurements[0].measure(held)["sag"] > 1.0


def test_mujoco_is_its_own_twin_and_ours_is_not() -> None:
    pytest.importorskip("mujoco")
    hinges, loop = (TWINS[f"fact_twin_{name}"].measurements[0].measure for name in ("hinges", "loop"))

    assert hinges(partial(find("mujoco").simulate, configuration="defaults"))["apart"] == 0.0
    assert 1e-9 < hinges(simulate)["apart"] < 0.1  # the same scene by another method
    assert 1e-9 < loop(simulate)["apart"] < 0.1


def test_mujoco_xla_is_mujoco_to_rounding_and_turns_balls_with_order_two() -> None:
    pytest.importorskip("mujoco.mjx", reason="the extra mjx is not installed")
    hinges, balls = (TWINS[f"fact_twin_{name}"].measurements[0].measure for name in ("hinges", "balls"))

    assert hinges(partial(find("mjx").simulate, configuration="defaults"))["apart"] < 1e-12
    assert 1e-6 < balls(partial(find("mjx").simulate, configuration="rk4"))["apart"] < 1e-4


def test_ours_shows_none_of_them() -> None:
    assert FACTS["fact_chain"].measurements[0].measure(simulate)["energy_gain"] < 1.0
    assert FACTS["fact_door"].measurements[0].measure(simulate)["unevenness"] < 1e-12
    assert FACTS["fact_beam"].measurements[0].measure(simulate)["sag"] < 1e-12
    assert FACTS["fact_creep"].measurements[0].measure(simulate)["creep"] < 1e-12


def test_ours_carries_a_load_up_to_its_explicit_bound_and_any_box() -> None:
    assert FACTS["fact_hung"].measurements[0].measure(simulate)["hung"] <= predicted_break()
    assert FACTS["fact_hung"].measurements[0].measure(simulate)["hung"] > 0.1 * predicted_break()
    assert FACTS["fact_stacked"].measurements[0].measure(simulate)["stacked"] == 1e6

    few = partial(simulate, method=Method(solver="iterative", iterations=5))
    assert FACTS["fact_stacked"].measurements[0].measure(few)["stacked"] < 1e3


def test_a_pendulum_shows_the_order_of_a_method() -> None:
    def by(method: Method) -> Simulate:
        return lambda scene, **options: simulate(scene, **(options | {"method": method}))

    for method, order in (
        (PLAIN, 1.0),
        (Method(half_step_velocities=True, corrections=2), 2.0),
        (Method(composition="order4"), 4.0),
    ):
        found = FACTS["fact_order"].measurements[0].measure(by(method))["order"]
        assert found == pytest.approx(order, abs=0.1), method
