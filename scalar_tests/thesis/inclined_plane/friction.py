"""Is Coulomb's law obeyed in every direction?

At tan θ = µ the box only just stands, so any model that can hold it reads F_t/F_n = µ there: the printed gate
alone cannot see anisotropy. The companions slide the box at tan θ = 0.6 in the same 36 directions.
"""

from __future__ import annotations

import math

from spook_tracker import engine

from ... import case
from ...bracket import break_point
from ...sweep import line, told
from .scene import (
    BOX,
    CONE,
    FRICTION,
    MODELS,
    SCALED_BOX,
    TIME_STEP,
    force_direction_error,
    force_ratio,
    scene,
    slide,
    unloaded,
)

DIRECTIONS = tuple(2.0 * math.pi * i / 36.0 for i in range(36))
LADDER_DIRECTIONS = DIRECTIONS[:9:3] + DIRECTIONS[1:9:3]
STILL = 1e-9  # m/s
LONGEST = 1e3  # s, where the search for the longest step ends
SLIDING = 0.6  # tan θ, above the friction coefficient
STEEP, PRESSED = 0.8, 0.2  # tan θ; the share of the weight that goes as the last step begins


def ratios(simulate: case.Simulate, slope: float, method: engine.Method) -> tuple[float, ...]:
    """F_t/F_n in each of the 36 directions."""
    return tuple(force_ratio(slide(simulate, slope, alpha, method=method)) for alpha in DIRECTIONS)


def _worst(values: tuple[float, ...]) -> float:
    return max(values, key=lambda value: abs(value - FRICTION))


def _measure_cone(simulate: case.Simulate) -> dict[str, float]:
    standing = _worst(ratios(simulate, FRICTION, CONE))
    runs = [(slide(simulate, SLIDING, alpha, method=CONE), alpha) for alpha in DIRECTIONS]
    sliding = _worst(tuple(force_ratio(run) for run, _ in runs))
    return {
        "force_ratio": standing,
        "standing_error": standing - FRICTION,
        "sliding_error": sliding - FRICTION,
        "direction_error": max(force_direction_error(run, alpha) for run, alpha in runs),
    }


def _measure_anisotropy(method: engine.Method) -> object:
    def measure(simulate: case.Simulate) -> dict[str, float]:
        values = ratios(simulate, SLIDING, method)
        return {"anisotropy": max(values) - min(values)}

    return measure


def steepest(simulate: case.Simulate) -> case.BreakPoint:
    """Steepest slope (its tangent) on which the box stands for a second, whatever the direction."""

    def stands(slope: float) -> bool:
        runs = (slide(simulate, slope, alpha) for alpha in LADDER_DIRECTIONS)
        return all(math.hypot(*map(float, run["velocity"])) < STILL for run in runs)

    return break_point(stands, 0.1, 2.0, resolution=0.0005, walk=8)


def longest_step(simulate: case.Simulate) -> case.BreakPoint:
    """The longest step [s] in which the box stands just below its angle and slides just above it, as Coulomb's law has it."""

    def right(time_step: float) -> bool:
        off = []
        for slope in (0.99 * FRICTION, SLIDING):
            observe = {"force": engine.Final(quantity=engine.ContactForce("box"))}
            result = simulate(scene(slope), time_step=time_step, steps=10, method=CONE, observe=observe)
            x, y, z = map(float, result["force"])
            off.append(abs(math.hypot(x, y) / abs(z) - min(slope, FRICTION)))
        return max(off) < 1e-9

    return break_point(right, TIME_STEP, LONGEST, walk=6)


def _draw_polar(slope: float) -> object:
    def draw(simulate: case.Simulate) -> case.Drawing:
        angles = (*tuple(math.degrees(alpha) for alpha in DIRECTIONS), 360.0)
        curves, said = [], []
        for name, method in MODELS.items():
            values = ratios(simulate, slope, method)
            said.append(f"{name}: {told(min(values), 3)} to {told(max(values), 3)}")
            curves.append(line(name, angles, (*values, values[0]), "both"))
        curves.append(case.Curve(name="Coulomb", x=angles, y=(FRICTION,) * len(angles), style="reference"))
        return case.Drawing(
            curves=tuple(curves),
            x_label="direction of the slope [degrees]",
            y_label="F_t/F_n",
            x_scale="angle",
            note=", ".join(said)
            + (". A box that is only held tells nothing about anisotropy." if slope == FRICTION else "."),
        )

    return draw


