"""Newton, by its Python package: six solvers of NVIDIA's, DeepMind's and Disney's engine on one model, on Warp's CPU device.

A body that joints reach hangs in an articulation, what closes a loop stays a joint of its own. A rod between point masses
is a hinge or a ball joint in joint coordinates and a distance for XPBD; the other solvers leave distances free. Materials
are the package's own but for friction and restitution. Steps are replayed as a graph, unless something pushes that
depends on where bodies are. Compilation counts as setting up.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np

from ..bodies import WORLD, Particle, RigidBody
from ..build_info import BuildInfo
from ..forces import CentralGravity, Load, Spring
from ..joints import Ball, Constraint, Distance, Hinge, Joint, Lock, Prismatic
from ..observe import ContactCount, ContactForce, Penetration
from ..protocol import Capabilities, Configuration, NotSupported, Task, Worlds
from ..recorded_joints import conjugate, product, turned
from ..recording import Recording
from ..result import Array
from ..shapes import Box, Capsule, Cylinder, Plane, Sphere
from . import joint_tree
from .described import upwards
from .frames import End, along, ends_of, xyzw
from .pushes import Pushes
from .stepped import Kept, stepped
from .surfaces import one_friction, one_restitution, pairs_apart
from .warp_graph import DEVICE, MADE, overflowed, replayed, room, silent

with silent():
    import newton
    import warp

POINT_INERTIA = 1e-6  # kg m²: Newton wants one of every body; 1 of a point mass that nothing turns
GAP = 1e-3  # m, as in the example of a cradle: from how far off contacts are looked at, in place of 0.1
TREES = ("SolverMuJoCo", "SolverFeatherstone")  # in joint coordinates, where a hinge can stand for a rod
FORCES = (
    "SolverMuJoCo",
    "SolverXPBD",
    "SolverVBD",
    "SolverKamino",
)  # that show those of contacts through Newton's containers
FINDS_CONTACTS = ("SolverMuJoCo", "SolverKamino")  # itself; the others are told by Newton's pipeline
OF_ITS_OWN = ("SolverMuJoCo", "SolverKamino")  # attributes of bodies and surfaces
HARD = (0.9999, 0.9999, 0.001, 0.5, 2.0)  # as hard as MuJoCo's contacts get: those of our adapter of MuJoCo
NO_BOUNCE = ("restitution",)


class Newton:
    """The adapter."""

    name = "newton"
    capabilities = Capabilities(
        shapes=frozenset({Sphere, Box, Capsule, Cylinder, Plane}),
        joints=frozenset({Distance, Lock, Ball, Hinge, Prismatic}),
        forces=frozenset({CentralGravity, Load, Spring}),
        shows=frozenset({ContactForce, ContactCount, Penetration}),
        friction=True,
        restitution=True,
        limits=True,
        springs_aside=True,
    )
    configurations = (
        Configuration(
            name="mujoco",
            reason="SolverMuJoCo, MuJoCo's equations as MuJoCo Warp has them: Runge-Kutta of order 4, elliptic cones and "
            "impratio 100 as in Newton's examples of legged robots, contacts as hard as they get (solimp 0.9999)",
            expected_order=4.0,
            options={
                "solver": "SolverMuJoCo",
                "of": {"integrator": "rk4", "cone": "elliptic", "impratio": 100.0, "iterations": 100},
            },
            lacks=NO_BOUNCE,
        ),
        Configuration(
            name="featherstone",
            reason="SolverFeatherstone: joint coordinates, symplectic Euler, contacts are springs of the package's stiffness; 20 "
            "substeps and no angular damping as in its example of a cradle",
            expected_order=1.0,
            options={"solver": "SolverFeatherstone", "of": {"angular_damping": 0.0}, "substeps": 20},
            lacks=("loops", *NO_BOUNCE),
        ),
        Configuration(
            name="xpbd",
            reason="SolverXPBD: positions corrected in turn; 10 substeps of 10 iterations and restitution as in that example",
            expected_order=1.0,
            options={
                "solver": "SolverXPBD",
                "of": {"iterations": 10, "enable_restitution": True},
                "substeps": 10,
            },
        ),
        Configuration(
            name="semi-implicit",
            reason="SolverSemiImplicit: joints and contacts are springs of the package's stiffness; 16 substeps as in its "
            "example of a soft body, no angular damping",
            expected_order=1.0,
            options={"solver": "SolverSemiImplicit", "of": {"angular_damping": 0.0}, "substeps": 16},
            lacks=NO_BOUNCE,
        ),
        Configuration(
            name="kamino",
            reason="SolverKamino (beta): hard constraints and contacts at once by proximal ADMM to 1e-6, stepped at the "
            "midpoint (moreau) as in Newton's example of a pyramid",
            expected_order=2.0,
            options={"solver": "SolverKamino", "of": {}},
        ),
        Configuration(
            name="vbd",
            reason="SolverVBD: augmented vertex block descent, 10 substeps of 10 iterations as in the example of a cradle",
            expected_order=1.0,
            options={"solver": "SolverVBD", "of": {"iterations": 10}, "substeps": 10},
            lacks=NO_BOUNCE,
        ),
    )

    def build_info(self) -> BuildInfo:
        try:
            beside = f", beside mujoco-warp {version('mujoco-warp')} and mujoco {version('mujoco')}"
        except PackageNotFoundError:
            beside = ""
        return BuildInfo(self.name, version("newton"), "", False, "", (), MADE + beside, "")

    def record(self, task: Task) -> Recording:
        with silent():
            began = time.perf_counter()
            world = _World(task)
            world.replay()
            return stepped(task, world.step, world.read, time.perf_counter() - began, world.health)

    def worlds(self, task: Task, count: int) -> Worlds:
        """Copies of the scene in one model, which do not touch each other."""
        with silent():
            began = time.perf_counter()
            world = _World(task, count)
            if world.pushes:
                raise NotSupported("our adapter cannot ask newton for forces in many worlds")
            world.replay()
            setup, began = time.perf_counter() - began, time.perf_counter()
            world.step(task.steps)
            took, places = time.perf_counter() - began, world.states[0].body_q.numpy()[:, :3]
            fixed = [body.position for body in task.scene.bodies]
            found = np.tile(np.array(fixed, dtype=float), (count, 1, 1))
            moving = [world.bodies[body.name] for body in task.scene.bodies]
            for k, index in enumerate(moving):
                if index != -1:
                    found[:, k] = places.reshape(count, -1, 3)[:, index]
            return Worlds(positions=found, seconds=took, setup_seconds=setup)


class _World:
    """One model in one solver, and what is read off it; or so many copies of it."""

    def __init__(self, task: Task, count: int = 1) -> None:
        self.task, self.scene = task, task.scene
        options = task.configuration.options
        self.kind, self.substeps = options["solver"], options.get("substeps", 1)
        if task.contacts and self.kind not in FORCES:
            raise NotSupported(f"newton ({task.configuration.name}) does not show contacts")
        self.pushes = Pushes(self.scene)
        self.builder = newton.ModelBuilder(gravity=self.scene.gravity)
        self.builder.rigid_gap = GAP
        make: Any = getattr(newton.solvers, self.kind)
        if self.kind in OF_ITS_OWN:
            make.register_custom_attributes(self.builder)
        self.bodies: dict[str, int] = {}  # by name; what does not move is part of the world
        self.shapes: dict[str, int] = {}
        self._grow()
        if self.scene.contacts:
            self._clothe()
        if count > 1:
            one, self.builder = self.builder, newton.ModelBuilder(gravity=self.scene.gravity)
            if self.kind in OF_ITS_OWN:
                make.register_custom_attributes(self.builder)
            self.builder.replicate(one, count)
        self.count = count
        self.builder.color()
        self.model = self.builder.finalize(device=DEVICE)
        self._set_going()
        try:
            self.solver = make(self.model, **self._settings(options["of"]))
        except ImportError as error:
            raise NotSupported(
                f"newton ({task.configuration.name}) needs a package that is not installed: {error}"
            ) from None
        except (ValueError, NotImplementedError) as error:
            raise NotSupported(
                f"newton ({task.configuration.name}) refuses the model: {' '.join(str(error).split())[:200]}"
            ) from None
        self.states = [self.model.state(), self.model.state()]
        self.control = self.model.control()
        self.pushed = warp.zeros(len(self.bodies), dtype=warp.spatial_vector)
        self.pipeline: Any = None
        self.contacts: Any = None
        self.seen: Any = None
        if self.scene.contacts and self.shapes:
            if self.kind in FINDS_CONTACTS:
                own = self.kind == "SolverMuJoCo"
                room = self.solver.get_max_contact_count() if own else self.model.rigid_contact_max
                self.contacts = newton.Contacts(room, 0)
            else:
                self.pipeline = newton.CollisionPipeline(self.model)
                self.contacts = self.pipeline.contacts()
            if task.contacts:
                self.seen = self.solver.observables({"contact_f"}, contacts=self.contacts)
        self.launch: Callable[[], None] = self.advance

    def _settings(self, options: dict[str, Any]) -> dict[str, Any]:
        """Of the solver: MuJoCo's guess of room is too small for a stack of ten, Kamino has a page of its own for them."""
        if self.kind == "SolverMuJoCo":
            bodies = len(self.bodies) if self.scene.contacts else 0
            return options | room(bodies, 6 * len(self.bodies))
        if self.kind != "SolverKamino":
            return options
        config = newton.solvers.SolverKamino.Config.from_model(self.model)
        config.use_collision_detector, config.integrator = True, "moreau"
        return {"config": config}

    def _grow(self) -> None:
        """All bodies and joints, parents first; what closes a loop comes last."""
        nodes = joint_tree.grown(self.scene)
        self.normal = joint_tree.plane_of_motion(self.scene)
        self.bodies = {name: -1 for name, node in nodes.items() if joint_tree.fixed(node.body)}
        ends = {None, WORLD, *self.bodies}
        roots = [name for name, node in nodes.items() if name not in self.bodies and node.parent in ends]
        for root in roots:
            joints = []
            for name in joint_tree.below(nodes, root):
                swings = nodes[name].tie is not None or bool(nodes[name].children)
                self.bodies[name] = self._link(nodes[name].body, POINT_INERTIA if swings else 1.0)
                joints.append(self._tie(name, nodes[name]))
            self.builder.add_articulation(joints)
        for constraint in joint_tree.closing(self.scene, nodes):
            first, second = (end if isinstance(end, str) else WORLD for end in constraint.between)
            forwards = self._index(second) != -1
            self._join(constraint, *((first, second) if forwards else (second, first)))
        self.turning = joint_tree.spins(self.scene, nodes)

    def _index(self, name: str) -> int:
        return self.bodies.get(name, -1)

    def _link(self, body: Particle | RigidBody, point_inertia: float) -> int:
        inertia = 3 * (point_inertia,) if isinstance(body, Particle) else body.inertia
        turn = joint_tree.turn_of(body)
        return int(
            self.builder.add_link(
                xform=_pose(body.position, turn),
                mass=body.mass,
                inertia=np.diag(np.array(inertia, dtype=float)),
                lock_inertia=True,
            )
        )

    def _tie(self, name: str, node: joint_tree.Node) -> int:
        """The joint that a body hangs on."""
        if node.tie is None:
            return int(self.builder.add_joint_free(self.bodies[name]))
        return self._join(node.tie, node.parent or WORLD, name)

    def _join(self, constraint: Constraint, parent: str, child: str) -> int:
        ends = {"parent": self._index(parent), "child": self._index(child)}
        if isinstance(constraint, Distance):
            return self._rod(constraint, child, ends)
        assert isinstance(constraint, Joint)
        frames = ends_of(self.scene, constraint)
        here, there = frames if constraint.between[1] == child else frames[::-1]
        if ends["parent"] == -1 and parent != WORLD:
            place = self.scene.body(parent)
            here = _in_world(here, place)
        places = {"parent_xform": _pose(here.point, here.turn), "child_xform": _pose(there.point, there.turn)}
        if isinstance(constraint, Hinge | Prismatic):
            hinge = isinstance(constraint, Hinge)
            add = self.builder.add_joint_revolute if hinge else self.builder.add_joint_prismatic
            return int(add(**ends, **places, axis=(1.0, 0.0, 0.0), **self._stops(constraint, child)))
        add = self.builder.add_joint_ball if isinstance(constraint, Ball) else self.builder.add_joint_fixed
        return int(add(**ends, **places))

    def _stops(self, joint: Hinge | Prismatic, child: str) -> dict[str, float]:
        """The limits of a joint's coordinate, which are the package's springs; for XPBD hard ones."""
        limit = joint.limit
        if limit is None:
            return {}
        if limit.restitution:
            raise NotSupported("our adapter cannot ask newton for stops that return")
        sign = 1.0 if joint.between[1] == child else -1.0
        lower, upper = sorted((sign * limit.lower, sign * limit.upper))
        return {"limit_lower": lower, "limit_upper": upper}

    def _rod(self, rod: Distance, child: str, ends: dict[str, int]) -> int:
        """A distance for XPBD, in joint coordinates a hinge, or where the motion is in no plane a ball joint."""
        here, there = (
            np.array(self.scene.anchor(rod, k)) for k in ((0, 1) if rod.between[1] == child else (1, 0))
        )
        parent = next(
            (self.scene.body(n) for n, k in self.bodies.items() if k == ends["parent"] and k != -1), None
        )
        below = self.scene.body(child)
        if self.kind == "SolverXPBD":
            length = self.scene.length(rod) if rod.rest_length is None else rod.rest_length
            places = {"parent_xform": _place(here, parent), "child_xform": _place(there, below)}
            return int(
                self.builder.add_joint_distance(**ends, **places, min_distance=length, max_distance=length)
            )
        if (
            self.kind not in TREES
            or self._index(child) in self.builder.joint_child
            or not isinstance(below, Particle)
        ):
            raise NotSupported(
                f"newton ({self.task.configuration.name}) leaves distances free, but for rods of a tree"
            )
        axes = along((0.0, 0.0, 1.0) if self.normal is None else _three(self.normal))
        places = {"parent_xform": _place(here, parent, axes), "child_xform": _place(here, below, axes)}
        if self.normal is None:
            return int(self.builder.add_joint_ball(**ends, **places))
        return int(self.builder.add_joint_revolute(**ends, **places, axis=(1.0, 0.0, 0.0)))

    def _clothe(self) -> None:
        """The surfaces, and which pairs must not touch."""
        config = newton.ModelBuilder.ShapeConfig(
            density=0.0,
            mu=one_friction(self.scene, "newton"),
            restitution=one_restitution(self.scene, "newton"),
            mu_rolling=0.0,
            mu_torsional=0.0,
        )
        for body in self.scene.bodies:
            if isinstance(body, RigidBody) and body.shape is not None:
                self.shapes[body.name] = self._shape(body, config)
        for a, b in pairs_apart(self.scene):
            self.builder.add_shape_collision_filter_pair(self.shapes[a], self.shapes[b])

    def _shape(self, body: RigidBody, config: Any) -> int:
        shape, index = body.shape, self.bodies[body.name]
        turn = np.array(body.orientation) if index == -1 else joint_tree.UPRIGHT
        place = body.position if index == -1 else (0.0, 0.0, 0.0)
        common = {"body": index, "xform": _pose(place, turn), "cfg": config}
        if self.kind == "SolverMuJoCo":
            common["custom_attributes"] = {"mujoco:geom_solimp": HARD}
        if isinstance(shape, Plane):
            common["xform"] = _pose(place, product(turn, upwards(shape.normal)))
            return int(self.builder.add_shape_plane(**common, width=0.0, length=0.0))
        if isinstance(shape, Sphere):
            return int(self.builder.add_shape_sphere(**common, radius=shape.radius))
        if isinstance(shape, Box):
            hx, hy, hz = (0.5 * edge for edge in shape.size)
            return int(self.builder.add_shape_box(**common, hx=hx, hy=hy, hz=hz))
        assert isinstance(shape, Capsule | Cylinder)
        add = (
            self.builder.add_shape_capsule if isinstance(shape, Capsule) else self.builder.add_shape_cylinder
        )
        return int(add(**common, radius=shape.radius, half_height=0.5 * shape.length))

    def _set_going(self) -> None:
        """Speeds of bodies, and of joints from them."""
        speeds = np.zeros((len(self.model.body_qd) // self.count, 6), dtype=np.float32)
        for body in self.scene.bodies:
            if (index := self.bodies[body.name]) != -1:
                speeds[index] = (*body.velocity, *self.turning[body.name])
        if len(speeds):
            self.model.body_qd.assign(np.tile(speeds, (self.count, 1)))
            newton.eval_ik(self.model, self.model, self.model.joint_q, self.model.joint_qd)

    # its steps

    def advance(self) -> None:
        """One step in the first of the states, or, of a step with substeps, two of these."""
        here, there = self.states
        more = {} if self.seen is None else {"observables": self.seen}
        for _ in range(min(2, self.substeps)):
            if self.pushes:
                warp.copy(here.body_f, self.pushed)
            else:
                here.clear_forces()
            if self.pipeline is not None:
                self.pipeline.collide(here, self.contacts)
            self.solver.step(
                here, there, self.control, self.contacts, self.task.time_step / self.substeps, **more
            )
            here, there = there, here
        if self.substeps == 1:
            there.assign(here)

    def replay(self) -> None:
        """From now on the same as a graph."""
        self.launch = replayed(self.advance)

    def step(self, count: int) -> None:
        """The steps, and before each what pushes."""
        for _ in range(count):
            if self.pushes:
                self._push()
            for _ in range(max(1, self.substeps // 2)):
                self.launch()

    def _push(self) -> None:
        where, turns, speeds, spins = self._bodies()
        forces, torques = self.pushes.at(where, speeds, turns, spins)
        pushed = self.pushed.numpy()  # on the CPU the memory itself
        for k, body in enumerate(self.scene.bodies):
            if (index := self.bodies[body.name]) != -1:
                pushed[index] = (*forces[k], *torques[k])

    # what it came to

    def _bodies(self) -> tuple[Array, Array, Array, Array]:
        """Positions, orientations, velocities and spins, in the scene's order."""
        state, n = self.states[0], len(self.scene.bodies)
        poses, twists = (state.body_q.numpy(), state.body_qd.numpy()) if len(self.model.body_q) else ((), ())
        where, turns, speeds, spins = np.empty((n, 3)), np.empty((n, 4)), np.zeros((n, 3)), np.zeros((n, 3))
        for k, body in enumerate(self.scene.bodies):
            index = self.bodies[body.name]
            if index == -1:
                where[k], turns[k] = body.position, joint_tree.turn_of(body)
                continue
            where[k], (x, y, z, w) = poses[index][:3], poses[index][3:]
            speeds[k], spins[k] = twists[index][:3], twists[index][3:]
            turns[k] = w, x, y, z
            if isinstance(body, Particle):
                turns[k], spins[k] = joint_tree.UPRIGHT, 0.0
        return where, turns, speeds, spins

    def health(self) -> str:
        """Nothing, or that a value is not finite, or what there was no room for."""
        finite = np.isfinite(self.states[0].body_q.numpy()).all()
        if finite and self.kind == "SolverMuJoCo":
            return overflowed(self.solver.mjw_data)
        return "" if finite else "a value is not finite"

    def read(self, keep: Kept, row: int, sample: int) -> None:
        keep.positions[row], keep.orientations[row], keep.velocities[row], keep.spins[row] = self._bodies()
        if self.seen is not None and sample:
            self._read_contacts(keep, row)

    def _read_contacts(self, keep: Kept, row: int) -> None:
        told, names = self.contacts, {index: name for name, index in self.shapes.items()}
        owners, poses = self.model.shape_body.numpy(), self.states[0].body_q.numpy()
        forces = self.seen.contact_f.numpy()
        for k in range(int(told.rigid_contact_count.numpy()[0])):
            pair = [int(getattr(told, f"rigid_contact_shape{end}").numpy()[k]) for end in (0, 1)]
            points = [
                _carried(
                    poses[owners[shape]] if owners[shape] != -1 else None,
                    getattr(told, f"rigid_contact_point{end}").numpy()[k],
                )
                for end, shape in enumerate(pair)
            ]
            thick = sum(float(getattr(told, f"rigid_contact_margin{end}").numpy()[k]) for end in (0, 1))
            apart = float((points[1] - points[0]) @ told.rigid_contact_normal.numpy()[k]) - thick
            keep.contacts[row] += apart <= 0.0
            keep.depths[row] = max(keep.depths[row], -apart)
            keep.pair((names[pair[0]], names[pair[1]]))[row] += forces[k][:3]


def _three(values: Array) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z


def _pose(point: Any, turn: Array) -> Any:
    return warp.transform(_three(point), xyzw(turn))


def _place(point: Array, body: Particle | RigidBody | None, turn: Array = joint_tree.UPRIGHT) -> Any:
    """A place of the world at the start, in the axes of a body."""
    if body is None:
        return _pose(point, turn)
    mine = conjugate(joint_tree.turn_of(body))
    return _pose(turned(mine, point - np.array(body.position)), product(mine, turn))


def _in_world(end: End, body: Any) -> End:
    """Of a body that does not move."""
    turn = np.array(body.orientation)
    return End(_three(np.array(body.position) + turned(turn, np.array(end.point))), product(turn, end.turn))


def _carried(pose: Any, point: Array) -> Array:
    if pose is None:
        return np.array(point, dtype=float)
    x, y, z, w = (float(part) for part in pose[3:])
    return np.array(pose[:3]) + turned(np.array([w, x, y, z]), np.array(point, dtype=float))


ENGINE = Newton()
