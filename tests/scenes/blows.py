"""Scenes of blows for tests/engine/test_laws.py: what flies, is carried, rides or rests when it is hit, wherever in a step."""

from __future__ import annotations

import math
import random
from dataclasses import replace
from typing import Any

import numpy as np

from spook_tracker.engine import (
    WORLD,
    Box,
    Limit,
    Lock,
    Material,
    Particle,
    Prismatic,
    RigidBody,
    Scene,
    Shape,
    Sphere,
    Spring,
)
from spook_tracker.scalar_tests.stacks import pile
from tests.scenes import corpus

H = 1 / 60  # s
RADIUS = 0.2  # m
ELASTIC = corpus.ELASTIC


def ball(name: str, place: Any, velocity: Any, mass: float = 1.0, radius: float = RADIUS) -> RigidBody:
    return corpus.solid(name, Sphere(radius), place, mass, velocity, material=ELASTIC)


def wall(name: str, place: Any, size: Any, **more: Any) -> RigidBody:
    return corpus.fixed(name, Box(size), place, material=ELASTIC, **more)


def falling(*bodies: RigidBody) -> Scene:
    return Scene(bodies=bodies, gravity=corpus.DOWN)


# Elastic balls: no blow takes or gives energy ---------------------------------------------------------------------------


def touching(share: float) -> Scene:
    """Two rise, one on top of the other, and meet a third after that share of a step."""
    up, down, heavy = 2.4, 1.5, 8.0
    gap = share * H * (up + down)
    return falling(
        ball("lower", (0, 0, 0), (0, 0, up), 4.0),
        ball("upper", (0, 0, 2 * RADIUS), (0, 0, up), 0.5),
        ball("third", (0, 0, 4 * RADIUS + gap), (0, 0, -down), heavy),
    )


def along_a_wall(share: float) -> Scene:
    return falling(
        wall("side", (-0.5 - RADIUS, 0, 0), (1, 4, 8)),
        wall("roof", (0, 0, RADIUS + share * H * 3.0 + 0.5), (4, 4, 1)),
        ball("ball", (0, 0, 0), (0, 0, 3.0)),
    )


def off_the_floor(share: float) -> Scene:
    """It begins the step on the floor, with a speed that gravity does not take back in it. Successive blows: in a
    simultaneous one the floor, which it still touches as the step begins, takes part and stops it."""
    _, *rest = along_a_wall(share).bodies
    return falling(wall("floor", (0, 0, -0.5 - RADIUS), (4, 4, 1)), *rest)


def earlier(share: float) -> Scene:
    """Two would meet late in the step; a third, sent up by the floor, hits the lower one before: both had been led to the
    time of their own blow."""
    heavy, light = 5.0, 0.4
    return falling(
        wall("floor", (0, 0, -0.5), (9, 9, 1)),
        ball("lowest", (0, 0, RADIUS + 0.1 * H * 12.0), (0, 0, -12.0), light),
        ball("lower", (0, 0, 3.0 * RADIUS + 0.03), (0, 0, 1.6), heavy),
        ball("upper", (0, 0, 5.0 * RADIUS + 0.03 + share * H * 2.6), (0, 0, -1.0), heavy),
    )


def locked_below_a_roof(share: float) -> Scene:
    """Balls one above the other rise to it, and both turn round: a lock holds them together, and holds none up."""
    bodies = (
        wall("roof", (0, 0, RADIUS + share * H * 3.0 + 0.5), (4, 4, 1)),
        ball("upper", (0, 0, 0), (0, 0, 3.0)),
        ball("lower", (0, 0, -3.0 * RADIUS), (0, 0, 3.0), 3.0),
    )
    lock = Lock(name="lock", between=("upper", "lower"), compliance=0.0)
    return replace(falling(*bodies), constraints=(lock,))


def plank(name: str, slope: float, along: float, size: float) -> RigidBody:
    """Its upper side through the origin, rising along x by that angle."""
    way, normal = (math.cos(slope), 0.0, math.sin(slope)), (-math.sin(slope), 0.0, math.cos(slope))
    place = [along * w - 0.5 * n for w, n in zip(way, normal, strict=True)]
    turn = (math.cos(0.5 * slope), 0.0, -math.sin(0.5 * slope), 0.0)
    return wall(name, place, (size, 4, 1), orientation=turn)


def on_a_slope(slope: float, share: float) -> Scene:
    """One rolls up a plank that carries it, and one that comes down knocks it back."""
    up = np.array((math.cos(slope), 0.0, math.sin(slope)))
    lies = RADIUS * np.array((-up[2], 0.0, up[0]))
    falls = ball("falls", lies + (2 * RADIUS + share * H * 3.0) * up, -1.0 * up, 3.0)
    return falling(plank("plank", slope, 0.0, 9.0), ball("rises", lies, 2.0 * up), falls)


