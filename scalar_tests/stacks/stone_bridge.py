"""How much does a stone bridge carry, and where?"""

from __future__ import annotations

import functools
import math

from spook_tracker import engine

from .. import case
from ..bracket import break_point, unbroken
from ..configurations import configured
from ..sweep import line, sweep, told

GRAVITY = 9.81  # m/s²
DENSITY = 2000.0  # kg/m³
DEPTH = 0.4  # m
RADIUS, THICKNESS = 1.0, 0.08  # m
HALF = math.radians(50.0)  # of the opening
STONES = 11
FRICTION = 1.0
COMPLIANCE, CREEP = 1e-10, 1e-9  # m/N, m/(N s)
TIME_STEP = 1.0 / 60.0  # s
DURATION = 0.5  # s
CROSSING = 2.0  # s
SHORT = 0.1  # s, of the ladder's runs
LESS, MORE = 0.99, 1.01  # of the limit load
# Limit load over the weight on one stone, and the interval of the thrust over the weight at 0.99 times that; the least
# limit load of a weight that crosses. Linear programmes in tests/scalar_tests/test_contact_limits.py find them again.
LIMIT = {1: 0.9777815, 2: 0.7517449, 3: 0.8485011, 4: 1.3156534}
THRUST = {1: (0.77126, 0.77679), 2: (0.86073, 0.86661), 3: (1.05489, 1.06219)}
LEAST = LIMIT[2]


def joints() -> list[float]:
    """Angles of the joints from x, left to right [rad]."""
    return [0.5 * math.pi + HALF - 2.0 * HALF * k / STONES for k in range(STONES + 1)]


def wedge(left: float, right: float) -> list[tuple[float, float, float]]:
    """The eight corners of a stone between two joints."""
    return [
        (radius * math.cos(angle), across, radius * math.sin(angle))
        for radius in (RADIUS - 0.5 * THICKNESS, RADIUS + 0.5 * THICKNESS)
        for across in (-0.5 * DEPTH, 0.5 * DEPTH)
        for angle in (left, right)
    ]


@functools.cache
def bridge() -> tuple[engine.RigidBody, ...]:
    """Stones between two abutments, touching and at rest."""
    rough = engine.Material(friction=FRICTION, compliance=COMPLIANCE, slip_compliance=CREEP)
    at, one = joints(), 2.0 * HALF / STONES
    places = [("left", at[0] + one, at[0]), ("right", at[-1], at[-1] - one)]
    places += [(f"stone {k}", at[k], at[k + 1]) for k in range(STONES)]
    bodies = []
    for name, left, right in places:
        shape, position, orientation = engine.ConvexHull.placed(wedge(left, right))
        stone = name.startswith("stone")
        bodies.append(
            engine.RigidBody(
                name=name,
                motion="dynamic" if stone else "static",
                mass=DENSITY * shape.volume if stone else None,
                shape=shape,
                position=position,
                orientation=orientation,
                material=rough,
            )
        )
    return tuple(bodies)


@functools.cache
def weight() -> float:
    """Of all stones [N]."""
    return GRAVITY * sum(body.mass for body in bridge() if body.mass)


def scene(stone: int, load: float) -> engine.Scene:
    """The bridge with so many times its weight on one stone."""
    on = engine.Load(name="load", body=f"stone {stone}", force=(0.0, 0.0, -load * weight()))
    return engine.Scene(bodies=bridge(), forces=(on,), gravity=(0.0, 0.0, -GRAVITY))


def crossed(load: float) -> engine.Scene:
    """So many times its weight goes over it at constant speed, shared by the two stones it stands between."""
    forces = []
    for stone in range(STONES):
        times = tuple(CROSSING * (stone + k) / (STONES + 1) for k in range(3))
        hat = engine.Table(times=times, values=(0.0, 1.0, 0.0))
        force = (0.0, 0.0, -load * weight())
        forces.append(engine.Load(name=f"load {stone}", body=f"stone {stone}", force=force, factor=hat))
    return engine.Scene(bodies=bridge(), forces=tuple(forces), gravity=(0.0, 0.0, -GRAVITY))


def most_sinking(load: float, duration: float = DURATION) -> float:
    """What a stone of a standing bridge can sink by [m]: every joint turns by less than what its points give way,
    2 (ε + γ T) F over the thickness, F no more than weight and load, and no stone is farther from it than 2 R."""
    give = 2.0 * (COMPLIANCE + CREEP * duration) * (1.0 + load) * weight()
    return (STONES + 1) * give / THICKNESS * 2.0 * RADIUS


