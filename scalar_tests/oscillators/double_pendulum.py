"""Does a double pendulum of two rods follow its equations, and does a free one keep its angular momentum?"""

from __future__ import annotations

import functools
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from spook_tracker import engine
from spook_tracker.engine.bodies import Body

from .. import case
from ..bracket import break_point
from ..sweep import line

HALF_STEP_CURVED = engine.Method(half_step_velocities=True, corrections=2)
ORDER_4, ORDER_6 = engine.Method(composition="order4"), engine.Method(composition="order6")
ORDER_8 = engine.Method(composition="order8")
LENGTH, MASS, GRAVITY = 1.0, 1.0, 9.81  # m, kg, m/s²
ACROSS, ALONG = MASS * LENGTH**2 / 12.0, 1e-3  # kg m²
TIME_STEP, DURATION = 1e-3, 2.0  # s: before the motion is chaotic enough to hide the order
HUNG_STEP, HUNG_STEPS, NUDGE = 1.0 / 60.0, 200, 1e-6  # s, rad/s: of the hanging pair that is nudged
HEAVIEST = 1e6  # times the upper rod, where the search for the lower one ends
FREE_STEP, FREE_STEPS = 1.0 / 60.0, 1200  # 20 s
ABOUT = ((0.0, 0.0, 0.0), (3.0, -2.0, 5.0), (-40.0, 7.0, 0.5))  # m
DRIFT = (0.3, -0.2, 0.5)  # m/s, of the free pair
TURN = (0.7, 2.0, -0.4)  # rad/s


def scene(time_step: float) -> engine.Scene:
    """Two level rods in a row from a hinge in the world at the origin, along x, at rest; both turn about y."""
    return engine.Scene(
        bodies=tuple(_rod(k) for k in (0, 1)),
        constraints=(
            _hinge(engine.WORLD, "rod 1", 0.0, time_step),
            _hinge("rod 1", "rod 2", LENGTH, time_step),
        ),
        gravity=(0.0, 0.0, -GRAVITY),
        contacts=False,
    )


def free_scene(time_step: float) -> engine.Scene:
    """The same pair without the world's hinge and gravity, drifting and turning as one body at the start."""
    rods: list[Body] = []
    for k in (0, 1):
        arm = ((k - 0.5) * LENGTH, 0.0, 0.0)
        x, y, z = (np.array(DRIFT) + np.cross(TURN, arm)).tolist()
        rods.append(_rod(k, velocity=(x, y, z), turn=TURN))
    hinge = _hinge("rod 1", "rod 2", LENGTH, time_step)
    return engine.Scene(bodies=tuple(rods), constraints=(hinge,), gravity=(0.0, 0.0, 0.0), contacts=False)


def _rod(k: int, velocity: Any = (0.0, 0.0, 0.0), turn: Any = (0.0, 0.0, 0.0)) -> engine.RigidBody:
    return engine.RigidBody(
        name=f"rod {k + 1}",
        mass=MASS,
        inertia=(ALONG, ACROSS, ACROSS),
        position=((k + 0.5) * LENGTH, 0.0, 0.0),
        velocity=velocity,
        angular_velocity=turn,
    )


def _hinge(first: str, second: str, x: float, time_step: float) -> engine.Hinge:
    return engine.Hinge(
        name=f"{first} to {second}",
        between=(first, second),
        at=(x, 0.0, 0.0),
        axis=(0.0, 1.0, 0.0),
        compliance=1e-13,
        damping=time_step,
    )


