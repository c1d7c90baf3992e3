"""A scene as OpenSim hands it to Simbody: bodies on their joints, what closes loops, forces, and what touches."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np

from ..bodies import WORLD, Particle, RigidBody
from ..forces import CentralGravity, Load, Spring
from ..joints import Ball, Distance, Hinge, Lock, Prismatic, Universal
from ..protocol import NotSupported, Task
from ..recorded_joints import joint_point, turned, turned_back
from ..result import Array
from ..shapes import Box, Plane, Sphere
from .described import upwards
from .frames import along
from .joint_tree import (
    Node,
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
from .stepped import quiet
from .surfaces import one_friction, pairs_apart, solid

with quiet():
    import opensim

    opensim.Logger.setLevelString("Off")

POINT_INERTIA = 1e-9  # kg m²: what turns must have one
HALF_HINGE = 0.5  # m from a hinge to each of the two points that hold it where it closes a loop
TOLERANCE = 1e-10  # to which what closes a loop is projected
SINKING = 1e-4  # of the least radius, by which the heaviest ball sinks under its weight
DISSIPATION = 20.0  # s/m, by which a force grows with the speed of meeting: nothing bounces then
CREEPING = 1e-3  # m/s below which a ball's friction falls off
STEEP = 1e4  # 1 over edges: so fast a corner's force grows as it sinks; 1150 / m unless told, where a metre is a foot's
TANGENTIAL = 1e5  # N/m a kg: what holds a corner that sticks
MOST_PAIRS = 300  # of balls and planes that are asked pair by pair; beyond, all in one force
MOST_BODIES = (
    200  # OpenSim looks through all of a model for each that is added: two seconds for three hundred
)
SHORTEST = 1e-4  # of the time step: what chooses its steps gives up there, where it would not end
WEIGHT = 9.81  # m/s², of what there is without gravity


class Model:
    """One model with its manager, at its start."""

    def __init__(self, task: Task) -> None:
        self.task, self.done = task, 0
        scene = self.scene = task.scene
        self.nodes = grown(scene)
        if sum(not fixed(body) for body in scene.bodies) > MOST_BODIES:
            raise NotSupported(
                f"OpenSim builds models for simbody in the square of their size: at most {MOST_BODIES} bodies"
            )
        self.normal = plane_of_motion(scene)
        self.bodies: dict[str, Any] = {}
        self.joints: dict[str, Any] = {}
        self.balls: list[tuple[tuple[str, str], Any]] = []
        self.corners: list[tuple[tuple[str, str], Any]] = []
        self.model = opensim.Model()
        self.model.setGravity(_vec(scene.gravity))
        for top, node in self.nodes.items():
            if node.parent is None or node.parent == WORLD:
                for name in below(self.nodes, top):
                    if not fixed(self.nodes[name].body):
                        self._add(self.nodes[name])
        for number, constraint in enumerate(closing(scene, self.nodes)):
            self._close(f"c{number}", constraint)
        for number, force in enumerate(scene.forces):
            self._push(f"f{number}", force)
        if scene.contacts:
            self._touch()
        self.state = self.model.initSystem()
        if self.state.getNY() == 0 and task.configuration.options["method"] == "CPodes":
            raise NotSupported("CPODES ends the process where nothing can move")
        self._start()
        self.manager = opensim.Manager(self.model)
        self._integrator()
        self.refused: RuntimeError | None = None  # a start that cannot be projected
        try:
            self.manager.initialize(self.state)
        except RuntimeError as error:
            self.refused = error

    def _add(self, node: Node) -> None:
        """A body with the joint that it hangs by, or free."""
        body, name = node.body, node.body.name
        moments = (POINT_INERTIA,) * 3 if isinstance(body, Particle) else body.inertia
        made = opensim.Body(
            f"b{node.index}",
            float(body.mass or 0.0),
            _vec(np.zeros(3)),
            opensim.Inertia(*map(float, moments or ())),
        )
        self.model.addBody(made)
        self.bodies[name] = made
        at, axes, kind = np.array(body.position), np.eye(3), opensim.FreeJoint
        tie = node.tie
        if tie is not None:
            at, kind = hung_at(self.scene, node), opensim.WeldJoint
        if isinstance(tie, Distance):
            normals = rod_axes(np.array(body.position) - at, self.normal)
            kind, axes = (opensim.PinJoint, _upon_z(normals[0])) if len(normals) == 1 else _universal(normals)
        elif isinstance(tie, Ball):
            kind = opensim.BallJoint
        elif isinstance(tie, Universal):
            pair = [np.array(tie.axis), np.array(tie.cross_axis)]
            kind, axes = _universal(pair if tie.between[1] == name else pair[::-1])
        elif isinstance(tie, Hinge):
            kind, axes = opensim.PinJoint, _upon_z(np.array(tie.axis))
        elif isinstance(tie, Prismatic):
            kind, axes = opensim.SliderJoint, _matrix(along(tie.axis))
        ends = (*self._seen(node.parent, at, axes), *self._seen(name, at, axes))
        self.joints[name] = joint = kind(f"j{node.index}", *ends)
        self.model.addJoint(joint)

    def _moving(self, name: Any) -> bool:
        return isinstance(name, str) and name != WORLD and not fixed(self.scene.body(name))

    def _seen(self, name: str | None, at: Array, axes: Array) -> tuple[Any, Any, Any]:
        """A body with a point and axes (columns) of the world at the start, as it sees them; what is fixed is the ground."""
        if not self._moving(name):
            return self.model.getGround(), _vec(at), _vec(_angles(axes))
        body = self.scene.body(str(name))
        turn = turn_of(body)
        back = _matrix(turn).T
        return (
            self.bodies[body.name],
            _vec(turned_back(turn, at - np.array(body.position))),
            _vec(_angles(back @ axes)),
        )

    def _close(self, name: str, constraint: Any) -> None:
        """Constraints where no joint can be."""
        made = []
        if isinstance(constraint, Distance):
            length = constraint.rest_length
            length = self.scene.length(constraint) if length is None else length
            ends: list[Any] = []
            for k, end in enumerate(constraint.between):
                at = np.array(self.scene.anchor(constraint, k))
                ends += self._seen(end if isinstance(end, str) else None, at, np.eye(3))[:2]
            made.append(opensim.ConstantDistanceConstraint(*ends, float(length)))
        elif isinstance(constraint, Lock):
            ends = [
                part
                for end in constraint.between
                for part in self._seen(end, joint_point(self.scene, constraint), np.eye(3))
            ]
            made.append(opensim.WeldConstraint(name, *ends))
        elif isinstance(constraint, Ball | Hinge):
            at = joint_point(self.scene, constraint)
            arms = (
                [HALF_HINGE * np.array(constraint.axis) * side for side in (-1.0, 1.0)]
                if isinstance(constraint, Hinge)
                else [np.zeros(3)]
            )
            for arm in arms:
                ends = [
                    part for end in constraint.between for part in self._seen(end, at + arm, np.eye(3))[:2]
                ]
                made.append(opensim.PointConstraint(*ends))
        else:
            raise NotSupported(
                f"our adapter cannot ask simbody to close a loop by the {constraint.kind} {constraint.name!r}"
            )
        for number, one in enumerate(made):
            one.setName(f"{name}n{number}")
            self.model.addConstraint(one)

    def _push(self, name: str, force: Any) -> None:
        """Forces besides gravity, in its own loop."""
        made = []
        if isinstance(force, Load):
            push = opensim.PrescribedForce(name, self.bodies[force.body])
            push.setForceIsInGlobalFrame(True)
            push.setForceFunctions(*map(opensim.Constant, map(float, force.force)))
            push.setTorqueFunctions(*map(opensim.Constant, map(float, force.torque)))
            made.append(push)
        elif isinstance(force, Spring):
            law = f"{force.stiffness!r}*(d-{force.rest_length!r})+{force.viscosity!r}*ddot"
            ends = [
                self._seen(
                    end if isinstance(end, str) else None, np.array(self.scene.anchor(force, k)), np.eye(3)
                )
                for k, end in enumerate(force.between)
            ]
            made.append(_between(ends, law))
        elif isinstance(force, CentralGravity):
            centre = (self.model.getGround(), _vec(np.array(force.centre)))
            for body in self.scene.bodies:
                if not fixed(body):
                    law = f"{force.strength * float(body.mass or 0.0)!r}/d^2"
                    made.append(_between([centre, (self.bodies[body.name], _vec(np.zeros(3)))], law))
        for number, one in enumerate(made):
            one.setName(f"{name}n{number}")
            self.model.addForce(one)

    def _touch(self) -> None:
        """What can touch: balls and planes by pairs or all in one force, corners of boxes and planes."""
        bodies = solid(self.scene)
        self.friction = one_friction(self.scene, "simbody")
        apart = {frozenset(pair) for pair in pairs_apart(self.scene)}
        rolling, standing = [], []
        for pair in combinations(bodies, 2):
            if all(fixed(body) for body in pair) or frozenset(body.name for body in pair) in apart:
                continue
            kinds = {type(body.shape) for body in pair}
            if kinds == {Box, Plane}:
                standing.append(pair if isinstance(pair[0].shape, Box) else pair[::-1])
            elif kinds <= {Sphere, Plane}:
                rolling.append(pair)
            else:
                raise NotSupported("boxes touch planes alone in simbody as our adapter asks it")
        self.surfaces = {
            body.name: self._surface(body) for body in bodies if any(body in pair for pair in rolling)
        }
        if len(rolling) > MOST_PAIRS:
            if apart or self.task.contacts:
                raise NotSupported(f"our adapter tells simbody of at most {MOST_PAIRS} pairs one by one")
            self._rolls([body for body in bodies if body.name in self.surfaces])
        else:
            for one, two in rolling:
                self.balls.append(((one.name, two.name), self._rolls([one, two])))
        for box, plane in standing:
            self._stands(box, plane)
        if standing and self.task.configuration.options["method"] == "CPodes":
            raise NotSupported("what a corner sticks to is a state between steps, which CPODES does not keep")

    def _surface(self, body: RigidBody) -> Any:
        """A ball, or the half space below a plane, by a name of its own."""
        name = f"s{self.nodes[body.name].index}"
        if isinstance(body.shape, Plane):
            into = _matrix(along(tuple(-self._up(body))))
            made = opensim.ContactHalfSpace(
                _vec(body.position), _vec(_angles(into)), self.model.getGround(), name
            )
        else:
            assert isinstance(body.shape, Sphere)
            frame, at, _ = self._seen(body.name, np.array(body.position), np.eye(3))
            made = opensim.ContactSphere(body.shape.radius, at, frame, name)
        self.model.addContactGeometry(made)
        return name

    def _up(self, body: RigidBody) -> Array:
        assert isinstance(body.shape, Plane)
        return turned(turn_of(body), np.array(body.shape.normal))

    def _weight(self, mass: float) -> float:
        return mass * (float(np.linalg.norm(self.scene.gravity)) or WEIGHT)

    def _rolls(self, bodies: list[RigidBody]) -> Any:
        """Hunt and Crossley's force between balls and planes, as stiff as the heaviest ball of the scene needs."""
        balls = [body for body in solid(self.scene) if isinstance(body.shape, Sphere)]
        least = min(body.shape.radius for body in balls)  # type: ignore[union-attr]
        heaviest = max(self._weight(float(body.mass or 0.0)) for body in balls if not fixed(body))
        force = opensim.HuntCrossleyForce()
        for body in bodies:
            force.addGeometry(self.surfaces[body.name])
        # Hertz: f = 4/3 E √r x^3/2, where two surfaces each give way by half, and E is that of one over 2^3/2.
        force.setStiffness(0.75 * 2.0**1.5 * heaviest / (least**2 * SINKING**1.5))
        force.setDissipation(DISSIPATION)
        force.setStaticFriction(self.friction)
        force.setDynamicFriction(self.friction)
        force.setTransitionVelocity(CREEPING)
        force.setName(f"h{len(self.balls)}")
        self.model.addForce(force)
        return force

    def _stands(self, box: RigidBody, plane: RigidBody) -> None:
        """Exponential springs between the corners of a box and a plane."""
        assert isinstance(box.shape, Box)
        turn = opensim.Rotation()
        turn.setRotationToBodyFixedXYZ(_vec(_angles(_matrix(upwards(tuple(self._up(plane)))))))
        pose = opensim.Transform(turn, _vec(plane.position))
        share, mass = 0.25 * self._weight(float(box.mass or 0.0)), float(box.mass or 0.0)
        for signs in np.ndindex(2, 2, 2):
            corner = opensim.ExponentialContactForce(
                pose, self.bodies[box.name], _vec((np.array(signs) - 0.5) * box.shape.size)
            )
            corner.setName(f"e{len(self.corners)}")
            corner.setExponentialShapeParameters(_vec((0.0, share, STEEP / min(box.shape.size))))
            corner.setNormalViscosity(DISSIPATION)
            corner.setMaxNormalForce(max(1e5, 1e6 * share))
            corner.setFrictionElasticity(TANGENTIAL * mass)
            corner.setFrictionViscosity(mass * TANGENTIAL**0.5)
            corner.setInitialMuStatic(self.friction)
            corner.setInitialMuKinetic(self.friction)
            self.model.addForce(corner)
            self.corners.append(((box.name, plane.name), corner))

    def _start(self) -> None:
        """Speeds of the coordinates, all of which are zero at the start; and where corners stick."""
        turning = spins(self.scene, self.nodes) | {WORLD: np.zeros(3)}
        for name, joint in self.joints.items():
            node = self.nodes[name]
            above = turning[node.parent] if self._moving(node.parent) else np.zeros(3)  # type: ignore[index]
            for k, speed in enumerate(self._speeds(node, turning[name] - above, above)):
                joint.get_coordinates(k).setSpeedValue(self.state, float(speed))
        if self.corners:
            for _, corner in self.corners:
                corner.setMuStatic(self.state, self.friction)
                corner.setMuKinetic(self.state, self.friction)
            self.model.realizeVelocity(self.state)
            opensim.ExponentialContactForce.resetAnchorPoints(self.model, self.state)

    def _speeds(self, node: Node, relative: Array, above: Array) -> Any:
        tie, body = node.tie, node.body
        if tie is None:
            return (*relative, *body.velocity)
        if isinstance(tie, Lock):
            return ()
        if isinstance(tie, Ball):
            return relative
        if isinstance(tie, Hinge):
            return (relative @ np.array(tie.axis),)
        if isinstance(tie, Prismatic):
            return (sliding(self.nodes, node, np.array(tie.axis), above),)
        if isinstance(tie, Universal):
            pair = [np.array(tie.axis), np.array(tie.cross_axis)]
            return [relative @ axis for axis in (pair if tie.between[1] == body.name else pair[::-1])]
        normals = rod_axes(np.array(body.position) - hung_at(self.scene, node), self.normal)
        return [relative @ axis for axis in normals]

    def _integrator(self) -> None:
        options, manager = self.task.configuration.options, self.manager
        manager.setIntegratorMethod(getattr(opensim.Manager, f"IntegratorMethod_{options['method']}"))
        manager.setWriteToStorage(False)
        manager.setPerformAnalyses(False)
        if options["accuracy"] is None:
            manager.setIntegratorFixedStepSize(self.task.time_step)
        else:
            manager.setIntegratorAccuracy(options["accuracy"])
            manager.setIntegratorMaximumStepSize(self.task.time_step)
            manager.setIntegratorMinimumStepSize(SHORTEST * self.task.time_step)
        manager.setIntegratorConstraintTolerance(TOLERANCE)


