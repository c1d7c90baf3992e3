"""At which slope does a box start to slide?"""

from __future__ import annotations

import functools
import math

from spook_tracker import engine

from ... import case
from ...bracket import break_point
from ...configurations import configured
from ...sweep import apart, line
from .scene import FRICTION, GRAVITY, SLIP_SPEED, TIME_STEP, scene, slip_slope, slips

LADDER_SLOPE = 0.51
STEEPER = 1.1  # times µ: the slope that the box is to slide down
LONGEST = 1e3  # s, where the search for the longest step ends
COEFFICIENTS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)


def _measure_slope(simulate: case.Simulate) -> dict[str, float]:
    return {"slip_slope_error": slip_slope(simulate, FRICTION) - FRICTION}


def _measure_bracket(simulate: case.Simulate) -> dict[str, float]:
    stands = not slips(simulate, FRICTION - 1e-4, FRICTION)
    slides = slips(simulate, FRICTION + 1e-4, FRICTION)
    return {"bracket_held": float(stands) + float(slides)}


def _draw_angle(simulate: case.Simulate) -> case.Drawing:
    found = tuple(math.atan(slip_slope(simulate, mu, resolution=1e-3)) for mu in COEFFICIENTS)
    return case.Drawing(
        curves=(
            line("simulation", COEFFICIENTS, found, "points"),
            line("θ = atan µ", COEFFICIENTS, (math.atan(mu) for mu in COEFFICIENTS), "reference"),
        ),
        x_label="friction coefficient µ",
        y_label="angle at which the box slides [rad]",
        note=f"At most {apart(found, map(math.atan, COEFFICIENTS))} rad from atan µ. Above µ = 1 a cube tips over before it slides, so the sweep ends at 0.9.",
    )


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Speed after 1 s just beyond the friction angle minus g (sin θ − µ cos θ) t [m/s]."""
    observe = {"velocity": engine.Final(quantity=engine.Velocity("box"))}
    result = simulate(scene(LADDER_SLOPE), time_step=time_step, duration=1.0, method=method, observe=observe)
    tilt = math.atan(LADDER_SLOPE)
    x, y, _ = result["velocity"]
    return math.hypot(x, y) - GRAVITY * (math.sin(tilt) - FRICTION * math.cos(tilt))


def slides_flat(simulate: case.Simulate, friction: float) -> bool:
    """Whether the box slides down a slope a tenth steeper than it stands on, without turning, for a quarter of a second."""
    observe = {
        "v": engine.Final(quantity=engine.Velocity("box")),
        "w": engine.Final(quantity=engine.AngularVelocity("box")),
    }
    slope = STEEPER * friction
    result = simulate(scene(slope, friction=friction), time_step=TIME_STEP, steps=15, observe=observe)
    tilt = math.atan(slope)
    speed = GRAVITY * (math.sin(tilt) - friction * math.cos(tilt)) * 15 * TIME_STEP
    off = math.hypot(float(result["v"][0]) + speed, *map(float, result["v"][1:]), *map(float, result["w"]))
    return result.completed and off < 1e-9


def tells_apart(simulate: case.Simulate, time_step: float) -> bool:
    """Whether the box stands at tan θ = µ − 1e-4 and slides at µ + 1e-4, in steps so long; four seconds, two steps at least."""
    observe = {"v": engine.Final(quantity=engine.Velocity("box"))}
    steps = max(2, round(4.0 / time_step))
    speeds = (
        math.hypot(
            *map(float, simulate(scene(slope), time_step=time_step, steps=steps, observe=observe)["v"])
        )
        for slope in (FRICTION - 1e-4, FRICTION + 1e-4)
    )
    return [speed > SLIP_SPEED for speed in speeds] == [False, True]


def roughest(simulate: case.Simulate) -> case.BreakPoint:
    """The largest friction coefficient with which the box slides and does not tip."""
    return break_point(functools.partial(slides_flat, simulate), 0.15, 10.0, resolution=1e-3, walk=7)


def longest_step(simulate: case.Simulate) -> case.BreakPoint:
    """The longest step [s] in which the box knows its angle."""
    return break_point(functools.partial(tells_apart, simulate), 1.0 / 60.0, LONGEST, walk=6)


TEST = case.ScalarTest(
    title="Slip angle",
    question="At which slope does a box on an inclined plane start to slide?",
    why="A box must stand for ever below its friction angle, and must not be held above it.",
    model=(
        "A box lies on a plane; for each slope a new run tells whether its speed exceeds 1e-3 m/s within four "
        "seconds, and the slope is found by bisection. The thesis raises the slope during one run instead, which "
        "adds the delay of the ramp."
    ),
    parameters=(
        ("box", "1 × 1 × 1 m, 1 kg"),
        ("friction coefficient", "µ = 0.5 (swept 0.1 … 0.9)"),
        ("gravity", "10 m/s²"),
        ("slip limit", "1e-3 m/s"),
        ("time step", "1/60 s"),
    ),
    theory=("The box slides iff tan θ > µ.",),
    reference="θ = atan µ (closed form).",
    conclusion="Green: no creep below the friction angle, no hold above it. Red: one of the two.",
    source="thesis, section 3.2.4",
    measurements=(
        case.Measurement(
            configuration="cone",
            time_step=TIME_STEP,
            metrics=(
                case.Metric(
                    name="slip_slope_error",
                    description="tan of the slope at which the box slides, minus µ = 0.5",
                    unit="1",
                    role="gate",
                    limit=2e-4,
                    limit_source="Coulomb's law; the bisection resolves 1e-4",
                    limit_kind="physical",
                    reference=0.0,
                    tolerance=1e-4,
                ),
            ),
            measure=_measure_slope,
            note="Cone friction, direct solver.",
        ),
        case.Measurement(
            configuration="cone",
            time_step=TIME_STEP,
            metrics=(
                case.Metric(
                    name="bracket_held",
                    description="stands at tan θ = 0.4999 and slides at 0.5001: 2 if both",
                    unit="1",
                    role="companion",
                    better="larger",
                    limit=2.0,
                    limit_source="Coulomb's law",
                    reference=2.0,
                ),
            ),
            measure=_measure_bracket,
            note="Cone friction, direct solver.",
        ),
    ),
    example=lambda: case.Example(scene=scene(FRICTION), time_step=TIME_STEP),
    figures=(
        case.Figure(
            name="slip-angle-against-friction",
            title="Angle at which the box slides against the friction coefficient",
            draw=_draw_angle,
            thesis="Fig 3.16",
        ),
    ),
    ladders=(
        case.Ladder(
            name="slide",
            description="speed after 1 s at tan θ = 0.51 against g (sin θ − µ cos θ) t, µ = 0.5",
            unit="m/s",
            time_steps=tuple(1.0 / n for n in (15, 30, 60, 120, 240)),
            configurations=configured({"direct": None, "iterative": None}),
            error=ladder_error,
            target_error=1e-3,
            target_seconds=0.01,
        ),
    ),
    stability=(
        case.StabilityStudy(
            name="roughest",
            title="Roughest box that slides before it tips",
            configuration="cone",
            definition="down a slope of 1.1 µ it goes by g (sin θ − µ cos θ) t and does not turn, to 1e-9",
            study=roughest,
            unit="1",
            expected=(0.999, 1.0),
            expected_source="friction µ N half an edge below the centre turns a cube over when N at its front edge, half an edge "
            "ahead, cannot balance it: µ > 1, on any slope; to the resolution of the search",
        ),
        case.StabilityStudy(
            name="longest-step",
            title="Longest step in which the box knows its angle",
            configuration="cone",
            definition="it stands at tan θ = 0.4999 and slides at 0.5001, faster than 1e-3 m/s",
            study=longest_step,
            unit="s",
            expected=(LONGEST, LONGEST),
            expected_source="gravity and the impulses that answer it have the factor h alike: Coulomb's bound knows no step; the "
            "search ends at 1000 s",
        ),
    ),
)
