"""How well does a distance constraint keep a pendulum's length, and what does it cost in energy?"""

from __future__ import annotations

from typing import Any

import numpy as np

from spook_tracker.engine import (
    PLAIN,
    ConstraintForce,
    Energy,
    Maximum,
    MaximumAbsolute,
    Method,
    Result,
    Trace,
    Violation,
)
from spook_tracker.engine.observe import Observable
from spook_tracker.scalar_tests.case import (
    Configuration,
    Example,
    Ladder,
    Measurement,
    Metric,
    ScalarTest,
    Simulate,
)
from spook_tracker.scalar_tests.pendulum.figures import FIGURES
from spook_tracker.scalar_tests.pendulum.scene import (
    CURVED,
    CURVED_TWICE,
    GRAVITY,
    MASS,
    TIME_STEP,
    angle,
    percent_of_energy,
    percent_of_length,
    period,
    scene,
    swing,
    traced_angle,
)
from spook_tracker.scalar_tests.pendulum.stability import STUDIES

LADDER_DURATION = 10.0  # s
ORDER_4, ORDER_6 = Method(composition="order4"), Method(composition="order6")
ORDER_8 = Method(composition="order8")
HALF_STEP = Method(half_step_velocities=True)
HALF_STEP_CURVED = Method(half_step_velocities=True, corrections=2)
OBSERVE: dict[str, Observable] = {
    "violation": MaximumAbsolute(quantity=Violation("rod")),
    "energy": Trace(quantity=Energy(), from_start=True),
    "tension": Maximum(quantity=ConstraintForce("rod")),
}


def _answers(simulate: Simulate, method: Method) -> dict[str, float]:
    result = swing(simulate, TIME_STEP, method, observe=OBSERVE)
    energy = percent_of_energy(result)
    return {
        "length_deviation": percent_of_length(result),
        "energy_deviation": float(np.abs(energy).max()),
        "energy_at_the_end": float(energy[-1]),
        "tension_at_the_bottom": float(result["tension"]) / (3.0 * MASS * GRAVITY) - 1.0,
        "period_error": _measured_period(simulate, method) / period() - 1.0,
    }


def _measured_period(simulate: Simulate, method: Method) -> float:
    """Mean period [s] between upward passages of the bottom, placed by straight lines between samples."""
    time, theta = traced_angle(simulate, TIME_STEP, 22.0, method)
    before = np.flatnonzero((theta[:-1] < 0.0) & (theta[1:] >= 0.0))
    passages = time[before] - theta[before] * TIME_STEP / (theta[before + 1] - theta[before])
    return float(np.diff(passages).mean())


def plain(simulate: Simulate) -> dict[str, float]:
    """Plain SPOOK."""
    return _answers(simulate, PLAIN)


def curved(simulate: Simulate) -> dict[str, float]:
    """Curved constraints, one correction."""
    return _answers(simulate, CURVED)


def curved_twice(simulate: Simulate) -> dict[str, float]:
    """Curved constraints, two corrections."""
    return _answers(simulate, CURVED_TWICE)


def length_error(simulate: Simulate, time_step: float, method: Method) -> float:
    """Largest length deviation over 10 s [%]."""
    observe: dict[str, Observable] = {"violation": MaximumAbsolute(quantity=Violation("rod"))}
    return percent_of_length(swing(simulate, time_step, method, duration=LADDER_DURATION, observe=observe))


def angle_error(simulate: Simulate, time_step: float, method: Method) -> float:
    """Largest |angle − exact angle| over 10 s [rad]."""
    time, theta = traced_angle(simulate, time_step, LADDER_DURATION, method)
    return float(np.abs(theta - angle(time)).max())


def run(simulate: Simulate, time_step: float, method: Method) -> Result:
    """The same 10 s with nothing observed."""
    return simulate(scene(time_step), time_step=time_step, duration=LADDER_DURATION, method=method)


PROTOTYPE = (
    "the method's own discrete solution: the prototype tests/oracle.py, written from the equations alone"
)


def _around(value: float, relative: float = 1e-6) -> tuple[float, float]:
    return (value * (1.0 - relative), value * (1.0 + relative))


