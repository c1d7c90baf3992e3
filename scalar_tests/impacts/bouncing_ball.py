"""Does a ball bounce as its restitution says until it is at rest?"""

from __future__ import annotations

import functools
import math

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.bodies import Material

from .. import case
from ..bracket import break_point
from ..configurations import configured
from ..sweep import line

RADIUS = 0.1  # m
MASS = 1.0  # kg
GRAVITY = 9.81  # m/s²
HEIGHT = 1.0  # m, gap at the start
RESTITUTION = 0.8
TIME_STEP = 1e-3  # s
BOUNCES = 5
DROPS = 16
PLATE = 0.02  # m, thickness of the plate in the tunnelling study
FALL = math.sqrt(2.0 * HEIGHT / GRAVITY)  # s, the first fall
STOP = FALL * (1.0 + RESTITUTION) / (1.0 - RESTITUTION)  # s
IMPACT_SPEED = math.sqrt(2.0 * GRAVITY * HEIGHT)  # m/s
RESTING_GAP = 1e-4  # m, from which on the ball counts as stopped: so many flights that stay lower last TAIL s
TAIL = math.sqrt(8.0 * RESTING_GAP / GRAVITY) / (1.0 - RESTITUTION)
SAG = GRAVITY * TIME_STEP**2 / 8.0  # m, of the path under its chord in a step


def scene(gap: float = HEIGHT, speed: float = 0.0) -> engine.Scene:
    """A ball `gap` [m] above a plane, falling at `speed` [m/s]."""
    rubber = Material(restitution=RESTITUTION)
    floor = engine.RigidBody(
        name="floor", motion="static", shape=engine.Plane(), position=(0.0, 0.0, 0.0), material=rubber
    )
    ball = engine.RigidBody(
        name="ball",
        mass=MASS,
        shape=engine.Sphere(RADIUS),
        position=(0.0, 0.0, RADIUS + gap),
        velocity=(0.0, 0.0, -speed),
        material=rubber,
    )
    return engine.Scene(bodies=(floor, ball), gravity=(0.0, 0.0, -GRAVITY))


def gaps(
    simulate: case.Simulate,
    time_step: float,
    duration: float,
    method: engine.Method = engine.PLAIN,
    height: float = HEIGHT,
) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and gap [m] between a ball dropped from `height` [m] and the floor."""
    observe = {"place": engine.Trace(quantity=engine.Position("ball"))}
    result = simulate(scene(height), time_step=time_step, duration=duration, method=method, observe=observe)
    return result.sample_times["place"], result["place"][:, 2] - RADIUS


def bounce_heights(
    simulate: case.Simulate,
    time_step: float = TIME_STEP,
    method: engine.Method = engine.PLAIN,
    height: float = HEIGHT,
) -> np.ndarray:
    """(BOUNCES,) peak gap [m] after each bounce."""
    _, gap = gaps(simulate, time_step, 0.95 * STOP, method, height)
    rising = np.diff(gap) > 0.0
    peaks = np.nonzero(rising[:-1] & ~rising[1:])[0] + 1
    heights = gap[peaks]
    if len(heights) < BOUNCES:
        return np.full(BOUNCES, np.nan)
    return np.asarray(heights[:BOUNCES])


def expected_heights() -> np.ndarray:
    """(BOUNCES,) e^(2n) h₀ [m]."""
    return np.asarray(HEIGHT * RESTITUTION ** (2.0 * np.arange(1, BOUNCES + 1)))


def _measure_heights(simulate: case.Simulate) -> dict[str, float]:
    return {"height_error": float(np.abs(bounce_heights(simulate) / expected_heights() - 1.0).max())}


def _measure_stop(simulate: case.Simulate) -> dict[str, float]:
    times, gap = gaps(simulate, TIME_STEP, 2.0 * STOP)
    moving = np.nonzero(gap > RESTING_GAP)[0]
    stop = times[moving[-1] + 1] if moving[-1] + 1 < len(times) else math.inf
    return {"stop_time_error": float(stop) / STOP - 1.0, "rest_gap": float(gap[-1])}


def _measure_energy(simulate: case.Simulate) -> dict[str, float]:
    result = simulate(
        scene(),
        time_step=TIME_STEP,
        duration=2.0 * STOP,
        observe={"energy": engine.Maximum(quantity=engine.Energy(), from_start=True)},
    )
    return {"energy_gain": float(result["energy"]) / (MASS * GRAVITY * HEIGHT)}


def _measure_rebound(simulate: case.Simulate) -> dict[str, float]:
    touching = scene(gap=0.0, speed=IMPACT_SPEED)
    result = simulate(
        touching,
        time_step=TIME_STEP,
        steps=1,
        observe={"speed": engine.Final(quantity=engine.Velocity("ball"))},
    )
    rebound = float(result["speed"][2]) + GRAVITY * TIME_STEP  # the step that bounces also falls for one step
    return {"rebound_error": rebound / (RESTITUTION * IMPACT_SPEED) - 1.0}


def _draw_heights(simulate: case.Simulate) -> case.Drawing:
    times, gap = gaps(simulate, TIME_STEP, 1.2 * STOP)
    every = slice(None, None, 5)
    return case.Drawing(
        curves=(
            line("gap", times[every], gap[every]),
            line("stop time t₀(1+e)/(1−e)", (STOP, STOP), (0.0, HEIGHT), "reference"),
        ),
        x_label="time [s]",
        y_label="gap between ball and floor [m]",
    )


def _draw_order(simulate: case.Simulate) -> case.Drawing:
    steps = (4e-3, 2e-3, 1e-3, 5e-4)
    errors = tuple(ladder_error(simulate, h, engine.PLAIN) for h in steps)
    return case.Drawing(
        curves=(
            line("largest error of five heights", steps, errors, "both"),
            line("second order", steps, (errors[0] * (h / steps[0]) ** 2 for h in steps), "reference"),
        ),
        x_label="time step [s]",
        y_label="relative error of the height",
        x_scale="log",
        y_scale="log",
        note="Root mean square of 16 drops, which meet the floor anywhere in a step.",
    )


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Largest relative error of the first five heights, root mean square of DROPS that meet the floor anywhere in a step."""
    heights = HEIGHT * (1.0 + 0.01 * np.arange(DROPS))
    worst = [
        np.abs(
            bounce_heights(simulate, time_step, method, float(h)) * HEIGHT / h / expected_heights() - 1.0
        ).max()
        for h in heights
    ]
    return float(np.sqrt(np.mean(np.square(worst))))


