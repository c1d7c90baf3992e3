"""Bodies that overlap in flight are parted: momenta stay to rounding, energy is not gained, joints hold."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from spook_tracker.engine import (
    AngularMomentum,
    Ball,
    Box,
    Capsule,
    Cone,
    ConvexHull,
    Cylinder,
    Distance,
    Energy,
    Hinge,
    KineticEnergy,
    Lock,
    Material,
    Maximum,
    MaximumAbsolute,
    Method,
    Momentum,
    Penetration,
    Position,
    Prismatic,
    RigidBody,
    Scene,
    Sphere,
    Trace,
    Violation,
    simulate,
)
from spook_tracker.scalar_tests import loose_bearing

STEPS = 12
TIME_STEPS = (1e-6, 1e-4, 1 / 60)  # s
SOLVERS = ("direct", "iterative")
WEDGE = ConvexHull.placed(((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0.8, 0.8, 0.8))).shape
SHAPES = (Sphere(0.5), Box((1.0, 0.6, 0.8)), Capsule(0.3, 0.8), Cylinder(0.4, 0.9), Cone(0.5, 0.9), WEDGE)
JOINTS = (None, Distance, Ball, Hinge, Prismatic, Lock)
WATCH = {
    "energy": Trace(quantity=KineticEnergy()),
    "p": Trace(quantity=Momentum()),
    "l": Trace(quantity=AngularMomentum()),
    "depth": Maximum(quantity=Penetration()),
}


def bodies_inside_each_other(rng: np.random.Generator, count: int, speed: float) -> Iterable[RigidBody]:
    """Of random shapes, off centre, that fly and spin."""
    place = np.zeros(3)
    for k in range(count):
        turn = rng.normal(size=4)
        yield RigidBody(
            name=f"body {k}",
            mass=rng.uniform(0.5, 2.0),
            shape=SHAPES[rng.integers(len(SHAPES))],
            position=tuple(place),
            orientation=tuple(turn / np.linalg.norm(turn)),
            velocity=tuple(speed * rng.normal(size=3)),
            angular_velocity=tuple(speed * rng.normal(size=3)),
        )
        place = place + 0.25 * rng.normal(size=3)


def joined(kind: type | None, rng: np.random.Generator, bodies: tuple[RigidBody, ...]) -> Iterable[object]:
    """Each body to the next; a body and the one after the next are free to meet."""
    for first, second in pairwise(bodies):
        between, name = (first.name, second.name), f"{first.name} to {second.name}"
        point, axis = tuple(0.3 * rng.normal(size=3)), rng.normal(size=3)
        if kind is Distance:
            yield Distance(name=name, between=between, anchors=(point, tuple(0.3 * rng.normal(size=3))))
        elif kind in (Hinge, Prismatic):
            yield kind(name=name, between=between, at=point, axis=tuple(axis / np.linalg.norm(axis)))
        elif kind is not None:
            yield kind(name=name, between=between, at=point)


def overlapping(kind: type | None, seed: int, speed: float = 1.0) -> Scene:
    rng = np.random.default_rng(seed)
    bodies = tuple(bodies_inside_each_other(rng, 2 + seed % 2 if kind is None else 3, speed))
    return Scene(bodies=bodies, constraints=tuple(joined(kind, rng, bodies)))  # type: ignore[arg-type]


@pytest.mark.parametrize("time_step", TIME_STEPS)
@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("kind", JOINTS, ids=lambda kind: "free" if kind is None else kind.__name__)
def test_parting_keeps_momenta_and_gains_no_energy(kind: type | None, solver: str, time_step: float) -> None:
    """A joint's finite turn, answered by (4/h) Ups of its violation, made 1096 J of 12 J in three steps of 1e-6 s."""
    depths = []
    for seed in (0, 1, 3, 4):
        result = simulate(
            overlapping(kind, seed),
            time_step=time_step,
            duration=STEPS * time_step,
            method=Method(solver=solver),
            observe=WATCH,
        )
        p, spin, energy = result["p"], result["l"], result["energy"]
        depths.append(result["depth"])

        assert np.abs(p - p[0]).max() < 1e-11
        assert np.abs(spin - spin[0]).max() < 1e-11
        assert energy.max() <= energy[0] * (1 + 1e-12)
    assert min(depths) > 1e-3 or kind is not None
    assert max(depths) > 0.1


