"""Box3D, in C, built from its public source by .ci/box3d with a loop of our own: contacts in single precision.

A plane is a box a thousand metres wide: Box3D has no half-space. Forces are those of the last of its substeps, friction
shared alike by the points of a pair. Friction of a joint is a motor that is to stand still, as its manual has it. Springs
between centres are its own; others, and fields, are pushed once a step, from C.
"""

from __future__ import annotations

import ctypes
import math
import os
import time
from pathlib import Path
from typing import Any

import numpy as np

from ..bodies import WORLD, Particle, RigidBody
from ..build_info import BuildInfo
from ..forces import CentralGravity, Load, Spring
from ..joints import Ball, Distance, Hinge, Joint, Lock, Prismatic
from ..meshes import HeightField, TriangleMesh
from ..observe import ConstraintForce, ContactCount, ContactForce, Penetration
from ..protocol import Capabilities, Configuration, NotSupported, Task
from ..recorded_joints import product
from ..recording import Recording
from ..result import Array
from ..shapes import Box, Capsule, Compound, ConvexHull, Plane, Shape, Sphere
from .frames import drive, ends_of
from .joint_tree import turn_of
from .stepped import Kept, stepped
from .surfaces import pairs_apart

VERSION, COMMIT = "0.1.0", "30c67b5e6d0a3a66f0f506c69ce9e9e0587e3b7c"
PLACE = Path("build/engines/box3d/libspook_box3d.so")  # of .ci/box3d, below where one stands
WIDE, THICK = 1000.0, 1.0  # m: half edges of the box that stands for a plane
NUMBERS, PLACES = ctypes.POINTER(ctypes.c_double), ctypes.POINTER(ctypes.c_int)
KINDS = {Ball: 1, Hinge: 2, Prismatic: 3, Lock: 4, Distance: 5}  # as the loop numbers them
LOAD, SPRING, ATTRACTION = range(3)
UPRIGHT = (1.0, 0.0, 0.0, 0.0)
Z_TO_X = np.array([math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0])  # the turn from where its hinges' axes lie
UNBOUNDED = 1e30  # N or N m
FADING = 1e-4  # 1: rate of a damper's spring over the damper's own, of which its pull has the square
MOST_POINTS = 16  # contact points a body, at most


def _library() -> ctypes.CDLL:
    file = Path(os.environ.get("TRACKER_BOX3D") or PLACE).absolute()
    try:
        found = ctypes.CDLL(str(file))
    except OSError as error:
        raise ImportError(f"no {file.name} in {file.parent} or by TRACKER_BOX3D: {error}") from None
    whole, real, loop = ctypes.c_int, ctypes.c_double, ctypes.c_void_p
    for name, given, result in (
        ("new", [NUMBERS, PLACES, real, real], loop),
        ("free", [loop], None),
        ("body", [loop, NUMBERS, NUMBERS], None),
        ("shape", [loop, whole, NUMBERS, NUMBERS, NUMBERS], None),
        ("corners", [loop, NUMBERS, whole, PLACES, whole, NUMBERS], whole),
        ("joint", [loop, whole, PLACES, NUMBERS, NUMBERS], None),
        ("joint_forces", [loop, NUMBERS], None),
        ("push", [loop, whole, whole, whole, NUMBERS], None),
        ("apart", [loop, whole, whole], None),
        ("step", [loop, whole, real, whole], None),
        ("state", [loop, NUMBERS], None),
        ("contacts", [loop, NUMBERS, whole], whole),
    ):
        try:
            function = getattr(found, f"spook_{name}")
        except AttributeError:
            raise ImportError(f"{file.name} is of an older loop; .ci/box3d builds it anew") from None
        function.argtypes, function.restype = given, result
    return found


LIBRARY = _library()


