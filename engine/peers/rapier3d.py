"""Rapier by its Python package: single precision, joints and contacts by sequential impulses, one thread.

Newer than the npm package behind `rapier`, with a choice of friction's model. Every step is a call from Python, which pushes
fields before it. What it shows of a joint are impulses of rows that it has made orthogonal to each other, which are no
forces; of a contact's friction it shows something where each point has a cone of its own (coulomb).
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from importlib.metadata import version
from typing import Any

import numpy as np
import rapier3d as rapier

from ..bodies import WORLD, Particle, RigidBody
from ..build_info import BuildInfo
from ..forces import CentralGravity, Load, Spring
from ..joints import Ball, Hinge, Joint, Lock, Prismatic
from ..meshes import HeightField, TriangleMesh
from ..observe import ContactCount, ContactForce, Penetration
from ..protocol import Capabilities, Configuration, NotSupported, Task
from ..recorded_joints import product, turned
from ..recording import Recording
from ..result import Array
from ..shapes import Box, Capsule, Compound, ConvexHull, Cylinder, Plane, Shape, Sphere
from .frames import drive, drive_damping, ends_of, xyzw
from .pushes import Pushes
from .stepped import Kept, stepped
from .surfaces import solid

POINT_INERTIA = 1e-6  # kg m²: every moving body wants one; a particle that turns is not seen to
WITHOUT_BOUND = 1e18  # m/s; its square is a number of single precision, too
FREE = {Hinge: rapier.JointAxis.ANG_X, Prismatic: rapier.JointAxis.LIN_X}
ABSENT = frozenset(  # of it and of its package for JavaScript
    {
        "the joint distance",  # its rope pulls alone, and so does every bound of a distance
        "the joint relation",
        "the observable constraint force",
        "compliance of a surface",
        "friction of rolling or turning",
        "friction that differs with the direction",
        "the force fluid",
    }
)
MASKS = {
    Lock: rapier.JointAxesMask.LOCKED_FIXED_AXES,
    Ball: rapier.JointAxesMask.LOCKED_SPHERICAL_AXES,
    Hinge: rapier.JointAxesMask.LOCKED_REVOLUTE_AXES,
    Prismatic: rapier.JointAxesMask.LOCKED_PRISMATIC_AXES,
}
KINDS = {
    "dynamic": rapier.RigidBodyType.DYNAMIC,
    "static": rapier.RigidBodyType.FIXED,
    "kinematic": rapier.RigidBodyType.KINEMATIC_VELOCITY_BASED,
}
TO_Z = (
    np.sqrt(0.5),
    np.sqrt(0.5),
    0.0,
    0.0,
)  # turns its y axis, along which cylinders and cones lie, to ours


class Rapier3D:
    """The adapter."""

    name = "rapier3d"
    capabilities = Capabilities(
        shapes=frozenset(
            {Sphere, Box, Capsule, Cylinder, ConvexHull, Plane, Compound, TriangleMesh, HeightField}
        ),
        joints=frozenset({Lock, Ball, Hinge, Prismatic}),
        forces=frozenset({CentralGravity, Load, Spring}),
        shows=frozenset({ContactForce, ContactCount, Penetration}),
        friction=True,
        joint_friction=True,
        motors=True,
        springs_aside=True,
        restitution=True,
        surface_velocity=True,
        kinematic=True,
        absent=ABSENT,
    )
    configurations = (
        Configuration(
            name="many-iterations",
            reason="100 solver iterations a step in place of 4: joints, stacks and friction are solved further",
            expected_order=1.0,
            options={"sweeps": 100, "coulomb": False},
        ),
        Configuration(
            name="defaults",
            reason="4 solver iterations: what one gets without asking",
            expected_order=1.0,
            options={"sweeps": 4, "coulomb": False},
        ),
        Configuration(
            name="coulomb",
            reason="as many-iterations, and a cone of friction at each point of contact in place of one for four "
            "(FrictionModel.COULOMB), whose forces it shows",
            expected_order=1.0,
            options={"sweeps": 100, "coulomb": True},
        ),
    )

    def build_info(self) -> BuildInfo:
        installed = version("rapier3d")
        return BuildInfo(
            self.name, installed, "", False, "", (), "wheel from the package index, float32, CPU", ""
        )

    def record(self, task: Task) -> Recording:
        began = time.perf_counter()
        run = _Run(task)
        return stepped(task, run.step, run.read, time.perf_counter() - began)


class _Run:
    """One world, and what is read off it."""

    def __init__(self, task: Task) -> None:
        self.task, self.scene = task, task.scene
        options = task.configuration.options
        rough = any(body.material.friction for body in solid(self.scene))
        if task.contacts and rough and not options["coulomb"]:
            raise NotSupported(
                f"rapier3d ({task.configuration.name}) does not support a contact force with friction: this model shows none"
            )
        self.world = rapier.PhysicsWorld(gravity=self.scene.gravity)
        self.world.set_num_threads(1)
        asked = self.world.integration_parameters
        asked.dt = task.time_step
        asked.num_solver_iterations = options["sweeps"]
        asked.normalized_max_linear_velocity = WITHOUT_BOUND
        if options["coulomb"]:
            asked.friction_model = rapier.FrictionModel.COULOMB
        self.handles = [self.world.add_body(*_body(b, self.scene.contacts)) for b in self.scene.bodies]
        self.bodies = [self.world.rigid_bodies[handle] for handle in self.handles]
        places = {body.name: handle for body, handle in zip(self.scene.bodies, self.handles, strict=True)}
        belts = {
            handle: body
            for handle, body in zip(self.handles, self.scene.bodies, strict=True)
            if isinstance(body, RigidBody) and any(body.surface_velocity)
        }
        if belts:
            self.world.physics_hooks = _Belts(belts, self.world)
        self.ground = self.world.add_body(rapier.RigidBodyBuilder(rapier.RigidBodyType.FIXED))
        for joint in self.scene.constraints:
            self._join(joint, places)
        joined = {frozenset(c.between) for c in self.scene.constraints if isinstance(c, Joint)}
        for pair in self.scene.no_contact:
            if frozenset(pair) not in joined:  # kept apart by a joint that holds nothing
                free = rapier.GenericJointBuilder(rapier.JointAxesMask.empty()).contacts_enabled(False)
                self.world.impulse_joints.insert(*(places[name] for name in pair), free.build())
        for force in self.scene.forces:
            if isinstance(force, Load):
                body = self.world.rigid_bodies[places[force.body]]
                body.add_force(force.force)  # stays until it is taken away
                body.add_torque(force.torque)
            elif isinstance(force, Spring):
                self._spring(force, places)
        fields = tuple(force for force in self.scene.forces if isinstance(force, CentralGravity))
        self.pushes = Pushes(replace(self.scene, forces=fields))

    def _join(self, joint: Any, places: Mapping[str, Any]) -> None:
        first, second = ends_of(self.scene, joint)
        made = rapier.GenericJointBuilder(MASKS[type(joint)])
        made = made.local_frame1((first.point, xyzw(first.turn))).local_frame2(
            (second.point, xyzw(second.turn))
        )
        if (driven := drive(joint, "rapier3d")) is not None:
            damping = drive_damping(self.scene, joint, self.task.time_step)
            made = _driven(made, FREE[type(joint)], damping, *driven)
        ends = [self.ground if end == WORLD else places[end] for end in joint.between]
        self.world.impulse_joints.insert(*ends, made.contacts_enabled(False).build())

    def _spring(self, spring: Spring, places: Mapping[str, Any]) -> None:
        """Its own spring joint, as stiff as it is told whatever it moves."""
        made = rapier.SpringJointBuilder(spring.rest_length, spring.stiffness, spring.viscosity)
        made = made.spring_model(rapier.MotorModel.FORCE_BASED).contacts_enabled(True)
        points = [a if isinstance(e, str) else e for e, a in zip(spring.between, spring.anchors, strict=True)]
        ends = [places[end] if isinstance(end, str) else self.ground for end in spring.between]
        self.world.impulse_joints.insert(
            *ends, made.local_anchor1(points[0]).local_anchor2(points[1]).build()
        )

    def step(self, count: int) -> None:
        for _ in range(count):
            if self.pushes:
                self._push()
            self.world.step()

    def _push(self) -> None:
        where, speeds = (
            np.array([tuple(getattr(body, name)) for body in self.bodies])
            for name in ("translation", "linvel")
        )
        for body, force in zip(self.bodies, self.pushes.at(where, speeds)[0], strict=True):
            # At once, and not through all its iterations, which would give energy.
            body.apply_impulse(tuple(self.task.time_step * force))

    def read(self, keep: Kept, row: int, sample: int) -> None:
        for k, body in enumerate(self.bodies):
            turn = body.rotation
            keep.positions[row, k] = tuple(body.translation)
            keep.orientations[row, k] = turn.w, turn.i, turn.j, turn.k
            keep.velocities[row, k] = tuple(body.linvel)
            keep.spins[row, k] = tuple(body.angvel)
            if isinstance(self.scene.bodies[k], Particle):
                keep.orientations[row, k], keep.spins[row, k] = (1.0, 0.0, 0.0, 0.0), 0.0
        if self.task.contacts and sample:
            self._read_contacts(keep, row)

    def _read_contacts(self, keep: Kept, row: int) -> None:
        names = {handle: body.name for handle, body in zip(self.handles, self.scene.bodies, strict=True)}
        for pair in self.world.narrow_phase.contact_pairs():
            first, second = (
                names[self.world.colliders[one].parent] for one in (pair.collider1, pair.collider2)
            )
            depths = [-point.dist for manifold in pair.manifolds for point in manifold.points]
            keep.contacts[row] += sum(depth >= 0.0 for depth in depths)
            keep.depths[row] = max([keep.depths[row], *depths])
            # The impulse is told on the second.
            told = np.array(tuple(pair.total_impulse()))
            if self.task.configuration.options["coulomb"]:
                told = told + sum(_rubbing(manifold) for manifold in pair.manifolds)
            keep.pair((first, second))[row] -= told / self.task.time_step


class _Belts:
    """Rapier asks it how the surfaces of a contact move along themselves, at every step."""

    def __init__(self, belts: Mapping[Any, RigidBody], world: Any) -> None:
        self.belts, self.world = belts, world

    def _flow(self, handle: Any) -> Array:
        body = self.belts.get(handle)
        if body is None:
            return np.zeros(3)
        turn = self.world.rigid_bodies[handle].rotation
        return turned(np.array([turn.w, turn.i, turn.j, turn.k]), np.array(body.surface_velocity))

    def modify_solver_contacts(self, contact: Any) -> None:
        """Of a pair with a belt: by how much the second is to go faster than the first."""
        flow = self._flow(contact.rigid_body1) - self._flow(contact.rigid_body2)
        contact.set_tangent_velocity(tuple(flow))


def _rubbing(manifold: Any) -> Array:
    """Impulse of friction on the second body: told along two tangents, which Rapier takes from the normal alone (those of
    Duff and others, "Building an orthonormal basis, revisited", of what points at the first)."""
    x, y, z = toward = -np.array(tuple(manifold.data.normal))
    sign = np.copysign(1.0, z)
    a = -1.0 / (sign + z)
    one = np.array([x * y * a, sign + y * y * a, -y])
    along, across = np.sum([point.tangent_impulse for point in manifold.points] or [(0.0, 0.0)], axis=0)
    return np.asarray(-along * one - across * np.cross(toward, one))


def _driven(made: Any, axis: Any, damping: float, speed: float, most: float | None) -> Any:
    made = made.motor_velocity(axis, speed, damping).motor_model(axis, rapier.MotorModel.FORCE_BASED)
    return made if most is None else made.motor_max_force(axis, most)


def _body(body: Particle | RigidBody, contacts: bool) -> tuple[Any, list[Any]]:
    point = isinstance(body, Particle)
    motion = "dynamic" if isinstance(body, Particle) else body.motion
    turn = (1.0, 0.0, 0.0, 0.0) if isinstance(body, Particle) else body.orientation
    made = rapier.RigidBodyBuilder(KINDS[motion]).position((body.position, xyzw(np.array(turn))))
    made = made.can_sleep(False).linear_damping(0.0).angular_damping(0.0).linvel(body.velocity)
    if isinstance(body, RigidBody):
        made = made.angvel(body.angular_velocity)
    if motion == "dynamic":
        inertia = (POINT_INERTIA,) * 3 if point else body.inertia  # type: ignore[union-attr]
        made = made.additional_mass_properties(rapier.MassProperties((0.0, 0.0, 0.0), body.mass, inertia))
    if point or body.shape is None or not contacts:  # type: ignore[union-attr]
        return made, []
    assert isinstance(body, RigidBody)
    rules = rapier.CoefficientCombineRule
    made_of = []
    for surface in _surfaces(body.shape):
        if any(body.surface_velocity):
            surface = surface.active_hooks(rapier.ActiveHooks.MODIFY_SOLVER_CONTACTS)
        rubs = (
            surface.density(0.0).friction(body.material.friction).friction_combine_rule(rules.GEOMETRIC_MEAN)
        )
        made_of.append(rubs.restitution(body.material.restitution).restitution_combine_rule(rules.MAX))
    return made, made_of


def _surfaces(shape: Shape) -> list[Any]:
    if not isinstance(shape, Compound):
        return [_shape(shape)]
    placed = []
    for part in shape.parts:
        turn = np.array(part.orientation)
        if isinstance(part.shape, Cylinder):
            turn = product(turn, np.array(TO_Z))
        placed.append(_shape(part.shape).position((part.position, xyzw(turn))))
    return placed


def _shape(shape: Shape) -> Any:
    if isinstance(shape, Sphere):
        return rapier.Collider.ball(shape.radius)
    if isinstance(shape, Box):
        return rapier.Collider.cuboid(*(0.5 * edge for edge in shape.size))
    if isinstance(shape, Capsule):
        return rapier.Collider.capsule_z(0.5 * shape.length, shape.radius)
    if isinstance(shape, Cylinder):
        made = rapier.Collider.cylinder(0.5 * shape.length, shape.radius)
        return made.position(((0.0, 0.0, 0.0), xyzw(np.array(TO_Z))))
    if isinstance(shape, ConvexHull):
        return rapier.Collider.convex_hull(np.array(shape.corners, dtype=np.float32))
    if isinstance(shape, TriangleMesh | HeightField):
        sides = np.array(shape.corners, dtype=np.float32), np.array(shape.faces, dtype=np.uint32)
        return rapier.Collider.trimesh(*sides, rapier.TriMeshFlags.FIX_INTERNAL_EDGES)
    assert isinstance(shape, Plane)
    return rapier.Collider.halfspace(shape.normal)


ENGINE = Rapier3D()
