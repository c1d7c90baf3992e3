"""What is read from runs of the door on its hinges, and the simulations behind each number."""

from __future__ import annotations

import numpy as np

from spook_tracker import engine

from ... import case
from ...sweep import line, told
from .scene import TIME_STEP, forces, least_norm_forces, scene, weight_error

LADDER_COUNT = 5

COUNTS = (1, 2, 3, 4, 5, 8, 10, 15, 20, 30, 40, 60, 80)

COUNTS_TO_200 = (1, 2, 3, 5, 10, 20, 50, 100, 200)

MASSES = (1.0, 10.0, 45.0, 100.0, 200.0, 300.0, 400.0, 500.0, 600.0)


SINGLE = 100.0 * 2.0**-24  # %, of a number with 24 bits


def _largest(values: np.ndarray) -> float:
    return float(values[np.argmax(np.abs(values))])


def _measure_damped(simulate: case.Simulate) -> dict[str, float]:
    held = forces(simulate, steps=1200, damping=2.0 * TIME_STEP)
    error = weight_error(held)
    return {"weight_error": _largest(error), "weight_error_settled": _largest(error[99:])}


def _measure_printed(simulate: case.Simulate) -> dict[str, float]:
    error = weight_error(forces(simulate, steps=3900))
    return {
        "weight_error": _largest(error[:1200]),
        "weight_error_at_20_s": float(error[1199]),
        "weight_error_to_65_s": _largest(error),
    }


def _measure_split(simulate: case.Simulate) -> dict[str, float]:
    worst = 0.0
    for count in COUNTS_TO_200:
        held = forces(simulate, steps=200, count=count, damping=2.0 * TIME_STEP)[-1]
        right = least_norm_forces(count)
        worst = max(worst, float(np.abs(held - right).max() / np.abs(right).max()))
    return {"split_error": worst}


def _measure_singular(simulate: case.Simulate) -> dict[str, float]:
    held = forces(simulate, steps=1200, count=5, damping=2.0 * TIME_STEP, compliance=0.0)
    return {"weight_error_settled": _largest(weight_error(held))}


def _measure_balance(simulate: case.Simulate) -> dict[str, float]:
    held = forces(simulate, steps=1200, damping=2.0 * TIME_STEP)
    return {"sideways_sum": _largest(held[99:, :, 0].sum(axis=1))}


def draw_against_count(simulate: case.Simulate) -> case.Drawing:
    printed, damped = [], []
    for count in COUNTS:
        printed.append(float(np.abs(weight_error(forces(simulate, steps=1200, count=count))).max()))
        held = forces(simulate, steps=200, count=count, damping=2.0 * TIME_STEP)
        damped.append(max(float(np.abs(weight_error(held)[99:]).max()), 1e-16))
    counts = tuple(map(float, COUNTS))
    return case.Drawing(
        curves=(
            case.Curve(name="printed damping 1e-13 s", x=counts, y=tuple(printed)),
            case.Curve(name="damping 2 h, settled", x=counts, y=tuple(damped)),
            line("limit", (1.0, 80.0), (0.02, 0.02), "limit"),
            line("what 32 bits resolve", (1.0, 80.0), (SINGLE, SINGLE), "reference"),
        ),
        x_label="hinges",
        y_label="largest deviation of the vertical force [% of weight]",
        y_scale="log",
        note=f"With the printed damping it rings by up to {told(max(printed))} %, with damping 2 h {told(max(damped))} % are "
        "left.",
    )


def draw_sideways(simulate: case.Simulate) -> case.Drawing:
    values = []
    for mass in MASSES:
        held = forces(simulate, steps=200, mass=mass, damping=2.0 * TIME_STEP)[-1]
        values.append(1e6 * abs(abs(held[0, 0]) - abs(held[1, 0])))
    return case.Drawing(
        curves=(line("two hinges", MASSES, values, "both"),),
        x_label="mass of the door [kg]",
        y_label="difference of the horizontal forces [µN]",
        note=f"At most {told(max(values))} µN. In theory F₁ₓ = −F₂ₓ; the thesis reads up to 0.2 µN at 600 kg.",
    )


def draw_against_mass(simulate: case.Simulate) -> case.Drawing:
    printed, damped = [], []
    for mass in MASSES:
        printed.append(float(np.abs(weight_error(forces(simulate, steps=1200, mass=mass), mass)).max()))
        held = forces(simulate, steps=200, mass=mass, damping=2.0 * TIME_STEP)
        damped.append(max(float(np.abs(weight_error(held, mass)[99:]).max()), 1e-16))
    left = sum(error > 0.02 for error in printed)
    kept = f"{left} of {len(MASSES)} doors leave the printed limit" if left else "all keep the printed limit"
    return case.Drawing(
        curves=(
            case.Curve(name="printed damping 1e-13 s", x=MASSES, y=tuple(printed)),
            case.Curve(name="damping 2 h, settled", x=MASSES, y=tuple(damped)),
            line("limit", (MASSES[0], MASSES[-1]), (0.02, 0.02), "limit"),
            line("what 32 bits resolve", (MASSES[0], MASSES[-1]), (SINGLE, SINGLE), "reference"),
        ),
        x_label="mass of the door [kg]",
        y_label="largest deviation of the vertical force [% of weight]",
        y_scale="log",
        note=f"{told(printed[0])} % at {MASSES[0]:g} kg and {told(printed[-1])} % at {MASSES[-1]:g} kg: {kept}.",
    )


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Largest |ΔFz| in the second second, damping 2 h [%]."""
    half = round(1.0 / time_step)
    observe = {
        f"hinge {i + 1}": engine.Trace(quantity=engine.ConstraintForce(f"hinge {i + 1}"), first=half)
        for i in range(LADDER_COUNT)
    }
    built = scene(LADDER_COUNT, damping=2.0 * time_step)
    result = simulate(built, time_step=time_step, duration=2.0, method=method, observe=observe)
    held = np.stack([result[name] for name in observe], axis=1)
    return abs(_largest(weight_error(held)))
