"""Do a belt and a turntable sort bodies by their friction, as Coulomb's law says?"""

from __future__ import annotations

import cmath
import math
from typing import Any

import numpy as np

from spook_tracker import engine

from .. import case
from ..bracket import break_point, unbroken
from ..closed_form import ask, error
from ..configurations import configured
from ..sweep import line, told

GRAVITY = 10.0  # m/s²
MASS = 0.5  # kg
EDGE = (0.1, 0.1, 0.04)  # m
# The belt
BELT = 1.5  # m/s, along x
FEED = (0.5, 0.9)  # m/s, how the boxes come in
SORTS = (0.15, 0.3, 0.45, 0.6)  # µ of the boxes on the belt
APART = 0.8  # m, along the belt
TIME_STEP, DURATION = 1.0 / 60.0, 1.2  # s
SLIP = complex(FEED[0] - BELT, FEED[1])  # m/s, in the belt's frame
# The turntable
RATE = 3.0  # rad/s
RADIUS = 0.4  # m
LEAST = RATE**2 * RADIUS / GRAVITY  # µ that keeps a box there
SHARES = (0.8, 0.9, 0.97, 1.03, 1.1, 1.2)  # of it
TABLE_STEP, TABLE_STEPS = 1.0 / 240.0, 120  # s; half a second
SLIPPED = (
    0.25 * (1.0 - SHARES[2]) * RATE**2 * RADIUS * (TABLE_STEP * TABLE_STEPS) ** 2
)  # m, half of what 0.97 lets slip


def box(name: str, friction: float, place: complex, velocity: complex, spin: float = 0.0) -> engine.RigidBody:
    """A box that has this µ on a surface of friction 1."""
    return engine.RigidBody(
        name=name,
        mass=MASS,
        shape=engine.Box(EDGE),
        position=(place.real, place.imag, 0.5 * EDGE[2]),
        velocity=(velocity.real, velocity.imag, 0.0),
        angular_velocity=(0.0, 0.0, spin),
        orientation=(math.cos(0.5 * cmath.phase(place)), 0.0, 0.0, math.sin(0.5 * cmath.phase(place)))
        if spin
        else (1.0, 0.0, 0.0, 0.0),
        material=engine.Material(friction=friction**2),
    )


def belt(times: float = 1.0) -> engine.Scene:
    """Boxes of different friction come in askew onto a belt, one behind the other, `times` as fast as seen from it."""
    surface = engine.RigidBody(
        name="belt",
        motion="static",
        shape=engine.Plane(),
        position=(0.0, 0.0, 0.0),
        material=engine.Material(friction=1.0),
        surface_velocity=(BELT, 0.0, 0.0),
    )
    boxes = [
        box(f"box {k}", friction, complex(APART * k), BELT + times * SLIP) for k, friction in enumerate(SORTS)
    ]
    return engine.Scene(bodies=(surface, *boxes), gravity=(0.0, 0.0, -GRAVITY))


def table(shares: tuple[float, ...] = SHARES) -> engine.Scene:
    """Boxes that ride a turntable on one circle, of so much times the friction that keeps them there."""
    surface = engine.RigidBody(
        name="table",
        motion="kinematic",
        shape=engine.Plane(),
        position=(0.0, 0.0, 0.0),
        angular_velocity=(0.0, 0.0, RATE),
        material=engine.Material(friction=1.0),
    )
    boxes = []
    for k, share in enumerate(shares):
        place = cmath.rect(RADIUS, 2.0 * math.pi * k / len(shares))
        boxes.append(box(f"box {k}", share * LEAST, place, 1j * RATE * place, RATE))
    return engine.Scene(bodies=(surface, *boxes), gravity=(0.0, 0.0, -GRAVITY))


def lane(friction: float) -> complex:
    """Where a box comes to rest in the belt's frame: |s|²/(2 µ g) along its slip s [m]."""
    return SLIP * abs(SLIP) / (2.0 * friction * GRAVITY)


