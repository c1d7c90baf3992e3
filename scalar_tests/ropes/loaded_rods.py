"""How heavy a load can swing with its period on ten light rods?

A rod under a tension T turns back like a stiff spring, T l per radian. Frozen within a step that stiffness is stepped
explicitly; taken implicitly it bounds nothing.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.linalg import eigh

from spook_tracker import engine
from spook_tracker.engine.observe import Observable

from .. import case
from ..bracket import break_point, cell, is_stable, table
from ..sweep import line

STIFF = engine.Method(string_stiffness=True)
STIFF_HALF = engine.Method(string_stiffness=True, half_step_velocities=True)
RODS = 10
LENGTH, MASS = 1.0, 1.0  # m, kg
ACROSS = MASS * LENGTH**2 / 12.0  # kg m², of a thin rod about its centre
GRAVITY = 9.81  # m/s²
HEAVY, SOME = 1e6, 1e3  # kg
STIFFEST = 1e-18  # m/N, where the search ends
TILT = 0.01  # rad
ZIGZAG = 1e-9  # rad, left and right in turn: wakes the fastest mode
TIME_STEP = 1.0 / 60.0  # s
DURATION = 40.0  # s
LADDER_DURATION = 20.0  # s, three swings
MAP_SECONDS = 13.0  # two swings
MAP_LOADS = tuple(float(m) for m in np.geomspace(30.0, 3e8, 8))  # kg
MAP_STEPS = tuple(float(h) for h in np.geomspace(1.0 / 480.0, 0.1, 8))  # s

OBSERVE: dict[str, Observable] = {
    "load": engine.Trace(quantity=engine.Position("load")),
    "joint": engine.MaximumAbsolute(quantity=engine.Violation("joint 10")),
}


def _vector(values: npt.NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return (x, y, z)


def scene(load: float = HEAVY, compliance: float = 0.0) -> engine.Scene:
    """The rods in a row, TILT off the vertical, on ball joints; the load at the end, free to turn."""
    angles = [TILT + ZIGZAG * (-1) ** k for k in range(RODS)]
    ends = [np.zeros(3)]
    for angle in angles:
        ends.append(ends[-1] + LENGTH * np.array([math.sin(angle), 0.0, -math.cos(angle)]))
    bodies = [
        engine.RigidBody(
            name=f"rod {k}",
            mass=MASS,
            inertia=(ACROSS, ACROSS, 1e-3),
            position=_vector(0.5 * (ends[k] + ends[k + 1])),
            orientation=(math.cos(0.5 * angle), 0.0, -math.sin(0.5 * angle), 0.0),
        )
        for k, angle in enumerate(angles)
    ]
    bodies.append(
        engine.RigidBody(name="load", mass=load, inertia=(0.01 * load,) * 3, position=_vector(ends[-1]))
    )
    names = [engine.WORLD, *(body.name for body in bodies)]
    joints = tuple(
        engine.Ball(
            name=f"joint {k}", between=(names[k], names[k + 1]), at=_vector(ends[k]), compliance=compliance
        )
        for k in range(RODS + 1)
    )
    return engine.Scene(
        bodies=tuple(bodies), constraints=joints, gravity=(0.0, 0.0, -GRAVITY), contacts=False
    )


def rates(load: float) -> npt.NDArray[np.float64]:
    """Frequencies [rad/s] of small swings about the straight chain, lowest first: K θ = ω² M θ in the rods' angles."""
    mass = load * LENGTH**2 * np.ones((RODS, RODS)) + ACROSS * np.eye(RODS)
    for k in range(RODS):
        reach = np.where(np.arange(RODS) < k, LENGTH, np.where(np.arange(RODS) == k, 0.5 * LENGTH, 0.0))
        mass += MASS * np.outer(reach, reach)
    tension = GRAVITY * (load + MASS * (RODS - np.arange(RODS) - 0.5))  # N, at each rod's centre
    return np.asarray(np.sqrt(eigh(np.diag(tension * LENGTH), mass, eigvals_only=True)))


def period(load: float, time_step: float) -> float:
    """Of the slowest swing [s], as the step with implicit stiffness has it: phase 2 atan(h ω/2) a step; 1 + TILT²/16
    of it for the width of the swing."""
    return math.pi * time_step / math.atan(0.5 * time_step * rates(load)[0]) * (1.0 + TILT**2 / 16.0)


def measured_period(result: engine.Result) -> float:
    """Mean period [s] from the load's zero crossings; NaN with fewer than three."""
    time, place = result.sample_times["load"], result["load"][:, 0]
    crossing = np.nonzero((place[:-1] > 0.0) != (place[1:] > 0.0))[0]
    if len(crossing) < 3:
        return math.nan
    zero = time[crossing] - place[crossing] * result.time_step / (place[crossing + 1] - place[crossing])
    return float(2.0 * (zero[-1] - zero[0]) / (len(zero) - 1))


