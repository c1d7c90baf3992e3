"""Gears as they look: what relations between hinges say of pitch circles and teeth, as solids a page can draw."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from spook_tracker.engine.bodies import WORLD
from spook_tracker.engine.couplings import Relation
from spook_tracker.engine.joints import AxialJoint, Hinge, Joint, Prismatic
from spook_tracker.engine.polytope import cross, dot, drawn, minus, quaternion
from spook_tracker.engine.scene import Scene
from spook_tracker.tracker.document.quaternions import Quaternion, Vector
from spook_tracker.tracker.document.run_document import DrawnSolid

FEWEST, MOST = 8, 120  # teeth of a wheel whose coefficient is not their number
LARGEST = (
    30.0  # ratio of two radii, or of a pinion's to the distance of its rack, that can be seen in one picture
)
THICK = 0.3  # of the pitch radius
DEPTH = 0.08  # of the pitch radius, above it and below it
ARM = (0.35, 0.16)  # an arm's width and thickness, of the smallest pitch radius on it


@dataclass(frozen=True)
class Wheel:
    """What turns about a hinge of a relation."""

    body: str
    axis: Vector
    radius: float  # m, of the pitch circle
    teeth: int


def acted_on(joint: Joint) -> str:
    """The second body of a joint, at whose centre it is unless it says where; of one with the world the body."""
    return next(name for name in reversed(joint.between) if name != WORLD)


def carrier(joint: Joint) -> str:
    """What it turns or slides on: the other body, or the world."""
    return next(name for name in joint.between if name != acted_on(joint))


def gears_of(scene: Scene) -> dict[str, list[DrawnSolid]]:
    """By body, what is drawn in place of the box of its inertia: wheels with their teeth, and the arms that carry them.

    Two hinges of one relation with parallel axes and coefficients of one sign mesh outside each other, so their pitch
    radii divide the distance of the axes in that proportion; beside a slide's coefficient a hinge's is a pinion's
    radius, m.
    """
    hinges = {joint.name: joint for joint in scene.constraints if isinstance(joint, AxialJoint)}
    shapeless = {body.name for body in scene.bodies if getattr(body, "shape", None) is None}
    wheels: dict[str, Wheel] = {}
    for relation in scene.constraints:
        if isinstance(relation, Relation) and all(name in hinges for name, _ in relation.terms):
            terms = [(hinges[name], factor) for name, factor in relation.terms]
            carriers = {carrier(joint) for joint, _ in terms}
            for wheel in _meshing(scene, [(j, f) for j, f in terms if acted_on(j) not in carriers]):
                wheels.setdefault(wheel.body, wheel)
    found = {name: [_toothed(scene, wheel)] for name, wheel in wheels.items() if name in shapeless}
    for joint in hinges.values():
        arm, carried = carrier(joint), wheels.get(acted_on(joint))
        if carried is not None and arm in shapeless and arm not in wheels:
            found.setdefault(arm, []).extend(_arm(scene, arm, carried))
    return found


def _meshing(scene: Scene, terms: Sequence[tuple[AxialJoint, float]]) -> list[Wheel]:
    """The wheels of two hinges, or of a hinge and a slide, that mesh as far as can be seen."""
    if len(terms) != 2:
        return []
    (one, here), (other, there) = sorted(terms, key=lambda term: isinstance(term[0], Prismatic))
    between = minus(scene.body(acted_on(other)).position, scene.body(acted_on(one)).position)
    along = dot(one.axis, between)
    apart = math.sqrt(max(0.0, dot(between, between) - along * along))
    if not isinstance(one, Hinge) or here == 0.0 or there == 0.0 or apart == 0.0:
        return []
    if isinstance(other, Prismatic):
        radius = abs(here / there)
        seen = apart / LARGEST <= radius <= LARGEST * apart
        return [Wheel(acted_on(one), one.axis, radius, 2 * FEWEST)] if seen else []
    parallel = abs(dot(one.axis, other.axis)) > 0.999
    ratio = here / there
    if not parallel or not 1.0 / LARGEST <= ratio <= LARGEST:
        return []
    whole = all(f == round(f) and FEWEST <= abs(f) <= MOST for f in (here, there))
    least = min(1.0, ratio)  # of the radius of the other
    wheels = []
    for joint, factor, size in ((one, here, ratio), (other, there, 1.0)):
        teeth = round(abs(factor)) if whole else min(MOST, round(2 * FEWEST * size / least))
        wheels.append(Wheel(acted_on(joint), joint.axis, apart * size / (1.0 + ratio), teeth))
    return wheels


def _toothed(scene: Scene, wheel: Wheel) -> DrawnSolid:
    """Half of each tooth is outside the pitch circle."""
    half = 0.5 * THICK * wheel.radius
    rim = []
    for i in range(4 * wheel.teeth):
        r = wheel.radius * (1.0 + DEPTH if i % 4 < 2 else 1.0 - DEPTH)
        angle = 2.0 * math.pi * i / (4 * wheel.teeth)
        rim.append((r * math.cos(angle), r * math.sin(angle)))
    faces: list[Sequence[Vector]] = []
    for (x, y), (u, v) in zip(rim, [*rim[1:], rim[0]], strict=True):
        faces.append(((0.0, 0.0, half), (x, y, half), (u, v, half)))
        faces.append(((0.0, 0.0, -half), (u, v, -half), (x, y, -half)))
        faces.append(((x, y, -half), (u, v, -half), (u, v, half), (x, y, half)))
    across = min(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), key=lambda v: abs(dot(v, wheel.axis)))
    return DrawnSolid(
        kind="facets",
        position=scene.body(wheel.body).position,
        orientation=_frame(across, wheel.axis),
        size=tuple(float(f"{number:.4g}") for number in drawn(faces)),
    )


def _arm(scene: Scene, arm: str, wheel: Wheel) -> list[DrawnSolid]:
    """A bar from the centre of a body to the axle of a wheel that it carries, above the wheel."""
    start = scene.body(arm).position
    along = minus(scene.body(wheel.body).position, start)
    length, (width, thick) = math.hypot(*along), (share * wheel.radius for share in ARM)
    if length == 0.0:
        return []
    up = 0.5 * THICK * wheel.radius + thick
    x, y, z = (s + 0.5 * d + up * a for s, d, a in zip(start, along, wheel.axis, strict=True))
    size = (length + width, width, thick)
    return [DrawnSolid(kind="box", position=(x, y, z), orientation=_frame(along, wheel.axis), size=size)]


def _frame(along: Vector, axis: Vector) -> Quaternion:
    """The turn that takes z to an axis, and x as near to `along` as that leaves it."""
    side = cross(axis, along)
    if math.hypot(*side) < 1e-9 * math.hypot(*along):  # an arm along its own axle
        side = cross(axis, (axis[1], axis[2], axis[0]))
    size = math.hypot(*side)
    y = (side[0] / size, side[1] / size, side[2] / size)
    x = cross(y, axis)
    return quaternion(tuple(zip(x, y, axis, strict=True)))  # type: ignore[arg-type]
