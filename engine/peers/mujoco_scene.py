"""A compiled MuJoCo model as a scene of ours: bodies, joints, drives, ties and surfaces, table by table.

MuJoCo reads MJCF and URDF; its arrays are what a file says once defaults, includes and classes are resolved. Each part of
it has one way into the scene, or a name it is refused by: nothing is passed over in silence that would move a body.

- Bodies without joints between them are one rigid body, in its principal axes.
- A body with several joints gets light bodies between them, of LIGHT of its mass.
- Tendons along joints, and servos of bounded force or of several joints, pull light carriages that go as the sums of joints do.
- Damping, springs and actuators that are linear in place and speed are one compliant row of their joint.
- Contacts are rigid, as all of this engine's are, whatever solref and solimp say.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from ..bodies import WORLD, PairFriction, RigidBody
from ..check import Rotation
from ..couplings import Relation
from ..forces import Force, Load
from ..joints import Ball, Constraint, Hinge, JointSpring, Limit, Lock, Motor, Prismatic
from ..protocol import NotSupported
from ..scene import Scene
from .lacking import Lacks, texts_of
from .mujoco_drives import Drives
from .mujoco_rails import FADING, Rails, relaxation, servo_name
from .mujoco_surfaces import surfaces

Array = npt.NDArray[np.float64]
LIGHT = 1e-7  # of its mass and inertia, what stands between two joints of one body
LIGHTER = 1e-10  # the same where joint coordinates are used, which nothing is too light for
PUSHES_AWAY = "an actuator that pushes away from where it stands or drives what moves"
APART = 1e-6  # of the model's extent: how far a tie may be open at the start
FREE, BALL, SLIDE, HINGE = (
    int(getattr(mujoco.mjtJoint, f"mjJNT_{k}")) for k in ("FREE", "BALL", "SLIDE", "HINGE")
)
CONNECTED, WELDED, JOINED, OF_TENDONS = (
    int(getattr(mujoco.mjtEq, f"mjEQ_{k}")) for k in ("CONNECT", "WELD", "JOINT", "TENDON")
)


@dataclass(frozen=True, slots=True)
class Placed:
    """Where a body of the file is in the rigid body it belongs to; `name` is empty for what stands still."""

    name: str
    place: Array  # m, from the centre, in its axes; of what stands still in the world's
    turn: Array  # (3, 3)


@dataclass(frozen=True, slots=True)
class Translated:
    """A scene, and how to find in it what the file names."""

    scene: Scene
    bodies: tuple[Placed, ...]  # by the number MuJoCo gives them
    moving: Mapping[str, float]  # mass [kg] of rigid bodies that are the file's own
    joints: tuple[str, ...]  # by number; empty for a free one
    drives: Drives
    has_carriages: bool  # light bodies on rails, which stiff springs pull: explicit methods would need steps as short as these


def translate(model: Any, data: Any, *, conservative: bool = False, path: Path | None = None) -> Translated:
    """The scene that starts as `data` is. Raises NotSupported with all that is lacking, by name and by line of the file `path`.

    `conservative`: without contacts, limits, actuators, and what damps or rubs.
    """
    mujoco.mj_forward(model, data)
    return _Translation(model, data, conservative).done(path)


def still(model: Any) -> npt.NDArray[np.int64]:
    """Of every body the one it is welded to; 0 for what stands still, and for what only a program moves (mocap)."""
    weld = np.array(model.body_weldid, dtype=int)
    weld[np.asarray(model.body_mocapid)[weld] >= 0] = 0
    return weld


class _Translation:
    def __init__(self, model: Any, data: Any, conservative: bool) -> None:
        self.m, self.d, self.conservative = model, data, conservative
        self.light = LIGHTER if conservative else LIGHT
        self.weld = still(model)
        self.lacks = Lacks()
        self.bodies: list[RigidBody] = []
        self.forces: list[Force] = []
        self.constraints: list[Constraint] = []
        self.main: dict[int, RigidBody] = {}
        self.joints = [""] * model.njnt
        self.tied: set[frozenset[str]] = set()
        off = mujoco.mjtDisableBit
        self.off = int(model.opt.disableflags) | (
            int(
                off.mjDSBL_CONTACT
                | off.mjDSBL_LIMIT
                | off.mjDSBL_ACTUATION
                | off.mjDSBL_FRICTIONLOSS
                | off.mjDSBL_DAMPER
            )
            if conservative
            else 0
        )

    def done(self, path: Path | None) -> Translated:
        """The scene, if nothing is lacking."""
        m = self.m
        self.refuse_what_we_lack()
        self.drives = Drives(m, self.d, self.has("ACTUATION"), self.lacks)
        self.rails = Rails(m, self.d, self.light, self.lacks)
        for body in range(1, m.nbody):
            if self.weld[body] == body:
                self.body(body)
        for body in self.main:
            self.hang(body)
        self.pull()
        if self.has("EQUALITY") and self.has("CONSTRAINT"):
            for tie in range(m.neq):
                if m.eq_active0[tie]:
                    self.tie(tie)
        fixed: list[RigidBody] = []
        apart: list[tuple[str, str]] = []
        rubbing: list[PairFriction] = []
        touching = self.has("CONTACT") and self.has("CONSTRAINT")
        if touching:
            covered, fixed, apart, rubbing = surfaces(m, self.d, self.weld, self.main, self.tied, self.lacks)
            self.bodies = [part for one in self.bodies for part in covered.get(one.name, [one])]
            self.constraints += [
                Lock(name=f"{part.name} to {name}", between=(name, part.name), compliance=0.0)
                for name, parts in covered.items()
                for part in parts[1:]
            ]
        if self.lacks:
            raise NotSupported(
                f"spook does not support {self.lacks.sentence(texts_of(path) if path else None)}"
            )
        if not self.bodies:
            raise NotSupported("nothing in the model moves")
        scene = Scene(
            bodies=(*self.bodies, *fixed),
            constraints=tuple(self.constraints),
            forces=tuple(self.forces),
            gravity=tuple(np.asarray(m.opt.gravity) if self.has("GRAVITY") else np.zeros(3)),
            contacts=touching,
            no_contact=tuple(apart),
            pair_frictions=tuple(rubbing),
        )
        return Translated(
            scene,
            tuple(self.placed(body) for body in range(m.nbody)),
            {one.name: float(one.mass or 0.0) for one in self.main.values()},
            tuple(self.joints),
            self.drives,
            bool(self.rails.bodies),
        )

    def has(self, flag: str) -> bool:
        """Whether the file leaves that part of MuJoCo on."""
        return not self.off & int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag}"))

    def name(self, kind: str, number: int) -> str:
        """As the file has it, or kind and number."""
        found = mujoco.mj_id2name(self.m, getattr(mujoco.mjtObj, f"mjOBJ_{kind.upper()}"), number)
        return found if found and found != WORLD else f"{kind} {number}"

    def lack(self, what: str, kind: str, number: int) -> None:
        self.lacks.of(what, self.m, kind, number)

    def refuse_what_we_lack(self) -> None:
        """Parts of a model that would move something and that no scene of ours can say."""
        m = self.m
        for count, what in ((m.nflex, "soft bodies (flex)"), (m.nplugin, "plugins")):
            if count:
                self.lacks.add(what)
        if not self.conservative and (m.opt.density or m.opt.viscosity):
            for geom in map(int, np.flatnonzero(np.asarray(m.geom_fluid)[:, 0])):
                self.lack("a medium that acts by the shape of geoms (fluidshape)", "geom", geom)

    # Bodies

    def body(self, body: int) -> None:
        """All that is welded to it as one, in principal axes."""
        m, d = self.m, self.d
        parts = np.flatnonzero(self.weld == body)
        masses = np.asarray(m.body_mass)[parts]
        mass = float(masses.sum())
        name = self.name("body", body)
        if mass <= 0.0:
            self.lack("a moving body without mass", "body", body)
            return
        centre = masses @ d.xipos[parts] / mass
        turns = d.ximat[parts].reshape(-1, 3, 3)
        if len(parts) == 1:
            moments, axes = np.array(m.body_inertia[body]), turns[0]
        else:
            arms = d.xipos[parts] - centre
            tensor = np.einsum("pij,pj,pkj->ik", turns, np.asarray(m.body_inertia)[parts], turns)
            tensor += np.diag(np.full(3, masses @ (arms**2).sum(axis=1)))
            tensor -= np.einsum("p,pi,pj->ij", masses, arms, arms)
            moments, axes = np.linalg.eigh(tensor)
            axes[:, 2] *= np.sign(np.linalg.det(axes))
        speed, spin = self.speed(body, centre)
        made = RigidBody(
            name=name,
            position=tuple(centre),
            mass=mass,
            inertia=tuple(moments),
            orientation=_quaternion(axes),
            velocity=tuple(speed),
            angular_velocity=tuple(spin),
        )
        self.main[body] = made
        self.bodies.append(made)
        lifted = set(np.asarray(m.body_gravcomp)[parts[masses > 0.0]].tolist())
        if len(lifted) > 1:
            self.lack(
                "gravity compensation that is not the same in all that is welded together", "body", body
            )
        elif self.has("GRAVITY") and (share := lifted.pop()):
            up = -share * mass * np.asarray(m.opt.gravity)
            self.forces.append(Load(name=f"lift of {name}", body=name, force=tuple(up)))

    def speed(self, body: int, point: Array) -> tuple[Array, Array]:
        """Of a point of a body, and of its turning, in the world's axes."""
        spin, linear = self.d.cvel[body, :3], self.d.cvel[body, 3:]
        return linear + np.cross(spin, point - self.d.subtree_com[self.m.body_rootid[body]]), spin

    def placed(self, body: int) -> Placed:
        """The frame of a body of the file in what it is a part of."""
        place, turn = self.d.xpos[body], self.d.xmat[body].reshape(3, 3)
        whole = self.main.get(int(self.weld[body]))
        if whole is None:
            return Placed("", place.copy(), turn.copy())
        axes = matrix(whole.orientation)
        return Placed(whole.name, axes.T @ (place - whole.position), axes.T @ turn)

    # Joints

    def hang(self, body: int) -> None:
        """The joints of a body in their order, each carrying what comes after it."""
        m, d, child = self.m, self.d, self.main[body]
        above = self.main.get(int(self.weld[m.body_parentid[body]]))
        holder = above.name if above else WORLD
        numbers = range(m.body_jntadr[body], m.body_jntadr[body] + m.body_jntnum[body])
        if m.jnt_type[numbers[0]] == FREE:
            dof = m.jnt_dofadr[numbers[0]]
            if any(self.passive(numbers[0])[:2]) or (self.has("FRICTIONLOSS") and m.dof_frictionloss[dof]):
                self.lack("a free joint with springs, damping or friction", "joint", numbers[0])
            if m.dof_armature[dof]:
                self.lack("a free joint with armature", "joint", numbers[0])
            return
        self.tied.add(frozenset((holder, child.name)))
        parent = int(self.weld[m.body_parentid[body]])
        spin = d.cvel[parent, :3].copy() if parent else np.zeros(3)
        mass = float(child.mass or 0.0)
        reach = np.sqrt(max(child.inertia) / mass) + np.linalg.norm(d.xanchor[numbers[0]] - child.position)
        at, speed = d.xanchor[numbers[0]], np.zeros(3)
        if parent:
            speed = self.speed(parent, at)[0]
        for number in numbers:
            anchor, axis = d.xanchor[number], d.xaxis[number]
            speed, at = speed + np.cross(spin, anchor - at), anchor
            turning = self.qvel(number)
            if m.jnt_type[number] == SLIDE:
                speed = speed + axis * turning
            elif m.jnt_type[number] == HINGE:
                spin = spin + axis * turning
            end = child.name
            if number != numbers[-1]:
                end = f"{child.name} before joint {number + 1}"
                self.bodies.append(
                    RigidBody(
                        name=end,
                        position=tuple(anchor),
                        mass=self.light * mass,
                        inertia=(self.light * mass * reach**2,) * 3,
                        velocity=tuple(speed),
                        angular_velocity=tuple(spin),
                    )
                )
            self.joint(number, holder, end)
            holder = end

    def qvel(self, joint: int) -> float:
        return float(self.d.qvel[self.m.jnt_dofadr[joint]])

    def joint(self, number: int, holder: str, end: str) -> None:
        m, d = self.m, self.d
        name = f"joint {self.name('joint', number)}"
        self.joints[number] = name
        kind, dof = m.jnt_type[number], m.jnt_dofadr[number]
        at = tuple(d.xanchor[number])
        if kind == BALL:
            if (
                self.drives.of(number)
                or any(self.passive(number)[:2])
                or (m.jnt_limited[number] and self.has("LIMIT"))
            ):
                self.lack("a ball joint with springs, damping, limits or actuators", "joint", number)
            if m.dof_armature[dof] or (m.dof_frictionloss[dof] and self.has("FRICTIONLOSS")):
                self.lack("a ball joint with armature or friction", "joint", number)
            self.constraints.append(Ball(name=name, between=(holder, end), at=at, compliance=0.0))
            return
        here = float(d.qpos[m.jnt_qposadr[number]])
        form = Hinge if kind == HINGE else Prismatic
        limit = None
        if m.jnt_limited[number] and self.has("LIMIT"):
            limit = Limit(
                lower=m.jnt_range[number, 0] - here,
                upper=m.jnt_range[number, 1] - here,
                damping=relaxation(m.jnt_solref[number]),
            )
        self.constraints.append(
            form(
                name=name,
                between=(holder, end),
                at=at,
                axis=tuple(d.xaxis[number]),
                compliance=0.0,
                limit=limit,
                spring=self.spring(number, here),
                motor=Motor(force=self.drives.force(number, here)) if self.drives.of(number) else None,
                friction=float(m.dof_frictionloss[dof]) if self.has("FRICTIONLOSS") else 0.0,
                armature=float(m.dof_armature[dof]) + self.drives.armature(number),
            )
        )
        for actuator, arm in self.drives.bounded(number):
            stiff, pulls_to, damping, most = self.drives.servo(number, actuator, arm, here)
            if stiff <= 0.0 or damping < 0.0:
                self.lack(PUSHES_AWAY, "joint", number)
                continue
            servo = JointSpring(stiffness=stiff, rest=pulls_to, damping=damping / stiff, max_force=most)
            self.rails.add(servo_name(actuator), [(number, 1.0)], self.joints, spring=servo)

    def passive(self, number: int) -> tuple[float, float, float]:
        """Stiffness and damping of a joint by itself, and where its spring rests [m or rad]."""
        m = self.m
        dof = m.jnt_dofadr[number]
        for poly, what, part in (
            ("jnt_stiffnesspoly", number, "SPRING"),
            ("jnt_springyield", number, "SPRING"),
            ("dof_dampingpoly", dof, "DAMPER"),
        ):
            if self.has(part) and np.any(getattr(m, poly, np.zeros(m.nv))[what]):
                self.lack("springs or damping that are not linear", "joint", number)
        stiffness = float(m.jnt_stiffness[number]) if self.has("SPRING") else 0.0
        damping = float(m.dof_damping[dof]) if self.has("DAMPER") else 0.0
        return stiffness, damping, float(m.qpos_spring[m.jnt_qposadr[number]])

    def spring(self, number: int, here: float) -> JointSpring | None:
        """All that is linear in place and speed of a joint, as one row."""
        stiffness, damping, rest = self.passive(number)
        further, braking = self.drives.linear(number)
        pull = stiffness * (rest - here)
        whole, damping = stiffness + further, damping + braking
        if whole < 0.0 or damping < 0.0:
            self.lack(PUSHES_AWAY, "joint", number)
            return None
        if not whole and not damping:
            return None
        whole = whole or FADING * damping
        return JointSpring(stiffness=whole, rest=pull / whole, damping=damping / whole)

    def pull(self) -> None:
        """What acts on sums of joint coordinates: tendons, and servos of several joints."""
        m, d = self.m, self.d
        for tendon in range(m.ntendon):
            self.rails.tendon(tendon, self.name("tendon", tendon), self.has, self.joints, self.at_site)
        for actuator, arms in self.drives.servos.items():
            self.rails.add(
                servo_name(actuator),
                arms,
                self.joints,
                spring=self.drives.shared(actuator, float(d.actuator_length[actuator])),
                armature=self.drives.rotor(actuator),
            )
        self.bodies += self.rails.bodies
        self.constraints += self.rails.constraints

    def at_site(self, site: int) -> tuple[str, Array]:
        """The rigid body that carries a site, or the world, and where it is."""
        whole = self.main.get(int(self.weld[self.m.site_bodyid[site]]))
        return whole.name if whole else WORLD, self.d.site_xpos[site].copy()

    # Equality constraints

    def tie(self, tie: int) -> None:
        kind = int(self.m.eq_type[tie])
        if kind == JOINED:
            return self.couple(tie)
        if kind == OF_TENDONS:
            made = self.rails.tie(tie, self.joints, APART)
            return (
                self.lack(made, "equality", tie) if isinstance(made, str) else self.constraints.append(made)
            )
        if kind not in (CONNECTED, WELDED):
            return self.lack(f"equality constraints of kind {_word(mujoco.mjtEq(kind))}", "equality", tie)
        (one, here, axes), (two, there, others) = self.ends(tie)
        gap = float(np.linalg.norm(here - there))
        bend = float(np.abs(axes - others).max()) if kind == WELDED else 0.0
        if gap > APART * self.m.stat.extent or bend > APART:
            return self.lack(f"a tie that starts {gap:.3g} m apart or bent by {bend:.3g}", "equality", tie)
        first, second = (self.main.get(int(self.weld[body])) for body in (one, two))
        if first is second:
            return None
        ends = (first.name if first else WORLD, second.name if second else WORLD)
        if ends[1] == WORLD:
            ends = (WORLD, ends[0])
        form = Ball if kind == CONNECTED else Lock
        self.constraints.append(
            form(name=f"equality {self.name('equality', tie)}", between=ends, at=tuple(here))
        )
        return None

    def ends(self, tie: int) -> Iterator[tuple[int, Array, Array]]:
        """Body, place and axes of both ends, which a tie that holds makes one."""
        m, d = self.m, self.d
        one, two, data = int(m.eq_obj1id[tie]), int(m.eq_obj2id[tie]), np.asarray(m.eq_data[tie])
        if int(m.eq_objtype[tie]) == int(mujoco.mjtObj.mjOBJ_SITE):
            for site in (one, two):
                yield int(m.site_bodyid[site]), d.site_xpos[site], d.site_xmat[site].reshape(3, 3)
            return
        axes = [d.xmat[body].reshape(3, 3) for body in (one, two)]
        if int(m.eq_type[tie]) == CONNECTED:
            yield one, d.xpos[one] + axes[0] @ data[:3], axes[0]
            yield two, d.xpos[two] + axes[1] @ data[3:6], axes[1]
            return
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, data[6:10])
        yield one, d.xpos[one] + axes[0] @ data[3:6], axes[0] @ turn.reshape(3, 3)
        yield two, d.xpos[two] + axes[1] @ data[:3], axes[1]

    def couple(self, tie: int) -> None:
        """q1 − q1₀ = c₀ + c₁ (q2 − q2₀): a gear."""
        m, d = self.m, self.d
        one, two, c = int(m.eq_obj1id[tie]), int(m.eq_obj2id[tie]), np.asarray(m.eq_data[tie])[:5]
        moved = [
            float((d.qpos - m.qpos0)[m.jnt_qposadr[joint]]) if joint >= 0 else 0.0 for joint in (one, two)
        ]
        if two < 0 or np.any(c[2:]) or not c[1]:
            return self.lack("a joint that is tied to no other, or by a curve", "equality", tie)
        if abs(gap := moved[0] - c[0] - c[1] * moved[1]) > APART:
            return self.lack(f"a tie of joints that starts {gap:.3g} m or rad off", "equality", tie)
        self.constraints.append(
            Relation(
                name=f"equality {self.name('equality', tie)}",
                terms=((self.joints[one], 1.0), (self.joints[two], -float(c[1]))),
                damping=relaxation(m.eq_solref[tie]),
            )
        )
        return None


def _word(value: Any) -> str:
    """mjEQ_TENDON -> tendon."""
    return str(value.name).rpartition("_")[2].lower()


def _quaternion(axes: Array) -> Rotation:
    found = np.zeros(4)
    mujoco.mju_mat2Quat(found, np.ascontiguousarray(axes).ravel())
    w, x, y, z = (found / np.linalg.norm(found)).tolist()
    return w, x, y, z


def matrix(turn: Any) -> Array:
    found = np.zeros(9)
    mujoco.mju_quat2Mat(found, np.asarray(turn))
    return found.reshape(3, 3)