def draw_unloaded(simulate: case.Simulate) -> case.Drawing:
    """F_t/F_n against direction in the step in which the normal force falls: the box model still has the one before."""
    angles = (*tuple(math.degrees(alpha) for alpha in DIRECTIONS), 360.0)
    curves, said = [], []
    for name, method in MODELS.items():
        values = [force_ratio(unloaded(simulate, STEEP, alpha, PRESSED, method)) for alpha in DIRECTIONS]
        said.append(f"{name}: {told(min(values), 3)} to {told(max(values), 3)}")
        curves.append(line(name, angles, (*values, values[0]), "both"))
    return case.Drawing(
        curves=tuple(curves),
        x_label="direction of the slope [degrees]",
        y_label="F_t/F_n",
        x_scale="angle",
        note=", ".join(said) + ".",
    )


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Largest |F_t/F_n − µ| over six directions after sliding for a second."""
    worst = 0.0
    for direction in LADDER_DIRECTIONS:
        observe = {"force": engine.Final(quantity=engine.ContactForce("box"))}
        result = simulate(
            scene(SLIDING, direction), time_step=time_step, duration=1.0, method=method, observe=observe
        )
        x, y, z = result["force"]
        worst = max(worst, abs(math.hypot(x, y) / abs(float(z)) - FRICTION))
    return worst


def ladder_run(simulate: case.Simulate, time_step: float, method: engine.Method) -> engine.Result:
    """One of these slides with nothing observed."""
    return simulate(scene(SLIDING, LADDER_DIRECTIONS[1]), time_step=time_step, duration=1.0, method=method)


TEST = case.ScalarTest(
    title="Friction in every direction",
    question="Is Coulomb's law obeyed, in every direction?",
    why=(
        "A friction model that bounds two axes separately is stronger along their diagonals: a vehicle then turns "
        "differently depending on where it stands in the world."
    ),
    model=(
        "A box of 1 m and 1 kg lies on a level plane under a gravity vector tilted by θ towards 36 directions α. "
        "The contact force on the box is split into its normal and tangential parts."
    ),
    parameters=(
        ("box", "1 × 1 × 1 m, 1 kg"),
        ("friction coefficient", "µ = 0.5"),
        ("gravity", "10 m/s², G = −g (sin θ cos α, sin θ sin α, cos θ)"),
        ("slopes", "tan θ = 0.5 (the printed test) and 0.6 (sliding)"),
        ("time step", "1/60 s, 60 steps"),
    ),
    theory=(
        "F_t = m g sin θ while it stands, F_t = µ F_n once it slides.",
        "F_t/F_n = min(tan θ, µ) in every direction α, opposite to the motion.",
        "Box model: |F_x| ≤ µ F_n and |F_y| ≤ µ F_n, up to √2 µ along the diagonals: at tan θ = 0.6 it reads "
        "0.5 along the axes and 0.6 along the diagonals.",
    ),
    reference="Coulomb's law (closed form).",
    conclusion=(
        "Green: the friction force has the right size and direction everywhere. Red: the bound is taken per axis, "
        "from the wrong normal force, or not at all."
    ),
    source="thesis, sections 3.2.4 and 4.2",
    misprints=(
        "Equations 3.11 and 3.12 have sine and cosine swapped: F_t = m g sin θ and F_n = m g cos θ.",
        "The printed test measures at tan θ = µ, where the box only stands; there even the box model reads 0.5, in every direction. "
        "Fig 3.18 draws three models apart, up to 0.8: so they are where the box slides and its load changes, since the box model "
        "takes its bound from the step before.",
    ),
    measurements=(
        case.Measurement(
            configuration="cone",
            time_step=TIME_STEP,
            metrics=(
                case.Metric(
                    name="force_ratio",
                    description="F_t/F_n at tan θ = 0.5, the worst of 36 directions",
                    unit="1",
                    role="gate",
                    better="inside",
                    limit=(FRICTION - 1e-4, FRICTION + 1e-4),
                    limit_source="thesis, section 4.2; it would catch a coefficient 0.02 % too small",
                    limit_kind="physical",
                    set_point=(FRICTION - 1e-9, FRICTION + 1e-9),
                    set_point_source="Coulomb's law to the solver's tolerance",
                    reference=FRICTION,
                    tolerance=1e-12,
                ),
                case.Metric(
                    name="standing_error",
                    description="deviation of F_t/F_n from 0.5 at tan θ = 0.5, the worst of 36 directions",
                    unit="1",
                    role="companion",
                    limit=1e-9,
                    limit_source="set point: Coulomb's law to rounding",
                    reference=0.0,
                    tolerance=1e-12,
                ),
                case.Metric(
                    name="sliding_error",
                    description="deviation of F_t/F_n from 0.5 when sliding at tan θ = 0.6, worst of 36 directions",
                    unit="1",
                    role="companion",
                    limit=1e-9,
                    limit_source="set point: Coulomb's law to rounding",
                    reference=0.0,
                    tolerance=1e-12,
                ),
                case.Metric(
                    name="direction_error",
                    description="angle between friction and slope when sliding, the worst of 36 directions",
                    unit="degrees",
                    role="companion",
                    limit=1e-6,
                    limit_source="set point: friction opposes the motion",
                    reference=0.0,
                    tolerance=1e-9,
                ),
            ),
            measure=_measure_cone,
            note="Cone friction, direct solver.",
        ),
        case.Measurement(
            configuration="box",
            time_step=TIME_STEP,
            metrics=(
                case.Metric(
                    name="anisotropy",
                    description="largest minus smallest F_t/F_n when sliding at tan θ = 0.6",
                    unit="1",
                    role="companion",
                    better="inside",
                    limit=(0.1 - 1e-9, 0.1 + 1e-9),
                    limit_source="the box model holds the diagonals at 0.6 and slides along the axes at 0.5, to rounding",
                    reference=0.1,
                    reference_kind="method",
                    tolerance=1e-9,
                ),
            ),
            measure=_measure_anisotropy(BOX),  # type: ignore[arg-type]
            note="Box friction: proves that the test can see anisotropy.",
        ),
        case.Measurement(
            configuration="scaled box",
            time_step=TIME_STEP,
            metrics=(
                case.Metric(
                    name="anisotropy",
                    description="largest minus smallest F_t/F_n when sliding at tan θ = 0.6",
                    unit="1",
                    role="reported",
                    reference=0.1,
                    reference_kind="method",
                    tolerance=1e-9,
                ),
            ),
            measure=_measure_anisotropy(SCALED_BOX),  # type: ignore[arg-type]
            note="Scaled box: the box with the current normal force.",
        ),
    ),
    example=lambda: case.Example(scene=scene(SLIDING), time_step=TIME_STEP),
    figures=(
        case.Figure(
            name="force-ratio-against-direction-standing",
            title="Force ratio against direction at tan θ = µ",
            draw=_draw_polar(FRICTION),  # type: ignore[arg-type]
            thesis="Fig 3.18",
        ),
        case.Figure(
            name="force-ratio-against-direction-unloaded",
            title="Force ratio against direction at tan θ = 0.8, as a fifth of the weight goes",
            draw=draw_unloaded,
            thesis="Fig 3.18, as drawn",
        ),
        case.Figure(
            name="force-ratio-against-direction-sliding",
            title="Force ratio against direction, sliding at tan θ = 0.6",
            draw=_draw_polar(SLIDING),  # type: ignore[arg-type]
        ),
    ),
    seven=True,
    ladders=(
        case.Ladder(
            name="sliding",
            description="largest error of F_t/F_n over six directions, sliding at tan θ = 0.6 for 1 s",
            unit="1",
            time_steps=tuple(1.0 / n for n in (30, 60, 120, 240)),
            configurations=(
                case.Configuration(name="cone", method=CONE, expected_order=None),
                case.Configuration(
                    name="cone, iterative", method=engine.Method(solver="iterative"), expected_order=None
                ),
                case.Configuration(name="box", method=BOX, expected_order=None),
                case.Configuration(name="scaled box", method=SCALED_BOX, expected_order=None),
            ),
            error=ladder_error,
            run=ladder_run,
            target_error=0.2,
            target_seconds=0.1,
        ),
    ),
    stability=(
        case.StabilityStudy(
            name="steepest",
            title="Steepest slope on which the box stands",
            configuration="cone",
            definition="no faster than 1e-9 m/s after a second, in six directions",
            study=steepest,
            unit="1",
            expected=(0.9995 * FRICTION, FRICTION),
            expected_source="tan θ = µ, to the resolution of the search",
        ),
        case.StabilityStudy(
            name="longest-step",
            title="Longest step in which friction is Coulomb's",
            configuration="cone",
            definition="F_t/F_n = min(tan θ, µ) to 1e-9 after ten steps, at tan θ = 0.495 and 0.6",
            study=longest_step,
            unit="s",
            expected=(LONGEST, LONGEST),
            expected_source="gravity's impulse and those of the contact have the factor h alike; the search ends at 1000 s",
        ),
    ),
)
