"""Hostile relations, wires and joints: one sentence that names the culprit."""

from __future__ import annotations

from typing import Any

import pytest

from spook_tracker.engine import (
    WORLD,
    Ball,
    Box,
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
