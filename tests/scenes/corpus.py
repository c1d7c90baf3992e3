"""The corpus that tests/engine/test_laws.py puts to every method: scenes that fly, collide, lie and swing.

A scene with a seed is one of many; what each was once wrong about is said beside its row there.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from spook_tracker.engine import (
    WORLD,
    Ball,
    Box,
    Capsule,
    Cone,
    ConvexHull,
    Cylinder,
    Cylindrical,
    Distance,
    Hinge,
    Limit,
    Lock,
    Material,
    Particle,
    Planar,
    Plane,
    PointOnLine,
    Prismatic,
    RigidBody,
    Scene,
    Shape,
    Sphere,
    Universal,
)

GRAVITY = 9.81  # m/s²
DOWN = (0.0, 0.0, -GRAVITY)
ELASTIC = Material(restitution=1.0)
ROUGH = Material(friction=0.5)
WEDGE = ConvexHull.placed(((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0.8, 0.8, 0.8))).shape
LARGE = (Sphere(0.5), Box((1.0, 0.6, 0.8)), Capsule(0.3, 0.8), Cylinder(0.4, 0.9), Cone(0.5, 0.9), WEDGE)


def turned(rng: np.random.Generator) -> tuple[float, ...]:
    turn = rng.normal(size=4)
    return tuple(turn / np.linalg.norm(turn))


def solid(
    name: str, shape: Shape | None, place: Iterable[float], mass: float | None = 1.0,
    velocity: Iterable[float] = (0.0, 0.0, 0.0), spin: Iterable[float] = (0.0, 0.0, 0.0), **more: Any,
) -> RigidBody:  # fmt: skip
    ways = {"velocity": tuple(velocity), "angular_velocity": tuple(spin)}
    return RigidBody(name=name, shape=shape, position=tuple(place), mass=mass, **ways, **more)


def fixed(name: str, shape: Shape, place: Iterable[float] = (0.0, 0.0, 0.0), **more: Any) -> RigidBody:
    return solid(name, shape, place, None, motion="static", **more)


def floor(material: Material) -> RigidBody:
    return fixed("floor", Plane(), material=material)


def thrown(rng: np.random.Generator, speed: float) -> dict[str, Any]:
    """Turned, flying and spinning at random."""
    return {
        "orientation": turned(rng),
        "velocity": speed * rng.normal(size=3),
        "spin": speed * rng.normal(size=3),
    }


def ball(name: str, x: float, speed: float, mass: float = 1.0, **more: Any) -> RigidBody:
    """On a line, of .1 m."""
    given = {"shape": Sphere(0.1), "place": (x, 0.0, 0.0), "material": ELASTIC}
    return solid(name, mass=mass, velocity=(speed, 0.0, 0.0), **(given | more))


# What floats: nothing outside, so that both momenta stay --------------------------------------------------------------


def rack(psi: float) -> Scene:
    """Balls and boxes that a ball of 9 m/s breaks up."""
    rng = np.random.default_rng(3)
    rough = Material(restitution=psi, friction=0.3)
    bodies = [ball("cue", -2.0, 9.0, place=(-2.0, 0.03, 0.0), material=Material(restitution=psi))]
    for i in range(10):
        place = (0.4 * (i % 4), 0.4 * (i // 4) - 0.4, float(rng.uniform(-0.05, 0.05)))
        shape = Sphere(0.15) if i % 2 else Box((0.25, 0.2, 0.3))
        bodies.append(solid(f"b{i}", shape, place, 1.0 + 0.2 * i, material=rough))
    return Scene(bodies=tuple(bodies))


def collision(seed: int) -> Scene:
    """Eight of six decades of mass thrown at each other: Newton's law alone raises the energy of some of these."""
    rng = np.random.default_rng(seed)
    shapes = (Box((0.5, 0.3, 0.4)), Sphere(0.25), Capsule(0.1, 0.5), Box((0.2, 0.2, 0.9)))
    bodies = []
    for k in range(8):
        corner = np.array((k % 2, k // 2 % 2, k // 4))
        rough = Material(friction=float(rng.uniform(0, 2)), restitution=float(rng.uniform(0, 1)))
        mass, ways = float(10 ** rng.uniform(-3, 3)), thrown(rng, 1.0)
        ways["velocity"] = ways["velocity"] - 3.0 * corner
        bodies.append(solid(f"b{k}", shapes[k % 4], 1.1 * corner, mass, material=rough, **ways))
    return Scene(bodies=tuple(bodies))


def joined(kind: type, rng: np.random.Generator, bodies: tuple[RigidBody, ...]) -> Iterable[Any]:
    """Each body to the next; a body and the one after the next are free to meet."""
    for first, second in itertools.pairwise(bodies):
        between, name = (first.name, second.name), f"{first.name} to {second.name}"
        point, axis = tuple(0.3 * rng.normal(size=3)), rng.normal(size=3)
        if kind is Distance:
            yield Distance(name=name, between=between, anchors=(point, tuple(0.3 * rng.normal(size=3))))
        else:
            turning = {"axis": tuple(axis / np.linalg.norm(axis))} if kind in (Hinge, Prismatic) else {}
            yield kind(name=name, between=between, at=point, **turning)


def overlapping(kind: type | None, seed: int, speed: float = 1.0) -> Scene:
    """Two or three of random shapes inside each other, which joints of a kind may tie."""
    rng, place, made = np.random.default_rng(seed), np.zeros(3), []
    for k in range(2 + seed % 2 if kind is None else 3):
        shape, mass = LARGE[rng.integers(len(LARGE))], rng.uniform(0.5, 2.0)
        made.append(solid(f"body {k}", shape, place, mass, **thrown(rng, speed)))
        place = place + 0.25 * rng.normal(size=3)
    bodies = tuple(made)
    return Scene(bodies=bodies, constraints=() if kind is None else tuple(joined(kind, rng, bodies)))


def unequal_row(seed: int) -> Scene:
    """Eight balls of .01 to 100 kg on a line, two of which come at the others: hundreds of impacts in a step."""
    masses = 10.0 ** np.random.default_rng(seed).uniform(-2.0, 2.0, 8)
    places = (0.0, 0.2, 0.6, 0.8, 1.0, 1.2, 1.4, 1.6)
    return Scene(
        bodies=tuple(ball(f"ball {k}", x, 12.43932973 * (k < 2), masses[k]) for k, x in enumerate(places))
    )


def near_row(count: int) -> Scene:
    """A plastic impact of 30 m/s that goes through all of them in one step."""
    row = (ball(f"b{k}", 0.201 * k, 30.0 * (k == 0), material=Material()) for k in range(count))
    return Scene(bodies=tuple(row))


def all_joints() -> Scene:
    """Six bodies on every kind of joint, some of them compliant."""
    rng = np.random.default_rng(5)
    bodies = tuple(
        solid(f"b{i}", None, (float(i), 0.1 * i * i, 0.0), 1.0 + i, rng.standard_normal(3), rng.standard_normal(3),
             inertia=(0.1 + 0.02 * i, 0.12, 0.15)) for i in range(6)
    )  # fmt: skip
    ends = [(f"b{i}", f"b{i + 1}") for i in range(5)]
    points = [(i + 0.5, 0.1 * i * i, 0.0) for i in range(5)]
    rod = Distance(
        name="rod", between=("b0", "b5"), anchors=((0.1, 0.0, 0.2), (0.0, 0.3, 0.0)), compliance=1e-2
    )
    joints = (
        Lock(name="lock", between=ends[0], at=points[0], compliance=1e-3),
        Ball(name="ball", between=ends[1], at=points[1], compliance=1e-4),
        Hinge(name="hinge", between=ends[2], at=points[2], axis=(0.0, 0.6, 0.8)),
        Prismatic(name="rail", between=ends[3], at=points[3], axis=(0.8, 0.0, 0.6)),
        Universal(name="cross", between=ends[4], at=points[4]),
        rod,
    )
    return Scene(bodies=bodies, constraints=joints)


def strings(kind: str) -> Scene:
    """Particles on taut rows: in a row, in a ring, and three rows from one."""
    rng = np.random.default_rng(5)
    count = 2 if kind == "pair" else 6
    angle = 2.0 * math.pi * np.arange(count) / count
    places = {
        "ring": np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1),
        "star": np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (-1, 0, 0), (0, -1, 0)], float),
    }.get(kind, np.outer(np.arange(count), (1.0, 0.0, 0.0)))
    mass = 1.0 + np.arange(count) % 3
    speeds = np.cross((0.1, 0.2, 0.6), places) + rng.normal(scale=0.3, size=(count, 3))
    speeds -= mass @ speeds / mass.sum()  # it stays where it is, so that no long way costs digits
    links = [(0, k) if kind == "star" else (k - 1, k) for k in range(1, count)]
    links += [(count - 1, 0)] if kind == "ring" else []
    rows = tuple(Distance(name=f"{a} to {b}", between=(f"{a}", f"{b}")) for a, b in links)
    bodies = (
        Particle(name=f"{k}", mass=mass[k], position=tuple(places[k]), velocity=tuple(speeds[k]))
        for k in range(count)
    )
    return Scene(bodies=tuple(bodies), constraints=rows)