def losing_its_support(share: float) -> Scene:
    """A ball leans on a wall and on another, which a third knocks away: it falls, with the kick of the whole step."""
    large, speed, lean = 1.5 * RADIUS, 4.0, 0.6
    support = np.array((0.0, 0.0, large))
    leans = support + (large + RADIUS) * np.array((-math.sin(lean), 0.0, math.cos(lean)))
    way = np.array((0.5, math.sqrt(0.75), 0.0))
    return falling(
        wall("floor", (0, 0, -0.5), (9, 9, 1)),
        wall("wall", (leans[0] - RADIUS - 0.5, 0.0, 1.0), (1.0, 0.2, 2.0)),
        ball("leans", leans, (0, 0, 0)),
        ball("support", support, (0, 0, 0), 1.0, large),
        ball("comes", support - (2.0 * large + share * H * speed) * way, speed * way, 1.0, large),
    )


def onto_a_steeper_slope(share: float) -> Scene:
    """It slides up a plank to one that is steeper."""
    up, normal = np.array((math.cos(0.3), 0.0, math.sin(0.3))), np.array((-math.sin(0.3), 0.0, math.cos(0.3)))
    place = RADIUS * normal - (RADIUS * math.tan(0.03) + share * H * 2.0) * up
    planks = plank("plank", 0.3, -2.0, 4.0), plank("steeper", 0.36, 2.0, 4.0)
    return falling(*planks, ball("slides", place, 2.0 * up))


def at_a_wall(h: float, seed: int, way: float) -> Scene:
    """Rows of up to four balls at a ceiling, or a floor. What rises was expected at the wall sooner than it came: no blow was
    found, and after a hundred tries all were answered at once."""
    rng, count = np.random.default_rng(seed), 1 + seed % 4
    masses, speed = 10.0 ** rng.uniform(-0.5, 0.5, count), rng.uniform(1.0, 3.0)
    gaps = np.array((0.5 + rng.uniform(0.2, 2.5) * h * speed, *10.0 ** rng.uniform(-9.0, -4.0, count - 1)))
    places = np.cumsum(gaps + RADIUS) + RADIUS * np.arange(count)
    row = [ball(f"b{k}", (0, 0, -way * places[k]), (0, 0, way * speed), masses[k]) for k in range(count)]
    return falling(wall("wall", (0, 0, 0), (4, 4, 1)), *row)


# Boxes ------------------------------------------------------------------------------------------------------------------


def spinning_row(seed: int) -> Scene:
    """They are not led to the time of a blow: they would have to be turned to it as well."""
    rng, bodies = np.random.default_rng(seed), []
    for k in range(4):
        mass, place = float(rng.uniform(0.5, 2.0)), (k * (0.4 + 5e-3), *rng.uniform(-0.05, 0.05, 2))
        ways = ((2.0, 0, 0) if k == 0 else (0, 0, 0)), rng.uniform(-0.4, 0.4, 3)
        bodies.append(corpus.solid(f"b{k}", Box((0.4, 0.3, 0.3)), place, mass, *ways, material=ELASTIC))
    return Scene(bodies=tuple(bodies))


HARDLY = (0.6, 0.5, 0.4)  # m, of boxes that hardly rebound


def hardly(places: int) -> Scene:
    """Three, .75 m apart: what the floor's blow or the one before sets in motion is 26 mm deep in the next one else."""
    rough, rng = Material(friction=0.4, restitution=0.1), random.Random(places)
    boxes = []
    for k, (x, y) in enumerate([(-0.3, -0.3), (0.0, 0.15), (0.3, -0.15)]):
        place = (x + rng.uniform(-0.02, 0.02), y + rng.uniform(-0.02, 0.02), 0.6 + 0.75 * k)
        boxes.append(corpus.solid(f"box {k}", Box(HARDLY), place, spin=(0, 0, 0.5), material=rough))
    return falling(corpus.floor(rough), *boxes)


def thrown_up() -> Scene:
    """At a tenth of h g: the row of its contact asked for a nineteenth of its speed, and pushed to get it."""
    up = corpus.solid(
        "ball", Sphere(0.25), (0, 0, 0.25), velocity=(0, 0, 0.1 * corpus.GRAVITY * H), material=corpus.ROUGH
    )
    return falling(corpus.floor(corpus.ROUGH), up)