class Box3D:
    """The adapter."""

    name = "box3d"
    capabilities = Capabilities(
        shapes=frozenset({Sphere, Box, Capsule, ConvexHull, Plane, Compound, TriangleMesh, HeightField}),
        joints=frozenset(KINDS),
        forces=frozenset({CentralGravity, Load, Spring}),
        shows=frozenset({ConstraintForce, ContactForce, ContactCount, Penetration}),
        friction=True,
        joint_friction=True,
        motors=True,
        springs_aside=True,
        restitution=True,
        surface_velocity=True,
        kinematic=True,
        # Cylinders are prisms to it, and all that gives does so by its pair's effective mass.
        absent=frozenset(
            {
                "the shape cylinder",
                "the shape cone",
                "compliance of a joint",
                "compliance of a surface",
                "the joint relation",
                "the joint universal",
                "the joint wire",
                "the force fluid",
                "friction that differs with the direction",
            }
        ),
    )
    configurations = (
        Configuration(
            name="many-substeps",
            reason="20 substeps in place of 4, which its makers say is how accuracy is had, joints as stiff as a substep "
            "takes (a quarter of its rate) in place of 60 Hz, and restitution from 1 cm/s on in place of 1 m/s",
            expected_order=1.0,
            options={"substeps": 20, "threshold": 1e-2, "stiffest": 1e6},
        ),
        Configuration(
            name="defaults",
            reason="4 substeps: what its makers call usual",
            expected_order=1.0,
            options={"substeps": 4, "threshold": -1.0, "stiffest": -1.0},
        ),
    )

    def build_info(self) -> BuildInfo:
        return BuildInfo(self.name, VERSION, COMMIT, False, "", (), "built from its source by .ci/box3d", "")

    def record(self, task: Task) -> Recording:
        began = time.perf_counter()
        run = _Run(task)
        try:
            return stepped(task, run.step, run.read, time.perf_counter() - began)
        finally:
            LIBRARY.spook_free(run.loop)


