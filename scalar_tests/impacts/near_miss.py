"""Is what is not touched left alone: bodies that pass each other, and inner edges of a floor of tiles?"""

from __future__ import annotations

import math

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.bodies import Material

from .. import case
from ..bracket import break_point, unbroken
from ..closed_form import ask, error
from ..sweep import line

TIME_STEP = 1.0 / 60.0  # s
SIZE = 0.05  # m, radius of balls and capsules, half an edge of boxes
MASS = 1.0  # kg
GRAVITY = 9.81  # m/s², on the tiles
TILE = 0.5  # m
START = (0.013, 0.007)  # m, on the first tile
PASSES = ((3.0, 0.01), (100.0, 0.4), (100.0, 1e-3))  # m/s of each body, m between them
SHAPES: dict[str, engine.Shape] = {
    "ball": engine.Sphere(SIZE),
    "box": engine.Box((2 * SIZE,) * 3),
    "capsule": engine.Capsule(SIZE, 2 * SIZE),
}
LYING = (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0)  # a capsule's axis along x


def passing(shape: engine.Shape, speed: float, gap: float) -> engine.Scene:
    """Two equal bodies on opposite ways with `gap` [m] between them, without gravity."""
    rubber = Material(restitution=0.5, friction=0.5)
    height = 2.0 * SIZE * (2.0 if isinstance(shape, engine.Capsule) else 1.0)

    def body(name: str, side: float, z: float) -> engine.RigidBody:
        return engine.RigidBody(
            name=name,
            mass=MASS,
            shape=shape,
            position=(-0.5037 * side, 0.0, z),
            velocity=(speed * side, 0.0, 0.0),
            material=rubber,
        )

    return engine.Scene(bodies=(body("going", 1.0, 0.0), body("coming", -1.0, height + gap)))


def pass_change(simulate: case.Simulate, shape: engine.Shape, speed: float, gap: float) -> float:
    """Largest change of a velocity of two bodies that pass [m/s]."""
    result = simulate(
        passing(shape, speed, gap),
        time_step=TIME_STEP,
        steps=30,
        observe={"v": engine.Final(quantity=engine.Velocity())},
    )
    return float(np.abs(result["v"] - ((speed, 0.0, 0.0), (-speed, 0.0, 0.0))).max())


def fastest_pass(simulate: case.Simulate) -> case.BreakPoint:
    """Highest speed [m/s] at which boxes pass each other 1 mm apart without losing a bit."""

    def holds(speed: float) -> bool:
        return pass_change(simulate, SHAPES["box"], speed, 1e-3) == 0.0

    return break_point(holds, 1.0, 1e6, resolution=0.1, walk=7)


def passes(simulate: case.Simulate, gap: float) -> bool:
    """Whether boxes of 100 m/s each pass so near [m] and keep every bit."""
    return pass_change(simulate, SHAPES["box"], 100.0, gap) == 0.0


def tiles(
    shape: engine.Shape,
    velocity: tuple[float, float, float],
    spin: tuple[float, float, float] = (0.0, 0.0, 0.0),
    orientation: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0),
    friction: float = 0.0,
    compliance: float = 0.0,
) -> engine.Scene:
    """A body on a floor of square tiles whose tops lie in one plane, as deep in it as `compliance` [m/N] lets it."""
    surface = Material(friction=friction, compliance=0.5 * compliance)
    floor = [
        engine.RigidBody(
            name=f"tile {i} {k}",
            motion="static",
            shape=engine.Box((TILE, TILE, 1.0)),
            position=(TILE * i, TILE * k, -0.5),
            material=surface,
        )
        for i in range(4)
        for k in range(4)
    ]
    slider = engine.RigidBody(
        name="slider",
        mass=MASS,
        shape=shape,
        position=(*START, SIZE - compliance * MASS * GRAVITY),
        velocity=velocity,
        angular_velocity=spin,
        orientation=orientation,
        material=surface,
    )
    return engine.Scene(bodies=(*floor, slider), gravity=(0.0, 0.0, -GRAVITY))


ACROSS = (3.0, 2.0, 0.0)  # m/s
SOFT = 1e-4  # m/N: the ball lies 1 mm deep
SLIDES = {
    "ball": tiles(SHAPES["ball"], ACROSS),
    "box": tiles(SHAPES["box"], ACROSS),
    "turning_box": tiles(engine.Box((2 * SIZE, 4 * SIZE, 2 * SIZE)), ACROSS, spin=(0.0, 0.0, 4.0)),
    "turning_capsule": tiles(SHAPES["capsule"], ACROSS, spin=(0.0, 0.0, 4.0), orientation=LYING),
    "rolling_ball": tiles(SHAPES["ball"], (1.0, 0.8, 0.0), spin=(-0.8 / SIZE, 1.0 / SIZE, 0.0), friction=0.5),
    "rolling_capsule": tiles(
        SHAPES["capsule"], (0.0, 1.0, 0.0), spin=(-1.0 / SIZE, 0.0, 0.0), orientation=LYING, friction=0.5
    ),
}


def slide_changes(simulate: case.Simulate, name: str, time_step: float = TIME_STEP) -> np.ndarray:
    """Largest change of velocity and of r ω [m/s] so far, at each step of 0.4 s."""
    scene = SLIDES[name]
    start = scene.bodies[-1]
    assert isinstance(start, engine.RigidBody)
    observe = {
        "v": engine.Trace(quantity=engine.Velocity("slider")),
        "w": engine.Trace(quantity=engine.AngularVelocity("slider")),
    }
    result = simulate(scene, time_step=time_step, duration=0.4, observe=observe)
    off = np.abs(np.hstack((result["v"] - start.velocity, SIZE * (result["w"] - start.angular_velocity))))
    return np.maximum.accumulate(off.max(axis=1))


