"""Box3D, in C, built from its public source by .ci/box3d with a loop of our own: contacts in single precision.

A plane is a box a thousand metres wide: Box3D has no half-space. Forces are those of the last of its substeps, friction
shared alike by the points of a pair. Joints are not asked: it is here for its contacts.
"""

from __future__ import annotations

import ctypes
import math
import os
import time
from pathlib import Path

import numpy as np

from spook_tracker.engine.bodies import Particle, RigidBody
from spook_tracker.engine.build_info import BuildInfo
from spook_tracker.engine.observe import ContactCount, ContactForce, Penetration
from spook_tracker.engine.peers.joint_tree import turn_of
from spook_tracker.engine.peers.stepped import Kept, stepped
from spook_tracker.engine.peers.surfaces import pairs_apart
from spook_tracker.engine.protocol import Capabilities, Configuration, NotSupported, Task
from spook_tracker.engine.recording import Recording
from spook_tracker.engine.result import Array
from spook_tracker.engine.shapes import Box, Capsule, Plane, Shape, Sphere

VERSION, COMMIT = "0.1.0", "30c67b5e6d0a3a66f0f506c69ce9e9e0587e3b7c"
PLACE = Path("build/engines/box3d/libspook_box3d.so")  # of .ci/box3d, below where one stands
WIDE, THICK = 1000.0, 1.0  # m: half edges of the box that stands for a plane
NUMBERS = ctypes.POINTER(ctypes.c_double)
MOST_POINTS = 16  # contact points a body, at most


def _library() -> ctypes.CDLL:
    file = Path(os.environ.get("TRACKER_BOX3D") or PLACE).absolute()
    try:
        found = ctypes.CDLL(str(file))
    except OSError as error:
        raise ImportError(f"no {file.name} in {file.parent} or by TRACKER_BOX3D: {error}") from None
    whole, real, loop = ctypes.c_int, ctypes.c_double, ctypes.c_void_p
    for name, given, result in (
        ("new", [NUMBERS, whole, real], loop),
        ("free", [loop], None),
        ("body", [loop, NUMBERS, NUMBERS, whole, NUMBERS, real, real], None),
        ("apart", [loop, whole, whole], None),
        ("step", [loop, whole, real, whole], None),
        ("state", [loop, NUMBERS], None),
        ("contacts", [loop, NUMBERS, whole], whole),
    ):
        function = getattr(found, f"spook_{name}")
        function.argtypes, function.restype = given, result
    return found


LIBRARY = _library()


class Box3D:
    """The adapter."""

    name = "box3d"
    capabilities = Capabilities(
        shapes=frozenset({Sphere, Box, Capsule, Plane}),
        shows=frozenset({ContactForce, ContactCount, Penetration}),
        friction=True,
        restitution=True,
    )
    configurations = (
        Configuration(
            name="many-substeps",
            reason="20 substeps in place of 4, which its makers say is how accuracy is had, and restitution from 1 cm/s on "
            "in place of 1 m/s",
            expected_order=1.0,
            options={"substeps": 20, "threshold": 1e-2},
        ),
        Configuration(
            name="defaults",
            reason="4 substeps: what its makers call usual",
            expected_order=1.0,
            options={"substeps": 4, "threshold": -1.0},
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
        self.loop = LIBRARY.spook_new(_numbers(task.scene.gravity), len(self.bodies), options["threshold"])
        try:
            for body in self.bodies:
                self._body(body)
        except NotSupported:
            LIBRARY.spook_free(self.loop)
            raise
        places = {body.name: k for k, body in enumerate(self.bodies)}
        for first, second in pairs_apart(task.scene):
            LIBRARY.spook_apart(self.loop, places[first], places[second])

    def _body(self, body: Particle | RigidBody) -> None:
        place, turn = np.array(body.position), turn_of(body)
        spin, mass = (0.0, 0.0, 0.0), (float(body.mass or 0.0), 1.0, 1.0, 1.0)
        kind, sizes, friction, restitution = 0, (0.0, 0.0, 0.0), 0.0, 0.0
        if isinstance(body, RigidBody):
            spin = body.angular_velocity
            mass = (
                (float(body.mass or 0.0), *(body.inertia or (1.0, 1.0, 1.0)))
                if body.motion == "dynamic"
                else (0.0,) * 4
            )
            if body.shape is not None and self.task.scene.contacts:
                kind, sizes = _surface(body.shape)
                friction, restitution = body.material.friction, body.material.restitution
            if isinstance(body.shape, Plane):
                if body.motion == "dynamic":
                    raise NotSupported("box3d does not support a plane that moves")
                up = np.array(body.shape.normal)
                turn = _upright_to(up)
                place = place - THICK * up
        state = (*place, *turn, *body.velocity, *spin)
        LIBRARY.spook_body(
            self.loop, _numbers(state), _numbers(mass), kind, _numbers(sizes), friction, restitution
        )

    def step(self, count: int) -> None:
        """The steps, in its own loop."""
        LIBRARY.spook_step(self.loop, count, self.task.time_step, self.substeps)

    def read(self, keep: Kept, place: int, sample: int) -> None:
        """The state of now; bodies that stand still are where the scene has them."""
        state = np.empty((len(self.bodies), 13))
        LIBRARY.spook_state(self.loop, state.ctypes.data_as(NUMBERS))
        for k, body in enumerate(self.bodies):
            if isinstance(body, RigidBody) and body.motion != "dynamic":
                state[k] = (*body.position, *turn_of(body), *(0.0,) * 6)
        keep.positions[place], keep.orientations[place] = state[:, :3], state[:, 3:7]
        keep.velocities[place], keep.spins[place] = state[:, 7:10], state[:, 10:]
        if self.task.contacts and sample:
            self._contacts(keep, place)

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
