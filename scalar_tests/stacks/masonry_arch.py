"""How thin may a masonry arch be before it falls?"""

from __future__ import annotations

import functools
import math

from spook_tracker import engine

from .. import case
from ..bracket import break_point
from ..sweep import line, sweep, told

GRAVITY = 9.81  # m/s²
DENSITY = 2000.0  # kg/m³
DEPTH = 0.4  # m
FRICTION = 1.0
COMPLIANCE, CREEP = 1e-9, 1e-8  # m/N, m/(N s)
TIME_STEP = 1.0 / 60.0  # s
DURATION = 0.5  # s
# Least thickness over the mean radius by limit analysis, of straight voussoirs, and the interval of the thrust over the
# weight at 1.02 times that: a linear programme in tests/scalar_tests/test_contact_limits.py finds both again.
LEAST = {5: 0.0949796, 9: 0.1015254, 21: 0.1066948}
THRUST = {5: (0.19794, 0.20065), 9: (0.19650, 0.19920), 21: (0.19653, 0.19943)}

# Least friction with which any forces hold five stones, 1.02 times as thick as they must be, and the largest that any
# forces which hold them need; the same test.
SMOOTHEST = (0.39587, 0.40131)
SOON, SLID = 0.1, 2e-5  # s, m: joints that hold give way by (ε + γ T) W, 5e-6 m


def voussoirs(count: int, thickness: float) -> list[list[tuple[float, float, float]]]:
    """The eight corners of each wedge of a semicircle of mean radius 1 m over the plane z = 0."""
    joints = [math.pi * k / count for k in range(count + 1)]
    return [
        [
            (radius * math.cos(angle), across, radius * math.sin(angle))
            for radius in (1.0 - 0.5 * thickness, 1.0 + 0.5 * thickness)
            for across in (-0.5 * DEPTH, 0.5 * DEPTH)
            for angle in joints[k : k + 2]
        ]
        for k in range(count)
    ]


@functools.cache
def scene(count: int, thickness: float, friction: float = FRICTION) -> engine.Scene:
    """The arch on rough ground, its stones touching and at rest."""
    stone = engine.Material(friction=friction, compliance=COMPLIANCE, slip_compliance=CREEP)
    bodies = [
        engine.RigidBody(
            name="ground", motion="static", shape=engine.Plane(), position=(0.0, 0.0, 0.0), material=stone
        )
    ]
    for k, corners in enumerate(voussoirs(count, thickness)):
        shape, position, orientation = engine.ConvexHull.placed(corners)
        bodies.append(
            engine.RigidBody(
                name=f"stone {k}",
                mass=DENSITY * shape.volume,
                shape=shape,
                position=position,
                orientation=orientation,
                material=stone,
            )
        )
    return engine.Scene(bodies=tuple(bodies), gravity=(0.0, 0.0, -GRAVITY))


def weight(count: int, thickness: float) -> float:
    """Of the whole arch [N]."""
    return GRAVITY * sum(
        body.mass
        for body in scene(count, thickness).bodies
        if isinstance(body, engine.RigidBody) and body.mass
    )


def most_sinking(count: int, thickness: float) -> float:
    """What the crown of a standing arch can sink by [m]: every joint turns by less than what its points give way,
    (ε + γ T) F over the thickness, F no more than the weight, and the crown is a radius away."""
    return (count + 1) * 2.0 * (COMPLIANCE + CREEP * DURATION) * weight(count, thickness) / thickness


def sinking(
    simulate: case.Simulate,
    count: int,
    thickness: float,
    time_step: float = TIME_STEP,
    method: engine.Method = engine.PLAIN,
) -> float:
    """How far the crown sinks in half a second [m]."""
    crown = f"stone {count // 2}"
    observe = {"x": engine.Final(quantity=engine.Position(crown))}
    asked = scene(count, thickness)
    result = simulate(asked, time_step=time_step, duration=DURATION, method=method, observe=observe)
    return float(asked.body(crown).position[2]) - float(result["x"][2])


