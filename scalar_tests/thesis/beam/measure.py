"""What is read from runs of the beam, and the simulations behind each number."""

from __future__ import annotations

import numpy as np

from spook_tracker import engine

from ... import case
from ...sweep import line, told
from .scene import COUNT, SAG_COMPLIANCE, SIZE, STEPS, deviation, heights, sag_of_compliant_beam, scene

LADDER_COUNT = 20
HIDDEN = 2.3e-15  # m/N in every lock row: sags by the printed limit


def _measure_gate(simulate: case.Simulate) -> dict[str, float]:
    return {"height_deviation": deviation(simulate)}


def _measure_long(simulate: case.Simulate) -> dict[str, float]:
    return {"height_deviation": deviation(simulate, count=2000)}


def _measure_sag(simulate: case.Simulate) -> dict[str, float]:
    each = heights(simulate, compliance=SAG_COMPLIANCE)
    return {"sag": float(-each.min()), "sag_error": float(-each.min()) / sag_of_compliant_beam() - 1.0}


def _measure_support(support: str) -> object:
    def measure(simulate: case.Simulate) -> dict[str, float]:
        return {"height_deviation": deviation(simulate, support=support)}

    return measure


def draw_against_time_step(simulate: case.Simulate) -> case.Drawing:
    steps = tuple(float(h) for h in np.geomspace(1e-4, 1e-1, 13))
    values = tuple(deviation(simulate, time_step=h) for h in steps)
    return case.Drawing(
        curves=(line("80 boxes", steps, values, "both"),),
        x_label="time step [s]",
        y_label="largest height deviation over length [%]",
        x_scale="log",
        note=f"At most {told(max(map(abs, values)))} %, with damping that follows the time step. The thesis reads down to "
        "−2e-7 % near h = 1e-4 s, where its beam never stopped ringing.",
    )


def draw_against_time(simulate: case.Simulate) -> case.Drawing:
    step = 9.8e-5
    result = simulate(
        scene(time_step=step),
        time_step=step,
        steps=STEPS,
        observe={"height": engine.Trace(quantity=engine.Position(), every=5, from_start=True)},
    )
    drops = result["height"][:, :COUNT, 2]
    lowest = 100.0 * drops.min(axis=1) / (COUNT * SIZE[0])
    times = tuple(float(t) for t in result.sample_times["height"])
    return case.Drawing(
        curves=(line("80 boxes, h = 9.8e-5 s", times, lowest),),
        x_label="time [s]",
        y_label="lowest height deviation over length [%]",
        note="The thesis' beam rings at this time step (about −1e-6 %).",
    )


def draw_along_the_beam(simulate: case.Simulate) -> case.Drawing:
    rigid = heights(simulate)
    soft = heights(simulate, compliance=HIDDEN)
    bent = 100.0 * float(np.abs(soft).max()) / (COUNT * SIZE[0])
    boxes = tuple(float(i + 1) for i in range(COUNT))
    return case.Drawing(
        curves=(
            line("compliance 0", boxes, 1e6 * rigid, "both"),
            line("compliance 2.3e-15", boxes, 1e6 * soft),
        ),
        x_label="box",
        y_label="height deviation [µm]",
        note=f"A compliance of 2.3e-15 in every lock row gives {told(bent)} % of the length; the printed limit is 4.9e-9 %. "
        "The thesis' figure reads −5e-9 m at the middle, ten times its own limit.",
    )


def draw_against_count(simulate: case.Simulate) -> case.Drawing:
    counts = (10, 20, 40, 60, 80, 100, 150, 200)
    values = tuple(deviation(simulate, count=count) for count in counts)
    hidden = tuple(-100.0 * sag_of_compliant_beam(n, HIDDEN) / (n * SIZE[0]) for n in counts)
    return case.Drawing(
        curves=(
            line("compliance 0", counts, values, "both"),
            line("statics with compliance 2.3e-15", counts, hidden, "reference"),
        ),
        x_label="boxes",
        y_label="largest height deviation over length [%]",
        x_scale="log",
        note=f"{told(values[-1])} % with {counts[-1]} boxes. In the thesis the deviation grows from about 100 boxes on, "
        "down to −8e-8 %.",
    )


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Largest height deviation of LADDER_COUNT boxes over 2 s, of their length [%]."""
    built = scene(LADDER_COUNT, time_step=time_step)
    observe = {"place": engine.MaximumAbsolute(quantity=engine.Position(), from_start=True)}
    result = simulate(built, time_step=time_step, duration=2.0, method=method, observe=observe)
    return 100.0 * float(result["place"][:LADDER_COUNT, 2].max()) / (LADDER_COUNT * SIZE[0])
