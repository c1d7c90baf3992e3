"""Library problem A05: does a stiff flyball governor settle and slow its shaft as it should?"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from spook_tracker import engine

from .. import case
from ..bracket import break_point
from .library import FIRST_ORDER, GRAVITY, HIGH, LOW, SECOND_ORDER, error_metric, ladders, library_error

SPIN = 2.0 * math.pi  # rad/s, of the shaft at the start
LEAN = math.radians(30.0)  # of the rods below the level
OUT, TOP, MIDDLE = 0.05, 1.0, 0.5  # m: hinges off the axis and their height; start of the slider
ROD, BALL, SLIDER = 0.3, 5.0, 3.0  # kg
ALONG, ACROSS = ROD * 2e-4 / 12.0, ROD * (1.0 + 1e-4) / 12.0  # kg m², of shaft and rods
CUBE = SLIDER * 0.1**2 / 6.0  # kg m²
STIFFNESS, VISCOSITY, REST = 8e5, 4e4, 0.5  # N/m, N s/m, m
COMPLIANCE = 1e-11  # m/N and rad/(N m)
EXACT = {  # s: height of the slider in m
    0.1: 0.523836475570,
    0.5: 0.743249424786,
    1.0: 0.501420922380,
    2.0: 0.505909294297,
    5.0: 0.535563103722,
    10.0: 0.619622917061,
}
END_RATE = 5.5482036227  # rad/s, of the shaft after 10 s
TURN = 53.86899866  # kg m²/s, L_z
CEILING = 0.9  # m, where a slider is too high
FINE = 1 / 2000  # s, of both searches
STIFFEST = 1e15  # N/m, where the search for the stiffest spring ends


def scene(time_step: float) -> engine.Scene:
    """Shaft, slider and two rods, each with its ball at the end as one body; g along −z."""
    mass, centre = ROD + BALL, (0.5 * ROD + BALL) / (ROD + BALL)  # kg; m from the hinge
    inertia = ACROSS + ROD * (centre - 0.5) ** 2 + BALL * (1.0 - centre) ** 2
    spin = (0.0, 0.0, SPIN)
    bodies = [
        engine.RigidBody(
            name="shaft",
            mass=ROD,
            inertia=(ACROSS, ACROSS, ALONG),
            position=(0.0, 0.0, MIDDLE),
            angular_velocity=spin,
        ),
        engine.RigidBody(
            name="slider",
            mass=SLIDER,
            inertia=(CUBE, CUBE, CUBE),
            position=(0.0, 0.0, MIDDLE),
            angular_velocity=spin,
        ),
    ]

    def options(name: str, first: str, second: str) -> dict[str, object]:
        return {"name": name, "between": (first, second), "compliance": COMPLIANCE, "damping": time_step}

    up = (0.0, 0.0, 1.0)
    rows: list[engine.Hinge | engine.Prismatic | engine.Distance] = [
        engine.Hinge(**options("bearing", engine.WORLD, "shaft"), at=(0.0, 0.0, 0.0), axis=up),  # type: ignore[arg-type]
        engine.Prismatic(**options("slide", "shaft", "slider"), at=(0.0, 0.0, MIDDLE), axis=up),  # type: ignore[arg-type]
    ]
    for side, sign in (("right", 1.0), ("left", -1.0)):
        x = sign * (OUT + centre * math.cos(LEAN))
        bodies.append(
            engine.RigidBody(
                name=side,
                mass=mass,
                inertia=(ALONG, inertia, inertia),
                position=(x, 0.0, TOP - centre * math.sin(LEAN)),
                orientation=(math.cos(0.5 * LEAN), 0.0, sign * math.sin(0.5 * LEAN), 0.0),
                velocity=(0.0, SPIN * x, 0.0),
                angular_velocity=spin,
            )
        )
        at = (sign * OUT, 0.0, TOP)
        rows.append(engine.Hinge(**options(f"{side} hinge", "shaft", side), at=at, axis=(0.0, 1.0, 0.0)))  # type: ignore[arg-type]
        rows.append(
            engine.Distance(
                name=f"{side} spring",
                between=("slider", side),
                anchors=((sign * OUT, 0.0, 0.0), (sign * (0.5 - centre), 0.0, 0.0)),
                rest_length=REST,
                compliance=1.0 / STIFFNESS,
                damping=VISCOSITY / STIFFNESS,
            )
        )
    return engine.Scene(
        bodies=tuple(bodies), constraints=tuple(rows), gravity=(0.0, 0.0, -GRAVITY), contacts=False
    )


def answers(
    simulate: case.Simulate, time_step: float, method: engine.Method = engine.PLAIN
) -> dict[str, float]:
    """The library's error of the slider, the shaft's rate at the end, angular momentum."""
    result = simulate(
        scene(time_step),
        time_step=time_step,
        duration=10.0,
        method=method,
        observe={
            "slider": engine.Trace(quantity=engine.Position("slider")),
            "rate": engine.Trace(quantity=engine.AngularVelocity("shaft")),
            "turn": engine.MaximumAbsolute(quantity=engine.AngularMomentum()),
            "drift": engine.MaximumAbsolute(quantity=engine.AngularMomentum(), from_start=True),
        },
    )
    times = [round(time / time_step) for time in EXACT]
    return {
        "library_error": library_error(result["slider"][times, 2], list(EXACT.values())),
        "shaft_rate_error": float(result["rate"][-1, 2]) / END_RATE - 1.0,
        "angular_momentum_error": float(result["turn"][2]) / TURN - 1.0,
        "angular_momentum_drift": float(np.abs(result["drift"][2])) / TURN,
    }


def coarse(simulate: case.Simulate) -> dict[str, float]:
    """At h = 1/60 s, 135 times what an explicit step could take."""
    return answers(simulate, 1 / 60)


def fine(simulate: case.Simulate) -> dict[str, float]:
    """At h = 1/4000 s."""
    return answers(simulate, 1 / 4000)


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Of the slider at six times in 10 s."""
    return answers(simulate, time_step, method)["library_error"]


