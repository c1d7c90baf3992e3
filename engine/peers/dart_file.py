"""A user's own model in DART: URDF, SDF and MJCF by DART's own parsers.

Nothing drives it. The first link of a URDF is fixed to the world, as other loaders do. Gravity and the time step are
the file's, which DART's parsers do not all read; its joint limits are enforced and its links touch each other, which
DART leaves out unless told.
"""

from __future__ import annotations

import re
import time
from pathlib import Path
from typing import Any

import dartpy as dart
import numpy as np

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
from .stepped import overheard, quiet

READS = ("URDF", "SDF", "MJCF")
NOTE = re.compile(  # colours, the kind and line before each of what it writes, and its own functions
    r"\x1b\[[0-9;]*m|(Warning|Error) \[[\w.]+:\d+\]|^Error:|at line \d+ in \S+|\[\w+(::\w+)*\]", re.MULTILINE
)


def run_model(run: ModelRun, time_step: float, duration: float, time_limit: float | None) -> Result:
    """Load the file in a world of its own, and run it."""
    refuse_settings("dart", run)
    if run.elsewhere:
        return elsewhere(__name__, run, time_step, duration, time_limit)
    before, began = resident(), time.perf_counter()
    world = _loaded(run)
    simulation = _Simulation(run, world, time_step, time_limit)
    load = time.perf_counter() - began
    simulation.megabytes = resident() - before
    with quiet():  # it warns of numbers that are not finite, which the run tells
        return simulation.result(duration, load)


def _loaded(run: ModelRun) -> Any:
    path = Path(run.model.path).absolute()  # it finds no other
    with overheard() as heard:
        world = _read(run, path)
        if world is None or not world.getNumSkeletons():
            lines = NOTE.sub(" ", heard().replace("file://", "")).split("\n")
            notes = " ".join(dict.fromkeys(line.strip() for line in lines)).strip()
            raise NotSupported(f"dart finds no model in {path.name}{': ' * bool(notes)}{said(notes, path)}")
    return world


def _read(run: ModelRun, path: Path) -> Any:
    if run.model.format == "MJCF" and "<freejoint" in path.read_text(encoding="utf-8", errors="replace"):
        raise NotSupported(
            f'dart welds what hangs by a <freejoint> of {path.name}; it reads <joint type="free">'
        )
    try:
        if run.model.format == "URDF":
            loader = dart.utils.DartLoader()
            fixed = dart.utils.DartLoaderRootJointType.FIXED
            loader.setOptions(dart.utils.DartLoaderOptions(defaultRootJointType=fixed))
            for name, folder in packages(run).items():
                loader.addPackageDirectory(name, folder)
            skeleton = loader.parseSkeleton(str(path))
            world = dart.simulation.World()
            if skeleton is not None:
                world.addSkeleton(skeleton)
        else:
            parser = dart.utils.SdfParser if run.model.format == "SDF" else dart.utils.MjcfParser
            world = parser.readWorld(str(path))
            if world is None and run.model.format == "SDF":  # a model without a world around it
                skeleton = parser.readSkeleton(str(path))
                world = dart.simulation.World()
                if skeleton is not None:
                    world.addSkeleton(skeleton)
    except (RuntimeError, ValueError, TypeError) as error:
        raise NotSupported(f"dart refuses {path.name}: {said(error, path)}") from None
    return world


