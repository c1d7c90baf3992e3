"""How bodies stand, slide, roll, rebound and fall over by statics, Coulomb's law and Gauss' principle of least constraint."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import nnls

from spook_tracker.engine import ConvexHull, Hinge, Lock, RigidBody, Scene
from spook_tracker.scalar_tests.standing import Robot
from spook_tracker.scalar_tests.thesis.door.scene import least_norm_forces
from spook_tracker.scalar_tests.vehicles import rover
from tests.oracles import constrained
from tests.oracles.ideal_motions import Found

NONE = 1e-9  # m and m/s²: what is no distance, and no acceleration


def standing(scene: Scene, times: np.ndarray) -> np.ndarray:
    """Where all began, (s, n, 3) m."""
    return np.tile([body.position for body in scene.bodies], (len(times), 1, 1))


def at_rest(scene: Scene, times: np.ndarray) -> Found:
    """What stands, and the hinges of a door, which share its load by least norm."""
    forces = {}
    hinges = [joint for joint in scene.constraints if isinstance(joint, Hinge)]
    if hinges:
        for hinge, force in zip(hinges, least_norm_forces(len(hinges), scene.bodies[0].mass), strict=True):
            forces[hinge.name] = np.tile(force, (len(times), 1))
    return {"positions": standing(scene, times), "constraint_forces": forces}


def on_a_slope(scene: Scene, times: np.ndarray) -> Found:
    """It stands where the slope's tangent is no more than µ, and slides by what is left of gravity; the plane is body 0."""
    box, pull = scene.bodies[1], np.array(scene.gravity)
    normal, along = -pull[2], np.hypot(pull[0], pull[1])
    friction = box.material.friction
    way = np.array([pull[0], pull[1], 0.0]) / along if along > 0.0 else np.zeros(3)
    held = min(along, friction * normal)
    t = times[:, None, None]
    each = np.array([[0.0], [1.0]]) * way * (along - held)
    force = box.mass * np.append(-held * way[:2], normal)
    return {
        "positions": standing(scene, times) + 0.5 * each * t**2,
        "velocities": each * t,
        "contact_forces": {("box", "plane"): np.tile(force, (len(t), 1))},
    }


def on_each_other(scene: Scene, times: np.ndarray) -> Found:
    """Bodies at rest from below: each is carried by the one before it, with all that lies on it."""
    masses = np.array([body.mass for body in scene.bodies[1:]])
    loads = np.cumsum(masses[::-1])[::-1, None] * -np.array(scene.gravity)
    names = [body.name for body in scene.bodies]
    return {
        "positions": standing(scene, times),
        "contact_forces": {
            (above, below): np.tile(load, (len(times), 1))
            for above, below, load in zip(names[1:], names, loads, strict=False)
        },
    }


def bouncing(scene: Scene, times: np.ndarray) -> Found:
    """A ball thrown up or let go above a plane: parabolas, each e times as long as the one before, until all are over."""
    ball, g = scene.bodies[1], -scene.gravity[2]
    height, back = ball.position[2] - ball.shape.radius, ball.material.restitution
    first = math.sqrt(ball.velocity[2] ** 2 + 2.0 * g * height)
    places = standing(scene, times)
    for row, time in enumerate(times):
        begins, speed = (ball.velocity[2] - first) / g, first  # as if it had come up from the plane
        while speed > NONE and back > 0.0 and time > begins + 2.0 * speed / g:
            begins, speed = begins + 2.0 * speed / g, back * speed
        since = time - begins
        over = speed <= NONE or since > 2.0 * speed / g
        places[row, 1, 2] = ball.shape.radius + (0.0 if over else speed * since - 0.5 * g * since**2)
    return {"positions": places}


def one_blow(scene: Scene, times: np.ndarray) -> Found:
    """A ball that meets a plane at the start: Newton's law along the normal; its slip turns round, or Coulomb's bound is less."""
    ball = scene.bodies[1]
    at, along = np.array(ball.velocity), np.array([ball.velocity[0], ball.velocity[1], 0.0])
    surface, way = ball.material, along / np.linalg.norm(along)
    push = -(1.0 + surface.restitution) * at[2]
    stops = (1.0 + surface.tangential_restitution) * np.linalg.norm(along) * 2.0 / 7.0
    drag = min(surface.friction * push, stops)
    velocity = at + push * np.array([0.0, 0.0, 1.0]) - drag * way
    spin = 2.5 * drag / ball.shape.radius * np.cross([0.0, 0.0, 1.0], way)
    moves = (times > 0.0)[:, None, None] * np.array([[0.0], [1.0]])
    return {
        "positions": standing(scene, times) + moves * velocity * times[:, None, None],
        "velocities": moves * velocity,
        "angular_velocities": moves * spin,
    }