def measure(simulate: case.Simulate, count: int) -> dict[str, float]:
    """An arch 2 % thicker than it must be, and one 2 % thinner."""
    thick, thin = 1.02 * LEAST[count], 0.98 * LEAST[count]
    observe = {
        "x": engine.Final(quantity=engine.Position(f"stone {count // 2}")),
        "foot": engine.Final(quantity=engine.ContactForce("stone 0", "ground")),
        "ground": engine.Final(quantity=engine.ContactForce("ground")),
    }
    asked = scene(count, thick)
    result = simulate(asked, time_step=TIME_STEP, duration=DURATION, observe=observe)
    whole = weight(count, thick)
    return {
        "stands": (float(asked.body(f"stone {count // 2}").position[2]) - float(result["x"][2]))
        / most_sinking(count, thick),
        "falls": sinking(simulate, count, thin) / most_sinking(count, thin),
        "weight_error": -float(result["ground"][2]) / whole - 1.0,
        "thrust": abs(float(result["foot"][0])) / whole,
    }


def stands(simulate: case.Simulate, count: int, thickness: float) -> bool:
    """Whether it sinks by no more than it can while it stands."""
    return sinking(simulate, count, thickness) < most_sinking(count, thickness)


def thinnest(simulate: case.Simulate) -> case.BreakPoint:
    """The thinnest arch of nine stones that stands."""
    least = LEAST[9]
    return break_point(
        lambda thickness: stands(simulate, 9, thickness), 1.3 * least, 0.8 * least, resolution=0.002, walk=6
    )


def slides(simulate: case.Simulate, friction: float) -> float:
    """How far a foot of five stones slides outwards in SOON [m]."""
    asked = scene(5, 1.02 * LEAST[5], friction)
    observe = {"x": engine.Final(quantity=engine.Position("stone 0"), from_start=True)}
    result = simulate(asked, time_step=TIME_STEP, duration=SOON, observe=observe)
    return float(result["x"][0])


def smoothest(simulate: case.Simulate) -> case.BreakPoint:
    """The least friction with which an arch of five stones stands."""
    low, high = SMOOTHEST
    return break_point(
        lambda mu: slides(simulate, mu) < SLID, 1.3 * high, 0.8 * low, resolution=0.002, walk=4
    )


def draw(simulate: case.Simulate) -> case.Drawing:
    """The crown's sinking against the thickness, over the least one."""
    ratios = (0.96, 0.98, 0.99, 1.01, 1.02, 1.04)
    curves = [
        line(
            f"{count} stones",
            ratios,
            sweep(ratios, lambda ratio, n=count: max(1e-9, sinking(simulate, n, ratio * LEAST[n]))),  # type: ignore[misc]
            "both",
        )
        for count in (5, 9)
    ]
    standing, falling = curves[1].y[3], curves[1].y[2]
    return case.Drawing(
        curves=tuple(curves),
        x_label="thickness over the least one",
        y_label="sinking of the crown in 0.5 s [m]",
        y_scale="log",
        note=f"One per cent above the least thickness the crown of nine stones gives way by {told(standing)} m, one per "
        f"cent below by {told(falling)} m.",
    )


def _asked(count: int) -> case.Measurement:
    low, high = THRUST[count]
    return case.Measurement(
        configuration="plain",
        time_step=TIME_STEP,
        parameters={"N": float(count)},
        metrics=(
            case.Metric(
                name="stands",
                description="sinking of the crown of the thicker arch, over the most that a standing one can",
                unit="1",
                role="gate",
                limit=1.0,
                limit_source="every joint turns by less than (ε + γ T) W/t; the crown is a radius away",
                reference=0.0,
                relative_tolerance=1e-3,
            ),
            case.Metric(
                name="falls",
                description="sinking of the crown of the thinner arch, over the most that a standing one can",
                unit="1",
                role="gate",
                better="larger",
                limit=3.0,
                limit_source="no thrust line fits: it must fall, three times as far as a standing one can sink",
                limit_kind="physical",
                relative_tolerance=1e-3,
            ),
            case.Metric(
                name="weight_error",
                description="force on the ground over the weight, minus one",
                unit="1",
                role="companion",
                limit=1e-3,
                limit_source="at rest; what still settles accelerates by less than a thousandth of g",
                reference=0.0,
                tolerance=1e-4,
            ),
            case.Metric(
                name="thrust",
                description="horizontal force at a foot over the weight, of the thicker arch",
                unit="1",
                role="companion",
                better="inside",
                limit=(low - 1e-3, high + 1e-3),
                limit_source="the least and the largest thrust whose line fits in, by limit analysis, and a thousandth "
                "for what gives way",
                relative_tolerance=1e-4,
            ),
        ),
        measure=functools.partial(measure, count=count),
        note=f"{count} stones, 2 % thicker and 2 % thinner than limit analysis allows",
    )


