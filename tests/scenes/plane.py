"""Random mechanisms that are their own mirror image in a plane of the world: chains, trees and loops of any joint."""

from __future__ import annotations

from typing import Any

import numpy as np

from spook_tracker.engine import WORLD, Hinge, Load, Lock, Planar, Prismatic, RigidBody, Scene

JOINTS: tuple[type[Any], ...] = (Hinge, Hinge, Hinge, Lock, Prismatic, Planar)


def in_space(normal: int, u: float, v: float, w: float = 0.0) -> tuple[float, float, float]:
    """The vector (u, v) of the plane across an axis of the world, and w along the axis."""
    out = [0.0, 0.0, 0.0]
    out[normal], out[(normal + 1) % 3], out[(normal + 2) % 3] = float(w), float(u), float(v)
    return (out[0], out[1], out[2])


def turned(normal: int, angle: float) -> tuple[float, float, float, float]:
    """The unit quaternion of a turn about an axis of the world."""
    return (float(np.cos(0.5 * angle)), *in_space(normal, 0.0, 0.0, float(np.sin(0.5 * angle))))


def mechanism(
    rng: np.random.Generator,
    bodies: int,
    loops: int = 0,
    *,
    chain: bool = False,
    joints: tuple[type[Any], ...] = JOINTS,
    decades: float = 0.5,
    compliances: tuple[float, ...] = (1e-8, 1e-5),
    reach: float = 1.0,
    speed: float = 1.0,
) -> Scene:
    """`bodies` on each other or the world, and `loops` hinges more. Masses of 10 to the ±`decades` kg, anchors `reach` m
    apart, turns of `speed` rad/s and speeds to match."""
    normal, away = int(rng.integers(3)), float(rng.normal())
    made: list[RigidBody] = []
    centres = reach * np.cumsum(rng.normal(0.3, 1.0, (bodies, 2)), axis=0)
    for k, centre in enumerate(centres):
        mass = float(10.0 ** rng.uniform(-decades, decades))
        across = mass * reach**2 * float(rng.uniform(0.05, 0.5))
        inertia = [0.7 * across, 0.6 * across, 0.8 * across]
        inertia[normal] = across
        made.append(
            RigidBody(
                name=f"b{k}",
                mass=mass,
                inertia=(inertia[0], inertia[1], inertia[2]),
                position=in_space(normal, *centre, away),
                orientation=turned(normal, rng.uniform(-3.0, 3.0)),
                velocity=in_space(normal, *(speed * reach * rng.normal(size=2))),
                angular_velocity=in_space(normal, 0.0, 0.0, speed * rng.normal()),
            )
        )
    held: list[Any] = []

    def tie(kind: type[Any], first: str, second: str, at: np.ndarray) -> None:
        sense = float(rng.choice([-1.0, 1.0]))
        axis = {
            Prismatic: in_space(normal, *rng.normal(size=2)),
            Hinge: in_space(normal, 0.0, 0.0, sense),
            Planar: in_space(normal, 0.0, 0.0, sense),
        }
        options = {"axis": axis[kind]} if kind in axis else {}
        compliance, damping = float(rng.choice(compliances)), float(rng.uniform(0.0, 0.3))
        held.append(
            kind(
                name=f"j{len(held)}",
                between=(first, second),
                at=in_space(normal, *at, away),
                compliance=compliance,
                damping=damping,
                **options,
            )
        )

    for k in range(bodies):
        on = k - 1 if chain else int(rng.integers(-1, k))
        kind = joints[int(rng.integers(len(joints)))] if k else Hinge
        tie(kind, WORLD if on < 0 else f"b{on}", f"b{k}", centres[k] + 0.5 * reach * rng.normal(size=2))
    for _ in range(loops):
        tie(Hinge, WORLD, f"b{int(rng.integers(bodies))}", reach * rng.normal(size=2))
    push = in_space(normal, *rng.normal(size=2))
    loads = (
        (Load(name="push", body="b0", force=push, torque=in_space(normal, 0.0, 0.0, 0.3)),)
        if rng.integers(2)
        else ()
    )
    gravity = in_space(normal, 3.0, -9.81)
    return Scene(bodies=tuple(made), constraints=tuple(held), forces=loads, gravity=gravity, contacts=False)
