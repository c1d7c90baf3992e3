"""Does a block rock from impact to impact as Housner's rule says?"""

from __future__ import annotations

import functools
import math
from dataclasses import replace
from typing import Any

import numpy as np

from spook_tracker import engine

from .. import case
from ..bracket import break_point
from ..closed_form import ask, error
from ..configurations import configured
from ..sweep import line, told

GRAVITY = 9.81  # m/s²
HALF_WIDTH, HALF_HEIGHT, DEPTH, MASS = 0.1, 0.4, 0.2, 10.0  # m, m, m, kg
TIME_STEP = 1.0 / 4000.0  # s
RADIUS = math.hypot(HALF_WIDTH, HALF_HEIGHT)  # m, from a corner to the centre
SLENDER = math.atan2(HALF_WIDTH, HALF_HEIGHT)  # rad, the lean at which it stands on its corner
RATE = math.sqrt(0.75 * GRAVITY / RADIUS)  # p, 1/s
START = 0.6 * SLENDER  # rad
COARSE = 1.0 / 60.0  # s, of a fall without a blow
SHORT, LAID, ARRIVING, ROCKED = 1e-5, 2e-4, 2.0, 5e-9  # s, rad, rad/s, rad: of a blow by itself
KEPT = 1.0 - 1.5 * math.sin(SLENDER) ** 2  # of the angular velocity at a blow

# Of the blow's impulses: across, m ω₋ h (1 − κ), and upwards, m ω₋ b (1 + κ), κ what is kept.
GRIP = 0.75 * math.sin(SLENDER) * math.cos(SLENDER) / (1.0 - 0.75 * math.sin(SLENDER) ** 2)


@functools.cache
def scene(
    lean: float = START, half_width: float = HALF_WIDTH, spin: float = 0.0, friction: float = 2.0
) -> engine.Scene:
    """The block leaning on its right lower edge, at rest or turning about it [rad/s]."""
    rough = engine.Material(friction=friction)
    ground = engine.RigidBody(
        name="ground", motion="static", shape=engine.Plane(), position=(0, 0, 0), material=rough
    )
    c, s = math.cos(lean), math.sin(lean)
    out, up = (
        HALF_HEIGHT * s - half_width * c,
        half_width * s + HALF_HEIGHT * c,
    )  # of the centre, from the edge
    block = engine.RigidBody(
        name="block",
        mass=MASS,
        shape=engine.Box((2 * half_width, DEPTH, 2 * HALF_HEIGHT)),
        position=(half_width + out, 0.0, up),
        orientation=(math.cos(0.5 * lean), 0.0, math.sin(0.5 * lean), 0.0),
        velocity=(spin * up, 0.0, -spin * out),
        angular_velocity=(0.0, spin, 0.0),
        material=rough,
    )
    return engine.Scene(bodies=(ground, block), gravity=(0.0, 0.0, -GRAVITY))


def energy(lean: float) -> float:
    """Of the block at rest at that lean, over that upright: m g R (cos(α − θ) − cos α), over m g R."""
    return math.cos(SLENDER - abs(lean)) - math.cos(SLENDER)


def speed(lean: float) -> float:
    """Angular velocity at the blow after a fall from that lean [rad/s]."""
    return RATE * math.sqrt(2.0 * energy(lean))


def quarter(lean: float) -> float:
    """Time from rest at that lean to the blow [s]: ∫ dθ/ω with θ = θ₀ (1 − u²), by Gauss."""
    nodes, weights = np.polynomial.legendre.leggauss(40)
    u = 0.5 * (nodes + 1.0)
    theta = lean * (1.0 - u * u)
    rate = RATE * np.sqrt(2.0 * (math.cos(SLENDER - lean) - np.cos(SLENDER - theta)))
    return float(np.sum(0.5 * weights * 2.0 * lean * u / rate))


@functools.cache
def next_lean() -> float:
    """The largest lean to the other side after the first blow [rad]: its energy is the square of what is kept."""
    low, high = 0.0, START
    for _ in range(100):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if energy(middle) < KEPT**2 * energy(START) else (low, middle)
    return low


