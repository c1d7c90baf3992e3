"""What crosses the border to the native side is what its column says: whole, a flag, a body that there is."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import Method, PairFriction, Scene, _core
from spook_tracker.engine.particle_program import pack as pack_particles
from spook_tracker.engine.rigid_program import pack
from tests.scenes import particle as particle_scenes
from tests.scenes import rigid as rigid_scenes

SCENE = rigid_scenes.everything(np.random.default_rng(7))
SCENE = replace(
    SCENE, pair_frictions=(PairFriction(between=tuple(b.name for b in SCENE.bodies[:2]), friction=0.5),)
)  # type: ignore[arg-type]


def tables(scene: Scene = SCENE) -> dict[str, Any]:
    return pack(scene, 0.01, Method())


def planted(table: str, column: str, value: float) -> dict[str, Any]:
    """The tables of the scene with one number put in place of another."""
    whole = tables()
    numbers = np.array(whole[table][column], dtype=float)
    numbers.flat[0] = value
    return whole | {table: whole[table] | {column: numbers}}


@pytest.mark.parametrize("value", [1.5, float("nan"), float("inf"), 1e300, -1e10])
@pytest.mark.parametrize(
    ("table", "column"), [("joints", "first"), ("motors", "joint"), ("no_contact", "first")]
)
def test_an_index_is_a_whole_number(table: str, column: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"{table}: the column '{column}' needs whole numbers, not "):
        _core.RigidProgram(planted(table, column, value), [], [])


@pytest.mark.parametrize(
    ("table", "column", "value", "what"),
    [
        ("joints", "first", 99, "bodies"),
        ("joints", "second", -2, "bodies"),
        ("springs", "first", 99, "bodies"),
        ("no_contact", "second", 99, "bodies"),
        ("no_contact", "first", -1, "bodies"),
        ("pair_frictions", "second", 99, "bodies"),
        ("motors", "joint", 99, "joints"),
        ("joint_springs", "joint", -1, "joints"),
        ("joint_springs", "joint", 99, "joints"),
    ],
)
def test_an_index_is_of_something_that_is_there(table: str, column: str, value: int, what: str) -> None:
    with pytest.raises(
        ValueError, match=f"{table}: the column '{column}' has {value}, and there are [0-9]+ {what}"
    ):
        _core.RigidProgram(planted(table, column, value), [], [])


@pytest.mark.parametrize("value", [2.0, -1.0, 0.5, float("nan")])
def test_a_flag_is_nought_or_one(value: float) -> None:
    with pytest.raises(ValueError, match="joints: the column 'one_sided' needs 0 or 1, not "):
        _core.RigidProgram(planted("joints", "one_sided", value), [], [])


def test_a_table_without_rows_still_has_all_its_columns() -> None:
    whole = tables()
    empty = {name: values[:0] for name, values in whole["motors"].items()}

    _core.RigidProgram(whole | {"motors": empty}, [], [])
    with pytest.raises(ValueError, match="motors: the column 'speed' is missing"):
        _core.RigidProgram(whole | {"motors": {"joint": empty["joint"]}}, [], [])
    with pytest.raises(ValueError, match="motors: the column 'colour' means nothing here"):
        _core.RigidProgram(whole | {"motors": empty | {"colour": np.zeros(0)}}, [], [])


@pytest.mark.parametrize(("kind", "table"), [("Rigid", "motors"), ("Particle", "rows")])
def test_a_table_or_an_option_too_many_or_too_few_is_named(kind: str, table: str) -> None:
    program = getattr(_core, f"{kind}Program")
    whole = (
        tables()
        if kind == "Rigid"
        else pack_particles(particle_scenes.chain(np.random.default_rng(7)), 0.01, Method())
    )
    method = whole["method"]
    for changed, message in (
        (
            {name: columns for name, columns in whole.items() if name != table},
            f"scene: the table '{table}' is missing",
        ),
        (whole | {"wheels": {}}, "scene: the table 'wheels' means nothing here"),
        (whole | {table: 3}, f"scene: the table '{table}' is no dict"),
        (whole | {"method": None}, "scene: the table 'method' is no dict"),
        (whole | {"method": method | {"colour": 1}}, "method: the option 'colour' means nothing here"),
        (whole | {"method": {"time_step": 0.01}}, "method: the option 'substeps' is missing"),
    ):
        with pytest.raises(ValueError, match=message):
            program(changed, [], [])


def test_a_particle_on_a_row_is_one_that_there_is() -> None:
    scene = particle_scenes.chain(np.random.default_rng(7))
    whole = pack_particles(scene, 0.01, Method())
    first = np.array(whole["rows"]["first"])
    first[0] = 99

    with pytest.raises(ValueError, match=r"rows: the column 'first' has 99, and there are [0-9]+ bodies"):
        _core.ParticleProgram(whole | {"rows": whole["rows"] | {"first": first}}, [], [])


@pytest.mark.parametrize("kind", ["rigid", "particles"])
def test_a_composition_goes_by_its_name(kind: str) -> None:
    scene = SCENE if kind == "rigid" else particle_scenes.chain(np.random.default_rng(7))
    whole = (pack if kind == "rigid" else pack_particles)(scene, 0.01, Method())
    program = _core.RigidProgram if kind == "rigid" else _core.ParticleProgram

    assert whole["method"]["composition"] == "none"
    with pytest.raises(
        ValueError, match="there is no composition 'order5'; there are none, order4, order6, order8"
    ):
        program(whole | {"method": whole["method"] | {"composition": "order5"}}, [], [])