class _Simulation(LoadedModel):
    """A world with all skeletons of the file."""

    megabytes = 0.0  # that the process took more

    def __init__(self, run: ModelRun, world: Any, time_step: float, time_limit: float | None) -> None:
        super().__init__(run, time_step, time_limit)
        self.world = world
        world.setTimeStep(time_step)
        world.setGravity(run.model.gravity)
        awake = dart.simulation.DeactivationOptions()
        awake.mEnabled = False
        world.setDeactivationOptions(awake)
        self.skeletons = [world.getSkeleton(k) for k in range(world.getNumSkeletons())]
        for skeleton in self.skeletons:
            skeleton.enableSelfCollisionCheck()
            for joint in (skeleton.getJoint(k) for k in range(skeleton.getNumJoints())):
                joint.setLimitEnforcement(True)
        bodies = [s.getBodyNode(k) for s in self.skeletons for k in range(s.getNumBodyNodes())]
        self.moving = [
            body for body in bodies if body.getNumDependentGenCoords() and body.getSkeleton().isMobile()
        ]
        if not self.moving:
            raise NotSupported(f"nothing in {Path(run.model.path).name} moves in dart")
        names = {body.getName(): body for body in bodies}
        names |= {f"{body.getSkeleton().getName()}::{body.getName()}": body for body in bodies}
        self.watched = [self._found(one, names) for one in run.model.watched]
        self.freedom = sum(skeleton.getNumDofs() for skeleton in self.skeletons)
        self.size = self._size()

    def _found(self, watched: Watched, names: dict[str, Any]) -> Any:
        if not watched.path and watched.name in names:
            return names[watched.name]
        raise NotSupported(f"dart finds no body {watched.label!r} in {Path(self.run.model.path).name}")

    def _size(self) -> float:
        """Twice how far what moves reaches from its middle: the boxes round its shapes, else its centres [m]."""
        points = []
        for body in self.moving:
            points.append(body.getCOM())
            for k in range(body.getNumShapeNodes()):
                node = body.getShapeNode(k)
                if node.getCollisionAspect() is None:
                    continue
                box, pose = node.getShape().getBoundingBox(), node.getWorldTransform()
                ends = np.array([box.getMin(), box.getMax()])
                points += [
                    pose.rotation() @ ends[[i, j, m], [0, 1, 2]] + pose.translation()
                    for i in (0, 1)
                    for j in (0, 1)
                    for m in (0, 1)
                ]
        spread = np.array(points) - np.mean(points, axis=0)
        return 2.0 * float(np.linalg.norm(spread, axis=1).max()) or 1.0

    def take(self, count: int) -> None:
        for _ in range(count):
            self.world.step()

    def push(self, change: Array) -> None:
        place = 0
        for skeleton in self.skeletons:
            count = skeleton.getNumDofs()
            skeleton.setVelocities(skeleton.getVelocities() + change[place : place + count])
            place += count

    def control(self) -> None:
        """None are supported."""

    def read(self) -> None:
        """Everything is up to date after a step."""

    def trouble(self) -> str:
        return "" if np.isfinite(self.state()).all() else "a place is not finite"

    def poses(self) -> tuple[Array, Array]:
        read = [body.getWorldTransform() for body in self.watched]
        turns = [dart.math.Quaternion(pose.rotation()).wxyz() for pose in read]
        return np.array([pose.translation() for pose in read]), np.array(turns)

    def speeds(self) -> tuple[Array, Array]:
        return (
            np.linalg.norm([body.getCOMLinearVelocity() for body in self.moving], axis=1),
            np.linalg.norm([body.getAngularVelocity() for body in self.moving], axis=1),
        )

    def state(self) -> Array:
        return np.concatenate(
            [part for s in self.skeletons for part in (s.getPositions(), s.getVelocities())]
        )

    def at_sample(self) -> dict[str, Any]:
        return {"violation": 0.0}  # joint coordinates: limits are not read

    def at_end(self) -> dict[str, Any]:
        gravity, moving = np.array(self.run.model.gravity), {*self.moving}
        deepest = carried = 0.0
        for contact in self.world.getLastCollisionResult().getContacts():
            deepest = max(deepest, float(contact.penetrationDepth))
            held = float(np.ravel(contact.force) @ gravity)  # on the first
            shapes = (contact.collisionObject1, contact.collisionObject2)
            owners = [one.getShapeFrame().getBodyNode() for one in shapes]
            if (owners[0] in moving) != (owners[1] in moving):
                carried += -held if owners[0] in moving else held
        mass = sum(body.getMass() for body in self.moving)
        weight = float(gravity @ gravity) * mass
        found = {"overlap": np.array(deepest), "load": np.array(carried / weight if weight else 0.0)}
        return found | ({"megabytes": np.array(self.megabytes)} if self.run.timed else {})