def _between(ends: Any, law: str) -> Any:
    """A force along the line between two points, together where it is positive."""
    force = opensim.ExpressionBasedPointToPointForce()
    for number, (body, point, *_) in enumerate(ends, start=1):
        getattr(force, f"setBody{number}Name")(body.getAbsolutePathString())
        getattr(force, f"setPoint{number}")(point)
    force.setExpression(law)
    return force


def _universal(pair: list[Array]) -> tuple[Any, Array]:
    return opensim.UniversalJoint, np.stack([*pair, np.cross(pair[0], pair[1])], axis=1)


def _upon_z(axis: Array) -> Array:
    """Axes (columns) of which z is that."""
    return _matrix(upwards(tuple(axis)))


def _matrix(turn: Any) -> Array:
    return np.stack([turned(np.asarray(turn), axis) for axis in np.eye(3)], axis=1)


def _angles(matrix: Array) -> Array:
    """Turns about x, y and z of the body, in that order, that make a rotation; sure of themselves where y is upright."""
    a = np.arctan2(-matrix[1, 2], matrix[2, 2])
    b = np.arctan2(matrix[0, 2], np.hypot(matrix[0, 0], matrix[0, 1]))
    c = np.arctan2(
        np.cos(a) * matrix[1, 0] + np.sin(a) * matrix[2, 0],
        np.cos(a) * matrix[1, 1] + np.sin(a) * matrix[2, 1],
    )
    return np.array([a, b, c])


def _vec(numbers: Any) -> Any:
    return opensim.Vec3(*map(float, numbers))


def array(vector: Any) -> Array:
    """One of its vectors of three numbers."""
    return np.array([vector.get(0), vector.get(1), vector.get(2)])
