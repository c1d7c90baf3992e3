"""The forces of a scene besides gravity, for engines that are pushed from Python at every step."""

from __future__ import annotations

import numpy as np

from ..bodies import Particle
from ..forces import CentralGravity, Load, Spring
from ..recorded_joints import cross, turned
from ..result import Array
from ..scene import Scene


class Pushes:
    """Forces [N] and torques [N m] on all bodies, world axes, where they are; false if there are none."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.places = {body.name: k for k, body in enumerate(scene.bodies)}
        moving = [isinstance(b, Particle) or b.motion == "dynamic" for b in scene.bodies]
        self.masses = np.array(
            [(b.mass or 0.0) if m else 0.0 for b, m in zip(scene.bodies, moving, strict=True)]
        )

    @property
    def aside(self) -> bool:
        """Whether a spring holds some body beside its centre."""
        return any(isinstance(force, Spring) and force.aside for force in self.scene.forces)

    def __bool__(self) -> bool:
        return bool(self.scene.forces)

    def at(
        self, where: Array, speeds: Array, turns: Array | None = None, spins: Array | None = None
    ) -> tuple[Array, Array]:
        """Forces and torques for positions and velocities (n, 3), turns (n, 4), angular velocities (n, 3): the last two
        are asked for by springs beside centres alone."""
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
                arms = [np.zeros(3), np.zeros(3)]
                if force.aside:
                    assert turns is not None and spins is not None
                    arms = [
                        turned(turns[self.places[str(end)]], np.array(anchor)) if any(anchor) else np.zeros(3)
                        for end, anchor in zip(force.between, force.anchors, strict=True)
                    ]
                self._pull(force, arms, where, speeds, spins, forces, torques)
        return forces, torques

    def _pull(
        self,
        spring: Spring,
        arms: list[Array],
        where: Array,
        speeds: Array,
        spins: Array | None,
        forces: Array,
        torques: Array,
    ) -> None:
        ends = [self.places[e] if isinstance(e, str) else None for e in spring.between]
        points = [
            np.array(e) if k is None else where[k] + arm
            for e, k, arm in zip(spring.between, ends, arms, strict=True)
        ]
        away = points[1] - points[0]
        length = float(np.linalg.norm(away))
        if length == 0.0:
            return
        moved = [
            np.zeros(3) if k is None else speeds[k] + (cross(spins[k], arm) if spins is not None else 0.0)
            for k, arm in zip(ends, arms, strict=True)
        ]
        opening = away @ (moved[1] - moved[0]) / length
        pull = (spring.stiffness * (length - spring.rest_length) + spring.viscosity * opening) / length * away
        for k, arm, sign in zip(ends, arms, (1.0, -1.0), strict=True):
            if k is not None:
                forces[k] += sign * pull
                torques[k] += sign * cross(arm, pull)