def _length(role: Any, limit: float, source: str, value: float) -> Metric:
    return Metric(
        name="length_deviation",
        description="largest |length − 1 m| in 22 s",
        unit="%",
        role=role,
        limit=limit,
        limit_source=source,
        set_point=_around(value, 1e-6 if value > 1e-4 else 1e-4),  # the smallest is rounding to seven digits
        set_point_source=PROTOTYPE,
        reference=0.0,
        relative_tolerance=1e-8,
        tolerance=1e-12,
    )


def _energy(limit: float, source: str, value: float) -> Metric:
    return Metric(
        name="energy_deviation",
        description="largest |E − E₀| in 22 s, of m g l",
        unit="%",
        role="companion",
        limit=limit,
        limit_source=source,
        set_point=_around(value),
        set_point_source=PROTOTYPE,
        reference=0.0,
        relative_tolerance=1e-8,
    )


ENERGY_AT_THE_END = Metric(
    name="energy_at_the_end",
    description="E − E₀ after 22 s, of m g l: negative is a loss",
    unit="%",
    role="companion",
    better="larger",
    limit=-0.205,
    limit_source="plain SPOOK's own discrete solution loses 0.2048 % (tests/oracle.py), and no remedy may buy its length "
    "with more energy; projecting positions loses far more",
    reference=0.0,
    relative_tolerance=1e-7,
)
TENSION = Metric(
    name="tension_at_the_bottom",
    description="largest rod tension over 3 m g, minus one",
    unit="1",
    role="companion",
    limit=2.73e-3,
    limit_source="3 m g at the bottom, to second order in h: (h ω)² = 2.73e-3",
    reference=0.0,
    relative_tolerance=1e-7,
)
PERIOD = Metric(
    name="period_error",
    description="measured period over 4 K(½) √(l/g), minus one",
    unit="1",
    role="companion",
    limit=9.1e-4,
    limit_source="second order in h: a third of (h ω)² = 2.73e-3",
    reference=0.0,
    relative_tolerance=1e-7,
)
HALF_STEP_OLD = (
    "½ h v·a of a velocity half a step old is at most 2.29 % of m g l; the step adds 3 % of that at second order "
    "(tests/oracle.py: 2.362 %)"
)
COMPANIONS = (ENERGY_AT_THE_END, TENSION, PERIOD)

