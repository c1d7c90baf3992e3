"""What is read from runs of the orbit, and the simulations behind each number."""

from __future__ import annotations

import functools
import math
from dataclasses import replace

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.observe import Observable

from ... import case
from ...bracket import break_point
from .scene import (
    DURATION,
    GAUSS,
    HALF_STEP,
    LONG_STEPS,
    PERIOD,
    START_ENERGY,
    TIME_STEP,
    energies,
    exact_position,
    orbit_radius,
    scene,
)

PERIOD_STEPS = round(PERIOD / TIME_STEP)
YEARS = 10.0  # rounds of the circle at 1 m, within which a fast planet is to turn back
# Half a round of a = 1/(2 − s²) takes them: ½ a^(3/2) = YEARS
FASTEST = math.sqrt(2.0 - (2.0 * YEARS) ** (-2.0 / 3.0))  # times the circle's speed, 1.365; √2 never does

ORDER_4, ORDER_6 = engine.Method(composition="order4"), engine.Method(composition="order6")

ORDER_8 = engine.Method(composition="order8")

OBSERVE: dict[str, Observable] = {
    "kinetic": engine.Trace(quantity=engine.KineticEnergy()),
    "potential": engine.Trace(quantity=engine.PotentialEnergy()),
}


def _position_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    observe: dict[str, Observable] = {"planet": engine.Final(quantity=engine.Position("planet"))}
    result = simulate(scene(), time_step=time_step, duration=DURATION, method=method, observe=observe)
    x, y = exact_position(DURATION)
    return float(np.hypot(result["planet"][0] - x, result["planet"][1] - y))


def _answers(simulate: case.Simulate, method: engine.Method) -> dict[str, float]:
    _, right, printed = energies(simulate, TIME_STEP, method)
    observe: dict[str, Observable] = {
        "turn": engine.MaximumAbsolute(quantity=engine.AngularMomentum(), from_start=True),
        "planet": engine.Trace(quantity=engine.Position("planet"), every=60),
    }
    result = simulate(scene(), time_step=TIME_STEP, duration=DURATION, method=method, observe=observe)
    x, y = result["planet"][:, 0], result["planet"][:, 1]
    return {
        "energy_oscillation": float(np.abs(right).max()),
        "energy_oscillation_as_printed": float(np.abs(printed).max()),
        "angular_momentum_drift": float(result["turn"][2]) / GAUSS,
        "radius_error": float(np.abs(np.hypot(x, y) - orbit_radius(np.arctan2(y, x))).max()),
        "position_error": _position_error(simulate, TIME_STEP, method),
    }


def plain(simulate: case.Simulate) -> dict[str, float]:
    """Plain SPOOK: symplectic Euler, since nothing constrains the planet."""
    return _answers(simulate, engine.PLAIN)


def half_step(simulate: case.Simulate) -> dict[str, float]:
    """Velocities at mid-step."""
    return _answers(simulate, HALF_STEP)


def coarse(simulate: case.Simulate) -> dict[str, float]:
    """The coarsest step of the thesis."""
    return {"energy_oscillation": float(np.abs(energies(simulate, 5.0)[1]).max())}


def long_run(simulate: case.Simulate) -> dict[str, float]:
    """1.404e6 steps: mean energy of the last round against that of the first."""
    first = engine.Mean(quantity=engine.Energy(), last=PERIOD_STEPS - 1)
    last = engine.Mean(quantity=engine.Energy(), first=LONG_STEPS - PERIOD_STEPS + 1, last=LONG_STEPS)
    result = simulate(
        scene(),
        time_step=TIME_STEP,
        steps=LONG_STEPS,
        observe={
            "first": first,
            "last": last,
            "turn": engine.MaximumAbsolute(quantity=engine.AngularMomentum(), from_start=True),
            "swing": engine.MaximumAbsolute(quantity=engine.Energy(), from_start=True),
        },
    )
    return {
        "energy_drift": 100.0 * float(result["last"] - result["first"]) / abs(START_ENERGY),
        "energy_oscillation": 100.0 * float(result["swing"]) / abs(START_ENERGY),
        "angular_momentum_drift": float(result["turn"][2]) / GAUSS,
    }


def position_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Distance from Kepler's position after 1200 s [m]."""
    return _position_error(simulate, time_step, method)


def largest_step(simulate: case.Simulate) -> case.BreakPoint:
    """Largest time step [s] with which ten rounds stay an orbit."""

    def holds(time_step: float) -> bool:
        result = simulate(
            scene(),
            time_step=time_step,
            steps=math.ceil(10.0 * PERIOD / time_step),
            observe={
                "planet": engine.Trace(quantity=engine.Position("planet")),
                "energy": engine.MaximumAbsolute(quantity=engine.Energy(), from_start=True),
            },
        )
        if not result.completed:
            return False
        distance = np.linalg.norm(result["planet"], axis=1)
        swing = float(result["energy"]) / abs(START_ENERGY)
        return float(distance.min()) >= 0.5 and float(distance.max()) <= 2.0 and swing <= 0.1

    return break_point(holds, 0.5, 200.0, resolution=0.005)


def turns_back(simulate: case.Simulate, times: float) -> bool:
    """Whether a planet that starts across its radius, so many times as fast as on a circle, is past its farthest place after
    YEARS rounds of that circle."""
    planet = replace(scene().bodies[0], velocity=(0.0, times * GAUSS, 0.0))
    observe = {"planet": engine.Trace(quantity=engine.Position("planet"))}
    steps = round(YEARS * 2.0 * math.pi / GAUSS)
    result = simulate(replace(scene(), bodies=(planet,)), time_step=1.0, steps=steps, observe=observe)
    distance = np.linalg.norm(result["planet"], axis=1)
    return result.completed and float(distance[-1]) < float(distance.max())


def fastest(simulate: case.Simulate) -> case.BreakPoint:
    """The fastest planet, over the circle's speed, that turns back in time."""
    return break_point(functools.partial(turns_back, simulate), 1.05, 1.6, resolution=5e-4, walk=6)