def rolling(scene: Scene, times: np.ndarray) -> Found:
    """A solid ball from rest on a plane that is steep enough to make it roll, and no more."""
    ball, (pull, _, down) = scene.bodies[1], scene.gravity
    assert pull <= 3.5 * ball.material.friction * -down
    each = np.array([[0.0], [1.0]]) * np.array([5.0 / 7.0 * pull, 0.0, 0.0])
    t = times[:, None, None]
    spin = each[:, [1, 0, 2]] / ball.shape.radius
    return {
        "positions": standing(scene, times) + 0.5 * each * t**2,
        "velocities": each * t,
        "angular_velocities": spin * t,
    }


def between_fingers(scene: Scene, times: np.ndarray) -> Found:
    """Two fingers that press with the same force hold up to 2 µ of it; what is beyond falls."""
    held, load = scene.bodies[0], scene.forces[0]
    carried = 2.0 * held.material.friction * abs(load.force[0]) / held.mass
    gain = min(0.0, scene.gravity[2] + carried)
    each = np.zeros((len(scene.bodies), 3))
    each[0, 2] = gain
    t = times[:, None, None]
    return {"positions": standing(scene, times) + 0.5 * each * t**2, "velocities": each * t}


def on_feet(robot: Robot) -> Callable[[Scene, np.ndarray], Found]:
    """A robot in a pose of balance stands there, its feet and joints with the loads of statics."""

    def form(scene: Scene, times: np.ndarray) -> Found:
        pairs = zip(robot.joints, robot.torques().values(), strict=True)
        turning = {
            joint.name: np.concatenate((np.zeros(3), torque * np.array(joint.axis)))
            for joint, torque in pairs
        }
        return {
            "positions": standing(scene, times),
            "contact_forces": {
                (foot, "floor"): np.tile(f, (len(times), 1)) for foot, (_, f) in robot.feet.items()
            },
            "constraint_forces": {name: np.tile(force, (len(times), 1)) for name, force in turning.items()},
        }

    return form


def up_steps(scene: Scene, times: np.ndarray) -> Found:
    """Spinning wheels drive with µ g up to ω r; what is past the edge of a step is up there."""
    v, places = rover, standing(scene, times)
    spun = v.SPEED / (v.FRICTION * v.GRAVITY)
    way = np.where(times < spun, 0.5 * v.FRICTION * v.GRAVITY * times**2, v.SPEED * (times - 0.5 * spun))
    velocities = np.zeros_like(places)
    for k, body in enumerate(scene.bodies):
        if body.motion == "dynamic":
            places[:, k, 0] += way
            velocities[:, k, 0] = v.speeds(times)
            places[:, k, 2] += sum(v.STEP * (places[:, k, 0] > v.FIRST + v.DEEP * step) for step in range(2))
    share = np.tile((0.0, 0.0, v.WEIGHT / len(v.WHEELS)), (len(times), 1))
    forces = {(wheel, "floor"): share for wheel in v.WHEELS}
    return {
        "positions": places,
        "velocities": velocities,
        "contact_forces": forces,
        "penetration": np.zeros(len(times)),
    }


def on_a_turntable(scene: Scene, times: np.ndarray) -> Found:
    """A box rides where µ g holds it on its circle, and else slips against the table with µ g, outwards at first."""
    surface, g = scene.bodies[0], -scene.gravity[2]
    rate, places = surface.angular_velocity[2], standing(scene, times)
    for k, box in enumerate(scene.bodies[1:], 1):
        held = g * math.sqrt(box.material.friction * surface.material.friction)
        start = complex(*box.position[:2])
        path = start * np.exp(1j * rate * times)
        if held < rate**2 * abs(start):
            path = _slipping(start, rate, held, times)
        places[:, k, :2] = np.stack([path.real, path.imag], axis=1)
    return {"positions": places}


def _slipping(start: complex, rate: float, held: float, times: np.ndarray) -> Any:
    """From rest on the table, in its own axes: ẍ = Ω² x − 2 i Ω ẋ − µ g ẋ/|ẋ|."""

    def slope(_: float, state: np.ndarray) -> np.ndarray:
        x, v = state
        way = v / abs(v) if abs(v) > 1e-12 else x / abs(x)
        return np.array([v, rate**2 * x - 2j * rate * v - held * way])

    found = solve_ivp(slope, (0.0, times[-1]), np.array([start, 0j]), "DOP853", times, rtol=1e-10, atol=1e-12)
    return found.y[0] * np.exp(1j * rate * times)


