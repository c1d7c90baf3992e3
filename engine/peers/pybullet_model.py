"""A scene as Bullet holds it: trees of joints, and constraints elsewhere."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..bodies import WORLD, Particle, RigidBody
from ..joints import Ball, Distance, Hinge, Joint, Lock, Prismatic, frictions
from ..protocol import NotSupported, Task
from ..recorded_joints import conjugate, joint_point, turned_back
from ..result import Array
from ..shapes import Box, Capsule, Cylinder, Plane, Shape, Sphere
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
    sliding,
    spins,
    turn_of,
)
from .pushes import Pushes
from .stepped import quiet
from .surfaces import one_restitution, pairs_apart, shares

with quiet():  # it says when it was built
    import pybullet as bullet

SWEEPS = 500  # of the solver, in place of 50
ERP = 0.9  # share of a constraint's error that is mended in a step; 0.2 unless told
SLOWEST_BOUNCE = 0.01  # m/s: slower impacts do not rebound
SEEN_FROM = 0.02  # m: how far apart surfaces are a contact to Bullet, unless told; it is kept for all worlds of the process
BOUNCING_ERP = 0.01  # share of a depth that is mended in a step where bodies bounce, in place of 0.2
POINT_INERTIA = 1e-9  # kg m²: Bullet wants one of every moving body
NO_BOUND = 1e10  # N, rad/s: Bullet bounds forces of constraints and speeds of joints
HALF_HINGE = 0.5  # m from a hinge to each of the two points that hold it where it is a constraint
LINKS = 127  # it takes no more in one tree


class Model:
    """One world, filled."""

    def __init__(self, task: Task, client: int) -> None:
        self.task, self.client = task, client
        scene = self.scene = task.scene
        self.nodes = grown(scene) if task.configuration.options["joints"] else alone(scene)
        self.normal = plane_of_motion(scene)
        self.restitution = one_restitution(scene, "pybullet")
        self.rolling = {kind: shares(scene, kind, "pybullet") for kind in ("rolling", "torsional")}
        self.ids: dict[str, tuple[int, int]] = {}  # body -> tree and link
        self.held: dict[str, tuple[int, ...]] = {}  # constraint -> Bullet's constraints
        self.children = {node.tie.name: name for name, node in self.nodes.items() if node.tie is not None}
        self.pushes = Pushes(scene)
        bullet.setGravity(*scene.gravity, physicsClientId=client)
        bullet.setPhysicsEngineParameter(
            fixedTimeStep=task.time_step,
            numSolverIterations=SWEEPS,
            numSubSteps=0,
            solverResidualThreshold=0.0,
            restitutionVelocityThreshold=SLOWEST_BOUNCE,
            contactBreakingThreshold=SLOWEST_BOUNCE * task.time_step if self.restitution else SEEN_FROM,
            deterministicOverlappingPairs=1,
            jointFeedbackMode=bullet.JOINT_FEEDBACK_IN_WORLD_SPACE,
            physicsClientId=client,
        )
        if self.restitution:
            # A contact seen from afar stops what comes, which then touches without a speed to bounce with; and what is mended
            # of a depth is added to the speed of the rebound.
            bullet.setPhysicsEngineParameter(contactERP=BOUNCING_ERP, physicsClientId=client)
        for name, node in self.nodes.items():
            if node.parent is None:
                self._tree([name])
        hung = [n for n, node in self.nodes.items() if node.parent == WORLD]
        for name in hung:
            self._tree([WORLD, name])
        for constraint in closing(scene, self.nodes):
            self._hold(constraint)
        self._apart()

    def _tree(self, tops: list[str]) -> None:
        """One free body, fixed body or point of the world, with all that hangs from it."""
        top = tops[0]
        names = [name for name in below(self.nodes, tops[-1]) if name != top]
        if len(names) > LINKS:
            raise NotSupported(f"pybullet does not support more than {LINKS} bodies in one tree of joints")
        base = self.nodes.get(top)
        place, turn = self._frame(top)
        numbers = {top: 0} | {name: k + 1 for k, name in enumerate(names)}
        frames = {top: (place, turn)}
        frames |= {name: (hung_at(self.scene, self.nodes[name]), np.array([1.0, 0, 0, 0])) for name in names}
        links: dict[str, list[Any]] = {key: [] for key in _LINK}
        for name in names:
            node = self.nodes[name]
            above, above_turn = frames[str(node.parent)]
            at, _ = frames[name]
            kind, axis = self._joint(node)
            values = (
                node.body.mass,
                self._surface(node.body),
                -1,
                turned_back(above_turn, at - above).tolist(),
                _xyzw(conjugate(above_turn)),
                (np.array(node.body.position) - at).tolist(),
                _xyzw(turn_of(node.body)),
                numbers[str(node.parent)],
                kind,
                axis,
            )
            for key, value in zip(_LINK, values, strict=True):
                links[key].append(value)
        made = bullet.createMultiBody(
            baseMass=0.0 if base is None or fixed(base.body) else base.body.mass,
            baseCollisionShapeIndex=-1 if base is None else self._surface(base.body),
            basePosition=place.tolist(),
            baseOrientation=_xyzw(turn),
            flags=bullet.URDF_USE_SELF_COLLISION,
            physicsClientId=self.client,
            **links,
        )
        if made < 0:
            raise NotSupported("pybullet refuses the model")
        for name, number in numbers.items():
            if name != WORLD:
                self.ids[name] = (made, number - 1)
                self._properties(name)
        self._start(made, names, top)

    def _frame(self, name: str) -> tuple[Array, Array]:
        if name == WORLD:
            return np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])
        body = self.nodes[name].body
        return np.array(body.position), turn_of(body)

    def _joint(self, node: Node) -> tuple[int, list[float]]:
        tie = node.tie
        if isinstance(tie, Distance):
            if self.normal is None:
                return bullet.JOINT_SPHERICAL, [0.0, 0.0, 1.0]
            return bullet.JOINT_REVOLUTE, self.normal.tolist()
        kinds = {
            Lock: bullet.JOINT_FIXED,
            Ball: bullet.JOINT_SPHERICAL,
            Hinge: bullet.JOINT_REVOLUTE,
            Prismatic: bullet.JOINT_PRISMATIC,
        }
        return kinds[type(tie)], list(getattr(tie, "axis", (0.0, 0.0, 1.0)))  # type: ignore[index]

    def _surface(self, body: Particle | RigidBody) -> int:
        if isinstance(body, Particle) or body.shape is None or not self.scene.contacts:
            return -1
        return int(bullet.createCollisionShape(**_surface(body.shape), physicsClientId=self.client))

    def _properties(self, name: str) -> None:
        """Masses as the scene has them, surfaces, and nothing that damps or bounds."""
        made, link = self.ids[name]
        body = self.nodes[name].body
        told: dict[str, Any] = {"linearDamping": 0.0, "angularDamping": 0.0, "jointDamping": 0.0}
        if isinstance(body, RigidBody):
            # Bullet multiplies two coefficients; the scene wants the geometric mean and the larger restitution.
            told["lateralFriction"] = math.sqrt(body.material.friction)
            told["restitution"] = math.sqrt(self.restitution)
            told["rollingFriction"] = self.rolling["rolling"].get(name, 0.0)
            told["spinningFriction"] = self.rolling["torsional"].get(name, 0.0)
        bullet.changeDynamics(made, link, physicsClientId=self.client, **told)
        # In calls of their own: a bound of speeds and a mass in one call free a base that is fixed.
        bullet.changeDynamics(made, link, maxJointVelocity=NO_BOUND, physicsClientId=self.client)
        if not fixed(body):
            inertia = (POINT_INERTIA,) * 3 if isinstance(body, Particle) else body.inertia
            bullet.changeDynamics(made, link, localInertiaDiagonal=inertia, physicsClientId=self.client)

    def _start(self, made: int, names: list[str], top: str) -> None:
        """Speeds at the start; the motors that Bullet puts into joints are taken away."""
        turning = spins(self.scene, self.nodes) | {WORLD: np.zeros(3)}
        if top != WORLD and not fixed(self.nodes[top].body):
            body = self.nodes[top].body
            bullet.resetBaseVelocity(
                made, list(body.velocity), turning[top].tolist(), physicsClientId=self.client
            )
        for link, name in enumerate(names):
            node = self.nodes[name]
            kind, axis = self._joint(node)
            relative = turning[name] - turning[str(node.parent)]
            if kind == bullet.JOINT_SPHERICAL:
                relative = turned_back(turn_of(node.body), relative)  # it wants it in the child's own axes
                bullet.resetJointStateMultiDof(
                    made, link, [0, 0, 0, 1], relative.tolist(), physicsClientId=self.client
                )
                bullet.setJointMotorControlMultiDof(
                    made,
                    link,
                    bullet.POSITION_CONTROL,
                    targetPosition=[0, 0, 0, 1],
                    force=[0, 0, 0],
                    physicsClientId=self.client,
                )
            elif kind != bullet.JOINT_FIXED:
                speed = float(relative @ np.array(axis))
                if kind == bullet.JOINT_PRISMATIC:
                    speed = sliding(self.nodes, node, np.array(axis), turning[str(node.parent)])
                bullet.resetJointState(made, link, 0.0, float(speed), physicsClientId=self.client)
                wanted, most = _motor(node)
                bullet.setJointMotorControl2(
                    made,
                    link,
                    bullet.VELOCITY_CONTROL,
                    targetVelocity=wanted,
                    force=most,
                    physicsClientId=self.client,
                )
            if self.task.constraint_forces:
                bullet.enableJointForceTorqueSensor(made, link, True, physicsClientId=self.client)

    def _hold(self, constraint: Any) -> None:
        """A constraint where no joint can be."""
        if isinstance(constraint, Distance):
            raise NotSupported("pybullet has no constraint of distance, only rods that joints can stand for")
        if any(frictions(constraint)[0]) or getattr(constraint, "motor", None):
            raise NotSupported(
                f"pybullet does not support friction or a motor in a constraint, as {constraint.name!r} would be"
            )
        at = joint_point(self.scene, constraint)
        points, kind = [at], bullet.JOINT_POINT2POINT
        if isinstance(constraint, Hinge):
            arm = HALF_HINGE * np.array(constraint.axis)
            points = [at - arm, at + arm]
        elif isinstance(constraint, Lock):
            kind = bullet.JOINT_FIXED
        elif isinstance(constraint, Prismatic):
            raise NotSupported(
                "pybullet does not support a slide as a constraint: its own lets bodies part sideways"
            )
        first, second = self._ends(constraint)
        place, turn = self._frame(first)
        other, other_turn = self._frame(second)
        made = []
        for point in points:
            made.append(
                bullet.createConstraint(
                    *self.ids[first],
                    *((-1, -1) if second == WORLD else self.ids[second]),
                    kind,
                    (0.0, 0.0, 0.0),
                    turned_back(turn, point - place).tolist(),
                    turned_back(other_turn, point - other).tolist(),
                    _xyzw(conjugate(turn)),
                    _xyzw(conjugate(other_turn)),
                    physicsClientId=self.client,
                )
            )
            bullet.changeConstraint(made[-1], maxForce=NO_BOUND, erp=ERP, physicsClientId=self.client)
        self.held[constraint.name] = tuple(made)

    def _ends(self, constraint: Joint) -> tuple[str, str]:
        """The body a constraint is told of first, which moves, and the other one or the world."""
        one, two = constraint.between
        return (two, one) if one == WORLD or fixed(self.nodes[one].body) else (one, two)

    def _apart(self) -> None:
        """Pairs that must not touch."""
        if not self.scene.contacts:
            return
        for a, b in pairs_apart(self.scene):
            bullet.setCollisionFilterPair(
                self.ids[a][0], self.ids[b][0], self.ids[a][1], self.ids[b][1], 0, physicsClientId=self.client
            )


_LINK = (
    "linkMasses",
    "linkCollisionShapeIndices",
    "linkVisualShapeIndices",
    "linkPositions",
    "linkOrientations",
    "linkInertialFramePositions",
    "linkInertialFrameOrientations",
    "linkParentIndices",
    "linkJointTypes",
    "linkJointAxis",
)


def _xyzw(q: Array) -> list[float]:
    """A turn as Bullet writes it."""
    return [float(q[1]), float(q[2]), float(q[3]), float(q[0])]


def _motor(node: Node) -> tuple[float, float]:
    """Speed and largest force of a joint's motor; without force it does nothing."""
    tie = node.tie
    if tie is None or (driven := drive(tie, "pybullet")) is None:
        return 0.0, 0.0
    sign = 1.0 if tie.between[1] == node.body.name else -1.0
    return sign * driven[0], NO_BOUND if driven[1] is None else driven[1]


def _surface(shape: Shape) -> dict[str, Any]:
    if isinstance(shape, Sphere):
        return {"shapeType": bullet.GEOM_SPHERE, "radius": shape.radius}
    if isinstance(shape, Box):
        return {"shapeType": bullet.GEOM_BOX, "halfExtents": [0.5 * edge for edge in shape.size]}
    if isinstance(shape, Capsule):
        return {"shapeType": bullet.GEOM_CAPSULE, "radius": shape.radius, "height": shape.length}
    if isinstance(shape, Cylinder):
        return {"shapeType": bullet.GEOM_CYLINDER, "radius": shape.radius, "height": shape.length}
    assert isinstance(shape, Plane)
    return {"shapeType": bullet.GEOM_PLANE, "planeNormal": list(shape.normal)}