def hanging(time_step: float, heavier: float) -> engine.Scene:
    """The pair hangs straight down; the lower rod, so many times as heavy, is nudged by NUDGE about its hinge."""
    rods: list[Body] = [
        engine.RigidBody(
            name=f"rod {k + 1}",
            mass=mass * MASS,
            inertia=(mass * ACROSS, mass * ACROSS, mass * ALONG),
            position=(0.0, 0.0, -(k + 0.5) * LENGTH),
            velocity=(-0.5 * LENGTH * turn, 0.0, 0.0),
            angular_velocity=(0.0, turn, 0.0),
        )
        for k, (mass, turn) in enumerate(((1.0, 0.0), (heavier, NUDGE)))
    ]
    hinges = tuple(
        replace(_hinge(first, second, 0.0, time_step), at=(0.0, 0.0, -k * LENGTH))
        for k, (first, second) in enumerate(((engine.WORLD, "rod 1"), ("rod 1", "rod 2")))
    )
    return engine.Scene(bodies=tuple(rods), constraints=hinges, gravity=(0.0, 0.0, -GRAVITY), contacts=False)


def fastest_rate(heavier: float) -> float:
    """ω [rad/s] of the hanging pair's faster mode: M θ̈ = −K θ in the rods' angles from the vertical."""
    mass = [[1.0 / 3.0 + heavier, 0.5 * heavier], [0.5 * heavier, heavier / 3.0]]
    pull = GRAVITY / LENGTH * np.diag([0.5 + heavier, 0.5 * heavier])
    return float(np.sqrt(np.linalg.eigvals(np.linalg.solve(mass, pull)).real.max()))


@functools.cache
def exact(times: tuple[float, ...]) -> np.ndarray:
    """(time, 2): angles [rad] from level, downwards, of both rods: Lagrange's equations by DOP853 at 1e-12.

    With c, s of θ₁ − θ₂, in units of m l²:  ⁴⁄₃ θ̈₁ + ½ c θ̈₂ = 3/2 (g/l) cos θ₁ − ½ s θ̇₂²,
    ½ c θ̈₁ + ⅓ θ̈₂ = ½ (g/l) cos θ₂ + ½ s θ̇₁².
    """

    def slopes(_: float, state: np.ndarray) -> np.ndarray:
        first, second, rate, other = state
        c, s = np.cos(first - second), np.sin(first - second)
        push = [
            1.5 * GRAVITY / LENGTH * np.cos(first) - 0.5 * s * other**2,
            0.5 * GRAVITY / LENGTH * np.cos(second) + 0.5 * s * rate**2,
        ]
        return np.concatenate(
            [[rate, other], np.linalg.solve([[4.0 / 3.0, 0.5 * c], [0.5 * c, 1.0 / 3.0]], push)]
        )

    found = solve_ivp(slopes, (0.0, times[-1]), np.zeros(4), "DOP853", times, rtol=1e-12, atol=1e-12)
    return np.asarray(found.y[:2].T)


def angles(simulate: case.Simulate, time_step: float, method: engine.Method) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and (time, 2) angles [rad] from level, downwards."""
    hinges = {"first": f"{engine.WORLD} to rod 1", "second": "rod 1 to rod 2"}
    observe = {name: engine.Trace(quantity=engine.JointCoordinate(hinge)) for name, hinge in hinges.items()}
    result = simulate(
        scene(time_step), time_step=time_step, duration=DURATION, method=method, observe=observe
    )
    first = result["first"]
    return result.sample_times["first"], np.stack([first, first + result["second"]], axis=1)


def error_after_a_second(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Largest |angle − exact angle| of both rods after 1 s [rad]; the largest on the way jumps from swing to swing."""
    times, found = angles(simulate, time_step, method)
    second = round(1.0 / time_step)
    return float(np.abs(found[second] - exact(tuple(times.tolist()))[second]).max())


def angle_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Largest |angle − exact angle| of both rods over 2 s [rad]."""
    times, found = angles(simulate, time_step, method)
    return float(np.abs(found - exact(tuple(times.tolist()))).max())


def swings(simulate: case.Simulate) -> dict[str, float]:
    """Angles against the tight integration."""
    return {"angle_error": angle_error(simulate, TIME_STEP, engine.PLAIN)}


def keeps_turning(simulate: case.Simulate) -> dict[str, float]:
    """Drift of the free pair's angular momentum about three points, over its size about each."""
    observe = {
        f"{name} {i}": engine.MaximumAbsolute(
            quantity=engine.AngularMomentum(about), from_start=name == "drift"
        )
        for i, about in enumerate(ABOUT)
        for name in ("drift", "size")
    }
    result = simulate(free_scene(FREE_STEP), time_step=FREE_STEP, steps=FREE_STEPS, observe=observe)
    drifts = [
        np.abs(result[f"drift {i}"]).max() / np.linalg.norm(result[f"size {i}"]) for i in range(len(ABOUT))
    ]
    return {"angular_momentum_drift": float(max(drifts))}


