"""What is read from runs of the chain that falls from the level, and the simulations behind each number."""

from __future__ import annotations

from typing import Any

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.observe import Observable

from ... import case
from ...ropes.chain import LENGTH, chain, exact_tip, level_chain, small_motion
from .figures import COUNT, CURVED_TWICE, TIME_STEP, TWO_SUBSTEPS, swing

EARLY_STEPS = 240  # 4 s

ENERGY_STEP = 600  # 10 s: later the chain is chaotic, and rounding decides the energy

TIP_TIME = 2.0  # s: before the chain whips, so that errors are still smooth in h

LONG_COUNT = 400

EIGHT_SUBSTEPS = engine.Method(substeps=8)

EIGHT_SUBSTEPS_CURVED = engine.Method(substeps=8, corrections=1)

AMPLITUDE = 1e-7  # m: the nonlinearity of small motion is its square

SMALL_MOTION_STEPS = 100

ORDER_4, ORDER_6 = engine.Method(composition="order4"), engine.Method(composition="order6")

ORDER_8 = engine.Method(composition="order8")

HALF_STEP = engine.Method(half_step_velocities=True)

HALF_STEP_CURVED = engine.Method(half_step_velocities=True, corrections=2)


def _answers(simulate: case.Simulate, method: engine.Method, count: int = COUNT) -> dict[str, float]:
    violation, energy = swing(simulate, count, method=method)
    return {
        "length_deviation": float(violation.max()),
        "energy_at_10_s": float(energy[ENERGY_STEP]),
        "energy_at_the_end": float(energy[-1]),
        "energy_gain": float(energy.max()),
    }


def plain(simulate: case.Simulate) -> dict[str, float]:
    """Plain SPOOK, with the first 4 s by themselves and the link that stretches most."""
    early: dict[str, Observable] = {"violation": engine.MaximumAbsolute(quantity=engine.Violation())}
    result = simulate(level_chain(COUNT, TIME_STEP), time_step=TIME_STEP, steps=EARLY_STEPS, observe=early)
    violation, _ = swing(simulate)
    return _answers(simulate, engine.PLAIN) | {
        "length_deviation_early": 100.0 * float(result["violation"].max()) / LENGTH,
        "weakest_link": float(np.argmax(violation)) + 1.0,
    }


def curved_twice(simulate: case.Simulate) -> dict[str, float]:
    """Curved constraints, two corrections."""
    return _answers(simulate, CURVED_TWICE)


def two_substeps(simulate: case.Simulate) -> dict[str, float]:
    """Plain SPOOK in two steps of h/2, damping one of them."""
    return _answers(simulate, TWO_SUBSTEPS)


def long_chain(simulate: case.Simulate) -> dict[str, float]:
    """400 spheres, eight substeps."""
    return _answers(simulate, EIGHT_SUBSTEPS, LONG_COUNT)


def long_chain_curved(simulate: case.Simulate) -> dict[str, float]:
    """400 spheres, eight substeps with curved constraints."""
    return _answers(simulate, EIGHT_SUBSTEPS_CURVED, LONG_COUNT)


def small_oscillations(simulate: case.Simulate) -> dict[str, float]:
    """Every mode started by itself; its squared frequency from x₊ − 2x + x₋ = −h² ω² x."""
    squares, shapes = small_motion(COUNT)
    errors = []
    for square, shape in zip(squares, shapes.T, strict=True):
        places = [(AMPLITUDE * float(part), 0.0, -(i + 1) * LENGTH) for i, part in enumerate(shape)]
        result = simulate(
            chain(places, TIME_STEP),
            time_step=TIME_STEP,
            steps=SMALL_MOTION_STEPS,
            observe={"places": engine.Trace(quantity=engine.Position())},
        )
        mode = result["places"][:, :, 0] @ shape
        bend = 2.0 * mode[1:-1] - mode[2:] - mode[:-2]
        errors.append(float(mode[1:-1] @ bend / (mode[1:-1] @ mode[1:-1]) / TIME_STEP**2 / square - 1.0))
    return {"frequency_error": max(errors, key=abs)}


def _scene(time_step: float, method: engine.Method) -> Any:
    return level_chain(COUNT, time_step / method.substeps)


def tip_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Distance of the last sphere from where it should be at 2 s [m]."""
    result = simulate(
        _scene(time_step, method),
        time_step=time_step,
        duration=TIP_TIME,
        method=method,
        observe={"tip": engine.Final(quantity=engine.Position(f"sphere {COUNT}"))},
    )
    x, z = exact_tip(COUNT, TIP_TIME)
    return float(np.hypot(result["tip"][0] - x, result["tip"][2] - z))


def length_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Largest deviation of any link over 2 s [%]."""
    result = simulate(
        _scene(time_step, method),
        time_step=time_step,
        duration=TIP_TIME,
        method=method,
        observe={"violation": engine.MaximumAbsolute(quantity=engine.Violation())},
    )
    return 100.0 * float(result["violation"].max()) / LENGTH
