"""Drake, by its Python package: joint coordinates, and its convex solver (SAP) for contacts and what closes loops.

The motion between two samples is one call of its simulator. A rod between particles is a hinge if all stays in a
plane, else a universal joint. Boxes and planes touch over surfaces (hydroelastic contact), spheres and capsules in
points: a box that touches in points has one of them in Drake. Contacts are found once a step, where the bodies were:
at 1/60 s a box that slides is off the ground at every other step. Central gravity is an expression it compiles.
"""

from __future__ import annotations

import logging
import time
from importlib.metadata import version
from typing import Any

import numpy as np

from ..bodies import Particle
from ..build_info import BuildInfo
from ..forces import CentralGravity, Load, Spring
from ..joints import Ball, Distance, Hinge, Lock, Prismatic, Universal
from ..observe import ConstraintForce, ContactForce
from ..protocol import Capabilities, Configuration, NotSupported, Task
from ..recording import Recording
from ..shapes import Box, Capsule, Plane, Sphere
from .drake_file import READS, run_model
from .drake_model import Model
from .stepped import Kept, stepped

logging.getLogger("drake").setLevel(
    logging.ERROR
)  # it warns of contact of soft bodies, which is never asked for


class Drake:
    """The adapter."""

    name = "drake"
    reads = READS
    run_model = staticmethod(run_model)
    capabilities = Capabilities(
        shapes=frozenset({Sphere, Box, Capsule, Plane}),
        joints=frozenset({Distance, Lock, Ball, Hinge, Prismatic, Universal}),
        forces=frozenset({CentralGravity, Load, Spring}),
        shows=frozenset({ConstraintForce, ContactForce}),
        shows_force_of=frozenset({Distance, Ball, Hinge, Lock}),
        friction=True,
        springs_aside=True,
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
            name="sap",
            reason="joint coordinates, discrete steps, contacts and loops by the convex solver its makers advise; "
            "hydroelastic contact where surfaces are flat",
            expected_order=1.0,
            options={"joints": True, "discrete": True},
        ),
        Configuration(
            name="rk3",
            reason="joint coordinates in continuous time, Runge-Kutta of order 3 with its step held: for smooth "
            "motion; its contacts would be springs and its loops are not held at all",
            expected_order=3.0,
            options={"joints": True, "discrete": False},
            lacks=("shapes", "friction", "loops"),
        ),
        Configuration(
            name="constraints",
            reason="free bodies held by constraints of the convex solver, as an engine of constraints has them",
            expected_order=1.0,
            options={"joints": False, "discrete": True},
        ),
    )

    def build_info(self) -> BuildInfo:
        installed = version("drake")
        return BuildInfo(self.name, installed, "", False, "", (), "wheel from the package index", "")

    def record(self, task: Task) -> Recording:
        began = time.perf_counter()
        run = _Run(task)
        return stepped(task, run.step, run.read, time.perf_counter() - began)


class _Run(Model):
    """One plant, and what is read off it."""

    def step(self, count: int) -> None:
        """On to the end of `count` more steps."""
        self.done += count
        self.simulator.AdvanceTo(self.done * self.task.time_step)

    def read(self, keep: Kept, row: int, sample: int) -> None:
        for k, body in enumerate(self.scene.bodies):
            made = self.bodies[body.name]
            pose = self.plant.EvalBodyPoseInWorld(self.context, made)
            moved = self.plant.EvalBodySpatialVelocityInWorld(self.context, made)
            keep.positions[row, k] = pose.translation()
            keep.velocities[row, k] = moved.translational()
            if isinstance(body, Particle):
                keep.orientations[row, k] = 1.0, 0.0, 0.0, 0.0
                continue
            keep.orientations[row, k] = pose.rotation().ToQuaternion().wxyz()
            keep.spins[row, k] = moved.rotational()
        if self.task.constraint_forces:
            self._read_joints(keep, sample)
        if self.task.contacts and sample:
            self._read_contacts(keep, row)

    def _read_joints(self, keep: Kept, sample: int) -> None:
        told = self.plant.get_reaction_forces_output_port().Eval(self.context) if sample else None
        held = {node.tie.name: name for name, node in self.nodes.items() if node.tie is not None}
        for constraint in self.scene.constraints:
            if type(constraint) not in (Drake.capabilities.shows_force_of or ()):
                continue
            if constraint.name not in held:
                raise NotSupported("drake does not show the force of a constraint, only those of joints")
            child = held[constraint.name]
            value: Any = 0.0 if isinstance(constraint, Distance) else np.zeros(6)
            if told is not None:
                joint = self.joints[child]
                frame = joint.frame_on_child().CalcPoseInWorld(self.context)
                turn = frame.rotation().matrix()
                shown = told[self.order[joint.index()]]
                force, torque = turn @ shown.translational(), turn @ shown.rotational()
                if isinstance(constraint, Distance):
                    place = self.plant.EvalBodyPoseInWorld(self.context, self.bodies[child]).translation()
                    rod = frame.translation() - place
                    value = float(force @ rod / np.linalg.norm(rod))
                else:
                    sign = 1.0 if constraint.between[1] == child else -1.0
                    value = sign * np.concatenate([force, torque])
            keep.forces.setdefault(constraint.name, []).append(value)

    def _read_contacts(self, keep: Kept, row: int) -> None:
        told = self.plant.get_contact_results_output_port().Eval(self.context)
        names = {made.index(): name for name, made in self.bodies.items()}
        owners = {geometry: name for name, geometry in self.geometries.items()}
        for k in range(told.num_point_pair_contacts()):
            contact = told.point_pair_contact_info(k)
            pair = names[contact.bodyA_index()], names[contact.bodyB_index()]
            keep.pair(pair)[row] -= contact.contact_force()
        for k in range(told.num_hydroelastic_contacts()):
            surface = told.hydroelastic_contact_info(k)
            ids = surface.contact_surface().id_M(), surface.contact_surface().id_N()
            keep.pair((owners[ids[0]], owners[ids[1]]))[row] += surface.F_Ac_W().translational()


ENGINE = Drake()