def hangs(simulate: case.Simulate, time_step: float, heavier: float = 1.0) -> bool:
    """Whether the nudged pair swings no wider than a hundred times what the nudge turns in a step, for HUNG_STEPS."""
    observe = {"turn": engine.MaximumAbsolute(quantity=engine.JointCoordinate("rod 1 to rod 2"))}
    result = simulate(hanging(time_step, heavier), time_step=time_step, steps=HUNG_STEPS, observe=observe)
    return result.completed and float(result["turn"]) < 100.0 * time_step * NUDGE


def longest_step(simulate: case.Simulate) -> case.BreakPoint:
    """The longest step [s] in which the hanging pair stays."""
    return break_point(functools.partial(hangs, simulate), 0.02, 2.0, resolution=2e-3, walk=5)


def heaviest(simulate: case.Simulate) -> case.BreakPoint:
    """The heaviest lower rod, over the upper one, that stays at HUNG_STEP."""
    holds = functools.partial(hangs, simulate, HUNG_STEP)
    return break_point(holds, 1.0, HEAVIEST, walk=7)


def draw(simulate: case.Simulate) -> case.Drawing:
    """Both angles against time."""
    times, found = angles(simulate, TIME_STEP, engine.PLAIN)
    times, found = times[::20], found[::20]
    right = exact(tuple(times.tolist()))
    return case.Drawing(
        curves=(
            line("first rod", times, np.degrees(found[:, 0])),
            line("second rod", times, np.degrees(found[:, 1])),
            line("first, exact", times, np.degrees(right[:, 0]), "reference"),
            line("second, exact", times, np.degrees(right[:, 1]), "reference"),
        ),
        x_label="time [s]",
        y_label="angle below level [degrees]",
    )


