"""The medium that a compiled MuJoCo model moves through: drag and lift of the boxes that have its bodies' inertia.

The law is that of MuJoCo's documentation (Computation, "Inertia model"), with density, viscosity and wind of the file; a model whose
geoms ask for their own (fluidshape) has another one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from .mujoco_scene import Placed, matrix

Array = npt.NDArray[np.float64]
LEAST = 1e-15  # kg, kg m²: bodies below it have no box


class Medium:
    """Forces and torques on rigid bodies, from where they are and how they move."""

    def __init__(self, model: Any, placed: Sequence[Placed]) -> None:
        """`placed`: where each body of the file is in the rigid body it belongs to."""
        parts = [body for body, one in enumerate(placed) if one.name and model.body_mass[body] > LEAST]
        owners = [placed[body].name for body in parts]
        self.names = list(dict.fromkeys(owners))
        self.place = np.array([self.names.index(owner) for owner in owners])
        inertia, mass = np.asarray(model.body_inertia)[parts], np.asarray(model.body_mass)[parts, None]
        self.box = np.sqrt(np.maximum(LEAST, inertia.sum(axis=1, keepdims=True) - 2.0 * inertia) / mass * 6.0)
        self.density, self.viscosity = float(model.opt.density), float(model.opt.viscosity)
        self.wind = np.array(model.opt.wind, dtype=float)
        self.arm = np.array([placed[b].place + placed[b].turn @ model.body_ipos[b] for b in parts])
        self.turn = np.array([placed[b].turn @ matrix(model.body_iquat[b]) for b in parts])

    def wrenches(self, states: Mapping[str, Array]) -> dict[str, tuple[Array, Array]]:
        """Force [N] and torque [N m] on each rigid body, at its centre, in the world's axes."""
        now = np.array([states[name] for name in self.names])[self.place]
        own = np.array([matrix(turn) for turn in now[:, 3:7]])
        axes, arm = own @ self.turn, np.einsum("pij,pj->pi", own, self.arm)
        moving = now[:, 7:10] + np.cross(now[:, 10:13], arm) - self.wind
        speed, spin = (np.einsum("pji,pj->pi", axes, found) for found in (moving, now[:, 10:13]))
        force, torque = self._drag(speed, spin)
        force, torque = (np.einsum("pij,pj->pi", axes, found) for found in (force, torque))
        whole = np.zeros((len(self.names), 6))
        np.add.at(whole, self.place, np.hstack([force, torque + np.cross(arm, force)]))
        return {name: (row[:3], row[3:]) for name, row in zip(self.names, whole, strict=True)}

    def _drag(self, speed: Array, spin: Array) -> tuple[Array, Array]:
        """Of each box, in its axes."""
        across = np.roll(self.box, -1, axis=1), np.roll(self.box, -2, axis=1)
        wide = self.box.mean(axis=1, keepdims=True)
        force = -3.0 * np.pi * wide * self.viscosity * speed
        force -= 0.5 * self.density * across[0] * across[1] * np.abs(speed) * speed
        torque = -np.pi * wide**3 * self.viscosity * spin
        torque -= self.density * self.box * (across[0] ** 4 + across[1] ** 4) * np.abs(spin) * spin / 64.0
        return force, torque