def borne(psi: float) -> Scene:
    """A box on a box, both 1 nm above what bears them: they get g h in the same step, the upper one without approaching the
    lower one before the floor stops that. It went on for g h² = 2.7 mm, and for twice that in the next step."""
    made_of = Material(restitution=psi)
    heights = (("lower", 0.1 + 1e-9), ("upper", 0.3 + 2e-9))
    boxes = (corpus.solid(name, Box((0.2, 0.2, 0.2)), (0, 0, z), material=made_of) for name, z in heights)
    return falling(corpus.floor(made_of), *boxes)


def end_hit_down(shape: Shape, floor: Shape) -> Scene:
    """A bar lies still with one end on the floor, the other 4 mm above it, out of reach, until a ball hits that end."""
    tilt, turn = 0.004, 0.5 * (math.pi / 2 + 0.004)
    turned = (math.cos(turn), 0.0, math.sin(turn), 0.0)
    return falling(
        corpus.fixed("floor", floor, (0, 0, -0.5 * isinstance(floor, Box))),
        corpus.solid("bar", shape, (0, 0, 0.05 + 0.5 * math.sin(tilt)), orientation=turned),
        corpus.solid("hammer", Sphere(0.1), (-0.45, 0, 0.3), 5.0, (0, 0, -8.0)),
    )


def sprung_particles() -> Scene:
    """Four, each tied to each by a spring with a damper."""
    bodies = (
        Particle(name=f"b{i}", mass=1.0 + i, position=(1.0 * i, 0.3 * i * i, 0.1 * i)) for i in range(4)
    )
    springs = (
        Spring(name=f"{i}{j}", between=(f"b{i}", f"b{j}"), stiffness=10.0 + i, rest_length=0.7, viscosity=0.3)
        for i in range(4)
        for j in range(i)
    )
    return Scene(bodies=tuple(bodies), forces=tuple(springs))


# Slides -----------------------------------------------------------------------------------------------------------------


def _slide(name: str, between: tuple[str, str], lower: float, upper: float, psi: float) -> Prismatic:
    limit = Limit(lower=lower, upper=upper, compliance=0.0, restitution=psi)
    return Prismatic(name=name, between=between, axis=(1.0, 0.0, 0.0), compliance=0.0, limit=limit)


def rider(psi: float) -> Scene:
    """A slider comes back from its stop at 3 m/s; what rides on it may move by a millimetre there, from one end to the
    other, and comes along. No stop acts on both bodies at once, so each answer is one of its own."""
    light = {"shape": None, "inertia": (1.0, 1.0, 1.0)}
    bodies = (corpus.ball("carrier", 0.0, 3.0, **light), corpus.ball("rider", 0.0, 3.0, **light))
    guide = _slide("guide", (WORLD, "carrier"), -0.3, 0.1, 1.0)
    return Scene(bodies=bodies, constraints=(guide, _slide("seat", ("carrier", "rider"), 0.0, 1e-3, psi)))


def hammer(range_: float, psi: float) -> Scene:
    """A slider rests at one end of its way; a heavy ball pushes it to the other, which is nearer than what a step leads it.
    Only the end that was nearer as the step began had a row: the slider went .05 m beyond the other."""
    soft = Material()
    bodies = (
        corpus.ball("slider", 0.0, 0.0, material=soft),
        corpus.ball("hammer", 0.25, -3.0, 5.0, material=soft),
    )
    return Scene(bodies=bodies, constraints=(_slide("guide", (WORLD, "slider"), -range_, 0.0, psi),))


# Many -------------------------------------------------------------------------------------------------------------------


def pile_of(shape: Shape, count: int) -> Scene:
    """The spheres of the catalogue's pile, or what else is in their places."""
    floor, *rest = pile.scene(count).bodies
    return falling(floor, *(replace(body, shape=shape) for body in rest))  # type: ignore[arg-type, type-var]


def ring(compliance: float, count: int = 12) -> Scene:
    """A thrown ring of locked bodies of different mass: the last lock says what the others already said."""
    bodies, locks, spin = [], [], np.array([0.3, 0.2, 1.0])
    for i, angle in enumerate(2.0 * math.pi * np.arange(count) / count):
        place = 2.0 * np.array([math.cos(angle), math.sin(angle), 0.0])
        turn = (math.cos(0.5 * angle), 0.0, 0.0, math.sin(0.5 * angle))
        ways, moments = (np.cross(spin, place), spin), {"inertia": (0.1, 0.12, 0.15), "orientation": turn}
        bodies.append(corpus.solid(f"b{i}", None, place, 1.0 + 0.1 * i, *ways, **moments))
        locks.append(Lock(name=f"lock {i}", between=(f"b{i}", f"b{(i + 1) % count}"), compliance=compliance))
    return Scene(bodies=tuple(bodies), constraints=tuple(locks))