def links(heavy: float) -> Scene:
    """Five on ball joints; with heavy ends the line through both has a part in 1e11 of the inertia across."""
    bodies = []
    for k in range(5):
        still = k in (0, 4) and heavy > 1.0
        swings = (0.0, 0.3 * math.sin(k), 0.2 * math.cos(2 * k)), (0.0, -0.2, 0.3 * (k - 2))
        velocity, spin = ((0.0,) * 3, (0.0,) * 3) if still else swings
        place, mass = (k + 0.5, 0.0, 0.0), heavy if still else 1.0
        bodies.append(solid(f"link {k}", None, place, mass, velocity, spin, inertia=(0.01, 1 / 12, 1 / 12)))
    balls = (
        Ball(name=f"b{k}", between=(f"link {k}", f"link {k + 1}"), at=(k + 1.0, 0.0, 0.0)) for k in range(4)
    )
    return Scene(bodies=tuple(bodies), constraints=tuple(balls), contacts=False)


def square() -> Scene:
    """Four on a loop with a diagonal, spinning: rows that branch and close."""
    corners = {"a": (1.0, 0.0), "b": (0.0, 1.0), "c": (-1.0, 0.0), "d": (0.0, -1.0)}
    bodies = (
        Particle(name=name, mass=1.0, position=(x, y, 0.0), velocity=(-2 * y, 2 * x, 0.5))
        for name, (x, y) in corners.items()
    )
    rows = (Distance(name=p + q, between=(p, q)) for p, q in ("ab", "bc", "cd", "da", "ac"))
    return Scene(bodies=tuple(bodies), constraints=tuple(rows))


