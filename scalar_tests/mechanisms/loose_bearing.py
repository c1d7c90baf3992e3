"""Does a slider with play in its bearing fly, strike and stick when and where mechanics says?"""

from __future__ import annotations

import functools
import itertools
import math
from typing import Any

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.observe import Observable

from .. import case
from ..bracket import break_point, unbroken
from ..closed_form import ask, error
from ..configurations import configured
from ..heavier import heavier
from ..sweep import line, told
from .slider_crank import (
    CRANK,
    RELAXATION,
    ROD,
    ROD_MASS,
    SLIDER,
    SPEED,
    START,
    TURNING,
    lag,
    next_order,
    pin,
    slope,
    strayed,
)

PIN, PLAY = 0.02, 0.005  # m, radius of the pin, and how far it may go to either side in its slot
WALL = (0.02, 0.1, 0.1)  # m
TIME_STEP = 1.0 / 240.0  # s
TURN = 1.0  # s
PRELOAD = (
    SLIDER * SPEED**2 * CRANK * (1.0 + CRANK / ROD)
)  # N, m times the acceleration with crank and rod in one line
DURATION = 2.25  # s: four flights


@functools.cache
def scene(time_step: float, preload: float | None = None) -> engine.Scene:
    """A crank that a motor turns, a rod whose far end is a pin guided along x, and round it the slider's slot. The pin
    touches the slot's left wall: it brakes the slider. Or the right one, which a preload [N] on the slider shuts."""
    x, lean, _ = (float(value) for value in pin(START))
    rates = [SPEED * float(slope(lambda t, i=i: pin(t)[i], START)) for i in (0, 1)]
    c, s = CRANK * math.cos(START), CRANK * math.sin(START)
    joint: dict[str, Any] = {"compliance": 0.0, "damping": RELAXATION * time_step}
    plastic = engine.Material()
    half = 0.5 * ROD
    aside = PIN + PLAY + 0.5 * WALL[0]
    bodies = (
        engine.RigidBody(
            name="crank", mass=1.0, inertia=(TURNING,) * 3, position=(0, 0, 0), angular_velocity=(0, 0, SPEED)
        ),
        engine.RigidBody(
            name="rod",
            mass=ROD_MASS,
            shape=engine.Compound((engine.Part(shape=engine.Sphere(PIN), position=(half, 0.0, 0.0)),)),
            inertia=(1e-4, ROD_MASS * ROD**2 / 12.0, ROD_MASS * ROD**2 / 12.0),
            position=(0.5 * (c + x), 0.5 * s, 0.0),
            orientation=(math.cos(0.5 * lean), 0.0, 0.0, -math.sin(0.5 * lean)),
            velocity=(0.5 * (rates[0] - SPEED * s), 0.5 * SPEED * c, 0.0),
            angular_velocity=(0.0, 0.0, -rates[1]),
            material=plastic,
        ),
        engine.RigidBody(
            name="slider",
            mass=SLIDER,
            shape=engine.Compound(
                tuple(engine.Part(shape=engine.Box(WALL), position=(d, 0.0, 0.0)) for d in (-aside, aside))
            ),
            inertia=(0.01,) * 3,
            position=(x + (PLAY if preload is None else -PLAY), 0, 0),
            velocity=(rates[0], 0, 0),
            material=plastic,
        ),
    )
    joints = (
        engine.Hinge(
            name="drive",
            between=(engine.WORLD, "crank"),
            at=(0, 0, 0),
            axis=(0, 0, 1),
            motor=engine.Motor(speed=SPEED),
            **joint,
        ),
        engine.Hinge(name="pin", between=("crank", "rod"), at=(c, s, 0.0), axis=(0, 0, 1), **joint),
        engine.PointOnLine(
            name="wrist", between=(engine.WORLD, "rod"), at=(x, 0.0, 0.0), axis=(1, 0, 0), **joint
        ),
        engine.Prismatic(name="guide", between=(engine.WORLD, "slider"), axis=(1, 0, 0), **joint),
    )
    loads = (
        () if preload is None else (engine.Load(name="preload", body="slider", force=(-preload, 0.0, 0.0)),)
    )
    return engine.Scene(bodies=bodies, constraints=joints, forces=loads)


def place(time: Any) -> Any:
    """Of the pin [m]."""
    return pin(START + SPEED * np.asarray(time))[0]


def speed(time: float) -> float:
    """Of the pin [m/s]."""
    return SPEED * float(slope(lambda t: pin(t)[0], START + SPEED * time))


def acceleration(time: float) -> float:
    """Of the pin [m/s²]."""
    return SPEED**2 * float(slope(lambda t: slope(lambda u: pin(u)[0], t, 1e-3), START + SPEED * time, 1e-3))


def crossing(function: Any, early: float, late: float) -> float:
    """Where a function changes its sign, by halving."""
    sign = function(early) > 0.0
    for _ in range(60):
        middle = 0.5 * (early + late)
        early, late = (middle, late) if (function(middle) > 0.0) == sign else (early, middle)
    return 0.5 * (early + late)