class _Run:
    """One world, and what is read off it."""

    def __init__(self, task: Task) -> None:
        self.task, self.bodies = task, task.scene.bodies
        options = task.configuration.options
        self.substeps = int(options["substeps"])
        scene = task.scene
        most = (len(self.bodies), len(scene.constraints) + len(scene.forces), len(scene.forces))
        self.loop = LIBRARY.spook_new(
            _numbers(scene.gravity), (ctypes.c_int * 3)(*most), options["threshold"], options["stiffest"]
        )
        self.places = {body.name: k for k, body in enumerate(self.bodies)}
        try:
            for body in self.bodies:
                self._body(body)
            for constraint in scene.constraints:
                self._join(constraint)
        except NotSupported:
            LIBRARY.spook_free(self.loop)
            raise
        for force in scene.forces:
            self._push(force)
        for first, second in pairs_apart(scene):
            LIBRARY.spook_apart(self.loop, self.places[first], self.places[second])

    def _body(self, body: Particle | RigidBody) -> None:
        place, turn = np.array(body.position), turn_of(body)
        spin, mass = (0.0, 0.0, 0.0), (float(body.mass or 0.0), 1.0, 1.0, 1.0)
        if isinstance(body, RigidBody):
            spin = body.angular_velocity
            if body.motion == "dynamic":
                mass = (float(body.mass or 0.0), *(body.inertia or (1.0, 1.0, 1.0)))
            else:
                mass = (-1.0 if body.motion == "kinematic" else 0.0, 0.0, 0.0, 0.0)
        state = (*place, *turn, *body.velocity, *spin)
        LIBRARY.spook_body(self.loop, _numbers(state), _numbers(mass))
        if isinstance(body, RigidBody) and body.shape is not None and self.task.scene.contacts:
            self._surfaces(body, body.shape)

    def _surfaces(self, body: RigidBody, shape: Shape) -> None:
        rubs = (body.material.friction, body.material.restitution, *body.surface_velocity)
        if isinstance(shape, ConvexHull | TriangleMesh | HeightField):
            faces = [] if isinstance(shape, ConvexHull) else [k for face in shape.faces for k in face]
            corners = [x for corner in shape.corners for x in corner]
            places = (ctypes.c_int * len(faces))(*faces)
            if not LIBRARY.spook_corners(
                self.loop, _numbers(corners), len(corners) // 3, places, len(faces) // 3, _numbers(rubs)
            ):
                raise NotSupported(f"box3d does not support the {shape.kind} of {body.name!r}")
            return
        parts: list[tuple[Shape, Any, Any]] = [(shape, (0.0, 0.0, 0.0), UPRIGHT)]
        if isinstance(shape, Compound):
            if any(isinstance(part.shape, ConvexHull) for part in shape.parts):
                raise NotSupported("our adapter cannot ask box3d for hulls in a compound")
            parts = [(part.shape, part.position, part.orientation) for part in shape.parts]
        if isinstance(shape, Plane):
            if body.motion == "dynamic":
                raise NotSupported("box3d does not support a plane that moves")
            up = np.array(shape.normal)
            parts = [(shape, -THICK * up, _upright_to(up))]
        for one, at, turn in parts:
            kind, sizes = _surface(one)
            LIBRARY.spook_shape(
                self.loop,
                kind,
                _numbers(sizes),
                _numbers((*at, *turn)),
                _numbers(rubs),
            )

    def _join(self, joint: Any) -> None:
        ends = [
            self.places.get(end, -1) if isinstance(end, str) and end != WORLD else -1 for end in joint.between
        ]
        numbers, frames = [0.0, -1.0, 0.0], []
        if isinstance(joint, Distance):
            scene = self.task.scene
            numbers[0] = scene.length(joint) if joint.rest_length is None else joint.rest_length
            for end, anchor in zip(joint.between, joint.anchors, strict=True):
                frames += [*(anchor if isinstance(end, str) else end), *UPRIGHT]
        else:
            for one in ends_of(self.task.scene, joint):
                frames += [*one.point, *(product(one.turn, Z_TO_X) if isinstance(joint, Hinge) else one.turn)]
        if (driven := drive(joint, "box3d")) is not None:
            numbers = [driven[0], UNBOUNDED if driven[1] is None else driven[1]]
        LIBRARY.spook_joint(
            self.loop, KINDS[type(joint)], (ctypes.c_int * 2)(*ends), _numbers(frames), _numbers(numbers)
        )

    def _push(self, force: Any) -> None:
        if isinstance(force, Load):
            given = (*force.force, *force.torque, 0.0, 0.0, 0.0)
            LIBRARY.spook_push(self.loop, LOAD, self.places[force.body], -1, _numbers(given))
        elif isinstance(force, CentralGravity):
            given = (*force.centre, force.strength, *(0.0,) * 5)
            LIBRARY.spook_push(self.loop, ATTRACTION, -1, -1, _numbers(given))
        else:
            assert isinstance(force, Spring)
            ends = [self.places[end] if isinstance(end, str) else -1 for end in force.between]
            if force.rest_length > 0.0 and not force.aside:
                self._spring(force, ends)
                return
            points = [
                a if isinstance(e, str) else e for e, a in zip(force.between, force.anchors, strict=True)
            ]
            given = (*points[0], *points[1], force.stiffness, force.rest_length, force.viscosity)
            LIBRARY.spook_push(self.loop, SPRING, *ends, _numbers(given))

    def _spring(self, spring: Spring, ends: list[int]) -> None:
        """Its own, which is told by the frequency and damping ratio of what it moves: that of two centres does not change."""
        inverse = sum(1.0 / mass for end in ends if end >= 0 and (mass := _mass(self.bodies[end])))
        # rad/s; a damper alone has the rate of a spring that does nothing beside it
        rate = max(math.sqrt(spring.stiffness * inverse), FADING * spring.viscosity * inverse)
        if rate == 0.0:
            return
        numbers = (spring.rest_length, 0.5 * rate / math.pi, 0.5 * spring.viscosity * inverse / rate)
        frames: list[float] = []
        for end in spring.between:
            frames += [*((0.0, 0.0, 0.0) if isinstance(end, str) else end), *UPRIGHT]
        LIBRARY.spook_joint(
            self.loop, KINDS[Distance], (ctypes.c_int * 2)(*ends), _numbers(frames), _numbers(numbers)
        )

    def step(self, count: int) -> None:
        """The steps, in its own loop."""
        LIBRARY.spook_step(self.loop, count, self.task.time_step, self.substeps)

    def read(self, keep: Kept, place: int, sample: int) -> None:
        """The state of now; bodies that stand still are where the scene has them."""
        state = np.empty((len(self.bodies), 13))
        LIBRARY.spook_state(self.loop, state.ctypes.data_as(NUMBERS))
        for k, body in enumerate(self.bodies):
            if isinstance(body, RigidBody) and body.motion == "static":
                state[k] = (*body.position, *turn_of(body), *(0.0,) * 6)
        keep.positions[place], keep.orientations[place] = state[:, :3], state[:, 3:7]
        keep.velocities[place], keep.spins[place] = state[:, 7:10], state[:, 10:]
        if self.task.contacts and sample:
            self._contacts(keep, place)
        if self.task.constraint_forces and self.task.scene.constraints:
            self._joint_forces(keep, sample)

    def _joint_forces(self, keep: Kept, sample: int) -> None:
        made = len(self.task.scene.constraints) + len(
            self.task.scene.forces
        )  # springs are joints, too, and come last
        told = np.zeros((made, 6))
        if sample:
            LIBRARY.spook_joint_forces(self.loop, told.ctypes.data_as(NUMBERS))
        for joint, row in zip(self.task.scene.constraints, told, strict=False):
            keep.forces.setdefault(joint.name, []).append(row if isinstance(joint, Joint) else row[0])

    def _contacts(self, keep: Kept, place: int) -> None:
        points = np.empty((MOST_POINTS * len(self.bodies), 6))
        found = LIBRARY.spook_contacts(self.loop, points.ctypes.data_as(NUMBERS), len(points))
        if found > len(points):  # more than was thought: once more, with room for all
            points = np.empty((found, 6))
            LIBRARY.spook_contacts(self.loop, points.ctypes.data_as(NUMBERS), found)
        keep.contacts[place] = found
        for first, second, *force, depth in points[:found]:
            keep.depths[place] = max(keep.depths[place], depth)
            keep.pair((self.bodies[int(first)].name, self.bodies[int(second)].name))[place] -= force


