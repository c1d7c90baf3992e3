"""A user's own model in our engine: MJCF and URDF, read by MuJoCo's parser, run as a scene of ours."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from ..errors import MethodError
from ..forces import Load
from ..joints import AxialJoint
from ..method import DEFAULT, Method
from ..model_file import ModelRun
from ..observe import (
    ContactForce,
    JointCoordinate,
    KineticEnergy,
    Penetration,
    PotentialEnergy,
    Quantity,
    Violation,
)
from ..protocol import NotSupported
from ..result import Result, SimulationFailed
from ..run import Run, start
from ..scene import Scene
from .model_loop import Array, LoadedModel, elsewhere, resident
from .mujoco_file import (
    LOADS,
    alter,
    bodies_of,
    driven,
    load,
    refusal,
    size_of,
    start_at,
)
from .mujoco_medium import Medium
from .mujoco_rails import servo_name
from .mujoco_scene import Placed, Translated, matrix, translate
from .mujoco_shown import Shown
from .mujoco_surfaces import hull_of

READS = ("MJCF", "URDF")
# The most accurate settings, from the best on: the first that a scene allows
EXPLICIT = (Method(runge_kutta="order8", tolerance=1e-11), Method(composition="order6"))
IMPLICIT = (
    Method(half_step_velocities=True, corrections=2),
    Method(half_step_velocities=True),
    DEFAULT,
)


def run_model(
    run: ModelRun, time_step: float, duration: float, time_limit: float | None, method: Method = DEFAULT
) -> Result:
    """Load the file, drive it for `duration` [s] and read what is asked for."""
    if run.elsewhere:
        return elsewhere(__name__, run, time_step, duration, time_limit)
    if run.timed:
        hull_of.cache_clear()
    before, began = resident(), time.perf_counter()
    simulation = _Simulation(run, time_step, time_limit, method)
    loads = [time.perf_counter() - began]
    simulation.megabytes = resident() - before
    if run.timed:
        for _ in range(LOADS - 1):
            hull_of.cache_clear()
            began = time.perf_counter()
            _Simulation(run, time_step, time_limit, method)
            loads.append(time.perf_counter() - began)
    return simulation.result(duration, min(loads))


def compiled(run: ModelRun) -> Any:
    """What MuJoCo makes of the file."""
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        return load(run)
    except (ValueError, OSError, RuntimeError) as error:
        raise NotSupported(f"spook reads by MuJoCo's parser, which refuses {refusal(run, error)}") from None


class _Simulation(LoadedModel):
    """A scene that is held, with the model it was made from."""

    megabytes = 0.0  # that the process took more

    def __init__(self, run: ModelRun, time_step: float, time_limit: float | None, method: Method) -> None:
        super().__init__(run, time_step, time_limit)
        model = compiled(run)
        alter(model, run)
        self.model, self.data = model, mujoco.MjData(model)
        start_at(run, model, self.data)
        self.drive = driven(run.model.drive, model, self.data)
        self.varies = self.drive.varies and not run.conservative
        self.size = size_of(run, model, self.data)
        watched = bodies_of(run, model)
        self.made: Translated = translate(
            model, self.data, conservative=run.conservative or run.swing > 0.0, path=Path(run.model.path)
        )
        self.watched = [self.made.bodies[body] for body in watched]
        self.freedom = 3 * len(self.made.moving)
        self.pushed = [f"push on {name}" for name in self.made.moving]
        self.masses = np.array([*self.made.moving.values()])[:, None]  # kg
        medium = (model.opt.density or model.opt.viscosity) and not (run.conservative or run.swing)
        self.medium = Medium(model, self.made.bodies) if medium else None
        changing = self.varies or (not run.conservative and self.made.drives.changes())
        self.controlled, self.varies = changing, changing or self.medium is not None
        self.held = self._started(method)
        self.read()

    def _started(self, method: Method) -> Run:
        scene = self.made.scene
        loads = [
            Load(name=f"medium on {body}", body=body) for body in (self.medium.names if self.medium else ())
        ]
        if self.is_pushed:
            loads += [
                Load(name=load, body=body) for load, body in zip(self.pushed, self.made.moving, strict=True)
            ]
        scene = replace(scene, forces=(*scene.forces, *loads))
        refused: MethodError | None = None
        accurate = IMPLICIT if self.made.has_carriages else (*EXPLICIT, *IMPLICIT)
        for one in accurate if self.run.accurate else (method,):
            try:
                return start(scene, time_step=self.step, method=one, observe=self._observed(scene))
            except MethodError as error:
                refused = error
        raise NotSupported(f"spook cannot run this model so: {refused}")

    def _observed(self, scene: Scene) -> dict[str, Quantity]:
        """What is read at samples and at the end."""
        self.fixed = [b.name for b in scene.bodies if b.motion == "static"]  # type: ignore[union-attr]
        self.ties = [c.name for c in scene.constraints if c.name.startswith("equality ")]
        self.limits = {c.name: c.limit for c in scene.constraints if isinstance(c, AxialJoint) and c.limit}
        found: dict[str, Quantity] = {name: Violation(name) for name in self.ties}
        found |= {name: JointCoordinate(name) for name in self.limits}
        if scene.contacts:
            found |= {"overlap": Penetration()} | {f"load {name}": ContactForce(name) for name in self.fixed}
        if self.run.conservative:
            found |= {"potential": PotentialEnergy(), "kinetic": KineticEnergy()}
        return found

    def take(self, count: int) -> None:
        try:
            self.held.step(count)
        except SimulationFailed as failed:
            self.broken = failed.result.failure

    broken = ""

    def trouble(self) -> str:
        return self.broken

    def push(self, change: Array) -> None:
        """As forces on what moves, for one step."""
        forces = change.reshape(-1, 3) * self.masses / self.step
        self.held.set_loads(dict(zip(self.pushed, forces.tolist(), strict=True)))

    def control(self) -> None:
        """What acts through the next step: the medium as it is at its begin, and controls where they vary."""
        if self.medium:
            for name, (force, torque) in self.medium.wrenches(self.held.state).items():
                self.held.set_load(f"medium on {name}", force=tuple(force), torque=tuple(torque))
        if self.controlled:
            self._drive()

    def _drive(self) -> None:
        self.data.time = self.held.time
        self.drive.apply(self.data)
        drives = self.made.drives
        drives.control = np.array(self.data.ctrl)
        for joint in drives.driven():
            here = float(self.data.qpos[self.model.jnt_qposadr[joint]])  # the start's: the data stay there
            if drives.of(joint):
                self.held.set_motor(self.made.joints[joint], force=drives.force(joint, here))
            for actuator, arm in drives.bounded(joint):
                rest = drives.servo(joint, actuator, arm, here)[1]
                self.held.set_rest(f"rail of {servo_name(actuator)}", rest)
        for actuator in drives.servos:
            rest = drives.rest(actuator, float(self.data.actuator_length[actuator]))
            self.held.set_rest(f"rail of {servo_name(actuator)}", rest)
        drives.pass_on(self.step)

    def read(self) -> None:
        self.now = self.held.state

    def poses(self) -> tuple[Array, Array]:
        return self.placed(self.watched)

    def shapes(self) -> dict[str, Array]:
        shown = Shown(self.model, self.data)
        self.seen_bodies = [self.made.bodies[body] for body in shown.bodies]
        return shown.arrays()

    def seen(self) -> tuple[Array, Array]:
        return self.placed(self.seen_bodies)

    def placed(self, bodies: Sequence[Placed]) -> tuple[Array, Array]:
        """Places and turns of bodies of the file."""
        places, turns = [], []
        for one in bodies:
            place, turn = one.place, one.turn
            if one.name:
                axes = matrix(self.now[one.name][3:7])
                place, turn = self.now[one.name][:3] + axes @ place, axes @ turn
            places.append(place)
            turns.append(_quaternion(turn))
        return np.array(places), np.array(turns)

    def speeds(self) -> tuple[Array, Array]:
        moving = np.array([self.now[name][7:] for name in self.made.moving])
        return np.linalg.norm(moving[:, :3], axis=1), np.linalg.norm(moving[:, 3:], axis=1)

    def state(self) -> Array:
        return np.concatenate(list(self.held.state.values()))

    def at_sample(self) -> dict[str, Any]:
        found: dict[str, Any] = {"violation": self._violation()}
        if self.run.conservative:
            found["energy"] = [float(self.held["potential"]), float(self.held["kinetic"])]
        return found

    def _violation(self) -> float:
        worst = [float(np.max(np.abs(self.held[name]))) for name in self.ties]
        for name, limit in self.limits.items():
            here = float(self.held[name])
            worst.append(max(limit.lower - here, here - limit.upper))
        return max([0.0, *worst])

    def at_end(self) -> dict[str, Any]:
        scene = self.made.scene
        found: dict[str, Any] = {"overlap": np.array(0.0), "load": np.array(0.0)}
        if scene.contacts:
            gravity = np.array(scene.gravity)
            weight = float(gravity @ gravity) * sum(self.made.moving.values())
            carried = sum(float(self.held[f"load {name}"] @ gravity) for name in self.fixed)
            found["overlap"] = np.array(max(0.0, float(self.held["overlap"])))
            found["load"] = np.array(carried / weight if weight else 0.0)
        if self.run.timed:
            found["megabytes"] = np.array(self.megabytes)
        return found


def _quaternion(axes: Array) -> Array:
    found = np.zeros(4)
    mujoco.mju_mat2Quat(found, np.ascontiguousarray(axes).ravel())
    return found