def crossed() -> Scene:
    """Two rods on a universal joint."""
    inertia = (1 / 12, 1 / 12, 1 / 12)
    first = solid("upper", None, (0.5, 0.0, 0.0), spin=(0.4, 1.0, -0.7), inertia=inertia)
    second = solid("lower", None, (1.5, 0.0, 0.0), inertia=inertia)
    axes = {"axis": (0.0, 1.0, 0.0), "cross_axis": (0.0, 0.0, 1.0)}
    cross = Universal(name="cross", between=("upper", "lower"), at=(1.0, 0.0, 0.0), **axes)  # type: ignore[arg-type]
    return Scene(bodies=(first, second), constraints=(cross,))


def locked(floor_there: bool = False) -> Scene:
    """Three boxes locked in a row that turn at 20 rad/s; far from a floor with a ball on it."""
    spin, inertia = (0.0, 0.0, 20.0), (1 / 6, 1 / 6, 1 / 6)
    bodies = [
        solid(f"box {i}", None, (i - 1.0, 0.0, 0.0), 1.0, (0.0, 20.0 * (i - 1.0), 0.0), spin, inertia=inertia)
        for i in range(3)
    ]
    locks = (
        Lock(name=f"lock {i}", between=(f"box {i}", f"box {i + 1}"), at=(i - 0.5, 0.0, 0.0)) for i in range(2)
    )
    if floor_there:
        bodies += [fixed("floor", Plane(), (0.0, 0.0, -9.0)), solid("ball", Sphere(0.1), (0.0, 9.0, -8.9))]
    return Scene(bodies=tuple(bodies), constraints=tuple(locks))


def slide_in_a_slot() -> Scene:
    """One that goes to and fro between the stops of another."""
    turns = {"inertia": (0.1, 0.1, 0.1), "shape": None}
    light, heavy = ball("light", 0.0, 3.0, **turns), ball("heavy", 0.0, 0.0, 5.0, **turns)
    stops = Limit(lower=-0.004, upper=0.004, restitution=1.0)
    guide = Prismatic(name="guide", between=("heavy", "light"), axis=(1.0, 0.0, 0.0), limit=stops)
    return Scene(bodies=(light, heavy), constraints=(guide,))


