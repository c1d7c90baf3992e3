"""MuJoCo, by its Python package, stepped in its own loop.

Joint coordinates where the joints make a tree (a rod between particles is one hinge if all stays in a plane,
else two), equality constraints for what closes a loop. Forces are those of the step that ended, with Runge-Kutta
of its last stage. Centrals and motors are Python callbacks: their errors are MuJoCo's, their run time is not.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from importlib.metadata import version
from typing import Any

import mujoco
import numpy as np

from ..build_info import BuildInfo
from ..couplings import Relation, Wire
from ..forces import CentralGravity, Load, Spring
from ..joints import Ball, Distance, Hinge, Joint, Lock, Prismatic, Universal
from ..observe import ConstraintForce, ContactCount, ContactForce, Penetration
from ..protocol import Capabilities, Configuration, NotSupported, Task
from ..recorded_joints import cross, joint_point, product, turned
from ..recording import Recording
from ..result import Array
from ..scene import Scene
from ..shapes import Box, Capsule, Compound, Cylinder, Plane, Sphere
from .mujoco_file import READS, run_model
from .mujoco_model import HALF_HINGE, Model, held_first, model
from .stepped import Kept, stepped

SURFACES_MOVE = hasattr(mujoco.MjModel, "geom_surfacevel")  # since 4.0
BAD = ("mjWARN_BADQPOS", "mjWARN_BADQVEL", "mjWARN_BADQACC")
STIFF = 'solref="{h2!r} 1" solimp=".9999 .9999 .001 .5 2"'
CAREFUL = 'cone="elliptic" impratio="100" noslip_iterations="10" tolerance="1e-12" iterations="200"'


class MuJoCo:
    """The adapter."""

    name = "mujoco"
    reads = READS
    run_model = staticmethod(run_model)
    capabilities = Capabilities(
        shapes=frozenset({Sphere, Box, Capsule, Cylinder, Plane, Compound}),
        joints=frozenset({Distance, Lock, Ball, Hinge, Prismatic, Universal, Relation, Wire}),
        forces=frozenset({CentralGravity, Load, Spring}),
        shows=frozenset({ConstraintForce, ContactForce, ContactCount, Penetration}),
        shows_force_of=frozenset({Distance, Ball, Hinge, Relation, Wire}),
        friction=True,
        rolling_friction=True,
        joint_friction=True,
        motors=True,
        limits=True,
        springs=True,
        kinematic=SURFACES_MOVE,
        springs_aside=True,
        surface_velocity=SURFACES_MOVE,
        absent=frozenset(
            {
                # Its contacts return what their damping leaves, and give by their pair's effective mass.
                "restitution",
                "compliance of a surface",
                "the shape triangle mesh",  # of which it takes the hull
                "the force fluid",  # its medium has no surface and lifts nothing
                "friction that differs with the direction",  # its two are along no direction of a body
            }
        ),
    )
    configurations = (
        Configuration(
            name="rk4",
            reason="joint coordinates, Runge-Kutta of order 4; contacts with elliptic cones, impratio 100, no-slip "
            "sweeps and the stiffest safe reference (2 h): what the manual advises where accuracy is wanted; what a motor "
            "turns comes .6 of the way to its speed in each step, and in the other settings all of it in one",
            expected_order=4.0,
            options={"joints": True, "option": f'integrator="RK4" {CAREFUL}', "stiff": True},
        ),
        Configuration(
            name="implicit",
            reason="the same, but implicit in what damps and drives (implicitfast), which the manual recommends for most "
            "models and where servos and damping are stiff",
            expected_order=1.0,
            options={"joints": True, "option": f'integrator="implicitfast" {CAREFUL}', "stiff": True},
        ),
        Configuration(
            name="defaults",
            reason="joint coordinates, semi-implicit Euler and soft contacts: what one gets without asking",
            expected_order=1.0,
            options={"joints": True, "option": 'integrator="Euler"', "stiff": False},
        ),
        Configuration(
            name="equalities",
            reason="free bodies held by equality constraints, as an engine of constraints has them; reference 2 h",
            expected_order=1.0,
            options={"joints": False, "option": f'integrator="Euler" {CAREFUL}', "stiff": True},
            # It has them of degrees of freedom, and here those of joints are none.
            lacks=("joint_friction", "motors", "limits", "springs"),
        ),
    )

    def build_info(self) -> BuildInfo:
        return BuildInfo(
            name=self.name,
            version=version("mujoco"),
            git_hash="",
            dirty=False,
            commit_time="",
            parents=(),
            compiler="wheel from the package index",
            flags="",
        )

    def record(self, task: Task) -> Recording:
        mujoco.set_mju_user_warning(
            lambda text: None
        )  # said in the outcome, not in a log file where one stands
        began = time.perf_counter()
        run = _Run(task)
        setup = time.perf_counter() - began
        try:
            return run.recording(setup)
        finally:
            mujoco.set_mjcb_passive(None)
            mujoco.set_mjcb_control(None)


def start_speeds(scene: Scene, made: Model, model: Any, data: Any) -> Array:
    """Joint speeds (nv,) from the bodies' velocities at the start; `data` is there."""
    points, speeds, rows = set(made.point_bodies), [], []
    for body in scene.bodies:
        if getattr(body, "motion", "dynamic") != "dynamic":
            continue
        moving, turning = np.zeros((3, model.nv)), np.zeros((3, model.nv))
        number = int(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, body.name))
        mujoco.mj_jacBody(model, data, moving, turning, number)
        rows.append(moving)
        speeds.append(body.velocity)
        if body.name not in points:
            rows.append(turning)
            speeds.append(body.angular_velocity)  # type: ignore[union-attr]
    wanted = np.array(speeds, dtype=float).ravel()
    if not wanted.any():
        return np.zeros(model.nv)
    found: Array = np.linalg.lstsq(np.concatenate(rows), wanted, rcond=None)[0]
    return found


