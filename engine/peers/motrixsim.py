"""MotrixSim, by its Python package: joint coordinates and soft contacts, single precision, on the CPU, one thread.

It reads MJCF, so that the model is the one our adapter of MuJoCo makes. What it does not know in a file it passes over with a
line in a log: that line is read here, and refuses the model. It has one integrator, semi-implicit Euler.
"""

from __future__ import annotations

import contextlib
import functools
import re
import time
from dataclasses import replace
from importlib.metadata import version
from typing import Any
from xml.etree import ElementTree

import numpy as np

from ..bodies import WORLD, Particle, RigidBody
from ..build_info import BuildInfo
from ..forces import Load
from ..joints import Ball, Distance, Hinge, Lock, Prismatic, Universal
from ..observe import ContactCount
from ..protocol import Capabilities, Configuration, NotSupported, Task, Worlds
from ..recorded_joints import cross, joint_point, turned
from ..recording import Recording
from ..result import Array
from ..scene import Scene
from ..shapes import Box, Capsule, Cylinder, Plane, Sphere
from .mujoco_model import model
from .stepped import Kept, overheard, quiet, stepped

with quiet():  # it says whether it is profiled
    import motrixsim

    with contextlib.suppress(RuntimeError):  # it is loaded already, and has its threads
        motrixsim.init_thread_pool(1)

PASSED_OVER = re.compile(r"^([\w@]+) at line: \d+$", re.MULTILINE)
HARMLESS = {"size"}  # how much memory MuJoCo may take
GROUND = " ground"  # no name of a scene begins so
ON_AN_ARM = """<mujoco><worldbody><body name="b" pos="1 0 0"><joint pos="-1 0 0" axis="0 0 1"/>
<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody></mujoco>"""


class MotrixSim:
    """The adapter."""

    name = "motrixsim"
    capabilities = Capabilities(
        shapes=frozenset({Sphere, Box, Capsule, Cylinder, Plane}),
        joints=frozenset({Distance, Lock, Ball, Hinge, Prismatic, Universal}),
        forces=frozenset({Load}),
        shows=frozenset({ContactCount}),
        friction=True,
        joint_friction=True,
        rolling_friction=True,
        absent=frozenset(
            {
                "the observable constraint force",
                "the observable penetration",
                "restitution",
                "compliance of a surface",
            }
        ),
    )
    configurations = (
        Configuration(
            name="many-iterations",
            reason="joint coordinates; 1000 iterations to 1e-6 in place of 100 to 1e-3, and a reference of 2 h, the "
            "stiffest that MuJoCo's manual, whose format it reads, calls safe",
            expected_order=1.0,
            options={"joints": True, "iterations": 1000, "tolerance": 1e-6, "stiff": True},
        ),
        Configuration(
            name="defaults",
            reason="joint coordinates and soft contacts: what one gets without asking",
            expected_order=1.0,
            options={"joints": True, "iterations": 100, "tolerance": 1e-3, "stiff": False},
        ),
        Configuration(
            name="equalities",
            reason="free bodies held by equality constraints, as an engine of constraints has them; reference 2 h",
            expected_order=1.0,
            options={"joints": False, "iterations": 1000, "tolerance": 1e-6, "stiff": True},
        ),
    )

    def build_info(self) -> BuildInfo:
        made = "wheel from the package index, float32, CPU"
        return BuildInfo(self.name, version("motrixsim"), "", False, "", (), made, "")

    def record(self, task: Task) -> Recording:
        with quiet():  # it writes what it panics over
            began = time.perf_counter()
            run = _Run(task)
            return stepped(task, run.step, run.read, time.perf_counter() - began)

    def worlds(self, task: Task, count: int) -> Worlds:
        """A batch of states beside one model; it spreads them over its threads, of which it has one here."""
        began = time.perf_counter()
        run = _Run(task, (count,))
        setup, began = time.perf_counter() - began, time.perf_counter()
        run.step(task.steps)
        took = time.perf_counter() - began
        run.model.forward_kinematic(run.data)
        places = run.model.get_link_poses(run.data)[:, run.links, :3]
        return Worlds(positions=np.asarray(places, dtype=float), seconds=took, setup_seconds=setup)


