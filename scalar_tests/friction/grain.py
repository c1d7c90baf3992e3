"""Does a box slide as friction that differs with the direction lets it?"""

from __future__ import annotations

import math

import numpy as np

from spook_tracker import engine

from .. import case
from ..bracket import break_point, unbroken
from ..closed_form import ask, error
from ..configurations import configured
from ..sweep import line, told

GRAVITY = 10.0  # m/s²
ALONG, ACROSS = 0.5, 0.2  # µ of the pair, along the grain and across it
GRAIN = math.radians(20.0)  # from x
MASS = 2.0  # kg
EDGE = (0.4, 0.4, 0.1)  # m
TIME_STEP = 1.0 / 60.0  # s
SLOPE = 0.6  # tan of the slope it drifts down
WAY = math.radians(70.0)  # downhill, from x
THROW = (3.0, 1.0)  # m/s, along the grain and across it
STANDS, SLIDES = 0.999, 1.01  # of the slope at which it begins to slide
WAYS = tuple(math.radians(15.0 * k + 5.0) for k in range(12))  # downhill, from x


def scene(tangent: float = 0.0, way: float = WAY, throw: tuple[float, float] = (0.0, 0.0)) -> engine.Scene:
    """A box on a grained board tilted down along `way`; `throw` is its velocity along the grain and across it."""
    c, s = math.cos(GRAIN), math.sin(GRAIN)
    board = engine.RigidBody(
        name="board",
        motion="static",
        shape=engine.Plane(),
        position=(0.0, 0.0, 0.0),
        material=engine.Material(
            friction=ALONG**2, friction_across=ACROSS**2, friction_direction=(c, s, 0.0)
        ),
    )
    box = engine.RigidBody(
        name="box",
        mass=MASS,
        shape=engine.Box(EDGE),
        position=(0.0, 0.0, 0.5 * EDGE[2]),
        velocity=(c * throw[0] - s * throw[1], s * throw[0] + c * throw[1], 0.0),
        material=engine.Material(friction=1.0),
    )
    x, y, z = gravity(tangent, way)
    return engine.Scene(bodies=(board, box), gravity=(x, y, z))


def gravity(tangent: float, way: float) -> tuple[float, float, float]:
    """In the axes of the board [m/s²]."""
    tilt = math.atan(tangent)
    down = GRAVITY * math.sin(tilt)
    return down * math.cos(way), down * math.sin(way), -GRAVITY * math.cos(tilt)


def grain_axes(x: float, y: float) -> tuple[float, float]:
    """A vector's parts along the grain and across it."""
    c, s = math.cos(GRAIN), math.sin(GRAIN)
    return c * x + s * y, c * y - s * x


def least_slope(way: float) -> float:
    """tan of the slope at which it begins to slide: downhill the ellipse reaches just so far."""
    along, across = grain_axes(math.cos(way), math.sin(way))
    return 1.0 / math.hypot(along / ALONG, across / ACROSS)


def slid(velocity: tuple[float, float], kick: float) -> tuple[float, float]:
    """v₊ = v − kick (µ_d² v₊_d, µ_a² v₊_a)/|(µ_d v₊_d, µ_a v₊_a)|, or 0: with λ that length, each part is
    v/(1 + kick µ²/λ), and one equation for λ is left, which falls."""
    parts = tuple(zip((ALONG, ACROSS), velocity, strict=True))
    if math.hypot(*(v / mu for mu, v in parts)) <= kick:
        return 0.0, 0.0
    low, high = 0.0, math.hypot(*(mu * v for mu, v in parts))
    for _ in range(100):
        middle = 0.5 * (low + high)
        above = sum((mu * v / (middle + kick * mu**2)) ** 2 for mu, v in parts) > 1.0
        low, high = (middle, high) if above else (low, middle)
    along, across = (v / (1.0 + kick * mu**2 / high) for mu, v in parts)
    return along, across


def drift(tangent: float, way: float) -> tuple[float, float]:
    """The acceleration from rest, along the grain and across it [m/s²]: constant, so the way is straight."""
    x, y, z = gravity(tangent, way)
    return slid(grain_axes(x, y), -z)