def ride(start: complex, velocity: complex, friction: float, rate: float, h: float, steps: int) -> Any:
    """Places by the method's own steps: friction takes h µ g of the slip against the surface where the step begins,
    or all of it; x₊ = x + h v₊. `rate` turns the surface; 0 is one at rest."""
    x, v = start, velocity
    places = [x]
    for _ in range(steps):
        surface = 1j * rate * x
        slip = v - surface
        v = surface + slip * max(0.0, 1.0 - h * friction * GRAVITY / max(abs(slip), 1e-300))
        x += h * v
        places.append(x)
    return np.array(places)


def off_the_way(result: engine.Result, k: int, times: float = 1.0) -> tuple[Any, Any]:
    """The way of a box as seen from the belt, and that by the method's own steps [m]."""
    way = result[f"x{k}"][:, 0] - APART * k - BELT * result.sample_times[f"x{k}"] + 1j * result[f"x{k}"][:, 1]
    return way, ride(0.0, times * SLIP, SORTS[k], 0.0, TIME_STEP, len(way) - 1)


def on_the_belt(simulate: case.Simulate) -> dict[str, float]:
    """Ways in the belt's frame, until all boxes rest in it."""
    observe = {f"x{k}": engine.Trace(quantity=engine.Position(f"box {k}")) for k in range(len(SORTS))}
    observe |= {f"v{k}": engine.Trace(quantity=engine.Velocity(f"box {k}")) for k in range(len(SORTS))}
    result = simulate(belt(), time_step=TIME_STEP, duration=DURATION, observe=observe)
    place, straight, late, carried = 0.0, 0.0, 0.0, 0.0
    for k, friction in enumerate(SORTS):
        way, exact = off_the_way(result, k)
        slip = np.hypot(result[f"v{k}"][:, 0] - BELT, result[f"v{k}"][:, 1])
        place = max(place, float(np.abs(way - exact).max()))
        straight = max(straight, float(np.abs((way / SLIP).imag).max() * abs(SLIP)))
        takes = math.ceil(abs(SLIP) / (friction * GRAVITY * TIME_STEP))
        late = max(late, abs(float(np.argmax(slip < 1e-6)) - takes))
        carried = max(carried, float(slip[-1]))
    return {"place_error": place, "straightness": straight, "steps_late": late, "slip_left": carried}


def grown(time_step: float) -> float:
    """By how much the circle of a box that rides grows in half a second: a step along the tangent is √(1 + (Ω h)²) longer."""
    return math.exp(0.25 / time_step * math.log1p((RATE * time_step) ** 2)) - 1.0


def on_the_table(simulate: case.Simulate) -> dict[str, float]:
    """Half a second: which still ride, and where all are."""
    observe = {f"x{k}": engine.Trace(quantity=engine.Position(f"box {k}")) for k in range(len(SHARES))}
    result = simulate(table(), time_step=TABLE_STEP, steps=TABLE_STEPS, observe=observe)
    place, kept = 0.0, 0
    for k, share in enumerate(SHARES):
        places = result[f"x{k}"][:, 0] + 1j * result[f"x{k}"][:, 1]
        start = complex(places[0])
        exact = ride(start, 1j * RATE * start, share * LEAST, RATE, TABLE_STEP, TABLE_STEPS)
        place = max(place, float(np.abs(places - exact).max()))
        kept += abs(places[-1] * cmath.exp(-1j * RATE * TABLE_STEP * TABLE_STEPS) - start) < SLIPPED
    return {"table_place_error": place, "kept": float(kept)}


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """How far the lane of the smoothest box is from its closed form [m]."""
    observe = {"x": engine.Final(quantity=engine.Position("box 0"))}
    result = simulate(belt(), time_step=time_step, duration=DURATION, method=method, observe=observe)
    return float(result["x"][1]) - lane(SORTS[0]).imag


def stays(simulate: case.Simulate, friction: float) -> bool:
    """Whether a box of this µ rides the table for a quarter of a second."""
    steps = TABLE_STEPS // 2
    observe = {"x": engine.Final(quantity=engine.Position("box 0"))}
    result = simulate(table((friction / LEAST,)), time_step=TABLE_STEP, steps=steps, observe=observe)
    if not result.completed:
        return False
    place = complex(result["x"][0], result["x"][1])
    return abs(place - RADIUS * (1.0 + 1j * RATE * TABLE_STEP) ** steps) < 1e-6


