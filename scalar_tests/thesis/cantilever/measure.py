"""What is read from runs of the beam."""

from __future__ import annotations

import math

import numpy as np

from spook_tracker import engine

from ... import case
from .scene import (
    COUNT,
    COUNTS,
    DENSITY,
    GRAVITY,
    LADDER_COUNT,
    LENGTH,
    LOAD,
    SMALL,
    STIFFNESS,
    TIME_STEP,
    TIP,
    deflection,
    scene,
)
from .statics import chain_tip, elastica_tip


def settled_nodes(simulate: case.Simulate, count: int, load: float, seconds: float = 30.0) -> np.ndarray:
    """(count,) downward deflection [m] of the box centres at rest, without self-weight."""
    observe = {"nodes": engine.Final(quantity=engine.Position())}
    result = simulate(scene(count, load), time_step=TIME_STEP, duration=seconds, observe=observe)
    return np.asarray(-result["nodes"][:, 2])


def tip_deflection(simulate: case.Simulate, count: int, *, self_weight: bool = False) -> float:
    """Downward tip deflection [m] once every box has been slower than 1e-4 m/s for a second; NaN if none is."""
    result = simulate(
        scene(count, self_weight=self_weight),
        time_step=TIME_STEP,
        duration=40.0,
        observe={
            "speed": engine.Trace(quantity=engine.Velocity(), first=2340),
            "last": engine.Final(quantity=engine.Position(f"box {count}")),
            "turn": engine.Final(quantity=engine.Orientation(f"box {count}")),
        },
    )
    if np.linalg.norm(result["speed"], axis=-1).max() > 1e-4:
        return math.nan
    w, x, y, z = result["turn"]
    half = 0.5 * LENGTH / count
    return -float(result["last"][2] + half * 2.0 * (x * z - w * y))


def _measure_nodes(simulate: case.Simulate) -> dict[str, float]:
    worst = 0.0
    for count in COUNTS:
        x = (np.arange(count) + 0.5) * LENGTH / count
        right = deflection(x, SMALL * LOAD)
        nodes = settled_nodes(simulate, count, SMALL * LOAD)
        worst = max(worst, float(np.abs(nodes / right - 1.0).max()))
    return {"node_error": worst}


def _measure_tip(simulate: case.Simulate) -> dict[str, float]:
    tip = tip_deflection(simulate, 80)
    return {
        "tip_deflection": tip,
        "tip_against_linear": tip / TIP - 1.0,
        "tip_against_elastica": tip / elastica_tip() - 1.0,
        "tip_against_statics": tip / chain_tip(80) - 1.0,
    }


def _measure_weight(simulate: case.Simulate) -> dict[str, float]:
    linear = TIP + DENSITY * GRAVITY * LENGTH**4 / (8.0 * STIFFNESS)
    return {"self_weight_ratio": tip_deflection(simulate, COUNT, self_weight=True) / linear}


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Tip of LADDER_COUNT pieces after 20 s over their statics, minus one."""
    last = f"box {LADDER_COUNT}"
    observe = {
        "last": engine.Final(quantity=engine.Position(last)),
        "turn": engine.Final(quantity=engine.Orientation(last)),
    }
    built = scene(LADDER_COUNT)
    result = simulate(built, time_step=time_step, duration=20.0, method=method, observe=observe)
    w, x, y, z = result["turn"]
    half = 0.5 * LENGTH / LADDER_COUNT
    tip = -(float(result["last"][2]) + half * 2.0 * float(x * z - w * y))
    return tip / chain_tip(LADDER_COUNT) - 1.0
