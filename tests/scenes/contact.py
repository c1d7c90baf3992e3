"""Ground, balls and cubes of the contact tests."""

from __future__ import annotations

from spook_tracker.engine import Box, Material, Plane, RigidBody, Sphere

TIME_STEP = 1.0 / 60.0  # s
GRAVITY = 9.81  # m/s²
DOWN = (0.0, 0.0, -GRAVITY)
SMOOTH = Material()


def ground(material: Material = SMOOTH) -> RigidBody:
    return RigidBody(name="ground", position=(0, 0, 0), shape=Plane(), motion="static", material=material)


def ball(name: str = "ball", height: float = 0.5, material: Material = SMOOTH, **fields: object) -> RigidBody:
    given = {"position": (0.0, 0.0, height), "mass": 1.0, "shape": Sphere(0.5), "material": material} | fields
    return RigidBody(name=name, **given)  # type: ignore[arg-type]


def cube(name: str, position: tuple[float, float, float], **fields: object) -> RigidBody:
    return RigidBody(name=name, position=position, **({"mass": 1.0, "shape": Box((1, 1, 1))} | fields))  # type: ignore[arg-type]
