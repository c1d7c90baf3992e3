"""PyBullet, by its Python package: Bullet in double precision, contacts and loops by sequential impulses.

Joint coordinates where the joints make a tree (a rod between particles is a hinge if all stays in a plane, else a
ball), constraints for what closes a loop, or for all. It has no loop of its own: every step is a call from Python,
and what pushes besides gravity is pushed from there. Springs, central gravity and loads act at the step's start. The sensors
in its joints tell forces wrong about a ball and in a chain that turn: those are not asked of joint coordinates.
"""

from __future__ import annotations

import time
from importlib.metadata import version
from typing import Any

import numpy as np

from ..bodies import Particle
from ..build_info import BuildInfo
from ..forces import CentralGravity, Load, Spring
from ..joints import Ball, Distance, Hinge, Lock, Prismatic
from ..observe import ConstraintForce, ContactCount, ContactForce, Penetration
from ..protocol import Capabilities, Configuration, NotSupported, Task
from ..recorded_joints import (
    conjugate,
    cross,
    joint_point,
    product,
    turned,
    turned_back,
)
from ..recording import Recording
from ..result import Array
from ..shapes import Box, Capsule, Cylinder, Plane, Sphere
from .joint_tree import (
    fixed,
    turn_of,
)
from .pybullet_file import READS, run_model
from .pybullet_model import HALF_HINGE, Model
from .stepped import Kept, quiet, stepped

with quiet():  # it says when it was built
    import pybullet as bullet


AT_REST = 1e-6  # rad/s


class PyBullet:
    """The adapter."""

    name = "pybullet"
    reads = READS
    run_model = staticmethod(run_model)
    capabilities = Capabilities(
        shapes=frozenset({Sphere, Box, Capsule, Cylinder, Plane}),
        joints=frozenset({Distance, Lock, Ball, Hinge, Prismatic}),
        forces=frozenset({CentralGravity, Load, Spring}),
        shows=frozenset({ConstraintForce, ContactForce, ContactCount, Penetration}),
        shows_force_of=frozenset({Distance, Ball, Hinge}),
        friction=True,
        rolling_friction=True,
        joint_friction=True,
        motors=True,
        springs_aside=True,
        restitution=True,
        absent=frozenset({"the force fluid"}),
    )
    configurations = (
        Configuration(
            name="joints",
            reason="joint coordinates by Featherstone's algorithm, semi-implicit Euler, no damping; 500 sweeps in "
            "place of 50 for contacts and loops, which mend 0.9 of an error in a step",
            expected_order=1.0,
            options={"joints": True},
        ),
        Configuration(
            name="constraints",
            reason="free bodies held by constraints, 500 sweeps, 0.9 of an error mended in a step: how Bullet is used "
            "where bodies are joined and parted. It has no constraint of distance",
            expected_order=1.0,
            options={"joints": False},
            lacks=("joint_friction", "motors"),
        ),
    )

    def build_info(self) -> BuildInfo:
        installed = version("pybullet")
        return BuildInfo(self.name, installed, "", False, "", (), "wheel from the package index", "")

    def record(self, task: Task) -> Recording:
        began = time.perf_counter()
        with quiet():
            client = bullet.connect(bullet.DIRECT)
            try:
                run = _Run(task, client)
                return stepped(task, run.step, run.read, time.perf_counter() - began)
            finally:
                bullet.disconnect(client)