def fastest_impact(simulate: case.Simulate) -> case.BreakPoint:
    """Highest speed [m/s] at which the ball does not pass a plate of PLATE [m], at h = 1/60 s."""

    def holds(speed: float) -> bool:
        plate = engine.RigidBody(
            name="plate",
            motion="static",
            shape=engine.Box((10.0, 10.0, PLATE)),
            position=(0.0, 0.0, -0.5 * PLATE),
        )
        ball = engine.RigidBody(
            name="ball",
            mass=MASS,
            shape=engine.Sphere(RADIUS),
            position=(0.0, 0.0, RADIUS + HEIGHT),
            velocity=(0.0, 0.0, -speed),
        )
        shot = engine.Scene(bodies=(plate, ball), gravity=(0.0, 0.0, -GRAVITY))
        observe = {"place": engine.Minimum(quantity=engine.Position("ball"))}
        result = simulate(shot, time_step=1.0 / 60.0, steps=120, observe=observe)
        return result.completed and float(result["place"][2]) > 0.0

    return break_point(holds, 0.1, 1e6, resolution=0.05, walk=15)


def leaves(simulate: case.Simulate, speed: float) -> bool:
    """Whether a ball that touches the floor at `speed` [m/s] is on its way up after a step."""
    observe = {"speed": engine.Final(quantity=engine.Velocity("ball"))}
    result = simulate(scene(gap=0.0, speed=speed), time_step=TIME_STEP, steps=1, observe=observe)
    return result.completed and float(result["speed"][2]) > 0.0


def gentlest_impact(simulate: case.Simulate) -> case.BreakPoint:
    """Lowest speed [m/s] from which a ball rebounds."""
    return break_point(functools.partial(leaves, simulate), 1.0, 1e-6, resolution=1e-3, walk=7)


