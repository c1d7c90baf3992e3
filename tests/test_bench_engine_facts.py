"""What follows from how an engine is made comes out: on the published page, and of MuJoCo where it is installed."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path

import pytest

from bench.engine_facts import FACTS
from spook_tracker.engine import simulate
from spook_tracker.engine.find import find
from spook_tracker.engine.result import SimulationFailed

PAGE = Path(__file__).parents[1] / "docs" / "engines.md"
UPPER = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")


def cells() -> dict[str, list[str]]:
    """The page's table of facts: what each setting of each engine answered."""
    table = PAGE.read_text(encoding="utf-8").partition("## What kinds of engines do")[2].partition("\n## ")[0]
    rows = [line.strip("|").split("|") for line in table.splitlines() if re.match(r"\| \w+ \(", line)]
    return {row[0].strip(): [cell.strip() for cell in row[1:]] for row in rows[1:]}


def said(cell: str) -> float:
    """2.2×10⁻²² -> 2.2e-22, 10⁻⁵ -> 1e-5; what came apart is infinite."""
    if cell in ("diverged", "not finite"):
        return float("inf")
    power = re.fullmatch(r"(?:(.+)×)?10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)", cell)
    return float(f"{power[1] or 1}e{power[2].translate(UPPER)}" if power else cell)


def column(place: int) -> dict[str, float]:
    return {
        name: said(row[place])
        for name, row in cells().items()
        if row[place] not in ("-", "timed out", "crashed")
    }


def test_joint_coordinates_with_semi_implicit_euler_explode_on_the_chain_to_a_240th_of_a_second() -> None:
    for place in (0, 1):
        gain = column(place)
        for name in JOINT_COORDINATES:
            assert gain[name] > 1e3, name
        assert gain["mujoco (rk4)"] < 1.0
        assert gain["spook (plain)"] < 1.0


JOINT_COORDINATES = {"mujoco (defaults)", "drake (sap)", "dart (joints)", "pybullet (joints)"}


def test_the_page_says_what_its_table_of_kinds_shows() -> None:
    """Each sentence above the table, asked of every setting in it."""
    for place in (0, 1):
        gain = column(place)
        bounded = gain.keys() - JOINT_COORDINATES - {"exudyn (generalised-alpha)", "drake (rk3)"}
        assert len(bounded) >= 10
        assert all(gain[name] < 0.5 for name in bounded)
    assert column(0)["drake (rk3)"] == float("inf")
    assert column(1)["exudyn (generalised-alpha)"] > 0.5
    split = column(2)
    assert all(uneven >= 1.0 for name, uneven in split.items() if name != "spook (plain)")
    assert max(split.values()) > 3.0
    sag = column(3)
    held = {name for name, fallen in sag.items() if fallen < 1.0}
    assert held == {
        "spook (plain)", "dart (joints)", "dart (constraints)", "drake (sap)", "mujoco (rk4)",
        "mujoco (defaults)", "pybullet (joints)",
    }  # fmt: skip
    assert all(sag[name] < 2e-3 for name in held - {"pybullet (joints)"})
    assert 0.06 < sag["pybullet (joints)"] < 0.075
    assert all(sag[name] >= 1.2 for name in sag.keys() - held)
    creep = column(4)
    stands = {name for name, way in creep.items() if way < 1e-4}
    assert stands == {"spook (plain)", "cannon (accurate)", "jolt (many-iterations)", "jolt (defaults)"}
    assert max(creep, key=creep.__getitem__) == "mujoco (defaults)"


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
    single = {"jolt", "rapier"}

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


def test_ours_shows_none_of_them() -> None:
    assert FACTS["fact_chain"].measurements[0].measure(simulate)["energy_gain"] < 1.0
    assert FACTS["fact_door"].measurements[0].measure(simulate)["unevenness"] < 1e-12
    assert FACTS["fact_beam"].measurements[0].measure(simulate)["sag"] < 1e-12
    assert FACTS["fact_creep"].measurements[0].measure(simulate)["creep"] < 1e-12
