"""Compiling is choosing, executed: the native step runs the stages that explain() lists, and nothing else decides."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from spook_tracker import engine
from spook_tracker.engine import Final, Method, Position, Scene, Trace, _core
from spook_tracker.engine.rigid_program import pack
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from tests.scenes import particle as particle_scenes
from tests.scenes import rigid as rigid_scenes

METHODS = {
    "plain": Method(),
    "iterative": Method(solver="iterative"),
    "forced": Method(force_stages=("collision", "solve_block", "rotation")),
}
PARTICLE_METHODS = {
    "curved": Method(corrections=2, half_step_velocities=True),
    "stiff": Method(string_stiffness=True),
}
SEED = 7


def scenes() -> list[tuple[str, Scene, Method]]:
    rng = np.random.default_rng(SEED)
    particles = {
        build.__name__: build(rng)
        for build in (
            particle_scenes.chain,
            particle_scenes.tree,
            particle_scenes.loop,
            particle_scenes.everything,
        )
    }
    bodies = {
        build.__name__: build(rng)
        for build in (rigid_scenes.tree, rigid_scenes.loop, rigid_scenes.everything)
    }
    cases = [
        (f"particles {name} {how}", scene, method)
        for name, scene in particles.items()
        for how, method in (METHODS | PARTICLE_METHODS).items()
    ]
    cases += [
        (f"bodies {name} {how}", scene, method)
        for name, scene in bodies.items()
        for how, method in METHODS.items()
    ]
    return cases


CASES = scenes()


def executed(program: engine.Program) -> tuple[str, ...]:
    """The stages that the parts of the native step have taken on, asked of the native object itself."""
    return tuple(program._native.stages)


def kept(program: engine.Program) -> tuple[str, ...]:
    return tuple(choice.stage for choice in program.explain() if choice.kept)


@pytest.mark.parametrize(("name", "scene", "method"), CASES, ids=[case[0] for case in CASES])
def test_what_is_explained_is_what_the_native_step_runs(name: str, scene: Scene, method: Method) -> None:
    for observe in ({}, {"x": Trace(quantity=Position())}, {"x": Final(quantity=Position())}):
        program = engine.compile(scene, time_step=0.01, method=method, observe=observe)

        assert executed(program) == kept(program)


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_scene_of_the_catalogue_runs_what_it_explains(name: str) -> None:
    example = CATALOGUE[name].example()

    program = engine.compile(
        example.scene, time_step=example.time_step, method=example.method, observe=example.observe
    )

    assert executed(program) == kept(program)


def test_only_stages_of_the_list_take_time() -> None:
    scene = particle_scenes.everything(np.random.default_rng(SEED))
    program = engine.compile(scene, time_step=0.01)

    timed = program.run(20, time_stages=True)

    assert timed.stage_seconds
    assert set(timed.stage_seconds) <= set(kept(program))


def tables(scene: Scene) -> dict[str, Any]:
    return pack(scene, 0.01, Method())


@pytest.mark.parametrize(
    ("table", "column", "what"),
    [("joints", "kind", "joint"), ("bodies", "motion", "motion"), ("colliders", "kind", "shape")],
)
def test_an_unknown_kind_is_named_at_the_start(table: str, column: str, what: str) -> None:
    rng = np.random.default_rng(SEED)
    planted = tables(rigid_scenes.everything(rng))
    if table == "colliders":
        planted[table] = {
            "kind": ["sphere"],
            "body": np.array([0]),
            "position": np.zeros((1, 3)),
            "orientation": np.array([[1.0, 0.0, 0.0, 0.0]]),
            "radius": np.ones(1),
            "length": np.zeros(1),
            "size": np.zeros((1, 3)),
            "normal": np.zeros((1, 3)),
            "outline": np.zeros(1),
        }
    _core.RigidProgram(planted, [], [])
    planted[table] = planted[table] | {column: ["unheard of", *planted[table][column][1:]]}

    with pytest.raises(ValueError, match=f"there is no {what} 'unheard of'; there are "):
        _core.RigidProgram(planted, [], [])


def test_an_unknown_quantity_reduction_or_method_is_named_at_the_start() -> None:
    with pytest.raises(ValueError, match="there is no quantity 'colour'"):
        _core.QuantityRequest(kind="colour", index=-1, point=(0.0, 0.0, 0.0), other=-1)
    with pytest.raises(ValueError, match="there is no reduction 'median'"):
        _core.Observation(quantity=0, reduction="median", first=0, last=-1, from_start=False, every=1)
    planted = tables(rigid_scenes.tree(np.random.default_rng(SEED)))
    planted["method"] |= {"friction": "pyramid"}
    with pytest.raises(ValueError, match="there is no friction 'pyramid'"):
        _core.RigidProgram(planted, [], [])


def test_a_column_too_many_too_few_or_of_another_shape_is_named() -> None:
    scene = rigid_scenes.tree(np.random.default_rng(SEED))

    def bodies(**changes: Any) -> dict[str, Any]:
        planted = tables(scene)
        columns = planted["bodies"] | changes
        return planted | {"bodies": {name: values for name, values in columns.items() if values is not None}}

    count = len(scene.bodies)
    for changes, message in (
        ({"colour": np.zeros(count)}, "bodies: the column 'colour' means nothing here"),
        ({"mass": None}, "bodies: the column 'mass' is missing"),
        ({"mass": np.zeros((count, 2))}, "bodies: the column 'mass' needs 1 numbers a row"),
        ({"mass": np.zeros(count + 1)}, "differs in length"),
    ):
        with pytest.raises(ValueError, match=message):
            _core.RigidProgram(bodies(**changes), [], [])