DURATION = quarter(START) + 2.0 * quarter(next_lean()) + 0.1  # s, two blows


def whole(time_step: float) -> float:
    """Two blows, in whole steps [s]."""
    return round(DURATION / time_step) * time_step


def returns(simulate: case.Simulate, lean: float) -> bool:
    """Whether a block let go at that lean has come back by some of it after a second."""
    observe = {"q": engine.Final(quantity=engine.Orientation("block"))}
    result = simulate(scene(lean), time_step=COARSE, duration=1.0, observe=observe)
    return result.completed and 2.0 * math.atan2(result["q"][2], result["q"][0]) < lean


def farthest(simulate: case.Simulate) -> case.BreakPoint:
    """The largest lean from which it comes back."""
    return break_point(
        functools.partial(returns, simulate), 0.25 * SLENDER, 2.0 * SLENDER, resolution=1e-4, walk=5
    )


def rocks(simulate: case.Simulate, half_width: float) -> bool:
    """Whether a block that a slow turn sets down on its other edge leans over that one then."""
    observe = {"q": engine.Trace(quantity=engine.Orientation("block"))}
    asked = scene(LAID, half_width, -ARRIVING)
    result = simulate(asked, time_step=SHORT, steps=100, observe=observe)
    return result.completed and float(result["q"][:, 2].min()) < -ROCKED


def broadest(simulate: case.Simulate) -> case.BreakPoint:
    """The largest width over its height at which it rocks on."""
    found = break_point(
        functools.partial(rocks, simulate),
        0.5 * HALF_HEIGHT,
        4.0 * HALF_HEIGHT,
        resolution=1e-4,
        walk=4,
    )
    return replace(found, value=found.value / HALF_HEIGHT)


def grips(simulate: case.Simulate, friction: float) -> bool:
    """Whether the step of the same blow does not use friction up."""
    observe = {"f": engine.Trace(quantity=engine.ContactForce("block", "ground"))}
    asked = scene(LAID, spin=-ARRIVING, friction=friction)
    result = simulate(asked, time_step=SHORT, steps=50, observe=observe)
    if not result.completed:
        return False
    across, _, up = max(result["f"], key=lambda force: float(force[2]))
    return abs(float(across)) < (1.0 - 1e-6) * friction * float(up)


def smoothest(simulate: case.Simulate) -> case.BreakPoint:
    """The least friction with which the edge that comes down does not slip."""
    return break_point(functools.partial(grips, simulate), 4.0 * GRIP, 0.3 * GRIP, resolution=1e-4, walk=5)


def beside() -> float:
    """Of a blow's impulses in its step, as a part: the lean it may find, h ω₋ of α, and what gravity pushes meanwhile."""
    return SHORT * ARRIVING / SLENDER + SHORT * GRAVITY / (ARRIVING * HALF_WIDTH * (1.0 + KEPT))


def unseen() -> float:
    """How far below √2 of its height a block is so broad that it does not lean by `ROCKED`, or not within the step of its
    blow: ω₊ = (1 − (3/2) sin²α) ω₋ must pay for the lean, ω₊² = 2 p² sin α θ, for gravity's kick, h p² sin α, and for the
    corner's arm at a lean of h ω₋, 3 sin α cos α h ω₋². By b/h it falls by 3 √2/9 ω₋."""
    s, c = math.sqrt(2.0 / 3.0), math.sqrt(1.0 / 3.0)
    pull = 0.75 * GRAVITY / (HALF_HEIGHT / c) * s  # p² sin α
    lost = math.sqrt(2.0 * pull * ROCKED) + SHORT * pull + 3.0 * s * c * SHORT * ARRIVING**2
    return lost / ARRIVING / (math.sqrt(2.0) / 3.0)


