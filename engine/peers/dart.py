"""DART, by its Python package: joint coordinates, semi-implicit Euler, contacts and loops by Dantzig's direct method.

A rod between particles is a hinge if all stays in a plane, else a universal joint. It has no loop of its own: every
step is a call from Python, and what pushes besides gravity is pushed from there. The forces of joints it shows are
those of the motion: impulses of contacts and loops are not in them, so there they are not shown.
"""

from __future__ import annotations

import math
import time
from importlib.metadata import version
from typing import Any

import dartpy as dart
import numpy as np

from ..bodies import WORLD, Particle, RigidBody
from ..build_info import BuildInfo
from ..forces import CentralGravity, Load, Spring
from ..joints import (
    Ball,
    Distance,
    Hinge,
    Joint,
    Lock,
    Prismatic,
    Universal,
    frictions,
)
from ..observe import ConstraintForce, ContactCount, ContactForce, Penetration
from ..protocol import Capabilities, Configuration, NotSupported, Task
from ..recorded_joints import cross, joint_point, turned
from ..recording import Recording
from ..result import Array
from ..shapes import Box, Capsule, Plane, Shape, Sphere
from .dart_file import READS, run_model
from .frames import drive
from .joint_tree import (
    Node,
    alone,
    below,
    closing,
    fixed,
    grown,
    hung_at,
    plane_of_motion,
    rod_axes,
    sliding,
    spins,
    turn_of,
)
from .pushes import Pushes
from .stepped import Kept, quiet, stepped
from .surfaces import one_friction, one_restitution, pairs_apart, solid

POINT_INERTIA = 1e-9  # kg m²: DART wants one of every body that turns
HALF_HINGE = 0.5  # m from a hinge to each of the two points that hold it where it is a constraint
BEYOND = 1e50  # rad/s or m/s: nothing has that speed
CONTACTS = 1000  # points of a step, at most: its package cannot ask for more, and what is left out falls through the ground


class Dart:
    """The adapter."""

    name = "dart"
    reads = READS
    run_model = staticmethod(run_model)
    capabilities = Capabilities(
        shapes=frozenset({Sphere, Box, Capsule, Plane}),
        joints=frozenset({Distance, Lock, Ball, Hinge, Prismatic, Universal}),
        forces=frozenset({CentralGravity, Load, Spring}),
        shows=frozenset({ConstraintForce, ContactForce, ContactCount, Penetration}),
        shows_force_of=frozenset({Distance, Ball, Hinge, Lock}),
        friction=True,
        joint_friction=True,
        motors=True,
        springs_aside=True,
        restitution=True,
        absent=frozenset({"the force fluid", "friction of rolling or turning"}),
    )
    configurations = (
        Configuration(
            name="joints",
            reason="joint coordinates by Featherstone's algorithm, contacts and loops by Dantzig's direct method, "
            "found by ODE's collision detector, which knows planes, boxes, spheres and capsules exactly",
            expected_order=1.0,
            options={"joints": True},
        ),
        Configuration(
            name="constraints",
            reason="free bodies held by constraints, solved by the same direct method. It has none of distance",
            expected_order=1.0,
            options={"joints": False},
            lacks=("joint_friction", "motors"),
        ),
    )

    def build_info(self) -> BuildInfo:
        installed = version("dartpy")
        return BuildInfo(self.name, installed, "", False, "", (), "wheel from the package index", "")

    def record(self, task: Task) -> Recording:
        began = time.perf_counter()
        with quiet():
            run = _Run(task)
            return stepped(task, run.step, run.read, time.perf_counter() - began, run.health)


