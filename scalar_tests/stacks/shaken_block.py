"""Does a block on a shaken floor rock as Housner's equations say until it falls over?"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from spook_tracker import engine

from .. import case
from ..bracket import break_point
from ..closed_form import ask, error
from ..configurations import configured
from ..sweep import line, told
from .rocking_block import (
    DEPTH,
    GRAVITY,
    HALF_HEIGHT,
    HALF_WIDTH,
    KEPT,
    MASS,
    RATE,
    SLENDER,
    blow_costs,
    blows,
)

UPLIFT = (
    GRAVITY * HALF_WIDTH / HALF_HEIGHT
)  # m/s², from which on the floor leaves the block behind on one edge
SHAKE, FREQUENCY = 1.5, 2.0  # times that, Hz
PULSE = 1.5  # Hz, of the half sine that throws it over
KNOTS = 400  # of the table that says so
TIME_STEP = 1.0 / 4000.0  # s
COARSE = 1.0 / 60.0  # s, of the study: no blow before the block falls
DURATION = 0.9  # s: a blow and the swing after it
FALLS = 1.6  # s
FINE = 1.0 / 500.0  # s, of the integration


def scene(
    pace: engine.Sinusoid | engine.Table, strength: float, frequency: float, friction: float = 2.0
) -> engine.Scene:
    """The block upright at rest; the floor's speed is the pace times that of (strength × UPLIFT) sin(2π frequency t)."""
    rough = engine.Material(friction=friction)
    floor = engine.RigidBody(
        name="floor",
        motion="kinematic",
        shape=engine.Plane(),
        position=(0, 0, 0),
        velocity=(strength * UPLIFT / (2.0 * math.pi * frequency), 0.0, 0.0),
        pace=pace,
        material=rough,
    )
    block = engine.RigidBody(
        name="block",
        mass=MASS,
        shape=engine.Box((2 * HALF_WIDTH, DEPTH, 2 * HALF_HEIGHT)),
        position=(0.0, 0.0, HALF_HEIGHT),
        material=rough,
    )
    return engine.Scene(bodies=(floor, block), gravity=(0.0, 0.0, -GRAVITY))


@functools.cache
def shaken() -> engine.Scene:
    """On and on: the speed is 1 − cos of the acceleration's sine."""
    pace = engine.Sinusoid(amplitude=-1.0, frequency=FREQUENCY, phase=0.5 * math.pi, offset=1.0)
    return scene(pace, SHAKE, FREQUENCY)


def struck(strength: float, friction: float = 2.0) -> engine.Scene:
    """By one half sine; then the floor goes on steadily."""
    times = [0.5 / PULSE * k / KNOTS for k in range(KNOTS + 1)]
    pace = engine.Table(tuple(times), tuple(1.0 - math.cos(2.0 * math.pi * PULSE * t) for t in times))
    return scene(pace, strength, PULSE, friction)


@dataclass(frozen=True)
class Rocking:
    """What the integration finds."""

    before: float  # rad, largest lean before the first blow
    turned: float  # s, when
    blow: float  # s
    speed: float  # rad/s, into it
    after: float  # rad, largest lean after it
    returned: float  # s, when


def pull(side: float, lean: float, time: float) -> float:
    """Angular acceleration on the edge of that side: p² (−side sin(α − |θ|) − a/g cos(α − |θ|))."""
    ground = SHAKE * UPLIFT / GRAVITY * math.sin(2.0 * math.pi * FREQUENCY * time)
    apart = SLENDER - side * lean
    return RATE**2 * (-side * math.sin(apart) - ground * math.cos(apart))


