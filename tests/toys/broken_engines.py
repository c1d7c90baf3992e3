"""Engines with one fault each: what they simulate is not quite the scene or the method they were given."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, is_dataclass, replace
from typing import Any

from spook_tracker.engine import PLAIN, EngineError, Scene, Tyre, simulate
from spook_tracker.scalar_tests.case import Simulate


class Untouched(EngineError):
    """The fault finds nothing in this scene to be wrong about: the answer would be the right one."""


def with_scene(change: Callable[[Scene], Scene]) -> Simulate:
    """An engine that simulates another scene than it was given."""

    def engine(scene: Scene, **options: Any) -> Any:
        changed = change(scene)
        if changed is scene:
            raise Untouched("nothing in this scene is changed by this fault")
        return simulate(changed, **options)

    return engine


def scaled(thing: Any, factor: float, names: tuple[str, ...]) -> Any:
    """`thing` with every number or vector of these names times `factor`, wherever it lies inside."""
    if isinstance(thing, tuple):
        return tuple(scaled(part, factor, names) for part in thing)
    if not is_dataclass(thing) or isinstance(thing, type):
        return thing
    changed = {}
    for field in fields(thing):
        value = getattr(thing, field.name)
        if field.name in names and isinstance(value, float):
            changed[field.name] = factor * value
        elif field.name in names and isinstance(value, tuple) and all(isinstance(v, float) for v in value):
            changed[field.name] = tuple(factor * part for part in value)
        elif isinstance(value, tuple) or is_dataclass(value):
            inside = scaled(value, factor, names)
            if inside is not value and inside != value:
                changed[field.name] = inside
    return replace(thing, **changed) if changed else thing


def off_by(factor: float, *names: str) -> Simulate:
    """An engine that takes these quantities of a scene `factor` times too large."""
    return with_scene(lambda scene: scaled(scene, factor, names))


def deaf(scene: Scene, **options: Any) -> Any:
    """Ignores every option of the method."""
    return simulate(scene, **(options | {"method": PLAIN}))


def softened(scene: Scene) -> Scene:
    """Every joint with a compliance of its own; a tyre has its stiffness."""

    def one(row: Any) -> Any:
        return row if isinstance(row, Tyre) else replace(row, compliance=1e-6)

    constraints = tuple(one(row) for row in scene.constraints)
    return scene if constraints == scene.constraints else replace(scene, constraints=constraints)


def spongy(scene: Scene) -> Scene:
    """Every surface with a compliance of its own."""

    def one(body: Any) -> Any:
        material = getattr(body, "material", None)
        return replace(body, material=replace(material, compliance=1e-4)) if material else body

    bodies = tuple(one(body) for body in scene.bodies)
    return (
        scene
        if all(a is b for a, b in zip(bodies, scene.bodies, strict=True))
        else replace(scene, bodies=bodies)
    )


def restless(scene: Scene, *, time_step: float, **options: Any) -> Any:
    """Steps 3 % further than it says."""
    return simulate(scene, time_step=1.03 * time_step, **options)


def lopsided(scene: Scene) -> Scene:
    """Every inertia 1 % off along one axis."""

    def tilted(body: Any) -> Any:
        inertia = getattr(body, "inertia", None)
        return replace(body, inertia=(1.01 * inertia[0], *inertia[1:])) if inertia else body

    bodies = tuple(tilted(body) for body in scene.bodies)
    return (
        scene
        if all(a is b for a, b in zip(bodies, scene.bodies, strict=True))
        else replace(scene, bodies=bodies)
    )


BROKEN: dict[str, Simulate] = {  # what is seen in few tests comes last
    "soft joints": with_scene(softened),
    "spongy surfaces": with_scene(spongy),
    **{
        f"{name} 3 % too small": off_by(0.97, name)
        for name in (
            "friction",
            "restitution",
            "strength",
            "gravity",
            "stiffness",
            "force",
            "speed",
            "cornering",
        )
    },
    "bodies 3 % too large": off_by(1.03, "radius", "size"),
    "restless clock": restless,
    "deaf to options": deaf,
    "lopsided": with_scene(lopsided),
}