def sinking(
    simulate: case.Simulate,
    stone: int,
    load: float,
    time_step: float = TIME_STEP,
    method: engine.Method = engine.PLAIN,
    duration: float = DURATION,
) -> float:
    """How far the loaded stone sinks [m]."""
    asked = scene(stone, load)
    observe = {"x": engine.Final(quantity=engine.Position(f"stone {stone}"))}
    result = simulate(asked, time_step=time_step, duration=duration, method=method, observe=observe)
    return float(asked.body(f"stone {stone}").position[2]) - float(result["x"][2])


def measure(simulate: case.Simulate, stone: int) -> dict[str, float]:
    """One per cent less than the limit load, and one per cent more."""
    load = LESS * LIMIT[stone]
    asked = scene(stone, load)
    observe = {
        "x": engine.Final(quantity=engine.Position(f"stone {stone}")),
        "left": engine.Final(quantity=engine.ContactForce("left")),
        "right": engine.Final(quantity=engine.ContactForce("right")),
    }
    result = simulate(asked, time_step=TIME_STEP, duration=DURATION, observe=observe)
    sunk = float(asked.body(f"stone {stone}").position[2]) - float(result["x"][2])
    carried = -float(result["left"][2]) - float(result["right"][2])
    more = MORE * LIMIT[stone]
    return {
        "stands": sunk / most_sinking(load),
        "falls": sinking(simulate, stone, more) / most_sinking(more),
        "weight_error": carried / ((1.0 + load) * weight()) - 1.0,
        "thrust": -float(result["left"][0]) / weight(),
    }


def cross(simulate: case.Simulate) -> dict[str, float]:
    """A load of 0.99 of the least limit goes over the bridge."""
    observe = {f"x{k}": engine.Final(quantity=engine.Position(f"stone {k}")) for k in range(STONES)}
    load = LESS * LEAST
    asked = crossed(load)
    result = simulate(asked, time_step=TIME_STEP, duration=CROSSING, observe=observe)
    moved = max(
        math.dist(asked.body(f"stone {k}").position, [float(x) for x in result[f"x{k}"]])
        for k in range(STONES)
    )
    return {"stays": moved / most_sinking(load, CROSSING)}


def stands(simulate: case.Simulate, load: float) -> bool:
    """Whether the weakest stone sinks by no more than it can while the bridge stands."""
    return sinking(simulate, 2, load) < most_sinking(load)


def heaviest(simulate: case.Simulate) -> case.BreakPoint:
    """The heaviest load that the weakest stone carries, over the weight."""
    limit = LIMIT[2]
    return break_point(
        lambda load: stands(simulate, load), 0.9 * limit, 1.1 * limit, resolution=0.005, walk=4
    )