def swing(simulate: case.Simulate) -> dict[str, float]:
    """Period, width and joints under the heavy load."""
    result = simulate(scene(), time_step=TIME_STEP, duration=DURATION, method=STIFF, observe=OBSERVE)
    width = np.abs(result["load"][:, 0])
    span = round(7.0 / TIME_STEP)  # more than a period
    return {
        "period_error": measured_period(result) / period(HEAVY, TIME_STEP) - 1.0,
        "width_change": float(abs(width[-span:].max() / width[:span].max() - 1.0)),
        "joint_violation": float(result["joint"].max()),
    }


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """How far the load is from its swing at most [m], of 0.1 m."""
    observe = {"load": engine.Trace(quantity=engine.Position("load"))}
    result = simulate(scene(), time_step=time_step, duration=LADDER_DURATION, method=method, observe=observe)
    rate = rates(HEAVY)[0] / (1.0 + TILT**2 / 16.0)
    exact = RODS * LENGTH * math.sin(TILT) * np.cos(rate * result.sample_times["load"])
    return float(np.abs(result["load"][:, 0] - exact).max())


def _kind(
    simulate: case.Simulate,
    load: float,
    time_step: float,
    method: engine.Method,
    seconds: float,
    compliance: float = 0.0,
) -> str:
    """Stable while the load swings no wider than it started, beyond what a step's start offset adds."""
    observe = {"load": engine.Trace(quantity=engine.Position("load"))}
    built, steps = scene(load, compliance), round(seconds / time_step)
    result = simulate(built, time_step=time_step, steps=steps, method=method, observe=observe)
    start = RODS * LENGTH * TILT
    return cell(result, result.partial["load"][:, 0] / start, bound=1.1 + time_step * float(rates(load)[0]))


def heaviest(simulate: case.Simulate) -> case.BreakPoint:
    """Largest load [kg] of plain SPOOK at 1/60 s."""
    return break_point(
        lambda load: is_stable(_kind(simulate, load, TIME_STEP, engine.PLAIN, 20.0)),
        30.0,
        3e4,
        resolution=0.005,
        walk=9,
    )


def predicted_break(time_step: float = TIME_STEP) -> float:
    """Load [kg] at which h ω = 2 for the fastest mode, where an explicit step breaks."""
    low, high = 0.0, 1e9
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if time_step * rates(middle)[-1] < 2.0 else (low, middle)
    return low


def longest_step(simulate: case.Simulate) -> case.BreakPoint:
    """Longest time step [s] of plain SPOOK under SOME kilograms."""
    guess = 2.0 / float(rates(SOME)[-1])
    return break_point(
        lambda h: is_stable(_kind(simulate, SOME, h, engine.PLAIN, 20.0)),
        0.2 * guess,
        3.0 * guess,
        resolution=0.005,
        walk=9,
    )


def stiffest(simulate: case.Simulate) -> case.BreakPoint:
    """Smallest compliance [m/N] of the joints under the heavy load, its tension taken implicitly."""
    return break_point(
        lambda compliance: is_stable(_kind(simulate, HEAVY, TIME_STEP, STIFF, 20.0, compliance)),
        1e-12,
        STIFFEST,
        walk=7,
    )


def _explicit_growth(load: float, time_step: float) -> float:
    """Largest |eigenvalue| of symplectic Euler on the fastest mode."""
    half = 0.5 * (time_step * float(rates(load)[-1])) ** 2 - 1.0
    return 1.0 if half <= 1.0 else half + math.sqrt(half * half - 1.0)


def _map(method: engine.Method) -> Any:
    def study(simulate: case.Simulate) -> case.StabilityMap:
        return case.StabilityMap(
            x=MAP_LOADS,
            y=MAP_STEPS,
            cells=table(MAP_STEPS, MAP_LOADS, lambda m, h: _kind(simulate, m, h, method, MAP_SECONDS)),
            x_label="load [kg]",
            y_label="time step [s]",
            prediction=table(MAP_STEPS, MAP_LOADS, _explicit_growth),
            note="The prediction is the growth per step of the fastest mode when it is stepped explicitly.",
        )

    return study


def _draw(simulate: case.Simulate) -> case.Drawing:
    result = simulate(scene(), time_step=TIME_STEP, duration=20.0, method=STIFF, observe=OBSERVE)
    times = result.sample_times["load"]
    exact = RODS * LENGTH * TILT * np.cos(2.0 * math.pi * times / period(HEAVY, TIME_STEP))
    return case.Drawing(
        curves=(
            line("simulation", times[::6], result["load"][::6, 0]),
            line("exact", times[::6], exact[::6], "reference"),
        ),
        x_label="time [s]",
        y_label="load, sideways [m]",
    )


