"""A heavy load on a light chain: the scene, its energy and its small motion."""

from __future__ import annotations

from typing import Any

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.observe import Observable

from ..chain import GRAVITY, LENGTH, MASS, hanging_chain, sideways_modes

COUNT = 10
TIME_STEP = 1.0 / 60.0  # s
STEPS = 1200  # 20 s
TILT = 0.01  # rad
STRING = engine.Method(string_stiffness=True)
HEAVY, LIGHT, BELOW_BREAK = 1e6, 10.0, 300.0  # load over a sphere's mass
OBSERVE: dict[str, Observable] = {
    "violation": engine.MaximumAbsolute(quantity=engine.Violation()),
    "places": engine.Trace(quantity=engine.Position()),
    "energy": engine.Trace(quantity=engine.Energy(), from_start=True),
}


def scene(
    ratio: float, time_step: float = TIME_STEP, *, tilt: float = TILT, zigzag: float = 0.0
) -> engine.Scene:
    """Ten spheres of 1 kg on rigid links, the last `ratio` times as heavy, leaning by `tilt` [rad]."""
    return hanging_chain(COUNT, time_step, load=ratio * MASS, compliance=0.0, tilt=tilt, zigzag=zigzag)


def lift(ratio: float, tilt: float = TILT) -> float:
    """Energy [J] of the leaning chain above the hanging one."""
    weight = GRAVITY * MASS * LENGTH * (COUNT * (COUNT - 1) / 2.0 + ratio * COUNT)
    return weight * (1.0 - float(np.cos(tilt)))


def exact_load(ratio: float, time: Any, tilt: float = TILT) -> Any:
    """Sideways place [m] of the load in small motion from a lean `tilt` [rad]: the sum of the ten modes."""
    squares, shapes = sideways_modes(COUNT, ratio * MASS)
    masses = np.append(np.full(COUNT - 1, MASS), ratio * MASS)
    share = shapes.T @ (masses * np.sin(tilt) * LENGTH * np.arange(1, COUNT + 1))
    return (shapes[-1] * share) @ np.cos(np.sqrt(squares)[:, None] * np.asarray(time)[None, :])
