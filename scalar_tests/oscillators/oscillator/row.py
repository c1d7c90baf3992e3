"""Does a distance row with compliance 1/κ oscillate as a spring κ, and stay bounded when it is far too fast?"""

from __future__ import annotations

import math

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.theory import undamped_row_invariant, undamped_row_phase

from ... import case
from ...configurations import configured
from ...sweep import apart, line, told
from .scene import MASS, REST_LENGTH, START, STEPS, STIFFNESS, TIME_STEP, one_step, row_scene, traced
from .spring import verlet
from .stability import ROW_STUDY, SOFT_ROW_STUDY

FAST_STIFFNESS = 400.0 / TIME_STEP**2  # N/m: (h ω)² = 400, a hundred times beyond Verlet's bound
LONG_STEPS = 100_000
STIFF_STEPS = 50


def _path(stiffness: float, steps: int) -> np.ndarray:
    """(steps + 1, 2) exact discrete states A^k (START, 0)."""
    step, states = one_step(stiffness, 0.0), [np.array([START, 0.0])]
    for _ in range(steps):
        states.append(step @ states[-1])
    return np.array(states)


def _answers(simulate: case.Simulate, stiffness: float) -> dict[str, float]:
    _, x, v = traced(simulate, row_scene(stiffness, 0.0))
    exact = _path(stiffness, STEPS)
    square = stiffness / MASS
    kept = undamped_row_invariant(x, v, square, TIME_STEP)
    amplitude = START * math.sqrt(1.0 + square * TIME_STEP**2 / 4.0)
    return {
        "difference": float(np.abs(x - exact[:, 0]).max()) / amplitude,
        "invariant_drift": float(np.abs(kept / kept[0] - 1.0).max()),
        "amplitude": float(np.abs(x).max()) / amplitude,
    }


def slow(simulate: case.Simulate) -> dict[str, float]:
    """53 steps a period; the frequency from x₊ + x₋ = 2 cos φ x."""
    answers = _answers(simulate, STIFFNESS)
    _, x, _ = traced(simulate, row_scene(STIFFNESS, 0.0))
    cosine = float(x[1:-1] @ (x[2:] + x[:-2]) / (2.0 * x[1:-1] @ x[1:-1]))
    expected = undamped_row_phase(STIFFNESS / MASS, TIME_STEP)
    return answers | {"frequency_error": math.acos(cosine) / expected - 1.0}


def fast(simulate: case.Simulate) -> dict[str, float]:
    """h ω = 20: aliased, but bounded."""
    return _answers(simulate, FAST_STIFFNESS)


def fast_and_long(simulate: case.Simulate) -> dict[str, float]:
    """The same for 100 000 steps."""
    _, x, _ = traced(simulate, row_scene(FAST_STIFFNESS, 0.0), steps=LONG_STEPS)
    bound = START * math.sqrt(1.0 + FAST_STIFFNESS / MASS * TIME_STEP**2 / 4.0)
    return {"amplitude": float(np.abs(x).max()) / bound}


def stiff(simulate: case.Simulate) -> dict[str, float]:
    """No compliance and no damping: −1 is a double eigenvalue and x grows as (−1)ⁿ (2n + 1)."""
    scene = row_scene(math.inf, 0.0, start=1.0 / 64.0)
    _, x, _ = traced(simulate, scene, steps=STIFF_STEPS)
    n = np.arange(STIFF_STEPS + 1)
    return {"linear_growth_error": float(np.abs(64.0 * x - (-1.0) ** n * (2 * n + 1)).max())}


def draw_row(simulate: case.Simulate) -> case.Drawing:
    """Row and Verlet against time."""
    time, x, _ = traced(simulate, row_scene(STIFFNESS, 0.0))
    return case.Drawing(
        curves=(line("distance row", time, x), line("Verlet", time, verlet(), "reference")),
        x_label="time [s]",
        y_label="position z [m]",
        note="The row's frequency is (2/h) atan(h ω/2), a little below ω; Verlet's is a little above.",
    )


def draw_difference(simulate: case.Simulate) -> case.Drawing:
    """Row minus Verlet."""
    time, x, _ = traced(simulate, row_scene(STIFFNESS, 0.0))
    return case.Drawing(
        curves=(line("distance row minus Verlet", time, x - verlet()),),
        x_label="time [s]",
        y_label="difference [m]",
        note=f"The phase parts: up to {apart(x, verlet())} m. The largest places differ by "
        f"{told(float(np.abs(x).max() - np.abs(verlet()).max()))} m.",
    )


def draw_fast(simulate: case.Simulate) -> case.Drawing:
    """h ω = 20."""
    time, x, _ = traced(simulate, row_scene(FAST_STIFFNESS, 0.0))
    bound = START * math.sqrt(1.0 + FAST_STIFFNESS / MASS * TIME_STEP**2 / 4.0)
    return case.Drawing(
        curves=(
            line("distance row, h ω = 20", time, x),
            line("± x₀ √(1 + (h ω/2)²)", [0.0, 5.0, 5.0, 0.0], [bound, bound, -bound, -bound], "limit"),
        ),
        x_label="time [s]",
        y_label="position z [m]",
        note="Aliasing: what is seen is not the motion. The start from rest is, to the step, a velocity half a step "
        f"old, so the amplitude grows: to {told(float(np.abs(x).max()), 3)} m, x₀ √(1 + (h ω/2)²) is {told(bound, 3)} m.",
    )


DIFFERENCE = case.Metric(
    name="difference",
    description="largest |x − Aᵏ x₀| over the amplitude, 300 steps",
    unit="1",
    role="gate",
    limit=1e-12,
    limit_source="rounding of 300 steps; A is the map of one step in closed form",
    reference=0.0,
    tolerance=1e-13,
)