TEST = case.ScalarTest(
    title="Masonry arch",
    question="How thin may a masonry arch be before it falls?",
    why="Nothing but contact and friction holds an arch, and whether it stands is decided by geometry alone: every "
    "stone's edges, weight and place must be right to a per cent of its thickness.",
    model="Straight-sided wedges form a semicircle of 1 m mean radius on rough ground, touching and at rest. They touch "
    "with four points a joint, of small compliance and creep: with none the forces in a standing arch are not unique.",
    parameters=(
        ("time step", "1/60 s"),
        ("stones", "5, 9 and 21 wedges, 0.4 m deep, 2000 kg/m³"),
        ("contacts", "µ = 1, ε = 1e-9 m/N, γ = 1e-8 m/(N s)"),
        ("thickness", "2 % more and less than the least"),
        ("gravity", "9.81 m/s²"),
    ),
    theory=(
        "Without sliding, an arch stands if a line of thrust fits inside (Heyman 1966): forces at the edges of each "
        "joint, none of them pulling, that balance every stone. This is a linear programme.",
        "Least thickness over radius: 0.1075 for infinitely many wedges (Milankovitch 1907); 0.09498, 0.10153, 0.10669 "
        "for 5, 9 and 21 straight ones (0.0966, 0.1021, 0.1068 if the stones are round).",
        "Below it four hinges open and it falls faster and faster.",
    ),
    reference="Limit analysis: a linear programme in the test of the limits.",
    conclusion="Green: hulls touch at their edges and carry what statics says. Red: corners are lost from the contact "
    "(it falls too early) or the stones stick (it stands too long).",
    source="ours; J. Heyman, The stone skeleton, 1966",
    measurements=(_asked(5), _asked(9), _asked(21)),
    example=lambda: case.Example(scene=scene(9, 0.95 * LEAST[9]), time_step=TIME_STEP, duration=1.5),
    stability=(
        case.StabilityStudy(
            name="thickness",
            title="Thinnest arch of nine stones that stands",
            configuration="plain",
            definition="in half a second the crown sinks by less than a standing arch can",
            study=thinnest,
            unit="m",
            better="smaller",
            expected=(0.995 * LEAST[9], 1.003 * LEAST[9]),
            expected_source="limit analysis: 0.1015; the resolution of the search, and what half a second of a fall that "
            "has hardly begun hides",
        ),
        case.StabilityStudy(
            name="smoothest",
            title="Least friction with which an arch of five stones stands",
            configuration="plain",
            definition="in a tenth of a second a foot slides by less than 0.02 mm",
            study=smoothest,
            unit="1",
            better="smaller",
            expected=(0.996 * SMOOTHEST[0], 1.002 * SMOOTHEST[1]),
            expected_source="limit analysis: no forces hold it below 0.3959, all that balance do above 0.4013; 0.2 % of the search, "
            "and as much lacking that slides by half of that in a tenth of a second",
        ),
    ),
    figures=(case.Figure(name="thickness", title="Sinking of the crown against thickness", draw=draw),),
    ladders=(
        case.Ladder(
            name="sinking",
            description="sinking of the crown of nine stones, 2 % thicker than they must be: none is right",
            unit="m",
            time_steps=tuple(1.0 / n for n in (30, 60, 120, 240)),
            configurations=(
                case.Configuration(name="direct", method=engine.PLAIN, expected_order=None),
                case.Configuration(
                    name="iterative",
                    method=engine.Method(solver="iterative", iterations=2000),
                    expected_order=None,
                ),
            ),
            error=lambda simulate, time_step, method: sinking(
                simulate, 9, 1.02 * LEAST[9], time_step, method
            ),
            target_error=1e-3,
            target_seconds=0.2,
        ),
    ),
)
