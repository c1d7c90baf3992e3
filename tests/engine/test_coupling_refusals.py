"""Hostile relations, wires and joints: one sentence that names the culprit."""

from __future__ import annotations

import math
from typing import Any

import pytest

from spook_tracker.engine import (
    WORLD,
    Ball,
    Box,
    Lock,
    Method,
    MethodError,
    Particle,
    Relation,
    RigidBody,
    Scene,
    SceneError,
    Wire,
    simulate,
)
from tests.scenes.coupling import H, X, Y, Z, axle, hung, masses, rotor


def three() -> Scene:
    wheels = (rotor("a", 1.0), rotor("b", 1.0, 1.0), rotor("c", 1.0, 2.0))
    terms = tuple((f"{wheel.name} axle", 1.0) for wheel in wheels)
    return Scene(
        bodies=wheels, constraints=(*(axle(w.name) for w in wheels), Relation(name="sum", terms=terms))
    )


def run(scene: Scene, **method: Any) -> Any:
    return simulate(scene, time_step=H, steps=1, method=Method(**method))


HOSTILE: dict[str, tuple[Any, type, str]] = {
    "ratio 0": (
        lambda: Relation(name="r", terms=(("a", 0.0), ("b", 1.0))),
        SceneError,
        "coefficient of 'a' is 0",
    ),
    "NaN": (lambda: Relation(name="r", terms=(("a", math.nan), ("b", 1.0))), SceneError, "finite"),
    "one joint": (lambda: Relation(name="r", terms=(("a", 1.0),)), SceneError, "at least two"),
    "twice": (lambda: Relation(name="r", terms=(("a", 1.0), ("a", 2.0))), SceneError, "twice"),
    "no pairs": (lambda: Relation(name="r", terms=("ab", 1.0)), SceneError, "pairs"),  # type: ignore[arg-type]
    "stranger": (
        lambda: Scene(
            bodies=(rotor("a", 1.0),),
            constraints=(axle("a"), Relation(name="r", terms=(("a axle", 1.0), ("ghost", 1.0)))),
        ),
        SceneError,
        "'ghost'",
    ),
    "no coordinate": (
        lambda: Scene(
            bodies=(rotor("a", 1.0),),
            constraints=(
                axle("a"),
                Ball(name="ball", between=(WORLD, "a")),
                Relation(name="r", terms=(("a axle", 1.0), ("ball", 1.0))),
            ),
        ),
        SceneError,
        "'ball'",
    ),
    "three bodies stiffened": (
        lambda: run(three(), string_stiffness=True),
        MethodError,
        "'sum' ties more than two moving bodies, which string_stiffness cannot hold",
    ),
    "short wire": (lambda: Wire(name="w", through=((WORLD, X),)), SceneError, "two points"),
    "through itself": (
        lambda: Wire(name="w", through=((WORLD, Z), ("a", X), ("a", Y), (WORLD, X))),
        SceneError,
        "on 'a', so that part",
    ),
    "no way": (lambda: Wire(name="w", through=((WORLD, X), ("a", X))), SceneError, "coincide"),
    "no length": (lambda: Wire(name="w", through=((WORLD, X), ("a", Y)), length=0.0), SceneError, "length"),
    "restitution": (
        lambda: Wire(name="w", through=((WORLD, X), ("a", Y)), restitution=1.5),
        SceneError,
        "between 0 and 1",
    ),
    "nowhere": (
        lambda: Scene(
            bodies=(rotor("a", 1.0),), constraints=(Wire(name="w", through=(("ghost", X), ("a", Y))),)
        ),
        SceneError,
        "'ghost'",
    ),
    "off a particle": (
        lambda: Scene(
            bodies=(Particle(name="p", mass=1.0, position=X),),
            constraints=(Wire(name="w", through=((WORLD, Z), ("p", Y))),),
        ),
        SceneError,
        "only its centre",
    ),
    "nothing moves": (
        lambda: Scene(
            bodies=(
                RigidBody(name="wall", motion="static", shape=Box((1, 1, 1)), position=X),
                rotor("a", 1.0),
            ),
            constraints=(Wire(name="w", through=((WORLD, Z), ("wall", Y))),),
        ),
        SceneError,
        "nothing it runs through can move",
    ),
    "strength": (
        lambda: Lock(name="l", between=(WORLD, "a"), strength=0.0),
        SceneError,
        "strength must be positive",
    ),
    "strength of NaN": (
        lambda: Wire(name="w", through=((WORLD, X), ("a", Y)), strength=math.nan),
        SceneError,
        "strength must be finite",
    ),
    "composition of what breaks": (
        lambda: simulate(hung(strength=1.0), time_step=H, steps=1, method=Method(half_step_velocities=True)),
        MethodError,
        "a strength at which it breaks",
    ),
    "composition with a slack wire": (
        lambda: run(masses(), composition="order4"),
        MethodError,
        "may go slack",
    ),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_input_is_refused_with_one_sentence(name: str) -> None:
    act, kind, words = HOSTILE[name]
    with pytest.raises(kind, match=words) as caught:
        act()
    assert "\n" not in str(caught.value)