def stop() -> tuple[float, float]:
    """Where a box thrown on the level comes to rest, along the grain and across it [m].

    dv_d/dv_a = (µ_d/µ_a)² v_d/v_a, so with u = v_a/v_a(0) the other part is v_d = v_d(0) u^((µ_d/µ_a)²), and
    dt = −|(µ_d v_d, µ_a v_a)|/(µ_a² g u) du: two integrals over u, by Gauss and Legendre.
    """
    nodes, weights = np.polynomial.legendre.leggauss(60)
    u, weight = 0.5 * (nodes + 1.0), 0.5 * weights
    along, across = THROW[0] * u ** (ALONG / ACROSS) ** 2, THROW[1] * u
    time = weight * np.hypot(ALONG * along, ACROSS * across) / (ACROSS**2 * GRAVITY * u)
    return float(along @ time), float(across @ time)


def down_the_slope(simulate: case.Simulate) -> dict[str, float]:
    """One second from rest."""
    observe = {
        "v": engine.Trace(quantity=engine.Velocity("box")),
        "force": engine.Final(quantity=engine.ContactForce("box", "board")),
    }
    result = simulate(scene(SLOPE), time_step=TIME_STEP, duration=1.0, observe=observe)
    found = np.array([grain_axes(x, y) for x, y, _ in result["v"]])
    exact = np.outer(TIME_STEP * np.arange(len(found)), drift(SLOPE, WAY))
    angle = math.atan2(found[-1, 1], found[-1, 0]) - math.atan2(*reversed(drift(SLOPE, WAY)))
    along, across = grain_axes(float(result["force"][0]), float(result["force"][1]))
    return {
        "drift_error": angle,
        "speed_error": float(np.abs(found - exact).max()),
        "ellipse_error": math.hypot(along / ALONG, across / ACROSS) / float(result["force"][2]) - 1.0,
    }


def thrown(simulate: case.Simulate) -> dict[str, float]:
    """Thrown on the level until it rests."""
    observe = {
        "v": engine.Trace(quantity=engine.Velocity("box")),
        "energy": engine.Trace(quantity=engine.KineticEnergy()),
    }
    result = simulate(scene(throw=THROW), time_step=TIME_STEP, duration=1.5, observe=observe)
    found = np.array([grain_axes(x, y) for x, y, _ in result["v"]])
    exact = [THROW]
    while len(exact) < len(found):
        exact.append(slid(exact[-1], TIME_STEP * GRAVITY))
    return {
        "velocity_error": float(np.abs(found - np.array(exact)).max()),
        "energy_gain": float(np.diff(result["energy"]).max()),
    }


