"""Simbody, by OpenSim's Python package: joint coordinates, constraints and compliant contact in continuous time.

The motion between two samples is one call of OpenSim's manager. Balls touch balls and planes by Hunt and Crossley's force,
the corners of boxes touch planes by exponential springs; boxes touch nothing else. OpenSim turns free bodies and ball joints
by angles of Euler, where Simbody has quaternions, too.
"""

from __future__ import annotations

import time
from importlib.metadata import version

import numpy as np

from ..bodies import Particle
from ..build_info import BuildInfo
from ..forces import CentralGravity, Load, Spring
from ..joints import Ball, Distance, Hinge, Lock, Prismatic, Universal
from ..observe import ConstraintForce, ContactForce
from ..protocol import Capabilities, Configuration, NotSupported, Task
from ..recording import Recording
from ..result import Array
from ..shapes import Box, Plane, Sphere
from .joint_tree import fixed, hung_at
from .simbody_model import Model, array
from .stepped import Kept, quiet, stepped


class Simbody:
    """The adapter."""

    name = "simbody"
    capabilities = Capabilities(
        shapes=frozenset({Sphere, Box, Plane}),
        joints=frozenset({Distance, Lock, Ball, Hinge, Prismatic, Universal}),
        forces=frozenset({CentralGravity, Load, Spring}),
        shows=frozenset({ConstraintForce, ContactForce}),
        shows_force_of=frozenset({Distance, Ball, Hinge, Lock}),
        friction=True,
        springs_aside=True,
        # What it gives back depends on the speed.
        absent=frozenset(
            {
                "restitution",
                "the force fluid",
                "friction of rolling or turning",
                "friction that differs with the direction",
            }
        ),
    )
    configurations = (
        Configuration(
            name="merson",
            reason="joint coordinates; the manager's own integrator, Runge-Kutta-Merson, which chooses its steps: to 1e-6 a "
            "step, and none longer than the time step; Simbody's integrators hold an error unless told",
            options={"method": "RungeKuttaMerson", "accuracy": 1e-6},
        ),
        Configuration(
            name="held-step",
            reason="the same with its steps held: for smooth motion, and for the order. Contacts are stiff springs",
            expected_order=4.0,
            options={"method": "RungeKuttaMerson", "accuracy": None},
            lacks=("shapes", "friction"),
        ),
        Configuration(
            name="defaults",
            reason="the same integrator to 1e-3 a step, which Simbody asks for unless told",
            options={"method": "RungeKuttaMerson", "accuracy": 1e-3},
        ),
        Configuration(
            name="cpodes",
            reason="implicit multistep by CPODES to 1e-6, none longer than the time step: for stiff springs, as balls touch by",
            options={"method": "CPodes", "accuracy": 1e-6},
        ),
    )

    def build_info(self) -> BuildInfo:
        made = "inside OpenSim, wheel from the package index"
        return BuildInfo(self.name, version("opensim"), "", False, "", (), made, "")

    def record(self, task: Task) -> Recording:
        with quiet():
            began = time.perf_counter()
            run = _Run(task)
            return stepped(task, run.step, run.read, time.perf_counter() - began)


class _Run(Model):
    """One model with its state, and what is read off it."""

    def step(self, count: int) -> None:
        """On to the end of `count` more steps."""
        if self.refused is not None:
            raise self.refused
        self.done += count
        self.state = self.manager.integrate(self.done * self.task.time_step)

    def read(self, keep: Kept, row: int, sample: int) -> None:
        self.model.realizeAcceleration(self.state)
        for k, body in enumerate(self.scene.bodies):
            keep.orientations[row, k] = 1.0, 0.0, 0.0, 0.0
            if fixed(body):
                keep.positions[row, k] = body.position
                keep.orientations[row, k] = body.orientation  # type: ignore[union-attr]
                continue
            made = self.bodies[body.name]
            keep.positions[row, k] = array(made.getPositionInGround(self.state))
            keep.velocities[row, k] = array(made.getLinearVelocityInGround(self.state))
            if isinstance(body, Particle):
                continue
            turn = made.getTransformInGround(self.state).R().convertRotationToQuaternion()
            keep.orientations[row, k] = [turn.get(axis) for axis in range(4)]
            keep.spins[row, k] = array(made.getAngularVelocityInGround(self.state))
        if self.task.constraint_forces:
            self._read_joints(keep, sample)
        if self.task.contacts and sample:
            self._read_contacts(keep, row)

    def _read_joints(self, keep: Kept, sample: int) -> None:
        held = {node.tie.name: node for node in self.nodes.values() if node.tie is not None}
        for constraint in self.scene.constraints:
            if type(constraint) not in (Simbody.capabilities.shows_force_of or ()):
                continue
            if constraint.name not in held:
                raise NotSupported(
                    "our adapter shows Simbody's forces of joints alone, not of what closes a loop"
                )
            node = held[constraint.name]
            told = self.joints[node.body.name].calcReactionOnChildExpressedInGround(self.state)
            torque, force = array(told.get(0)), array(told.get(1))
            if isinstance(constraint, Distance):
                keep.forces.setdefault(constraint.name, []).append(self._pull(node.body.name, force, sample))
                continue
            sign = 1.0 if constraint.between[1] == node.body.name else -1.0
            value = sign * np.concatenate([force, torque]) * bool(sample)
            keep.forces.setdefault(constraint.name, []).append(value)

    def _pull(self, name: str, force: Array, sample: int) -> float:
        """Along the rod, from the particle on."""
        node = self.nodes[name]
        above = self.nodes.get(str(node.parent))
        at = hung_at(self.scene, node)
        if above is not None and not fixed(above.body):
            at = array(self.bodies[above.body.name].getPositionInGround(self.state))
        rod = at - array(self.bodies[name].getPositionInGround(self.state))
        return float(force @ rod / np.linalg.norm(rod)) if sample else 0.0

    def _read_contacts(self, keep: Kept, row: int) -> None:
        for pair, force in self.balls:
            told = force.getRecordValues(self.state)
            keep.pair(pair)[row] += [told.get(axis) for axis in range(3)]
        for pair, corner in self.corners:
            keep.pair(pair)[row] += array(corner.getForce(self.state, True))


ENGINE = Simbody()