class _Run:
    """One model with its state, or with a batch of them."""

    def __init__(self, task: Task, batch: tuple[int, ...] = ()) -> None:
        self.task, options = task, task.configuration.options
        made = model(
            task.scene if options["joints"] else _tied_to_the_world(task.scene),
            joint_coordinates=options["joints"],
            option=f'timestep="{task.time_step!r}"',
            row=f'solref="{2.0 * task.time_step!r} 1"' if options["stiff"] else "",
        )
        xml = _tied_to_a_body(made.xml)
        with overheard() as heard:
            try:
                self.model = motrixsim.load_mjcf_str(xml)
            except (RuntimeError, ValueError) as error:
                raise NotSupported(
                    f"motrixsim refuses the model: {' '.join(str(error).split())[:200]}"
                ) from None
            if ignored := {*PASSED_OVER.findall(heard())} - HARMLESS:
                raise NotSupported(f"motrixsim does not know {', '.join(sorted(ignored))} of MJCF")
        self.model.options.max_iterations = options["iterations"]
        self.model.options.solver_tolerance = options["tolerance"]
        self.data = motrixsim.SceneData(self.model, batch)
        names = list(self.model.link_names)
        self.links = [names.index(body.name) for body in task.scene.bodies]
        self.points = [k for k, body in enumerate(task.scene.bodies) if isinstance(body, Particle)]
        self.loads = [force for force in task.scene.forces if isinstance(force, Load)]
        self.arms = _arms(made.xml, [body.name for body in task.scene.bodies])
        self._start()

    def _start(self) -> None:
        """Speeds of its coordinates from the bodies' at the start: what each coordinate moves is linear in them."""
        bodies, points = self.task.scene.bodies, set(self.points)
        moves = [k for k, body in enumerate(bodies) if getattr(body, "motion", "dynamic") == "dynamic"]
        wanted = [(*bodies[k].velocity, *getattr(bodies[k], "angular_velocity", (0.0,) * 3)) for k in moves]
        if np.any(wanted):
            seen = np.array([[k not in points or axis < 3 for axis in range(6)] for k in moves]).ravel()
            columns = [self._moved(unit)[moves].ravel()[seen] for unit in np.eye(self.model.num_dof_vel)]
            speeds = np.linalg.lstsq(np.transpose(columns), np.ravel(wanted)[seen], rcond=None)[0]
            self.data.set_dof_vel(speeds.astype(np.float32))

    def _moved(self, speeds: Array) -> Array:
        """Velocities (n, 6) of the bodies of one state with those speeds."""
        one = motrixsim.SceneData(self.model)
        one.set_dof_vel(speeds.astype(np.float32))
        return self._seen(one)[1]

    def _seen(self, data: Any) -> tuple[Array, Array]:
        """Places and turns (n, 7), of which x, y, z come before w, and velocities (n, 6), of the bodies."""
        self.model.forward_kinematic(data)  # after a step they are those before it
        poses = np.asarray(self.model.get_link_poses(data), dtype=float)[self.links]
        moving = np.array(self.model.get_link_velocities(data), dtype=float)[self.links]
        if _turned_about():
            arms = turned(poses[:, [6, 3, 4, 5]], self.arms)
            moving[:, :3] += 2.0 * cross(moving[:, 3:], arms)
        return poses, moving

    def step(self, count: int) -> None:
        try:
            self._take(count)
        except BaseException as panic:  # which is no Exception
            if type(panic).__name__ != "PanicException":
                raise
            raise RuntimeError(f"motrixsim panics: {panic}") from None

    def _take(self, count: int) -> None:
        if not self.loads:
            self.model.step_n(self.data, count)
            return
        places = {body.name: link for body, link in zip(self.task.scene.bodies, self.links, strict=True)}
        pulls = [
            (self.model.links[places[load.body]], self._each(load.force), self._each(load.torque))
            for load in self.loads
        ]
        centre = self._each(
            np.zeros(3)
        )  # unless told where, a force acts at the joint that the link hangs by
        for _ in range(count):  # a force is for one step
            for link, force, torque in pulls:
                link.add_external_force(self.data, force, centre, local=False)
                link.add_external_torque(self.data, torque, local=False)
            self.model.step(self.data)

    def _each(self, vector: Any) -> Any:
        """The same for every state of a batch."""
        return np.broadcast_to(np.array(vector, dtype=np.float32), (*self.data.shape, 3)).copy()

    def read(self, keep: Kept, row: int, sample: int) -> None:
        poses, moving = self._seen(self.data)
        keep.positions[row], keep.orientations[row] = poses[:, :3], poses[:, [6, 3, 4, 5]]
        keep.velocities[row], keep.spins[row] = moving[:, :3], moving[:, 3:]
        if self.task.contacts and sample:
            keep.contacts[row] = int(np.sum(self.model.get_contact_query(self.data).num_contacts))


def _tied_to_the_world(scene: Scene) -> Scene:
    """Welds to a body that stands turned are held as if it stood upright: they are welds to the world here."""
    still = {b.name for b in scene.bodies if isinstance(b, RigidBody) and b.motion != "dynamic"}
    rows, apart = [], list(scene.no_contact)
    for row in scene.constraints:
        if isinstance(row, Lock) and not still.isdisjoint(row.between):
            ends = (WORLD, row.between[1]) if row.between[0] in still else (row.between[0], WORLD)
            apart.append(row.between)
            row = replace(row, between=ends, at=tuple(joint_point(scene, row)))
        rows.append(row)
    return replace(scene, constraints=tuple(rows), no_contact=tuple(apart))


def _tied_to_a_body(xml: str) -> str:
    """Welds to the world, which turn a body upright, as welds to a body that stands still."""
    tied = re.sub(r'(<weld body1="[^"]*")(?= anchor)', rf'\1 body2="{GROUND}"', xml)
    return xml if tied == xml else tied.replace("<worldbody>", f'<worldbody><body name="{GROUND}"/>', 1)


def _arms(xml: str, names: list[str]) -> Array:
    """From the joint of each body to its centre, in the body's axes [m]; bodies that are free have none."""
    found = {}
    for body in ElementTree.fromstring(xml).iter("body"):
        joint = body.find("joint")
        at = "0 0 0" if joint is None else joint.get("pos", "0 0 0")
        found[body.get("name")] = [-float(number) for number in at.split()]
    return np.array([found[name] for name in names])


@functools.cache
def _turned_about() -> bool:
    """Whether it tells, of a link beside its joint, the joint's velocity less what the turning adds, in place of more."""
    with overheard():
        one = motrixsim.load_mjcf_str(ON_AN_ARM)
    data = motrixsim.SceneData(one)
    data.set_dof_vel(np.ones(1, dtype=np.float32))
    one.forward_kinematic(data)
    return bool(one.get_link_velocities(data)[0, 1] < 0.0)  # 1 m/s along y, where it is right


ENGINE = MotrixSim()