@pytest.mark.parametrize("kind", [Distance, Ball, Hinge, Prismatic])
def test_joints_hold_while_their_bodies_are_parted(kind: type) -> None:
    """At 1e-6 s a joint's default compliance gives way more easily than a body: parting must not use that."""
    for seed in (0, 1, 3, 4):
        scene = overlapping(kind, seed, speed=0.0)
        result = simulate(
            scene,
            time_step=1e-6,
            duration=40e-6,
            observe={
                joint.name: MaximumAbsolute(quantity=Violation(joint.name)) for joint in scene.constraints
            },
        )

        assert max(np.abs(result[joint.name]).max() for joint in scene.constraints) < 1e-8


@pytest.mark.parametrize("time_step", [1 / 60, 1 / 240])
@pytest.mark.parametrize("mass", [1e-6, 1e-3, 1e3, 1e6, 1e9])
def test_a_heavy_body_does_not_sink_into_a_light_jointed_one(mass: float, time_step: float) -> None:
    """A pin on a crank leads a slider of another weight by its slot: contacts gave way by what moves the lighter side, and
    1000 t sank .43 mm into it at 1/240 s. What is left is a depth that counts as none, 1e-10 of a size."""
    slotted = loose_bearing.scene(time_step)
    weights = {"mass": mass, "inertia": (0.01 * mass,) * 3}
    bodies = tuple(replace(b, **weights) if b.name == "slider" else b for b in slotted.bodies)  # type: ignore[arg-type]
    result = simulate(
        replace(slotted, bodies=bodies),
        time_step=time_step,
        duration=1.2,
        observe={"depth": Maximum(quantity=Penetration())},
    )

    assert result.completed and result.counters["corrections"] > 10
    assert result["depth"] < 1e-10


@pytest.mark.parametrize("time_step", [1e-6, 1e-5, 1e-4, 1e-3, 1 / 60])
@pytest.mark.parametrize("compliance", [1e-8, 1e-6, 1e-4])
@pytest.mark.parametrize("solver", SOLVERS)
def test_a_compliant_contact_gives_back_no_more_than_it_was_given(
    solver: str, compliance: float, time_step: float
) -> None:
    """Balls that overlap and approach: a blow is no sign that compliance explains their depth (1 J became 25 kJ)."""
    soft = Material(compliance=compliance)
    for depth in (0.02, 0.3):
        result = simulate(
            Scene(
                bodies=(
                    RigidBody(name="left", mass=1.0, shape=Sphere(0.5), position=(0, 0, 0), velocity=(1, 0, 0),
                              material=soft),
                    RigidBody(name="right", mass=1.0, shape=Sphere(0.5), position=(1 - depth, 0.1, 0),
                              velocity=(-1, 0, 0), material=soft),
                )
            ),
            time_step=time_step,
            duration=40 * time_step,
            method=Method(solver=solver),
            observe={"energy": Trace(quantity=Energy())},
        )  # fmt: skip

        assert result["energy"].max() <= 1.0 + 1e-9


@pytest.mark.parametrize("boxes", [2, 5])
def test_what_parts_is_not_pushed_into_a_third_that_nothing_touches(boxes: int) -> None:
    """A row along x, .1 mm between all, the first 4 mm inside a wall. Parting takes .8 mm in the first step: the next
    one was entered by .74 mm, since only pairs that touch had a say."""
    side, gap = 0.2, 1e-4
    row = [
        RigidBody(
            name=f"box {k}",
            mass=1.0,
            shape=Box((side, side, side)),
            position=(side - 4e-3 + k * (side + gap), 0.0, 0.0),
        )
        for k in range(boxes)
    ]
    wall = RigidBody(name="wall", motion="static", shape=Box((side, side, side)), position=(0.0, 0.0, 0.0))
    run = simulate(
        Scene(bodies=(wall, *row)),
        time_step=1 / 60,
        steps=40,
        observe={body.name: Trace(quantity=Position(body.name)) for body in row},
    )

    places = np.array([run[body.name][:, 0] for body in row])
    assert places[0, -1] == pytest.approx(side, abs=1e-6)
    assert np.diff(places, axis=0).min() > side - 1e-9
