"""Random scenes of rigid bodies for the tests: any joint, trees and loops, motors, springs and loads."""

from __future__ import annotations

from typing import Any

import numpy as np

from spook_tracker.engine import (
    WORLD,
    Ball,
    CentralGravity,
    Cylindrical,
    Distance,
    Hinge,
    JointSpring,
    Load,
    Lock,
    Motor,
    Particle,
    Planar,
    PointOnLine,
    Prismatic,
    RigidBody,
    Scene,
    Spring,
    Universal,
)
from spook_tracker.engine.bodies import Body
from spook_tracker.engine.joints import Constraint

TIME_STEP = 0.01  # s
GRAVITY = (0.4, -0.3, -9.81)  # m/s²
JOINTS: dict[str, type[Any]] = {
    "lock": Lock,
    "ball": Ball,
    "hinge": Hinge,
    "prismatic": Prismatic,
    "universal": Universal,
    "distance": Distance,
}
EVERY_JOINT = JOINTS | {"planar": Planar, "cylindrical": Cylindrical, "point on line": PointOnLine}


def vector(rng: np.random.Generator, scale: float) -> tuple[float, float, float]:
    x, y, z = scale * rng.standard_normal(3)
    return (float(x), float(y), float(z))


def rigid_body(rng: np.random.Generator, index: int, speed: float = 0.3, spin: float = 1.0) -> RigidBody:
    """A body of random mass, three different moments, turned at random, spinning slowly."""
    q = rng.standard_normal(4)
    a, b, c = rng.uniform(0.1, 1.0, 3)
    return RigidBody(
        name=f"b{index}",
        mass=float(10.0 ** rng.uniform(-0.5, 0.7)),
        inertia=(b + c, a + c, a + b),
        position=(1.0 + index, float(rng.uniform(-0.3, 0.3)), float(rng.uniform(-0.3, 0.3))),
        orientation=tuple(q / np.linalg.norm(q)),
        velocity=vector(rng, speed),
        angular_velocity=vector(rng, spin),
    )


def some(rng: np.random.Generator, choices: list[float], count: int) -> tuple[float, ...]:
    return tuple(float(rng.choice(choices)) for _ in range(count))


def joint(rng: np.random.Generator, kind: str, first: str, second: str, at: Any, **extra: Any) -> Constraint:
    """A joint of that kind with its own compliance and damping for every degree of freedom."""
    make = EVERY_JOINT[kind]
    rows = make.rows
    name = f"{kind} {first} {second}"
    compliance = some(rng, [1e-9, 1e-6, 1e-4], rows)
    damping = None if rng.random() < 0.3 else some(rng, [0.01, 0.02, 0.05], rows)
    if kind == "distance":
        end = at if first == WORLD else first
        anchors = (vector(rng, 0.2), vector(rng, 0.2))
        return Distance(
            name=name, between=(end, second), anchors=anchors, compliance=compliance[0], damping=0.02
        )
    axis = rng.standard_normal(3)
    axis /= np.linalg.norm(axis)
    if kind in ("hinge", "prismatic", "planar", "cylindrical", "point on line"):
        extra = {"axis": tuple(axis), **extra}
    if kind == "universal":
        cross = np.cross(axis, rng.standard_normal(3))
        extra = {"axis": tuple(axis), "cross_axis": tuple(cross / np.linalg.norm(cross))}
    return make(name=name, between=(first, second), at=at, compliance=compliance, damping=damping, **extra)  # type: ignore[no-any-return]


def between(bodies: list[RigidBody], i: int, j: int) -> tuple[float, ...]:
    """A point halfway between two bodies."""
    return tuple(0.5 * (np.array(bodies[i].position) + np.array(bodies[j].position)))


def one_joint(rng: np.random.Generator, kind: str, bodies: int, backwards: bool = False) -> Scene:
    """One body on a joint to the world, or two on one between them."""
    made = [rigid_body(rng, i) for i in range(bodies)]
    at = (0.4 + bodies, 0.1, 0.2)
    ends = ("b0", "b1") if bodies == 2 else (WORLD, "b0")
    if backwards:
        ends = (ends[1], ends[0])
    return Scene(bodies=tuple(made), constraints=(joint(rng, kind, *ends, at),), gravity=GRAVITY)


def tree(rng: np.random.Generator, count: int = 6) -> Scene:
    bodies = [rigid_body(rng, i) for i in range(count)]
    kinds = [str(kind) for kind in rng.permutation(list(JOINTS))]
    rows = [joint(rng, "hinge", WORLD, "b0", (0.5, 0.0, 0.0))]
    for i in range(1, count):
        parent = int(rng.integers(0, i))
        rows.append(joint(rng, kinds[i % 6], f"b{parent}", f"b{i}", between(bodies, parent, i)))
    return Scene(bodies=tuple(bodies), constraints=tuple(rows), gravity=GRAVITY)


def loop(rng: np.random.Generator, count: int = 5) -> Scene:
    """A ring of joints, tied to the world twice."""
    bodies = [rigid_body(rng, i) for i in range(count)]
    rows = [
        joint(
            rng,
            str(rng.choice(list(JOINTS))),
            f"b{i}",
            f"b{(i + 1) % count}",
            between(bodies, i, (i + 1) % count),
        )
        for i in range(count)
    ]
    rows += [
        joint(rng, "ball", WORLD, "b0", (0.5, 0.0, 0.0)),
        joint(rng, "distance", WORLD, "b2", (0.0, 0.0, 4.0)),
    ]
    return Scene(bodies=tuple(bodies), constraints=tuple(rows), gravity=GRAVITY)


def everything(rng: np.random.Generator) -> Scene:
    """A particle, a static body, driven and sprung joints, and every kind of force."""
    bodies: list[Body] = [rigid_body(rng, i) for i in range(4)]
    bodies += [
        Particle(name="dot", mass=0.7, position=(2.0, 1.0, 1.0), velocity=(0.0, 0.3, 0.0)),
        RigidBody(name="ground", motion="static", position=(0.0, 0.0, -3.0)),
    ]
    rows = (
        joint(rng, "hinge", "ground", "b0", (0.5, 0.0, 0.0), motor=Motor(speed=1.5)),
        joint(rng, "prismatic", "b0", "b1", (1.5, 0.0, 0.0), spring=JointSpring(stiffness=200.0, rest=0.1)),
        joint(rng, "hinge", "b1", "b2", (2.5, 0.0, 0.0), spring=JointSpring(stiffness=30.0, damping=0.03)),
        joint(rng, "prismatic", WORLD, "b3", (4.5, 0.0, 0.0), motor=Motor(speed=-0.7)),
        Distance(
            name="leash", between=("b2", "dot"), anchors=((0.1, 0.2, 0.0), (0.0, 0.0, 0.0)), compliance=1e-5
        ),
    )
    forces = (
        Spring(name="spring", between=("b0", "dot"), stiffness=20.0, rest_length=0.5, viscosity=0.4),
        Spring(name="soft", between=((0.0, 1.0, 0.0), "b2"), stiffness=3.0),
        CentralGravity(name="star", strength=2.0, centre=(2.0, 5.0, 0.0)),
        Load(name="push", body="b1", force=(0.0, 1.5, -0.5), torque=(0.3, 0.0, 0.2)),
    )
    return Scene(bodies=tuple(bodies), constraints=rows, forces=forces, gravity=GRAVITY)