HANGS = "nudged by 1e-6 rad/s the lower rod turns by no more than a hundred times what that is in a step, in 200 steps"
TEST = case.ScalarTest(
    title="Double pendulum of rods",
    question="Does a double pendulum of two rods follow its equations of motion?",
    why="Two hinged bodies are the smallest scene where rotation, joints and gravity all couple, and its path forgets "
    "nothing: every error of the step shows in the angles. A free pair must keep its angular momentum about any point.",
    model="Two uniform rods of 1 kg and 1 m in a level row from a hinge in the world, let go at rest; and the pair "
    "without world and gravity, drifting and turning, for 20 s.",
    parameters=(
        ("time step", "1e-3 s; ladder 1/60 to 1/4000 s; free pair 1/60 s"),
        ("rods", "1 kg, 1 m, 1/12 kg m² across"),
        ("gravity", "9.81 m/s²"),
        ("hinges", "compliance 1e-13, damping one time step"),
        ("duration", "2 s; free pair 20 s"),
    ),
    theory=(
        "⁴⁄₃ θ̈₁ + ½ cos(θ₁ − θ₂) θ̈₂ = 3/2 (g/l) cos θ₁ − ½ sin(θ₁ − θ₂) θ̇₂²",
        "½ cos(θ₁ − θ₂) θ̈₁ + ⅓ θ̈₂ = ½ (g/l) cos θ₂ + ½ sin(θ₁ − θ₂) θ̇₁²",
        "A velocity half a step old starts it half a step early: θ is off by ½ h θ̇ to first order.",
    ),
    reference="Lagrange's equations by DOP853 at 1e-12; conservation of angular momentum about each of three points.",
    conclusion="Green: coupled bodies move as they should. Red: a torque, a lever or an inertia is wrong in the joint.",
    source="ours; the multibody library's method of reference",
    measurements=(
        case.Measurement(
            configuration="plain",
            time_step=TIME_STEP,
            metrics=(
                case.Metric(
                    name="angle_error",
                    description="largest |angle − exact| of both rods over 2 s",
                    unit="rad",
                    role="gate",
                    limit=6.83e-3,
                    limit_source="velocities live half a step early, which puts the angles off by ½ h θ̇: 6.82e-3 where the second rod is fastest",
                    reference=0.0,
                    relative_tolerance=1e-6,
                ),
            ),
            measure=swings,
            note="the SPOOK step as it stands",
        ),
        case.Measurement(
            configuration="free",
            time_step=FREE_STEP,
            metrics=(
                case.Metric(
                    name="angular_momentum_drift",
                    description="largest |L − L₀| over |L| about three points, the worst",
                    unit="1",
                    role="gate",
                    limit=1e-12,
                    limit_source="a hinge pushes both rods alike at one point; rounding of 1200 steps, 2e-16 each, adds up to 2.4e-13",
                    reference=0.0,
                    tolerance=1e-13,
                ),
            ),
            measure=keeps_turning,
            note="the pair alone in space, plain SPOOK",
        ),
    ),
    example=lambda: case.Example(scene=scene(TIME_STEP), time_step=TIME_STEP),
    figures=(case.Figure(name="angles", title="Angles of both rods", draw=draw),),
    ladders=(
        case.Ladder(
            name="angle",
            description="largest angle error of both rods over 2 s against the tight integration",
            unit="rad",
            time_steps=tuple(1.0 / n for n in (60, 120, 250, 500, 1000, 2000, 4000)),
            configurations=(
                case.Configuration(
                    name="plain", method=engine.PLAIN, expected_order=1.0, order_range=(1 / 4000, 1 / 500)
                ),
                case.Configuration(
                    name="half-step, curved twice",
                    method=HALF_STEP_CURVED,
                    expected_order=2.0,
                    order_range=(1 / 4000, 1 / 250),
                ),
                case.Configuration(
                    name="order 4", method=ORDER_4, expected_order=4.0, order_range=(1 / 500, 1 / 60)
                ),
                case.Configuration(
                    name="order 6", method=ORDER_6, expected_order=6.0, order_range=(1 / 250, 1 / 60)
                ),
                case.Configuration(name="order 8", method=ORDER_8, expected_order=None),
            ),
            error=angle_error,
            target_error=0.02,
            target_seconds=0.02,
        ),
        case.Ladder(
            name="high-order",
            description="angle error of both rods after 1 s against the tight integration",
            unit="rad",
            time_steps=tuple(1.0 / n for n in (40, 50, 60, 80)),
            configurations=tuple(
                case.Configuration(name=name, method=method, expected_order=order)
                for name, method, order in (
                    ("order4", ORDER_4, 4.0),
                    ("order6", ORDER_6, 6.0),
                    ("order8", ORDER_8, 8.0),
                )
            ),
            error=error_after_a_second,
            run=case.Unobserved(angle_error),
            target_error=1e-4,
            target_seconds=0.01,
        ),
    ),
    stability=(
        case.StabilityStudy(
            name="longest-step",
            title="Longest step in which the hanging pair stays",
            configuration="plain",
            definition=HANGS,
            study=longest_step,
            unit="s",
            expected=(0.996 * 2.0 / fastest_rate(1.0), 1.002 * 2.0 / fastest_rate(1.0)),
            expected_source="gravity is taken where a step begins: stable while h ω < 2 for the faster mode; to the resolution of "
            "the search, and what 200 steps tell",
        ),
        case.StabilityStudy(
            name="heaviest-below",
            title="Heaviest lower rod, over the upper one, that hangs still at h = 1/60 s",
            configuration="plain",
            definition=HANGS,
            study=heaviest,
            unit="1",
            expected=(HEAVIEST, HEAVIEST),
            expected_source="both modes stay slow however heavy the lower rod, h ω = 0.16 and less: the upper one is a string to it; "
            "the search ends at a ratio of 1e6",
        ),
    ),
)
