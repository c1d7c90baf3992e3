"""Does a die that is thrown tumble as Euler's equations have it, faster than a radian a step?"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable

import numpy as np
from scipy.integrate import solve_ivp

from spook_tracker import engine

from .. import case
from ..bracket import break_point
from ..closed_form import ask, error
from ..sweep import line, told

SIZE = (0.016, 0.012, 0.009)  # m
MASS = 2e-3  # kg
SPIN = (60.0, 50.0, 80.0)  # rad/s, in the axes of the die: 1.9 rad a step
VELOCITY, GRAVITY = (1.0, 0.5, 3.0), 9.81  # m/s, m/s²
TIME_STEP = 1.0 / 60.0  # s
DURATION = 0.6  # s, just before it comes down again


def scene(size: tuple[float, float, float] = SIZE, spin: tuple[float, float, float] = SPIN) -> engine.Scene:
    """The die as it leaves the hand."""
    die = engine.RigidBody(
        name="die",
        mass=MASS,
        shape=engine.Box(size),
        position=(0.0, 0.0, 0.0),
        velocity=VELOCITY,
        angular_velocity=spin,
    )
    return engine.Scene(bodies=(die,), gravity=(0.0, 0.0, -GRAVITY))


def moments() -> np.ndarray:
    """Of a uniform brick [kg m²]."""
    squares = np.array(SIZE) ** 2
    return np.asarray(MASS / 12.0 * (squares.sum() - squares))


def slope(_: float, state: np.ndarray) -> np.ndarray:
    """Euler's equations: change of spin and orientation (w, x, y, z)."""
    spin, scalar, vector = state[:3], state[3], state[4:]
    torque = np.cross(moments() * spin, spin)
    turn = 0.5 * (scalar * spin + np.cross(vector, spin))
    return np.concatenate([torque / moments(), [-0.5 * vector @ spin], turn])


def exact(times: Iterable[float]) -> np.ndarray:
    """Orientations (w, x, y, z) at rising times [s], shape (times, 4): Euler's equations integrated to rounding."""
    state, last, found = np.array([*SPIN, 1.0, 0.0, 0.0, 0.0]), 0.0, []
    for end in times:
        if end > last:
            solved = solve_ivp(slope, (last, end), state, method="DOP853", rtol=3e-14, atol=1e-15)
            state, last = solved.y[:, -1], end
        found.append(state[3:] / np.linalg.norm(state[3:]))
    return np.array(found)


@functools.cache
def landing() -> np.ndarray:
    """Orientation at the end."""
    return np.asarray(exact((DURATION,))[0])


def ladder_run(simulate: case.Simulate, time_step: float, method: engine.Method) -> engine.Result:
    """The throw with nothing observed."""
    return simulate(scene(), time_step=time_step, duration=DURATION, method=method)


def apart(result: engine.Result, right: np.ndarray) -> float:
    """The angle [rad] between where it points at the end and where it should."""
    turn = result.final_state["die"][3:7]
    return float(2.0 * np.linalg.norm(turn * np.sign(turn @ right) - right))


def turn_error(
    simulate: case.Simulate, time_step: float = TIME_STEP, method: engine.Method = engine.PLAIN
) -> float:
    """By how much it has turned wrongly at the end [rad]."""
    return apart(ladder_run(simulate, time_step, method), landing())


def fastest(simulate: case.Simulate) -> case.BreakPoint:
    """How many times as fast the die may spin and keep its energy."""
    parabola = MASS * GRAVITY * 0.5 * TIME_STEP * GRAVITY * DURATION  # J, of the step's own fall

    def keeps(times: float) -> bool:
        spin = np.array(SPIN) * times
        x, y, z = spin.tolist()
        observe = {"e": engine.MaximumAbsolute(quantity=engine.Energy(), from_start=True)}
        asked = scene(spin=(x, y, z))
        result = simulate(asked, time_step=TIME_STEP, duration=DURATION, observe=observe)
        return abs(float(result["e"]) - parabola) < 1e-9 * 0.5 * float(moments() @ spin**2)

    return break_point(keeps, 1.0, 1e4, resolution=0.1, walk=9)


def needle(thickness: float) -> np.ndarray:
    """Where a needle as long as the die and so thick [m] points at the end (w, x, y, z): it turns about its momentum at
    L/I, I across it, and about itself at what of its spin is not in that."""
    length, spin = SIZE[0], np.array(SPIN)
    across, along = (length**2 + thickness**2) / 12.0, thickness**2 / 6.0
    turn = np.array((along / across, 1.0, 1.0)) * spin
    half = 0.5 * DURATION * float(np.linalg.norm(turn))
    own = 0.5 * DURATION * (1.0 - along / across) * spin[0]
    w, (x, y, z) = math.cos(half), turn * math.sin(half) / np.linalg.norm(turn)
    c, s = math.cos(own), math.sin(own)
    return np.array((w * c - x * s, x * c + w * s, y * c + z * s, z * c - y * s))


def thinnest(simulate: case.Simulate) -> case.BreakPoint:
    """The thinnest needle [m] that turns rightly."""
    return break_point(functools.partial(turns, simulate), SIZE[1], 1e-8, resolution=0.05, walk=6)


# What a rounding of the momentum does to the spin about a needle itself, ε L/I₁, turns it wrongly for a step at least; at
# worst all steps' roundings add up and last until the end.
WRONG = 1e-10  # rad
ROUNDED = 2.0**-53 * math.hypot(*SPIN[1:]) * TIME_STEP  # rad, times I/I₁ = ½ (length/thickness)²
THIN = (
    SIZE[0] * math.sqrt(0.5 * ROUNDED / WRONG),
    SIZE[0] * math.sqrt(0.5 * (DURATION / TIME_STEP) ** 2 * ROUNDED / WRONG),
)


