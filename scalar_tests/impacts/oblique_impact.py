"""Does a hard ball leave a glass plate at the angle at which it was photographed?"""

from __future__ import annotations

import math
from dataclasses import replace

from spook_tracker import engine
from spook_tracker.engine.bodies import Material

from .. import case, readings
from ..bracket import break_point
from ..readings import Reading, deviation
from ..sweep import line

RADIUS, DENSITY = 2.5e-3, 4000.0  # m, kg/m³
SPEED = 3.9  # m/s
FRICTION, RESTITUTION = 0.092, 1.0
TURNED = (
    0.41  # of the slip that turns round where the ball grips: 7/2 (1 − e_t) − 1, measured e_t = 0.597 at 20°
)
TIME_STEP = 1e-3  # s
SOURCE = "Kharaz, Gorham & Salman, Powder Technology 120 (2001) 281, as read off its figure twice"
FIRST = ((30.3767, 21.7809), (39.6233, 32.5455), (49.7831, 45.1051), (60.0571, 57.3652))  # MFiX, test DEM05
SECOND = ((30.29, 21.67), (39.535, 32.613), (49.747, 45.125), (60.208, 57.474))  # Lethe, oblique wall impact
SIGMA = 0.1  # degrees: what the two, brought to the same angle, differ by
STEEPEST_GRIP = math.degrees(math.atan(3.5 * (1.0 + RESTITUTION) * FRICTION / (1.0 + TURNED)))
SEARCHED = 1e-3
FASTEST = 1e6  # times the photographed speed, where the search ends
ANGLES = tuple(0.5 * (a[0] + b[0]) for a, b in zip(FIRST, SECOND, strict=True))
READINGS = tuple(
    Reading(at=f"rebound at {angle:.2f}°", value=0.5 * (a[1] + b[1]), sigma=SIGMA)
    for angle, a, b in zip(ANGLES, FIRST, SECOND, strict=True)
)


def scene(angle: float) -> engine.Scene:
    """The ball as it touches the plate, `angle` [degrees] from the normal."""
    hard = Material(friction=FRICTION, restitution=RESTITUTION, tangential_restitution=TURNED)
    turn = math.radians(angle)
    plate = engine.RigidBody(
        name="plate", motion="static", shape=engine.Plane(), position=(0.0, 0.0, 0.0), material=hard
    )
    ball = engine.RigidBody(
        name="ball",
        mass=4.0 / 3.0 * math.pi * RADIUS**3 * DENSITY,
        shape=engine.Sphere(RADIUS),
        position=(0.0, 0.0, RADIUS),
        velocity=(SPEED * math.sin(turn), 0.0, -SPEED * math.cos(turn)),
        material=hard,
    )
    return engine.Scene(bodies=(plate, ball), gravity=(0.0, 0.0, 0.0))


def rebound(simulate: case.Simulate, angle: float) -> tuple[float, float]:
    """Angle [degrees] from the normal and spin [rad/s] after the impact."""
    observe = {
        "v": engine.Final(quantity=engine.Velocity("ball")),
        "w": engine.Final(quantity=engine.AngularVelocity("ball")),
    }
    result = simulate(scene(angle), time_step=TIME_STEP, steps=1, observe=observe)
    return math.degrees(math.atan2(float(result["v"][0]), float(result["v"][2]))), float(result["w"][1])


def sliding(angle: float) -> tuple[float, float]:
    """The same of a rigid ball that slides through the impact, by Coulomb's law."""
    turn = math.radians(angle)
    push = (1.0 + RESTITUTION) * FRICTION
    slope = (math.tan(turn) - push) / RESTITUTION
    return math.degrees(math.atan(slope)), 2.5 * push * SPEED * math.cos(turn) / RADIUS


def measure(simulate: case.Simulate) -> dict[str, float]:
    """Rebounds at the four measured angles beyond 30°."""
    found = [rebound(simulate, angle) for angle in ANGLES]
    right = [sliding(angle) for angle in ANGLES]
    return {
        "deviation": deviation((angle for angle, _ in found), READINGS),
        "theory_error": max(
            abs(a / b - 1.0)
            for one, other in zip(found, right, strict=True)
            for a, b in zip(one, other, strict=True)
        ),
        "at_20_degrees": rebound(simulate, 20.56)[0] - 12.3645,
    }


