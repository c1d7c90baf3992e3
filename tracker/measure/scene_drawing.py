"""What a reader has to see of a scene: solids, links, forces, as plain numbers a page can draw.

Taken from the scene's definition, not from a simulation, so that it changes only when the scene does.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

from msgspec.structs import replace

from spook_tracker.engine.bodies import WORLD, Particle, RigidBody
from spook_tracker.engine.couplings import Wire
from spook_tracker.engine.forces import CentralGravity, Spring
from spook_tracker.engine.joints import Distance, Joint
from spook_tracker.engine.scene import Scene
from spook_tracker.engine.shapes import Compound, Shape
from spook_tracker.tracker.document.quaternions import UPRIGHT, Quaternion, Vector, multiplied, turned
from spook_tracker.tracker.document.run_document import DrawnLink, DrawnSolid, SceneDrawing

from .gear_drawing import acted_on, gears_of

MOST_SOLIDS = 300
CLOSE = 0.7  # of the way to the nearest body, a box without a surface is long at most


def drawing(scene: Scene) -> SceneDrawing:
    """The scene at its start; a very large one is drawn in part."""
    solids = [solid for of_body in drawn_bodies(scene, scene.bodies[:MOST_SOLIDS]) for solid in of_body]
    places = {body.name: body.position for body in scene.bodies}
    turns = {body.name: getattr(body, "orientation", UPRIGHT) for body in scene.bodies}
    links: list[DrawnLink] = []
    for tie in (*scene.constraints, *scene.forces):
        if isinstance(tie, Distance | Spring):
            anchors = getattr(tie, "anchors", ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
            ends = [
                _end(end, anchor, places, turns) for end, anchor in zip(tie.between, anchors, strict=True)
            ]
            kind = "spring" if isinstance(tie, Spring) else "distance"
            links.append(DrawnLink(kind=kind, ends=(ends[0], ends[1])))  # type: ignore[arg-type]
        elif isinstance(tie, Wire):
            points = [point for _, point in tie.through]
            links += [DrawnLink(kind="distance", ends=ends) for ends in itertools.pairwise(points)]
        elif isinstance(tie, Joint):
            links += _joint(tie, places)
    return SceneDrawing(
        solids=tuple(solids),
        links=tuple(links[: 2 * MOST_SOLIDS]),
        attractors=tuple(force.centre for force in scene.forces if isinstance(force, CentralGravity)),
        gravity=scene.gravity,
    )


def driven_bodies(scene: Scene) -> frozenset[str]:
    """Names of the bodies whose motion is given, and of those that a motor acts on: of two the second."""
    given = {
        body.name
        for body in scene.bodies
        if isinstance(body, RigidBody)
        and body.motion == "kinematic"
        and (body.follows_time or any(body.velocity) or any(body.angular_velocity))
    }
    turned_by = {
        acted_on(joint)
        for joint in scene.constraints
        if isinstance(joint, Joint) and getattr(joint, "motor", None) is not None
    }
    return frozenset(given | turned_by)


def drawn_bodies(scene: Scene, bodies: Sequence[Particle | RigidBody]) -> list[list[DrawnSolid]]:
    """What is seen of each of these bodies of a scene: several solids of a compound, one of most others."""
    driven, gears = driven_bodies(scene), gears_of(scene)
    found = [gears.get(body.name) or _solids_of(body, bodies) for body in bodies]
    return [
        [replace(solid, driven=True) for solid in solids] if body.name in driven else solids
        for body, solids in zip(bodies, found, strict=True)
    ]


def _solids_of(body: Particle | RigidBody, beside: Sequence[Particle | RigidBody]) -> list[DrawnSolid]:
    if isinstance(body, Particle):
        return [DrawnSolid(kind="particle", position=body.position, velocity=body.velocity)]
    if body.shape is None:
        return [_shrunk(_of_inertia(body), body, beside)]
    return _solids(body.shape, body.position, body.orientation, body)


def _solids(shape: Shape, position: Vector, orientation: Quaternion, body: RigidBody) -> list[DrawnSolid]:
    if isinstance(shape, Compound):
        return [
            solid
            for part in shape.parts
            for solid in _solids(
                part.shape,
                _moved(position, orientation, part.position),
                multiplied(orientation, part.orientation),
                body,
            )
        ]
    if not shape.drawn_as:
        return []
    return [
        DrawnSolid(
            kind=shape.drawn_as,  # type: ignore[arg-type]
            position=position,
            orientation=orientation,
            size=shape.measures(),
            fixed=body.motion != "dynamic",
            velocity=body.velocity,
        )
    ]


def _of_inertia(body: RigidBody) -> DrawnSolid:
    """A body without a surface: the box of uniform density that turns as it does."""
    if body.mass is None or body.inertia is None:
        return DrawnSolid(kind="particle", position=body.position, velocity=body.velocity)
    x, y, z = body.inertia
    edges = (y + z - x, z + x - y, x + y - z)
    tilted = body.inertia_axes != UPRIGHT
    return DrawnSolid(
        kind="box",
        position=body.position,
        orientation=multiplied(body.orientation, body.inertia_axes) if tilted else body.orientation,
        size=tuple(math.sqrt(max(0.0, 6.0 * edge / body.mass)) for edge in edges),
        velocity=body.velocity,
    )


def _shrunk(solid: DrawnSolid, body: RigidBody, beside: Sequence[Particle | RigidBody]) -> DrawnSolid:
    """No larger than lets the others be seen: this box says how its body turns, not how far it reaches."""
    if solid.kind != "box":
        return solid
    apart = [d for other in beside if (d := math.dist(body.position, other.position)) > 0.0]
    share = CLOSE * min(apart, default=math.inf) / (max(solid.size) or 1.0)
    return solid if share >= 1.0 else replace(solid, size=tuple(share * edge for edge in solid.size))


def _end(end: object, anchor: Vector, places: dict[str, Vector], turns: dict[str, Quaternion]) -> Vector:
    """Where one end of a distance or a spring is: on a body, or at a point of the world."""
    if isinstance(end, str):
        return anchor if end == WORLD else _moved(places[end], turns[end], anchor)
    assert isinstance(end, Sequence)
    return (float(end[0]), float(end[1]), float(end[2]))


def _joint(joint: Joint, places: dict[str, Vector]) -> list[DrawnLink]:
    at = places[acted_on(joint)] if joint.at is None else joint.at
    return [DrawnLink(kind="joint", ends=(at, at))]


def _moved(position: Vector, orientation: Quaternion, by: Vector) -> Vector:
    dx, dy, dz = turned(orientation, by)
    return (position[0] + dx, position[1] + dy, position[2] + dz)
