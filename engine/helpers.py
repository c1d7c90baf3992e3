"""What scenes are often put together from, in fewer words: a turn by an angle, a bar between two points, a pair of gears."""

from __future__ import annotations

import math
from typing import Any

from spook_tracker.misuse import explained

from . import check
from .bodies import RigidBody
from .check import Rotation, Vector
from .couplings import Relation
from .errors import SceneError
from .shapes import Box, Capsule, Shape


@explained
def axis_angle(axis: Vector, angle: float) -> Rotation:
    """The unit quaternion (w, x, y, z) of a right-handed turn by `angle` [rad] about `axis`, of whatever length.

    Raises SceneError for an axis of no length, and for what is no number.
    """
    x, y, z = check.direction("axis_angle", "axis", axis)
    half = check.number("axis_angle", "angle", angle) / 2.0
    return (math.cos(half), math.sin(half) * x, math.sin(half) * y, math.sin(half) * z)


@explained
def bar(
    start: Vector,
    end: Vector,
    *,
    radius: float | None = None,
    section: tuple[float, float] | None = None,
    **body: Any,
) -> RigidBody:
    """A body along the line between two world points [m], its z axis from `start` to `end`; `body` as RigidBody has it.

    With a `radius` [m] it is a capsule whose half-spheres have their centres there, with a `section` (along its x and y) [m] a
    box that ends there. Raises SceneError for anything else, and for points that coincide.
    """
    name = f"bar {body.get('name', '')!r}"
    first, second = check.vector(name, "start", start), check.vector(name, "end", end)
    along = (second[0] - first[0], second[1] - first[1], second[2] - first[2])
    length = math.hypot(*along)
    if length == 0.0:
        raise SceneError(f"{name}: start and end coincide at {first}, so it has no direction")
    shape: Shape
    if radius is not None and section is None:
        shape = Capsule(radius=radius, length=length)
    elif section is not None and radius is None:
        sides = check.entries(section)
        if sides is None or len(sides) != 2:
            raise SceneError(f"{name}: section must be two lengths, not {section!r}")
        shape = Box((sides[0], sides[1], length))
    else:
        raise SceneError(f"{name}: give either a radius, of a capsule, or a section, of a box")
    middle = (
        first[0] + along[0] / 2.0,
        first[1] + along[1] / 2.0,
        first[2] + along[2] / 2.0,
    )
    return RigidBody(position=middle, shape=shape, orientation=_turned_to(along, length), **body)


def _turned_to(along: Vector, length: float) -> Rotation:
    """The least turn that takes the z axis there; half a turn about x where it is opposite."""
    x, y, z = (component / length for component in along)
    aside = math.hypot(x, y)
    if aside == 0.0:
        return (1.0, 0.0, 0.0, 0.0) if z > 0.0 else (0.0, 1.0, 0.0, 0.0)
    half = math.atan2(aside, z) / 2.0
    return (math.cos(half), 0.0 - math.sin(half) * y / aside, math.sin(half) * x / aside, 0.0)


@explained
def gear_pair(
    name: str,
    first: tuple[str, float],
    second: tuple[str, float],
    *,
    inner: bool = False,
    **relation: Any,
) -> Relation:
    """Two gears in mesh, each a hinge and its teeth or pitch radius: they turn in opposite ways, an `inner` pair in the same.

    The force that is observed times its teeth is the torque [N m] on each; `relation` as Relation has it (compliance, damping).
    Costs one row. Raises SceneError for teeth that are not positive.
    """
    owner, terms = f"gear pair {name!r}", []
    for gear in (first, second):
        pair = check.entries(gear)
        if pair is None or len(pair) != 2:
            raise SceneError(f"{owner}: needs a hinge and its teeth, not {gear!r}")
        terms.append((pair[0], check.positive(owner, f"the teeth of {pair[0]!r}", pair[1])))
    if inner:
        terms[1] = (terms[1][0], -terms[1][1])
    return Relation(name=name, terms=tuple(terms), **relation)
