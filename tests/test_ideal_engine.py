"""Closed forms in the engine's place: each physical question that they can answer is green."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np
import pytest
from scipy.special import ellipj, ellipk

from spook_tracker.engine import CentralGravity, ConstraintForce, Distance, Scene
from spook_tracker.engine.build_info import BuildInfo
from spook_tracker.engine.protocol import Capabilities, Configuration, Task, run
from spook_tracker.engine.recording import Recording
from spook_tracker.scalar_tests.catalogue import CATALOGUE
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
    """From level and at rest: the sine of half its angle is sn(K − ω t)/√2, by Jacobi's elliptic functions."""
    (rod,) = (row for row in scene.constraints if isinstance(row, Distance))
    length = float(rod.rest_length or 0.0)
    pace = math.sqrt(-scene.gravity[2] / length)
    sn, cn, _, _ = ellipj(float(ellipk(0.5)) - pace * times, 0.5)
    angle, rate = 2.0 * np.arcsin(math.sqrt(0.5) * sn), -2.0 * math.sqrt(0.5) * pace * cn
    sine, cosine, level = np.sin(angle), np.cos(angle), np.zeros_like(angle)
    along, across = np.stack([sine, level, -cosine], axis=1), np.stack([cosine, level, sine], axis=1)
    return np.array(rod.between[0]) + length * along, length * rate[:, None] * across


class Ideal:
    """One particle, as it moves by the laws it is asked about."""

    name = "ideal"
    capabilities = Capabilities(
        rigid_bodies=False, compliance=True, joints=frozenset({Distance}), forces=frozenset({CentralGravity}),
        shows=frozenset({ConstraintForce}),
    )  # fmt: skip
    configurations: tuple[Configuration, ...] = (Configuration(name="exact", reason="closed forms"),)

    def build_info(self) -> BuildInfo:
        return BuildInfo(self.name, "", "", False, "", (), "closed forms", "")

    def record(self, task: Task) -> Recording:
        scene, times = task.scene, task.samples * task.time_step
        form = swinging if scene.constraints else on_an_ellipse if scene.forces else falling
        places, velocities = form(scene, times)
        still = np.zeros((len(times), 1, 3))
        tension = {}
        for rod in scene.constraints:  # turns the body, and holds its weight
            assert isinstance(rod, Distance)
            length = float(rod.rest_length or 0.0)
            out = (places - np.array(rod.between[0])) / length
            tension[rod.name] = scene.bodies[0].mass * (
                np.square(velocities).sum(axis=1) / length + out @ np.array(scene.gravity)
            )
        return Recording(
            samples=task.samples, positions=places[:, None], velocities=velocities[:, None], angular_velocities=still,
            orientations=np.tile([1.0, 0.0, 0.0, 0.0], (len(times), 1, 1)), steps=task.steps, seconds=0.0,
            constraint_forces=tension,
        )  # fmt: skip


@pytest.mark.parametrize("name", ["falling_object", "pendulum", "planetarium"])
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