def smoothest(simulate: case.Simulate) -> case.BreakPoint:
    """The least µ that keeps a box, walking from three times the least to a third of it."""
    return break_point(lambda mu: stays(simulate, mu), 3.0 * LEAST, LEAST / 3.0, resolution=1e-3)


def sorted_at(simulate: case.Simulate, times: float) -> bool:
    """Whether boxes so many times as fast keep their ways for a second, to 1e-9 of them."""
    observe = {f"x{k}": engine.Trace(quantity=engine.Position(f"box {k}")) for k in range(len(SORTS))}
    result = simulate(belt(times), time_step=TIME_STEP, steps=60, observe=observe)
    ways = [off_the_way(result, k, times) for k in range(len(SORTS))]
    return result.completed and all(np.abs(a - b).max() < 1e-9 * np.abs(b).max() for a, b in ways)


def draw_belt(simulate: case.Simulate) -> case.Drawing:
    """Ways in the belt's frame."""
    observe = {f"x{k}": engine.Trace(quantity=engine.Position(f"box {k}")) for k in range(len(SORTS))}
    result = simulate(belt(), time_step=TIME_STEP, duration=DURATION, observe=observe)
    curves = []
    for k, friction in enumerate(SORTS):
        along = result[f"x{k}"][:, 0] - APART * k - BELT * result.sample_times[f"x{k}"]
        curves.append(line(f"µ = {friction:g}", along, result[f"x{k}"][:, 1], "points"))
    ends = [lane(friction) for friction in SORTS]
    curves.append(
        line("closed form: where they rest", [e.real for e in ends], [e.imag for e in ends], "limit")
    )
    widest, narrowest = result["x0"][-1, 1], result[f"x{len(SORTS) - 1}"][-1, 1]
    return case.Drawing(
        curves=tuple(curves),
        x_label="along the belt, seen from it [m]",
        y_label="across the belt [m]",
        note=f"Across the belt the smoothest ends {told(float(widest), 3)} m away, the roughest {told(float(narrowest), 3)} m.",
    )


def draw_table(simulate: case.Simulate) -> case.Drawing:
    """Distances from the axis against time."""
    observe = {f"x{k}": engine.Trace(quantity=engine.Position(f"box {k}")) for k in range(len(SHARES))}
    result = simulate(table(), time_step=TABLE_STEP, steps=2 * TABLE_STEPS, observe=observe)
    curves = [
        line(
            f"{share:g} of the least µ",
            result.sample_times[f"x{k}"],
            np.hypot(result[f"x{k}"][:, 0], result[f"x{k}"][:, 1]),
        )
        for k, share in enumerate(SHARES)
    ]
    return case.Drawing(
        curves=tuple(curves),
        x_label="time [s]",
        y_label="distance from the axis [m]",
        note=f"In a second the circle of the roughest has grown to {told(curves[-1].y[-1], 4)} m, since the table is felt where "
        f"a step begins. The smoothest is {told(curves[0].y[-1], 3)} m away.",
    )


ROUNDED = "constant friction is exact in a step; the solver stops at 1e-10 of the load"