TEST = ScalarTest(
    title="Pendulum",
    question="How well does a distance constraint keep a pendulum's length?",
    why="A constraint that stretches is a spring nobody asked for. Length alone says little, since a length can be "
    "kept by throwing energy away: energy, tension and period stand beside it.",
    model="A bob of 1 kg on a distance constraint of 1 m to a fixed point starts level with that point, at rest, "
    "and swings for 22 s. The bob is a particle; its radius of 0.25 m plays no part.",
    parameters=(
        ("time step", "1/60 s; figures 0.0063 to 0.07 s"),
        ("mass", "1 kg; figure 1 to 1200 kg"),
        ("length", "1 m"),
        ("start", "90°, at rest"),
        ("gravity", "9.81 m/s²"),
        ("compliance", "1e-13 m/N"),
        ("damping", "one time step"),
        ("duration", "22 s, 9.29 periods"),
    ),
    theory=(
        "g = |x| − l = 0",
        "sin(θ/2) = √½ cd(√(g/l) t | ½), period 4 K(½) √(l/g) = 2.36784194757624 s, tension at the bottom 3 m g",
        "Linearised rows leave the curvature of the circle out: |Δl| ≈ h² v² (1 + 2 τ/h)/(4 l), v² = 2 g l at most.",
        "With τ = h this is ¾ · 2 g h² = 0.409 % at h = 1/60 s, second order in h, whatever the mass.",
        "Curved constraints put the curvature into the right side: order 4 with one correction, 6 with two.",
    ),
    reference="Jacobi's elliptic functions for angle and period; 1 m for the length; E₀ for the energy.",
    conclusion="Green: rods hold, and no energy was paid for it. Red in length: regularisation or solve went wrong. "
    "Red in energy with a green length: the length is bought.",
    source="thesis, section 3.2.5 and section 4.2",
    seven=True,
    misprints=(
        "The printed limit of 0.004 % is ten times tighter than Figs 3.20 and 3.24, which read 0.4 %: a ratio "
        "printed as per cent. Here 0.004 % is taken literally and met by curved constraints; plain SPOOK gives "
        "0.407 %.",
        "22 s are 9.29 periods, not a little more than 10.",
        "Fig 3.23 shows length, not energy. The explosion without compliance and damping is a property of the "
        "method (a double eigenvalue −1), not a defect.",
        "Eq 2.11 has the wrong sign of the damping term, Eq 2.12 lacks 1/h beside the compliance, since the "
        "multiplier is an impulse.",
    ),
    measurements=(
        Measurement(
            configuration="curved",
            time_step=TIME_STEP,
            metrics=(
                _length("gate", 0.004, "thesis, section 4.2, as printed", 9.2780682e-4),
                _energy(2.37, HALF_STEP_OLD, 2.3612642),
                *COMPANIONS,
            ),
            measure=curved,
            note="curved constraints, one extra back-substitution",
        ),
        Measurement(
            configuration="plain",
            time_step=TIME_STEP,
            metrics=(
                _length(
                    "companion",
                    0.409,
                    "theory: (1 + 2 τ/h)/4 · 2 g h²/l",
                    0.40703795,
                ),
                _energy(3.5, "Fig 3.24 reads 3 to 3.5 %", 3.4329115),
                *COMPANIONS,
            ),
            measure=plain,
            note="the SPOOK step as it stands: rows linearised at the start of the step",
        ),
        Measurement(
            configuration="curved twice",
            time_step=TIME_STEP,
            metrics=(
                _length(
                    "companion",
                    0.004,
                    "thesis, section 4.2, as printed",
                    2.53509e-6,
                ),
                _energy(2.37, HALF_STEP_OLD, 2.3617971),
                *COMPANIONS,
            ),
            measure=curved_twice,
            note="curved constraints, two extra back-substitutions",
        ),
    ),
    example=lambda: Example(scene=scene(TIME_STEP), time_step=TIME_STEP, observe=OBSERVE),
    figures=FIGURES,
    ladders=(
        Ladder(
            name="length",
            description="largest length deviation over 10 s",
            unit="%",
            time_steps=tuple(1.0 / n for n in (15, 30, 60, 120, 240, 480)),
            configurations=(
                Configuration(name="plain", method=PLAIN, expected_order=2.0, order_range=(1 / 480, 1 / 30)),
                Configuration(
                    name="curved", method=CURVED, expected_order=4.0, order_range=(1 / 480, 1 / 60)
                ),
                Configuration(
                    name="curved twice",
                    method=CURVED_TWICE,
                    expected_order=6.0,
                    order_range=(1 / 120, 1 / 30),
                ),
            ),
            error=length_error,
            run=run,
            target_error=0.01,
            target_seconds=1e-3,
        ),
        Ladder(
            name="angle",
            description="largest angle error over 10 s against elliptic functions",
            unit="rad",
            time_steps=tuple(1.0 / n for n in (15, 20, 30, 60, 120, 240, 480, 960, 1920, 3840)),
            configurations=(
                Configuration(
                    name="plain", method=PLAIN, expected_order=1.0, order_range=(1 / 3840, 1 / 480)
                ),
                Configuration(
                    name="half-step", method=HALF_STEP, expected_order=2.0, order_range=(1 / 3840, 1 / 480)
                ),
                Configuration(
                    name="half-step, curved twice",
                    method=HALF_STEP_CURVED,
                    expected_order=2.0,
                    order_range=(1 / 3840, 1 / 240),
                ),
                Configuration(
                    name="order 4", method=ORDER_4, expected_order=4.0, order_range=(1 / 480, 1 / 60)
                ),
                Configuration(
                    name="order 6", method=ORDER_6, expected_order=6.0, order_range=(1 / 120, 1 / 30)
                ),
                Configuration(
                    name="order 8", method=ORDER_8, expected_order=8.0, order_range=(1 / 30, 1 / 15)
                ),
            ),
            error=angle_error,
            run=run,
            target_error=1e-3,
            target_seconds=1e-2,
        ),
    ),
    stability=STUDIES,
)