def leans(simulate: case.Simulate, time_step: float, method: engine.Method = engine.PLAIN) -> Any:
    """The lean at every step [rad]."""
    observe = {"q": engine.Trace(quantity=engine.Orientation("block"))}
    q = simulate(scene(), time_step=time_step, duration=whole(time_step), method=method, observe=observe)["q"]
    return 2.0 * np.arctan2(q[:, 2], q[:, 0])


def blows(lean: Any, time_step: float) -> list[float]:
    """When it passes upright [s]."""
    found = np.flatnonzero(lean[:-1] * lean[1:] <= 0.0)
    kept = [k for i, k in enumerate(found) if i == 0 or k > found[i - 1] + 10]
    return [
        float(k + lean[k] / (lean[k] - lean[k + 1])) * time_step if lean[k] != lean[k + 1] else k * time_step
        for k in kept
    ]


def kept(lean: Any, time_step: float) -> float:
    """Energy at the largest lean to the other side, over that at the start."""
    return energy(float(-lean.min())) / energy(START)


def measure(simulate: case.Simulate) -> dict[str, float]:
    """The first blow and the swing after it."""
    lean = leans(simulate, TIME_STEP)
    times = [*blows(lean, TIME_STEP), math.nan, math.nan]  # an engine may lose a blow
    return {
        "kept_error": kept(lean, TIME_STEP) / KEPT**2 - 1.0,
        "first_blow_late": (times[0] - quarter(START)) / TIME_STEP,
        "swing_error": (times[1] - times[0]) / (2.0 * quarter(next_lean())) - 1.0,
    }


def blow_costs(kick: float, w: float) -> float:
    """First order in h of the energy that a blow at ω keeps [1/s]: what kicks in its step, `kick` times ω h, counts twice;
    the corner's arm is that at a lean of h ω, 6 ω sin α cos α over what is kept; and the step's own energy before and
    after is off by the kick."""
    s, c = math.sin(SLENDER), math.cos(SLENDER)
    return 2.0 * kick + 6.0 * w * s * c / KEPT + 2.0 * kick * (1.0 + 1.0 / KEPT)


