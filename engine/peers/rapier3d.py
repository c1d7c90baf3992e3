"""Rapier by its Python package: single precision, joints and contacts by sequential impulses, one thread.

Newer than the npm package behind `rapier`, with cylinders, cones and joints between bodies turned against each other.
Every step is a call from Python. Its contacts show impulses along their normals only: with friction that would be a
part of the force, so that it is asked of smooth surfaces only.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from importlib.metadata import version
from typing import Any

import numpy as np
import rapier3d as rapier

from spook_tracker.engine.bodies import WORLD, Particle, RigidBody
from spook_tracker.engine.build_info import BuildInfo
from spook_tracker.engine.forces import Load
from spook_tracker.engine.joints import Ball, Hinge, Joint, Lock, Prismatic
from spook_tracker.engine.observe import ContactCount, ContactForce, Penetration
from spook_tracker.engine.peers.frames import ends_of, xyzw
from spook_tracker.engine.peers.stepped import Kept, stepped
from spook_tracker.engine.peers.surfaces import solid
from spook_tracker.engine.protocol import Capabilities, Configuration, NotSupported, Task
from spook_tracker.engine.recording import Recording
from spook_tracker.engine.shapes import Box, Capsule, Cylinder, Plane, Shape, Sphere

POINT_INERTIA = 1e-6  # kg m²: every moving body wants one; a particle that turns is not seen to
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
        shapes=frozenset({Sphere, Box, Capsule, Cylinder, Plane}),
        joints=frozenset({Lock, Ball, Hinge, Prismatic}),
        forces=frozenset({Load}),
        shows=frozenset({ContactForce, ContactCount, Penetration}),
        friction=True,
        restitution=True,
        kinematic=True,
        absent=frozenset({"the joint distance", "the observable constraint force"}),
    )
    configurations = (
        Configuration(
            name="many-iterations",
            reason="100 solver iterations a step in place of 4: joints, stacks and friction are solved further",
            expected_order=1.0,
            options={"sweeps": 100},
        ),
        Configuration(
            name="defaults",
            reason="4 solver iterations: what one gets without asking",
            expected_order=1.0,
            options={"sweeps": 4},
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
        joined = {frozenset(c.between) for c in self.scene.constraints if isinstance(c, Joint)}
        if self.scene.contacts and any(frozenset(pair) not in joined for pair in self.scene.no_contact):
            raise NotSupported("our adapter cannot ask rapier3d for single pairs that must not touch")
        if task.contacts and any(body.material.friction for body in solid(self.scene)):
            raise NotSupported("our adapter cannot ask rapier3d for a contact force with friction")
        self.world = rapier.PhysicsWorld(gravity=self.scene.gravity)
        self.world.set_num_threads(1)
        asked = self.world.integration_parameters
        asked.dt = task.time_step
        asked.num_solver_iterations = task.configuration.options["sweeps"]
        self.handles = [self.world.add_body(*_body(b, self.scene.contacts)) for b in self.scene.bodies]
        self.bodies = [self.world.rigid_bodies[handle] for handle in self.handles]
        places = {body.name: handle for body, handle in zip(self.scene.bodies, self.handles, strict=True)}
        self.ground = self.world.add_body(rapier.RigidBodyBuilder(rapier.RigidBodyType.FIXED))
        for joint in self.scene.constraints:
            self._join(joint, places)
        for load in self.scene.forces:
            assert isinstance(load, Load)
            body = self.world.rigid_bodies[places[load.body]]
            body.add_force(load.force)  # stays until it is taken away
            body.add_torque(load.torque)

    def _join(self, joint: Any, places: Mapping[str, Any]) -> None:
        first, second = ends_of(self.scene, joint)
        made = rapier.GenericJointBuilder(MASKS[type(joint)])
        made = made.local_frame1((first.point, xyzw(first.turn))).local_frame2(
            (second.point, xyzw(second.turn))
        )
        ends = [self.ground if end == WORLD else places[end] for end in joint.between]
        self.world.impulse_joints.insert(*ends, made.contacts_enabled(False).build())

    def step(self, count: int) -> None:
        for _ in range(count):
            self.world.step()

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
            keep.pair((first, second))[row] -= np.array(tuple(pair.total_impulse())) / self.task.time_step


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
    surface = _shape(body.shape).density(0.0)
    surface = surface.friction(body.material.friction).friction_combine_rule(rules.GEOMETRIC_MEAN)
    return made, [surface.restitution(body.material.restitution).restitution_combine_rule(rules.MAX)]


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
    assert isinstance(shape, Plane)
    return rapier.Collider.halfspace(shape.normal)


ENGINE = Rapier3D()