class _Run:
    """One model with its data, and what is read off it."""

    def __init__(self, task: Task) -> None:
        self.task, options = task, task.configuration.options
        hard = STIFF.format(h2=2.0 * task.time_step)
        self.made: Model = model(
            task.scene,
            joint_coordinates=options["joints"],
            option=f'timestep="{task.time_step!r}" {options["option"]}',
            row=hard if options["stiff"] else "",
            hard=hard,
            damping=2.0 * task.time_step,
        )
        try:
            self.model = mujoco.MjModel.from_xml_string(self.made.xml)
        except ValueError as error:
            raise NotSupported(f"mujoco refuses the model: {' '.join(str(error).split())[:200]}") from None
        self.data = mujoco.MjData(self.model)
        self.ids = np.array([self._body(body.name) for body in task.scene.bodies])
        self.roots = self.model.body_rootid[self.ids]
        self._push()
        if self.made.speeds:
            self._drive()
        self._start()

    def _body(self, name: str) -> int:
        return int(mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_BODY, name))

    def _drive(self) -> None:
        """Motors: rows of dry friction that are to come to a speed within a step, and not to a stand. Told in every stage."""
        m = self.model
        speeds = np.zeros(m.ntendon)
        for name, speed in self.made.speeds.items():
            speeds[mujoco.mj_name2id(m, mujoco.mjtObj.mjOBJ_TENDON, name)] = speed
        rubbing = int(mujoco.mjtConstraint.mjCNSTR_FRICTION_TENDON)

        def drive(m: Any, d: Any) -> None:
            rows = np.flatnonzero(d.efc_type == rubbing)
            d.efc_aref[rows] += d.efc_KBIP[rows, 1] * speeds[d.efc_id[rows]]

        mujoco.set_mjcb_control(drive)

    def _push(self) -> None:
        fields = []
        for force in self.task.scene.forces:
            if isinstance(force, Load):
                self.data.xfrc_applied[self._body(force.body)] += (*force.force, *force.torque)
            elif isinstance(force, CentralGravity):
                fields.append(force)
        if fields:
            mujoco.set_mjcb_passive(_attraction(self, fields))

    def _start(self) -> None:
        mujoco.mj_forward(self.model, self.data)
        self.data.qvel[:] = start_speeds(self.task.scene, self.made, self.model, self.data)
        mujoco.mj_forward(self.model, self.data)

    def recording(self, setup: float) -> Recording:
        def step(count: int) -> None:
            mujoco.mj_step(self.model, self.data, count)

        return stepped(self.task, step, self._read, setup, self._health)

    def _health(self) -> str:
        for kind in BAD:
            if self.data.warning[getattr(mujoco.mjtWarning, kind)].number:
                return f"mujoco reset a state it calls bad ({kind[7:].lower()})"
        return ""

    def _read(self, keep: Kept, place: int, sample: int) -> None:
        m, d = self.model, self.data
        if self.task.constraint_forces:
            self._read_constraints(keep, sample)
        if self.task.contacts and sample:
            self._read_contacts(keep, place)
        mujoco.mj_kinematics(m, d)
        mujoco.mj_comPos(m, d)
        mujoco.mj_comVel(m, d)
        spin = d.cvel[self.ids, :3]
        keep.positions[place] = where = d.xpos[self.ids]
        keep.orientations[place] = d.xquat[self.ids]
        keep.spins[place] = spin
        keep.velocities[place] = d.cvel[self.ids, 3:] + cross(spin, where - d.subtree_com[self.roots])
        for k, body in enumerate(self.task.scene.bodies):
            if getattr(body, "motion", "dynamic") == "kinematic":
                _carry(keep, place, k, body, sample * self.task.time_step)

    def _read_constraints(self, keep: Kept, sample: int) -> None:
        scene, m, d = self.task.scene, self.model, self.data
        if sample:
            mujoco.mj_rnePostConstraint(m, d)
        equalities = d.efc_type[: d.nefc] == int(mujoco.mjtConstraint.mjCNSTR_EQUALITY)
        rows, forces = d.efc_id[: d.nefc][equalities], d.efc_force[: d.nefc][equalities]
        taut = d.efc_type[: d.nefc] == int(mujoco.mjtConstraint.mjCNSTR_LIMIT_TENDON)
        for constraint in scene.constraints:
            if type(constraint) not in MuJoCo.capabilities.shows_force_of:  # type: ignore[operator]
                continue
            assert isinstance(constraint, Distance | Joint | Relation | Wire)
            if not sample:
                value: Any = np.zeros(6) if isinstance(constraint, Joint) else 0.0
            elif constraint.name in self.made.wires:
                pull = taut & (d.efc_id[: d.nefc] == self.made.wires[constraint.name])
                value = float(d.efc_force[: d.nefc][pull].sum())
            elif isinstance(constraint, Relation | Wire):
                force = forces[rows == self.made.equalities[constraint.name][0]]
                value = float(force.sum()) * (1.0 if isinstance(constraint, Relation) else -1.0)
            elif constraint.name in self.made.tree:
                value = self._of_tree(constraint)
            else:
                mine = [forces[rows == k] for k in self.made.equalities[constraint.name]]
                value = self._of_equality(constraint, mine)
            keep.forces.setdefault(constraint.name, []).append(value)

    def _of_tree(self, constraint: Distance | Joint) -> Any:
        """The force that MuJoCo says a body exerts on its child, moved to the joint."""
        d, child = self.data, self.made.tree[constraint.name]
        body = self._body(child)
        torque, force = d.cfrc_int[body, :3], d.cfrc_int[body, 3:]
        second = constraint.between[1] == child
        if isinstance(constraint, Distance):
            other = constraint.between[0 if second else 1]
            anchor = d.xpos[self._body(other)] if isinstance(other, str) else np.array(other)
            rod = anchor - d.xpos[body]
            return float(force @ rod / np.linalg.norm(rod))
        at = self._carried(constraint, child)
        torque = torque + cross(d.subtree_com[self.model.body_rootid[body]] - at, force)
        return np.concatenate([force, torque]) * (1.0 if second else -1.0)

    def _of_equality(self, constraint: Distance | Joint, rows: list[Array]) -> Any:
        if isinstance(constraint, Distance):
            return -float(rows[0][0]) if len(rows[0]) else 0.0
        # MuJoCo's rows push its first body, which is `held`; a force is read as that on the second.
        held = held_first(self.task.scene, constraint)[0]
        sign = 1.0 if held == constraint.between[1] else -1.0
        arms = [np.zeros(3)]
        if isinstance(constraint, Hinge):
            body = self.task.scene.body(held)
            turn = np.array(body.orientation)  # type: ignore[union-attr]
            local = turned(turn * np.array([1.0, -1.0, -1.0, -1.0]), np.array(constraint.axis))
            axis = turned(np.array(self.data.xquat[self._body(held)]), local)
            arms = [-HALF_HINGE * axis, HALF_HINGE * axis]
        total = np.zeros(6)
        for row, arm in zip(rows, arms, strict=True):
            if len(row):  # MuJoCo leaves out an equality that no joint can break
                total += np.concatenate([row, cross(arm, row)])
        return sign * total

    def _carried(self, joint: Joint, name: str) -> Array:
        """Where the joint's point, fixed to a body at the start, is now."""
        body = self.task.scene.body(name)
        turn = np.array(body.orientation)  # type: ignore[union-attr]
        back = turn * np.array([1.0, -1.0, -1.0, -1.0])
        local = turned(back, joint_point(self.task.scene, joint) - np.array(body.position))
        index = self._body(name)
        return np.asarray(self.data.xpos[index] + turned(np.array(self.data.xquat[index]), local))

    def _read_contacts(self, keep: Kept, place: int) -> None:
        m, d = self.model, self.data
        names = {int(self.ids[i]): body.name for i, body in enumerate(self.task.scene.bodies)}
        keep.contacts[place] = d.ncon
        # All at once: one contact's own arrays are read wrong by releases before 3.3 beside a NumPy of today.
        touching = d.contact
        frames = np.reshape(touching.frame, (-1, 3, 3))
        wrench = np.zeros(6)
        for k in range(d.ncon):
            keep.depths[place] = max(keep.depths[place], -touching.dist[k])
            mujoco.mj_contactForce(m, d, k, wrench)
            force = frames[k].T @ wrench[:3]  # on the second, along the normal
            first, second = (names[int(m.geom_bodyid[g[k]])] for g in (touching.geom1, touching.geom2))
            keep.pair((first, second))[place] -= force