@functools.cache
def flights() -> tuple[tuple[float, float, float], ...]:
    """When the slider leaves a wall of its slot, when it strikes the other, and how fast it flies [s, s, m/s]: it leaves
    when the pin's acceleration changes its sign, goes on as it is, and sticks to the wall it strikes."""
    found: list[tuple[float, float, float]] = []
    time, side = 0.0, 1.0  # of the pin: +1 where the slider is as far ahead as it may be
    while True:
        later = time + 0.01
        while acceleration(time) * acceleration(later) > 0.0:
            later += 0.01
        left = crossing(acceleration, time, later)
        start, flies = float(place(left)) + side * PLAY, speed(left)

        def beyond(
            t: float, side: float = side, start: float = start, flies: float = flies, left: float = left
        ) -> float:
            return side * (start + flies * (t - left) - float(place(t))) + PLAY

        late = left + 0.01
        while beyond(late) > 0.0:
            late += 0.01
        struck = crossing(beyond, left, late)
        if struck > DURATION:
            return tuple(found)
        found.append((left, struck, flies))
        time, side = struck, -side


def path(times: Any) -> Any:
    """Of the slider [m]."""
    found = place(times) + PLAY
    side = 1.0
    for left, struck, flies in flights():
        found = np.where(times > left, place(left) + side * PLAY + flies * (times - left), found)
        side = -side
        found = np.where(times > struck, place(times) + side * PLAY, found)
    return found


def runs(
    simulate: case.Simulate, time_step: float, method: engine.Method = engine.PLAIN
) -> tuple[Any, Any, Any]:
    """Times, and the slider's place and speed along its guide."""
    observe: dict[str, Observable] = {
        "x": engine.Trace(quantity=engine.Position("slider")),
        "v": engine.Trace(quantity=engine.Velocity("slider")),
    }
    result = simulate(
        scene(time_step), time_step=time_step, duration=DURATION, method=method, observe=observe
    )
    return result.sample_times["x"], result["x"][:, 0], result["v"][:, 0]


def measure(simulate: case.Simulate) -> dict[str, float]:
    """Two turns and a quarter."""
    times, x, v = runs(simulate, TIME_STEP)
    flying = [v[round(0.5 * (left + struck) / TIME_STEP)] / flies - 1.0 for left, struck, flies in flights()]
    held = [
        round(0.5 * (struck + left) / TIME_STEP)
        for (_, struck, _), (left, _, _) in itertools.pairwise(flights())
    ]
    return {
        "place_error": float(np.abs(x - path(times)).max()),
        "flight_error": float(np.abs(flying).max()),
        "stuck_error": float(np.abs(np.abs(x[held] - place(times[held])) - PLAY).max()),
    }


def pin_error(time_step: float) -> float:
    """Of the pin's place [m]: what its joints lag and its crank runs ahead."""
    return float(np.abs(strayed(time_step, DURATION, guided=True)).max()) * next_order(time_step)


def flight_error(time_step: float) -> float:
    """Of the speed in flight [m/s]: the slider leaves with the fastest mean speed of a step, j h²/6 short at most (j the jerk
    there: within half a step of the fastest moment, and a mean over the step), of a pin that strays on its own, too."""
    left = flights()[0][0]
    jerk = abs(acceleration(left + 1e-3) - acceleration(left - 1e-3)) / 2e-3
    swings = np.abs(np.gradient(strayed(time_step, DURATION, guided=True), time_step)).max()
    return jerk * time_step**2 / 6.0 + float(swings) * next_order(time_step)


def place_limit(time_step: float) -> float:
    """The pin's error, and that of the speed for as long as the slider flies."""
    longest = max(struck - left for left, struck, _ in flights())
    return pin_error(time_step) + longest * flight_error(time_step)


def shut(simulate: case.Simulate, preload: float) -> bool:
    """Whether pin and wall press each other in every step of a turn."""
    observe = {"f": engine.Trace(quantity=engine.ContactForce("slider", "rod"))}
    asked = scene(TIME_STEP, preload)
    result = simulate(asked, time_step=TIME_STEP, duration=TURN, observe=observe)
    return result.completed and float(np.abs(result["f"][1:, 0]).min()) > 0.0


def preload_error() -> float:
    """Of the least preload [N]: joints lag, and what they lag swings twice a turn at most."""
    return SLIDER * (2.0 * SPEED) ** 2 * lag(TIME_STEP)


def least(simulate: case.Simulate) -> case.BreakPoint:
    """The least preload that keeps the bearing from rattling."""
    return break_point(
        functools.partial(shut, simulate), 4.0 * PRELOAD, 0.25 * PRELOAD, resolution=1e-3, walk=4
    )


def flies(simulate: case.Simulate, slider: float) -> bool:
    """Whether a slider of that mass [kg] is where it should be in two turns and a quarter."""
    asked = heavier(scene(TIME_STEP), slider / SLIDER, "slider")
    observe = {"x": engine.Trace(quantity=engine.Position("slider"))}
    result = simulate(asked, time_step=TIME_STEP, duration=DURATION, observe=observe)
    off = np.abs(result["x"][:, 0] - path(result.sample_times["x"]))
    return result.completed and float(off.max()) < place_limit(TIME_STEP)


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Largest error of the slider's place [m]."""
    times, x, _ = runs(simulate, time_step, method)
    return float(np.abs(x - path(times)).max())