def spun(simulate: case.Simulate, spin: float, stiffness: float = STIFFNESS) -> float:
    """The slider's highest place [m] in the first 0.6 s at FINE, the shaft starting with `spin` [rad/s]."""
    built = scene(FINE)
    bodies = (
        replace(
            body,
            velocity=(0.0, spin / SPIN * body.velocity[1], 0.0),
            angular_velocity=(0.0, 0.0, spin),
        )
        for body in built.bodies
        if isinstance(body, engine.RigidBody)
    )
    joints = (
        replace(joint, compliance=1.0 / stiffness) if isinstance(joint, engine.Distance) else joint
        for joint in built.constraints
    )
    built = replace(built, bodies=tuple(bodies), constraints=tuple(joints))
    observe = {"slider": engine.Maximum(quantity=engine.Position("slider"))}
    result = simulate(built, time_step=FINE, duration=0.6, observe=observe)
    return float(result["slider"][2]) if result.completed else math.inf


def lift(spin: float, height: float) -> float:
    """Energy [J] that is left for rising when the slider, from rest at MIDDLE with the shaft at `spin`, is at `height`.

    The springs' length is kept: the slider is as far below TOP as sin φ, φ the rods' lean. L_z is kept, too.
    """
    mass, centre = ROD + BALL, (0.5 * ROD + BALL) / (ROD + BALL)
    own = ACROSS + ROD * (centre - 0.5) ** 2 + BALL * (1.0 - centre) ** 2

    def inertia(sine: float) -> float:
        cosine = math.sqrt(1.0 - sine * sine)
        rods = mass * (OUT + centre * cosine) ** 2 + own * cosine**2 + ALONG * sine**2
        return ALONG + CUBE + 2.0 * rods

    first, last = TOP - MIDDLE, TOP - height
    turn = inertia(first) * spin
    weight = GRAVITY * (2.0 * mass * centre + SLIDER) * (first - last)
    return 0.5 * turn**2 * (1.0 / inertia(first) - 1.0 / inertia(last)) - weight


def fastest_below(height: float) -> float:
    """The spin [rad/s] at which the slider's first rise ends at `height` [m]; halving."""
    low, high = 1.0, 100.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if lift(middle, height) < 0.0 else (low, middle)
    return low


def fastest(simulate: case.Simulate) -> case.BreakPoint:
    """The fastest spin [rad/s] at which the slider stays below CEILING."""
    return break_point(
        lambda spin: spun(simulate, spin) < CEILING, 0.8 * SPIN, 4.0 * SPIN, resolution=2e-3, walk=6
    )


def stiffest(simulate: case.Simulate) -> case.BreakPoint:
    """The stiffest springs [N/m] with which the slider rises as high as with a link, to a centimetre."""

    def holds(stiffness: float) -> bool:
        return abs(spun(simulate, SPIN, stiffness) - HIGHEST) < 0.01

    return break_point(holds, STIFFNESS, STIFFEST, walk=6)


def highest() -> float:
    """Where the first rise ends at SPIN [m]; halving."""
    low, high = MIDDLE + 0.01, TOP
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if lift(SPIN, middle) > 0.0 else (low, middle)
    return low


