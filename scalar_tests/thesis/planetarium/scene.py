"""The thesis' planet on its orbit: scene, exact motion by Kepler's equation, and energies of a run."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.optimize import brentq

from spook_tracker import engine
from spook_tracker.engine.observe import Observable

from ... import case

GAUSS = 2.0 * math.pi / 365.0  # k, 1/s
ECCENTRICITY = 0.017  # ξ; r = 1 at the start is the semi-latus rectum
DURATION = 1200.0  # s
TIME_STEP = 1.0 / 60.0  # s
LONG_STEPS = 1_404_000  # 6.5 h
HALF_STEP = engine.Method(half_step_velocities=True)
SPEED = (-ECCENTRICITY * GAUSS, GAUSS, 0.0)  # m/s at the start
START_ENERGY = 0.5 * GAUSS**2 * (1.0 + ECCENTRICITY**2) - GAUSS**2  # J: ½ v² − k²/r
SEMI_MAJOR = 1.0 / (1.0 - ECCENTRICITY**2)  # m, from the energy −k²/(2a)
MEAN_MOTION = GAUSS / SEMI_MAJOR**1.5  # 1/s
PERIOD = 2.0 * math.pi / MEAN_MOTION  # s, 365.1583


def scene() -> engine.Scene:
    """A planet of 1 kg at (1, 0, 0) m; the sun at the origin attracts and does not move."""
    planet = engine.Particle(name="planet", position=(1.0, 0.0, 0.0), velocity=SPEED, mass=1.0)
    return engine.Scene(bodies=(planet,), forces=(engine.CentralGravity(name="sun", strength=GAUSS**2),))


def exact_position(time: float) -> tuple[float, float]:
    """(x, y) [m] after `time` [s]: Kepler's equation E − e sin E = n t, to 1e-14.

    At the start r = 1 is the semi-latus rectum, so the true anomaly is ±90°; v points inwards, so −90°.
    """
    e = ECCENTRICITY
    flat = math.sqrt(1.0 - e * e)
    start = math.atan2(-flat, e)  # eccentric anomaly at true anomaly −90°
    mean = start - e * math.sin(start) + MEAN_MOTION * time
    anomaly = brentq(lambda E: E - e * math.sin(E) - mean, mean - 1.0, mean + 1.0, xtol=1e-15, rtol=1e-15)
    along, across = SEMI_MAJOR * (math.cos(anomaly) - e), SEMI_MAJOR * flat * math.sin(anomaly)
    return -across, along  # perihelion lies on the +y axis, 90° ahead of the start


def orbit_radius(angle: Any) -> Any:
    """r(θ) [m] = 1/(1 + ξ sin θ), the thesis' Eq 3.19."""
    return 1.0 / (1.0 + ECCENTRICITY * np.sin(angle))


def energies(
    simulate: case.Simulate, time_step: float, method: engine.Method = engine.PLAIN, every: int = 1
) -> tuple[Any, Any, Any]:
    """Times [s], E = ½v² − k²/r and the printed ½v² + k²/r: each minus its start, in % of it."""
    observe: dict[str, Observable] = {
        "kinetic": engine.Trace(quantity=engine.KineticEnergy(), every=every),
        "potential": engine.Trace(quantity=engine.PotentialEnergy(), every=every),
    }
    result = simulate(scene(), time_step=time_step, duration=DURATION, method=method, observe=observe)
    right = result["kinetic"] + result["potential"]
    printed = result["kinetic"] - result["potential"]
    times = result.sample_times["kinetic"]
    return times, 100.0 * (right / right[0] - 1.0), 100.0 * (printed / printed[0] - 1.0)