def stepped(side: float, lean: float, speed: float, time: float, h: float) -> tuple[float, float]:
    """One step of Runge and Kutta."""
    k1, m1 = speed, pull(side, lean, time)
    k2, m2 = speed + 0.5 * h * m1, pull(side, lean + 0.5 * h * k1, time + 0.5 * h)
    k3, m3 = speed + 0.5 * h * m2, pull(side, lean + 0.5 * h * k2, time + 0.5 * h)
    k4, m4 = speed + h * m3, pull(side, lean + h * k3, time + h)
    return lean + h / 6.0 * (k1 + 2 * k2 + 2 * k3 + k4), speed + h / 6.0 * (m1 + 2 * m2 + 2 * m3 + m4)


def until(turns: int, side: float, lean: float, speed: float, time: float) -> tuple[float, float, float]:
    """On to the event: the block passes upright (turns = 0) or stops (turns = 1). Lean, speed, time there, by halving the
    last step."""
    while True:
        then = stepped(side, lean, speed, time, FINE)
        if (side * then[0] < 0.0) if turns == 0 else (side * then[1] < 0.0 < side * speed):
            break
        lean, speed, time = *then, time + FINE
    low, high = 0.0, FINE
    for _ in range(60):
        middle = 0.5 * (low + high)
        then = stepped(side, lean, speed, time, middle)
        low, high = (low, middle) if side * then[turns] < 0.0 else (middle, high)
    return (*stepped(side, lean, speed, time, low), time + low)


@functools.cache
def rocking(kept: float = KEPT, late: float = 0.0, delay: float = 0.0) -> Rocking:
    """Uplift, swing, blow and the swing after it, each located. `kept` of the speed at the blow; the uplift `late` and the
    blow `delay` [s] behind."""
    start = math.asin(1.0 / SHAKE) / (2.0 * math.pi * FREQUENCY)
    before, speed, turned = until(1, -1.0, 0.0, -1e-14, start + late)
    _, speed, blow = until(0, -1.0, before, speed, turned)
    after, _, returned = until(1, 1.0, 0.0, kept * speed, blow + delay)
    return Rocking(before, turned, blow, speed, after, returned)


def leans(simulate: case.Simulate, time_step: float, method: engine.Method = engine.PLAIN) -> Any:
    """The lean at every step [rad]."""
    observe = {"q": engine.Trace(quantity=engine.Orientation("block"))}
    q = simulate(shaken(), time_step=time_step, duration=whole(time_step), method=method, observe=observe)[
        "q"
    ]
    return 2.0 * np.arctan2(q[:, 2], q[:, 0])


def whole(time_step: float) -> float:
    """The run, in whole steps [s]."""
    return round(DURATION / time_step) * time_step


def largest(lean: Any) -> float:
    """The largest lean, by a parabola through three samples [rad]."""
    k = min(max(int(np.argmax(lean)), 1), len(lean) - 2)
    before, here, beyond = lean[k - 1 : k + 2]
    return float(here + (beyond - before) ** 2 / 8.0 / max(2.0 * here - before - beyond, 1e-300))


def swings(lean: Any, time_step: float) -> tuple[float, float]:
    """Largest leans before and after the first blow of the reference [rad]."""
    blow = round(rocking().blow / time_step)
    return largest(-lean[:blow]), largest(lean[blow:])


def measure(simulate: case.Simulate) -> dict[str, float]:
    """A swing, a blow and a swing."""
    lean, right = leans(simulate, TIME_STEP), rocking()
    before, after = swings(lean, TIME_STEP)
    late = [time for time in blows(lean, TIME_STEP) if time > 0.5 * right.blow]
    return {
        "before_error": before / -right.before - 1.0,
        "after_error": after / right.after - 1.0,
        "blow_late": ((late[0] if late else math.nan) - right.blow) / TIME_STEP,
    }


def blow_error(time_step: float) -> float:
    """First order of the speed kept at the blow: half of what is off in the energy. In its step gravity and the floor kick
    by h p² (sin α + a/g cos α)."""
    w = abs(rocking().speed)
    kick = RATE**2 * (math.sin(SLENDER) + SHAKE * UPLIFT / GRAVITY * math.cos(SLENDER)) / w
    return 0.5 * time_step * blow_costs(kick, w)


