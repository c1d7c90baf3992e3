"""Is a spring that is a plain force integrated exactly as Verlet's stepper does it?"""

from __future__ import annotations

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.theory import plain_spring_invariant

from ... import case
from ...sweep import apart, line
from .scene import MASS, START, STEPS, STIFFNESS, TIME_STEP, spring_scene, traced
from .stability import SOFT_SPRING_STUDY, SPRING_STUDY

ORDER_4, ORDER_6 = engine.Method(composition="order4"), engine.Method(composition="order6")


def verlet(steps: int = STEPS) -> np.ndarray:
    """Positions [m] of v₊ = v + h F/m, x₊ = x + h v₊ (thesis, Eq 2.20), in double precision."""
    x, v, path = START, 0.0, [START]
    for _ in range(steps):
        force = -STIFFNESS * x
        v += TIME_STEP * (force / MASS)
        x += TIME_STEP * v
        path.append(x)
    return np.array(path)


def against_verlet(simulate: case.Simulate) -> dict[str, float]:
    """Difference to Verlet, and the spread of the quantity symplectic Euler keeps."""
    _, x, v = traced(simulate, spring_scene())
    kept = plain_spring_invariant(x, v, STIFFNESS / MASS, TIME_STEP)
    return {
        "difference": float(np.abs(x - verlet()).max()),
        "invariant_drift": float(np.abs(kept / kept[0] - 1.0).max()),
    }


def draw(simulate: case.Simulate) -> case.Drawing:
    """Both against time."""
    time, x, _ = traced(simulate, spring_scene())
    return case.Drawing(
        curves=(line("simulation", time, x), line("Verlet", time, verlet(), "reference")),
        x_label="time [s]",
        y_label="position z [m]",
        note=f"The two are at most {apart(x, verlet())} m apart.",
    )


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Largest distance from the oscillator of the continuum over 2 s [m]."""
    observe = {"x": engine.Trace(quantity=engine.Position("mass"))}
    result = simulate(spring_scene(), time_step=time_step, duration=2.0, method=method, observe=observe)
    exact = START * np.cos(np.sqrt(STIFFNESS / MASS) * result.sample_times["x"])
    return float(np.abs(result["x"][:, 2] - exact).max())


TEST = case.ScalarTest(
    title="Oscillator: spring force",
    question="Is a spring that is a plain force integrated exactly as Verlet's stepper does it?",
    why="With nothing constrained SPOOK is symplectic Euler, the stepper of Verlet. Any bit of difference means that "
    "the step does something else besides.",
    model="A mass of 1 kg on a spring force, no gravity, starts 2 m out, at rest, and oscillates for 5 s.",
    parameters=(
        ("time step", "1/60 s"),
        ("mass", "1 kg"),
        ("stiffness", "0.014/h² = 50.4 N/m, 53 steps a period"),
        ("start", "2 m from rest, at rest (read off Fig 2.4)"),
        ("duration", "5 s"),
    ),
    theory=(
        "v₊ = v − h (κ/m) x, x₊ = x + h v₊",
        "v² − h ω² x v + ω² x² is kept exactly, ω² = κ/m; stable while h ω < 2.",
    ),
    reference="The same three operations in a loop, in the same order.",
    conclusion="Green: forces enter the step once and unscaled. Red: gain, order or rounding of the force differ.",
    source="thesis, section 2.1.2.2, Fig 2.4",
    misprints=("Eq 2.17 lacks the sine term that a start from rest needs when there is damping.",),
    measurements=(
        case.Measurement(
            configuration="plain",
            time_step=TIME_STEP,
            metrics=(
                case.Metric(
                    name="difference",
                    description="largest |simulation − Verlet| in 5 s",
                    unit="m",
                    role="gate",
                    limit=0.0,
                    limit_source="thesis, section 2.1.2.2: the difference is always 0",
                    set_point=(0.0, 0.0),
                    set_point_source="equal to the bit",
                    reference=0.0,
                ),
                case.Metric(
                    name="invariant_drift",
                    description="largest relative change of v² − h ω² x v + ω² x²",
                    unit="1",
                    role="companion",
                    limit=1e-13,
                    limit_source="kept exactly; 300 roundings remain",
                    reference=0.0,
                    tolerance=1e-14,
                ),
            ),
            measure=against_verlet,
            note="the SPOOK step with a force and no row",
        ),
    ),
    example=lambda: case.Example(scene=spring_scene(), time_step=TIME_STEP),
    figures=(case.Figure(name="position", title="Position against time", draw=draw, thesis="Fig 2.4"),),
    stability=(SPRING_STUDY, SOFT_SPRING_STUDY),
    ladders=(
        case.Ladder(
            name="position",
            description="largest distance from x₀ cos ω t over 2 s",
            unit="m",
            time_steps=tuple(1.0 / n for n in (60, 120, 240, 480, 960, 1920)),
            configurations=(
                case.Configuration(name="plain", method=engine.PLAIN, expected_order=1.0),
                case.Configuration(
                    name="half-step", method=engine.Method(half_step_velocities=True), expected_order=2.0
                ),
                case.Configuration(
                    name="order 4", method=ORDER_4, expected_order=4.0, order_range=(1 / 480, 1 / 60)
                ),
                case.Configuration(
                    name="order 6", method=ORDER_6, expected_order=6.0, order_range=(1 / 240, 1 / 60)
                ),
            ),
            error=ladder_error,
            target_error=0.01,
            target_seconds=1e-3,
        ),
    ),
)
