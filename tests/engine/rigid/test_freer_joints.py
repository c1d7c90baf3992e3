"""Joints that hold less: what each leaves free, its energy, and how a recording reads it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    WORLD,
    ConstraintForce,
    Cylindrical,
    Hinge,
    Load,
    Lock,
    Orientation,
    Particle,
    Planar,
    PointOnLine,
    Position,
    RigidBody,
    Scene,
    SceneError,
    Violation,
    recorded_joints,
    simulate,
)
from spook_tracker.engine.protocol import Capabilities, unsupported
from tests.scenes.corpus import solid
from tests.scenes.coupling import H, Z, hung, masses, pair
from tests.scenes.seen import finals, traces

FREE: dict[
    type, tuple[tuple[int, ...], tuple[int, ...]]
] = {  # translations, rotations along x, y, z that are free
    PointOnLine: ((2,), (0, 1, 2)),
    Cylindrical: ((2,), (2,)),
    Planar: ((0, 1), (2,)),
}


@pytest.mark.parametrize("kind", FREE)
def test_each_holds_what_it_says_and_leaves_the_rest_free(kind: Any) -> None:
    body = RigidBody(name="body", mass=2.0, inertia=(1.0, 1.0, 1.0), position=(0.0, 0.0, 0.0))
    joint = kind(name="joint", between=(WORLD, "body"), axis=Z, compliance=0.0)
    for k in range(3):
        push = tuple(1e-3 * float(i == k) for i in range(3))
        for field, free, at, inertia in (
            ("force", FREE[kind][0], 7, 2.0),
            ("torque", FREE[kind][1], 10, 1.0),
        ):
            load = Load(name="push", body="body", **{field: push})
            scene = Scene(bodies=(body,), constraints=(joint,), forces=(load,))
            observe = finals(f=ConstraintForce("joint"), g=Violation("joint"))
            result = simulate(scene, time_step=H, steps=50, observe=observe)
            speed = result.final_state["body"][at + k]
            held = result["f"][k + (0 if field == "force" else 3)]

            assert result["g"].shape == (kind.rows,)
            if k in free:
                assert speed == pytest.approx(1e-3 * 0.5 / inertia, rel=1e-9)
                assert abs(held) < 1e-15
            else:
                assert abs(speed) < 1e-15
                assert held == pytest.approx(-1e-3, rel=1e-9)


@pytest.mark.parametrize("kind", FREE)
def test_a_recording_reads_the_same_violations(kind: Any) -> None:
    """Two bodies on a soft joint, both moving: the rows of the engine and those found from places and turns."""
    bodies = tuple(
        solid(name, None, (x, 0.2, 0.0), mass, (0.1, x, -0.2), (0.3, -x, 0.4), inertia=(1.0, 1.5, 2.0))
        for name, mass, x in (("one", 1.0, 0.0), ("two", 2.0, 1.0))
    )
    joint = kind(
        name="joint", between=("one", "two"), at=(0.4, 0.1, 0.3), axis=(1.0, 2.0, 2.0), compliance=0.1
    )
    scene = Scene(bodies=bodies, constraints=(joint,))
    observe = traces(g=Violation("joint"), x=Position(), q=Orientation())
    result = simulate(scene, time_step=H, steps=100, observe=observe)

    assert np.abs(result["g"][-1]).min() > 1e-4
    np.testing.assert_allclose(
        recorded_joints.violation(scene, joint, result["x"], result["q"]), result["g"], rtol=0, atol=1e-13
    )


def test_other_engines_are_not_asked_for_what_they_lack() -> None:
    able = Capabilities(
        particles=True,
        rigid_bodies=True,
        joints=frozenset({Lock, Hinge}),
        forces=frozenset({Load}),
        motors=True,
        compliance=True,
    )
    assert unsupported(able, masses(), {}) == ("the joint wire",)
    assert "the joint relation" in unsupported(able, pair(), {})
    assert unsupported(able, hung(strength=1.0), {}) == ("a joint that breaks", "functions of time")


@pytest.mark.parametrize("kind", [PointOnLine, Cylindrical, Planar])
@pytest.mark.parametrize(
    ("other", "word"), [("ghost", "'ghost'"), ("dot", "particle"), ("wall", "neither end can move")]
)
def test_an_end_that_cannot_be_held_is_refused(kind: Any, other: str, word: str) -> None:
    bodies = (
        RigidBody(name="body", mass=1.0, inertia=(1.0, 1.0, 1.0), position=(0.0, 0.0, 0.0)),
        RigidBody(name="wall", motion="static", position=(1.0, 0.0, 0.0)),
        Particle(name="dot", mass=1.0, position=(0.0, 1.0, 0.0)),
    )
    joint = kind(name="guide", between=(WORLD, other))
    with pytest.raises(SceneError, match=word) as caught:
        Scene(bodies=bodies, constraints=(joint,))
    assert "'guide'" in str(caught.value) and "\n" not in str(caught.value)