def masonry(scene: Scene, times: np.ndarray) -> Found:
    """Wedges that touch along joints through the origin, in the plane y = 0: they stand, or fall on the hinges that stay closed.

    Gauss: of all accelerations that part no joint's edges, those nearest to free fall, M-weighed. Its multipliers are pushes
    within the cone of friction, so that nothing slides if none of them is on its side. Then the stones are a linkage.
    """
    stones = [body for body in scene.bodies if body.motion == "dynamic"]
    edges = list(_edges(scene))
    index = {body.name: k for k, body in enumerate(stones)}
    root = np.array([(s.mass**-0.5, s.mass**-0.5, _inertia(s) ** -0.5) for s in stones])
    free = np.zeros((len(stones), 3))
    free[:, 1] = scene.gravity[2]
    for load in scene.forces:
        free[index[load.body], :2] += np.array(load.force)[[0, 2]] / stones[index[load.body]].mass
    columns, touched = [], []
    for first, second, at in edges:
        radial = at / np.linalg.norm(at)
        across = np.array([-radial[1], radial[0]])  # towards the left, where the first is
        motion = np.zeros(
            (2, len(stones), 3)
        )  # of the first's edge less the second's, for a unit of each freedom
        for name, sign in ((first, 1.0), (second, -1.0)):
            if name in index:
                arm = at - np.array(stones[index[name]].position)[[0, 2]]
                motion[:, index[name]] = sign * np.array([[1.0, 0.0, -arm[1]], [0.0, 1.0, arm[0]]])
        touched.append(motion)
        friction = scene.body(first).material.friction
        columns += [
            np.einsum("ink,i->nk", motion, across + side * friction * radial) * root for side in (1.0, -1.0)
        ]
    pushes, _ = nnls(np.stack([c.ravel() for c in columns], axis=1), -(free / root).ravel(), maxiter=10000)
    change = free + root * np.einsum("cnk,c->nk", np.array(columns), pushes)
    closed = [np.abs(np.einsum("ink,nk->i", motion, change)).max() < NONE for motion in touched]
    if all(closed):
        return {"positions": standing(scene, times)}
    sides = pushes.reshape(-1, 2)
    assert all(stays for stays, side in zip(closed, sides, strict=True) if side.any())
    joints: list[Hinge | Lock] = []
    for pair, group in itertools.groupby(zip(edges, closed, strict=True), lambda item: item[0][:2]):
        kept = [edge[2] for edge, stays in group if stays]
        between = tuple(name if name in index else "world" for name in pair)
        told = {"name": "-".join(pair), "between": between, "at": (kept[0][0], 0.0, kept[0][1])}
        joints.append(Lock(**told) if len(kept) > 1 else Hinge(**told, axis=(0.0, 1.0, 0.0)))
    linkage = Scene(
        bodies=tuple(stones),
        constraints=tuple(joints),
        forces=scene.forces,
        gravity=scene.gravity,
        contacts=False,
    )
    moved = constrained.moved(linkage, times)
    places = standing(scene, times)
    places[:, [k for k, body in enumerate(scene.bodies) if body.motion == "dynamic"]] = moved["positions"]
    return {"positions": places}


def _edges(scene: Scene) -> Any:
    """Each two bodies that share edges, the left one first, and where in the plane, inner and outer."""
    hulls = [body for body in scene.bodies if isinstance(body.shape, ConvexHull)]
    corners = {body.name: _corners(body) for body in hulls}
    ordered = sorted(hulls, key=lambda body: -math.atan2(body.position[2], body.position[0]))
    for left, right in itertools.pairwise(ordered):
        shared = [
            p for p in corners[left.name] if min(np.linalg.norm(p - q) for q in corners[right.name]) < NONE
        ]
        assert len(shared) == 2
        yield from ((left.name, right.name, p) for p in shared)
    for ground in (body for body in scene.bodies if body not in hulls):
        for stone, pair in ((ordered[0], (ground, ordered[0])), (ordered[-1], (ordered[-1], ground))):
            feet = [p for p in corners[stone.name] if abs(p[1]) < NONE]
            assert len(feet) == 2
            yield from ((pair[0].name, pair[1].name, p) for p in feet)


def _corners(body: RigidBody) -> list[np.ndarray]:
    """In the plane, of the half that is nearer."""
    turn = constrained.rotations(np.array([body.orientation]))[0]
    places = np.array(body.position) + np.array(body.shape.corners) @ turn.T
    return [place[[0, 2]] for place in places if place[1] > 0.0]


def _inertia(body: RigidBody) -> float:
    """About y [kg m²]."""
    turn = constrained.rotations(np.array([body.orientation]))[0]
    return float(turn[1] ** 2 @ np.array(body.inertia))
