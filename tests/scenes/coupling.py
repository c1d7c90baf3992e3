"""Wheels on axles and weights on wires, for the tests of relations and wires."""

from __future__ import annotations

from typing import Any

from spook_tracker.engine import WORLD, Hinge, Load, Lock, Particle, Ramp, Relation, RigidBody, Scene, Wire

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
H = 0.01


def rotor(name: str, inertia: float, x: float = 0.0, mass: float = 1.0) -> RigidBody:
    return RigidBody(name=name, mass=mass, inertia=(inertia, inertia, inertia), position=(x, 0.0, 0.0))


def axle(name: str, first: str = WORLD, **changes: Any) -> Hinge:
    return Hinge(name=f"{name} axle", between=(first, name), axis=Z, compliance=0.0, **changes)


def pair(
    first: float = 3.0, second: float = 2.0, compliance: float = 0.0, torque: float = 1.0, **drive: Any
) -> Scene:
    """Two wheels of 1 and 4 kg m² that mesh with `first` and `second` teeth; a torque on the first."""
    return Scene(
        bodies=(rotor("a", 1.0), rotor("b", 4.0, 2.0)),
        constraints=(
            axle("a", **drive),
            axle("b"),
            Relation(name="mesh", terms=(("a axle", first), ("b axle", second)), compliance=compliance),
        ),
        forces=(Load(name="torque", body="a", torque=(0.0, 0.0, torque)),),
    )


def masses(one: float = 3.0, two: float = 1.0) -> Scene:
    """Two weights on a wire over two eyes."""
    return Scene(
        bodies=(
            Particle(name="one", mass=one, position=(-1.0, 0.0, 0.0)),
            Particle(name="two", mass=two, position=(1.0, 0.0, -1.0)),
        ),
        constraints=(
            Wire(
                name="wire",
                through=(
                    ("one", (-1.0, 0.0, 0.0)),
                    (WORLD, (-1.0, 0.0, 5.0)),
                    (WORLD, (1.0, 0.0, 5.0)),
                    ("two", (1.0, 0.0, -1.0)),
                ),
                compliance=0.0,
            ),
        ),
        gravity=(0.0, 0.0, -10.0),
    )


def hung(**strength: Any) -> Scene:
    """2 kg on a lock, pulled down by a force that grows by 10 N a second."""
    body = RigidBody(name="body", mass=2.0, inertia=(1.0, 1.0, 1.0), position=(0.0, 0.0, 0.0))
    lock = Lock(name="lock", between=(WORLD, "body"), compliance=0.0, **strength)
    pull = Load(
        name="pull",
        body="body",
        force=(0.0, 0.0, -1.0),
        torque=(1.0, 0.0, 0.0),
        factor=Ramp(end=10.0, end_value=100.0),
    )
    return Scene(bodies=(body,), constraints=(lock,), forces=(pull,), gravity=(0.0, 0.0, -10.0))
