"""Exudyn, by its Python package: redundant coordinates, joints as constraints, solved in its own loop.

The whole motion is one call of its solver; positions, rotations and velocities come from its own sensors.
"""

from __future__ import annotations

import math
import re
import time
import warnings
from importlib.metadata import version
from typing import Any

import exudyn
import numpy as np
from exudyn.rigidBodyUtilities import RigidBodyInertia

from ..bodies import WORLD, Particle, RigidBody
from ..build_info import BuildInfo
from ..forces import Load, Spring
from ..joints import Ball, Distance, Hinge, Lock, Prismatic
from ..observe import ConstraintForce
from ..protocol import Capabilities, Configuration, NotSupported, Task
from ..recorded_joints import joint_point, turned
from ..recording import Recording
from ..result import Array

exudyn.config.printToConsole = False  # it tells of every solve that fails, by the screenful
exudyn.config.suppressWarnings = True
SOLVERS = exudyn.DynamicSolverType
SEEN = exudyn.OutputVariableType
CALLER = re.compile(r"\[Python file [^\]]*\]")  # where this file is on the machine: no part of the reason


class Exudyn:
    """The adapter."""

    name = "exudyn"
    capabilities = Capabilities(
        joints=frozenset({Distance, Lock, Ball, Hinge, Prismatic}),
        forces=frozenset({Load, Spring}),
        springs_aside=True,
        shows=frozenset({ConstraintForce}),
        shows_force_of=frozenset({Distance}),
    )
    configurations = (
        Configuration(
            name="trapezoidal",
            reason="implicit trapezoidal rule with constraints on velocity level: no numerical damping",
            expected_order=2.0,
            options={"solver": SOLVERS.TrapezoidalIndex2},
        ),
        Configuration(
            name="generalised-alpha",
            reason="generalised-alpha, spectral radius 0.9, constraints on position level: what its makers advise "
            "for joints, lengths kept to the solver's tolerance",
            expected_order=2.0,
            options={"solver": SOLVERS.GeneralizedAlpha},
        ),
    )

    def build_info(self) -> BuildInfo:
        installed = version("exudyn")
        return BuildInfo(self.name, installed, "", False, "", (), "wheel from the package index", "")

    def record(self, task: Task) -> Recording:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return _Run(task).recording()


