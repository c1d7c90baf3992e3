"""Does a damped distance row decay by √α a step, as the theory of the method says?"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from spook_tracker import engine

from ... import case
from ...configurations import configured
from ...sweep import apart, line
from .scene import (
    MASS,
    START,
    STEPS,
    STIFFNESS,
    TIME_STEP,
    decay,
    growth,
    one_step,
    row_scene,
    run_map,
    traced,
)
from .stability import MAP_STUDY, growth_error

DAMPING = 2.0 * TIME_STEP  # s
MAP_STEPS = 8
SHOWN = 3.0  # s


def _damped_wave(time: Any) -> Any:
    """Damped oscillator from rest at START: Eq 2.17 with its sine term, ζ ω = τ κ/(2 m)."""
    rate = 0.5 * DAMPING * STIFFNESS / MASS
    wave = math.sqrt(STIFFNESS / MASS - rate**2)
    return START * np.exp(-rate * time) * (np.cos(wave * time) + rate / wave * np.sin(wave * time))


def damped(simulate: case.Simulate) -> dict[str, float]:
    """Path against the powers of the map, decay against √α."""
    _, x, v = traced(simulate, row_scene(STIFFNESS, DAMPING))
    step, state, worst = one_step(STIFFNESS, DAMPING), np.array([START, 0.0]), 0.0
    for k in range(STEPS + 1):
        worst = max(worst, abs(x[k] - state[0]))
        state = step @ state
    measured = growth(run_map(simulate, STIFFNESS, DAMPING, TIME_STEP, MAP_STEPS), MAP_STEPS)
    time = TIME_STEP * np.arange(STEPS + 1)
    return {
        "difference": float(worst) / START,
        "decay_error": measured / decay(STIFFNESS, DAMPING) - 1.0,
        "against_continuum": float(np.abs(x - _damped_wave(time)).max()),
        "final_speed": float(abs(v[-1])),
    }


def over_the_map(simulate: case.Simulate) -> dict[str, float]:
    """Growth per step against the eigenvalue, over h ω = 0.01 … 1e6 and τ/h = 0 … 10."""
    return {"growth_error": growth_error(simulate)}


def draw(simulate: case.Simulate) -> case.Drawing:
    """Simulation, continuum and decay."""
    time, x, _ = traced(simulate, row_scene(STIFFNESS, DAMPING), steps=round(SHOWN / TIME_STEP))
    envelope = START * decay(STIFFNESS, DAMPING) ** np.arange(len(time))
    return case.Drawing(
        curves=(
            line("simulation", time, x),
            line("damped oscillator", time, _damped_wave(time), "reference"),
            line("x₀ √α ᵏ", time, envelope, "limit"),
        ),
        x_label="time [s]",
        y_label="position z [m]",
        note=f"At most {apart(x, _damped_wave(time))} m from the damped oscillator of ratio h ω.",
    )


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Largest distance from the oscillator of the continuum over 2 s [m]."""
    observe = {"x": engine.Trace(quantity=engine.Position("mass"))}
    result = simulate(
        row_scene(STIFFNESS, DAMPING), time_step=time_step, duration=2.0, method=method, observe=observe
    )
    exact = _damped_wave(result.sample_times["x"])
    return float(np.abs(result["x"][:, 2] - exact).max())


TEST = case.ScalarTest(
    title="Oscillator: damping",
    question="Does a damped distance row decay by √α a step, as the theory of the method says?",
    why="SPOOK's damping is what keeps stiff constraints quiet. Its strength is known exactly, so it can be held to "
    "the last digit.",
    model="A mass of 1 kg on a distance row of compliance 1/κ with damping 2 h, no gravity, from 2 m out at rest.",
    parameters=(
        ("time step", "1/60 s"),
        ("mass", "1 kg"),
        ("stiffness", "0.014/h² = 50.4 N/m"),
        ("damping", "τ = 2 h"),
        ("start", "2 m from rest length, at rest"),
    ),
    theory=(
        "z₊ = A z, α = det A = 1 − 4θ ρ/(1 + 4θ), ½ tr A = 1 − 2(θ + 1) ρ/(1 + 4θ), ρ = 1/(1 + m Σ)",
        "While it oscillates both eigenvalues have the modulus √α.",
        "Continuum: x = x₀ e^(−ζωt) (cos ω′t + ζω/ω′ sin ω′t), ζ = τ ω/2.",
    ),
    reference="The powers of the one-step map, in closed form; the damped oscillator beside it.",
    conclusion="Green: damping has the right sign, size and time scale. Red: most likely Υ or Σ is misplaced, or "
    "damping is counted in steps instead of seconds.",
    source="thesis, section 2.1.2.2, Fig 2.7 and Eqs 2.21 to 2.30",
    misprints=(
        "Eq 2.11: the damping term must have a plus.",
        "Eq 2.17 lacks the sine term of a start from rest.",
        "Eq 2.27, second line: the bounds must be 1/3 < β < 1.",
        "For real eigenvalues |λ| = |α| is false: α is their product.",
    ),
    measurements=(
        case.Measurement(
            configuration="plain",
            time_step=TIME_STEP,
            metrics=(
                case.Metric(
                    name="difference",
                    description="largest |x − Aᵏ x₀| over x₀ in 5 s",
                    unit="1",
                    role="gate",
                    limit=1e-12,
                    limit_source="rounding of 300 steps",
                    reference=0.0,
                    tolerance=1e-13,
                ),
                case.Metric(
                    name="decay_error",
                    description="decay per step read off two runs over √α, minus one",
                    unit="1",
                    role="companion",
                    limit=1e-12,
                    limit_source="exact; rounding remains",
                    reference=0.0,
                    tolerance=1e-13,
                ),
                case.Metric(
                    name="against_continuum",
                    description="largest distance from the damped oscillator of the continuum",
                    unit="m",
                    role="companion",
                    limit=0.0809,
                    limit_source="the powers of A against the damped oscillator, both in closed form: 0.08083 m",
                    set_point=(0.080828, 0.080830),
                    set_point_source="both in closed form",
                    reference=0.0,
                ),
                case.Metric(
                    name="final_speed",
                    description="speed after 5 s",
                    unit="m/s",
                    role="reported",
                    better="smaller",
                ),
            ),
            measure=damped,
            note="damping two time steps",
        ),
        case.Measurement(
            configuration="map",
            time_step=TIME_STEP,
            metrics=(
                case.Metric(
                    name="growth_error",
                    description="largest |growth − |eigenvalue|| per step over h ω = 0.01 … 1e6, τ/h = 0 … 10",
                    unit="1",
                    role="companion",
                    limit=1e-10,
                    limit_source="exact; rounding remains",
                    reference=0.0,
                    tolerance=1e-12,
                ),
            ),
            measure=over_the_map,
            note="170 oscillators, each read off two runs of 8 steps",
        ),
    ),
    example=lambda: case.Example(scene=row_scene(STIFFNESS, DAMPING), time_step=TIME_STEP),
    figures=(case.Figure(name="damped", title="Damped oscillation", draw=draw, thesis="Fig 2.7"),),
    stability=(MAP_STUDY,),
    ladders=(
        case.Ladder(
            name="position",
            description="largest distance from the damped oscillator over 2 s",
            unit="m",
            time_steps=tuple(1.0 / n for n in (60, 120, 240, 480, 960, 1920)),
            configurations=configured({"plain": 1.0, "half-step": 1.0}),
            error=ladder_error,
            target_error=0.01,
            target_seconds=1e-3,
        ),
    ),
)
