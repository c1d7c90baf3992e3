"""Does a sphere on a slope roll just as long as friction can hold its contact?"""

from __future__ import annotations

import math

from spook_tracker import engine
from spook_tracker.engine.bodies import Material

from .. import case
from ..bracket import break_point
from ..sweep import apart, line

RADIUS = 0.5  # m
MASS = 1.0  # kg
GRAVITY = 10.0  # m/s²
FRICTION = 0.2
TIME_STEP = 1.0 / 60.0  # s
LONGEST = 100.0  # s, where the search for the longest step ends
STEPS = 120
LADDER_DURATION = 2.0  # s
ROLLING, SLIDING = 0.4, 1.0  # tan θ; a solid sphere rolls up to 3.5 µ = 0.7


def scene(slope: float) -> engine.Scene:
    """A sphere at rest on a level plane under gravity tilted by atan(slope) towards +x."""
    tilt = math.atan(slope)
    rough = Material(friction=FRICTION)
    plane = engine.RigidBody(
        name="plane", motion="static", shape=engine.Plane(), position=(0.0, 0.0, 0.0), material=rough
    )
    ball = engine.RigidBody(
        name="ball", mass=MASS, shape=engine.Sphere(RADIUS), position=(0.0, 0.0, RADIUS), material=rough
    )
    return engine.Scene(
        bodies=(plane, ball), gravity=(GRAVITY * math.sin(tilt), 0.0, -GRAVITY * math.cos(tilt))
    )


def accelerations(slope: float) -> tuple[float, float]:
    """Linear [m/s²] and angular [rad/s²] acceleration of a solid sphere on the slope (closed form)."""
    tilt = math.atan(slope)
    if slope <= 3.5 * FRICTION:
        linear = 5.0 / 7.0 * GRAVITY * math.sin(tilt)
        return linear, linear / RADIUS
    normal = GRAVITY * math.cos(tilt)
    return GRAVITY * math.sin(tilt) - FRICTION * normal, 2.5 * FRICTION * normal / RADIUS


def speeds(simulate: case.Simulate, slope: float) -> tuple[float, float]:
    """Speed [m/s] down the slope and spin [rad/s] after STEPS steps."""
    observe = {
        "velocity": engine.Final(quantity=engine.Velocity("ball")),
        "spin": engine.Final(quantity=engine.AngularVelocity("ball")),
    }
    result = simulate(scene(slope), time_step=TIME_STEP, steps=STEPS, observe=observe)
    return float(result["velocity"][0]), float(result["spin"][1])


def _measure(simulate: case.Simulate) -> dict[str, float]:
    seconds = STEPS * TIME_STEP
    values = {}
    for name, slope in (("rolling", ROLLING), ("sliding", SLIDING)):
        linear, angular = accelerations(slope)
        speed, spin = speeds(simulate, slope)
        values[f"{name}_speed_error"] = speed / (linear * seconds) - 1.0
        values[f"{name}_spin_error"] = spin / (angular * seconds) - 1.0
    return values


def steepest_rolled(simulate: case.Simulate) -> case.BreakPoint:
    """Steepest slope (its tangent) down which the sphere rolls without slip."""

    def rolls(slope: float) -> bool:
        observe = {
            "v": engine.Final(quantity=engine.Velocity("ball")),
            "w": engine.Final(quantity=engine.AngularVelocity("ball")),
        }
        result = simulate(scene(slope), time_step=TIME_STEP, steps=STEPS, observe=observe)
        speed = float(result["v"][0])
        return abs(speed - RADIUS * float(result["w"][1])) <= 1e-9 * speed

    return break_point(rolls, 0.1, 2.0, resolution=0.002, walk=8)


def longest_step(simulate: case.Simulate) -> case.BreakPoint:
    """The longest step [s] in which the sphere rolls and slides as it should."""

    def right(time_step: float) -> bool:
        off = []
        for slope in (ROLLING, SLIDING):
            observe = {
                "v": engine.Final(quantity=engine.Velocity("ball")),
                "w": engine.Final(quantity=engine.AngularVelocity("ball")),
            }
            result = simulate(scene(slope), time_step=time_step, steps=10, observe=observe)
            linear, angular = (10.0 * time_step * rate for rate in accelerations(slope))
            off += [float(result["v"][0]) / linear - 1.0, float(result["w"][1]) / angular - 1.0]
        return max(map(abs, off)) < 1e-9

    return break_point(right, TIME_STEP, LONGEST, walk=6)


