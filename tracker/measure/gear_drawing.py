"""Gears as they look: what relations between hinges say of pitch circles and teeth, as solids a page can draw."""

from __future__ import annotations

import math
from collections.abc import Sequence

from spook_tracker.engine.bodies import WORLD
from spook_tracker.engine.couplings import Relation
from spook_tracker.engine.joints import AxialJoint, Hinge, Prismatic
from spook_tracker.engine.scene import Scene
from spook_tracker.tracker.document.quaternions import Quaternion, Vector
from spook_tracker.tracker.document.run_document import DrawnSolid

FEWEST, MOST = 8, 120  # teeth of a wheel whose coefficient is not their number
THICK = 0.3  # of the pitch radius
DEPTH = 0.08  # of the pitch radius, above it and below it
ARM = (0.35, 0.16)  # an arm's width and thickness, of the smallest pitch radius on it


def gears_of(scene: Scene) -> dict[str, list[DrawnSolid]]:
    """By body, what is drawn in place of the box of its inertia: wheels with their teeth, and the arms that carry them.

    Two hinges of one relation with coefficients of one sign mesh outside each other, so their pitch radii divide the
    distance of their centres in that proportion; beside a slide's coefficient a hinge's is a pinion's radius, m.
    """
    hinges = {joint.name: joint for joint in scene.constraints if isinstance(joint, AxialJoint)}
    shapeless = {body.name for body in scene.bodies if getattr(body, "shape", None) is None}
    drawn: dict[str, list[DrawnSolid]] = {}
    radii: dict[str, float] = {}
    for relation in scene.constraints:
        if not isinstance(relation, Relation) or any(name not in hinges for name, _ in relation.terms):
            continue
        terms = [(hinges[name], factor) for name, factor in relation.terms]
        carriers = {joint.between[0] for joint, _ in terms} - {WORLD}
        meshing = [(joint, factor) for joint, factor in terms if joint.between[1] not in carriers]
        for joint, radius, teeth in _pitch_circles(scene, meshing):
            name = joint.between[1]
            if name in shapeless and name not in drawn:
                radii[name] = radius
                drawn[name] = [_wheel(scene.body(name).position, joint.axis, radius, teeth)]
    for joint in hinges.values():
        arm, wheel = joint.between
        if wheel in radii and arm in shapeless:
            drawn.setdefault(arm, []).append(
                _arm(scene.body(arm).position, scene.body(wheel).position, joint.axis, radii[wheel])
            )
    return drawn


def _pitch_circles(
    scene: Scene, meshing: Sequence[tuple[AxialJoint, float]]
) -> list[tuple[AxialJoint, float, int]]:
    """Hinge, radius [m] and number of teeth of each wheel of a pair that meshes."""
    if len(meshing) != 2:
        return []
    (one, here), (other, there) = meshing
    for wheel, factor, slide, way in ((one, here, other, there), (other, there, one, here)):
        if isinstance(wheel, Hinge) and isinstance(slide, Prismatic) and way:
            return [(wheel, abs(factor / way), 2 * FEWEST)]
    apart = math.dist(scene.body(one.between[1]).position, scene.body(other.between[1]).position)
    if not (isinstance(one, Hinge) and isinstance(other, Hinge)) or here * there <= 0.0 or apart == 0.0:
        return []
    least = min(abs(here), abs(there))
    whole = all(f == round(f) and FEWEST <= abs(f) <= MOST for f in (here, there))
    teeth = [round(abs(f)) if whole else min(MOST, round(2 * FEWEST * abs(f) / least)) for f in (here, there)]
    share = apart / (abs(here) + abs(there))
    return [(one, share * abs(here), teeth[0]), (other, share * abs(there), teeth[1])]


def _wheel(centre: Vector, axis: Vector, radius: float, teeth: int) -> DrawnSolid:
    """Half of each tooth is outside the pitch circle."""
    half = 0.5 * THICK * radius
    rim = []
    for i in range(4 * teeth):
        r = radius * (1.0 + DEPTH if i % 4 < 2 else 1.0 - DEPTH)
        angle = 2.0 * math.pi * i / (4 * teeth)
        rim.append((r * math.cos(angle), r * math.sin(angle)))
    size: list[float] = []
    for (x, y), (u, v) in zip(rim, [*rim[1:], rim[0]], strict=True):
        top = ((0.0, 0.0, half), (x, y, half), (u, v, half))
        bottom = ((0.0, 0.0, -half), (u, v, -half), (x, y, -half))
        side = ((x, y, -half), (u, v, -half), (u, v, half), (x, y, half))
        for face in (top, bottom, side):
            size += [len(face), *(float(f"{c:.4g}") for corner in face for c in corner)]
    return DrawnSolid(kind="facets", position=centre, orientation=_turn_to(axis), size=tuple(size))


def _arm(start: Vector, end: Vector, axis: Vector, radius: float) -> DrawnSolid:
    """A bar between two axles, above the wheels it carries."""
    along = (end[0] - start[0], end[1] - start[1], end[2] - start[2])
    length, (width, thick) = math.hypot(*along), (share * radius for share in ARM)
    up = 0.5 * THICK * radius + thick
    middle = tuple(s + 0.5 * d + up * a for s, d, a in zip(start, along, axis, strict=True))
    angle = math.atan2(along[1], along[0])
    about_z = (math.cos(0.5 * angle), 0.0, 0.0, math.sin(0.5 * angle))
    turn = about_z if abs(axis[2]) > 0.999 else _turn_between((1.0, 0.0, 0.0), along)
    return DrawnSolid(
        kind="box",
        position=(middle[0], middle[1], middle[2]),
        orientation=turn,
        size=(length + width, width, thick),
    )


def _turn_to(axis: Vector) -> Quaternion:
    return _turn_between((0.0, 0.0, 1.0), axis)


def _turn_between(one: Vector, other: Vector) -> Quaternion:
    """The shortest turn that takes the direction of one vector to that of the other."""
    long = math.hypot(*other)
    x, y, z = (c / long for c in other)
    dot = one[0] * x + one[1] * y + one[2] * z
    if dot < -1.0 + 1e-12:
        return (0.0, 1.0, 0.0, 0.0) if abs(one[0]) < 0.5 else (0.0, 0.0, 1.0, 0.0)
    w = 1.0 + dot
    v = (one[1] * z - one[2] * y, one[2] * x - one[0] * z, one[0] * y - one[1] * x)
    size = math.hypot(w, *v)
    return (w / size, v[0] / size, v[1] / size, v[2] / size)