def _measure_passes(simulate: case.Simulate) -> dict[str, float]:
    return {
        f"{name}_change": max(pass_change(simulate, shape, speed, gap) for speed, gap in PASSES)
        for name, shape in SHAPES.items()
    }


def _measure_slides(simulate: case.Simulate) -> dict[str, float]:
    return {f"{name}_on_tiles": float(slide_changes(simulate, name)[-1]) for name in SLIDES}


def _measure_soft(simulate: case.Simulate) -> dict[str, float]:
    """On one soft plane the level velocity keeps every bit; on tiles a sunk ball meets their edges at a slant."""
    scene = tiles(SHAPES["ball"], ACROSS, compliance=SOFT)
    observe = {"v": engine.Trace(quantity=engine.Velocity("slider"))}
    result = simulate(scene, time_step=TIME_STEP, duration=0.4, observe=observe)
    return {"soft_ball_on_tiles": float(np.abs(result["v"][:, :2] - ACROSS[:2]).max())}


def _draw(simulate: case.Simulate) -> case.Drawing:
    curves = []
    for name in SLIDES:
        off = slide_changes(simulate, name)
        times = tuple(TIME_STEP * k for k in range(len(off)))
        curves.append(line(name.replace("_", " "), times, (max(float(o), 1e-18) for o in off)))
    return case.Drawing(
        curves=tuple(curves), x_label="time [s]", y_label="largest change so far [m/s]", y_scale="log"
    )


def _untouched(name: str) -> case.Metric:
    return case.Metric(
        name=f"{name}_change",
        description=f"largest change of a velocity of two bodies ({name}) that pass, three speeds and gaps",
        unit="m/s",
        role="gate",
        limit=0.0,
        limit_source="no touch, no impulse: not a bit may change",
        reference=0.0,
    )


PLANE = "one plane is one plane, however it is tiled; rounding and the solver's tolerance remain"

TEST = case.ScalarTest(
    title="Near misses",
    question="Is what is not touched left alone: bodies that pass each other, and inner edges of a floor of tiles?",
    why="Engines look ahead so that fast bodies do not tunnel. A plane put before a body for a whole step is met by "
    "bodies that only pass by, and inner edges throw wheels and turning boxes into the air.",
    model="Two balls, boxes or capsules pass each other; balls, boxes and capsules slide, turn and roll over tiles "
    "whose tops lie in one plane.",
    parameters=(
        ("passing bodies", "0.1 m across; 3 m/s each with 1 cm between, 100 m/s with 40 cm and with 1 mm"),
        ("tiles", "0.5 × 0.5 m"),
        ("sliding bodies", "0.1 m across, at 3 and 2 m/s across the tiles, turning at 4 rad/s"),
        ("rolling bodies", "μ = 0.5, at 1 m/s"),
        ("gravity", "9.81 m/s² on the tiles"),
        ("time step", "1/60 s"),
    ),
    theory=(
        "Without touch there is no impulse: velocities keep every bit.",
        "On a plane without friction nothing changes but the place; rolling needs no friction.",
    ),
    reference="Free motion and rolling on a plane (closed form).",
    conclusion="Green: a contact exists where bodies touch. Red: bodies hit what they do not touch, or edges that "
    "are none.",
    source="ours",
    lacks={"ladder": "exact at every step"},
    measurements=(
        ask(_measure_passes, tuple(_untouched(name) for name in SHAPES), "Bodies that pass.", TIME_STEP),
        ask(
            _measure_slides,
            tuple(
                error(
                    f"{name}_on_tiles",
                    f"largest change of velocity or r ω of a {name.replace('_', ' ')} in 0.4 s",
                    "m/s",
                    1e-9,
                    PLANE,
                )
                for name in SLIDES
            ),
            "Bodies on tiles.",
            TIME_STEP,
        ),
        ask(
            _measure_soft,
            (
                case.Metric(
                    name="soft_ball_on_tiles",
                    description="largest change of the level velocity of a ball 1 mm deep in soft tiles, in 0.4 s",
                    unit="m/s",
                    role="reported",
                    reference=0.0,
                ),
            ),
            "Followed: a ball that has sunk in meets the edges of the next tile at a slant, and is slowed.",
            TIME_STEP,
            configuration="soft",
        ),
    ),
    example=lambda: case.Example(scene=SLIDES["turning_box"], time_step=TIME_STEP, duration=0.5),
    figures=(case.Figure(name="on-tiles", title="Change of velocity on the tiles", draw=_draw),),
    stability=(
        case.StabilityStudy(
            name="fastest-pass",
            title="Fastest boxes that pass 1 mm apart at h = 1/60 s",
            configuration="plain",
            definition="no bit of a velocity changes",
            study=fastest_pass,
            unit="m/s",
            expected=(1e6, 1e6),
            expected_source="a direction keeps them apart for the whole way, however long; the search ends at 1e6 m/s",
        ),
        unbroken(
            passes,
            1e-3,
            1e-15,
            name="narrowest-pass",
            title="Narrowest gap between boxes that pass at 100 m/s",
            definition="no bit of a velocity changes",
            source="bodies that touch, but do not approach each other, have no impulse to exchange",
            unit="m",
        ),
    ),
)
