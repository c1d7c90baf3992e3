"""A scene whose bodies are heavier or lighter than it says."""

from __future__ import annotations

from dataclasses import replace

from spook_tracker import engine


def heavier(scene: engine.Scene, times: float, *names: str) -> engine.Scene:
    """The same places and shapes with so many times the mass and the inertia, of the named bodies or of all."""
    bodies = tuple(
        replace(body, mass=times * body.mass, inertia=tuple(times * one for one in body.inertia))
        if isinstance(body, engine.RigidBody) and body.mass is not None and (not names or body.name in names)
        else body
        for body in scene.bodies
    )
    return replace(scene, bodies=bodies)
