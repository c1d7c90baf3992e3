"""What is read from runs of the orbit, and the simulations behind each number."""

from __future__ import annotations

import functools
import math
from dataclasses import replace

import numpy as np

from spook_tracker.engine import (
    PLAIN,
    AngularMomentum,
    Energy,
    Final,
    KineticEnergy,
    MaximumAbsolute,
    Mean,
    Method,
    Position,
    PotentialEnergy,
    Trace,
)
from spook_tracker.engine.observe import Observable
from spook_tracker.scalar_tests.bracket import break_point
from spook_tracker.scalar_tests.case import BreakPoint, Simulate
from spook_tracker.scalar_tests.planetarium.scene import (
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

ORDER_4, ORDER_6 = Method(composition="order4"), Method(composition="order6")

ORDER_8 = Method(composition="order8")

OBSERVE: dict[str, Observable] = {
    "kinetic": Trace(quantity=KineticEnergy()),
    "potential": Trace(quantity=PotentialEnergy()),
}


def _position_error(simulate: Simulate, time_step: float, method: Method) -> float:
    observe: dict[str, Observable] = {"planet": Final(quantity=Position("planet"))}
    result = simulate(scene(), time_step=time_step, duration=DURATION, method=method, observe=observe)
    x, y = exact_position(DURATION)
    return float(np.hypot(result["planet"][0] - x, result["planet"][1] - y))


def _answers(simulate: Simulate, method: Method) -> dict[str, float]:
    _, right, printed = energies(simulate, TIME_STEP, method)
    observe: dict[str, Observable] = {
        "turn": MaximumAbsolute(quantity=AngularMomentum(), from_start=True),
        "planet": Trace(quantity=Position("planet"), every=60),
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


def plain(simulate: Simulate) -> dict[str, float]:
    """Plain SPOOK: symplectic Euler, since nothing constrains the planet."""
    return _answers(simulate, PLAIN)


def half_step(simulate: Simulate) -> dict[str, float]:
    """Velocities at mid-step."""
    return _answers(simulate, HALF_STEP)


def coarse(simulate: Simulate) -> dict[str, float]:
    """The coarsest step of the thesis."""
    return {"energy_oscillation": float(np.abs(energies(simulate, 5.0)[1]).max())}


def long_run(simulate: Simulate) -> dict[str, float]:
    """1.404e6 steps: mean energy of the last round against that of the first."""
    first = Mean(quantity=Energy(), last=PERIOD_STEPS - 1)
    last = Mean(quantity=Energy(), first=LONG_STEPS - PERIOD_STEPS + 1, last=LONG_STEPS)
    result = simulate(
        scene(),
        time_step=TIME_STEP,
        steps=LONG_STEPS,
        observe={
            "first": first,
            "last": last,
            "turn": MaximumAbsolute(quantity=AngularMomentum(), from_start=True),
            "swing": MaximumAbsolute(quantity=Energy(), from_start=True),
        },
    )
    return {
        "energy_drift": 100.0 * float(result["last"] - result["first"]) / abs(START_ENERGY),
        "energy_oscillation": 100.0 * float(result["swing"]) / abs(START_ENERGY),
        "angular_momentum_drift": float(result["turn"][2]) / GAUSS,
    }


def position_error(simulate: Simulate, time_step: float, method: Method) -> float:
    """Distance from Kepler's position after 1200 s [m]."""
    return _position_error(simulate, time_step, method)


def largest_step(simulate: Simulate) -> BreakPoint:
    """Largest time step [s] with which ten rounds stay an orbit."""

    def holds(time_step: float) -> bool:
        result = simulate(
            scene(),
            time_step=time_step,
            steps=math.ceil(10.0 * PERIOD / time_step),
            observe={
                "planet": Trace(quantity=Position("planet")),
                "energy": MaximumAbsolute(quantity=Energy(), from_start=True),
            },
        )
        if not result.completed:
            return False
        distance = np.linalg.norm(result["planet"], axis=1)
        swing = float(result["energy"]) / abs(START_ENERGY)
        return float(distance.min()) >= 0.5 and float(distance.max()) <= 2.0 and swing <= 0.1

    return break_point(holds, 0.5, 200.0, resolution=0.005)


def turns_back(simulate: Simulate, times: float) -> bool:
    """Whether a planet that starts across its radius, so many times as fast as on a circle, is past its farthest place after
    YEARS rounds of that circle."""
    planet = replace(scene().bodies[0], velocity=(0.0, times * GAUSS, 0.0))
    observe = {"planet": Trace(quantity=Position("planet"))}
    steps = round(YEARS * 2.0 * math.pi / GAUSS)
    result = simulate(replace(scene(), bodies=(planet,)), time_step=1.0, steps=steps, observe=observe)
    distance = np.linalg.norm(result["planet"], axis=1)
    return result.completed and float(distance[-1]) < float(distance.max())


def fastest(simulate: Simulate) -> BreakPoint:
    """The fastest planet, over the circle's speed, that turns back in time."""
    return break_point(functools.partial(turns_back, simulate), 1.05, 1.6, resolution=5e-4, walk=6)