def endless(seed: int) -> Scene:
    """A light slider between its elastic stop and heavy balls that come on: over a hundred impacts in a step."""
    rng = np.random.default_rng(seed)
    bodies, place = [ball("slider", 0.0, -1.0, 10.0 ** rng.uniform(-3.0, -1.0))], 0.2
    for k in range(2 + seed % 2):
        place += 10.0 ** rng.uniform(-6.0, -3.0)
        bodies.append(ball(f"b{k}", place, -rng.uniform(1.0, 4.0), 10.0 ** rng.uniform(1.0, 3.0)))
        place += 0.2
    return Scene(bodies=tuple(bodies), constraints=(_stop(10.0 ** rng.uniform(-6.0, -2.0), 9.0),))


def between_ends(range_: float) -> Scene:
    """An elastic slider that has come from one end to the other, and past it, long before a step is over."""
    return Scene(bodies=(ball("slider", 0.0, 3.0),), constraints=(_stop(range_, 0.0),))


def _stop(below: float, above: float) -> Prismatic:
    limit = Limit(lower=-below, upper=above, compliance=0.0, restitution=1.0)
    return Prismatic(
        name="guide", between=(WORLD, "slider"), axis=(1.0, 0.0, 0.0), compliance=0.0, limit=limit
    )


def beyond(kind: Any, lower: float, upper: float, speed: float) -> Scene:
    """Two bars, one hung to the other off its centre, that fly and spin about a joint which begins beyond its stop."""
    spin = (0.0, speed if kind is Hinge else 0.0, 0.0)
    bars = (
        solid(name, Box((0.1, 0.2, 1.0)), (0.0, 0.0, 0.0), mass, (0.3 * speed, 0.0, 0.0), spin)
        for name, mass in (("first", 2.0), ("second", 1.0))
    )
    ends = {"between": ("first", "second"), "at": (0.0, 0.0, 0.4), "axis": (0.0, 1.0, 0.0)}
    return Scene(
        bodies=tuple(bars), constraints=(kind(name="joint", limit=Limit(lower=lower, upper=upper), **ends),)
    )


def soft_pair(compliance: float, depth: float) -> Scene:
    """Balls of compliant contacts that overlap and approach."""
    soft = {"shape": Sphere(0.5), "material": Material(compliance=compliance)}
    return Scene(
        bodies=(ball("left", 0.0, 1.0, **soft), ball("right", 0.0, -1.0, place=(1 - depth, 0.1, 0), **soft))
    )


# What falls, leans and lies: energy only falls -------------------------------------------------------------------------


def heap(count: int) -> Scene:
    """Mixed shapes slightly out of line, some tied in pairs."""
    rough = Material(friction=0.4, restitution=0.2)
    shapes = (Sphere(0.4), Box((0.7, 0.6, 0.5)), Capsule(0.2, 0.5))
    side, bodies = math.ceil(count ** (1 / 3)), [floor(rough)]
    for k in range(count):
        i, j, level = k % side, k // side % side, k // side**2
        place = (i + 0.05 * math.sin(7.0 * k), j + 0.05 * math.cos(11.0 * k), 0.6 + 1.1 * level)
        bodies.append(solid(f"b{k}", shapes[k % 3], place, material=rough))
    ties = (
        Distance(name=f"tie{k}", between=(f"b{k}", f"b{k + 1}"), compliance=1e-6)
        for k in range(0, count - 1, 10)
    )
    return Scene(bodies=tuple(bodies), constraints=tuple(ties), gravity=DOWN)