def steepest_grip(simulate: case.Simulate) -> case.BreakPoint:
    """Steepest impact [degrees] at which the ball grips: its slip turns round by TURNED."""

    def grips(angle: float) -> bool:
        kept = math.tan(math.radians(rebound(simulate, angle)[0])) / math.tan(math.radians(angle))
        return abs(kept - (1.0 - (1.0 + TURNED) / 3.5)) < 1e-9

    return break_point(grips, 10.0, 60.0, resolution=SEARCHED, walk=4)


def fastest(simulate: case.Simulate) -> case.BreakPoint:
    """How many times as fast the ball may come and still leave at the right angle."""

    def right(times: float) -> bool:
        angle = ANGLES[0]
        built = scene(angle)
        quick = tuple(
            replace(body, velocity=(times * body.velocity[0], 0.0, times * body.velocity[2]))
            for body in built.bodies
        )
        observe = {"v": engine.Final(quantity=engine.Velocity("ball"))}
        result = simulate(replace(built, bodies=quick), time_step=TIME_STEP, steps=1, observe=observe)
        found = math.degrees(math.atan2(float(result["v"][0]), float(result["v"][2])))
        return result.completed and abs(found / sliding(angle)[0] - 1.0) < 1e-12

    return break_point(right, 1.0, FASTEST, resolution=SEARCHED, walk=7)


def _draw(simulate: case.Simulate) -> case.Drawing:
    angles = tuple(float(a) for a in range(2, 66, 3))
    return case.Drawing(
        curves=(
            line("simulated", angles, (rebound(simulate, a)[0] for a in angles)),
            line("measured", ANGLES, (one.value for one in READINGS), "points"),
        ),
        x_label="angle of impact [degrees]",
        y_label="angle of rebound [degrees]",
        note=readings.distance(measure(simulate)["deviation"]),
    )


TEST = readings.measured_test(
    SOURCE,
    " (validation data of MFiX and of Lethe). ±0.1° is what the two readings of the figure differ by; the "
    "scatter of the impacts, of which there are no digits, is not in it.",
    READINGS,
    "degrees",
    (
        ("ball", "diameter 5 mm, 4000 kg/m³"),
        ("speed", "3.9 m/s"),
        ("friction coefficient", "0.092, as MFiX has it"),
        ("restitution", "1, as MFiX has it; along the plate 0.41 where the ball grips"),
        ("time step", "1e-3 s, one step"),
    ),
    measure,
    readings.against_theory(1e-12, "one impact by Coulomb's law; rounding"),
    case.Metric(
        name="at_20_degrees",
        description="rebound at 20.56° minus the measured 12.36°, where real balls grip elastically",
        unit="degrees",
        role="reported",
        tolerance=1e-9,
    ),
    configuration="plain",
    time_step=TIME_STEP,
    note="four impacts beyond 30°, where real balls slide",
    title="Oblique impact, measured",
    question="Does a hard ball leave a glass plate at the angle at which it was photographed?",
    why="Impact with friction is where rigid bodies are the crudest model: one number for rebound, one for friction.",
    model="A ball of aluminium oxide of 5 mm meets thick glass at 3.9 m/s without spin; one impact, no gravity.",
    theory=(
        "Sliding: e tan α' = tan α − (1 + e) µ, r ω = ⁵⁄₂ (1 + e) µ v cos α.",
        "It grips where tan α < ⁷⁄₂ (1 + e) µ/(1 + e_grip).",
        "Left out: the elasticity along the plate (one number of the material stands for it; measured rebounds below 25° need "
        "more), wear, and spin of which readings scatter by 7 %.",
    ),
    conclusion="Green: rigid bodies with Coulomb's law rebound as real ones do. Red: friction in an impact is wrong.",
    example=lambda: case.Example(scene=scene(ANGLES[0]), time_step=TIME_STEP, duration=0.01),
    figures=(case.Figure(name="rebound", title="Angle of rebound, simulated and measured", draw=_draw),),
    lacks={"ladder": "exact at every step"},
    stability=(
        *readings.breaks_at(
            STEEPEST_GRIP,
            SEARCHED,
            steepest_grip,
            "tan α = ⁷⁄₂ (1 + e) µ/(1 + e_grip), Coulomb's bound",
            name="steepest-grip",
            title="Steepest impact at which the ball grips",
            definition="its slip turns round by 0.41 to 1e-9",
            unit="degrees",
        ),
        *readings.breaks_at(
            FASTEST,
            SEARCHED,
            fastest,
            "Coulomb's law and restitution know no speed: the angle stays as far as it is looked for, 3900 km/s",
            name="fastest",
            title="How many times as fast the ball may come",
            definition="it leaves at the angle of sliding to 1e-12, 30.3° from the normal",
            unit="1",
        ),
    ),
)
