"""What is read from runs of the loaded chain, and the simulations behind each number."""

from __future__ import annotations

import numpy as np

from spook_tracker import engine

from ... import case
from ...sweep import line, told
from ..chain import LENGTH
from .scene import (
    BELOW_BREAK,
    COUNT,
    HEAVY,
    LIGHT,
    OBSERVE,
    STEPS,
    STRING,
    TILT,
    TIME_STEP,
    exact_load,
    lift,
    scene,
)

LADDER_RATIO, LADDER_TILT = 1000.0, 1e-4  # rad: small motion to 1e-9

STRING_HALF_STEP = engine.Method(string_stiffness=True, half_step_velocities=True)


def _answers(simulate: case.Simulate, ratio: float, method: engine.Method) -> dict[str, float]:
    result = simulate(scene(ratio), time_step=TIME_STEP, steps=STEPS, method=method, observe=OBSERVE)
    time = TIME_STEP * np.arange(STEPS + 1)
    load = result["places"][:, -1, 0]
    energy = result["energy"] / lift(ratio)
    return {
        "length_deviation": float(result["violation"].max()) / LENGTH,
        "path_error": float(np.abs(load - exact_load(ratio, time)).max()) / (COUNT * LENGTH * TILT),
        "energy_gain": float(energy.max()),
        "energy_lost": float(-energy[-STEPS // 4 :].mean()),
    }


def plain(simulate: case.Simulate) -> dict[str, float]:
    """Plain SPOOK below its break point."""
    return _answers(simulate, BELOW_BREAK, engine.PLAIN)


def string(simulate: case.Simulate) -> dict[str, float]:
    """String stiffness, a million to one."""
    return _answers(simulate, HEAVY, STRING)


def string_unneeded(simulate: case.Simulate) -> dict[str, float]:
    """String stiffness where plain SPOOK would do: what it costs."""
    with_it, without = _answers(simulate, LIGHT, STRING), _answers(simulate, LIGHT, engine.PLAIN)
    return {"energy_cost": with_it["energy_lost"] - without["energy_lost"]}


def draw(simulate: case.Simulate) -> case.Drawing:
    """The load's path at a million to one."""
    result = simulate(scene(HEAVY), time_step=TIME_STEP, steps=STEPS, method=STRING, observe=OBSERVE)
    time = TIME_STEP * np.arange(STEPS + 1)
    swings = np.abs(result["places"][:, -1, 0])
    early, late = float(swings[: STEPS // 4].max()), float(swings[-STEPS // 4 :].max())
    return case.Drawing(
        curves=(
            line("string stiffness, 1e6 : 1", time[::4], result["places"][::4, -1, 0]),
            line("small motion", time[::4], exact_load(HEAVY, time[::4]), "reference"),
        ),
        x_label="time [s]",
        y_label="load, sideways [m]",
        note=f"In the last quarter it swings {told(100.0 * late / early, 3)} % as far as in the first.",
    )


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Largest distance of the load from small motion over 5 s, of the start's excursion."""
    result = simulate(
        scene(LADDER_RATIO, time_step, tilt=LADDER_TILT),
        time_step=time_step,
        duration=5.0,
        method=method,
        observe={"places": engine.Trace(quantity=engine.Position())},
    )
    exact = exact_load(LADDER_RATIO, result.sample_times["places"], LADDER_TILT)
    return float(np.abs(result["places"][:, -1, 0] - exact).max()) / (COUNT * LENGTH * LADDER_TILT)