def _carry(keep: Kept, place: int, k: int, body: Any, time: float) -> None:
    """Where a kinematic body is by now, of which MuJoCo has the surface alone."""
    spin = np.array(body.angular_velocity)
    rate = float(np.linalg.norm(spin))
    keep.positions[place, k] = np.array(body.position) + time * np.array(body.velocity)
    keep.velocities[place, k], keep.spins[place, k] = body.velocity, spin
    if rate:
        half = 0.5 * rate * time
        gone = np.array([math.cos(half), *(math.sin(half) / rate * spin)])
        keep.orientations[place, k] = product(gone, np.array(body.orientation))


def _attraction(run: _Run, fields: list[CentralGravity]) -> Callable[[Any, Any], None]:
    """Central gravity as a callback: a force at each body's centre."""
    bodies = [
        (run._body(body.name), float(body.mass or 0.0))
        for body in run.task.scene.bodies
        if getattr(body, "motion", "dynamic") == "dynamic"
    ]

    def pull(m: Any, d: Any) -> None:
        for index, mass in bodies:
            where = d.xipos[index]
            for one in fields:
                x, y, z = where[0] - one.centre[0], where[1] - one.centre[1], where[2] - one.centre[2]
                size = -mass * one.strength / (x * x + y * y + z * z) ** 1.5
                mujoco.mj_applyFT(
                    m, d, np.array([size * x, size * y, size * z]), np.zeros(3), where, index, d.qfrc_passive
                )

    return pull


ENGINE = MuJoCo()