def begins(simulate: case.Simulate) -> dict[str, float]:
    """Half a second just below the slope at which it begins to slide, and just above, downhill all ways."""
    creep, late = 0.0, 0.0
    for way in WAYS:
        observe = {"v": engine.Final(quantity=engine.Velocity("box"))}
        stands = scene(STANDS * least_slope(way), way)
        slides = scene(SLIDES * least_slope(way), way)
        v = simulate(stands, time_step=TIME_STEP, duration=0.5, observe=observe)["v"]
        creep = max(creep, math.hypot(float(v[0]), float(v[1])))
        v = simulate(slides, time_step=TIME_STEP, duration=0.5, observe=observe)["v"]
        rate = drift(SLIDES * least_slope(way), way)
        along, across = grain_axes(float(v[0]), float(v[1]))
        late = max(late, math.hypot(along - 0.5 * rate[0], across - 0.5 * rate[1]))
    return {"creep": creep, "slide_error": late}


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Distance of the place of rest from the closed form [m]."""
    observe = {"x": engine.Final(quantity=engine.Position("box"))}
    result = simulate(scene(throw=THROW), time_step=time_step, duration=1.5, method=method, observe=observe)
    found = grain_axes(float(result["x"][0]), float(result["x"][1]))
    return math.dist(found, stop())


def stands(simulate: case.Simulate, tangent: float) -> bool:
    """Whether the box is at rest after half a second."""
    observe = {"v": engine.Final(quantity=engine.Velocity("box"))}
    result = simulate(scene(tangent), time_step=TIME_STEP, steps=30, observe=observe)
    return result.completed and float(np.abs(result["v"]).max()) < 1e-6


def steepest(simulate: case.Simulate) -> case.BreakPoint:
    """The steepest slope it stands on, from half the bound to twice it."""
    bound = least_slope(WAY)
    return break_point(lambda t: stands(simulate, t), 0.5 * bound, 2.0 * bound, resolution=1e-3)


def slows(simulate: case.Simulate, times: float) -> bool:
    """Whether ten steps take of a throw so many times as fast what they must, to a millionth of that."""
    fast = (times * THROW[0], times * THROW[1])
    observe = {"v": engine.Final(quantity=engine.Velocity("box"))}
    result = simulate(scene(throw=fast), time_step=TIME_STEP, steps=10, observe=observe)
    right = fast
    for _ in range(10):
        right = slid(right, TIME_STEP * GRAVITY)
    found = grain_axes(float(result["v"][0]), float(result["v"][1]))
    return result.completed and math.dist(found, right) < 1e-6 * math.dist(fast, right)


def draw_throw(simulate: case.Simulate) -> case.Drawing:
    """The velocity across the grain against that along it, until the box rests."""
    observe = {"v": engine.Trace(quantity=engine.Velocity("box"))}
    result = simulate(scene(throw=THROW), time_step=TIME_STEP, duration=1.5, observe=observe)
    found = np.array([grain_axes(x, y) for x, y, _ in result["v"]])
    u = np.linspace(0.0, 1.0, 60)
    power = (ALONG / ACROSS) ** 2
    share = np.clip(found[:, 1] / THROW[1], 0.0, 1.0)
    off = float(np.abs(found[:, 0] - THROW[0] * share**power).max())
    return case.Drawing(
        curves=(
            line("box", found[:, 0], found[:, 1], "points"),
            line("closed form", THROW[0] * u**power, THROW[1] * u, "reference"),
        ),
        x_label="speed along the grain [m/s]",
        y_label="speed across the grain [m/s]",
        note=f"It leaves the curve by at most {told(off)} m/s.",
    )


def draw_drift(simulate: case.Simulate) -> case.Drawing:
    """Which way the box slides from rest against where downhill is."""
    ways = [k * math.pi / 24 for k in range(1, 24)]
    observe = {"v": engine.Final(quantity=engine.Velocity("box"))}
    found, exact = [], []
    for way in ways:
        v = simulate(scene(SLOPE, way + GRAIN), time_step=TIME_STEP, steps=10, observe=observe)["v"]
        along, across = grain_axes(float(v[0]), float(v[1]))
        found.append(math.degrees(math.atan2(across, along)))
        along, across = drift(SLOPE, way + GRAIN)
        exact.append(math.degrees(math.atan2(across, along)))
    degrees = [math.degrees(way) for way in ways]
    most = max(abs(f - d) for f, d in zip(found, degrees, strict=True))
    return case.Drawing(
        curves=(line("box", degrees, found, "points"), line("closed form", degrees, exact, "reference")),
        x_label="downhill, from the grain [°]",
        y_label="way it slides, from the grain [°]",
        note=f"It slides up to {told(most, 3)}° beside the steepest way down, towards the direction across the grain.",
    )


ROUNDED = "the method's own solution, by one equation for λ a step; the solver stops at 1e-10 of the load"
OPEN = (
    "the solver stops at 1e-10 of the load: it leaves the direction of a slip v open by 1e-10 Λ/v, Λ = 0.16 m/s what a "
    "point's friction alone does to its slip in a step; friction times that is the error of a step, summed over 30 from rest"
)
THROWN = "as above, of up to 60 steps one after the other: what one leaves turns the next"

TEST = case.ScalarTest(
    title="Sliding on a grain",
    question="Does a box slide as friction that differs with the direction lets it?",
    why="Wood, boards with grooves, blades and tracks hold one way and let go the other. A law that takes each direction "
    "by itself, or acts against the slip, sends bodies the wrong way, or gains energy.",
    model="A box on a board with a grain 20° from x. It slides down a slope of tan θ = 0.6 from rest, is thrown askew on "
    "the level, and lies on slopes that are tilted all ways.",
    parameters=(
        ("time step", "1/60 s"),
        ("box", "0.4 × 0.4 × 0.1 m, 2 kg"),
        ("friction", "µ = 0.5 along the grain, 0.2 across it"),
        ("throw", "3 m/s along the grain, 1 m/s across it"),
        ("gravity", "10 m/s²"),
    ),
    theory=(
        "Friction f lies in (f_d/µ_d)² + (f_a/µ_a)² ≤ N²; while the box slides it is the one of these that dissipates most: "
        "f = −N (µ_d² v_d, µ_a² v_a)/√(µ_d² v_d² + µ_a² v_a²).",
        "It stands up to tan θ = 1/√((cos(φ)/µ_d)² + (sin(φ)/µ_a)²), downhill at φ from the grain.",
        "From rest the way is straight: v = a t with a = g_t + f(a)/m, in every step of the method, too.",
        "On the level v_d ∝ v_a^((µ_d/µ_a)²): the box turns towards the direction of lower friction and stops in it.",
        "f · v ≤ 0 always: energy is only lost.",
    ),
    reference="Closed forms with one root, and two integrals.",
    conclusion="Green: the force is on the ellipse, normal to it along the slip. Red: it acts against the slip (the box "
    "drifts too little), each direction has its own bound (it stands too long between them), or the grain is turned.",
    source="ours; Goyal, Ruina, Papadopoulos, Planar sliding with dry friction, 1991 (the law)",
    measurements=(
        ask(
            down_the_slope,
            (
                error(
                    "drift_error",
                    "direction of the slide after 1 s, less its closed form",
                    "rad",
                    1e-9,
                    ROUNDED,
                ),
                error(
                    "speed_error", "largest difference of a part of the velocity to a t", "m/s", 1e-9, ROUNDED
                ),
                error(
                    "ellipse_error",
                    "|(f_d/µ_d, f_a/µ_a)| over the normal force, minus one",
                    "1",
                    1e-9,
                    ROUNDED,
                    "companion",
                ),
            ),
            "down a slope, from rest",
            TIME_STEP,
        ),
        ask(
            thrown,
            (
                error(
                    "velocity_error", "largest difference to the method's own solution", "m/s", 1e-8, THROWN
                ),
                error(
                    "energy_gain",
                    "largest rise of the kinetic energy in a step",
                    "J",
                    1e-12,
                    "friction only takes; rounding of 10 J",
                    "companion",
                ),
            ),
            "thrown askew on the level",
            TIME_STEP,
            "thrown",
        ),
        ask(
            begins,
            (
                error(
                    "creep",
                    "largest speed where 0.999 of the bound is asked, twelve ways",
                    "m/s",
                    1e-9,
                    ROUNDED,
                ),
                error(
                    "slide_error",
                    "largest difference to a t where 1.01 of it is asked",
                    "m/s",
                    2e-8,
                    OPEN,
                ),
            ),
            "just below and above where it begins to slide, 0.5 s",
            TIME_STEP,
            "beginning",
        ),
    ),
    example=lambda: case.Example(scene=scene(throw=THROW), time_step=TIME_STEP, duration=1.5),
    stability=(
        case.StabilityStudy(
            name="slope",
            title="Steepest slope the box stands on, 50° from the grain",
            configuration="plain",
            definition="after half a second it is at rest",
            study=steepest,
            unit="1",
            expected=(0.998 * least_slope(WAY), least_slope(WAY)),
            expected_source="where the ellipse ends, to the resolution of the search",
        ),
        unbroken(
            slows,
            1.0,
            1e6,
            name="fastest",
            title="How many times as fast the box may be thrown",
            definition="what ten steps take of its velocity is the method's own solution to a millionth",
            source="friction knows the slip's direction only; rounding of a speed leaves 1e-9 of what ten steps take",
            unit="1",
            configuration="thrown",
            walk=4,
        ),
    ),
    figures=(
        case.Figure(name="throw", title="Speed across the grain against speed along it", draw=draw_throw),
        case.Figure(name="drift", title="Way it slides against the way down", draw=draw_drift),
    ),
    ladders=(
        case.Ladder(
            name="rest",
            description="place of rest of the thrown box, against two integrals",
            unit="m",
            time_steps=tuple(1.0 / n for n in (20, 40, 80, 160, 320)),
            configurations=configured({"direct": 1.0, "iterative": 1.0}),
            error=ladder_error,
            target_error=0.01,
            target_seconds=0.01,
        ),
    ),
)
