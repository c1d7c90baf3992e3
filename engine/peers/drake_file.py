"""A user's own model in Drake: URDF, SDF and MJCF by Drake's own parser, in discrete steps as its users take them.

Nothing drives it: actuators get no torque. The first link of a URDF is welded to the world, as other loaders do.
Gravity is the file's, which Drake's parser leaves out.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from ..errors import EngineError
from ..model_file import ModelRun, Watched
from ..protocol import NotSupported
from ..result import Result
from .model_loop import (
    Array,
    LoadedModel,
    elsewhere,
    packages,
    refuse_settings,
    resident,
    said,
)
from .stepped import quiet

READS = ("URDF", "SDF", "MJCF")


def run_model(run: ModelRun, time_step: float, duration: float, time_limit: float | None) -> Result:
    """Load the file into a plant of its own, and run it."""
    refuse_settings("drake", run)
    if run.elsewhere:
        return elsewhere(__name__, run, time_step, duration, time_limit)
    before, began = resident(), time.perf_counter()
    path = Path(run.model.path)
    with quiet():  # it writes what it raises, too
        try:
            simulation = _Simulation(run, time_step, time_limit)
        except (RuntimeError, ValueError, SystemExit) as error:  # the last where Drake asserts
            if isinstance(error, EngineError):
                raise
            raise NotSupported(f"drake refuses {path.name}: {said(error, path)}") from None
    load = time.perf_counter() - began
    simulation.megabytes = resident() - before
    return simulation.result(duration, load)


class _Simulation(LoadedModel):
    """One plant in its simulator."""

    megabytes = 0.0  # that the process took more

    def __init__(self, run: ModelRun, time_step: float, time_limit: float | None) -> None:
        super().__init__(run, time_step, time_limit)
        builder = DiagramBuilder()
        self.plant, self.graph = AddMultibodyPlantSceneGraph(builder, time_step)
        self._parse(run)
        self.plant.mutable_gravity_field().set_gravity_vector(run.model.gravity)
        self.plant.Finalize()
        self.diagram = builder.Build()
        self.simulator = Simulator(self.diagram)
        self.context = self.plant.GetMyMutableContextFromRoot(self.simulator.get_mutable_context())
        still = {body.index() for body in self.plant.GetBodiesWeldedTo(self.plant.world_body())}
        every = (self.plant.get_body(BodyIndex(k)) for k in range(self.plant.num_bodies()))
        self.moving = [body for body in every if body.index() not in still]
        if not self.moving:
            raise NotSupported(f"nothing in {Path(run.model.path).name} moves in drake")
        self.watched = [self._found(one) for one in run.model.watched]
        self.freedom = self.plant.num_velocities()
        self.size = self._size()
        self.taken = 0

    def _parse(self, run: ModelRun) -> None:
        path = Path(run.model.path)
        parser = Parser(self.plant, self.graph)
        for name, folder in packages(run).items():
            parser.package_map().Add(name, folder)
        made = parser.AddModels(str(path))
        if run.model.format != "URDF":
            return
        for model in made:
            first = self.plant.get_body(self.plant.GetBodyIndices(model)[0])
            world = self.plant.world_frame()
            if not any(
                joint.child_body().index() == first.index()
                for joint in map(self.plant.get_joint, self.plant.GetJointIndices(model))
            ):
                self.plant.WeldFrames(world, first.body_frame())

    def _found(self, watched: Watched) -> Any:
        model, scoped, name = watched.name.rpartition("::")
        if scoped and self.plant.HasModelInstanceNamed(model):
            instance = self.plant.GetModelInstanceByName(model)
            if self.plant.HasBodyNamed(name, instance):
                return self.plant.GetBodyByName(name, instance)
        elif not watched.path and self.plant.HasBodyNamed(watched.name):
            return self.plant.GetBodyByName(watched.name)
        raise NotSupported(f"drake finds no body {watched.label!r} in {Path(self.run.model.path).name}")

    def _size(self) -> float:
        """Twice how far what moves reaches from its middle: its boxes, or where it has no geometry its centres [m]."""
        inspector = self.graph.model_inspector()
        points = []
        for body in self.moving:
            pose = self.plant.EvalBodyPoseInWorld(self.context, body)
            points.append(pose @ body.CalcCenterOfMassInBodyFrame(self.context))
            for geometry in self.plant.GetCollisionGeometriesForBody(body):
                if (box := inspector.GetObbInGeometryFrame(geometry)) is not None:
                    place = pose @ inspector.GetPoseInFrame(geometry) @ box.pose()
                    points += [
                        place @ (sign * np.diag(box.half_width())[k]) for k in range(3) for sign in (-1, 1)
                    ]
        spread = np.array(points) - np.mean(points, axis=0)
        return 2.0 * float(np.linalg.norm(spread, axis=1).max()) or 1.0

    def take(self, count: int) -> None:
        self.taken += count
        try:
            self.simulator.AdvanceTo(self.taken * self.step)
        except (RuntimeError, SystemExit) as error:
            self.broken = " ".join(str(error).split())[:200]

    broken = ""

    def push(self, change: Array) -> None:
        self.plant.SetVelocities(self.context, self.plant.GetVelocities(self.context) + change)

    def control(self) -> None:
        """None are supported."""

    def read(self) -> None:
        """Everything is evaluated where it is asked for."""

    def trouble(self) -> str:
        return self.broken or ("" if np.isfinite(self.state()).all() else "a place is not finite")

    def poses(self) -> tuple[Array, Array]:
        read = [self.plant.EvalBodyPoseInWorld(self.context, body) for body in self.watched]
        turns = [pose.rotation().ToQuaternion().wxyz() for pose in read]
        return np.array([pose.translation() for pose in read]), np.array(turns)

    def speeds(self) -> tuple[Array, Array]:
        moved, turned = [], []
        for body in self.moving:
            of_frame = self.plant.EvalBodySpatialVelocityInWorld(self.context, body)
            arm = self.plant.EvalBodyPoseInWorld(self.context, body).rotation() @ (
                body.CalcCenterOfMassInBodyFrame(self.context)
            )
            moved.append(np.linalg.norm(of_frame.translational() + np.cross(of_frame.rotational(), arm)))
            turned.append(np.linalg.norm(of_frame.rotational()))
        return np.array(moved), np.array(turned)

    def state(self) -> Array:
        found: Array = self.plant.GetPositionsAndVelocities(self.context)
        return found

    def at_sample(self) -> dict[str, Any]:
        return {"violation": 0.0}  # joint coordinates: limits, which it holds softly, are not read

    def at_end(self) -> dict[str, Any]:
        told = self.plant.get_contact_results_output_port().Eval(self.context)
        gravity, moving = np.array(self.run.model.gravity), {body.index() for body in self.moving}
        deepest = carried = 0.0
        for k in range(told.num_point_pair_contacts()):
            contact = told.point_pair_contact_info(k)
            deepest = max(deepest, contact.point_pair().depth)
            if (contact.bodyA_index() in moving) != (contact.bodyB_index() in moving):
                held = float(contact.contact_force() @ gravity)  # on the second body
                carried += -held if contact.bodyB_index() in moving else held
        mass = sum(body.get_mass(self.context) for body in self.moving)
        weight = float(gravity @ gravity) * mass
        found = {"overlap": np.array(deepest), "load": np.array(carried / weight if weight else 0.0)}
        return found | ({"megabytes": np.array(self.megabytes)} if self.run.timed else {})
