"""A user's own model in PyBullet: URDF, SDF and MJCF by Bullet's own importers.

Bullet knows no controls of a file: its joints are let go (no motors), and what a model is driven with is not supported.
Gravity is the file's, which Bullet's importers leave out; the floor is whatever the file holds.
"""

from __future__ import annotations

import re
import time
from pathlib import Path
from typing import Any

import numpy as np

from ..model_file import ModelRun, Watched
from ..protocol import NotSupported
from ..result import Result
from .model_loop import (
    Array,
    LoadedModel,
    elsewhere,
    refuse_settings,
    resident,
    said,
)
from .pybullet_model import SEEN_FROM
from .stepped import overheard, quiet

with quiet():  # it says when it was built
    import pybullet as bullet

READS = ("URDF", "SDF", "MJCF")
SWEEPS = 500  # in place of 50, as in this engine's other questions
NOTE = re.compile(r"b3(Warning|Error)\[[^\]]*\]:\n?")  # before each of what its importers write
UNREAD = re.compile(r"(?:cannot extract|issue extracting)[^\n]* '?([^\s']+)'?")  # a mesh; it goes on without


def run_model(run: ModelRun, time_step: float, duration: float, time_limit: float | None) -> Result:
    """Load the file in a world of its own, and run it."""
    refuse_settings("pybullet", run)
    if run.elsewhere:
        return elsewhere(__name__, run, time_step, duration, time_limit)
    with quiet():
        client = bullet.connect(bullet.DIRECT)
        try:
            before, began = resident(), time.perf_counter()
            made = _loaded(run, client)
            load = time.perf_counter() - began
            simulation = _Simulation(run, made, client, time_step, time_limit)
            simulation.megabytes = resident() - before
            return simulation.result(duration, load)
        finally:
            bullet.disconnect(client)


def _loaded(run: ModelRun, client: int) -> list[int]:
    path = Path(run.model.path)
    bullet.setAdditionalSearchPath(str(path.parent), physicsClientId=client)
    flags = bullet.URDF_USE_INERTIA_FROM_FILE
    with overheard() as heard:
        try:
            if run.model.format == "URDF":
                made = [bullet.loadURDF(str(path), useFixedBase=True, flags=flags, physicsClientId=client)]
            else:
                loader = bullet.loadSDF if run.model.format == "SDF" else bullet.loadMJCF
                made = list(loader(str(path), physicsClientId=client))
        except bullet.error as error:
            _, *notes = NOTE.split(heard())
            why = [note for kind, note in zip(notes[::2], notes[1::2], strict=True) if kind == "Error"]
            raise NotSupported(
                f"pybullet refuses {path.name}: {said(' '.join([str(error), *why]), path)}"
            ) from None
        if unread := UNREAD.search(heard()):
            raise NotSupported(f"pybullet cannot read the mesh {Path(unread[1]).name} of {path.name}")
    return made


