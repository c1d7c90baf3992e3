"""Does the friction force grow with the slope and stop at the friction coefficient, whatever the mass?"""

from __future__ import annotations

import functools
import math

from spook_tracker import engine

from ... import case
from ...bracket import break_point
from ...configurations import configured
from ...sweep import line, told
from .scene import FRICTION, TIME_STEP, force_ratio, scene, slide

LADDER_SLOPE = 0.3
MASSES = (1.0, 10.0, 1e2, 1e3, 1e4)  # kg
RIGHT = 1e-9  # of a ratio, the gate's limit
ROUGH = 2.0  # friction with which a cube tips and does not slide
HEAVIEST = 1e12  # kg, where the search ends
SLOPES = tuple(0.05 * i for i in range(1, 15))


def _error(simulate: case.Simulate, slope: float, mass: float) -> float:
    return force_ratio(slide(simulate, slope, mass=mass)) - min(slope, FRICTION)


def _measure(simulate: case.Simulate) -> dict[str, float]:
    errors = [_error(simulate, slope, mass) for mass in (1.0, 1e4) for slope in (0.1, 0.3, 0.45, 0.55, 0.7)]
    return {"ratio_error": max(errors, key=abs)}


def _draw(simulate: case.Simulate) -> case.Drawing:
    curves = [
        line(
            f"{mass:g} kg",
            SLOPES,
            (force_ratio(slide(simulate, slope, mass=mass)) for slope in SLOPES),
            "both",
        )
        for mass in MASSES
    ]
    off = max(abs(y - min(s, FRICTION)) for curve in curves for s, y in zip(SLOPES, curve.y, strict=True))
    curves.append(line("min(tan θ, µ)", SLOPES, (min(s, FRICTION) for s in SLOPES), "reference"))
    return case.Drawing(
        curves=tuple(curves),
        x_label="tan θ",
        y_label="F_t/F_n",
        note=f"At most {told(off)} from Coulomb's law, which has no dip; the thesis' curve dips near tan θ = 0.3.",
    )


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """|F_t/F_n − tan θ| of a box that stands at tan θ = 0.3, after 1 s."""
    observe = {"force": engine.Final(quantity=engine.ContactForce("box"))}
    result = simulate(scene(LADDER_SLOPE), time_step=time_step, duration=1.0, method=method, observe=observe)
    x, y, z = result["force"]
    return abs(math.hypot(x, y) / abs(float(z)) - LADDER_SLOPE)


def tells_both(simulate: case.Simulate, mass: float) -> bool:
    """Whether a box so heavy [kg] has the right ratio where it stands and where it slides."""
    return max(abs(_error(simulate, slope, mass)) for slope in (0.3, 0.7)) < RIGHT


def held(simulate: case.Simulate, slope: float) -> bool:
    """Whether a box too rough to slide has F_t/F_n = tan θ after ten steps."""
    return abs(force_ratio(slide(simulate, slope, steps=10, friction=ROUGH)) - slope) < RIGHT


def heaviest(simulate: case.Simulate) -> case.BreakPoint:
    """The heaviest box [kg] whose ratio is right."""
    return break_point(functools.partial(tells_both, simulate), 1.0, HEAVIEST, walk=5)


def steepest(simulate: case.Simulate) -> case.BreakPoint:
    """The steepest slope (its tangent) that the ratio follows when nothing slides."""
    return break_point(functools.partial(held, simulate), 0.1, 1.9, resolution=5e-4, walk=6)


TEST = case.ScalarTest(
    title="Force ratio on a slope",
    question="Does the friction force follow the slope up to the friction coefficient, whatever the mass?",
    why="Below the friction angle the plane must give exactly the force that is needed, above it exactly µ F_n.",
    model="A box on a plane under tilted gravity; the contact force is read after one second.",
    parameters=(
        ("box", "1 × 1 × 1 m, 1 … 1e4 kg"),
        ("friction coefficient", "µ = 0.5"),
        ("gravity", "10 m/s²"),
        ("time step", "1/60 s, 60 steps"),
    ),
    theory=("F_t/F_n = min(tan θ, µ), independent of the mass.",),
    reference="Coulomb's law (closed form).",
    conclusion="Green: the contact gives the force the law asks for. Red: it creeps, sticks or depends on the mass.",
    source="thesis, section 3.2.4",
    measurements=(
        case.Measurement(
            configuration="cone",
            time_step=TIME_STEP,
            metrics=(
                case.Metric(
                    name="ratio_error",
                    description="largest deviation of F_t/F_n from min(tan θ, µ), five slopes, 1 kg and 1e4 kg",
                    unit="1",
                    role="gate",
                    limit=1e-9,
                    limit_source="Coulomb's law to rounding",
                    reference=0.0,
                    tolerance=1e-12,
                ),
            ),
            measure=_measure,
            note="Cone friction, direct solver.",
        ),
    ),
    example=lambda: case.Example(scene=scene(0.3), time_step=TIME_STEP),
    figures=(
        case.Figure(
            name="force-ratio-against-slope", title="Force ratio against slope", draw=_draw, thesis="Fig 3.17"
        ),
    ),
    ladders=(
        case.Ladder(
            name="ratio",
            description="error of F_t/F_n at tan θ = 0.3 after 1 s",
            unit="1",
            time_steps=tuple(1.0 / n for n in (30, 60, 120, 240)),
            configurations=configured({"direct": None, "iterative": None}),
            error=ladder_error,
            target_error=1e-9,
            target_seconds=0.01,
        ),
    ),
    stability=(
        case.StabilityStudy(
            name="steepest",
            title="Steepest slope that the ratio of a box too rough to slide follows",
            configuration="cone",
            definition="F_t/F_n = tan θ to 1e-9 after ten steps, µ = 2",
            study=steepest,
            unit="1",
            expected=(0.9995, 1.0),
            expected_source="the weight of a cube points beyond its lower edge at tan θ > 1, and it tips; to the resolution of "
            "the search",
        ),
        case.StabilityStudy(
            name="heaviest",
            title="Heaviest box whose ratio is right",
            configuration="cone",
            definition="F_t/F_n = min(tan θ, µ) to 1e-9 at tan θ = 0.3 and 0.7",
            study=heaviest,
            unit="kg",
            expected=(HEAVIEST, HEAVIEST),
            expected_source="one body on the ground: its mass scales out of all its rows; the search ends at 1e12 kg",
        ),
    ),
)