class _Run:
    def __init__(self, task: Task) -> None:
        began = time.perf_counter()
        self.task, self.system = task, exudyn.SystemContainer().AddSystem()
        self.ground = self.system.CreateGround()
        self.items = {body.name: self._body(body) for body in task.scene.bodies}
        self.tensions: dict[str, Any] = {}
        for constraint in task.scene.constraints:
            self._constraint(constraint)
        for force in task.scene.forces:
            if isinstance(force, Spring):
                self._spring(force)
                continue
            assert isinstance(force, Load)
            item = self.items[force.body]
            self.system.CreateForce(bodyNumber=item, loadVector=list(force.force))
            if any(force.torque):
                self.system.CreateTorque(bodyNumber=item, loadVector=list(force.torque))
        self.sensors = {
            name: [self._sensor(item, kind) for kind in _kinds(task.scene.body(name))]
            for name, item in self.items.items()
            if item != self.ground
        }
        self.system.Assemble()
        self.setup = time.perf_counter() - began

    def _body(self, body: Particle | RigidBody) -> Any:
        gravity = list(self.task.scene.gravity)
        if isinstance(body, Particle):
            return self.system.CreateMassPoint(
                referencePosition=list(body.position),
                initialVelocity=list(body.velocity),
                mass=body.mass,
                gravity=gravity,
            )
        if body.motion != "dynamic":
            return self.ground
        assert body.inertia is not None
        inertia: Any = RigidBodyInertia  # without types
        return self.system.CreateRigidBody(
            inertia=inertia(mass=body.mass, com=[0, 0, 0], inertiaTensor=np.diag(np.array(body.inertia))),
            referencePosition=list(body.position),
            referenceRotationMatrix=_matrix(np.array(body.orientation)),
            initialVelocity=list(body.velocity),
            initialAngularVelocity=list(body.angular_velocity),
            gravity=gravity,
        )

    def _ends(self, held: Distance | Spring) -> tuple[list[Any], list[list[float]]]:
        """Both items, and the points on them."""
        items: list[Any] = []
        points: list[list[float]] = []
        for end, anchor in zip(held.between, held.anchors, strict=True):
            fixed = not isinstance(end, str) or self.items[end] == self.ground
            items.append(self.ground if fixed else self.items[str(end)])
            points.append(list(self.task.scene.anchor(held, len(points))) if fixed else list(anchor))
        return items, points

    def _spring(self, spring: Spring) -> None:
        items, points = self._ends(spring)
        place = {"itemNumbers": items, "localPosition0": points[0], "localPosition1": points[1]}
        if spring.rest_length > 0.0:
            self.system.CreateSpringDamper(
                referenceLength=spring.rest_length,
                stiffness=spring.stiffness,
                damping=spring.viscosity,
                **place,
            )
            return
        if spring.viscosity:
            raise NotSupported(
                f"exudyn does not support viscosity along {spring.name!r}, which has no rest length"
            )
        self.system.CreateCartesianSpringDamper(stiffness=[spring.stiffness] * 3, damping=[0.0] * 3, **place)

    def _constraint(self, constraint: Any) -> None:
        scene = self.task.scene
        if isinstance(constraint, Distance):
            items, points = self._ends(constraint)
            length = scene.length(constraint) if constraint.rest_length is None else constraint.rest_length
            made = self.system.CreateDistanceConstraint(
                itemNumbers=items, localPosition0=points[0], localPosition1=points[1], distance=length
            )
            if self.task.constraint_forces:
                self.tensions[constraint.name] = self.system.AddSensor(
                    {
                        "sensorType": "Object",
                        "objectNumber": made,
                        "storeInternal": True,
                        "outputVariableType": SEEN.Force,
                    }
                )
            return
        ends = [self.ground if end == WORLD else self.items[end] for end in constraint.between]
        place = {
            "itemNumbers": ends,
            "position": list(joint_point(scene, constraint)),
            "useGlobalFrame": True,
        }
        if isinstance(constraint, Ball):
            self.system.CreateSphericalJoint(**place)
        elif isinstance(constraint, Hinge):
            self.system.CreateRevoluteJoint(axis=list(constraint.axis), **place)
        elif isinstance(constraint, Prismatic):
            self.system.CreatePrismaticJoint(axis=list(constraint.axis), **place)
        else:
            self.system.CreateGenericJoint(constrainedAxes=[1] * 6, **place)

    def _sensor(self, item: Any, kind: Any) -> Any:
        return self.system.AddSensor(
            {"sensorType": "Body", "bodyNumber": item, "storeInternal": True, "outputVariableType": kind}
        )

    def recording(self) -> Recording:
        task = self.task
        settings = exudyn.SimulationSettings()
        settings.timeIntegration.numberOfSteps = max(task.steps, 1)
        settings.timeIntegration.endTime = max(task.steps, 1) * task.time_step
        settings.timeIntegration.verboseMode = 0
        settings.timeIntegration.generalizedAlpha.spectralRadius = 0.9
        settings.solution.file.write = False
        every = task.time_step if task.every_step else max(task.steps, 1) * task.time_step
        settings.solution.sensors.writePeriod = every
        if len(task.scene.bodies) > 20:
            settings.linearSolver.solverType = exudyn.LinearSolverType.EigenSparse
        worked, began = time.process_time(), time.perf_counter()
        end = math.inf if task.time_limit is None else worked + task.time_limit
        self.system.SetPreStepUserFunction(lambda system, t: time.process_time() < end)
        try:
            solved = self.system.SolveDynamic(
                settings, solverType=task.configuration.options["solver"], showHints=False
            )
            failure = "" if solved else "its solver did not converge"
        except Exception as error:  # what the solver could not do is an outcome
            failure = " ".join(CALLER.sub("", str(error)).split())[:200]
        self.seconds, self.cpu_seconds = time.perf_counter() - began, time.process_time() - worked
        if late := time.process_time() >= end:
            failure = f"the time limit of {task.time_limit:g} s was reached"
        return self._read(failure, "timed_out" if late else "diverged")

    def _read(self, failure: str, bad: Any) -> Recording:
        task, bodies = self.task, self.task.scene.bodies
        stored = {name: [self._stored(s) for s in sensors] for name, sensors in self.sensors.items()}
        count = min((len(rows) for series in stored.values() for rows in series), default=1)
        steps = np.arange(count) if task.every_step else np.array([0, task.steps])[:count]
        turns = np.tile([1.0, 0.0, 0.0, 0.0], (count, len(bodies), 1))
        where, speeds, spins = (np.zeros((count, len(bodies), 3)) for _ in range(3))
        for k, body in enumerate(bodies):
            where[:, k] = body.position
            if isinstance(body, RigidBody):
                turns[:, k] = body.orientation
            if body.name in stored:
                series = [rows[:count] for rows in stored[body.name]]
                where[:, k], speeds[:, k] = series[0], series[1]
                if isinstance(body, RigidBody):
                    turns[:, k], spins[:, k] = _quaternions(series[2]), series[3]
        tensions = {name: self._stored(sensor)[:count, 0] for name, sensor in self.tensions.items()}
        return Recording(
            samples=steps.astype(np.int64),
            positions=where,
            orientations=turns,
            velocities=speeds,
            angular_velocities=spins,
            steps=int(steps[-1]),
            seconds=self.seconds,
            cpu_seconds=self.cpu_seconds,
            setup_seconds=self.setup,
            constraint_forces=tensions,
            status=bad if failure else "completed",
            failure=failure,
        )

    def _stored(self, sensor: Any) -> Array:
        """Samples of a sensor without their times."""
        return np.asarray(self.system.GetSensorStoredData(sensor))[:, 1:]


def _kinds(body: Particle | RigidBody) -> tuple[Any, ...]:
    turning = () if isinstance(body, Particle) else (SEEN.RotationMatrix, SEEN.AngularVelocity)
    return (SEEN.Position, SEEN.Velocity, *turning)


def _matrix(q: Array) -> Array:
    """Rotation matrix of a unit quaternion."""
    return np.stack([turned(q, axis) for axis in np.eye(3)], axis=1)


def _quaternions(rows: Array) -> Array:
    """Unit quaternions (s, 4) of rotation matrices (s, 9): the largest of four ways, so that none cancels."""
    m = rows.reshape(-1, 3, 3)
    x, y, z = m[:, 0, 0], m[:, 1, 1], m[:, 2, 2]
    a, b, c = m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]
    d, e, f = m[:, 0, 1] + m[:, 1, 0], m[:, 0, 2] + m[:, 2, 0], m[:, 1, 2] + m[:, 2, 1]
    ways = np.stack(
        [
            np.stack([1 + x + y + z, a, b, c], axis=1),
            np.stack([a, 1 + x - y - z, d, e], axis=1),
            np.stack([b, d, 1 - x + y - z, f], axis=1),
            np.stack([c, e, f, 1 - x - y + z], axis=1),
        ],
        axis=1,
    )
    best = np.argmax(np.abs(ways[:, range(4), range(4)]), axis=1)
    chosen = ways[np.arange(len(m)), best]
    return np.asarray(chosen / np.linalg.norm(chosen, axis=1, keepdims=True))


ENGINE = Exudyn()