class _Run:
    """One world, and what is read off it."""

    def __init__(self, task: Task) -> None:
        self.task = task
        scene = self.scene = task.scene
        self.nodes = grown(scene) if task.configuration.options["joints"] else alone(scene)
        self.normal = plane_of_motion(scene)
        self.friction = one_friction(scene, "dart") if scene.contacts else 0.0
        self.restitution = one_restitution(scene, "dart")
        self.pushes = Pushes(scene)
        self.bodies: dict[str, Any] = {}
        self.driven: list[tuple[Any, float]] = []  # joints with motors, and their speeds
        self.world = dart.simulation.World()
        self.world.setTimeStep(task.time_step)
        self.world.setGravity(np.array(scene.gravity))
        awake = dart.simulation.DeactivationOptions()
        awake.mEnabled = False
        self.world.setDeactivationOptions(awake)
        solver = self.world.getConstraintSolver()
        if scene.contacts and solid(scene):
            solver.setCollisionDetector(dart.collision.OdeCollisionDetector())
        for name, node in self.nodes.items():
            if node.parent is None or node.parent == WORLD:
                self._skeleton(name)
        self._apart(solver.getCollisionOption())
        self._start()
        left = closing(scene, self.nodes)
        for constraint in left:
            for one in self._held(constraint):
                solver.addConstraint(one)
        if task.constraint_forces and (left or self.driven or (scene.contacts and solid(scene))):
            raise NotSupported(
                "dart does not show forces of joints where contacts or loops act, too, or motors"
            )

    def _skeleton(self, top: str) -> None:
        """One free or fixed body, with all that hangs from it."""
        made = dart.dynamics.Skeleton(top)
        for name in below(self.nodes, top):
            node = self.nodes[name]
            joint, body = self._pair(made, node)
            body.setName(name)
            joint.setName(f"joint of {name}")
            self.bodies[name] = body
            if node.tie is not None:
                at = hung_at(self.scene, node)
                parent = self.nodes.get(str(node.parent))
                joint.setTransformFromParentBodyNode(_seen(parent.body if parent else None, at))
                joint.setTransformFromChildBodyNode(_seen(node.body, at))
            self._fill(node.body, body)
        made.enableSelfCollisionCheck()
        made.setAdjacentBodyCheck(True)
        if fixed(self.nodes[top].body) and len(self.nodes[top].children) == 0:
            made.setMobile(False)
        self.world.addSkeleton(made)

    def _pair(self, made: Any, node: Node) -> tuple[Any, Any]:
        parent = self.bodies.get(str(node.parent))
        tie = node.tie
        if tie is None:
            if fixed(node.body):
                joint, body = made.createWeldJointAndBodyNodePair(parent)
                joint.setTransformFromParentBodyNode(_pose(node.body))
                return joint, body
            if isinstance(node.body, Particle):
                joint, body = made.createTranslationalJointAndBodyNodePair(parent)
                joint.setPositions(np.array(node.body.position))
                return joint, body
            joint, body = made.createFreeJointAndBodyNodePair(parent)
            joint.setRelativeTransform(_pose(node.body))
            return joint, body
        axes: list[Array] = []
        if isinstance(tie, Distance):
            axes = rod_axes(np.array(node.body.position) - hung_at(self.scene, node), self.normal)
        elif isinstance(tie, Universal):
            axes = [np.array(tie.axis), np.array(tie.cross_axis)]
            axes = axes if tie.between[1] == node.body.name else axes[::-1]
        elif isinstance(tie, Hinge | Prismatic):
            axes = [np.array(tie.axis)]
        if isinstance(tie, Lock):
            return made.createWeldJointAndBodyNodePair(parent)  # type: ignore[no-any-return]
        if isinstance(tie, Ball):
            return made.createBallJointAndBodyNodePair(parent)  # type: ignore[no-any-return]
        if len(axes) == 2:
            joint, body = made.createUniversalJointAndBodyNodePair(parent)
            joint.setAxis1(axes[0])
            joint.setAxis2(axes[1])
            return joint, body
        slides = isinstance(tie, Prismatic)
        joint, body = (
            made.createPrismaticJointAndBodyNodePair(parent)
            if slides
            else made.createRevoluteJointAndBodyNodePair(parent)
        )
        joint.setAxis(axes[0])
        joint.setCoulombFriction(0, max(frictions(tie)[0]))
        if getattr(tie, "motor", None) and (driven := drive(tie, "dart")) is not None:
            self._drive(joint, driven, 1.0 if tie.between[1] == node.body.name else -1.0)
        return joint, body

    def _drive(self, joint: Any, driven: tuple[float, float | None], sign: float) -> None:
        """A servo: a row of bounded force that holds a speed, which DART forgets after each step."""
        speed, most = driven
        joint.setActuatorType(dart.dynamics.ActuatorType.SERVO)
        if most is not None:
            joint.setForceLowerLimit(0, -most)
            joint.setForceUpperLimit(0, most)
        self.driven.append((joint, sign * speed))

    def _fill(self, given: Particle | RigidBody, body: Any) -> None:
        """Mass, inertia and surface."""
        if not fixed(given):
            moments = (POINT_INERTIA,) * 3 if isinstance(given, Particle) else given.inertia
            body.setInertia(dart.dynamics.Inertia(given.mass, np.zeros(3), np.diag(np.array(moments))))
        if isinstance(given, Particle) or given.shape is None or not self.scene.contacts:
            return
        surface = body.createShapeNode(_shape(given.shape), given.name)
        surface.createCollisionAspect()
        aspect = surface.createDynamicsAspect()
        aspect.setFrictionCoeff(self.friction)
        aspect.setRestitutionCoeff(math.sqrt(self.restitution))  # DART multiplies two

    def _apart(self, option: Any) -> None:
        """Pairs that must not touch."""
        for a, b in pairs_apart(self.scene) if self.scene.contacts else ():
            option.collisionFilter.addBodyNodePairToBlackList(self.bodies[a], self.bodies[b])

    def _start(self) -> None:
        """Speeds at the start."""
        turning = spins(self.scene, self.nodes) | {WORLD: np.zeros(3)}
        for name, node in self.nodes.items():
            joint = self.bodies[name].getParentJoint()
            if fixed(node.body) or isinstance(node.tie, Lock):
                continue
            if node.tie is None:
                if isinstance(node.body, Particle):
                    joint.setVelocities(np.array(node.body.velocity))
                else:
                    joint.setLinearVelocity(np.array(node.body.velocity))
                    joint.setAngularVelocity(turning[name])
                continue
            relative = turning[name] - turning[str(node.parent)]
            if isinstance(node.tie, Prismatic):
                axis, above = np.array(node.tie.axis), turning[str(node.parent)]
                joint.setVelocity(0, sliding(self.nodes, node, axis, above))
            elif isinstance(node.tie, Ball):
                joint.setVelocities(relative)
            elif joint.getNumDofs() == 2:
                joint.setVelocities(np.array([relative @ joint.getAxis1(), relative @ joint.getAxis2()]))
            else:
                joint.setVelocity(0, float(relative @ joint.getAxis()))

    def _held(self, constraint: Any) -> list[Any]:
        """DART's constraints where no joint can be."""
        if isinstance(constraint, Distance):
            raise NotSupported("dart has no constraint of distance, only rods that joints can stand for")
        if any(frictions(constraint)[0]) or getattr(constraint, "motor", None):
            raise NotSupported(
                f"dart does not support friction or a motor in a constraint, as {constraint.name!r} would be"
            )
        one, two = constraint.between
        if one == WORLD or fixed(self.nodes[one].body):
            one, two = two, one
        ends = [self.bodies[one]]
        if two != WORLD:
            ends.append(self.bodies[two])
        at, c = joint_point(self.scene, constraint), dart.constraint
        if isinstance(constraint, Lock):
            return [c.WeldJointConstraint(*ends)]
        if isinstance(constraint, Ball):
            return [c.BallJointConstraint(*ends, at)]
        if not isinstance(constraint, Hinge):
            raise NotSupported(f"dart has no constraint for the {constraint.kind} {constraint.name!r}")
        arm = HALF_HINGE * np.array(constraint.axis)  # its own hinge lets moving bodies part
        return [c.BallJointConstraint(*ends, at - arm), c.BallJointConstraint(*ends, at + arm)]

    def step(self, count: int) -> None:
        """The steps, and before each what pushes."""
        for _ in range(count):
            if self.pushes:
                self._push()
            for joint, speed in self.driven:
                joint.setCommand(0, speed)
            self.world.step()

    def health(self) -> str:
        """DART puts what is not finite to zero and goes on; speeds beyond all bounds come before that. Contacts beyond its most
        it leaves out: that is not supported."""
        if self.world.getLastCollisionResult().getNumContacts() >= CONTACTS:
            raise NotSupported(
                f"dart does not support {CONTACTS} contact points and more: it leaves out the rest"
            )
        for k in range(self.world.getNumSkeletons()):
            if not (np.abs(self.world.getSkeleton(k).getVelocities()) < BEYOND).all():
                return f"a joint is faster than {BEYOND:g} rad/s or m/s"
        return ""

    def _push(self) -> None:
        moving = [self.bodies[body.name] for body in self.scene.bodies]
        where = np.array([body.getWorldTransform().translation().ravel() for body in moving])
        speeds = np.array([body.getCOMLinearVelocity() for body in moving])
        more: tuple[Any, ...] = ()
        if self.pushes.aside:
            turns = [body.getWorldTransform().quaternion() for body in moving]
            more = (
                np.array([[q.w(), q.x(), q.y(), q.z()] for q in turns]),
                np.array([body.getAngularVelocity() for body in moving]),
            )
        forces, torques = self.pushes.at(where, speeds, *more)
        for body, force, torque in zip(moving, forces, torques, strict=True):
            body.addExtForce(force)
            if torque.any():
                body.addExtTorque(torque, False)

    def read(self, keep: Kept, row: int, sample: int) -> None:
        for k, given in enumerate(self.scene.bodies):
            body = self.bodies[given.name]
            pose = body.getWorldTransform()
            keep.positions[row, k] = pose.translation().ravel()
            keep.velocities[row, k] = body.getCOMLinearVelocity()
            if isinstance(given, Particle):
                keep.orientations[row, k] = 1.0, 0.0, 0.0, 0.0
                continue
            turn = pose.quaternion()
            keep.orientations[row, k] = turn.w(), turn.x(), turn.y(), turn.z()
            keep.spins[row, k] = body.getAngularVelocity()
        if self.task.constraint_forces:
            self._read_joints(keep, row, sample)
        if self.task.contacts and sample:
            self._read_contacts(keep, row)

    def _read_joints(self, keep: Kept, row: int, sample: int) -> None:
        for name, node in self.nodes.items():
            tie = node.tie
            if type(tie) not in (Dart.capabilities.shows_force_of or ()):
                continue
            assert isinstance(tie, Distance | Joint)
            body = self.bodies[name]
            pose = body.getWorldTransform()
            told = np.array(body.getBodyForce())  # on the body, about its centre, in its axes
            torque, force = (np.array(pose.rotation()) @ told[k : k + 3] for k in (0, 3))
            arm = (
                np.array(pose.rotation())
                @ np.array(body.getParentJoint().getTransformFromChildBodyNode().translation()).ravel()
            )
            if isinstance(tie, Distance):
                value: Any = float(force @ arm / np.linalg.norm(arm)) if sample else 0.0
            else:
                sign = 1.0 if tie.between[1] == name else -1.0
                value = sign * np.concatenate([force, torque - cross(arm, force)]) if sample else np.zeros(6)
            keep.forces.setdefault(tie.name, []).append(value)

    def _read_contacts(self, keep: Kept, row: int) -> None:
        for contact in self.world.getLastCollisionResult().getContacts():
            first, second = (
                one.getShapeFrame().getName() for one in (contact.collisionObject1, contact.collisionObject2)
            )
            keep.contacts[row] += 1
            keep.depths[row] = max(keep.depths[row], contact.penetrationDepth)
            keep.pair((first, second))[row] += np.array(contact.force).ravel()


def _isometry(place: Array, turn: Array) -> Any:
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([turned(turn, axis) for axis in np.eye(3)], axis=1)
    matrix[:3, 3] = place
    return dart.math.Isometry3(matrix)


def _pose(body: Particle | RigidBody) -> Any:
    return _isometry(np.array(body.position), turn_of(body))


def _seen(body: Particle | RigidBody | None, at: Array) -> Any:
    """A point of the world with the world's axes, seen from a body at the start."""
    if body is None:
        return _isometry(at, np.array([1.0, 0.0, 0.0, 0.0]))
    back = turn_of(body) * np.array([1.0, -1.0, -1.0, -1.0])
    return _isometry(turned(back, at - np.array(body.position)), back)


def _shape(shape: Shape) -> Any:
    if isinstance(shape, Sphere):
        return dart.dynamics.SphereShape(shape.radius)
    if isinstance(shape, Box):
        return dart.dynamics.BoxShape(np.array(shape.size))
    if isinstance(shape, Capsule):
        return dart.dynamics.CapsuleShape(shape.radius, shape.length)
    assert isinstance(shape, Plane)
    return dart.dynamics.PlaneShape(np.array(shape.normal), 0.0)


ENGINE = Dart()