class _Run(Model):
    """One world, and what is read off it."""

    def step(self, count: int) -> None:
        """The steps, and before each what pushes."""
        for _ in range(count):
            if self.pushes:
                self._push()
            bullet.stepSimulation(physicsClientId=self.client)

    def _push(self) -> None:
        states = [self._state(body.name) for body in self.scene.bodies]
        where = np.array([state[0] for state in states])
        turns = np.array([(state[1][3], *state[1][:3]) for state in states])
        speeds, spinning = (np.array([state[k] for state in states]) for k in (2, 3))
        forces, torques = self.pushes.at(where, speeds, turns, spinning)
        for k, body in enumerate(self.scene.bodies):
            if fixed(body):
                continue
            made, link = self.ids[body.name]
            bullet.applyExternalForce(
                made,
                link,
                forces[k].tolist(),
                where[k].tolist(),
                bullet.WORLD_FRAME,
                physicsClientId=self.client,
            )
            if torques[k].any():
                bullet.applyExternalTorque(
                    made, link, torques[k].tolist(), bullet.WORLD_FRAME, physicsClientId=self.client
                )

    def _state(self, name: str) -> tuple[Any, Any, Any, Any]:
        """Place, turn (x, y, z, w), velocity, angular velocity."""
        made, link = self.ids[name]
        if link < 0:
            return (
                *bullet.getBasePositionAndOrientation(made, physicsClientId=self.client),
                *bullet.getBaseVelocity(made, physicsClientId=self.client),
            )
        told = bullet.getLinkState(
            made, link, computeLinkVelocity=1, computeForwardKinematics=1, physicsClientId=self.client
        )
        return told[0], told[1], told[6], told[7]

    def read(self, keep: Kept, row: int, sample: int) -> None:
        for k, body in enumerate(self.scene.bodies):
            where, turn, speed, spin = self._state(body.name)
            keep.positions[row, k] = where
            keep.orientations[row, k] = turn[3], turn[0], turn[1], turn[2]
            keep.velocities[row, k] = speed
            keep.spins[row, k] = spin
            if isinstance(body, Particle):
                keep.orientations[row, k], keep.spins[row, k] = (1.0, 0.0, 0.0, 0.0), 0.0
        if self.task.constraint_forces:
            for constraint in self.scene.constraints:
                if type(constraint) in PyBullet.capabilities.shows_force_of:  # type: ignore[operator]
                    value: Any = self._force(constraint, keep, row) if sample else None
                    if value is None:
                        value = 0.0 if isinstance(constraint, Distance) else np.zeros(6)
                    keep.forces.setdefault(constraint.name, []).append(value)
        if self.task.contacts and sample:
            self._read_contacts(keep, row)

    def _force(self, constraint: Any, keep: Kept, row: int) -> Any:
        """Tension of a rod, force and torque of a joint on its second end, about its point."""
        child = self.children.get(constraint.name)
        body = self.scene.body(child or self._ends(constraint)[0])
        k = self.nodes[body.name].index
        where, moved = keep.positions[row, k], product(keep.orientations[row, k], conjugate(turn_of(body)))
        if child is not None:  # a sensor in the joint: force and torque on the child, about its centre
            told = bullet.getJointStateMultiDof(*self.ids[child], physicsClientId=self.client)[2]
            force, torque = np.array(told[:3]), np.array(told[3:])
            torque = torque + self._unsensed(constraint, child, keep, row, moved)
        else:
            force, torque = self._of_points(constraint, moved)
        if isinstance(constraint, Distance):
            other = constraint.between[0 if constraint.between[1] == child else 1]
            anchor = keep.positions[row, self.nodes[other].index] if isinstance(other, str) else other
            return float(force @ (anchor - where) / np.linalg.norm(anchor - where))
        if child is not None:
            at = turned(moved, joint_point(self.scene, constraint) - np.array(body.position))
            torque = torque - cross(at, force)
        sign = 1.0 if constraint.between[1] == body.name else -1.0
        return sign * np.concatenate([force, torque])

    def _unsensed(self, tie: Any, child: str, keep: Kept, row: int, moved: Array) -> Any:
        """The torque that a sensor leaves out: about a hinge's axis what its motor or friction gives, and one ω×Iω of the two
        it counts. Of what turns about a ball, or in a tree of several bodies, it leaves out more: that is not supported.
        """
        node, made = self.nodes[child], self.ids[child][0]
        tree = [name for name, ids in self.ids.items() if ids[0] == made and not fixed(self.nodes[name].body)]
        if len(tree) > 1 or isinstance(tie, Ball):
            if any(np.abs(self._state(name)[3]).max() > AT_REST for name in tree):
                raise NotSupported(
                    f"pybullet (joints) does not support the force of {tie.name!r}, which turns: its sensors tell it wrong "
                    "for a ball joint and in a chain"
                )
            spin = np.zeros(3)
        else:
            spin = keep.spins[row, node.index]
        if not isinstance(tie, Hinge):
            return np.zeros(3)
        given = bullet.getJointState(*self.ids[child], physicsClientId=self.client)[3]
        turn = keep.orientations[row, node.index]
        inertia = np.array(getattr(node.body, "inertia", np.zeros(3)))
        twice = cross(spin, turned(turn, inertia * turned_back(turn, spin)))
        return given * turned(moved, np.array(tie.axis)) - twice

    def _of_points(self, constraint: Any, moved: Array) -> tuple[Array, Array]:
        """Force and torque about the joint's point: what Bullet says of a point is on its second end."""
        told = [bullet.getConstraintState(k, physicsClientId=self.client) for k in self.held[constraint.name]]
        forces = -np.array(told)
        if len(forces) == 1:
            return forces[0], np.zeros(3)
        arm = HALF_HINGE * turned(moved, np.array(constraint.axis))
        return forces.sum(axis=0), cross(arm, forces[1] - forces[0])

    def _read_contacts(self, keep: Kept, row: int) -> None:
        names = {ids: name for name, ids in self.ids.items()}
        for told in bullet.getContactPoints(physicsClientId=self.client):
            first, second = names.get((told[1], told[3])), names.get((told[2], told[4]))
            if first is None or second is None:
                continue
            normal = np.array(told[7])
            force = told[9] * normal + told[10] * np.array(told[11]) + told[12] * np.array(told[13])
            keep.contacts[row] += told[8] <= 0.0 or told[9] > 0.0
            keep.depths[row] = max(keep.depths[row], -told[8])
            keep.pair((first, second))[row] += force


ENGINE = PyBullet()
