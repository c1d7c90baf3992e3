"""Closed forms in the engine's place: each physical question that they can answer is green."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest
from scipy.special import ellipj, ellipk

from spook_tracker.engine import (
    Box,
    Capsule,
    CentralGravity,
    ConstraintForce,
    ContactForce,
    Cylinder,
    Distance,
    Hinge,
    Lock,
    Particle,
    Plane,
    Scene,
    Sphere,
)
from spook_tracker.engine.build_info import BuildInfo
from spook_tracker.engine.protocol import Capabilities, Configuration, Task, run
from spook_tracker.engine.recording import Recording
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.scalar_tests.door.scene import least_norm_forces
from spook_tracker.tracker.measure.others import asked_of


def falling(scene: Scene, times: Any) -> tuple[Any, Any]:
    body, g, t = scene.bodies[0], np.array(scene.gravity), times[:, None]
    v = np.array(body.velocity)
    return np.array(body.position) + v * t + 0.5 * g * t**2, v + g * t


def on_an_ellipse(scene: Scene, times: Any) -> tuple[Any, Any]:
    """By Lagrange's f and g of the change of the eccentric anomaly, found by Newton's method."""
    (field,) = (force for force in scene.forces if isinstance(force, CentralGravity))
    mu, body = field.strength, scene.bodies[0]
    r, v = np.array(body.position), np.array(body.velocity)
    distance = float(np.linalg.norm(r))
    a = 1.0 / (2.0 / distance - float(v @ v) / mu)
    rate = math.sqrt(mu / a**3)
    c, s = 1.0 - distance / a, float(r @ v) / math.sqrt(mu * a)  # e cos E, e sin E at the start
    turned = rate * times
    for _ in range(8):
        left = turned - c * np.sin(turned) + s * (1.0 - np.cos(turned)) - rate * times
        turned = turned - left / (1.0 - c * np.cos(turned) + s * np.sin(turned))
    sine, less = np.sin(turned), 1.0 - np.cos(turned)
    now = a * (1.0 - c * np.cos(turned) + s * sine)
    f, g = 1.0 - a / distance * less, times - (turned - sine) / rate
    df, dg = -math.sqrt(mu * a) / (distance * now) * sine, 1.0 - a / now * less
    return np.outer(f, r) + np.outer(g, v), np.outer(df, r) + np.outer(dg, v)


def swinging(scene: Scene, times: Any) -> tuple[Any, Any]:
    """From rest at φ₀: the sine of half its angle is k sn(K − ω t), k = sin φ₀/2, by Jacobi's elliptic functions."""
    (rod,) = (row for row in scene.constraints if isinstance(row, Distance))
    start = np.array(scene.bodies[0].position) - np.array(rod.between[0])
    length = float(rod.rest_length or np.linalg.norm(start))
    angle, rate = swing(math.atan2(start[0], -start[2]), math.sqrt(-scene.gravity[2] / length), times)
    sine, cosine, level = np.sin(angle), np.cos(angle), np.zeros_like(angle)
    along, across = np.stack([sine, level, -cosine], axis=1), np.stack([cosine, level, sine], axis=1)
    return np.array(rod.between[0]) + length * along, length * rate[:, None] * across


def swing(start: float, pace: float, times: Any) -> tuple[Any, Any]:
    """Angle [rad] and rate [rad/s] of a pendulum let go at `start`; `pace` [rad/s] is that of small swings."""
    modulus = math.sin(0.5 * start)
    sn, cn, _, _ = ellipj(float(ellipk(modulus**2)) - pace * times, modulus**2)
    return 2.0 * np.arcsin(modulus * sn), -2.0 * modulus * pace * cn


def at_rest(task: Task, scene: Scene) -> dict[str, Any]:
    """What stands, and the hinges of a door, which share its load by least norm."""
    count = len(task.samples)
    forces = {}
    hinges = [joint for joint in scene.constraints if isinstance(joint, Hinge)]
    if hinges:
        mass = scene.bodies[0].mass
        for hinge, force in zip(hinges, least_norm_forces(len(hinges), mass), strict=True):
            forces[hinge.name] = np.tile(force, (count, 1))
    places = np.array([body.position for body in scene.bodies])
    return {"positions": np.tile(places, (count, 1, 1)), "constraint_forces": forces}


def on_a_slope(task: Task, scene: Scene) -> dict[str, Any]:
    """It stands where the slope's tangent is no more than µ, and slides by what is left of gravity; the plane is body 0."""
    box, pull = scene.bodies[1], np.array(scene.gravity)
    normal, along = -pull[2], np.hypot(pull[0], pull[1])
    friction = box.material.friction
    way = np.array([pull[0], pull[1], 0.0]) / along if along > 0.0 else np.zeros(3)
    held = min(along, friction * normal)
    t = (task.samples * task.time_step)[:, None, None]
    each = np.array([[0.0], [1.0]]) * way * (along - held)
    force = box.mass * np.append(-held * way[:2], normal)
    return {
        "positions": np.array([body.position for body in scene.bodies]) + 0.5 * each * t**2,
        "velocities": each * t,
        "contact_forces": {("box", "plane"): np.tile(force, (len(t), 1))},
    }


def on_each_other(task: Task, scene: Scene) -> dict[str, Any]:
    """Bodies at rest from below: each is carried by the one before it, with all that lies on it."""
    masses = np.array([body.mass for body in scene.bodies[1:]])
    loads = np.cumsum(masses[::-1])[::-1, None] * -np.array(scene.gravity)
    names = [body.name for body in scene.bodies]
    count = len(task.samples)
    return {
        "positions": np.tile([body.position for body in scene.bodies], (count, 1, 1)),
        "contact_forces": {
            (above, below): np.tile(load, (count, 1))
            for above, below, load in zip(names[1:], names, loads, strict=False)
        },
    }


