"""PhysX 5 by the Python package of SAPIEN: single precision on the CPU, one thread, by sweeps (PGS) or small steps (TGS).

Joints are its six-axis joints, locked where they hold; limits of a swing do not hold there, so that hinges, slides and
locks have a stiff spring about the other two axes. It has articulations in joint coordinates, too, which our
adapter does not ask for. Every step is a call from Python. It shows of a contact the impulse without its friction: with
friction a contact's force is not asked.
"""

from __future__ import annotations

import math
import time
import warnings
from importlib.metadata import version
from typing import Any

import numpy as np

from ..bodies import WORLD, Particle, RigidBody
from ..build_info import BuildInfo
from ..forces import CentralGravity, Load, Spring
from ..joints import Ball, Distance, Hinge, Joint, Lock, Prismatic
from ..observe import ContactCount, ContactForce, Penetration
from ..protocol import Capabilities, Configuration, NotSupported, Task
from ..recording import Recording
from ..shapes import Box, Capsule, Plane, Shape, Sphere
from .frames import along, drive, drive_damping, ends_of, turned_inertia
from .pushes import Pushes
from .stepped import Kept, quiet, stepped
from .surfaces import one_friction, one_restitution, solid

with quiet(), warnings.catch_warnings():  # it looks for a display
    warnings.simplefilter("ignore")
    import sapien
    from sapien import physx

POINT_INERTIA = 1e-6  # kg m²: PhysX wants one of every body that turns
FASTEST = 1e7  # rad/s, in place of 100
SLOWEST_BOUNCE = 0.01  # m/s, in place of 2: slower impacts do not rebound
SWUNG = 1e3  # kg m²: what turns and is heavier asks for more
FREE = (-math.inf, math.inf)
UNBOUNDED = 1e30  # N or N m
SWING = (
    1e9,
    1e6,
)  # N m/rad, N m s/rad: holds what the package's limits of a swing (cone or pyramid of 0) let go


class Sapien:
    """The adapter."""

    name = "sapien"
    capabilities = Capabilities(
        shapes=frozenset({Sphere, Box, Capsule, Plane}),
        joints=frozenset({Distance, Lock, Ball, Hinge, Prismatic}),
        forces=frozenset({CentralGravity, Load, Spring}),
        shows=frozenset({ContactForce, ContactCount, Penetration}),
        friction=True,
        joint_friction=True,
        motors=True,
        springs_aside=True,
        restitution=True,
        kinematic=False,
        # A cylinder is a prism to it, which rests deeper on its side and rolls too slowly.
        absent=frozenset(
            {
                "the shape cylinder",
                "the force fluid",
                "friction of rolling or turning",
                "friction that differs with the direction",
            }
        ),
    )
    configurations = (
        Configuration(
            name="tgs",
            reason="PhysX's solver of small steps, 50 position iterations in place of 10: its manual recommends it "
            "for chains and mass ratios",
            expected_order=1.0,
            options={"tgs": True, "sweeps": 50},
        ),
        Configuration(
            name="pgs",
            reason="PhysX's projected Gauss-Seidel, 50 position iterations in place of 10",
            expected_order=1.0,
            options={"tgs": False, "sweeps": 50},
        ),
        Configuration(
            name="defaults",
            reason="small steps and 10 position iterations: what one gets from SAPIEN without asking",
            expected_order=1.0,
            options={"tgs": True, "sweeps": 10},
        ),
    )

    def build_info(self) -> BuildInfo:
        installed = version("sapien")
        return BuildInfo(
            self.name, installed, "", False, "", (), "wheel from the package index, float32, CPU", ""
        )

    def record(self, task: Task) -> Recording:
        began = time.perf_counter()
        with quiet(), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            run = _Run(task)
            return stepped(task, run.step, run.read, time.perf_counter() - began)