def _mass(body: Particle | RigidBody) -> float:
    """What of it resists a pull [kg]; 0 of what does not move by one."""
    return float(body.mass or 0.0) if isinstance(body, Particle) or body.motion == "dynamic" else 0.0


def _surface(shape: Shape) -> tuple[int, tuple[float, float, float]]:
    """The kind of a shape and its sizes, as the loop takes them."""
    if isinstance(shape, Sphere):
        return 1, (shape.radius, 0.0, 0.0)
    if isinstance(shape, Box):
        x, y, z = shape.size
        return 2, (0.5 * x, 0.5 * y, 0.5 * z)
    if isinstance(shape, Capsule):
        return 3, (shape.radius, 0.5 * shape.length, 0.0)
    return 2, (WIDE, WIDE, THICK)


def _upright_to(up: Array) -> Array:
    """The quaternion that turns z to a direction."""
    if up[2] <= -1.0 + 1e-12:
        return np.array([0.0, 1.0, 0.0, 0.0])
    q = np.array([1.0 + up[2], -up[1], up[0], 0.0])
    return q / math.sqrt(float(q @ q))


def _numbers(values: object) -> ctypes.Array[ctypes.c_double]:
    given = [float(value) for value in values]  # type: ignore[attr-defined]
    return (ctypes.c_double * len(given))(*given)


ENGINE = Box3D()
