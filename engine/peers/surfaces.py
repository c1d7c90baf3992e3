"""What adapters share about surfaces: pairs that must not touch, a restitution for all."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import combinations, combinations_with_replacement

import numpy as np

from ..bodies import WORLD, Material, RigidBody
from ..joints import Joint
from ..protocol import NotSupported
from ..scene import Scene


def solid(scene: Scene) -> list[RigidBody]:
    """The bodies that have a surface."""
    return [b for b in scene.bodies if isinstance(b, RigidBody) and b.shape is not None]


def pairs_apart(scene: Scene) -> list[tuple[str, str]]:
    """Pairs of bodies with surfaces that must not touch: those named and those joined."""
    names = {body.name for body in solid(scene)}
    joined = [c.between for c in scene.constraints if isinstance(c, Joint) and WORLD not in c.between]
    pairs = {(a, b) if a < b else (b, a) for a, b in (*scene.no_contact, *joined)}
    return sorted(pair for pair in pairs if names.issuperset(pair))


def _of_all(
    scene: Scene, given: Callable[[Material], float], joined: Callable[[float, float], float]
) -> set[float]:
    """What a coefficient comes to in every pair of surfaces that may touch."""
    counts = [(given(b.material), b.motion == "dynamic") for b in solid(scene)] if scene.contacts else []
    return {
        joined(a[0], b[0])
        for a, b in combinations_with_replacement(sorted(set(counts)), 2)
        if (a[1] or b[1]) and (a != b or counts.count(a) > 1)
    }


def one_restitution(scene: Scene, engine: str) -> float:
    """The restitution of every pair, for engines that multiply those of two bodies where we take the larger.

    Raises NotSupported where two pairs differ: no numbers for single bodies give both then.
    """
    found = _of_all(scene, lambda material: material.restitution, max)
    if len(found) > 1:
        raise NotSupported(f"{engine} does not support surfaces of different restitution in one scene")
    return max(found, default=0.0)


def one_friction(scene: Scene, engine: str) -> float:
    """The friction of every pair, for engines that do not take the geometric mean of two: it is given to all surfaces.

    Raises NotSupported where two pairs differ: they have a coefficient for each surface, which would give pairs others.
    """
    found = _of_all(scene, lambda material: material.friction, lambda a, b: a if a == b else math.sqrt(a * b))
    if len(found) > 1:
        raise NotSupported(f"our adapter cannot ask {engine} for pairs of different friction in one scene")
    return max(found, default=0.0)


def shares(scene: Scene, kind: str, engine: str) -> dict[str, float]:
    """What each surface gives to "rolling" or "torsional" friction [m] where an engine adds for two of them
    √µ_b share_a + √µ_a share_b, and we take the larger coefficient of the two.

    Raises NotSupported where no shares give every pair its own.
    """
    bodies = solid(scene) if scene.contacts else []
    own = [float(getattr(body.material, f"{kind}_friction")) for body in bodies]
    if not any(own):
        return {}
    root = [math.sqrt(body.material.friction) for body in bodies]
    pairs = [
        (a, b)
        for a, b in combinations(range(len(bodies)), 2)
        if "dynamic" in (bodies[a].motion, bodies[b].motion)
    ]
    sums, wanted = np.zeros((len(pairs), len(bodies))), np.array([max(own[a], own[b]) for a, b in pairs])
    for row, (a, b) in zip(sums, pairs, strict=True):
        row[a], row[b] = root[b], root[a]
    found = np.clip(np.linalg.lstsq(sums, wanted, rcond=None)[0], 0.0, None)
    if not np.allclose(sums @ found, wanted, rtol=1e-9, atol=1e-12 * wanted.max()):
        raise NotSupported(f"{engine} does not support surfaces of different {kind} friction in one scene")
    return {body.name: float(share) for body, share in zip(bodies, found, strict=True)}