def _invariant(limit: float) -> case.Metric:
    return case.Metric(
        name="invariant_drift",
        description="largest relative change of v² + ω² (x − h v/2)²",
        unit="1",
        role="companion",
        limit=limit,
        limit_source="kept exactly by the undamped step; rounding remains, amplified by h ω",
        reference=0.0,
        tolerance=1e-13,
    )


AMPLITUDE = case.Metric(
    name="amplitude",
    description="largest |x| over x₀ √(1 + (h ω/2)²)",
    unit="1",
    role="companion",
    better="smaller",
    limit=1.0 + 1e-9,
    limit_source="the invariant bounds it",
)


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Largest distance from the oscillator of the continuum over 2 s [m]."""
    observe = {"x": engine.Trace(quantity=engine.Position("mass"))}
    result = simulate(
        row_scene(STIFFNESS, 0.0), time_step=time_step, duration=2.0, method=method, observe=observe
    )
    exact = START * np.cos(np.sqrt(STIFFNESS / MASS) * result.sample_times["x"])
    return float(np.abs(result["x"][:, 2] - exact).max())


TEST = case.ScalarTest(
    title="Oscillator: distance row",
    question="Does a distance row with compliance 1/κ oscillate as a spring κ, bounded at any frequency?",
    why="A constraint with compliance is SPOOK's spring. It must be the right spring, and unlike an explicit one it "
    "must survive when the time step is too long for it.",
    model="A mass of 1 kg on a distance row of compliance 1/κ without damping, along the row, no gravity, from 2 m "
    "out at rest for 5 s; once at 53 steps a period and once at h ω = 20.",
    parameters=(
        ("time step", "1/60 s"),
        ("mass", "1 kg"),
        ("stiffness", "0.014/h² and 400/h²"),
        ("damping", "0"),
        ("rest length", f"{REST_LENGTH:g} m, so that the row never turns over"),
        ("start", "2 m from rest length, at rest"),
    ),
    theory=(
        "z₊ = A z, det A = 1: frequency (2/h) atan(h ω/2), at every h ω",
        "v² + ω² (x − h v/2)² is kept exactly.",
        "From v = 0 the amplitude becomes x₀ √(1 + (h ω/2)²).",
    ),
    reference="The powers of the one-step map, in closed form.",
    conclusion="Green: compliance is inverse stiffness and the row is neutral. Red: regularisation is wrong; growth "
    "means the explicit limit h ω < 2 has come back.",
    source="thesis, section 2.1.2.2, Figs 2.5 and 2.6",
    misprints=(
        "Eq 2.12: the multiplier is an impulse, so the term is (ε/h) λ.",
        "Eqs 2.21 and 2.26 write ε where Σ = 4 ε/(h² (1 + 4θ)) is meant.",
    ),
    measurements=(
        case.Measurement(
            configuration="plain",
            time_step=TIME_STEP,
            metrics=(
                DIFFERENCE,
                _invariant(1e-13),
                AMPLITUDE,
                case.Metric(
                    name="frequency_error",
                    description="measured frequency over (2/h) atan(h ω/2), minus one",
                    unit="1",
                    role="companion",
                    limit=1e-12,
                    limit_source="exact; rounding remains",
                    reference=0.0,
                    tolerance=1e-13,
                ),
            ),
            measure=slow,
            parameters={"(h w)^2": 0.014},
            note="a row of compliance 1/κ, no damping",
        ),
        case.Measurement(
            configuration="plain",
            time_step=TIME_STEP,
            metrics=(DIFFERENCE, _invariant(1e-11), AMPLITUDE),
            measure=fast,
            parameters={"(h w)^2": 400.0},
            note="a hundred times beyond the bound of an explicit spring",
        ),
        case.Measurement(
            configuration="long run",
            time_step=TIME_STEP,
            metrics=(AMPLITUDE,),
            measure=fast_and_long,
            parameters={"(h w)^2": 400.0, "steps": LONG_STEPS},
            note="the same for 100 000 steps",
        ),
        case.Measurement(
            configuration="stiff",
            time_step=TIME_STEP,
            metrics=(
                case.Metric(
                    name="linear_growth_error",
                    description="largest |x/x₀ − (−1)ⁿ (2n + 1)| in 50 steps",
                    unit="1",
                    role="companion",
                    limit=1e-9,
                    limit_source="exact; rounding grows with the square of the steps",
                    reference=0.0,
                    tolerance=1e-12,
                ),
            ),
            measure=stiff,
            note="compliance 0 and damping 0: legal to ask for, never a default; what Fig 3.23 shows",
        ),
    ),
    example=lambda: case.Example(scene=row_scene(STIFFNESS, 0.0), time_step=TIME_STEP),
    figures=(
        case.Figure(name="row", title="Distance row and Verlet", draw=draw_row, thesis="Fig 2.5, upper"),
        case.Figure(
            name="difference",
            title="Distance row minus Verlet",
            draw=draw_difference,
            thesis="Fig 2.5, lower",
        ),
        case.Figure(name="fast", title="Far beyond h ω = 2", draw=draw_fast, thesis="Fig 2.6"),
    ),
    stability=(ROW_STUDY, SOFT_ROW_STUDY),
    ladders=(
        case.Ladder(
            name="position",
            description="largest distance from x₀ cos ω t over 2 s",
            unit="m",
            time_steps=tuple(1.0 / n for n in (60, 120, 240, 480, 960, 1920)),
            configurations=configured({"plain": 1.0, "half-step": 2.0}),
            error=ladder_error,
            target_error=0.01,
            target_seconds=1e-3,
        ),
    ),
)