def kept_limit(time_step: float) -> float:
    """Gravity kicks by h p² sin α."""
    w = speed(START)
    return time_step * blow_costs(RATE**2 * math.sin(SLENDER) / w, w)


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Relative error of the energy kept at the first blow."""
    return kept(leans(simulate, time_step, method), time_step) / KEPT**2 - 1.0


def draw(simulate: case.Simulate) -> case.Drawing:
    """The lean over time at three steps."""
    curves = []
    for steps in (250, 1000, 4000):
        lean = leans(simulate, 1.0 / steps)
        stride = max(1, steps // 250)
        curves.append(
            line(f"h = 1/{steps} s", np.arange(len(lean))[::stride] / steps, np.degrees(lean)[::stride])
        )
    blow = quarter(START)
    curves.append(
        line(
            "Housner",
            (0.0, blow, blow + quarter(next_lean())),
            (math.degrees(START), 0.0, -math.degrees(next_lean())),
            "points",
        )
    )
    return case.Drawing(curves=tuple(curves), x_label="time [s]", y_label="lean [°]")


TEST = case.ScalarTest(
    title="Rocking block",
    question="Does a block rock from impact to impact as Housner's rule says?",
    why="Columns and statues in earthquakes rock from corner to corner. The blow must act at the new corner alone: an "
    "engine that spreads it over both stops the block, one that lets it bounce never does.",
    model="A slender block leans on its lower edge on rough ground and is let go; plastic contact, no restitution.",
    parameters=(
        ("block", "0.2 × 0.2 × 0.8 m, 10 kg"),
        ("lean at the start", "0.6 of that at which it stands on its corner"),
        ("friction coefficient", "2"),
        ("gravity", "9.81 m/s²"),
        (
            "time step",
            f"1/4000 s, at which the energy that a blow keeps is {told(100.0 * kept_limit(TIME_STEP))} % off at most, of the "
            f"{told(100.0 * (1.0 - KEPT**2))} % that it takes; at 1/60 s {told(100.0 * kept_limit(1.0 / 60.0))} % would pass "
            "any blow",
        ),
    ),
    theory=(
        "About the new corner angular momentum is kept: ω₊/ω₋ = 1 − (3/2) sin²α, tan α = b/h (Housner 1963).",
        "The energy kept is the square of that; the swing from lean to lean follows from energy by quadrature.",
        "It falls over from a lean of α; a block of b/h = √2 or more does not rock on, for ω₊/ω₋ = 0.",
        "Its new edge slips with friction below 3 b h/(4 h² + b²).",
    ),
    reference="Angular momentum about the corner, and energy (closed form; times by quadrature).",
    conclusion="Green: the blow acts where it must. Red: impacts at two points at once are solved wrongly.",
    source="ours; G. Housner, The behavior of inverted pendulum structures during earthquakes, 1963",
    measurements=(
        ask(
            measure,
            (
                error(
                    "kept_error",
                    "energy after the first blow over Housner's, minus one",
                    "1",
                    kept_limit(TIME_STEP),
                    "first order in the step: gravity's kick and the lean in the step of the blow",
                ),
                error(
                    "first_blow_late",
                    "first blow, less the time by quadrature, in time steps",
                    "steps",
                    2.0,
                    "a start half a step off, and a blow found within one",
                    "companion",
                ),
                error(
                    "swing_error",
                    "time from blow to blow over that by quadrature, minus one",
                    "1",
                    2.0 * kept_limit(TIME_STEP) + 4.0 * TIME_STEP / (2.0 * quarter(next_lean())),
                    "a swing grows with its energy by less than twice in proportion, and two blows are each found within "
                    "two steps",
                    "companion",
                ),
            ),
            "from rest through two blows",
            TIME_STEP,
        ),
    ),
    example=lambda: case.Example(scene=scene(), time_step=1.0 / 240.0, duration=4.0),
    figures=(case.Figure(name="lean", title="A block that rocks", draw=draw),),
    stability=(
        case.StabilityStudy(
            name="farthest",
            title="Largest lean from which the block comes back",
            configuration="plain",
            definition="let go it leans less after a second than at the start",
            study=farthest,
            unit="rad",
            expected=(0.9998 * SLENDER, 1.0001 * SLENDER),
            expected_source="at tan α = b/h its centre is above the edge; the search ends within 1e-4",
        ),
        case.StabilityStudy(
            name="broadest",
            title="Largest width over height of a block that rocks on after its blow",
            configuration="plain",
            definition="set down at 2 rad/s it then leans over the other edge by 5e-9 rad; 1e-5 s",
            study=broadest,
            unit="1",
            expected=(math.sqrt(2.0) * (1.0 - 1.01e-4) - unseen(), math.sqrt(2.0) + unseen()),
            expected_source="Housner's rule turns no block on whose (3/2) sin²α is 1, b/h = √2; what of a lean is too small to be "
            "seen, and the search, which ends within 1e-4",
        ),
        case.StabilityStudy(
            name="smoothest",
            title="Least friction with which the edge that comes down does not slip",
            configuration="plain",
            definition="set down at 2 rad/s, the step that pushes most does not use friction up; 1e-5 s",
            study=smoothest,
            unit="1",
            better="smaller",
            expected=(GRIP * (1.0 - beside()), GRIP * (1.00011 + beside())),
            expected_source="the blow's impulses across and upwards, (1 − κ) h over (1 + κ) b with κ = 1 − (3/2) sin²α; what gravity "
            "and the lean in the step of the blow change, 3e-4, and the search, which ends within 1e-4",
        ),
    ),
    ladders=(
        case.Ladder(
            name="kept",
            description="relative error of the energy kept at the first blow, which falls on the middle of a step",
            unit="1",
            # The blow in the middle of a step: where in it changes the error by a factor.
            time_steps=tuple(quarter(START) / (n + 0.5) for n in (64, 128, 256, 512, 1024)),
            configurations=configured({"direct": 1.0, "iterative": 1.0}),
            error=ladder_error,
            target_error=1e-2,
            target_seconds=0.05,
        ),
    ),
)