def _draw(simulate: case.Simulate) -> case.Drawing:
    slopes = tuple(0.1 * i for i in range(1, 13))
    seconds = STEPS * TIME_STEP
    found = [speeds(simulate, slope) for slope in slopes]
    right = [accelerations(slope) for slope in slopes]
    return case.Drawing(
        curves=(
            line("speed", slopes, (speed for speed, _ in found), "points"),
            line("radius × spin", slopes, (RADIUS * spin for _, spin in found), "points"),
            line("speed, closed form", slopes, (a * seconds for a, _ in right), "reference"),
            line("radius × spin, closed form", slopes, (RADIUS * b * seconds for _, b in right), "reference"),
        ),
        x_label="tan θ",
        y_label="speed after two seconds [m/s]",
        note=f"At most {apart((speed for speed, _ in found), (a * seconds for a, _ in right))} m/s from the closed form. In "
        "theory rolling ends at tan θ = 3.5 µ = 0.7.",
    )


def _metric(name: str, description: str, role: str) -> case.Metric:
    return case.Metric(
        name=name,
        description=description,
        unit="1",
        role=role,  # type: ignore[arg-type]
        limit=1e-9,
        limit_source="closed form; constant acceleration is exact in the velocities",
        reference=0.0,
        tolerance=1e-12,
    )


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Distance rolled in 2 s minus ½ a t² [m]."""
    observe = {"place": engine.Final(quantity=engine.Position("ball"), from_start=True)}
    result = simulate(
        scene(ROLLING), time_step=time_step, duration=LADDER_DURATION, method=method, observe=observe
    )
    return float(result["place"][0]) - 0.5 * accelerations(ROLLING)[0] * LADDER_DURATION**2


TEST = case.ScalarTest(
    title="Rolling and sliding sphere",
    question="Does a sphere on a slope roll just as long as friction can hold its contact?",
    why="Rolling couples friction, rotation and translation: any error in one of them shows as a wrong acceleration.",
    model="A solid sphere starts from rest on a plane under tilted gravity; speed and spin are read after 2 s.",
    parameters=(
        ("sphere", "radius 0.5 m, 1 kg, solid"),
        ("friction coefficient", "µ = 0.2"),
        ("gravity", "10 m/s²"),
        ("slopes", "tan θ = 0.4 (rolls) and 1.0 (slides)"),
        ("time step", "1/60 s, 120 steps"),
    ),
    theory=(
        "Rolls iff tan θ ≤ 3.5 µ: a = (5/7) g sin θ, α = a/r.",
        "Slides beyond: a = g (sin θ − µ cos θ), α = 2.5 µ g cos θ / r.",
    ),
    reference="Rigid-body mechanics (closed form).",
    conclusion="Green: friction and rotation agree. Red: inertia, friction bound or lever is wrong.",
    source="ours",
    measurements=(
        case.Measurement(
            configuration="cone",
            time_step=TIME_STEP,
            metrics=(
                _metric("rolling_speed_error", "relative error of the speed when rolling", "gate"),
                _metric("rolling_spin_error", "relative error of the spin when rolling", "companion"),
                _metric("sliding_speed_error", "relative error of the speed when sliding", "companion"),
                _metric("sliding_spin_error", "relative error of the spin when sliding", "companion"),
            ),
            measure=_measure,
            note="Cone friction, direct solver.",
        ),
    ),
    example=lambda: case.Example(scene=scene(ROLLING), time_step=TIME_STEP),
    figures=(case.Figure(name="speed-against-slope", title="Speed and spin against slope", draw=_draw),),
    ladders=(
        case.Ladder(
            name="distance",
            description="distance rolled in 2 s against ½ a t²",
            unit="m",
            time_steps=tuple(1.0 / n for n in (15, 30, 60, 120, 240, 480, 960)),
            configurations=(
                case.Configuration(name="direct", method=engine.PLAIN, expected_order=1.0),
                case.Configuration(
                    name="iterative", method=engine.Method(solver="iterative"), expected_order=None
                ),
                case.Configuration(  # exact, for constant forces
                    name="half-step velocities",
                    method=engine.Method(half_step_velocities=True),
                    expected_order=None,
                ),
            ),
            error=ladder_error,
            target_error=0.05,
            target_seconds=0.01,
        ),
    ),
    stability=(
        case.StabilityStudy(
            name="steepest-rolled",
            title="Steepest slope down which a sphere rolls",
            configuration="plain",
            definition="no slip after two seconds, to 1e-9 of the speed",
            study=steepest_rolled,
            unit="1",
            expected=(0.998 * 3.5 * FRICTION, 3.5 * FRICTION),
            expected_source="7/2 µ, to the resolution of the search",
        ),
        case.StabilityStudy(
            name="longest-step",
            title="Longest step in which a sphere rolls and slides as it should",
            configuration="cone",
            definition="speed and spin after ten steps right to 1e-9, at tan θ = 0.4 and 1",
            study=longest_step,
            unit="s",
            expected=(LONGEST, LONGEST),
            expected_source="accelerations are constant, and the speeds of steps that add them exact, however far it turns in one; "
            "the search ends at 100 s",
        ),
    ),
)