def draw(simulate: case.Simulate) -> case.Drawing:
    """How far the slider is ahead of the pin."""
    times, x, _ = runs(simulate, TIME_STEP)
    apart = float(np.abs(x - path(times)).max())
    return case.Drawing(
        curves=(
            line("simulation", times, 1e3 * (x - place(times)), "points"),
            line("flights and blows", times, 1e3 * (path(times) - place(times)), "reference"),
        ),
        x_label="time [s]",
        y_label="slider ahead of the pin [mm]",
        note=f"The slider is at most {told(1e3 * apart)} mm from where it must be, of a play of {told(2e3 * PLAY)} mm.",
    )


LAG = "rods and cranks lag by (1 + 2 τ/h)/4 h² of the acceleration across a joint"

TEST = case.ScalarTest(
    title="Slider-crank with clearance",
    question="Does a slider with play in its bearing fly, strike and stick when and where mechanics says?",
    why="Worn bearings rattle. Twice a turn the pin leaves one side of its hole and strikes the other: a contact within a "
    "loop of joints that opens, flies free and closes with a blow that runs through rod and crank to the motor.",
    model="The slider-crank, its motor and masses, with a pin on the rod, guided along x, in a slot of the slider that is 10 mm "
    "wider; pin and slot touch without friction and without rebound. No gravity.",
    parameters=(
        ("crank and rod", "0.15 m and 0.45 m"),
        ("rod and slider", "1 kg and 2 kg"),
        ("play", "5 mm to either side"),
        ("speed", "a turn a second"),
        ("joints", "rigid, τ = 2 h"),
        (
            "time step",
            f"1/240 s, at which the pin is {told(1e3 * pin_error(TIME_STEP))} mm off; it would be "
            f"{told(1e3 * pin_error(1.0 / 60.0))} mm at 1/60 s, of a play of 5",
        ),
    ),
    theory=(
        "The slider leaves its wall when the pin's acceleration changes its sign, flies at that speed, strikes the other wall "
        "and moves with the pin again.",
        "The gap may close within a step, no more: the slider lands on its wall, and the blow is plastic. What the release "
        "is off is of second order, for the speed is largest there.",
        "Nothing can run away: rows are rigid, and a plastic blow takes energy. Pressed to its wall by m ω² r (1 + r/l) or more "
        "the slider never flies.",
    ),
    reference="Geometry, with release and strike located by halving.",
    conclusion="Green: contacts open and close within loops of joints as they must. Red: a contact pulls, or a blow is lost.",
    source="ours; any textbook of machine dynamics for the mechanism",
    measurements=(
        ask(
            measure,
            (
                error(
                    "place_error",
                    "largest error of the slider's place in two turns and a quarter",
                    "m",
                    place_limit(TIME_STEP),
                    f"{LAG}; the release is off by j h²/6 of the speed",
                ),
                error(
                    "flight_error",
                    "largest relative error of a flight's speed",
                    "1",
                    flight_error(TIME_STEP) / abs(flights()[0][2]),
                    "the fastest mean speed of a step, and how fast the pin strays",
                    "companion",
                ),
                error(
                    "stuck_error",
                    "largest distance from the wall halfway between a strike and the next release",
                    "m",
                    pin_error(TIME_STEP),
                    LAG,
                    "companion",
                ),
            ),
            "four flights",
            TIME_STEP,
        ),
    ),
    example=lambda: case.Example(scene=scene(TIME_STEP), time_step=TIME_STEP, duration=4.0),
    figures=(case.Figure(name="play", title="The slider's play", draw=draw),),
    stability=(
        case.StabilityStudy(
            name="preload",
            title="Least preload of the slider that keeps its bearing from rattling",
            configuration="plain",
            definition="pressed to one wall it presses the pin in every step of a turn",
            study=least,
            unit="N",
            better="smaller",
            expected=(PRELOAD - preload_error(), 1.00101 * PRELOAD + preload_error()),
            expected_source="m ω² r (1 + r/l), what the slider needs where crank and rod lie in one line; m (2 ω)² times what the "
            "joints lag; the search ends within a thousandth",
        ),
        unbroken(
            flies,
            SLIDER,
            1e9,
            name="heaviest",
            title="Heaviest slider that flies, strikes and sticks as it should",
            definition="in two turns and a quarter its place is right to the limit of the question",
            source="the pin goes as the motor has it, whatever it pushes",
            unit="kg",
            walk=4,
        ),
    ),
    ladders=(
        case.Ladder(
            name="place",
            description="largest error of the slider's place",
            unit="m",
            time_steps=tuple(1.0 / n for n in (60, 120, 240, 480)),
            configurations=configured({"direct": 2.0, "half-step, curved twice": None}),
            error=ladder_error,
            target_error=5e-4,
            target_seconds=0.02,
        ),
    ),
)