HOLDS = (
    "20 s (13 s in maps) without the load swinging wider than at the start, beyond 10 % and the step's start offset, "
    "or doubling in the last third; rods start 1e-9 rad left and right in turn"
)
TEST = case.ScalarTest(
    title="Loaded rods",
    question="How heavy a load can swing with its period on ten light rods?",
    why="Cranes, bridges and legs are light parts under heavy loads; there rigid-body engines tremble, or blow up.",
    model="Ten rods in a row on ball joints under a heavy load, let go 0.01 rad off the vertical.",
    parameters=(
        ("rods", "ten, 1 m, 1 kg"),
        ("load", "1e6 kg"),
        ("joints", "compliance 0"),
        ("time step", "1/60 s, 40 s"),
    ),
    theory=(
        "K θ = ω² M θ in the rods' angles, K = diag(T_k l).",
        "Stiffness taken at ¼(θ₊ + 2θ + θ₋): phase 2 atan(h ω/2) a step, stable for every load.",
        "Stiffness of the step's start: stable while h ω < 2, a load near m l/(3 g h²).",
    ),
    reference="Eigenvalues of the straight chain and the discrete map of one mode.",
    conclusion="Green: tension is carried however large. Red: the load changes its period, or the rods tremble.",
    source="ours; the rigid counterpart of the hanging chain",
    measurements=(
        case.Measurement(
            configuration="string",
            time_step=TIME_STEP,
            parameters={"N": RODS},
            metrics=(
                case.Metric(
                    name="period_error",
                    description="relative error of the mean period over 40 s",
                    unit="1",
                    role="gate",
                    limit=1e-6,
                    limit_source="the faster modes' share of the start, the rods' mass over the load's (1e-5), moves the "
                    "first and the last crossing; 12 half-swings of π lie between them",
                    reference=0.0,
                    tolerance=1e-9,
                ),
                case.Metric(
                    name="width_change",
                    description="|largest swing of the last 7 s over that of the first, less one|",
                    unit="1",
                    role="companion",
                    limit=7e-5,
                    limit_source="a crest between two samples is (h ω)²/8 = 3.4e-5 low, and the start's half step as much",
                    reference=0.0,
                    tolerance=1e-9,
                ),
                case.Metric(
                    name="joint_violation",
                    description="largest violation of the joint at the load",
                    unit="m",
                    role="companion",
                    limit=1.8e-8,
                    limit_source="r (1 − cos φ)(1 + 2θ)/2 = 1.70e-8 m at the lowest point: φ = 0.01 h ω, θ = 2, arm r = l/2",
                    reference=0.0,
                    tolerance=1e-12,
                ),
            ),
            measure=swing,
            note="Geometric stiffness treated implicitly.",
        ),
    ),
    example=lambda: case.Example(scene=scene(), time_step=TIME_STEP, method=STIFF),
    figures=(case.Figure(name="swing", title="The load sideways", draw=_draw),),
    ladders=(
        case.Ladder(
            name="place",
            description="load from its swing at most, in 20 s: the slowest mode, with its width in the period",
            unit="m",
            time_steps=tuple(1.0 / n for n in (15, 30, 60, 120, 240, 480)),
            configurations=(
                case.Configuration(
                    name="string", method=STIFF, expected_order=1.0, order_range=(1 / 480, 1 / 30)
                ),
                case.Configuration(
                    name="string, half-step",
                    method=STIFF_HALF,
                    expected_order=2.0,
                    order_range=(1 / 120, 1 / 15),  # beyond, the rods' share of the start, 1e-5 of it
                ),
            ),
            error=ladder_error,
            target_error=1e-3,
            target_seconds=0.01,
        ),
    ),
    stability=(
        case.StabilityStudy(
            name="heaviest-load-plain",
            title="Heaviest load of ten rods, plain SPOOK",
            configuration="plain",
            definition=HOLDS,
            study=heaviest,
            unit="kg",
            expected=(0.99 * predicted_break(), 1.01 * predicted_break()),
            expected_source="h ω = 2 for the fastest mode of ten rods",
        ),
        case.StabilityStudy(
            name="longest-step-plain",
            title="Longest time step of ten rods under 1000 kg, plain SPOOK",
            configuration="plain",
            definition=HOLDS,
            study=longest_step,
            unit="s",
            expected=(0.99 * 2.0 / float(rates(SOME)[-1]), 1.005 * 2.0 / float(rates(SOME)[-1])),
            expected_source="h ω = 2 for the fastest mode of ten rods, to the resolution of the search",
        ),
        case.StabilityStudy(
            name="smallest-compliance-string",
            title="Smallest compliance of the joints under 1e6 kg, string stiffness",
            configuration="string",
            definition=HOLDS,
            study=stiffest,
            unit="m/N",
            better="smaller",
            expected=(STIFFEST, STIFFEST),
            expected_source="rows of an open chain do not repeat each other: the system is regular at 0 as well, and a "
            "row's own map is stable for every compliance while τ > 0; the search ends at 1e-18",
        ),
        case.StabilityStudy(
            name="map-plain",
            title="Load and time step, plain SPOOK",
            configuration="plain",
            definition=HOLDS,
            study=_map(engine.PLAIN),
        ),
        case.StabilityStudy(
            name="map-string",
            title="Load and time step, string stiffness",
            configuration="string",
            definition=HOLDS,
            study=_map(STIFF),
        ),
    ),
)