class _Run:
    """One world, and what is read off it."""

    def __init__(self, task: Task) -> None:
        self.task, self.scene = task, task.scene
        scene = self.scene
        joined = {frozenset(c.between) for c in scene.constraints if isinstance(c, Joint)}
        if scene.contacts and any(frozenset(pair) not in joined for pair in scene.no_contact):
            raise NotSupported("our adapter cannot ask sapien for single pairs that must not touch")
        if task.contacts and any(body.material.friction for body in solid(scene)):
            raise NotSupported(
                "sapien does not support a contact force with friction: its contacts tell the part along their normals"
            )
        friction = one_friction(scene, "sapien") if scene.contacts else 0.0
        self.material = physx.PhysxMaterial(friction, friction, one_restitution(scene, "sapien"))
        self.pushes = Pushes(scene)
        _configure(task)
        self.world = physx.PhysxCpuSystem()
        self.world.timestep = task.time_step
        self.place = sapien.Scene([self.world])
        self.bodies = [self._body(body) for body in scene.bodies]
        self.by_name = {body.name: made for body, made in zip(scene.bodies, self.bodies, strict=True)}
        for constraint in scene.constraints:
            self._hold(constraint)

    def _body(self, body: Particle | RigidBody) -> Any:
        moves = isinstance(body, Particle) or body.motion == "dynamic"
        made = physx.PhysxRigidDynamicComponent() if moves else physx.PhysxRigidStaticComponent()
        turn = (1.0, 0.0, 0.0, 0.0) if isinstance(body, Particle) else body.orientation
        # Where nothing can touch, shapes it does not have are let through.
        if (
            isinstance(body, RigidBody)
            and body.shape is not None
            and self.scene.contacts
            and type(body.shape) in Sapien.capabilities.shapes
        ):
            made.attach(_shape(body.shape, self.material))
        if moves:
            made.mass = body.mass
            made.inertia = (POINT_INERTIA,) * 3 if isinstance(body, Particle) else body.inertia
            made.cmass_local_pose = sapien.Pose()
            made.linear_damping = made.angular_damping = 0.0
            made.max_angular_velocity = FASTEST
        entity = sapien.Entity()
        entity.add_component(made)
        entity.set_pose(sapien.Pose(body.position, turn))
        self.place.add_entity(entity)
        if moves:
            made.set_linear_velocity(body.velocity)
            if isinstance(body, RigidBody):
                made.set_angular_velocity(body.angular_velocity)
        return made

    def _hold(self, constraint: Any) -> None:
        """PhysX wants the second end to move; the first may be the world or stand."""
        if isinstance(constraint, Distance):
            self._rod(constraint)
            return
        ends = list(constraint.between)
        frames = list(ends_of(self.scene, constraint))
        if not self._moves(ends[1]):
            ends, frames = ends[::-1], frames[::-1]
        if not self._moves(ends[1]):
            return
        child = self.by_name[ends[1]]
        joint = physx.PhysxDriveComponent(child)
        joint.parent = None if ends[0] == WORLD else self.by_name[ends[0]]
        joint.pose_in_parent = sapien.Pose(frames[0].point, frames[0].turn)
        joint.pose_in_child = sapien.Pose(frames[1].point, frames[1].turn)
        slides, twists = isinstance(constraint, Prismatic), isinstance(constraint, Ball | Hinge)
        joint.set_limit_x(*(FREE if slides else (0.0, 0.0)))
        joint.set_limit_y(0.0, 0.0)
        joint.set_limit_z(0.0, 0.0)
        joint.set_limit_twist(*(FREE if twists else (0.0, 0.0)))
        if not isinstance(constraint, Ball):
            firmer = max(1.0, turned_inertia(self.scene, constraint) / SWUNG)
            joint.set_drive_property_swing(*(firmer * part for part in SWING))
        if (driven := drive(constraint, "sapien")) is not None:
            damping = drive_damping(self.scene, constraint, self.task.time_step)
            self._drive(joint, slides, damping, driven, 1.0 if ends == list(constraint.between) else -1.0)
        child.entity.add_component(joint)

    def _drive(
        self, joint: Any, slides: bool, damping: float, driven: tuple[float, float | None], sign: float
    ) -> None:
        """The drive of its joint: a stiff damper, solved implicitly, that moves at a speed. Its bound is the impulse of a step,
        and a twist counts against its axis."""
        speed, most = driven
        bound = UNBOUNDED if most is None else most * self.task.time_step
        ahead, still = (sign * speed, 0.0, 0.0), (0.0, 0.0, 0.0)
        if slides:
            joint.set_drive_property_x(0.0, damping, bound, "force")
            joint.set_drive_velocity_target(ahead, still)
        else:
            joint.set_drive_property_twist(0.0, damping, bound, "force")
            joint.set_drive_velocity_target(still, (-sign * speed, 0.0, 0.0))

    def _rod(self, rod: Distance) -> None:
        """A point of the world is where it is; one of a body is beside its centre, in its axes."""
        ends = list(zip(rod.between, rod.anchors, strict=True))
        if not self._moves(ends[1][0]):
            ends = ends[::-1]
        (first, beside), (second, aside) = ends
        if not isinstance(second, str) or not self._moves(second):
            return
        child = self.by_name[second]
        joint = physx.PhysxDistanceJointComponent(child)
        joint.parent = self.by_name[first] if isinstance(first, str) else None
        joint.pose_in_parent = sapien.Pose(beside if isinstance(first, str) else first)
        joint.pose_in_child = sapien.Pose(aside)
        length = self.scene.length(rod) if rod.rest_length is None else rod.rest_length
        joint.set_limit(length, length)
        child.entity.add_component(joint)

    def _moves(self, end: Any) -> bool:
        if not isinstance(end, str) or end == WORLD:
            return False
        body = self.scene.body(end)
        return isinstance(body, Particle) or body.motion == "dynamic"

    def step(self, count: int) -> None:
        """The steps, and before each what pushes."""
        for _ in range(count):
            if self.pushes:
                self._push()
            self.world.step()

    def _push(self) -> None:
        where = np.array([body.pose.p for body in self.bodies], dtype=float)
        speeds = np.array(
            [getattr(body, "linear_velocity", (0.0, 0.0, 0.0)) for body in self.bodies], dtype=float
        )
        spins = np.array(
            [getattr(body, "angular_velocity", (0.0, 0.0, 0.0)) for body in self.bodies], dtype=float
        )
        turns = np.array([body.pose.q for body in self.bodies], dtype=float)
        forces, torques = self.pushes.at(where, speeds, turns, spins)
        for body, force, torque in zip(self.bodies, forces, torques, strict=True):
            if isinstance(body, physx.PhysxRigidDynamicComponent):
                body.add_force_torque(force, torque)

    def read(self, keep: Kept, row: int, sample: int) -> None:
        for k, body in enumerate(self.bodies):
            pose = body.pose
            keep.positions[row, k], keep.orientations[row, k] = pose.p, pose.q
            if isinstance(body, physx.PhysxRigidDynamicComponent):
                keep.velocities[row, k], keep.spins[row, k] = body.linear_velocity, body.angular_velocity
            described = self.scene.bodies[k]
            if isinstance(described, Particle):
                keep.orientations[row, k], keep.spins[row, k] = (1.0, 0.0, 0.0, 0.0), 0.0
        if self.task.contacts and sample:
            self._read_contacts(keep, row)

    def _read_contacts(self, keep: Kept, row: int) -> None:
        for contact in self.world.get_contacts():
            first, second = (
                next(name for name, made in self.by_name.items() if made == body) for body in contact.bodies
            )
            for point in contact.points:
                keep.contacts[row] += point.separation <= 0.0
                keep.depths[row] = max(keep.depths[row], -point.separation)
                keep.pair((first, second))[row] += np.array(point.impulse) / self.task.time_step