TEST = case.ScalarTest(
    title="Sorting",
    question="Do a belt and a turntable sort bodies by their friction, as Coulomb's law says?",
    why="Belts and tables that sort work by slip alone: a body's lane tells its friction, if slip is against the surface's "
    "motion, all bodies feel their own coefficient, and what rides is let go at the right one.",
    model="Four boxes come in askew onto a belt that runs at 1.5 m/s. Six ride a turntable on a circle of 0.4 m, of 0.8 to "
    "1.2 times the friction that keeps them there.",
    parameters=(
        (
            "time step",
            f"1/60 s; of the table 1/240 s, in which the circle of what rides grows by Ω² h/2 a second, "
            f"{told(100.0 * grown(TABLE_STEP))} % in half a second: less than the 3 % of friction left, which 1/60 s with "
            f"{told(100.0 * grown(TIME_STEP))} % would use up",
        ),
        ("boxes", "0.1 × 0.1 × 0.04 m, 0.5 kg"),
        ("feed", "0.5 m/s along the belt, 0.9 m/s across it"),
        ("on the belt", "µ = 0.15, 0.3, 0.45, 0.6"),
        ("table", "3 rad/s, boxes at 0.4 m: µ = 0.36 keeps them"),
        ("gravity", "10 m/s²"),
    ),
    theory=(
        "Seen from the belt a box starts with the slip s = v − v_b, is slowed down by µ g, and goes straight: the belt's "
        "speed is reached after |s|/(µ g), the way is |s|² / (2 µ g), of it across the belt the part of s.",
        "Each step's speed is exact; summed at the ends of steps the way is |s| h/2 less.",
        "A table keeps what has µ g ≥ Ω² r. Felt where a step begins it leads on along the tangent: the circle grows by "
        "√(1 + (Ω h)²) a step, 0.9 % in the half second.",
        "A box whose spin is the table's slips alike at all corners, so nothing turns it.",
    ),
    reference="Closed forms, and the method's own steps of one complex number.",
    conclusion="Green: every box feels its own friction, against its own slip. Red: paths bend, lanes are not at 1/µ, or "
    "the table keeps what it should throw.",
    source="ours; a wish of the thesis, section 5.4",
    measurements=(
        ask(
            on_the_belt,
            (
                error("place_error", "largest distance from the method's own way", "m", 1e-9, ROUNDED),
                error(
                    "steps_late",
                    "largest difference of the steps to the belt's speed to |s|/(µ g h), rounded up",
                    "1",
                    0.5,
                    "a whole number",
                ),
                error(
                    "straightness",
                    "largest distance from the straight way in the belt's frame",
                    "m",
                    1e-9,
                    ROUNDED,
                    "companion",
                ),
                error("slip_left", "largest slip at the end", "m/s", 1e-9, ROUNDED, "companion"),
            ),
            "four boxes on a belt",
            TIME_STEP,
        ),
        ask(
            on_the_table,
            (
                case.Metric(
                    name="kept",
                    description="boxes of six that still ride: those of 1.03, 1.1 and 1.2 times the least friction",
                    unit="1",
                    role="gate",
                    better="inside",
                    limit=(3.0, 3.0),
                    limit_source="µ g ≥ Ω² r; on the table it has moved by less than half of ½ · 0.03 Ω² r t², 6.75 mm",
                    limit_kind="physical",
                    reference=3.0,
                ),
                error(
                    "table_place_error",
                    "largest distance from the method's own way, riding or thrown",
                    "m",
                    1e-9,
                    ROUNDED,
                    "companion",
                ),
            ),
            "six boxes on a turntable",
            TABLE_STEP,
            "table",
        ),
    ),
    example=lambda: case.Example(scene=belt(), time_step=TIME_STEP, duration=DURATION),
    stability=(
        case.StabilityStudy(
            name="friction",
            title="Least friction that keeps a box on the turntable",
            configuration="table",
            definition="it rides for a quarter of a second",
            study=smoothest,
            unit="1",
            better="smaller",
            expected=(LEAST, 1.006 * LEAST),
            expected_source="Ω² r/g; the circle grows by 0.5 %, and the resolution of the search",
        ),
        unbroken(
            sorted_at,
            1.0,
            1e6,
            name="fastest",
            title="How many times as fast boxes may come onto the belt",
            definition="ways of four boxes are the method's own for a second, to 1e-9 of them",
            source="Coulomb's friction knows no speed",
            unit="1",
        ),
    ),
    figures=(
        case.Figure(name="lanes", title="Ways seen from the belt", draw=draw_belt),
        case.Figure(name="table", title="Distance from the axis of the turntable", draw=draw_table),
    ),
    ladders=(
        case.Ladder(
            name="lane",
            description="lane of the smoothest box, against |s| s/(2 µ g)",
            unit="m",
            time_steps=tuple(1.0 / n for n in (20, 40, 80, 160, 320)),
            configurations=configured({"direct": 1.0, "iterative": 1.0}),
            error=ladder_error,
            target_error=0.01,
            target_seconds=0.01,
        ),
    ),
)