def turns(simulate: case.Simulate, thickness: float) -> bool:
    """Whether a needle of that thickness [m] has turned rightly."""
    asked = scene(size=(SIZE[0], thickness, thickness))
    result = simulate(asked, time_step=TIME_STEP, duration=DURATION)
    return result.completed and apart(result, needle(thickness)) < WRONG


def measure(simulate: case.Simulate) -> dict[str, float]:
    """One throw."""
    observe = {"e": engine.MaximumAbsolute(quantity=engine.Energy(), from_start=True)}
    result = simulate(scene(), time_step=TIME_STEP, duration=DURATION, observe=observe)
    # The step's parabola: v − h g in every step, and its energy with half a step's fall in it
    parabola = MASS * GRAVITY * 0.5 * TIME_STEP * GRAVITY * DURATION
    spinning = 0.5 * float(moments() @ np.array(SPIN) ** 2)
    return {
        "turn_error": turn_error(simulate),
        "energy_error": (float(result["e"]) - parabola) / spinning,
    }


def height(q: np.ndarray) -> np.ndarray:
    """Of the long axis' end, in half lengths, for orientations of shape (times, 4)."""
    return np.asarray(2.0 * (q[:, 1] * q[:, 3] - q[:, 0] * q[:, 2]))


def draw(simulate: case.Simulate) -> case.Drawing:
    """Where the die's long axis points."""
    observe = {"q": engine.Trace(quantity=engine.Orientation("die"))}
    result = simulate(scene(), time_step=TIME_STEP, duration=DURATION, observe=observe)
    q, times = result["q"], result.sample_times["q"]
    up = height(q)
    fine = np.linspace(0.0, DURATION, 151)
    curve, at_steps = height(exact(fine)), height(exact(times))
    off = float(np.max(np.abs(up - at_steps)))
    return case.Drawing(
        curves=(line("simulation", times, up, "points"), line("Euler's equations", fine, curve, "reference")),
        x_label="time [s]",
        y_label="height of the long axis' end [half lengths]",
        note=f"At the steps they are at most {told(off)} apart.",
    )


EXACT = "Euler's equations are solved to rounding in every step, whatever the body spins"

TEST = case.ScalarTest(
    title="Thrown die",
    question="Does a die that is thrown tumble as Euler's equations have it?",
    why="Dice, bolts and gravel are small, and what is small spins fast: more than a radian in a step of 1/60 s. Engines that "
    "refuse such spins, or slow them down, let nothing small be thrown.",
    model="An oblong die leaves the hand at 112 rad/s about no axis of its own and flies for 0.6 s.",
    parameters=(
        ("time step", f"1/60 s, in which it turns by {told(TIME_STEP * math.hypot(*SPIN))} rad"),
        ("die", "16 × 12 × 9 mm, 2 g"),
        ("spin", "(60, 50, 80) rad/s in its axes"),
        ("throw", "(1, 0.5, 3) m/s under 9.81 m/s²"),
    ),
    theory=("I dω/dt + ω × I ω = 0; gravity has no torque about the centre of mass.",),
    reference="Euler's equations, integrated to rounding.",
    conclusion="Green: small bodies tumble rightly. Red: spins are capped, or the turn of a step is wrong.",
    source="ours",
    measurements=(
        ask(
            measure,
            (
                error("turn_error", "angle by which it has turned wrongly after 0.6 s", "rad", 1e-10, EXACT),
                error(
                    "energy_error",
                    "largest change of the energy less what the step's parabola gives, over that of the spin",
                    "1",
                    1e-10,
                    EXACT + "; ½ m g h · g t of the fall is the symplectic step's",
                    "companion",
                ),
            ),
            "one throw",
            TIME_STEP,
        ),
    ),
    example=lambda: case.Example(scene=scene(), time_step=TIME_STEP, duration=DURATION),
    figures=(case.Figure(name="axis", title="Where the long axis points", draw=draw),),
    ladders=(
        case.Ladder(
            name="turn",
            description="angle by which it has turned wrongly after 0.6 s",
            unit="rad",
            time_steps=tuple(1.0 / n for n in (30, 60, 120, 240, 480)),
            configurations=(
                case.Configuration(name="plain", method=engine.PLAIN, expected_order=None),  # no step errs
                case.Configuration(
                    name="order4", method=engine.Method(composition="order4"), expected_order=None
                ),
            ),
            error=turn_error,
            target_error=1e-2,
            target_seconds=0.01,
        ),
    ),
    stability=(
        case.StabilityStudy(
            name="fastest",
            title="How many times as fast the die may spin at h = 1/60 s",
            configuration="plain",
            definition="energy kept to 1e-9 of that of the spin",
            study=fastest,
            unit="1",
            expected=(1e4, 1e4),
            expected_source="a turn has no limit; the search ends at 1e4, 18 600 radians a step",
        ),
        case.StabilityStudy(
            name="thinnest",
            title="Thinnest needle that turns as it must",
            configuration="plain",
            definition="after 0.6 s it has turned rightly to 1e-10 rad",
            study=thinnest,
            unit="m",
            better="smaller",
            expected=THIN,
            expected_source="a rounding of the momentum, 2^-53 L, is I/I₁ times as much of the spin about the needle: 1e-10 rad from one "
            "that lasts a step, and from those of all 36 steps that last to the end",
        ),
    ),
)