HIGHEST = highest()  # m
FASTEST = fastest_below(CEILING)  # rad/s
OUTPUTS = "the slider's height at 0.1, 0.5, 1, 2, 5 and 10 s"
KEPT = (
    case.Metric(
        name="angular_momentum_error",
        description="largest |L_z| over 53.86899866 kg m²/s, minus one",
        unit="1",
        role="companion",
        limit=1e-9,
        limit_source="half a unit of the reference's last digit is 1e-10",
        reference=0.0,
        tolerance=1e-12,
    ),
    case.Metric(
        name="angular_momentum_drift",
        description="largest |L_z − L_z(0)| over L_z",
        unit="1",
        role="companion",
        limit=1e-11,
        limit_source="rows push both ends alike and the step keeps angular momentum; rounding of 40 000 steps remains",
        reference=0.0,
        tolerance=1e-12,
    ),
    case.Metric(
        name="shaft_rate_error",
        description="rate of the shaft after 10 s over 5.5482036227 rad/s, minus one",
        unit="1",
        role="reported",
        reference=0.0,
        relative_tolerance=1e-5,
    ),
)

TEST = case.ScalarTest(
    title="Multibody library A05: stiff flyball governor",
    question="Does a stiff flyball governor settle and slow its shaft as it should?",
    why="Time constants of 0.1 ms beside motions of seconds: a step that follows the springs takes 100 000 steps, one "
    "that does not must damp them rightly.",
    model="A turning shaft, two hinged rods with balls of 5 kg, and a slider held to the rods by spring-dampers of "
    "8e5 N/m and 4e4 N s/m.",
    parameters=(
        ("time step", "1/60 and 1/4000 s; ladder 1/30 to 1/8000 s"),
        ("masses", "shaft and rods 0.3 kg, balls 5 kg, slider 3 kg"),
        ("start", "rods 30° below the level, slider at 0.5 m, 2π rad/s"),
        ("joints", "compliance 1e-11, damping one time step"),
        ("duration", "10 s"),
    ),
    theory=(
        "Eigenvalues −8117, −20.05 and ± 7.346 i per second; a spring-damper is a row of compliance 1/k and damping d/k.",
        "L_z = 53.86899866 kg m²/s is kept.",
    ),
    reference="Height of the slider to twelve digits, from a tight integration; the library's error measure.",
    conclusion="Green: stiff spring-dampers are solved, not followed. Red: they are cut, ring, or take momentum away.",
    source="Library for computational benchmarking of multibody dynamics, problem A05",
    measurements=(
        case.Measurement(
            configuration="plain",
            time_step=1 / 60,
            metrics=(error_metric("companion", LOW, OUTPUTS), *KEPT),
            measure=coarse,
            note="the SPOOK step as it stands",
        ),
        case.Measurement(
            configuration="plain",
            time_step=1 / 4000,
            metrics=(error_metric("gate", HIGH, OUTPUTS), *KEPT),
            measure=fine,
            note="the SPOOK step as it stands",
        ),
    ),
    example=lambda: case.Example(scene=scene(1 / 60), time_step=1 / 60),
    ladders=ladders(
        "the slider at six times",
        {
            "low": (
                (1 / 30, 1 / 60, 1 / 120, 1 / 240),
                (
                    replace(FIRST_ORDER, order_range=(1 / 240, 1 / 60)),
                    replace(SECOND_ORDER, order_range=(1 / 240, 1 / 60)),
                ),
            ),
            "high": (
                (1 / 480, 1 / 1000, 1 / 2000, 1 / 4000, 1 / 8000),
                (
                    FIRST_ORDER,
                    replace(SECOND_ORDER, order_range=(1 / 4000, 1 / 480)),
                ),
            ),
        },
        ladder_error,
    ),
    stability=(
        case.StabilityStudy(
            name="fastest",
            title="Fastest spin at which the slider stays below 0.9 m at h = 1/2000 s",
            configuration="plain",
            definition="its highest place within 0.6 s",
            study=fastest,
            unit="rad/s",
            expected=(0.99 * FASTEST, 1.01 * FASTEST),
            expected_source="energy and L_z from rest to the end of the first rise, springs as links. Their dashpots take a few "
            "tenths of a per cent, and the bend of a step for a motion: a speed of ½ h v²/r, 0.3 % at this step (2.4 % at "
            "1/240 s); 0.2 % is the search's",
        ),
        case.StabilityStudy(
            name="stiffest-springs",
            title="Stiffest springs with which the slider rises as high as with links",
            configuration="plain",
            definition="its highest place within 0.6 s is that of rigid links to 0.01 m, h = 1/2000 s",
            study=stiffest,
            unit="N/m",
            expected=(STIFFEST, STIFFEST),
            expected_source="a spring is a row with its compliance: none is too stiff, and the limit is the link; the search ends "
            "at 1e15 N/m",
        ),
    ),
)