def block(shape: Shape) -> Scene:
    """A thousand of a metre."""
    bodies = [floor(ROUGH)]
    for k in range(1000):
        layer = 1.05 * (k % 10) + 0.01 * math.sin(k), 1.05 * (k // 10 % 10) + 0.01 * math.cos(3 * k)
        place = (*layer, 0.55 + 1.05 * (k // 100))
        bodies.append(solid(f"b{k}", shape, place, material=ROUGH))
    return Scene(bodies=tuple(bodies), gravity=DOWN)


def stack(count: int) -> Scene:
    """Boxes of a metre and a kilogram, one upon the other."""
    boxes = (solid(f"box {k}", Box((1, 1, 1)), (0, 0, 0.5 + k), material=ROUGH) for k in range(count))
    return Scene(bodies=(floor(ROUGH), *boxes), gravity=DOWN)


def tumbler(seed: int) -> Scene:
    """One of 1e-6 to 1e9 kg whose corners and rims swing in within a step."""
    rng = np.random.default_rng(seed)
    shape = (Box((0.4, 0.3, 0.5)), Cylinder(0.2, 0.5), Cone(0.3, 0.5))[seed % 3]
    turn, mass, spin = turned(rng), float(10.0 ** rng.uniform(-6, 9)), rng.normal(size=3)
    tumbling = solid("body", shape, (0.0, 0.0, 0.6), mass, spin=spin, orientation=turn, material=ROUGH)
    return Scene(bodies=(floor(ROUGH), tumbling), gravity=DOWN)


def rubber(seed: int) -> Scene:
    """Five of every kind, elastic both ways and rough, thrown at a floor and each other."""
    rng = np.random.default_rng(seed)
    shapes = (Sphere(0.2), Box((0.3, 0.4, 0.5)), Capsule(0.1, 0.4), Cylinder(0.15, 0.4))
    below = Material(friction=1.0, restitution=float(rng.uniform(0.5, 1.0)), tangential_restitution=0.5)
    bodies = [floor(below)]
    for k in range(5):
        material = Material(
            friction=float(rng.choice((0.3, 1.0, 3.0))), restitution=float(rng.uniform(0.5, 1.0)),
            tangential_restitution=float(rng.uniform(0.0, 1.0)),
        )  # fmt: skip
        shape, place = shapes[rng.integers(4)], (0.7 * (k % 2), 0.1 * k, 0.5 + 0.7 * (k // 2))
        ways = thrown(rng, 2.5) | {"velocity": rng.uniform((-2, -2, -3), (2, 2, 0))}
        bodies.append(solid(f"b{k}", shape, place, float(rng.uniform(0.5, 2.0)), material=material, **ways))
    return Scene(bodies=tuple(bodies), gravity=DOWN)


def grained(seed: int) -> Scene:
    """Twelve on a floor whose friction differs with the direction."""
    rng = np.random.default_rng(seed)
    along = {"friction_across": 0.01, "friction_direction": (math.cos(0.7), math.sin(0.7), 0.0)}
    bodies = [floor(Material(friction=0.81, **along))]  # type: ignore[arg-type]
    for k, (x, y, z) in enumerate(itertools.product(range(2), range(2), range(3))):
        place = np.array([0.45 * x, 0.45 * y, 0.25 + 0.45 * z]) + rng.uniform(-0.03, 0.03, 3)
        shape, way = Box((0.4, 0.3, 0.35)) if k % 2 else Sphere(0.2), rng.uniform(-1, 1, 3)
        bodies.append(solid(f"b{k}", shape, place, 1.0, way, material=Material(friction=1.0)))
    return Scene(bodies=tuple(bodies), gravity=DOWN)


def spun() -> Scene:
    """A box set sliding and spinning."""
    rough = Material(friction=0.4)
    box = solid("box", Box((1, 1, 0.5)), (0, 0, 0.25), 1.0, (2, 1, 0), (0, 0, 6), material=rough)
    return Scene(bodies=(floor(rough), box), gravity=DOWN)


RESTING = (  # mass, place, turn, velocity, angular velocity of three boxes that come to rest
    (0.678538, (-0.094110, -0.008731, 0.164636), (0.975045, -0.003666, 0.011193, 0.221696),
     (-0.124477, -0.055250, -0.013965), (0.194716, -0.023325, 1.520483)),
    (0.118079, (-0.035581, 0.136023, 0.611824), (0.666776, -0.212858, 0.682966, 0.208944),
     (-0.594638, 0.312906, 0.014564), (0.212104, -0.009103, 2.393555)),
    (6.354507, (-0.231810, 0.487989, 0.136810), (0.585422, -0.426923, -0.535576, -0.433793),
     (-0.694551, -0.458203, -0.479285), (0.814533, -3.160628, -2.189938)),
)  # fmt: skip


def tents(seed: int) -> Scene:
    """A face on a mesh's edges, places that differ by 1e-5 m: most ways to share its load push and pull."""
    from bench.campaign import TENTS

    rng = np.random.default_rng(seed)
    bodies = [fixed("ground", TENTS, (-3.0, -3.0, -0.1))]
    for k, (mass, place, turn, velocity, spin) in enumerate(RESTING):
        at = np.array(place) + 1e-5 * rng.normal(size=3)
        bodies.append(solid(f"b{k}", Box((0.4, 0.3, 0.5)), at, mass, velocity, spin, orientation=turn))
    return Scene(bodies=tuple(bodies), gravity=DOWN)


def long_cone() -> Scene:
    """Dropped across the edges of a block."""
    lying = (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)
    cone = solid("cone", Cone(1, 10), (0, 0, 1.51), orientation=lying, material=ROUGH)
    return Scene(bodies=(fixed("block", Box((2, 2, 1))), cone), gravity=DOWN)


def gas(seed: int, across: int) -> Scene:
    """Elastic balls of .1 to 10 kg between walls 2 m apart, in `across` + 1 directions."""
    rng, radius, half, thick = np.random.default_rng(seed), 0.2, 1.0, 1.0
    bodies = []
    for axis, side in itertools.product(range(3), (-1.0, 1.0)):
        place, size = [0.0, 0.0, half], [2 * half + 4 * thick] * 3
        place[axis] += side * (half + 0.5 * thick)
        size[axis] = thick
        bodies.append(fixed(f"wall {axis} {side:+.0f}", Box(tuple(size)), place, material=ELASTIC))  # type: ignore[arg-type]
    free, middle = np.array((across > 0, across > 1, True)), (0.0, 0.0, half)
    while len(bodies) < 6 + (3, 6, 8)[across]:
        at = np.where(free, rng.uniform(1.05 * radius - half, half - 1.05 * radius, 3), 0.0) + np.array(
            middle
        )
        if all(np.linalg.norm(at - np.array(other.position)) > 2.05 * radius for other in bodies[6:]):
            velocity, mass = (
                np.where(free, rng.normal(size=3) * 3.0, 0.0),
                float(10.0 ** rng.uniform(-1.0, 1.0)),
            )
            bodies.append(solid(f"ball {len(bodies)}", Sphere(radius), at, mass, velocity, material=ELASTIC))
    return Scene(bodies=tuple(bodies), gravity=DOWN)


def weak_chain(masses: tuple[float, ...], depth: float | None) -> Scene:
    """Links in a row, each turning at its own rate, over a floor at `depth` if there is one; light ones carry heavy ones."""
    place, speed, bodies, joints = np.zeros(3), np.zeros(3), [], []
    for k, (mass, rate) in enumerate(zip(masses, (3.0, -2.0, 2.0, -1.0), strict=False)):
        half, spin = np.array((0.25, 0.0, 0.0)), np.array((0.0, rate, 0.0))
        bodies.append(
            solid(f"link {k}", Box((0.4, 0.1, 0.1)), place + half, mass, speed + np.cross(spin, half), spin)
        )
        ends = (f"link {k - 1}" if k else WORLD, f"link {k}")
        joints.append(
            Hinge(name=f"hinge {k}", between=ends, at=tuple(place), axis=(0.0, 1.0, 0.0), compliance=0.0)
        )
        place, speed = place + 2.0 * half, speed + np.cross(spin, 2.0 * half)
    below = [] if depth is None else [fixed("floor", Plane(), (0.0, 0.0, -depth))]
    return Scene(bodies=(*bodies, *below), constraints=tuple(joints), gravity=DOWN)


# What swings and turns: energy stays ------------------------------------------------------------------------------------


def rods(count: int = 2) -> Scene:
    """Of 1 kg and 1 m, straight out, on hinges across the swing."""
    bodies = (solid(f"rod {i}", None, (0.5 + i, 0.0, 0.0), inertia=(1 / 12,) * 3) for i in range(count))
    hinges = (
        Hinge(name=f"hinge {i}", between=(f"rod {i - 1}" if i else WORLD, f"rod {i}"), at=(float(i), 0.0, 0.0),
              axis=(0.0, 1.0, 0.0), compliance=0.0) for i in range(count)
    )  # fmt: skip
    return Scene(bodies=tuple(bodies), constraints=tuple(hinges), gravity=DOWN)


def freer(kind: Any) -> Scene:
    """A spinning body with three different moments on a joint at its side that holds less."""
    ways = {
        Planar: ((0.2, 0.1, 0.0), (0.0, 0.0, 1.0)), Cylindrical: ((0.0, 0.0, 0.3), (0.0, 0.0, 1.0)),
        PointOnLine: ((0.0, 0.0, 0.3), (0.4, -0.2, 1.0)),
    }  # fmt: skip
    place = (0.3, 0.1, 0.0)
    free = solid("body", None, place, 2.0, *ways[kind], inertia=(1.0, 1.5, 2.0))
    joint = kind(name="joint", between=(WORLD, "body"), at=place, axis=(0.0, 0.0, 1.0), compliance=0.0)
    return Scene(bodies=(free,), constraints=(joint,))
