"""What adapters share about surfaces: pairs that must not touch, a restitution for all."""

from __future__ import annotations

from itertools import combinations_with_replacement

from spook_tracker.engine.bodies import WORLD, RigidBody
from spook_tracker.engine.joints import Joint
from spook_tracker.engine.protocol import NotSupported
from spook_tracker.engine.scene import Scene


def solid(scene: Scene) -> list[RigidBody]:
    """The bodies that have a surface."""
    return [b for b in scene.bodies if isinstance(b, RigidBody) and b.shape is not None]


def pairs_apart(scene: Scene) -> list[tuple[str, str]]:
    """Pairs of bodies with surfaces that must not touch: those named and those joined."""
    names = {body.name for body in solid(scene)}
    joined = [c.between for c in scene.constraints if isinstance(c, Joint) and WORLD not in c.between]
    pairs = {(a, b) if a < b else (b, a) for a, b in (*scene.no_contact, *joined)}
    return sorted(pair for pair in pairs if names.issuperset(pair))


def one_restitution(scene: Scene, engine: str) -> float:
    """The restitution of every pair, for engines that multiply those of two bodies where we take the larger.

    Raises NotSupported where two pairs differ: no numbers for single bodies give both then.
    """
    if not scene.contacts:
        return 0.0
    kinds = {(b.material.restitution, b.motion == "dynamic") for b in solid(scene)}
    counts = [(b.material.restitution, b.motion == "dynamic") for b in solid(scene)]
    found = {
        max(a[0], b[0])
        for a, b in combinations_with_replacement(sorted(kinds), 2)
        if (a[1] or b[1]) and (a != b or counts.count(a) > 1)
    }
    if len(found) > 1:
        raise NotSupported(f"{engine} does not support surfaces of different restitution in one scene")
    return max(found, default=0.0)


def one_friction(scene: Scene, engine: str) -> float:
    """The friction of all surfaces, for engines that do not take the geometric mean of two.

    Raises NotSupported where two differ.
    """
    found = {body.material.friction for body in solid(scene)}
    if len(found) > 1:
        raise NotSupported(f"{engine} does not support surfaces of different friction in one scene")
    return found.pop() if found else 0.0