def bouncing(task: Task, scene: Scene) -> dict[str, Any]:
    """A ball let go above a plane: parabolas, each e times as long as the one before."""
    ball, g = scene.bodies[1], -scene.gravity[2]
    height, back = ball.position[2] - ball.shape.radius, ball.material.restitution
    fall = math.sqrt(2.0 * height / g)
    places = np.tile([body.position for body in scene.bodies], (len(task.samples), 1, 1))
    for row, time in enumerate(task.samples * task.time_step):
        begins, speed = -fall, g * fall  # as if it had come up from the plane
        while back > 0.0 and time > begins + 2.0 * speed / g:
            begins, speed = begins + 2.0 * speed / g, back * speed
        since = time - begins
        places[row, 1, 2] = ball.shape.radius + speed * since - 0.5 * g * since**2
    return {"positions": places}


def bar_that_swings(task: Task, scene: Scene) -> dict[str, Any]:
    """A rigid pendulum about the y axis through the origin."""
    bar, times = scene.bodies[0], task.samples * task.time_step
    arm = np.array(bar.position)
    reach = float(np.linalg.norm(arm))
    inertia = float(bar.shape.inertia(bar.mass)[1]) + bar.mass * reach**2
    pace = math.sqrt(bar.mass * -scene.gravity[2] * reach / inertia)
    angle, rate = swing(math.atan2(-arm[0], -arm[2]), pace, times)
    nothing, half = np.zeros_like(angle), 0.5 * angle
    place = reach * np.stack([-np.sin(angle), nothing, -np.cos(angle)], axis=1)
    speed = reach * rate[:, None] * np.stack([-np.cos(angle), nothing, np.sin(angle)], axis=1)
    return {
        "positions": place[:, None],
        "velocities": speed[:, None],
        "orientations": np.stack([np.cos(half), nothing, np.sin(half), nothing], axis=1)[:, None],
        "angular_velocities": np.stack([nothing, rate, nothing], axis=1)[:, None],
    }


def particle(task: Task, scene: Scene) -> dict[str, Any]:
    times = task.samples * task.time_step
    form = swinging if scene.constraints else on_an_ellipse if scene.forces else falling
    places, velocities = form(scene, times)
    tension = {}
    for rod in scene.constraints:  # turns the body, and holds its weight
        assert isinstance(rod, Distance)
        reach = places - np.array(rod.between[0])
        length = float(rod.rest_length or np.linalg.norm(reach[0]))
        tension[rod.name] = scene.bodies[0].mass * (
            np.square(velocities).sum(axis=1) / length + reach @ np.array(scene.gravity) / length
        )
    return {"positions": places[:, None], "velocities": velocities[:, None], "constraint_forces": tension}


def form_of(scene: Scene) -> Callable[[Task, Scene], dict[str, Any]]:
    """By what a scene is about."""
    if isinstance(scene.bodies[0], Particle):
        return particle
    if not scene.constraints and scene.bodies[0].motion == "static":
        if scene.bodies[1].material.restitution:
            return bouncing
        return on_a_slope if any(scene.gravity[:2]) else on_each_other
    if not scene.constraints:
        return particle
    first = scene.constraints[0]
    return bar_that_swings if isinstance(first, Hinge) and first.axis == (0.0, 1.0, 0.0) else at_rest


class Ideal:
    """Bodies as they move by the laws they are asked about."""

    name = "ideal"
    capabilities = Capabilities(
        shapes=frozenset({Box, Capsule, Cylinder, Plane, Sphere}), joints=frozenset({Distance, Hinge, Lock}),
        forces=frozenset({CentralGravity}), shows=frozenset({ConstraintForce, ContactForce}), compliance=True,
        friction=True, restitution=True,
    )  # fmt: skip
    configurations: tuple[Configuration, ...] = (Configuration(name="exact", reason="closed forms"),)

    def build_info(self) -> BuildInfo:
        return BuildInfo(self.name, "", "", False, "", (), "closed forms", "")

    def record(self, task: Task) -> Recording:
        found = form_of(task.scene)(task, task.scene)
        still = np.zeros_like(found["positions"])
        unturned = np.tile([1.0, 0.0, 0.0, 0.0], (*still.shape[:2], 1))
        told = {"velocities": still, "angular_velocities": still, "orientations": unturned, **found}
        return Recording(samples=task.samples, steps=task.steps, seconds=0.0, **told)


ANSWERED = (
    "falling_object", "pendulum", "planetarium", "door", "beam", "friction", "slip_angle", "bar_pendulum", "seconds_pendulum",
    "slope_grid", "resting_grid", "bounce_grid",
)  # fmt: skip


@pytest.mark.parametrize("name", ANSWERED)
def test_an_exact_engine_keeps_every_physical_limit(name: str) -> None:
    test = asked_of({name: CATALOGUE[name]}, Ideal().configurations, gating=True)[name]
    held = 0
    for asked in test.measurements:
        limits = [metric for metric in asked.metrics if metric.limit is not None]
        values = asked.measure(partial(run, Ideal())) if limits else {}
        for metric in limits:
            assert metric.limit_kind == "physical"
            assert metric.passes(values[metric.name]), metric.name
            held += 1
    assert held > 0
