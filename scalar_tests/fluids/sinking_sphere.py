"""Does a sphere sink at its terminal speed, and does a pendulum under water swing as its lost weight says?"""

from __future__ import annotations

import functools
import math
from dataclasses import replace
from typing import Any

import numpy as np

from spook_tracker import engine

from .. import case
from ..bracket import break_point
from ..configurations import configured
from ..sweep import line, told
from .floating_box import period

GRAVITY = 9.81  # m/s²
WATER, STONE = 1000.0, 2500.0  # kg/m³
RADIUS = 0.1  # m
DRAG = 0.47  # C_d, stated: of a sphere at Reynolds numbers of 1e4 to 1e5
TIME_STEP = 1.0 / 60.0  # s
DURATION = 10.0  # s
ROD = 1.0  # m, from the pivot to the sphere's centre
SWING = 1e-3  # rad
VOLUME = 4.0 / 3.0 * math.pi * RADIUS**3
MASS = STONE * VOLUME
PULL = (1.0 - WATER / STONE) * GRAVITY  # m/s², what is left of gravity
RESISTANCE = 0.5 * WATER * DRAG * math.pi * RADIUS**2 / MASS  # 1/m, drag over mass and speed²
TERMINAL = math.sqrt(PULL / RESISTANCE)  # m/s
RISE = TERMINAL / PULL  # s: v = v_t tanh(t/RISE)
# The pendulum: (m L² + ⅖ m r²) φ'' = −(m − ρ V) g L φ.
SWING_RATE = math.sqrt(PULL * ROD / (ROD**2 + 0.4 * RADIUS**2))  # rad/s


def sinking(speed: float = 0.0) -> engine.Scene:
    """A stone under water, moving down with `speed` [m/s]."""
    stone = engine.RigidBody(
        name="stone",
        mass=MASS,
        shape=engine.Sphere(RADIUS),
        position=(0.0, 0.0, 0.0),
        velocity=(0.0, 0.0, -speed),
    )
    water = engine.Fluid(name="water", density=WATER, drag_coefficient=DRAG)
    return engine.Scene(bodies=(stone,), forces=(water,), gravity=(0.0, 0.0, -GRAVITY))


def swinging() -> engine.Scene:
    """The stone on a light rod, out by 1 mrad, in water without drag."""
    stone = engine.RigidBody(
        name="stone",
        mass=MASS,
        shape=engine.Sphere(RADIUS),
        position=(ROD * math.sin(SWING), 0.0, -ROD * math.cos(SWING)),
    )
    pivot = engine.Hinge(
        name="pivot",
        between=(engine.WORLD, "stone"),
        at=(0.0, 0.0, 0.0),
        axis=(0.0, -1.0, 0.0),
        compliance=0.0,
    )
    water = engine.Fluid(name="water", density=WATER)
    return engine.Scene(bodies=(stone,), constraints=(pivot,), forces=(water,), gravity=(0.0, 0.0, -GRAVITY))


def sink(simulate: case.Simulate) -> dict[str, float]:
    """Speeds at every step."""
    observe = {"v": engine.Trace(quantity=engine.Velocity("stone"))}
    result = simulate(sinking(), time_step=TIME_STEP, duration=DURATION, observe=observe)
    down = -result["v"][:, 2]
    v, discrete = 0.0, [0.0]
    for _ in range(len(down) - 1):
        v += TIME_STEP * (PULL - RESISTANCE * v * v)
        discrete.append(v)
    return {
        "terminal_error": float(down[-1]) / TERMINAL - 1.0,
        "speed_error": float(np.abs(down - discrete).max()),
        "sideways": float(np.abs(result["v"][:, :2]).max()),
    }


