"""A scene as Drake holds it: a plant with its joints, what closes loops, surfaces, and forces."""

from __future__ import annotations

from typing import Any

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.common.value import Value
from pydrake.geometry import (
    AddCompliantHydroelasticProperties,
    AddContactMaterial,
    AddRigidHydroelasticProperties,
    CollisionFilterDeclaration,
    GeometrySet,
    HalfSpace,
    ProximityProperties,
)
from pydrake.geometry import Box as DrakeBox
from pydrake.geometry import Capsule as DrakeCapsule
from pydrake.geometry import Sphere as DrakeSphere
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.math import SpatialForce, SpatialVelocity
from pydrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    ContactModel,
    CoulombFriction,
    DiscreteContactApproximation,
    ExternallyAppliedSpatialForce,
    MultibodyPlant,
)
from pydrake.multibody.tree import (
    BallRpyJoint,
    FixedOffsetFrame,
    LinearSpringDamper,
    PrismaticJoint,
    RevoluteJoint,
    SpatialInertia,
    UnitInertia,
    UniversalJoint,
    WeldJoint,
)
from pydrake.symbolic import MakeVectorVariable, sqrt
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import SymbolicVectorSystem

from ..bodies import WORLD, Particle, RigidBody
from ..forces import CentralGravity, Load, Spring
from ..joints import Ball, Distance, Hinge, Lock, Prismatic, Universal
from ..protocol import NotSupported, Task
from ..recorded_joints import joint_point, turned_back
from ..result import Array
from ..shapes import Box, Capsule, Plane, Shape, Sphere
from .described import upwards
from .joint_tree import (
    Node,
    alone,
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
from .surfaces import one_friction, pairs_apart, solid

POINT_INERTIA = 1e-9  # kg m²: Drake wants one of every moving body
HALF_HINGE = 0.5  # m from a hinge to each of the two points that hold it where it is a constraint
MODULUS = 1e5  # Pa, of surfaces that touch: the cube of 1 kg and 1 m sinks in by 0.05 mm
SINKING = 1e-5  # m that what touches in points may sink in; a millimetre unless told


class Model:
    """One plant in its simulator, at its start."""

    def __init__(self, task: Task) -> None:
        self.task = task
        scene = self.scene = task.scene
        options = task.configuration.options
        self.nodes = grown(scene) if options["joints"] else alone(scene)
        self.normal = plane_of_motion(scene)
        self.friction = one_friction(scene, "drake") if scene.contacts else 0.0
        self.joints: dict[str, Any] = {}  # body -> the joint it hangs by
        self.geometries: dict[str, Any] = {}
        builder = DiagramBuilder()
        pace = task.time_step if options["discrete"] else 0.0
        if scene.contacts and solid(scene):
            self.plant, self.graph = AddMultibodyPlantSceneGraph(builder, pace)
        else:
            self.plant, self.graph = builder.AddSystem(MultibodyPlant(pace)), None
        if options["discrete"]:
            self.plant.set_discrete_contact_approximation(DiscreteContactApproximation.kSap)
        self.plant.mutable_gravity_field().set_gravity_vector(np.array(scene.gravity))
        self.plant.set_adjacent_bodies_collision_filters(False)
        self.plant.set_sap_near_rigid_threshold(0.0)  # it would soften what is stiffer than a step can tell
        self.plant.set_contact_model(ContactModel.kHydroelasticWithFallback)
        self.bodies = {body.name: self._body(body) for body in scene.bodies}
        for name, node in self.nodes.items():
            if node.tie is not None:
                self.joints[name] = self._join(node)
        left = closing(scene, self.nodes)
        if left and not options["discrete"]:
            raise NotSupported(
                f"drake ({task.configuration.name}) does not support what closes loops, as {left[0].name!r} does"
            )
        if left:
            self._close(left)
        for force in scene.forces:
            if isinstance(force, Spring):
                self._spring(force)
        self.plant.Finalize()
        if self.graph is not None:
            self.plant.set_penetration_allowance(SINKING)
            self._apart()
        self.order = {index: k for k, index in enumerate(self.plant.GetJointIndices())}
        self._attract(builder)
        diagram = builder.Build()
        self.simulator = Simulator(diagram)
        if not options["discrete"]:
            ResetIntegratorFromFlags(self.simulator, "runge_kutta3", task.time_step).set_fixed_step_mode(True)
        self.context = self.plant.GetMyMutableContextFromRoot(self.simulator.get_mutable_context())
        self._start()
        self.done = 0
        self.simulator.Initialize()

    def _body(self, body: Particle | RigidBody) -> Any:
        moves = not fixed(body)
        mass = float(body.mass or 1.0) if moves else 1.0
        inertia = (POINT_INERTIA,) * 3 if isinstance(body, Particle) else body.inertia if moves else None
        unit = UnitInertia(*(np.array(inertia or (1.0, 1.0, 1.0)) / mass))
        made = self.plant.AddRigidBody(body.name, SpatialInertia(mass, np.zeros(3), unit))
        if not moves:
            self.plant.WeldFrames(self.plant.world_frame(), made.body_frame(), _pose(body))
        if isinstance(body, RigidBody) and body.shape is not None and self.scene.contacts:
            self._surface(body, body.shape, made)
        return made

    def _surface(self, body: RigidBody, shape: Shape, made: Any) -> None:
        properties = ProximityProperties()
        AddContactMaterial(None, None, CoulombFriction(self.friction, self.friction), properties)
        if isinstance(shape, Plane):
            AddRigidHydroelasticProperties(properties)
        elif isinstance(shape, Box):
            AddCompliantHydroelasticProperties(0.1, MODULUS, properties)
        kind, turn = _drake(shape)
        pose = RigidTransform(RotationMatrix(Quaternion(turn)), np.zeros(3))
        self.geometries[body.name] = self.plant.RegisterCollisionGeometry(
            made, pose, kind, body.name, properties
        )

    def _end(self, name: str | None) -> tuple[Any, Array, Array]:
        """A body with its place and turn at the start."""
        if name is None or name == WORLD:
            return self.plant.world_body(), np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])
        body = self.scene.body(name)
        return self.bodies[name], np.array(body.position), turn_of(body)

    def _frame(self, name: str | None, at: Array, axes: Array) -> Any:
        """A frame on a body, at a point of the world and with these axes (columns) at the start."""
        made, place, turn = self._end(name)
        back = RotationMatrix(Quaternion(turn)).inverse()
        pose = RigidTransform(back @ RotationMatrix(axes), turned_back(turn, at - place))
        called = f"frame {self.plant.num_frames()}"
        return self.plant.AddFrame(FixedOffsetFrame(called, made.body_frame(), pose))

    def _join(self, node: Node) -> Any:
        tie, name = node.tie, node.body.name
        at, axes, kind = hung_at(self.scene, node), np.eye(3), WeldJoint
        more: tuple[Any, ...] = ()
        if isinstance(tie, Distance):
            normals = rod_axes(np.array(node.body.position) - at, self.normal)
            if len(normals) == 1:
                kind, more = RevoluteJoint, (normals[0],)
            else:
                kind, axes = UniversalJoint, np.stack([*normals, np.cross(normals[0], normals[1])], axis=1)
        elif isinstance(tie, Lock):
            more = (RigidTransform(),)
        elif isinstance(tie, Ball):
            kind = BallRpyJoint
        elif isinstance(tie, Universal):
            pair = [np.array(tie.axis), np.array(tie.cross_axis)]
            pair = pair if tie.between[1] == name else pair[::-1]
            kind, axes = UniversalJoint, np.stack([*pair, np.cross(pair[0], pair[1])], axis=1)
        else:
            assert isinstance(tie, Hinge | Prismatic)
            kind, more = RevoluteJoint if isinstance(tie, Hinge) else PrismaticJoint, (np.array(tie.axis),)
        above = self._frame(node.parent, at, axes)
        return self.plant.AddJoint(kind(f"{name} by its joint", above, self._frame(name, at, axes), *more))

    def _close(self, constraints: list[Any]) -> None:
        """Constraints where no joint can be. On the world's own body they would end the process, so it gets one."""
        ground = self.plant.AddRigidBody(
            " ground", SpatialInertia(1.0, np.zeros(3), UnitInertia(1.0, 1.0, 1.0))
        )
        self.plant.WeldFrames(self.plant.world_frame(), ground.body_frame())
        for constraint in constraints:
            if isinstance(constraint, Distance):
                points = [np.array(self.scene.anchor(constraint, k)) for k in (0, 1)]
                length = constraint.rest_length
                length = self.scene.length(constraint) if length is None else length
                ends = [e if isinstance(e, str) else None for e in constraint.between]
                placed = [self._point(e, p, ground) for e, p in zip(ends, points, strict=True)]
                self.plant.AddDistanceConstraint(*placed[0], *placed[1], length)
                continue
            at = joint_point(self.scene, constraint)
            if isinstance(constraint, Lock):
                held = [self._point(e, at, ground) for e in constraint.between]
                turns = [RotationMatrix(Quaternion(self._end(e)[2])).inverse() for e in constraint.between]
                poses = [RigidTransform(turn, p) for turn, (_, p) in zip(turns, held, strict=True)]
                self.plant.AddWeldConstraint(held[0][0], poses[0], held[1][0], poses[1])
                continue
            arm = HALF_HINGE * np.array(getattr(constraint, "axis", (0.0, 0.0, 0.0)))
            if not isinstance(constraint, Ball | Hinge):
                raise NotSupported(f"drake has no constraint for the {constraint.kind} {constraint.name!r}")
            for point in (at - arm, at + arm) if isinstance(constraint, Hinge) else (at,):
                one, two = (self._point(e, point, ground) for e in constraint.between)
                self.plant.AddBallConstraint(*one, *two)

    def _point(self, name: str | None, at: Array, ground: Any) -> tuple[Any, Array]:
        """A body and where a point of the world is on it at the start."""
        made, place, turn = self._end(name)
        return (ground if name in (None, WORLD) else made), turned_back(turn, at - place)

    def _spring(self, spring: Spring) -> None:
        if spring.rest_length <= 0.0:
            raise NotSupported("drake does not support a spring without a rest length")
        ends = [
            (self.bodies[e], np.array(a)) if isinstance(e, str) else (self.plant.world_body(), np.array(e))
            for e, a in zip(spring.between, spring.anchors, strict=True)
        ]
        self.plant.AddForceElement(
            LinearSpringDamper(*ends[0], *ends[1], spring.rest_length, spring.stiffness, spring.viscosity)
        )

    def _apart(self) -> None:
        """Pairs that must not touch."""
        manager = self.graph.collision_filter_manager()
        for a, b in pairs_apart(self.scene):
            one, two = (GeometrySet(self.geometries[name]) for name in (a, b))
            manager.Apply(CollisionFilterDeclaration().ExcludeBetween(one, two))

    def _attract(self, builder: Any) -> None:
        """Central gravity as an expression of the state: a generalised force, so of bodies that fly free only."""
        fields = [f for f in self.scene.forces if isinstance(f, CentralGravity)]
        if not fields:
            return
        if any(node.tie is not None for node in self.nodes.values()):
            raise NotSupported("drake does not support central gravity on bodies that hang from others")
        count, width = self.plant.num_positions(), self.plant.num_velocities()
        state = MakeVectorVariable(count + width, "x")
        pull: list[Any] = [0.0 * state[0]] * width
        for body in self.scene.bodies:
            if fixed(body):
                continue
            made = self.bodies[body.name]
            first, where = made.floating_velocities_start_in_v(), made.floating_positions_start() + 4
            for field in fields:
                away = [state[where + k] - field.centre[k] for k in range(3)]
                far = sqrt(away[0] * away[0] + away[1] * away[1] + away[2] * away[2])
                for k in range(3):
                    size = -float(body.mass or 0.0) * field.strength
                    pull[first + 3 + k] = pull[first + 3 + k] + size * away[k] / (far * far * far)
        still = MakeVectorVariable(1, "s")  # in continuous time it must have a state of its own
        system = SymbolicVectorSystem(
            input=state, state=still, dynamics=[0.0 * still[0]], output=np.array(pull)
        )
        if self.task.configuration.options["discrete"]:
            system = SymbolicVectorSystem(input=state, output=np.array(pull))
        builder.AddSystem(system)
        builder.Connect(self.plant.get_state_output_port(), system.get_input_port())
        builder.Connect(system.get_output_port(), self.plant.get_applied_generalized_force_input_port())

    def _start(self) -> None:
        turning = spins(self.scene, self.nodes) | {WORLD: np.zeros(3)}
        pushed = []
        for force in self.scene.forces:
            if isinstance(force, Load):
                push = ExternallyAppliedSpatialForce()
                push.body_index = self.bodies[force.body].index()
                push.p_BoBq_B = np.zeros(3)
                push.F_Bq_W = SpatialForce(np.array(force.torque), np.array(force.force))
                pushed.append(push)
        if pushed:
            port = self.plant.get_applied_spatial_force_input_port()
            port.FixValue(self.context, Value[list[ExternallyAppliedSpatialForce]](pushed))
        for name, node in self.nodes.items():
            body = node.body
            if fixed(body):
                continue
            if node.tie is None:
                self.plant.SetFreeBodyPose(self.context, self.bodies[name], _pose(body))
                speed = SpatialVelocity(turning[name], np.array(body.velocity))
                self.plant.SetFreeBodySpatialVelocity(self.context, self.bodies[name], speed)
                continue
            self._set_rate(node, turning[name] - turning[str(node.parent)], turning[str(node.parent)])

    def _set_rate(self, node: Node, relative: Array, above: Array) -> None:
        joint = self.joints[node.body.name]
        if isinstance(joint, RevoluteJoint):
            joint.set_angular_rate(self.context, float(relative @ joint.revolute_axis()))
        elif isinstance(joint, PrismaticJoint):
            along = sliding(self.nodes, node, joint.translation_axis(), above)
            joint.set_translation_rate(self.context, along)
        elif isinstance(joint, BallRpyJoint):
            joint.set_angular_velocity(self.context, relative)
        elif isinstance(joint, UniversalJoint):
            axes = joint.frame_on_parent().CalcPoseInWorld(self.context).rotation().matrix()
            joint.set_angular_rates(self.context, (axes.T @ relative)[:2])


def _pose(body: Particle | RigidBody) -> Any:
    return RigidTransform(RotationMatrix(Quaternion(turn_of(body))), np.array(body.position))


def _drake(shape: Shape) -> tuple[Any, Any]:
    """Drake's shape, and its turn."""
    upright = np.array([1.0, 0.0, 0.0, 0.0])
    if isinstance(shape, Sphere):
        return DrakeSphere(shape.radius), upright
    if isinstance(shape, Box):
        return DrakeBox(*shape.size), upright
    if isinstance(shape, Capsule):
        return DrakeCapsule(shape.radius, shape.length), upright
    assert isinstance(shape, Plane)
    return HalfSpace(), upwards(shape.normal)