GENTLEST = GRAVITY * TIME_STEP / RESTITUTION  # m/s: what is left of it, gravity takes in the same step
TEST = case.ScalarTest(
    title="Bouncing ball",
    question="Does a ball bounce as its restitution says until it is at rest?",
    why="Impacts are where engines gain or lose energy by accident, and where a ball may jitter for ever.",
    model="A ball falls from rest on a plane with restitution 0.8 and bounces until it stops.",
    parameters=(
        ("ball", "radius 0.1 m, 1 kg"),
        ("gap at the start", "1 m"),
        ("restitution", "e = 0.8"),
        ("gravity", "9.81 m/s²"),
        ("time step", "1e-3 s"),
    ),
    theory=(
        "Impact: v₊ = −e v₋. Height after n bounces: e²ⁿ h₀.",
        "The bounces end at t₀ (1 + e)/(1 − e), t₀ = √(2 h₀/g).",
        "Within a step the path is a chord of the parabola: an impact is met up to its sag, g h²/8, beside the floor.",
    ),
    reference="Newton's impact law and free fall (closed form).",
    conclusion="Green: impacts neither gain nor lose. Red: penetration turns into speed, or restitution depends on phase.",
    source="thesis, section 5.4 (asked for)",
    measurements=(
        case.Measurement(
            configuration="plain",
            time_step=TIME_STEP,
            metrics=(
                case.Metric(
                    name="height_error",
                    description="largest relative error of the first five heights",
                    unit="1",
                    role="gate",
                    limit=(1.0 + RESTITUTION ** (-2 * BOUNCES)) * SAG / HEIGHT,
                    limit_source="impacts up to g h²/8 above the floor, 1 − e² of which stays, or tops seen as much too low, over "
                    "e¹⁰ h₀; and the half step by which it falls from the start",
                    reference=0.0,
                    tolerance=1e-9,
                ),
            ),
            measure=_measure_heights,
            note="Impact stage with restitution, resting stage after it.",
        ),
        case.Measurement(
            configuration="plain",
            time_step=TIME_STEP,
            metrics=(
                case.Metric(
                    name="rebound_error",
                    description="relative error of the speed after an impact of a ball that just touches",
                    unit="1",
                    role="companion",
                    limit=1e-12,
                    limit_source="v₊ = −e v₋, exact in the impact stage",
                    reference=0.0,
                    tolerance=1e-14,
                ),
            ),
            measure=_measure_rebound,
            note="Impact stage alone.",
        ),
        case.Measurement(
            configuration="plain",
            time_step=TIME_STEP,
            metrics=(
                case.Metric(
                    name="stop_time_error",
                    description="relative error of the time at which the gap stays under 1e-4 m",
                    unit="1",
                    role="companion",
                    limit=(TAIL + 2.0 * TIME_STEP) / STOP,
                    limit_source="flights under 1e-4 m, √(8e-4/g)/(1−e) of time, and the two steps between which it stops",
                    reference=0.0,
                    tolerance=1e-9,
                ),
                case.Metric(
                    name="rest_gap",
                    description="gap at the end: the ball rests on the floor",
                    unit="m",
                    role="companion",
                    limit=1e-6,
                    limit_source="rigid contact",
                    reference=0.0,
                    tolerance=1e-12,
                ),
            ),
            measure=_measure_stop,
            note="Twice the time the bounces should take.",
        ),
        case.Measurement(
            configuration="plain",
            time_step=TIME_STEP,
            metrics=(
                case.Metric(
                    name="energy_gain",
                    description="largest energy above the start, over m g h₀",
                    unit="1",
                    role="companion",
                    better="smaller",
                    limit=0.5 * TIME_STEP * IMPACT_SPEED / HEIGHT,
                    limit_source="the symplectic step reads energy off by up to ½ m g h v",
                    reference=0.0,
                    tolerance=1e-12,
                ),
            ),
            measure=_measure_energy,
            note="Twice the time the bounces should take.",
        ),
    ),
    example=lambda: case.Example(scene=scene(), time_step=TIME_STEP),
    figures=(
        case.Figure(name="heights", title="Bounces", draw=_draw_heights),
        case.Figure(name="order", title="Error of the heights against the time step", draw=_draw_order),
    ),
    ladders=(
        case.Ladder(
            name="heights",
            description="largest relative error of the first five heights, of 16 drops",
            unit="1",
            time_steps=(4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4),
            configurations=configured({"plain": 2.0, "half-step": 2.0}),
            error=ladder_error,
            target_error=0.05,
            target_seconds=0.01,
        ),
    ),
    stability=(
        case.StabilityStudy(
            name="fastest-impact",
            title="Fastest ball that does not pass a plate of 2 cm at h = 1/60 s",
            configuration="plain",
            definition="120 steps with the ball's centre always above the plate's top",
            study=fastest_impact,
            unit="m/s",
            expected=(1e6, 1e6),
            expected_source="contacts are looked for as far away as a body gets in one step, so no speed passes; the search ends at 1e6 m/s",
        ),
        case.StabilityStudy(
            name="gentlest-impact",
            title="Slowest ball that rebounds at h = 1e-3 s",
            configuration="plain",
            definition="a ball that touches the floor is on its way up after a step",
            study=gentlest_impact,
            unit="m/s",
            better="smaller",
            expected=(GENTLEST, 1.002 * GENTLEST),
            expected_source="the step that bounces also falls for one step: e v > g h; the search ends within a thousandth",
        ),
    ),
)