def swing(simulate: case.Simulate) -> dict[str, float]:
    """The period under water."""
    observe = {"angle": engine.Trace(quantity=engine.JointCoordinate("pivot"))}
    result = simulate(swinging(), time_step=TIME_STEP, duration=60.0, observe=observe)
    angle = result["angle"] + SWING
    return {"swing_error": period(result.sample_times["angle"], angle) * SWING_RATE / (2.0 * math.pi) - 1.0}


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Speed at half a second against v_t tanh(t/τ) [m/s]."""
    observe = {"v": engine.Final(quantity=engine.Velocity("stone"))}
    result = simulate(sinking(), time_step=time_step, duration=0.5, method=method, observe=observe)
    return -float(result["v"][2]) - TERMINAL * math.tanh(0.5 / RISE)


def stable(simulate: case.Simulate, time_step: float) -> bool:
    """Whether a stone at its terminal speed, off by 1 %, comes nearer to it in 40 steps."""
    observe = {"v": engine.Final(quantity=engine.Velocity("stone"))}
    result = simulate(sinking(1.01 * TERMINAL), time_step=time_step, steps=40, observe=observe)
    if not result.completed:
        return False
    return abs(-float(result["v"][2]) / TERMINAL - 1.0) < 0.01


def largest_step(simulate: case.Simulate) -> case.BreakPoint:
    """Where that ends, walking from a quarter of τ to four times τ."""
    return break_point(lambda time_step: stable(simulate, time_step), 0.25 * RISE, 4.0 * RISE)


def draw(simulate: case.Simulate) -> case.Drawing:
    """Speed against time, from rest and from too fast."""
    curves, ends = [], []
    apart = 0.0
    for start in (0.0, 2.0 * TERMINAL):
        observe = {"v": engine.Trace(quantity=engine.Velocity("stone"))}
        result = simulate(sinking(start), time_step=TIME_STEP, duration=2.0, observe=observe)
        time, down = result.sample_times["v"], -result["v"][:, 2]
        curves.append(line(f"from {told(start, 3)} m/s", time, down))
        ends.append(float(down[-1]))
        if start == 0.0:
            exact: Any = TERMINAL * np.tanh(time / RISE)
            curves.append(line("v_t tanh(t/τ)", time, exact, "reference"))
            apart = float(np.abs(down - exact).max())
    return case.Drawing(
        curves=tuple(curves),
        x_label="time [s]",
        y_label="speed downwards [m/s]",
        note=f"They come to {told(ends[0], 4)} m/s and {told(ends[1], 4)} m/s, {told(TERMINAL, 4)} in closed form; from rest the "
        f"speed is at most {told(apart, 2)} m/s off.",
    )


def sinks(simulate: case.Simulate, density: float) -> bool:
    """Whether a sphere of that density [kg/m³] goes down."""
    stone = replace(sinking().bodies[0], mass=density * VOLUME)
    observe = {"v": engine.Final(quantity=engine.Velocity("stone"))}
    result = simulate(replace(sinking(), bodies=(stone,)), time_step=TIME_STEP, steps=10, observe=observe)
    return result.completed and float(result["v"][2]) < 0.0


def lightest(simulate: case.Simulate) -> case.BreakPoint:
    """The lightest sphere [kg/m³] that sinks."""
    return break_point(functools.partial(sinks, simulate), STONE, 0.1 * WATER, resolution=1e-4, walk=6)


TEST = case.ScalarTest(
    title="Sinking sphere",
    question="Does a stone move under water as drag and buoyancy say?",
    why="Drag and buoyancy decide how fast things fall through a fluid. The terminal speed is exact for every time "
    "step, so whatever differs from it is a fault of the force.",
    model="A stone ball of 0.1 m radius sinks from rest in deep still water with quadratic drag of C_d = 0.47. The same "
    "ball swings by 1 mrad on a light rod of 1 m under water without drag. No water moves along (no added mass).",
    parameters=(
        ("time step", "1/60 s"),
        ("ball", "radius 0.1 m, 2500 kg/m³"),
        ("water", "1000 kg/m³, C_d = 0.47 on π r²"),
        ("gravity", "9.81 m/s²"),
    ),
    theory=(
        "m v' = (m − ρ V) g − ½ ρ C_d π r² v²: v = v_t tanh(t/τ), v_t = √(2 (m − ρ V) g/(ρ C_d π r²)), τ = v_t/((1 − ρ/ρ_s) g).",
        "One step: v₊ = v + h (v_t² − v²)/(v_t τ). Its fixed point is v_t for every h; it is stable for h < τ.",
        "Pendulum: ω² = (1 − ρ/ρ_s) g L/(L² + ⅖ r²); the discrete period is shorter by (h ω)²/24.",
    ),
    reference="Closed forms; the recursion of one step.",
    conclusion="Green: drag and buoyancy are right, and act at the centre. Red: the area, the coefficient, the density or "
    "the power of the speed is wrong.",
    source="ours; buoyancy is asked for in the thesis, section 5.4",
    measurements=(
        case.Measurement(
            configuration="plain",
            time_step=TIME_STEP,
            metrics=(
                case.Metric(
                    name="terminal_error",
                    description="speed after 10 s over √(2 (m − ρ V) g/(ρ C_d A)), minus one",
                    unit="1",
                    role="gate",
                    limit=1e-12,
                    limit_source="v_t is the fixed point of the discrete step; each step shrinks the rest by "
                    "1 − 2 h/τ = .93, 600 steps to nothing",
                    reference=0.0,
                    tolerance=1e-14,
                ),
                case.Metric(
                    name="speed_error",
                    description="largest difference to the recursion of one step in 10 s",
                    unit="m/s",
                    role="companion",
                    limit=1e-12,
                    limit_source="the same sums in another order",
                    reference=0.0,
                    tolerance=1e-14,
                ),
                case.Metric(
                    name="sideways",
                    description="largest speed across",
                    unit="m/s",
                    role="companion",
                    limit=1e-15,
                    limit_source="nothing pushes the stone aside",
                    reference=0.0,
                    tolerance=1e-15,
                ),
            ),
            measure=sink,
            note="sinking with quadratic drag",
        ),
        case.Measurement(
            configuration="pendulum",
            time_step=TIME_STEP,
            metrics=(
                case.Metric(
                    name="swing_error",
                    description="period of the pendulum under water over its closed form, minus one",
                    unit="1",
                    role="gate",
                    limit=1e-4,
                    limit_source="(h ω)²/24 = 6.8e-5; without the buoyancy it would be −0.23",
                    reference=0.0,
                    relative_tolerance=1e-4,
                ),
            ),
            measure=swing,
            note="no drag, 60 s of a small swing",
        ),
    ),
    example=lambda: case.Example(scene=sinking(), time_step=TIME_STEP, duration=2.0),
    stability=(
        case.StabilityStudy(
            name="time-step",
            title="Largest time step of a stone that sinks",
            configuration="plain",
            definition="1 % off its terminal speed, the stone is nearer to it after 40 steps",
            study=largest_step,
            unit="s",
            expected=(0.98 * RISE, 1.02 * RISE),
            expected_source="the slope of the map of one step at v_t is 1 − 2 h/τ: stable for h < τ = 0.491 s",
        ),
        case.StabilityStudy(
            name="lightest",
            title="Lightest sphere that sinks",
            configuration="plain",
            definition="it goes down from rest",
            study=lightest,
            unit="kg/m³",
            better="smaller",
            expected=(WATER, 1.0001 * WATER),
            expected_source="Archimedes: one as dense as the water stays; to the resolution of the search",
        ),
    ),
    figures=(case.Figure(name="speed", title="Speed against time", draw=draw),),
    ladders=(
        case.Ladder(
            name="speed",
            description="speed after 0.5 s against v_t tanh(t/τ)",
            unit="m/s",
            time_steps=tuple(1.0 / n for n in (30, 60, 120, 240, 480, 960)),
            configurations=configured({"plain": 1.0, "half-step": 1.0}, (1 / 960, 1 / 240)),
            error=ladder_error,
            target_error=0.02,
            target_seconds=0.01,
        ),
    ),
)