class _Simulation(LoadedModel):
    """All bodies of the file, each a base with links."""

    megabytes = 0.0  # that the process took more

    def __init__(
        self, run: ModelRun, made: list[int], client: int, time_step: float, time_limit: float | None
    ) -> None:
        super().__init__(run, time_step, time_limit)
        self.client = client
        self.links = [(body, link) for body in made for link in range(-1, self._count(body))]
        self.mass = np.array([self._dynamics(*one)[0] for one in self.links])
        self.moving = self._moving()
        if not self.moving:
            raise NotSupported(f"nothing in {Path(run.model.path).name} moves in pybullet")
        names = self._names()
        self.watched = [self._found(one, names) for one in run.model.watched]
        bullet.setGravity(*run.model.gravity, physicsClientId=client)
        bullet.setPhysicsEngineParameter(
            fixedTimeStep=time_step, numSolverIterations=SWEEPS, numSubSteps=0, solverResidualThreshold=0.0,
            deterministicOverlappingPairs=1, contactBreakingThreshold=SEEN_FROM, physicsClientId=client,
        )  # fmt: skip
        self._let_go()
        self.size = self._size()
        self.freedom = 3 * len(self.moving)

    def _count(self, body: int) -> int:
        return int(bullet.getNumJoints(body, physicsClientId=self.client))

    def _dynamics(self, body: int, link: int) -> Any:
        return bullet.getDynamicsInfo(body, link, physicsClientId=self.client)

    def _moving(self) -> list[tuple[int, int]]:
        """What has mass and is not fixed to the world: free bases, and links with something movable above them."""
        found = []
        free = {
            body for (body, link), mass in zip(self.links, self.mass, strict=True) if link < 0 and mass > 0.0
        }
        moves: dict[tuple[int, int], bool] = {}
        for body, link in self.links:
            if link < 0:
                moves[body, link] = body in free
            else:
                joint = bullet.getJointInfo(body, link, physicsClientId=self.client)
                moves[body, link] = joint[2] != bullet.JOINT_FIXED or moves.get((body, joint[16]), False)
            if moves[body, link]:
                found.append((body, link))
        return found

    def _names(self) -> dict[str, tuple[int, int]]:
        """Links by their names, and by their model's before them."""
        names: dict[str, tuple[int, int]] = {}
        for body, link in self.links:
            if link < 0:
                base, made = bullet.getBodyInfo(body, physicsClientId=self.client)
                made, base = made.decode(), base.decode()
                found = [made, base, f"{made}::{base}"]
            else:
                joint = bullet.getJointInfo(body, link, physicsClientId=self.client)
                found = [joint[12].decode(), f"{made}::{joint[12].decode()}"]
            names |= dict.fromkeys(found, (body, link))
        return names

    def _found(self, watched: Watched, names: dict[str, tuple[int, int]]) -> tuple[int, int]:
        if not watched.path and watched.name in names:
            return names[watched.name]
        raise NotSupported(f"pybullet finds no body {watched.label!r} in {Path(self.run.model.path).name}")

    def _let_go(self) -> None:
        """Bullet's joints hold still by motors, and its bodies are damped, until told otherwise."""
        for body, link in self.links:
            bullet.changeDynamics(
                body, link, linearDamping=0.0, angularDamping=0.0, activationState=bullet.ACTIVATION_STATE_DISABLE_SLEEPING,
                physicsClientId=self.client,
            )  # fmt: skip
            if link >= 0:
                kind = bullet.getJointInfo(body, link, physicsClientId=self.client)[2]
                if kind in (bullet.JOINT_REVOLUTE, bullet.JOINT_PRISMATIC):
                    bullet.setJointMotorControl2(
                        body, link, bullet.VELOCITY_CONTROL, force=0.0, physicsClientId=self.client
                    )

    def _size(self) -> float:
        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        for body, link in self.moving:
            one, other = bullet.getAABB(body, link, physicsClientId=self.client)
            low, high = np.minimum(low, one), np.maximum(high, other)
        return float(np.linalg.norm(high - low))

    def take(self, count: int) -> None:
        for _ in range(count):
            bullet.stepSimulation(physicsClientId=self.client)

    def push(self, change: Array) -> None:
        """As forces on what moves, for one step."""
        for k, (body, link) in enumerate(self.moving):
            force = change[3 * k : 3 * k + 3] * max(self._dynamics(body, link)[0], 0.0) / self.step
            bullet.applyExternalForce(
                body, link, force.tolist(), [0, 0, 0], bullet.LINK_FRAME, physicsClientId=self.client
            )

    def control(self) -> None:
        """None are supported."""

    def read(self) -> None:
        """Everything is up to date after a step."""

    def trouble(self) -> str:
        return "" if np.isfinite(self.state()).all() else "a place is not finite"

    def _of(self, body: int, link: int) -> tuple[Any, Any, Any, Any]:
        """Place and turn (x, y, z, w) of its frame, speed and turning of its centre."""
        if link < 0:
            place, turn = bullet.getBasePositionAndOrientation(body, physicsClientId=self.client)
            speed, spin = bullet.getBaseVelocity(body, physicsClientId=self.client)
            inward = self._dynamics(body, link)[3:5]
            back = bullet.invertTransform(*inward)
            return (*bullet.multiplyTransforms(place, turn, *back), speed, spin)
        found = bullet.getLinkState(
            body, link, computeLinkVelocity=1, computeForwardKinematics=1, physicsClientId=self.client
        )
        return found[4], found[5], found[6], found[7]

    def poses(self) -> tuple[Array, Array]:
        read = [self._of(*one) for one in self.watched]
        turns = np.array([one[1] for one in read])
        return np.array([one[0] for one in read]), turns[:, [3, 0, 1, 2]]

    def speeds(self) -> tuple[Array, Array]:
        read = [self._of(*one) for one in self.moving]
        return (
            np.linalg.norm([one[2] for one in read], axis=1),
            np.linalg.norm([one[3] for one in read], axis=1),
        )

    def state(self) -> Array:
        return np.array([np.concatenate(self._of(*one)) for one in self.moving])

    def at_sample(self) -> dict[str, Any]:
        return {"violation": 0.0}  # joint coordinates: none can be violated but limits, which are not read

    def at_end(self) -> dict[str, Any]:
        moving, deepest, carried, gravity = set(self.moving), 0.0, 0.0, np.array(self.run.model.gravity)
        for contact in bullet.getContactPoints(physicsClientId=self.client):
            deepest = max(deepest, -contact[8])
            one, other = (contact[1], contact[3]), (contact[2], contact[4])
            if (one in moving) != (other in moving):
                held = contact[9] * float(np.dot(contact[7], gravity))  # the normal points to the first body
                carried += -held if one in moving else held
        weight = float(gravity @ gravity) * sum(self._dynamics(*one)[0] for one in self.moving)
        found = {"overlap": np.array(deepest), "load": np.array(carried / weight if weight else 0.0)}
        return found | ({"megabytes": np.array(self.megabytes)} if self.run.timed else {})