def _configure(task: Task) -> None:
    """PhysX takes these for every world made from now on."""
    options = task.configuration.options
    scene = physx.PhysxSceneConfig()
    scene.gravity, scene.enable_tgs, scene.bounce_threshold = (
        task.scene.gravity,
        options["tgs"],
        SLOWEST_BOUNCE,
    )
    physx.set_scene_config(scene)
    body = physx.PhysxBodyConfig()
    body.sleep_threshold, body.solver_position_iterations = 0.0, options["sweeps"]
    physx.set_body_config(body)


def _shape(shape: Shape, material: Any) -> Any:
    """Its axes lie along x where ours lie along z."""
    if isinstance(shape, Sphere):
        return physx.PhysxCollisionShapeSphere(shape.radius, material)
    if isinstance(shape, Box):
        return physx.PhysxCollisionShapeBox([0.5 * edge for edge in shape.size], material)
    if isinstance(shape, Plane):
        made: Any = physx.PhysxCollisionShapePlane(material)
        made.local_pose = sapien.Pose((0.0, 0.0, 0.0), along(shape.normal))
        return made
    assert isinstance(shape, Capsule)
    made = physx.PhysxCollisionShapeCapsule(shape.radius, 0.5 * shape.length, material)
    made.local_pose = sapien.Pose((0.0, 0.0, 0.0), along((0.0, 0.0, 1.0)))
    return made


ENGINE = Sapien()