def carries(simulate: case.Simulate, load: float) -> bool:
    """Whether the keystone sinks by no more than it can under so many times the weight."""
    return sinking(simulate, STONES // 2, load, duration=SHORT) < most_sinking(load, SHORT)


def draw(simulate: case.Simulate) -> case.Drawing:
    """Sinking of the loaded stone against the load over its limit."""
    ratios = (0.9, 0.97, 0.99, 1.01, 1.03)
    curves = [
        line(
            f"on stone {stone + 1}",
            ratios,
            sweep(ratios, lambda r, s=stone: max(1e-9, sinking(simulate, s, r * LIMIT[s]))),  # type: ignore[misc]
            "both",
        )
        for stone in (1, 2)
    ]
    standing, falling = curves[1].y[2], curves[1].y[3]
    return case.Drawing(
        curves=tuple(curves),
        x_label="load over the limit load of its place",
        y_label="sinking of the loaded stone in 0.5 s [m]",
        y_scale="log",
        note=f"One per cent below its limit load the third stone gives way by {told(standing)} m, one per cent above by "
        f"{told(falling)} m.",
    )


def _asked(stone: int) -> case.Measurement:
    low, high = THRUST[stone]
    return case.Measurement(
        configuration="plain",
        time_step=TIME_STEP,
        parameters={"stone": float(stone + 1)},
        metrics=(
            case.Metric(
                name="stands",
                description="sinking under less than the limit load, over the most that a standing bridge can",
                unit="1",
                role="gate",
                limit=1.0,
                limit_source="every joint turns by less than 2 (ε + γ T) (W + P)/t, and no stone is farther than 2 R",
                reference=0.0,
                relative_tolerance=1e-3,
            ),
            case.Metric(
                name="falls",
                description="sinking under more than the limit load, over the most that a standing bridge can",
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
                description="force on both abutments over weight and load, minus one",
                unit="1",
                role="companion",
                limit=1e-3,
                limit_source="at rest; what still settles accelerates by less than a thousandth of g",
                reference=0.0,
                tolerance=1e-4,
            ),
            case.Metric(
                name="thrust",
                description="horizontal force on the left abutment over the weight, under less than the limit load",
                unit="1",
                role="companion",
                better="inside",
                limit=(low - 1e-3, high + 1e-3),
                limit_source="the least and the largest thrust whose line fits in, by limit analysis, and a thousandth "
                "for what gives way",
                relative_tolerance=1e-4,
            ),
        ),
        measure=functools.partial(measure, stone=stone),
        note=f"1 % less and 1 % more than what limit analysis allows on stone {stone + 1} of {STONES}",
    )


CROSSED = case.Measurement(
    configuration="crossed",
    time_step=TIME_STEP,
    metrics=(
        case.Metric(
            name="stays",
            description="largest way of a stone while a load crosses, over the most that a standing bridge can give",
            unit="1",
            role="gate",
            limit=1.0,
            limit_source="every joint turns by less than 2 (ε + γ T) (W + P)/t, and no stone is farther than 2 R",
            reference=0.0,
            relative_tolerance=1e-3,
        ),
    ),
    measure=cross,
    note="0.99 of the least limit load crosses in 2 s, shared by the two stones it is between",
)

TEST = case.ScalarTest(
    title="Stone bridge",
    question="How much does a stone bridge carry, and where?",
    why="A load bends the line of thrust, and where the line leaves the stones, joints open. The engine must find the same "
    "load as limit analysis, to a per cent, though no joint is glued and all forces are found from contact alone.",
    model="Eleven wedges of 0.08 m form an arch of 1 m mean radius and 100° between two fixed abutments, touching and at "
    "rest. A load acts on the second, third or fourth stone, or crosses the bridge slowly. The joints have small compliance "
    "and creep: with none the forces are not unique.",
    parameters=(
        ("time step", "1/60 s"),
        ("stones", "11 wedges, 0.08 × 0.4 m, 2000 kg/m³"),
        ("contacts", "µ = 1, ε = 1e-10 m/N, γ = 1e-9 m/(N s)"),
        ("load", "1 % less and more than the limit, at the centre of mass of a stone"),
        ("gravity", "9.81 m/s²"),
    ),
    theory=(
        "Without sliding a bridge carries a load if a line of thrust fits inside (Heyman 1966): forces at the edges of each "
        "joint, none of them pulling, that balance every stone. The largest load is a linear programme.",
        "Over the weight: 0.97778, 0.75174, 0.84850, 1.31565 on the second to the fifth stone; on the keystone no load is "
        "too much while stone does not crush.",
        "Forces in joints are at most 0.35 as steep as the joint's own: nothing slides at µ = 1.",
        "Beyond it four hinges open, and it falls faster and faster. A load between two stones is weakest on the third.",
    ),
    reference="Limit analysis: linear programmes in the test of the limits.",
    conclusion="Green: the bridge stands and falls where the thrust line says. Red: corners are lost from contacts (it falls "
    "too early), or joints hold that should open (it carries too much).",
    source="ours; J. Heyman, The stone skeleton, 1966",
    measurements=(_asked(1), _asked(2), _asked(3), CROSSED),
    example=lambda: case.Example(scene=crossed(LESS * LEAST), time_step=TIME_STEP, duration=CROSSING),
    stability=(
        case.StabilityStudy(
            name="load",
            title="Heaviest load that the third stone carries, over the weight",
            configuration="plain",
            definition="in half a second it sinks by less than a standing bridge can",
            study=heaviest,
            unit="1",
            expected=(0.995 * LIMIT[2], 1.002 * LIMIT[2]),
            expected_source="limit analysis: 0.7517; the resolution of the search, and what half a second of a fall that has "
            "hardly begun hides",
        ),
        unbroken(
            carries,
            1.0,
            100.0,
            name="keystone-load",
            title="Heaviest load that the keystone carries, over the weight",
            definition="in a tenth of a second it sinks by less than a standing bridge can",
            source="limit analysis: a line of thrust fits whatever lies on the keystone, and stone does not crush",
            unit="1",
            walk=3,
        ),
    ),
    figures=(case.Figure(name="load", title="Sinking of the loaded stone against the load", draw=draw),),
    ladders=(
        case.Ladder(
            name="sinking",
            description="sinking of the third stone under 0.99 of its limit load in 0.1 s: none is right",
            unit="m",
            time_steps=tuple(1.0 / n for n in (30, 60, 120)),
            configurations=configured({"direct": None, "half-step": None}),
            error=lambda simulate, time_step, method: sinking(
                simulate, 2, LESS * LIMIT[2], time_step, method, SHORT
            ),
            target_error=1e-4,
            target_seconds=0.05,
        ),
    ),
)
