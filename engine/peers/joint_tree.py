"""A scene in joint coordinates: which body hangs from which by which joint, and what closes a loop.

Shared by every engine with such coordinates. A body that joints reach from the world hangs on the shortest way
there; of bodies that fly free the first of each group is free and the rest hang from it. A rod between particles at
its rest length is a hinge where all stays in a plane, and two hinges or a ball elsewhere.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from ..bodies import WORLD, Particle, RigidBody
from ..joints import Constraint, Distance, Joint
from ..recorded_joints import joint_point
from ..result import Array
from ..scene import Scene

UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


@dataclass
class Node:
    """A body on its way into the tree: the joint that ties it to its parent, if any."""

    body: Particle | RigidBody
    index: int
    parent: str | None = None  # None: free, or fixed
    tie: Constraint | None = None
    children: list[str] = field(default_factory=list)


def fixed(body: Particle | RigidBody) -> bool:
    """Whether nothing moves the body."""
    return isinstance(body, RigidBody) and body.motion != "dynamic"


def alone(scene: Scene) -> dict[str, Node]:
    """Every body free: all constraints stay constraints."""
    return {body.name: Node(body, index) for index, body in enumerate(scene.bodies)}


def grown(scene: Scene) -> dict[str, Node]:
    """Hang every body that joints reach from the world on the shortest way there; loops stay constraints."""
    nodes = alone(scene)
    beside: dict[str, list[Constraint]] = {}
    for constraint in scene.constraints:
        if not isinstance(constraint, Distance | Joint):  # wires and relations hang nothing
            continue
        if isinstance(constraint, Distance) and not _is_rod(scene, constraint):
            continue
        for end in constraint.between:
            beside.setdefault(end if isinstance(end, str) else WORLD, []).append(constraint)
    held = [name for name, node in nodes.items() if fixed(node.body)]
    reached, line = {WORLD, *held}, [WORLD, *held]
    starts = iter(list(nodes))
    while True:
        while line:
            parent = line.pop(0)
            for constraint in beside.get(parent, ()):
                names = [end if isinstance(end, str) else WORLD for end in constraint.between]
                child = names[1] if names[0] == parent else names[0]
                if child in reached:
                    continue
                reached.add(child)
                line.append(child)
                nodes[child].parent, nodes[child].tie = parent, constraint
                if parent in nodes:
                    nodes[parent].children.append(child)
        free = next((name for name in starts if name not in reached), None)
        if free is None:
            return nodes
        reached.add(free)  # a body that flies free, and what hangs from it
        line.append(free)


def _is_rod(scene: Scene, rod: Distance) -> bool:
    """Whether a distance is a rod between centres at its rest length, so that hinges can stand for it."""
    ends = [scene.body(end) for end in rod.between if isinstance(end, str)]
    length = scene.length(rod)
    return all(isinstance(body, Particle) for body in ends) and (
        rod.rest_length is None or abs(rod.rest_length - length) <= 1e-14 * length
    )


def below(nodes: dict[str, Node], top: str) -> Iterator[str]:
    """A body and all that hangs from it, parents first, without recursion: chains may be long."""
    line = [top]
    while line:
        name = line.pop()
        yield name
        line += reversed(nodes[name].children)


def closing(scene: Scene, nodes: dict[str, Node]) -> list[Constraint]:
    """The constraints that are not in the tree."""
    tied = {node.tie.name for node in nodes.values() if node.tie is not None}
    return [constraint for constraint in scene.constraints if constraint.name not in tied]


def plane_of_motion(scene: Scene) -> Array | None:
    """The normal of the plane in which all particles stay, if there is one."""
    if scene.forces:
        return None
    points = [b.position for b in scene.bodies]
    points += [end for c in scene.constraints for end in c.between if not isinstance(end, str)]
    spread = [np.subtract(p, points[0]) for p in points[1:]]
    spread += [np.array(b.velocity) for b in scene.bodies] + [np.array(scene.gravity)]
    _, sizes, axes = np.linalg.svd(np.array(spread))
    if sizes[0] == 0.0 or (len(sizes) > 2 and sizes[2] > 1e-12 * sizes[0]):
        return None
    return np.asarray(axes[2])


def rod_axes(rod: Array, normal: Array | None) -> list[Array]:
    """The axes [1] of the hinges that stand for a rod: the normal of its plane, or two normals of the rod."""
    if normal is not None:
        return [normal]
    least = np.eye(3)[int(np.argmin(np.abs(rod)))]
    one = np.cross(rod, least)
    two = np.cross(rod, one)
    return [one / np.linalg.norm(one), two / np.linalg.norm(two)]


def turn_of(body: Particle | RigidBody) -> Array:
    """A body's orientation at the start (w, x, y, z)."""
    return UPRIGHT if isinstance(body, Particle) else np.array(body.orientation)


def hung_at(scene: Scene, node: Node) -> Array:
    """Where the joint of a body that hangs from another is at the start, in world axes [m]."""
    tie = node.tie
    if isinstance(tie, Distance):
        return np.array(scene.anchor(tie, 0 if tie.between[1] == node.body.name else 1))
    assert isinstance(tie, Joint)
    return joint_point(scene, tie)


def spins(scene: Scene, nodes: dict[str, Node]) -> dict[str, Array]:
    """Angular velocity [rad/s] of every body at the start; of a particle on a rod, that of the rod."""
    found: dict[str, Array] = {}
    for name, node in nodes.items():
        if isinstance(node.body, RigidBody):
            found[name] = np.array(node.body.angular_velocity)
            continue
        found[name] = np.zeros(3)
        if isinstance(node.tie, Distance):
            arm = np.array(node.body.position) - hung_at(scene, node)
            above = nodes[node.parent].body.velocity if node.parent in nodes else (0.0, 0.0, 0.0)
            found[name] = np.cross(arm, np.subtract(node.body.velocity, above)) / (arm @ arm)
    return found


def sliding(nodes: dict[str, Node], node: Node, axis: Array, above: Array) -> float:
    """Speed [m/s] along a slide at the start; `above` is the parent's angular velocity."""
    parent = nodes.get(str(node.parent))
    place = np.array(parent.body.position) if parent else np.zeros(3)
    carried = np.cross(above, np.array(node.body.position) - place)
    carried = carried + (parent.body.velocity if parent else 0.0)
    return float((np.array(node.body.velocity) - carried) @ axis)