def before_limit(time_step: float) -> float:
    """The swing before the blow with an uplift a step late, and a lead of half a step of the fastest turn."""
    return abs(rocking(late=time_step).before / rocking().before - 1.0) + RATE * time_step


def after_limit(time_step: float) -> float:
    """The swing after the blow of an integration whose blow keeps as much less or is two steps late, both together."""
    less, right = rocking(kept=KEPT * (1.0 - blow_error(time_step))), rocking().after
    later = rocking(delay=2.0 * time_step)
    return abs(less.after / right - 1.0) + abs(later.after / right - 1.0) + before_limit(time_step)


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Relative error of the largest lean after the blow."""
    return swings(leans(simulate, time_step, method), time_step)[1] / rocking().after - 1.0


LEAST = 1.91538  # times UPLIFT: the least half sine that throws the block over, by integration in the test


def stands(simulate: case.Simulate, strength: float) -> bool:
    """Whether the block has not passed the lean at which it stands on its edge."""
    observe = {"q": engine.Final(quantity=engine.Orientation("block"))}
    result = simulate(
        struck(strength), time_step=COARSE, duration=round(FALLS / COARSE) * COARSE, observe=observe
    )
    return result.completed and abs(2.0 * math.atan2(result["q"][2], result["q"][0])) < SLENDER


def strongest(simulate: case.Simulate) -> case.BreakPoint:
    """The strongest half sine that leaves the block standing."""
    return break_point(functools.partial(stands, simulate), 0.6, 4.0, resolution=1e-3)


def lifts(simulate: case.Simulate, friction: float) -> bool:
    """Whether a floor of that friction lifts an edge, rather than draw itself away below the block."""
    observe = {"q": engine.Final(quantity=engine.Orientation("block"))}
    result = simulate(struck(1.2, friction), time_step=COARSE, steps=15, observe=observe)
    return result.completed and abs(float(result["q"][2])) > 1e-6


def smoothest(simulate: case.Simulate) -> case.BreakPoint:
    """The least friction of a floor that makes the block rock."""
    return break_point(functools.partial(lifts, simulate), 2.0, 0.02, resolution=1e-3, walk=6)


def draw(simulate: case.Simulate) -> case.Drawing:
    """The lean over time at three steps."""
    curves, after = [], []
    right = rocking()
    for steps in (60, 500, 4000):
        lean = leans(simulate, 1.0 / steps)
        after.append(math.degrees(float(np.abs(lean[math.ceil(right.blow * steps) + 1 :]).max())))
        stride = max(1, steps // 250)
        curves.append(
            line(f"h = 1/{steps} s", np.arange(len(lean))[::stride] / steps, np.degrees(lean)[::stride])
        )
    times, places = (
        (right.turned, right.blow, right.returned),
        (math.degrees(right.before), 0.0, math.degrees(right.after)),
    )
    curves.append(line("by integration", times, places, "points"))
    return case.Drawing(
        curves=tuple(curves),
        x_label="time [s]",
        y_label="lean [°]",
        note=f"After the blow it leans up to {told(after[0], 3)}° with h = 1/60 s and {told(after[-1], 3)}° with 1/4000 s, "
        f"{told(math.degrees(abs(right.after)), 3)}° by integration.",
    )


STEPS = tuple(rocking().blow / (n + 0.5) for n in (64, 128, 256, 512, 1024))

TEST = case.ScalarTest(
    title="Shaken block",
    question="Does a block on a shaken floor rock as Housner's equations say until it falls over?",
    why="Columns, shelves and reactors stand or fall in earthquakes by rocking. The floor moves as it is told, whatever "
    "rocks on it: its speed must reach the block through friction and contact at the right moment.",
    model="A slender block stands on a rough floor that is shaken sideways by 1.5 times the least that lifts an edge, 2 Hz: "
    "it rocks back, strikes and rocks on. On a floor struck by one half sine of 1.5 Hz it falls over or stays.",
    parameters=(
        ("block", "0.2 × 0.2 × 0.8 m, 10 kg"),
        ("floor", "a = 1.5 g b/h sin ωt, 2 Hz, or one half sine of 1.5 Hz; friction coefficient 2"),
        ("gravity", "9.81 m/s²"),
        (
            "time step",
            f"1/4000 s, at which a blow may keep {told(100.0 * blow_error(TIME_STEP))} % less speed, of the "
            f"{told(100.0 * (1.0 - KEPT))} % it takes, and {told(100.0 * blow_error(COARSE))} % less at 1/60 s. "
            "1/60 s for falling over, which takes no blow",
        ),
    ),
    theory=(
        "On its right edge: θ'' = −p² (sin(α − θ) + a/g cos(α − θ)), p² = 3 g/4R; on the left one with the signs turned.",
        "It lifts when a > g b/h; a blow keeps 1 − (3/2) sin²α of the speed (Housner 1963).",
        "A blow acts where its step starts: first order, smooth if it falls on the same part of a step at every step size.",
    ),
    reference="Integration by Runge and Kutta with uplift, blows and turns located by halving.",
    conclusion="Green: the floor's motion reaches the block, and blows act where they must. Red: friction or contact feels the "
    "floor late, or a blow is spread over both edges.",
    source="ours; G. Housner, The behavior of inverted pendulum structures during earthquakes, 1963",
    measurements=(
        ask(
            measure,
            (
                error(
                    "after_error",
                    "largest lean after the blow over that of the integration, minus one",
                    "1",
                    after_limit(TIME_STEP),
                    "the integration with a blow that keeps less by its first order in the step, and two steps late",
                ),
                error(
                    "before_error",
                    "largest lean before the blow over that of the integration, minus one",
                    "1",
                    before_limit(TIME_STEP),
                    "an uplift a step late, and h p",
                    "companion",
                ),
                error(
                    "blow_late",
                    "first blow, less that of the integration, in time steps",
                    "steps",
                    2.0,
                    "an uplift found within a step, and a blow within one",
                    "companion",
                ),
            ),
            "shaken on and on",
            TIME_STEP,
        ),
    ),
    example=lambda: case.Example(scene=shaken(), time_step=1.0 / 240.0, duration=4.0),
    figures=(case.Figure(name="lean", title="A block on a shaken floor", draw=draw),),
    stability=(
        case.StabilityStudy(
            name="overturning",
            title="Strongest half sine of the floor that leaves the block standing",
            configuration="plain",
            definition="after 1.6 s the block leans less than it does standing on its edge",
            study=strongest,
            unit="1",
            expected=(0.998 * LEAST, 1.002 * LEAST),
            expected_source="1.915 times the acceleration that lifts an edge, by integration of Housner's equation; steps of "
            "1/60 s give 0.02 % more, the search ends within 0.1 %",
        ),
        case.StabilityStudy(
            name="smoothest",
            title="Least friction with which the floor makes the block rock",
            configuration="plain",
            definition="1.2 times the acceleration that lifts an edge does so, by 2e-6 rad",
            study=smoothest,
            unit="1",
            better="smaller",
            expected=(HALF_WIDTH / HALF_HEIGHT, 1.002 * HALF_WIDTH / HALF_HEIGHT),
            expected_source="µ m g h tips the block over b where µ > b/h; the search ends within 0.1 %",
        ),
    ),
    ladders=(
        case.Ladder(
            name="lean",
            description="relative error of the largest lean after the blow, which falls on the middle of a step",
            unit="1",
            time_steps=STEPS,
            configurations=configured({"direct": 1.0, "iterative": 1.0}),
            error=ladder_error,
            target_error=1e-2,
            target_seconds=0.05,
        ),
    ),
)
