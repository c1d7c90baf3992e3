"""The forces of a scene besides gravity, for engines that are pushed from Python at every step."""

from __future__ import annotations

import numpy as np

from spook_tracker.engine.bodies import Particle
from spook_tracker.engine.forces import CentralGravity, Load, Spring
from spook_tracker.engine.result import Array
from spook_tracker.engine.scene import Scene


class Pushes:
    """Forces [N] and torques [N m] on all bodies, world axes, where they are; false if there are none."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.places = {body.name: k for k, body in enumerate(scene.bodies)}
        moving = [isinstance(b, Particle) or b.motion == "dynamic" for b in scene.bodies]
        self.masses = np.array(
            [(b.mass or 0.0) if m else 0.0 for b, m in zip(scene.bodies, moving, strict=True)]
        )

    def __bool__(self) -> bool:
        return bool(self.scene.forces)

    def at(self, where: Array, speeds: Array) -> tuple[Array, Array]:
        """Forces and torques for positions and velocities (n, 3)."""
        forces, torques = np.zeros_like(where), np.zeros_like(where)
        for force in self.scene.forces:
            if isinstance(force, Load):
                forces[self.places[force.body]] += force.force
                torques[self.places[force.body]] += force.torque
            elif isinstance(force, CentralGravity):
                away = where - np.array(force.centre)
                size = -force.strength * self.masses / np.linalg.norm(away, axis=1) ** 3
                forces += size[:, None] * away
            elif isinstance(force, Spring):
                self._pull(force, where, speeds, forces)
        return forces, torques

    def _pull(self, spring: Spring, where: Array, speeds: Array, forces: Array) -> None:
        ends = [self.places[e] if isinstance(e, str) else None for e in spring.between]
        points = [np.array(e) if k is None else where[k] for e, k in zip(spring.between, ends, strict=True)]
        away = points[1] - points[0]
        length = float(np.linalg.norm(away))
        if length == 0.0:
            return
        moved = [np.zeros(3) if k is None else speeds[k] for k in ends]
        opening = away @ (moved[1] - moved[0]) / length
        pull = (spring.stiffness * (length - spring.rest_length) + spring.viscosity * opening) / length * away
        for k, sign in zip(ends, (1.0, -1.0), strict=True):
            if k is not None:
                forces[k] += sign * pull
